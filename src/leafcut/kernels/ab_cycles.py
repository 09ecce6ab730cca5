"""AB-cycles: what two tours do not share, divided into rings that take an edge of A and an edge of B in turn.

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
    """What it takes to assemble tour A, which lies in a `Tour`, and tour B; one object per worker.

    ====== ================ ==========================================================================
    links  int32[n, 4]      neighbours of every node: 0, 1 in the child that is made of A, 2, 3 in B
    trail  int32[n, 8]      columns UNUSED_A, UNUSED_B (two each): neighbours by edges of one tour alone
                            that no cycle has yet; LEFT + 0, 1: how many of them; SEEN + 0, 1: where the
                            walk passed before an edge of A, of B; -1 for nowhere
    lists  int32[4, 2n+2]   rows WALK: its nodes; CYCLES: nodes of all AB-cycles, from each even one of
                            which an edge of A goes on; BEGIN: where each cycle begins; ORDER: nodes to
                            begin walks at, then cycles to try
    pieces int32[4, m]      rows CUT: places behind which A is cut, ascending; JOINED: the end that each
                            end is joined to; SUBTOUR of each piece; SIZE of each subtour
    log    int32[m, 3]      (node, slot, neighbour before) of every change to the child's links
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
    """Find the edges that only one tour has; return at how many nodes there are some.

    Changes: trail, row ORDER of lists.
    """
    nodes = 0
    for v in range(len(a.links)):
        link, trail = a.links[v], a.trail[v]
        for kind in range(2):
            count, mine, other = 0, 2 * kind, 2 - 2 * kind
            for slot in range(2):
                w = link[mine + slot]
                if w != link[other] and w != link[other + 1]:
                    trail[mine + count] = w
                    count += 1
            trail[LEFT + kind], trail[SEEN + kind] = count, -1
        if trail[LEFT] > 0:
            a.lists[ORDER, nodes] = v
            nodes += 1
    return nodes


@part
def _step(trail: NDArray, u: int, kind: int, words: NDArray, k: int) -> int:
    """Take a random unused edge of a kind (0: A, 1: B) at u; return where it leads. Changes: trail, words[k]."""
    first = 2 * kind
    slot = first + (below(words, k, 2) if trail[u, LEFT + kind] == 2 else 0)
    v = trail[u, slot]
    if slot == first:
        trail[u, first] = trail[u, first + 1]
    trail[u, LEFT + kind] -= 1
    if trail[v, first] == u:
        trail[v, first] = trail[v, first + 1]
    trail[v, LEFT + kind] -= 1
    return int(v)


@part
def _some_node(a: Assembly, nodes: int, words: NDArray, k: int) -> int:
    """Return how many nodes of ORDER are left when a random one with an unused edge has come to their end; 0 if none.

    Changes: row ORDER of lists, words[k].
    """
    order = a.lists[ORDER]
    while nodes > 0:
        i = below(words, k, nodes)
        order[i], order[nodes - 1] = order[nodes - 1], order[i]
        if a.trail[order[nodes - 1], LEFT] > 0:
            return nodes
        nodes -= 1
    return 0


@part
def find_cycles(a: Assembly, words: NDArray, k: int) -> int:
    """Divide the edges that only one tour has into AB-cycles at random; return how many there are.

    Changes: trail, lists, words[k].
    """
    walk, cycles, begin = a.lists[WALK], a.lists[CYCLES], a.lists[BEGIN]
    nodes = _fill_unused(a)
    count = filled = begin[0] = 0
    length = 0  # edges in the walk
    while True:
        if length == 0:
            nodes = _some_node(a, nodes, words, k)
            if nodes == 0:
                return count
            walk[0] = a.lists[ORDER, nodes - 1]
            a.trail[walk[0], SEEN] = 0
        v = _step(a.trail, walk[length], length & 1, words, k)
        length += 1
        since = a.trail[v, SEEN + (length & 1)]
        if since < 0:
            walk[length] = v
            a.trail[v, SEEN + (length & 1)] = length
            continue
        # The walk was here before an edge of the same kind: what lies between is a cycle. It begins at an edge of A.
        for step in range(length - since):
            at = since + (since & 1) + step
            cycles[filled] = walk[at if at < length else at - length + since]
            filled += 1
        for at in range(since + 1, length):
            a.trail[walk[at], SEEN + (at & 1)] = -1
        count += 1
        begin[count] = filled
        length = since
        if length == 0:
            a.trail[v, SEEN] = -1
