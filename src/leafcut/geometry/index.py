"""Find pairs of shapes that are close to each other, using an index of bounding boxes (shapely's STRtree)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Indices, Points
from leafcut.message import Message

#: Maximum number of pairs in a valid drawing: a base value, plus a number for each shape.
MOST_PAIRS, MOST_PER_SHAPE = 500_000, 64
#: Number of shapes per query of the index. In crowded drawings, a small number detects too many pairs early.
_MIN_BATCH, _MAX_BATCH = 16, 4096
#: Batch sizes of `NearLines`: lines per query, and pairs that are evaluated together.
_LINES, _PAIRS = 256, 500_000
#: Relative accuracy of the distances between boxes and points. If a distance is closer to the limit, GEOS measures the
#: pair.
_ACCURACY = 1e-9


def query_pairs(
    shapes: Any, targets: Any, description: str, predicate: str, distance: float | None = None
) -> Iterator[tuple[Indices, Indices]]:
    """Yield batches of pairs (index in `shapes`, index in `targets`) that satisfy a shapely predicate.

    Raises
    ------
    PlanError
        There are more pairs than in any valid drawing. The message contains `description`.
    """
    tree: Any = shapely.STRtree(targets)
    options = {} if distance is None else {"distance": distance}
    start, step, total = 0, _MIN_BATCH, 0
    while start < len(shapes):
        first, second = tree.query(shapes[start : start + step], predicate=predicate, **options)
        total += len(first)
        if total > MOST_PAIRS + MOST_PER_SHAPE * len(shapes):
            raise PlanError("millions of {}; clean up the drawing", description)
        yield first + start, second
        start += step
        step = min(2 * step, _MAX_BATCH) if len(first) <= MOST_PER_SHAPE * step else max(step // 2, _MIN_BATCH)


def point_pairs_within(points: Points, distance: float) -> tuple[Indices, Indices, NDArray[np.float64]]:
    """Return all pairs of points i < j that are within a distance of each other, and the distance of each pair.

    Raises
    ------
    PlanError
        Hundreds of points share the same position.
    """
    shapes = shapely.points(points)
    batches = [np.zeros((2, 0), dtype=np.int64)]
    for i, j in query_pairs(
        shapes, shapes, Message("points within {:g} mm of each other", distance), "dwithin", distance
    ):
        batches.append(np.stack([i, j])[:, i < j])
    first, second = np.concatenate(batches, axis=1)
    return first, second, np.hypot(*(points[first] - points[second]).T)


class NearLines:
    """An index of short shapely lines and points that finds pairs close to each other.

    The bounding boxes and three points of each line are enough to decide most pairs. Measuring all distances between
    lines would take most of the time in crowded drawings.
    """

    def __init__(self, lines: NDArray[np.object_]) -> None:
        self.lines, self.boxes = lines, shapely.bounds(lines)
        coordinates, owner = shapely.get_coordinates(lines, return_index=True)
        first, last = (np.searchsorted(owner, np.arange(len(lines)), side=side) for side in ("left", "right"))
        self.samples = coordinates[np.stack([first, (first + last - 1) // 2, last - 1], axis=1)]
        self.tree = shapely.STRtree(lines)

    def pairs(
        self,
        targets: NearLines,
        reach: float,
        is_candidate: Callable[[Indices, Indices], NDArray[np.bool_]] | None = None,
    ) -> Iterator[tuple[Indices, Indices]]:
        """Yield batches of pairs (index in this object, index in `targets`) of lines that are at most `reach` apart.

        `is_candidate` receives both index arrays, int64[k], and returns a mask, bool[k], of the pairs to test.
        """
        for start in range(0, len(targets.lines), _LINES):
            min_x, min_y, max_x, max_y = targets.boxes[start : start + _LINES].T
            boxes = shapely.box(min_x - reach, min_y - reach, max_x + reach, max_y + reach)
            candidates = self.tree.query(boxes)
            for k in range(0, max(candidates.shape[1], 1), _PAIRS):
                target, line = candidates[:, k : k + _PAIRS]
                target = target + start
                if is_candidate is not None:
                    selected = is_candidate(line, target)
                    line, target = line[selected], target[selected]
                yield self._pairs_within_reach(line, targets, target, reach)

    def _pairs_within_reach(
        self, line: Indices, targets: NearLines, target: Indices, reach: float
    ) -> tuple[Indices, Indices]:
        a, b = self.boxes[line], targets.boxes[target]
        box_gaps = np.maximum(np.maximum(a[:, :2] - b[:, 2:], b[:, :2] - a[:, 2:]), 0.0)
        possible = np.hypot(*box_gaps.T) <= reach * (1.0 + _ACCURACY)
        line, target = line[possible], target[possible]
        near = np.zeros(len(line), dtype=bool)
        for k in range(3):
            for j in range(3):
                offsets = self.samples[line, k] - targets.samples[target, j]
                near |= np.hypot(*offsets.T) <= reach * (1.0 - _ACCURACY)
        unsure = np.flatnonzero(~near)
        near[unsure] = shapely.dwithin(self.lines[line[unsure]], targets.lines[target[unsure]], reach)
        return line[near], target[near]


class ShapeIndex:
    """An index of shapely polygons or lines of any size. A query only measures the distances of edges nearby."""

    def __init__(self, shapes: Any) -> None:
        self._shapes = np.array(shapes, dtype=object)
        shapely.prepare(self._shapes)
        self._tree = shapely.STRtree(self._shapes)

    def pairs_near(self, others: Any, distance: float) -> Indices:
        """Return all pairs of shapes that are within `distance` mm of each other, sorted, int64[2, k].

        A pair consists of an index in `others` and the index of a shape.
        """
        others = np.asarray(others, dtype=object)
        min_x, min_y, max_x, max_y = shapely.bounds(others).T
        boxes = shapely.box(min_x - distance, min_y - distance, max_x + distance, max_y + distance)
        other, shape = self._tree.query(boxes)
        near = shapely.dwithin(self._shapes[shape], others[other], distance)
        return unique_pairs(other[near], shape[near]).T


def unique_pairs(first: Indices, second: Indices) -> Indices:
    """Return the distinct pairs (first, second) of non-negative numbers in sorted order, int64[k, 2]."""
    stride = int(second.max(initial=0)) + 1
    keys = np.sort(first * stride + second)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    return np.stack([keys // stride, keys % stride], axis=1)


def connected_components(n: int, first: Indices, second: Indices) -> Indices:
    """Return the connected component of each node 0 … n - 1 as a number. The pairs (first, second) are the edges."""
    parent = list(range(n))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        parent[root(b)] = root(a)
    return np.array([root(k) for k in range(n)], dtype=np.int64)
