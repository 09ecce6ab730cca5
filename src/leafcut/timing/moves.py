"""The moves of a toolpath as columns, with the data that the look-ahead needs: length, direction, speed, and so on.

Rows that do not move the tool are left out. They only determine which moves must end at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import SPEED_ALONE, Kind, Toolpath
from leafcut.model.turns import AXES, SHORTEST, Turn, Turns

#: How a move ends: at a stop, on the exact path with tangent transitions (G61), or blended into the next move (G64).
REST, EXACT, BLEND = 0, 1, 2

#: The machine does not stop at rows of these kinds if they contain no move.
_FLOWING = (Kind.BLENDING, Kind.TORCH, Kind.HEIGHT)


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves in the order in which they run, one entry per move, in mm, mm/s, and mm/s².

    Attributes
    ----------
    row
        Row in the toolpath.
    length, velocity
        Length and requested speed of the move.
    limit, acceleration
        Maximum speed that the axes allow along the move, and acceleration along the move.
    start, end
        Unit tangents at the start and the end of the move, float64[m, 3].
    turn
        Geometry of arcs and helices.
    mode, tolerance
        End mode (`REST`, `EXACT`, or `BLEND`) and the P value of G64 in mm. 0 if G64 has no P.
    flushed
        True if the machine stops before the next move to execute another command.
    """

    row: NDArray[np.int64]
    length: Floats
    velocity: Floats
    limit: Floats
    acceleration: Floats
    start: Floats
    end: Floats
    turn: Turn
    rapid: Mask
    mode: NDArray[np.int8]
    tolerance: Floats
    flushed: Mask

    def __len__(self) -> int:
        return len(self.row)

    def __getitem__(self, part: slice | NDArray[np.int64]) -> Moves:
        columns = {name: value[part] for name, value in vars(self).items() if name != "turn"}
        return Moves(turn=Turn(*(value[part] for value in self.turn)), **columns)


class MovingRows(NamedTuple):
    """The rows of a toolpath that move the tool, one entry per move.

    Attributes
    ----------
    row
        Row in the toolpath.
    delta
        Displacement, float64[m, 3], mm.
    arc
        Index of the arc. -1 for a straight move.
    feed, rapid
        Feed in mm/s, and whether the move is a rapid.
    mode, tolerance, joining
        End mode (`REST`, `EXACT`, or `BLEND`), and the P and Q values of G64 in mm.
    flushed
        True if the machine stops before the next move.
    """

    row: NDArray[np.int64]
    delta: NDArray[np.float64]
    arc: NDArray[np.int64]
    feed: NDArray[np.float64]
    rapid: NDArray[np.bool_]
    mode: NDArray[np.int8]
    tolerance: NDArray[np.float64]
    joining: NDArray[np.float64]
    flushed: NDArray[np.bool_]

    def select(self, rows: NDArray[np.int64]) -> MovingRows:
        """Select moves by index. An index may occur more than once."""
        return MovingRows(*(column[rows] for column in self))  # type: ignore[arg-type]  # each column keeps its type


class Corners(NamedTuple):
    """The corner after each move. After the last move, the machine is at rest.

    Attributes
    ----------
    speed
        Maximum speed at the corner in mm/s. It is 0 for a stop, and infinite if a corner arc limits the speed instead.
    arc_length, arc_speed, arc_acceleration
        Length (mm), maximum speed (mm/s), and acceleration (mm/s²) of the corner arc. The length is 0 if the corner has
        no arc.
    trim
        Length in mm that the arc cuts off both adjacent moves.
    held_back
        Fraction of the acceleration that both adjacent moves reserve for the bend.
    overlapped
        True if the next move starts while the previous move is still decelerating. Each of the two moves then has half
        the acceleration.
    """

    speed: Floats
    arc_length: Floats
    arc_speed: Floats
    arc_acceleration: Floats
    trim: Floats
    held_back: Floats
    overlapped: Mask


