"""The five ant algorithms of the literature.

Source: M. Dorigo and T. Stützle, Ant Colony Optimization, MIT Press 2004, chapter 3 ("the book" below).
Differs: pheromone is kept on candidate edges only, so memory grows with n; see `kernels.construct`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import pheromone as trails
from leafcut.kernels.construct import Decay, WeightedEdges, construct_tour, construct_tour_with_decay
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.local_search import improve, queue_all
from leafcut.options import AcoOptions
from leafcut.options.search import BY_N_C, BY_N_RHO_C, RANDOM_TRAILS
from leafcut.order.construction import nearest_neighbour, none_visited, random_words
from leafcut.order.instance import Instance
from leafcut.order.statistics import Best, WorkerLog
from leafcut.order.stop import Stop, clock

#: Moves between two looks at the clock: some milliseconds of work.
MOVES_PER_LOOK = 2000


@dataclass(frozen=True)
class Recommended:
    """What the book recommends for one algorithm: ants (0 = as many as nodes) and evaporation rate ρ.

    Without local search from box 3.1; with local search the few ants that its section 3.7 and the authors' program
    ACOTSP use.
    """

    name: str
    title: str
    ants: int
    rate: float
    ants_local: int
    rate_local: float


RECOMMENDED = {
    "as": Recommended("as", "Ant System", 0, 0.5, 25, 0.5),
    "eas": Recommended("eas", "Elitist Ant System", 0, 0.5, 25, 0.5),
    "asrank": Recommended("asrank", "rank-based Ant System", 0, 0.1, 25, 0.1),
    "mmas": Recommended("mmas", "MAX–MIN Ant System", 0, 0.02, 25, 0.2),
    "acs": Recommended("acs", "Ant Colony System", 10, 0.1, 10, 0.1),
}

#: Ranks that deposit (w of ASrank), local evaporation rate (ξ of ACS), and probability of building the best tour anew
#: at convergence (p_best of MMAS): the book's.
RANKS, LOCAL_RATE, BEST_PROBABILITY = 6, 0.1, 0.05

#: As many ants as nodes, but not more than this: the rule is meant for hundreds of nodes.
MOST_ANTS = 1000

#: MAX–MIN starts again from equal trails when trails have converged and nothing got better for this long.
RESTART_AFTER = 250
CONVERGED_BRANCHING = 1.00001
BRANCHING_SHARE = 0.05

# What random numbers are for: with the seed this begins the stream of the first trails.
_TRAILS = 3


#: A tour int32[n], and how much was laid on each of its edges.
Deposit = tuple[NDArray[np.int32], float]


@dataclass(frozen=True)
class ColonyParameters:
    """The options with every "as recommended" filled in for one instance."""

    algorithm: str
    ants: int
    alpha: float
    beta: float
    rate: float
    elitist_weight: float
    ranks: int
    greedy_probability: float
    local_rate: float
    best_probability: float
    local_search: bool
    initial: float | str | None

    @classmethod
    def of(cls, algorithm: str, options: AcoOptions, n: int, local_search: bool) -> ColonyParameters:
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
            local_rate=LOCAL_RATE,
            best_probability=BEST_PROBABILITY,
            local_search=local_search,
            initial=options.initial_pheromone,
        )


class Trails:
    """Pheromone on the candidate edges, and how the five algorithms change it."""

    def __init__(
        self,
        lists: NDArray[np.int32],
        parameters: ColonyParameters,
        c_nn: float,
        one_way: bool = False,
        *,
        seed: int = 1,
    ) -> None:
        """Lay the first trails on `lists` int32[n, k]; `c_nn` is the cost of the nearest-neighbour tour.

        They are equal, or drawn by the `seed`.
        `one_way`: an edge costs otherwise when it is gone along from its other end, and has a trail for each way.
        """
        self.lists, self.parameters, self.c_nn, self.one_way = lists, parameters, c_nn, one_way
        self.initial = _initial_pheromone(parameters, len(lists), c_nn)
        self.highest, self.lowest = math.inf, 0.0
        self.pheromone = np.full(lists.shape, self.initial)
        if parameters.initial == RANDOM_TRAILS:
            # Drawn from 0 to twice the mean, which is what trails of Ant Colony System wear off to.
            self.pheromone *= 2.0 * _drawn(lists, one_way, seed)
        self.nearness, self.weights = np.zeros(lists.shape), np.zeros(lists.shape)
        # A thousandth of the mean edge: nodes on one place are near, not infinitely near.
        self.offset = max(1e-12, 1e-3 * c_nn / len(lists))
        self.restarted_at = 0
        #: Who of MAX–MIN laid pheromone last (`model.snapshot.Step`), and the best tour of the last iteration.
        self.depositor, self.iteration_best = "", math.inf
        #: What was laid in this iteration, as `receive` takes it; None where nobody asks.
        self.changes: list[Deposit] | None = None
        self._learn: Callable[[int, NDArray[np.int32], NDArray[np.float64], Best], None] = {
            "as": self._ant_system,
            "eas": self._elitist,
            "asrank": self._rank_based,
            "mmas": self._max_min,
            "acs": self._colony_system,
        }[parameters.algorithm]

    def reinforce(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """Evaporate and deposit as the algorithm says."""
        self._learn(iteration, tours, costs, best)
        self.iteration_best = float(costs.min())
        self.weigh()

    def weigh(self) -> None:
        """Bring the weights that ants choose by up to date."""
        trails.fill_weights(self.pheromone, self.nearness, self.parameters.alpha, self.weights)

    def receive(self, changes: list[Deposit]) -> None:
        """Lay what another colony laid: evaporation is everybody's own."""
        for tour, amount in changes:
            if self.parameters.algorithm == "acs":
                rate = self.parameters.rate
                trails.reinforce_and_decay(self.lists, tour, rate, amount, self.one_way, self.pheromone)
            else:
                trails.deposit(self.lists, tour, amount, self.highest, self.one_way, self.pheromone)
        self.weigh()

    def _note(self, tour: NDArray[np.int32], amount: float) -> None:
        if self.changes is not None:
            self.changes.append((tour.copy(), amount))

    def _deposit(self, tour: NDArray[np.int32], amount: float) -> None:
        self._note(tour, amount)
        trails.deposit(self.lists, tour, amount, self.highest, self.one_way, self.pheromone)

    def _ant_system(self, _: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """All ants deposit 1/C (equations 3.2 to 3.4)."""
        trails.evaporate(self.pheromone, self.parameters.rate, self.lowest)
        for tour, cost in zip(tours, costs, strict=True):
            if cost < math.inf:
                self._deposit(tour, 1.0 / cost)

    def _elitist(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """As Ant System, and the best tour so far deposits e/C (equation 3.5)."""
        self._ant_system(iteration, tours, costs, best)
        self._deposit(best.tour, self.parameters.elitist_weight / best.cost)

    def _rank_based(self, _: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """The w - 1 best ants deposit by rank, the best so far with weight w (equation 3.6)."""
        trails.evaporate(self.pheromone, self.parameters.rate, self.lowest)
        w = self.parameters.ranks
        for rank, ant in enumerate(np.argsort(costs, kind="stable")[: w - 1], start=1):
            if costs[ant] < math.inf:
                self._deposit(tours[ant], (w - rank) / costs[ant])
        self._deposit(best.tour, w / best.cost)

    def _max_min(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """One ant deposits, within trail limits; equal trails again when they have converged (section 3.3.4)."""
        p = self.parameters
        self.highest = 1.0 / (p.rate * best.cost)
        self.lowest = self.highest * _lowest_share(p, *self.lists.shape)
        since = iteration - self.restarted_at
        stuck = since >= RESTART_AFTER and iteration - best.iteration >= RESTART_AFTER
        if stuck and iteration % 100 == 0 and self._converged():
            self.pheromone[:] = self.highest
            self.restarted_at, self.depositor = iteration, "restart"
            return
        trails.evaporate(self.pheromone, p.rate, self.lowest)
        if since % _best_so_far_every(since, p.local_search) == 0:
            self._deposit(best.tour, 1.0 / best.cost)
            self.depositor = "best"
        else:
            winner, self.depositor = int(np.argmin(costs)), "iteration"
            self._deposit(tours[winner], 1.0 / costs[winner])

    def _colony_system(self, _: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """Only the edges of the best tour so far change (equation 3.11)."""
        rate, amount = self.parameters.rate, 1.0 / best.cost
        self._note(best.tour, amount)
        trails.reinforce_and_decay(self.lists, best.tour, rate, amount, self.one_way, self.pheromone)

    def _converged(self) -> bool:
        factor = trails.branching(self.lists, self.pheromone, BRANCHING_SHARE)
        # An edge in both lists counts at both its nodes; a converged tour keeps two edges per node.
        return bool(factor <= 2.0 * CONVERGED_BRANCHING)


class ColonyTrails(Trails):
    """The trails of a colony on an instance."""

    def __init__(self, instance: Instance, parameters: ColonyParameters, c_nn: float, seed: int) -> None:
        super().__init__(instance.candidates, parameters, c_nn, seed=seed)
        self.instance = instance
        trails.fill_nearness(instance.cost, instance.candidates, parameters.beta, self.offset, self.nearness)
        self.weigh()


def _initial_pheromone(p: ColonyParameters, n: int, c_nn: float) -> float:
    """Return τ0: as asked for, else by the book's box 3.1; of trails that are drawn their mean, half of 1/(nC)."""
    if p.initial == RANDOM_TRAILS:
        return 0.5 / (n * c_nn)
    if p.initial == BY_N_RHO_C:
        return 1.0 / (n * p.rate * c_nn)
    if p.initial is not None and not isinstance(p.initial, str):
        return p.initial
    if p.initial == BY_N_C:
        return 1.0 / (n * c_nn)
    if p.algorithm == "as":
        return float(p.ants / c_nn)
    if p.algorithm == "eas":
        return float((p.elitist_weight + p.ants) / (p.rate * c_nn))
    if p.algorithm == "asrank":
        return max(1.0, 0.5 * p.ranks * (p.ranks - 1)) / (p.rate * c_nn)
    if p.algorithm == "mmas":
        return 1.0 / (p.rate * c_nn)
    return 1.0 / (n * c_nn)


def _drawn(lists: NDArray[np.int32], one_way: bool, seed: int) -> NDArray[np.float64]:
    """Return a random number of 0 … 1 for each edge of `lists` int32[n, k]; the same for both its entries."""
    n = len(lists)
    here, there = np.broadcast_to(np.arange(n, dtype=np.int64)[:, None], lists.shape), lists.astype(np.int64)
    low, high = (here, there) if one_way else (np.minimum(here, there), np.maximum(here, there))
    edges, which = np.unique(low * n + high, return_inverse=True)
    return np.random.default_rng((seed, _TRAILS)).random(len(edges))[which].reshape(lists.shape)


def _lowest_share(p: ColonyParameters, n: int, k: int) -> float:
    """Return τ_min / τ_max: 1/2n with local search (ACOTSP), else by p_best (the book, section 3.3.4, equation 3.9)."""
    if p.local_search:
        return float(1.0 / (2.0 * n))
    root = float(p.best_probability ** (1.0 / n))
    return float(min(1.0, (1.0 - root) / (max(1.0, 0.5 * (k + 1)) * root)))


def _best_so_far_every(since_restart: int, local_search: bool) -> int:
    """Return how often the best tour so far deposits instead of the iteration's best: ever more often (section 3.3.4).

    The steps are those of ACOTSP.
    """
    if not local_search or since_restart < 25:
        return 25
    for limit, every in ((75, 5), (125, 3), (250, 2)):
        if since_restart < limit:
            return every
    return 1


@dataclass(frozen=True, eq=False)
class LocalSearch:
    """2-opt, with Or-opt if wanted, on the candidate lists of one instance; one object per worker."""

    instance: Instance
    place: NDArray[np.int32]
    queue: NDArray[np.int32]
    queued: NDArray[np.uint8]
    state: NDArray[np.int64]
    touched: NDArray[np.int32]
    use_or_opt: bool

    @classmethod
    def of(cls, instance: Instance, use_or_opt: bool = True) -> LocalSearch:
        """Return a local search with buffers of its own."""
        n = instance.n
        place, queue = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
        queued, touched = np.zeros(n, dtype=np.uint8), np.zeros(8, dtype=np.int32)
        return cls(instance, place, queue, queued, np.zeros(2, dtype=np.int64), touched, use_or_opt)

    def __call__(self, tour: NDArray[np.int32], stop: Stop) -> None:
        """Improve the tour int32[n] in place to a local optimum, or until `stop.now()`."""
        queue_all(tour, self.place, self.queue, self.queued, self.state)
        cost, lists = self.instance.cost, self.instance.candidates
        while True:
            moves = improve(
                cost, tour, self.place, lists, self.queue, self.queued, self.state, self.touched, self.use_or_opt,
                MOVES_PER_LOOK,
            )  # fmt: skip
            if moves < MOVES_PER_LOOK or stop.now():
                return


class Ants:
    """Builds and improves the tours of one iteration, ants spread over workers.

    What an ant does depends on the seed, the iteration and its number only: the answer is the same on any number of
    threads.
    """

    def __init__(self, colony: ColonyTrails, seed: int, stop: Stop, executor: Executor | None, workers: int) -> None:
        self.colony, self.seed, self.stop = colony, seed, stop
        self.executor, self.workers = executor, workers
        self.log = WorkerLog.of(workers)
        m, n = colony.parameters.ants, colony.instance.n
        self.tours = np.zeros((m, n), dtype=np.int32)
        self.costs = np.full(m, math.inf)
        self._unvisited = [none_visited(colony.instance) for _ in range(workers)]
        self._search = [LocalSearch.of(colony.instance) for _ in range(workers)]

    def propose(self, iteration: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the tours int32[m, n] of the ants and their costs float64[m] (inf: not finished in time)."""
        words = random_words(self.seed, iteration, count=len(self.costs))
        self.costs[:] = math.inf
        built = self._built(words)
        if self.executor is None:
            self._work(0, words, built)
        else:
            jobs = [self.executor.submit(self._work, w, words, built) for w in range(self.workers)]
            for job in jobs:
                job.result()
        return self.tours, self.costs

    def _built(self, words: NDArray[np.uint64]) -> int | None:
        """Return how many tours were built before the workers begin; None where each of them builds its own."""
        return self._build_with_decay(words, 0, 1) if self.colony.parameters.algorithm == "acs" else None

    def share(self, iteration: int, worker: int, workers: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the tours of every `workers`-th ant, the first of them `worker`, and their costs."""
        words = random_words(self.seed, iteration, count=len(self.costs))
        self.costs[:] = math.inf
        acs = self.colony.parameters.algorithm == "acs"
        self._work(worker, words, self._build_with_decay(words, worker, workers) if acs else None, workers)
        return self.tours[worker::workers], self.costs[worker::workers]

    def _build_with_decay(self, words: NDArray[np.uint64], first: int, step: int) -> int:
        """Let ants of Ant Colony System build one after another; return the number of the first who had no time to."""
        colony, i, p = self.colony, self.colony.instance, self.colony.parameters
        edges = WeightedEdges(i.candidates, colony.pheromone, colony.nearness, colony.weights)
        decay = Decay(p.alpha, p.local_rate, colony.initial)
        for ant in range(first, p.ants, step):
            if ant > first and self.stop.now():
                return ant
            construct_tour_with_decay(
                i.cost, i.tree, edges, decay, p.greedy_probability, i.first, i.second, words, ant, self.tours[ant],
                self._unvisited[0],
            )  # fmt: skip
        return p.ants

    def _work(self, worker: int, words: NDArray[np.uint64], built: int | None, step: int = 0) -> None:
        """Build and improve the tours of every `step`-th ant; without a step there are as many shares as workers."""
        began, ants, mine, step = clock(), 0, worker % self.workers, step or self.workers
        i = self.colony.instance
        for ant in range(worker, len(self.costs) if built is None else built, step):
            if ant >= step and self.stop.now():
                break
            if built is None:
                self._build(mine, ant, words)
            if self.colony.parameters.local_search:
                self._search[mine](self.tours[ant], self.stop)
            self.costs[ant] = tour_cost(i.cost, self.tours[ant])
            ants += 1
        best = float(self.costs[worker::step].min(initial=math.inf))
        self.log.add(mine, ants, clock() - began, best)

    def _build(self, worker: int, ant: int, words: NDArray[np.uint64]) -> None:
        colony, i = self.colony, self.colony.instance
        construct_tour(
            i.cost, i.tree, i.candidates, colony.weights, colony.nearness, colony.parameters.greedy_probability,
            i.first, i.second, words, ant, self.tours[ant], self._unvisited[worker],
        )  # fmt: skip


def first_tour(instance: Instance, local_search: bool, stop: Stop, best: Best) -> float:
    """Offer the nearest-neighbour tour, and its improvement when `local_search`; return the former's cost (C_nn)."""
    tour = nearest_neighbour(instance)
    c_nn = float(tour_cost(instance.cost, tour))
    best.offer(tour, c_nn, 0)
    if local_search:
        LocalSearch.of(instance)(tour, stop)
        best.offer(tour, float(tour_cost(instance.cost, tour)), 0)
    return c_nn
