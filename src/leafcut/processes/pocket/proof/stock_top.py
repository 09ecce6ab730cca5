"""What stands over a solid's pockets before they are milled is no higher than a program takes it to be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.regions import region
from leafcut.model.difference import Difference
from leafcut.model.pocket import Pocket
from leafcut.proof.surface import meets_area

#: Room for the chords of arcs and of the triangles, mm.
_ROOM = 0.06


def stock_top_differences(
    pockets: Sequence[Pocket],
    tops: Sequence[float],
    of_solid: Sequence[Pocket],
    triangles: NDArray[np.float64],
    radius: float,
) -> list[Difference]:
    """Return the pockets over which, or within a tool's radius around which, the solid is higher than `tops` say.

    What other pockets of the solid take away there is taken to be full up to their own rims. It looks at each triangle
    above such a height by itself, with its distance, and shares no code with what found the heights.

    Parameters
    ----------
    tops
        Of each pocket, mm: 0 where the pockets of a program begin, and negative below.
    of_solid
        All pockets of the solid, milled or not; `triangles`, float64[n, 3, 3], are its surface, mm.
    """
    wrong = []
    for one, top in zip(pockets, tops, strict=True):
        own = region(one.outline, (), name=one.label)
        around = [region(other.outline, (), name=other.label) for other in of_solid]
        area = shapely.union_all([own, *(other for other in around if other.distance(own) <= 0.0)])
        height = (one.top or 0.0) + top
        if meets_area(triangles, area, radius - _ROOM, height + _ROOM):
            words = f"{one.label}: the solid is higher than Z{height:.3f}, where its material is taken to begin"
            wrong.append(Difference("rapid in the material", 0, 0, words))
    return wrong
