"""Map rows of a planned toolpath to lines of the program written from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.model.cycles import expand
from leafcut.model.toolpath import Kind, Toolpath

#: Tolerance of rounded positions, mm: half of 0.0001 inch at worst, and again where they add up.
_ROUNDING = 0.01
#: Maximum number of program rows between two matched rows of the plan.
_AHEAD = 40
_SMALLEST_MOVE = 1e-9
_RAPIDS = (Kind.RAPID, Kind.MACHINE)


def written_lines(planned: Toolpath, written: Toolpath) -> NDArray[np.int32]:
    """Return the line of every row of a plan without canned cycles, int32[n], from 1; 0 for none.

    `written` is the program read back. Its moves are matched in order, by kind and end. Actions without a word in the
    program (a torch that descends and pierces) get the line of the next row.
    """
    written = expand(written)
    plan_rows, written_rows = _moving(planned), _moving(written)
    a, b = (_marks(path, rows) for path, rows in ((planned, plan_rows), (written, written_rows)))
    matches = _aligned(a, b)
    line = np.zeros(len(planned), dtype=np.int32)
    known = matches >= 0
    line[plan_rows[known]] = written.line[written_rows[matches[known]]]
    return _filled(line)


def _moving(path: Toolpath) -> NDArray[np.int64]:
    before = path.before
    moves = (path.kind <= Kind.ARC_CCW) | (path.kind == Kind.MACHINE)
    # A row that gives an axis its first position also counts.
    unmoved = (np.abs(path.end - before) <= _SMALLEST_MOVE) | np.isnan(path.end)
    return np.flatnonzero(moves & ~unmoved.all(axis=1))


def _marks(path: Toolpath, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return float64[k, 4]: rapid or not, and the end."""
    return np.column_stack([np.isin(path.kind[rows], _RAPIDS), path.end[rows]])


def _equal(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Unknown values match anything."""
    near = (np.abs(a - b) <= _ROUNDING) | np.isnan(a) | np.isnan(b)
    return np.asarray(near.all(axis=-1))


def _aligned(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return for every row of `a` its row of `b`, in order, -1 for none."""
    if len(a) == len(b) and _equal(a, b).all():
        return np.arange(len(a))
    matches = np.full(len(a), -1, dtype=np.int64)
    start = 0
    for row in range(len(a)):
        equal = np.flatnonzero(_equal(a[row], b[start : start + _AHEAD]))
        if len(equal):
            matches[row] = start + equal[0]
            start += int(equal[0]) + 1
    return matches


def _filled(line: NDArray[np.int32]) -> NDArray[np.int32]:
    """Fill missing lines with the next line, and at the end with the last."""
    rows = np.flatnonzero(line)
    if not len(rows):
        return line
    after = np.minimum(np.searchsorted(rows, np.arange(len(line))), len(rows) - 1)
    return line[rows[after]]
