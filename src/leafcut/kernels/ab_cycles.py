"""AB-cycles: the difference of two tours, split into closed walks that alternate between edges of A and of B.

Source: Y. Nagata and S. Kobayashi, INFORMS J. Computing 25 (2013), section 3 (edge assembly).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import part
from leafcut.kernels.random import below

# Columns of `Assembly.trail`.
UNUSED_A, UNUSED_B, LEFT, SEEN = 0, 2, 4, 6
# Rows of `Assembly.lists` and of `Assembly.pieces`.
WALK, CYCLES, BEGIN, ORDER = 0, 1, 2, 3
CUT, JOINED, SUBTOUR, SIZE = 0, 1, 2, 3


class Assembly(NamedTuple):
    """Data to assemble tour A, which is in a `Tour`, and tour B; one object per worker.

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
    log    int32[m, 3]      (node, slot, previous neighbour) of every change of the child's links
    ====== ================ ==========================================================================
    """

    links: NDArray[np.int32]
    trail: NDArray[np.int32]
    lists: NDArray[np.int32]
    pieces: NDArray[np.int32]
    log: NDArray[np.int32]


@part
def fill_links(links: NDArray, tour: NDArray, first: int) -> None:
    """Write the two neighbours of every node in a tour. Changes: columns first, first + 1 of links."""
    for k in range(len(tour)):
        links[tour[k], first] = tour[k - 1]
        links[tour[k - 1], first + 1] = tour[k]


@part
def _fill_unused(a: Assembly) -> int:
    """Find the edges that are in only one tour; return the number of nodes with such edges. Changes: trail, row ORDER
    of lists.
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


@part
def _step(trail: NDArray, u: int, kind: int, states: NDArray, k: int) -> int:
    """Follow a random unused edge of a kind (0: A, 1: B) from u; return its other end. Changes: trail, states[k]."""
    first = 2 * kind
    slot = first + (below(states, k, 2) if trail[u, LEFT + kind] == 2 else 0)
    v = trail[u, slot]
    if slot == first:
        trail[u, first] = trail[u, first + 1]
    trail[u, LEFT + kind] -= 1
    if trail[v, first] == u:
        trail[v, first] = trail[v, first + 1]
    trail[v, LEFT + kind] -= 1
    return int(v)


@part
def _some_node(a: Assembly, nodes: int, states: NDArray, k: int) -> int:
    """Move a random node with an unused edge to the end of ORDER; return the number of nodes left, 0 if none. Changes:
    row ORDER of lists, states[k].
    """
    order = a.lists[ORDER]
    while nodes > 0:
        i = below(states, k, nodes)
        order[i], order[nodes - 1] = order[nodes - 1], order[i]
        if a.trail[order[nodes - 1], LEFT] > 0:
            return nodes
        nodes -= 1
    return 0


@part
def find_cycles(a: Assembly, states: NDArray, k: int) -> int:
    """Split the difference of the tours into AB-cycles at random; return their number. Changes: trail, lists,
    states[k].
    """
    walk, cycles, starts = a.lists[WALK], a.lists[CYCLES], a.lists[BEGIN]
    nodes = _fill_unused(a)
    count = filled = starts[0] = 0
    length = 0  # edges in the walk
    while True:
        if length == 0:
            nodes = _some_node(a, nodes, states, k)
            if nodes == 0:
                return count
            walk[0] = a.lists[ORDER, nodes - 1]
            a.trail[walk[0], SEEN] = 0
        v = _step(a.trail, walk[length], length & 1, states, k)
        length += 1
        since = a.trail[v, SEEN + (length & 1)]
        if since < 0:
            walk[length] = v
            a.trail[v, SEEN + (length & 1)] = length
            continue
        # The walk has already left this node by an edge of the same kind, so the part since then closes a cycle.
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
