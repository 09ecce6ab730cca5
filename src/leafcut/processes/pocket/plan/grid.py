"""Clear a region along a square grid of points: create the grid and the routing problem, and convert orders to paths.

Source: the published pocketing method with a discrete firefly algorithm uses such a grid with a point spacing DP
between 0.5 D and 0.7 D, where D is the tool diameter. It has separate paths for roughing and finishing, and its points
are pixels of a picture. Differs: here, the points lie in the exact region, and the finishing pass follows the walls
instead of points.

This method leaves no material uncut. Every position is within DP/√2 of a point of the unbounded grid. If this point is
in the region, the tool visits it. Otherwise, the boundary lies between the position and the point, and the finishing
pass follows the boundary. If roughing leaves stock, this pass stays away from the walls by the thickness of the stock,
and another pass finishes the walls (`walls`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Indices, Points
from leafcut.geometry.obstacles import shortest_path
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketPiece, PocketRules
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.stationed_path import Ring

#: Usual and minimum spacing of points, in tool diameters. Points at a smaller spacing would clear the same area twice.
#: The centre between four points is 0.71 spacings away from each of them, so it is cleared if the spacing is less than
#: 0.7 diameters.
USUAL, NEAREST = 0.6, 0.5
#: Maximum number of points. The costs of all pairs take 8 bytes each, so more points would need too much memory.
MOST_POINTS = 3000
#: Number of offsets of the grid to try along each axis, and angles to try, rad.
OFFSETS, ANGLES = 8, (0.0, math.pi / 12.0, math.pi / 6.0)
#: Rounding tolerance for moves along the boundary, mm.
ROUNDING = 1e-6
#: Maximum length of a straight move between two nodes, in grid spacings.
REACH = 3.0
#: Distance between nodes on the boundary, in grid spacings.
NODE_SPACING = 0.5
#: Number of segments tested at once, which limits the memory use.
SEGMENTS_AT_ONCE = 50_000


@dataclass(frozen=True)
class Retract:
    """The cost of a retract, expressed as a feed length, mm.

    `fixed` is the cost of raising and lowering the tool. `per_mm` is the cost per millimetre of rapid.
    """

    fixed: float = 60.0
    per_mm: float = 0.25

    def cost(self, distance: float) -> float:
        """Return the feed length that takes as long as a retract with a rapid of `distance` mm."""
        return self.fixed + self.per_mm * distance


@dataclass(frozen=True, eq=False)
class Grid:
    """The points of a square grid that lie in a region.

    Attributes
    ----------
    points
        float64[n, 2], mm.
    pitch
        Distance between neighbours along a row, mm.
    longer
        Lower bound on the number of steps longer than the pitch in any path over all points. Colour the grid like a
        chessboard: each step of one pitch changes the colour, so unequal numbers of both colours require longer steps.
        A point with fewer than two neighbours is either an end of the path or an end of a longer step.
    """

    points: Points
    pitch: float
    longer: int

    @property
    def path_length_bound(self) -> float:
        """Lower bound on the length of an open path over all points, mm.

        Any step longer than the pitch is at least as long as the diagonal.
        """
        return self.pitch * (max(len(self.points) - 1, 0) + (math.sqrt(2.0) - 1.0) * self.longer)


@dataclass(frozen=True, eq=False)
class GridContext:
    """The data that `grid_path` needs to convert an order to a path."""

    region: CentreRegion
    grid: Grid
    paths: RegionPaths
    retract: Retract


def grid_pitch(rules: PocketRules) -> float:
    """Return the spacing of the grid points, mm.

    Raises
    ------
    PlanError
        The step-over requires a spacing of at most 0.5 tool diameters.
    """
    pitch = min(rules.step_over, USUAL * rules.tool_diameter)
    if pitch <= NEAREST * rules.tool_diameter:
        raise PlanError(
            "the grid of the strategy needs points more than {:g} diameters apart, which exceeds the step-over "
            "of {:.4g} mm; use another strategy",
            NEAREST,
            rules.step_over,
        )
    return pitch


def grid_points(
    region: CentreRegion, offset: tuple[float, float] = (0.0, 0.0), angle: float = 0.0, grown: Any = None
) -> Grid:
    """Create a grid that starts at the corner of the region's bounding box.

    Points that are slightly outside the region, within the tolerance, are moved onto its boundary.

    Parameters
    ----------
    offset, angle
        Shift of the grid, mm, and rotation, rad.
    grown
        The region enlarged by the tolerance, if it is already known.

    Raises
    ------
    PlanError
        The step-over is too small for a grid, or the grid has more than `MOST_POINTS` points.
    """
    pitch, rules = grid_pitch(region.rules), region.rules
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    corners = np.asarray(region.polygon.exterior.coords)[:, :2] @ turn.T
    low, high = corners.min(axis=0), corners.max(axis=0) + rules.tolerance
    if region.polygon.area > 2.0 * MOST_POINTS * pitch**2:
        _refuse_large_grid(region.polygon.area / pitch**2, rules)
    x, y = (np.arange(low[k] + offset[k], high[k], pitch) for k in range(2))
    columns, rows = (a.ravel() for a in np.meshgrid(np.arange(len(x)), np.arange(len(y))))
    places = np.stack([x[columns], y[rows]], axis=1) @ turn
    grown = region.polygon.buffer(rules.tolerance) if grown is None else grown
    inside = shapely.contains_xy(grown, places[:, 0], places[:, 1])
    places, colour = places[inside], (columns + rows)[inside] % 2
    if len(places) > MOST_POINTS:
        _refuse_large_grid(len(places), rules)
    outside = ~shapely.intersects_xy(region.polygon, places[:, 0], places[:, 1])
    if outside.any():
        near = shapely.shortest_line(region.polygon, shapely.points(places[outside]))
        places[outside] = shapely.get_coordinates(near).reshape(-1, 2, 2)[:, 0]
    return Grid(
        places, pitch, max(abs(len(places) - 2 * int(colour.sum())) - 1, _count_spurs(columns[inside], rows[inside]))
    )


def _count_spurs(columns: NDArray[np.int64], rows: NDArray[np.int64]) -> int:
    if len(columns) < 2:
        return 0
    # A frame of empty cells makes checks at the border unnecessary.
    cells = np.zeros((columns.max() + 3, rows.max() + 3), dtype=bool)
    cells[columns + 1, rows + 1] = True
    middle = slice(1, -1)
    beside = np.add(cells[:-2, middle], cells[2:, middle], dtype=np.int64)
    beside += cells[middle, :-2]
    beside += cells[middle, 2:]
    missing = int(np.maximum(2 - beside, 0)[cells[middle, middle]].sum())
    return max(0, math.ceil((missing - 2) / 2))


def _refuse_large_grid(count: float, rules: PocketRules) -> None:
    raise PlanError(
        "the grid for a tool of {:g} mm has about {:.0f} points here, but the limit is {}; use another "
        "--strategy or a larger tool",
        rules.tool_diameter,
        count,
        MOST_POINTS,
    )


def best_grid(region: CentreRegion) -> Grid:
    """Try several offsets and angles, and return the grid with the smallest lower bound on its path length.

    A region that is too small for any grid gets a single point.
    """
    pitch = grid_pitch(region.rules)
    steps = np.arange(OFFSETS) * pitch / OFFSETS
    grown = region.polygon.buffer(region.rules.tolerance)
    shapely.prepare([grown, region.polygon])
    grids = [grid_points(region, (x, y), angle, grown) for angle, x, y in itertools.product(ANGLES, steps, steps)]
    grids = [grid for grid in grids if len(grid.points)]
    if not grids:
        middle = region.polygon.representative_point()
        return Grid(np.array([[middle.x, middle.y]]), pitch, 0)
    return min(grids, key=lambda g: g.path_length_bound)


def grid_problem(
    region: CentreRegion,
    retract: Retract | None = None,
    *,
    grid: Grid | None = None,
) -> tuple[RoutingProblem, GridContext]:
    """Create the routing problem of visiting all points of a grid, and the context for `grid_path`.

    The cost between two points is the length of the shortest path inside the region, mm, or the cost of a retract if
    this is lower. Raises the same errors as `grid_points`.
    """
    grid, retract = grid or best_grid(region), retract or Retract()
    paths = RegionPaths(region.polygon, region.boundary_rings, grid.points, grid.pitch)
    x, y = grid.points.T
    lifted = retract.fixed + retract.per_mm * np.hypot(x[:, None] - x, y[:, None] - y)
    matrix = np.minimum(paths.shortest_lengths(), lifted)
    np.fill_diagonal(matrix, 0.0)
    problem = RoutingProblem.of_points(grid.points, Metric("EXPLICIT", matrix=matrix))
    return problem, GridContext(region, grid, paths, retract)


def grid_path(context: GridContext, order: NDArray[np.int32], strategy: str = "firefly") -> PocketPath:
    """Return a path that visits the points in the given order, int32[n], and then follows every wall.

    The path follows walls in milling direction. The order is reversed if this makes the links to the walls cheaper. The
    tool retracts wherever a retract is cheaper than a link.
    """
    nodes = [int(k) for k in order]
    rough = _path_over_points(context, nodes)
    turned = [PocketPiece(piece.path.reversed(), piece.kind) for piece in reversed(rough)]
    there, back = (_path_along_walls(context, end) for end in (nodes[-1], nodes[0]))
    pieces = [*rough, *there[1]] if there[0] <= back[0] else [*turned, *back[1]]
    return PocketPath(strategy, tuple(pieces))


def _path_over_points(context: GridContext, nodes: list[int]) -> list[PocketPiece]:
    """Return the sections of the path that visits the points in the order of `nodes`.

    The tool moves in a straight line if possible, and retracts if a retract is cheaper. It never retracts both before
    and after the same point, because it only cuts while it moves.
    """
    places, paths, retract = context.paths.places, context.paths, context.retract
    pieces: list[PocketPiece] = []
    run, linked = [places[nodes[0]]], False
    straight = paths.straight_move_mask(places[nodes[:-1]], places[nodes[1:]])
    for k, (a, b) in enumerate(itertools.pairwise(nodes)):
        link = (b, places[[a, b]]) if straight[k] else paths.path_to_nearest(a, [b])
        needed = (len(run) == 1 and not linked) or k == len(nodes) - 2
        dear = link is not None and path_length(link[1]) > retract.cost(math.dist(places[a], places[b]))
        by_feed = link is not None and (needed or not dear)
        if by_feed and straight[k]:
            run.append(places[b])
            continue
        if len(run) > 1 or not linked:
            pieces.append(PocketPiece(as_polyline(run if len(run) > 1 else run * 2)))
        if by_feed and link is not None:
            pieces.append(PocketPiece(as_polyline(link[1]), "link"))
        run, linked = [places[b]], by_feed
    if len(run) > 1 or not linked:
        pieces.append(PocketPiece(as_polyline(run if len(run) > 1 else run * 2)))
    return pieces


def _path_along_walls(context: GridContext, at: int) -> tuple[float, list[PocketPiece]]:
    """Visit all walls, starting at a node. The next wall is always the nearest wall.

    Return the total cost of the links, mm, and the path sections.
    """
    paths, retract = context.paths, context.retract
    left, rules = set(range(len(paths.rings))), context.region.rules
    spent, pieces = 0.0, []
    last = paths.places[at]
    while left:
        owner = {int(node): k for k in left for node in paths.rings[k]}
        nodes = np.array(list(owner))
        apart = np.hypot(*(paths.places[nodes] - last).T)
        node, lifted = int(nodes[apart.argmin()]), retract.cost(float(apart.min()))
        nearest = paths.path_to_nearest(at, owner)
        if nearest is not None and path_length(nearest[1]) <= lifted:
            node = nearest[0]
        loop = _wall_loop(context.region.boundary_rings, paths.places[node], rules.climb)
        if nearest is not None and node == nearest[0]:
            link = np.concatenate([last[None], nearest[1], loop[:1]])
            spent += path_length(link)
            if path_length(link) > SAME_PLACE:
                pieces.append(PocketPiece(as_polyline(_without_repeats(link)), "link"))
        else:
            spent += lifted
        pieces.append(PocketPiece(as_polyline(loop), "rough" if rules.stock else "finish"))
        left.remove(owner[node])
        at, last = node, loop[-1]
    return spent, pieces


def _wall_loop(walls: list[Points], place: Points, climb: bool) -> Points:
    """Return the wall nearest to a position as a closed loop, float64[k, 2]. The loop starts near this position.

    For climb milling, outer walls run counter-clockwise.
    """
    rings = [Ring.from_open_points(wall, 0) for wall in walls]
    ring = min(rings, key=lambda ring: ring.line.distance(shapely.Point(place)))
    start = ring.nearest_station(place)
    loop = _without_repeats(ring.points_between(start, start + ring.length))
    return loop if climb else loop[::-1]


def _without_repeats(path: Points) -> Points:
    new = np.hypot(*np.diff(path, axis=0).T) > 1e-9
    kept: Points = path[np.concatenate([[True], new])]
    kept[-1] = path[-1]
    return kept


# -- paths in the region ---------------------------------------------------------------------------------------------


class RegionPaths:
    """The allowed moves between points in a region of tool centres, and the shortest paths that use these moves.

    Straight moves connect nodes that are close together. Other moves follow the boundary from one node to the next.

    Attributes
    ----------
    places
        The points to visit, followed by the nodes on the boundary, float64[n + m, 2], mm.
    rings
        The nodes of each boundary ring, in order, as indices of `places`.
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
                links.append((here, there, path_length(run)))
            self.rings.append(nodes)
            stops.append(ring[at])
            count += len(at)
        self.places = np.concatenate([points.reshape(-1, 2), *stops])
        self._store_edges(links, REACH * pitch)

    def _store_edges(self, links: Iterable[tuple[int, int, float]], reach: float) -> None:
        """Store the neighbours of each node, and the length of the move to each neighbour, mm."""
        places: Any = shapely.points(self.places)
        here, there = shapely.STRtree(places).query(places, predicate="dwithin", distance=reach)
        pairs = np.stack([here, there], axis=1)[here < there]
        pairs = pairs[self.straight_move_mask(self.places[pairs[:, 0]], self.places[pairs[:, 1]])]
        cost = np.hypot(*(self.places[pairs[:, 0]] - self.places[pairs[:, 1]]).T)
        around = np.array([(a, b, c) for a, b, c in links if a != b]).reshape(-1, 3)
        a = np.concatenate([pairs[:, 0], around[:, 0].astype(np.int64)])
        b = np.concatenate([pairs[:, 1], around[:, 1].astype(np.int64)])
        costs = np.concatenate([cost, around[:, 2]])
        source, target, costs = np.concatenate([a, b]), np.concatenate([b, a]), np.concatenate([costs, costs])
        order = np.lexsort((costs, target, source))
        self._begin = np.searchsorted(source[order], np.arange(len(self.places) + 1))
        self._target, self._cost = target[order], costs[order]

    def straight_move_mask(self, start: Points, end: Points) -> NDArray[np.bool_]:
        """Return a mask of the straight moves from `start` to `end`, float64[k, 2] each, that stay in the region."""
        inside = np.zeros(len(start), dtype=np.bool_)
        for k in range(0, len(start), SEGMENTS_AT_ONCE):
            part = slice(k, k + SEGMENTS_AT_ONCE)
            inside[part] = shapely.covers(self.allowed, shapely.linestrings(np.stack([start[part], end[part]], axis=1)))
        return inside

    def shortest_lengths(self) -> NDArray[np.float64]:
        """Return the length of the shortest path between each pair of points, float64[n, n], mm.

        The length is infinite if no path exists. The function updates the matrix row by row, in sweeps across the
        plane, until it converges.
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

        Return the last node and the corners of the path, or None if no path exists.
        """
        nodes = shortest_path(len(self.places), self._edges, start, ends)
        return None if nodes is None else (nodes[-1], self._straightened(self._path_corners(nodes)))

    def _edges(self, node: int) -> tuple[Indices, Floats]:
        near = slice(self._begin[node], self._begin[node + 1])
        return self._target[near], self._cost[near]

    def _path_corners(self, nodes: list[int]) -> Points:
        runs = [self.places[nodes[:1]]]
        for a, b in itertools.pairwise(nodes):
            run = self._along.get((a, b))
            straight = math.dist(self.places[a], self.places[b])
            if run is None or (path_length(run) > straight + ROUNDING and self._is_straight(a, b)):
                run = self.places[[a, b]]
            runs.append(run[1:])
        return np.concatenate(runs)

    def _is_straight(self, a: int, b: int) -> bool:
        return bool(self.straight_move_mask(self.places[[a]], self.places[[b]])[0])

    def _straightened(self, corners: Points) -> Points:
        kept, at = [0], 0
        while at < len(corners) - 1:
            rest = corners[at + 1 :]
            seen = np.flatnonzero(self.straight_move_mask(np.broadcast_to(corners[at], rest.shape), rest))
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


def path_length(path: Points) -> float:
    """Return the length of a path through corners, float64[k, 2], mm."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())
