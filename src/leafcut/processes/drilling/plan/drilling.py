"""Plan the operations for the holes and slots of a drawing.

There is one operation for each tool, and the order needs as few tool changes as possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError, count_of
from leafcut.geometry.zones import touches_any_zone, widen_zones
from leafcut.message import Message
from leafcut.model.cutter import cutter_of_tool, shank_and_holder_discs, tip_radius_and_discs, widest_radius_below
from leafcut.model.cycles import PECKING
from leafcut.model.heights import SAME_HEIGHT, HeightCount
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.problem import Relief
from leafcut.model.tool import LONGEST_STROKE, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import DrillCycle
from leafcut.options import JobOptions
from leafcut.processes.drilling.options import DrillOptions
from leafcut.processes.drilling.plan.tooling import Step, ToolChooser
from leafcut.processes.job import plane_point
from leafcut.processes.spindle_moves import check_speeds, check_spindle_heights
from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones, zone_boxes

if TYPE_CHECKING:
    from leafcut.model.mesh import Mesh
    from leafcut.processes.drilling.plan.work_surface import WorkSurface

#: Height of tool changes above Z0 if the machine has no safe height, mm.
TOOL_CHANGE_HEIGHT = 25.0
#: Clearance of travel moves from the surface and from fixtures, in both vertical and horizontal direction, mm.
SURFACE_CLEARANCE = 2.0
#: A warning is issued if the tip of a tool goes farther below the part than this, mm. The tool may hit the table, a
#: vise or a parallel.
FAR_BELOW = 3.0
#: A note is issued if the tip of a tool goes farther below a circuit board than this, mm. Many backing boards are only
#: 2 mm thick.
BELOW_BOARD = 1.0
#: Default depth of a centre drill as a share of its diameter. At this depth, the cone is large enough to centre the
#: drill.
CENTRE_DEPTH_RATIO = 0.4
#: Length of the tapered lead of a tap, in pitches: 3.5 to 5 for a plug tap (DIN 2197, form B).
TAP_LEAD = 5.0


@dataclass(frozen=True, eq=False)
class DrillOperation:
    """An operation makes all holes or slots of one tool, and runs the same drilling cycle at each of them.

    Attributes
    ----------
    targets
        Indices of the holes, or of the slots if `slots` is set, int32[k].
    tips
        For counterbores and countersinks, the depth of the tip below the top of each hole, float64[k], mm; otherwise
        None.
    """

    tool: Tool
    cycle: DrillCycle
    targets: NDArray[np.int32]
    slots: bool = False
    tips: NDArray[np.float64] | None = None

    def bottoms(self, tops: NDArray[np.float64], deeper: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the lowest height of the tip in each hole, float64[k], mm. The operation must not cut slots.

        `tops` and `deeper` have an entry for each hole of the part (see `DrillPlan`).
        """
        if self.tips is not None:
            return tops[self.targets] - self.tips
        # A centre drill has the same depth everywhere.
        depth = 0.0 if self.tool.kind is ToolKind.CENTRE_DRILL else deeper[self.targets]
        return np.asarray(tops[self.targets] - depth + self.cycle.bottom)


@dataclass(frozen=True, eq=False)
class DrillPlan:
    """Drilling operations in machining order, and the data they share, mm.

    - `zones`: rectangles in which nothing may be drilled, float64[k, 4]
    - `zone_heights`: minimum height of a rapid across each zone, at most the clearance height, float64[k]
    - `tops`: height from which the depth of each hole is measured, float64[n]
    - `r_planes`: R plane of each hole, float64[n]
    - `deeper`: depth of each hole in addition to the depth of the cycle, float64[n]
    - `reliefs`: travel heights of each operation over `work_surface`; empty for a flat part
    """

    part: Part
    operations: tuple[DrillOperation, ...]
    clearance_height: float
    retract_height: float
    tool_change_height: float
    always_initial: bool
    zones: NDArray[np.float64]
    zone_heights: NDArray[np.float64]
    start: tuple[float, float] | None
    end: tuple[float, float] | None
    tops: NDArray[np.float64]
    r_planes: NDArray[np.float64]
    deeper: NDArray[np.float64]
    issues: tuple[Issue, ...]
    work_surface: WorkSurface | None = None
    reliefs: tuple[Relief, ...] = ()
    made_for: str = ""

    @property
    def tools(self) -> tuple[Tool, ...]:
        """The tools in the order in which they are used, without duplicates."""
        return tuple({o.tool.number: o.tool for o in self.operations}.values())

    def zones_for(self, tool: Tool, tip: float) -> NDArray[np.float64]:
        """Return the rectangles that the centre of a tool must avoid, float64[k, 4], mm.

        The tip of the tool is at the height `tip`, mm.

        Each zone grows by the largest radius that tool, shank and holder have below the height of the zone.
        """
        return widen_zones(self.zones, self.radii_below_zones(tool, tip))

    def radii_below_zones(self, tool: Tool, tip: float) -> NDArray[np.float64]:
        """For each zone, return the largest radius that tool, shank and holder have below its height, float64[k], mm.

        `tip` is the height of the tool tip, mm.
        """
        radius, cone = tip_radius_and_discs(tool)
        return widest_radius_below(radius, [*cone, *shank_and_holder_discs(tool)], tip, self.zone_heights)

    def high_zones_for(self, tool: Tool) -> NDArray[np.float64]:
        """Return the rectangles of `zones_for` that are too high for rapids at the retract height to cross."""
        return self.zones_for(tool, self.retract_height)[self.zone_heights > self.retract_height]


