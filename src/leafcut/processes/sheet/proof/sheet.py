"""Check a cutting program by comparing its effect on the sheet with the drawing.

The check does not use any planning code. It only takes the user's requests from the plan: feeds, directions, and the
data of the chart.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from leafcut.errors import count_of
from leafcut.gcode.dialects import Dialect
from leafcut.geometry.arrays import Points
from leafcut.geometry.index import ShapeIndex
from leafcut.message import Message
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.kinds import CutMethod, first_word_of_process
from leafcut.model.machine import Machine
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.sheet.proof.matched_runs import MOST, PIECE, CutRequest, MatchedRuns, RunMatch, sheet_difference
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, Target
from leafcut.processes.sheet.proof.torch import check_torch
from leafcut.processes.sheet.proof.torch_runs import TorchRun, burning_sections, torch_runs
from leafcut.proof.difference import limit_differences, position_text
from leafcut.proof.envelope import check_machine_limits

#: A path counts as cut twice if runs follow it over this multiple of its length.
TWICE = 1.9
#: Uncut sections of a path that are shorter than this are rounding errors, mm.
SHORT = 0.1
#: Spacing of the points at which bridges are checked, in kerf widths.
BRIDGE_STEP = 0.2
#: A bridge must leave the kerfs around its start within this distance, in kerf widths.
LEAVES_WITHIN = 4.0
#: Consecutive sections of a run may overlap by this length, mm.
OVERLAP = 0.2
#: Methods whose arc or flame goes out when it crosses a kerf.
NEED_METAL = (CutMethod.PLASMA, CutMethod.OXYFUEL)
#: Kerfs coincide if they overlap over at least this length, in kerf widths and in mm. Over a shorter length, they
#: cross.
CROSSING_KERFS, CROSSING = 1.0, 0.2
#: A line may meet an earlier line only within this distance from its end, mm.
AT_END = 0.1
#: Spacing of the points at which moves are checked, mm; and depth inside a part from which a move counts as crossing
#: the part, mm.
_MOVE_STEP, _DEPTH = 0.5, 0.3
#: Tolerance for the distance between head and part, mm. It is needed because this check uses other chords for curved
#: edges than the planner.
_LEEWAY = 0.2


def check_sheet(
    sheet: Sheet, plan: CutPlan, text: str, path: Toolpath, dialect: Dialect, machine: Machine, asked: CutRequest
) -> list[Difference]:
    """Check a cutting program and return its faults. `path` is the motion that was read back from the `text`.

    The program is verified if it obeys these rules:

    1. Each contour that the kerf fits is cut exactly once and completely, and marks are marked.
    2. No kerf touches the material of a part, a clamp, or the air beyond the edge of the sheet.
    3. Inner contours are cut before outer contours, and marks before the outline around them.
    4. Each pierce is in scrap that is still attached.
    5. The torch is off during rapids at clearance height. Touching off, pierces, feeds and directions are as planned.
    6. Between the contours of a run, the torch stays in attached scrap and enters no other kerf.
    7. Common lines are cut before the outline around their parts, and by no other run.
    8. A head that stays down between cuts crosses no more detached parts than the plan reports.
    9. All moves are within the travel of the machine.
    """
    by_register = dialect.torch is not None and dialect.torch.compensation == "G41"
    runs = torch_runs(path, plan.data.kerf if by_register else None)
    found = check_torch(path, runs, plan, text, dialect, asked)
    matched = MatchedRuns(runs, plan, sheet, dialect, asked)
    for check in CHECKS:
        found += check(matched)
    found += check_detached_parts(matched, path, dialect, machine.nozzle_diameter)
    return limit_differences([*found, *check_machine_limits(path, machine)])


def uncut_contour_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is not cut, or not cut completely."""
    found = []
    for target in matched.targets:
        claims = matched.of_target.get(target.index, [])
        if target.may_stay and not claims:
            continue
        gaps = _uncut_stretches(matched, target, [matched.lines[c.run] for c in claims])
        if sum(g.length for g in gaps) > MOST * target.centreline.length:
            found.append(
                sheet_difference(
                    Message("not marked") if target.marks else Message("not cut"),
                    Message("{} is not marked" if target.marks else "{} is not cut", target.name),
                    _first_line(matched.runs, claims),
                )
            )
            continue
        joints = 0 if target.marks or target.source.is_hole else matched.asked.joints
        widest = matched.asked.joint_width + 2.0 * matched.asked.half + 2.0 * TOLERANCE
        bare = gaps if len(gaps) > joints else [g for g in gaps if g.length > widest]
        if bare:
            x, y = bare[0].interpolate(0.5, normalized=True).coords[0]
            text = Message(
                "{} is not marked all the way: {:.3f} mm are left at {}"
                if target.marks
                else "{} is not cut all the way: {:.3f} mm are left at {}",
                target.name,
                bare[0].length,
                position_text(x, y),
            )
            found.append(sheet_difference(Message("incomplete"), text, _first_line(matched.runs, claims)))
    return found


