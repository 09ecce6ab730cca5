"""`Obstacles`: what stands on the table, and how tools may pass it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import PASSING, touches_any_zone, way_round, widened
from leafcut.quick_dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Rectangles that nothing is cut in, and that rapids cross high up, or not at all.

    Attributes
    ----------
    zones
        float64[k, 4]: x0 ≤ x1, y0 ≤ y1 in order x0, y0, x1, y1, mm, as they were named.
    height
        A rapid at this height or above may cross them, mm; infinite where the tool cannot be lifted: it goes round.
    radii
        By tool, mm: so far its centre stays outside; 0 for others.
    dogleg
        The axes of a rapid do not arrive together, and it may go anywhere in the rectangle between its ends.
    """

    zones: NDArray[np.float64]
    height: float = math.inf
    radii: Mapping[int, float] = field(default_factory=dict)
    dogleg: bool = False

    def __len__(self) -> int:
        return len(self.zones)

    def of_tool(self, tool: int | None) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], that the centre of a tool stays out of."""
        return widened(self.zones, self.radii.get(tool or 0, 0.0))

    def between(self, a: Point, b: Point, tool: int | None) -> bool:
        """Return whether a rapid crosses one; from a place that is not known it may, so one that can be lifted is."""
        unknown = any(map(math.isnan, a))
        if unknown and math.isfinite(self.height):
            return True
        begin = b if unknown else a
        return bool(touches_any_zone([begin], [b], self.of_tool(tool), dogleg=self.dogleg)[0])

    def round(self, a: Point, b: Point, tool: int | None) -> list[Point] | None:
        """Return the places between two on the shortest way round all, or None where there is none."""
        return way_round(a, b, self.of_tool(tool), dogleg=self.dogleg)

    def round_room(self) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], in which all ways round them turn, whatever the tool."""
        return widened(self.zones, PASSING + max(self.radii.values(), default=0.0))
