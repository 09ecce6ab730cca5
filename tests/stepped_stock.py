"""A second judge of stock: a flat mill put at many places along its way, on a coarse grid, in plain NumPy."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

#: Distance of the tested tool positions, mm.
STEP = 0.2


class SteppedStock:
    """A block of heights, cut by a flat mill place by place."""

    def __init__(self, low: Sequence[float], high: Sequence[float], cell: float = 0.25) -> None:
        self.x = np.arange(low[0] + cell / 2, high[0], cell)
        self.y = np.arange(low[1] + cell / 2, high[1], cell)
        self.heights = np.full((len(self.y), len(self.x)), float(high[2]))

    def under(self, x: float, y: float, radius: float) -> np.ndarray:
        """Return which cells lie within a radius of a place."""
        return (self.x[None, :] - x) ** 2 + (self.y[:, None] - y) ** 2 <= radius**2

    def highest(self, begin: Sequence[float], end: Sequence[float], radius: float) -> float:
        """Return the maximum height of material above the tip along a move, mm; negative if below."""
        worst = -math.inf
        for x, y, z in places(begin, end):
            near = self.under(x, y, radius)
            if near.any():
                worst = max(worst, float(self.heights[near].max()) - z)
        return worst

    def cut(self, begin: Sequence[float], end: Sequence[float], radius: float) -> None:
        """Cut along a way."""
        for x, y, z in places(begin, end):
            near = self.under(x, y, radius)
            self.heights[near] = np.minimum(self.heights[near], z)


def places(begin: Sequence[float], end: Sequence[float]) -> np.ndarray:
    """Return places along a way, both ends among them."""
    count = max(math.ceil(math.dist(begin, end) / STEP), 1)
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    return np.asarray(begin) + share * (np.asarray(end) - np.asarray(begin))
