"""Straight moves and shortest paths inside a region of tool centres.

The nodes are the points to visit and points on the boundary. Straight moves connect nodes that are close together, and
paths along the boundary connect neighbouring nodes on the boundary.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Indices, Points
from leafcut.geometry.obstacles import shortest_path

#: Rounding tolerance for moves along the boundary, mm.
ROUNDING = 1e-6
#: Maximum length of a straight move between two nodes, in grid spacings.
REACH = 3.0
#: Distance between nodes on the boundary, in grid spacings.
NODE_SPACING = 0.5
#: Number of segments tested at once; it limits memory.
SEGMENTS_AT_ONCE = 50_000


class RegionPaths:
    """Allowed moves between points of a region, and the shortest paths along them.

    `places` contains the points to visit, followed by the nodes on the boundary, float64[n + m, 2], mm. `rings`
    contains the nodes of each boundary ring in order, as indices of `places`.
    """

    def __init__(self, polygon: Any, rings: list[Points], points: Points, pitch: float) -> None:
        self.n_points, self.allowed = len(points), polygon.buffer(ROUNDING, join_style="mitre")
        shapely.prepare(self.allowed)
        self._along: dict[tuple[int, int], Points] = {}
        self.rings: list[NDArray[np.int64]] = []
        stops: list[Points] = []
        links: list[tuple[int, int, float]] = []
        count = len(points)
        for corners in rings:
            ring = _densified_ring(corners, NODE_SPACING * pitch)
            at = _spaced_indices(ring, NODE_SPACING * pitch)
            nodes = np.arange(count, count + len(at))
            for k, (a, b) in enumerate(zip(at, np.roll(at, -1), strict=True)):
                here, there = int(nodes[k]), int(nodes[(k + 1) % len(nodes)])
                run = ring[a : b + 1] if b > a else np.concatenate([ring[a:], ring[: b + 1]])
                self._along[here, there], self._along[there, here] = run, run[::-1]
                links.append((here, there, length_of(run)))
            self.rings.append(nodes)
            stops.append(ring[at])
            count += len(at)
        self.places = np.concatenate([points.reshape(-1, 2), *stops])
        self._store_edges(links, REACH * pitch)

    def _store_edges(self, links: Iterable[tuple[int, int, float]], reach: float) -> None:
        """Store the neighbours of each node and the lengths of the moves to them, mm."""
        places: Any = shapely.points(self.places)
        here, there = shapely.STRtree(places).query(places, predicate="dwithin", distance=reach)
        pairs = np.stack([here, there], axis=1)[here < there]
        pairs = pairs[self.straight(self.places[pairs[:, 0]], self.places[pairs[:, 1]])]
        cost = np.hypot(*(self.places[pairs[:, 0]] - self.places[pairs[:, 1]]).T)
        around = np.array([(a, b, c) for a, b, c in links if a != b]).reshape(-1, 3)
        a = np.concatenate([pairs[:, 0], around[:, 0].astype(np.int64)])
        b = np.concatenate([pairs[:, 1], around[:, 1].astype(np.int64)])
        costs = np.concatenate([cost, around[:, 2]])
        source, target, costs = np.concatenate([a, b]), np.concatenate([b, a]), np.concatenate([costs, costs])
        order = np.lexsort((costs, target, source))
        self._begin = np.searchsorted(source[order], np.arange(len(self.places) + 1))
        self._target, self._cost = target[order], costs[order]

    def straight(self, start: Points, end: Points) -> NDArray[np.bool_]:
        """Return a mask of the straight moves from `start` to `end`, float64[k, 2] each, that stay inside the
        region.
        """
        inside = np.zeros(len(start), dtype=np.bool_)
        for k in range(0, len(start), SEGMENTS_AT_ONCE):
            part = slice(k, k + SEGMENTS_AT_ONCE)
            inside[part] = shapely.covers(self.allowed, shapely.linestrings(np.stack([start[part], end[part]], axis=1)))
        return inside

    def between_points(self) -> NDArray[np.float64]:
        """Return the lengths of the shortest paths between all points, float64[n, n], mm; infinite where no path
        exists.

        The matrix is relaxed row by row, in sweeps across the plane, until it converges.
        """
        n, total = self.n_points, len(self.places)
        lengths = np.full((total, n), np.inf)
        lengths[np.arange(n), np.arange(n)] = 0.0
        order = np.lexsort((self.places[:, 1], self.places[:, 0]))
        news = np.ones(total, dtype=np.bool_)
        for sweep in range(total):
            changed = False
            for i in order if sweep % 2 == 0 else order[::-1]:
                near = slice(self._begin[i], self._begin[i + 1])
                if near.start == near.stop or not news[i]:
                    continue
                news[i] = False
                row = (lengths[self._target[near]] + self._cost[near, None]).min(axis=0)
                if (row < lengths[i] - ROUNDING).any():
                    np.minimum(lengths[i], row, out=lengths[i])
                    news[self._target[near]] = changed = True
            if not changed:
                break
        both: NDArray[np.float64] = np.minimum(lengths[:n], lengths[:n].T)
        return both

    def path_to_nearest(self, start: int, ends: Collection[int]) -> tuple[int, Points] | None:
        """Find the shortest path from `start` to any of the nodes `ends`, and straighten it.

        Return its last node and its corners, or None if no path exists.
        """
        nodes = shortest_path(len(self.places), self._edges, start, ends)
        return None if nodes is None else (nodes[-1], self._straightened(self._corners(nodes)))

    def _edges(self, node: int) -> tuple[Indices, Floats]:
        near = slice(self._begin[node], self._begin[node + 1])
        return self._target[near], self._cost[near]

    def _corners(self, nodes: list[int]) -> Points:
        runs = [self.places[nodes[:1]]]
        for a, b in itertools.pairwise(nodes):
            run = self._along.get((a, b))
            straight = math.dist(self.places[a], self.places[b])
            if run is None or (length_of(run) > straight + ROUNDING and self._is_straight(a, b)):
                run = self.places[[a, b]]
            runs.append(run[1:])
        return np.concatenate(runs)

    def _is_straight(self, a: int, b: int) -> bool:
        return bool(self.straight(self.places[[a]], self.places[[b]])[0])

    def _straightened(self, corners: Points) -> Points:
        """Straighten a path: from each corner, go to the farthest visible corner."""
        kept, at = [0], 0
        while at < len(corners) - 1:
            rest = corners[at + 1 :]
            seen = np.flatnonzero(self.straight(np.broadcast_to(corners[at], rest.shape), rest))
            at += int(seen[-1]) + 1 if len(seen) else 1
            kept.append(at)
        return corners[kept]


def _densified_ring(ring: Points, spacing: float) -> Points:
    return np.asarray(shapely.segmentize(shapely.LinearRing(ring), spacing).coords)[:-1]


def _spaced_indices(ring: Points, spacing: float) -> NDArray[np.int64]:
    along = np.concatenate([[0.0], np.hypot(*np.diff(ring, axis=0).T).cumsum()])
    step = np.floor(along / spacing).astype(np.int64)
    stops = np.flatnonzero(np.diff(step, prepend=-1) > 0)
    return stops if len(stops) > 1 else np.array([0, len(ring) // 2])


def length_of(path: Points) -> float:
    """Return the length of a path through corners, float64[k, 2], mm."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())
