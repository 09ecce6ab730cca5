"""A grid of square cells for looking up nearby points quickly."""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Indices, Points


class Cells:
    """Square cells that cover a box and are numbered row by row.

    The box is given by minimum x and y, then maximum x and y, mm. `side` is the side length of a cell, mm. `margin` is
    the number of extra cells on each side of the box. `around` must not use a larger `reach` than this.
    """

    def __init__(self, bounds: tuple[float, float, float, float], side: float, margin: int) -> None:
        self.low, self.side, self.margin = np.array(bounds[:2]), side, margin
        self.wide = math.ceil((bounds[2] - bounds[0]) / side) + 2 * margin

    def cells_of(self, points: Points) -> Indices:
        """Return the number of the cell that contains each point, int64[n]."""
        column, row = (np.floor((points - self.low) / self.side).astype(np.int64) + self.margin).T
        cells: Indices = row * self.wide + column
        return cells

    def cells_around(self, cells: Indices, reach: int) -> Indices:
        """Return the sorted numbers of all cells within `reach` rows and columns of the given cells."""
        cells, offsets = np.unique(cells), np.arange(-reach, reach + 1)
        for step in (1, self.wide):
            cells = np.unique(cells[:, None] + step * offsets)
        return cells

    def columns_and_rows(self, cells: Indices) -> tuple[Indices, Indices]:
        """Return the column and the row of each cell, counted from the lower left corner of the grid."""
        return cells % self.wide - self.margin, cells // self.wide - self.margin


def number_points(points: Points, side: float) -> Indices:
    """Number the points, int64[n]. If points round to the same multiples of `side`, mm, they share a number."""
    if not len(points):
        return np.zeros(0, np.int64)
    column, row = np.round(points / side).astype(np.int64).T
    numbers: Indices = (column - column.min()) * (row.max() - row.min() + 1) + (row - row.min())
    return numbers
