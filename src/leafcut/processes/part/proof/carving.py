"""Check that each shape is carved to its walls, and that no cut goes through a wall.

The check does not use a medial axis. The walls of a carved shape slope at the angle of the V-bit everywhere. So a cone
touches the surface below each point, with its radius at that depth equal to the distance to the nearest wall. A shape
with an end mill has a flat floor where the walls would meet below the maximum depth.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import Carving, PartRequest, PocketMill, VBit
from leafcut.processes.part.proof.cuts import HEIGHT, STRIP, TOLERANCE, Cuts, FaceWork, Verdict, points_on
from leafcut.processes.part.proof.pockets import check_load, uncleared_place
from leafcut.proof.difference import position_text

#: Maximum distance between points on a cut, and between checked points on a wall, mm.
_SPACING = 0.1
#: Minimum distance between checked points inside a shape, mm, and approximate maximum number of these points.
_CELL, _MOST = 0.25, 20_000
#: Number of points that are checked at once.
_BLOCK = 1000
#: Minimum perimeter of the area of mill centres where the end mill must clear a floor itself, in mill radii.
_ROOM = 4.0
#: Number of chords per quarter of a circle.
_QUARTER = 64


def check_carvings(request: PartRequest, cuts: Cuts) -> Verdict:
    """Find the cuts inside each carved shape, and check them against the request."""
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences: list[Difference] = []
    works = []
    rows_of: dict[PocketMill, NDArray[np.int64]] = {}
    for carving in request.carvings:
        region, bit, name = carving.area.region, carving.bit, carving.area.name
        inside = cuts.within(region.buffer(TOLERANCE))
        inside = inside[cuts.lowest[inside] >= -carving.limit - HEIGHT]
        own, level = inside[cuts.tools[inside] == bit.tool], inside[:0]
        floor: Any = shapely.Polygon()
        if carving.flat is not None:
            level = inside[cuts.tools[inside] == carving.flat.tool]
            floor = region.buffer(-bit.tip - carving.limit * bit.spread, quad_segs=_QUARTER)
            rows_of[carving.flat] = np.union1d(rows_of.get(carving.flat, cuts.rows[:0]), cuts.rows[level])
            differences += _check_mill(carving, carving.flat, cuts, own, level)
            differences += _check_floor(carving, carving.flat, floor, cuts, own, level)
        explained[own] = explained[level] = True
        cut, tips = points_on(cuts.ends[own], _SPACING)
        reach = np.minimum(bit.tip - tips[:, 2] * bit.spread, bit.radius)
        away = _distance_inside(region, tips[:, :2])
        for k in np.flatnonzero(reach > away + TOLERANCE)[:1].tolist():
            differences.append(_through_wall(name, cuts, int(own[cut[k]]), tips[k]))
        # Passes that are not deep enough cannot touch a wall.
        deep = reach >= away - STRIP
        cones = np.unique(np.column_stack([tips[deep, :2], reach[deep]]).round(3), axis=0)
        place = _uncarved_place(region, bit, cones, floor)
        if place is not None:
            words = Message("{} is not carved all the way to its walls at {}", name, position_text(*place.tolist()))
            differences.append(Difference(Message("not cut"), 0, 0, words))
        works.append(FaceWork(name, np.union1d(own, level), region))
    for mill, rows in rows_of.items():
        differences += check_load(mill, cuts, rows) if len(rows) else []
    return Verdict(explained, differences, works)


def _through_wall(name: str, cuts: Cuts, k: int, place: NDArray[np.float64]) -> Difference:
    words = Message("{} is carved through its wall at {}", name, position_text(*place.tolist()))
    return cuts.difference(Message("gouge"), k, words)


def _check_mill(
    carving: Carving, mill: PocketMill, cuts: Cuts, own: NDArray[np.int64], level: NDArray[np.int64]
) -> list[Difference]:
    """Check that the end mill stays clear of the slopes, and that it comes before the V-bit.

    `own` are the cuts of the V-bit in this shape, and `level` are those of the end mill.
    """
    name = carving.area.name
    cut, tips = points_on(cuts.ends[level], _SPACING)
    needed = mill.radius - tips[:, 2] * carving.bit.spread
    through = np.flatnonzero(needed > _distance_inside(carving.area.region, tips[:, :2]) + TOLERANCE)[:1].tolist()
    differences = [_through_wall(name, cuts, int(level[cut[k]]), tips[k]) for k in through]
    if len(own) and len(level) and cuts.rows[own[0]] < cuts.rows[level[-1]]:
        words = Message("T{} works in {} before T{} has cleared it", carving.bit.tool, name, mill.tool)
        differences.append(cuts.difference(Message("order"), int(own[0]), words))
    return differences


def _check_floor(
    carving: Carving, mill: PocketMill, centres: Any, cuts: Cuts, own: NDArray[np.int64], level: NDArray[np.int64]
) -> list[Difference]:
    """Check that the end mill clears the floor where it fits, and that the V-bit clears the rest.

    The tip of the V-bit reaches the floor in the area `centres`.
    """
    bit = carving.bit
    deep = cuts.highest <= -carving.limit + HEIGHT
    own, level = own[deep[own]], level[deep[level]]
    rooms = carving.area.region.buffer(-carving.limit * bit.spread - mill.radius, quad_segs=_QUARTER)
    wide = [room for room in shapely.get_parts(rooms).tolist() if room.length >= _ROOM * mill.radius]
    at = uncleared_place(mill.radius, shapely.MultiPolygon(wide).buffer(mill.radius, quad_segs=_QUARTER), cuts, level)
    if at is None:
        cleared = shapely.buffer(cuts.lines[level], mill.radius + TOLERANCE, quad_segs=_QUARTER)
        # Between wider strips, the ridges would be too high.
        strips = shapely.buffer(cuts.lines[own], bit.tip + STRIP * min(1.0, bit.spread))
        left = centres.buffer(bit.tip, quad_segs=_QUARTER) - shapely.union_all([*cleared, *strips])
        left = left.buffer(-0.5 * TOLERANCE)
        if left.is_empty:
            return []
        point = left.representative_point()
        at = position_text(point.x, point.y)
    words = Message("{} is not cleared {:g} mm deep at {}", carving.area.name, carving.limit, at)
    return [Difference(Message("not cut"), 0, 0, words)]


def _distance_inside(region: Any, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance to the nearest wall, mm. It is negative outside the region."""
    shapely.prepare(region)
    away = shapely.distance(region.boundary, shapely.points(places))
    return np.where(shapely.contains_xy(region, *places.T), away, -away)


