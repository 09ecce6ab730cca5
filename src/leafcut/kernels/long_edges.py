"""Repair long edges. One end of the edge stays fixed, and the other end walks towards it along candidate edges.

If fragments of a greedy tour end far apart, a long edge remains. No exchange of five edges can shorten it, because the
tour would become longer until the end has left its cluster. The end therefore walks many steps. Each step adds an edge
from the walking end to one of its candidates, and removes the edge before that candidate. The node that loses this edge
becomes the new end. Finally, the steps after the best position are undone.

Source: S. Lin and B. W. Kernighan, Operations Research 21 (1973), section 1 (the step, the gain criterion, and the rule
that an added edge is not removed again).
Differs: each step uses the candidate that gives the shortest tour.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import EPSILON, NONE, inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost
from leafcut.kernels.lin_kernighan import Tour, predecessor, push_to_queue, reverse_positions, successor


@inner_kernel
def _make_walk_step(tour: Tour, fixed: int, moving: int, target: int) -> int:
    """Walk one step: remove the edge fixed–moving and the edge before `target`, and add the edge moving–target.

    The node before `target` becomes the new end, next to `fixed`. Returns the number of written positions. Changes:
    node, place.
    """
    node, place = tour.node, tour.place
    if successor(node, place, fixed) == moving:
        return reverse_positions(node, place, place[moving], place[predecessor(node, place, target)])
    return reverse_positions(node, place, place[successor(node, place, target)], place[moving])


@inner_kernel
def _let_end_walk(
    cost: CostModel,
    tour: Tour,
    candidates: NDArray,
    lengths: NDArray,
    joined_to: NDArray,
    steps: NDArray,
    fixed: int,
    moving: int,
    places: int,
) -> tuple[float, int]:
    """Walk an end of an edge step by step along candidate edges.

    Returns the gain of the steps that are kept, and the number of positions that may still be written (`places`).
    Changes: tour, joined_to, steps.
    """
    open_length, best, kept, count = node_travel_cost(cost, fixed, moving), 0.0, 0, 0
    while count < len(steps) and places > 0:
        forward = successor(tour.node, tour.place, fixed) == moving
        shortest, target, gain = math.inf, NONE, 0.0
        for c in range(candidates.shape[1]):
            x = candidates[moving, c]
            if x < 0:
                break
            y = predecessor(tour.node, tour.place, x) if forward else successor(tour.node, tour.place, x)
            if x == fixed or y in (moving, fixed) or joined_to[x] == y or joined_to[y] == x:
                continue
            gain_here = open_length - lengths[moving, c] + node_travel_cost(cost, y, x)
            if gain_here > best + EPSILON and node_travel_cost(cost, fixed, y) - gain_here < shortest:
                shortest, target, gain = node_travel_cost(cost, fixed, y) - gain_here, x, gain_here
        if target < 0:
            break
        end = predecessor(tour.node, tour.place, target) if forward else successor(tour.node, tour.place, target)
        places -= _make_walk_step(tour, fixed, moving, target)
        joined_to[moving] = target
        steps[count, 0], steps[count, 1] = moving, target
        moving, open_length, count = end, gain, count + 1
        if -shortest > best + EPSILON:
            best, kept = -shortest, count
    for k in range(count - 1, -1, -1):
        joined_to[steps[k, 0]] = -1
        if k >= kept:
            places -= _make_walk_step(tour, fixed, moving, steps[k, 1])
            moving = steps[k, 0]
        else:
            push_to_queue(tour, steps[k, 0])
            push_to_queue(tour, steps[k, 1])
    if kept > 0:
        push_to_queue(tour, fixed)
        push_to_queue(tour, moving)
    return best, places


@kernel
def shorten_by_walking(
    cost: CostModel,
    tour: Tour,
    candidates: NDArray,
    lengths: NDArray,
    edges: NDArray,
    joined_to: NDArray,
    steps: NDArray,
    places: int,
) -> float:
    """Try to shorten long edges by letting one end walk and then the other end. Return the gain.

    ========== =============== ==========================================================
    candidates int32[n, k]     neighbours of every node, nearest first, -1 for none
    lengths    float64[n, k]   costs of those edges
    edges      int32[m, 2]     the long edges; edges that no longer exist are skipped
    joined_to  int32[n]        node to which an end walked, or -1; all -1 before and after the call
    steps      int32[most, 2]  steps of one walk: the walking end and its destination
    places     int             approximate maximum number of positions to write
    ========== =============== ==========================================================

    Touched nodes are queued. Changes: tour, joined_to, steps.
    """
    total = 0.0
    for e in range(len(edges)):
        for end in range(2):
            fixed, moving = edges[e, end], edges[e, 1 - end]
            node, place = tour.node, tour.place
            if places > 0 and (successor(node, place, fixed) == moving or predecessor(node, place, fixed) == moving):
                gain, places = _let_end_walk(cost, tour, candidates, lengths, joined_to, steps, fixed, moving, places)
                total += gain
    return total
