"""V-carving: a V-bit follows the medial axis of a shape, so deep that its cone just reaches both walls.

Where a shape with a maximum depth is too wide for this, it has a flat floor at this depth. An end mill clears the
floor, and the V-bit follows its edge and clears the places that are too narrow for the end mill.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.geometry.arrays import Floats, Point
from leafcut.geometry.medial_axis import medial_axis
from leafcut.geometry.regions import as_polyline, polygons, shrink_region, swept_region, tool_centres
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, SHORTEST
from leafcut.processes.part.model import Carving, Edge, PocketArea, PocketMill, VBit
from leafcut.processes.part.plan.finishing import index_of_areas
from leafcut.processes.part.plan.task import Mill, PartHeights

#: Maximum material that is left in a corner, and tolerance of the path, mm.
_LEFT, _TOLERANCE = 0.015, 0.004
#: Minimum length of a move, mm. Rounding to four decimals of an inch could turn a shorter move into none.
_SHORTEST_MOVE = 0.005
#: Maximum number of start points of a path.
_STARTS = 8
#: Maximum height of the ridges that the V-bit leaves on a floor, and maximum width of the strip that one pass clears
#: beside the flat of the tip, mm.
_RIDGE = 0.04
#: Distance between two passes on a floor, as a share of the width that they clear.
_OVERLAP = 0.9
#: Maximum length of a move from one pass to the next, in distances between the passes.
_LINK = 3.0
#: Minimum excess of a circle that makes room for a floor, mm. It exceeds the errors of the medial axis and of offsets.
_EXCESS = 0.005
#: Maximum distance between the end of the medial axis and the edge of the floor, mm.
_SNAP = 0.05
#: Minimum width of a remainder on a floor that counts, mm. Films are within the tolerance of the end mill's path.
_THIN = 0.04
#: Minimum perimeter of the area of mill centres, in mill radii. Otherwise, the end mill has no room for a ramp.
_ROOM = 2.0


@dataclass(frozen=True, eq=False)
class CarvingTask:
    """The connected paths in a shape, which the V-bit follows in one go.

    Each of `tours`, float64[n, 3], mm, starts at another end. The V-bit goes back over branches that it has carved. If
    the shape is deeper than the step-down, it repeats the tour, back and forth. `later` contains the edges that enclose
    or cross the shape.
    """

    tours: tuple[Floats, ...]
    passes: int
    later: tuple[int, ...]

    @property
    def choices(self) -> list[tuple[Point, Point]]:
        """Entry and exit point of each choice."""
        ends = [tour[[0, -1 if self.passes % 2 else 0], :2].tolist() for tour in self.tours]
        return [((x0, y0), (x1, y1)) for (x0, y0), (x1, y1) in ends]

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Carve the shape pass by pass. The vertical speed is at most the plunge rate."""
        data, tour = mill.data, self.tours[choice]
        builder.feed(z=ABOVE, feed=data.tool.feed)
        for number in range(self.passes):
            level = -(number + 1) * mill.step
            for x, y, depth in (tour[::-1] if number % 2 else tour).tolist():
                position, z = builder.position, max(depth, level)
                length, drop = math.dist(position, (x, y, z)), position[2] - z
                if length > _SHORTEST_MOVE:
                    steep = data.plunge_feed * length / drop if drop > SHORTEST else math.inf
                    builder.feed(x, y, z, feed=min(data.tool.feed, steep))


def carving_axis(region: shapely.Polygon, bit: VBit, limit: float = math.inf) -> list[Floats]:
    """Return the paths of the tip in a shape as float64[n, 3], mm. Places narrower than the tip are left out.

    Where the tip would go below the depth `limit`, mm, it follows the edge of a floor at this depth instead.
    """
    wide = region.buffer(-bit.tip).buffer(bit.tip) if bit.tip else region
    pieces = [piece for piece in shapely.get_parts(wide) if not piece.is_empty]
    axis = [branch for piece in pieces for branch in medial_axis(piece, _LEFT, _TOLERANCE)]
    if limit < math.inf:
        axis = _around_floor(axis, region, bit.tip + limit * bit.spread)
    for branch in axis:
        branch[:, 2] = np.maximum(np.minimum(bit.tip - branch[:, 2], 0.0) / bit.spread, -limit)
    return axis


