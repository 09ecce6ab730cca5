"""The search loop that all population algorithms share: propose, keep the best, reinforce, tell."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.order.statistics import Best
from leafcut.order.stop import Stop


class Propose(Protocol):
    """Makes the candidates of one iteration."""

    def __call__(self, iteration: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return tours int32[m, n] and their costs float64[m], inf for a tour that was not finished."""


class Reinforce(Protocol):
    """Learns from the candidates of one iteration."""

    def __call__(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """Change the state from which the next candidates are made."""


def search(propose: Propose, reinforce: Reinforce, stop: Stop, best: Best) -> int:
    """Run until `stop`; return the number of iterations that were finished.

    The winner of an iteration is the first of the cheapest, in the order of their numbers, whatever thread made it.
    """
    iteration = 0
    while not stop.reached(iteration, iteration - best.iteration):
        tours, costs = propose(iteration)
        winner = int(np.argmin(costs))
        best.offer(tours[winner], costs[winner], iteration)
        if stop.now():
            break
        reinforce(iteration, tours, costs, best)
        iteration += 1
        best.tell(iteration, costs=costs)
    return iteration
