"""Find new moves across areas that the original avoided, where an unknown obstacle such as a clamp may stand.

A point that the original tool reached is clear down to that height; elsewhere or lower, there may be an obstacle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.model.cycles import approach_of
from leafcut.model.toolpath import Kind, Toolpath, arc_sweep
from leafcut.processes.program.model import AvoidedAreas
from leafcut.proof.clearance import at_machine_height

#: Distance from a move of the original within which an area is not avoided, mm (half the width of a narrow clamp).
NEAR = 5.0
#: Tolerance of heights, mm (0.0001 inch is 0.00254 mm).
_ROOM = 0.003
#: Distance between the points of a move that are examined, mm.
_STEP = 1.0
#: Number of moves examined at once.
_MOVES = 200
#: Shift between moves under different work offsets, so that they do not overlap, mm.
_APART = 1e7
#: Arcs are divided into chords of at most this angle, rad.
_ANGLE = 0.05


class _Ways(NamedTuple):
    """Straight moves: both ends, float64[n, 2], mm, and their rows.

    `z` is the greatest height of an original move, and the lowest of a new move.
    """

    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    z: NDArray[np.float64]
    row: NDArray[np.int64]


def avoided_areas(original: Program, new: Program, safe_z: float = 0.0) -> AvoidedAreas:
    """Return the rapids of a new program across areas where the original was never as low.

    `safe_z` is the machine height, mm, at or above which a tool is retracted after a move in machine coordinates.
    """
    number: dict[object, int] = {}
    level = not any(np.isfinite(p.path.end[p.path.kind <= Kind.DRILL, 2]).any() for p in (original, new))
    was, now = _visited(original, number, level), _rapids(new, number, level, safe_z)
    if not len(was.row) or not len(now.row):
        return AvoidedAreas()
    kept = set(_from_to(original, _rapids(original, number, level, safe_z), level))
    fresh = np.array([move not in kept for move in _from_to(new, now, level)], dtype=bool)
    now = _Ways(now.begin[fresh], now.end[fresh], now.z[fresh], now.row[fresh])
    strange = _unvouched(was, now)
    if not strange.any():
        return AvoidedAreas()
    rows = np.unique(now.row[strange])
    across = np.isfinite(was.z) & (np.hypot(*(was.end - was.begin).T) > _ROOM)
    top, highest = float(was.z[across].max(initial=-np.inf)), float(now.z[strange].max())
    below = top if not level and highest < top - _ROOM else None
    return AvoidedAreas(len(rows), int(new.path.line[rows].min()), below)


def _visited(program: Program, number: dict[object, int], level: bool) -> _Ways:
    """Return all moves of a program, including plunges, with the highest z of each."""
    path, before = program.path, _before(program.path, level)
    end = _leveled(path.end, level)
    moves = np.flatnonzero((path.kind <= Kind.ARC_CCW) & np.isfinite(end[:, :2]).all(axis=1))
    straight = moves[path.kind[moves] < Kind.ARC_CW]
    ways = [_of_rows(straight, before, end, np.maximum(before[straight, 2], end[straight, 2]))]
    # A vertical move proves its whole height range.
    down = straight[(np.abs(before[straight, :2] - end[straight, :2]) <= _ROOM).all(axis=1)]
    ways.append(_of_rows(down, before, end, np.minimum(before[down, 2], end[down, 2])))
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    if len(drills):
        level_z = approach_of(path, drills, before[drills, 2])[2]
        ways.append(_of_rows(drills, before, end, np.fmax(level_z, before[drills, 2])))
        bottom = np.array([cycle.bottom for cycle in path.cycles])[path.ref[drills]]
        ways.append(_of_rows(drills, end, end, bottom))
    ways.extend(_of_arc(path, before, row) for row in moves[path.kind[moves] >= Kind.ARC_CW].tolist())
    return _apart(_joined(ways), program, number)


def _rapids(program: Program, number: dict[object, int], level: bool, safe_z: float) -> _Ways:
    """Return the sideways rapids of a program at known heights, with the lowest z of each."""
    path, before = program.path, _before(program.path, level)
    end = _leveled(path.end, level)
    rapid = np.flatnonzero((path.kind == Kind.RAPID) & ~at_machine_height(path, safe_z))
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    ways = [_of_rows(rapid, before, end, np.minimum(before[rapid, 2], end[rapid, 2]))]
    if len(drills):
        ways.append(_of_rows(drills, before, end, approach_of(path, drills, before[drills, 2])[2]))
    found = _joined(ways)
    sideways = np.hypot(*(found.end - found.begin).T) > _ROOM
    keep = sideways & np.isfinite(found.z) & np.isfinite(found.begin).all(axis=1) & np.isfinite(found.end).all(axis=1)
    return _apart(_Ways(*(column[keep] for column in found)), program, number)


def _before(path: Toolpath, level: bool) -> NDArray[np.float64]:
    return _leveled(path.before, level)


def _leveled(places: NDArray[np.float64], level: bool) -> NDArray[np.float64]:
    """Return the points, with z = 0 for programs that never state Z."""
    return np.column_stack([places[:, :2], np.zeros(len(places))]) if level else places


def _of_rows(
    rows: NDArray[np.int64], before: NDArray[np.float64], end: NDArray[np.float64], z: NDArray[np.float64]
) -> _Ways:
    """Return straight moves; a move with unknown start is reduced to its end."""
    begin = np.where(np.isfinite(before[rows, :2]).all(axis=1, keepdims=True), before[rows, :2], end[rows, :2])
    return _Ways(begin, end[rows, :2], np.asarray(z, dtype=np.float64), rows)


def _of_arc(path: Toolpath, before: NDArray[np.float64], row: int) -> _Ways:
    """Return the chords of an arc in the XY plane; for other arcs, no moves."""
    arc = path.arcs[int(path.ref[row])]
    if arc.plane != 17 or not np.isfinite(before[row, :2]).all():
        return _of_rows(np.zeros(0, dtype=np.int64), before, path.end, np.zeros(0))
    radius, start, sweep = arc_sweep(path, row)
    count = max(2, int(abs(sweep) / _ANGLE) + 2)
    angle = start + np.linspace(0.0, sweep, count)
    points = np.column_stack([arc.center[0] + radius * np.cos(angle), arc.center[1] + radius * np.sin(angle)])
    highest = np.full(count - 1, np.fmax(before[row, 2], path.end[row, 2]))
    return _Ways(points[:-1], points[1:], highest, np.full(count - 1, row, dtype=np.int64))


def _joined(ways: Sequence[_Ways]) -> _Ways:
    return _Ways(*(np.concatenate(columns) for columns in zip(*ways, strict=True)))


def _apart(ways: _Ways, program: Program, number: dict[object, int]) -> _Ways:
    """Shift the moves of each work offset by a separate distance, since their coordinates are not comparable."""
    modals = program.before[program.row_block[ways.row]]
    of_modal = {}
    for k in np.unique(modals).tolist():
        modal = program.modals[k]
        of_modal[k] = number.setdefault((modal.frame, modal.shift), len(number))
    shift = _APART * np.array([of_modal[k] for k in modals.tolist()], dtype=np.float64)
    moved = np.column_stack([shift, np.zeros(len(shift))])
    return _Ways(ways.begin + moved, ways.end + moved, ways.z, ways.row)


def _from_to(program: Program, ways: _Ways, level: bool) -> list[tuple[float, ...]]:
    """Return the rounded start and end of each move in X, Y and Z, mm."""
    z = np.column_stack([_before(program.path, level)[ways.row, 2], _leveled(program.path.end, level)[ways.row, 2]])
    return [tuple(move) for move in (np.column_stack([ways.begin, ways.end, z]).round(3) + 0.0).tolist()]


def _unvouched(was: _Ways, now: _Ways) -> NDArray[np.bool_]:
    """Return the mask of new moves with a point that is not `NEAR` any original move at its height or lower."""
    found = np.zeros(len(now.row), dtype=bool)
    usable = np.isfinite(was.z) & np.isfinite(was.begin).all(axis=1) & np.isfinite(was.end).all(axis=1)
    lines: NDArray[Any] = np.asarray(shapely.linestrings(np.stack([was.begin[usable], was.end[usable]], axis=1)))
    z = was.z[usable]
    tree = shapely.STRtree(lines)
    for at in range(0, len(found), _MOVES):
        part = np.arange(at, min(at + _MOVES, len(found)))
        length = np.hypot(*(now.end[part] - now.begin[part]).T)
        count = np.ceil(length / _STEP).astype(np.int64) + 1
        move = np.repeat(part, count)
        step = (np.arange(len(move)) - np.repeat(np.cumsum(count) - count, count)) / np.repeat(count - 1, count)
        points = now.begin[move] + step[:, None] * (now.end[move] - now.begin[move])
        point, line = tree.query(shapely.points(points), predicate="dwithin", distance=NEAR)
        vouched = np.zeros(len(points), dtype=bool)
        vouched[point[z[line] <= now.z[move[point]] + _ROOM]] = True
        found[np.unique(move[~vouched])] = True
    return found
