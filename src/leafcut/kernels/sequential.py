"""Local search for directed paths with asymmetric costs and precedence.

The search finds exchanges of two or three edges along candidate lists. In terms of the pieces in `kernels.route`, an
exchange produces

    A C B D,   A B' D,   A C B' D,   A C' B D   or   A B' C' D   (' reversed).

The first form keeps all directions. The literature calls it the path-preserving exchange. Precedence is checked last,
and only for exchanges that have a gain. A reversed path is also a path, so each function works in both directions. The
coordinate of a node is the number of positions from the anchor to the node, counted either along the path or against
it.

Source: L. M. Gambardella and M. Dorigo, INFORMS J. Computing 12 (2000) (path-preserving exchanges of three edges, with
precedence).
Differs: the search follows candidate lists and gains, whereas the paper searches all positions with labels. Pieces may
be reversed. Kicks work as in `kernels.lin_kernighan`.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel, typed_constant
from leafcut.kernels.cost import CostModel
from leafcut.kernels.lin_kernighan import pop_from_queue, push_to_queue
from leafcut.kernels.random import random_below, random_uniform
from leafcut.kernels.route import (
    BLOCK,
    RING,
    SWAPPED,
    TURNED_B,
    TURNED_C,
    TWISTED,
    Lists,
    P,
    Q,
    R,
    Route,
    Rules,
    keeps_precedence,
    leg_cost,
    make_exchange,
    recompute_bias,
    switch_option,
    switch_to_best_option,
    undo_exchanges,
    visit_cost,
)

#: A kick moves pieces of at most LONGEST_PIECE nodes. It tries at most DRAWS random positions until precedence allows
#: one of them.
LONGEST_PIECE, DRAWS = 50, 12

#: If nodes have several options, this fraction of the kicks changes the option of a node.
OPTION_SHARE = 0.3

#: If the path may become longer, at most this many kicks are made at once. On short paths, the repair would undo a
#: single kick.
MOST_AT_ONCE = 3

#: Search for an exchange at most this many times after a kick.
MOST_SEARCHES = typed_constant(10_000)

#: Values for the flags of an exchange.
YES, NO = typed_constant(True), typed_constant(False)


@inner_kernel
def coordinate_of(route: Route, v: int, s: int) -> int:
    """Return the coordinate of node v: its distance from the anchor in direction s, 0 … n - 1."""
    at = route.place[v]
    return int(at if s > 0 or at == 0 else len(route.place) - at)


@inner_kernel
def node_at_coordinate(route: Route, x: int, s: int) -> int:
    """Return the node at coordinate x = 0 … n in direction s. Coordinate n is the anchor again."""
    n = len(route.node)
    if x == 0 or x == n:
        return int(route.node[0])
    return int(route.node[x if s > 0 else n - x])


@inner_kernel
def reversal_cost(route: Route, s: int, x: int, y: int) -> float:
    """Compute how much the cost inside the piece at coordinates x … y grows when the piece is reversed."""
    if route.flags[TWISTED] == 0:
        return 0.0
    n, bias, shift = len(route.bias), route.bias, route.shift
    a, b = (x, y) if s > 0 else (n - y, n - x)
    return float(bias[b] + shift[b >> BLOCK] - bias[a] - shift[a >> BLOCK])


@inner_kernel
def new_edge_cost(cost: CostModel, route: Route, rules: Rules, listed: float, u: int, v: int, s: int) -> float:
    """Return the cost of travel from u to v. It is the candidate's `listed` cost, unless nodes have several options."""
    if len(rules.way) <= len(route.node):
        return listed
    return leg_cost(cost, route, u, v, s)


