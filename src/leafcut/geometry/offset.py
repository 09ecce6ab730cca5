"""Offset closed paths and keep their arcs. Kerf compensation, clearance and spacing use these offsets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.geometry.regions import FINE, chords_per_quarter

#: Maximum share of the distance by which GEOS moves the points of shallow concave parts (its `simplifyFactor`).
GEOS_SLACK = 0.01


def offset_closed_path(path: Polyline, distance: float, tolerance: float = 0.01) -> list[Polyline]:
    """Grow the area inside a closed path by `distance` mm on all sides, and return its new boundary.

    At outward corners, the boundary follows an arc around the corner, as if a round tool of this radius had swept the
    area. If every element of the path has a parallel, lines stay lines and arcs stay arcs. Otherwise, shapely's buffer
    computes the boundary with chords, and arcs are fitted to these chords. In both cases, the result is checked: each
    point must be at the given distance from the path, within `tolerance`.

    A negative distance shrinks the area. The direction of the path does not matter.

    Returns
    -------
    paths
        Closed paths, largest first, or an empty list if no area remains. Outer boundaries are counter-clockwise. Holes
        that are enclosed by growing are clockwise.

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
    rings = list(_buffered_rings(check.region, distance, fine, tolerance))
    if len(rings) == 1:
        exact = offset_by_elements(path, distance, fine)
        if exact is not None and check.agrees(exact, rings[0]):
            return [exact]
    return [_fit_ring(ring, check, tolerance) for ring in rings]


def _fit_ring(ring: Points, check: _OffsetCheck, tolerance: float) -> Polyline:
    """Fit lines and arcs to a ring of chords. If no arcs fit, return the chords."""
    moved = check.moved_to_distance(ring)
    for points, reach in ((moved, 0.5), (moved, 0.2), (ring, 0.2)):
        candidate = fit_arcs(points, reach * tolerance, closed=True)
        if check.agrees(candidate, ring):
            return candidate
    return Polyline.of_points(ring, closed=True)


def _buffered_rings(region: Any, distance: float, fine: float, tolerance: float) -> Iterator[Points]:
    """Yield the rings of the buffered region, largest first, float64[n, 2]. The first point is not repeated."""
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
    """Checks offset paths against the original path, which is represented by fine chords."""

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
        """Return whether an offset path keeps its distance from the edge everywhere.

        It must also cover the `ring` and must not cross itself.
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
        points = shapely.points(ring)
        lines = shapely.shortest_line(self.edge, points)
        feet = shapely.get_coordinates(shapely.get_point(lines, 0))
        offsets = ring - feet
        gaps = np.hypot(offsets[:, 0], offsets[:, 1])[:, None]
        moved: Points = feet + offsets * (self.distance / np.maximum(gaps, 1e-12))
        return moved


# -- parallels of lines and arcs -------------------------------------------------------------------------------------


class Element(NamedTuple):
    """A line or arc of a parallel. `turn` is the angle of an arc, positive counter-clockwise, or 0 for a line."""

    start: Point
    end: Point
    turn: float = 0.0
    center: Point = (0.0, 0.0)
    radius: float = 0.0


def offset_by_elements(path: Polyline, distance: float, tolerance: float) -> Polyline | None:
    """Return the parallel at `distance` mm to the right of a closed path. A negative distance is to the left.

    The parallel is built element by element, so lines stay lines and arcs stay arcs. Arcs around the corners close
    gaps, and overlaps are cut at the intersection. The result is None if an element has no parallel, such as an arc
    with a radius below the distance, or if two neighbours do not meet. The result may cross itself, so the caller must
    check it. Ends closer than `tolerance` mm coincide.
    """
    shifted = [_shifted_element(s, distance) for s in path.segments() if s.start != s.end]
    if len(shifted) < 2 or any(e is None for e in shifted):
        return None
    elements: list[Element] = [e for e in shifted if e is not None]
    corners = [s.end for s in path.segments() if s.start != s.end]
    joints: list[Element | None] = []
    for i, corner in enumerate(corners):
        j = (i + 1) % len(elements)
        first, second = elements[i], elements[j]
        turn = _turning_angle(_direction_of_travel(first, at_end=True), _direction_of_travel(second, at_end=False))
        joints.append(None)
        if math.dist(first.end, second.start) <= tolerance:
            joint_point = (0.5 * (first.end[0] + second.start[0]), 0.5 * (first.end[1] + second.start[1]))
            elements[i], elements[j] = first._replace(end=joint_point), second._replace(start=joint_point)
        elif turn * distance > 0.0:
            joints[-1] = Element(first.end, second.start, turn, corner, abs(distance))
        else:
            crossing = _nearest_intersection(first, second)
            if crossing is None:
                return None
            elements[i], elements[j] = first._replace(end=crossing), second._replace(start=crossing)
    rows: list[tuple[float, float, float]] = []
    for element, joint in zip(elements, joints, strict=True):
        bulge = _trimmed_bulge(element)
        if bulge is None:
            return None
        rows.append((*element.start, bulge))
        if joint is not None:
            rows.append((*joint.start, math.tan(0.25 * joint.turn)))
    return Polyline(np.array(rows), closed=True)


def _shifted_element(s: Segment, distance: float) -> Element | None:
    if not s.is_arc:
        dx, dy = s.end[0] - s.start[0], s.end[1] - s.start[1]
        length = math.hypot(dx, dy)
        ox, oy = dy / length * distance, -dx / length * distance
        return Element((s.start[0] + ox, s.start[1] + oy), (s.end[0] + ox, s.end[1] + oy))
    # For a counter-clockwise arc, the right side is away from the centre.
    radius = s.radius + math.copysign(distance, s.bulge * distance)
    if radius <= 1e-6 * s.radius:
        return None
    cx, cy = s.center
    share = radius / s.radius
    start = (cx + (s.start[0] - cx) * share, cy + (s.start[1] - cy) * share)
    end = (cx + (s.end[0] - cx) * share, cy + (s.end[1] - cy) * share)
    return Element(start, end, 4.0 * math.atan(s.bulge), s.center, radius)


def _direction_of_travel(e: Element, at_end: bool) -> Point:
    """Return the direction of travel at the start or the end of an element. The vector is not normalised."""
    if e.turn == 0.0:
        return (e.end[0] - e.start[0], e.end[1] - e.start[1])
    x, y = e.end if at_end else e.start
    side = math.copysign(1.0, e.turn)
    return (-(y - e.center[1]) * side, (x - e.center[0]) * side)


def _turning_angle(a: Point, b: Point) -> float:
    """Return the angle from direction `a` to direction `b`, from -π to π."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def _nearest_intersection(a: Element, b: Element) -> Point | None:
    """Return the intersection of two elements that is closest to their common end, or None if they do not intersect."""
    reference = (0.5 * (a.end[0] + b.start[0]), 0.5 * (a.end[1] + b.start[1]))
    if a.turn == 0.0 and b.turn == 0.0:
        points = _unbounded_line_intersections(a, b)
    elif a.turn == 0.0:
        points = _line_circle_intersections(a, b)
    elif b.turn == 0.0:
        points = _line_circle_intersections(b, a)
    else:
        points = _circle_circle_intersections(a, b)
    return min(points, key=lambda p: math.dist(p, reference), default=None)