def _uncut_stretches(matched: MatchedRuns, target: Target, lines: Sequence[Any]) -> list[Any]:
    """Return the sections of the path of a target that no run follows.

    Arcs around corners with a loop are not included.
    """
    if not lines:
        return [target.centreline]
    burnt = shapely.union_all(lines)
    left = target.centreline.difference(burnt.buffer(1.5 * TOLERANCE))
    if target.shape is not None and len(pieces := shapely.get_parts(left)) > 1:
        left = shapely.line_merge(shapely.multilinestrings(pieces))
    return [g for g in shapely.get_parts(left) if g.length > SHORT and not _is_corner_arc(matched, target, g, burnt)]


def _is_corner_arc(matched: MatchedRuns, target: Target, gap: Any, burnt: Any) -> bool:
    """Return whether an uncut section is the arc around a corner, and the kerfs reach the corner anyway."""
    half = matched.asked.half
    if not len(target.corners):
        return False
    points = shapely.points(gap.coords)
    corners: Any = shapely.points(target.corners)
    near = corners[shapely.dwithin(corners, gap, half + TOLERANCE)]
    return any(
        np.all(np.abs(shapely.distance(corner, points) - half) < TOLERANCE)
        and shapely.distance(corner, burnt) < half + 2.0 * TOLERANCE
        for corner in near
    )


def repeated_cut_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut twice, and for each run that does not follow any contour."""
    found = []
    for claims in matched.of_target.values():
        target = claims[0].target
        whole = [
            c
            for c in claims
            if c.followed > MOST * target.centreline.length and not matched.only_follows_common_line(c)
        ]
        if len(whole) > 1 or any(c.followed > TWICE * target.centreline.length for c in whole):
            lines = ", ".join(str(matched.runs[c.run].line) for c in whole)
            text = Message("{} is cut more than once, from line {}", target.name, lines)
            found.append(sheet_difference(Message("cut twice"), text, matched.runs[whole[-1].run].line))
    used = {c.run for c in matched.claims}
    for number, run in enumerate(matched.runs):
        if number not in used:
            start = position_text(*run.start)
            text = Message("the cut from {} is not in the drawing", start)
            if matched.marks[number]:
                text = Message("the mark from {} is not in the drawing", start)
            found.append(sheet_difference(Message("cuts nothing"), text, run.line))
    return found


def gouge_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each part that a kerf cuts into."""
    found = []
    metal = ShapeIndex(matched.parts)
    slits = {t.index: t.edge for t in matched.targets if t.shape is None and not t.marks}
    for number, line in enumerate(matched.lines):
        if matched.marks[number]:
            continue
        own = [slits[c.target.index] for c in matched.claims if c.run == number and c.target.index in slits]
        free = line.difference(shapely.union_all(own).buffer(2.0 * TOLERANCE)) if own else line
        for part in metal.pairs_near([free], matched.asked.half)[1].tolist():
            into = free.intersection(matched.parts[part].buffer(matched.asked.half))
            depth = matched.asked.half - shapely.distance(free, matched.parts[part]) + TOLERANCE
            x, y = shapely.get_coordinates(into if not into.is_empty else free)[0]
            text = Message(
                "the kerf goes {:.3f} mm or more into part {}, at {}", depth, matched.numbers[part], position_text(x, y)
            )
            found.append(sheet_difference(Message("cuts into a part"), text, matched.line_at(number, x, y)))
    return found


