"""The discrete firefly algorithm: closed tours that fly towards shorter ones by inversions.

Source: G. K. Jati and Suyanto, Evolutionary discrete firefly algorithm for travelling salesman problem, ICAIS 2011,
LNAI 6943, 393–403; of the parameters, the published system for milling pockets that uses it. Two tours of h nodes with
A different edges are r = 10·A/h apart; how attractive a shorter tour is, β = β0·exp(-γ·r²), falls with the distance. A
firefly flies to the most attractive of the shorter tours, by inversions of runs with 2 to A nodes at random places; the
shortest, which sees none, flies at random.

What the sources leave open is settled as follows.

- β is how many inversions a flight has; an iteration is as many flights as there are nodes (`FLIGHTS`).
- Long inversions have 2 to A nodes, short ones no more than a share of all, or 50 where mended. Until the switch, at a
  share of the iterations (or of the time limit), they are long, then short: first far, then fine.
- The settings for simple and for complex pockets differ in their defaults only: fireflies, β0, and the switch.

Differs: inversions are made one after the other, and each is kept unless it makes the tour longer, instead of trying
all from one place and keeping the n best tours of all, which soon are copies of one (`order.published_firefly`). All
fireflies see the swarm as it was when the iteration began, so they may fly in threads. With local search a move is two
inversions near each other, mended by sequential exchanges (`kernels.lin_kernighan`) at what they touched: one alone
would be turned back.
Those who copy edges of the brighter tour instead (G. K. Jati, R. Manurung and Suyanto, Discrete firefly algorithm for
traveling salesman problem: a new movement scheme, in: Swarm Intelligence and Bio-Inspired Computation, Elsevier 2013,
295–312) were tried: on grids of 344 to 849 points no better.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import edges_apart, fly, fly_and_mend
from leafcut.kernels.lin_kernighan import Tour
from leafcut.options import FireflyOptions
from leafcut.order.construction import greedy, random_words
from leafcut.order.instance import Instance, costs_of_edges
from leafcut.order.kicks import BREADTH, LONGEST_REWRITE, choices, descend, work_tour
from leafcut.order.statistics import Best, WorkerLog
from leafcut.order.stop import Stop


@dataclass(frozen=True)
class Mode:
    """What the published system takes in one of its modes: fireflies, β0, and the share at which it switches, %."""

    fireflies: int
    attractiveness: float
    switch_at: float


#: By the value of `--variant`.
MODES = {
    "leafcut": Mode(11, 20.0, 27.0),
    "published": Mode(11, 20.0, 27.0),
    "published-complex": Mode(10, 15.0, 37.0),
}

#: Iterations without a shorter tour after which the published system ends.
PATIENCE = 20

#: Flights of an iteration for every node. A move that is mended does as much as some hundred that are not.
FLIGHTS, FLIGHTS_MENDED = 1.0, 0.05

#: Inversions that a preset has time for, and moves that are mended.
PRESETS = {"fast": (2e7, 2e4), "default": (4e8, 2e5), "thorough": (1e10, 1e7)}

#: Most nodes of a short inversion: as a share of all, and where it is mended.
SHORT_SHARE, SHORT_MENDED = 0.25, 50

#: Most inversions between two looks at the clock: some ten milliseconds; and moves that are mended.
MOVES_PER_LOOK, MENDED_PER_LOOK = 500_000, 500

#: Without local search costs between all nodes are at hand: up to this many, a tenth of a gigabyte.
MOST_NODES = 5000


@dataclass(frozen=True)
class Flight:
    """The options with everything that is as published filled in."""

    fireflies: int
    attractiveness: float
    absorption: float
    switch: float
    patience: float
    at_random: bool
    complex: bool = False

    @classmethod
    def of(cls, options: FireflyOptions, limited: bool) -> Flight:
        """Return the parameters; a search that is `limited`, in time or iterations, ends there and nowhere else."""
        mode = MODES[options.variant]
        return cls(
            fireflies=options.n_fireflies or mode.fireflies,
            attractiveness=mode.attractiveness if options.attractiveness is None else options.attractiveness,
            absorption=options.absorption,
            switch=0.01 * mode.switch_at,
            patience=math.inf if limited else PATIENCE,
            at_random=options.variant != "leafcut",
            complex=options.variant == "published-complex",
        )

    def attraction(self, apart: int, h: int) -> float:
        """Return β between two tours of h nodes with so many different edges."""
        r = 10.0 * apart / h
        return self.attractiveness * math.exp(-self.absorption * r * r)

    def target(self, lengths: NDArray[np.float64], f: int, apart: dict[int, int], h: int) -> int:
        """Return the most attractive of the brighter fireflies: brightness is 1 over the length."""
        # Lengths below 0 are none: costs of a table may be, then all are equally bright.
        floor = max(float(lengths[f]), 1e-300)
        return max(apart, key=lambda j: self.attraction(apart[j], h) * floor / max(float(lengths[j]), 1e-300))

    def aim(
        self, lengths: NDArray[np.float64], f: int, apart: Callable[[int], int], h: int, done: float, mended: bool
    ) -> tuple[float, int]:
        """Return how attractive the target of a firefly is, and how many nodes its longest inversion has.

        `apart` tells how many edges of another one it has not; the brightest sees none, and flies at random.
        """
        short = SHORT_MENDED if mended else math.ceil(SHORT_SHARE * h)
        seen = {j: apart(j) for j in np.flatnonzero(lengths < lengths[f]).tolist()}
        if not seen:
            return self.attractiveness, self.longest(h, h, done, short)
        away = seen[self.target(lengths, f, seen, h)]
        return self.attraction(away, h), self.longest(away, h, done, short)

    def longest(self, apart: int, h: int, share_done: float, short: int) -> int:
        """Return how many nodes the longest inversion has, 2 … h - 2."""
        limit = apart if share_done < self.switch else min(apart, short)
        return max(2, min(limit, h - 2))


def share_done(stop: Stop, iteration: int) -> float:
    """Return how much of the iterations, or of the time, has gone, 0 … 1."""
    of_time = stop.elapsed() / stop.seconds if stop.seconds < math.inf else 0.0
    of_count = iteration / stop.iterations if stop.iterations < math.inf else 0.0
    return max(of_time, of_count)


def first_of(instance: Instance, flight: Flight, seed: int, f: int) -> Ints:
    """Return the tour int32[h] that a firefly begins with: a random one, or a greedy one with small changes."""
    rng = np.random.default_rng((seed, f))
    if not flight.at_random:
        return greedy(instance, rng if f else None)
    tied = [node for node in (instance.first, instance.second) if instance.second >= 0]
    return np.append(rng.permutation(np.setdiff1d(np.arange(instance.n), tied)), tied).astype(np.int32)


class Fireflies:
    """The swarm: its tours, and how every one of them flies in an iteration.

    What a firefly does depends on the seed, the iteration and the swarm only: the answer is the same on any number of
    threads.
    """

    def __init__(
        self, instance: Instance, flight: Flight, local_search: bool, seed: int, stop: Stop, executor: Executor | None,
        workers: int,
    ) -> None:  # fmt: skip
        self.instance, self.flight, self.seed, self.stop = instance, flight, seed, stop
        self.mended, self.executor, self.workers = local_search, executor, workers
        self.log = WorkerLog.of(workers)
        self.swarm = [self._begin(f) for f in range(flight.fireflies)]
        self.lengths = np.full(flight.fireflies, math.inf)
        self.lengths[0] = tour_cost(instance.cost, self.swarm[0].node)
        self.costs = np.zeros((0, 0), dtype=np.float32) if local_search else all_costs(instance)
        self.breadth = choices(instance, BREADTH)
        #: The share of the search that had gone when they last flew.
        self.done = 0.0

    @property
    def size(self) -> int:
        """Nodes of a tour."""
        return self.instance.n

    @property
    def tours(self) -> Ints:
        """The swarm's tours, int32[fireflies, h]."""
        return np.stack([tour.node for tour in self.swarm])

    def moves_of(self, attraction: float) -> int:
        """Return how many moves a firefly makes in an iteration."""
        flights = self.instance.n * (FLIGHTS_MENDED if self.mended else FLIGHTS)
        return max(1, round(attraction * flights))

    def _begin(self, f: int) -> Tour:
        node = first_of(self.instance, self.flight, self.seed, f)
        return work_tour(node, log=2 * self.instance.n + 1000 if self.mended else 0)

    def propose(self, iteration: int) -> tuple[Ints, NDArray[np.float64]]:
        """Return the swarm, int32[fireflies, h], and its lengths after every firefly has flown."""
        self.done = share_done(self.stop, iteration)
        plan = [self._aim(f) for f in range(len(self.swarm))] if iteration else []
        words = random_words(self.seed, iteration, count=len(self.swarm))
        if self.executor is None:
            self._work(0, plan, words)
        else:
            jobs = [self.executor.submit(self._work, w, plan, words) for w in range(self.workers)]
            for job in jobs:
                job.result()
        return self.tours, self.lengths

    def apart(self, one: int, other: int) -> int:
        """Return how many edges of a firefly another one has not."""
        return int(edges_apart(self.swarm[one].node, self.swarm[other].node, self.swarm[other].place))

    def _aim(self, f: int) -> tuple[int, int]:
        """Return how many moves a firefly makes, and how many nodes the longest inversion has."""
        attraction, longest = self.flight.aim(
            self.lengths, f, lambda j: self.apart(f, j), self.instance.n, self.done, self.mended
        )
        return self.moves_of(attraction), self._limit(longest)

    def _limit(self, longest: int) -> int:
        return min(longest, LONGEST_REWRITE) if self.mended else longest

    def _work(self, worker: int, plan: list[tuple[int, int]], words: NDArray[np.uint64]) -> None:
        began, flown = time.perf_counter(), 0
        for f in range(worker, len(self.swarm), self.workers):
            if f and self.stop.now():
                break
            if plan:
                self._fly(f, *plan[f], words)
            elif self.mended:
                descend(self.instance, self.swarm[f]._replace(log=np.zeros((0, 2), dtype=np.int32)), BREADTH, self.stop)
            self.lengths[f] = tour_cost(self.instance.cost, self.swarm[f].node)
            flown += 1
        mine = self.lengths[worker :: self.workers]
        self.log.add(worker, flown, time.perf_counter() - began, float(mine.min(initial=math.inf)))

    def _fly(self, f: int, moves: int, longest: int, words: NDArray[np.uint64]) -> None:
        tour, instance, per_look = self.swarm[f], self.instance, MENDED_PER_LOOK if self.mended else MOVES_PER_LOOK
        while moves > 0:
            now = min(moves, per_look)
            if self.mended:
                fly_and_mend(instance.cost, tour, *instance.exchange_lists, self.breadth, now, longest, words, f)
            else:
                fly(self.costs, tour.node, tour.place, now, longest, words, f)
            moves -= now
            if self.stop.now():
                return


def all_costs(instance: Instance) -> NDArray[np.float32]:
    """Return the costs between all nodes, float32[h, h].

    Raises
    ------
    SolveError
        There are more than `MOST_NODES`.
    """
    h = instance.n
    if h > MOST_NODES:
        raise SolveError(
            f"fireflies without local search store the costs between all nodes, up to {MOST_NODES} of them; there are "
            f"{h}; leave out --no-local-search"
        )
    costs, there = np.zeros((h, h), dtype=np.float32), np.arange(h, dtype=np.int32)
    for here in range(h):
        others = np.delete(there, here)
        costs[here, others] = costs_of_edges(instance.cost, np.full(h - 1, here, dtype=np.int32), others)
    return costs


def first_tour(swarm: Fireflies, best: Best) -> None:
    """Offer the tour that the first firefly begins with."""
    best.offer(swarm.swarm[0].node, float(swarm.lengths[0]), 0)


def learn_nothing(iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
    """Leave everything as it is: fireflies learn by flying."""
