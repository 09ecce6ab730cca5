"""Local search with 2-opt and Or-opt moves on candidate lists. A queue holds the nodes to examine.

All moves consist of 2-opt exchanges, each of which is given by its four nodes. An exchange reverses the shorter side of
the tour. The direction in which the array stores the tour does not matter.
"""

from __future__ import annotations

from numpy.typing import NDArray

from leafcut.kernels import EPSILON, inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost
from leafcut.kernels.lin_kernighan import (
    ENDS,
    Tour,
    count_positions_between,
    pop_from_queue,
    predecessor,
    push_to_queue,
    reverse_positions,
    successor,
)

#: Or-opt moves runs of at most this many nodes (Or 1976).
LONGEST_SEGMENT = 3


@inner_kernel
def neighbour_in_tour(node: NDArray, place: NDArray, v: int, forward: bool) -> int:
    """Return the node after v if `forward` is set, and the node before v otherwise."""
    return successor(node, place, v) if forward else predecessor(node, place, v)


@inner_kernel
def exchange_edges(node: NDArray, place: NDArray, a: int, b: int, c: int, d: int) -> None:
    """Replace the edges a–b and c–d with a–c and b–d.

    When the tour is followed in one direction, b comes after a, and d comes after c.

    Changes: node, place.
    """
    if neighbour_in_tour(node, place, a, True) == b and neighbour_in_tour(node, place, c, True) == d:
        reverse_positions(node, place, place[b], place[c])
    else:
        reverse_positions(node, place, place[c], place[b])


@inner_kernel
def make_two_opt_move(
    cost: CostModel, node: NDArray, place: NDArray, candidates: NDArray, a: int, touched: NDArray
) -> bool:
    """Make the first 2-opt move at node a that improves the tour.

    Changes: node, place, touched int64[≥4] (the four nodes of the move).
    """
    for direction in range(2):
        forward = direction == 0
        b = neighbour_in_tour(node, place, a, forward)
        old = node_travel_cost(cost, a, b)
        for k in range(candidates.shape[1]):
            c = candidates[a, k]
            if c < 0:
                break
            gain = old - node_travel_cost(cost, a, c)
            if gain <= EPSILON:
                break
            d = neighbour_in_tour(node, place, c, forward)
            if c == b or d == a:
                continue
            if gain + node_travel_cost(cost, c, d) - node_travel_cost(cost, b, d) > EPSILON:
                exchange_edges(node, place, a, b, c, d)
                touched[0], touched[1], touched[2], touched[3] = a, b, c, d
                return True
    return False


@inner_kernel
def _is_in_run(place: NDArray, a: int, length: int, forward: bool, v: int) -> bool:
    return count_positions_between(place[v], place[a], 0 if forward else 1, len(place)) < length


@inner_kernel
def make_or_opt_move(
    cost: CostModel, node: NDArray, place: NDArray, candidates: NDArray, a: int, touched: NDArray
) -> bool:
    """If it improves the tour, move a run of 1 … 3 nodes that starts at a to a better position, in either direction.

    Symbols: the run is a … e, p is the node before a, and q is the node after e. The run is moved between c and d, so
    that a is next to c.
    Changes: node, place, touched int64[≥6].
    Source: I. Or, PhD thesis, Northwestern University 1976.
    """
    for direction in range(2):
        forward = direction == 0
        p = neighbour_in_tour(node, place, a, not forward)
        e = a
        for length in range(1, LONGEST_SEGMENT + 1):
            if length > 1:
                e = neighbour_in_tour(node, place, e, forward)
            q = neighbour_in_tour(node, place, e, forward)
            removed = node_travel_cost(cost, p, a) + node_travel_cost(cost, e, q) - node_travel_cost(cost, p, q)
            for k in range(candidates.shape[1]):
                c = candidates[a, k]
                if c < 0:
                    break
                gain = removed - node_travel_cost(cost, a, c)
                if gain <= EPSILON:
                    break
                if _is_in_run(place, a, length, forward, c):
                    continue
                for side in range(2):
                    d = neighbour_in_tour(node, place, c, forward if side == 0 else not forward)
                    if _is_in_run(place, a, length, forward, d):
                        continue
                    if gain + node_travel_cost(cost, c, d) - node_travel_cost(cost, e, d) > EPSILON:
                        _move_run(node, place, p, a, e, q, c, d, side == 0)
                        touched[0], touched[1], touched[2] = p, a, e
                        touched[3], touched[4], touched[5] = q, c, d
                        return True
    return False


@inner_kernel
def _move_run(node: NDArray, place: NDArray, p: int, a: int, e: int, q: int, c: int, d: int, c_first: bool) -> None:
    """Move a run of nodes to a new position.

    If `c_first` is set, p a…e q … c d becomes p q … c a…e d. Otherwise, p a…e q … d c becomes p q … d e…a c.
    Changes: node, place.
    """
    if c_first:
        if c != q:
            exchange_edges(node, place, p, a, c, d)  # p c…q e…a d
            exchange_edges(node, place, p, c, q, e)  # p q…c e…a d
            exchange_edges(node, place, c, e, a, d)  # p q…c a…e d
        else:
            exchange_edges(node, place, p, a, q, d)  # p q e…a d
            exchange_edges(node, place, q, e, a, d)  # p q a…e d
    else:
        exchange_edges(node, place, p, a, d, c)  # p d…q e…a c
        exchange_edges(node, place, p, d, q, e)  # p q…d e…a c


@kernel
def improve_by_two_opt_and_or_opt(cost: CostModel, tour: Tour, candidates: NDArray, max_moves: int) -> int:
    """Improve the tour at the queued nodes, and return the number of moves, which is at most `max_moves`.

    A node leaves the queue when no move at this node improves the tour (its don't-look bit). The ends of each move
    enter the queue.
    Changes: tour.
    Source: J. L. Bentley, Fast algorithms for geometric travelling salesman problems, ORSA J. Computing 4 (1992).
    """
    moves = 0
    while tour.counts[1] > 0 and moves < max_moves:
        a = pop_from_queue(tour)
        touched = 0
        if make_two_opt_move(cost, tour.node, tour.place, candidates, a, tour.move[ENDS]):
            touched = 4
        elif make_or_opt_move(cost, tour.node, tour.place, candidates, a, tour.move[ENDS]):
            touched = 6
        if touched > 0:
            moves += 1
        for k in range(touched):
            push_to_queue(tour, tour.move[ENDS, k])
    return moves
