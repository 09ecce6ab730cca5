"""Start of a directed path search: candidates from exits to entries, and an initial path."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import kernel
from leafcut.kernels.candidates import _choose
from leafcut.kernels.cost import CostModel, travel
from leafcut.kernels.neighbours import Nearby, Tree, find_nearby
from leafcut.kernels.route import Route, Rules, leg


@kernel
def fill_directed_candidates(
    cost: CostModel,
    tree: Tree,
    goal: NDArray,
    query: NDArray,
    per_quadrant: int,
    candidates: NDArray,
    lengths: NDArray,
    nearby: Nearby,
) -> None:
    """Fill the list of every query: the nearest goals per quadrant, and the nearest overall, except its own.

    Symbols: tree, of m goals, with space for one more point after them; goal int32[m], query int32[n], rows of
    `CostModel.xy`. Lists hold point numbers of the tree. The cost of travel from query to goal is symmetric.
    Changes: candidates int32[n, k] (sorted by cost; -1 if there are fewer) and lengths float64[n, k]; the last point of
    the tree; nearby.
    """
    m, k = len(goal), candidates.shape[1]
    for i in range(len(query)):
        tree.x[m], tree.y[m] = cost.xy[query[i], 0], cost.xy[query[i], 1]
        tree.leaf_of[m] = 0  # the root: the search starts there and covers all points
        nearby.limit[:] = math.inf
        find_nearby(tree, m, per_quadrant, k, nearby)
        count = _choose(nearby.found, nearby.near, per_quadrant, k, nearby.chosen)
        for c in range(k):
            candidates[i, c], lengths[i, c] = -1, math.inf
        for f in range(count):
            j = nearby.chosen[f]
            d = travel(cost, query[i], goal[j])
            slot = f
            while slot > 0 and lengths[i, slot - 1] > d:
                lengths[i, slot], candidates[i, slot] = lengths[i, slot - 1], candidates[i, slot - 1]
                slot -= 1
            lengths[i, slot], candidates[i, slot] = d, j


@kernel
def lay_route(
    cost: CostModel, route: Route, rules: Rules, open_nodes: NDArray, open_index: NDArray, missing: NDArray
) -> None:
    """Build a path from the node at position 0, always to the cheapest node whose predecessors are all on the path.

    Symbols: open_ int32[n], nodes that may come next, without the node at position 0; spot int32[n], index of each node
    there, -1 for the others; missing int32[n], number of predecessors that are not on the path yet. The precedence has
    no cycles. Candidates are tried first; if none may come next, all open nodes.
    Changes: node, place, open_nodes, open_index, missing.
    """
    n, near = len(route.node), rules.onward.near
    count = 0
    while count < n and open_nodes[count] >= 0:
        count += 1
    for step in range(n):
        if step > 0:
            last, best = route.node[step - 1], -1
            for k in range(near.shape[1]):
                if near[last, k] < 0 or open_index[near[last, k]] >= 0:
                    best = near[last, k]
                    break
            if best < 0:
                best_d = math.inf
                for f in range(count):
                    d = leg(cost, route, last, open_nodes[f], 1)
                    if d < best_d:
                        best, best_d = open_nodes[f], d
            count -= 1
            moved = open_nodes[count]
            open_nodes[open_index[best]], open_index[moved] = moved, open_index[best]
            open_index[best] = -1
            route.node[step] = best
        v = route.node[step]
        route.place[v] = step
        for e in range(rules.after_begin[v], rules.after_begin[v + 1]):
            w = rules.after[e]
            missing[w] -= 1
            if missing[w] == 0:
                open_nodes[count], open_index[w] = w, count
                count += 1
