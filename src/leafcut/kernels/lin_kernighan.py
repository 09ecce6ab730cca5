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

from leafcut.kernels import EPSILON, kernel, part
from leafcut.kernels.cost import CostModel, is_straight, straight, travel

#: Most edges that one move exchanges.
DEPTH = 5

#: In `Tour.queued`: not in the queue, and not to be pushed.
WAITING = 2

#: Rows of `Tour.move`.
ENDS, ORDER, RANK, KEY = 0, 1, 2, 3


class Tour(NamedTuple):
    """A tour being worked on, and all that a search in it needs; one object per worker.

    ======== =============== ==========================================================================
    node     int32[n]        nodes in the order of the tour
    place    int32[n]        where each node stands in it
    queue    int32[n]        ring buffer of nodes worth looking at; counts[0] is its first, counts[1] how many
    queued   uint8[n]        1 for nodes in the queue, WAITING for those whose move was too long for the buffer
    counts   int64[4]        queue's first, queue's length, entries in the log, 1 when the log was too small
    log      int32[m, 2]     (place, node that stood there) of everything overwritten; m = 0 where no log is kept
    buffer   int32[b]        pieces on their way; a move that writes more places is not made
    move     int64[4, 2·DEPTH]  of a move: rows ENDS t0, t1, …; ORDER, their indices by place; RANK, its inverse; KEY
    gain     float64[DEPTH]  gain of the edges exchanged down to each depth
    tried    int64[DEPTH]    how far the candidates at each depth have been tried
    ======== =============== ==========================================================================
    """

    node: NDArray[np.int32]
    place: NDArray[np.int32]
    queue: NDArray[np.int32]
    queued: NDArray[np.uint8]
    counts: NDArray[np.int64]
    log: NDArray[np.int32]
    buffer: NDArray[np.int32]
    move: NDArray[np.int64]
    gain: NDArray[np.float64]
    tried: NDArray[np.int64]


@part
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
    return int(node)


@part
def after(node: NDArray, place: NDArray, v: int) -> int:
    """Return the node that follows v."""
    at = place[v] + 1
    return int(node[at if at < len(node) else 0])


@part
def before(node: NDArray, place: NDArray, v: int) -> int:
    """Return the node that precedes v."""
    return int(node[place[v] - 1])


@part
def sort_ends(place: NDArray, move: NDArray, k: int) -> None:
    """Sort the 2k ends of the k removed edges by place, from just behind the first removed edge round to its front.

    Even ranks then begin a piece of the tour and odd ranks end one; a piece of one node has both, the beginning first.
    Changes: rows ORDER, RANK, KEY of move.
    """
    n = len(place)
    p0, p1 = place[move[ENDS, 0]], place[move[ENDS, 1]]
    base = p1 if p1 == p0 + 1 or (p0 == n - 1 and p1 == 0) else p0
    for e in range(k):
        a = place[move[ENDS, 2 * e]] - base
        b = place[move[ENDS, 2 * e + 1]] - base
        if a < 0:
            a += n
        if b < 0:
            b += n
        # The one that stands later begins a piece, the other ends one; the first edge closes the circle.
        begins_b = (a == n - 1) if e == 0 else (b == a + 1)
        move[KEY, 2 * e] = 2 * a + (1 if begins_b else 0)
        move[KEY, 2 * e + 1] = 2 * b + (0 if begins_b else 1)
    for i in range(2 * k):
        j = i
        value = move[KEY, i]
        while j > 0 and move[KEY, move[ORDER, j - 1]] > value:
            move[ORDER, j] = move[ORDER, j - 1]
            j -= 1
        move[ORDER, j] = i
    for i in range(2 * k):
        move[RANK, move[ORDER, i]] = i


@part
def next_piece(move: NDArray, rank: int, k: int) -> int:
    """Return the rank at which the new tour enters the next piece, after it entered one at `rank`.

    It leaves the piece at its other end, which is joined to a partner: t1–t2, t3–t4, …, t(2k-1)–t0.
    """
    i = move[ORDER, rank ^ 1]
    if i == 0:
        return int(move[RANK, 2 * k - 1])
    if i == 2 * k - 1:
        return int(move[RANK, 0])
    return int(move[RANK, i + 1 if i % 2 == 1 else i - 1])


@part
def is_one_tour(place: NDArray, move: NDArray, k: int) -> bool:
    """Return whether the move leaves one tour. Changes: rows ORDER, RANK, KEY of move."""
    sort_ends(place, move, k)
    rank, pieces = 0, 0
    while True:
        pieces += 1
        rank = next_piece(move, rank, k)
        if rank == 0:
            return pieces == k


