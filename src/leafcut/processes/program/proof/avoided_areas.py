"""Detect new moves across areas that the original program avoided, because an unknown clamp might be there.

Wherever the tool went in the original program, the space is clear down to that height. Anywhere else, and at any lower
height, there may be an obstacle.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import shapely

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind
from leafcut.processes.program.model import AvoidedAreas
from leafcut.proof.clearance import rows_at_machine_height

#: Points within this distance of an original move do not count as avoided, mm (half the width of a narrow clamp).
NEAR = 5.0
#: Tolerance for heights, mm (0.0001 inch is 0.00254 mm).
_ROOM = 0.003
#: Moves are checked at points with this spacing, mm.
_STEP = 1.0
#: Number of moves checked at a time.
_MOVES = 200
#: Moves under different work offsets are shifted apart by this distance, mm.
_APART = 1e7
#: Arcs are replaced by chords with at most this error, mm.
_CHORD_ERROR = 0.02


class _Moves(NamedTuple):
    """Straight moves of a program, stored in columns.

    Attributes
    ----------
    ends
        Start and end of each move, float64[n, 6], mm.
    row
        Row of each move in the program.
    crosses
        Whether each move is a sideways rapid at a known height.
    """

    ends: Floats
    row: Indices
    crosses: Mask

    def pick(self, which: Mask) -> _Moves:
        return _Moves(self.ends[which], self.row[which], self.crosses[which])


def find_avoided_areas(original: Program, new: Program, safe_z: float = 0.0) -> AvoidedAreas:
    """Detect rapids in a new program that cross an area lower than the original program ever did.

    `safe_z` is a height in machine coordinates, mm. After a move in machine coordinates to this height or above, the
    tool counts as retracted.
    """
    number: dict[object, int] = {}
    level = not any(np.isfinite(p.path.end[p.path.kind <= Kind.DRILL, 2]).any() for p in (original, new))
    was, now = (_moves_of(program, number, level, safe_z) for program in (original, new))
    kept = set(_rounded_ends(was.pick(was.crosses)))
    now = now.pick(now.crosses)
    now = now.pick(np.array([move not in kept for move in _rounded_ends(now)], dtype=bool))
    strange = _unproven_moves(was.ends, now.ends)
    if not strange.any():
        return AvoidedAreas()
    rows = np.unique(now.row[strange])
    across = np.hypot(*(was.ends[:, 3:5] - was.ends[:, :2]).T) > _ROOM
    top = float(was.ends[across][:, [2, 5]].max(initial=-np.inf))
    heights = now.ends[strange][:, [2, 5]].min(axis=1)
    line = int(new.path.line[rows].min())
    if level or float(heights.max()) >= top - _ROOM:
        return AvoidedAreas(len(rows), line)
    return AvoidedAreas(len(rows), line, top, float(heights.min()))


def _moves_of(program: Program, number: dict[object, int], level: bool, safe_z: float) -> _Moves:
    """Return the moves of a program. Moves under different work offsets are shifted apart.

    If the start of a move is unknown, only its end point is used. `level` means that neither program states Z. In that
    case, all moves are at Z0.
    """
    path = replace(program.path, line=np.arange(len(program.path), dtype=np.int32))
    if level:
        path = replace(path, end=np.column_stack([path.end[:, :2], np.zeros(len(path))]))
    path = expand_cycles(path)
    moves = convert_to_straight_moves(path, _CHORD_ERROR, np.inf)
    unknown = np.isin(moves.row, moves.unknown)
    ends = moves.ends.copy()
    ends[unknown, :3] = ends[unknown, 3:]
    sideways = np.hypot(*(ends[:, 3:5] - ends[:, :2]).T) > _ROOM
    row = path.line[moves.row].astype(np.int64)
    modals = program.before[program.row_block[row]]
    origin = {k: (program.modals[k].frame, program.modals[k].shift) for k in np.unique(modals).tolist()}
    shift = [number.setdefault(origin[k], len(number)) for k in modals.tolist()]
    ends[:, [0, 3]] += _APART * np.array(shift, dtype=np.float64)[:, None]
    return _Moves(ends, row, moves.rapid & sideways & ~rows_at_machine_height(path, safe_z)[moves.row])


def _rounded_ends(moves: _Moves) -> list[tuple[float, ...]]:
    return [tuple(move) for move in (moves.ends.round(3) + 0.0).tolist()]


def _unproven_moves(was: Floats, now: Floats) -> Mask:
    """Return a mask of the new moves that leave the space proved clear by the original program.

    Such a move has a point where no original move within the distance `NEAR` is at the same height or lower.
    """
    found = np.zeros(len(now), dtype=bool)
    lines: Any = np.asarray(shapely.linestrings(was.reshape(-1, 2, 3)[:, :, :2]))
    # A vertical move shows that its whole height range is clear.
    upright = (np.abs(was[:, 3:5] - was[:, :2]) <= _ROOM).all(axis=1)
    z = np.where(upright, np.minimum(was[:, 2], was[:, 5]), np.maximum(was[:, 2], was[:, 5]))
    begin, end, lowest = now[:, :2], now[:, 3:5], np.minimum(now[:, 2], now[:, 5])
    tree = shapely.STRtree(lines)
    for at in range(0, len(found), _MOVES):
        part = np.arange(at, min(at + _MOVES, len(found)))
        length = np.hypot(*(end[part] - begin[part]).T)
        count = np.ceil(length / _STEP).astype(np.int64) + 1
        move = np.repeat(part, count)
        step = (np.arange(len(move)) - np.repeat(np.cumsum(count) - count, count)) / np.repeat(count - 1, count)
        points = begin[move] + step[:, None] * (end[move] - begin[move])
        point, line = tree.query(shapely.points(points), predicate="dwithin", distance=NEAR)
        vouched = np.zeros(len(points), dtype=bool)
        vouched[point[z[line] <= lowest[move[point]] + _ROOM]] = True
        found[np.unique(move[~vouched])] = True
    return found
