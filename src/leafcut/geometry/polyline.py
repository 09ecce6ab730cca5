"""`Polyline`: a path of connected lines and circular arcs, open or closed, for contours, leads and cuts.

The bulge of an arc defines its shape, as in DXF (LWPOLYLINE, group code 42). The bulge is the tangent of a quarter of
the arc's angle, and is positive counter-clockwise. It is 0 for a straight line and 1 for a half circle. A full circle
consists of two half circles.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Points

#: Maximum bulge of a straight line. An arc with this bulge rises by less than a nanometre per metre.
STRAIGHT = 1e-9
#: Maximum distance between lines that coincide, mm.
COINCIDENT = 0.01


class Segment(NamedTuple):
    """A line or arc from `start` to `end`, mm. A line has the bulge 0, and its `center` and `radius` are NaN."""

    start: tuple[float, float]
    end: tuple[float, float]
    bulge: float
    center: tuple[float, float]
    radius: float

    @property
    def is_arc(self) -> bool:
        """Whether the segment is an arc. An arc with a positive `bulge` is counter-clockwise."""
        return self.bulge != 0.0


@dataclass(frozen=True, eq=False)
class Polyline:
    """A path of lines and arcs. Each vertex is stored with the bulge of the segment that starts there.

    Attributes
    ----------
    vertices
        float64[n, 3]: x and y in mm, and the bulge to the next vertex. A closed polyline does not repeat its first
        vertex, and its last bulge belongs to the segment back to the first vertex. The last bulge of an open polyline
        is 0.
    """

    vertices: NDArray[np.float64]
    closed: bool = False

    def __post_init__(self) -> None:
        shape = self.vertices.shape
        if len(shape) != 2 or shape[1] != 3 or not shape[0]:
            raise PlanError("a polyline needs vertices of shape (n, 3): x, y and bulge; the shape is {}", shape)
        if not np.isfinite(self.vertices).all():
            raise PlanError("a polyline has a coordinate that is not a number")

    @classmethod
    def of_points(cls, points: ArrayLike, closed: bool = False) -> Polyline:
        """Create a polyline of straight lines through n points (x and y in mm).

        If the polyline is closed and the last point repeats the first point, the last point is dropped.
        """
        xy = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        if closed and len(xy) > 1 and np.array_equal(xy[0], xy[-1]):
            xy = xy[:-1]
        return cls(np.column_stack([xy, np.zeros(len(xy))]), closed)

    @classmethod
    def circle(cls, x: float, y: float, radius: float, clockwise: bool = False) -> Polyline:
        """Create a circle that starts at its rightmost point, counter-clockwise by default."""
        bulge = -1.0 if clockwise else 1.0
        return cls(np.array([[x + radius, y, bulge], [x - radius, y, bulge]]), closed=True)

    @property
    def n_segments(self) -> int:
        """Number of lines and arcs."""
        return len(self.vertices) - (0 if self.closed else 1)

    @cached_property
    def _ends(self) -> Points:
        """Start and end of each segment: x0, y0, x1, y1, float64[m, 4]."""
        xy = self.vertices[:, :2]
        after = np.concatenate([xy[1:], xy[:1]]) if self.closed else xy[1:]
        return np.concatenate([xy[: self.n_segments], after], axis=1)

    @cached_property
    def bulges(self) -> Points:
        """Bulge of each segment, float64[m]. It is exactly 0 if a segment is straight except for rounding."""
        bulges = self.vertices[: self.n_segments, 2]
        return np.where(np.abs(bulges) < STRAIGHT, 0.0, bulges)

    @cached_property
    def lengths(self) -> Points:
        """Length of each segment, mm, float64[m]."""
        chord = np.hypot(self._ends[:, 2] - self._ends[:, 0], self._ends[:, 3] - self._ends[:, 1])
        if not self.bulges.any():
            return chord
        angle = 4.0 * np.arctan(np.abs(self.bulges))
        with np.errstate(divide="ignore", invalid="ignore"):
            stretch = np.where(angle > 0.0, 0.5 * angle / np.sin(0.5 * angle), 1.0)
        return chord * stretch

    @cached_property
    def length(self) -> float:
        """Total length, mm."""
        return float(self.lengths.sum())

    @cached_property
    def area(self) -> float:
        """Area inside a closed polyline, mm². It is negative if the polyline is clockwise, and 0 if it is open."""
        if not self.closed:
            return 0.0
        x0, y0, x1, y1 = self._ends.T
        # Use coordinates relative to the first vertex, so that a small area far from the origin stays precise.
        x0, x1, y0, y1 = (
            x0 - self.vertices[0, 0],
            x1 - self.vertices[0, 0],
            y0 - self.vertices[0, 1],
            y1 - self.vertices[0, 1],
        )
        angle = 4.0 * np.arctan(self.bulges)
        with np.errstate(divide="ignore", invalid="ignore"):
            radius = np.where(angle != 0.0, 0.5 * np.hypot(x1 - x0, y1 - y0) / np.sin(0.5 * np.abs(angle)), 0.0)
        return float(np.sum(0.5 * (x0 * y1 - x1 * y0) + 0.5 * radius**2 * (angle - np.sin(angle))))

    def segment(self, index: int) -> Segment:
        """Return the segment at an index. Negative indices count from the end."""
        return self._segments[index]

    @cached_property
    def _segments(self) -> tuple[Segment, ...]:
        return tuple(map(_segment, self._ends.tolist(), self.bulges.tolist()))

    def segments(self) -> Iterator[Segment]:
        """Yield every segment in order."""
        return iter(self._segments)

    @property
    def start(self) -> tuple[float, float]:
        """Start point, mm."""
        return (float(self.vertices[0, 0]), float(self.vertices[0, 1]))

    @property
    def end(self) -> tuple[float, float]:
        """End point, mm. For a closed polyline, this is the start point."""
        return self.start if self.closed else (float(self.vertices[-1, 0]), float(self.vertices[-1, 1]))

    @cached_property
    def extents(self) -> tuple[float, float, float, float]:
        """Minimum x and y, followed by maximum x and y, mm. Arcs are taken into account."""
        blocks = [self.vertices[:, :2]]
        arcs = np.flatnonzero(self.bulges).tolist() if self.vertices[:, 2].any() else []
        for s in map(self.segment, arcs):
            start = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0])
            turn = 4.0 * math.atan(s.bulge)
            for quarter in range(4):
                from_start = (quarter * 0.5 * math.pi - start) * math.copysign(1.0, turn) % (2.0 * math.pi)
                if from_start <= abs(turn):
                    angle = quarter * 0.5 * math.pi
                    blocks.append(
                        np.array([[s.center[0] + s.radius * math.cos(angle), s.center[1] + s.radius * math.sin(angle)]])
                    )
        points = np.concatenate(blocks) if arcs else blocks[0]
        low, high = points.min(axis=0), points.max(axis=0)
        return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))

    def flattened(self, tolerance: float = 0.01) -> Points:
        """Return points along the polyline, float64[k, 2]. The chord error of arcs is at most `tolerance` mm.

        For a closed polyline, the first point is repeated at the end.
        """
        if not self.bulges.any():
            return np.concatenate([self.vertices[:, :2], self.vertices[: int(self.closed), :2]])
        points = [np.array([self.start])]
        points += [_arc_chord_points(s, tolerance) if s.is_arc else np.array([s.end]) for s in self.segments()]
        return np.concatenate(points)

    def reversed(self) -> Polyline:
        """Return the polyline in reverse direction. A closed polyline still starts at the same vertex."""
        xy = self.vertices[::-1, :2]
        if self.closed:
            xy = np.roll(xy, 1, axis=0)
            bulges = -self.vertices[::-1, 2]
        else:
            bulges = np.append(-self.vertices[-2::-1, 2], 0.0)
        return Polyline(np.column_stack([xy, bulges]), self.closed)

    def moved(self, dx: float, dy: float) -> Polyline:
        """Return the polyline moved by (dx, dy) mm."""
        return Polyline(self.vertices + np.array([dx, dy, 0.0]), self.closed)

    def turned(self, angle: float) -> Polyline:
        """Return the polyline rotated by `angle` (rad) counter-clockwise about the origin."""
        cos, sin = math.cos(angle), math.sin(angle)
        x, y, bulge = self.vertices.T
        return Polyline(np.column_stack([cos * x - sin * y, sin * x + cos * y, bulge]), self.closed)

    @cached_property
    def _distances(self) -> tuple[list[float], list[float]]:
        """Distance from the start of the path to the end of each segment, and the length of each segment, mm."""
        return np.cumsum(self.lengths).tolist(), self.lengths.tolist()

    def _locate(self, distance: float) -> tuple[int, float]:
        """Return the segment at a distance from the start, and the position on this segment as a fraction."""
        if self.closed and self.length > 0.0:
            distance %= self.length
        ends, lengths = self._distances
        index = min(bisect_right(ends, distance), self.n_segments - 1)
        length = lengths[index]
        before = ends[index] - length
        return index, min(max((distance - before) / length, 0.0), 1.0) if length > 0.0 else 0.0

    def point_at(self, distance: float) -> tuple[float, float]:
        """Return the point at a distance from the start, mm.

        Beyond the ends of an open polyline, return the closest end.
        """
        index, share = self._locate(distance)
        return _point_on_segment(self.segment(index), share)

    def direction_at(self, distance: float) -> tuple[float, float]:
        """Return the direction of travel, as a unit vector, at a given distance (in mm) from the start.

        At a vertex, this is the direction of the following segment.
        """
        index, share = self._locate(distance)
        s = self.segment(index)
        if not s.is_arc:
            length = math.hypot(s.end[0] - s.start[0], s.end[1] - s.start[1])
            return ((s.end[0] - s.start[0]) / length, (s.end[1] - s.start[1]) / length) if length else (1.0, 0.0)
        x, y = _point_on_segment(s, share)
        side = math.copysign(1.0, s.bulge)
        return (-(y - s.center[1]) / s.radius * side, (x - s.center[0]) / s.radius * side)

    def piece(self, start: float, end: float) -> Polyline:
        """Return the open polyline between two distances from the start, mm, where `start` ≤ `end`.

        In a closed polyline, `end` may exceed the length. The piece then continues past the start for up to one more
        round.
        """
        if not self.closed:
            start, end = max(start, 0.0), min(end, self.length)
        elif self.length > 0.0:
            laps = math.floor(start / self.length)
            start, end = start - laps * self.length, end - laps * self.length
        rows: list[tuple[float, float, float]] = []
        last = self.point_at(start)
        travelled = 0.0
        for _ in range(3 if self.closed else 1):
            for s, length in zip(self._segments, self._distances[1], strict=True):
                low, high = max(start - travelled, 0.0), min(end - travelled, length)
                if length > 0.0 and high > low:
                    share = (high - low) / length
                    bulge = math.tan(share * math.atan(s.bulge)) if share < 1.0 else s.bulge
                    rows.append((*_point_on_segment(s, low / length), bulge))
                    last = _point_on_segment(s, high / length)
                travelled += length
            if travelled >= end:
                break
        return Polyline(np.array([*rows, (*last, 0.0)]), closed=False)


def concatenate(*pieces: Polyline) -> Polyline:
    """Concatenate open polylines. Each polyline must start where the previous polyline ends."""
    rows = [p.vertices[:-1] for p in pieces if p.n_segments]
    ends = [p for p in pieces if p.n_segments]
    if not ends:
        return pieces[0]
    last = np.array([[*ends[-1].end, 0.0]])
    return Polyline(np.concatenate([*rows, last]), closed=False)


def _segment(ends: Sequence[float], bulge: float) -> Segment:
    x0, y0, x1, y1 = ends
    if bulge == 0.0:
        return Segment((x0, y0), (x1, y1), 0.0, (math.nan, math.nan), math.nan)
    # The centre lies on the chord's bisector, to the left of the chord by (1 − b²)/4b of its length.
    off = (1.0 - bulge * bulge) / (4.0 * bulge)
    center = (0.5 * (x0 + x1) - off * (y1 - y0), 0.5 * (y0 + y1) + off * (x1 - x0))
    return Segment((x0, y0), (x1, y1), bulge, center, math.hypot(x0 - center[0], y0 - center[1]))


def _point_on_segment(s: Segment, share: float) -> tuple[float, float]:
    if share <= 0.0:
        return s.start
    if share >= 1.0:
        return s.end
    if not s.is_arc:
        return (s.start[0] + share * (s.end[0] - s.start[0]), s.start[1] + share * (s.end[1] - s.start[1]))
    angle = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0]) + share * 4.0 * math.atan(s.bulge)
    return (s.center[0] + s.radius * math.cos(angle), s.center[1] + s.radius * math.sin(angle))


#: Maximum number of chords per arc. The limit prevents a tiny tolerance from exhausting the memory.
MAX_CHORDS = 2000


def _arc_chord_points(s: Segment, tolerance: float) -> Points:
    """Return the end points of the chords of an arc, float64[k, 2].

    The chord error, r·(1 − cos(step/2)), is at most `tolerance`.
    """
    turn = 4.0 * math.atan(s.bulge)
    step = 2.0 * math.acos(max(1.0 - tolerance / s.radius, 0.0)) if s.radius > 0.0 else math.pi
    count = min(max(math.ceil(abs(turn) / max(step, 1e-6)), 1), MAX_CHORDS)
    start = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0])
    angles = start + turn * np.arange(1, count + 1) / count
    points = np.column_stack([s.center[0] + s.radius * np.cos(angles), s.center[1] + s.radius * np.sin(angles)])
    points[-1] = s.end
    return points
