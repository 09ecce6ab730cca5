"""What holds the last piece of work of a run in its place: that what comes next begins where it ends."""

from __future__ import annotations

import math

import numpy as np

from leafcut.gcode.program import Program
from leafcut.model.sequence import PieceOfWork
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.sections.program_rows import TOLERANCE, Rows

#: Rows before which the tool goes up for their sake.
STOPS = [int(k) for k in (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)]
_FEEDS = [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)]


def stays_last(program: Program, rows: Rows, piece: PieceOfWork) -> bool:
    """Return whether a piece behind which others stay must be the last of its section.

    So it is where a dwell or radius compensation follows without a rapid in between, or a cut without a way across;
    where the tool rises higher behind a block that stays, and goes on to other work from there; where the piece itself
    goes elsewhere after its work, as for a person or the end; and where the next way is made with a beam that was off.
    """
    low, high = int(program.first[piece.begin]), int(program.first[piece.end])
    last = low + int(np.flatnonzero(rows.cut[low:high])[-1])
    return (
        _goes_on(program, rows, last, high)
        or bool((rows.travel & ~rows.cut)[last + 1 : high].any())
        or _is_lit_after(program, rows, low, high)
    )


def _goes_on(program: Program, rows: Rows, last: int, high: int) -> bool:
    """Return whether what follows the row of the last cut, and stays, begins at its place."""
    kind, ref, z = program.path.kind, program.path.ref, program.path.end[:, 2]
    risen = higher = False
    for row in range(last + 1, len(kind)):
        stays = row >= high
        if kind[row] == Kind.RAPID:
            compensated = follows_compensation(program, row)
            if rows.sideways[row] or (stays and compensated):
                return (stays and compensated) or (higher and not stops_before_work(program, rows, row))
            risen |= not compensated
            higher = stays and bool(z[row] > rows.before[high, 2] + TOLERANCE)
        elif kind[row] in _FEEDS:
            return stays
        elif kind[row] == Kind.DRILL:
            # To the very next hole a piece that is last now rises as the original did.
            r_plane = program.path.cycles[int(ref[row])].r_plane
            return higher or (row > high and r_plane > rows.before[high, 2] + TOLERANCE)
        elif kind[row] in STOPS:
            return False
        elif stays and not risen and (kind[row] == Kind.DWELL or (kind[row] == Kind.RADIUS and ref[row] != 40)):
            return True
    return False


def stops_before_work(program: Program, rows: Rows, row: int) -> bool:
    """Return whether the tool goes up for a stop or a change of tool after a row, before it works again."""
    upcoming = [np.flatnonzero(mask[row:]) for mask in (rows.cut, np.isin(program.path.kind, STOPS))]
    work, stop = (int(found[0]) if len(found) else math.inf for found in upcoming)
    return stop < work


def follows_compensation(program: Program, row: int) -> bool:
    """Return whether radius compensation was on in the move before a row: it comes to an end in the row."""
    kind = program.path.kind
    before = next((r for r in range(row - 1, -1, -1) if kind[r] <= Kind.DRILL), -1)
    if before < 0:
        return False
    block = int(np.searchsorted(program.first, before, side="right")) - 1
    return program.modal(block + 1).radius != 40


def _is_lit_after(program: Program, rows: Rows, low: int, high: int) -> bool:
    """Return whether the first way behind a piece is made with the beam on, unlike the first of its own."""
    if not rows.beam.any():
        return False
    ways = [np.flatnonzero(part) for part in (rows.travel[low:high], rows.travel[high:])]
    if not all(len(way) for way in ways):
        return False
    blocks = [int(rows.block[start + int(way[0])]) for start, way in zip((low, high), ways, strict=True)]
    own, after = (program.modal(block + 1).spindle for block in blocks)
    return own == 0 and after != 0
