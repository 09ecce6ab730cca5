"""A directed path that is being improved: exchange pieces of the path, and undo exchanges.

The path is an array with an anchor at position 0 (the depot of an open path). It is treated as a circle, so the first
position follows the last. An exchange cuts the path after up to three positions p < q < r. The pieces are A = … p, B =
p + 1 … q, C = q + 1 … r and D = r + 1 …. The exchange then reassembles the path with B and C swapped, reversed, or
both. The cost of reversing a piece is the difference of two prefix sums, so the search does not need to visit its
nodes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost
from leafcut.kernels.lin_kernighan import push_to_queue

#: Binary logarithm of the number of positions that share an entry of `Route.shift`.
BLOCK = 8

#: Columns of `Route.move`: the three cuts, and how the two pieces between them change.
P, Q, R, SWAPPED, TURNED_B, TURNED_C = 0, 1, 2, 3, 4, 5

#: Indices into `Route.flags`.
TWISTED, RING = 0, 1

#: In the log, this value marks a change of a node's option. It takes the place of an exchange's third cut.
CHOICE = -2


class Route(NamedTuple):
    """A path that is being improved, and the state of the search. Each worker has its own object.

    ======== =============== ==========================================================================
    node     int32[n]        nodes in the order of the path
    place    int32[n]        position of each node in the path
    enter    int32[n]        row of `CostModel.xy` (or of its matrix) at which a node is entered
    leave    int32[n]        row at which a node is left
    bias     float64[n]      plus shift: cost of travel back to the anchor minus cost of travel from the anchor
    shift    float64[b]      value added to `bias` of 2**BLOCK positions each
    flags    int64[2]        TWISTED: some travel costs are asymmetric; otherwise, bias is not used;
                             RING: the path may start anywhere, otherwise the node at position 0 is fixed
    queue    int32[n]        ring buffer of nodes to examine; counts[0] is its start, counts[1] its length
    queued   uint8[n]        1 for nodes in the queue
    counts   int64[4]        start and length of the queue, entries in the log, 1 if the log was too small
    log      int32[m]        overwritten entries, the last on top; m = 0 without a log
    buffer   int32[b]        pieces being moved; exchanges that write more than b positions are not made
    move     int64[6]        the exchange that was found
    ======== =============== ==========================================================================
    """

    node: NDArray[np.int32]
    place: NDArray[np.int32]
    enter: NDArray[np.int32]
    leave: NDArray[np.int32]
    bias: NDArray[np.float64]
    shift: NDArray[np.float64]
    flags: NDArray[np.int64]
    queue: NDArray[np.int32]
    queued: NDArray[np.uint8]
    counts: NDArray[np.int64]
    log: NDArray[np.int32]
    buffer: NDArray[np.int32]
    move: NDArray[np.int64]


class Lists(NamedTuple):
    """Each node's candidates in one direction of the path, cheapest first. Missing entries are -1 with infinite cost.

    ========= ============== ===================================================
    near      int32[n, c]    nodes that are cheap to reach from a node
    near_cost float64[n, c]  costs of travel to them; the minimum over several options
    back      int32[n, c]    nodes from which a node is cheap to reach
    back_cost float64[n, c]  costs of travel from them
    ========= ============== ===================================================
    """

    near: NDArray[np.int32]
    near_cost: NDArray[np.float64]
    back: NDArray[np.int32]
    back_cost: NDArray[np.float64]


class Rules(NamedTuple):
    """Data that does not change while a path is being improved.

    ============ ============= ==================================================================================
    after_begin  int32[n + 1]  successors of node v: after[after_begin[v] … after_begin[v+1] - 1]
    after        int32[k]
    before_begin int32[n + 1]  predecessors of a node, stored likewise
    before       int32[k]
    way_begin    int32[n + 1]  options of a node, stored likewise; the path uses exactly one of them
    way          int32[w]      entry row of an option
    beyond       int64[1]      exit row minus entry row of an option
    service      float64[rows] cost within an option, by entry row
    onward       Lists         candidates along the path
    backward     Lists         the same for the reversed path
    ============ ============= ==================================================================================
    """

    after_begin: NDArray[np.int32]
    after: NDArray[np.int32]
    before_begin: NDArray[np.int32]
    before: NDArray[np.int32]
    way_begin: NDArray[np.int32]
    way: NDArray[np.int32]
    beyond: NDArray[np.int64]
    service: NDArray[np.float64]
    onward: Lists
    backward: Lists


@inner_kernel
def leg_cost(cost: CostModel, route: Route, u: int, v: int, s: int) -> float:
    """Compute the cost of travel from node u to node v, or from v to u if s = -1."""
    if s > 0:
        return node_travel_cost(cost, route.leave[u], route.enter[v])
    return node_travel_cost(cost, route.leave[v], route.enter[u])


@inner_kernel
def update_bias(cost: CostModel, route: Route, low: int, high: int) -> None:
    """Update bias and shift after the nodes at positions low … high have changed. Changes: bias, shift."""
    node, bias, shift, n = route.node, route.bias, route.shift, len(route.node)
    value = bias[low - 1] + shift[(low - 1) >> BLOCK] if low > 0 else 0.0
    for at in range(low, min(high + 2, n)):
        if at > 0:
            u, v = node[at - 1], node[at]
            value += leg_cost(cost, route, v, u, 1) - leg_cost(cost, route, u, v, 1)
        if at <= high:
            bias[at] = value - shift[at >> BLOCK]
    if high + 1 < n:
        block = (high + 1) >> BLOCK
        change = value - (bias[high + 1] + shift[block])
        for at in range(high + 1, min((block + 1) << BLOCK, n)):
            bias[at] += change
        for b in range(block + 1, len(shift)):
            shift[b] += change


@kernel
def recompute_bias(cost: CostModel, route: Route) -> None:
    """Recompute bias from scratch, because incremental updates accumulate rounding errors. Changes: bias, shift."""
    if route.flags[TWISTED] == 1:
        route.shift[:] = 0.0
        update_bias(cost, route, 0, len(route.node) - 1)


@inner_kernel
def keeps_precedence(route: Route, rules: Rules, p: int, q: int, r: int, swapped: bool, b: bool, c: bool) -> bool:
    """Check whether the path would still satisfy the precedence after an exchange.

    `swapped` means that the exchange swaps the pieces. `b` and `c` mean that it reverses piece B or C.
    """
    node, place, after_begin, after = route.node, route.place, rules.after_begin, rules.after
    if len(after) == 0:
        return True
    if swapped and q - p <= r - q:
        for at in range(q, p, -1):
            v = node[at]
            for e in range(after_begin[v], after_begin[v + 1]):
                if q < place[after[e]] <= r:
                    return False
    elif swapped:
        for at in range(q + 1, r + 1):
            v = node[at]
            for e in range(rules.before_begin[v], rules.before_begin[v + 1]):
                if p < place[rules.before[e]] <= q:
                    return False
    for at in range(p + 1 if b else q + 1, (r if c else q) + 1):
        v = node[at]
        for e in range(after_begin[v], after_begin[v + 1]):
            if place[after[e]] <= (q if at <= q else r):
                return False
    return True


@inner_kernel
def log_exchange(route: Route, p: int, r: int) -> bool:
    """Write the nodes at positions p + 1 … r to the log, and return whether the log had space for them.

    Changes: log, counts.
    """
    log, top = route.log, route.counts[2]
    if len(log) == 0:
        return True
    if top + (r - p) + 2 > len(log):
        route.counts[3] = 1
        return False
    for at in range(p + 1, r + 1):
        log[top] = route.node[at]
        top += 1
    log[top], log[top + 1] = p, r
    route.counts[2] = top + 2
    return True


@inner_kernel
def make_exchange(cost: CostModel, route: Route) -> bool:
    """Make the exchange in `move`, log the overwritten entries, and queue the nodes at the cuts.

    Returns whether the log had enough space. Changes: node, place, bias, shift, queue, queued, counts, log, buffer.
    """
    node, place, move, buffer = route.node, route.place, route.move, route.buffer
    n, p, q, r = len(node), move[P], move[Q], move[R]
    if not log_exchange(route, p, r):
        return False
    filled = 0
    for piece in range(2):
        second = (piece == 0) == (move[SWAPPED] == 1)
        first, last = (q + 1, r) if second else (p + 1, q)
        turned = (move[TURNED_C] if second else move[TURNED_B]) == 1
        for k in range(last - first + 1):
            buffer[filled] = node[last - k if turned else first + k]
            filled += 1
    for k in range(filled):
        node[p + 1 + k] = buffer[k]
        place[buffer[k]] = p + 1 + k
    if route.flags[TWISTED] == 1:
        update_bias(cost, route, p + 1, r)
    middle = p + (r - q if move[SWAPPED] == 1 else q - p)
    for cut in (p, middle, r):
        push_to_queue(route, node[cut])
        push_to_queue(route, node[cut + 1 if cut + 1 < n else 0])
    return True


@inner_kernel
def visit_cost(cost: CostModel, route: Route, rules: Rules, v: int, row: int) -> float:
    """Compute the cost of visiting node v by the option with entry row `row`.

    The cost consists of the travel to the node, the service, and the travel to the next node.
    """
    index = route.place[v]
    u, w = route.node[index - 1], route.node[index + 1 if index + 1 < len(route.node) else 0]
    arrival, departure = (
        node_travel_cost(cost, route.leave[u], row),
        node_travel_cost(cost, row + rules.beyond[0], route.enter[w]),
    )
    return float(rules.service[row] + arrival + departure)


@inner_kernel
def switch_option(cost: CostModel, route: Route, rules: Rules, v: int, row: int) -> bool:
    """Switch node v to the option with entry row `row`, log the previous option, and queue v and its neighbours.

    Returns whether the log had enough space. Changes: enter, leave, bias, shift, queue, queued, counts, log.
    """
    at, top = route.place[v], route.counts[2]
    if len(route.log) > 0:
        if top + 3 > len(route.log):
            route.counts[3] = 1
            return False
        route.log[top], route.log[top + 1], route.log[top + 2] = route.enter[v], v, CHOICE
        route.counts[2] = top + 3
    route.enter[v], route.leave[v] = row, row + rules.beyond[0]
    if route.flags[TWISTED] == 1:
        update_bias(cost, route, at, at)
    push_to_queue(route, v)
    push_to_queue(route, route.node[at - 1])
    push_to_queue(route, route.node[at + 1 if at + 1 < len(route.node) else 0])
    return True


@inner_kernel
def switch_to_best_option(cost: CostModel, route: Route, rules: Rules, v: int, min_gain: float) -> float:
    """Switch node v to the option that is best between its neighbours, if the gain exceeds `min_gain`.

    Returns the gain, or 0 if the option stays the same. Changes: see `switch_option`.
    """
    start, stop = rules.way_begin[v], rules.way_begin[v + 1]
    if stop - start < 2:
        return 0.0
    best = route.enter[v]
    current = visit_cost(cost, route, rules, v, best)
    best_cost = current - min_gain
    for e in range(start, stop):
        total = visit_cost(cost, route, rules, v, rules.way[e])
        if total < best_cost:
            best, best_cost = rules.way[e], total
    if best == route.enter[v] or not switch_option(cost, route, rules, v, best):
        return 0.0
    return float(current - best_cost)


@inner_kernel
def undo_exchanges(cost: CostModel, route: Route, rules: Rules) -> None:
    """Undo all changes in the log, most recent first, and empty the log.

    Changes: node, place, enter, leave, bias, shift, counts.
    """
    top, log = route.counts[2], route.log
    while top > 0:
        p, r = log[top - 2], log[top - 1]
        top -= 2
        if r == CHOICE:
            top -= 1
            route.enter[p], route.leave[p] = log[top], log[top] + rules.beyond[0]
            p = route.place[p] - 1
            r = p + 1
        else:
            top -= r - p
            for k in range(r - p):
                route.node[p + 1 + k] = log[top + k]
                route.place[log[top + k]] = p + 1 + k
        if route.flags[TWISTED] == 1:
            update_bias(cost, route, p + 1, r)
    route.counts[2] = 0


@kernel
def build_cheapest_path(
    cost: CostModel, route: Route, rules: Rules, open_nodes: NDArray, open_index: NDArray, missing: NDArray
) -> None:
    """Build a path from the node at position 0.

    The path always continues with the cheapest node whose predecessors are all on the path. The search tries candidates
    first. If no candidate may come next, it tries all open nodes. The precedence must not contain cycles.

    Symbols: open_nodes int32[n] contains the nodes that may come next, without the node at position 0. open_index
    int32[n] is the index of each node in open_nodes, or -1. missing int32[n] is the number of predecessors that are not
    on the path yet.
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
                    d = leg_cost(cost, route, last, open_nodes[f], 1)
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
