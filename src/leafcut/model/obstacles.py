"""`Obstacles`: clamps and fixtures on the table, and rapids past them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import PASSING, path_around_zones, touches_any_zone, widened
from leafcut.model.cutter import widest_below


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Rectangles without cuts; rapids cross them at a safe height, or go around.

    Attributes
    ----------
    zones
        float64[k, 4]: x0, y0, x1, y1 with x0 ≤ x1, y0 ≤ y1, mm.
    heights
        float64[k]: minimum height of a rapid across each zone, mm; infinite if the tool cannot be lifted and must go
        around.
    radii
        By tool, radius of the flutes, mm: minimum distance of its centre; 0 for others.
    bodies
        By tool, discs above its flutes: height above the tip, and radius, mm.
    lowest
        By tool, lowest height of its tip, mm. Its centre keeps clear of a zone with every disc that is then below the
        zone's height.
    """

    zones: NDArray[np.float64]
    heights: NDArray[np.float64]
    radii: Mapping[int, float] = field(default_factory=dict)
    dogleg: bool = False
    bodies: Mapping[int, Sequence[tuple[float, float]]] = field(default_factory=dict)
    lowest: Mapping[int, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.zones)

    @property
    def height(self) -> float:
        """Minimum height of a rapid across all zones, mm."""
        return float(self.heights.max(initial=-math.inf))

    def of_tool(self, tool: int | None) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], that the centre of a tool must avoid."""
        return widened(self.zones, self._margins(tool or 0))

    def between(self, a: Point, b: Point, tool: int | None) -> float:
        """Return the minimum height of a rapid from `a` to `b`, mm; −∞ if no zone is in its path.

        A rapid from an unknown position may cross any zone; it is lifted if it can be.
        """
        unknown = any(map(math.isnan, a))
        if unknown and math.isfinite(self.height):
            return self.height
        start = b if unknown else a
        zones = self.of_tool(tool)
        if not touches_any_zone([start], [b], zones, dogleg=self.dogleg)[0]:
            return -math.inf
        touched = [touches_any_zone([start], [b], zones[[k]], dogleg=self.dogleg)[0] for k in range(len(zones))]
        return float(self.heights[touched].max())

    def round(self, a: Point, b: Point, tool: int | None) -> list[Point] | None:
        """Return the intermediate points of the shortest path around all zones, or None if all paths are blocked."""
        return path_around_zones(a, b, self.of_tool(tool), dogleg=self.dogleg)

    def round_room(self) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], that contain all corners of paths around the zones, for any tool."""
        widest = max((float(self._margins(tool).max(initial=0.0)) for tool in self.radii), default=0.0)
        return widened(self.zones, PASSING + widest)

    def _margins(self, tool: int) -> NDArray[np.float64]:
        """Return the distance that the centre of a tool keeps from each zone, float64[k], mm."""
        bodies, lowest = self.bodies.get(tool, ()), self.lowest.get(tool, -math.inf)
        return widest_below(self.radii.get(tool, 0.0), bodies, lowest, self.heights)
