"""Local kicks: one good tour, changed at one place at a time and mended there. What it costs does not grow with n."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.candidates import fill_lengths
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.kicks import kick_and_mend
from leafcut.kernels.lin_kernighan import DEPTH, Tour, improve_queued, push_all
from leafcut.solve.construction import nearest_neighbour, random_words
from leafcut.solve.instance import Instance
from leafcut.solve.statistics import Best
from leafcut.solve.stop import Stop

#: Candidates tried at each depth of a move. Measured at 1 and 3 s on pcb3038 and rl11849: (8, 4, 2, 1) with two
#: neighbours per quadrant was better than (5, 5, 3, 2), (5, 3, 2, 1) and (6, 4, 2, 1) with one.
BREADTH = (0, 8, 4, 2, 1)
CANDIDATES = 8

#: Nodes looked at between two looks at the clock in the first improvement: some ten milliseconds.
NODES_PER_LOOK = 5000


def kicks_per_iteration(n: int) -> int:
    """Return how many kicks make an iteration: so many that to add up and keep the tour costs little beside them."""
    return max(200, n // 100)


def work_tour(node: NDArray[np.int32]) -> Tour:
    """Return a tour int32[n] with all that the kernels need to work on it, every node in the queue."""
    n = len(node)
    tour = Tour(
        node=node.copy(),
        place=np.zeros(n, dtype=np.int32),
        queue=np.zeros(n, dtype=np.int32),
        queued=np.zeros(n, dtype=np.uint8),
        counts=np.zeros(4, dtype=np.int64),
        log=np.zeros((2 * n + 1000, 2), dtype=np.int32),
        buffer=np.zeros(n, dtype=np.int32),
        move=np.zeros((4, 2 * DEPTH), dtype=np.int64),
        gain=np.zeros(DEPTH),
        tried=np.zeros(DEPTH, dtype=np.int64),
    )
    push_all(tour)
    return tour


def improve_by_kicks(instance: Instance, seed: int, stop: Stop, best: Best) -> int:
    """Improve the nearest-neighbour tour to a local optimum and then kick by kick; return the iterations made.

    An iteration is `kicks_per_iteration` kicks. What comes out depends on the seed and the number of iterations only.
    """
    start = nearest_neighbour(instance)
    best.offer(start, float(tour_cost(instance.cost, start)), 0)
    tour = work_tour(start)
    lengths = np.zeros(instance.candidates.shape)
    fill_lengths(instance.cost, instance.candidates, lengths)
    breadth = np.minimum(np.array(BREADTH, dtype=np.int64), instance.candidates.shape[1])
    words = random_words(seed, 0, 1)
    while tour.counts[1] > 0 and not stop.now():
        improve_queued(instance.cost, tour, instance.candidates, lengths, breadth, NODES_PER_LOOK)
        tour.counts[2:] = 0
    _offer(instance, tour, best, 0)
    iteration, kicks = 0, kicks_per_iteration(instance.n)
    while not stop.reached(iteration, iteration - best.iteration):
        gained = kick_and_mend(instance.cost, tour, instance.candidates, lengths, breadth, words, 0, kicks)
        iteration += 1
        if gained > 0.0:
            _offer(instance, tour, best, iteration)
        best.tell(iteration)
    return iteration


def _offer(instance: Instance, tour: Tour, best: Best, iteration: int) -> None:
    best.offer(tour.node, float(tour_cost(instance.cost, tour.node)), iteration)