def plan_drilling(
    part: Part,
    machine: Machine,
    library: ToolLibrary | None,
    job: JobOptions,
    options: DrillOptions,
    mesh: Mesh | None = None,
    fixture: Mesh | None = None,
    *,
    drawn: bool = False,
) -> DrillPlan:
    """Plan the operations for all holes and slots of `part`.

    If a hole needs several tools (centre drill, drill, tap), they are used in the order of its recipe. Each tool is
    mounted only once, unless the recipes make this impossible. Tools are sorted by kind, and then by diameter. If a
    `mesh` of the surface is given, each hole starts on the surface, and travel moves are as low as the surface and the
    `fixture` allow. If `drawn` is set, each hole starts at the height at which it is drawn.

    Raises
    ------
    PlanError
        If no tool fits a hole, a hole is too deep for its tool, or the recipes contradict each other.
    OptionError
        If options are invalid or contradict each other.
    """
    if not part.holes and not part.slots:
        reasons = [Message.joined("; ", (issue.message for issue in part.issues))] if part.issues else []
        raise PlanError(Message.joined(": ", (part.name, Message("there are no holes to drill"), *reasons)))
    refuse_unknown_depth(part, job)
    work_surface = _work_surface(part, mesh, job, options, fixture)
    if work_surface is not None and work_surface.clearance > job.clearance_height:
        raise PlanError(
            "--clearance-height {:g} mm is less than the {:g} mm that moves "
            "keep from the surface; give a larger --clearance-height",
            job.clearance_height,
            work_surface.clearance,
        )
    chooser = ToolChooser(library, machine, job, options, board=part.format == "excellon")
    deeper = np.zeros(len(part.holes))
    underside = np.full(len(part.holes), -np.inf)
    if work_surface is None:
        tops, height_issues = _hole_tops(part, drawn)
        surface = tops
        if job.thickness is not None:
            underside = tops - job.thickness
        work = _collect_targets(part, chooser)
    else:
        work = _collect_targets(part, chooser)
        radii = _widest_radii(part, work)
        from leafcut.processes.drilling.plan.work_surface import measure_hole_tops

        measured = measure_hole_tops(
            part, work_surface, radii, _cut_radius_function(part, work, radii), drawn or part.has_hole_depths
        )
        tops, surface, height_issues = measured.tops, np.maximum(measured.tops, measured.surface), measured.issues
        # A hole that opens into a cavity ends there, above the underside of the part.
        exits = [hole.z - hole.depth if hole.through and hole.depth is not None else -np.inf for hole in part.holes]
        underside = np.maximum(measured.under, exits)
        if job.is_through:
            thickness = tops - measured.under
            job = replace(job, depth=None, thickness=float(thickness.min()))
            deeper = thickness - thickness.min()
        elif part.has_hole_depths and job.depth is None and job.thickness is None:
            job, deeper = _depths_of_solid(part, work, job)
    wide, wide_issues = _add_counterbore_tools(part, chooser, work, work_surface)
    highest = float(tops.max(initial=0.0)) if work_surface is None else max(work_surface.top_z, 0.0)
    raised_job = replace(
        job, clearance_height=job.clearance_height + highest, retract_height=job.retract_height + highest
    )
    check_spindle_heights(machine, raised_job, "drill")
    refuse_higher_zones(job.keep_out, raised_job.clearance_height)
    # Without a surface, the space between holes of different heights is unknown: travel above the highest hole.
    initial = job.retract == "initial" or (work_surface is None and bool(len(tops) and np.ptp(tops)))
    rule = depth_rule(job, options)
    groups = _order_tools(list(work), chooser.tool_sequences)
    operations = tuple(
        _build_counterbore_operation(step, work[step], wide[step], job, initial)
        if step.wide
        else _build_operation(step, work[step], rule, job, options, initial)
        for step in groups
    )
    for operation in operations:
        check_speeds(operation.tool, machine, job.spindle_speed)
    _check_flutes(operations, tops, deeper)
    if work_surface is not None:
        _check_tools_on_surface(part, operations, tops, deeper, work_surface)
    plan = DrillPlan(
        part=part,
        operations=operations,
        clearance_height=raised_job.clearance_height,
        retract_height=raised_job.retract_height,
        tool_change_height=TOOL_CHANGE_HEIGHT + highest,
        always_initial=initial,
        tops=tops,
        r_planes=(surface + job.retract_height).round(6),
        deeper=deeper,
        zones=parse_zones(job.keep_out),
        zone_heights=crossing_heights(job.keep_out, raised_job.clearance_height),
        start=plane_point(job.start_point),
        end=plane_point(job.end_point),
        issues=(
            *height_issues,
            *wide_issues,
            *chooser.issues(),
            *(note for o in operations if (note := tap_lead_issue(o.tool, rule)) is not None),
            *_break_through_issues(part, operations, rule, tops, deeper, underside),
            *_stroke_issues(part, operations, tops, deeper, underside),
        ),
        work_surface=work_surface,
    )
    _check_zones(plan)
    if work_surface is None or initial:
        return plan
    return replace(
        plan, reliefs=tuple(_safe_travel_heights(plan, work_surface, machine, operation) for operation in operations)
    )


