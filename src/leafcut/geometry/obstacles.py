"""Obstacles in the plane: find moves that cross them, and find the shortest paths around them.

    map = ObstacleMap({0: part, 1: other}, walls={-1: clamp})
    map.path_around(a, b, {0}, radius=4.0)

`shortest_path` is Dijkstra's algorithm. `ObstacleMap` builds visibility graphs of polygons, and
`zones.path_around_zones` builds visibility graphs of rectangles.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.polygon import orient

from leafcut.geometry.arrays import Floats, Indices, Point, Points

#: Minimum depth at which a move crosses a polygon, mm. Moves may start at the edge of a polygon and run along it.
DEPTH = 0.1
#: Distance between paths and corners, mm. This is an estimate: with a larger distance, paths would not fit between
#: polygons that are close together.
MARGIN, CLEARANCE = 1.0, 0.02
#: Tolerance for the distance of paths from polygons, mm.
SLACK = 0.01
#: Maximum number of candidate corners per path, and maximum number of search rounds. Each round adds the polygons on
#: the path.
MOST_CORNERS, MOST_ROUNDS = 120, 3
#: Radius of the disc around an end of a path, in radii of the head. The end is enclosed if it has no exit from this
#: disc.
ENCLOSING = 2.0

#: Key of a group of nodes: the number of a polygon, or a point with a flag that marks an end of the path.
_Key: TypeAlias = int | tuple[Point, bool]
#: Possible corners of paths, float64[n, 2], mm, with their key. They are the corners of a polygon, or a single point.
_Nodes: TypeAlias = tuple[_Key, Points]


def shortest_path(
    n: int, edges: Callable[[int], tuple[Indices, Floats]], start: int, ends: Collection[int]
) -> list[int] | None:
    """Return the nodes of the shortest path from `start` to the closest of the nodes `ends`, or None if no path exists.

    `n` is the number of nodes. `edges` returns the neighbours of a node, int64[k], and their distances, float64[k]. An
    infinite distance means that the nodes are not connected.
    """
    best, previous, queue = np.full(n, np.inf), dict[int, int](), [(0.0, start)]
    best[start] = 0.0
    while queue:
        length, node = heapq.heappop(queue)
        if node in ends:
            path = [node]
            while path[-1] != start:
                path.append(previous[path[-1]])
            return path[::-1]
        if length > best[node]:
            continue
        neighbours, distances = edges(node)
        totals = length + distances
        shorter = totals < best[neighbours]
        for neighbour, total in zip(neighbours[shorter].tolist(), totals[shorter].tolist(), strict=True):
            if total < best[neighbour]:  # two edges may connect the same nodes
                best[neighbour], previous[neighbour] = total, node
                heapq.heappush(queue, (total, neighbour))
    return None


class ObstacleMap:
    """Obstacles for a cutting head. Walls always block the head, and polygons only block it while they are `standing`.

    The head stays at least its radius away from standing polygons, and its centre never crosses a wall. Paths are
    cached for each set of standing polygons.
    """

    def __init__(self, polygons: Mapping[int, Any], walls: Mapping[int, Any]) -> None:
        self.shapes = {**polygons, **walls}
        self._numbers = [*self.shapes]
        self._walls = frozenset(walls)
        inner = [shape.buffer(-DEPTH) for shape in self.shapes.values()]
        self._inner: Any = shapely.STRtree(np.array(inner, dtype=object))
        self._inner_walls: Any = shapely.STRtree(np.array(inner[len(polygons) :], dtype=object))
        self._whole: Any = shapely.STRtree(np.array([*polygons.values()], dtype=object))
        self._corners: dict[tuple[int, float], Points] = {}
        self._crossed: dict[tuple[Point, Point], frozenset[int]] = {}
        self._met: dict[tuple[Point, Point, float], frozenset[int]] = {}
        self._between: dict[tuple[_Key, _Key, float], NDArray[np.int64]] = {}
        # Cached paths by ends and radius: the polygons that influenced the path, those that were standing, and the
        # corners of the path.
        self._paths: dict[
            tuple[Point, Point, float], list[tuple[frozenset[int], frozenset[int], list[Point] | None]]
        ] = {}

    def polygons_crossed(self, a: Point, b: Point) -> frozenset[int]:
        """Return all polygons that a straight move crosses. Walls are not included.

        The result includes polygons that are not standing.
        """
        if (a, b) not in self._crossed:
            hit = self._inner.query(shapely.LineString([a, b]), predicate="intersects")
            self._crossed[a, b] = frozenset(self._numbers[k] for k in hit.tolist()) - self._walls
        return self._crossed[a, b]

    def polygons_approached(self, a: Point, b: Point, radius: float) -> frozenset[int]:
        """Return all polygons that a straight move crosses or approaches within a radius.

        The result includes polygons that are not standing.
        """
        if (a, b, radius) not in self._met:
            _, near = self._approaching_pairs(np.array([[a, b]]), np.array([[True, True]]), radius)
            self._met[a, b, radius] = self.polygons_crossed(a, b) | {self._numbers[k] for k in near.tolist()}
        return self._met[a, b, radius]

    def path_around(self, a: Point, b: Point, standing: set[int], radius: float) -> list[Point] | None:
        """Return the corners of a short path from `a` to `b`, or None if no path exists.

        The path never crosses a wall, and stays `radius` mm away from standing polygons. Within this radius of its
        ends, it may come closer.
        """
        known = self._paths.setdefault((a, b, radius), [])
        for seen, stood, corners in known:
            if seen & standing == stood:
                return corners
        influence = set[int]()
        found = self._find_path(a, b, standing, radius, influence)
        known.append((frozenset(influence), frozenset(influence & standing), found))
        return found

    def _find_path(self, a: Point, b: Point, standing: set[int], radius: float, seen: set[int]) -> list[Point] | None:
        """Return the corners of a path, or None if no path exists.

        The function adds all polygons that influence the path to `seen`.
        """
        met = self.polygons_approached(a, b, radius) if radius > 0.0 else self.polygons_crossed(a, b)
        seen |= met
        apart = math.dist(a, b) > (ENCLOSING + 1.0) * radius > 0.0
        if apart and any(self._is_enclosed(end, standing, radius, seen) for end in (a, b)):
            return None
        blocking = set(met & standing)
        away = [
            *self._clear_points_nearby(a, standing, radius, seen),
            *self._clear_points_nearby(b, standing, radius, seen),
        ]
        ends: list[_Nodes] = [((point, k < 2), np.array([point])) for k, point in enumerate([a, b, *away])]
        for _ in range(MOST_ROUNDS):
            nodes = [*ends, *((n, self._turning_corners(n, radius)) for n in sorted(blocking))]
            if sum(len(places) for _, places in nodes) > MOST_CORNERS:
                return None
            path, hit = self._shortest_unblocked_path(nodes, standing | self._walls, radius, seen)
            if path is not None:
                return path[1:-1]
            if hit <= blocking:
                return None
            blocking |= hit
        return None

    def _is_enclosed(self, place: Point, standing: set[int], radius: float, seen: set[int]) -> bool:
        point, reach = shapely.Point(place), ENCLOSING * radius
        near = self._polygons_near(point, reach + radius)
        seen.update(near)
        blocked = shapely.union_all([self.shapes[n].buffer(radius - SLACK) for n in near if n in standing])
        surroundings = point.buffer(reach)
        free = shapely.get_parts(shapely.difference(surroundings, blocked))
        exits = shapely.dwithin(free, point, radius) & shapely.dwithin(free, surroundings.boundary, SLACK)
        return not exits.any()

    def _polygons_near(self, point: Any, distance: float) -> list[int]:
        return [self._numbers[k] for k in self._whole.query(point, predicate="dwithin", distance=distance).tolist()]

    def _clear_points_nearby(self, place: Point, standing: set[int], radius: float, seen: set[int]) -> list[Point]:
        """Move a point straight away from each standing polygon nearby until the point is clear.

        Return all moved points.
        """
        point, away = shapely.Point(place), list[Point]()
        for number in self._polygons_near(point, radius) if radius > 0.0 else ():
            x, y = shapely.get_coordinates(shapely.shortest_line(self.shapes[number], point))[0]
            far = math.hypot(place[0] - x, place[1] - y)
            seen.add(number)
            if number in standing and far > 0.0:
                out = (radius + CLEARANCE) / far
                away.append((float(x + out * (place[0] - x)), float(y + out * (place[1] - y))))
        return away

    def _approaching_pairs(
        self, lines: NDArray[np.float64], ends: NDArray[np.bool_], radius: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return pairs (line, polygon) for each line that comes within `radius` mm of a polygon.

        `lines` is float64[n, 2, 2]. `ends`, bool[n, 2], marks the ends of the whole path. Within `radius` mm of these
        ends, lines may come closer to a polygon.
        """
        step = lines[:, 1] - lines[:, 0]
        length = np.maximum(np.hypot(*step.T), 1e-12)
        low, high = np.where(ends[:, 0], radius / length, 0.0), np.where(ends[:, 1], 1.0 - radius / length, 1.0)
        some = np.flatnonzero((low < high) & (radius > 0.0))
        begin, end = lines[:, 0] + low[:, None] * step, lines[:, 0] + high[:, None] * step
        cut = shapely.linestrings(np.stack([begin, end], axis=1)[some])
        at, what = self._whole.query(cut, predicate="dwithin", distance=max(radius - SLACK, 0.0))
        return some[at], what

    def _turning_corners(self, number: int, radius: float) -> Points:
        """Return the corners where paths can turn around an obstacle.

        These are the convex corners of its enlarged outline.
        """
        distance = max(MARGIN, radius + CLEARANCE)
        if (number, distance) not in self._corners:
            shape = self.shapes[number].simplify(0.25 * MARGIN)
            grown = shape.buffer(distance, join_style="mitre", mitre_limit=2.0)
            ring = shapely.get_coordinates(orient(grown).exterior)[:-1]
            one, other = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
            self._corners[number, distance] = ring[one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] > 0.0]
        return self._corners[number, distance]

    def _obstacles_between_nodes(self, nodes: Sequence[_Nodes], radius: float) -> NDArray[np.int64]:
        """Find all obstacles that a straight line between two nodes crosses or approaches.

        Return a row (node, node, obstacle) for each of them. The rows are cached, because they do not depend on which
        polygons are standing. Most rows do not depend on the ends of the path either.
        """
        pairs = [(i, j) for i in range(len(nodes)) for j in range(i, len(nodes))]
        keys = [(nodes[i][0], nodes[j][0], radius) for i, j in pairs]
        new = [pair for pair, key in zip(pairs, keys, strict=True) if key not in self._between]
        if new:
            of = [_index_pairs(len(nodes[i][1]), len(nodes[j][1]), i == j) for i, j in new]
            lines = [
                np.stack([nodes[i][1][one], nodes[j][1][other]], axis=1)
                for (i, j), (one, other) in zip(new, of, strict=True)
            ]
            is_end = [not isinstance(key, int) and key[1] for key, _ in nodes]
            ends = np.repeat([(is_end[i], is_end[j]) for i, j in new], [len(some) for some in lines], axis=0)
            which, what = self._obstacles_on_lines(np.concatenate(lines), ends, radius)
            rows = np.vstack([np.concatenate(of, axis=1)[:, which], what]).T
            splits = np.searchsorted(which, np.cumsum([len(some) for some in lines])[:-1])
            for (i, j), some in zip(new, np.split(rows, splits), strict=True):
                self._between[nodes[i][0], nodes[j][0], radius] = some
        first = np.cumsum([0, *(len(places) for _, places in nodes)])
        found = [self._between[key] for key in keys]
        shift = np.zeros((len(pairs), 3), dtype=np.int64)
        shift[:, :2] = first[np.array(pairs)]
        return np.concatenate(found) + np.repeat(shift, [len(some) for some in found], axis=0)

    def _obstacles_on_lines(
        self, lines: NDArray[np.float64], ends: NDArray[np.bool_], radius: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return pairs (line, obstacle) for each line that crosses or approaches an obstacle, sorted by line."""
        # A line between corners is within the radius of each polygon that it crosses. Walls require no distance.
        both = ends.any(axis=1) | (radius <= DEPTH)
        some, others = np.flatnonzero(both), np.flatnonzero(~both)
        at, what = self._inner.query(shapely.linestrings(lines[some]), predicate="intersects")
        of, wall = self._inner_walls.query(shapely.linestrings(lines[others]), predicate="intersects")
        at, what = np.concatenate([some[at], others[of]]), np.concatenate([what, wall + len(self._whole)])
        near, by = self._approaching_pairs(lines, ends, radius)
        which, parts = np.concatenate([at, near]), np.concatenate([what, by])
        order = np.argsort(which, kind="stable")
        return which[order], parts[order]

    def _shortest_unblocked_path(
        self, nodes: Sequence[_Nodes], standing: set[int], radius: float, seen: set[int]
    ) -> tuple[list[Point] | None, set[int]]:
        """Return the shortest unblocked path from the first node to the second node, and an empty set.

        If no such path exists, return None and the obstacles that block a line.
        """
        places = np.concatenate([of for _, of in nodes])
        length = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
        one, other, what = self._obstacles_between_nodes(nodes, radius).T
        numbers = {k: self._numbers[k] for k in np.flatnonzero(np.bincount(what)).tolist()}
        seen.update(numbers.values())
        stands = np.zeros(len(self._numbers), dtype=bool)
        stands[[k for k, number in numbers.items() if number in standing]] = True
        at = stands[what]
        length[one[at], other[at]] = length[other[at], one[at]] = math.inf
        everywhere = np.arange(len(length))
        path = shortest_path(len(length), lambda node: (everywhere, length[node]), 0, (1,))
        if path is None:
            return None, standing.intersection(numbers.values())
        return [(float(x), float(y)) for x, y in places[path].tolist()], set()


def _index_pairs(n: int, m: int, same: bool) -> NDArray[np.int64]:
    """Return all pairs of an index below n and an index below m, int64[2, k].

    If `same`, return all pairs i ≠ j of indices below n.
    """
    return np.array(np.triu_indices(n, 1) if same else np.indices((n, m)).reshape(2, -1))
