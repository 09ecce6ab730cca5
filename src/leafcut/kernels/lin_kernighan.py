"""Improve tours by sequential exchanges of up to five edges (Lin and Kernighan's idea).

The search goes depth first along candidate edges.

A move removes k edges and adds k edges: it removes t0–t1, adds t1–t2, removes t2–t3, and so on, until t(2k-1)–t0 closes
the tour. The search itself does not change the tour. The sorted positions of the 2k nodes show whether the move yields
a single tour, so intermediate steps may split the tour. Only moves that improve the tour are made. A move rewrites all
pieces except the longest, and logs the overwritten entries so that it can be undone.

Source: S. Lin and B. W. Kernighan, Operations Research 21 (1973). K. Helsgaun, European J. Operational Research 126
(2000), section 5 (sequential 5-opt moves as basis), and Mathematical Programming Computation 1 (2009), section 3
(feasibility by sorting).

A kick is a small local change to a good tour, followed by this search at the affected nodes only. The effort for a kick
and its repair does not depend on the size of the tour. If the result is worse, the log is used to undo it.

Source: O. Martin, S. W. Otto and E. W. Felten, Operations Research Letters 11 (1992) (the double bridge). D. Applegate,
W. Cook and A. Rohe, INFORMS J. Computing 15 (2003), section 3 (local kicks, no global work per kick).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON, inner_kernel, kernel, typed_constant
from leafcut.kernels.cost import CostModel, node_travel_cost, straight_travel_cost, uses_straight_cost
from leafcut.kernels.random import random_below

#: A move exchanges at most this many edges.
DEPTH = 5

#: A kick moves pieces of at most this length. Shorter pieces soon produce no new tours, and longer pieces are seldom
#: repaired.
LONGEST_PIECE = 50

#: Value in `Tour.queued` for a node that is not in the queue and must not be added to it.
WAITING = 2

#: Bit sets that contain a 1 for each move that yields a single tour. A key selects the bit. Each edge that is removed
#: after t0–t1 adds to the key: first `on` from `find_move`, then a bit for each edge removed earlier, which is 1 if
#: that edge starts closer to t1. There are 4 valid moves of three edges, 20 of four, and 148 of five. Keys for five
#: edges have ten bits. The last four bits select a number, and the other bits select a bit of this number.
LEAVES_3, LEAVES_4 = 0x1E, 0x1E030D50406678
LEAVES_5 = np.array([
    0x1E66020AB0C07800, 0x1E780107E0801E78, 0x1050000040000000, 0x1040000010400000, 0x0E030D0000000000,
    0x0E0D0E0D00000000, 0x1E00000000000000, 0x1E1E000000000000, 0x661E, 0x66, 0x501090D0, 0x50F0A0,
    0x30E00000904, 0x300000F0C, 0x1E030D50406678, 0x0,
])  # fmt: skip

#: Numbers of edges that a move may exchange, as constants.
TWO, THREE, FOUR, FIVE = typed_constant(2), typed_constant(3), typed_constant(4), typed_constant(5)
#: Maximum number of nodes to examine after a kick. In practice, this limit is never reached.
NO_LIMIT = typed_constant(1_000_000)

#: Rows of `Tour.move`.
ENDS, ORDER, RANK, KEY = 0, 1, 2, 3


class Tour(NamedTuple):
    """A tour that is being improved, and the state of the search. Each worker has its own object.

    ======== =============== ==========================================================================
    node     int32[n]        nodes in the order of the tour
    place    int32[n]        position of each node in the tour
    queue    int32[n]        ring buffer of nodes to examine; counts[0] is its start, counts[1] its length
    queued   uint8[n]        1 for nodes in the queue, WAITING for those whose move was too long for the buffer
    counts   int64[4]        start and length of the queue, entries in the log, 1 if the log was too small
    log      int32[m, 2]     (position, previous node) for every overwritten entry; m = 0 without a log
    buffer   int32[b]        pieces being moved; moves that write more than b positions are not made
    move     int64[4, 2·DEPTH]  of a move: rows ENDS t0, t1, …; ORDER, their indices by position; RANK, its inverse; KEY
    gain     float64[1]      gain of a move
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


