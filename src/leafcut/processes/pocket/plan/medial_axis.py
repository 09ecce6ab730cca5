"""The medial axis of a region (points with several nearest walls) as a tree whose root is the widest point."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Points, segments

#: A branch leads into a corner if its end is closer to the boundary than this distance, in sample spacings.
_IN_CORNER = 4.0
#: Maximum number of samples on the boundary; it limits memory.
_MOST = 200_000


@dataclass(frozen=True, eq=False)
class Axis:
    """The medial axis as a tree of points.

    - `xy`: points, float64[n, 2], mm; the first point is the root (widest point), other points follow their parents
    - `width`: distance of each point from the boundary of the region, float64[n], mm
    - `parent`: index of the parent of each point, int64[n]; -1 for the root
    """

    xy: Points
    width: Floats
    parent: NDArray[np.int64]

    def children(self) -> list[list[int]]:
        """Return the children of each point, sorted by the length of their branches, shortest first."""
        below = np.zeros(len(self.xy))
        follow: list[list[int]] = [[] for _ in below]
        for i in range(len(below) - 1, 0, -1):
            up = int(self.parent[i])
            below[up] += below[i] + math.dist(self.xy[i], self.xy[up])
            follow[up].append(i)
        for nodes in follow:
            nodes.sort(key=lambda i: below[i])
        return follow


def medial_axis(polygon: Any, spacing: float, tolerance: float) -> Axis:
    """Return the medial axis of a polygon, from the Voronoi diagram of points on its boundary, `spacing` mm apart.

    Cycles around islands are cut at their narrowest points. Branches into corners are extended to the corner. A branch
    is removed if its discs extend beyond the disc at its fork by less than the tolerance, because such a branch only
    leads to a vertex between two chords. Source: J. W. Brandt, "Convergence and continuity criteria for discrete
    approximations of the continuous planar skeleton", CVGIP: Image Understanding 59 (1994): the inner edges of the
    diagram converge to the axis.
    """
    points = _boundary_points(polygon, spacing)
    lines = shapely.voronoi_polygons(shapely.MultiPoint(points), only_edges=True)
    ends = np.concatenate([segments(np.asarray(g.coords)) for g in getattr(lines, "geoms", [lines])])
    shapely.prepare(polygon)
    ends = ends[shapely.contains_properly(polygon, shapely.linestrings(ends))]
    if not len(ends):  # a circle, where all edges of the diagram meet in the centre
        line = shapely.maximum_inscribed_circle(polygon, 0.1 * tolerance)
        return Axis(np.asarray(line.coords)[:1], np.array([line.length]), np.array([-1]))
    xy, names = np.unique(ends.reshape(-1, 2).round(7), axis=0, return_inverse=True)
    width = shapely.distance(shapely.points(xy), polygon.boundary)
    order, parent = _widest_spanning_tree(xy, width, names.reshape(-1, 2))
    axis = Axis(xy[order], width[order], parent)
    return _prune_branches(_extend_into_corners(axis, polygon, _IN_CORNER * spacing), tolerance)


def _boundary_points(polygon: Any, spacing: float) -> Points:
    parts = []
    spacing = max(spacing, polygon.length / _MOST)
    for ring in (polygon.exterior, *polygon.interiors):
        points = np.asarray(ring.coords)[:, :2]
        vector = np.diff(points, axis=0)
        count = np.maximum(np.ceil(np.hypot(vector[:, 0], vector[:, 1]) / spacing).astype(np.int64), 1)
        row = np.repeat(np.arange(len(vector)), count)
        share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)) / count[row]
        parts.append(points[row] + share[:, None] * vector[row])
    return np.concatenate(parts)


def _widest_spanning_tree(xy: Points, width: Floats, pairs: NDArray[np.int64]) -> tuple[list[int], NDArray[np.int64]]:
    """Return the points in the order in which the widest spanning tree reaches them, and the parent of each point.

    A parent is an index in this order.
    """
    near: list[list[int]] = [[] for _ in xy]
    for a, b in pairs.tolist():
        near[a].append(b)
        near[b].append(a)
    root = int(np.argmax(width))
    number: dict[int, int] = {}
    order: list[int] = []
    parent: list[int] = []
    heap = [(0.0, root, -1)]
    while heap:
        _, node, came = heapq.heappop(heap)
        if node in number:
            continue
        number[node] = len(order)
        order.append(node)
        parent.append(came)
        for neighbour in near[node]:
            if neighbour not in number:
                heapq.heappush(heap, (-float(width[neighbour]), neighbour, number[node]))
    return order, np.array(parent, dtype=np.int64)


def _extend_into_corners(axis: Axis, polygon: Any, reach: float) -> Axis:
    """Extend each branch that ends near a corner of the boundary into the corner."""
    leaf = np.ones(len(axis.xy), dtype=bool)
    leaf[axis.parent[1:]] = False
    leaf[0] = False
    ends = np.flatnonzero(leaf & (axis.width < reach))
    corners = np.concatenate([np.asarray(r.coords)[:-1, :2] for r in (polygon.exterior, *polygon.interiors)])
    places: Any = shapely.points(corners)
    tree = shapely.STRtree(places)
    pairs, _ = tree.query_nearest(shapely.points(axis.xy[ends]), all_matches=False, return_distance=True)
    to = corners[pairs[1]]
    near = np.hypot(*(to - axis.xy[ends[pairs[0]]]).T) < 2.0 * reach
    came, to = ends[pairs[0]][near], to[near]
    return Axis(
        np.concatenate([axis.xy, to]),
        np.concatenate([axis.width, np.zeros(len(to))]),
        np.concatenate([axis.parent, came]),
    )


def _prune_branches(axis: Axis, tolerance: float) -> Axis:
    """Remove the branches whose discs lie inside the disc at their fork, within the tolerance."""
    n = len(axis.xy)
    parent, places, width = axis.parent.tolist(), axis.xy.tolist(), axis.width.tolist()
    keep = np.ones(n, dtype=bool)
    degree = np.bincount(axis.parent[1:], minlength=n).tolist()
    ends = [i for i in range(1, n) if not degree[i]]
    while ends:
        again = []
        for end in ends:
            branch = [end]
            while parent[branch[-1]] > 0 and degree[parent[branch[-1]]] == 1:
                branch.append(parent[branch[-1]])
            fork = parent[branch[-1]]
            if fork < 0:
                continue
            beyond = max(math.dist(places[i], places[fork]) + width[i] for i in branch) - width[fork]
            if beyond <= tolerance:
                keep[branch] = False
                degree[fork] -= 1
                if not degree[fork] and fork > 0:
                    again.append(fork)
        ends = again
    number = np.cumsum(keep) - 1
    up = axis.parent[keep]
    return Axis(axis.xy[keep], axis.width[keep], np.where(up >= 0, number[up], -1))
