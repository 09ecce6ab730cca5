"""A path over one level that comes back to where it began, so that the next level begins there without a lift.

Source: of the closed contour, the published system for pockets by a discrete firefly algorithm. Differs: the way back
goes through the region, from wherever a strategy ends.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Ints, Points
from leafcut.geometry.polyline import joined
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketPiece
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.region_paths import Ways

#: Most places that a way back may lead over, beside the walls: a few milliseconds.
MOST_PLACES = 2000


def closed(path: PocketPath, region: CentreRegion) -> PocketPath:
    """Return a path that is led back to its start through the region, at depth.

    Raises
    ------
    PlanError
        The path is lifted somewhere, or no way leads back.
    """
    if path.retracts:
        raise PlanError(
            f"its path is lifted {path.retracts} times on each level; --closed-path needs one that is not: use "
            "--strategy connected, firefly or ants"
        )
    begin, end = path.pieces[0].path.start, path.pieces[-1].path.end
    if math.dist(begin, end) <= SAME_PLACE:
        return path
    if region.middle is not None:
        # In a slot as wide as the tool there is one way back.
        back = joined(*(piece.path for piece in path.pieces)).reversed()
        return replace(path, pieces=(*path.pieces, PocketPiece(back, "link")))
    way = _way_back(region, np.array(end), np.array(begin))
    return replace(path, pieces=(*path.pieces, PocketPiece(as_polyline(way), "link")))


def _way_back(region: CentreRegion, end: Points, begin: Points) -> Points:
    """Return the corners of the shortest way from the end to the begin, float64[n, 2], straight where that is free."""
    ends = np.stack([end, begin])
    pitch = max(region.rules.step_over, math.sqrt(region.polygon.area / MOST_PLACES))
    ways = Ways(region.polygon, region.rings, np.concatenate([ends, _places(region, pitch)]), pitch)
    if ways.straight(ends[:1], ends[1:])[0]:
        return ends
    found = ways.way(0, [1])
    if found is None:
        raise PlanError("no way at depth leads back to where its path begins; leave out --closed-path")
    return found[1]


def _places(region: CentreRegion, pitch: float) -> Points:
    """Return places all over a region, float64[n, 2], so that a way leads from every wall to every other."""
    x0, y0, x1, y1 = region.polygon.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x0, x1, pitch), np.arange(y0, y1, pitch)))
    inside = shapely.contains_xy(region.polygon, x, y)
    return np.stack([x[inside], y[inside]], axis=1)


def turned_to_wall(order: Ints, places: Points, region: CentreRegion) -> Ints:
    """Return a closed order int32[n] of places, float64[n, 2], cut open where the ways to a wall and back are short."""
    away = shapely.distance(region.polygon.boundary, shapely.points(places[order]))
    at = int(np.argmin(away + np.roll(away, 1)))
    return np.roll(order, -at)
