"""The ground of a pocket as places, and how far from each of them a way may be: made where they are looked at."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, Points
from leafcut.geometry.cells import Cells
from leafcut.material.bands import pieces_near

#: How far a way may be from places, float64[n, 2], that are so many mm apart: float64[n], mm.
Limit = Callable[[Points, float], Points]

#: So many places at most are looked at in one go: bounds time and memory.
MOST_PLACES = 200_000
#: Cells in which places are taken, to the longest limit.
CELLS = 2


@dataclass(frozen=True, eq=False)
class CoveragePoints:
    """Places of the ground, float64[n, 2], and how far from each the way may be, float64[n], mm.

    `pieces` are the rows of the way that may be near enough to one of them.
    """

    points: Points
    limits: Points
    pieces: Indices

    @cached_property
    def geoms(self) -> Any:
        """The places as shapely Points."""
        return shapely.points(self.points)

    def near(self, way: Points) -> tuple[Indices, Indices]:
        """Return the pairs (piece of the way, place) where one is near enough to the other, sorted by piece."""
        piece, place = pieces_near(way[self.pieces], way[self.pieces + 1], self.points, self.limits)
        return self.pieces[piece], place


class CoverageGrid:
    """A square grid of places inside a polygon; nothing is kept but those that were looked at.

    Parameters
    ----------
    polygon
        shapely Polygon of the allowed tool centres.
    pitch
        Distance between places, mm; wider where too many would be looked at.
    longest
        No limit is longer, mm.
    limit
        How far from places the way may be.
    """

    def __init__(self, polygon: Any, pitch: float, longest: float, limit: Limit) -> None:
        self.polygon, self.longest, self.limit = polygon, longest, limit
        shapely.prepare(polygon)
        self._set(pitch)

    def _set(self, pitch: float) -> None:
        """Forget all places, and take others so far apart."""
        self.pitch = pitch
        self.side = max(round(self.longest / (CELLS * pitch)), 1)
        self.grid = Cells(self.polygon.bounds, self.side * pitch, CELLS + 2)
        self.cells = np.zeros(0, np.int64)
        self.points, self.limits = np.zeros((0, 2)), np.zeros(0)
        self.first = np.zeros(1, np.int64)

    def beside(self, way: Points, looked: NDArray[np.bool_]) -> CoveragePoints:
        """Return the places that may be near enough to pieces of a way that are looked at, bool[n − 1].

        Pieces are short: no longer than half the longest limit.
        """
        middle = 0.5 * (way[:-1] + way[1:])
        wanted = self.grid.around(self.grid.of(middle[looked]), CELLS + 1)
        while len(wanted) * self.side**2 > MOST_PLACES and self.side > 1:
            self._set(self.pitch * math.sqrt(1.05 * len(wanted) * self.side**2 / MOST_PLACES))
            wanted = self.grid.around(self.grid.of(middle[looked]), CELLS + 1)
        self._learn(np.setdiff1d(wanted, self.cells, assume_unique=True))
        k = np.searchsorted(self.cells, wanted)
        rows = _spans(self.first[k], self.first[k + 1])
        near = np.isin(self.grid.of(middle), self.grid.around(wanted, CELLS + 1))
        return CoveragePoints(self.points[rows], self.limits[rows], np.flatnonzero(near))

    def _learn(self, cells: Indices) -> None:
        """Find the places in cells, and their limits."""
        inside = np.arange(self.side**2)
        column, row = self.grid.columns_and_rows(cells)
        x = (column[:, None] * self.side + inside % self.side).ravel()
        y = (row[:, None] * self.side + inside // self.side).ravel()
        points = self.grid.low + self.pitch * np.column_stack([x, y])
        there = shapely.contains_xy(self.polygon, points[:, 0], points[:, 1])
        points = points[there]
        count = there.reshape(len(cells), self.side**2).sum(axis=1)
        every = np.concatenate([self.cells, cells])
        counts = np.concatenate([np.diff(self.first), count])
        begin = np.cumsum(counts) - counts
        order = np.argsort(every)
        rows = _spans(begin[order], (begin + counts)[order])
        self.points = np.vstack([self.points, points])[rows]
        self.limits = np.concatenate([self.limits, self.limit(points, self.pitch)])[rows]
        self.cells, self.first = every[order], np.concatenate([[0], np.cumsum(counts[order])])


def _spans(first: Indices, end: Indices) -> Indices:
    """Return all rows from each `first` up to its `end`."""
    many = end - first
    return np.repeat(first - np.cumsum(many) + many, many) + np.arange(many.sum())
