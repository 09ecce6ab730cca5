"""Measure the lengths of a toolpath and the time that each kind of motion takes on a machine."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.cycles import expand_cycles
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import FIRST_OFFSET, MOTIONS, PLACES, STILL, Kind, Toolpath, latest_marked_rows
from leafcut.model.turns import Turns, arc_turns
from leafcut.timing.grbl import SentLines, grbl_seconds
from leafcut.timing.linuxcnc import CYCLE
from leafcut.timing.lookahead import move_seconds
from leafcut.timing.moves import BLEND, EXACT, REST, Moves, extract_moves
from leafcut.timing.profile import move_time

#: Default corner style for each controller.
_STYLES = {"linuxcnc": "linuxcnc", "grbl": "grbl"}

#: A move counts as starved if waiting for program lines takes up more than this fraction of its duration.
STARVED_SHARE = 0.1

#: GRBL dwells in steps of this many seconds (DWELL_TIME_STEP).
_GRBL_DWELL_STEP = 0.05

#: Rows of these kinds set the tool position without moving the tool.
_REPOSITIONING = [int(k) for k in PLACES if k not in MOTIONS]

#: Maps the `ref` of a BLENDING row to the end mode of the following moves.
_MODES = {610: EXACT, 611: REST, 640: BLEND}


def corner_style_of_machine(machine: Machine) -> str:
    """Return the corner style of the machine's controller: linuxcnc, grbl, or round."""
    return machine.corners or _STYLES.get(machine.control, "round")


@dataclass(frozen=True, eq=False)
class PathTimes:
    """A toolpath with its canned cycles expanded, and the duration of each row in seconds.

    `source` maps each row of `path` to a row of the original toolpath.
    """

    path: Toolpath
    source: NDArray[np.int32]
    seconds: Floats


def measure_toolpath(
    path: Toolpath,
    machine: Machine,
    beam_off: NDArray[np.bool_] | None = None,
    start: tuple[float, float] | None = None,
    lines: SentLines | None = None,
) -> Measure:
    """Measure the lengths (mm) and the machine time (s) of a toolpath.

    Parameters
    ----------
    beam_off
        Mask of feed moves that count as travel because the beam is off, bool[n].
    start
        Tool position (x, y) in mm before the first move. Only needed if the path does not state it.
    lines
        Byte and word counts of the program lines, if known. They affect the time on GRBL.

    Notes
    -----
    Canned cycles are expanded. The controller blends moves as described in `timing.lookahead`, and the machine stops at
    every other command. A laser under GRBL is assumed to run in laser mode ($32=1), where an S word in the block of a
    move changes the power without a stop. If a program sets no path mode (G61, G61.1, G64), we assume G64, which is
    active at power-on. For a planned path, we assume G61, because leafcut writes it.

    A tool change takes `tool_change_s`, unless the tool is already in the spindle. Starting the spindle or changing its
    speed takes `spindle_start_s`, or the duration of the following dwell if that is longer. This time counts as
    ``spindle``. Pauses take no time because the waiting time of the operator is unknown.

    If a coordinate of a move is unknown, the move takes no time along that axis. A move between program coordinates and
    machine coordinates has an exact time if the machine's `work_offset` is known. Otherwise, the time is estimated from
    half of the axis travel, provided that the travel is known, and the length counts as 0.

    Raises
    ------
    PlanError
        If the expanded cycles have too many moves.
    """
    timed = _time_path(path, machine, start, lines)
    path, source, delta, turns, moves, move_times, standing_seconds = timed
    dark_feed = (path.kind == Kind.FEED) & (beam_off[source] if beam_off is not None else False)
    rapid = (path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE) | dark_feed
    seconds = {
        "rapid": float(move_times[moves.rapid].sum()),
        "feed": float(move_times[~moves.rapid].sum()),
        "dwell": float(standing_seconds[path.kind == Kind.DWELL].sum()),
        "tool_change": float(standing_seconds[path.kind == Kind.TOOL].sum()),
        "spindle": float(standing_seconds[path.kind == Kind.SPINDLE].sum()),
    }
    return Measure(
        travel_mm=_total_length(delta[rapid]),
        cut_mm=_total_length(delta[(path.kind == Kind.FEED) & ~dark_feed]) + float(turns.length.sum()),
        time_s=sum(seconds.values()),
        by_kind=seconds,
        by_tool=_seconds_by_tool(timed),
        start=start,
        lines=lines,
    )


