"""Edge assembly: recombine two tours along their AB-cycles.

Take two tours A and B. An AB-cycle alternates between edges that only A has and edges that only B has. Suppose we
remove the cycle's A edges from tour A and add its B edges. Every node still has two edges, but the result may consist
of several subtours. Each subtour is then joined to the remaining tour by an exchange of two edges. The child differs
from A in few positions, and consists of edges that were good in at least one parent. Finding the AB-cycles takes two
passes over all nodes. After that, the effort for a cycle depends only on its size.

Source: Y. Nagata and S. Kobayashi, INFORMS J. Computing 25 (2013), section 3 (edge assembly) and section 4.1 (the
localised form with single AB-cycles).
Differs: every cycle that improves the tour is applied at once, whereas the paper generates 30 children and selects one.
A cycle is only tried if exchanging its edges has a gain. A subtour is joined to the tour near the ends of its pieces.
Sequential exchanges at the affected nodes improve the child.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON, NONE, inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost
from leafcut.kernels.lin_kernighan import Tour, improve_queued, push_to_queue
from leafcut.kernels.random import random_below

# Columns of `Assembly.trail`.
UNUSED_A, UNUSED_B, LEFT, SEEN = 0, 2, 4, 6
# Rows of `Assembly.lists` and of `Assembly.pieces`.
WALK, CYCLES, BEGIN, ORDER = 0, 1, 2, 3
CUT, JOINED, SUBTOUR, SIZE = 0, 1, 2, 3

#: Skip cycles with more edges of A than this. They are slow and hardly ever improve a tour.
LONGEST_CYCLE = 1000

#: Maximum number of log entries. Each edge of A needs two entries, and each joined subtour needs four.
MOST_CHANGES = 6 * LONGEST_CYCLE

#: A subtour is joined to the tour at most this many positions from the ends of its pieces.
REACH = 200

#: When joining a subtour, try at most this many candidates per node.
JOINS = 16


class Assembly(NamedTuple):
    """Data for recombining tour A, which is stored in a `Tour`, with tour B. Each worker has its own object.

    ====== ================ ==========================================================================
    links  int32[n, 4]      neighbours of every node: 0, 1 in the child, which starts as A; 2, 3 in B
    trail  int32[n, 8]      columns UNUSED_A, UNUSED_B (two each): neighbours by edges of one tour only
                            that are in no cycle yet; LEFT + 0, 1: their number; SEEN + 0, 1: position
                            in the walk before an edge of A, of B; -1 for none
    lists  int32[4, 2n+2]   rows WALK: nodes of the walk; CYCLES: nodes of all AB-cycles, an edge of A
                            follows each even position; BEGIN: start of each cycle; ORDER: start nodes
                            of walks, then cycles to try
    pieces int32[4, m]      rows CUT: positions after which A is cut, ascending; JOINED: the end that each
                            end is joined to; SUBTOUR of each piece; SIZE of each subtour
    log    int32[m, 3]      (node, slot, previous neighbour) for every change of the child's links
    ====== ================ ==========================================================================
    """

    links: NDArray[np.int32]
    trail: NDArray[np.int32]
    lists: NDArray[np.int32]
    pieces: NDArray[np.int32]
    log: NDArray[np.int32]


@inner_kernel
def store_tour_links(links: NDArray, tour: NDArray, first: int) -> None:
    """Write each node's two neighbours in `tour` to two columns of `links`.

    Changes: columns first and first + 1 of links.
    """
    for k in range(len(tour)):
        links[tour[k], first] = tour[k - 1]
        links[tour[k - 1], first + 1] = tour[k]


@inner_kernel
def _collect_differing_edges(a: Assembly) -> int:
    """Find the edges that occur in only one of the two tours, and return the number of nodes that have such edges.

    Changes: trail, row ORDER of lists.
    """
    nodes = 0
    for v in range(len(a.links)):
        link, trail = a.links[v], a.trail[v]
        for kind in range(2):
            count, own, partner = 0, 2 * kind, 2 - 2 * kind
            for slot in range(2):
                w = link[own + slot]
                if w != link[partner] and w != link[partner + 1]:
                    trail[own + count] = w
                    count += 1
            trail[LEFT + kind], trail[SEEN + kind] = count, -1
        if trail[LEFT] > 0:
            a.lists[ORDER, nodes] = v
            nodes += 1
    return nodes


@inner_kernel
def _follow_random_edge(trail: NDArray, u: int, kind: int, states: NDArray, k: int) -> int:
    """Choose a random unused edge of tour A (kind 0) or tour B (kind 1) at node u, and mark it as used.

    Returns the other end of the edge. Changes: trail, states[k].
    """
    first = 2 * kind
    slot = first + (random_below(states, k, 2) if trail[u, LEFT + kind] == 2 else 0)
    v = trail[u, slot]
    if slot == first:
        trail[u, first] = trail[u, first + 1]
    trail[u, LEFT + kind] -= 1
    if trail[v, first] == u:
        trail[v, first] = trail[v, first + 1]
    trail[v, LEFT + kind] -= 1
    return int(v)


@inner_kernel
def _move_random_node_to_end(a: Assembly, nodes: int, states: NDArray, k: int) -> int:
    """Move a random node that has an unused edge to the end of ORDER. Return the number of remaining nodes.

    Changes: row ORDER of lists, states[k].
    """
    order = a.lists[ORDER]
    while nodes > 0:
        i = random_below(states, k, nodes)
        order[i], order[nodes - 1] = order[nodes - 1], order[i]
        if a.trail[order[nodes - 1], LEFT] > 0:
            return nodes
        nodes -= 1
    return 0


@inner_kernel
def split_into_ab_cycles(a: Assembly, states: NDArray, k: int) -> int:
    """Split the edges in which the tours differ into random AB-cycles, and return the number of cycles.

    Changes: trail, lists, states[k].
    """
    walk, cycles, starts = a.lists[WALK], a.lists[CYCLES], a.lists[BEGIN]
    nodes = _collect_differing_edges(a)
    count = filled = starts[0] = 0
    length = 0  # number of edges in the walk
    while True:
        if length == 0:
            nodes = _move_random_node_to_end(a, nodes, states, k)
            if nodes == 0:
                return count
            walk[0] = a.lists[ORDER, nodes - 1]
            a.trail[walk[0], SEEN] = 0
        v = _follow_random_edge(a.trail, walk[length], length & 1, states, k)
        length += 1
        since = a.trail[v, SEEN + (length & 1)]
        if since < 0:
            walk[length] = v
            a.trail[v, SEEN + (length & 1)] = length
            continue
        # The walk has left this node before along an edge of the same kind. The part since then is a closed cycle.
        for step in range(length - since):
            index = since + (since & 1) + step
            cycles[filled] = walk[index if index < length else index - length + since]
            filled += 1
        for index in range(since + 1, length):
            a.trail[walk[index], SEEN + (index & 1)] = -1
        count += 1
        starts[count] = filled
        length = since
        if length == 0:
            a.trail[v, SEEN] = -1


@inner_kernel
def _replace_link(a: Assembly, entries: int, v: int, old: int, new: int) -> int:
    """Replace v's neighbour `old` with `new`, and return the new length of the log. Changes: links, log."""
    slot = 0 if a.links[v, 0] == old else 1
    a.log[entries, 0], a.log[entries, 1], a.log[entries, 2] = v, slot, old
    a.links[v, slot] = new
    return entries + 1