@inner_kernel
def record_exchange(
    route: Route, rules: Rules, s: int, x: int, y: int, z: int, swapped: bool, b: bool, c: bool
) -> bool:
    """If precedence allows it, record the exchange that cuts the path after coordinates x < y ≤ z.

    Returns whether precedence allows the exchange.
    """
    n, move, capacity = len(route.node), route.move, len(route.buffer)
    if s > 0:
        p, q, r = x, y, z
    else:
        p, q, r = n - 1 - z, n - 1 - y, n - 1 - x
        b, c = c, b
    if r - p > capacity or not keeps_precedence(route, rules, p, q, r, swapped, b, c):
        # On a ring, A C B with empty D equals B A C, which is a different order with respect to precedence.
        if not (route.flags[RING] == 1 and swapped and r == n - 1) or b or c:
            return False
        p, q, r = -1, p, q
        if r - p > capacity or not keeps_precedence(route, rules, p, q, r, YES, NO, NO):
            return False
    move[P], move[Q], move[R] = p, q, r
    move[SWAPPED], move[TURNED_B], move[TURNED_C] = swapped, b, c
    return True


@inner_kernel
def search_cut_before(
    cost: CostModel,
    route: Route,
    rules: Rules,
    lists: Lists,
    breadth: int,
    min_gain: float,
    s: int,
    x0: int,
    t1: int,
    c: int,
    gain: float,
) -> float:
    """Search for an exchange that adds the edge from x0 to c and removes the edge that leads to c.

    For the symbols, see `find_exchange`. `gain` is the gain of the edge to c over the edge to t1. The exchange is
    stored in `move`. Returns the gain of the exchange, or 0 if the search fails. Changes: move.
    """
    n = len(route.node)
    xc = coordinate_of(route, c, s)
    cut = (xc if xc > 0 else n) - 1
    t3 = node_at_coordinate(route, cut, s)
    gain += leg_cost(cost, route, t3, c, s)
    span = cut - x0 if cut > x0 else cut - x0 + n
    for k in range(min(breadth, lists.near.shape[1])):  # A C B D, with its cuts in each of three roles
        e = lists.near[t3, k]
        if e < 0 or gain - lists.near_cost[t3, k] <= min_gain:
            break
        xe = coordinate_of(route, e, s)
        last = (xe if xe > 0 else n) - 1
        if (last - x0 if last >= x0 else last - x0 + n) <= span:
            continue
        u = node_at_coordinate(route, last, s)
        total = (
            gain - new_edge_cost(cost, route, rules, lists.near_cost[t3, k], t3, e, s) + leg_cost(cost, route, u, e, s)
        )
        total -= leg_cost(cost, route, u, t1, s)
        if total > min_gain:
            x, z = min(x0, cut, last), max(x0, cut, last)
            if record_exchange(route, rules, s, x, x0 + cut + last - x - z, z, YES, NO, NO):
                return total
    if cut <= x0:
        return 0.0
    inside = reversal_cost(route, s, x0 + 1, cut)
    for k in range(min(breadth, lists.back.shape[1])):  # A C B' D
        e = lists.back[t3, k]
        if e < 0 or gain - lists.back_cost[t3, k] <= min_gain:
            break
        xe = coordinate_of(route, e, s)
        if xe < xc or xc == 0:
            continue
        f = node_at_coordinate(route, xe + 1, s)
        total = (
            gain - new_edge_cost(cost, route, rules, lists.back_cost[t3, k], e, t3, s) + leg_cost(cost, route, e, f, s)
        )
        total -= leg_cost(cost, route, t1, f, s) + inside
        if total > min_gain and record_exchange(route, rules, s, x0, cut, xe, YES, YES, NO):
            return total
    return 0.0


