"""Preparation of a part: edges, mill, tabs and heights, and the motion of an order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from leafcut.errors import OptionError, PlanError, count_of
from leafcut.gcode.dialects import dialect
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.part import Hole
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.problem import RoutingProblem
from leafcut.options import MillingOptions
from leafcut.processes.job import Job, check_dialect_options, check_tool_changes, library_of, plane_point
from leafcut.processes.milling.mill import MillingData, assumed_number, library_mill_for, milling_data
from leafcut.processes.part.model import Edge, PartHole, PartRequest, TabRules
from leafcut.processes.part.options import PartOptions
from leafcut.processes.part.plan.holes import HoleGroup, fitting_drill, hole_groups
from leafcut.processes.part.plan.motion import PartHeights, part_motion
from leafcut.processes.part.plan.outlines import OutlineCut, edges_of, missing_paths, plan_cuts
from leafcut.processes.plan import Plan
from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones
from leafcut.timing.toolpath import measure_toolpath
from leafcut.timing.travel import travel_metric

if TYPE_CHECKING:
    from leafcut.model.tool import Tool, ToolLibrary
    from leafcut.read.format import Source


#: Largest distance of a point of a drilled hole from its circle, in diameters.
_ROUND = 0.005


@dataclass(frozen=True, eq=False)
class PartWork:
    """The cuts of a part and its drilled holes.

    `nodes` has the cut and the start point (distance along its path, mm) of each choice of the mill.
    """

    cuts: tuple[OutlineCut, ...]
    groups: tuple[HoleGroup, ...]
    nodes: tuple[tuple[int, float], ...]
    data: MillingData
    heights: PartHeights
    climb: bool


def plan_part(job: Job, source: Source) -> Plan:
    """Return the plan of a part.

    Raises ReadError, OptionError or PlanError if the drawing, the tool or the tabs do not suit.
    """
    from leafcut.processes.contours import check_thickness, prepare_sheet, without_excluded_holes
    from leafcut.processes.placing import place_part
    from leafcut.read import read_contours

    settings, milling = job.settings, job.settings.of(MillingOptions)
    asked, thickness = settings.job, settings.job.thickness
    if thickness is None:
        raise OptionError("a part needs the thickness of its plate; give --thickness")
    if settings.sheet.open_paths in ("cut", "mark"):
        raise OptionError(
            "--open-paths {}: leafcut part mills closed outlines only; close the paths, or use --open-paths drop",
            settings.sheet.open_paths,
        )
    part = read_contours(source, settings.read, job.start_step(Message("reading")))
    part = replace(part, issues=(*part.issues, *check_thickness(part, thickness)))
    part = place_part(part, settings.read)
    sheet = prepare_sheet(part, settings.sheet, settings.read.concentric)
    sheet = without_excluded_holes(sheet, settings.read)
    bottom = -thickness - asked.break_through
    library = library_of(settings, job.machine)
    mill, diameter = _mill(job, library, -bottom)
    data, issues = milling_data(milling, asked, diameter, job.machine, mill)
    tabs = _tab_rules(settings.of(PartOptions), thickness)
    all_edges, left = edges_of(sheet.contours)
    edges, drilled, other = _split_holes(all_edges, library, asked.diameter_tolerance, -bottom)
    groups, deep = hole_groups(drilled, bottom, asked.retract_height, asked.retract == "initial", job.machine)
    climb = milling.milling == "climb"
    area = None if sheet.outline is None else _sheet_area(sheet.outline, sheet.holes)
    cuts, more = plan_cuts(edges, 0.5 * diameter, climb, tabs, area)
    if not cuts:
        raise OptionError("{}: no edge is wider than the mill of {:g} mm; use a smaller mill", part.name, diameter)
    words_of = dialect(settings.post.dialect or job.machine.controller)
    job = job.for_dialect(words_of)
    check_dialect_options(settings, words_of)
    check_tool_changes(job.machine, words_of)
    refuse_higher_zones(asked.keep_out, asked.clearance_height)
    retract = asked.clearance_height if asked.retract == "initial" else asked.retract_height
    high = crossing_heights(asked.keep_out, asked.clearance_height) > retract
    start, end = plane_point(asked.start_point), plane_point(asked.end_point)
    heights = PartHeights(
        clearance=asked.clearance_height,
        retract=retract,
        tab_top=tabs.height - thickness,
        bottom=bottom,
        step=asked.step_down or 0.5 * diameter,
        zones=parse_zones(asked.keep_out)[high],
        end=end,
    )
    nodes = tuple((k, s) for k, cut in enumerate(cuts) for s in cut.starts)
    work = PartWork(tuple(cuts), tuple(groups), nodes, data, heights, climb)
    return Plan(
        job=job,
        part=replace(
            part, holes=tuple(Hole(x, y, group.tool.diameter) for group in groups for x, y in group.places.tolist())
        ),
        dialect=words_of,
        work=work,
        spec=PartRequest(
            tuple(edges),
            tuple(PartHole(x, y, tool.number, bottom - tool.point_length) for x, y, tool in drilled),
            data.tool.number,
            0.5 * diameter,
            thickness,
            bottom,
            tabs,
            area,
        ),
        stages=_stages(job, part.name, work, edges, start, end),
        kind="part",
        tools=(*(group.tool for group in groups), data.tool),
        box=part.extents,
        start=start,
        issues=[*sheet.issues, *left, *other, *more, *deep, *assumed_number(milling, mill, data.tool), *issues],
    )


def part_candidate(plan: Plan, order: Order) -> Candidate:
    """Generate and time the motion of an order."""
    work: PartWork = plan.work
    *drilled, milled = order.choices
    chosen = [work.nodes[node] for node in milled.tolist()]
    path = part_motion(
        [replace(group, places=group.places[nodes]) for group, nodes in zip(work.groups, drilled, strict=True)],
        [(work.cuts[cut], start) for cut, start in chosen],
        work.heights,
        work.data,
        plan.job.machine,
        climb=work.climb,
        coolant=plan.job.settings.post.coolant,
        pause=plan.dialect.hand_change_pause and not plan.job.machine.tool_changer,
    )
    return Candidate(order, path, measure_toolpath(path, plan.job.machine, start=plan.start))


def _stages(
    job: Job, name: str, work: PartWork, edges: Sequence[Edge], start: Point | None, end: Point | None
) -> tuple[Stage, ...]:
    """Return a stage for each drill, and a last stage for the mill."""
    metric = travel_metric(job.machine, job.settings.solve.objective)
    stages = []
    for number, group in enumerate(work.groups):
        title = f"{name}: {group.tool.label}"
        problem = RoutingProblem.of_points(group.places.round(6), metric, start=None if number else start, name=title)
        given = np.arange(len(group.places), dtype=np.int32)
        stages.append(Stage(problem, number > 0, given, Message("ordering {}", group.tool.label)))
    places = np.array([work.cuts[cut].path.point_at(s) for cut, s in work.nodes], dtype=np.float64)
    cluster = np.array([cut for cut, _ in work.nodes], dtype=np.int32)
    pairs = [
        (inner, outer)
        for inner, cut in enumerate(work.cuts)
        for outer, around in enumerate(work.cuts)
        if around.edge in edges[cut.edge].within
    ]
    problem = RoutingProblem(
        entry=places,
        exit=places,
        cluster=cluster,
        service=np.zeros(len(places)),
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        metric=metric,
        start=None if stages else start,
        end=end,
        name=name,
    )
    # The order of the drawing, with the edges inside an edge before it.
    drawn = sorted(range(len(work.cuts)), key=lambda cut: -len(edges[work.cuts[cut].edge].within))
    first = np.searchsorted(cluster, drawn).astype(np.int32)
    return (*stages, Stage(problem, bool(stages), first, Message("ordering the edges")))


def _split_holes(
    edges: Sequence[Edge], library: ToolLibrary | None, tolerance: float, depth: float
) -> tuple[list[Edge], list[tuple[float, float, Tool]], list[Issue]]:
    """Return the edges to mill, the holes (centre and drill) that a drill of the library makes, and an issue about
    holes that need other tools.

    A hole with a recipe in the library, such as a thread, is neither milled nor drilled here. An opening with an edge
    inside is milled.
    """
    from leafcut.processes.contours import round_diameter

    around = {number for edge in edges for number in edge.within}
    drilled: dict[int, tuple[float, float, Tool]] = {}
    other: list[Edge] = []
    gone: set[int] = set()
    for number, edge in enumerate(edges):
        diameter = round_diameter(edge.path) if edge.inside else None
        if diameter is None or not _is_circle(edge.path, diameter):
            continue
        if library is not None and library.recipes_for(diameter, edge.layer, tolerance):
            other.append(edge)
            gone.add(number)
            continue
        # A drill would destroy the part inside an opening.
        drill = None if number in around else fitting_drill(library, diameter, tolerance, depth)
        if drill is not None:
            x0, y0, x1, y1 = edge.path.extents
            drilled[number] = (0.5 * (x0 + x1), 0.5 * (y0 + y1), drill)
            gone.add(number)
    place = {number: k for k, number in enumerate(k for k in range(len(edges)) if k not in gone)}
    milled = [
        replace(edges[k], within=tuple(place[outer] for outer in edges[k].within if outer in place)) for k in place
    ]
    issues = []
    if other:
        words = Message("{} with a recipe in the tool library, not made", count_of(len(other), "hole"))
        x, y = other[0].path.start
        where = Message("the first at ({:.4g}, {:.4g}): make it first, with leafcut drill", x, y)
        issues.append(Issue("L707", words, where, missing=missing_paths("hole", [edge.path for edge in other])))
    return milled, list(drilled.values()), issues


def _is_circle(path: Polyline, diameter: float) -> bool:
    """Return whether all points lie on a circle, because the bore of a shaft may have a flat.

    The sides of a polygon with 24 corners lie 0.43 % of the diameter inside its circle.
    """
    x0, y0, x1, y1 = path.extents
    corners = path.flattened()
    points = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=0))])
    away = np.hypot(points[:, 0] - 0.5 * (x0 + x1), points[:, 1] - 0.5 * (y0 + y1))
    return bool(np.abs(away - 0.5 * diameter).max() <= _ROUND * diameter)


def _mill(job: Job, library: ToolLibrary | None, depth: float) -> tuple[Tool | None, float]:
    """Return the end mill of the tool library, None without a library, and the diameter of the mill, mm."""
    asked, mill = job.settings.job, library_mill_for(library, job.settings, depth)
    if mill is not None:
        if mill.corner_radius > asked.break_through + 1e-9:
            raise PlanError(
                "{} has a corner radius of {:g} mm and would not cut the lower edge of the plate; give --break-through "
                "{:g}mm or more, or use a mill with sharp corners",
                mill.label,
                mill.corner_radius,
                mill.corner_radius,
            )
        return mill, mill.diameter
    if asked.tool_diameter is None:
        raise OptionError(
            "a part needs the diameter of its end mill; give --tool-diameter, or a tool library with --tools"
        )
    return None, asked.tool_diameter


def _sheet_area(outline: Polyline, holes: Sequence[Polyline]) -> shapely.Polygon:
    return shapely.Polygon(outline.flattened(), [hole.flattened() for hole in holes])


def _tab_rules(options: PartOptions, thickness: float) -> TabRules:
    if options.tabs and options.tab_height >= thickness:
        raise OptionError(
            "--tab-height {:g} mm: the plate is only {:g} mm thick; give a lower height, or --tabs 0",
            options.tab_height,
            thickness,
        )
    return TabRules(options.tabs, options.tab_width, options.tab_height)