@inner_kernel
def undo_changes(a: Assembly, entries: int) -> None:
    """Undo the changes in the log, starting with the most recent. Changes: links."""
    for e in range(entries - 1, -1, -1):
        a.links[a.log[e, 0], a.log[e, 1]] = a.log[e, 2]


@inner_kernel
def shell_sort(values: NDArray, count: int) -> None:
    """Sort the first `count` values. Changes: values.

    Source: D. L. Shell, Communications of the ACM 2 (1959); gaps of M. Ciura (2001).
    """
    for gap in (1750, 701, 301, 132, 57, 23, 10, 4, 1):
        for i in range(gap, count):
            value, j = values[i], i
            while j >= gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value


@inner_kernel
def piece_of_position(cut: NDArray, count: int, place: int) -> int:
    """Return the number of the piece that contains a position.

    Piece s ends at position cut[s]. Positions after the last cut belong to piece 0.
    """
    low, high = 0, count
    while low < high:
        middle = (low + high) >> 1
        if cut[middle] < place:
            low = middle + 1
        else:
            high = middle
    return low if low < count else 0


@inner_kernel
def length_of_piece(cut: NDArray, count: int, s: int, n: int) -> int:
    """Return the number of nodes in piece s of `count` pieces."""
    return int(cut[s] - cut[s - 1] if s > 0 else cut[0] - cut[count - 1] + n)


