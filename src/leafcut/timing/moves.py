"""The moves of a toolpath in columns: how far, which way, how fast; what look-ahead needs to know of each.

A move is one straight or round piece that takes time. Rows that do not move the tool are not here, but say where a
move has to end at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.machine import Machine
from leafcut.model.toolpath import SPEED_ALONE, Kind, Toolpath
from leafcut.timing.chords import Steps, joined_steps

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: How the moves of a row end: at rest, at rest but for tangents (G61), or rounded (G64).
REST, EXACT, BLEND = 0, 1, 2

#: Axes of the planes 17, 18, 19: first, second, normal, so that a counter-clockwise arc turns from first to second.
_AXES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])

#: Rows without a move that the machine does not stop for.
_FLOWING = (Kind.BLENDING, Kind.TORCH, Kind.HEIGHT)

#: A move shorter than this is rounding and has no direction, mm.
_SHORTEST = 1e-9

#: An arc that ends within this angle (rad) of its start goes all the way round (`model.toolpath.arc_sweep`).
_NO_TURN = 1e-9


class Turn(NamedTuple):
    """The round part of moves; zeros for a straight one.

    `radius` mm, `sweep` rad, never negative, `rise` mm along the axis of a helix, `normal` of the plane so that the
    turn is counter-clockwise about it, and unit vectors `out` from the centre to the start and `out_end` to the end.
    """

    radius: Floats
    sweep: Floats
    rise: Floats
    normal: Floats
    out: Floats
    out_end: Floats


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves in order: mm, mm/s, mm/s²; one entry a move.

    Attributes
    ----------
    row
        Row of the toolpath.
    length, velocity, limit, acceleration
        `velocity` is what is asked for, at most `limit`: what the axes can do along the move.
    start, end
        Unit tangents, float64[m, 3].
    turn
        The round part.
    rapid
        G0.
    mode, tolerance
        `REST`, `EXACT` or `BLEND` after the move; P of G64, 0 without.
    flushed
        Something else comes before the next move, and the machine stands still for it.
    """

    row: NDArray[np.int64]
    length: Floats
    velocity: Floats
    limit: Floats
    acceleration: Floats
    start: Floats
    end: Floats
    turn: Turn
    rapid: Flags
    mode: NDArray[np.int8]
    tolerance: Floats
    flushed: Flags

    def __len__(self) -> int:
        return len(self.row)

    def __getitem__(self, part: slice | NDArray[np.int64]) -> Moves:
        columns = {name: value[part] for name, value in vars(self).items() if name != "turn"}
        return Moves(turn=Turn(*(value[part] for value in self.turn)), **columns)


class Turns(NamedTuple):
    """All arcs of a path: their rows, length (mm; 0 where the start is not known) and round parts."""

    row: NDArray[np.int64]
    length: Floats
    plane: NDArray[np.int64]
    turn: Turn


def turns_of(path: Toolpath) -> Turns:
    """Return the arcs and helices of a path."""
    row = np.flatnonzero((path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW))
    n = len(row)
    used = [path.arcs[i] for i in path.ref[row].tolist()]
    plane = np.array([a.plane for a in used], dtype=np.int64).reshape(n) - 17
    centre = np.array([a.center for a in used], dtype=np.float64).reshape(n, 3)
    turns = np.array([a.turns for a in used], dtype=np.float64).reshape(n)
    axes = _AXES[plane]
    side = np.where(path.kind[row] == Kind.ARC_CCW, 1.0, -1.0)
    begin, end = path.before[row], path.end[row]
    flat0, flat1 = (np.take_along_axis(p - centre, axes[:, :2], axis=1) for p in (begin, end))
    angle0, angle1 = (np.arctan2(flat[:, 1], flat[:, 0]) for flat in (flat0, flat1))
    sweep = (side * (angle1 - angle0)) % math.tau
    sweep = np.where(sweep < _NO_TURN, math.tau, sweep) + math.tau * (turns - 1)
    rise = np.nan_to_num(np.take_along_axis(end - begin, axes[:, 2:], axis=1)[:, 0])
    radius = np.hypot(flat0[:, 0], flat0[:, 1])
    known = radius * sweep > _SHORTEST  # false, too, where the start is not known
    normal, out, out_end = (np.zeros((n, 3)) for _ in range(3))
    np.put_along_axis(normal, axes[:, 2:], side[:, None], axis=1)
    for vector, angle in ((out, angle0), (out_end, angle0 + side * sweep)):
        np.put_along_axis(vector, axes[:, :2], np.column_stack([np.cos(angle), np.sin(angle)]), axis=1)
    turn = Turn(radius, sweep, rise, normal, out, out_end)
    return Turns(row, np.where(known, np.hypot(radius * sweep, rise), 0.0), plane, turn)


