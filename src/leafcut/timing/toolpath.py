"""What a whole toolpath costs on a machine: lengths, and seconds by kind of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.cycles import expand
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import MOTIONS, PLACES, STILL, Kind, Toolpath, last_rows
from leafcut.timing.grbl import DWELL_STEP, SentLines, grbl_seconds
from leafcut.timing.linuxcnc import CYCLE
from leafcut.timing.lookahead import move_seconds
from leafcut.timing.moves import BLEND, EXACT, REST, Moves, moves_of
from leafcut.timing.profile import move_time
from leafcut.timing.turns import Turns, turns_of

#: How controllers take corners whose machine does not say it.
_STYLES = {"linuxcnc": "linuxcnc", "grbl": "grbl"}

#: A move is late for want of lines if it loses this part of its time.
LATE_PART = 0.1

#: Kinds that say where the tool is without moving it.
_RESTATED = [int(k) for k in PLACES if k not in MOTIONS]

#: The work offset that `Machine.work_offset` is about: G54.
_FIRST_FRAME = 540

#: Ends of moves by `ref` of a BLENDING row.
_MODES = {610: EXACT, 611: REST, 640: BLEND}


def corner_style(machine: Machine) -> str:
    """Return how a machine takes corners: linuxcnc, grbl or round."""
    return machine.corners or _STYLES.get(machine.control, "round")


@dataclass(frozen=True, eq=False)
class PathTimes:
    """When a toolpath is where.

    Attributes
    ----------
    path
        The toolpath with its canned cycles written out.
    source
        int32[m]: the row of the toolpath it was made of that each row comes from.
    seconds
        float64[m]: the time that every row takes, s.
    """

    path: Toolpath
    source: NDArray[np.int32]
    seconds: Floats


def measure(
    path: Toolpath,
    machine: Machine,
    off: NDArray[np.bool_] | None = None,
    start: tuple[float, float] | None = None,
    lines: SentLines | None = None,
) -> Measure:
    """Return lengths (mm) and machine time (s) of a toolpath.

    Rows that are `off`, bool[n], are ways and no cuts although they are made at feed: those of a beam that is off.
    `start` is where the tool stands before the first of them, (x, y) in mm, where the path does not say it.

    Canned cycles are expanded. Moves run into each other as the controller joins them (`timing.lookahead`); wherever
    something else is done in between, the machine stops; but a laser under GRBL is taken to be in laser mode ($32=1),
    in which an S in the block of a move changes the power on the way. A path that does not say how moves end (G61,
    G61.1, G64) is taken as a control is when it is switched on, G64; one that was planned and not read, as our posts
    write it, G61.

    A tool change costs `tool_change_s`, the first one too; changing to the tool that is in the spindle costs nothing.
    A spindle that starts or changes speed costs `spindle_start_s`, or the dwell that follows it if that is longer; both
    count as ``spindle``. Pauses cost nothing: a person's time is not known.

    A coordinate that is not known costs nothing. A move between program and machine coordinates is exact where the
    machine's `work_offset` is known; elsewhere half of the axis' travel is taken for its time, as an estimate, and
    nothing for its length; nothing at all where the travel is not known.

    Raises
    ------
    PlanError
        The cycles come to more moves than can be meant.
    """
    path, source, delta, turns, moves, each, standing = _timed(path, machine, start, lines)
    dark = (path.kind == Kind.FEED) & (off[source] if off is not None else False)
    rapid = (path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE) | dark
    seconds = {
        "rapid": float(each[moves.rapid].sum()),
        "feed": float(each[~moves.rapid].sum()),
        "dwell": float(standing[path.kind == Kind.DWELL].sum()),
        "tool_change": float(standing[path.kind == Kind.TOOL].sum()),
        "spindle": float(standing[path.kind == Kind.SPINDLE].sum()),
    }
    return Measure(
        travel_mm=_length(delta[rapid]),
        cut_mm=_length(delta[(path.kind == Kind.FEED) & ~dark]) + float(turns.length.sum()),
        time_s=sum(seconds.values()),
        by_kind=seconds,
        start=start,
        lines=lines,
    )


def starved_rows(path: Toolpath, machine: Machine, lines: SentLines | None = None) -> tuple[NDArray[np.int32], Floats]:
    """Return the rows that a GRBL board runs more slowly for want of lines, and what each loses, s.

    The same moves are run by a board whose serial line and processor take no time; what the first move after a stop
    loses, when lines are read before it can begin, is not among them. Of other controllers there are none.

    Raises
    ------
    PlanError
        The cycles come to more moves than can be meant.
    """
    if corner_style(machine) != "grbl":
        return np.zeros(0, dtype=np.int32), np.zeros(0)
    timed, fastest = _timed(path, machine, None, lines), _timed(path, machine, None, lines, pace=0.0).each
    lost = timed.each - fastest
    follows = np.append(False, ~timed.moves.flushed[:-1])[: len(lost)]
    late = follows & (lost > LATE_PART * fastest)
    return timed.source[timed.moves.row[late]], lost[late]


def seconds_by_row(path: Toolpath, machine: Machine) -> Floats:
    """Return the time of every row that moves, s, float64[n], as `measure` adds them up; 0 for the others.

    For paths without canned cycles.
    """
    return _timed(path, machine).moving


def clock(
    path: Toolpath, machine: Machine, lines: SentLines | None = None, start: tuple[float, float] | None = None
) -> PathTimes:
    """Return the time of every row. Their sum is the time of `measure` with the same `lines` and `start`.

    Raises
    ------
    PlanError
        The cycles come to more moves than can be meant.
    """
    timed = _timed(path, machine, start, lines)
    return PathTimes(timed.path, timed.source, timed.moving + timed.standing)


class _Timed(NamedTuple):
    """A path with its cycles written out, the rows that these come from, and what is known of its rows.

    That is how far they move, mm, their arcs, their moves and the seconds of these, and how long the machine stands, s.
    """

    path: Toolpath
    source: NDArray[np.int32]
    delta: Floats
    turns: Turns
    moves: Moves
    each: Floats
    standing: Floats

    @property
    def moving(self) -> Floats:
        """How long each row moves, s, float64[n]."""
        return np.bincount(self.moves.row, weights=self.each, minlength=len(self.path)).astype(np.float64)


def _timed(
    path: Toolpath,
    machine: Machine,
    start: tuple[float, float] | None = None,
    lines: SentLines | None = None,
    pace: float = 1.0,
) -> _Timed:
    """Return the path with its cycles written out, and what is known of its rows."""
    style = corner_style(machine)
    path, source, mode, tolerance, joining = _expanded(path, style)
    path, touching = _touched(path)
    delta, estimate = _displacements(path, machine, start, 3 if style == "grbl" else 2)
    turns = turns_of(path)
    cycle_s = CYCLE if style == "linuxcnc" else 0.0
    moves = moves_of(path, machine, delta + estimate, turns, mode, tolerance, joining, cycle_s)
    estimated = np.asarray(estimate[moves.row].any(axis=1)) | touching[moves.row]
    for at_rest in (estimated, np.append(estimated[1:], False)[: len(moves)]):
        moves.mode[at_rest], moves.flushed[at_rest] = REST, True
    standing = _standing(path, machine, style)
    if style == "grbl":
        each = grbl_seconds(path, machine, delta + estimate, moves, standing, lines, pace)
    else:
        each = move_seconds(moves, machine, style)
    if machine.rapid_style == "dogleg":
        each[moves.rapid] = move_time((delta + estimate)[moves.row[moves.rapid]], machine)
    return _Timed(path, source, delta, turns, moves, each, standing)


def _touched(path: Toolpath) -> tuple[Toolpath, NDArray[np.bool_]]:
    """Return the path with its probes as feeds to where they trip, and which rows these are, bool[n].

    That is taken to be where the program has its surface: the height that the SHIFT (G92) behind a probe says. One that
    none follows costs nothing, since nobody knows how far it goes. Of programs that other CAMs wrote a probe is a
    FOREIGN row with a feed.
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