def _seconds_by_tool(timed: _TimedPath) -> dict[int, float]:
    changes = np.flatnonzero(timed.path.kind == Kind.TOOL)
    tools = timed.path.ref[changes].tolist()
    if len(set(tools)) < 2:
        return {}
    until = np.append(0.0, np.cumsum(timed.moving_seconds + timed.standing_seconds))
    spent = dict.fromkeys(sorted({0, *tools}), 0.0)
    for tool, seconds in zip((0, *tools), np.diff(until[[0, *changes, -1]]).tolist(), strict=True):
        spent[tool] += seconds
    return {tool: seconds for tool, seconds in spent.items() if seconds > 0.0}


def rows_waiting_for_serial_line(
    path: Toolpath, machine: Machine, lines: SentLines | None = None
) -> tuple[NDArray[np.int32], Floats]:
    """Find the rows that a GRBL board slows down for because it waits for program lines.

    The comparison is with a board whose serial line and processor take no time. The first move after a stop does not
    count, because the board reads lines during the stop. For other controllers, the result is empty.

    Returns
    -------
    tuple[NDArray[np.int32], Floats]
        The affected rows, and the time lost in each row in seconds.

    Raises
    ------
    PlanError
        If the expanded cycles have too many moves.
    """
    if corner_style_of_machine(machine) != "grbl":
        return np.zeros(0, dtype=np.int32), np.zeros(0)
    timed, fastest = _time_path(path, machine, None, lines), _time_path(path, machine, None, lines, pace=0.0).move_times
    loss = timed.move_times - fastest
    follows = np.append(False, ~timed.moves.flushed[:-1])[: len(loss)]
    starved = follows & (loss > STARVED_SHARE * fastest)
    return timed.source[timed.moves.row[starved]], loss[starved]


def seconds_by_row(path: Toolpath, machine: Machine) -> Floats:
    """Return the time in motion for each row of a path without canned cycles, float64[n], s."""
    return _time_path(path, machine).moving_seconds


def time_rows(
    path: Toolpath, machine: Machine, lines: SentLines | None = None, start: tuple[float, float] | None = None
) -> PathTimes:
    """Compute the duration of each row of a toolpath.

    The durations add up to the time that `measure_toolpath` returns for the same `lines` and `start`.

    Raises
    ------
    PlanError
        If the expanded cycles have too many moves.
    """
    timed = _time_path(path, machine, start, lines)
    return PathTimes(timed.path, timed.source, timed.moving_seconds + timed.standing_seconds)


class _TimedPath(NamedTuple):
    """A toolpath with its canned cycles expanded, and its times.

    Attributes
    ----------
    source
        For each row, the row in the original toolpath.
    delta
        Displacement of each row, mm.
    turns, moves
        Arcs and moves of the path.
    move_times, standing_seconds
        Duration of each move, and time at rest in each row, s.
    """

    path: Toolpath
    source: NDArray[np.int32]
    delta: Floats
    turns: Turns
    moves: Moves
    move_times: Floats
    standing_seconds: Floats

    @property
    def moving_seconds(self) -> Floats:
        """Time in motion for each row, float64[n], s."""
        return np.bincount(self.moves.row, weights=self.move_times, minlength=len(self.path)).astype(np.float64)


