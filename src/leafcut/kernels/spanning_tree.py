"""Build minimum spanning trees over all pairs of nodes under penalties. These trees prove a lower bound.

The tree leaves out one node, the hub of a 1-tree. The penalised cost of an edge is d(i, j) + (p_i + p_j). The terms are
added in this order so that rounding is the same from both ends.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.cost import EXPLICIT, CostModel, metric_distance, node_travel_cost
from leafcut.kernels.neighbours import Tree, squared_distance_to_box
from leafcut.kernels.one_tree import Graph


@kernel
def build_dense_spanning_tree(
    cost: CostModel,
    penalty: NDArray,
    excluded: int,
    outside: NDArray,
    key: NDArray,
    near: NDArray,
    a: NDArray,
    b: NDArray,
) -> None:
    """Build the minimum spanning tree by scanning all n² pairs. This works for any metric and needs O(n) memory.

    If several edges have equal cost, the algorithm uses the edge to the node that joined last. Chains form as a result,
    and not stars.
    Changes: outside, near int32[n], key float64[n] (work arrays); a, b int32[n-2], the edges.
    Source: R. C. Prim, Bell System Technical Journal 36 (1957).
    """
    size = 0
    for j in range(len(penalty)):
        if j != excluded:
            outside[size], key[size] = j, math.inf
            size += 1
    size -= 1
    i = outside[size]
    for e in range(len(a)):
        nearest = 0
        for s in range(size):
            # For a matrix, a lookup is enough, because tied and free edges end at the hub.
            d = cost.matrix[i, outside[s]] if cost.code == EXPLICIT else node_travel_cost(cost, i, outside[s])
            c = d + (penalty[i] + penalty[outside[s]])
            if c <= key[s]:
                key[s], near[s] = c, i
            if key[s] < key[nearest]:
                nearest = s
        a[e], b[e] = near[nearest], outside[nearest]
        i = outside[nearest]
        size -= 1
        outside[nearest], key[nearest], near[nearest] = outside[size], key[size], near[size]


class ForestParts(NamedTuple):
    """The parts of a forest. Each round merges some of them until a single tree remains.

    =========== ========== ==============================================================================
    up          int64[n]   union–find: a part is identified by the root of its nodes
    part        int32[n]   part of every node
    low         int32[m]   smallest id of a part that has points in a box of the k-d tree
    high        int32[m]   largest such id; -1 for none
    min_penalty float64[m] smallest penalty of its points
    nearest     int32[n]   cheapest node that the search has found in another part, or -1
    reach       float64[n] lower bound on the cost to other parts; if `nearest` exists, its cost
    best        float64[n] cost of the cheapest edge that leaves each part, from `leave` to `arrive`
    leave       int64[n]
    arrive      int64[n]
    stack       int64[128] boxes to visit
    =========== ========== ==============================================================================
    """

    up: NDArray
    part: NDArray
    low: NDArray
    high: NDArray
    min_penalty: NDArray
    nearest: NDArray
    reach: NDArray
    best: NDArray
    leave: NDArray
    arrive: NDArray
    stack: NDArray


@kernel
def find_cheapest_leaving_edges_in_graph(graph: Graph, penalty: NDArray, parts: ForestParts) -> None:
    """Find the cheapest graph edge that leaves each part. Changes: parts.best, leave, arrive."""
    part, best, near = parts.part, parts.best, graph.near
    for i in range(len(part)):
        best[i] = math.inf
    for i in range(len(part)):
        own = part[i]
        for e in range(graph.begin[i], graph.begin[i + 1]):
            j = near[e]
            if part[j] != own:
                c = graph.length[e] + (penalty[i] + penalty[j])
                if c < best[own]:
                    best[own], parts.leave[own], parts.arrive[own] = c, i, j


@kernel
def find_cheapest_leaving_edges_in_kd_tree(
    cost: CostModel, tree: Tree, penalty: NDArray, excluded: int, max_visits: int, parts: ForestParts
) -> int:
    """Search the k-d tree for the cheapest edge that leaves each part.

    Returns the number of visited boxes, or -1 if it exceeds `max_visits`.

    Every metric of positions increases with |dx| and |dy|, even after rounding, and a lift can only add to the cost. An
    edge into a box therefore costs at least as much as an edge to the nearest point of the box. Values that are already
    in `parts.best` prune the search.
    Changes: parts.nearest, reach, best, leave, arrive, stack.
    """
    part, best, nearest, reach, low, high = parts.part, parts.best, parts.nearest, parts.reach, parts.low, parts.high
    min_penalty, stack, box = parts.min_penalty, parts.stack, tree.box
    visits = 0
    for i in range(len(tree.x)):
        x, y, own = tree.x[i], tree.y[i], part[i]
        if i == excluded:
            continue
        searched = (nearest[i] < 0 or part[nearest[i]] == own) and reach[i] < best[own]
        if searched:
            nearest[i], reach[i] = -1, best[own]
        stack[0] = 0
        height = 1 if searched else 0
        while height > 0:
            height -= 1
            box_node = stack[height]
            visits += 1
            if high[box_node] < 0 or low[box_node] == own == high[box_node]:
                continue
            dx = max(box[box_node, 0] - x, x - box[box_node, 2], 0.0)
            dy = max(box[box_node, 1] - y, y - box[box_node, 3], 0.0)
            c = metric_distance(cost.code, dx, dy, 0.0, 0.0, cost.vx, cost.vy, cost.ax, cost.ay, cost.per_mm)
            if c + (penalty[i] + min_penalty[box_node]) >= reach[i]:
                continue
            right = tree.child[box_node] + 1
            if right > 0:
                # The nearer box is visited first, because its result lowers the limit for the other box.
                second = (
                    0
                    if squared_distance_to_box(box, right, x, y) < squared_distance_to_box(box, right - 1, x, y)
                    else 1
                )
                stack[height], stack[height + 1] = right - 1 + second, right - second
                height += 2
                continue
            for j in range(tree.begin[box_node], tree.stop[box_node]):
                if j != excluded and part[j] != own:
                    c = node_travel_cost(cost, i, j) + (penalty[i] + penalty[j])
                    if c < reach[i]:
                        reach[i], nearest[i] = c, j
            visits += tree.stop[box_node] - tree.begin[box_node]
        if visits > max_visits:
            return -1
        if nearest[i] >= 0 and part[nearest[i]] != own and reach[i] < best[own]:
            best[own], parts.leave[own], parts.arrive[own] = reach[i], i, nearest[i]
    return visits


@inner_kernel
def _find_part_of_node(up: NDArray, i: int) -> int:
    """Find the part that contains node i, and return its number. Changes: up (path compression)."""
    while up[i] != i:
        up[i] = up[up[i]]
        i = up[i]
    return i


@kernel
def join_parts(excluded: int, parts: ForestParts, a: NDArray, b: NDArray, count: int) -> int:
    """Merge the parts of the forest along the edges that leave them, and return the number of edges in the tree.

    Ties are harmless. If two edges of equal cost would close a cycle, the second edge is dropped. It costs no less than
    the edge that has already merged its part.
    Changes: parts.up, part; a, b int32[n-2] from `count` on.
    Source: O. Borůvka, Práce Moravské přírodovědecké společnosti 3 (1926).
    """
    up, part = parts.up, parts.part
    for i in range(len(up)):
        if part[i] == i and i != excluded and parts.best[i] < math.inf:
            u, v = _find_part_of_node(up, parts.leave[i]), _find_part_of_node(up, parts.arrive[i])
            if u != v:
                up[u] = v
                a[count], b[count] = parts.leave[i], parts.arrive[i]
                count += 1
    for i in range(len(up)):
        part[i] = _find_part_of_node(up, i)
    return count
