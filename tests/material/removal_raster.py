"""Independent computation of the removal of a path, with pixels in NumPy, without the polygons of `removal`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.material.tool_steps import steps_along_path
from leafcut.model.pocket import Pocket, PocketPath, PocketRules

Mask = NDArray[np.bool_]

#: Pixels of a picture at most: larger pockets get larger pixels.
MOST_PIXELS = 16_000_000


class RasterAreas(NamedTuple):
    """Areas found by counting pixels, mm², and the width of a pixel, mm."""

    pixel: float
    pocket_mm2: float
    reachable_mm2: float
    uncovered_mm2: float
    gouge_mm2: float


def raster_areas(pocket: Pocket, path: PocketPath, rules: PocketRules, pixel: float = 0.1) -> RasterAreas:
    """Return the areas of `removal.Removal` by pixels.

    A pixel counts where its middle lies. An area of perimeter P is true within about P · pixel / 2, and much better
    where its edge is not along the pixels.

    Gouged are the middles nearer to the path than the radius less the tolerance, outside the walls. Uncovered are
    those that are reachable and further from the path than the radius and the tolerance. Reachable are those within
    the radius of a middle that is no nearer to the walls than the radius: half a pixel is added, since such middles
    lie that far behind the edge of the allowed centres on average.
    """
    walls = [line.flattened(0.125 * rules.tolerance) for line in (pocket.outline, *pocket.islands)]
    places = steps_along_path(path, rules).xy
    seen = np.concatenate([*walls, places])
    low, high = seen.min(axis=0) - rules.tool_diameter, seen.max(axis=0) + rules.tool_diameter
    pixel = max(pixel, math.sqrt(float(np.prod(high - low)) / MOST_PIXELS))
    canvas = _Canvas(low, high, pixel)
    inside = canvas.filled(walls)
    step = min(0.5 * pixel, 0.25 * rules.radius)
    allowed = inside & ~canvas.stamped(np.concatenate([_dense(w, step) for w in walls]), rules.radius)
    reachable = inside & (allowed | canvas.stamped(canvas.edge_of(allowed), rules.radius + 0.5 * pixel))
    shallow = canvas.stamped(places, rules.radius + rules.tolerance)
    deep = canvas.stamped(places, rules.radius - rules.tolerance)
    masks = (inside, reachable, reachable & ~shallow, deep & ~inside)
    return RasterAreas(pixel, *(float(np.count_nonzero(mask)) * pixel * pixel for mask in masks))


class _Canvas:
    """Pixels over a rectangle: x of the columns' middles, y of the rows'."""

    def __init__(self, low: Points, high: Points, pixel: float) -> None:
        self.pixel = pixel
        # A share of a pixel that is no fraction of people's numbers: middles then lie on no wall.
        self.low = low - 0.3819660113 * pixel
        columns, rows = np.ceil((high - self.low) / pixel).astype(int) + 1
        self.x = self.low[0] + pixel * (np.arange(columns) + 0.5)
        self.y = self.low[1] + pixel * (np.arange(rows) + 0.5)

    def blank(self) -> Mask:
        return np.zeros((len(self.y), len(self.x)), dtype=bool)

    def filled(self, rings: list[Points]) -> Mask:
        """Return the pixels inside an odd number of closed rings: a row's crossings with all edges, sorted."""
        mask = self.blank()
        a = np.concatenate([ring[:-1] for ring in rings])
        b = np.concatenate([ring[1:] for ring in rings])
        first = np.searchsorted(self.y, np.minimum(a[:, 1], b[:, 1]), side="right")
        count = np.searchsorted(self.y, np.maximum(a[:, 1], b[:, 1]), side="right") - first
        edge = np.repeat(np.arange(len(a)), count)
        row = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count) + first[edge]
        share = (self.y[row] - a[edge, 1]) / (b[edge, 1] - a[edge, 1])
        column = np.searchsorted(self.x, a[edge, 0] + share * (b[edge, 0] - a[edge, 0]))
        flips = np.zeros((len(self.y), len(self.x) + 1), dtype=np.int32)
        np.add.at(flips, (row, column), 1)
        mask[:] = np.cumsum(flips, axis=1)[:, :-1] % 2 == 1
        return mask

    def stamped(self, places: Points, radius: float) -> Mask:
        """Return the pixels nearer than a radius to any of the places."""
        mask = self.blank()
        reach = math.ceil(radius / self.pixel) + 1
        at = np.floor((places - self.low) / self.pixel).astype(int)
        for (x, y), (column, row) in zip(places.tolist(), at.tolist(), strict=True):
            columns = slice(max(column - reach, 0), max(column + reach + 1, 0))
            rows = slice(max(row - reach, 0), max(row + reach + 1, 0))
            dx, dy = self.x[columns] - x, self.y[rows] - y
            mask[rows, columns] |= (dx * dx)[None, :] + (dy * dy)[:, None] < radius * radius
        return mask

    def edge_of(self, mask: Mask) -> Points:
        """Return the middles of the pixels of a mask that have a neighbour outside it, float64[n, 2]."""
        kernel = mask.copy()
        kernel[1:-1, 1:-1] &= mask[:-2, 1:-1] & mask[2:, 1:-1] & mask[1:-1, :-2] & mask[1:-1, 2:]
        row, column = np.nonzero(mask & ~kernel)
        return np.column_stack([self.x[column], self.y[row]])


def _dense(points: Points, step: float) -> Points:
    """Return points along a line no further apart than a step."""
    vector = np.diff(points, axis=0)
    count = np.maximum(np.ceil(np.hypot(vector[:, 0], vector[:, 1]) / step).astype(int), 1)
    row = np.repeat(np.arange(len(vector)), count)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)) / count[row]
    dense: Points = points[row] + share[:, None] * vector[row]
    return dense
