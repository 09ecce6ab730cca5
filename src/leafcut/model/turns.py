"""Store the arcs and helices of a toolpath as arrays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.toolpath import Kind, Toolpath

#: First, second and normal axis of the planes 17, 18 and 19. A counter-clockwise arc turns from the first to the second
#: axis.
AXES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])

#: Minimum length of a move, mm, for which its direction is meaningful. Shorter moves come from rounding.
SHORTEST = 1e-9

#: An arc is a full turn if its end is within this angle (rad) of its start (`model.toolpath.arc_radius_start_sweep`).
_NO_TURN = 1e-9


class Turn(NamedTuple):
    """The geometry of arcs and helices, with a row for each move. A straight move has zeros.

    Attributes
    ----------
    radius
        Radius, mm.
    sweep
        Sweep, rad, never negative.
    rise
        Height of a helix along its axis, mm.
    normal
        Normal of the plane. The turn is counter-clockwise about this normal.
    out, out_end
        Unit vectors from the centre to the start and to the end of the move.
    """

    radius: Floats
    sweep: Floats
    rise: Floats
    normal: Floats
    out: Floats
    out_end: Floats


class Turns(NamedTuple):
    """All arcs and helices of a path.

    Attributes
    ----------
    row
        Row of the path.
    length
        Length of the arc, mm; 0 if the start is unknown.
    plane
        0, 1 or 2 for G17, G18 or G19.
    centre
        Centre in the plane, float64[n, 2], mm.
    angle
        Angle of the start point, rad.
    end_radius
        Radius at the end, mm; controllers allow a small difference from the radius at the start.
    """

    row: NDArray[np.int64]
    length: Floats
    plane: NDArray[np.int64]
    centre: Floats
    angle: Floats
    end_radius: Floats
    turn: Turn

    @property
    def sweep(self) -> Floats:
        """Signed sweep of each arc, rad. It is positive for a counter-clockwise arc."""
        sweep: Floats = self.turn.sweep * self.turn.normal.sum(axis=1)
        return sweep


def arc_turns(path: Toolpath) -> Turns:
    """Return the arcs and helices of a path."""
    row = np.flatnonzero((path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW))
    n = len(row)
    arcs = [path.arcs[i] for i in path.ref[row].tolist()]
    plane = np.array([a.plane for a in arcs], dtype=np.int64).reshape(n) - 17
    centre = np.array([a.center for a in arcs], dtype=np.float64).reshape(n, 3)
    turns = np.array([a.turns for a in arcs], dtype=np.float64).reshape(n)
    axes = AXES[plane]
    side = np.where(path.kind[row] == Kind.ARC_CCW, 1.0, -1.0)
    start, end = path.before[row], path.end[row]
    flat0, flat1 = (np.take_along_axis(p - centre, axes[:, :2], axis=1) for p in (start, end))
    angle0, angle1 = (np.arctan2(flat[:, 1], flat[:, 0]) for flat in (flat0, flat1))
    sweep = (side * (angle1 - angle0)) % math.tau
    sweep = np.where(sweep < _NO_TURN, math.tau, sweep) + math.tau * (turns - 1)
    rise = np.nan_to_num(np.take_along_axis(end - start, axes[:, 2:], axis=1)[:, 0])
    radius = np.hypot(flat0[:, 0], flat0[:, 1])
    is_valid = radius * sweep > SHORTEST  # also false if the start is unknown
    normal, out, out_end = (np.zeros((n, 3)) for _ in range(3))
    np.put_along_axis(normal, axes[:, 2:], side[:, None], axis=1)
    for vector, angle in ((out, angle0), (out_end, angle0 + side * sweep)):
        np.put_along_axis(vector, axes[:, :2], np.column_stack([np.cos(angle), np.sin(angle)]), axis=1)
    turn = Turn(radius, sweep, rise, normal, out, out_end)
    length = np.where(is_valid, np.hypot(radius * sweep, rise), 0.0)
    flat_centre = np.take_along_axis(centre, axes, axis=1)
    return Turns(row, length, plane, flat_centre[:, :2], angle0, np.hypot(flat1[:, 0], flat1[:, 1]), turn)
