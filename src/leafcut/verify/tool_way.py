"""The way of a tool over a pocket in small steps: what engagement, step-over and pictures are measured on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import FINE
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketRules

Floats = NDArray[np.float64]

#: A step is at most this share of the tool's diameter.
STEP = 0.05
#: A change of direction below this is a chord of a curve, rad.
STRAIGHT_ON = math.radians(2.0)


@dataclass(frozen=True, eq=False)
class ToolWay:
    """Places along the feed of a path, in the order of cutting.

    There is a place at the end of every step, one where every piece begins that the tool is let down to, and one more
    at every corner, so that both directions are looked at there.

    Attributes
    ----------
    xy
        float64[n, 2], mm.
    back, ahead
        Unit tangents of the way that leads here and of the way on, float64[n, 2]; `back` is NaN where the tool was let
        down. They differ at corners only; between the chords of a curve both lie half way between them.
    chord
        Unit vector of the step that ends here, or of the way on where that has no length, float64[n, 2].
    step
        Length of the step that ends here, mm, float64[n]; 0 where the tool was let down and for the way on at corners.
    run
        int64[n]: number of the run, feed without a lift.
    piece
        int64[n]: number of the piece.
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


def step_of(rules: PocketRules) -> float:
    """Return the length of a step, mm: `STEP` diameters at most.

    Discs one step apart leave cusps of step²/8r between them; they are at most half the tolerance high.
    """
    return min(STEP * rules.tool_diameter, math.sqrt(4.0 * rules.radius * rules.tolerance))


def way_of(path: PocketPath, rules: PocketRules) -> ToolWay:
    """Return the way of the tool in steps; arcs as chords that are true within an eighth of the tolerance."""
    steps, parts, run, last = step_of(rules), [], -1, None
    for number, piece in enumerate(path.pieces):
        points = piece.path.flattened(FINE * rules.tolerance)
        lifted = last is None or math.dist(last[0], piece.path.start) > SAME_PLACE
        run += lifted
        parts.append(_steps(points, steps, None if lifted or last is None else last[1], run, number))
        last = (piece.path.end, parts[-1].back[-1])
    if not parts:
        none = np.zeros((0, 2))
        return ToolWay(none, none, none, none, np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
    columns = ("xy", "back", "ahead", "chord", "step", "run", "piece")
    return ToolWay(*(np.concatenate([getattr(part, name) for part in parts]) for name in columns))


def _steps(points: Points, longest: float, came: Floats | None, run: int, piece: int) -> ToolWay:
    """Return the steps of one piece; `came` is the direction in which the tool arrives at it, None: from above."""
    vector = np.diff(points, axis=0)
    length = np.hypot(vector[:, 0], vector[:, 1])
    vector, length = vector[length > 0.0], length[length > 0.0]
    begin = points[0] + np.concatenate([np.zeros((1, 2)), np.cumsum(vector, axis=0)])[:-1]
    if not len(length):
        still = np.array([[1.0, 0.0]])
        back = np.full((1, 2), np.nan) if came is None else came[None]
        return ToolWay(points[:1], back, still, still, np.zeros(1), np.array([run]), np.array([piece]))
    unit = vector / length[:, None]
    arrives = np.concatenate([np.full((1, 2), np.nan) if came is None else came[None], unit[:-1]])
    turned = ~((arrives * unit).sum(axis=1) >= math.cos(STRAIGHT_ON))  # true, too, where the tool comes from above
    count = np.maximum(np.ceil(length / longest - 1e-9).astype(np.int64), 1)
    rows = np.repeat(np.arange(len(length)), count + turned)
    first = np.cumsum(count + turned) - (count + turned)
    share_of = (np.arange(len(rows)) - first[rows] + np.where(turned, 0, 1)[rows]) / count[rows]
    at_corner, at_end = share_of == 0.0, share_of == 1.0
    smooth = np.append(~turned[1:], False)
    tangent = unit + np.where(smooth[:, None], np.append(unit[1:], unit[-1:], axis=0), unit)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    along = np.where((at_end & ~at_corner)[:, None], tangent[rows], unit[rows])
    return ToolWay(
        xy=begin[rows] + share_of[:, None] * vector[rows],
        back=np.where(at_corner[:, None], arrives[rows], along),
        ahead=along,
        chord=unit[rows],
        step=np.where(at_corner, 0.0, (length / count)[rows]),
        run=np.full(len(rows), run),
        piece=np.full(len(rows), piece),
    )