def _depths_of_solid(
    part: Part, work: dict[Step, list[int]], job: JobOptions
) -> tuple[JobOptions, NDArray[np.float64]]:
    """Return the job with an adapted thickness, and the additional depth of each hole, mm.

    The thickness becomes the depth of the shallowest hole.

    Each hole of a solid has its own depth. In a through hole, the full diameter of the drill goes below the part by the
    break-through, as in a plate. In a blind hole, the full diameter ends at the depth of the hole. If a blind hole has
    a flat floor, the point of the drill ends there instead.
    """
    depths = np.array([hole.depth or 0.0 for hole in part.holes])
    points = np.zeros(len(depths))
    for step, targets in work.items():
        if step.tool.kind is ToolKind.DRILL:
            points[targets] = np.maximum(points[targets], step.tool.point_length)
    through = np.array([hole.through for hole in part.holes])
    flat = np.array([hole.flat for hole in part.holes])
    deeper = depths - np.where(through, 0.0, job.break_through) - np.where(flat, points, 0.0)
    shallow = int(np.argmin(deeper))
    least = float(deeper[shallow])
    if least <= 0.0:
        hole = part.holes[shallow]
        raise PlanError(
            "the hole at ({:g}, {:g}) has a flat floor {:.3g} mm deep, but the point of its drill is longer "
            "than that; set --depth, or leave the hole out with --max-diameter or --min-diameter",
            hole.x,
            hole.y,
            hole.depth,
        )
    return replace(job, thickness=least), deeper - least


def _work_surface(
    part: Part, mesh: Mesh | None, job: JobOptions, options: DrillOptions, fixture: Mesh | None
) -> WorkSurface | None:
    if job.is_through and job.thickness is not None:
        raise OptionError("--depth through and --thickness both set the depth of the holes; leave out one of them")
    if mesh is None:
        if job.is_through:
            raise OptionError("--depth through needs --surface; for a plate, give --thickness")
        return None
    if part.slots:
        raise PlanError(
            "{}: slots cannot be milled on an uneven surface; leave out --surface, or exclude the slots with --layers",
            part.name,
        )
    from leafcut.processes.drilling.plan.work_surface import WorkSurface, validate_fixture

    boxes, issues = zone_boxes(job.keep_out, float(mesh.low[2])), list[Issue]()
    if fixture is not None:
        fixture, issues = validate_fixture(fixture, mesh)
    return WorkSurface(mesh, boxes, SURFACE_CLEARANCE, fixture, tuple(issues))