@inner_kernel
def _is_successor(place: NDArray, u: int, v: int) -> bool:
    return bool(place[v] == place[u] + 1 or (place[v] == 0 and place[u] == len(place) - 1))


@inner_kernel
def _exchange_cycle_edges(cost: CostModel, place: NDArray, a: Assembly, start: int, stop: int) -> float:
    """Replace tour A's edges in an AB-cycle with tour B's edges, and return the gain.

    Afterwards, the log has two entries for each edge of A. Changes: links, log, row CUT of pieces.
    """
    cycle = a.lists[CYCLES]
    gain, entries = 0.0, 0
    for i in range(start, stop, 2):
        u, v = cycle[i], cycle[i + 1]
        back, on = cycle[i - 1 if i > start else stop - 1], cycle[i + 2 if i + 2 < stop else start]
        gain += node_travel_cost(cost, u, v) - node_travel_cost(cost, v, on)
        a.pieces[CUT, entries >> 1] = place[u] if _is_successor(place, u, v) else place[v]
        entries = _replace_link(a, entries, u, v, back)
        entries = _replace_link(a, entries, v, u, on)
    return gain


@inner_kernel
def _piece_end(a: Assembly, place: NDArray, count: int, v: int, removed: int) -> int:
    """Find the end of a piece at node v, which has lost its edge to `removed`.

    Piece s has its start at number 2 s and its end at number 2 s + 1.
    """
    return 2 * piece_of_position(a.pieces[CUT], count, place[v]) + (0 if _is_successor(place, removed, v) else 1)


@inner_kernel
def _find_subtours(a: Assembly, place: NDArray, start: int, stop: int) -> int:
    """Number the subtours that a cycle creates, count their nodes, and return the number of subtours.

    Changes: rows JOINED, SUBTOUR, SIZE of pieces.
    """
    cycle, count = a.lists[CYCLES], (stop - start) >> 1
    joined, subtour = a.pieces[JOINED], a.pieces[SUBTOUR]
    for i in range(start, stop, 2):
        after = i + 2 if i + 2 < stop else start
        # A piece of one node has the node at both ends. The removed edge of A determines the end.
        first_end = _piece_end(a, place, count, cycle[i + 1], cycle[i])
        second_end = _piece_end(a, place, count, cycle[after], cycle[after + 1])
        joined[first_end], joined[second_end] = second_end, first_end
    for s in range(count):
        subtour[s] = -1
    subtours = 0
    for first in range(count):
        end, size = 2 * first, 0
        while subtour[end >> 1] < 0:
            subtour[end >> 1] = subtours
            size += length_of_piece(a.pieces[CUT], count, end >> 1, len(place))
            end = joined[end ^ 1]
        if size > 0:
            a.pieces[SIZE, subtours] = size
            subtours += 1
    return subtours