@inner_kernel
def push_to_queue(work: Any, v: int) -> None:
    """Append a node to the queue of a `Tour` or a `Route`, unless it is already in the queue.

    Changes: queue, queued, counts.
    """
    if work.queued[v] == 0:
        work.queued[v] = 1
        n = len(work.queue)
        tail = work.counts[0] + work.counts[1]
        work.queue[tail - n if tail >= n else tail] = v
        work.counts[1] += 1


@inner_kernel
def pop_from_queue(work: Any) -> int:
    """Remove the first node from the queue of a `Tour` or a `Route`, and return it. Changes: queued, counts."""
    first = work.counts[0]
    v = work.queue[first]
    work.counts[0] = first + 1 if first + 1 < len(work.queue) else 0
    work.counts[1] -= 1
    work.queued[v] = 0
    return int(v)


@inner_kernel
def successor(node: NDArray, place: NDArray, v: int) -> int:
    """Return the successor of v."""
    at = place[v] + 1
    return int(node[at if at < len(node) else 0])


@inner_kernel
def predecessor(node: NDArray, place: NDArray, v: int) -> int:
    """Return the predecessor of v."""
    return int(node[place[v] - 1])


@inner_kernel
def reverse_positions(node: NDArray, place: NDArray, first: int, last: int) -> int:
    """Reverse positions first … last of the tour. If fewer positions lie outside this range, reverse those instead.

    If last < first, the range wraps around. Returns the number of reversed positions. Changes: node, place.
    """
    n = len(node)
    size = last - first + 1
    if size <= 0:
        size += n
    if 2 * size > n:
        first, last, size = last + 1, first - 1, n - size
        if first == n:
            first = 0
        if last < 0:
            last = n - 1
    for _ in range(size // 2):
        a, b = node[first], node[last]
        node[first], place[b] = b, first
        node[last], place[a] = a, last
        first += 1
        if first == n:
            first = 0
        last -= 1
        if last < 0:
            last = n - 1
    return int(size)


@inner_kernel
def sort_removed_ends(place: NDArray, move: NDArray, k: int) -> None:
    """Sort the 2k ends of the k removed edges by position, starting right after the first removed edge.

    In this order, an end with an even rank is the start of a piece of the tour, and the next end is the end of the same
    piece. A piece with a single node appears as two ends.
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
        # The later end is the start of a piece, the other the end of one. For the first edge, positions wrap around.
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


@inner_kernel
def next_entered_piece(move: NDArray, rank: int, k: int) -> int:
    """Return the rank at which the new tour enters its next piece, given that it entered the current piece at `rank`.

    The tour leaves the current piece at the other end. From there, an added edge (t1–t2, t3–t4, … or t(2k-1)–t0) leads
    to the next piece.
    """
    i = move[ORDER, rank ^ 1]
    if i == 0:
        return int(move[RANK, 2 * k - 1])
    if i == 2 * k - 1:
        return int(move[RANK, 0])
    return int(move[RANK, i + 1 if i % 2 == 1 else i - 1])


@inner_kernel
def is_single_tour(place: NDArray, move: NDArray, k: int) -> bool:
    """Check whether the move yields a single tour. Changes: rows ORDER, RANK, KEY of move."""
    sort_removed_ends(place, move, k)
    rank, pieces = 0, 0
    while True:
        pieces += 1
        rank = next_entered_piece(move, rank, k)
        if rank == 0:
            return pieces == k


@inner_kernel
def make_move(tour: Tour, k: int) -> bool:
    """Make a move whose ends are sorted.

    The longest piece of the tour stays, and the other pieces are written after it. Returns whether the buffer and the
    log had enough space. If not, the tour does not change. If a log exists, counts[3] is set.
    Changes: node, place, log, counts, buffer.
    """
    node, place, move = tour.node, tour.place, tour.move
    n = len(node)
    longest, longest_length = 0, -1
    for piece in range(k):
        length = place[move[ENDS, move[ORDER, 2 * piece + 1]]] - place[move[ENDS, move[ORDER, 2 * piece]]]
        if length < 0:
            length += n
        if length > longest_length:
            longest, longest_length = piece, length
    logged = len(tour.log) > 0
    if n - longest_length - 1 > (len(tour.log) - tour.counts[2] if logged else len(tour.buffer)):
        tour.counts[3] = 1 if logged else 0
        return False
    # Copy the pieces in the order in which the new tour visits them after the longest piece.
    rank = next_entered_piece(move, 2 * longest, k)
    filled = 0
    while rank != 2 * longest:
        index = place[move[ENDS, move[ORDER, rank]]]
        stop = place[move[ENDS, move[ORDER, rank ^ 1]]]
        step = 1 if rank % 2 == 0 else -1
        tour.buffer[filled] = node[index]
        filled += 1
        while index != stop:
            index += step
            if index == n:
                index = 0
            elif index < 0:
                index = n - 1
            tour.buffer[filled] = node[index]
            filled += 1
        rank = next_entered_piece(move, rank, k)
    position = place[move[ENDS, move[ORDER, 2 * longest + 1]]]
    entry = tour.counts[2]
    for i in range(filled):
        position += 1
        if position == n:
            position = 0
        new = tour.buffer[i]
        if node[position] != new:
            if logged:
                tour.log[entry, 0], tour.log[entry, 1] = position, node[position]
                entry += 1
            node[position] = new
            place[new] = position
    tour.counts[2] = entry
    return True


@inner_kernel
def undo_logged_changes(tour: Tour) -> None:
    """Undo all entries of the log, most recent first, and empty the log. Changes: node, place, counts."""
    for entry in range(tour.counts[2] - 1, -1, -1):
        at, v = tour.log[entry, 0], tour.log[entry, 1]
        tour.node[at] = v
        tour.place[v] = at
    tour.counts[2] = 0


@inner_kernel
def _is_removed(ends: NDArray, last: int, c: int, d: int) -> bool:
    for e in range(0, 2 * last + 1, 2):
        a, b = ends[e], ends[e + 1]
        if (a == c and b == d) or (a == d and b == c):
            return True
    return False


@inner_kernel
def _is_either(a: int, b: int, v: int) -> bool:
    """Check whether v is a or b. `v in (a, b)` takes three times as long to compile."""
    return not (v != a and v != b)


@inner_kernel
def _is_ordinary_node(free: int, tied_a: int, tied_b: int, v: int) -> bool:
    return v != free and v != tied_a and v != tied_b


@inner_kernel
def edge_and_closing_cost(cost: CostModel, c: int, d: int, t0: int, leaves: bool) -> tuple[float, float]:
    """Compute the cost of travel from c to d, and from d to t0.

    If the move does not yield a single tour, the second cost is ∞. Machine times are slow to compute. Skipping them for
    impossible moves makes a kick 5 % faster.
    """
    return node_travel_cost(cost, c, d), node_travel_cost(cost, d, t0) if leaves else math.inf


@inner_kernel
def neighbours_of_position(node: NDArray, at: int) -> tuple[int, int]:
    """Return the node after a position and the node before it."""
    return node[at + 1 if at + 1 < len(node) else 0], node[at - 1]


@inner_kernel
def count_positions_between(at: int, start: int, direction: int, n: int) -> int:
    """Count the positions from `start` to `at`, going forward (direction 0) or backward (direction 1)."""
    r = at - start if direction == 0 else start - at
    return r if r >= 0 else r + n


@inner_kernel
def store_move(place: NDArray, move: NDArray, gain: NDArray, k: int, gained: float) -> int:
    """Prepare a move of k edges for `make_move`, and return k. Changes: rows ORDER, RANK, KEY of move; gain."""
    sort_removed_ends(place, move, k)
    gain[0] = gained
    return k


@inner_kernel
def find_move(  # noqa: PLR0915  # five loops, one within the other
    cost: CostModel,
    node: NDArray,
    place: NDArray,
    move: NDArray,
    gain: NDArray,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    t0: int,
) -> int:
    """Search for an improving move that starts at t0. Return its number of edges, or 0 if the search fails.

    The gain of the move is stored in gain[0].

    The search uses one nested loop per edge, which is a quarter faster than one loop with a stack. A table lookup
    (`LEAVES_3`) shows whether a move yields a single tour. Each edge adds bits to the key of the table. The lookup is a
    sixth faster than sorting the ends of every move that has a gain, because only one in nine of these moves yields a
    single tour.

    ========== =============== ==========================================================
    candidates int32[n, k]     neighbours of every node, nearest first, -1 for none
    lengths    float64[n, k]   costs of those edges
    breadth    int64[DEPTH]    number of candidates tried at each depth; entry 0 is not used
    ========== =============== ==========================================================

    Symbols, all in the direction from t1 away from t0: r is the number of positions from t1 to a node; `on` is 1 if the
    even end of a removed edge comes before its odd end; m is the number of positions from t1 to the start of that edge.
    Changes: move, gain.
    """
    ends, code, xy, n = move[ENDS], cost.code, cost.xy, len(node)
    free, tied_a, tied_b = cost.free, cost.tied_a, cost.tied_b
    # A call of `travel` passes the whole cost model. If costs are straight, it is needed only at free and tied nodes.
    quick = uses_straight_cost(cost) and t0 != free and t0 != tied_a and t0 != tied_b
    b1, b2, b3, b4 = breadth[1], breadth[2], breadth[3], breadth[4]
    for direction in range(2):
        t1 = successor(node, place, t0) if direction == 0 else predecessor(node, place, t0)
        start = place[t1]
        g0 = node_travel_cost(cost, t0, t1)
        ends[0], ends[1] = t0, t1
        for i1 in range(b1):
            t2 = candidates[t1, i1]
            g1 = g0 - lengths[t1, i1]
            if t2 < 0 or g1 <= EPSILON:
                break
            at2 = place[t2]
            ahead1, behind1 = neighbours_of_position(node, at2)
            if _is_either(ahead1, behind1, t1):
                continue  # an edge of the tour cannot be added
            r2 = count_positions_between(at2, start, direction, n)
            ends[2] = t2
            for side1 in range(2):
                t3 = ahead1 if side1 == 0 else behind1
                # With two edges, the direction determines whether there is one tour; later, the order of the positions.
                leaves = side1 != direction
                if (
                    quick
                    and _is_ordinary_node(free, tied_a, tied_b, t2)
                    and _is_ordinary_node(free, tied_a, tied_b, t3)
                ):
                    removed, back = straight_travel_cost(xy, code, t2, t3), straight_travel_cost(xy, code, t3, t0)
                else:
                    removed, back = edge_and_closing_cost(cost, t2, t3, t0, leaves)
                h1 = g1 + removed
                closed = h1 - back
                ends[3] = t3
                if closed > EPSILON and leaves:
                    return store_move(place, move, gain, TWO, closed)
                on1 = 1 if side1 == direction else 0
                m1 = r2 - 1 + on1
                for i2 in range(b2):
                    t4 = candidates[t3, i2]
                    g2 = h1 - lengths[t3, i2]
                    if t4 < 0 or g2 <= EPSILON:
                        break
                    at4 = place[t4]
                    ahead2, behind2 = neighbours_of_position(node, at4)
                    if _is_either(ahead2, behind2, t3):
                        continue
                    r4 = count_positions_between(at4, start, direction, n)
                    ends[4] = t4
                    for side2 in range(2):
                        t5 = ahead2 if side2 == 0 else behind2
                        if _is_removed(ends, 0, t4, t5):
                            continue
                        on2 = 1 if side2 == direction else 0
                        m2 = r4 - 1 + on2
                        key2 = on1 | (on2 << 1) | ((1 if m1 < m2 else 0) << 2)
                        leaves = (LEAVES_3 >> key2) & 1 == 1
                        if (
                            quick
                            and _is_ordinary_node(free, tied_a, tied_b, t4)
                            and _is_ordinary_node(free, tied_a, tied_b, t5)
                        ):
                            removed, back = (
                                straight_travel_cost(xy, code, t4, t5),
                                straight_travel_cost(xy, code, t5, t0),
                            )
                        else:
                            removed, back = edge_and_closing_cost(cost, t4, t5, t0, leaves)
                        h2 = g2 + removed
                        closed = h2 - back
                        ends[5] = t5
                        if closed > EPSILON and leaves:
                            return store_move(place, move, gain, THREE, closed)
                        for i3 in range(b3):
                            t6 = candidates[t5, i3]
                            g3 = h2 - lengths[t5, i3]
                            if t6 < 0 or g3 <= EPSILON:
                                break
                            at6 = place[t6]
                            ahead3, behind3 = neighbours_of_position(node, at6)
                            if _is_either(ahead3, behind3, t5):
                                continue
                            r6 = count_positions_between(at6, start, direction, n)
                            ends[6] = t6
                            for side3 in range(2):
                                t7 = ahead3 if side3 == 0 else behind3
                                if _is_removed(ends, 1, t6, t7):
                                    continue
                                on3 = 1 if side3 == direction else 0
                                m3 = r6 - 1 + on3
                                key3 = key2 | (on3 << 3) | ((1 if m1 < m3 else 0) << 4) | ((1 if m2 < m3 else 0) << 5)
                                leaves = (LEAVES_4 >> key3) & 1 == 1
                                if (
                                    quick
                                    and _is_ordinary_node(free, tied_a, tied_b, t6)
                                    and _is_ordinary_node(free, tied_a, tied_b, t7)
                                ):
                                    removed, back = (
                                        straight_travel_cost(xy, code, t6, t7),
                                        straight_travel_cost(xy, code, t7, t0),
                                    )
                                else:
                                    removed, back = edge_and_closing_cost(cost, t6, t7, t0, leaves)
                                h3 = g3 + removed
                                closed = h3 - back
                                ends[7] = t7
                                if closed > EPSILON and leaves:
                                    return store_move(place, move, gain, FOUR, closed)
                                for i4 in range(b4):
                                    t8 = candidates[t7, i4]
                                    g4 = h3 - lengths[t7, i4]
                                    if t8 < 0 or g4 <= EPSILON:
                                        break
                                    at8 = place[t8]
                                    ahead4, behind4 = neighbours_of_position(node, at8)
                                    if _is_either(ahead4, behind4, t7):
                                        continue
                                    r8 = count_positions_between(at8, start, direction, n)
                                    for side4 in range(2):
                                        on4 = 1 if side4 == direction else 0
                                        m4 = r8 - 1 + on4
                                        row = (
                                            on4
                                            | ((1 if m1 < m4 else 0) << 1)
                                            | ((1 if m2 < m4 else 0) << 2)
                                            | ((1 if m3 < m4 else 0) << 3)
                                        )
                                        if not (LEAVES_5[row] >> key3) & 1:
                                            continue
                                        t9 = ahead4 if side4 == 0 else behind4
                                        if _is_removed(ends, 2, t8, t9):
                                            continue
                                        if (
                                            quick
                                            and _is_ordinary_node(free, tied_a, tied_b, t8)
                                            and _is_ordinary_node(free, tied_a, tied_b, t9)
                                        ):
                                            removed, back = (
                                                straight_travel_cost(xy, code, t8, t9),
                                                straight_travel_cost(xy, code, t9, t0),
                                            )
                                        else:
                                            removed, back = edge_and_closing_cost(cost, t8, t9, t0, True)
                                        closed = g4 + removed - back
                                        if closed > EPSILON:
                                            ends[8], ends[9] = t8, t9
                                            return store_move(place, move, gain, FIVE, closed)
    return 0


@kernel
def improve_queued(
    cost: CostModel, tour: Tour, candidates: NDArray, lengths: NDArray, breadth: NDArray, max_nodes: int
) -> float:
    """Make improving moves at the queued nodes, and return the gain.

    The search stops when the queue is empty, the log is full, or `max_nodes` nodes have been examined. Changes: tour.
    """
    total = 0.0
    examined = 0
    while tour.counts[1] > 0 and tour.counts[3] == 0 and examined < max_nodes:
        v = pop_from_queue(tour)
        examined += 1
        while True:
            k = find_move(cost, tour.node, tour.place, tour.move, tour.gain, candidates, lengths, breadth, v)
            if k == 0:
                break
            if not make_move(tour, k):
                if tour.counts[3] == 1:
                    push_to_queue(tour, v)
                else:
                    tour.queued[v] = WAITING
                break
            total += tour.gain[0]
            for i in range(2 * k):
                push_to_queue(tour, tour.move[ENDS, i])
    return total


@inner_kernel
def undo_if_longer(tour: Tour, gained: float) -> float:
    """Undo the logged changes if they make the tour longer or if the log was too small.

    Return the gain. Changes: tour.
    """
    if tour.counts[3] == 0 and gained >= -EPSILON:
        return gained
    while tour.counts[1] > 0:
        pop_from_queue(tour)
    undo_logged_changes(tour)
    return 0.0


@inner_kernel
def segment_kick(cost: CostModel, tour: Tour, states: NDArray, k: int) -> float:
    """Swap two adjacent pieces of 1 … 50 nodes at a random position, and return the added cost.

    Changes: tour, states[k].
    """
    n = len(tour.node)
    longest = min(LONGEST_PIECE, (n - 2) // 2)
    p = random_below(states, k, n)
    q = (p + 1 + random_below(states, k, longest)) % n
    r = (q + 1 + random_below(states, k, longest)) % n
    a, b = tour.node[p], tour.node[p + 1 if p + 1 < n else 0]
    c, d = tour.node[q], tour.node[q + 1 if q + 1 < n else 0]
    e, f = tour.node[r], tour.node[r + 1 if r + 1 < n else 0]
    # a b…c d…e f  becomes  a d…e b…c f
    move = tour.move
    move[ENDS, 0], move[ENDS, 1], move[ENDS, 2], move[ENDS, 3], move[ENDS, 4], move[ENDS, 5] = b, a, d, c, f, e
    added = node_travel_cost(cost, a, d) + node_travel_cost(cost, e, b) + node_travel_cost(cost, c, f)
    removed = node_travel_cost(cost, a, b) + node_travel_cost(cost, c, d) + node_travel_cost(cost, e, f)
    if not is_single_tour(tour.place, move, THREE) or not make_move(tour, THREE):
        return 0.0
    for i in range(6):
        push_to_queue(tour, move[ENDS, i])
    return added - removed


@kernel
def kick_and_repair(
    cost: CostModel,
    tour: Tour,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    states: NDArray,
    k: int,
    kicks: int,
) -> float:
    """Kick and repair the tour `kicks` times. Undo any result that makes the tour longer, and return the total gain.

    Changes: tour, states[k].
    """
    total = 0.0
    for _ in range(kicks):
        tour.counts[2] = 0
        tour.counts[3] = 0
        added = segment_kick(cost, tour, states, k)
        total += undo_if_longer(tour, improve_queued(cost, tour, candidates, lengths, breadth, NO_LIMIT) - added)
    return total
