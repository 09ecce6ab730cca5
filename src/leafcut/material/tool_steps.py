"""Sample the path of a tool through a pocket in small steps, in order to measure its engagement and step-over and to
draw it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Point, Points
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketRules

#: Maximum length of a step as a share of the tool diameter.
STEP = 0.05
#: Maximum angle of a step along an arc, rad. The chord error is then one eight-hundredth of the radius.
BEND = 0.1
#: Maximum change of direction between chords of a curve, rad.
STRAIGHT_ON = math.radians(4.0)


@dataclass(frozen=True, eq=False)
class ToolSteps:
    """Points along the feed moves of a path, in cutting order.

    There is a point at the end of each step, and at the start of each section after a plunge. A corner has two points,
    so that both directions are evaluated.

    Attributes
    ----------
    xy
        Position, float64[n, 2], mm.
    back, ahead
        Unit tangents of the incoming and the outgoing path, float64[n, 2]. They differ only at corners. Between chords
        of a curve, both are the mean direction. `back` is NaN after a plunge.
    chord
        Unit vector of the step that ends at the point, float64[n, 2]. If the step has length 0, this is the direction
        of the outgoing path.
    step
        Length of the step that ends at the point, float64[n], mm. It is 0 after a plunge and at the outgoing point of a
        corner.
    run
        Number of the run, int64[n]. A run is a series of feed moves without a retract.
    piece
        Number of the section of the path, int64[n].
    """

    xy: Points
    back: Points
    ahead: Points
    chord: Points
    step: Floats
    run: NDArray[np.int64]
    piece: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.xy)


def max_step_length(rules: PocketRules) -> float:
    """Return the length of a step, mm, which is at most `STEP` diameters.

    Discs that are one step apart leave cusps between them. The height of these cusps, step²/8r, is at most half the
    tolerance.
    """
    return min(STEP * rules.tool_diameter, math.sqrt(4.0 * rules.radius * rules.tolerance))


def steps_along_path(path: PocketPath, rules: PocketRules) -> ToolSteps:
    """Sample the path of the tool in steps. All points and tangents on arcs are exact."""
    steps, parts, run, last = max_step_length(rules), [], -1, None
    for number, piece in enumerate(path.pieces):
        starts_run = last is None or math.dist(last[0], piece.path.start) > SAME_PLACE
        run += starts_run
        parts.append(
            _divide_section(
                _Chords.of(piece.path, steps),
                steps,
                None if starts_run or last is None else last[1],
                run,
                number,
                piece.path.start,
            )
        )
        last = (piece.path.end, parts[-1].back[-1])
    if not parts:
        empty = np.zeros((0, 2))
        return ToolSteps(empty, empty, empty, empty, np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
    columns = ("xy", "back", "ahead", "chord", "step", "run", "piece")
    return ToolSteps(*(np.concatenate([getattr(part, name) for part in parts]) for name in columns))


@dataclass(frozen=True, eq=False)
class _Chords:
    """Chords of a section, with start points, vectors, and tangents at both ends, float64[m, 2] each."""

    start: Points
    vector: Points
    leaves: Points
    arrives: Points

    @classmethod
    def of(cls, path: Polyline, max_step: float) -> _Chords:
        """Return the chords of a path. Arcs are divided into steps, and lines are not divided."""
        if not path.bulges.any():
            points = path.flattened()
            vector = np.diff(points, axis=0)
            has_length = (vector != 0.0).any(axis=1)
            start, vector = points[:-1][has_length], vector[has_length]
            unit = vector / np.hypot(vector[:, 0], vector[:, 1])[:, None]
            return cls(start, vector, unit, unit)
        parts = [_arc_chords(s, max_step) if s.is_arc else _line_chords(s) for s in path.segments()]
        parts = [part for part in parts if len(part.start)]
        return cls(*(np.concatenate([getattr(p, name) for p in parts]) for name in vars(parts[0])))


def _line_chords(segment: Segment) -> _Chords:
    return _Chords.of(Polyline.of_points([segment.start, segment.end]), math.inf)


def _arc_chords(s: Segment, max_step: float) -> _Chords:
    turn = 4.0 * math.atan(s.bulge)
    count = max(math.ceil(abs(turn) * s.radius / max_step), math.ceil(abs(turn) / BEND), 1)
    angle = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0]) + turn * np.linspace(0.0, 1.0, count + 1)
    out = np.column_stack([np.cos(angle), np.sin(angle)])
    points, side = np.array(s.center) + s.radius * out, math.copysign(1.0, s.bulge)
    points[0], points[-1] = s.start, s.end
    tangent = side * np.column_stack([-out[:, 1], out[:, 0]])
    return _Chords(points[:-1], np.diff(points, axis=0), tangent[:-1], tangent[1:])


def _divide_section(
    line: _Chords, max_step: float, arrival: Floats | None, run: int, piece: int, start: Point
) -> ToolSteps:
    """Divide a section of a path into steps.

    `arrival` is the direction in which the tool arrives, or None after a plunge.
    """
    length = np.hypot(line.vector[:, 0], line.vector[:, 1])
    before = np.full((1, 2), np.nan) if arrival is None else arrival[None]
    if not len(length):
        direction = np.array([[1.0, 0.0]])
        return ToolSteps(
            np.array([start]), before, direction, direction, np.zeros(1), np.array([run]), np.array([piece])
        )
    unit = line.vector / length[:, None]
    arrives = np.concatenate([before, line.arrives[:-1]])
    is_corner = ~((arrives * line.leaves).sum(axis=1) >= math.cos(STRAIGHT_ON))  # also true after a plunge
    count = np.maximum(np.ceil(length / max_step - 1e-9).astype(np.int64), 1)
    rows = np.repeat(np.arange(len(length)), count + is_corner)
    first = np.cumsum(count + is_corner) - (count + is_corner)
    share = (np.arange(len(rows)) - first[rows] + np.where(is_corner, 0, 1)[rows]) / count[rows]
    at_corner, at_end = share == 0.0, share == 1.0
    smooth = np.append(~is_corner[1:], False)
    tangent = line.arrives + np.where(smooth[:, None], np.append(line.leaves[1:], unit[-1:], axis=0), line.arrives)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    along = np.where(at_end[:, None], tangent[rows], np.where(at_corner[:, None], line.leaves[rows], unit[rows]))
    return ToolSteps(
        xy=line.start[rows] + share[:, None] * line.vector[rows],
        back=np.where(at_corner[:, None], arrives[rows], along),
        ahead=along,
        chord=unit[rows],
        step=np.where(at_corner, 0.0, (length / count)[rows]),
        run=np.full(len(rows), run),
        piece=np.full(len(rows), piece),
    )
