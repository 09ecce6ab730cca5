"""The strategy `connected`, which clears a region along a single path over all rings, without retracts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Points, consecutive_segments
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import PocketPath, PocketPiece
from leafcut.processes.pocket.plan.coverage_points import CoverageGrid
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.ring_links import RingLinks
from leafcut.processes.pocket.plan.rings import never_stopped, offset_rings
from leafcut.processes.pocket.plan.shorten import SAMPLE_SPACING, chamfer_corners, shorten_path, subdivide_path
from leafcut.processes.pocket.plan.spurs import add_spurs

#: Tolerance for the spacing of sample points, in step-overs. It is added to half the step-over.
LEEWAY = 0.0035
#: Maximum number of attempts to correct a path with gaps between its passes.
CORRECTIONS = 4
#: Safety margin for chamfers, in tool radii. It compensates for the spacing of sample points.
SPARE = 0.03
#: Maximum distance allowed between a sample point and the path, in step-overs.
LONGEST_LIMIT = 1.25
#: Maximum length of a segment in the spatial index, in step-overs. Longer segments would have large bounding boxes.
LONGEST_LOOKED = 4.0
#: Function that returns whether the search must stop.
Stopped = Callable[[], bool]
#: Maximum number of nested rings.
MOST_LEVELS = 400
#: Maximum distance between a wall and a segment that runs along it, mm.
ALONG = 1e-5


def connected_path(
    region: CentreRegion, too_wide: Callable[[PocketPath], Points] | None = None, stopped: Stopped = never_stopped
) -> PocketPath:
    """Connect the rings of a region with the cheapest joints, then shorten the path.

    Every point of the region is within half a step-over of the path. The exceptions are places where the rings
    themselves leave wider gaps: their corners, and the space between the two sides of an innermost ring.

    Parameters
    ----------
    too_wide
        Function that returns the positions in a path, float64[n, 2], where passes are further apart than the step-over.
        The rings are not shortened near these positions, and joints move away from them.
    stopped
        Function that returns whether the search must stop. The path then still clears everything, but it may be longer,
        or passes may be too far apart.

    Raises
    ------
    PlanError
        The region has more than `MOST_LEVELS` nested rings.
    """
    # The planned step-over is smaller, because chords and sample points have their own tolerances.
    region = replace(region, rules=region.rules.planned)
    cut = offset_rings(region)
    if max((ring.level for ring in cut), default=0) >= MOST_LEVELS:
        raise PlanError(
            "the connected path would need {} nested rings or more; use --strategy contour or "
            "zigzag, or a larger tool or step-over",
            MOST_LEVELS,
        )
    layout = RingLinks(region, cut, stopped)
    candidates: list[tuple[int, PocketPath]] = []
    kept = np.zeros((0, 2))
    for _ in range(CORRECTIONS):
        paths = layout.joined_paths(kept)
        path = _shorten_paths(region, paths, np.array(layout.links).reshape(-1, 2), kept, stopped)
        if candidates and stopped():
            break
        wide = too_wide(path) if too_wide and not stopped() else np.zeros((0, 2))
        candidates.append((len(wide), path))
        if not len(wide):
            break
        kept = np.vstack([kept, wide])
    return min(candidates, key=lambda one: one[0])[1]


def _shorten_paths(
    region: CentreRegion, paths: list[Points], links: Points, kept: Points, stopped: Stopped
) -> PocketPath:
    rules = region.rules
    coverage, allowed = _coverage_grid(region, paths), region.polygon.buffer(1e-7)
    paths = [shorten_path(path, coverage, region, allowed, kept, stopped) for path in paths]
    cleared = CoverageGrid(
        region.polygon, SAMPLE_SPACING * rules.radius, rules.radius, partial(_clearing_distances, rules.radius)
    )
    paths = [chamfer_corners(path, cleared, region, allowed, np.vstack([links, kept]), stopped) for path in paths]
    paths = add_spurs(paths, region.polygon, rules)
    return PocketPath("best", tuple(piece for path in paths for piece in _divide_at_walls(region, path)))


def _divide_at_walls(region: CentreRegion, path: Points) -> list[PocketPiece]:
    """Divide a path wherever it reaches or leaves a wall.

    Passes along walls are finishing passes if no stock remains there.
    """
    middle, edge = shapely.points(0.5 * (path[:-1] + path[1:])), region.polygon.boundary
    shapely.prepare(edge)
    along = shapely.dwithin(edge, middle, ALONG) & (region.rules.stock == 0.0)
    cuts = [0, *(np.flatnonzero(np.diff(along)) + 1).tolist(), len(along)]
    return [PocketPiece(as_polyline(path[a : b + 1]), "finish" if along[a] else "rough") for a, b in pairwise(cuts)]


def _coverage_grid(region: CentreRegion, paths: list[Points]) -> CoverageGrid:
    """Create sample points in the region, with the maximum allowed distance of each point from the path.

    The limit is half the step-over, or the current distance from `paths` if this distance is larger.
    """
    step = region.rules.step_over
    short = [subdivide_path(path, LONGEST_LOOKED * step) for path in paths]
    steps: Any = shapely.linestrings(np.concatenate([consecutive_segments(path) for path in short]))
    tree = shapely.STRtree(steps)

    def limit(points: Points, pitch: float) -> Points:
        indices, near = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
        away = np.empty(len(points))
        away[indices[0]] = near / step
        limits: Points = np.minimum(step * (np.maximum(0.5, away) + LEEWAY), LONGEST_LIMIT * step)
        return limits

    return CoverageGrid(region.polygon, SAMPLE_SPACING * region.rules.radius, LONGEST_LIMIT * step, limit)


def _clearing_distances(radius: float, points: Points, pitch: float) -> Points:
    """Return the maximum distance from each sample point at which a path still clears the area around it, mm."""
    return np.full(len(points), max(radius - SPARE * pitch / SAMPLE_SPACING, 0.0))
