"""Rectangles that moves must not cross at a low height, such as clamps, vices and raised edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Tolerance for touching a rectangle, mm. It only covers rounded coordinates.
_TOUCH = 1e-9


def widen_zones(zones: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
    """Enlarge rectangles (x0, y0, x1, y1; float64[k, 4]) on all sides by `distance` mm.

    `distance` is a single number, or an array with a number for each rectangle.
    """
    table = np.asarray(zones, dtype=np.float64).reshape(-1, 4)
    result: NDArray[np.float64] = table + np.multiply.outer(
        np.asarray(distance, dtype=np.float64), [-1.0, -1.0, 1.0, 1.0]
    )
    return result


def touches_any_zone(a: ArrayLike, b: ArrayLike, zones: ArrayLike, *, dogleg: bool = False) -> NDArray[np.bool_]:
    """Return a mask of the moves from `a` to `b` (float64[n, 2], mm) that touch any of the `zones` (float64[k, 4]).

    A segment and a rectangle are disjoint exactly if a line along an axis or along the segment separates them
    (separating axis theorem for two convex shapes). With `dogleg`, the axes are not synchronised, so the actual path is
    not straight. The whole rectangle between start and end is checked instead. A move with an unknown coordinate (NaN)
    never touches a zone.
    """
    start, end = (np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in (a, b))
    touched = np.zeros(len(start), dtype=bool)
    low, high = np.minimum(start, end), np.maximum(start, end)
    dx, dy = (end - start).T
    # A cross product equals a distance times the length of the segment.
    tolerance = _TOUCH * (np.abs(dx) + np.abs(dy))
    for x0, y0, x1, y1 in np.asarray(zones, dtype=np.float64).reshape(-1, 4):
        corner_low, corner_high = np.array([min(x0, x1), min(y0, y1)]), np.array([max(x0, x1), max(y0, y1)])
        touching = ((high >= corner_low - _TOUCH) & (low <= corner_high + _TOUCH)).all(axis=1)
        if not dogleg:
            sides = np.array(
                [dx * (y - start[:, 1]) - dy * (x - start[:, 0]) for x in (x0, x1) for y in (y0, y1)], dtype=np.float64
            )
            touching &= (sides.min(axis=0) <= tolerance) & (sides.max(axis=0) >= -tolerance)
        touched |= touching
    return touched


#: Distance between a detour and the corners of a rectangle, mm.
PASSING = 1.0


def path_around_zones(
    a: tuple[float, float], b: tuple[float, float], zones: ArrayLike, *, dogleg: bool = False
) -> list[tuple[float, float]] | None:
    """Return the corners of the shortest path from `a` to `b` around all `zones`, or None if no path exists.

    The path turns slightly outside the corners of the rectangles. `dogleg` works as in `touches_any_zone`.
    """
    from leafcut.geometry.obstacles import shortest_path

    wide = widen_zones(zones, PASSING)
    places = np.concatenate([[a, b], wide[:, [0, 1]], wide[:, [2, 1]], wide[:, [2, 3]], wide[:, [0, 3]]])

    def edges(node: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        start = np.broadcast_to(places[node], places.shape)
        visible = np.flatnonzero(~touches_any_zone(start, places, zones, dogleg=dogleg))
        return visible, np.hypot(*(places[visible] - places[node]).T)

    path = shortest_path(len(places), edges, 0, (1,))
    return None if path is None else [(round(float(x), 3), round(float(y), 3)) for x, y in places[path[1:-1]].tolist()]
