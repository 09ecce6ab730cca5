"""`Obstacles`: clamps and fixtures on the table, and how rapids get past them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import PASSING, path_around_zones, touches_any_zone, widen_zones
from leafcut.model.cutter import widest_radius_below


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Rectangles in which the program must not cut. Rapids cross them at a safe height or go around them.

    Attributes
    ----------
    zones
        float64[k, 4]: x0, y0, x1, y1 with x0 ≤ x1, y0 ≤ y1, mm.
    heights
        float64[k]: minimum height of a rapid across each zone, mm. Infinite if the tool cannot be lifted and must go
        around the zone.
    radii
        Maps a tool number to the radius of the flutes, mm. The centre of the tool keeps at least this distance from a
        zone. All other tools have radius 0.
    dogleg
        Whether each axis moves at its own speed in a rapid, so that the path is bent.
    bodies
        Maps a tool number to the discs of shank and holder, as pairs (height above the tip, radius), mm.
    lowest
        Maps a tool number to the lowest height of its tip, mm. With the tip at this height, every disc that is lower
        than a zone must clear the zone.
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

    def zones_for_tool(self, tool: int | None) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], that the centre of a tool must avoid."""
        return widen_zones(self.zones, self._margins(tool or 0))

    def min_rapid_height(self, a: Point, b: Point, tool: int | None) -> float:
        """Return the minimum height of a rapid from `a` to `b`, mm, or −∞ if the rapid crosses no zone.

        A rapid from an unknown position may cross any zone. If the tool can be lifted, such a rapid must stay above all
        zones.
        """
        unknown = any(map(math.isnan, a))
        if unknown and math.isfinite(self.height):
            return self.height
        start = b if unknown else a
        zones = self.zones_for_tool(tool)
        if not touches_any_zone([start], [b], zones, dogleg=self.dogleg)[0]:
            return -math.inf
        touched = [touches_any_zone([start], [b], zones[[k]], dogleg=self.dogleg)[0] for k in range(len(zones))]
        return float(self.heights[touched].max())

    def route_around(self, a: Point, b: Point, tool: int | None) -> list[Point] | None:
        """Return the intermediate points of the shortest route around all zones, or None if every route is blocked."""
        return path_around_zones(a, b, self.zones_for_tool(tool), dogleg=self.dogleg)

    def extent_of_detours(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the extent of moves over or around the zones: the lowest and then the highest x, y and z, mm."""
        if math.isfinite(self.height):
            return (math.inf,) * 3, (-math.inf, -math.inf, self.height)
        widest = max((float(self._margins(tool).max(initial=0.0)) for tool in self.radii), default=0.0)
        wide = widen_zones(self.zones, PASSING + widest)
        low, high = wide[:, :2].min(axis=0).tolist(), wide[:, 2:].max(axis=0).tolist()
        return (*low, math.inf), (*high, -math.inf)

    def _margins(self, tool: int) -> NDArray[np.float64]:
        """Return the distance that the centre of a tool must keep from each zone, float64[k], mm."""
        bodies, lowest = self.bodies.get(tool, ()), self.lowest.get(tool, -math.inf)
        return widest_radius_below(self.radii.get(tool, 0.0), bodies, lowest, self.heights)
