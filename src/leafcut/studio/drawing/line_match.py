"""Matches the lines of two programs that do the same work in a different order."""

from __future__ import annotations

from itertools import count

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import occurrence_keys
from leafcut.model.toolpath import Kind, Toolpath

#: Tolerance for equal positions, mm.
_SAME = 0.002
_UNKNOWN = -(1 << 40)


def matching_lines(before: Toolpath, after: Toolpath, original: str, new: str) -> NDArray[np.uint32]:
    """Match the lines of an original program and a new program.

    Lines that do the same work are matched first. The lines next to them (travel moves, comments) are matched if their
    text is equal.

    Returns
    -------
    uint32[k, 2]
        Line in the original and line in the new program, both from 1, sorted by the original line.
    """
    old, current = _number_line_texts(original.split("\n"), new.split("\n"))
    new_of, old_of = np.zeros(len(old) + 1, dtype=np.int64), np.zeros(len(current) + 1, dtype=np.int64)
    lines = _work_pairs(before, after)
    lines = lines[(lines > 0).all(axis=1) & (lines[:, 0] <= len(old)) & (lines[:, 1] <= len(current))]
    for side in (0, 1):
        lines = lines[np.sort(np.unique(lines[:, side], return_index=True)[1])]
    new_of[lines[:, 0]], old_of[lines[:, 1]] = lines[:, 1], lines[:, 0]
    _match_equal_text(new_of, old_of, old, current)
    matched = np.flatnonzero(new_of)
    return np.column_stack([matched, new_of[matched]]).astype(np.uint32)


def _number_line_texts(*texts: list[str]) -> tuple[list[int], ...]:
    numbers: dict[str, int] = {}
    fresh = count()
    numbered = []
    for lines in texts:
        if lines and not lines[-1]:
            lines.pop()
        numbered.append(
            [numbers[s] if (s := line.strip()) in numbers else numbers.setdefault(s, next(fresh)) for line in lines]
        )
    return tuple(numbered)


def _work_pairs(before: Toolpath, after: Toolpath) -> NDArray[np.int64]:
    """Match lines that do the same work, int64[k, 2]. Repeated work is matched in the order of the file."""
    sides = [_work_keys_by_line(path) for path in (before, after)]
    _, number = np.unique(np.concatenate([keys for _, keys in sides]), axis=0, return_inverse=True)
    number = number.reshape(-1)
    first = len(sides[0][0])
    keys = occurrence_keys(number[:first]), occurrence_keys(number[first:])
    _, old, new = np.intersect1d(keys[0], keys[1], assume_unique=True, return_indices=True)
    pairs = np.column_stack([sides[0][0][old], sides[1][0][new]]).astype(np.int64)
    return pairs[np.argsort(old)]


def _work_keys_by_line(path: Toolpath) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the line and the work of each working row.

    The work consists of the kind, the tool, and both ends in a fixed order.
    """
    rows = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL))
    kind = path.kind[rows]
    sort = np.where(kind == Kind.FEED, 0, np.where(kind == Kind.DRILL, 2, 1))
    ends = np.stack([path.before[rows], path.end[rows]], axis=1) / _SAME
    ends = np.where(np.isfinite(ends), np.rint(np.nan_to_num(ends)), _UNKNOWN).astype(np.int64)
    ends[sort == 2, 0] = 0  # the direction of approach to a hole does not matter
    backward = np.zeros(len(rows), dtype=bool)
    equal_so_far = np.ones(len(rows), dtype=bool)
    for axis in range(3):
        backward |= equal_so_far & (ends[:, 0, axis] > ends[:, 1, axis])
        equal_so_far &= ends[:, 0, axis] == ends[:, 1, axis]
    ends[backward] = ends[backward][:, ::-1]
    return path.line[rows], np.column_stack([sort, path.tool[rows], ends.reshape(-1, 6)]).astype(np.int64)


def _match_equal_text(new_of: NDArray[np.int64], old_of: NDArray[np.int64], old: list[int], now: list[int]) -> None:
    """Match lines with equal text, starting at both ends of the programs and next to lines that already match."""
    ahead, back = new_of.tolist(), old_of.tolist()
    n, m = len(old), len(now)

    def take(line: int, new_line: int) -> None:
        if (
            0 < line <= n
            and 0 < new_line <= m
            and not ahead[line]
            and not back[new_line]
            and old[line - 1] == now[new_line - 1]
        ):
            ahead[line], back[new_line] = new_line, line

    take(1, 1)
    for line in range(2, n + 1):
        if not ahead[line] and ahead[line - 1]:
            take(line, ahead[line - 1] + 1)
    take(n, m)
    for line in range(n - 1, 0, -1):
        if not ahead[line] and ahead[line + 1]:
            take(line, ahead[line + 1] - 1)
    new_of[:], old_of[:] = ahead, back
