"""Ant System, Elitist Ant System and rank-based Ant System.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, sections 3.3.1 to 3.3.3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.order.best import Best
from leafcut.order.literature.pheromone import Trails


class AntSystem(Trails):
    """All ants deposit 1/C (equations 3.2 to 3.4)."""

    def usual_pheromone(self) -> float:
        """Return the initial pheromone, m / C_nn."""
        return float(self.parameters.ants / self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate, then deposit on every finished tour."""
        self.evaporate()
        for tour, cost in zip(tours, costs, strict=True):
            if cost < math.inf:
                self.deposit(tour, 1.0 / cost)


class ElitistAntSystem(AntSystem):
    """Ant System in which the best-so-far tour deposits an additional e/C (equation 3.5)."""

    def usual_pheromone(self) -> float:
        """Return the initial pheromone, (e + m) / (ρ C_nn)."""
        p = self.parameters
        return float((p.elitist_weight + p.ants) / (p.rate * self.c_nn))

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Update as in Ant System, then deposit on the best-so-far tour."""
        super().update(iteration, tours, costs, best)
        self.deposit(best.tour, self.parameters.elitist_weight / best.cost)

    def constants(self) -> dict[str, float]:
        """Return the weight e of the best tour."""
        return {"e": self.parameters.elitist_weight}


class RankBasedAntSystem(Trails):
    """The w - 1 best ants deposit by rank, and the best-so-far tour with weight w (equation 3.6)."""

    def usual_pheromone(self) -> float:
        """Return the initial pheromone, w(w - 1) / 2 / (ρ C_nn)."""
        p = self.parameters
        return max(1.0, 0.5 * p.ranks * (p.ranks - 1)) / (p.rate * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate, then deposit on the tours of the best ants and on the best-so-far tour."""
        self.evaporate()
        w = self.parameters.ranks
        for rank, ant in enumerate(np.argsort(costs, kind="stable")[: w - 1], start=1):
            if costs[ant] < math.inf:
                self.deposit(tours[ant], (w - rank) / costs[ant])
        self.deposit(best.tour, w / best.cost)

    def constants(self) -> dict[str, float]:
        """Return the weight w of the best tour."""
        return {"w": self.parameters.ranks}