def _time_path(
    path: Toolpath,
    machine: Machine,
    start: tuple[float, float] | None = None,
    lines: SentLines | None = None,
    pace: float = 1.0,
) -> _TimedPath:
    style = corner_style_of_machine(machine)
    path, source, mode, tolerance, joining = _expand_cycles(path, style)
    path, probing = _replace_probes_with_feeds(path)
    delta, estimate = _displacements(path, machine, start, 3 if style == "grbl" else 2)
    turns = arc_turns(path)
    cycle_s = CYCLE if style == "linuxcnc" else 0.0
    moves = extract_moves(path, machine, delta + estimate, turns, mode, tolerance, joining, cycle_s)
    estimated = np.asarray(estimate[moves.row].any(axis=1)) | probing[moves.row]
    for at_rest in (estimated, np.append(estimated[1:], False)[: len(moves)]):
        moves.mode[at_rest], moves.flushed[at_rest] = REST, True
    standing_seconds = _seconds_at_rest(path, machine, style)
    if style == "grbl":
        move_times = grbl_seconds(path, machine, delta + estimate, moves, standing_seconds, lines, pace)
    else:
        move_times = move_seconds(moves, machine, style)
    if machine.rapid_style == "dogleg":
        move_times[moves.rapid] = move_time((delta + estimate)[moves.row[moves.rapid]], machine)
    return _TimedPath(path, source, delta, turns, moves, move_times, standing_seconds)


def _replace_probes_with_feeds(path: Toolpath) -> tuple[Toolpath, NDArray[np.bool_]]:
    """Replace probe moves with feed moves to the point of contact, and mark the probe rows in a mask, bool[n].

    We assume that the probe makes contact at the height of the SHIFT row (G92) that follows it, which is the program's
    surface. If no such row follows, the length of the probe move is unknown, and the probe takes no time. In programs
    from other CAM systems, a probe move is a FOREIGN row with a feed.
    """
    probes = (path.kind == Kind.PROBE) | ((path.kind == Kind.FOREIGN) & (path.value > 0.0))
    if not probes.any():
        return path, probes
    kind, end = path.kind.copy(), path.end.copy()
    rows = np.flatnonzero(probes)
    after = np.minimum(rows + 1, len(path) - 1)
    tripped = np.where(path.kind[after] == Kind.SHIFT, path.end[after, 2], np.nan)
    kind[rows], end[rows, 2] = Kind.FEED, tripped
    return replace(path, kind=kind, end=end), probes


def _expand_cycles(
    path: Toolpath, style: str
) -> tuple[Toolpath, NDArray[np.int32], NDArray[np.int8], NDArray[np.float64], NDArray[np.float64]]:
    """Expand all canned cycles.

    Returns
    -------
    tuple
        The expanded path, followed by four columns with one entry per row: the original row, the end mode, and the P
        and Q values of G64 in mm.
    """
    rows = np.arange(len(path), dtype=np.int32)
    written = expand_cycles(replace(path, line=rows))
    source = written.line
    blending = np.flatnonzero(path.kind == Kind.BLENDING)
    codes = np.append(640 if path.line.any() else 610, path.ref[blending])
    values = np.nan_to_num([np.append(0.0, column[blending]) for column in (path.value, path.end[:, 0])])
    last = np.searchsorted(blending, rows, side="right")
    mode = np.array([_MODES.get(code, BLEND) for code in codes.tolist()], dtype=np.int8)[last]
    tolerance, joining = np.where(codes == 640, values, 0.0)[:, last]
    if style == "grbl":
        mode, tolerance, joining = np.full_like(mode, BLEND), np.zeros_like(tolerance), np.zeros_like(joining)
    # Canned cycles run in exact-path mode. Source: LinuxCNC 2.9, observed with rs274.
    in_cycle = path.kind == Kind.DRILL
    mode[in_cycle], tolerance[in_cycle], joining[in_cycle] = EXACT, 0.0, 0.0
    return replace(written, line=path.line[source]), source, mode[source], tolerance[source], joining[source]


def _total_length(delta: NDArray[np.float64]) -> float:
    return float(np.sqrt((delta**2).sum(axis=1)).sum())


