"""Match the rows of a planned toolpath to the lines of the program written from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.model.cycles import expand
from leafcut.model.toolpath import Kind, Toolpath

#: Tolerance of positions, mm. Each rounding error is at most half of 0.0001 inch, but the errors may add up.
_ROUNDING = 0.01
#: Number of rows of the program that are searched for the next row of the plan.
_AHEAD = 40
_SMALLEST_MOVE = 1e-9
_RAPIDS = (Kind.RAPID, Kind.MACHINE)


def written_lines(planned: Toolpath, written: Toolpath) -> NDArray[np.int32]:
    """Return the program line of every row of a planned toolpath without canned cycles, int32[n], from 1.

    `written` is the program read back. Moves are matched in order, by kind and end position. Rows that the program does
    not state, such as the descent of a torch, get the line of the next row. If no row matches, all lines are 0.
    """
    written = expand(written)
    plan_rows, written_rows = _moving_rows(planned), _moving_rows(written)
    a, b = (_move_keys(path, rows) for path, rows in ((planned, plan_rows), (written, written_rows)))
    matches = _match_rows(a, b)
    line = np.zeros(len(planned), dtype=np.int32)
    known = matches >= 0
    line[plan_rows[known]] = written.line[written_rows[matches[known]]]
    return _fill_gaps(line)


def _moving_rows(path: Toolpath) -> NDArray[np.int64]:
    before = path.before
    moves = (path.kind <= Kind.ARC_CCW) | (path.kind == Kind.MACHINE)
    # A row that sets the first position of an axis counts as a move.
    unmoved = (np.abs(path.end - before) <= _SMALLEST_MOVE) | np.isnan(path.end)
    return np.flatnonzero(moves & ~unmoved.all(axis=1))


def _move_keys(path: Toolpath, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the data by which moves are matched, float64[k, 4]: rapid or not, and end position."""
    return np.column_stack([np.isin(path.kind[rows], _RAPIDS), path.end[rows]])


def _equal(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether moves match; unknown coordinates match any value."""
    near = (np.abs(a - b) <= _ROUNDING) | np.isnan(a) | np.isnan(b)
    return np.asarray(near.all(axis=-1))


def _match_rows(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return for every row of `a` the matching row of `b`, or -1; matches are in ascending order."""
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


def _fill_gaps(line: NDArray[np.int32]) -> NDArray[np.int32]:
    """Replace missing lines by the next known line, or at the end by the last known line."""
    rows = np.flatnonzero(line)
    if not len(rows):
        return line
    after = np.minimum(np.searchsorted(rows, np.arange(len(line))), len(rows) - 1)
    return line[rows[after]]