def _widest_radii(part: Part, work: dict[Step, list[int]]) -> NDArray[np.float64]:
    radii = np.zeros(len(part.holes))
    for step, targets in work.items():
        if not step.slots:
            radii[targets] = np.maximum(radii[targets], 0.5 * step.tool.diameter)
    return radii


def _check_tools_on_surface(
    part: Part,
    operations: Sequence[DrillOperation],
    tops: NDArray[np.float64],
    deeper: NDArray[np.float64],
    work_surface: WorkSurface,
) -> None:
    from leafcut.processes.drilling.plan.work_surface import (
        check_fixture_collisions,
        check_shank_and_holder,
        check_tool_width,
    )

    widths = np.array([max([hole.diameter, *(step.diameter for step in hole.steps)]) for hole in part.holes])
    for operation in operations:
        points, lowest = part.hole_xy[operation.targets], operation.bottoms(tops, deeper)
        check_shank_and_holder(operation.tool, points, tops[operation.targets], lowest, work_surface)
        check_fixture_collisions(points, lowest, 0.5 * operation.tool.diameter, work_surface)
        if part.has_hole_depths:
            check_tool_width(
                operation.tool, points, widths[operation.targets], tops[operation.targets], lowest, work_surface
            )


def _cut_radius_function(
    part: Part, work: dict[Step, list[int]], radii: NDArray[np.float64]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return a function that computes the largest radius that is cut at each hole, mm.

    The function takes the height of the material above the top of each hole, mm. A centre drill only cuts with its
    point. The radius is never smaller than the hole, unless all tools of the hole are smaller.
    """

    def widest(above: NDArray[np.float64]) -> NDArray[np.float64]:
        cut = np.minimum(radii, [0.5 * hole.diameter for hole in part.holes])
        for step, targets in work.items():
            if step.slots:
                continue
            cutter = cutter_of_tool(step.tool)
            reach = np.full(len(targets), cutter.radius)
            if step.tool.kind is ToolKind.CENTRE_DRILL:
                deep = above[targets] + centre_depth(step.tool)
                reach = np.array([cutter.radius_at(depth) for depth in deep.tolist()])
            cut[targets] = np.maximum(cut[targets], reach)
        return cut

    return widest


def _safe_travel_heights(
    plan: DrillPlan, work_surface: WorkSurface, machine: Machine, operation: DrillOperation
) -> Relief:
    return work_surface.safe_travel_heights(
        machine,
        operation.tool,
        plan.part.hole_xy[operation.targets].round(6),
        plan.r_planes[operation.targets],
        plan.clearance_height,
        widen_zones(plan.zones[plan.zone_heights >= plan.clearance_height], 0.5 * operation.tool.diameter),
    )


def _add_counterbore_tools(
    part: Part, chooser: ToolChooser, work: dict[Step, list[int]], work_surface: WorkSurface | None
) -> tuple[dict[Step, list[float]], list[Issue]]:
    """Add the tools for counterbores and countersinks to `work`.

    If a tool is wider than its countersink, it needs free space around the top of the hole. The function returns the
    depths of the tips, mm, and an issue about holes without a suitable tool.
    """
    wide: dict[Step, list[float]] = {}
    unmade = []
    for index, hole in enumerate(part.holes):
        for wide_part in hole.steps:
            step = chooser.step_for_counterbore(hole, wide_part)
            radius = 0.0 if step is None else 0.5 * step.tool.diameter
            if (
                step is not None
                and work_surface is not None
                and not work_surface.is_clear(hole.x, hole.y, radius, hole.z)
            ):
                step = None
            if step is None:
                unmade.append((hole, wide_part))
                continue
            tip = wide_part.tip - (
                0.5 * step.tool.tip_diameter / math.tan(0.5 * wide_part.angle) if wide_part.angle < math.pi else 0.0
            )
            work.setdefault(step, []).append(index)
            wide.setdefault(step, []).append(tip)
    if not unmade:
        return wide, []
    hole, wide_part = unmade[0]
    holes = len({id(hole) for hole, _ in unmade})
    issue = Issue(
        "L217",
        Message(
            "the program drills only the narrow part of {} with a counterbore, countersink or undercut, such "
            "as the one at ({:g}, {:g}), Ø {:g} mm and {:.3f} mm deep; to machine the wide part, add an end "
            "mill of its diameter or a chamfer mill of its angle to --tools",
            count_of(holes, "hole"),
            hole.x,
            hole.y,
            wide_part.diameter,
            wide_part.depth,
        ),
        missing=MissingWork("wide part", len(unmade), tuple((hole.x, hole.y) for hole, _ in unmade)),
    )
    return wide, [issue]


def _build_counterbore_operation(
    step: Step, targets: list[int], tips: list[float], job: JobOptions, initial: bool
) -> DrillOperation:
    tool = step.tool
    dwell = tool.dwell or 0.0
    cycle = DrillCycle("G82" if dwell else "G81", job.retract_height, -min(tips), to_initial=initial, dwell=dwell)
    return DrillOperation(tool, cycle, np.array(targets, dtype=np.int32), tips=np.array(tips, dtype=np.float64))


def _check_flutes(
    operations: tuple[DrillOperation, ...], tops: NDArray[np.float64], deeper: NDArray[np.float64]
) -> None:
    for operation in operations:
        if operation.slots or operation.tips is not None:
            continue
        deepest = float((tops[operation.targets] - operation.bottoms(tops, deeper)).max(initial=0.0))
        if operation.tool.flute_length is not None and deepest > operation.tool.flute_length + 1e-9:
            raise PlanError(
                "{} cuts {:g} mm deep at most, but the part is {:.3g} mm thick at its thickest hole; use a longer tool",
                operation.tool.label,
                operation.tool.flute_length,
                deepest,
            )


def _hole_tops(part: Part, drawn: bool) -> tuple[NDArray[np.float64], list[Issue]]:
    """Return the height of the top of each hole, mm, and a note if holes are not drawn at Z0.

    Unless `drawn` is set, all holes start at Z0. Holes that are drawn at several heights are then refused, because some
    of them would be drilled too deep or not at all.
    """
    if drawn:
        tops = np.array([hole.z for hole in part.holes], dtype=np.float64)
        heights_seen: dict[tuple[float, float], float] = {}
        for hole in part.holes:
            height = heights_seen.setdefault((round(hole.x, 2), round(hole.y, 2)), hole.z)
            if abs(height - hole.z) > SAME_HEIGHT:
                raise PlanError(
                    "{}: with --z-zero drawn, only one hole may lie at ({:g}, {:g}), but one is drawn at Z{:g} "
                    "and another at Z{:g}; select one of them with --layers or --max-diameter",
                    part.name,
                    hole.x,
                    hole.y,
                    height,
                    hole.z,
                )
        return tops, []
    heights = HeightCount.of((hole.x, hole.y, hole.z) for hole in part.holes)
    if heights.differ:
        raise PlanError(
            "{}: the holes are drawn at different heights: {}; all of them are drilled from Z0, so use "
            "--z-zero drawn, select a single height with --layers, or draw the holes at the same height",
            part.name,
            heights,
        )
    return np.zeros(len(part.holes)), heights.notes("holes")


def _break_through_issues(
    part: Part,
    operations: tuple[DrillOperation, ...],
    rule: DepthRule,
    tops: NDArray[np.float64],
    deeper: NDArray[np.float64],
    underside: NDArray[np.float64],
) -> list[Issue]:
    """Warn if the tip of a tool goes far below the part. For a circuit board, the result is only a note.

    `underside` is the height of the underside at each hole, mm, or −∞ if it is unknown.
    """
    farthest, count, label, point = BELOW_BOARD if part.format == "excellon" else FAR_BELOW, 0, "", (0.0, 0.0)
    for operation in operations:
        if operation.slots:
            below = np.full(len(operation.targets), -operation.cycle.bottom - rule.depth if rule.through else -np.inf)
        else:
            below = underside[operation.targets] - operation.bottoms(tops, deeper)
        far = np.flatnonzero(below > FAR_BELOW + 1e-9)
        count += len(far)
        if float(below.max(initial=0.0)) > farthest + 1e-9:
            farthest, target = float(below.max()), int(operation.targets[np.argmax(below)])
            label = operation.tool.label
            point = part.slots[target].start if operation.slots else (part.holes[target].x, part.holes[target].y)
    if not label:
        return []
    if not count:
        message = Message("{} exits up to {:.2f} mm below the board; use a thicker backing board", label, farthest)
        return [Issue("L402", message, severity=Severity.NOTE)]
    message = Message(
        "{} at ({:g}, {:g}) exits {:.2f} mm below the part ({} with more than {:g} mm); leave room for the tip "
        "below the part, or use a smaller --break-through",
        label,
        point[0],
        point[1],
        farthest,
        count_of(count, "place"),
        FAR_BELOW,
    )
    return [Issue("L404", message)]


def _stroke_issues(
    part: Part,
    operations: tuple[DrillOperation, ...],
    tops: NDArray[np.float64],
    deeper: NDArray[np.float64],
    underside: NDArray[np.float64],
) -> list[Issue]:
    """Warn about each drill whose stroke is longer than `LONGEST_STROKE`, except on circuit boards."""
    issues: list[Issue] = []
    for operation in operations if part.format != "excellon" else ():
        if operation.slots or operation.tips is not None or operation.tool.kind is not ToolKind.DRILL:
            continue
        depths = tops[operation.targets] - np.maximum(operation.bottoms(tops, deeper), underside[operation.targets])
        strokes = np.minimum(depths, operation.cycle.peck) if operation.cycle.name in PECKING else depths
        limit = LONGEST_STROKE * operation.tool.diameter
        deep = np.flatnonzero(strokes > limit + SAME_HEIGHT)
        if not len(deep):
            continue
        number = int(deep[np.argmax(depths[deep])])
        hole = part.holes[int(operation.targets[number])]
        depth, stroke = float(depths[number]), float(strokes[number])
        drills = Message(
            "{} at ({:g}, {:g}) drills {:.4g} mm deep, which is {:.1f} diameters",
            operation.tool.label,
            hole.x,
            hole.y,
            depth,
            depth / operation.tool.diameter,
        )
        holes = count_of(len(deep), "hole")
        if stroke < depth:
            detail = Message("{} with strokes longer than {:g} diameters", holes, LONGEST_STROKE)
            message = Message("{}, in strokes of {:.4g} mm ({}); use a smaller peck", drills, stroke, detail)
        else:
            detail = Message("{} deeper than {:g} diameters", holes, LONGEST_STROKE)
            message = Message(
                "{}, in one stroke ({}); give --peck, or set the tool's 'cycle' to G83 and its 'peck' in the library",
                drills,
                detail,
            )
        issues.append(Issue("L446", message))
    return issues


def _check_zones(plan: DrillPlan) -> None:
    for operation in plan.operations:
        if operation.slots:
            slots = [plan.part.slots[t] for t in operation.targets]
            starts, ends = np.array([s.start for s in slots]), np.array([s.end for s in slots])
        else:
            starts = ends = plan.part.hole_xy[operation.targets]
        kind, tool = "slot" if operation.slots else "hole", operation.tool
        tips = np.full(len(starts), operation.cycle.bottom)
        if not operation.slots:
            tips = operation.bottoms(plan.tops, plan.deeper)
        radii = widest_radius_below(*tip_radius_and_discs(tool), float(tips.min()), plan.zone_heights)
        inside = np.flatnonzero(touches_any_zone(starts, ends, widen_zones(plan.zones, radii)))
        if len(inside):
            x, y = starts[inside[0]]
            raise PlanError(
                "the slot at ({:g}, {:g}) is in a keep-out zone, or closer to it than the radius of {} ({} in "
                "all); change --keep-out, or leave them out"
                if operation.slots
                else "the hole at ({:g}, {:g}) is in a keep-out zone, or closer to it than the radius of {} ({} in "
                "all); change --keep-out, or leave them out",
                x,
                y,
                tool.label,
                count_of(len(inside), kind),
            )
        if not shank_and_holder_discs(tool) or not len(plan.zones):
            continue
        distances = _distances_to_zones(starts, ends, plan.zones)
        hits = [k for k, tip in enumerate(tips.tolist()) if (distances[k] <= plan.radii_below_zones(tool, tip)).any()]
        if hits:
            x, y = starts[hits[0]]
            raise PlanError(
                "{}: at ({:g}, {:g}), its shank or holder enters a keep-out zone below the height of the zone "
                "({} in all); use a longer tool, change --keep-out, or leave them out",
                tool.label,
                x,
                y,
                count_of(len(hits), kind),
            )


def _distances_to_zones(
    starts: NDArray[np.float64], ends: NDArray[np.float64], zones: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance of each straight cut from each keep-out zone, float64[n, k], mm.

    `starts` and `ends` are float64[n, 2], and `zones` are float64[k, 4].
    """
    import shapely  # imported here because most tools have no known holder

    cuts: Any = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)))
    is_point = (starts == ends).all(axis=1)
    cuts[is_point] = shapely.points(ends[is_point])
    boxes: Any = shapely.box(*zones.T)
    distances: NDArray[np.float64] = shapely.distance(cuts[:, None], boxes[None, :])
    return distances