def corners_without_arcs(speed: Floats) -> Corners:
    """Create corners that only limit the speed, without arcs or overlaps."""
    zeros = np.zeros(len(speed))
    return Corners(speed, zeros, zeros, zeros, zeros, zeros, np.zeros(len(speed), dtype=np.bool_))


def extract_moves(
    path: Toolpath,
    machine: Machine,
    delta: Floats,
    turns: Turns,
    mode: NDArray[np.int8],
    tolerance: Floats,
    joining: Floats,
    cycle_s: float = 0.0,
) -> Moves:
    """Extract the moves from a path without canned cycles.

    Parameters
    ----------
    delta
        Displacement of each row, float64[n, 3], mm.
    mode, tolerance, joining
        End mode of each row, and the P and Q values of G64 in mm.
    cycle_s
        Planning interval of the controller in seconds. No move takes less time than this.
    """
    steps = _moving_rows(path, machine, delta, turns, mode, tolerance, joining)
    if np.any((steps.mode == BLEND) & (steps.joining > 0)):
        steps = _merge_moves(steps, turns)
    length, limit, acceleration, start, end = _straight_lengths_limits_and_directions(steps, machine)
    turn = Turn(*(np.zeros((len(length), *column.shape[1:])) for column in turns.turn))
    on_arc = np.flatnonzero(steps.arc >= 0)
    if len(on_arc):
        turn_rows = steps.arc[on_arc]
        for column, turn_column in zip(turn, turns.turn, strict=True):
            column[on_arc] = turn_column[turn_rows]
        length[on_arc] = turns.length[turn_rows]
        start[on_arc], end[on_arc] = _arc_tangents(turns.turn, turn_rows, length[on_arc])
        limit[on_arc], acceleration[on_arc] = _arc_limits(turns, turn_rows, machine)
    limit = np.minimum(limit, length / cycle_s) if cycle_s else limit
    feed = np.where(steps.feed > 0, np.minimum(steps.feed, machine.max_feed), machine.max_feed)
    velocity = np.where(steps.rapid, limit, np.minimum(feed, limit))
    ends = (steps.mode, steps.tolerance, steps.flushed)
    return Moves(steps.row, length, velocity, limit, acceleration, start, end, turn, steps.rapid, *ends)


def _merge_moves(steps: MovingRows, turns: Turns) -> MovingRows:
    """Merge straight moves with equal feeds and replace shallow arcs with chords, within the limits that G64 sets.

    Source: LinuxCNC documentation, G64 ("naive CAM detector", which also applies to arcs in the XY plane).
    """
    from leafcut.kernels.chords import merge_chords

    steps = _flat_arcs_as_chords(steps, turns)
    mergeable = (steps.arc < 0) & ~steps.rapid & (steps.joining > 0)
    joins = np.zeros(len(mergeable), dtype=np.bool_)
    joins[1:] = mergeable[1:] & mergeable[:-1] & ~steps.flushed[:-1]
    joins[1:] &= (steps.feed[1:] == steps.feed[:-1]) & (steps.joining[1:] == steps.joining[:-1])
    if not joins.any():
        return steps
    point = np.zeros((len(mergeable) + 1, 3))
    np.cumsum(steps.delta, axis=0, out=point[1:])
    starts = np.empty(len(mergeable), dtype=np.bool_)
    merge_chords(point, joins, steps.joining, starts)
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(mergeable)) - 1
    return steps.select(first)._replace(delta=point[last + 1] - point[first], flushed=steps.flushed[last])


def _flat_arcs_as_chords(steps: MovingRows, turns: Turns) -> MovingRows:
    """Replace an arc with two chords if it sweeps less than a quarter turn and its bulge is below Q."""
    arc, turn = steps.arc, turns.turn
    if not len(turns.row):
        return steps
    bulge = turn.radius * (1.0 - np.cos(0.5 * turn.sweep))
    flat = (arc >= 0) & (bulge[arc] < steps.joining) & (turn.sweep[arc] < 0.5 * np.pi) & (turns.plane[arc] == 0)
    if not flat.any():
        return steps
    result = steps.select(np.repeat(np.arange(len(arc)), 1 + flat))
    second = np.flatnonzero(np.repeat(flat, 1 + flat))[1::2]
    arcs = arc[flat]
    middle = turn.out[arcs] + turn.out_end[arcs]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    half_rise = 0.5 * np.abs(turn.normal[arcs]) * turn.rise[arcs, None]
    radius = turn.radius[arcs, None]
    result.delta[second - 1] = radius * (middle - turn.out[arcs]) + half_rise
    result.delta[second] = radius * (turn.out_end[arcs] - middle) + half_rise
    result.flushed[second - 1] = False
    result.arc[second] = -1
    result.arc[second - 1] = -1
    return result