@part
def make_move(tour: Tour, k: int) -> bool:
    """Make the move, whose ends are sorted: keep the longest piece, write the others behind it.

    Return whether there was room for it; without, nothing is changed, and counts[3] is set if a log is kept.
    Changes: node, place, log, counts, buffer.
    """
    node, place, move = tour.node, tour.place, tour.move
    n = len(node)
    longest, most = 0, -1
    for piece in range(k):
        length = place[move[ENDS, move[ORDER, 2 * piece + 1]]] - place[move[ENDS, move[ORDER, 2 * piece]]]
        if length < 0:
            length += n
        if length > most:
            longest, most = piece, length
    logged = len(tour.log) > 0
    if n - most - 1 > (len(tour.log) - tour.counts[2] if logged else len(tour.buffer)):
        tour.counts[3] = 1 if logged else 0
        return False
    # Copy the pieces in the order in which the new tour meets them behind the longest one.
    rank = next_piece(move, 2 * longest, k)
    filled = 0
    while rank != 2 * longest:
        here = place[move[ENDS, move[ORDER, rank]]]
        there = place[move[ENDS, move[ORDER, rank ^ 1]]]
        step = 1 if rank % 2 == 0 else -1
        tour.buffer[filled] = node[here]
        filled += 1
        while here != there:
            here += step
            if here == n:
                here = 0
            elif here < 0:
                here = n - 1
            tour.buffer[filled] = node[here]
            filled += 1
        rank = next_piece(move, rank, k)
    at = place[move[ENDS, move[ORDER, 2 * longest + 1]]]
    entry = tour.counts[2]
    for i in range(filled):
        at += 1
        if at == n:
            at = 0
        new = tour.buffer[i]
        if node[at] != new:
            if logged:
                tour.log[entry, 0], tour.log[entry, 1] = at, node[at]
                entry += 1
            node[at] = new
            place[new] = at
    tour.counts[2] = entry
    return True


@part
def take_back(tour: Tour) -> None:
    """Undo everything in the log, last first, and empty it. Changes: node, place, counts."""
    for entry in range(tour.counts[2] - 1, -1, -1):
        at, v = tour.log[entry, 0], tour.log[entry, 1]
        tour.node[at] = v
        tour.place[v] = at
    tour.counts[2] = 0


@part
def _is_new(move: NDArray, depth: int, c: int, d: int) -> bool:
    """Return whether the edge c–d is not among the edges removed so far."""
    for e in range(depth):
        a, b = move[ENDS, 2 * e], move[ENDS, 2 * e + 1]
        if (a == c and b == d) or (a == d and b == c):
            return False
    return True


@part
def find_move(
    cost: CostModel,
    node: NDArray,
    place: NDArray,
    move: NDArray,
    gain: NDArray,
    tried: NDArray,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    t0: int,
) -> int:
    """Look for an improving move that begins at t0; return its number of edges, or 0. Its gain is in gain[0].

    ========== =============== ==========================================================
    candidates int32[n, k]     neighbours of every node, nearest first, -1 for none
    lengths    float64[n, k]   costs of those edges
    breadth    int64[DEPTH]    candidates tried at each depth; entry 0 is not used
    ========== =============== ==========================================================

    Changes: move, gain, tried.
    """
    quick, code, xy = is_straight(cost), cost.code, cost.xy
    special = (cost.free, cost.tied_a, cost.tied_b)  # at hand: `is_special` would be handed the cost model
    for direction in range(2):
        t1 = after(node, place, t0) if direction == 0 else before(node, place, t0)
        move[ENDS, 0], move[ENDS, 1] = t0, t1
        gain[0] = travel(cost, t0, t1)
        depth = 1
        tried[1] = 0
        while depth > 0:
            last = move[ENDS, 2 * depth - 1]
            choice = tried[depth] >> 1
            forward = (tried[depth] & 1) == 0
            if choice >= breadth[depth] or candidates[last, choice] < 0:
                depth -= 1
                continue
            c = candidates[last, choice]
            left = gain[depth - 1] - lengths[last, choice]
            if left <= EPSILON:
                depth -= 1
                continue
            tried[depth] += 1
            following, preceding = after(node, place, c), before(node, place, c)
            if last in (following, preceding):
                tried[depth] += 1  # an edge of the tour: neither way is of use
                continue
            d = following if forward else preceding
            if not _is_new(move, depth, c, d):
                continue
            move[ENDS, 2 * depth], move[ENDS, 2 * depth + 1] = c, d
            total = left + (
                straight(xy, code, c, d) if quick and c not in special and d not in special else travel(cost, c, d)
            )
            closed = total - (
                straight(xy, code, d, t0) if quick and d not in special and t0 not in special else travel(cost, d, t0)
            )
            # With two edges the way round decides; with more, the order of the places.
            if closed > EPSILON and (
                forward == (direction == 1) if depth == 1 else is_one_tour(place, move, depth + 1)
            ):
                if depth == 1:
                    sort_ends(place, move, 2)
                gain[0] = closed
                return depth + 1
            if depth + 1 < DEPTH:
                gain[depth] = total
                depth += 1
                tried[depth] = 0
    return 0


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
        v = pop(tour)
        looked += 1
        while True:
            k = find_move(
                cost, tour.node, tour.place, tour.move, tour.gain, tour.tried, candidates, lengths, breadth, v
            )
            if k == 0:
                break
            if not make_move(tour, k):
                if tour.counts[3] == 1:
                    push(tour, v)
                else:
                    tour.queued[v] = WAITING
                break
            total += tour.gain[0]
            for i in range(2 * k):
                push(tour, tour.move[ENDS, i])
    return total
