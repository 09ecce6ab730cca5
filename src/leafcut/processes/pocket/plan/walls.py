"""The finishing pass along each wall, which removes the stock that roughing leaves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.pocket import PocketPath, PocketPiece
from leafcut.processes.pocket.plan.region import CentreRegion

#: Candidate radii of lead-in and lead-out arcs, in tool radii.
LEADS = (0.8, 0.5, 0.3, 0.15)
#: Maximum number of positions along a wall at which leads are tried.
MOST_PLACES = 60
#: Maximum overlap of a lead with the chords of a wall, as a share of the path tolerance.
TOUCH = 0.1


def wall_passes(region: CentreRegion, roughed: Any) -> PocketPath:
    """Return a path with a pass along each wall of a region. Each pass starts and ends in the cleared area.

    The lead-in and lead-out are quarter circles. If they do not fit, the pass starts directly on the wall. `roughed` is
    the area of tool centres for roughing (shapely geometry).
    """
    shapely.prepare(roughed)
    room = region.polygon.buffer(TOUCH * region.rules.tolerance)
    shapely.prepare(room)
    # Each ring has the region on its left and the wall on its right, which is climb milling.
    rings = [ring if region.rules.climb else ring[::-1] for ring in region.boundary_rings]
    pieces = []
    place: tuple[float, float] | None = None
    for ring in _order_rings(rings):
        piece = _wall_pass(
            _add_midpoints(ring, region.rules.radius), room, roughed, region.rules.climb, region.rules.radius
        )
        if place is not None and roughed.covers(shapely.LineString([place, piece.start])):
            pieces.append(PocketPiece(Polyline.of_points([place, piece.start]), "link"))
        pieces.append(PocketPiece(piece, "finish"))
        place = piece.end
    return PocketPath("walls", tuple(pieces))


def _order_rings(rings: list[Points]) -> list[Points]:
    """Return the outer wall, followed by the walls of the islands in nearest-neighbour order."""
    rest, order = rings[1:], rings[:1]
    while rest:
        here = order[-1][0]
        nearest = min(range(len(rest)), key=lambda k: float(np.hypot(*(rest[k] - here).T).min()))
        order.append(rest.pop(nearest))
    return order


def _wall_pass(ring: Points, room: Any, roughed: Any, climb: bool, radius: float) -> Polyline:
    side = 1.0 if climb else -1.0
    best: tuple[int, Polyline, Polyline] | None = None
    for part in LEADS:
        for start in _straight_vertices(ring):
            come, leave = _wall_leads(ring, start, side, part * radius)
            if roughed.covers(shapely.Point(come.start)) and all(
                room.covers(shapely.LineString(lead.flattened(1e-4))) for lead in (come, leave)
            ):
                best = (start, come, leave)
                break
        if best is not None:
            break
    start = 0 if best is None else best[0]
    turned = np.roll(ring, -start, axis=0)
    whole = Polyline.of_points(np.concatenate([turned, turned[:1]]))
    return whole if best is None else concatenate(best[1], whole, best[2])


def _add_midpoints(ring: Points, least: float) -> Points:
    """Add the midpoint of each edge of a ring that is longer than `least`, mm."""
    after = np.roll(ring, -1, axis=0)
    long = np.hypot(*(after - ring).T) > least
    return np.insert(ring, np.flatnonzero(long) + 1, 0.5 * (ring + after)[long], axis=0)


def _straight_vertices(ring: Points) -> list[int]:
    """Return the indices of points where a ring hardly turns. Points between long edges come first."""
    ahead = np.roll(ring, -1, axis=0) - ring
    behind = np.roll(ahead, 1, axis=0)
    turn = np.abs(np.arctan2(behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0], (behind * ahead).sum(axis=1)))
    straight = np.flatnonzero(turn < 0.1)
    if not len(straight):
        return []
    longest = np.hypot(*ahead.T) + np.hypot(*behind.T)
    order = straight[np.argsort(-longest[straight], kind="stable")]
    return [int(k) for k in order[:MOST_PLACES]]


def _wall_leads(ring: Points, start: int, side: float, radius: float) -> tuple[Polyline, Polyline]:
    """Return the lead-in and lead-out at a point of a ring. Both are quarter circles on the inner side of the wall."""
    ahead, behind = ring[(start + 1) % len(ring)] - ring[start], ring[start] - ring[start - 1]
    tangent = ahead / math.hypot(*ahead) + behind / math.hypot(*behind)
    tangent /= math.hypot(*tangent)
    normal = side * np.array([-tangent[1], tangent[0]])
    ends = [ring[start] + radius * (normal + sign * tangent) for sign in (-1.0, 1.0)]
    bulge = side * math.tan(math.pi / 8.0)
    first = np.array([[*ends[0], bulge], [*ring[start], 0.0]])
    last = np.array([[*ring[start], bulge], [*ends[1], 0.0]])
    return Polyline(first), Polyline(last)