def _displacements(
    path: Toolpath, machine: Machine, start: tuple[float, float] | None = None, n_started: int = 2
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compute the known and the estimated displacement of each row along each axis, float64[n, 3] each, mm.

    Each axis is tracked separately, in program coordinates or in machine coordinates. A work offset, G92, or a block
    that leafcut does not understand may change the coordinates without a move. The first `n_started` axes start at
    `start`. Z starts at 0.
    """
    delta, estimate = np.zeros((len(path), 3)), np.zeros((len(path), 3))
    in_machine = path.kind == Kind.MACHINE
    moving = (path.kind <= Kind.ARC_CCW) | in_machine
    restated = np.isin(path.kind, _REPOSITIONING) & ((path.kind != Kind.FOREIGN) | (path.ref != STILL))
    shifted = (path.kind == Kind.SHIFT) | ((path.kind == Kind.FRAME) & (path.ref != FIRST_OFFSET))
    offset = None if shifted.any() else machine.work_offset
    for axis in range(3):
        rows = np.flatnonzero((moving & np.isfinite(path.end[:, axis])) | restated)
        position, frame, moves = path.end[rows, axis], in_machine[rows], moving[rows]
        if offset is not None:
            position = np.where(frame, position - offset[axis], position)
            frame = np.zeros_like(frame)
        last = latest_marked_rows(moves)[:-1]
        crossing = moves[1:] & (last >= 0) & (frame[1:] != frame[last])
        is_known = moves[1:] & ~crossing
        delta[rows[1:], axis] = np.where(is_known, np.nan_to_num(np.diff(position)), 0.0)
        half_travel = 0.5 * machine.reach(axis)
        estimate[rows[1:], axis] = np.where(crossing, half_travel if math.isfinite(half_travel) else 0.0, 0.0)
        if start is not None and axis < n_started and len(rows) and path.kind[rows[0]] in (Kind.RAPID, Kind.FEED):
            delta[rows[0], axis] = position[0] - (*start, 0.0)[axis]
    return delta, estimate


def _seconds_at_rest(path: Toolpath, machine: Machine, style: str) -> Floats:
    """Compute the time at rest in each row, float64[n], s, for dwells, tool changes, and the spindle.

    We do not know which tool is in the spindle at the start, so the first TOOL row counts as a tool change. A dwell
    that merely waits for the spindle counts as spindle time. A tool change stops the spindle, as M6 does on LinuxCNC
    and Haas, so the spindle must start again afterwards. GRBL does not wait for the spindle, and rounds dwells up to
    whole steps.
    """
    seconds = np.zeros(len(path))
    dwells = (path.kind == Kind.DWELL) & np.isfinite(path.value) & (path.value > 0.0)
    seconds[dwells] = path.value[dwells]
    if style == "grbl":
        seconds[dwells] = np.ceil(seconds[dwells] / _GRBL_DWELL_STEP - 1e-6) * _GRBL_DWELL_STEP
    changes = np.flatnonzero(path.kind == Kind.TOOL)
    is_new_tool = np.append(True, np.diff(path.ref[changes]) != 0)[: len(changes)]
    seconds[changes[is_new_tool]] = machine.tool_change_s
    turning, start_s = 0.0, 0.0 if style == "grbl" else machine.spindle_start_s
    # The path of a beam has a SPINDLE row for every cut; plain lists are faster here than arrays.
    kinds, tool = path.kind.tolist(), int(Kind.TOOL)
    rows = np.flatnonzero((path.kind == Kind.SPINDLE) | (path.kind == tool))
    for row, value in zip(rows.tolist(), path.value[rows].tolist(), strict=True):
        speed = 0.0 if kinds[row] == tool else value
        if speed not in (0.0, turning):
            dwell = _find_dwell_after(kinds, row)
            dwell_s = 0.0 if dwell is None else float(seconds[dwell])
            seconds[row] = max(dwell_s, start_s)
            if dwell is not None:
                seconds[dwell] = 0.0
        turning = speed
    return seconds


#: Only rows of these kinds may appear between a spindle start and the dwell that waits for the spindle.
_DWELL, _IGNORED_ROWS = int(Kind.DWELL), (int(Kind.COOLANT), int(Kind.OFFSET))


def _find_dwell_after(kinds: list[int], row: int) -> int | None:
    """Find the dwell that follows a row. Only coolant and length-offset rows may come before the dwell."""
    for after in range(row + 1, len(kinds)):
        if kinds[after] == _DWELL:
            return after
        if kinds[after] not in _IGNORED_ROWS:
            break
    return None
