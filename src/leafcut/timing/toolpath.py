"""What a whole toolpath costs on a machine: lengths, and seconds by kind of motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.model.cycles import expand
from leafcut.model.machine import Machine
from leafcut.model.outcome import Measure
from leafcut.model.toolpath import Kind, Toolpath, arc_sweep, plane_axes, position_before
from leafcut.timing.profile import move_time, trapezoid_time


def measure(path: Toolpath, machine: Machine) -> Measure:
    """Return lengths (mm) and machine time (s) of a toolpath.

    Canned cycles are expanded, and every move goes from rest to rest (`timing.profile`). Arcs and helices run at the
    feed, but not above √(a r), where the way round takes all the acceleration a of the slower axis of their plane.
    A tool change costs `tool_change_s`, the first one too; changing to the tool that is in the spindle costs nothing.
    A spindle that starts or changes speed costs `spindle_start_s`, or the dwell that follows it if that is longer; both
    count as ``spindle``. Pauses cost nothing: a person's time is not known.

    A coordinate that is not known costs nothing. A move between program and machine coordinates is exact where the
    machine's `work_offset` is known; elsewhere half of the axis' travel is taken for its time, as an estimate, and
    nothing for its length.

    Raises
    ------
    PlanError
        The cycles come to more moves than can be meant.
    """
    path = expand(path)
    delta, estimate = _displacements(path, machine)
    rapid = (path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE)
    feed = path.kind == Kind.FEED
    arc_mm, arc_s = _arcs(path, machine)
    waited, spindle_s = _spindle(path, machine)
    seconds = {
        "rapid": float(move_time(delta[rapid] + estimate[rapid], machine).sum()),
        "feed": float(move_time(delta[feed], machine, path.value[feed]).sum()) + arc_s,
        "dwell": _known_sum(path.value[path.kind == Kind.DWELL]) - waited,
        "tool_change": _tool_changes(path) * machine.tool_change_s,
        "spindle": spindle_s,
    }
    return Measure(
        travel_mm=_length(delta[rapid]),
        cut_mm=_length(delta[feed]) + arc_mm,
        time_s=sum(seconds.values()),
        by_kind=seconds,
    )


def _length(delta: NDArray[np.float64]) -> float:
    return float(np.sqrt((delta**2).sum(axis=1)).sum())


def _known_sum(seconds: NDArray[np.float64]) -> float:
    return float(seconds[np.isfinite(seconds) & (seconds > 0)].sum())


def _displacements(path: Toolpath, machine: Machine) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far every row moves each axis, float64[n, 3] mm: as far as it is known, and the estimate where not.

    Every axis is followed by itself through the rows that place it, in program coordinates or in the machine's.
    """
    delta, estimate = np.zeros((len(path), 3)), np.zeros((len(path), 3))
    in_machine = path.kind == Kind.MACHINE
    moving = (path.kind <= Kind.ARC_CCW) | in_machine
    for axis in range(3):
        rows = np.flatnonzero(moving & np.isfinite(path.end[:, axis]))
        place, frame = path.end[rows, axis], in_machine[rows]
        if machine.work_offset is not None:
            place = np.where(frame, place - machine.work_offset[axis], place)
            frame = np.zeros_like(frame)
        crossing = frame[1:] != frame[:-1]
        delta[rows[1:], axis] = np.where(crossing, 0.0, np.diff(place))
        half_travel = 0.5 * (machine.travel_max[axis] - machine.travel_min[axis])
        estimate[rows[1:], axis] = np.where(crossing, half_travel, 0.0)
    return delta, estimate


def _arcs(path: Toolpath, machine: Machine) -> tuple[float, float]:
    """Return the length in mm and the seconds of all arcs and helices."""
    rows = np.flatnonzero((path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW)).tolist()
    length = seconds = 0.0
    for row in rows:
        one_mm, one_s = _arc(path, row, machine)
        length += one_mm
        seconds += one_s
    return length, seconds


def _arc(path: Toolpath, row: int, machine: Machine) -> tuple[float, float]:
    radius, _, sweep = arc_sweep(path, row)
    first, second, normal = plane_axes(path.arcs[int(path.ref[row])].plane)
    round_mm = radius * abs(sweep)
    if not round_mm > 0:  # also where the start is not known
        return 0.0, 0.0
    before = position_before(path, row)
    rise = float(np.nan_to_num(path.end[row, normal] - before[normal]))
    length = float(np.hypot(round_mm, rise))
    acceleration = min(machine.acceleration[first], machine.acceleration[second]) * machine.acceleration_factor
    velocity = min(
        float(path.value[row]) if path.value[row] > 0 else machine.max_feed,
        machine.max_feed,
        machine.rapid_velocity[first],
        machine.rapid_velocity[second],
        float(np.sqrt(acceleration * radius)),
        machine.rapid_velocity[normal] * length / abs(rise) if rise else np.inf,
    )
    return length, trapezoid_time(length, float(velocity), acceleration)


def _tool_changes(path: Toolpath) -> int:
    """Return how often another tool comes into the spindle; which one is in it at first is not known."""
    tools = path.ref[path.kind == Kind.TOOL]
    return int(len(tools) and 1 + np.count_nonzero(np.diff(tools)))


def _spindle(path: Toolpath, machine: Machine) -> tuple[float, float]:
    """Return the dwells that only wait for the spindle, and the seconds that its starts take with them.

    A tool change stops the spindle (as M6 does on LinuxCNC and Haas), so the next speed is a start again.
    """
    turning, waited, seconds = 0.0, 0.0, 0.0
    for row in np.flatnonzero((path.kind == Kind.SPINDLE) | (path.kind == Kind.TOOL)).tolist():
        speed = 0.0 if path.kind[row] == Kind.TOOL else float(path.value[row])
        if speed not in (0.0, turning):
            dwell = _dwell_after(path, row)
            waited += dwell
            seconds += max(dwell, machine.spindle_start_s)
        turning = speed
    return waited, seconds


def _dwell_after(path: Toolpath, row: int) -> float:
    """Return the seconds of the dwell that follows a row, with nothing but coolant and length offset in between."""
    for after in range(row + 1, len(path)):
        if path.kind[after] == Kind.DWELL:
            return _known_sum(path.value[after : after + 1])
        if path.kind[after] not in (Kind.COOLANT, Kind.OFFSET):
            break
    return 0.0
