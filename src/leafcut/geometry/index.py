"""Pairs of shapes that are near to each other, by an index of boxes (shapely's STRtree), within bounds of memory."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Points

Indices = NDArray[np.int64]
#: Pairs that no drawing has: these, and so many per shape more.
MOST_PAIRS, MOST_PER_SHAPE = 500_000, 64
#: Shapes that one question to the index is about: few where many lie together, so that it is found out early.
_FEWEST, _MOST = 16, 4096


def query_pairs(
    shapes: Any, others: Any, what: str, predicate: str, distance: float | None = None
) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs (index in `shapes`, index in `others`) that fulfil a predicate of shapely, some at a time.

    Raises
    ------
    PlanError
        There are more than any drawing has; `what` says of what.
    """
    import shapely

    tree = shapely.STRtree(others)
    more = {} if distance is None else {"distance": distance}
    begin, step, total = 0, _FEWEST, 0
    while begin < len(shapes):
        first, second = tree.query(shapes[begin : begin + step], predicate=predicate, **more)
        total += len(first)
        if total > MOST_PAIRS + MOST_PER_SHAPE * len(shapes):
            raise PlanError(f"millions of {what}; the drawing is no sheet, clean it")
        yield first + begin, second
        begin += step
        step = min(2 * step, _MOST) if len(first) <= MOST_PER_SHAPE * step else max(step // 2, _FEWEST)


def near_pairs(points: Points, distance: float) -> tuple[Indices, Indices, NDArray[np.float64]]:
    """Return all pairs i < j of points (float64[n, 2]) within a distance, and how far apart they are.

    Raises
    ------
    PlanError
        Hundreds lie in one place.
    """
    import shapely

    places = shapely.points(points)
    found = [np.zeros((2, 0), dtype=np.int64)]
    for i, j in query_pairs(places, places, f"points within {distance:g} mm of each other", "dwithin", distance):
        found.append(np.stack([i, j])[:, i < j])
    first, second = np.concatenate(found, axis=1)
    return first, second, np.hypot(*(points[first] - points[second]).T)


def linked(n: int, first: Indices, second: Indices) -> Indices:
    """Return a number for each of 0 … n - 1, int64[n], equal for those that pairs (first, second) link, however far."""
    parent = list(range(n))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        parent[root(b)] = root(a)
    return np.array([root(k) for k in range(n)], dtype=np.int64)
