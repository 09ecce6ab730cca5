"""Check that each shape is carved to its walls, and that no cut goes through a wall.

The check does not use a medial axis. The walls of a carved shape slope at the angle of the V-bit everywhere. So a cone
touches the surface below each point, with its radius at that depth equal to the distance to the nearest wall.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import PartRequest, VBit
from leafcut.processes.part.proof.cuts import HEIGHT, STRIP, TOLERANCE, Cuts, FaceWork, Verdict, points_on
from leafcut.proof.difference import position_text

#: Maximum distance between points on a cut, and between checked points on a wall, mm.
_SPACING = 0.1
#: Minimum distance between checked points inside a shape, mm, and approximate maximum number of these points.
_CELL, _MOST = 0.25, 20_000
#: Number of points that are checked at once.
_BLOCK = 1000


def check_carvings(request: PartRequest, cuts: Cuts) -> Verdict:
    """Find the cuts inside each carved shape, and check them against the request."""
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences: list[Difference] = []
    works = []
    for carving in request.carvings:
        region, bit, name = carving.area.region, carving.bit, carving.area.name
        inside = cuts.within(region.buffer(TOLERANCE))
        own = inside[(cuts.tools[inside] == bit.tool) & (cuts.lowest[inside] >= -carving.limit - HEIGHT)]
        explained[own] = True
        cut, tips = points_on(cuts.ends[own], _SPACING)
        reach = np.minimum(bit.tip - tips[:, 2] * bit.spread, bit.radius)
        away = _distance_inside(region, tips[:, :2])
        for k in np.flatnonzero(reach > away + TOLERANCE)[:1].tolist():
            words = Message("{} is carved through its wall at {}", name, position_text(*tips[k].tolist()))
            differences.append(cuts.difference(Message("gouge"), int(own[cut[k]]), words))
        # Passes that are not deep enough cannot touch a wall.
        deep = reach >= away - STRIP
        place = _uncarved_place(region, bit, np.unique(np.column_stack([tips[deep, :2], reach[deep]]).round(3), axis=0))
        if place is not None:
            words = Message("{} is not carved all the way to its walls at {}", name, position_text(*place.tolist()))
            differences.append(Difference(Message("not cut"), 0, 0, words))
        works.append(FaceWork(name, own, region))
    return Verdict(explained, differences, works)


def _distance_inside(region: Any, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance to the nearest wall, mm. It is negative outside the region."""
    shapely.prepare(region)
    away = shapely.distance(region.boundary, shapely.points(places))
    return np.where(shapely.contains_xy(region, *places.T), away, -away)


def _uncarved_place(region: Any, bit: VBit, tips: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return a point whose surface is too high, or None. `tips` has x, y and the radius of the cone at the top, mm.

    Places that are narrower than the tip of the V-bit are left out.
    """
    reachable = region.buffer(-bit.tip, quad_segs=64).buffer(bit.tip, quad_segs=64) if bit.tip else region
    cell = max(_CELL, math.sqrt(region.area / _MOST))
    x0, y0, x1, y1 = region.bounds
    x, y = np.meshgrid(np.arange(x0, x1, cell), np.arange(y0, y1, cell))
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[shapely.contains_xy(reachable, *grid.T)]
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