@inner_kernel
def search_cut_after(
    cost: CostModel,
    route: Route,
    rules: Rules,
    lists: Lists,
    breadth: int,
    min_gain: float,
    s: int,
    x0: int,
    t1: int,
    xc: int,
    gain: float,
) -> float:
    """Search for an exchange that adds the edge to the node at coordinate xc > x0 + 1 and removes the edge after it.

    Everything else works as in `search_cut_before`.
    """
    n = len(route.node)
    d = node_at_coordinate(route, xc + 1, s)
    gain += leg_cost(cost, route, node_at_coordinate(route, xc, s), d, s)
    inside = reversal_cost(route, s, x0 + 1, xc)
    total = gain - leg_cost(cost, route, t1, d, s) - inside  # A B' D
    if total > min_gain and record_exchange(route, rules, s, x0, xc, xc, NO, YES, NO):
        return total
    for k in range(min(breadth, lists.back.shape[1])):  # A C' B D
        e = lists.back[d, k]
        if e < 0 or gain - lists.back_cost[d, k] <= min_gain:
            break
        xe = coordinate_of(route, e, s)
        if xe <= x0 or xe >= xc:
            continue
        h = node_at_coordinate(route, xe + 1, s)
        total = (
            gain - new_edge_cost(cost, route, rules, lists.back_cost[d, k], e, d, s) + leg_cost(cost, route, e, h, s)
        )
        total -= leg_cost(cost, route, h, t1, s) + reversal_cost(route, s, xe + 1, xc)
        if total > min_gain and record_exchange(route, rules, s, x0, xe, xc, YES, NO, YES):
            return total
    for k in range(min(breadth, lists.near.shape[1]) if xc + 1 < n else 0):  # A B' C' D
        f = lists.near[d, k]
        if f < 0 or gain - lists.near_cost[d, k] <= min_gain:
            break
        xf = coordinate_of(route, f, s)
        last = (xf if xf > 0 else n) - 1
        if last <= xc:
            continue
        e = node_at_coordinate(route, last, s)
        total = (
            gain - new_edge_cost(cost, route, rules, lists.near_cost[d, k], d, f, s) + leg_cost(cost, route, e, f, s)
        )
        total -= leg_cost(cost, route, t1, e, s) + inside + reversal_cost(route, s, xc + 1, last)
        if total > min_gain and record_exchange(route, rules, s, x0, xc, last, NO, YES, YES):
            return total
    return 0.0


@inner_kernel
def find_exchange(
    cost: CostModel,
    route: Route,
    rules: Rules,
    lists: Lists,
    breadth: NDArray,
    min_gain: float,
    s: int,
    t0: int,
) -> float:
    """Search for an exchange that gives t0 a different successor and gains more than `min_gain`.

    Returns the gain, or 0 if the search fails.

    ======= ======== ===============================================================
    lists   Lists    candidates in direction s
    breadth int64[2] number of candidates for the first and for the second new edge
    s       int      direction: 1, or -1 for the reversed path
    x0, t1  int      coordinate of t0, and its current successor
    ======= ======== ===============================================================

    Changes: move.
    """
    x0 = coordinate_of(route, t0, s)
    t1 = node_at_coordinate(route, x0 + 1, s)
    current = leg_cost(cost, route, t0, t1, s)
    for k in range(min(breadth[0], lists.near.shape[1])):
        c = lists.near[t0, k]
        if c < 0 or current - lists.near_cost[t0, k] <= min_gain:
            break
        gain = current - new_edge_cost(cost, route, rules, lists.near_cost[t0, k], t0, c, s)
        if c == t1 or gain <= min_gain:
            continue
        gained = search_cut_before(cost, route, rules, lists, breadth[1], min_gain, s, x0, t1, c, gain)
        if gained > 0.0:
            return gained
        xc = coordinate_of(route, c, s)
        if xc > x0:
            gained = search_cut_after(cost, route, rules, lists, breadth[1], min_gain, s, x0, t1, xc, gain)
            if gained > 0.0:
                return gained
    return 0.0


@kernel
def improve_route(
    cost: CostModel, route: Route, rules: Rules, breadth: NDArray, min_gain: float, max_searches: int
) -> float:
    """Make exchanges at the queued nodes, and return the gain.

    The search stops when the queue is empty, the log is full, or `max_searches` searches have been made. Changes:
    route.
    """
    total = 0.0
    while route.counts[1] > 0 and route.counts[3] == 0 and max_searches > 0:
        v = pop_from_queue(route)
        while True:
            max_searches -= 1
            gain = switch_to_best_option(cost, route, rules, v, min_gain)
            if gain <= 0.0:
                # Numba compiles a version for each constant direction. A common version would be a third slower.
                gain = find_exchange(cost, route, rules, rules.onward, breadth, min_gain, 1, v)
                if gain <= 0.0:
                    gain = find_exchange(cost, route, rules, rules.backward, breadth, min_gain, -1, v)
                if gain > 0.0 and not make_exchange(cost, route):
                    gain = 0.0
            total += gain
            if gain <= 0.0 or max_searches <= 0:
                break
        if gain > 0.0:
            push_to_queue(route, v)
    return total