def _collect_targets(part: Part, chooser: ToolChooser) -> dict[Step, list[int]]:
    """For each step, return the indices of the holes or slots that the step makes, in file order."""
    work: dict[Step, list[int]] = {}
    for index, hole in enumerate(part.holes):
        for step in chooser.steps_for_hole(hole):
            work.setdefault(step, []).append(index)
    for index, slot in enumerate(part.slots):
        work.setdefault(chooser.step_for_slot(slot), []).append(index)
    return work


_KIND_ORDER = {kind: position for position, kind in enumerate(ToolKind)}


def _order_tools(steps: list[Step], sequences: Sequence[Sequence[Step]]) -> list[Step]:
    """Sort the steps by kind (centre drills first) and diameter, but never put a step before its predecessors."""
    predecessors: dict[Step, set[Step]] = {step: set() for step in steps}
    for sequence in sequences:
        for k, step in enumerate(sequence):
            predecessors[step].update(sequence[:k])
    order: list[Step] = []
    remaining = sorted(steps, key=lambda s: (s.slots, _KIND_ORDER[s.tool.kind], s.tool.diameter, s.tool.number))
    while remaining:
        ready = next((s for s in remaining if not predecessors[s] - set(order)), None)
        if ready is None:
            names = ", ".join(s.tool.label for s in remaining)
            raise PlanError(
                "the recipes contradict each other: they require a circular order of {}; change a recipe",
                names,
            )
        order.append(ready)
        remaining.remove(ready)
    return order


