"""Time of a single move from rest to rest with constant acceleration.

Derivation. A move of length d with maximum velocity v and acceleration a needs v/a seconds and v²/2a millimetres to
reach v, and the same to stop. If d ≥ v²/a, the velocity is reached. The time is d/v for the whole length at v, plus v/a
because the mean velocity of both ramps is v/2: t = d/v + v/a. Otherwise, the move changes from acceleration to
deceleration halfway: d/2 = a (t/2)²/2, so t = 2 √(d/a). Both times are equal at d = v²/a.

On a straight move along a unit vector u, axis i stays within v_i and a_i if v = min v_i/|u_i| and a = min a_i/|u_i|.
With δ = d u, two quantities are sufficient: cruise = d/v = max |δ_i|/v_i and ramp = d/a = max |δ_i|/a_i. The time is t
= cruise + ramp/cruise if cruise² ≥ ramp, else t = 2 √ramp.

`timing.lookahead` computes the times of moves that pass corners without a stop.
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
    """Return the time of a move from rest to rest, s. Arrays are broadcast against each other.

    The distance is in mm and must not be negative. Velocity and acceleration are in mm/s and mm/s².
    """
    cruise, ramp = distance / velocity, distance / acceleration
    if isinstance(cruise, float) and isinstance(ramp, float):
        return _trapezoid_time(cruise, ramp)
    return _trapezoid_times(np.asarray(cruise), np.asarray(ramp))


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
    """Return the time, s, of straight moves from rest to rest by `delta` (float64[..., 3], mm).

    Without `feed`, the move is a rapid. On a ``linear`` machine, every axis stays within its velocity and acceleration.
    On a ``dogleg`` machine, the axes move independently, and the slowest axis determines the time. With `feed`, mm/s,
    the move is also limited by the feed and by `max_feed`; a feed that is not positive counts as `max_feed`.
    `Machine.acceleration_factor` applies to all moves. A move by an unknown distance (NaN) takes no time.
    """
    moved = np.abs(np.nan_to_num(np.asarray(delta, dtype=np.float64)))
    cruise = moved / np.asarray(machine.rapid_velocity)
    ramp = moved / (np.asarray(machine.acceleration) * machine.acceleration_factor)
    if feed is None and machine.rapid_style == "dogleg":
        seconds = _trapezoid_times(cruise, ramp).max(axis=-1)
    else:
        slowest = cruise.max(axis=-1)
        if feed is not None:
            limit = np.asarray(feed, dtype=np.float64)
            limit = np.where(limit > 0, np.minimum(limit, machine.max_feed), machine.max_feed)
            slowest = np.maximum(slowest, np.sqrt((moved**2).sum(axis=-1)) / limit)
        seconds = _trapezoid_times(slowest, ramp.max(axis=-1))
    return float(seconds) if np.ndim(seconds) == 0 else seconds


def _trapezoid_times(cruise: NDArray[np.float64], ramp: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times of moves, s, where cruise = distance / velocity and ramp = distance / acceleration."""
    reached = cruise * cruise >= ramp
    safe = np.where(reached & (cruise > 0), cruise, 1.0)
    seconds: NDArray[np.float64] = np.where(reached, cruise + ramp / safe, 2.0 * np.sqrt(ramp))
    return seconds


def _trapezoid_time(cruise: float, ramp: float) -> float:
    if cruise * cruise < ramp:
        return 2.0 * math.sqrt(ramp)
    return cruise + ramp / cruise if cruise > 0 else 0.0
