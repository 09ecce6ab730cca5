"""Clear a region with limited engagement, using arcs along the medial axis.

First, a helix and a spiral clear the largest disc that fits into the region of tool centres. From this disc, a series
of discs follows the medial axis into every branch and corner. Each of these discs touches the walls on both sides. The
tool cuts an arc along the front of a disc, then returns through the cleared area to the start of the next arc. The next
disc is as far away as the engagement limit allows. The engagement can be computed exactly, because the cleared area is
a union of discs (`ClearedDiscs`).

Sources: M. Held, C. Spielberger, "A smooth spiral tool path for high speed machining of 2D pockets", Computer-Aided
Design 41 (2009), for discs on the axis; G. Elber, E. Cohen, S. Drake, "MATHSM: medial axis transform toward high speed
machining of pockets", Computer-Aided Design 37 (2005), for clearing the discs by arcs.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Points, consecutive_segments
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion

#: Safety margin for the engagement limit, rad. The engagement is sampled, so it may peak between two samples.
MARGIN = math.radians(0.4)
#: Radius of the entry helix, in tool radii. It is less than 1, so that the helix leaves no core.
HELIX = 0.9
#: Maximum height of the cusps that arcs leave on a wall, in mm and relative to the maximum cut width. The wall pass
#: removes the cusps.
CUSP, CUSP_SHARE = 0.05, 0.25
#: Minimum thickness of a cut, relative to the maximum cut width. Thinner cuts are left for the next arc.
THIN = 0.03
#: Maximum thickness of a film in the tip of a corner, relative to the path tolerance. The wall pass removes such a
#: film.
FILM = 0.6
#: Number of bisections between a disc that is close enough and a disc that is too far away.
_HALVINGS = 5
#: Factor that shortens a step that turns out slightly too long.
_BACK = 0.8
#: Minimum step to a new disc, mm. If only shorter steps are possible, the path cannot meet the engagement limit.
_STUCK = 1e-5
#: Maximum distance from the end of a branch to the boundary at which the branch counts as leading into a corner, in
#: sample spacings.
_IN_CORNER = 4.0
#: Maximum number of boundary samples for the medial axis, which limits the memory use.
_MOST_SAMPLES = 200_000
#: Number of nearest discs that are used to compute an engagement. All other discs could only reduce the engagement.
_NEAREST = 96
#: Samples of the engagement along an arc: spacing, in tool radii, and maximum number.
_APART, _MOST = 0.1, 160
#: Denser sampling for a reliable result, because cusps of earlier arcs cause short peaks of the engagement.
_APART_SURE, _MOST_SURE = 0.025, 1000
_HALF = 0.5 * math.pi
#: Rounding tolerance for points on the edge of a disc, mm.
_SLACK = 1e-6


def adaptive(region: CentreRegion) -> PocketPath:
    """Return a path that clears a region within the engagement limit and then follows the walls.

    The engagement also never exceeds the engagement of a straight cut as wide as the step-over.

    Raises
    ------
    PlanError
        The rules have no engagement limit, or the region is too narrow for the limit.
    """
    limit = region.rules.max_engagement
    if limit is None:
        raise PlanError("the adaptive strategy needs an engagement limit; give --max-engagement")

    edge = region.polygon.boundary
    shapely.prepare(edge)
    path = _AdaptivePath(region.rules, min(limit, region.rules.engagement, math.pi - 0.1) - MARGIN, edge)
    axis = medial_axis(
        region.polygon, min(0.05 * region.rules.tool_diameter, path.width_at_limit), FILM * region.rules.tolerance
    )
    path.clear_widest_disc(axis)
    path.clear_along_axis(axis)
    path.cut_along_walls(region.boundary_rings)
    return PocketPath("adaptive", tuple(path.pieces))


@dataclass(frozen=True, eq=False)
class _ClearedPoint:
    """A point on the medial axis, float64[2], mm, whose disc has been cleared.

    `disc` is the index of a cleared disc that contains the point.
    """

    disc: int
    at: Floats


@dataclass
class _AdaptivePath:
    rules: PocketRules
    limit: float
    #: Boundary of the region, as a prepared shapely geometry.
    edge: Any
    pieces: list[PocketPiece] = field(default_factory=list)
    #: Predecessor of each disc.
    parents: list[int] = field(default_factory=list)
    #: Position of the tool, and the disc that contains it.
    at: tuple[float, float] = (0.0, 0.0)
    disc: int = 0

    def __post_init__(self) -> None:
        self.turn = 1 if self.rules.climb else -1
        self.fine = 0.3 * self.rules.tolerance
        self.cleared = ClearedDiscs(self.rules.radius, self.turn, self.fine, THIN * self.width_at_limit)

    @property
    def width_at_limit(self) -> float:
        """Width of a straight cut that just reaches the engagement limit, mm."""
        return self.rules.radius * (1.0 - math.cos(self.limit))

    def clear_widest_disc(self, axis: Axis) -> None:
        (x, y), radius = axis.xy[0].tolist(), float(axis.width[0])
        helix = min(HELIX * self.rules.radius, radius)
        if helix < 10.0 * self.rules.tolerance:
            raise PlanError(
                "the widest part of a pocket is as narrow as the tool: its engagement cannot be limited; choose a "
                "smaller --tool-diameter or another --strategy"
            )
        circle = Polyline.circle(x, y, helix, clockwise=self.turn < 0)
        opened = Polyline(np.concatenate([circle.vertices, circle.vertices[:1] * (1, 1, 0)]))
        self.pieces.append(PocketPiece(opened, "entry"))
        if radius > helix:
            self.pieces.append(PocketPiece(as_polyline(self._spiral(helix, radius) + np.array([x, y])), "rough"))
        self.cleared.add(x, y, radius)
        self.parents.append(0)
        self.at = self.pieces[-1].path.end

    def _spiral(self, first: float, last: float) -> Points:
        """Return a spiral around (0, 0) that ends with a full circle, float64[n, 2]. The radii are in mm.

        A tool with radius r widens a hole from r + ρ − w to r + ρ. Its engagement is φ, where

            (r + ρ − w)² = ρ² + r² + 2ρr cos φ.

        At the engagement limit, the width w increases with ρ. A spiral that grows by w(ρ) per turn therefore never cuts
        more than w(ρ).
        """
        radii, angles, full = [first], [0.0], math.inf
        while angles[-1] < full:
            rho = radii[-1]
            step = min(2.0 * math.sqrt(0.5 * self.rules.tolerance / rho), 0.2)
            # The spiral is inclined outwards by an angle whose tangent is dρ/(ρ dθ); this angle adds to the engagement.
            rate = self._uncut_width(rho, self.limit) / math.tau
            rate = self._uncut_width(rho, max(self.limit - math.atan2(rate, rho), 0.5 * self.limit)) / math.tau
            if rho >= last and math.isinf(full):
                full = angles[-1] + math.tau
            angles.append(min(angles[-1] + step, full))
            radii.append(min(rho + rate * (angles[-1] - angles[-2]), last))
        angle = self.turn * np.array(angles)
        spiral: Points = np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return spiral

    def _uncut_width(self, rho: float, angle: float) -> float:
        tool = self.rules.radius
        return tool + rho - math.sqrt(rho * rho + tool * tool + 2.0 * rho * tool * math.cos(angle))

    def clear_along_axis(self, axis: Axis) -> None:
        children = axis.children()
        spots = {0: _ClearedPoint(0, axis.xy[0])}
        stack = [(child, 0) for child in reversed(children[0])]
        while stack:
            node, up = stack.pop()
            to_end = len(children[node]) != 1
            spots[node] = self._clear_along_edge(axis.xy[up], axis.xy[node], spots[up], to_end)
            stack += [(child, node) for child in reversed(children[node])]

    def _clear_along_edge(self, start: Floats, end: Floats, spot: _ClearedPoint, to_end: bool) -> _ClearedPoint:
        """Clear the axis between two neighbouring points with as few discs as possible.

        Return the last point that was cleared.
        """
        good = 0.0
        while not self._can_clear(end, spot, to_end):
            low, high = good, 1.0
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if self._can_clear(start + middle * (end - start), spot) else (low, middle)
            for _ in range(_HALVINGS):  # finer sampling may reveal a higher peak
                if self._can_clear(start + low * (end - start), spot, True):
                    at, on = start + low * (end - start), low
                    break
                low = good + _BACK * (low - good)
            else:
                at, on = self._closer_point(start + low * (end - start), spot), good
            cleared = self._clear_disc(at, spot)
            if cleared.disc == spot.disc and float(np.hypot(*(at - spot.at))) < _STUCK:
                x, y = end.tolist()
                if self.cleared.contains_disc(x, y, self._distance_to_edge(end), FILM * self.rules.tolerance):
                    return cleared  # the wall pass removes the film in the tip of a corner
                raise PlanError(
                    "the engagement limit cannot be kept near ({:.2f}, {:.2f}), where the tool has hardly any "
                    "room to turn; choose a larger --max-engagement or a smaller --tool-diameter",
                    x,
                    y,
                )
            spot, good = cleared, on
        return self._clear_disc(end, spot) if to_end else spot

    def _closer_point(self, at: Floats, spot: _ClearedPoint) -> Floats:
        """Move `at` towards the last cleared point until the disc around it can be cleared next.

        Return the new position. The connecting line always stays in the region. Any point outside the region would be
        closer to the boundary than to the last disc.
        """
        part = 1.0
        while part * float(np.hypot(*(at - spot.at))) > 0.5 * _STUCK:
            part *= 0.5
            if self._can_clear(spot.at + part * (at - spot.at), spot, True):
                break
        return spot.at + part * (at - spot.at)

    def _distance_to_edge(self, at: Floats) -> float:
        return float(shapely.distance(self.edge, shapely.Point(at)))

    def _can_clear(self, at: Floats, spot: _ClearedPoint, sure: bool = False) -> bool:
        """Return whether the disc around a point can be cleared next.

        This must neither exceed the engagement limit nor leave a large cusp. With `sure`, the engagement is sampled
        more densely.
        """
        (x, y), radius = at.tolist(), self._distance_to_edge(at)
        if not self._uncut_arcs(x, y, radius):
            return True
        cx, cy, before = self.cleared.discs[spot.disc].tolist()
        cusp = min(CUSP, CUSP_SHARE * self.width_at_limit)
        if math.hypot(x - cx, y - cy) > before + 0.8 * radius:
            return False
        if float(np.hypot(*(at - spot.at))) > math.sqrt(8.0 * cusp * (self.rules.radius + radius)):
            return False
        return self.cleared.engagement(x, y, radius, sure) <= self._engagement_limit(radius)

    def _uncut_arcs(self, x: float, y: float, radius: float) -> list[tuple[float, float]]:
        """Return the start angle and sweep, rad, of each uncut arc of a disc. Thin films in corners are ignored."""
        if radius < self.fine and self.cleared.contains_disc(x, y, radius, 0.5 * self.rules.tolerance):
            return []
        return self.cleared.uncut_arcs(x, y, radius)

    def _engagement_limit(self, radius: float) -> float:
        """Return the engagement limit on a circle, rad.

        Small circles have a lower limit, because films matter more there. A film of thickness h in a hole of radius r +
        ρ has the same effect as a film of thickness h (1 + r/ρ) at a straight edge.
        """
        tool = self.rules.radius
        film = self.fine * (1.0 + tool / max(radius, self.fine))
        return self.limit - min(film / (tool * math.sin(self.limit)), 0.5 * self.limit)

    def _clear_disc(self, at: Floats, spot: _ClearedPoint) -> _ClearedPoint:
        (x, y), radius = at.tolist(), self._distance_to_edge(at)
        arcs = self._uncut_arcs(x, y, radius)
        if not arcs:
            return _ClearedPoint(self.cleared.nearest(x, y), at)
        for start, sweep in arcs:
            arc = _arc(x, y, radius, start, self.turn * sweep)
            self._link_to(arc.start, self._disc_containing(arc.start, spot.disc))
            self.pieces.append(PocketPiece(arc))
            self.at, self.disc = arc.end, self._disc_containing(arc.end, spot.disc)
        self.disc = self.cleared.add(x, y, radius)
        self.parents.append(spot.disc)
        return _ClearedPoint(self.disc, at)

    def _disc_containing(self, place: tuple[float, float], first: int) -> int:
        """Return the index of a cleared disc that contains a position. The disc `first` takes precedence."""
        x, y, radius = self.cleared.discs[first].tolist()
        return first if math.dist(place, (x, y)) <= radius + 1e-7 else self.cleared.nearest(*place)

    def _link_to(self, to: tuple[float, float], disc: int) -> None:
        """Move through the cleared area to the position `to`, which must lie inside the given disc."""
        discs = self._discs_between(self.disc, disc)
        places = [self.at, *(self._overlap_centre(a, b) for a, b in pairwise(discs)), to]
        corners, i = [places[0]], 0
        while i < len(places) - 1:
            # The line from position k to position k + 1 is inside disc k of `discs`.
            j = len(places) - 1
            while j > i + 1 and not self.cleared.contains_move(places[i], places[j], discs[i:j]):
                j = i + 1 + (j - i - 1) // 2
            corners.append(places[j])
            i = j
        if math.dist(self.at, to) > SAME_PLACE or len(corners) > 2:
            self.pieces.append(PocketPiece(Polyline.of_points(corners), "link"))
        self.at, self.disc = to, disc

    def _discs_between(self, a: int, b: int) -> list[int]:
        up, down = [a], [b]
        while up[-1] != down[-1]:
            longer = up if up[-1] > down[-1] else down  # a disc has a higher index than its predecessor
            longer.append(self.parents[longer[-1]])
        return up + down[-2::-1]

    def _overlap_centre(self, a: int, b: int) -> tuple[float, float]:
        (ax, ay, ar), (bx, by, br) = self.cleared.discs[[a, b]].tolist()
        far = math.dist((ax, ay), (bx, by))
        middle = 0.5 * (max(-ar, far - br) + min(ar, far + br)) / far if far else 0.0
        return (ax + middle * (bx - ax), ay + middle * (by - ay))

    def cut_along_walls(self, rings: list[Points]) -> None:
        walls = [self._started_at_least_material(ring if self.turn > 0 else ring[::-1]) for ring in rings]
        while walls:
            wall = walls.pop(min(range(len(walls)), key=lambda i: math.dist(walls[i][0], self.at)))
            first = (float(wall[0, 0]), float(wall[0, 1]))
            self._link_to(first, self.cleared.nearest(*first))
            self.pieces.append(PocketPiece(as_polyline(wall), "finish"))

    def _started_at_least_material(self, ring: Points) -> Points:
        """Rotate a closed ring so that it starts where the least material remains, away from its corners."""
        edges = np.roll(ring, -1, axis=0) - ring
        count = np.maximum(np.hypot(edges[:, 0], edges[:, 1]) / (0.2 * self.rules.radius), 1.0).astype(np.int64)
        row = np.repeat(np.arange(len(ring)), count)
        share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[row]
        places = ring[row] + share[:, None] * edges[row]
        best = int(np.argmin(self.cleared.distances_to_union(places)))
        start = places[best : best + 1]
        return np.concatenate([start, np.roll(ring, -int(row[best]) - 1, axis=0), start])


def _arc(x: float, y: float, radius: float, start: float, sweep: float) -> Polyline:
    parts = max(math.ceil(abs(sweep) / math.pi - 1e-9), 1)
    angles = start + sweep * np.linspace(0.0, 1.0, parts + 1)
    bulges = np.append(np.full(parts, math.tan(0.25 * sweep / parts)), 0.0)
    return Polyline(np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles), bulges]))


# -- medial axis -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Axis:
    """The medial axis as a tree of points.

    Attributes
    ----------
    xy
        Points, float64[n, 2], mm. The first point is the root, which is the widest point. Parents precede their
        children.
    width
        Distance from each point to the boundary of the region, float64[n], mm.
    parent
        Index of the parent of each point, or -1 for the root, int64[n].
    """

    xy: Points
    width: Floats
    parent: NDArray[np.int64]

    def children(self) -> list[list[int]]:
        """Return the children of each point. The child with the shortest branch comes first."""
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
    """Compute the medial axis of a polygon from the Voronoi diagram of boundary points that are `spacing` mm apart.

    A cycle around an island is cut at its narrowest point. Branches that lead into a corner are extended to the corner.
    A branch is removed if its discs stay inside the disc at its fork, within the tolerance. Such a branch only leads to
    a vertex between two chords.

    Source: J. W. Brandt, "Convergence and continuity criteria for discrete approximations of the continuous planar
    skeleton", CVGIP: Image Understanding 59 (1994): the inner edges of the diagram converge to the axis.
    """
    points = _boundary_points(polygon, spacing)
    lines = shapely.voronoi_polygons(shapely.MultiPoint(points), only_edges=True)
    ends = np.concatenate([consecutive_segments(np.asarray(g.coords)) for g in getattr(lines, "geoms", [lines])])
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
    spacing = max(spacing, polygon.length / _MOST_SAMPLES)
    for ring in (polygon.exterior, *polygon.interiors):
        points = np.asarray(ring.coords)[:, :2]
        vector = np.diff(points, axis=0)
        count = np.maximum(np.ceil(np.hypot(vector[:, 0], vector[:, 1]) / spacing).astype(np.int64), 1)
        row = np.repeat(np.arange(len(vector)), count)
        share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)) / count[row]
        parts.append(points[row] + share[:, None] * vector[row])
    return np.concatenate(parts)


def _widest_spanning_tree(xy: Points, width: Floats, pairs: NDArray[np.int64]) -> tuple[list[int], NDArray[np.int64]]:
    """Build the spanning tree that always grows at the widest reachable point.

    Returns
    -------
    order
        The points in the order in which the tree reaches them.
    parent
        Position of each point's parent in this order.
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


