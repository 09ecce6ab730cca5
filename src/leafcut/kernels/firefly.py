"""Fireflies that are closed tours: compute distances between them, and move them by inversions.

Source: G. K. Jati and Suyanto, Evolutionary discrete firefly algorithm for travelling salesman problem, ICAIS 2011,
LNAI 6943, 393–403. The distance between two tours is the number of edges in which they differ, and a move inverts a
random run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON, inner_kernel, kernel
from leafcut.kernels.cost import TIED, CostModel, node_travel_cost, tour_cost
from leafcut.kernels.lin_kernighan import (
    ENDS,
    NO_LIMIT,
    TWO,
    Tour,
    improve_queued,
    is_single_tour,
    make_move,
    push_to_queue,
    reverse_positions,
    undo_if_longer,
)
from leafcut.kernels.random import random_below

_A, _B, _C = np.uint64(13), np.uint64(7), np.uint64(17)
_HALF, _LOW = np.uint64(32), np.uint64(0xFFFFFFFF)

#: Make this many nearby inversions before each local search, because local search would undo a single inversion.
INVERSIONS = 2


@kernel
def count_different_edges(tour: NDArray, second: NDArray, place: NDArray) -> int:
    """Count the edges of `tour` that are missing in the tour `second` (int32[h] each).

    `place`, int32[h], is the inverse of `second`.
    """
    h, count = len(tour), 0
    for k in range(h):
        index, before = place[tour[k]], tour[k - 1]
        if second[index - 1] != before and second[index + 1 if index + 1 < h else 0] != before:
            count += 1
    return count


@inner_kernel
def longest_edge_cost(costs: NDArray, tour: NDArray) -> float:
    """Find the longest edge of a closed tour, int32[h], and return its cost."""
    longest = np.float64(costs[tour[0], tour[-1]])
    for k in range(1, len(tour)):
        longest = max(longest, np.float64(costs[tour[k], tour[k - 1]]))
    return float(longest)


@kernel
def make_random_inversions(
    costs: NDArray, tour: NDArray, place: NDArray, moves: int, longest: int, states: NDArray, k: int
) -> float:
    """Try to invert `moves` random runs, and keep the inversions that do not lengthen the tour. Return the gain.

    An inversion needs up to four table lookups. Usually the first lookup is enough, because a new edge is already
    longer than both removed edges together. Inversions that keep the length are accepted. Otherwise, no move would
    succeed on grids.

    ======= ============= ==================================================================
    costs   float32[h, h] costs of all edges; half the memory gives twice as many inversions per second
    tour    int32[h]      `place` int32[h] is its inverse
    longest int           nodes of the longest run, 2 … h - 2; lengths from 2 on are equally likely
    ======= ============= ==================================================================

    Changes: tour, place, states[k] (one random number per inversion: its halves determine position and length).
    """
    h, total, word = len(tour), 0.0, states[k]
    places, lengths = np.uint64(h), np.uint64(longest - 1)
    reach = 2.0 * longest_edge_cost(costs, tour)
    for _ in range(moves):
        word ^= word << _A
        word ^= word >> _B
        word ^= word << _C
        first = np.int64(((word >> _HALF) * places) >> _HALF)
        last = first + 1 + np.int64(((word & _LOW) * lengths) >> _HALF)
        if last >= h:
            last -= h
        a, c = tour[first - 1], tour[last]
        ac = np.float64(costs[a, c])
        if ac > reach:
            continue
        b, d = tour[first], tour[last + 1 if last + 1 < h else 0]
        bd = np.float64(costs[b, d])
        # Add two lengths in a fixed order, so that rounding does not break a tie.
        gain = (np.float64(costs[a, b]) + np.float64(costs[c, d])) - (ac + bd)
        if gain >= 0.0:
            reverse_positions(tour, place, int(first), int(last))
            total += gain
            reach = max(reach, 2.0 * ac, 2.0 * bd)
    states[k] = word
    return total


@inner_kernel
def count_different_positions(tour: NDArray, second: NDArray) -> int:
    """Count the positions at which two tours, int32[h], differ (Hamming distance)."""
    count = 0
    for k in range(len(tour)):
        if tour[k] != second[k]:
            count += 1
    return count


class PairRules(NamedTuple):
    """Rules for the moves of a pair of fireflies in an iteration.

    ============ ===== =================================================================================
    moves        int   β0, the number of moves of a pair
    absorption   float γ
    long         bool  every move is long; otherwise only moves of a pair with equal brightness are long
    explore      bool  firefly j makes all moves of a pair (i, j)
    darker_first bool  the darker firefly makes the first β moves; otherwise the brighter firefly
    short        int   maximum number of nodes in a short inversion; 0: the number of positions where the pair differs
    ============ ===== =================================================================================
    """

    moves: int
    absorption: float
    long: bool
    explore: bool
    darker_first: bool
    short: int


@kernel
def move_firefly_pairs(
    cost: CostModel,
    tours: NDArray,
    lengths: NDArray,
    start: int,
    stop: int,
    rules: PairRules,
    states: NDArray,
    k: int,
    kept: NDArray,
    kept_lengths: NDArray,
) -> None:
    """Move all pairs of fireflies (i, j) with start <= i < stop and i <= j < n, and keep the n shortest results.

    A pair makes β0 moves: one firefly makes β of them, and the other firefly makes the rest. Each move starts with the
    firefly's unchanged tour. A long inversion reverses the run between two random positions. A short inversion reverses
    2 … `short` nodes, starting at a random position. No run wraps around the end of the array. A move that would break
    a tied edge is dropped.

    ============ ================ ==========================================================================
    tours        int32[n, h]      `lengths` float64[n]
    kept         int32[n, 3]      firefly, first and last position of the inverted run; results of equal length
                                  stay in order
    kept_lengths float64[n]       ascending; inf for a free row
    ============ ================ ==========================================================================

    Changes: states[k], kept, kept_lengths.
    Source: as `order.literature.published_fireflies`.
    """
    n, h = tours.shape
    for i in range(start, stop):
        for j in range(i, n):
            equal = abs(lengths[i] - lengths[j]) <= EPSILON
            apart = count_different_positions(tours[i], tours[j])
            r = 10.0 * apart / h
            towards = int(rules.moves * np.exp(-rules.absorption * r * r))
            first, second = j, i
            if rules.explore:
                towards = rules.moves
            elif not equal and (lengths[i] > lengths[j]) == rules.darker_first:
                first, second = i, j
            limit = max(2, min(rules.short if rules.short > 0 else apart, h - 2))
            for u in range(rules.moves):
                f = first if u < towards else second
                if rules.long or equal:
                    head, last = random_below(states, k, h), random_below(states, k, h - 1)
                    if last >= head:
                        last += 1
                    else:
                        head, last = last, head
                else:
                    nodes = 2 + random_below(states, k, limit - 1)
                    head = random_below(states, k, h - nodes + 1)
                    last = head + nodes - 1
                added = inversion_cost(cost, tours[f], head, last)
                if added < -0.5 * TIED:
                    insert_result(kept, kept_lengths, f, head, last, lengths[f] + added)


@inner_kernel
def inversion_cost(cost: CostModel, tour: NDArray, first: int, last: int) -> float:
    """Compute how much longer a closed tour, int32[h], becomes when its positions `first` … `last` are inverted."""
    h = len(tour)
    if last - first >= h - 2:
        return 0.0  # the same cycle in reverse direction
    a, b = tour[first - 1], tour[first]
    c, d = tour[last], tour[last + 1 if last + 1 < h else 0]
    return (
        node_travel_cost(cost, a, c)
        + node_travel_cost(cost, b, d)
        - node_travel_cost(cost, a, b)
        - node_travel_cost(cost, c, d)
    )


@inner_kernel
def insert_result(kept: NDArray, kept_lengths: NDArray, f: int, first: int, last: int, length: float) -> None:
    """Insert a result into the sorted rows of `kept`, and remove the longest row."""
    row = len(kept_lengths)
    while row > 0 and length < kept_lengths[row - 1] - EPSILON:
        row -= 1
    for later in range(len(kept_lengths) - 1, row, -1):
        for column in range(kept.shape[1]):
            kept[later, column] = kept[later - 1, column]
        kept_lengths[later] = kept_lengths[later - 1]
    if row < len(kept_lengths):
        kept[row, 0], kept[row, 1], kept[row, 2] = f, first, last
        kept_lengths[row] = length


@kernel
def write_result_tours(cost: CostModel, tours: NDArray, kept: NDArray, moved: NDArray, lengths: NDArray) -> None:
    """Write the tours of the results `kept`, int32[m, 3], to the first rows of `moved`, and compute all lengths.

    Changes: moved int32[n, h], lengths float64[n].
    """
    for row in range(len(kept)):
        f, first, last = kept[row]
        for index in range(tours.shape[1]):
            moved[row, index] = tours[f, first + last - index if first <= index <= last else index]
    for row in range(len(moved)):
        lengths[row] = tour_cost(cost, moved[row])


@inner_kernel
def invert_run(cost: CostModel, tour: Tour, first: int, length: int) -> float:
    """Invert a run of `length` positions that starts at `first`, and return the added cost. Changes: tour."""
    h = len(tour.node)
    last = (first + length - 1) % h
    a, b = tour.node[first - 1], tour.node[first]
    c, d = tour.node[last], tour.node[last + 1 if last + 1 < h else 0]
    move = tour.move
    move[ENDS, 0], move[ENDS, 1], move[ENDS, 2], move[ENDS, 3] = a, b, d, c
    added = (
        node_travel_cost(cost, a, c)
        + node_travel_cost(cost, b, d)
        - node_travel_cost(cost, a, b)
        - node_travel_cost(cost, c, d)
    )
    if not is_single_tour(tour.place, move, TWO) or not make_move(tour, TWO):
        return 0.0
    for i in range(4):
        push_to_queue(tour, move[ENDS, i])
    return added


@kernel
def invert_and_repair(
    cost: CostModel,
    tour: Tour,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    moves: int,
    longest: int,
    states: NDArray,
    k: int,
) -> float:
    """Make `moves` moves of a firefly, and return the gain.

    A move makes `INVERSIONS` nearby inversions and then runs local search at the affected nodes. A move that makes the
    tour longer is undone. Symbols: for candidates, lengths and breadth, see `lin_kernighan.find_move`; for longest, see
    `make_random_inversions`.
    Changes: tour, states[k].
    """
    h, total = len(tour.node), 0.0
    for _ in range(moves):
        tour.counts[2] = 0
        tour.counts[3] = 0
        centre, added = random_below(states, k, h), 0.0
        for _ in range(INVERSIONS):
            first = (centre + random_below(states, k, longest)) % h
            added += invert_run(cost, tour, first, 2 + random_below(states, k, longest - 1))
        total += undo_if_longer(tour, improve_queued(cost, tour, candidates, lengths, breadth, NO_LIMIT) - added)
    return total
