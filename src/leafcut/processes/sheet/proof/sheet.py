"""Check a cutting program: compare the effect of the program on the sheet with the drawing.

The check uses no planning code. From the plan, it uses only what the user requested: feeds, directions, and the data of
the chart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.dialects import Dialect
from leafcut.geometry.index import ShapeIndex
from leafcut.message import Message
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.machine import Machine
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Toolpath
from leafcut.processes.sheet.proof.chains import check_chains
from leafcut.processes.sheet.proof.common_lines import check_common_lines
from leafcut.processes.sheet.proof.detached_parts import check_detached_parts
from leafcut.processes.sheet.proof.matched_runs import MOST, PIECE, CutRequest, MatchedRuns, RunMatch, sheet_difference
from leafcut.processes.sheet.proof.sheet_order import direction_faults, order_faults, pierce_faults, plan_faults
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, Target
from leafcut.processes.sheet.proof.torch import check_torch
from leafcut.processes.sheet.proof.torch_runs import TorchRun, burning_pieces, torch_runs
from leafcut.proof.difference import cap_differences, position_text
from leafcut.proof.envelope import check_envelope

#: Multiple of the length of a path that runs must follow to count as cutting it twice.
TWICE = 1.9
#: Minimum length of an uncut section of a path that is not a rounding error, mm.
SHORT = 0.1


def check_sheet(
    sheet: Sheet, plan: CutPlan, text: str, path: Toolpath, dialect: Dialect, machine: Machine, asked: CutRequest
) -> list[Difference]:
    """Return the faults of a cutting program, given its text and the `path` that was read back.

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
    return cap_differences([*found, *check_envelope(path, machine)])


def uncut_contours(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is not cut, or is cut incompletely."""
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
                    _line_of(matched.runs, claims),
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
            found.append(sheet_difference(Message("incomplete"), text, _line_of(matched.runs, claims)))
    return found


def _uncut_stretches(matched: MatchedRuns, target: Target, lines: Sequence[Any]) -> list[Any]:
    """Return the sections of a target's path that no run follows, except arcs around corners with a loop."""
    if not lines:
        return [target.centreline]
    burnt = shapely.union_all(lines)
    left = target.centreline.difference(burnt.buffer(1.5 * TOLERANCE))
    if target.shape is not None and len(pieces := shapely.get_parts(left)) > 1:
        left = shapely.line_merge(shapely.multilinestrings(pieces))
    return [g for g in shapely.get_parts(left) if g.length > SHORT and not _at_corner(matched, target, g, burnt)]


def _at_corner(matched: MatchedRuns, target: Target, gap: Any, burnt: Any) -> bool:
    """Return whether an uncut section is the arc around a corner that the kerfs reach anyway."""
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


def repeated_cuts(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut twice, and for each run that follows no contour."""
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


def find_gouges(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each part that a kerf cuts into."""
    found = []
    metal = ShapeIndex(matched.parts)
    slits = {t.index: t.edge for t in matched.targets if t.shape is None and not t.marks}
    for number, line in enumerate(matched.lines):
        if matched.marks[number]:
            continue
        own = [slits[c.target.index] for c in matched.claims if c.run == number and c.target.index in slits]
        free = line.difference(shapely.union_all(own).buffer(2.0 * TOLERANCE)) if own else line
        for part in metal.near([free], matched.asked.half)[1].tolist():
            into = free.intersection(matched.parts[part].buffer(matched.asked.half))
            depth = matched.asked.half - shapely.distance(free, matched.parts[part]) + TOLERANCE
            x, y = shapely.get_coordinates(into if not into.is_empty else free)[0]
            text = Message(
                "the kerf goes {:.3f} mm or more into part {}, at {}", depth, matched.numbers[part], position_text(x, y)
            )
            found.append(sheet_difference(Message("cuts into a part"), text, matched.line_at(number, x, y)))
    return found


def find_strays(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each kerf that runs into a clamp or off the sheet. Starts beyond the edge are allowed."""
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
            text = Message("the torch burns off the sheet, at {}", position_text(x, y))
            found.append(sheet_difference(Message("off the sheet"), text, matched.line_at(number, x, y)))
    return found


def _points_off_sheet(matched: MatchedRuns, number: int, inside: Any) -> NDArray[np.float64]:
    """Return the points of a run that are off the sheet, float64[k, 2], mm, except the lead of a start at the edge."""
    middles, _, along = burning_pieces(matched.runs[number], PIECE)
    out = ~shapely.contains(inside, shapely.points(middles))
    if not matched.pierces(number):
        out &= along >= min((c.first for c in matched.claims if c.run == number), default=0.0)
    places: NDArray[np.float64] = middles[out]
    return places


def _line_of(runs: list[TorchRun], claims: list[RunMatch]) -> int:
    return runs[claims[0].run].line if claims else 0


#: The checks of the runs against the sheet.
CHECKS: tuple[Callable[[MatchedRuns], list[Difference]], ...] = (
    uncut_contours,
    repeated_cuts,
    find_gouges,
    find_strays,
    plan_faults,
    order_faults,
    pierce_faults,
    direction_faults,
    check_chains,
    check_common_lines,
)
