"""Sequential exchanges of up to five edges, found depth first along candidate edges (Lin and Kernighan's idea).

A move removes k edges and adds k: t0–t1 goes, t1–t2 comes, t2–t3 goes, … and t(2k-1)–t0 closes the tour. It is looked
for without touching the tour: whether it leaves one tour is read off the sorted places of the 2k nodes, so steps that
cut the tour in pieces on the way are no obstacle. Only a move that improves is made; then all but the longest piece
is written anew, and what was overwritten goes to a log from which it can be taken back.

Source: S. Lin and B. W. Kernighan, Operations Research 21 (1973); K. Helsgaun, European J. Operational Research 126
(2000), section 5 (sequential 5-opt moves as basis), and Mathematical Programming Computation 1 (2009), section 3
(feasibility by sorting).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON, kernel
from leafcut.kernels.cost import CostModel, travel

#: Most edges that one move exchanges.
DEPTH = 5


class Tour(NamedTuple):
    """A tour being worked on, and all that a search in it needs; one object per worker.

    ======== =============== ==========================================================================
    node     int32[n]        nodes in the order of the tour
    place    int32[n]        where each node stands in it
    queue    int32[n]        ring buffer of nodes worth looking at; counts[0] is its first, counts[1] how many
    queued   uint8[n]        1 for nodes in the queue
    counts   int64[4]        queue's first, queue's length, entries in the log, 1 when the log was too small
    log      int32[m, 2]     (place, node that stood there) of everything overwritten
    buffer   int32[n]        pieces on their way
    ends     int32[2·DEPTH]  t0, t1, … of the move
    order    int32[2·DEPTH]  indices into `ends`, by place
    rank     int32[2·DEPTH]  inverse of `order`
    key      int64[2·DEPTH]  what they are sorted by
    gain     float64[DEPTH]  gain of the edges exchanged down to each depth
    tried    int32[DEPTH]    how far the candidates at each depth have been tried
    ======== =============== ==========================================================================
    """

    node: NDArray[np.int32]
    place: NDArray[np.int32]
    queue: NDArray[np.int32]
    queued: NDArray[np.uint8]
    counts: NDArray[np.int64]
    log: NDArray[np.int32]
    buffer: NDArray[np.int32]
    ends: NDArray[np.int32]
    order: NDArray[np.int32]
    rank: NDArray[np.int32]
    key: NDArray[np.int64]
    gain: NDArray[np.float64]
    tried: NDArray[np.int32]


@kernel
def push(tour: Tour, node: int) -> None:
    """Put a node into the queue, if it is not there. Changes: queue, queued, counts."""
    if tour.queued[node] == 0:
        tour.queued[node] = 1
        n = len(tour.queue)
        tail = tour.counts[0] + tour.counts[1]
        tour.queue[tail - n if tail >= n else tail] = node
        tour.counts[1] += 1


@kernel
def pop(tour: Tour) -> int:
    """Take the first node out of the queue. Changes: queued, counts."""
    first = tour.counts[0]
    node = tour.queue[first]
    tour.counts[0] = first + 1 if first + 1 < len(tour.queue) else 0
    tour.counts[1] -= 1
    tour.queued[node] = 0
    return node


@kernel
def after(tour: Tour, node: int) -> int:
    """Return the node that follows."""
    at = tour.place[node] + 1
    return tour.node[at if at < len(tour.node) else 0]


@kernel
def before(tour: Tour, node: int) -> int:
    """Return the node that precedes."""
    return tour.node[tour.place[node] - 1]


@kernel
def sort_ends(tour: Tour, k: int) -> None:
    """Sort the 2k ends of the k removed edges by place, from just behind the first removed edge round to its front.

    Even ranks then begin a piece of the tour and odd ranks end one; a piece of one node has both, the beginning first.
    Changes: order, rank, key.
    """
    n = len(tour.node)
    ends, key, order, rank = tour.ends, tour.key, tour.order, tour.rank
    p0, p1 = tour.place[ends[0]], tour.place[ends[1]]
    base = p1 if p1 == p0 + 1 or (p0 == n - 1 and p1 == 0) else p0
    for e in range(k):
        a = tour.place[ends[2 * e]] - base
        b = tour.place[ends[2 * e + 1]] - base
        if a < 0:
            a += n
        if b < 0:
            b += n
        # The one that stands later begins a piece, the other ends one; the first edge closes the circle.
        begins_b = (a == n - 1) if e == 0 else (b == a + 1)
        key[2 * e] = 2 * a + (1 if begins_b else 0)
        key[2 * e + 1] = 2 * b + (0 if begins_b else 1)
    for i in range(2 * k):
        j = i
        while j > 0 and key[order[j - 1]] > key[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i
    for i in range(2 * k):
        rank[order[i]] = i


@kernel
def partner(i: int, k: int) -> int:
    """Return the index of the end that end i is joined to: t1–t2, t3–t4, …, t(2k-1)–t0."""
    if i == 0:
        return 2 * k - 1
    if i == 2 * k - 1:
        return 0
    return i + 1 if i % 2 == 1 else i - 1


@kernel
def is_one_tour(tour: Tour, k: int) -> bool:
    """Return whether the move in `ends` leaves one tour. Changes: order, rank, key."""
    sort_ends(tour, k)
    rank, pieces = 0, 0
    while True:
        pieces += 1
        rank = tour.rank[partner(tour.order[rank ^ 1], k)]
        if rank == 0:
            return pieces == k


@kernel
def _put(tour: Tour, at: int, node: int) -> None:
    """Write a node to a place and log what stood there. Changes: node, place, log, counts."""
    old = tour.node[at]
    if old == node:
        return
    entry = tour.counts[2]
    if entry < len(tour.log):
        tour.log[entry, 0] = at
        tour.log[entry, 1] = old
        tour.counts[2] = entry + 1
    else:
        tour.counts[3] = 1
    tour.node[at] = node
    tour.place[node] = at


@kernel
def make_move(tour: Tour, k: int) -> None:
    """Make the move in `ends`, whose ends are sorted: keep the longest piece, write the others behind it.

    Changes: node, place, log, counts, buffer.
    """
    n = len(tour.node)
    longest, most = 0, -1
    for piece in range(k):
        first = tour.place[tour.ends[tour.order[2 * piece]]]
        last = tour.place[tour.ends[tour.order[2 * piece + 1]]]
        length = last - first
        if length < 0:
            length += n
        if length > most:
            longest, most = piece, length
    # Leave the longest piece at its end and copy the pieces in the order in which the new tour meets them.
    at = tour.place[tour.ends[tour.order[2 * longest + 1]]]
    rank = tour.rank[partner(tour.order[2 * longest + 1], k)]
    filled = 0
    while rank != 2 * longest:
        here = tour.place[tour.ends[tour.order[rank]]]
        there = tour.place[tour.ends[tour.order[rank ^ 1]]]
        step = 1 if rank % 2 == 0 else -1
        while True:
            tour.buffer[filled] = tour.node[here]
            filled += 1
            if here == there:
                break
            here += step
            if here == n:
                here = 0
            elif here < 0:
                here = n - 1
        rank = tour.rank[partner(tour.order[rank ^ 1], k)]
    for i in range(filled):
        at += 1
        if at == n:
            at = 0
        _put(tour, at, tour.buffer[i])


@kernel
def take_back(tour: Tour) -> None:
    """Undo everything in the log, last first, and empty it. Changes: node, place, counts."""
    for entry in range(tour.counts[2] - 1, -1, -1):
        at, node = tour.log[entry, 0], tour.log[entry, 1]
        tour.node[at] = node
        tour.place[node] = at
    tour.counts[2] = 0


@kernel
def _is_new(tour: Tour, depth: int, c: int, d: int) -> bool:
    """Return whether the edge c–d is not among the edges removed so far."""
    for e in range(depth):
        a, b = tour.ends[2 * e], tour.ends[2 * e + 1]
        if (a == c and b == d) or (a == d and b == c):
            return False
    return True


@kernel
def improving_move(
    cost: CostModel, tour: Tour, candidates: NDArray, lengths: NDArray, breadth: NDArray, t0: int
) -> float:
    """Look for a move that begins at t0 and improves; make it and return its gain, or return 0.

    ========== =============== ==========================================================
    candidates int32[n, k]     neighbours of every node, nearest first, -1 for none
    lengths    float64[n, k]   costs of those edges
    breadth    int32[DEPTH]    candidates tried at each depth; entry 0 is not used
    ========== =============== ==========================================================

    Changes: tour.
    """
    ends, gain, tried = tour.ends, tour.gain, tour.tried
    for direction in range(2):
        ends[0] = t0
        ends[1] = after(tour, t0) if direction == 0 else before(tour, t0)
        gain[0] = travel(cost, t0, ends[1])
        depth = 1
        tried[1] = 0
        while depth > 0:
            last = ends[2 * depth - 1]
            choice = tried[depth] >> 1
            forward = (tried[depth] & 1) == 0
            tried[depth] += 1
            if choice >= breadth[depth]:
                depth -= 1
                continue
            c = candidates[last, choice]
            if c < 0:
                depth -= 1
                continue
            left = gain[depth - 1] - lengths[last, choice]
            if left <= EPSILON:
                depth -= 1
                continue
            next_c, previous_c = after(tour, c), before(tour, c)
            if last in (next_c, previous_c):
                tried[depth] |= 1  # an edge of the tour: both ways are no use
                tried[depth] += 1
                continue
            d = next_c if forward else previous_c
            if not _is_new(tour, depth, c, d):
                continue
            ends[2 * depth], ends[2 * depth + 1] = c, d
            total = left + travel(cost, c, d)
            closed = total - travel(cost, d, t0)
            if closed > EPSILON and is_one_tour(tour, depth + 1):
                make_move(tour, depth + 1)
                for i in range(2 * depth + 2):
                    push(tour, ends[i])
                return closed
            if depth + 1 < DEPTH:
                gain[depth] = total
                depth += 1
                tried[depth] = 0
    return 0.0


@kernel
def improve_queued(
    cost: CostModel, tour: Tour, candidates: NDArray, lengths: NDArray, breadth: NDArray, max_nodes: int
) -> float:
    """Make improving moves at the nodes in the queue until it is empty, the log full, or `max_nodes` were looked at.

    Return the sum of the gains. Changes: tour.
    """
    total = 0.0
    looked = 0
    while tour.counts[1] > 0 and tour.counts[3] == 0 and looked < max_nodes:
        node = pop(tour)
        looked += 1
        while True:
            gained = improving_move(cost, tour, candidates, lengths, breadth, node)
            if gained == 0.0:
                break
            total += gained
    return total
