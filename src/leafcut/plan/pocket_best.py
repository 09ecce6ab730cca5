"""leafcut's own way to clear a pocket: one connected way, never lifted."""

from __future__ import annotations

from typing import Any

import numpy as np

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import PocketPath, PocketPiece
from leafcut.plan.pocket_joints import Layout
from leafcut.plan.pocket_region import CentreRegion
from leafcut.plan.pocket_rings import spaced_rings
from leafcut.plan.pocket_shorten import GROUND_PITCH, Ground, shorten

#: A path may be this much further from a place than half the step-over: the pitch of the places, in step-overs.
LEEWAY = 0.0035
#: Distances beyond half the step-over are rounded up to this, in step-overs, so that few of them differ.
ROUNDING = 1.0 / 60.0


def best(region: CentreRegion) -> PocketPath:
    """Return one connected way over a region: rings joined where it costs least, then shortened.

    No place is further from the way than half the step-over, or than rings leave it (in their corners).
    """
    rules = region.rules
    ways = Layout(region, spaced_rings(region)).ways()
    ground, allowed = _ground(region, ways), region.polygon.buffer(1e-7)
    ways = [shorten(way, ground, allowed, rules.radius) for way in ways]
    return PocketPath("best", tuple(PocketPiece(as_polyline(way), "rough") for way in ways))


def _ground(region: CentreRegion, ways: list[Points]) -> Ground:
    """Return places of the region and how far from the way each may be."""
    import shapely

    step = region.rules.step_over
    places = _places(region.polygon, GROUND_PITCH * region.rules.radius)
    way = shapely.multilinestrings([shapely.LineString(w) for w in ways])
    away = shapely.distance(way, shapely.points(places)) / step
    limits = np.maximum(0.5 + LEEWAY, ROUNDING * np.ceil((away + 0.1 * ROUNDING) / ROUNDING))
    return Ground(places, step * limits)


def _places(polygon: Any, pitch: float) -> Points:
    """Return the points of a square grid inside a polygon, float64[n, 2]."""
    import shapely

    x0, y0, x1, y1 = polygon.bounds
    grid = np.stack(np.meshgrid(np.arange(x0, x1 + pitch, pitch), np.arange(y0, y1 + pitch, pitch)), axis=-1)
    grid = grid.reshape(-1, 2)
    inside: Points = grid[shapely.contains_xy(polygon, grid[:, 0], grid[:, 1])]
    return inside
