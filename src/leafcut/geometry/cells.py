"""Square cells of the plane, numbered, so that what is near a place is found without looking at everything."""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Indices, Points


class Cells:
    """Square cells, numbered row by row, with as many more around a box as the `margin` says.

    Parameters
    ----------
    bounds
        The box that places lie in: lowest x and y, highest x and y, mm.
    side
        Of a cell, mm.
    margin
        How many cells beyond the box are numbered, too: as far as `around` may go.
    """

    def __init__(self, bounds: tuple[float, float, float, float], side: float, margin: int) -> None:
        self.low, self.side, self.margin = np.array(bounds[:2]), side, margin
        self.wide = math.ceil((bounds[2] - bounds[0]) / side) + 2 * margin

    def of(self, places: Points) -> Indices:
        """Return the cells that places, float64[n, 2], are in, int64[n]."""
        column, row = (np.floor((places - self.low) / self.side).astype(np.int64) + self.margin).T
        cells: Indices = row * self.wide + column
        return cells

    def around(self, cells: Indices, reach: int) -> Indices:
        """Return the cells as near to some as `reach`, each once, sorted."""
        cells, offsets = np.unique(cells), np.arange(-reach, reach + 1)
        for step in (1, self.wide):
            cells = np.unique(cells[:, None] + step * offsets)
        return cells

    def columns_and_rows(self, cells: Indices) -> tuple[Indices, Indices]:
        """Return which column and which row of cells each is in, 0 at the corner of the box."""
        return cells % self.wide - self.margin, cells // self.wide - self.margin


def numbered(places: Points, side: float) -> Indices:
    """Return a number for every place, float64[n, 2], int64[n]: equal where both rounded to `side`, mm, are."""
    if not len(places):
        return np.zeros(0, np.int64)
    column, row = np.round(places / side).astype(np.int64).T
    numbers: Indices = (column - column.min()) * (row.max() - row.min() + 1) + (row - row.min())
    return numbers
