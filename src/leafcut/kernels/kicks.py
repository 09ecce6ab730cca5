"""Kicks: small local changes of a good tour, followed by local search at the touched nodes only.

The effort of a kick and its repair is independent of the size of the tour; a worse result is undone from the log.

Source: O. Martin, S. W. Otto and E. W. Felten, Operations Research Letters 11 (1992) (the double bridge); D. Applegate,
W. Cook and A. Rohe, INFORMS J. Computing 15 (2003), section 3 (local kicks, no global work per kick).
"""

from __future__ import annotations

from numpy.typing import NDArray

from leafcut.kernels import EPSILON, kernel, part
from leafcut.kernels.cost import CostModel, travel
from leafcut.kernels.lin_kernighan import ENDS, Tour, improve_queued, is_one_tour, make_move, pop, push, take_back
from leafcut.kernels.random import below

#: Maximum length of a piece moved by a kick. Shorter ones are soon exhausted, longer ones are seldom repaired.
LONGEST_PIECE = 50


@part
def segment_kick(cost: CostModel, tour: Tour, states: NDArray, k: int) -> float:
    """Swap two adjacent pieces of 1 … 50 nodes at a random place; return the added cost. Changes: tour, states[k]."""
    n = len(tour.node)
    longest = min(LONGEST_PIECE, (n - 2) // 2)
    p = below(states, k, n)
    q = (p + 1 + below(states, k, longest)) % n
    r = (q + 1 + below(states, k, longest)) % n
    a, b = tour.node[p], tour.node[p + 1 if p + 1 < n else 0]
    c, d = tour.node[q], tour.node[q + 1 if q + 1 < n else 0]
    e, f = tour.node[r], tour.node[r + 1 if r + 1 < n else 0]
    # a b…c d…e f  becomes  a d…e b…c f
    move = tour.move
    move[ENDS, 0], move[ENDS, 1], move[ENDS, 2], move[ENDS, 3], move[ENDS, 4], move[ENDS, 5] = b, a, d, c, f, e
    added = travel(cost, a, d) + travel(cost, e, b) + travel(cost, c, f)
    removed = travel(cost, a, b) + travel(cost, c, d) + travel(cost, e, f)
    if not is_one_tour(tour.place, move, 3) or not make_move(tour, 3):
        return 0.0
    for i in range(6):
        push(tour, move[ENDS, i])
    return added - removed


@kernel
def kick_and_mend(
    cost: CostModel,
    tour: Tour,
    candidates: NDArray,
    lengths: NDArray,
    breadth: NDArray,
    states: NDArray,
    k: int,
    kicks: int,
) -> float:
    """Kick and repair `kicks` times, undoing results that lengthen the tour; return the total gain. Changes: tour,
    states[k].
    """
    total = 0.0
    for _ in range(kicks):
        tour.counts[2] = 0
        tour.counts[3] = 0
        added = segment_kick(cost, tour, states, k)
        gained = improve_queued(cost, tour, candidates, lengths, breadth, 1_000_000) - added
        if tour.counts[3] == 1 or gained < -EPSILON:
            while tour.counts[1] > 0:
                pop(tour)
            take_back(tour)
        else:
            total += gained
    return total
