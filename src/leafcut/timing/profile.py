"""The time of a single move from rest to rest with constant acceleration.

Derivation. A move of length d with maximum velocity v and acceleration a needs v/a seconds and v²/2a millimetres to
reach v, and the same to stop. If d ≥ v²/a, the velocity is reached. The time is d/v for the whole length at v, plus v/a
because the mean velocity of the two ramps is v/2: t = d/v + v/a. Otherwise the move switches from acceleration to
deceleration half way: d/2 = a (t/2)²/2, hence t = 2 √(d/a). Both are equal at d = v²/a.

A straight move along a unit vector u keeps axis i within v_i and a_i if v = min v_i/|u_i| and a = min a_i/|u_i|.
With δ = d u, two numbers suffice: cruise = d/v = max |δ_i|/v_i and ramp = d/a = max |δ_i|/a_i, with
t = cruise + ramp/cruise if cruise² ≥ ramp, else 2 √ramp.

Moves start and end at rest here; `timing.lookahead` carries speed through corners.
"""

from __future__ import annotations

import math
from typing import overload

import numpy as np
from numpy.typing import NDArray

from leafcut.model.machine import Machine

Number = float | NDArray[np.float64]


@overload
def trapezoid_time(distance: float, velocity: float, acceleration: float) -> float: ...
@overload
def trapezoid_time(distance: NDArray[np.float64], velocity: Number, acceleration: Number) -> NDArray[np.float64]: ...
def trapezoid_time(distance: Number, velocity: Number, acceleration: Number) -> Number:
    """Return the seconds of a move of `distance` ≥ 0 mm from rest to rest, limited by `velocity` and `acceleration`.

    Numbers give a number; arrays broadcast against each other. mm, mm/s, mm/s².
    """
    cruise, ramp = distance / velocity, distance / acceleration
    if isinstance(cruise, float) and isinstance(ramp, float):
        return _times_of(cruise, ramp)
    return _times(np.asarray(cruise), np.asarray(ramp))


@overload
def move_time(delta: tuple[float, float, float], machine: Machine, feed: float | None = None) -> float: ...
@overload
def move_time(
    delta: NDArray[np.float64], machine: Machine, feed: float | NDArray[np.float64] | None = None
) -> NDArray[np.float64]: ...
def move_time(
    delta: tuple[float, float, float] | NDArray[np.float64],
    machine: Machine,
    feed: float | NDArray[np.float64] | None = None,
) -> float | NDArray[np.float64]:
    """Return the duration, s, of straight moves by `delta` (float64[..., 3], mm) from rest to rest.

    Without `feed`, the move is a rapid in the machine's style: ``linear`` moves keep every axis within its velocity and
    acceleration. On a ``dogleg`` machine, each axis moves independently, and the slowest determines the time. With
    `feed` (mm/s, along the path), the move is straight and limited by the axes and by `max_feed`; a feed that is not
    positive counts as `max_feed`. `Machine.acceleration_factor` applies to all. An unknown delta (NaN) costs nothing.
    """
    moved = np.abs(np.nan_to_num(np.asarray(delta, dtype=np.float64)))
    cruise = moved / np.asarray(machine.rapid_velocity)
    ramp = moved / (np.asarray(machine.acceleration) * machine.acceleration_factor)
    if feed is None and machine.rapid_style == "dogleg":
        seconds = _times(cruise, ramp).max(axis=-1)
    else:
        slowest = cruise.max(axis=-1)
        if feed is not None:
            limit = np.asarray(feed, dtype=np.float64)
            limit = np.where(limit > 0, np.minimum(limit, machine.max_feed), machine.max_feed)
            slowest = np.maximum(slowest, np.sqrt((moved**2).sum(axis=-1)) / limit)
        seconds = _times(slowest, ramp.max(axis=-1))
    return float(seconds) if np.ndim(seconds) == 0 else seconds


def _times(cruise: NDArray[np.float64], ramp: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds of moves with cruise = distance / velocity and ramp = distance / acceleration, elementwise."""
    reached = cruise * cruise >= ramp
    safe = np.where(reached & (cruise > 0), cruise, 1.0)
    seconds: NDArray[np.float64] = np.where(reached, cruise + ramp / safe, 2.0 * np.sqrt(ramp))
    return seconds


def _times_of(cruise: float, ramp: float) -> float:
    if cruise * cruise < ramp:
        return 2.0 * math.sqrt(ramp)
    return cruise + ramp / cruise if cruise > 0 else 0.0
