"""Compute the duration of a single move that starts and ends at rest, with constant acceleration.

Derivation: Consider a move of length d with maximum velocity v and acceleration a. The tool needs v/a seconds and v²/2a
millimetres to reach v, and the same again to stop. If d ≥ v²/a, the tool reaches v. The move then takes d/v at constant
velocity, plus v/a because the mean velocity on both ramps is only v/2: t = d/v + v/a. Otherwise, the tool switches from
acceleration to deceleration halfway: d/2 = a (t/2)²/2, so t = 2 √(d/a). The two formulas agree at d = v²/a.

On a straight move along a unit vector u, axis i stays within v_i and a_i if v = min v_i/|u_i| and a = min a_i/|u_i|.
With δ = d u, the duration depends on only two quantities: cruise = d/v = max |δ_i|/v_i and ramp = d/a = max |δ_i|/a_i.
It is t = cruise + ramp/cruise if cruise² ≥ ramp, and t = 2 √ramp otherwise.

`timing.lookahead` handles moves that pass through corners without a stop.
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
    """Compute the duration in seconds of a move that starts and ends at rest. Arrays are broadcast against each other.

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
    """Compute the duration in seconds of straight moves that start and end at rest.

    Parameters
    ----------
    delta
        Displacements, float64[..., 3], mm. A move with an unknown distance (NaN) takes no time.
    feed
        Feed in mm/s. If None, the move is a rapid. The feed is capped at `max_feed`, and a feed that is not positive
        counts as `max_feed`.

    Notes
    -----
    On a ``linear`` machine, the axes move together, and each stays within its own velocity and acceleration. On a
    ``dogleg`` machine, the axes move independently, and the slowest axis determines the duration.
    `Machine.acceleration_factor` applies to all moves.
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
    """Compute move durations in seconds from cruise = distance / velocity and ramp = distance / acceleration."""
    reached = cruise * cruise >= ramp
    safe = np.where(reached & (cruise > 0), cruise, 1.0)
    seconds: NDArray[np.float64] = np.where(reached, cruise + ramp / safe, 2.0 * np.sqrt(ramp))
    return seconds


def _trapezoid_time(cruise: float, ramp: float) -> float:
    if cruise * cruise < ramp:
        return 2.0 * math.sqrt(ramp)
    return cruise + ramp / cruise if cruise > 0 else 0.0
