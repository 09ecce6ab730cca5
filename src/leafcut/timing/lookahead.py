"""Compute move times with look-ahead.

Every corner has a maximum speed. For controllers that merely slow down at corners (style ``round``), the junction
deviation determines this speed. For LinuxCNC, the corner model in `timing.linuxcnc` does. A backward pass lowers the
speed at each corner until the tool can still slow down for the moves within the look-ahead. A forward pass lowers it to
a speed that the tool can actually reach. Between two corners, the velocity profile is a trapezoid.

Both passes are running minima. Let S be the cumulative sum of 2 a d up to each corner. Because v² ≤ w² + 2 a d between
corners, v² + S is the minimum of w² + S over the following corners, and v² - S is the minimum of w² - S over the
preceding corners.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.machine import Machine
from leafcut.timing.linuxcnc import (
    CYCLE,
    DEPTH,
    GAP_CYCLES,
    SHORTEST,
    blend_corners,
    overlap_speeds,
    velocity_and_acceleration_limits,
)
from leafcut.timing.moves import BLEND, Corners, Moves, corners_without_arcs

#: Look-ahead, in moves, for controllers that do not specify a value. It is so large that it never limits a speed.
_FAR = 500

#: Cosine of the largest turn that still counts as straight. Its negative is the limit for reversals. Source: gnea/grbl
#: 1.1, planner.c.
_STRAIGHT = 0.999999

#: Process this many corners at a time so that intermediate arrays fit in the processor's cache.
_BLOCK = 1 << 13


class MotionSegments(NamedTuple):
    """Moves and corner arcs in the order in which the tool runs them, in mm, mm/s, and mm/s².

    `join` is the speed limit at the end of each segment. `move` is the index of the move that the segment belongs to.
    """

    length: Floats
    velocity: Floats
    acceleration: Floats
    join: Floats
    move: NDArray[np.int64]


def move_seconds(moves: Moves, machine: Machine, style: str) -> Floats:
    """Compute the duration of each move in seconds for the corner styles linuxcnc and round.

    A move's duration includes the arc in the corner after it.
    """
    if not len(moves):
        return np.zeros(0)
    # Straight moves have radius 0 and reversals have width 0; the results of these divisions are discarded.
    with np.errstate(divide="ignore", invalid="ignore"):
        return _seconds_by_style(moves, machine, style)


def _seconds_by_style(moves: Moves, machine: Machine, style: str) -> Floats:
    corners = _corners_in_blocks(moves, machine, style)
    if style == "linuxcnc":
        return _linuxcnc_seconds(moves, corners)
    acceleration = moves.acceleration * machine.acceleration_factor
    velocity = np.minimum(moves.velocity, arc_speed_limits(moves, acceleration))
    pieces = MotionSegments(moves.length, velocity, acceleration, corners.speed, np.arange(len(moves)))
    return segment_move_seconds(pieces, _FAR)


def arc_speed_limits(moves: Moves, acceleration: Floats) -> Floats:
    """Return the speed in mm/s at which each arc reaches its normal acceleration limit. Infinite for straight moves."""
    radius = moves.turn.radius
    return np.where(radius > 0, np.sqrt(acceleration * radius), np.inf)


def _corners_in_blocks(moves: Moves, machine: Machine, style: str) -> Corners:
    """Compute the corners after all moves, one block at a time.

    The last move serves as its own successor. This is harmless because the last move ends at rest.
    """
    blocks = []
    for first in range(0, len(moves), _BLOCK):
        before, after = moves[first : first + _BLOCK], moves[first + 1 : first + 1 + _BLOCK]
        if len(after) < len(before):
            after = moves[np.minimum(np.arange(first + 1, first + 1 + len(before)), len(moves) - 1)]
        if style == "linuxcnc":
            blocks.append(blend_corners(before, after, machine))
        else:
            blocks.append(junction_deviation_corners(before, after, machine))
    return Corners(*(np.concatenate(column) for column in zip(*blocks, strict=True)))


def junction_deviation_corners(before: Moves, after: Moves, machine: Machine) -> Corners:
    """Compute the corners for a controller that uses the junction deviation δ.

    The deviation applies between feed moves under G64. The machine stops before and after rapids.

    Take the circle that touches both moves and stays within δ of the corner. It allows the speed v² = a δ s / (1 - s),
    where s is the sine of half the angle between the moves. Source: S. K. Jeon, "Improving Grbl: cornering algorithm"
    (2011).
    """
    cosine = -(before.end * after.start).sum(axis=1)
    sine = np.sqrt(0.5 * (1.0 - np.clip(cosine, -1.0, 1.0)))
    bend = np.abs(after.start - before.end)
    size = np.sqrt((bend * bend).sum(axis=1))
    allowed = np.asarray(machine.acceleration) * machine.acceleration_factor
    acceleration = np.where(size > 0, size / (bend / allowed).max(axis=1), 0.0)
    speed = np.sqrt(acceleration * machine.corner_deviation * sine / (1.0 - sine))
    speed = np.where(cosine < -_STRAIGHT, np.inf, np.where(cosine > _STRAIGHT, 0.0, speed))
    joined = ~before.flushed & (before.mode == BLEND) & ~before.rapid & ~after.rapid
    return corners_without_arcs(np.where(joined, speed, 0.0))


def _linuxcnc_seconds(moves: Moves, corners: Corners) -> Floats:
    held_back = np.maximum(corners.held_back, np.append(0.0, corners.held_back[:-1]))
    follows = corners.overlapped & ~moves.flushed
    halved = corners.overlapped | np.append(False, follows[:-1])
    limit, acceleration = velocity_and_acceleration_limits(
        moves, moves.acceleration * (1.0 - held_back) * np.where(halved, 0.5, 1.0)
    )
    velocity = np.minimum(moves.velocity, limit)
    length = moves.length - corners.trim - np.append(0.0, corners.trim[:-1])
    with_arc = corners.arc_length > 0
    # If the remainder of a move before the arc of a corner is too short, it is merged into the arc.
    merged = with_arc & (length < GAP_CYCLES * CYCLE * corners.arc_speed)
    arc_length = corners.arc_length + np.where(merged, np.maximum(length, 0.0), 0.0)
    m = len(moves)
    # The remainder of a move takes slightly more than a cycle, and so does every arc.
    arc_speed = np.minimum(corners.arc_speed, arc_length / SHORTEST)
    velocity = np.where(length > 0.0, np.minimum(velocity, length / SHORTEST), velocity)
    arcs = (arc_length, arc_speed, corners.arc_acceleration, np.full(m, np.inf), np.arange(m))
    pieces = (length, velocity, acceleration, corners.speed, np.arange(m))
    columns = [np.column_stack([piece, arc]).ravel() for piece, arc in zip(pieces, arcs, strict=True)]
    exists = np.column_stack([~merged, with_arc]).ravel()
    seconds = segment_move_seconds(MotionSegments(*(column[exists] for column in columns)), DEPTH, m)
    # The planner detects the end of a move only in the following cycle, on average half a cycle late.
    seconds += np.where((corners.speed == 0) & ~follows, 0.5 * CYCLE, 0.0)
    if follows.any():
        seconds -= _seconds_saved_by_overlap(moves, follows, velocity, acceleration)
    return seconds


def _seconds_saved_by_overlap(
    moves: Moves, follows: NDArray[np.bool_], velocity: Floats, acceleration: Floats
) -> Floats:
    saved = np.zeros(len(moves))
    followed = np.flatnonzero(follows)
    before, after = (replace(moves[rows], velocity=velocity[rows]) for rows in (followed, followed + 1))
    half_angle = 0.5 * np.arccos(np.clip(-(before.end * after.start).sum(axis=1), -1.0, 1.0))
    overlap_speed, _ = overlap_speeds(before, after, (acceleration[followed], acceleration[followed + 1]), half_angle)
    saved[followed] = overlap_speed / acceleration[followed]
    return saved


def segment_move_seconds(pieces: MotionSegments, depth: int, n_moves: int | None = None) -> Floats:
    """Compute the duration of each move in seconds from its motion segments, looking `depth` segments ahead."""
    length, velocity, acceleration = np.maximum(pieces.length, 0.0), pieces.velocity, pieces.acceleration
    limit = np.minimum(pieces.join, velocity)
    limit[:-1] = np.minimum(limit[:-1], velocity[1:])
    limit[-1] = 0.0
    gain = 2.0 * acceleration * length
    total_gain = np.cumsum(gain)
    backward_limit = np.minimum(
        _sliding_minimum(limit * limit + total_gain, depth),
        total_gain[np.minimum(np.arange(len(total_gain)) + depth, len(total_gain) - 1)],
    )
    backward_square = backward_limit - total_gain
    forward_limit = np.minimum(np.minimum.accumulate(backward_square - total_gain), 0.0) + total_gain
    end = np.sqrt(np.maximum(np.minimum(forward_limit, limit * limit), 0.0))
    start = np.append(0.0, end[:-1])
    peak = np.minimum(np.sqrt(0.5 * (gain + start * start + end * end)), velocity)
    peak = np.maximum(peak, np.maximum(start, end))
    ramps = (2.0 * peak - start - end) / acceleration
    ramped = (2.0 * peak * peak - start * start - end * end) / (2.0 * acceleration)
    cruise = np.maximum(length - ramped, 0.0) / np.where(peak > 0, peak, 1.0)
    seconds: Floats = np.bincount(pieces.move, weights=ramps + cruise, minlength=n_moves or len(length)).astype(float)
    return seconds


def _sliding_minimum(value: Floats, depth: int) -> Floats:
    """Return the minimum of each value and the `depth` values after it.

    The algorithm splits the values into blocks of the same size as the window, so each window covers the end of one
    block and the start of the next. Source: M. van Herk, Pattern Recognition Letters 13 (1992); J. Gil and M. Werman,
    IEEE PAMI 15 (1993).
    """
    window = depth + 1
    padded = np.full((-(-len(value) // window) + 1) * window, np.inf)
    padded[: len(value)] = value
    blocks = padded.reshape(-1, window)
    to_end = np.minimum.accumulate(blocks[:, ::-1], axis=1)[:, ::-1].ravel()
    from_begin = np.minimum.accumulate(blocks, axis=1).ravel()
    return np.minimum(to_end[: len(value)], from_begin[depth : depth + len(value)])