def _around_floor(axis: Sequence[Floats], region: shapely.Polygon, radius: float) -> list[Floats]:
    """Replace the branches whose circles are larger than `radius`, mm, by the edges of the area of these circles.

    The edges are divided where branches end on them, so that the tip can go round the floor and into its corners.
    """
    rings = _rings(shrink_region(region, radius))
    branches: list[Floats] = []
    nodes: list[list[float]] = [[] for _ in rings]
    for piece in (piece for branch in axis for piece in _narrow_pieces(branch, radius + _EXCESS)):
        branch = piece
        for last in (False, True):
            end = shapely.Point(branch[-1 if last else 0, :2])
            nearest = int(shapely.distance(rings, end).argmin()) if rings else 0
            if rings and branch[-1 if last else 0, 2] >= radius and rings[nearest].distance(end) <= _SNAP:
                nodes[nearest].append(round(min(rings[nearest].project(end), rings[nearest].length), 3))
                node = [[*rings[nearest].interpolate(nodes[nearest][-1]).coords[0], radius]]
                branch = np.concatenate([branch, node] if last else [node, branch])
        branches.append(branch)
    for ring, places in zip(rings, nodes, strict=True):
        branches += [np.column_stack([xy, np.full(len(xy), radius)]) for xy in _pieces_between(ring, places)]
    return branches


def _narrow_pieces(branch: Floats, radius: float) -> list[Floats]:
    """Return the pieces of a branch on which its circles are at most as large as `radius`, mm."""
    wide = branch[:, 2] > radius
    before = np.flatnonzero(wide[1:] != wide[:-1])
    first, step = branch[before], np.diff(branch, axis=0)[before]
    crossings = first + ((radius - first[:, 2]) / step[:, 2])[:, None] * step
    crossings[:, 2] = radius
    points = np.insert(branch, before + 1, crossings, axis=0)
    bounds = [0, *(before + 1 + np.arange(len(before))).tolist(), len(points) - 1]
    # Wide and narrow pieces alternate.
    return [points[a : b + 1] for k, (a, b) in enumerate(pairwise(bounds)) if bool(wide[0]) == bool(k % 2)]


def _rings(area: Any) -> list[shapely.LineString]:
    pieces = polygons(area.simplify(_TOLERANCE))
    return [shapely.LineString(ring.coords) for piece in pieces for ring in (piece.exterior, *piece.interiors)]


def _pieces_between(ring: shapely.LineString, places: Sequence[float]) -> Iterator[Floats]:
    """Yield the pieces of a closed line between places, mm along the line, each from one place to the next."""
    coordinates = shapely.get_coordinates(ring)
    if not places:
        yield coordinates
        return
    stops = sorted(set(places))
    two_laps = shapely.LineString(np.concatenate([coordinates, coordinates[1:]]))
    ends = [ring.interpolate(stop).coords[0] for stop in (*stops, stops[0])]
    spans = pairwise([*stops, stops[0] + ring.length])
    for (start, end), (first, last) in zip(spans, pairwise(ends), strict=True):
        inner = shapely.get_coordinates(substring(two_laps, start, end))[1:-1]
        yield np.array([first, *inner.tolist(), last])


def floor_areas(area: PocketArea, bit: VBit, limit: float, mill: PocketMill) -> tuple[PocketArea, ...]:
    """Return the areas of the floor of a shape that an end mill can clear. `limit` is the depth of the floor, mm."""
    floors = polygons(shrink_region(area.region, limit * bit.spread))
    centres = [piece for floor in floors for piece in polygons(tool_centres(floor, mill.radius))]
    return tuple(
        replace(
            area,
            outline=as_polyline(piece.exterior.coords, closed=True),
            islands=tuple(as_polyline(ring.coords, closed=True) for ring in piece.interiors),
            depth=limit,
            mill=mill,
        )
        for room in centres
        if room.length >= _ROOM * mill.radius
        for piece in map(shapely.geometry.polygon.orient, polygons(swept_region(room, mill.radius)))
    )


def floor_passes(carving: Carving, cleared: Any) -> list[Floats]:
    """Return the paths of the tip that clear the floor of a shape, except for its edge and the area `cleared`.

    Each path is float64[n, 3], mm.
    """
    bit = carving.bit
    cover = bit.tip + _RIDGE * min(1.0, bit.spread)
    half = _OVERLAP * cover
    centres = shrink_region(carving.area.region, bit.tip + carving.limit * bit.spread)
    left = swept_region(centres, bit.tip) - shapely.union_all([cleared, swept_region(centres.boundary, cover)])
    wide = _without_films(left)
    lines: list[Any] = []
    # Passes at even distances from the edge leave strips in the middle of narrow places. Passes between them clear
    # these strips.
    for first in (2.0 * half, half):
        farthest = _farthest_place(wide, centres.boundary)
        for offset in np.arange(first, farthest + cover, 2.0 * half).tolist():
            rings = shapely.MultiLineString(_rings(shrink_region(centres, offset)))
            parts = shapely.get_parts(rings.intersection(wide.buffer(cover, quad_segs=4)))
            passes: Any = shapely.line_merge(shapely.multilinestrings(parts[shapely.length(parts) > _TOLERANCE]))
            if not passes.is_empty:
                lines += shapely.get_parts(passes).tolist()
                # Films are removed from a copy, because they would grow if they were removed again and again.
                left = left - swept_region(passes, cover)
                wide = _without_films(left)
    paths = _linked([shapely.get_coordinates(line) for line in lines], centres, 2.0 * _LINK * half)
    return [np.column_stack([path, np.full(len(path), -carving.limit)]) for path in paths]