def _uncarved_place(region: Any, bit: VBit, tips: NDArray[np.float64], floor: Any) -> NDArray[np.float64] | None:
    """Return a point whose surface is too high, or None. `tips` has x, y and the radius of the cone at the top, mm.

    Places that are narrower than the tip of the V-bit are left out, and so is the area `floor`.
    """
    reachable = region.buffer(-bit.tip, quad_segs=64).buffer(bit.tip, quad_segs=64) if bit.tip else region
    cell = max(_CELL, math.sqrt(region.area / _MOST))
    x0, y0, x1, y1 = region.bounds
    x, y = np.meshgrid(np.arange(x0, x1, cell), np.arange(y0, y1, cell))
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[shapely.contains_xy(reachable, *grid.T) & ~shapely.contains_xy(floor, *grid.T)]
    walls = shapely.get_coordinates(shapely.segmentize(reachable.boundary, _SPACING))
    places = np.concatenate([walls, grid])
    away = np.maximum(_distance_inside(reachable, places), 0.0)
    for first in range(0, len(places), _BLOCK):
        block = places[first : first + _BLOCK]
        apart = np.hypot(*(block[:, None] - tips[None, :, :2]).transpose(2, 0, 1))
        missing = away[first : first + _BLOCK] - (tips[:, 2] - apart).max(axis=1, initial=-math.inf)
        if (missing > STRIP).any():
            return np.asarray(block[missing.argmax()])
    return None