@inner_kernel
def _join_subtour(
    cost: CostModel,
    node: NDArray,
    place: NDArray,
    a: Assembly,
    candidates: NDArray,
    lengths: NDArray,
    count: int,
    small: int,
    entries: int,
) -> tuple[float, int]:
    """Join the subtour `small` to another subtour by the best exchange of two edges.

    Returns the gain and the number of the other subtour, or -1 if no exchange is possible. Symbols: the exchange
    removes edge u–v from the small subtour and edge w–x from the other subtour. It adds u–w and v–x.
    Changes: links, log.
    """
    cut, subtour = a.pieces[CUT], a.pieces[SUBTOUR]
    best, bu, bv, bw, bx = -math.inf, NONE, NONE, NONE, NONE
    for s in range(count):
        if subtour[s] != small:
            continue
        length = length_of_piece(cut, count, s, len(place))
        i = 0
        while i < length:
            if i == REACH and length > 2 * REACH:
                i = length - REACH
            i += 1
            u = node[cut[s] - length + i]  # piece 0 may start before position 0, at the end of the array
            for slot in range(2):
                v = a.links[u, slot]
                removed = node_travel_cost(cost, u, v)
                for c in range(min(JOINS, candidates.shape[1])):
                    w = candidates[u, c]
                    if w < 0 or subtour[piece_of_position(cut, count, place[w])] == small:
                        continue
                    for side in range(2):
                        x = a.links[w, side]
                        gain = removed - lengths[u, c] + node_travel_cost(cost, w, x) - node_travel_cost(cost, v, x)
                        if gain > best:
                            best, bu, bv, bw, bx = gain, u, v, w, x
    if bu < 0:
        return best, -1
    entries = _replace_link(a, entries, bu, bv, bw)
    entries = _replace_link(a, entries, bv, bu, bx)
    entries = _replace_link(a, entries, bw, bx, bu)
    entries = _replace_link(a, entries, bx, bw, bv)
    return best, int(subtour[piece_of_position(cut, count, place[bw])])


@inner_kernel
def build_cycle_child(
    cost: CostModel, node: NDArray, place: NDArray, a: Assembly, candidates: NDArray, lengths: NDArray, cycle: int
) -> tuple[float, int]:
    """Create the child of a single AB-cycle in `links`.

    Returns the gain, and the length of the log, which is needed to undo the child. The gain is -∞ if exchanging the
    edges has no gain, or if the subtours cannot be joined.
    Changes: links, log, pieces.
    """
    start, stop = a.lists[BEGIN, cycle], a.lists[BEGIN, cycle + 1]
    count = (stop - start) >> 1
    gain = _exchange_cycle_edges(cost, place, a, start, stop)
    entries = 2 * count
    if gain <= EPSILON:
        return -math.inf, entries
    shell_sort(a.pieces[CUT], count)
    subtours = _find_subtours(a, place, start, stop)
    size, subtour = a.pieces[SIZE], a.pieces[SUBTOUR]
    for _ in range(subtours - 1):
        small = NONE
        for s in range(subtours):
            if size[s] > 0 and (small < 0 or size[s] < size[small]):
                small = s
        added, target = _join_subtour(cost, node, place, a, candidates, lengths, count, small, entries)
        if target < 0:
            return -math.inf, entries
        gain, entries = gain + added, entries + 4
        for s in range(count):
            if subtour[s] == small:
                subtour[s] = target
        size[target] += size[small]
        size[small] = 0
    return gain, entries


@inner_kernel
def _cut_at_changed_edges(node: NDArray, place: NDArray, a: Assembly, entries: int) -> int:
    """Cut tour A after each logged node whose successor has changed, and return the number of pieces.

    Changes: row CUT of pieces.
    """
    cut, count = a.pieces[CUT], 0
    for e in range(entries):
        v = a.log[e, 0]
        p = place[v]
        w = node[p + 1 if p + 1 < len(node) else 0]
        if a.links[v, 0] != w and a.links[v, 1] != w:
            cut[count] = p
            count += 1
    shell_sort(cut, count)
    kept = 0
    for i in range(count):  # a node may occur in the log twice
        if i == 0 or cut[i] != cut[kept - 1]:
            cut[kept] = cut[i]
            kept += 1
    return kept


