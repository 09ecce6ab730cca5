"""Parameters of the ant algorithms, and the base class of their trails.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, chapter 3 ("the book" in this package).
Differs: pheromone is kept on candidate edges only, so memory grows with n; see `kernels.construct`.
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
from leafcut.order.best import Best


@dataclass(frozen=True)
class Recommended:
    """Recommended number of ants (0: one per node) and evaporation rate ρ, without and with local search.

    The values without local search are from box 3.1 of the book. With local search, fewer ants are used, as in its
    section 3.7 and in ACOTSP, the authors' program.
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

#: Number of ranks that deposit (w of ASrank) and local evaporation rate (ξ of ACS), from the book.
RANKS, LOCAL_RATE = 6, 0.1

#: Maximum number of ants if there is one per node: the rule is meant for hundreds of nodes.
MOST_ANTS = 1000

#: λ of the branching factor.
BRANCHING_SHARE = 0.05

#: Number of next nodes shown to an observer, the most probable first.
MOST_CHOICES = 5

# First word of the random stream of the first trails.
_TRAILS = 3

#: A tour int32[n], and the pheromone that was added to each of its edges.
Deposit = tuple[Ints, float]


@dataclass(frozen=True)
class AntParameters:
    """Options of an ant algorithm, with the recommended values for an instance as defaults."""

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
    def of(cls, algorithm: str, options: AcoOptions, n: int, local_search: bool) -> AntParameters:
        """Return the parameters of `algorithm` for n nodes."""
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
    """Pheromone on the candidate edges int32[n, k]; each subclass implements the update rule of an algorithm.
    `nearness` and `weights` are η^β and τ^α·η^β of each edge, float64[n, k]. With `one_way`, each direction of an
    edge has its own trail. `changes` are None if they are not recorded; `depositor` is the origin of the last
    deposit of MAX–MIN Ant System (`model.snapshot.SearchStep`).
    """

    def __init__(
        self, lists: Ints, parameters: AntParameters, c_nn: float, one_way: bool = False, *, seed: int = 1
    ) -> None:
        """Start with equal or random trails (`seed`); `c_nn` is the cost C_nn of the nearest-neighbour tour."""
        self.lists, self.parameters, self.c_nn, self.one_way = lists, parameters, c_nn, one_way
        self.initial = self._initial_pheromone()
        self.highest, self.lowest = math.inf, 0.0
        self.pheromone = np.full(lists.shape, self.initial)
        if parameters.initial == RANDOM_TRAILS:
            # From 0 to twice the mean, the level to which trails of Ant Colony System decay.
            self.pheromone *= 2.0 * _random_shares(lists, one_way, seed)
        self.nearness, self.weights = np.zeros(lists.shape), np.zeros(lists.shape)
        # A thousandth of the mean edge: the attraction between nodes at the same position is finite.
        self.offset = max(1e-12, 1e-3 * c_nn / len(lists))
        self.depositor, self.iteration_best = "", math.inf
        self.changes: list[Deposit] | None = None

    def usual_pheromone(self) -> float:
        """Return the initial pheromone τ0 of the algorithm (box 3.1)."""
        raise NotImplementedError

    def update(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate and deposit."""
        raise NotImplementedError

    def constants(self) -> dict[str, float]:
        """Return the algorithm's own parameters for observers."""
        return {}

    def reinforce(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate and deposit, and update the weights."""
        self.update(iteration, tours, costs, best)
        self.iteration_best = float(costs.min())
        self.weigh()

    def weigh(self) -> None:
        """Update the weights by which ants choose."""
        trails.fill_weights(self.pheromone, self.nearness, self.parameters.alpha, self.weights)

    def evaporate(self) -> None:
        """Reduce all pheromone by the evaporation rate (equation 3.2), not below the lower limit."""
        trails.evaporate(self.pheromone, self.parameters.rate, self.lowest)

    def deposit(self, tour: Ints, amount: float) -> None:
        """Add pheromone along a tour (equation 3.3)."""
        if self.changes is not None:
            self.changes.append((tour.copy(), amount))
        self._add(tour, amount)

    def receive(self, changes: list[Deposit]) -> None:
        """Add the deposits of other colonies; each colony evaporates by itself."""
        for tour, amount in changes:
            self._add(tour, amount)
        self.weigh()

    def _add(self, tour: Ints, amount: float) -> None:
        trails.deposit(self.lists, tour, amount, self.highest, self.one_way, self.pheromone)

    def _initial_pheromone(self) -> float:
        p, n, c_nn = self.parameters, len(self.lists), self.c_nn
        if p.initial == RANDOM_TRAILS:
            return 0.5 / (n * c_nn)
        if p.initial == BY_N_RHO_C:
            return 1.0 / (n * p.rate * c_nn)
        if p.initial == BY_N_C:
            return 1.0 / (n * c_nn)
        return self.usual_pheromone() if p.initial is None else float(p.initial)

    def branching(self) -> float:
        """Return the mean λ-branching factor."""
        return float(trails.branching(self.lists, self.pheromone, BRANCHING_SHARE))

    def step(self, best: Best, here: int = 0, choices: tuple[NextPlace, ...] = ()) -> SearchStep:
        """Return the variables of the last iteration, and an example: a node and its next nodes."""
        p = self.parameters
        values = {
            "alpha": p.alpha, "beta": p.beta, "rho": p.rate, "m": p.ants, "tau_0": self.initial,
            "epsilon": self.offset, "c_best": best.cost, "lambda": self.branching(),
        }  # fmt: skip
        if self.iteration_best < math.inf:
            values["c_iteration"] = self.iteration_best
        return SearchStep(p.algorithm, values | self.constants(), self.depositor, here, choices)


def _random_shares(lists: Ints, one_way: bool, seed: int) -> NDArray[np.float64]:
    """Return a random number from 0 to 1 for each edge of `lists` int32[n, k]; both entries of an edge are equal."""
    n = len(lists)
    here, there = np.broadcast_to(np.arange(n, dtype=np.int64)[:, None], lists.shape), lists.astype(np.int64)
    low, high = (here, there) if one_way else (np.minimum(here, there), np.maximum(here, there))
    edges, which = np.unique(low * n + high, return_inverse=True)
    return np.random.default_rng((seed, _TRAILS)).random(len(edges))[which].reshape(lists.shape)