def _expanded(
    path: Toolpath, style: str
) -> tuple[Toolpath, NDArray[np.int32], NDArray[np.int8], NDArray[np.float64], NDArray[np.float64]]:
    """Return the path with its cycles written out, the row that each of its rows comes from, and how its moves end.

    How they end comes with P and Q of G64, in mm.
    """
    rows = np.arange(len(path), dtype=np.int32)
    written = expand(replace(path, line=rows))
    source = written.line
    blending = np.flatnonzero(path.kind == Kind.BLENDING)
    codes = np.append(640 if path.line.any() else 610, path.ref[blending])
    values = np.nan_to_num([np.append(0.0, column[blending]) for column in (path.value, path.end[:, 0])])
    last = np.searchsorted(blending, rows, side="right")
    mode = np.array([_MODES.get(code, BLEND) for code in codes.tolist()], dtype=np.int8)[last]
    tolerance, joining = np.where(codes == 640, values, 0.0)[:, last]
    if style == "grbl":
        mode, tolerance, joining = np.full_like(mode, BLEND), np.zeros_like(tolerance), np.zeros_like(joining)
    # Canned cycles run in exact-path mode. Source: LinuxCNC 2.9, seen with rs274.
    in_cycle = path.kind == Kind.DRILL
    mode[in_cycle], tolerance[in_cycle], joining[in_cycle] = EXACT, 0.0, 0.0
    return replace(written, line=path.line[source]), source, mode[source], tolerance[source], joining[source]