@inner_kernel
def apply_child(tour: Tour, a: Assembly, entries: int) -> bool:
    """Update `node` and `place` from the child's links. The longest piece of A stays, and the other pieces follow it.

    Returns True if the links form a single tour and the buffer is large enough. Otherwise, `node` and `place` do not
    change.
    Changes: node, place and buffer of tour, row CUT of pieces.
    """
    node, place, cut, n = tour.node, tour.place, a.pieces[CUT], len(tour.node)
    count = _cut_at_changed_edges(node, place, a, entries)
    if count == 0:
        return True
    longest = 0
    for s in range(1, count):
        if length_of_piece(cut, count, s, n) > length_of_piece(cut, count, longest, n):
            longest = s
    longest_length = length_of_piece(cut, count, longest, n)
    if n - longest_length > len(tour.buffer):
        return False
    v = node[cut[longest]]
    previous = node[cut[longest] - 1] if longest_length > 1 else a.links[v, 0]
    filled = 0
    while filled < n - longest_length:
        w = a.links[v, 1] if a.links[v, 0] == previous else a.links[v, 0]
        s = piece_of_position(cut, count, place[w])
        if s == longest:
            return False
        length = length_of_piece(cut, count, s, n)
        p = place[w]
        step = -1 if p == cut[s] else 1
        previous = v
        for _ in range(length):
            tour.buffer[filled] = node[p]
            filled += 1
            p += step
            if p == n:
                p = 0
        v = tour.buffer[filled - 1]
        if length > 1:
            previous = tour.buffer[filled - 2]
    p = cut[longest]
    for i in range(filled):
        p = p + 1 if p + 1 < n else 0
        node[p] = tour.buffer[i]
        place[node[p]] = p
    return True


@inner_kernel
def _has_all_edges(a: Assembly, cycle: int) -> bool:
    for i in range(a.lists[BEGIN, cycle], a.lists[BEGIN, cycle + 1], 2):
        u, v = a.lists[CYCLES, i], a.lists[CYCLES, i + 1]
        if a.links[u, 0] != v and a.links[u, 1] != v:
            return False
    return True


@kernel
def recombine_by_edge_assembly(
    cost: CostModel,
    tour: Tour,
    a: Assembly,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    own: NDArray,
    partner: NDArray,
    states: NDArray,
    gains: NDArray,
    first: int,
    stop: int,
) -> None:
    """Improve each tour by the AB-cycles that it forms with a partner tour.

    The cycles are tried in random order. If a cycle improves the tour, it is applied, and local search follows.

    ========== =============== ==================================================
    candidates int32[n, c]     neighbours of every node, -1 for none
    lengths    float64[n, c]   costs of those edges
    breadth    int64[DEPTH]    candidates tried at each depth of an exchange
    own        int32[m, n]     tours A; become the children
    partner    int32[m, n]     tours B
    states     uint64[m]       random states
    gains      float64[m]      the gain of each pair is added to its entry
    first,stop int             range of pairs
    ========== =============== ==================================================

    Changes: own, states, gains; tour, a.
    """
    n, order = own.shape[1], a.lists[ORDER]
    for pair in range(first, stop):
        for i in range(n):
            tour.node[i] = own[pair, i]
            tour.place[own[pair, i]] = i
        store_tour_links(a.links, own[pair], 0)
        store_tour_links(a.links, partner[pair], 2)
        count = split_into_ab_cycles(a, states, pair)
        for c in range(count):
            order[c] = c
        for c in range(count):
            pick = c + random_below(states, pair, count - c)
            cycle = order[pick]
            order[pick] = order[c]
            if a.lists[BEGIN, cycle + 1] - a.lists[BEGIN, cycle] > 2 * LONGEST_CYCLE or not _has_all_edges(a, cycle):
                continue
            gain, entries = build_cycle_child(cost, tour.node, tour.place, a, candidates, lengths, cycle)
            if gain > EPSILON and apply_child(tour, a, entries):
                gains[pair] += gain
                for e in range(entries):
                    push_to_queue(tour, a.log[e, 0])
            else:
                undo_changes(a, entries)
        gains[pair] += improve_queued(cost, tour, candidates, lengths, breadth, n * n)
        for i in range(n):
            own[pair, i] = tour.node[i]
