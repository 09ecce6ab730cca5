"""What holds the last piece of work of a run in its place: that what comes next begins where it ends."""

from __future__ import annotations

import numpy as np

from leafcut.gcode.program import Program
from leafcut.model.sequence import Chain
from leafcut.model.toolpath import MOTIONS, Kind
from leafcut.plan.chains import Rows

#: Rows before which the tool goes up for their sake.
STOPS = [int(k) for k in (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)]
_MOTIONS = [int(k) for k in MOTIONS]
#: What takes up where the work before it has ended.
_GOES_ON = [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DWELL)]


def stays_last(program: Program, rows: Rows, chain: Chain) -> bool:
    """Return whether a chain behind which others stay must be the last of its section.

    So it is where a cut, a dwell, or radius compensation follows without a rapid in between; where the chain itself
    goes elsewhere after its work, as for a person or the end; and where the next way is made with a beam that was off.
    """
    low, high = int(program.first[chain.begin]), int(program.first[chain.end])
    last = low + int(np.flatnonzero(rows.cut[low:high])[-1])
    return (
        _goes_on(program, last, high)
        or bool((rows.travel & ~rows.cut)[last + 1 : high].any())
        or _is_lit_after(program, rows, low, high)
    )


def _goes_on(program: Program, last: int, high: int) -> bool:
    """Return whether what follows the row of the last cut, and stays, begins at its place."""
    kind, ref = program.path.kind, program.path.ref
    for row in range(last + 1, len(kind)):
        if row >= high and (kind[row] in _GOES_ON or (kind[row] == Kind.RADIUS and ref[row] != 40)):
            return True
        if kind[row] in _MOTIONS or kind[row] in STOPS:
            return False
    return False


def _is_lit_after(program: Program, rows: Rows, low: int, high: int) -> bool:
    """Return whether the first way behind a chain is made with the beam on, unlike the first of its own."""
    if not rows.beam.any():
        return False
    ways = [np.flatnonzero(part) for part in (rows.travel[low:high], rows.travel[high:])]
    if not all(len(way) for way in ways):
        return False
    blocks = [int(rows.block[start + int(way[0])]) for start, way in zip((low, high), ways, strict=True)]
    own, after = (program.modal(block + 1).spindle for block in blocks)
    return own == 0 and after != 0
