"""`Obstacles`: what stands on the table, and how tools may pass it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import PASSING, touches_any_zone, way_round, widened
from leafcut.model.cutter import widest_below


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Rectangles that nothing is cut in, and that rapids cross high up, or not at all.

    Attributes
    ----------
    zones
        float64[k, 4]: x0 ≤ x1, y0 ≤ y1 in order x0, y0, x1, y1, mm, as they were named.
    heights
        float64[k]: a rapid at this height or above may cross each zone, mm; infinite where the tool cannot be lifted:
        it goes round.
    radii
        Of the flutes, by tool, mm: so far its centre stays outside; 0 for others.
    dogleg
        The axes of a rapid do not arrive together, and it may go anywhere in the rectangle between its ends.
    bodies
        By tool, of what is above its flutes: how far above the tip, and the radius, mm.
    lowest
        By tool, mm: how low its tip goes. Its centre stays as far outside of a zone as all that is then below the
        height of the zone.
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
        """The height at which a rapid may cross all of them, mm."""
        return float(self.heights.max(initial=-math.inf))

    def of_tool(self, tool: int | None) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], that the centre of a tool stays out of."""
        return widened(self.zones, self._margins(tool or 0))

    def between(self, a: Point, b: Point, tool: int | None) -> float:
        """Return the height at or above which a rapid may go from `a` to `b`, mm; −∞ where none is in the way.

        From a place that is not known it may cross all, so one that can be lifted is.
        """
        unknown = any(map(math.isnan, a))
        if unknown and math.isfinite(self.height):
            return self.height
        begin = b if unknown else a
        zones = self.of_tool(tool)
        if not touches_any_zone([begin], [b], zones, dogleg=self.dogleg)[0]:
            return -math.inf
        touched = [touches_any_zone([begin], [b], zones[[k]], dogleg=self.dogleg)[0] for k in range(len(zones))]
        return float(self.heights[touched].max())

    def round(self, a: Point, b: Point, tool: int | None) -> list[Point] | None:
        """Return the places between two on the shortest way round all, or None where there is none."""
        return way_round(a, b, self.of_tool(tool), dogleg=self.dogleg)

    def round_room(self) -> NDArray[np.float64]:
        """Return the rectangles, float64[k, 4], in which all ways round them turn, whatever the tool."""
        widest = max((float(self._margins(tool).max(initial=0.0)) for tool in self.radii), default=0.0)
        return widened(self.zones, PASSING + widest)

    def _margins(self, tool: int) -> NDArray[np.float64]:
        """Return how far the centre of a tool stays outside of each zone, float64[k], mm."""
        bodies, lowest = self.bodies.get(tool, ()), self.lowest.get(tool, -math.inf)
        return widest_below(self.radii.get(tool, 0.0), bodies, lowest, self.heights)