@inner_kernel
def swap_random_pieces(cost: CostModel, route: Route, rules: Rules, states: NDArray, k: int) -> float:
    """Swap two adjacent pieces at a random position that precedence allows, and return the added cost.

    Changes: route, states[k].
    """
    node, move, n = route.node, route.move, len(route.node)
    first = -1 if route.flags[RING] == 1 else 0
    for draw in range(DRAWS):
        max_length = max(1, LONGEST_PIECE >> (draw // 2))
        p = first + random_below(states, k, n - 2 - first)
        q = p + 1 + random_below(states, k, min(max_length, n - 2 - p))
        r = q + 1 + random_below(states, k, min(max_length, n - 1 - q))
        if (p < 0 and r == n - 1) or r - p > len(route.buffer):
            continue
        if not keeps_precedence(route, rules, p, q, r, YES, NO, NO):
            continue
        move[P], move[Q], move[R], move[SWAPPED], move[TURNED_B], move[TURNED_C] = p, q, r, 1, 0, 0
        a, b, c, d, e = node[p], node[p + 1], node[q], node[q + 1], node[r]
        f = node[r + 1 if r + 1 < n else 0]
        added = leg_cost(cost, route, a, d, 1) + leg_cost(cost, route, e, b, 1) + leg_cost(cost, route, c, f, 1)
        added -= leg_cost(cost, route, a, b, 1) + leg_cost(cost, route, c, d, 1) + leg_cost(cost, route, e, f, 1)
        return added if make_exchange(cost, route) else 0.0
    return 0.0


@inner_kernel
def switch_to_random_option(cost: CostModel, route: Route, rules: Rules, states: NDArray, k: int) -> float:
    """Switch a random node to a random option, and return the added cost. Changes: route, states[k]."""
    v = random_below(states, k, len(route.node))
    start, stop = rules.way_begin[v], rules.way_begin[v + 1]
    if stop - start < 2:
        return 0.0
    row = rules.way[start + random_below(states, k, stop - start)]
    added = visit_cost(cost, route, rules, v, row) - visit_cost(cost, route, rules, v, route.enter[v])
    return added if switch_option(cost, route, rules, v, row) else 0.0


@inner_kernel
def kick(cost: CostModel, route: Route, rules: Rules, states: NDArray, k: int, times: int) -> float:
    """Change the path at `times` random positions, and return the added cost. Changes: route, states[k]."""
    added = 0.0
    for _ in range(times):
        if len(rules.way) > len(route.node) and random_uniform(states, k) < OPTION_SHARE:
            added += switch_to_random_option(cost, route, rules, states, k)
        else:
            added += swap_random_pieces(cost, route, rules, states, k)
    return added


@kernel
def kick_route(
    cost: CostModel,
    route: Route,
    rules: Rules,
    breadth: NDArray,
    min_gain: float,
    heat: float,
    states: NDArray,
    k: int,
    kicks: int,
) -> float:
    """Kick and repair the path `kicks` times. Undo results that make the path longer, and return the total gain.

    If `heat` is above 0, several kicks are repaired at once. A path that is longer by x is then accepted with
    probability exp(-x / heat), as in simulated annealing.
    Changes: route, states[k].
    """
    total = 0.0
    recompute_bias(cost, route)
    for _ in range(kicks):
        route.counts[2], route.counts[3] = 0, 0
        times = 1 + random_below(states, k, MOST_AT_ONCE) if heat > 0.0 else 1
        added = kick(cost, route, rules, states, k, times)
        gained = improve_route(cost, route, rules, breadth, min_gain, MOST_SEARCHES) - added
        allowed = heat * math.log(1.0 - random_uniform(states, k)) if heat > 0.0 else -min_gain
        if route.counts[3] == 1 or route.counts[1] > 0 or gained < allowed:
            while route.counts[1] > 0:
                pop_from_queue(route)
            undo_exchanges(cost, route, rules)
        else:
            total += gained
    return total