def clamp_and_sheet_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each kerf that hits a clamp or leaves the sheet.

    Starts beyond the edge of the sheet are allowed.
    """
    found = []
    half = 0.5 * matched.plan.data.kerf  # with or without compensation
    for zone in matched.zones:
        for number in np.flatnonzero(shapely.dwithin(matched.lines, zone, max(half - TOLERANCE, 0.0))).tolist():
            x, y = shapely.get_coordinates(shapely.shortest_line(zone, matched.lines[number]))[1]
            text = Message("the kerf runs into a keep-out zone at {}", position_text(x, y))
            found.append(sheet_difference(Message("in a keep-out zone"), text, matched.line_at(number, x, y)))
    sheet = matched.sheet
    if sheet is None:
        return found
    inside = sheet.buffer(TOLERANCE)
    shapely.prepare(inside)
    for number in np.flatnonzero(~shapely.contains(inside, matched.lines)).tolist():
        outside = _points_off_sheet(matched, number, inside)
        if len(outside):
            x, y = outside[0]
            text = Message("the torch cuts outside the sheet, at {}", position_text(x, y))
            found.append(sheet_difference(Message("off the sheet"), text, matched.line_at(number, x, y)))
    return found


def _points_off_sheet(matched: MatchedRuns, number: int, inside: Any) -> NDArray[np.float64]:
    """Return the points at which a run leaves the sheet, float64[k, 2], mm.

    If the cut starts at the edge of the sheet, its lead is allowed to lie outside.
    """
    middles, _, along = burning_sections(matched.runs[number], PIECE)
    out = ~shapely.contains(inside, shapely.points(middles))
    if not matched.pierces(number):
        out &= along >= min((c.first for c in matched.claims if c.run == number), default=0.0)
    places: NDArray[np.float64] = middles[out]
    return places


def _first_line(runs: list[TorchRun], claims: list[RunMatch]) -> int:
    return runs[claims[0].run].line if claims else 0


# -- order, pierces and directions -----------------------------------------------------------------------------------


def plan_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault if the number of cuts is not as planned, and for each contour that the plan does not contain."""
    cuts, found = matched.plan.cuts, []
    if len(cuts) != len(matched.runs):
        text = Message(
            "the torch is switched on for {}, but the plan has {}", count_of(len(matched.runs), "cut"), len(cuts)
        )
        found.append(sheet_difference(Message("number of cuts"), text, 0))
    planned = {i for cut in cuts for i in cut.contours}
    return found + [
        sheet_difference(Message("not planned"), Message("{} is in no cut of the plan", target.name), 0)
        for target in matched.targets
        if target.index not in planned and not target.may_stay
    ]


