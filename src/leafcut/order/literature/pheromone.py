"""Parameters and pheromone trails of the ant algorithms.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, chapter 3 ("the book" in this package). For
MAX–MIN Ant System with local search, the deposit schedule follows ACOTSP, the authors' program. Differs: only candidate
edges carry pheromone, so memory grows linearly with n. See `kernels.construct`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels import pheromone as trails
from leafcut.model.snapshot import NextPlace, SearchStep
from leafcut.options import AcoOptions
from leafcut.options.search import BY_N_C, BY_N_RHO_C, RANDOM_TRAILS
from leafcut.order.search import Best


@dataclass(frozen=True)
class Recommended:
    """Recommended number of ants (0: one per node) and evaporation rate ρ, without and with local search.

    The values without local search come from box 3.1 of the book. With local search, we use fewer ants, like section
    3.7 of the book and ACOTSP.
    """

    ants: int
    rate: float
    ants_local: int
    rate_local: float


RECOMMENDED = {
    "as": Recommended(0, 0.5, 25, 0.5),
    "eas": Recommended(0, 0.5, 25, 0.5),
    "asrank": Recommended(0, 0.1, 25, 0.1),
    "mmas": Recommended(0, 0.02, 25, 0.2),
    "acs": Recommended(10, 0.1, 10, 0.1),
}

#: Number of ranks that deposit pheromone (w in ASrank) and local evaporation rate (ξ in ACS), from the book.
RANKS, LOCAL_RATE = 6, 0.1

#: If the rule is one ant per node, use at most this many ants. The rule is meant for hundreds of nodes.
MOST_ANTS = 1000

#: The λ used for the branching factor.
BRANCHING_SHARE = 0.05

#: When the trails have converged, an ant reconstructs the best tour with this probability (p_best in the book).
BEST_PROBABILITY = 0.05

#: The trails restart if they have converged and the best tour has not changed for this many iterations.
RESTART_AFTER = 250
CONVERGED_BRANCHING = 1.00001

#: Observers see at most this many possible next nodes, most probable first.
MOST_CHOICES = 5

# First word of the random stream of the first trails.
_TRAILS = 3

#: A tour, int32[n], and the amount of pheromone that was added to each of its edges.
Deposit = tuple[Ints, float]


@dataclass(frozen=True)
class AntParameters:
    """Options of an ant algorithm. The defaults are the values recommended for an instance."""

    algorithm: str
    ants: int
    alpha: float
    beta: float
    rate: float
    elitist_weight: float
    ranks: int
    greedy_probability: float
    local_rate: float
    local_search: bool
    initial: float | str | None

    @classmethod
    def from_options(cls, algorithm: str, options: AcoOptions, n: int, local_search: bool) -> AntParameters:
        """Read the parameters of `algorithm` from the options, for n nodes."""
        known = RECOMMENDED[algorithm]
        asked = n if isinstance(options.n_ants, str) else options.n_ants
        ants = asked or (known.ants_local if local_search else known.ants) or min(n, MOST_ANTS)
        rate = options.evaporation_rate
        return cls(
            algorithm=algorithm,
            ants=ants,
            alpha=options.pheromone_weight,
            beta=options.heuristic_weight,
            rate=rate if rate is not None else (known.rate_local if local_search else known.rate),
            elitist_weight=ants,
            ranks=min(RANKS, ants),
            greedy_probability=options.greedy_probability if algorithm == "acs" else 0.0,
            local_rate=LOCAL_RATE if algorithm == "acs" else 0.0,
            local_search=local_search,
            initial=options.initial_pheromone,
        )


class Trails:
    """Pheromone on the candidate edges, int32[n, k]. Each subclass implements an algorithm's update rule.

    Attributes
    ----------
    nearness, weights
        The values η^β and τ^α·η^β of each edge, float64[n, k].
    one_way
        Whether each direction of an edge has its own trail.
    changes
        The recorded deposits. None if deposits are not recorded.
    depositor
        Which tour made the last deposit in MAX–MIN Ant System (`model.snapshot.SearchStep`).
    """

    def __init__(
        self, lists: Ints, parameters: AntParameters, c_nn: float, one_way: bool = False, *, seed: int = 1
    ) -> None:
        """Create trails with the same pheromone everywhere, or with random pheromone if the parameters ask for it.

        `c_nn` is the cost C_nn of the nearest-neighbour tour. `seed` determines the random pheromone.
        """
        self.lists, self.parameters, self.c_nn, self.one_way = lists, parameters, c_nn, one_way
        self.initial = self._chosen_initial_pheromone()
        self.highest, self.lowest = math.inf, 0.0
        self.pheromone = np.full(lists.shape, self.initial)
        if parameters.initial == RANDOM_TRAILS:
            # Random values from 0 to 2 τ0. Their mean τ0 is the level to which trails of Ant Colony System decay.
            self.pheromone *= 2.0 * _random_pheromone(lists, one_way, seed)
        self.nearness, self.weights = np.zeros(lists.shape), np.zeros(lists.shape)
        # A thousandth of the mean edge, so that the attraction between nodes at the same position is finite.
        self.offset = max(1e-12, 1e-3 * c_nn / len(lists))
        self.depositor, self.iteration_best = "", math.inf
        self.changes: list[Deposit] | None = None

    def default_initial_pheromone(self) -> float:
        """Return the algorithm's initial pheromone τ0 (box 3.1)."""
        raise NotImplementedError

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate and deposit pheromone."""
        raise NotImplementedError

    def algorithm_parameters(self) -> dict[str, float]:
        """Return the parameters that only this algorithm has, for display."""
        return {}

    def reinforce(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate and deposit pheromone, and update the weights."""
        self.update(iteration, tours, costs, best)
        self.iteration_best = float(costs.min())
        self.update_weights()

    def update_weights(self) -> None:
        """Recompute the weights that ants use to choose their next node."""
        trails.fill_weights(self.pheromone, self.nearness, self.parameters.alpha, self.weights)

    def evaporate(self) -> None:
        """Reduce all pheromone by the evaporation rate (equation 3.2), but not below the lower trail limit."""
        trails.evaporate(self.pheromone, self.parameters.rate, self.lowest)

    def deposit(self, tour: Ints, amount: float) -> None:
        """Add pheromone along a tour (equation 3.3)."""
        if self.changes is not None:
            self.changes.append((tour.copy(), amount))
        self._add_pheromone(tour, amount)

    def add_deposits(self, changes: list[Deposit]) -> None:
        """Add the deposits of other colonies. Each colony evaporates only its own pheromone."""
        for tour, amount in changes:
            self._add_pheromone(tour, amount)
        self.update_weights()

    def _add_pheromone(self, tour: Ints, amount: float) -> None:
        trails.deposit(self.lists, tour, 1.0, amount, self.highest, self.one_way, self.pheromone)

    def _chosen_initial_pheromone(self) -> float:
        p, n, c_nn = self.parameters, len(self.lists), self.c_nn
        if p.initial == RANDOM_TRAILS:
            return 0.5 / (n * c_nn)
        if p.initial == BY_N_RHO_C:
            return 1.0 / (n * p.rate * c_nn)
        if p.initial == BY_N_C:
            return 1.0 / (n * c_nn)
        return self.default_initial_pheromone() if p.initial is None else float(p.initial)

    def branching_factor(self) -> float:
        """Return the mean λ-branching factor of the trails."""
        return float(trails.branching_factor(self.lists, self.pheromone, BRANCHING_SHARE))

    def describe_iteration(self, best: Best, here: int = 0, choices: tuple[NextPlace, ...] = ()) -> SearchStep:
        """Describe the last iteration: its variables, and an example choice with a node and its possible next nodes."""
        p = self.parameters
        values = {
            "alpha": p.alpha, "beta": p.beta, "rho": p.rate, "m": p.ants, "tau_0": self.initial,
            "epsilon": self.offset, "c_best": best.cost, "lambda": self.branching_factor(),
        }  # fmt: skip
        if self.iteration_best < math.inf:
            values["c_iteration"] = self.iteration_best
        return SearchStep(p.algorithm, values | self.algorithm_parameters(), self.depositor, here, choices)


