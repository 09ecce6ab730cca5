"""Passes of a mill whose width nobody says: levels, a finishing pass beside its roughing, rows that clear a surface.

Where the width is known, whatever comes nearer than that keeps its order. Where it is not, this keeps what would load
or break the tool if it changed places, and leaves free what is at one depth and apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.geometry.index import NearLines, unique_pairs
from leafcut.model.sequence import PieceOfWork
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.sections.program_rows import Rows

#: A mill of unknown width is taken to be so wide, mm: half an inch, which few routers and no desktop machines exceed.
SUPPOSED_WIDTH = 12.7
#: What roughing leaves for finishing is no more than this, mm.
_ALLOWANCE = 1.0
#: Depths that differ by less are one, mm.
_LEVEL = 0.01
#: A cut of which less lies at its lowest place follows a surface.
_MOSTLY_LEVEL = 0.25
#: Rows that clear a surface lie no farther apart, mm, and are so many at least.
_WIDEST_ROW, _LEAST_ROWS = 100.0, 3

_Path = tuple[int, NDArray[np.float64]]
_Lines = tuple[NDArray[np.object_], NDArray[np.int64]]


def passes_in_order(
    program: Program,
    rows: Rows,
    ones: Sequence[PieceOfWork],
    others: Sequence[PieceOfWork],
    short_lines: Sequence[tuple[NearLines, NDArray[np.int64]]],
) -> Iterator[NDArray[np.int64]]:
    """Yield int64[k, 2], pairs of a piece of `ones` and one of `others` whose order has meaning to a mill.

    These are cuts at different depths nearer than `SUPPOSED_WIDTH`, but for those that both follow a surface, and for
    two holes; and cuts at one depth that run side by side nearer than an allowance, unless both are closed.

    Parameters
    ----------
    short_lines
        Short lines of `ones`, with the number of the piece of each, and those of `others`.
    """
    (near, owner), (other_near, other_owner) = short_lines
    one = _Shapes(program, rows, ones)
    other = one if others is ones else _Shapes(program, rows, others)

    def deeper(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        a, b = owner[a], other_owner[b]
        chosen = _apart(one, a, other, b) & ~(one.follows[a] & other.follows[b])
        return chosen & ~(one.still[a] & other.still[b])

    def alike(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        a, b = owner[a], other_owner[b]
        chosen = ~_apart(one, a, other, b) & ~one.still[a] & ~other.still[b] & ~(one.closed[a] & other.closed[b])
        chosen &= ~(one.follows[a] & other.follows[b])
        return chosen & (a != b) if ones is others else chosen

    depths = np.concatenate([one.bottom, other.bottom])
    if np.fmax.reduce(depths) - np.fmin.reduce(depths) > _LEVEL:
        for a, b in near.pairs(other_near, SUPPOSED_WIDTH, deeper):
            yield unique_pairs(owner[a], other_owner[b])
    for a, b in near.pairs(other_near, _ALLOWANCE, alike):
        pairs = unique_pairs(owner[a], other_owner[b])
        yield pairs[_side_by_side((near.lines, owner), (other_near.lines, other_owner), pairs)]


def _apart(one: _Shapes, a: NDArray[np.int64], other: _Shapes, b: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether pieces lie at different depths; not where a depth is not known."""
    different: NDArray[np.bool_] = np.abs(one.bottom[a] - other.bottom[b]) > _LEVEL
    return different


def rows_in_order(paths: Sequence[_Path], pieces: Sequence[PieceOfWork]) -> NDArray[np.int64]:
    """Return int64[k, 2], pairs of pieces that follow each other as rows that clear a surface, evenly to one side."""
    straight: dict[int, NDArray[np.float64]] = {}
    several: set[int] = set()
    for number, points in paths:
        if number in straight or number in several:
            straight.pop(number, None)
            several.add(number)
            continue
        length = float(np.hypot(*np.diff(points, axis=0).T).sum())
        if 0.0 < length <= 1.01 * float(np.hypot(*(points[-1] - points[0]))):
            straight[number] = points[[0, -1]]
    found: list[tuple[int, int]] = []
    run: list[tuple[int, int]] = []
    last = 0.0
    for number in range(1, len(pieces)):
        step = math.nan
        if number - 1 in straight and number in straight and abs(_fall(pieces, number)) <= _LEVEL:
            step = _step(straight[number - 1], straight[number])
        if not run or math.isnan(step) or step * last < 0 or abs(step) > 1.05 * abs(last):
            found += run if len(run) + 1 >= _LEAST_ROWS else []
            run = []
        if not math.isnan(step):
            run.append((number - 1, number))
            last = step
    found += run if len(run) + 1 >= _LEAST_ROWS else []
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _fall(pieces: Sequence[PieceOfWork], number: int) -> float:
    return pieces[number].bottom - pieces[number - 1].bottom


