"""Find touching cuts whose order has changed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, Mask
from leafcut.processes.program.proof.traces import Traces, touching
from leafcut.proof.difference import MOST_LISTED

#: Maximum number of pieces in a cell that are all compared with each other.
_FEW = 16
#: Maximum number of compared pairs; beyond it, the order counts as unproved.
_MOST_PAIRS = 60_000_000
_MOST_LEVELS = 64
_CHUNK = 200_000

#: Lower or upper bounds of pieces along several directions, mm.
Reach = NDArray[np.float32]


def inverted(traces: Traces, rank: Indices, tolerance: float) -> tuple[Indices, bool]:
    """Return the pairs of touching features in changed order, int64[k, 2], and whether the search is complete.

    The originally earlier feature comes first. `rank` is the position of each feature in the new program, int64[n], -1
    if it is missing. The pieces are split into smaller and smaller cells; a cell whose pieces keep their order needs no
    comparison.
    """
    kept = rank[traces.feature] >= 0
    if not kept.all():
        traces = traces.pick(np.flatnonzero(kept))
    place = rank[traces.feature]
    low, high = _extents(traces, tolerance)
    entry, cell = np.arange(len(place)), np.zeros(len(place), dtype=np.int64)
    found: list[Indices] = []
    looked = count = 0
    for _ in range(_MOST_LEVELS):
        entry, cell = _with_inversions(entry, cell, place)
        if not len(entry):
            return _unique(found), True
        few, many, split = _split(entry, cell, low, high)
        for one, other in (*_near_pairs(entry[few], cell[few], place), *_all_pairs(entry[many], cell[many], place)):
            looked += len(one)
            if looked > _MOST_PAIRS:
                return _unique(found), False
            touch = touching(traces.pick(one), traces.pick(other), tolerance)
            pairs = np.column_stack([traces.feature[one], traces.feature[other]])[touch]
            found.append(pairs)
            count += len(pairs)
            if count > 20 * MOST_LISTED:
                return _unique(found), True
        entry, cell = split
    return _unique(found), False


def _unique(found: list[Indices]) -> Indices:
    return np.unique(np.concatenate(found), axis=0) if found else np.zeros((0, 2), dtype=np.int64)


def _extents(traces: Traces, tolerance: float) -> tuple[Reach, Reach]:
    """Return the bounds along x, y and along and across the prevailing direction, float32[k, 4] each."""
    along = traces.end - traces.begin
    angle = np.arctan2(along[:, 1], along[:, 0]) % math.pi
    length = np.hypot(*along.T)
    weight = np.bincount((angle * 180 / math.pi).astype(np.int64) % 180, weights=length, minlength=180)
    weight[[0, 89, 90, 179]] = 0.0
    best = int(np.argmax(weight))
    chosen = (angle * 180 / math.pi).astype(np.int64) % 180 == best
    main = float(np.average(angle[chosen], weights=length[chosen])) if weight[best] > 0 else math.pi / 4
    turned = (0.0, math.pi / 2, main, main + math.pi / 2)
    directions = np.array([(math.cos(a), math.sin(a)) for a in turned]).T
    room = traces.bow + 0.5 * tolerance + 1e-9
    # Single precision is enough if the bounds are rounded outwards.
    low, high = (np.empty((len(room), directions.shape[1]), dtype=np.float32) for _ in range(2))
    for k, direction in enumerate(directions.T):
        ends = traces.begin @ direction, traces.end @ direction
        low[:, k] = np.minimum(*ends) - room
        high[:, k] = np.maximum(*ends) + room
    return np.nextafter(low, np.float32(-np.inf), out=low), np.nextafter(high, np.float32(np.inf), out=high)


def _with_inversions(entry: Indices, cell: Indices, place: Indices) -> tuple[Indices, Indices]:
    """Return the entries of the cells that contain a changed order, with renumbered cells."""
    order = np.argsort(cell, kind="stable")
    entry, cell = entry[order], cell[order]
    together = cell[1:] == cell[:-1]
    falls = together & (place[entry[1:]] < place[entry[:-1]])
    number = np.cumsum(np.concatenate([[0], ~together]))[: len(cell)]
    bad = np.zeros(int(number[-1]) + 1 if len(number) else 0, dtype=bool)
    bad[number[1:][falls]] = True
    stays = bad[number]
    return entry[stays], (np.cumsum(bad) - 1)[number[stays]]


def _split(entry: Indices, cell: Indices, low: Reach, high: Reach) -> tuple[Mask, Mask, tuple[Indices, Indices]]:
    """Return the masks of entries in small cells and in unsplittable cells, and the other cells in halves."""
    begins = np.flatnonzero(np.diff(cell, prepend=-1))
    size = np.diff(np.append(begins, len(cell)))
    middle = 0.5 * (low[entry] + high[entry])
    mean = np.add.reduceat(middle, begins, axis=0) / size[:, None]
    left, right = low[entry] <= mean[cell], high[entry] >= mean[cell]
    sizes = [np.add.reduceat(side.astype(np.int64), begins, axis=0) for side in (left, right)]
    most, both = np.maximum(*sizes), sizes[0] + sizes[1]
    best = np.argmin(both + most, axis=1)
    cells = np.arange(len(begins))
    few = size <= _FEW
    many = ~few & ((most[cells, best] >= size) | (both[cells, best] > 1.7 * size))
    rows = np.flatnonzero(~(few | many)[cell])
    side = best[cell[rows]]
    to_left, to_right = rows[left[rows, side]], rows[right[rows, side]]
    halves = (
        np.concatenate([entry[to_left], entry[to_right]]),
        np.concatenate([2 * cell[to_left], 2 * cell[to_right] + 1]),
    )
    return few[cell], many[cell], halves


IndexPair = tuple[Indices, Indices]


def _near_pairs(entry: Indices, cell: Indices, place: Indices) -> Iterator[IndexPair]:
    """Yield the inverted pairs within small cells."""
    for apart in range(1, _FEW):
        rows = np.flatnonzero(cell[apart:] == cell[:-apart]) if len(cell) > apart else np.zeros(0, dtype=np.int64)
        yield from _inverted(entry[rows], entry[rows + apart], place)


def _all_pairs(entry: Indices, cell: Indices, place: Indices) -> Iterator[IndexPair]:
    """Yield the inverted pairs within large cells."""
    if not len(entry):
        return
    begins = np.flatnonzero(np.diff(cell, prepend=-1))
    for begin, end in zip(begins.tolist(), [*begins[1:].tolist(), len(cell)], strict=True):
        members = entry[begin:end]
        rows = max(1, _CHUNK // len(members))
        for first in range(0, len(members), rows):
            some = members[first : first + rows]
            one, other = np.meshgrid(some, members, indexing="ij")
            later = other.ravel() > one.ravel()
            yield from _inverted(one.ravel()[later], other.ravel()[later], place)


def _inverted(one: Indices, other: Indices, place: Indices) -> Iterator[IndexPair]:
    rows = np.flatnonzero(place[one] > place[other])
    for begin in range(0, len(rows), _CHUNK):
        chunk = rows[begin : begin + _CHUNK]
        yield one[chunk], other[chunk]