def _moving_rows(
    path: Toolpath,
    machine: Machine,
    delta: Floats,
    turns: Turns,
    mode: NDArray[np.int8],
    tolerance: Floats,
    joining: Floats,
) -> MovingRows:
    arc_of = np.full(len(path), -1, dtype=np.int64)
    arc_of[turns.row[turns.length > 0]] = np.flatnonzero(turns.length > 0)
    rapid = (path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE)
    straight = rapid | (path.kind == Kind.FEED)
    row = np.flatnonzero((straight & (np.abs(delta) > SHORTEST).any(axis=1)) | (arc_of >= 0))
    halts = ~(rapid | (path.kind <= Kind.ARC_CCW) | np.isin(path.kind, _FLOWING))
    if machine.control.startswith("grbl") and machine.head is Head.LASER:
        halts &= ~laser_power_changes(path)
    halted = np.cumsum(halts)[row]
    flushed = np.append(halted[1:] != halted[:-1], True)[: len(row)]
    columns = (mode[row], tolerance[row], joining[row])
    return MovingRows(row, delta[row], arc_of[row], path.value[row], rapid[row], *columns, flushed)


def laser_power_changes(path: Toolpath) -> Mask:
    """Mark the rows that only change the laser power within the block of a move.

    The machine does not stop at these rows. Source: GRBL 1.1, laser mode ($32=1), gcode.c.
    """
    power = (path.kind == Kind.SPINDLE) & (path.ref == SPEED_ALONE)
    moves = np.append(path.kind[1:] <= Kind.ARC_CCW, False)
    same_block = np.append(path.line[1:] == path.line[:-1], False)
    changes: Mask = (power & moves & same_block)[: len(path)]
    return changes


def _straight_lengths_limits_and_directions(
    steps: MovingRows, machine: Machine
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    moved = np.abs(steps.delta)
    length = np.sqrt((moved * moved).sum(axis=1))
    safe = np.where(length > 0, length, 1.0)
    with np.errstate(divide="ignore"):
        limit = safe / (moved / np.asarray(machine.rapid_velocity)).max(axis=1)
        acceleration = safe / (moved / np.asarray(machine.acceleration)).max(axis=1)
    unit = steps.delta / safe[:, None]
    return length, limit, acceleration, unit, unit.copy()


def _arc_tangents(turn: Turn, rows: NDArray[np.int64], length: Floats) -> tuple[Floats, Floats]:
    sweep, normal = turn.sweep[rows, None], turn.normal[rows]
    upwards = np.abs(normal) * turn.rise[rows, None]
    along = [turn.radius[rows, None] * sweep * np.cross(normal, out[rows]) for out in (turn.out, turn.out_end)]
    return (along[0] + upwards) / length[:, None], (along[1] + upwards) / length[:, None]


def _arc_limits(turns: Turns, rows: NDArray[np.int64], machine: Machine) -> tuple[Floats, Floats]:
    axes = AXES[turns.plane[rows]]
    length = turns.length[rows]
    flat = turns.turn.radius[rows] * turns.turn.sweep[rows]
    rise = np.abs(turns.turn.rise[rows])
    limits = []
    for limit in (np.asarray(machine.rapid_velocity), np.asarray(machine.acceleration)):
        with np.errstate(divide="ignore"):
            limits.append(np.minimum(limit[axes[:, :2]].min(axis=1) * length / flat, limit[axes[:, 2]] * length / rise))
    return limits[0], limits[1]
