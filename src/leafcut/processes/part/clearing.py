"""Find the pockets of a part, check them against the other shapes, and plan the paths that clear them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import shapely

from leafcut.errors import PlanError, count_of
from leafcut.gcode.dialects import Dialect
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue
from leafcut.model.part import Part
from leafcut.model.pocket import EITHER, POCKET, USUAL, Pocket, PocketRules
from leafcut.options import MillingOptions, Settings
from leafcut.processes.job import Job, plane_point
from leafcut.processes.part.model import Edge, Engraving, PartRequest, PocketArea, PocketMill, TabRules, material_of
from leafcut.processes.part.operations import LayeredPart, open_shape
from leafcut.processes.part.plan.finishing import check_allowance, no_room, tight_place
from leafcut.processes.part.plan.outlines import OutlineCut, missing_paths
from leafcut.processes.part.plan.pockets import PocketTask
from leafcut.processes.part.plan.rest import cleared_floor, rest_pockets, with_entries_in_air
from leafcut.processes.part.plan.task import Mill
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.region import centre_regions
from leafcut.read.operations import LayerRule, Operation

#: Share of the time limit for planning the paths in pockets. The rest of the time is for ordering the tasks.
_CLEARING = 0.5
#: Maximum overlap of shapes that count as touching, mm.
_TOUCH = 0.01
#: The mill can only plunge into a pocket if the perimeter of the area of mill centres is smaller than this, mm.
_PLUNGE = 0.1


def with_pockets(part: Part) -> Part:
    """Return the part with its issues adjusted for a process that mills pockets.

    The issue about unmilled pockets is removed. Issues about the other features of a solid (`Part.besides`) are
    added.
    """
    if not (part.pockets or part.besides):
        return part
    issues = (issue for issue in part.issues if issue.code != "L219")
    return replace(part, issues=(*issues, *part.besides), besides=())


def pocket_mills(mills: Sequence[Mill]) -> dict[int | None, PocketMill]:
    """Return the mills as mills of pockets, by tool number."""
    return {
        tool.number: PocketMill(tool.number, 0.5 * tool.diameter, mill.step, tool.feed)
        for mill in mills
        for tool in [mill.data.tool]
    }


def pocket_areas(
    divided: LayeredPart, settings: Settings, diameter: float, mills: Sequence[Mill]
) -> tuple[list[PocketArea], list[Issue]]:
    """Collect the areas to clear: the pockets drawn on pocket layers, and the pockets of a solid.

    `mills` contains the mills that layers may name. Every other pocket uses the end mill of the part, whose diameter is
    `diameter`, mm. Pockets of a solid that are too narrow for this end mill are skipped. If a pocket is too narrow for
    the first of its two mills, the second mill clears all of it.

    Returns
    -------
    areas
        The areas to clear, with their islands.
    issues
        Issues about repaired lines and about skipped pockets.

    Raises
    ------
    PlanError, ReadError
        An outline is open, or it crosses another outline. The message gives the line in the operations file.
    """
    mill_of = pocket_mills(mills)
    areas: list[PocketArea] = []
    issues: list[Issue] = []
    for rule, contours in divided.faces_of(Operation.POCKET):
        for drawn in drawn_areas(rule, contours, settings, issues):
            name = Message("the pocket at ({:.4g}, {:.4g}) on layer {}", *drawn.outline.start, drawn.layer)
            mill, rest = mill_of.get(rule.tool), mill_of.get(rule.rest)
            area = replace(drawn, name=name, mill=mill, rest=rest)
            if rest is not None and mill is not None and _is_narrow(area, 2.0 * mill.radius):
                area = replace(area, mill=rest, rest=None)
            refuse_overlap(rule, area, areas)
            areas.append(area)
    solid = [PocketArea(pocket.outline, pocket.islands, pocket.depth or 0.0) for pocket in divided.edges.pockets]
    narrow = [area for area in solid if _is_narrow(area, diameter)]
    if narrow:
        words = Message(
            "the program does not mill {} narrower than the mill of {:g} mm", count_of(len(narrow), "pocket"), diameter
        )
        where = Message("the first at ({:.4g}, {:.4g}); drill it, or use a smaller mill", *narrow[0].outline.start)
        missing = missing_paths("pocket", [area.outline for area in narrow])
        issues.append(Issue("L707", words, where, missing=missing))
    for area in solid:
        if area not in narrow:
            name = Message("the pocket at ({:.4g}, {:.4g})", *area.outline.start)
            areas.append(replace(area, name=name))
    return areas, issues


def drawn_areas(
    rule: LayerRule, contours: Sequence[Contour], settings: Settings, issues: list[Issue]
) -> list[PocketArea]:
    """Return the areas inside the closed shapes of a layer, without names.

    Shapes inside a shape are its islands. Raises PlanError or ReadError if a shape is open or crosses another shape.
    """
    from leafcut.processes.contours import open_contours
    from leafcut.processes.layers import contour_kinds
    from leafcut.read.pocket_outlines import contours_to_pockets

    every = replace(settings.sheet, cut_layers=("*",), mark_layers=(), ignore_layers=(), sheet_layers=())
    drawn = tuple(contour for contour in contours if contour.kind != "text")
    contour_kinds(contours, every, issues)  # reports the texts that are left out
    for contour in open_contours(drawn, every):
        raise open_shape(rule, contour)
    part = contours_to_pockets(Part(rule.layer, contours=drawn), [EITHER] * len(drawn), every, rule.place, POCKET)
    issues += part.issues
    return [PocketArea(one.outline, one.islands, rule.depth, layer=one.layer) for one in part.pockets]


def refuse_overlap(rule: LayerRule, area: PocketArea, others: Sequence[PocketArea]) -> None:
    """Raise PlanError if an area overlaps another area."""
    for other in others:
        if area.region.intersection(other.region).area > _TOUCH * _TOUCH:
            raise PlanError(
                "{}: {} overlaps {}; to leave it standing, put it on the same layer as an island",
                rule.place,
                area.name,
                other.name,
            )


def _is_narrow(area: PocketArea, diameter: float) -> bool:
    """Return whether the mill does not fit into a pocket or can only plunge into it.

    A slot may be as wide as the mill.
    """
    return bool(area.region.buffer(_TOUCH - 0.5 * diameter).length < _PLUNGE)


def check_pockets(
    areas: Sequence[PocketArea],
    faces: Sequence[PocketArea],
    edges: Sequence[Edge],
    cuts: Sequence[OutlineCut],
    engravings: Sequence[Engraving],
    tabs: TabRules,
    thickness: float,
    diameter: float,
    finish: float,
) -> None:
    """Check that the pockets `areas` fit the mill, and that no area on the top face damages the rest of the part.

    `faces` contains the pockets and the carved shapes. They may cross an edge, like a step.

    Raises
    ------
    OptionError
        The finishing allowance is not less than the radius of a mill.
    PlanError
        A pocket is narrower than its mill or leaves no room for the finishing allowance `finish`. Or it lies outside
        the parts, contains an engraved path, or makes the tabs of a nearby edge too thin.
    """
    lines = [shapely.LinearRing(edge.path.flattened(_TOUCH)) for edge in edges]
    with_tabs = {cut.edge for cut in cuts if cut.tabs}
    material = None if all(edge.inside for edge in edges) else material_of(edges)
    for area in areas:
        radius = area.mill.radius if area.mill else 0.5 * diameter
        if _is_narrow(area, 2.0 * radius):
            raise PlanError("{} is narrower than the mill of {:g} mm; use a smaller mill", area.name, 2.0 * radius)
        check_allowance(finish, radius)
        tight = tight_place(area.region, radius, finish) if finish else None
        if tight is not None:
            raise no_room(area.name, tight, radius, finish)
    for area in faces:
        inner = area.region.buffer(-_TOUCH)
        for number, (edge, line) in enumerate(zip(edges, lines, strict=True)):
            # A wall lower than a tab would break before the tab.
            if (
                number in with_tabs
                and area.depth > thickness - tabs.height
                and area.region.distance(line) < tabs.height
            ):
                raise PlanError(
                    "{} is so deep that the tabs of {} would be thinner than {:g} mm; give a smaller --tab-height",
                    area.name,
                    edge.name,
                    tabs.height,
                )
        if material is not None and not material.intersects(inner):
            raise PlanError("{} lies outside the parts; move it, or choose 'ignore' for its layer", area.name)
        for engraving in engravings:
            if inner.intersects(engraving.line):
                raise PlanError("{} would be engraved in {}; engrave only outside pockets", engraving.name, area.name)


def pocket_tasks(
    job: Job, dialect: Dialect, part: Part, request: PartRequest, mills: Sequence[Mill]
) -> tuple[dict[int, list[PocketTask]], list[Issue]]:
    """Plan a task for each region of each pocket and of each carved floor.

    Returns
    -------
    tasks
        The tasks of each mill, by tool number.
    issues
        Issues about places that the mills cannot reach.
    """
    tasks: dict[int, list[PocketTask]] = {}
    issues: list[Issue] = []
    floors = [floor for carving in request.carvings for floor in carving.floors]
    total = sum(len(request.mills_of(area)) for area in request.pockets) + len(floors)
    for mill in mills:
        number = mill.data.tool.number
        own = [_Work(area, _pocket_of(area)) for area in request.pockets if request.mill_of(area).tool == number]
        rest_areas = [area for area in request.pockets if area.rest is not None and area.rest.tool == number]
        left: list[_Work] = []
        for area in rest_areas:
            done, rules = tasks[request.mill_of(area).tool], _rules(job, mill.data.tool.diameter)
            cleared = cleared_floor(task.clearing for task in done if task.pocket is area)
            pockets = rest_pockets(area, _rules(job, 2.0 * request.mill_of(area).radius), rules)
            left += [_Work(area, pocket, cleared) for pocket in pockets]
            issues += centre_regions(_pocket_of(area), rules)[1]
        own_floors = [area for area in floors if request.mill_of(area).tool == number]
        left += [_Work(area, _pocket_of(area)) for area in own_floors]
        tasks[number] = []
        # The mill of the rest works in corners, where it clears all levels up to the wall. The V-bit finishes floors.
        for works, count, stock in (
            (own, len(own), request.finish),
            (left, len(rest_areas) + len(own_floors), 0.0),
        ):
            share = _CLEARING * count / max(total, 1)
            more, more_issues = _tasks_of(job, dialect, part, works, request.edges, mill, share, stock)
            tasks[number] += more
            issues += more_issues
    return tasks, issues


class _Work(NamedTuple):
    """A pocket to clear: all of an area, or what the first mill has left of it after it cleared the area `before`."""

    area: PocketArea
    pocket: Pocket
    before: Any = None


def _pocket_of(area: PocketArea) -> Pocket:
    return Pocket(area.outline, area.islands, area.name, area.layer, depth=area.depth)


def _rules(job: Job, diameter: float, stock: float = 0.0) -> PocketRules:
    from leafcut.processes.pocket.plan.rules import clearing_rules

    milling, step_over = job.settings.of(MillingOptions).milling, job.settings.job.step_over
    return clearing_rules(PocketOptions(stock=stock), milling, step_over, diameter)


def _tasks_of(
    job: Job,
    dialect: Dialect,
    part: Part,
    works: Sequence[_Work],
    edges: Sequence[Edge],
    mill: Mill,
    share: float,
    stock: float,
) -> tuple[list[PocketTask], list[Issue]]:
    if not works:
        return [], []
    from leafcut.processes.pocket.clearing import clear_pocket
    from leafcut.processes.pocket.job import PocketJob
    from leafcut.processes.pocket.plan.rules import divide_into_levels
    from leafcut.processes.pocket.plan.toolpath import PocketHeights
    from leafcut.processes.pocket.strategies import SearchTime

    asked, tool = job.settings.job, mill.data.tool
    pocket_job = PocketJob(
        run=job,
        part=replace(part, contours=(), pockets=tuple(work.pocket for work in works)),
        rules=_rules(job, tool.diameter, stock),
        levels=tuple(divide_into_levels(work.area.depth, mill.step, tool.diameter) for work in works),
        around=(None,) * len(works),
        heights=PocketHeights(asked.clearance_height, asked.retract_height),
        data=mill.data,
        dialect=dialect,
        start=plane_point(asked.start_point),
    )
    time = SearchTime(job.deadline.for_share(share))
    shapes = shapely.STRtree([shapely.Polygon(edge.path.flattened(_TOUCH)) for edge in edges])
    tasks: list[PocketTask] = []
    issues: list[Issue] = []
    for number, (area, pocket, before) in enumerate(works):
        cleared, more = clear_pocket(pocket_job, pocket, number, time, USUAL)
        # Two mills leave only the corners that the second mill cannot reach.
        issues += [] if area.rest else more
        later = tuple(np.sort(shapes.query(area.region, predicate="intersects")).tolist())
        clearings = cleared.clearings[cleared.plan.result.strategy]
        if before is not None:
            clearings = [with_entries_in_air(clearing, before) for clearing in clearings]
        tasks += [PocketTask(area, clearing, job.machine, later) for clearing in clearings]
    return tasks, issues