def _unbounded_line_intersections(a: Element, b: Element) -> list[Point]:
    (ux, uy), (vx, vy) = _direction_of_travel(a, True), _direction_of_travel(b, True)
    cross = ux * vy - uy * vx
    if abs(cross) <= 1e-12 * math.hypot(ux, uy) * math.hypot(vx, vy):
        return []
    share = ((b.start[0] - a.start[0]) * vy - (b.start[1] - a.start[1]) * vx) / cross
    return [(a.start[0] + share * ux, a.start[1] + share * uy)]


def _line_circle_intersections(line: Element, arc: Element) -> list[Point]:
    ux, uy = _direction_of_travel(line, True)
    length = math.hypot(ux, uy)
    ux, uy = ux / length, uy / length
    rx, ry = arc.center[0] - line.start[0], arc.center[1] - line.start[1]
    along, off = rx * ux + ry * uy, ux * ry - uy * rx
    square = arc.radius * arc.radius - off * off
    if square < 0.0:
        return []
    half = math.sqrt(square)
    return [(line.start[0] + t * ux, line.start[1] + t * uy) for t in (along - half, along + half)]


def _circle_circle_intersections(a: Element, b: Element) -> list[Point]:
    dx, dy = b.center[0] - a.center[0], b.center[1] - a.center[1]
    gap = math.hypot(dx, dy)
    if gap <= 1e-9 * a.radius:
        return []
    along = (gap * gap + a.radius * a.radius - b.radius * b.radius) / (2.0 * gap)
    square = a.radius * a.radius - along * along
    if square < 0.0:
        return []
    ux, uy, half = dx / gap, dy / gap, math.sqrt(square)
    return [(a.center[0] + along * ux - s * half * uy, a.center[1] + along * uy + s * half * ux) for s in (-1.0, 1.0)]


def _trimmed_bulge(e: Element) -> float | None:
    """Return the bulge of an element after trimming its ends, or None if nothing is left of an arc.

    If a line is trimmed beyond its own start, its direction is reversed. The caller detects this with its distance
    check.
    """
    if e.turn == 0.0:
        return 0.0
    side = math.copysign(1.0, e.turn)
    start = math.atan2(e.start[1] - e.center[1], e.start[0] - e.center[0])
    stop = math.atan2(e.end[1] - e.center[1], e.end[0] - e.center[0])
    turn = side * (stop - start) % math.tau
    if turn > abs(e.turn) + 1e-9:
        return None
    return side * math.tan(0.25 * turn)
