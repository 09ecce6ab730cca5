"""Compare the stock that two programs leave, cell by cell, using height fields."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.material.height_field import HeightField

#: Side length of the squares in which differing cells are grouped, in cells.
_TILE = 64
#: Side length of the squares that make up regions of cells, in cells.
_SQUARE = 8


class StockDifference(NamedTuple):
    """A difference between two height fields.

    The largest difference is at `x`, `y`, where the heights are `before` and `after`, mm. `cells` is the number of
    cells that differ.
    """

    x: float
    y: float
    before: float
    after: float
    cells: int


def stock_differences(before: HeightField, after: HeightField, tolerance: float) -> list[StockDifference]:
    """Return the differences between two height fields with the same cells, sorted by descending number of cells.

    Each cell is compared with the heights of the other field in this cell and in its eight neighbours. The cell differs
    if its height is more than `tolerance` mm outside the range of these heights. A wall that has moved by less than a
    cell therefore counts as equal. Neighbouring cells are reported together.

    Raises
    ------
    ValueError
        The fields have different cells.
    """
    wrong = differing_cells(before, after, tolerance)
    rows, columns = np.nonzero(wrong)
    if not len(rows):
        return []
    difference = np.abs(before.heights - after.heights)
    result = []
    label = (rows // _TILE) * wrong.shape[1] + columns // _TILE
    order = np.argsort(label, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        worst = group[np.argmax(difference[rows[group], columns[group]])]
        row, column = int(rows[worst]), int(columns[worst])
        result.append(
            StockDifference(
                before.x + column * before.cell,
                before.y + row * before.cell,
                float(before.heights[row, column]),
                float(after.heights[row, column]),
                len(group),
            )
        )
    return sorted(result, key=lambda stock_difference: -stock_difference.cells)


def connected_regions(cells: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Return connected groups of cells, largest first. Each group is an array of rows and columns, int64[k, 2].

    The cells are combined into squares of `_SQUARE` cells. Squares that touch each other belong to the same group.
    """
    positions = np.argwhere(cells)
    squares: dict[tuple[int, int], list[int]] = {}
    for index, (row, column) in enumerate((positions // _SQUARE).tolist()):
        squares.setdefault((row, column), []).append(index)
    groups = []
    while squares:
        members, stack = list[int](), [next(iter(squares))]
        while stack:
            row, column = stack.pop()
            members += squares.pop((row, column), [])
            neighbours = (
                (row + row_step, column + column_step) for row_step in (-1, 0, 1) for column_step in (-1, 0, 1)
            )
            stack += [square for square in neighbours if square in squares]
        groups.append(positions[members])
    return sorted(groups, key=lambda group: -len(group))


def differing_cells(before: HeightField, after: HeightField, tolerance: float) -> NDArray[np.bool_]:
    """Return a mask of the cells that differ (see `stock_differences`), bool[rows, columns].

    Raises ValueError if the fields have different cells.
    """
    first, second = ((field.heights.shape, field.x, field.y, field.cell) for field in (before, after))
    if first != second:
        raise ValueError("height fields of different cells cannot be compared")
    return _outside_neighbourhood_range(after.heights, before.heights, tolerance) | _outside_neighbourhood_range(
        before.heights, after.heights, tolerance
    )


def _outside_neighbourhood_range(
    field: NDArray[np.float32], reference: NDArray[np.float32], tolerance: float
) -> NDArray[np.bool_]:
    low, high = reference.copy(), reference.copy()
    for extreme, whole in ((np.minimum, low), (np.maximum, high)):
        for bound in (whole, whole.T):
            shifted = bound.copy(order="K")
            extreme(bound[1:], shifted[:-1], out=bound[1:])
            extreme(bound[:-1], shifted[1:], out=bound[:-1])
    outside: NDArray[np.bool_] = (field < low - tolerance) | (field > high + tolerance)
    return outside