def late_contour_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut too late, after an outer contour has already detached it."""
    closed = [t for t in matched.targets if t.shape is not None]
    everything = list(matched.targets)
    edges = np.array([t.edge for t in everything], dtype=object)
    tree, whole = shapely.STRtree(shapely.line_interpolate_point(edges, 0.0)), shapely.STRtree(edges)
    found = []
    for around in closed:
        shape = around.shape.buffer(-TOLERANCE)
        inside = set(tree.query(shape, predicate="contains").tolist())
        if not around.source.is_hole:
            inside |= _contours_in_notches(matched, around, whole, inside)
        for number in sorted(inside):
            inner = everything[number]
            if inner.source.is_hole and around.source.is_hole and inner.source.part == around.source.part:
                continue  # holes of a part are not nested, but parts of a divided hole may overlap in a short neck
            late = _late_run(matched, inner, around) if inner.index != around.index else None
            if late is not None:
                text = Message("{} comes after {}, which detaches it", inner.name, around.name)
                found.append(sheet_difference(Message("out of order"), text, matched.runs[late].line))
    return found


def _contours_in_notches(matched: MatchedRuns, around: Target, edges: Any, known: set[int]) -> set[int]:
    """Return the contours inside an outline and in its closed notches, as indices of targets.

    If there are no other contours nearby, the result is empty.

    Parameters
    ----------
    edges
        Spatial index of the drawn lines of all targets.
    known
        Contours inside the outline.
    """
    reach = 0.5 * matched.plan.data.kerf - TOLERANCE
    near = set(
        edges.query(shapely.box(*around.centreline.buffer(reach, quad_segs=1).bounds), predicate="contains").tolist()
    )
    if all(matched.targets[number].index == around.index for number in near - known):
        return set()
    burnt = shapely.Polygon(around.centreline.coords).buffer(reach)
    found: set[int] = set(edges.query(shapely.Polygon(burnt.exterior), predicate="contains").tolist())
    return found


def _late_run(matched: MatchedRuns, inner: Target, around: Target) -> int | None:
    """Return the last run of the contour `inner` if it ends after the cut of the contour `around` has started.

    Otherwise, return None.
    """
    one, other = matched.of_target.get(inner.index), matched.of_target.get(around.index)
    if not one or not other:
        return None
    last = max(one, key=lambda c: (c.run, c.last))
    first = min((c for c in other if matched.detaches(c)), key=lambda c: (c.run, c.first), default=other[0])
    return last.run if (last.run, last.last) > (first.run, first.first + TOLERANCE) else None


def pierce_faults(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of pierces.

    A pierce may be missing, or lie in an earlier kerf, in a detached part, or in a slug.
    """
    found = []
    starts = shapely.points([run.start for run in matched.runs])
    tree = shapely.STRtree(starts)
    for number, line in enumerate(matched.lines):
        reach = max(0.5 * matched.plan.data.kerf - TOLERANCE, 0.0)
        for later in tree.query(line, predicate="dwithin", distance=reach).tolist():
            if later > number and matched.pierces(later) and not matched.marks[later] and not matched.marks[number]:
                text = Message(
                    "the torch is switched on at {}, in the kerf of an earlier cut",
                    position_text(*matched.runs[later].start),
                )
                found.append(sheet_difference(Message("pierces in the air"), text, matched.runs[later].line))
    found += _unpierced_cuts(matched)
    for claim in matched.claims:
        if claim.target.shape is None or not matched.detaches(claim):
            continue
        for later in tree.query(claim.target.shape, predicate="contains").tolist():
            if later > claim.run and all(c.run != later for c in matched.of_target[claim.target.index]):
                text = Message(
                    "the torch is switched on at {}, inside {}, which has already been cut",
                    position_text(*matched.runs[later].start),
                    claim.target.name,
                )
                found.append(sheet_difference(Message("pierces in the air"), text, matched.runs[later].line))
    return found


def _unpierced_cuts(matched: MatchedRuns) -> list[Difference]:
    sheet, half = matched.sheet, 0.5 * matched.plan.data.kerf
    found = []
    for number, run in enumerate(matched.runs):
        if matched.pierces(number) or matched.marks[number]:
            continue
        if sheet is None or shapely.distance(sheet, shapely.Point(*run.start)) < half - TOLERANCE:
            text = Message(
                "the torch is switched on at {} without a pierce, although that is not beside the sheet",
                position_text(*run.start),
            )
            found.append(sheet_difference(Message("not pierced"), text, run.line))
    return found


def direction_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut in the wrong direction."""
    found = []
    for claim in matched.claims:
        if claim.run >= len(matched.plan.cuts) or claim.target.shape is None:
            continue
        cut = matched.plan.cuts[claim.run]
        asked = next((c.direction for c in cut.choices if c.contours == (claim.target.index,)), "")
        if asked not in ("clockwise", "counter-clockwise"):
            continue
        if (asked == "clockwise") != claim.clockwise:
            text = Message(
                "{} is cut clockwise, not counter-clockwise"
                if claim.clockwise
                else "{} is cut counter-clockwise, not clockwise",
                claim.target.name,
            )
            found.append(sheet_difference(Message("direction"), text, matched.runs[claim.run].line))
    return found


# -- several contours in a run ---------------------------------------------------------------------------------------


def check_chains(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of runs that cut several contours.

    The contours must be cut completely, one after the other, and in the planned order. Each bridge must leave the kerf
    at its start and must not enter another kerf, where the arc would go out. No other run may cross the bridge, and the
    scrap around it must still be attached.
    """
    cuts, kerf, lines, found = matched.plan.cuts, matched.kerf, matched.kerf_lines, list[Difference]()
    followed: list[list[RunMatch]] = [[] for _ in matched.runs]
    for claim in matched.claims:
        in_group = claim.run < len(cuts) and cuts[claim.run].group
        if claim.followed > MOST * claim.target.centreline.length and not in_group:
            followed[claim.run].append(claim)
    tree = shapely.STRtree(lines)
    for number, own in enumerate(followed):
        planned = cuts[number].contours if number < len(cuts) and not cuts[number].group else ()
        if len(own) < 2 and len(planned) < 2:
            continue
        run, steps = matched.runs[number], sorted(own, key=lambda f: f.first)
        found += _chain_order_faults(run, steps, planned)
        for before, after in itertools.pairwise(steps):
            bridge = _stretch_of_run(run, before.last, after.first)
            if bridge is None:
                continue
            found += _own_kerf_faults(run, before.last, bridge, kerf)
            earlier = [f for k in range(number) for f in followed[k]]
            found += _detached_scrap_faults(
                run, [*earlier, *(f for f in own if f.last <= before.last + OVERLAP)], bridge
            )
            for other in tree.query(bridge, predicate="dwithin", distance=kerf - 2.0 * TOLERANCE).tolist():
                if other != number:
                    x, y = shapely.get_coordinates(shapely.shortest_line(lines[other], bridge))[0]
                    text = Message("a bridge and another cut cross at {}: the arc would go out", position_text(x, y))
                    found.append(sheet_difference(Message("chain"), text, matched.runs[max(number, other)].line))
    return found