# -- cleared area ----------------------------------------------------------------------------------------------------


class ClearedDiscs:
    """The discs that have been cleared so far, in order.

    Attributes
    ----------
    turn
        1 for counter-clockwise arcs, and -1 for clockwise arcs.
    fine
        Maximum thickness of a film that is not worth cutting, mm.
    thin
        Chips are not worth cutting if they are no thicker than in a straight cut of this width, mm.
    """

    def __init__(self, tool_radius: float, turn: int, fine: float, thin: float) -> None:
        self.tool = tool_radius
        self.turn = turn
        self.fine, self.thin = fine, thin
        self.count = 0
        self._discs = np.zeros((64, 3))

    @property
    def discs(self) -> Floats:
        """Centres and radii of all discs, float64[n, 3], mm."""
        return self._discs[: self.count]

    def add(self, x: float, y: float, radius: float) -> int:
        """Add a disc and return its index."""
        if self.count == len(self._discs):
            self._discs = np.concatenate([self._discs, np.zeros_like(self._discs)])
        self._discs[self.count] = x, y, radius
        self.count += 1
        return self.count - 1

    def uncut_arcs(self, x: float, y: float, radius: float) -> list[tuple[float, float]]:
        """Return the start angle and sweep, rad, of each arc of a circle that lies outside all discs.

        The arcs run in the direction of `turn`. An arc is skipped if it is within `fine` mm of the discs, or if its
        chips are thinner than in a straight cut with a width of `thin` mm.
        """
        return self._arcs(x, y, radius, self.discs)

    def contains_disc(self, x: float, y: float, radius: float, but: float) -> bool:
        """Return whether a single cleared disc contains the given disc, apart from a film of `but` mm."""
        discs = self.discs
        return bool((np.hypot(discs[:, 0] - x, discs[:, 1] - y) + radius <= discs[:, 2] + but).any())

    def _arcs(self, x: float, y: float, radius: float, discs: Floats) -> list[tuple[float, float]]:
        dx, dy = discs[:, 0] - x, discs[:, 1] - y
        distance = np.hypot(dx, dy)
        reach, film = discs[:, 2], min(self.fine, self.thin * radius / (self.tool + radius))
        if len(discs) and (distance + radius <= reach + film).any():
            return []
        touching = (distance < radius + reach) & (distance > np.abs(radius - reach))
        if not touching.any():
            return [(0.0, math.tau)]
        d, r = distance[touching], reach[touching]
        half = np.arccos(np.clip((d * d + radius * radius - r * r) / (2.0 * d * radius), -1.0, 1.0))
        middle = self.turn * np.arctan2(dy[touching], dx[touching])
        start = (middle - half) % math.tau
        order = np.argsort(start)
        start, end = start[order], (start + 2.0 * half)[order]
        gaps, reached = [], float(end.max()) - math.tau
        for a, b in zip(start.tolist(), end.tolist(), strict=True):
            if a > reached:
                gaps.append((reached, a))
            reached = max(reached, b)
        arcs = [(self.turn * a, b - a) for a, b in gaps]
        return [arc for arc in arcs if self._arc_depth(x, y, radius, arc, discs) > film]

    def _arc_depth(self, x: float, y: float, radius: float, arc: tuple[float, float], discs: Floats) -> float:
        angle = arc[0] + self.turn * arc[1] * np.linspace(0.0, 1.0, 9)[1:-1]
        px, py = x + radius * np.cos(angle), y + radius * np.sin(angle)
        gaps = np.hypot(px[:, None] - discs[:, 0], py[:, None] - discs[:, 1]) - discs[:, 2]
        return float(gaps.min(axis=1).max())

    def engagement(self, x: float, y: float, radius: float, sure: bool = False) -> float:
        """Return the maximum engagement along the uncut arcs of a circle, rad, or 0 in air.

        With `sure`, the engagement is sampled at more points.
        """
        discs = self.discs
        gap = np.hypot(discs[:, 0] - x, discs[:, 1] - y) - discs[:, 2]
        if len(discs) > _NEAREST:
            discs = discs[np.argpartition(gap, _NEAREST)[:_NEAREST]]
        arcs = self._arcs(x, y, radius, discs)
        if not arcs:
            return 0.0
        apart, most = (_APART_SURE, _MOST_SURE) if sure else (_APART, _MOST)
        step = apart * min(self.tool, radius + 0.01)
        angles = []
        for start, sweep in arcs:
            samples = min(max(math.ceil(sweep * radius / step), 8), most)
            angles.append(start + self.turn * sweep * np.linspace(0.0, 1.0, samples + 1))
        angle = np.concatenate(angles)
        return float(self._engagement_at(x, y, radius, angle, discs).max())

    def _engagement_at(self, x: float, y: float, radius: float, angle: Floats, discs: Floats) -> Floats:
        """Return the engagement at several points of a circle, float64[k], rad.

        The engagement is the angle over which the front half of the tool touches uncut material.
        """
        px, py = x + radius * np.cos(angle), y + radius * np.sin(angle)
        dx, dy = discs[:, 0] - px[:, None], discs[:, 1] - py[:, None]
        distance = np.hypot(dx, dy)
        tool, cleared = self.tool, discs[:, 2] + self.tool
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = (tool * tool + distance * distance - cleared * cleared) / (2.0 * tool * distance)
        half = np.arccos(np.clip(np.where(distance > 0.0, cosine, -1.0), -1.0, 1.0))
        ahead = angle + self.turn * _HALF
        # Angles are relative to the direction of travel; intervals that cross ±π are copied.
        middle = (np.arctan2(dy, dx) - ahead[:, None] + math.pi) % math.tau - math.pi
        low = np.concatenate([middle - half, middle - half + math.tau, middle - half - math.tau], axis=1)
        high = np.concatenate([middle + half, middle + half + math.tau, middle + half - math.tau], axis=1)
        low, high = np.clip(low, -_HALF, _HALF), np.clip(high, -_HALF, _HALF)
        order = np.argsort(low, axis=1)
        low, high = np.take_along_axis(low, order, axis=1), np.take_along_axis(high, order, axis=1)
        reach = np.maximum.accumulate(high, axis=1)
        before = np.concatenate([np.full((len(angle), 1), -_HALF), reach[:, :-1]], axis=1)
        covered: Floats = np.maximum(high - np.maximum(low, before), 0.0).sum(axis=1)
        return math.pi - np.minimum(covered, math.pi)

    def nearest(self, x: float, y: float) -> int:
        """Return the index of the disc that contains a point most deeply.

        Outside all discs, return the nearest disc.
        """
        discs = self.discs
        return int(np.argmin(np.hypot(discs[:, 0] - x, discs[:, 1] - y) - discs[:, 2]))

    def distances_to_union(self, places: Floats) -> Floats:
        """Return the distance of each point from the union of all discs, float64[k], mm.

        Points inside have a negative distance.
        """
        discs, gaps = self.discs, np.full(len(places), np.inf)
        for first in range(0, len(discs), 256):
            some = discs[first : first + 256]
            away = np.hypot(places[:, :1] - some[:, 0], places[:, 1:2] - some[:, 1]) - some[:, 2]
            gaps = np.minimum(gaps, away.min(axis=1))
        return gaps

    def contains_move(self, a: tuple[float, float], b: tuple[float, float], which: list[int]) -> bool:
        """Return whether a straight move from `a` to `b` stays inside the union of some discs.

        `which` contains the indices of these discs.
        """
        discs = self._discs[which]
        move = np.array(b) - a
        length = float(np.hypot(*move))
        if length == 0.0:
            return True
        from_a = discs[:, :2] - a
        along = from_a @ move / length
        off = (from_a[:, 0] * move[1] - from_a[:, 1] * move[0]) / length
        rest = (discs[:, 2] + _SLACK) ** 2 - off * off
        half = np.sqrt(np.maximum(rest, 0.0))
        there = rest > 0.0
        low, high = (along - half)[there], (along + half)[there]
        order = np.argsort(low)
        reach = 0.0
        for start, end in zip(low[order].tolist(), high[order].tolist(), strict=True):
            if start > reach:
                break
            reach = max(reach, end)
        return reach >= length - _SLACK