def _random_pheromone(lists: Ints, one_way: bool, seed: int) -> NDArray[np.float64]:
    """Draw a random number from 0 to 1 for each edge of the candidate lists, int32[n, k].

    If an edge has two entries, both get the same number.
    """
    n = len(lists)
    here, there = np.broadcast_to(np.arange(n, dtype=np.int64)[:, None], lists.shape), lists.astype(np.int64)
    low, high = (here, there) if one_way else (np.minimum(here, there), np.maximum(here, there))
    edges, which = np.unique(low * n + high, return_inverse=True)
    return np.random.default_rng((seed, _TRAILS)).random(len(edges))[which].reshape(lists.shape)


class AntSystem(Trails):
    """Ant System: every ant deposits 1/C on its tour (equations 3.2 to 3.4)."""

    def default_initial_pheromone(self) -> float:
        """Return the initial pheromone, m / C_nn."""
        return float(self.parameters.ants / self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate pheromone, then deposit on every finished tour."""
        self.evaporate()
        for tour, cost in zip(tours, costs, strict=True):
            if cost < math.inf:
                self.deposit(tour, 1.0 / cost)


class ElitistAntSystem(AntSystem):
    """Ant System in which the best-so-far tour deposits an additional e/C (equation 3.5)."""

    def default_initial_pheromone(self) -> float:
        """Return the initial pheromone, (e + m) / (ρ C_nn)."""
        p = self.parameters
        return float((p.elitist_weight + p.ants) / (p.rate * self.c_nn))

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Update the trails as in Ant System, then deposit on the best-so-far tour."""
        super().update(iteration, tours, costs, best)
        self.deposit(best.tour, self.parameters.elitist_weight / best.cost)

    def algorithm_parameters(self) -> dict[str, float]:
        """Return the weight e of the best-so-far tour."""
        return {"e": self.parameters.elitist_weight}


class RankBasedAntSystem(Trails):
    """Rank-based Ant System (equation 3.6).

    The w - 1 best ants deposit according to their rank. The best-so-far tour deposits with weight w.
    """

    def default_initial_pheromone(self) -> float:
        """Return the initial pheromone, w(w - 1) / 2 / (ρ C_nn)."""
        p = self.parameters
        return max(1.0, 0.5 * p.ranks * (p.ranks - 1)) / (p.rate * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate pheromone, then deposit on the tours of the best ants and on the best-so-far tour."""
        self.evaporate()
        w = self.parameters.ranks
        for rank, ant in enumerate(np.argsort(costs, kind="stable")[: w - 1], start=1):
            if costs[ant] < math.inf:
                self.deposit(tours[ant], (w - rank) / costs[ant])
        self.deposit(best.tour, w / best.cost)

    def algorithm_parameters(self) -> dict[str, float]:
        """Return the weight w of the best-so-far tour."""
        return {"w": self.parameters.ranks}


class MaxMinAntSystem(Trails):
    """MAX–MIN Ant System (section 3.3.4).

    Only one ant deposits pheromone. Trail limits bound the pheromone, and the trails are reset when the search
    converges.
    """

    restarted_at = 0

    def default_initial_pheromone(self) -> float:
        """Return the initial pheromone, 1 / (ρ C_nn)."""
        return 1.0 / (self.parameters.rate * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Update the trail limits. Then evaporate and deposit pheromone, or reset the trails."""
        p = self.parameters
        self.highest = 1.0 / (p.rate * best.cost)
        self.lowest = self.highest * trail_limit_ratio(p, *self.lists.shape)
        since = iteration - self.restarted_at
        stuck = since >= RESTART_AFTER and iteration - best.iteration >= RESTART_AFTER
        # An edge in the lists of both nodes counts twice, so converged trails have two edges per node.
        if stuck and iteration % 100 == 0 and self.branching_factor() <= 2.0 * CONVERGED_BRANCHING:
            self.pheromone[:] = self.highest
            self.restarted_at, self.depositor = iteration, "restart"
            return
        self.evaporate()
        if since % deposit_interval(since, p.local_search) == 0:
            self.deposit(best.tour, 1.0 / best.cost)
            self.depositor = "best"
        else:
            winner, self.depositor = int(np.argmin(costs)), "iteration"
            self.deposit(tours[winner], 1.0 / costs[winner])

    def algorithm_parameters(self) -> dict[str, float]:
        """Return the trail limits τ_max and τ_min."""
        return {"tau_max": self.highest, "tau_min": self.lowest}


def trail_limit_ratio(p: AntParameters, n: int, k: int) -> float:
    """Return the ratio τ_min / τ_max.

    It is 1/(2n) with local search, as in ACOTSP. Otherwise, it follows from p_best (equation 3.9).
    """
    if p.local_search:
        return float(1.0 / (2.0 * n))
    root = float(BEST_PROBABILITY ** (1.0 / n))
    return float(min(1.0, (1.0 - root) / (max(1.0, 0.5 * (k + 1)) * root)))


def deposit_interval(since_restart: int, local_search: bool) -> int:
    """Return the number of iterations between deposits of the best-so-far tour.

    In all other iterations, the iteration-best tour deposits.
    """
    if not local_search or since_restart < 25:
        return 25
    for limit, every in ((75, 5), (125, 3), (250, 2)):
        if since_restart < limit:
            return every
    return 1


class AntColonySystem(Trails):
    """Ant Colony System: only the edges of the best-so-far tour evaporate and receive pheromone (equation 3.11).

    The local update (equation 3.12) happens during construction (`kernels.construct.Decay`).
    """

    def default_initial_pheromone(self) -> float:
        """Return the initial pheromone, 1 / (n C_nn)."""
        return 1.0 / (len(self.lists) * self.c_nn)

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Deposit 1/C on the best-so-far tour."""
        self.deposit(best.tour, 1.0 / best.cost)

    def _add_pheromone(self, tour: Ints, amount: float) -> None:
        rate = self.parameters.rate
        trails.deposit(self.lists, tour, 1.0 - rate, rate * amount, self.highest, self.one_way, self.pheromone)

    def algorithm_parameters(self) -> dict[str, float]:
        """Return the greedy probability q0 and the local evaporation rate ξ."""
        return {"q_0": self.parameters.greedy_probability, "xi": self.parameters.local_rate}


TRAILS: dict[str, type[Trails]] = {
    "as": AntSystem,
    "eas": ElitistAntSystem,
    "asrank": RankBasedAntSystem,
    "mmas": MaxMinAntSystem,
    "acs": AntColonySystem,
}