def _build_operation(
    step: Step, targets: list[int], rule: DepthRule, job: JobOptions, options: DrillOptions, initial: bool
) -> DrillOperation:
    tool = step.tool
    bottom = -rule.tip_depth(tool)
    if tool.flute_length is not None and -bottom > tool.flute_length + 1e-9:
        raise PlanError(
            "{} cuts {:g} mm deep at most, but the hole requires {:.3g} mm{}; use a longer tool",
            tool.label,
            tool.flute_length,
            -bottom,
            "" if tool.kind is ToolKind.CENTRE_DRILL else rule.option_text,
        )
    cycle = DrillCycle(
        name=_cycle_name(tool, options),
        r_plane=job.retract_height,
        bottom=bottom,
        to_initial=initial,
        peck=_first_given_value(tool.peck, options.peck if tool.kind is ToolKind.DRILL else None),
        dwell=_first_given_value(tool.dwell, options.dwell if tool.kind is ToolKind.DRILL else None),
    )
    return DrillOperation(tool, _checked_cycle(cycle, tool), np.array(targets, dtype=np.int32), step.slots)


def _first_given_value(*values: float | None) -> float:
    return next((v for v in values if v is not None), 0.0)


def _cycle_name(tool: Tool, options: DrillOptions) -> str:
    if tool.cycle:
        return tool.cycle
    if tool.kind is ToolKind.TAP:
        return "G84"
    if tool.kind is ToolKind.REAMER:
        return "G85"
    if tool.kind is not ToolKind.DRILL:
        return "G82" if tool.dwell else "G81"
    if options.cycle:
        return options.cycle
    if _first_given_value(tool.peck, options.peck):
        return "G83"
    return "G82" if _first_given_value(tool.dwell, options.dwell) else "G81"


