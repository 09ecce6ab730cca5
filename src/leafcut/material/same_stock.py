"""Compare the remaining stock of two programs: height fields, cell by cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.material.height_field import HeightField

#: Side of the squares in which differing cells are grouped, cells.
_TILE = 64


class StockDifference(NamedTuple):
    """A place where two fields differ: position of the largest difference, both heights there, mm, and cell count."""

    x: float
    y: float
    before: float
    after: float
    cells: int


def stock_differences(before: HeightField, after: HeightField, tolerance: float) -> list[StockDifference]:
    """Return the differences of two height fields with the same cells, largest places first.

    A cell differs if its height is more than `tolerance`, mm, outside the range of the other field in the cell and its
    eight neighbours. A wall moved by less than a cell therefore counts as equal. Nearby cells are one place.

    Raises
    ------
    ValueError
        The fields have different cells.
    """
    wrong = differing_cells(before, after, tolerance)
    rows, columns = np.nonzero(wrong)
    if not len(rows):
        return []
    apart = np.abs(before.heights - after.heights)
    found = []
    label = (rows // _TILE) * wrong.shape[1] + columns // _TILE
    order = np.argsort(label, kind="stable")
    for place in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        worst = place[np.argmax(apart[rows[place], columns[place]])]
        row, column = int(rows[worst]), int(columns[worst])
        found.append(
            StockDifference(
                before.x + column * before.cell,
                before.y + row * before.cell,
                float(before.heights[row, column]),
                float(after.heights[row, column]),
                len(place),
            )
        )
    return sorted(found, key=lambda one: -one.cells)


def regions(cells: NDArray[np.bool_], near: int = 8) -> list[NDArray[np.int64]]:
    """Return groups of cells, int64[k, 2] rows and columns each, largest first.

    Cells in touching squares of `near` cells are one group.
    """
    places = np.argwhere(cells)
    squares: dict[tuple[int, int], list[int]] = {}
    for at, (row, column) in enumerate((places // near).tolist()):
        squares.setdefault((row, column), []).append(at)
    groups = []
    while squares:
        found, waiting = list[int](), [next(iter(squares))]
        while waiting:
            row, column = waiting.pop()
            found += squares.pop((row, column), [])
            beside = ((row + down, column + across) for down in (-1, 0, 1) for across in (-1, 0, 1))
            waiting += [square for square in beside if square in squares]
        groups.append(places[found])
    return sorted(groups, key=lambda group: -len(group))


def differing_cells(before: HeightField, after: HeightField, tolerance: float) -> NDArray[np.bool_]:
    """Return the differing cells, bool[rows, columns], as defined in `stock_differences`.

    Raises
    ------
    ValueError
        The fields have different cells.
    """
    if before.heights.shape != after.heights.shape or (before.x, before.y, before.cell) != (
        after.x, after.y, after.cell,
    ):  # fmt: skip
        raise ValueError("height fields of different cells cannot be compared")
    return _outside(after.heights, before.heights, tolerance) | _outside(before.heights, after.heights, tolerance)


def _outside(one: NDArray[np.float32], other: NDArray[np.float32], tolerance: float) -> NDArray[np.bool_]:
    """Return the cells of a field that are higher or lower than all nine cells of the other field there."""
    low, high = other.copy(), other.copy()
    for axis in (0, 1):
        for extreme, wide in ((np.minimum, low), (np.maximum, high)):
            shifted = wide.copy()
            ahead, behind = (slice(1, None), slice(None, -1)) if axis == 0 else (
                (slice(None), slice(1, None)), (slice(None), slice(None, -1))
            )  # fmt: skip
            extreme(wide[ahead], shifted[behind], out=wide[ahead])
            extreme(wide[behind], shifted[ahead], out=wide[behind])
    outside: NDArray[np.bool_] = (one < low - tolerance) | (one > high + tolerance)
    return outside
