"""MAX–MIN Ant System.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, section 3.3.4. The deposit schedule for local
search follows ACOTSP, the authors' program.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.order.best import Best
from leafcut.order.literature.pheromone import AntParameters, Trails

#: Probability of reconstructing the best tour at convergence (p_best), from the book.
BEST_PROBABILITY = 0.05

#: The trails restart if they have converged and the best tour is this many iterations old.
RESTART_AFTER = 250
CONVERGED_BRANCHING = 1.00001


class MaxMinAntSystem(Trails):
    """One ant deposits, within trail limits; converged trails restart."""

    restarted_at = 0

    def usual_pheromone(self) -> float:
        """Return the initial pheromone, 1 / (ρ C_nn)."""
        return 1.0 / (self.parameters.rate * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Update the limits; evaporate and deposit, or restart."""
        p = self.parameters
        self.highest = 1.0 / (p.rate * best.cost)
        self.lowest = self.highest * lowest_share(p, *self.lists.shape)
        since = iteration - self.restarted_at
        stuck = since >= RESTART_AFTER and iteration - best.iteration >= RESTART_AFTER
        # An edge in both lists counts at both nodes: converged trails keep two edges per node.
        if stuck and iteration % 100 == 0 and self.branching() <= 2.0 * CONVERGED_BRANCHING:
            self.pheromone[:] = self.highest
            self.restarted_at, self.depositor = iteration, "restart"
            return
        self.evaporate()
        if since % best_so_far_every(since, p.local_search) == 0:
            self.deposit(best.tour, 1.0 / best.cost)
            self.depositor = "best"
        else:
            winner, self.depositor = int(np.argmin(costs)), "iteration"
            self.deposit(tours[winner], 1.0 / costs[winner])

    def constants(self) -> dict[str, float]:
        """Return the trail limits τ_max and τ_min."""
        return {"tau_max": self.highest, "tau_min": self.lowest}


def lowest_share(p: AntParameters, n: int, k: int) -> float:
    """Return τ_min / τ_max: 1/2n with local search (ACOTSP), else by p_best (equation 3.9)."""
    if p.local_search:
        return float(1.0 / (2.0 * n))
    root = float(BEST_PROBABILITY ** (1.0 / n))
    return float(min(1.0, (1.0 - root) / (max(1.0, 0.5 * (k + 1)) * root)))


def best_so_far_every(since_restart: int, local_search: bool) -> int:
    """Return the interval of iterations at which the best tour so far deposits, instead of the iteration's best."""
    if not local_search or since_restart < 25:
        return 25
    for limit, every in ((75, 5), (125, 3), (250, 2)):
        if since_restart < limit:
            return every
    return 1