def _chain_order_faults(run: TorchRun, steps: Sequence[RunMatch], planned: Sequence[int]) -> list[Difference]:
    got = tuple(f.target.index for f in steps)
    if got != tuple(planned):
        words = [" and ".join(str(k + 1) for k in numbers) or "none" for numbers in (got, planned)]
        return [
            sheet_difference(
                Message("chain"), Message("a run cuts contours {} instead of {}", words[0], words[1]), run.line
            )
        ]
    for before, after in itertools.pairwise(steps):
        if before.last > after.first + OVERLAP:
            one, other = before.target.index + 1, after.target.index + 1
            return [
                sheet_difference(
                    Message("chain"), Message("contour {} starts before contour {} is finished", other, one), run.line
                )
            ]
    return []


def _stretch_of_run(run: TorchRun, begin: float, end: float) -> Any:
    """Return the section of a run between two distances, mm along the run, as a shapely line.

    Return None if it is empty.
    """
    return None if end - begin <= OVERLAP else substring(shapely.LineString(run.points), begin, end)


def _own_kerf_faults(run: TorchRun, at: float, bridge: Any, kerf: float) -> list[Difference]:
    """Return a fault if a bridge enters a kerf that its own run has cut. The bridge starts `at` mm along the run."""
    done = _stretch_of_run(run, 0.0, at)
    if done is None:
        return []
    count = max(math.ceil(bridge.length / (BRIDGE_STEP * kerf)), 4)
    along = np.linspace(0.0, bridge.length, count + 1)
    points = shapely.line_interpolate_point(bridge, along)
    apart = shapely.distance(points, done) >= kerf - 2.0 * TOLERANCE
    left = np.maximum.accumulate(apart) | (along > LEAVES_WITHIN * kerf)
    clear = apart | ~left
    clear[-1] = apart[-1]
    if clear.all():
        return []
    point = points[int(np.argmin(clear))]
    text = Message("a bridge runs into its own kerf at {}: the arc would go out", position_text(point.x, point.y))
    return [sheet_difference(Message("chain"), text, run.line)]


def _detached_scrap_faults(run: TorchRun, done: Sequence[RunMatch], bridge: Any) -> list[Difference]:
    """Return a fault if a bridge crosses scrap or parts that have already come loose.

    `done` contains the contours that were cut before the bridge.
    """
    middle = bridge.interpolate(0.5, normalized=True)
    for f in done:
        if f.target.shape is not None and f.target.shape.contains(middle):
            text = Message("a bridge crosses scrap or a part that contour {} has detached", f.target.index + 1)
            return [sheet_difference(Message("chain"), text, run.line)]
    return []


# -- common lines ----------------------------------------------------------------------------------------------------


