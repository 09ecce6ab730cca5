"""Compute the height of the material above each pocket of a solid, from the surface above and around the pocket."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.model.pocket import Pocket

#: Maximum projected area of a vertical triangle, mm². Such triangles are skipped, because a neighbour has the same
#: upper edge.
_UPRIGHT = 1e-9


def stock_tops(
    pockets: Sequence[Pocket], of_solid: Sequence[Pocket], triangles: NDArray[np.float64], radius: float
) -> list[float]:
    """Return the height of the material above each pocket before milling, mm, relative to the top of the pocket.

    The height is the highest point of the solid above the pocket or within a tool radius of it. It never exceeds the
    top of the pocket. If a pocket lies inside another pocket, the outer pocket counts as filled up to its rim, even if
    it is milled.

    Parameters
    ----------
    of_solid
        All pockets of the solid.
    triangles
        Surface of the solid, float64[n, 3, 3], mm.
    radius
        Tool radius, mm.
    """
    filled = [pocket.region(filled=True) for pocket in of_solid]
    tops = []
    for pocket in pockets:
        own = pocket.region(filled=True)
        area = shapely.union_all([own, *(other for other in filled if other.intersects(own))])
        highest = highest_over(triangles, area.buffer(radius))
        tops.append(round(min(highest - (pocket.top or 0.0), 0.0), 6))
    return tops


def fill_pockets(
    triangles: NDArray[np.float64], of_solid: Sequence[Pocket], tops: Sequence[float]
) -> NDArray[np.float64]:
    """Fill all pockets of a solid up to their `stock_tops`. Return the new surface, float64[n, 3, 3], mm."""
    lids = [triangles]
    for pocket, top in zip(of_solid, tops, strict=True):
        flat = shapely.get_parts(shapely.constrained_delaunay_triangles(pocket.region(filled=True)))
        xy = shapely.get_coordinates(flat).reshape(-1, 4, 2)[:, :3]
        lids.append(np.concatenate([xy, np.full((len(xy), 3, 1), (pocket.top or 0.0) + top)], axis=2))
    return np.concatenate(lids)


def highest_over(triangles: NDArray[np.float64], area: Any) -> float:
    """Return the maximum height of a surface above an area, mm, or −∞ if the surface does not cover the area at all."""
    x0, y0, x1, y1 = area.bounds
    low, high = triangles[:, :, :2].min(axis=1), triangles[:, :, :2].max(axis=1)
    near = triangles[(low <= (x1, y1)).all(axis=1) & (high >= (x0, y0)).all(axis=1)]
    tops, best = near[:, :, 2].max(axis=1), -np.inf
    shapely.prepare(area)
    for k in np.argsort(-tops, kind="stable").tolist():
        if tops[k] <= best:
            break
        flat = shapely.Polygon(near[k, :, :2])
        if flat.area < _UPRIGHT or not area.intersects(flat):
            continue
        places = near[k] if area.covers(flat) else _raise_to_triangle(near[k], area.intersection(flat))
        best = max(best, float(places[:, 2].max(initial=-np.inf)))
    return best


def _raise_to_triangle(triangle: NDArray[np.float64], part: Any) -> NDArray[np.float64]:
    """Project a plane shape vertically onto the plane of a triangle. Return its corners, float64[n, 3], mm."""
    xy = shapely.get_coordinates(part)
    a, b, c = triangle
    share = np.linalg.solve(np.array([(b - a)[:2], (c - a)[:2]]).T, (xy - a[:2]).T)
    z = a[2] + share[0] * (b - a)[2] + share[1] * (c - a)[2]
    return np.column_stack([xy, np.clip(z, triangle[:, 2].min(), triangle[:, 2].max())])