def moves_of(
    path: Toolpath,
    machine: Machine,
    delta: Floats,
    turns: Turns,
    mode: NDArray[np.int8],
    tolerance: Floats,
    joining: Floats,
    cycle_s: float = 0.0,
) -> Moves:
    """Return the moves of a path without canned cycles.

    Parameters
    ----------
    delta
        What every row moves, float64[n, 3], mm.
    turns
        Its arcs.
    mode, tolerance, joining
        By row: how the move ends, and P and Q of G64 in mm.
    cycle_s
        A controller that plans at this interval lets no move be shorter.
    """
    steps = _steps(path, machine, delta, turns, mode, tolerance, joining)
    if np.any((steps.mode == BLEND) & (steps.joining > 0)):
        steps = joined_steps(steps, turns)
    length, limit, acceleration, start, end = _straight(steps, machine)
    turn = Turn(*(np.zeros((len(length), *column.shape[1:])) for column in turns.turn))
    at = np.flatnonzero(steps.arc >= 0)
    if len(at):
        which = steps.arc[at]
        for column, known in zip(turn, turns.turn, strict=True):
            column[at] = known[which]
        length[at] = turns.length[which]
        start[at], end[at] = _tangents(turns.turn, which, length[at])
        limit[at], acceleration[at] = _round_limits(turns, which, machine)
    limit = np.minimum(limit, length / cycle_s) if cycle_s else limit
    feed = np.where(steps.feed > 0, np.minimum(steps.feed, machine.max_feed), machine.max_feed)
    velocity = np.where(steps.rapid, limit, np.minimum(feed, limit))
    ends = (steps.mode, steps.tolerance, steps.flushed)
    return Moves(steps.row, length, velocity, limit, acceleration, start, end, turn, steps.rapid, *ends)


def _steps(
    path: Toolpath,
    machine: Machine,
    delta: Floats,
    turns: Turns,
    mode: NDArray[np.int8],
    tolerance: Floats,
    joining: Floats,
) -> Steps:
    """Return the rows that move, and whether anything stands between them."""
    arc_of = np.full(len(path), -1, dtype=np.int64)
    arc_of[turns.row[turns.length > 0]] = np.flatnonzero(turns.length > 0)
    rapid = (path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE)
    straight = rapid | (path.kind == Kind.FEED)
    row = np.flatnonzero((straight & (np.abs(delta) > _SHORTEST).any(axis=1)) | (arc_of >= 0))
    halts = ~(rapid | (path.kind <= Kind.ARC_CCW) | np.isin(path.kind, _FLOWING))
    if machine.controller.startswith("grbl") and machine.process == "laser":
        halts &= ~_changes_power(path)
    halted = np.cumsum(halts)[row]
    flushed = np.append(halted[1:] != halted[:-1], True)[: len(row)]
    columns = (mode[row], tolerance[row], joining[row])
    return Steps(row, delta[row], arc_of[row], path.value[row], rapid[row], *columns, flushed)


def _changes_power(path: Toolpath) -> Flags:
    """Return which rows only change the power of a beam in the block of a move: no reason to stop in laser mode.

    M3, M4 and M5 wait for the machine to stand, and so does an S without a move. Source: GRBL 1.1, laser mode ($32=1),
    gcode.c.
    """
    power = (path.kind == Kind.SPINDLE) & (path.ref == SPEED_ALONE)
    moves = np.append(path.kind[1:] <= Kind.ARC_CCW, False)
    same_block = np.append(path.line[1:] == path.line[:-1], False)
    changes: Flags = (power & moves & same_block)[: len(path)]
    return changes


def _straight(steps: Steps, machine: Machine) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return length, limits of velocity and acceleration, and tangents of straight moves."""
    moved = np.abs(steps.delta)
    length = np.sqrt((moved * moved).sum(axis=1))
    safe = np.where(length > 0, length, 1.0)
    with np.errstate(divide="ignore"):
        limit = safe / (moved / np.asarray(machine.rapid_velocity)).max(axis=1)
        acceleration = safe / (moved / np.asarray(machine.acceleration)).max(axis=1)
    unit = steps.delta / safe[:, None]
    return length, limit, acceleration, unit, unit.copy()


def _tangents(turn: Turn, which: NDArray[np.int64], length: Floats) -> tuple[Floats, Floats]:
    """Return the unit tangents at the start and at the end of helices of given length."""
    sweep, normal = turn.sweep[which, None], turn.normal[which]
    upwards = np.abs(normal) * turn.rise[which, None]
    along = [turn.radius[which, None] * sweep * np.cross(normal, out[which]) for out in (turn.out, turn.out_end)]
    return (along[0] + upwards) / length[:, None], (along[1] + upwards) / length[:, None]


def _round_limits(turns: Turns, which: NDArray[np.int64], machine: Machine) -> tuple[Floats, Floats]:
    """Return the velocity and the acceleration along helices that the slowest axis of their plane, and rise, allow."""
    axes = _AXES[turns.plane[which]]
    length = turns.length[which]
    flat = turns.turn.radius[which] * turns.turn.sweep[which]
    rise = np.abs(turns.turn.rise[which])
    limits = []
    for limit in (np.asarray(machine.rapid_velocity), np.asarray(machine.acceleration)):
        with np.errstate(divide="ignore"):
            limits.append(np.minimum(limit[axes[:, :2]].min(axis=1) * length / flat, limit[axes[:, 2]] * length / rise))
    return limits[0], limits[1]
