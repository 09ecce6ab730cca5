"""Find dangers in a program of unknown origin.

Each kind of danger is a single issue, with the number of positions and the first position.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Mask
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.message import Message
from leafcut.model.cycles import expand_cycles
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS, ProgramKind
from leafcut.model.machine import Machine
from leafcut.model.toolpath import STILL, Kind, Toolpath, latest_marked_rows
from leafcut.proof.clearance import DangerCheck, rapid_height_checks, spindle_turns_check, torch_off_check
from leafcut.proof.difference import position_text, start_and_end_texts
from leafcut.proof.envelope import check_machine_limits
from leafcut.units import to_fixed

#: Tolerance for rounded heights, mm.
_TOLERANCE = 0.002
#: Maximum chord error of arcs, mm.
_CHORD_ERROR = 0.01
#: Matches S0 in the text of a program.
_NO_SPEED = re.compile(r"S\s*0+(?:\.0*)?(?![\d.])", re.IGNORECASE)
#: Patterns of a comment, of an explicit height in an origin command, and of G52 Z0, which only cancels an earlier
#: shift.
_COMMENT = re.compile(r"\([^)]*\)|;.*")
_Z_SHIFT = re.compile(r"Z\s*[-+#\[.\d]", re.IGNORECASE)
_NO_SHIFT = re.compile(r"G\s*52\b.*Z\s*[-+]?(?:0+\.?0*|\.0+)(?![\d.])", re.IGNORECASE)
#: Issue code, severity, and messages for a single position and for several positions, by kind of danger.
_KINDS = {
    "rapid below clearance": (
        "L801",
        Severity.DANGER,
        Message("rapid below Z0.05"),
        partial(Message, "{:,} rapids below Z0.05"),
    ),
    "rapid into the part": (
        "L802",
        Severity.DANGER,
        Message("rapid down into the part"),
        partial(Message, "{:,} rapids down into the part"),
    ),
    "spindle off": (
        "L803",
        Severity.DANGER,
        Message("cut with the spindle off"),
        partial(Message, "{:,} cuts with the spindle off"),
    ),
    "torch on in a rapid": (
        "L804",
        Severity.DANGER,
        Message("rapid with the torch on"),
        partial(Message, "{:,} rapids with the torch on"),
    ),
    "height not known": (
        "L805",
        Severity.NOTE,
        Message("move in X or Y while Z is unknown"),
        partial(Message, "{:,} moves in X or Y while Z is unknown"),
    ),
}


def find_dangers(
    program: Program,
    machine: Machine,
    process: str,
    heights: bool = True,
    simulated: Mapping[str, Mask] = MappingProxyType({}),
) -> list[Issue]:
    """Return the dangers of a program and the exceeded limits of the machine, as one issue per kind, worst first.

    A rapid counts as unsafe if it is below Z0.05. It also counts as unsafe if it descends below Z0, unless earlier cuts
    have cleared the depth and width of its tool.

    Parameters
    ----------
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``. Heights and rapids of a laser are harmless.
    heights
        Whether to check heights; False if the controller moves Z.
    simulated
        Masks of the rows whose rapids were already checked by simulating the stock, bool[n], by issue code.
    """
    source = replace(program.path, line=np.arange(len(program.path), dtype=np.int32))
    path = expand_cycles(source)
    rows = path.line
    path = replace(path, line=program.path.line[rows])
    checks: list[DangerCheck] = []
    if process not in BEAMS and heights:
        checks += rapid_height_checks(path, 0.0, machine.safe_z or 0.0, milled=False)
    if process not in BEAMS:
        checks.append(spindle_turns_check(path, _rows_with_turning_spindle(program, rows, True)))
    elif process == ProgramKind.PLASMA:
        checks.append(torch_off_check(path, _rows_with_turning_spindle(program, rows, False)))
    rapid, nowhere = path.kind == Kind.RAPID, np.zeros(len(program.path), dtype=bool)
    unchecked: list[Issue] = []
    for index, (kind, mask, text) in enumerate(checks):
        by_stock = simulated.get(_KINDS[kind][0], nowhere)
        left = mask & ~(by_stock[rows] & rapid)
        cleared, unresolved = _cleared_and_unchecked_rapids(program, rows, path, left)
        checks[index] = kind, left & ~cleared & ~unresolved, text
        if unresolved.any():
            unchecked.append(_unchecked_rapids_issue(path, unresolved))
    issues = unchecked + [_danger_issue(path, kind, mask) for kind, mask, _ in checks if mask.any()]
    spindle_never_starts = not _rows_with_turning_spindle(program, rows, True).any()
    issues = [
        _manual_spindle_issue(issue) if spindle_never_starts and issue.code == "L803" else issue for issue in issues
    ]
    if process not in BEAMS and heights and "L801" not in simulated:
        issues += [*_report_unknown_surface(path), *_report_lowered_zero(program)]
    issues += [*_report_untracked_moves(program), *_report_machine_limits(program.path, machine)]
    return sorted(issues, key=lambda issue: (RANK[issue.severity], issue.code))


#: Sort order of severities.
RANK = {Severity.DANGER: 0, Severity.WARNING: 1, Severity.NOTE: 2}


def _cleared_and_unchecked_rapids(
    program: Program, rows: NDArray[np.int32], path: Toolpath, mask: Mask
) -> tuple[Mask, Mask]:
    """Return two masks: rapids that end where earlier cuts have removed the material, and unchecked rapids."""
    cleared, unchecked = np.zeros((2, len(path)), dtype=bool)
    straight = mask & (path.kind == Kind.RAPID) & np.isclose(path.end[:, :2], path.before[:, :2]).all(axis=1)
    descents = np.flatnonzero(straight)
    if len(descents):
        from leafcut.proof.cleared_rapids import find_cleared_descents

        cleared[descents], unchecked[descents] = find_cleared_descents(program, rows, path, descents)
    return cleared, unchecked


def _unchecked_rapids_issue(path: Toolpath, mask: Mask) -> Issue:
    number, row = int(mask.sum()), int(np.argmax(mask))
    message = Message(
        "{:,} rapids down below Z0 were not compared with earlier cuts, because there are too many; the first "
        "is to {}; check them with leafcut stock",
        number,
        position_text(*path.end[row].tolist()),
    )
    return Issue("L815", message, Message("line {}", int(path.line[row])))


def _rows_with_turning_spindle(program: Program, rows: NDArray[np.int32], default: bool) -> Mask:
    """Return a mask of the rows in which the spindle turns.

    If only the machine knows the spindle state, `default` applies. A tool change stops the spindle. M3 without an S
    word starts it at the current speed. S0 does not count as a speed.
    """
    kinds = program.path.kind
    sets_state = (kinds == Kind.SPINDLE) | (kinds == Kind.TOOL) | ((kinds == Kind.FOREIGN) & (program.path.ref == 1))
    turns_before = program.modal_at_rows("spindle") != 0
    for row in np.flatnonzero((kinds == Kind.SPINDLE) & (program.path.value == 0.0) & turns_before).tolist():
        turns_before[row] = not _NO_SPEED.search(program.lines[int(program.path.line[row]) - 1])
    state = np.where(kinds == Kind.SPINDLE, (program.path.value != 0.0) | turns_before, default & (kinds != Kind.TOOL))
    last = latest_marked_rows(sets_state)
    turning: Mask = ((last >= 0) & state[last])[rows]
    return turning


def _danger_issue(path: Toolpath, kind: str, mask: Mask) -> Issue:
    code, severity, singular, plural = _KINDS[kind]
    number, row = int(mask.sum()), int(np.argmax(mask))
    start, end = start_and_end_texts(path, row)
    if path.kind[row] == Kind.MACHINE:
        end = Message("a position in machine coordinates")
    if number == 1:
        message = Message("{}: from {} to {}", singular, start, end)
    else:
        message = Message("{}: the first from {} to {}", plural(number), start, end)
    return Issue(code, message, Message("line {}", int(path.line[row])), severity)


def _manual_spindle_issue(issue: Issue) -> Issue:
    message = Message("the program never starts the spindle (M3); start it before you run the program")
    return replace(issue, message=message, severity=Severity.WARNING)


def _report_unknown_surface(path: Toolpath) -> Iterator[Issue]:
    """Report that no cut goes below Z0, so that the height of the surface is unknown (L814)."""
    cuts = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end[:, 2])
    if not cuts.any() or path.end[cuts, 2].min() < -_TOLERANCE:
        return
    # Arcs in XZ and YZ may be lower than their ends.
    moves = convert_to_straight_moves(path, _CHORD_ERROR, math.inf)
    heights = moves.ends[~moves.rapid][:, 5]
    if len(heights) and heights.min() >= -_TOLERANCE:
        yield Issue(
            "L814",
            Message(
                "no cut goes below Z0 (lowest Z{}, highest Z{}), so the surface is unknown and rapids were not "
                "checked against it; check them with leafcut stock --workpiece",
                to_fixed(heights.min(), 3),
                to_fixed(heights.max(), 3),
            ),
        )


def _report_lowered_zero(program: Program) -> Iterator[Issue]:
    """Report that the program lowers Z0, or moves it by an unknown distance, while the tool height is known (L816).

    Later rapids are compared with the new Z0. A probed height counts as unknown. Raising Z0 is safe.
    """
    path = program.path
    before, after = path.before[:, 2], path.end[:, 2]
    for row in np.flatnonzero(
        (path.kind == Kind.SHIFT) & np.isfinite(before) & ~(after <= before + _TOLERANCE)
    ).tolist():
        line = _COMMENT.sub("", program.lines[int(path.line[row]) - 1])
        if not _Z_SHIFT.search(line) or _NO_SHIFT.search(line):
            continue
        moved = (
            Message("{:.3f} mm down", after[row] - before[row])
            if np.isfinite(after[row])
            else Message("by an unknown height")
        )
        yield Issue(
            "L816",
            Message(
                "Z0 is moved {}, so later rapids were compared with the new Z0 and not with the surface of "
                "earlier cuts",
                moved,
            ),
            Message("line {}", int(path.line[row])),
        )
        return


def _report_untracked_moves(program: Program) -> Iterator[Issue]:
    """Report moves to unknown positions, which are neither timed nor checked.

    Probes are left out, because their contact points are never known.
    """
    path = program.path
    untracked = (path.kind == Kind.FOREIGN) & (path.ref != STILL) & (path.value == 0.0) & np.isnan(path.end).any(axis=1)
    rows = np.flatnonzero(untracked)
    if not len(rows):
        return
    block = int(program.row_block[rows[0]])
    message = (
        Message("the tool path in one block is unknown and is neither timed nor checked")
        if len(rows) == 1
        else Message("the tool path in {:,} blocks is unknown and is neither timed nor checked", len(rows))
    )
    if block in program.fixed:
        message = Message("{}: {}", message, program.fixed[block])
    yield Issue("L808", message, Message("line {}", int(path.line[rows[0]])))


def _report_machine_limits(path: Toolpath, machine: Machine) -> Iterator[Issue]:
    differences = [difference for difference in check_machine_limits(path, machine) if difference.what != "and more"]
    numbers = Counter(difference.what for difference in differences)
    for what, number in numbers.items():
        difference = next(difference for difference in differences if difference.what == what)
        times = Message(" ({} times)", number) if number > 1 else ""
        location = Message("line {}", difference.new) if difference.new else ""
        yield Issue("L806", Message("{} on {}: {}{}", difference.what, machine.name, difference.text, times), location)
