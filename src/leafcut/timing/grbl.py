"""Times of moves on GRBL 1.1.

The simulation in `kernels.grbl_clock` models the planner, the buffers, and the serial line of the board.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.timing.moves import REST, Moves, laser_power_changes

#: Speed of the serial line in bytes per second. Every board runs at 115200 baud (BAUD_RATE) with ten bits per byte.
BYTES_PER_SECOND = 11_520

#: Maximum number of chords per arc. GRBL counts chords in a 16-bit integer.
MOST_CHORDS = 65535

_COMMENT = re.compile(r"\([^)]*\)|;.*|\s+")
_WORD = re.compile(r"[A-Z]")

#: GRBL never stops at rows of these kinds.
_FLOWING = (Kind.BLENDING, Kind.TORCH, Kind.HEIGHT, Kind.RADIUS)


def rows_after_stops(path: Toolpath, machine: Machine) -> Mask:
    """Mark the rows before which the machine must stop, as bool[n].

    The machine stops before

    - M3, M4, M5, M7, M8, and M9 if they change the current state;
    - an S word while the spindle is turning (in laser mode, only if the block contains no move);
    - a dwell, a pause, the end of the program, and a change of the origin or the length offset;
    - blocks that leafcut does not understand.

    Source: GRBL 1.1h, gcode.c, spindle_control.c, coolant_control.c, system.c.
    """
    kind = path.kind
    moving = (kind <= Kind.ARC_CCW) | (kind == Kind.MACHINE)
    stops: Mask = ~moving & ~np.isin(kind, _FLOWING)
    for modal_kind, column, initial in (
        (Kind.SPINDLE, path.value, 0.0),
        (Kind.COOLANT, path.ref, 0.0),
        (Kind.OFFSET, path.ref, 0.0),
        (Kind.FRAME, path.ref, 540.0),
    ):
        rows = np.flatnonzero(kind == modal_kind)
        stops[rows] = np.diff(column[rows], prepend=initial) != 0
    if machine.head is Head.LASER:
        stops &= ~laser_power_changes(path)
    return stops


class SentLines(NamedTuple):
    """Byte count and word count of each line as sent to the board, without blanks and comments, int64[n] each.

    When the arrays are aligned with the rows of a toolpath, both counts are 0 for rows that do not start a line.
    """

    size: NDArray[np.int64]
    words: NDArray[np.int64]


def count_line_bytes_and_words(text: Iterable[str]) -> SentLines:
    """Count the bytes and words in each line of a program. The first entry belongs to line 1."""
    sent = [_COMMENT.sub("", line).upper() for line in text]
    size = [len(line) + 1 if line else 0 for line in sent]
    words = [len(_WORD.findall(line)) for line in sent]
    return SentLines(np.array(size, dtype=np.int64), np.array(words, dtype=np.int64))


def line_counts_by_row(path: Toolpath, lines: SentLines | None) -> SentLines:
    """Look up the program line that starts at each row of a path and return its byte and word counts.

    If the program text is not available, the counts are estimated for coordinates with three decimals.
    """
    n = len(path)
    if lines is not None and path.line.any():
        starts = np.append(True, path.line[1:] != path.line[:-1])[:n]
        starts &= (path.line > 0) & (path.line <= len(lines.size))
        line = np.clip(path.line - 1, 0, len(lines.size) - 1)
        return SentLines(*(np.where(starts, column[line], 0) for column in lines))
    starts = np.append(True, (path.line[1:] != path.line[:-1]) | (path.line[1:] == 0))[:n]
    moving = (path.kind <= Kind.ARC_CCW) | (path.kind == Kind.MACHINE)
    arc = (path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW)
    written = np.isfinite(path.end) & (path.end != path.before) & moving[:, None]
    digits = 5 + np.floor(np.log10(np.maximum(np.abs(np.nan_to_num(path.end)), 1.0))) + (path.end < 0)
    size = 4 + np.where(written, digits, 0).sum(axis=1).astype(np.int64) + np.where(arc, 16, 0)
    words = 1 + written.sum(axis=1) + np.where(arc, 2, 0)
    return SentLines(np.where(starts, size, 0), np.where(starts, words, 0))


def grbl_seconds(
    path: Toolpath,
    machine: Machine,
    delta: Floats,
    moves: Moves,
    waits: Floats,
    lines: SentLines | None = None,
    pace: float = 1.0,
) -> Floats:
    """Compute the duration of each move in seconds, float64[m].

    A move's duration includes the time lost in a stop before it, but no dwells.

    Parameters
    ----------
    path
        Toolpath without canned cycles.
    delta
        Displacement of each row, float64[n, 3], mm.
    moves
        Moves of the path.
    waits
        Time at rest in each row, float64[n], s.
    lines
        Byte and word counts of the program lines, if known.
    pace
        Factor that scales the serial and processor times. 0 models an infinitely fast controller.
    """
    from leafcut.kernels.grbl_clock import BEGAN, new_board, simulate_board

    n, m = len(path), len(moves)
    if not m:
        return np.zeros(0)
    position = np.zeros((m + 1, 3))
    np.cumsum(delta[moves.row], axis=0, out=position[1:])
    move = np.full(n, -1, dtype=np.int64)
    move[moves.row] = np.arange(m)
    stops = rows_after_stops(path, machine) | (waits > 0)
    stops[moves.row[1:]] |= moves.mode[:-1] == REST
    board = new_board(n, pace / BYTES_PER_SECOND, machine.motor_lock_s, pace)
    limits = np.array([machine.steps_per_mm, machine.rapid_velocity, machine.acceleration])
    limits[2] *= machine.acceleration_factor
    programmed = path.value[moves.row]
    feed = np.where(programmed > 0.0, np.minimum(programmed, machine.max_feed), machine.max_feed)
    feed[moves.rapid] = np.inf
    arcs = _arc_chords(moves, machine.arc_tolerance)
    sent = line_counts_by_row(path, lines)
    scratch = (np.zeros(n), np.zeros(3))
    simulate_board(board, move, *sent, stops, waits, position, feed, *arcs, limits, machine.corner_deviation, *scratch)
    total_waits = np.cumsum(np.where(stops, waits, 0.0))
    ends = (np.maximum.accumulate(board.done) - total_waits)[moves.row]
    start = board.state[BEGAN] - total_waits[moves.row[0]]
    seconds: Floats = np.maximum(np.diff(np.maximum(ends, start), prepend=start), 0.0)
    return seconds


def _arc_chords(moves: Moves, tolerance: float) -> tuple[NDArray[np.int64], Floats, Floats, Floats, Floats]:
    """Split arcs into chords the same way GRBL does.

    Returns
    -------
    tuple
        For each arc, the number of chords, the angle per chord in rad, two vectors that span the circle, and the rise
        per chord in mm.
    """
    turn = moves.turn
    radius, sweep = turn.radius, turn.sweep
    flat = np.sqrt(np.maximum(tolerance * (2.0 * radius - tolerance), 1e-12))
    chords = np.clip(np.floor(0.5 * sweep * radius / flat), 1.0, MOST_CHORDS)
    out = turn.out * radius[:, None]
    across = np.cross(turn.normal, out)
    rise = np.abs(turn.normal) * (turn.rise / chords)[:, None]
    return chords.astype(np.int64), sweep / chords, out, across, rise
