"""leafcut's own way to clear a pocket: one connected way, never lifted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import PocketPath, PocketPiece
from leafcut.plan.pocket_joints import Layout
from leafcut.plan.pocket_region import CentreRegion
from leafcut.plan.pocket_rings import rings
from leafcut.plan.pocket_shorten import GROUND_PITCH, Ground, chamfer, shorten
from leafcut.plan.pocket_spurs import with_spurs

#: A path may be this much further from a place than half the step-over: the pitch of the places, in step-overs.
LEEWAY = 0.0035
#: Rings are nearer to each other by this share than they may be, or chords and leeway would add up to more.
LESS = 0.0016
#: Where a path came out too wide, its rings are left as they were: so often that is looked for.
CORRECTIONS = 4
#: Corners are cut off where all ground is cleared with this to spare, in tool radii: the places are so far apart.
SPARE = 0.03
#: So many places at most stand for the ground: bounds time and memory.
MOST_PLACES = 200_000
#: What is nearer to a wall's way than this runs along it, mm.
ALONG = 1e-5


def best(region: CentreRegion, too_wide: Callable[[PocketPath], Points] | None = None) -> PocketPath:
    """Return one connected way over a region: rings joined where it costs least, then shortened.

    No place is further from the way than half the step-over, or than rings leave it: in their corners, and where the
    two sides of a last ring meet.

    Parameters
    ----------
    too_wide
        Returns the places of a path, float64[n, 2], where it is further than the step-over from its nearer neighbour;
        there the rings are left as they were, and joined elsewhere.
    """
    # Chords and the places that stand for the ground must not add up to more than the step-over.
    region = replace(region, rules=replace(region.rules, step_over=(1.0 - LESS) * region.rules.step_over))
    cut = rings(region)
    found: list[tuple[int, PocketPath]] = []
    kept = np.zeros((0, 2))
    for _ in range(CORRECTIONS):
        layout = Layout(region, cut, kept)
        path = _shortened(region, layout.ways(), np.array(layout.links).reshape(-1, 2), kept)
        wide = too_wide(path) if too_wide else np.zeros((0, 2))
        found.append((len(wide), path))
        if not len(wide):
            break
        kept = np.vstack([kept, wide])
    return min(found, key=lambda one: one[0])[1]


def _shortened(region: CentreRegion, ways: list[Points], links: Points, kept: Points) -> PocketPath:
    """Return the path of ways made shorter, but for what lies near the places `kept`."""
    rules = region.rules
    ground, allowed = _ground(region, ways), region.polygon.buffer(1e-7)
    ways = [shorten(way, ground, region, allowed, kept) for way in ways]
    spare = SPARE * ground.pitch / (GROUND_PITCH * rules.radius)
    cleared = Ground(ground.points, np.full(len(ground), (1.0 - spare) * rules.radius), ground.pitch)
    ways = [chamfer(way, cleared, region, allowed, np.vstack([links, kept])) for way in ways]
    ways = with_spurs(ways, region.polygon, rules)
    return PocketPath("best", tuple(piece for way in ways for piece in _pieces(region, way)))


def _pieces(region: CentreRegion, way: Points) -> list[PocketPiece]:
    """Return a way cut where it comes to a wall and leaves it: what runs along a wall without stock finishes it."""
    import shapely

    middle = shapely.points(0.5 * (way[:-1] + way[1:]))
    along = (shapely.distance(region.polygon.boundary, middle) < ALONG) & (region.rules.stock == 0.0)
    cuts = [0, *(np.flatnonzero(np.diff(along)) + 1).tolist(), len(along)]
    return [PocketPiece(as_polyline(way[a : b + 1]), "finish" if along[a] else "rough") for a, b in pairwise(cuts)]


def _ground(region: CentreRegion, ways: list[Points]) -> Ground:
    """Return places of the region and how far from the way each may be."""
    import shapely

    step = region.rules.step_over
    pitch = max(GROUND_PITCH * region.rules.radius, math.sqrt(region.polygon.area / MOST_PLACES))
    places = _places(region.polygon, pitch)
    steps = shapely.linestrings(np.concatenate([np.stack([way[:-1], way[1:]], axis=1) for way in ways]))
    found, near = shapely.STRtree(steps).query_nearest(shapely.points(places), return_distance=True, all_matches=False)
    away = np.empty(len(places))
    away[found[0]] = near / step
    return Ground(places, step * (np.maximum(0.5, away) + LEEWAY), pitch)


def _places(polygon: Any, pitch: float) -> Points:
    """Return the points of a square grid inside a polygon, float64[n, 2]."""
    import shapely

    x0, y0, x1, y1 = polygon.bounds
    grid = np.stack(np.meshgrid(np.arange(x0, x1 + pitch, pitch), np.arange(y0, y1 + pitch, pitch)), axis=-1)
    grid = grid.reshape(-1, 2)
    shapely.prepare(polygon)
    inside: Points = grid[shapely.contains_xy(polygon, grid[:, 0], grid[:, 1])]
    return inside