def check_common_lines(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of runs that cut a common line of two parts.

    No other run may cut any section of a common line. Each line must lie inside the run around its group and must be
    cut before that run. The run around the group must have the requested direction. If the cutting method needs metal,
    a line may meet an earlier line only at its end. Whether each part is cut completely is checked elsewhere.
    """
    runs, lines, found = matched.runs, matched.kerf_lines, list[Difference]()
    cuts = dict(enumerate(matched.plan.cuts[: len(runs)]))
    common = [k for k, cut in cuts.items() if cut.common > 0.0]
    if not common:
        return []
    tree = shapely.STRtree(lines)
    for k in common:
        for other in tree.query(lines[k], predicate="dwithin", distance=TOLERANCE).tolist():
            both = lines[k].intersection(lines[other].buffer(TOLERANCE))
            if other != k and both.length > max(CROSSING_KERFS * matched.kerf, CROSSING) + 2.0 * TOLERANCE:
                x, y = shapely.get_coordinates(both)[0]
                text = Message("an edge of two parts is cut twice at {}", position_text(x, y))
                found.append(sheet_difference(Message("cut twice"), text, runs[max(k, other)].line))
    for group in sorted({cuts[k].group for k in common}):
        found += _group_faults(matched, group, [k for k in common if cuts[k].group == group])
    if first_word_of_process(matched.plan.data.process) in NEED_METAL:
        found += _crossing_faults(matched, common)
    return found


def _group_faults(matched: MatchedRuns, group: int, own: Sequence[int]) -> Iterator[Difference]:
    runs, lines, cuts, kerf = matched.runs, matched.kerf_lines, matched.plan.cuts, matched.kerf
    around = [k for k, cut in enumerate(cuts[: len(runs)]) if cut.group == group and not cut.common]
    if len(around) != 1:
        text = Message("{} cuts, instead of a single one, go around parts with common lines", len(around))
        yield sheet_difference(Message("out of order"), text, runs[own[0]].line)
        return
    last = around[0]
    swept = shapely.get_parts(lines[last].buffer(0.5 * kerf, quad_segs=32))
    body = max((shapely.Polygon(p.exterior) for p in swept), key=lambda p: p.area).buffer(TOLERANCE - 0.5 * kerf)
    for k in own:
        if k > last:
            text = Message("a common line is cut after the cut around its parts, which detaches them")
            yield sheet_difference(Message("out of order"), text, runs[k].line)
        if lines[k].intersection(body).length < cuts[k].common - TOLERANCE:
            text = Message("the common line that starts at {} is not within its parts", position_text(*runs[k].start))
            yield sheet_difference(Message("out of order"), text, runs[k].line)
    asked = cuts[last].choice.direction
    if asked in ("clockwise", "counter-clockwise") and _is_clockwise(runs[last]) != (asked == "clockwise"):
        text = Message("the cut around parts with common lines is not {}", asked)
        yield sheet_difference(Message("direction"), text, runs[last].line)


def _is_clockwise(run: TorchRun) -> bool:
    x, y = (run.points - run.points[0]).T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) < 0.0


def _crossing_faults(matched: MatchedRuns, common: Sequence[int]) -> Iterator[Difference]:
    """Yield a fault for each common line that crosses the kerf of an earlier line. The arc would go out there."""
    for early, late in itertools.combinations(sorted(common), 2):
        met = matched.kerf_lines[late].intersection(matched.kerf_lines[early])
        end = shapely.Point(matched.runs[late].points[-1])
        if not met.is_empty and shapely.distance(met, end) > AT_END:
            x, y = shapely.get_coordinates(met)[0]
            text = Message("a common line crosses an earlier one at {}", position_text(x, y))
            yield sheet_difference(Message("crosses a kerf"), text, matched.runs[late].line)


# -- travel over detached parts --------------------------------------------------------------------------------------


def check_detached_parts(
    matched: MatchedRuns, path: Toolpath, dialect: Dialect, nozzle: float = 0.0
) -> list[Difference]:
    """Return a fault if more moves cross detached parts than the plan reports.

    `nozzle` is the diameter of the head, mm, or 0 if it is unknown.
    """
    reported, close = matched.plan.crossings, matched.plan.close
    if dialect.moves_z or reported is None:
        return []
    found = detached_part_crossings(matched, path)
    if len(found) > reported:
        line, where = found[0]
        count = count_of(len(found), "travel move")
        text = Message(
            "{} over detached parts, but only {} reported; the first leads to {}",
            count,
            reported,
            position_text(*where),
        )
        return [Difference(Message("travel over a detached part"), 0, line, text)]
    near = detached_part_crossings(matched, path, 0.5 * nozzle) if nozzle > 0.0 else []
    if len(near) > reported + close:
        line, where = near[0]
        text = Message(
            "a nozzle of {:g} mm passes over detached parts on {}, but only {} reported; the first leads to {}",
            nozzle,
            count_of(len(near), "travel move"),
            reported + close,
            position_text(*where),
        )
        return [Difference(Message("travel over a detached part"), 0, line, text)]
    return []


def detached_part_crossings(
    matched: MatchedRuns, path: Toolpath, radius: float = 0.0
) -> list[tuple[int, tuple[float, float]]]:
    """Find the travel moves that cross a detached part.

    The moves between two runs form a route, and only the first crossing of each route is reported. The check samples
    points along each move, whereas the planner intersects whole moves with offset parts.

    Parameters
    ----------
    radius
        Radius of the head, mm. If it is given, a route also counts as crossing if it passes a part within this
        distance, except near the ends of the route.

    Returns
    -------
    list of tuple
        Program line and end point of the first crossing move of each route.
    """
    ends = np.array([run.row_line[-1] for run in matched.runs], dtype=np.int64)
    freed = _detaching_runs(matched)
    if not freed:
        return []
    cut_by, parts = np.array([run for run, _ in freed]), [part for _, part in freed]
    shapely.prepare(parts)
    # Moves outside the boxes of all parts, enlarged by the radius, need no closer check.
    low, high = np.split(shapely.bounds(parts), 2, axis=1)
    grown = max(radius - _LEEWAY, 0.0)
    before = path.before
    rows = np.flatnonzero(
        (path.kind == Kind.RAPID) & np.isfinite(np.hstack([before[:, :2], path.end[:, :2]])).all(axis=1)
    )
    way_of = np.searchsorted(ends, path.line[rows])
    order = np.argsort(way_of, kind="stable")
    cuts = np.flatnonzero(np.diff(way_of[order])) + 1
    found = []
    for mine in np.split(rows[order], cuts) if len(rows) else ():
        free = cut_by < np.searchsorted(ends, path.line[mine[0]])
        begin, goal = before[mine[0], :2], path.end[mine[-1], :2]
        for row in mine.tolist():
            a, b = before[row, :2], path.end[row, :2]
            beside = (low <= np.maximum(a, b) + grown).all(axis=1) & (high >= np.minimum(a, b) - grown).all(axis=1)
            near = np.flatnonzero(free & beside).tolist()
            if not near:
                continue
            points = _points_along(a, b)
            away = np.minimum(np.hypot(*(points - begin).T), np.hypot(*(points - goal).T)) >= radius
            if any(_crosses(points, parts[k]) or _comes_near(points[away], parts[k], radius - _LEEWAY) for k in near):
                found.append((int(path.line[row]), (float(b[0]), float(b[1]))))
                break
    return found


def _detaching_runs(matched: MatchedRuns) -> list[tuple[int, Any]]:
    """Return each run that detaches a part, as the index of the run and the polygon of the part.

    Common lines do not detach a part.
    """
    common = {run for run, cut in enumerate(matched.plan.cuts) if cut.common > 0.0}
    return [
        (claim.run, claim.target.shape)
        for claim in matched.claims
        if _is_outline(claim.target)
        and matched.detaches(claim)
        and claim.run not in common
        and len(matched.runs[claim.run].lines()) == 1
    ]


def _is_outline(target: Target) -> bool:
    return target.shape is not None and not target.marks and target.source.depth % 2 == 0


def _points_along(a: Points, b: Points) -> Points:
    """Return evenly spaced points along a straight move, float64[n, 2], mm."""
    steps = max(2, int(np.hypot(*(b - a)) / _MOVE_STEP) + 2)
    return a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)


def _crosses(points: Points, part: Any) -> bool:
    inside = points[shapely.contains_xy(part, points)]
    return bool((shapely.distance(part.exterior, shapely.points(inside)) > _DEPTH).any())


def _comes_near(points: Points, part: Any, distance: float) -> bool:
    return distance > 0.0 and bool((shapely.distance(part.exterior, shapely.points(points)) < distance).any())


#: The checks of the runs against the sheet.
CHECKS: tuple[Callable[[MatchedRuns], list[Difference]], ...] = (
    uncut_contour_faults,
    repeated_cut_faults,
    gouge_faults,
    clamp_and_sheet_faults,
    plan_faults,
    late_contour_faults,
    pierce_faults,
    direction_faults,
    check_chains,
    check_common_lines,
)
