"""Junctions of moves: the speed through a corner, and the controller's motion there; and the corners of controllers
that only slow down (``round``: junction deviation of feed moves under G64, rapids end in position).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.machine import Machine
from leafcut.timing.moves import BLEND, Moves

#: Cosine limit of a straight continuation, or negative: of a reversal. Source: gnea/grbl 1.1, planner.c.
_STRAIGHT = 0.999999


class Corners(NamedTuple):
    """The junction after every move; the machine is at rest after the last move.

    speed
        Maximum junction speed, mm/s; 0 = rest. Where an arc rounds the corner, the arc's speed is the limit.
    arc_length, arc_speed, arc_acceleration
        The arc fitted into the corner, mm, mm/s, mm/s²; length 0: none.
    trim
        Length that the arc removes from both neighbours, mm.
    held_back
        Share of the acceleration that both neighbours reserve for the bend.
    overlapped
        The next move starts while this one decelerates, each with half the acceleration.
    """

    speed: Floats
    arc_length: Floats
    arc_speed: Floats
    arc_acceleration: Floats
    trim: Floats
    held_back: Floats
    overlapped: Mask


def plain_corners(speed: Floats) -> Corners:
    """Return corners with a speed limit only."""
    zeros = np.zeros(len(speed))
    return Corners(speed, zeros, zeros, zeros, zeros, zeros, np.zeros(len(speed), dtype=np.bool_))


def deviation_corners(before: Moves, after: Moves, machine: Machine) -> Corners:
    """Return the corners of a controller that uses the junction deviation: the circle that touches both moves and
    stays within δ of the corner allows v² = a δ s / (1 - s), where s is the sine of half the angle between them.
    Source: S. K. Jeon, "Improving Grbl: cornering algorithm" (2011).
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
    return plain_corners(np.where(joined, speed, 0.0))
