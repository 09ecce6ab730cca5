"""Rectangles that moves must not cross at a low height: clamps, vices, raised edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Tolerance for touching a rectangle, mm, for rounded coordinates only.
_TOUCH = 1e-9


def widened(zones: ArrayLike, by: ArrayLike) -> NDArray[np.float64]:
    """Return `zones` (float64[k, 4]: x0 ≤ x1, y0 ≤ y1), every side moved outwards by `by` mm, scalar or float64[k]."""
    table = np.asarray(zones, dtype=np.float64).reshape(-1, 4)
    wider: NDArray[np.float64] = table + np.multiply.outer(np.asarray(by, dtype=np.float64), [-1.0, -1.0, 1.0, 1.0])
    return wider


def touches_any_zone(a: ArrayLike, b: ArrayLike, zones: ArrayLike, *, dogleg: bool = False) -> NDArray[np.bool_]:
    """Return for every move from `a` to `b` (float64[n, 2], mm) whether it touches one of `zones` (float64[k, 4]).

    A segment and a rectangle are disjoint exactly if a line along an axis or along the segment separates them
    (separating axis theorem for two convex shapes). With `dogleg`, the axes are not synchronised and the path is not
    straight, so the whole rectangle between start and end counts. An unknown coordinate (NaN) touches nothing.
    """
    begin, end = (np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in (a, b))
    touched = np.zeros(len(begin), dtype=bool)
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    dx, dy = (end - begin).T
    # A cross product is a distance times the segment's length.
    room = _TOUCH * (np.abs(dx) + np.abs(dy))
    for x0, y0, x1, y1 in np.asarray(zones, dtype=np.float64).reshape(-1, 4):
        corner_low, corner_high = np.array([min(x0, x1), min(y0, y1)]), np.array([max(x0, x1), max(y0, y1)])
        near = ((high >= corner_low - _TOUCH) & (low <= corner_high + _TOUCH)).all(axis=1)
        if not dogleg:
            sides = np.array(
                [dx * (y - begin[:, 1]) - dy * (x - begin[:, 0]) for x in (x0, x1) for y in (y0, y1)], dtype=np.float64
            )
            near &= (sides.min(axis=0) <= room) & (sides.max(axis=0) >= -room)
        touched |= near
    return touched


#: Distance at which a detour passes the corners of a rectangle, mm.
PASSING = 1.0


def way_round(
    a: tuple[float, float], b: tuple[float, float], zones: ArrayLike, *, dogleg: bool = False
) -> list[tuple[float, float]] | None:
    """Return the corners of the shortest path from `a` to `b` around all `zones`; None if there is none.

    Dijkstra's algorithm over the corners of the rectangles, each slightly outside; `dogleg` as in `touches_any_zone`.
    """
    wide = widened(zones, PASSING)
    corners = np.concatenate([wide[:, [0, 1]], wide[:, [2, 1]], wide[:, [2, 3]], wide[:, [0, 3]]])
    places = np.concatenate([[a, b], corners])
    n = len(places)
    length, came, left = np.full(n, np.inf), np.full(n, -1), np.ones(n, dtype=bool)
    length[0] = 0.0
    while left.any():
        here = int(np.argmin(np.where(left, length, np.inf)))
        if not left[here] or not np.isfinite(length[here]):
            return None
        if here == 1:
            break
        left[here] = False
        free = left & ~touches_any_zone(np.broadcast_to(places[here], (n, 2)), places, zones, dogleg=dogleg)
        way = length[here] + np.hypot(*(places - places[here]).T)
        better = free & (way < length)
        length[better], came[better] = way[better], here
    turns: list[tuple[float, float]] = []
    at = int(came[1])
    while at > 0:
        turns.append((round(float(places[at, 0]), 3), round(float(places[at, 1]), 3)))
        at = int(came[at])
    return turns[::-1]
