"""How much of the tool's edge is in material, step by step along the way: exact by circles against circles.

At a place p the tool has removed what its disc swept so far. Engaged is the part of its edge, on the half of the
circle that looks ahead, that lies in none of it. What was swept is taken as discs one step apart, so that each covers
one interval of angles about p and their union is found by sorting: no raster, no polygon.

Two circles of one radius touch each other all the time (the edge has just been there), so material is looked for a
tolerance inside the edge: a film thinner than the tolerance is no material. The disc that the tool stands on then
covers exactly the half behind it, and discs of the same run nearer than `_NEAR` are shrunk by the tolerance, too, or
the fresh edge would seem to be cut by the step before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.kernels.engagement import ToolEdge, engaged_edges
from leafcut.material.bands import bands_of
from leafcut.material.tool_steps import ToolWay
from leafcut.model.pocket import PocketRules

#: An engagement below this is rounding, rad.
_NOTHING = 1e-6


class Engaged(NamedTuple):
    """What the tool engages at every place of a way: the angle of its edge, rad, at most π; its width, mm; float64[n].

    The width is measured square to the way: the strip of material that the tool takes off sideways, its whole diameter
    in a slot. `chip` is the thickest chip as a share of the feed per tooth: cos of the least angle between the way
    ahead and an engaged part of the edge, 1 where material is straight ahead. Of a straight cut a wide at one side,
    a < r, that is √(1 − (1 − a/r)²), the 2 √(a/D (1 − a/D)) of chip thinning (`material.chip_thickness`).
    """

    angle: Floats
    width: Floats
    chip: Floats


def engagement(way: ToolWay, rules: PocketRules, entry: NDArray[np.bool_] | None = None) -> Engaged:
    """Return what is engaged at every place of a way.

    Exact at the places but for what the tolerance t does to the width of material: an angle φ is true within
    t / (r sin φ), 0.1 degrees at 90 for a tool of 10 mm and 0.01 mm; where less than 2t is cut it may be 0. In between
    it is not looked at: an edge met head-on within one step shows at the step's end.

    Parameters
    ----------
    entry
        Places on the loop along which the tool came down: it has cleared them on its way, and 0 is told.
    """
    n = len(way)
    angle, width, nearest = (np.zeros(n) for _ in range(3))
    if n:
        near = 2.0 * math.sqrt(2.0 * rules.radius * rules.tolerance)
        tool = ToolEdge(rules.radius, rules.radius - rules.tolerance, near, _NOTHING)
        x, y, ahead_x, ahead_y, back_x, back_y = np.concatenate([way.xy, way.ahead, way.back], axis=1).T.copy()
        low, high = np.zeros((2, 2 * n + 2))
        # All earlier places count, those too where nothing was engaged: a film that they took off, thinner than the
        # tolerance, would be material for others, and such films would add up.
        engaged_edges(
            bands_of(way.xy, rules.radius), x, y, ahead_x, ahead_y, back_x, back_y, way.run, np.cumsum(way.step), tool,
            low, high, angle, width, nearest,
        )  # fmt: skip
    if entry is not None:
        angle[entry] = width[entry] = 0.0
    return Engaged(angle, rules.radius * width, np.where(angle > 0.0, np.cos(nearest), 0.0))