def _checked_cycle(cycle: DrillCycle, tool: Tool) -> DrillCycle:
    """Remove all parameters that a drilling cycle does not use.

    Raises PlanError if a parameter is missing, or if the tool cannot run the cycle.
    """
    if cycle.name in ("G83", "G73") and not cycle.peck:
        raise PlanError(
            "{}: {} needs a peck depth; give --peck, or set 'peck' for the tool in the library", tool.label, cycle.name
        )
    if cycle.name == "G82" and not cycle.dwell:
        raise PlanError("{}: G82 needs a dwell; give --dwell, or set 'dwell' for the tool in the library", tool.label)
    if cycle.name == "G84" and tool.kind is not ToolKind.TAP:
        raise PlanError("{}: G84 is a tapping cycle, but this tool is not a tap; choose another --cycle", tool.label)
    return DrillCycle(
        name=cycle.name,
        r_plane=cycle.r_plane,
        bottom=cycle.bottom,
        to_initial=cycle.to_initial,
        peck=cycle.peck if cycle.name in ("G83", "G73") else 0.0,
        dwell=cycle.dwell if cycle.name in ("G82", "G84") else 0.0,
    )


# -- depths ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DepthRule:
    """The depth of holes, mm below the surface.

    If `through` is set, the full diameter of the tool goes `break_through` mm below the plate. The point goes even
    deeper.
    """

    depth: float
    through: bool
    to_shoulder: bool
    break_through: float
    thickness: float | None = None

    @property
    def option_text(self) -> str:
        """The option that determines the depth, as text for a message, for example `` for --thickness 80 mm``."""
        return f" for {'--thickness' if self.through else '--depth'} {self.depth:g} mm"

    def tip_depth(self, tool: Tool) -> float:
        """Return the depth of a tool's tip below the surface, mm.

        Raises PlanError if a tap or a reamer would hit the cone that the point of the drill leaves, or if a blind hole
        would break through.
        """
        if tool.kind is ToolKind.CENTRE_DRILL:
            return centre_depth(tool)
        if self.through:
            return self.depth + self.break_through + tool.point_length
        if tool.kind in (ToolKind.TAP, ToolKind.REAMER) and not self.to_shoulder:
            raise PlanError(
                "{} would break at the bottom, because the drill before it reaches {:g} mm only with its tip; "
                "give --thickness, or --depth with --depth-to shoulder",
                tool.label,
                self.depth,
            )
        tip = self.depth + (tool.point_length if self.to_shoulder else 0.0)
        if self.thickness is not None and self.depth < self.thickness < tip:
            raise PlanError(
                "a hole of --depth {:g} mm in a plate of {:g} mm is blind, but the tip of "
                "{} would go {:.3g} mm deep; use a smaller --depth or --depth-to tip, or leave --depth "
                "out for through holes",
                self.depth,
                self.thickness,
                tool.label,
                tip,
            )
        return tip


