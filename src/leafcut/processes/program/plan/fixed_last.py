"""Check whether the last piece of work in a series must stay last, because the next blocks depend on its end point."""

from __future__ import annotations

import math

import numpy as np

from leafcut.gcode.program import Program
from leafcut.model.sequence import ProgramTask
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.program_rows import TOLERANCE, Rows

#: Kinds of rows before which a program retracts the tool.
STOPS = [int(k) for k in (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)]
_FEEDS = [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)]


def must_stay_last(program: Program, rows: Rows, piece: ProgramTask) -> bool:
    """Return whether a piece of work must stay the last of its section because of the fixed blocks after it.

    This is the case if

    - a dwell or cutter compensation follows without a rapid, or a cut follows without a travel move;
    - the tool retracts higher in a fixed block and continues to other work from there;
    - the piece moves elsewhere after its work, for example to the operator or to the end position;
    - the next travel move has the beam on, while the first travel move of the piece has it off.
    """
    low, high = int(program.first[piece.begin]), int(program.first[piece.end])
    last = low + int(np.flatnonzero(rows.cut[low:high])[-1])
    return (
        _continues_from_cut(program, rows, last, high)
        or bool((rows.travel & ~rows.cut)[last + 1 : high].any())
        or _is_lit_after(program, rows, low, high)
    )


def _continues_from_cut(program: Program, rows: Rows, last: int, high: int) -> bool:
    """Return whether the fixed rows after the last cut depend on its end point."""
    kind, ref, z = program.path.kind, program.path.ref, program.path.end[:, 2]
    risen = higher = False
    for row in range(last + 1, len(kind)):
        stays = row >= high
        if kind[row] == Kind.RAPID:
            compensated = follows_compensation(program, row)
            if rows.sideways[row] or (stays and compensated):
                return (stays and compensated) or (higher and not stops_before_work(program, rows, row))
            risen |= not compensated
            higher = stays and bool(z[row] > program.path.before[high, 2] + TOLERANCE)
        elif kind[row] in _FEEDS:
            return stays
        elif kind[row] == Kind.DRILL:
            # If the hole follows directly, another last piece retracts in the same way.
            r_plane = program.path.cycles[int(ref[row])].r_plane
            return higher or (row > high and r_plane > program.path.before[high, 2] + TOLERANCE)
        elif kind[row] in STOPS:
            return False
        elif stays and not risen and (kind[row] == Kind.DWELL or (kind[row] == Kind.RADIUS and ref[row] != 40)):
            return True
    return False


def stops_before_work(program: Program, rows: Rows, row: int) -> bool:
    """Return whether a stop or a tool change comes before the next cut after a row."""
    upcoming = [np.flatnonzero(mask[row:]) for mask in (rows.cut, np.isin(program.path.kind, STOPS))]
    work, stop = (int(found[0]) if len(found) else math.inf for found in upcoming)
    return stop < work


def follows_compensation(program: Program, row: int) -> bool:
    """Return whether cutter compensation is on in the move before a row, so that the compensation ends in this row."""
    kind = program.path.kind
    before = next((r for r in range(row - 1, -1, -1) if kind[r] <= Kind.DRILL), -1)
    if before < 0:
        return False
    return program.modal(int(program.row_block[before]) + 1).radius != 40


def _is_lit_after(program: Program, rows: Rows, low: int, high: int) -> bool:
    """Return whether the beam is on in the first travel move after a piece, but off in the first one of the piece."""
    if not rows.beam.any():
        return False
    ways = [np.flatnonzero(part) for part in (rows.travel[low:high], rows.travel[high:])]
    if not all(len(way) for way in ways):
        return False
    blocks = [int(program.row_block[start + int(way[0])]) for start, way in zip((low, high), ways, strict=True)]
    own, after = (program.modal(block + 1).spindle for block in blocks)
    return own == 0 and after != 0
