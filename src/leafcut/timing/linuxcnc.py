"""Model how LinuxCNC 2.9 plans corners and arcs.

The formulas come from the documentation (G61, G61.1, G64; [TRAJ]ARC_BLEND_* in the INI reference) and from the source
code (emc/tp/tp.c, blendmath.c, tc.c of the 2.9 branch). We checked them against the simulated machine (`python -m
benchmarks machine_time`).

Suppose the path bends from unit vector u to unit vector w at speed v. Within one servo cycle, the axes must then
accelerate by (w - u) v / cycle. If every axis needs at most the kink ratio (0.1) of its acceleration, LinuxCNC treats
the bend as tangent: the tool passes it at full speed, and both adjacent moves reserve that fraction of their
acceleration. At a sharper bend, the same limit determines the maximum speed.

Under G64, LinuxCNC considers two more options. It can round the corner with an arc within the tolerance. It can also
start the next move while the previous move is still decelerating; each move then gets half the acceleration. LinuxCNC
uses the fastest of the three options. The machine stops between a rapid and a feed move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.machine import Machine
from leafcut.timing.moves import BLEND, REST, Corners, Moves

#: Servo period in seconds ([EMCMOT]SERVO_PERIOD). Nearly all configurations use this value.
CYCLE = 0.001

#: Shortest possible duration of a move in seconds (TP_MIN_SEGMENT_CYCLES cycles).
SHORTEST = 1.02 * CYCLE

#: The planner looks this many moves ahead ([TRAJ]ARC_BLEND_OPTIMIZATION_DEPTH).
DEPTH = 50

#: If the part of a move before a corner arc would take fewer servo cycles than this, LinuxCNC merges it into the arc
#: ([TRAJ]ARC_BLEND_GAP_CYCLES).
GAP_CYCLES = 4

#: Largest fractions of the acceleration that are available normal and tangential to an arc. Their squares add up to 1.
NORMAL, TANGENTIAL = np.sqrt(3.0) / 2.0, 0.5

#: A corner arc deviates from the path by at most this fraction of the shorter move, even if G64 allows more.
_DEVIATION_SHARE = 0.25

#: A corner that turns by more than 178 degrees counts as a reversal. This is the cosine of that angle.
_REVERSAL = np.cos(np.radians(178.0))

_TINY = 1e-6


def blend_corners(before: Moves, after: Moves, machine: Machine) -> Corners:
    """Compute the corner between each move in `before` and the corresponding move in `after`."""
    bounds = np.asarray(machine.acceleration)
    kink = 1.0 - machine.acceleration_factor
    cosine = (before.end * after.start).sum(axis=1)
    joined = ~before.flushed & (before.mode != REST) & (before.rapid == after.rapid) & (cosine > _REVERSAL)
    slower = np.minimum(before.velocity, after.velocity)
    bend = (np.abs(after.start - before.end) / bounds).max(axis=1) * (slower / CYCLE + after.acceleration)
    bend /= np.where((before.turn.radius > 0) | (after.turn.radius > 0), TANGENTIAL, 1.0)
    tangent = joined & (bend <= kink + _TINY)
    corner_speed = np.where(tangent, slower, slower * kink / bend)
    held_back = np.where(joined, np.minimum(bend, kink), 0.0)

    rounded = joined & ~tangent & (before.mode == BLEND)
    corner = _fit_corner_arcs(before, after, machine, cosine)
    speed = np.where(tangent | rounded, corner_speed, 0.0)
    overlap = np.sin(corner.half_angle) * _overlap_speed(before, after, corner.half_angle, kink) / 2.0
    with_arc = rounded & (corner.speed > np.maximum(speed, overlap))
    overlapped = rounded & ~with_arc & (overlap >= speed)
    unlimited = with_arc | overlapped
    return Corners(
        speed=np.where(with_arc, np.inf, np.where(overlapped, 0.0, speed)),
        arc_length=np.where(with_arc, corner.length, 0.0),
        arc_speed=np.where(with_arc, corner.speed, 0.0),
        arc_acceleration=np.where(with_arc, TANGENTIAL * corner.acceleration, 0.0),
        trim=np.where(with_arc, corner.trim, 0.0),
        held_back=np.where(unlimited, 0.0, held_back),
        # The planner halves the acceleration of a move that may overlap with the next one, even if there is no next
        # move.
        overlapped=overlapped | (before.flushed & (before.mode == BLEND)),
    )


class _CornerArc(NamedTuple):
    half_angle: Floats
    length: Floats
    speed: Floats
    acceleration: Floats
    trim: Floats


def _fit_corner_arcs(before: Moves, after: Moves, machine: Machine, cosine: Floats) -> _CornerArc:
    """Fit a blend arc into each corner. The speed is 0 where no arc fits."""
    half_angle = 0.5 * np.arccos(np.clip(-cosine, -1.0, 1.0))
    angle, reach = _room_for_corner_arcs(before, after, half_angle)
    turn = np.pi - 2.0 * angle
    acceleration = _longest_vector_in_corner_plane(before, after, np.asarray(machine.acceleration))
    whole = np.minimum(before.length, after.length)
    tolerance = np.where(before.tolerance > 0, before.tolerance, np.inf)
    tolerance = np.minimum(tolerance, _DEVIATION_SHARE * whole)
    reach = np.minimum(reach, np.cos(angle) * tolerance / (1.0 - np.sin(angle)))
    widest = np.tan(angle) * reach
    speed = np.minimum(np.sqrt(NORMAL * acceleration * widest), _requested_arc_speed(before, after, machine, turn))
    # The arc is at least as wide as the speed requires, and as an overlap of both moves would be.
    half = 0.5 * acceleration
    overlap_s = np.minimum(np.sqrt(2.0 * half * reach), speed) / half
    radius = np.maximum(speed * speed / (NORMAL * acceleration), np.minimum(overlap_s * speed / turn, widest))
    trim = radius / np.tan(angle)
    length = radius * turn
    fits = (length > _TINY) & (angle > _TINY) & (turn > _TINY) & _coplanar_corners(before, after)
    return _CornerArc(half_angle, *(np.where(fits, v, 0.0) for v in (length, speed, acceleration, trim)))


def _room_for_corner_arcs(before: Moves, after: Moves, half_angle: Floats) -> tuple[Floats, Floats]:
    """Determine how much room each corner has for a blend arc.

    A blend arc may use half of an adjacent straight move. If the adjacent move is itself an arc, the blend may use two
    thirds of its sweep before the corner, or one third after the corner. An arc that turns in the same direction as the
    corner is replaced by its chord, which makes the corner angle smaller.

    Returns
    -------
    tuple[Floats, Floats]
        Half of each corner angle in rad, and the length in mm of the adjacent moves that the blend arc may use.
    """
    angle, reach = half_angle, np.full(len(half_angle), np.inf)
    for move, share, inwards in (
        (before, 2.0 / 3.0, -(after.start * before.turn.out_end).sum(axis=1)),
        (after, 1.0 / 3.0, (before.end * after.turn.out).sum(axis=1)),
    ):
        convex = inwards > 0
        sweep = np.minimum(share * move.turn.sweep, np.where(convex, half_angle, 0.5 * np.pi))
        on_arc = move.turn.radius * np.where(convex, np.sin(0.25 * sweep), sweep)
        is_arc = move.turn.radius > 0
        reach = np.minimum(reach, np.where(is_arc, on_arc, 0.5 * move.length))
        angle = np.where(is_arc & convex, np.minimum(angle, half_angle - 0.25 * sweep), angle)
    return angle, reach


def _coplanar_corners(before: Moves, after: Moves) -> Mask:
    """Mark the corners that lie in the planes of their adjacent arcs. Other corners get no blend arc."""
    across = np.cross(before.end, after.start)
    size = np.sqrt((across * across).sum(axis=1))
    flat = np.ones(len(before), dtype=np.bool_)
    for move in (before, after):
        aligned = np.abs((across * move.turn.normal).sum(axis=1)) >= (1.0 - _TINY) * size
        flat &= aligned | (move.turn.radius == 0)
    return flat


def _longest_vector_in_corner_plane(before: Moves, after: Moves, bounds: Floats) -> Floats:
    across = np.cross(before.end, after.start)
    size2 = (across * across).sum(axis=1)
    share = np.sqrt(np.maximum(1.0 - across * across / np.where(size2 > 0, size2, 1.0)[:, None], 0.0))
    longest: Floats = np.min(bounds / share, axis=1)
    return longest


def _requested_arc_speed(before: Moves, after: Moves, machine: Machine, turn: Floats) -> Floats:
    """Return the requested speed on each blend arc, capped at a speed that the axes can sustain on the whole arc."""
    requested = np.maximum(before.velocity, after.velocity)
    allowed = _longest_vector_in_corner_plane(before, after, np.asarray(machine.rapid_velocity))
    # Between two straight moves, the velocity vector moves along one side of a triangle. A speed equal to the height of
    # the triangle is therefore allowed too.
    steepest = np.cos(np.minimum(turn, 0.49 * np.pi))
    first = np.minimum(before.limit, after.limit / steepest)
    second = np.minimum(after.limit, before.limit / steepest)
    base = after.start * second[:, None] - before.end * first[:, None]
    height = first * second * np.sin(turn) / np.sqrt((base * base).sum(axis=1))
    straight = (before.turn.radius == 0) & (after.turn.radius == 0)
    return np.minimum(requested, np.where(straight, np.fmax(height, allowed), allowed))


def _overlap_speed(before: Moves, after: Moves, half_angle: Floats, kink: float) -> Floats:
    half = [m.acceleration * (1.0 - kink) * 0.5 * np.where(m.turn.radius > 0, TANGENTIAL, 1.0) for m in (before, after)]
    first, second = overlap_speeds(before, after, (half[0], half[1]), half_angle, shortened=0.5)
    return (first + second) / 2.0


def overlap_speeds(
    before: Moves, after: Moves, half: tuple[Floats, Floats], half_angle: Floats, shortened: float = 1.0
) -> tuple[Floats, Floats]:
    """Compute the speeds of two overlapping moves.

    Parameters
    ----------
    half
        Accelerations of both moves during the overlap, mm/s².
    shortened
        Fraction of each move's length that remains in any case.

    Returns
    -------
    tuple[Floats, Floats]
        Speed of the first move when the second move starts, and speed of the second move when the first move ends, both
        in mm/s.
    """
    moves = (before, after)
    reached = [np.minimum(np.sqrt(a * shortened * m.length), m.velocity) for m, a in zip(moves, half, strict=True)]
    longest = np.minimum(*(m.length / v for m, v in zip(moves, reached, strict=True)))
    overlap_s = np.minimum(longest, np.maximum(*(v / a for v, a in zip(reached, half, strict=True))))
    within = 2.0 * np.sqrt(half[0] * before.tolerance / np.cos(half_angle))
    within = np.where((before.tolerance > 0) & (np.cos(half_angle) > _TINY), within, np.inf)
    first, second = (np.minimum(np.minimum(v, overlap_s * a), within) for v, a in zip(reached, half, strict=True))
    return first, second


def velocity_and_acceleration_limits(moves: Moves, acceleration: Floats) -> tuple[Floats, Floats]:
    """Return the velocity limit (mm/s) and the acceleration limit (mm/s²) along each move.

    On an arc, the move shares the acceleration between two directions: at most `NORMAL` across the path and
    `TANGENTIAL` along it. If the arc needs less normal acceleration, more tangential acceleration is available.
    """
    radius = moves.turn.radius
    is_arc = radius > 0
    # The planner uses r + h²/r as the radius of a helix, where h is the total rise, not the rise per radian.
    curvature = radius / (radius * radius + moves.turn.rise * moves.turn.rise + ~is_arc)
    inwards = moves.limit * moves.limit * curvature / acceleration
    tight = inwards > NORMAL
    limit = np.where(tight, np.sqrt(NORMAL * acceleration / curvature), moves.limit)
    share = np.where(tight, TANGENTIAL, np.sqrt(1.0 - np.minimum(inwards, NORMAL) ** 2))
    return limit, acceleration * np.where(is_arc, share, 1.0)
