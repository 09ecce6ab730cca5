"""Detect commands that are probably mistakes: unknown to the controller, or valid but implausible."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from leafcut.errors import count_of
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.jumps import board_command
from leafcut.gcode.program import Program
from leafcut.gcode.words import COMMENT
from leafcut.geometry.arrays import Mask
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.toolpath import Kind, Toolpath

#: A longer dwell is implausible and probably uses the unit of another controller, s.
_LONG = 60.0
#: Name of the unit of dwells, by the unit in the dialect.
_UNITS = {"s": "seconds", "ms": "milliseconds", "cs": "hundredths of a second"}
_CHANGE = re.compile(r"M0*6(?![0-9])", re.IGNORECASE)
#: Heights that differ by at most this much count as equal, mm.
_SAME = 1e-6
_TAPS = ("G84", "G74")


def find_probable_mistakes(program: Program, dialect: Dialect, process: str) -> list[Issue]:
    """Return probable mistakes: M4 in cuts, no time for the spindle to start, long dwells, unsupported commands."""
    if dialect.language != "g-code":
        return []
    spindle = [] if process in BEAMS else [*_report_backward_rotation(program), *_report_spindle_restarts(program)]
    return [
        *spindle,
        *_report_long_dwells(program, dialect),
        *_report_unsupported_tool_changes(program, dialect),
        *_report_foreign_board_commands(program, dialect),
    ]


def _report_backward_rotation(program: Program) -> Iterator[Issue]:
    """Report M4 (counterclockwise rotation) in cuts, except in tapping cycles and in retracts from tapped holes."""
    path, turns, cuts = program.path, program.modal_at_rows("spindle"), _cutting_rows(program.path)
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    cuts[drills] = [path.cycles[k].name not in _TAPS for k in path.ref[drills].tolist()]
    rows = np.flatnonzero(cuts & (turns < 0))
    if len(rows):
        message = Message(
            "M4 turns the spindle backwards in cuts, but mills and drills need M3 unless they are left-handed"
        )
        yield Issue("L806", message, Message("line {}", int(path.line[rows[0]])))


def _cutting_rows(path: Toolpath) -> Mask:
    """Return a mask of the cuts: feed moves sideways or down, arcs, and cycles."""
    with np.errstate(invalid="ignore"):
        across = (np.abs(path.end[:, :2] - path.before[:, :2]) > _SAME).any(axis=1)
        plunging = path.end[:, 2] < path.before[:, 2] - _SAME
    cuts: Mask = ((path.kind == Kind.FEED) & (across | plunging)) | np.isin(
        path.kind, (Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL)
    )
    return cuts


def _report_spindle_restarts(program: Program) -> Iterator[Issue]:
    """Report a spindle that stops and restarts between cuts with the same tool, without a dwell before the next cut.

    Starts after a tool change are not reported. Every program has them, and the operator watches the first start.
    """
    path, on = program.path, program.modal_at_rows("spindle") != 0
    cuts = np.flatnonzero(_cutting_rows(path) & on)
    if not len(cuts):
        return
    dwells = (path.kind == Kind.DWELL) & (path.value > 0.0)
    n_dwells, n_changes = (np.append(0, np.cumsum(mask)) for mask in (dwells, path.kind == Kind.TOOL))
    stops, starts = np.flatnonzero(on[:-1] & ~on[1:]) + 1, np.flatnonzero(~on[:-1] & on[1:]) + 1
    starts = starts[(starts > cuts[0]) & (starts <= cuts[-1])]
    stopped = stops[np.searchsorted(stops, starts) - 1] if len(stops) else starts
    following = cuts[np.searchsorted(cuts, starts)]
    without = (n_dwells[following] == n_dwells[starts]) & (n_changes[following] == n_changes[stopped])
    rows = starts[without & (stopped > cuts[0])]
    if len(rows):
        message = Message(
            "{} of the spindle between cuts without a dwell (G4) before the next cut; the spindle may not be "
            "up to speed, unless the controller waits for it",
            count_of(len(rows), "start"),
        )
        yield Issue("L817", message, Message("line {}", int(path.line[rows[0]])), Severity.NOTE)


def _report_long_dwells(program: Program, dialect: Dialect) -> Iterator[Issue]:
    path = program.path
    seconds = np.where(path.kind == Kind.DWELL, path.value, 0.0)
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    seconds[drills] = [path.cycles[k].dwell for k in path.ref[drills].tolist()]
    rows = np.flatnonzero(seconds > _LONG)
    if len(rows):
        dwells, longest = count_of(len(rows), "dwell"), f"{seconds.max():,.0f} s"
        unit = _UNITS.get(dialect.dwell_unit, "its own unit")
        message = Message(
            "{} longer than {:g} s, the longest {}: {} reads {} in "
            "{}, but other controllers use another unit; check the value",
            dwells,
            _LONG,
            longest,
            dialect.name,
            dialect.dwell_letter,
            unit,
        )
        yield Issue("L102", message, Message("line {}", int(path.line[rows[0]])))


def _report_unsupported_tool_changes(program: Program, dialect: Dialect) -> Iterator[Issue]:
    if 6 in dialect.m_codes:
        return
    for line in np.unique(program.path.line[program.path.kind == Kind.TOOL]).tolist():
        if _CHANGE.search(COMMENT.sub(" ", program.lines[line - 1])):
            message = Message(
                "{} does not support M6 and stops with an error or skips the tool change, unless the sender "
                "handles it; use {}",
                dialect.name,
                dialect.stop_word,
            )
            yield Issue("L806", message, Message("line {}", line))
            return


def _report_foreign_board_commands(program: Program, dialect: Dialect) -> Iterator[Issue]:
    if dialect.family.startswith("grbl"):
        return
    for number, line in enumerate(program.lines, 1):
        command = board_command(line) if "$" in line else ""
        if command:
            yield Issue(
                "L806",
                Message("{} is a GRBL command, which {} does not support", command, dialect.name),
                Message("line {}", number),
            )
            return