def _step(row: NDArray[np.float64], follower: NDArray[np.float64]) -> float:
    """Return how far a straight line lies to the left of another, mm, seen along +x or +y; NaN where it is no row."""
    along, other = row[1] - row[0], follower[1] - follower[0]
    length = float(np.hypot(*along))
    along = along / length
    if along[0] < -1e-9 or (abs(along[0]) <= 1e-9 and along[1] < 0):
        along = -along
    across = np.array([-along[1], along[0]])
    apart = float((follower.mean(axis=0) - row.mean(axis=0)) @ across)
    beside = min(np.max(row @ along), np.max(follower @ along)) - max(np.min(row @ along), np.min(follower @ along))
    shorter = min(length, float(np.hypot(*other)))
    even = abs(float(other @ across)) <= 0.02 * float(np.hypot(*other))
    wide = _LEVEL < abs(apart) <= min(_WIDEST_ROW, shorter)
    return apart if even and wide and beside >= 0.5 * shorter else math.nan


class _Shapes:
    """What pieces are like, an entry for each: how deep, and whether drilled, closed, or following a surface."""

    def __init__(self, program: Program, rows: Rows, pieces: Sequence[PieceOfWork]) -> None:
        n = len(pieces)
        self.bottom = np.array([c.bottom for c in pieces], dtype=np.float64)
        self.still, self.closed, self.follows = (np.zeros(n, dtype=bool) for _ in range(3))
        path = program.path
        for number, piece in enumerate(pieces):
            part = slice(int(program.first[piece.begin]), int(program.first[piece.end]))
            end, before = path.end[part], rows.before[part]
            arcs = np.isin(path.kind[part], [int(Kind.ARC_CW), int(Kind.ARC_CCW)])
            moved = rows.cut[part] & (rows.sideways[part] | arcs) & (path.kind[part] != Kind.DRILL)
            self.still[number] = not moved.any()
            if self.still[number]:
                continue
            length = np.maximum(np.hypot(*(end - before)[:, :2].T), np.where(arcs, 1e-3, 0.0))
            level = moved & (end[:, 2] <= piece.bottom + _LEVEL) & (before[:, 2] <= piece.bottom + _LEVEL)
            self.follows[number] = length[level].sum() < _MOSTLY_LEVEL * length[moved].sum()
            at = np.flatnonzero(moved)
            gap = end[at[-1], :2] - before[at[0], :2]
            self.closed[number] = bool(np.hypot(*gap) <= _ALLOWANCE)


def _side_by_side(one: _Lines, other: _Lines, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return bool[k]: whether half of the shorter of two pieces lies within the allowance of the other."""
    if not len(pairs):
        return np.zeros(0, dtype=bool)
    (a, in_a), (b, in_b) = (np.unique(column, return_inverse=True) for column in pairs.T)
    shapes = np.concatenate([_joined(*one, a), _joined(*other, b)])
    lengths = shapely.length(shapes)
    left, right = in_a.ravel(), in_b.ravel() + len(a)
    turn = lengths[left] > lengths[right]
    shorter, longer = np.where(turn, right, left), np.where(turn, left, right)
    around = np.full(len(shapes), None, dtype=object)
    used = np.unique(longer)
    around[used] = shapely.buffer(shapes[used], _ALLOWANCE, quad_segs=4)
    within = shapely.length(shapely.intersection(shapes[shorter], around[longer]))
    beside: NDArray[np.bool_] = within >= 0.5 * lengths[shorter]
    return beside


def _joined(lines: NDArray[np.object_], owner: NDArray[np.int64], pieces: NDArray[np.int64]) -> NDArray[np.object_]:
    """Return the lines of each piece as one shape, without what is a place only."""
    mine = np.flatnonzero(np.isin(owner, pieces) & (shapely.get_type_id(lines) == 1))
    shapes = np.full(len(pieces), shapely.MultiLineString(), dtype=object)
    numbers = np.searchsorted(pieces, owner[mine])
    if len(mine):
        shapely.multilinestrings(lines[mine], indices=numbers, out=shapes)
    return shapes
