"""Inner and outer: what lies inside a closed cut, and was made before it was closed or after, must still be.

An outer cut frees what is inside it; and a finishing pass may lie inside the roughing that came before it."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

import numpy as np

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.processes.program.proof.traces import Traces, distances
from leafcut.proof.difference import MOST_LISTED

#: A cut is closed when it comes back to within this of where it has been, mm: text has three decimals, or four of an
#: inch, and both ends of an arc are rounded.
_CLOSED = 0.01
#: Parts of an eighth of a turn in the outline of an arc: it differs from the arc by 0.0003 of the radius.
_HALVINGS = 4
#: A run of more pieces is closed only where one of its corners is met again; a shorter one where it crosses itself.
_MOST_PIECES = 1500
#: Places times lines that are looked at together.
_AT_ONCE = 1_000_000


def exchanged(
    traces: Traces, places: Floats, run: Indices, rank: Indices, *, inner_may_come_first: bool = False
) -> list[tuple[int, int]]:
    """Return (inner, outer) features that have changed places: outer is a run of cuts that closes around inner.

    `places` are those of the features seen from above, float64[n, 2]; `run` numbers the runs of cuts without a rapid
    in between, int64[n], rising; `rank` is as for `touching_order.inverted`. With `inner_may_come_first` only
    what was inside before and is now made too late counts: a beam does no roughing.
    """
    n = int(run[-1]) + 1 if len(run) else 0
    first = np.searchsorted(run, np.arange(n))
    last = np.searchsorted(run, np.arange(n), side="right") - 1
    begins, ends = rank[first], np.full(n, -1)
    np.maximum.at(ends, run, rank)
    # Only a run that some other one was before, and is after now, or the other way round, can matter.
    latest = np.maximum.accumulate(np.concatenate([[-1], begins]))[:n]
    soonest = np.minimum.accumulate(np.concatenate([[len(rank)], np.where(begins < 0, len(rank), begins)[::-1]]))[:n]
    pieces = np.searchsorted(traces.feature, [first, last + 1])
    moved = (latest > ends) | (soonest[::-1] < ends)
    candidates = np.flatnonzero(moved & (ends >= 0) & (np.diff(pieces, axis=0)[0] > 1))
    spots = places[first]
    by_x = np.argsort(spots[:, 0], kind="stable")
    by_x = by_x[np.isfinite(spots[by_x]).all(axis=1)]
    xs = spots[by_x, 0]
    found: list[tuple[int, int]] = []
    for outer in candidates.tolist():
        part = slice(int(pieces[0, outer]), int(pieces[1, outer]))
        bow = traces.bow[part].max()
        corners = np.concatenate([traces.begin[part], traces.end[part]])
        low, high = corners.min(axis=0) - bow, corners.max(axis=0) + bow
        slab = by_x[np.searchsorted(xs, low[0]) : np.searchsorted(xs, high[0], side="right")]
        later = begins[slab] > ends[outer]
        within = slab[(slab != outer) & (later == (slab < outer)) & (begins[slab] >= 0)]
        if inner_may_come_first:
            within = within[within < outer]
        within = within[(spots[within, 1] >= low[1]) & (spots[within, 1] <= high[1])]
        if not len(within):
            continue
        inside = _enclosed(spots[within], traces.pick(np.arange(part.start, part.stop)))
        found += [(int(first[inner]), int(last[outer])) for inner in within[inside].tolist()]
        if len(found) > MOST_LISTED:
            break
    return found


def _enclosed(spots: Floats, traces: Traces) -> Mask:
    """Return which places lie inside any loop of a run of cuts."""
    inside = np.zeros(len(spots), dtype=bool)
    for loop in loops_in(outline_of(traces)):
        inside |= within_loop(spots, loop)
    return inside


def outline_of(traces: Traces) -> Floats:
    """Return the corners of a run of cuts in order, arcs as many short lines."""
    for _ in range(_HALVINGS if (traces.arc >= 0).any() else 0):
        traces = traces.halved().pick(_needed(traces))
    return np.concatenate([traces.begin[:1], traces.end])


def _needed(traces: Traces) -> Indices:
    """Return which halves count: both of an arc, one of a straight piece, which is not halved."""
    both = np.repeat(traces.arc >= 0, 2)
    return np.flatnonzero(both | (np.arange(len(both)) % 2 == 0))


def loops_in(outline: Floats) -> Iterator[Floats]:
    """Yield the closed parts of a line, float64[k, 2]: where it meets an earlier corner, else where it meets itself."""
    closed = False
    stack: list[int] = []
    at: dict[tuple[int, int], int] = {}
    cells = np.floor(outline / _CLOSED).astype(np.int64).tolist()
    for corner, (x, y) in enumerate(cells):
        around = [(x + i, y + j) for i in (0, -1, 1) for j in (0, -1, 1)]
        met = next((at[key] for key in around if key in at and _near(outline, at[key], corner)), None)
        if met is not None:
            depth = bisect_left(stack, met)  # the corners on the stack rise
            loop = stack[depth:]
            if len(loop) > 2:
                closed = True
                yield outline[loop]
            for gone in loop[1:]:
                at.pop((cells[gone][0], cells[gone][1]), None)
            del stack[depth + 1 :]
        else:
            stack.append(corner)
            at[(x, y)] = corner
    if not closed and 3 < len(outline) <= _MOST_PIECES:
        yield from _crossings(outline)


def _near(outline: Floats, one: int, other: int) -> bool:
    return bool(np.abs(outline[one] - outline[other]).max() <= _CLOSED)


def _crossings(outline: Floats) -> Iterator[Floats]:
    """Yield the parts of a line between the places where it crosses or touches itself."""
    begin, end = outline[:-1], outline[1:]
    low, high = np.minimum(begin, end) - _CLOSED, np.maximum(begin, end)
    meet = np.triu((low[:, None] <= high).all(axis=2) & (low <= high[:, None]).all(axis=2), 2)
    one, other = np.nonzero(meet)
    touch = distances(begin[one], end[one], begin[other], end[other]) <= _CLOSED
    one, other = one[touch], other[touch]
    # Of all that a part meets, the first closes the largest loop and the last the smallest one.
    for firsts, lasts in ((one, other), (one[::-1], other[::-1])):
        last, at = np.unique(lasts, return_index=True)
        for begins, ends in zip(firsts[at].tolist(), last.tolist(), strict=True):
            where = _crossing(begin[begins], end[begins], begin[ends], end[ends])
            yield np.concatenate([where[None], outline[begins + 1 : ends + 1]])


def _crossing(begin: Floats, end: Floats, other_begin: Floats, other_end: Floats) -> Floats:
    """Return where one straight line meets another, float64[2]; its end where they are parallel."""
    along, other = end - begin, other_end - other_begin
    across = along[0] * other[1] - along[1] * other[0]
    apart = other_begin - begin
    part = (apart[0] * other[1] - apart[1] * other[0]) / across if abs(across) > 1e-12 else 1.0
    met: Floats = begin + min(max(part, 0.0), 1.0) * along
    return met


def within_loop(spots: Floats, loop: Floats) -> Mask:
    """Return which places lie inside a closed line, by how often a ray to the right crosses it."""
    begin, end = loop, np.roll(loop, -1, axis=0)
    rows = max(1, _AT_ONCE // max(len(loop), 1))
    inside = [_ray_odd(spots[k : k + rows], begin, end) for k in range(0, len(spots), rows)]
    return np.concatenate(inside) if inside else np.zeros(0, dtype=bool)


def _ray_odd(spots: Floats, begin: Floats, end: Floats) -> Mask:
    """Return for which places a ray to the right crosses an odd number of lines."""
    x, y = spots.T
    spot, line = np.nonzero((begin[:, 1] > y[:, None]) != (end[:, 1] > y[:, None]))
    a, b = begin[line], end[line]
    crossing = a[:, 0] + (y[spot] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    odd: Mask = np.bincount(spot[crossing > x[spot]], minlength=len(spots)) % 2 == 1
    return odd
