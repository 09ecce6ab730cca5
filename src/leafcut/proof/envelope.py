"""Check the limits of the machine: positions must be within the travel, and feeds and speeds within their range."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import FIRST_OFFSET, MOTIONS, Kind, Toolpath, arc_extremes
from leafcut.proof.difference import limit_differences

#: Tolerance for rounded coordinates, mm.
_TOLERANCE = 0.001


def check_machine_limits(path: Toolpath, machine: Machine) -> list[Difference]:
    """Return a difference for each limit of `machine` that the path exceeds, with the first position that exceeds it.

    If the `work_offset` of the machine is known, every position in G54 must be inside the travel. This includes hole
    bottoms and arc bulges. Otherwise, and in other work offsets, only the size of the job is compared with the travel.
    Heights refer to the tool tip, because the tool length is unknown here.
    """
    return limit_differences(
        [
            *_positions_outside_travel(path, machine),
            *_feeds_out_of_range(path, machine),
            *_speeds_out_of_range(path, machine),
        ]
    )


def _reached_positions(path: Toolpath) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return every position that the tool reaches, and the row of each position.

    Positions are in program coordinates, float64[m, 3].
    """
    moving = np.flatnonzero(np.isin(path.kind, [int(k) for k in MOTIONS]))
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    positions, rows = [path.end[moving]], [moving]
    if len(drills):
        for heights in ([c.bottom for c in path.cycles], [c.r_plane for c in path.cycles]):
            holes = path.end[drills].copy()
            holes[:, 2] = np.array(heights)[path.ref[drills]]
            positions.append(holes)
            rows.append(drills)
    for row in np.flatnonzero((path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW)).tolist():
        if np.isfinite(path.end[row]).all():
            extremes = np.array(_arc_extremes_if_known(path, row), dtype=np.float64).reshape(-1, 3)
            positions.append(extremes)
            rows.append(np.full(len(extremes), row))
    return np.concatenate(positions), np.concatenate(rows)


def _arc_extremes_if_known(path: Toolpath, row: int) -> list[tuple[float, float, float]]:
    try:
        return arc_extremes(path, row)
    except ValueError:  # the start of the arc is unknown; the interpreter has already reported it
        return []


def _positions_outside_travel(path: Toolpath, machine: Machine) -> list[Difference]:
    positions, rows = _reached_positions(path)
    outside = []
    known = path.latest(Kind.FRAME, path.ref, FIRST_OFFSET)[rows] == FIRST_OFFSET
    known &= machine.work_offset is not None
    for axis, name in enumerate("XYZ"):
        low, high = machine.travel_min[axis] - _TOLERANCE, machine.travel_max[axis] + _TOLERANCE
        if machine.work_offset is not None:
            offset = machine.work_offset[axis]
            outside += _axis_outside_limits(
                path,
                rows[known],
                positions[known, axis] + offset,
                (low, high),
                Message("{} in machine coordinates", name),
            )
        outside += _exceeds_travel(positions[~known, axis], machine.reach(axis), name)
        in_machine = np.flatnonzero(path.kind == Kind.MACHINE)
        values = path.end[in_machine, axis]
        outside += _axis_outside_limits(
            path, in_machine, values, (low, high), Message("{} in machine coordinates", name)
        )
    return outside


def _axis_outside_limits(
    path: Toolpath, rows: NDArray[np.int64], values: NDArray[np.float64], limits: tuple[float, float], name: str
) -> list[Difference]:
    low, high = limits
    out = np.flatnonzero((values < low) | (values > high))
    if not len(out):
        return []
    first = int(out[np.argmin(rows[out])])
    text = Message(
        "{} {:.3f} mm is outside the machine's travel, {:.3f} to {:.3f} mm; number of such positions: {}",
        name,
        values[first],
        low + _TOLERANCE,
        high - _TOLERANCE,
        len(out),
    )
    return [Difference(Message("outside travel"), 0, int(path.line[rows[first]]), text)]


def _exceeds_travel(values: NDArray[np.float64], travel: float, name: str) -> list[Difference]:
    finite = values[np.isfinite(values)]
    if not len(finite) or np.ptp(finite) <= travel + _TOLERANCE:
        return []
    text = Message(
        "{} goes from {:.3f} to {:.3f} mm, {:.3f} mm in all, but the machine's travel is {:.3f} mm",
        name,
        finite.min(),
        finite.max(),
        np.ptp(finite),
        travel,
    )
    return [Difference(Message("too large"), 0, 0, text)]


def _feeds_out_of_range(path: Toolpath, machine: Machine) -> list[Difference]:
    feeding = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL))
    values = path.value[feeding]
    wrong = []
    # Feeds are rounded in the program, so a feed at the limit may be written slightly above it.
    for kind, is_wrong, limit in (
        (
            Message("feed too high"),
            values > machine.max_feed * 1.005,
            Message("the machine allows at most {:.6g}", machine.max_feed * 60),
        ),
        (Message("no feed"), ~(values > 0), Message("the feed must be above 0")),
    ):
        rows = feeding[is_wrong]
        if len(rows):
            value = path.value[rows[0]] * 60.0
            feed = f"{value:,.0f}" if value >= 1e6 else f"{value:.6g}"
            text = Message("the feed is {} mm/min, {}; number of such moves: {}", feed, limit, len(rows))
            wrong.append(Difference(kind, 0, int(path.line[rows[0]]), text))
    return wrong


def _speeds_out_of_range(path: Toolpath, machine: Machine) -> list[Difference]:
    # For a torch or a water jet, S is not a speed.
    if machine.head not in (Head.SPINDLE, Head.LASER):
        return []
    low, high = machine.spindle_min_rpm, machine.spindle_max_rpm
    speeds = np.abs(path.value)
    rows = np.flatnonzero((path.kind == Kind.SPINDLE) & (speeds > 0) & ((speeds > high + 0.5) | (speeds < low - 0.5)))
    if machine.head is Head.LASER:
        kind = Message("laser power")
        text = partial(Message, "S{:g} is out of range; the laser power ranges from S{:g} to S{:g}")
    else:
        kind = Message("spindle speed")
        text = partial(Message, "{:g} rpm is out of range; the spindle turns {:g} to {:g} rpm")
    return [Difference(kind, 0, int(path.line[row]), text(speeds[row], low, high)) for row in rows.tolist()]