def centre_depth(tool: Tool) -> float:
    """Return the depth of the tip of a centre drill below the surface, mm.

    If the depth of the tool is not stated, it is a fraction of the diameter.
    """
    return tool.depth if tool.depth is not None else CENTRE_DEPTH_RATIO * tool.diameter


def tap_lead_issue(tool: Tool, rule: DepthRule) -> Issue | None:
    """Return a note if a through hole ends with incomplete threads because of the lead of the tap.

    The tap does not go deeper automatically. The space below is unknown, and a tap that hits the table breaks.
    """
    lead = TAP_LEAD * tool.pitch if tool.pitch else 0.0
    if not rule.through or rule.break_through >= lead:
        return None
    return Issue(
        "L402",
        Message(
            "{} ends {:g} mm below the plate, but its tapered lead may be {:g} mm long; for a full thread at "
            "the exit, set a larger --break-through if there is room below the plate",
            tool.label,
            rule.break_through,
            lead,
        ),
        severity=Severity.NOTE,
    )


def refuse_unknown_depth(part: Part, job: JobOptions) -> None:
    """Raise `OptionError` if neither the options nor the drawing of a part state the depth of the holes."""
    if job.depth is None and job.thickness is None and not part.has_hole_depths:
        raise OptionError(
            "{}: drilling needs a depth; give --thickness 6mm (through holes), --depth 5mm (blind holes), or "
            "--depth 1mm --depth-to tip (spots only)",
            part.name,
        )


def depth_rule(job: JobOptions, options: DrillOptions) -> DepthRule:
    """Derive the depth rule from the options. Raises PlanError if depth and thickness contradict each other."""
    to_shoulder = options.depth_to == "shoulder"
    depth = job.blind_depth
    if depth is None:
        assert job.thickness is not None
        return DepthRule(job.thickness, True, to_shoulder, job.break_through)
    if job.thickness is not None and depth > job.thickness:
        raise PlanError(
            "--depth {:g} mm is more than --thickness {:g} mm; leave --depth out for through holes",
            depth,
            job.thickness,
        )
    return DepthRule(depth, False, to_shoulder, 0.0, job.thickness)
