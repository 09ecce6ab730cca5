"""Pairs of nearby shapes, by an index of bounding boxes (shapely's STRtree), with bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Indices, Points

#: Maximum number of pairs in a valid drawing: constant, and per shape.
MOST_PAIRS, MOST_PER_SHAPE = 500_000, 64
#: Shapes per query of the index: few in crowded drawings, to detect them early.
_FEWEST, _MOST = 16, 4096
#: Batch sizes of `NearLines`: lines per query, and pairs evaluated at a time.
_LINES, _PAIRS = 256, 500_000
#: Relative accuracy of box and point distances; pairs closer to the limit are measured by GEOS.
_EXACT = 1e-9


def query_pairs(
    shapes: Any, others: Any, what: str, predicate: str, distance: float | None = None
) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs (index in `shapes`, index in `others`) that satisfy a shapely predicate, in batches.

    Raises
    ------
    PlanError
        There are more than in any valid drawing; `what` names them.
    """
    tree: Any = shapely.STRtree(others)
    more = {} if distance is None else {"distance": distance}
    begin, step, total = 0, _FEWEST, 0
    while begin < len(shapes):
        first, second = tree.query(shapes[begin : begin + step], predicate=predicate, **more)
        total += len(first)
        if total > MOST_PAIRS + MOST_PER_SHAPE * len(shapes):
            raise PlanError(f"millions of {what}; clean up the drawing")
        yield first + begin, second
        begin += step
        step = min(2 * step, _MOST) if len(first) <= MOST_PER_SHAPE * step else max(step // 2, _FEWEST)


def near_pairs(points: Points, distance: float) -> tuple[Indices, Indices, NDArray[np.float64]]:
    """Return all pairs i < j of points (float64[n, 2]) within a distance, and their distances.

    Raises
    ------
    PlanError
        Hundreds of points lie in one place.
    """
    places = shapely.points(points)
    found = [np.zeros((2, 0), dtype=np.int64)]
    for i, j in query_pairs(places, places, f"points within {distance:g} mm of each other", "dwithin", distance):
        found.append(np.stack([i, j])[:, i < j])
    first, second = np.concatenate(found, axis=1)
    return first, second, np.hypot(*(points[first] - points[second]).T)


class NearLines:
    """Short lines and points, object[n] of shapely, for finding near pairs.

    Most pairs are decided by bounding boxes and three points of each, without measuring the distance of the lines; in
    crowded drawings that is most of the work.
    """

    def __init__(self, lines: NDArray[np.object_]) -> None:
        self.lines, self.boxes = lines, shapely.bounds(lines)
        coordinates, of = shapely.get_coordinates(lines, return_index=True)
        first, last = (np.searchsorted(of, np.arange(len(lines)), side=side) for side in ("left", "right"))
        self.marks = coordinates[np.stack([first, (first + last - 1) // 2, last - 1], axis=1)]
        self.tree = shapely.STRtree(lines)

    def pairs(
        self, others: NearLines, reach: float, wanted: Callable[[Indices, Indices], NDArray[np.bool_]] | None = None
    ) -> Iterator[tuple[Indices, Indices]]:
        """Yield (index here, index in `others`) of lines at most `reach` apart, in batches.

        `wanted` selects the pairs to test: from int64[k] and int64[k] to bool[k].
        """
        for begin in range(0, len(others.lines), _LINES):
            left, low, right, high = others.boxes[begin : begin + _LINES].T
            wide = shapely.box(left - reach, low - reach, right + reach, high + reach)
            found = self.tree.query(wide)
            for k in range(0, max(found.shape[1], 1), _PAIRS):
                other, one = found[:, k : k + _PAIRS]
                other = other + begin
                if wanted is not None:
                    chosen = wanted(one, other)
                    one, other = one[chosen], other[chosen]
                yield self._near(one, others, other, reach)

    def _near(self, one: Indices, others: NearLines, other: Indices, reach: float) -> tuple[Indices, Indices]:
        a, b = self.boxes[one], others.boxes[other]
        apart = np.maximum(np.maximum(a[:, :2] - b[:, 2:], b[:, :2] - a[:, 2:]), 0.0)
        may = np.hypot(*apart.T) <= reach * (1.0 + _EXACT)
        one, other = one[may], other[may]
        near = np.zeros(len(one), dtype=bool)
        for k in range(3):
            for m in range(3):
                between = self.marks[one, k] - others.marks[other, m]
                near |= np.hypot(*between.T) <= reach * (1.0 - _EXACT)
        unsure = np.flatnonzero(~near)
        near[unsure] = shapely.dwithin(self.lines[one[unsure]], others.lines[other[unsure]], reach)
        return one[near], other[near]


def unique_pairs(first: Indices, second: Indices) -> Indices:
    """Return int64[k, 2], the distinct pairs (first, second), in order; both are non-negative."""
    wide = int(second.max(initial=0)) + 1
    keys = np.sort(first * wide + second)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    return np.stack([keys // wide, keys % wide], axis=1)


def linked(n: int, first: Indices, second: Indices) -> Indices:
    """Return a component number for each of 0 … n - 1, int64[n]; the pairs (first, second) are edges."""
    parent = list(range(n))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        parent[root(b)] = root(a)
    return np.array([root(k) for k in range(n)], dtype=np.int64)
