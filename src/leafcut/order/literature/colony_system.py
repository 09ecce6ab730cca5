"""Ant Colony System: ants lower the pheromone on their edges; only the best-so-far tour gains pheromone.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, section 3.4.1. The local update (equation
3.12) is part of the construction (`kernels.construct.Decay`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.pheromone import reinforce_and_decay
from leafcut.order.best import Best
from leafcut.order.literature.pheromone import Trails


class AntColonySystem(Trails):
    """Evaporation and deposit on the edges of the best-so-far tour only (equation 3.11)."""

    def usual_pheromone(self) -> float:
        """Return the initial pheromone, 1 / (n C_nn)."""
        return 1.0 / (len(self.lists) * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Deposit 1/C on the best-so-far tour."""
        self.deposit(best.tour, 1.0 / best.cost)

    def _add(self, tour: Ints, amount: float) -> None:
        rate = self.parameters.rate
        reinforce_and_decay(self.lists, tour, rate, amount, self.one_way, self.pheromone)

    def constants(self) -> dict[str, float]:
        """Return the greedy probability q0 and the local evaporation rate ξ."""
        return {"q_0": self.parameters.greedy_probability, "xi": self.parameters.local_rate}
