"""Minimum 1-trees on a sparse graph, and the subgradient ascent on node penalties that yields a lower bound.

A 1-tree is a spanning tree of all nodes except one, the hub, plus two edges of the hub. Every tour is a 1-tree, so no
tour costs less than the minimum 1-tree. Suppose we add a penalty to all edges of a node. The cost of every tour grows
by the same amount, but the cost of a 1-tree grows in proportion to the degree of the node. Penalties on nodes with many
edges, and rewards on leaves, therefore make 1-trees more like tours.

Source: M. Held and R. M. Karp, The traveling-salesman problem and minimum spanning trees, Operations Research 18 (1970)
and Mathematical Programming 1 (1971).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

#: Number of children per heap node. Four children share a cache line, and the heap is half as high as with two
#: children.
WAYS = 4

#: Values in `TreeScratch.place` for a node that is not in the heap yet, and for a node that is already in the tree.
OUTSIDE, DONE = -1, -2

#: Minimum width of a set. It is given as a multiple of the distance to the nearest outside node, divided by the number
#: of nodes in the set. Without a minimum, sets on a grid would have width 0. In a test on eight boards, 0 was worse for
#: clustered holes, and 1 was worse for grids.
SLACK = 0.3


class Graph(NamedTuple):
    """A sparse graph over n nodes. Every edge is stored at both ends.

    ====== ============ =======================================================
    begin  int32[n+1]   the edges of node i are begin[i] … begin[i + 1] - 1
    near   int32[2e]    other end of each edge
    length float64[2e]  cost of each edge
    ====== ============ =======================================================
    """

    begin: NDArray
    near: NDArray
    length: NDArray


class Sets(NamedTuple):
    """A hierarchy of node sets. Set i < n consists of node i, and each later set is the union of two earlier sets.

    ===== =========== ==============================================================================
    left  int32[2n]   one part of a set ≥ n
    right int32[2n]   the other part
    width float64[2n] distance to the nearest node outside minus the gaps inside, or the minimum width
    ===== =========== ==============================================================================
    """

    left: NDArray
    right: NDArray
    width: NDArray


class TreeScratch(NamedTuple):
    """The tree under construction, with work arrays.

    ====== =========== =================================================================================
    parent int32[n]    node through which a node joined the tree; -1 for the first
    key    float64[n]  penalised cost of that edge
    heap   int32[n]    nodes next to the tree, cheapest first
    place  int32[n]    position of a node in the heap
    excess float64[2n] degree of a node minus two; for a set, the sum over its nodes
    ====== =========== =================================================================================
    """

    parent: NDArray
    key: NDArray
    heap: NDArray
    place: NDArray
    excess: NDArray


@inner_kernel
def _insert_in_heap(heap: NDArray, place: NDArray, key: NDArray, hole: int, node: int) -> None:
    """Insert a node into the heap at position `hole` or higher up. Changes: heap, place."""
    while hole > 0:
        up = (hole - 1) // WAYS
        parent = heap[up]
        if key[parent] <= key[node]:
            break
        heap[hole] = parent
        place[parent] = hole
        hole = up
    heap[hole] = node
    place[node] = hole


@inner_kernel
def _replace_heap_top(heap: NDArray, place: NDArray, key: NDArray, size: int, node: int) -> None:
    """Replace the node at the top of the heap. Changes: heap, place."""
    hole = 0
    while WAYS * hole + 1 < size:
        smallest = WAYS * hole + 1
        for child in range(smallest + 1, min(WAYS * hole + 1 + WAYS, size)):
            if key[heap[child]] < key[heap[smallest]]:
                smallest = child
        if key[heap[smallest]] >= key[node]:
            break
        heap[hole] = heap[smallest]
        place[heap[hole]] = hole
        hole = smallest
    heap[hole] = node
    place[node] = hole


@inner_kernel
def build_sparse_spanning_tree(graph: Graph, penalty: NDArray, root: int, work: TreeScratch) -> float:
    """Build the minimum spanning tree of a connected graph under penalties, and return its penalised cost.

    Nodes without edges do not belong to the tree. Changes: work.parent, key, heap, place.
    Source: R. C. Prim, Bell System Technical Journal 36 (1957).
    """
    parent, key, heap, place = work.parent, work.key, work.heap, work.place
    begin, near, length = graph.begin, graph.near, graph.length
    for i in range(len(key)):
        key[i], place[i] = math.inf, OUTSIDE
    heap[0], place[root], key[root], parent[root] = root, 0, 0.0, -1
    size, total = 1, 0.0
    while size > 0:
        i = int(heap[0])
        total += key[i]
        place[i] = DONE
        size -= 1
        if size > 0:
            _replace_heap_top(heap, place, key, size, heap[size])
        for e in range(begin[i], begin[i + 1]):
            j = near[e]
            if place[j] == DONE:
                continue
            c = length[e] + (penalty[i] + penalty[j])
            if c < key[j]:
                key[j] = c
                parent[j] = i
                if place[j] == OUTSIDE:
                    place[j] = size
                    size += 1
                _insert_in_heap(heap, place, key, place[j], j)
    return total


@inner_kernel
def two_cheapest_hub_edges(spokes: NDArray, penalty: NDArray, hub: int, tied: int) -> tuple[int, int]:
    """Return the hub's neighbours along its two cheapest edges. Unless `tied` is -1, it is one of the two.

    Symbols: spokes float64[n] is the cost of the edge from the hub to each node.
    """
    a, b = tied, -1
    first_cost = -math.inf if tied >= 0 else math.inf
    second_cost = math.inf
    for j in range(len(penalty)):
        c = spokes[j] + penalty[j] if j != hub and j != tied else math.inf
        if c < first_cost:
            b, second_cost = a, first_cost
            a, first_cost = j, c
        elif c < second_cost:
            b, second_cost = j, c
    return a, b


@inner_kernel
def complete_one_tree(spokes: NDArray, hub: int, tied: int, root: int, penalty: NDArray, work: TreeScratch) -> float:
    """Complete the spanning tree in `work` to a 1-tree, count the degrees of its nodes, and return the added cost.

    The added cost consists of the cost of both hub edges, minus the effect of all penalties on a tour. This effect is
    the same for every tour. The hub has no penalty.
    Changes: work.excess, which is 0 at the hub.
    """
    a, b = two_cheapest_hub_edges(spokes, penalty, hub, tied)
    excess, parent, on_a_tour = work.excess, work.parent, 0.0
    for i in range(len(penalty)):
        excess[i] = -2.0
        on_a_tour += penalty[i]
    for i in range(len(penalty)):
        if i != hub and i != root:
            excess[i] += 1.0
            excess[parent[i]] += 1.0
    excess[a] += 1.0
    excess[b] += 1.0
    excess[hub] = 0.0
    return float((spokes[a] + penalty[a]) + (spokes[b] + penalty[b]) - 2.0 * on_a_tour)


@kernel
def join_sets(
    a: NDArray, b: NDArray, length: NDArray, n: int, up: NDArray, formed: NDArray, size: NDArray, sets: Sets
) -> None:
    """Join n nodes into sets along the edges of a spanning tree, shortest edge first (single linkage).

    ====== =========== =====================================
    a, b   int32[e]    ends of the edges, by ascending length
    up     int32[2n]   work array: the set that contains a set
    formed float64[2n] work array: length of the edge that formed a set
    size   float64[2n] work array: number of nodes in a set
    ====== =========== =====================================

    Changes: up, formed, size, sets.
    """
    for i in range(len(up)):
        up[i], formed[i], size[i], sets.width[i] = i, 0.0, 1.0, 0.0
    for e in range(len(a)):
        new = n + e
        formed[new], size[new] = length[e], 0.0
        for side in range(2):
            part = a[e] if side == 0 else b[e]
            while up[part] != part:
                up[part] = up[up[part]]
                part = up[part]
            (sets.left if side == 0 else sets.right)[new] = part
            sets.width[part] = max(0.0, length[e] - formed[part], SLACK * length[e] / size[part])
            size[new] += size[part]
        up[sets.left[new]] = new
        up[sets.right[new]] = new


@inner_kernel
def penalty_direction(sets: Sets, n: int, excess: NDArray) -> float:
    """Convert the excess of each node into a direction for the penalties.

    Each set changes the penalties of all its nodes by its excess times its width. Returns the inner product of the
    excess and the direction.
    Changes: excess float64[2n].
    """
    last = 2 * n - 3
    for s in range(n, last + 1):
        excess[s] = excess[sets.left[s]] + excess[sets.right[s]]
    product = 0.0
    for s in range(last + 1):
        product += sets.width[s] * excess[s] * excess[s]
        excess[s] *= sets.width[s]
    for s in range(last, n - 1, -1):
        excess[sets.left[s]] += excess[s]
        excess[sets.right[s]] += excess[s]
    return product


@kernel
def ascend_subgradient(
    graph: Graph,
    sets: Sets,
    spokes: NDArray,
    hub: int,
    tied: int,
    upper: float,
    first: int,
    last: int,
    steps: int,
    penalty: NDArray,
    best: NDArray,
    best_value: float,
    work: TreeScratch,
) -> float:
    """Take steps first … last - 1 of a subgradient ascent that has `steps` steps in total, starting with `penalty`.

    The best penalties are kept, and their value is returned. Each step follows the excess of the minimum 1-tree. If the
    value grew linearly, a full step would close the gap to `upper`, the cost of a tour. The steps decrease to zero.
    Changes: penalty, best (float64[n] each), work.
    Source: M. Held, P. Wolfe and H. P. Crowder, Validation of subgradient optimization, Mathematical Programming 6
    (1974) (the length of a step). T. Volgenant and R. Jonker, European J. Operational Research 9 (1982) (the quadratic
    decrease).
    Differs: the penalties of all sets in `Sets` change as well, in proportion to the widths of the sets. The sets
    correspond to the moats of M. Jünger and W. R. Pulleyblank (1993). A cluster of holes needs a common reward, which
    would take thousands of steps node by node.
    """
    n = len(penalty)
    root = 0 if hub != 0 else 1
    for step in range(first, last):
        value = build_sparse_spanning_tree(graph, penalty, root, work) + complete_one_tree(
            spokes, hub, tied, root, penalty, work
        )
        if value > best_value:
            best_value = value
            for i in range(n):
                best[i] = penalty[i]
        product = penalty_direction(sets, n, work.excess)
        if not (product > 0.0 and upper > value):
            break
        share = 1.0 - step / steps
        step_size = share * share * (upper - value) / product
        for i in range(n):
            penalty[i] += step_size * work.excess[i]
    return best_value
