"""Prepare the milling of a part (edges, mill, tabs and heights), and generate the motion for an order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from leafcut.errors import OptionError, PlanError, count_of, printable
from leafcut.geometry.arrays import Floats, Point
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import layer_matcher
from leafcut.model.issue import Issue
from leafcut.model.part import Hole, Part
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sheet import Sheet
from leafcut.model.tool import Tool, ToolLibrary
from leafcut.model.toolpath import FIRST_OFFSET
from leafcut.options import MillingOptions, Settings
from leafcut.options.drawings import ISLAND_NAMES, POCKET_NAMES
from leafcut.processes.contours import (
    diameter_if_round,
    open_contours,
    prepare_sheet,
    read_placed_contours,
    without_excluded_holes,
)
from leafcut.processes.job import (
    Job,
    check_dialect_options,
    check_tool_change_options,
    dialect_of,
    library_of,
    plane_point,
)
from leafcut.processes.milling.clamps import parse_clamps, refuse_clamp_collisions
from leafcut.processes.milling.mill import assumed_number_issues, library_mill_for, milling_data
from leafcut.processes.part.carving import carvings_of, with_floor_passes
from leafcut.processes.part.chamfering import chamfers_of
from leafcut.processes.part.clearing import check_pockets, pocket_areas, pocket_tasks, with_pockets
from leafcut.processes.part.copies import fixture_issues, repeat_part, work_offsets
from leafcut.processes.part.engraving import engravings_of
from leafcut.processes.part.isolating import isolations_of
from leafcut.processes.part.mills import other_mills
from leafcut.processes.part.model import Carving, CopyGrid, Edge, LayerWork, PartHole, PartRequest, TabRules
from leafcut.processes.part.operations import (
    LayeredPart,
    divide_by_layer,
    edge_options,
    not_a_bore,
    open_shape,
)
from leafcut.processes.part.options import PartOptions
from leafcut.processes.part.plan.carving import carving_tasks
from leafcut.processes.part.plan.chamfers import chamfer_path, chamfer_tasks
from leafcut.processes.part.plan.engraving import engraving_tasks
from leafcut.processes.part.plan.finishing import check_allowance, ring_of
from leafcut.processes.part.plan.holes import HoleGroup, PlannedHole, fitting_drill, hole_groups
from leafcut.processes.part.plan.isolation import isolation_tasks
from leafcut.processes.part.plan.motion import part_motion
from leafcut.processes.part.plan.outlines import OutlineCut, edges_of, missing_paths, plan_cuts, with_ramps
from leafcut.processes.part.plan.task import Mill, MillTask, PartHeights
from leafcut.processes.plan import Plan
from leafcut.processes.quoting import stock_price
from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones
from leafcut.read.format import Source
from leafcut.read.operations import Operation, read_operations
from leafcut.timing.toolpath import measure_toolpath
from leafcut.timing.travel import travel_metric

#: Maximum deviation of a round hole from an exact circle, in diameters.
_ROUND = 0.005
#: Minimum finishing allowance, mm. The verification locates a cut with an accuracy of 0.03 mm.
_SMALLEST_FINISH = 0.1


@dataclass(frozen=True, eq=False)
class MillStage:
    """The tasks of a mill. A search finds the best order of these tasks."""

    mill: Mill
    tasks: tuple[MillTask, ...]

    @cached_property
    def nodes(self) -> tuple[tuple[int, int], ...]:
        """Index of the task and index of the choice for each node of the search."""
        return tuple((k, choice) for k, task in enumerate(self.tasks) for choice in range(len(task.choices)))


@dataclass(frozen=True, eq=False)
class PartWork:
    """The holes of each drill and the tasks of each mill.

    `cuts` contains only the tasks along edges. `copies` is None if the drawing is milled once on the plate.
    `plate_price` is the price of the plate, for a quote. A plate is milled in each of the `work_offsets`.
    """

    groups: tuple[HoleGroup, ...]
    mills: tuple[MillStage, ...]
    cuts: tuple[OutlineCut, ...]
    heights: PartHeights
    layers: tuple[LayerWork, ...]
    copies: CopyGrid | None
    plate_price: float = 0.0
    work_offsets: tuple[int, ...] = (FIRST_OFFSET,)


def plan_part(job: Job, source: Source) -> Plan:
    """Plan the milling of a part.

    Raises
    ------
    ReadError, OptionError, PlanError
        The drawing, the tool, the tabs or the operations are unsuitable.
    """
    settings, milling, asked = job.settings, job.settings.of(MillingOptions), job.settings.job
    thickness = _thickness(settings)
    bottom = -thickness - asked.break_through
    library = library_of(settings, job.machine)
    mill, diameter = _mill(job, library, -bottom)
    tabs, finish = _tab_rules(settings, thickness), _allowance(settings, 0.5 * diameter)
    part, grid = repeat_part(
        with_pockets(read_placed_contours(job, source)), settings, tabs.least_gap(0.5 * diameter, finish)
    )
    divided = _divide(part, settings, thickness)
    sheet = _prepare_sheet(divided, settings)
    data, of_data = milling_data(milling, asked, diameter, job.machine, mill)
    main = Mill(data, asked.step_down or 0.5 * diameter, milling.milling == "climb")
    edges, issues = _drawn_edges(sheet, divided, settings, part.name)
    edges, drilled, more = _split_holes(edges, divided, library, asked.diameter_tolerance, -bottom, diameter)
    issues += more
    area = None if sheet.outline is None else _sheet_area(sheet.outline, sheet.holes)
    cuts, more = plan_cuts(edges, 0.5 * diameter, main.climb, tabs, area, finish)
    issues += more
    groups, more = hole_groups(drilled, bottom, asked.retract_height, asked.retract == "initial", job.machine)
    issues += more
    mills, of_mills = other_mills(divided, job, main, library)
    areas, more = pocket_areas(divided, settings, diameter, [*mills, main])
    engravings, of_engravings = engravings_of(divided, settings, data.tool.number)
    issues += [*more, *of_engravings]
    isolations, of_isolations = isolations_of(divided, [*mills, main])
    tools = {one.data.tool.number: one.data.tool for one in (*mills, main)}
    carvings, axes, of_carvings = carvings_of(divided, settings, [*mills, main], areas, thickness)
    faces = [*areas, *(carving.area for carving in carvings)]
    check_pockets(areas, faces, edges, cuts, engravings, tabs, thickness, diameter, finish)
    chamfers = chamfers_of(divided, edges, cuts, drilled, faces, 0.5 * diameter, tools, tabs, thickness)
    if not (edges or drilled or engravings or faces or isolations) and not any(issue.missing for issue in issues):
        raise PlanError("{}: there is nothing to mill, because --operations ignores all layers", part.name)
    if not (cuts or groups or engravings or faces or isolations):
        raise OptionError("{}: nothing can be milled: {}", part.name, next(one for one in issues if one.missing))
    issues += [*assumed_number_issues(milling, mill, data.tool), *of_data, *of_mills, *of_isolations, *of_carvings]
    post_dialect = dialect_of(job)
    job = job.for_dialect(post_dialect)
    check_dialect_options(settings, post_dialect)
    check_tool_change_options(job.machine, post_dialect)
    request = PartRequest(
        edges=_with_tabs(edges, cuts),
        holes=tuple(PartHole(hole.x, hole.y, hole.drill.number, bottom - hole.drill.point_length) for hole in drilled),
        tool=data.tool.number,
        radius=0.5 * diameter,
        thickness=thickness,
        bottom=bottom,
        tabs=tabs,
        sheet=area,
        engravings=tuple(engravings),
        pockets=tuple(areas),
        chamfers=tuple(chamfers),
        carvings=tuple(carvings),
        isolations=tuple(isolations),
        steps={one.data.tool.number: one.step for one in (*mills, main)},
        feed=data.tool.feed,
        finish=finish,
        climb=main.climb,
    )
    heights = _heights(job, tabs, thickness, bottom)
    cuts = [with_ramps(cut, main, heights) for cut in cuts]
    _refuse_clamps(request, cuts, tools | {group.tool.number: group.tool for group in groups}, settings)
    pockets, more = pocket_tasks(job, post_dialect, part, request, [*mills, main])
    issues += more
    stages = _mill_stages([*mills, main], request, with_floor_passes(carvings, axes, pockets), pockets, cuts)
    layers = _summarize_layers(part, divided, request, drilled, tools)
    price = stock_price(settings, 0.0, 0.0 if area is None else area.area, asked.material, thickness)
    offsets = work_offsets(settings, post_dialect, len(groups) + len(stages))
    work = PartWork(tuple(groups), tuple(stages), tuple(cuts), heights, layers, grid, price, offsets)
    return Plan(
        job=job,
        part=replace(
            part,
            holes=tuple(Hole(x, y, group.tool.diameter) for group in groups for x, y in group.places.tolist()),
        ),
        dialect=post_dialect,
        work=work,
        spec=request,
        stages=_stages(job, part.name, work),
        tools=(*(group.tool for group in groups), *(stage.mill.data.tool for stage in stages)),
        box=part.extents,
        start=plane_point(asked.start_point),
        issues=[*sheet.issues, *issues, *fixture_issues(offsets, job.machine, heights.clearance)],
    )


def _divide(part: Part, settings: Settings, thickness: float) -> LayeredPart:
    """Divide the drawing by operation. Without an operations file, every contour is an edge."""
    file = settings.of(PartOptions).operations
    if file is None and part.format == "gerber":
        raise OptionError(
            "{}: a board needs an operation for each layer; give --operations with a file such as [layer] COPPER = "
            '"isolate 0.1mm T6", HOLES = "bore", OUTLINE = "profile"',
            part.name,
        )
    if file is None:
        return LayeredPart(part)
    return divide_by_layer(part, read_operations(file), file, thickness, settings.sheet)


def _drawn_edges(sheet: Sheet, divided: LayeredPart, settings: Settings, name: str) -> tuple[list[Edge], list[Issue]]:
    """Return the closed outlines to mill. Raises PlanError if there is neither an outline nor an operations file."""
    edges, issues = edges_of(sheet.contours)
    if divided.rules:
        return edges, issues
    if not edges:
        raise PlanError(
            "{}: there is nothing to mill, because the drawing has no closed outlines except those that are marked or "
            "left out; check --mark-layers, --cut-layers, --min-diameter and --max-diameter",
            name,
        )
    if not settings.sheet.cut_layers:
        issues += _pockets_through_plate(edges)
    return edges, issues


def _pockets_through_plate(edges: Sequence[Edge]) -> list[Issue]:
    """Warn about each layer whose name suggests pockets, because its shapes are milled through the plate."""
    is_pocket = layer_matcher((*POCKET_NAMES, *ISLAND_NAMES))
    return [
        Issue(
            "L418",
            Message(
                "milled through the plate: {} on layer '{}', which is named for pockets; for a pocket, assign an "
                'operation to each layer with --operations, such as "{}" = "pocket 3mm"',
                count_of(number, "shape"),
                printable(layer),
                printable(layer),
            ),
        )
        for layer, number in Counter(edge.layer for edge in edges).items()
        if is_pocket(layer)
    ]


def _thickness(settings: Settings) -> float:
    """Return the thickness of the plate, mm. Raises OptionError if a required option is missing or unsuitable."""
    asked, thickness = settings.job, settings.job.thickness
    if thickness is None:
        if asked.tool_diameter is None and asked.tools is None:
            raise OptionError(
                "the plate thickness and the end mill are missing; give --thickness and --tool-diameter, "
                "such as --thickness 6mm --tool-diameter 3mm, or a tool library with --tools"
            )
        raise OptionError("the plate thickness is missing; give --thickness, such as --thickness 6mm")
    if settings.sheet.open_paths in ("cut", "mark"):
        raise OptionError(
            "--open-paths {}: leafcut part mills closed outlines only; close the paths, or use --open-paths drop",
            settings.sheet.open_paths,
        )
    return thickness


def _prepare_sheet(divided: LayeredPart, settings: Settings) -> Sheet:
    part, options = divided.edges, settings.sheet
    if divided.rules:
        if not part.contours:
            return Sheet(part.name, (), issues=part.issues)
        options = edge_options(divided, options)
        for contour in open_contours(part.contours, options):
            raise open_shape(divided.rules[contour.layer], contour)
    sheet = prepare_sheet(part, options, settings.read.concentric, "drop")
    return without_excluded_holes(sheet, settings.read)


def _with_tabs(edges: Sequence[Edge], cuts: Sequence[OutlineCut]) -> tuple[Edge, ...]:
    tabs_of = {cut.edge: len(cut.tabs) for cut in cuts}
    return tuple(replace(edge, tabs=tabs_of.get(number, 0)) for number, edge in enumerate(edges))


def _summarize_layers(
    part: Part, divided: LayeredPart, request: PartRequest, drilled: Sequence[PlannedHole], tools: Mapping[int, Tool]
) -> tuple[LayerWork, ...]:
    deep, mill = -request.bottom, (tools[request.tool],)
    works: list[tuple[str, str, float, tuple[Tool, ...]]] = [
        (edge.layer, str(Operation.BORE if edge.is_bore else Operation.PROFILE), deep, mill) for edge in request.edges
    ]
    works += [(hole.layer, "drill", deep, (hole.drill,)) for hole in drilled]
    works += [(one.layer, str(Operation.ENGRAVE), one.depth, (tools[one.tool],)) for one in request.engravings]
    works += [(one.layer, str(Operation.CHAMFER), one.depth, (tools[one.bit.tool],)) for one in request.chamfers]
    works += [
        (one.layer, str(Operation.ISOLATE), one.depth, (tools[one.tool],))
        for one in request.isolations
        for _ in shapely.get_parts(one.copper)
    ]
    # The deepest shape stands for its layer.
    deepest = {one.area.layer: one.area.depth for one in sorted(request.carvings, key=lambda one: one.area.depth)}
    works += [
        (layer, str(Operation.VCARVE), round(deepest[layer], 2), tuple(tools[number] for number in numbers))
        for one in request.carvings
        for layer, numbers in [(one.area.layer, [*([one.flat.tool] if one.flat else []), one.bit.tool])]
    ]
    works += [
        (
            area.layer,
            str(Operation.POCKET),
            area.depth,
            tuple(tools[own.tool] for own in request.mills_of(area)),
        )
        for area in request.pockets
    ]
    # The strokes of a text have the same handle.
    ignored = dict.fromkeys(
        (contour.layer, contour.handle or str(number))
        for number, contour in enumerate(part.contours)
        if divided.operation(contour.layer) is Operation.IGNORE
    )
    works += [(layer, str(Operation.IGNORE), 0.0, ()) for layer, _ in ignored]
    position = {layer: k for k, layer in enumerate(dict.fromkeys(contour.layer for contour in part.contours))}
    rows = sorted(Counter(works).items(), key=lambda row: position.get(row[0][0], -1))
    return tuple(LayerWork(layer, number, word, depth, used) for (layer, word, depth, used), number in rows)


def _heights(job: Job, tabs: TabRules, thickness: float, bottom: float) -> PartHeights:
    asked = job.settings.job
    refuse_higher_zones(asked.keep_out, asked.clearance_height)
    retract = asked.clearance_height if asked.retract == "initial" else asked.retract_height
    high = crossing_heights(asked.keep_out, asked.clearance_height) > retract
    return PartHeights(
        clearance=asked.clearance_height,
        retract=retract,
        tab_top=tabs.height - thickness,
        bottom=bottom,
        zones=parse_zones(asked.keep_out)[high],
        end=plane_point(asked.end_point),
    )


def _mill_stages(
    mills: Sequence[Mill],
    request: PartRequest,
    carved: Sequence[tuple[Carving, Sequence[Floats]]],
    pockets: Mapping[int, Sequence[MillTask]],
    cuts: Sequence[MillTask],
) -> list[MillStage]:
    """Create the stage of each mill. Mills without tasks are left out.

    Each mill has its engravings, chamfers, shapes and `pockets`. `carved` contains the shapes with their paths.
    The last mill also has all `cuts` along edges.
    """
    stages = []
    for mill in mills:
        number = mill.data.tool.number
        engravings = [engraving for engraving in request.engravings if engraving.tool == number]
        chamfers = [chamfer for chamfer in request.chamfers if chamfer.bit.tool == number]
        copper = [one for one in request.isolations if one.tool == number]
        shapes = [(one, paths) for one, paths in carved if one.bit.tool == number]
        face: tuple[MillTask, ...] = (
            *engraving_tasks(engravings, request.edges, mill.step),
            *isolation_tasks(copper, request.edges, mill.step, mill.climb),
            *chamfer_tasks(chamfers, request.edges, mill.step, mill.climb),
            *carving_tasks(shapes, request.edges, mill.step),
            *pockets[number],
        )
        tasks = (*face, *(cuts if mill is mills[-1] else ()))
        stages += [MillStage(mill, tasks)] if tasks else []
    return stages


def _refuse_clamps(
    request: PartRequest, cuts: Sequence[OutlineCut], tools: Mapping[int, Tool], settings: Settings
) -> None:
    clamps = parse_clamps(settings.job.keep_out, settings.job.clearance_height)
    if not clamps:
        return
    mill, radius = request.tool, request.radius
    floors = [floor for carving in request.carvings for floor in carving.floors]
    works: list[tuple[str, shapely.Geometry, float, int]] = [
        *((request.edges[cut.edge].name, cut.centres, request.bottom, mill) for cut in cuts),
        *(
            (area.name, area.region.buffer(-own.radius), -area.depth, own.tool)
            for area in (*request.pockets, *floors)
            for own in request.mills_of(area)
        ),
        *((one.name, one.line, -one.depth, one.tool) for one in request.engravings),
        *(
            (Message("the copper on layer {}", one.layer), one.copper.buffer(one.offsets[-1]), -one.depth, one.tool)
            for one in request.isolations
        ),
        *((one.area.name, one.area.region, -one.area.depth, one.bit.tool) for one in request.carvings),
        *((one.name, ring_of(chamfer_path(one)), -one.depth, one.bit.tool) for one in request.chamfers),
        *(
            (Message("the hole at ({:g}, {:g})", hole.x, hole.y), shapely.Point(hole.x, hole.y), hole.tip, hole.tool)
            for hole in request.holes
        ),
    ]
    for name, centres, floor, tool in works:
        wide = radius if tool == mill else 0.5 * tools[tool].diameter
        refuse_clamp_collisions(name, centres, floor, tools[tool], wide, clamps)


def part_candidate(plan: Plan, order: Order) -> Candidate:
    """Generate the motion for an order, and compute its time."""
    work: PartWork = plan.work
    drilled, milled = order.choices[: len(work.groups)], order.choices[len(work.groups) :]
    path = part_motion(
        [replace(group, places=group.places[nodes]) for group, nodes in zip(work.groups, drilled, strict=True)],
        [
            (
                stage.mill,
                [(stage.tasks[task], choice) for task, choice in (stage.nodes[node] for node in nodes.tolist())],
            )
            for stage, nodes in zip(work.mills, milled, strict=True)
        ],
        work.heights,
        plan.job.machine,
        coolant=plan.job.settings.post.coolant,
        pause=plan.dialect.hand_change_pause and not plan.job.machine.tool_changer,
        work_offsets=work.work_offsets,
    )
    return Candidate(order, path, measure_toolpath(path, plan.job.machine, start=plan.start))


def _stages(job: Job, name: str, work: PartWork) -> tuple[Stage, ...]:
    metric = travel_metric(job.machine, job.settings.solve.objective)
    start, end = plane_point(job.settings.job.start_point), work.heights.end
    stages: list[Stage] = []
    for number, group in enumerate(work.groups):
        title = f"{name}: {group.tool.label}"
        problem = RoutingProblem.of_points(group.places.round(6), metric, start=None if number else start, name=title)
        given = np.arange(len(group.places), dtype=np.int32)
        stages.append(Stage(problem, number > 0, given, Message("ordering {}", group.tool.label)))
    for one in work.mills:
        problem = _mill_problem(one, metric, None if stages else start, end if one is work.mills[-1] else None, name)
        # The initial order follows the drawing, but inner edges come before the edges around them.
        drawn = sorted(range(len(one.tasks)), key=lambda task: -len(one.tasks[task].later))
        first = np.searchsorted(problem.cluster, drawn).astype(np.int32)
        stages.append(Stage(problem, bool(stages), first, Message("ordering {}", one.mill.data.tool.label)))
    return tuple(stages)


def _mill_problem(
    stage: MillStage, metric: Metric, start: Point | None, end: Point | None, name: str
) -> RoutingProblem:
    ends = np.array([pair for task in stage.tasks for pair in task.choices], dtype=np.float64)
    cuts_of: dict[int, list[int]] = {}
    for number, task in enumerate(stage.tasks):
        if isinstance(task, OutlineCut):
            cuts_of.setdefault(task.edge, []).append(number)
    pairs = [
        (number, after)
        for number, task in enumerate(stage.tasks)
        for after in sorted(cut for edge in task.later for cut in cuts_of.get(edge, ()))
    ]
    return RoutingProblem(
        entry=ends[:, 0],
        exit=ends[:, 1],
        cluster=np.array([task for task, _ in stage.nodes], dtype=np.int32),
        service=np.zeros(len(stage.nodes)),
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        metric=metric,
        start=start,
        end=end,
        name=name,
    )


def _split_holes(
    edges: Sequence[Edge],
    divided: LayeredPart,
    library: ToolLibrary | None,
    tolerance: float,
    depth: float,
    mill: float,
) -> tuple[list[Edge], list[PlannedHole], list[Issue]]:
    """Decide which edges are milled and which holes are drilled.

    A hole is drilled if the library has a drill that fits. An opening that contains another edge is always milled. A
    hole on a profile layer is always milled, too. A milled round hole of at most two `mill` diameters, mm, counts as a
    bore. If the library has a recipe for a hole, such as a thread, the hole is skipped.

    Returns
    -------
    edges, holes
        The edges to mill, and the holes to drill.
    issues
        An issue about holes that need other tools.

    Raises
    ------
    PlanError
        A shape on a bore layer is not a round hole.
    """
    around = {number for edge in edges for number in edge.within}
    drilled: dict[int, PlannedHole] = {}
    other: list[Edge] = []
    gone: set[int] = set()
    milled: dict[int, Edge] = {}
    for number, edge in enumerate(edges):
        operation = divided.operation(edge.layer)
        diameter = diameter_if_round(edge.path) if edge.inside or operation is Operation.BORE else None
        is_round = diameter is not None and _is_circle(edge.path, diameter)
        if operation is Operation.BORE and (not is_round or number in around):
            raise not_a_bore(divided.rules[edge.layer], edge.path.start, is_round=is_round)
        is_alone = is_round and number not in around and operation is not Operation.PROFILE
        is_bore = is_alone and diameter is not None and mill < diameter <= 2.0 * mill
        milled[number] = replace(edge, inside=edge.inside or operation is Operation.BORE, is_bore=is_bore)
        if diameter is None or not is_round or operation is Operation.PROFILE:
            continue
        if library is not None and library.recipes_for(diameter, edge.layer, tolerance):
            other.append(edge)
            gone.add(number)
            continue
        # A drill would destroy the part inside an opening.
        drill = None if number in around else fitting_drill(library, diameter, tolerance, depth)
        if drill is not None:
            x0, y0, x1, y1 = edge.path.extents
            drilled[number] = PlannedHole(0.5 * (x0 + x1), 0.5 * (y0 + y1), drill, edge.layer)
            gone.add(number)
    place = {number: k for k, number in enumerate(k for k in range(len(edges)) if k not in gone)}
    kept = [
        replace(milled[k], within=tuple(place[outer] for outer in edges[k].within if outer in place)) for k in place
    ]
    issues = []
    if other:
        words = Message("the program does not drill {} with a recipe in the tool library", count_of(len(other), "hole"))
        x, y = other[0].path.start
        where = Message("the first at ({:.4g}, {:.4g}); drill it before milling, with leafcut drill", x, y)
        issues.append(Issue("L707", words, where, missing=missing_paths("hole", [edge.path for edge in other])))
    return kept, list(drilled.values()), issues


def _is_circle(path: Polyline, diameter: float) -> bool:
    """Return whether all points of a path lie on a circle. A bore with a flat side does not.

    A polygon with 24 corners counts as a circle, because its sides are at most 0.43 % of the diameter inside the
    circle.
    """
    x0, y0, x1, y1 = path.extents
    corners = path.flattened(min(0.01, 0.25 * _ROUND * diameter))
    points = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=0))])
    away = np.hypot(points[:, 0] - 0.5 * (x0 + x1), points[:, 1] - 0.5 * (y0 + y1))
    return bool(np.abs(away - 0.5 * diameter).max() <= _ROUND * diameter)


def _mill(job: Job, library: ToolLibrary | None, depth: float) -> tuple[Tool | None, float]:
    """Return the end mill and its diameter, mm. The end mill is None without a tool library."""
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
            "a part needs the diameter of its end mill; give --tool-diameter, such as --tool-diameter 3mm, or a tool "
            "library with --tools"
        )
    return None, asked.tool_diameter


def _sheet_area(outline: Polyline, holes: Sequence[Polyline]) -> shapely.Polygon:
    return shapely.Polygon(outline.flattened(), [hole.flattened() for hole in holes])


def _allowance(settings: Settings, radius: float) -> float:
    finish = settings.of(PartOptions).finish
    if 0.0 < finish < _SMALLEST_FINISH:
        raise OptionError(
            "--finish {:g} mm is too small to be verified; give at least {:g} mm, or 0 for no finishing pass",
            finish,
            _SMALLEST_FINISH,
        )
    check_allowance(finish, radius)
    return finish


def _tab_rules(settings: Settings, thickness: float) -> TabRules:
    options = settings.of(PartOptions)
    height = options.tab_height if "tab_height" in settings.given else min(options.tab_height, 0.5 * thickness)
    if options.tabs and height >= thickness:
        raise OptionError(
            "--tab-height is {:g} mm, but the plate is only {:g} mm thick; give a smaller --tab-height, or --tabs 0",
            height,
            thickness,
        )
    return TabRules(options.tabs, options.tab_width, height)
