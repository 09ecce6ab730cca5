"""Offset closed paths while preserving arcs, for kerf compensation, clearance and spacing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Points
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.parallel import parallel
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import FINE, chords_per_quarter

#: GEOS moves the points of shallow concave parts by up to this share of the distance (its `simplifyFactor`).
GEOS_SLACK = 0.01


def offset(path: Polyline, distance: float, tolerance: float = 0.01) -> list[Polyline]:
    """Return the boundary of the area inside a closed path after growing it by `distance` mm on all sides.

    At outward corners, the boundary follows an arc around the corner, as if a round tool of that radius swept the area.
    Lines stay lines and arcs stay arcs if every element of the path has a parallel. Otherwise the boundary is computed
    with chords (shapely's buffer), and arcs are fitted to them. Both kinds of result are checked: each point is at the
    given distance from the path, within `tolerance`.

    A negative distance shrinks the area. The direction of the path does not matter. The resulting paths are closed and
    sorted, largest first. Outer boundaries are counter-clockwise; holes enclosed by growing are clockwise. The list is
    empty if no area remains.

    Raises
    ------
    PlanError
        The path is open or crosses itself.
    """
    if not path.closed:
        raise PlanError("only a closed path can be offset; the path is open")
    path = path if path.area >= 0.0 else path.reversed()
    if distance == 0.0:
        return [path]
    fine = FINE * tolerance
    check = _OffsetCheck(path, abs(distance), tolerance)
    rings = list(_rings(check.region, distance, fine, tolerance))
    if len(rings) == 1:
        exact = parallel(path, distance, fine)
        if exact is not None and check.agrees(exact, rings[0]):
            return [exact]
    return [_fit_ring(ring, check, tolerance) for ring in rings]


def _fit_ring(ring: Points, check: _OffsetCheck, tolerance: float) -> Polyline:
    """Fit lines and arcs to a ring of chords; return it unchanged if no arcs fit."""
    moved = check.moved_to_distance(ring)
    for points, reach in ((moved, 0.5), (moved, 0.2), (ring, 0.2)):
        candidate = fit_arcs(points, reach * tolerance, closed=True)
        if check.agrees(candidate, ring):
            return candidate
    return Polyline.of_points(ring, closed=True)


def _rings(region: Any, distance: float, fine: float, tolerance: float) -> Iterator[Points]:
    """Yield the rings of the buffered region, largest first, float64[n, 2]; the first point is not repeated."""
    grown = region.buffer(distance, quad_segs=chords_per_quarter(abs(distance), fine))
    pieces = [p for p in getattr(grown, "geoms", [grown]) if not p.is_empty]
    rings = [(r, sign) for p in pieces for r, sign in ((p.exterior, 1.0), *((i, -1.0) for i in p.interiors))]
    sized = []
    for ring, sign in rings:
        points = np.asarray(ring.coords)[:-1, :2]
        x, y = points.T - points[0][:, None]
        area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        # A passage exactly as wide as the tool leaves a sliver, which is not an edge to cut.
        if 2.0 * abs(area) > tolerance * ring.length:
            sized.append((abs(area), points if area * sign > 0.0 else points[::-1]))
    yield from (points for _, points in sorted(sized, key=lambda pair: -pair[0]))


class _OffsetCheck:
    """Check of offset paths against the original path, which is given as fine chords."""

    def __init__(self, path: Polyline, distance: float, tolerance: float) -> None:
        self.distance, self.tolerance = distance, tolerance
        points = path.flattened(FINE * tolerance)
        if len(points) < 4:
            raise PlanError("a closed path of fewer than three points encloses nothing")
        self.region = shapely.Polygon(points)
        if not self.region.is_valid:
            location = shapely.is_valid_reason(self.region).partition("[")[2].rstrip("]").replace(" ", ", ")
            raise PlanError("the path crosses or touches itself at ({}) and cannot be offset", location)
        self.edge = shapely.LineString(points)
        shapely.prepare(self.edge)

    def agrees(self, candidate: Polyline, ring: Points) -> bool:
        """Return whether an offset path has the right distance everywhere, does not cross itself, and covers the
        ring.
        """
        if candidate.n_segments < 2:
            return False
        points = candidate.flattened(FINE * self.tolerance)
        candidate_ring = shapely.LinearRing(points)
        dense = np.concatenate([points, 0.5 * (points[1:] + points[:-1])])
        gaps = shapely.distance(self.edge, shapely.points(dense))
        if float(np.abs(gaps - self.distance).max()) > self.tolerance or not candidate_ring.is_simple:
            return False
        shapely.prepare(candidate_ring)
        expected = np.concatenate([ring, 0.5 * (ring + np.roll(ring, 1, axis=0))])
        max_distance = 2.0 * self.tolerance + 2.0 * GEOS_SLACK * self.distance
        return bool(shapely.dwithin(candidate_ring, shapely.points(expected), max_distance).all())

    def moved_to_distance(self, ring: Points) -> Points:
        """Move the points of a ring to the exact distance from the nearest point of the path."""
        points = shapely.points(ring)
        lines = shapely.shortest_line(self.edge, points)
        feet = shapely.get_coordinates(shapely.get_point(lines, 0))
        offsets = ring - feet
        gaps = np.hypot(offsets[:, 0], offsets[:, 1])[:, None]
        moved: Points = feet + offsets * (self.distance / np.maximum(gaps, 1e-12))
        return moved
