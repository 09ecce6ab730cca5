"""Engagement of the cutting edge along a path, computed exactly by intersecting circles.

When the tool reaches a point p, it has already swept an area. The engagement is the part of the cutting edge, on the
front half of the tool, that lies outside this area. The swept area is represented by discs one step apart. Each disc
covers an interval of angles around p. Sorting gives the union of these intervals without a raster or a polygon.

The edge always touches the area that the tool has just cleared. The algorithm therefore looks for material slightly
inside the edge, by a tolerance, and ignores thinner films. The disc at the tool position then covers exactly the rear
half. Nearby discs of the same run are reduced by the tolerance as well. Otherwise, the previous step would seem to cut
the fresh edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.kernels.engagement import EdgePath, ToolEdge, measure_engagement
from leafcut.material.bands import sort_into_bands
from leafcut.material.tool_steps import ToolSteps
from leafcut.model.pocket import PocketRules

#: Minimum engagement that does not count as a rounding error, rad.
_NOTHING = 1e-6


class Engaged(NamedTuple):
    """The engagement at each point of a path, float64[n] each.

    Attributes
    ----------
    angle
        Engagement angle of the edge, rad, at most π.
    width
        Width of the removed strip of material, measured perpendicular to the path, mm. In a slot, this is the tool
        diameter.
    chip
        Maximum chip thickness as a share of the feed per tooth. This is the cosine of the smallest angle between the
        direction of travel and an engaged part of the edge, so it is 1 for material straight ahead. For a one-sided
        straight cut of width a < r, the share is √(1 − (1 − a/r)²), which equals the chip thinning 2 √(a/D (1 − a/D))
        (`material.cutting.relative_chip_thickness`).
    """

    angle: Floats
    width: Floats
    chip: Floats


def slot_engagement(diameter: float) -> Engaged:
    """Return the engagement of a tool that cuts a slot as wide as its diameter, mm."""
    return Engaged(np.array([math.pi]), np.array([diameter]), np.ones(1))


def engagement_along_path(path: ToolSteps, rules: PocketRules, entry: NDArray[np.bool_] | None = None) -> Engaged:
    """Return the engagement at each point of a path.

    The tolerance t for the width of material limits the accuracy: an angle φ is accurate to t / (r sin φ). For a tool
    of 10 mm and a tolerance of 0.01 mm, this is 0.1 degrees at 90 degrees. Cuts thinner than 2t may result in 0. The
    engagement is only evaluated at the points. If the edge meets material head-on within a step, the engagement
    increases at the end of this step.

    `entry` marks the points on entry loops. Their engagement is 0, because the tool has cleared the loop during its
    descent.
    """
    n = len(path)
    angle, width, nearest = (np.zeros(n) for _ in range(3))
    if n:
        near = 2.0 * math.sqrt(2.0 * rules.radius * rules.tolerance)
        tool = ToolEdge(rules.radius, rules.radius - rules.tolerance, near, _NOTHING)
        x, y, ahead_x, ahead_y, back_x, back_y = np.concatenate([path.xy, path.ahead, path.back], axis=1).T.copy()
        points = EdgePath(x, y, ahead_x, ahead_y, back_x, back_y, path.run, np.cumsum(path.step))
        low, high = np.zeros((2, 2 * n + 2))
        # All earlier points count, including those without engagement. Otherwise the films that they removed would
        # accumulate as material for later points.
        measure_engagement(sort_into_bands(path.xy, rules.radius), points, tool, low, high, angle, width, nearest)
    if entry is not None:
        angle[entry] = width[entry] = 0.0
    return Engaged(angle, rules.radius * width, np.where(angle > 0.0, np.cos(nearest), 0.0))
