"""Sample points in a pocket, each with a maximum allowed distance from the tool path."""

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
from leafcut.material.bands import segment_point_pairs_within

#: Function that receives sample points, float64[n, 2], and their spacing, mm. It returns the maximum distance of each
#: point from the path, float64[n], mm.
Limit = Callable[[Points, float], Points]

#: Maximum number of sample points in use, which limits time and memory.
MOST_PLACES = 200_000
#: Largest allowed distance, in sides of a grid cell.
CELLS = 2


@dataclass(frozen=True, eq=False)
class CoveragePoints:
    """Sample points, and the segments of a path close to them.

    Attributes
    ----------
    points
        Sample points, float64[n, 2], mm.
    limits
        Maximum distance of each point from the path, float64[n], mm.
    pieces
        Indices of the segments.
    """

    points: Points
    limits: Points
    pieces: Indices

    @cached_property
    def point_geometries(self) -> Any:
        """The sample points as an array of shapely Points."""
        return shapely.points(self.points)

    def pairs_within_limit(self, path: Points) -> tuple[Indices, Indices]:
        """Find all pairs of a segment and a sample point whose distance is within the limit of the point.

        Return the segment indices, in ascending order, and the point indices.
        """
        piece, place = segment_point_pairs_within(path[self.pieces], path[self.pieces + 1], self.points, self.limits)
        return self.pieces[piece], place


class CoverageGrid:
    """A square grid of sample points inside a region of tool centres.

    Points are only created in the cells that a caller requests.

    Parameters
    ----------
    polygon
        The region of tool centres.
    pitch
        Spacing of the points, mm. The grid uses a larger spacing if there would be too many points.
    longest
        Upper bound for the values of `limit`, mm.
    limit
        Function that returns the maximum distance of each point from the path.
    """

    def __init__(self, polygon: Any, pitch: float, longest: float, limit: Limit) -> None:
        self.polygon, self.longest, self.limit = polygon, longest, limit
        shapely.prepare(polygon)
        self._set_pitch(pitch)

    def _set_pitch(self, pitch: float) -> None:
        self.pitch = pitch
        self.side = max(round(self.longest / (CELLS * pitch)), 1)
        self.grid = Cells(self.polygon.bounds, self.side * pitch, CELLS + 2)
        self.cells = np.zeros(0, np.int64)
        self.points, self.limits = np.zeros((0, 2)), np.zeros(0)
        self.first = np.zeros(1, np.int64)

    def points_near(self, path: Points, selected: NDArray[np.bool_]) -> CoveragePoints:
        """Return all sample points whose limits reach the selected segments of a path, and possibly more points nearby.

        `selected` marks these segments, bool[n − 1]. All segments must be short.
        """
        middle = 0.5 * (path[:-1] + path[1:])
        wanted = self.grid.cells_around(self.grid.cells_of(middle[selected]), CELLS + 1)
        while len(wanted) * self.side**2 > MOST_PLACES and self.side > 1:
            self._set_pitch(self.pitch * math.sqrt(1.05 * len(wanted) * self.side**2 / MOST_PLACES))
            wanted = self.grid.cells_around(self.grid.cells_of(middle[selected]), CELLS + 1)
        self._add_cells(np.setdiff1d(wanted, self.cells, assume_unique=True))
        k = np.searchsorted(self.cells, wanted)
        rows = _joined_ranges(self.first[k], self.first[k + 1])
        near = np.isin(self.grid.cells_of(middle), self.grid.cells_around(wanted, CELLS + 1))
        return CoveragePoints(self.points[rows], self.limits[rows], np.flatnonzero(near))

    def _add_cells(self, cells: Indices) -> None:
        inside = np.arange(self.side**2)
        column, row = self.grid.columns_and_rows(cells)
        x = (column[:, None] * self.side + inside % self.side).ravel()
        y = (row[:, None] * self.side + inside // self.side).ravel()
        points = self.grid.low + self.pitch * np.column_stack([x, y])
        there = shapely.contains_xy(self.polygon, points[:, 0], points[:, 1])
        points = points[there]
        count = there.reshape(len(cells), self.side**2).sum(axis=1)
        all_cells = np.concatenate([self.cells, cells])
        counts = np.concatenate([np.diff(self.first), count])
        first_rows = np.cumsum(counts) - counts
        order = np.argsort(all_cells)
        rows = _joined_ranges(first_rows[order], (first_rows + counts)[order])
        self.points = np.vstack([self.points, points])[rows]
        self.limits = np.concatenate([self.limits, self.limit(points, self.pitch)])[rows]
        self.cells, self.first = all_cells[order], np.concatenate([[0], np.cumsum(counts[order])])


def _joined_ranges(first: Indices, end: Indices) -> Indices:
    counts = end - first
    return np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