def _length(delta: NDArray[np.float64]) -> float:
    return float(np.sqrt((delta**2).sum(axis=1)).sum())


def _displacements(
    path: Toolpath, machine: Machine, start: tuple[float, float] | None = None, n_started: int = 2
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far every row moves each axis, float64[n, 3] mm: as far as it is known, and the estimate where not.

    Every axis is followed by itself through the rows that move it, in program coordinates or in the machine's, and
    those that say anew where it is (a work offset, G92, a block that is not understood). Of the first row that moves
    an axis, so many axes from x on are known to begin at `start`, z at 0.
    """
    delta, estimate = np.zeros((len(path), 3)), np.zeros((len(path), 3))
    in_machine = path.kind == Kind.MACHINE
    moving = (path.kind <= Kind.ARC_CCW) | in_machine
    restated = np.isin(path.kind, _RESTATED) & ((path.kind != Kind.FOREIGN) | (path.ref != STILL))
    shifted = (path.kind == Kind.SHIFT) | ((path.kind == Kind.FRAME) & (path.ref != _FIRST_FRAME))
    offset = None if shifted.any() else machine.work_offset
    for axis in range(3):
        rows = np.flatnonzero((moving & np.isfinite(path.end[:, axis])) | restated)
        place, frame, moves = path.end[rows, axis], in_machine[rows], moving[rows]
        if offset is not None:
            place = np.where(frame, place - offset[axis], place)
            frame = np.zeros_like(frame)
        last = last_rows(moves)[:-1]
        crossing = moves[1:] & (last >= 0) & (frame[1:] != frame[last])
        known = moves[1:] & ~crossing
        delta[rows[1:], axis] = np.where(known, np.nan_to_num(np.diff(place)), 0.0)
        half_travel = 0.5 * machine.reach(axis)
        estimate[rows[1:], axis] = np.where(crossing, half_travel if math.isfinite(half_travel) else 0.0, 0.0)
        if start is not None and axis < n_started and len(rows) and path.kind[rows[0]] in (Kind.RAPID, Kind.FEED):
            delta[rows[0], axis] = place[0] - (*start, 0.0)[axis]
    return delta, estimate


def _standing(path: Toolpath, machine: Machine, style: str) -> Floats:
    """Return for how long the machine stands at every row for a dwell, a change of tool or the spindle, s.

    Which tool is in the spindle at first is not known: the first one is changed to. A dwell that only waits for the
    spindle counts as the spindle's. A tool change stops the spindle (as M6 does on LinuxCNC and Haas), so the next
    speed is a start again. GRBL waits for no spindle, and dwells for whole steps.
    """
    seconds = np.zeros(len(path))
    dwells = (path.kind == Kind.DWELL) & np.isfinite(path.value) & (path.value > 0.0)
    seconds[dwells] = path.value[dwells]
    if style == "grbl":
        seconds[dwells] = np.ceil(seconds[dwells] / DWELL_STEP - 1e-6) * DWELL_STEP
    changes = np.flatnonzero(path.kind == Kind.TOOL)
    other = np.append(True, np.diff(path.ref[changes]) != 0)[: len(changes)]
    seconds[changes[other]] = machine.tool_change_s
    turning, start_s = 0.0, 0.0 if style == "grbl" else machine.spindle_start_s
    # Plain lists and numbers: a beam has as many rows SPINDLE as cuts, and to look into an array takes longer.
    kinds, tool = path.kind.tolist(), int(Kind.TOOL)
    rows = np.flatnonzero((path.kind == Kind.SPINDLE) | (path.kind == tool))
    for row, value in zip(rows.tolist(), path.value[rows].tolist(), strict=True):
        speed = 0.0 if kinds[row] == tool else value
        if speed not in (0.0, turning):
            dwell = _dwell_after(kinds, row)
            waits = 0.0 if dwell is None else float(seconds[dwell])
            seconds[row] = max(waits, start_s)
            if dwell is not None:
                seconds[dwell] = 0.0
        turning = speed
    return seconds


#: What may stand between a start of the spindle and the dwell that waits for it.
_DWELL, _BESIDE = int(Kind.DWELL), (int(Kind.COOLANT), int(Kind.OFFSET))


def _dwell_after(kinds: list[int], row: int) -> int | None:
    """Return the row of the dwell that follows a row with nothing but coolant and length offset in between, if any."""
    for after in range(row + 1, len(kinds)):
        if kinds[after] == _DWELL:
            return after
        if kinds[after] not in _BESIDE:
            break
    return None
