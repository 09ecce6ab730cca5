"""Corners between moves: the maximum speed and the motion of the controller at each corner.

This module has the corners of controllers that only slow down (style ``round``): junction deviation between feed moves
under G64, while rapids stop. `timing.linuxcnc` has the corners of LinuxCNC.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.machine import Machine
from leafcut.timing.moves import BLEND, Moves

#: Cosine of the largest turn that counts as straight; its negative limits reversals. Source: gnea/grbl 1.1, planner.c.
_STRAIGHT = 0.999999


class Corners(NamedTuple):
    """The corner after every move; the machine is at rest after the last move.

    Attributes
    ----------
    speed
        Maximum speed at the corner, mm/s: 0 for a stop, infinite if an arc rounds the corner and limits the speed.
    arc_length, arc_speed, arc_acceleration
        Length, mm, maximum speed, mm/s, and acceleration, mm/s², of the arc in the corner; length 0 for no arc.
    trim
        Length that the arc removes from both adjacent moves, mm.
    held_back
        Share of the acceleration that both adjacent moves reserve for the bend.
    overlapped
        Whether the next move starts while this move decelerates, each with half the acceleration.
    """

    speed: Floats
    arc_length: Floats
    arc_speed: Floats
    arc_acceleration: Floats
    trim: Floats
    held_back: Floats
    overlapped: Mask


def corners_without_arcs(speed: Floats) -> Corners:
    """Return corners with speed limits, but without arcs and overlaps."""
    zeros = np.zeros(len(speed))
    return Corners(speed, zeros, zeros, zeros, zeros, zeros, np.zeros(len(speed), dtype=np.bool_))


def deviation_corners(before: Moves, after: Moves, machine: Machine) -> Corners:
    """Return the corners of a controller that uses the junction deviation δ.

    The circle that touches both moves and stays within δ of the corner allows v² = a δ s / (1 - s), where s is the sine
    of half the angle between the moves. Source: S. K. Jeon, "Improving Grbl: cornering algorithm" (2011).
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
