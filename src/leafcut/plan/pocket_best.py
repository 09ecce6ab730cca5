"""leafcut's own way to clear a pocket: one connected way, never lifted."""

from __future__ import annotations

from typing import Any

import numpy as np

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import PocketPath, PocketPiece
from leafcut.plan.pocket_gaps import wide_gaps
from leafcut.plan.pocket_joints import Layout
from leafcut.plan.pocket_region import CentreRegion
from leafcut.plan.pocket_rings import spaced_rings
from leafcut.plan.pocket_shorten import GROUND_PITCH, Ground, chamfer, mended, shorten

#: A path may be this much further from a place than half the step-over: the pitch of the places, in step-overs.
LEEWAY = 0.0035
#: Joints are laid so often, until none leaves a gap.
TRIES = 4
#: A gap within so many step-overs of a joint is its work.
BLAME = 1.2
#: Corners are cut off where all ground is cleared with this to spare, in tool radii: the places are so far apart.
SPARE = 0.03


def best(region: CentreRegion) -> PocketPath:
    """Return one connected way over a region: rings joined where it costs least, then shortened.

    No place is further from the way than half the step-over, or than rings leave it (in their corners).
    """
    rules = region.rules
    ways, links = _joined(region)
    ground, allowed = _ground(region, ways), region.polygon.buffer(1e-7)
    ways = [shorten(way, ground, region, allowed) for way in ways]
    cleared = Ground(ground.points, np.full(len(ground), (1.0 - SPARE) * rules.radius))
    ways = [mended(chamfer(way, cleared, region, allowed, links), region) for way in ways]
    return PocketPath("best", tuple(PocketPiece(as_polyline(way), "rough") for way in ways))


def _joined(region: CentreRegion) -> tuple[list[Points], Points]:
    """Return the ways through all rings, and the places of their joints, float64[n, 2].

    Joints that leave a gap wider than the step-over are laid anew elsewhere.
    """
    import shapely

    step, cut = region.rules.step_over, spaced_rings(region)
    closed: list[Points] = []
    for _ in range(TRIES):
        layout = Layout(region, cut, closed)
        ways = layout.ways()
        gaps = wide_gaps(region.polygon, [shapely.LineString(way) for way in ways], region.rules)
        gaps_ = shapely.MultiLineString(gaps)
        bad = [place for place in layout.links if shapely.Point(place).distance(gaps_) < BLAME * step] if gaps else []
        if not bad:
            break
        closed += bad
    return ways, np.array(layout.links).reshape(-1, 2)


def _ground(region: CentreRegion, ways: list[Points]) -> Ground:
    """Return places of the region and how far from the way each may be."""
    import shapely

    step = region.rules.step_over
    places = _places(region.polygon, GROUND_PITCH * region.rules.radius)
    steps = shapely.linestrings(np.concatenate([np.stack([way[:-1], way[1:]], axis=1) for way in ways]))
    found, near = shapely.STRtree(steps).query_nearest(shapely.points(places), return_distance=True, all_matches=False)
    away = np.empty(len(places))
    away[found[0]] = near / step
    return Ground(places, step * (np.maximum(0.5, away) + LEEWAY))


def _places(polygon: Any, pitch: float) -> Points:
    """Return the points of a square grid inside a polygon, float64[n, 2]."""
    import shapely

    x0, y0, x1, y1 = polygon.bounds
    grid = np.stack(np.meshgrid(np.arange(x0, x1 + pitch, pitch), np.arange(y0, y1 + pitch, pitch)), axis=-1)
    grid = grid.reshape(-1, 2)
    inside: Points = grid[shapely.contains_xy(polygon, grid[:, 0], grid[:, 1])]
    return inside