def _without_films(area: Any) -> Any:
    """Return an area without its films. Few points are enough, because their error is smaller than a film."""
    return area.buffer(-0.5 * _THIN, quad_segs=2).buffer(0.5 * _THIN, quad_segs=2).simplify(_TOLERANCE)


def _farthest_place(area: Any, boundary: Any) -> float:
    """Return an upper bound for the distance of points in an area from a boundary, mm."""
    farthest = 0.0
    for piece in polygons(area):
        x0, y0, x1, y1 = piece.bounds
        away = shapely.distance(boundary, shapely.points(shapely.get_coordinates(piece)))
        # Each point of the piece is at most this far from one of its corners.
        farthest = max(farthest, float(away.max()) + math.hypot(x1 - x0, y1 - y0))
    return farthest


def _linked(lines: Sequence[Floats], room: Any, longest: float) -> list[Floats]:
    """Connect lines by moves of at most `longest` mm that stay inside an area."""
    room = room.buffer(_TOLERANCE)
    shapely.prepare(room)
    ends = np.array([line[[0, -1]] for line in lines]).reshape(-1, 2, 2)
    left, paths = np.ones(len(lines), dtype=np.bool_), []
    while left.any():
        number, end = int(left.argmax()), 0
        path: list[Floats] = []
        while True:
            left[number] = False
            path.append(lines[number][::-1] if end else lines[number])
            away = np.where(left[:, None], np.hypot(*np.moveaxis(ends - path[-1][-1], -1, 0)), math.inf)
            number, end = divmod(int(away.argmin()), 2)
            link = shapely.LineString([path[-1][-1], ends[number, end]])
            if away.min() > longest or not room.covers(link):
                break
        paths.append(np.concatenate(path))
    return paths


def carving_tasks(
    carved: Sequence[tuple[Carving, Sequence[Floats]]], edges: Sequence[Edge], step: float
) -> list[CarvingTask]:
    """Create the carving tasks of one V-bit from shapes and their paths. Each pass is at most `step` mm deep."""
    areas = index_of_areas(edges)
    tasks = []
    for carving, axis in carved:
        later = tuple(np.sort(areas.query(carving.area.region, predicate="intersects")).tolist())
        for tours in _connected_tours(axis):
            deepest = -min(float(tour[:, 2].min()) for tour in tours)
            tasks.append(CarvingTask(tours, max(math.ceil(deepest / step - 1e-9), 1), later))
    return tasks


def _connected_tours(axis: Sequence[Floats]) -> Iterator[tuple[Floats, ...]]:
    """Yield the tours of each connected part of an axis. They start at its ends, at the shallowest first."""
    at: dict[tuple[float, ...], list[int]] = {}
    # Branches into corners come before the edge of a floor, which leads to further corners.
    for number in sorted(range(len(axis)), key=lambda k: (_is_level(axis[k]), len(axis[k]))):
        for place in (axis[number][0], axis[number][-1]):
            at.setdefault(tuple(place), []).append(number)
    left = set(range(len(axis)))
    # A closed branch has no end.
    ends = sorted(at, key=lambda place: (len(at[place]) > 1, -place[2]))
    for place in ends:
        if left.isdisjoint(at[place]):
            continue
        first, own = _tour(axis, at, place)
        left -= own
        others = [end for end in ends if end != place and len(at[end]) == 1 and at[end][0] in own]
        yield (first, *(_tour(axis, at, end)[0] for end in others[: _STARTS - 1]))


def _tour(
    axis: Sequence[Floats], at: dict[tuple[float, ...], list[int]], place: tuple[float, ...]
) -> tuple[Floats, set[int]]:
    done: set[int] = set()
    path, back, seen = [np.array([place])], [], 0
    while True:
        number = next((k for k in at[place] if k not in done), None)
        if number is not None:
            done.add(number)
            branch = axis[number] if tuple(axis[number][0]) == place else axis[number][::-1]
            back.append(branch[::-1])
            path.append(branch[1:])
            seen = len(path)
        elif back:
            branch = back.pop()
            path.append(branch[1:])
        else:
            # The way back after the last new branch is not needed.
            return np.concatenate(path[:seen] or path), done
        place = tuple(branch[-1])


def _is_level(branch: Floats) -> bool:
    return float(np.ptp(branch[:, 2])) < SHORTEST
