"""Discrete firefly algorithm: tours or orders move towards shorter tours or orders by inversions.

Source: G. K. Jati and Suyanto, Evolutionary discrete firefly algorithm for travelling salesman problem, ICAIS 2011,
LNAI 6943, 393–403. The parameters come from the published system for pocket milling that uses the algorithm. If two
tours of h nodes differ in A edges, their distance is r = 10·A/h. A shorter tour attracts a firefly with the
attractiveness β = β0·exp(-γ·r²), which decreases with the distance. A firefly moves towards the most attractive shorter
tour by inverting runs of 2 to A nodes at random positions. The firefly with the shortest tour moves at random.

The sources leave some points open. This module makes the following choices:

- β is the number of inversions in a flight. An iteration has one flight per node (`FLIGHTS`).
- Long inversions have 2 to A nodes. Short inversions have at most a given fraction of all nodes, or 50 nodes with
  repair. After a given fraction of the iterations or of the time limit, the search switches from long to short
  inversions, from coarse to fine.

Differs:

- Inversions are applied one after another, and each is kept unless it makes the tour longer. The published algorithm
  applies all inversions to the same tour and keeps the n shortest results (`published_fireflies`).
- All fireflies see the swarm in its state at the start of the iteration. They can therefore move in parallel threads.
- With local search, a move consists of two nearby inversions. Sequential exchanges (`kernels.lin_kernighan`) then
  repair the tour at the affected nodes. The exchanges would simply undo a single inversion.
- For orders of clusters, the distance counts directed steps, and precedence may prevent the inversion of a run. An
  iteration is one flight per firefly, because every inversion requires choosing all nodes again.

We also tried copying edges from the brighter tour instead (G. K. Jati, R. Manurung and Suyanto, Discrete firefly
algorithm for traveling salesman problem: a new movement scheme, in: Swarm Intelligence and Bio-Inspired Computation,
Elsevier 2013, 295–312). It was no better on grids of 344 to 849 points.
"""

from __future__ import annotations

import math
import time
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import count_different_edges, invert_and_repair, make_random_inversions
from leafcut.kernels.lin_kernighan import Tour
from leafcut.kernels.ordering import count_different_steps, invert_runs
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.directed import DirectedInstance
from leafcut.order.instance import Instance, costs_of_edges
from leafcut.order.kicks import BREADTH, LONGEST_REWRITE, improve_queued_nodes, search_breadth, tour_with_buffers
from leafcut.order.literature.choices import Choices
from leafcut.order.literature.flight import Flight, Swarm, completed_share, initial_tour
from leafcut.order.literature.published_fireflies import PublishedFireflies
from leafcut.order.search import (
    AlgorithmRun,
    Best,
    SearchResult,
    Tours,
    run_population,
    set_preset_budget,
    set_visit_budget,
)
from leafcut.order.stop import Stop
from leafcut.order.workers import run_on_all_workers, thread_count, thread_pool

#: Number of flights per iteration and node, without and with repair. A move with repair takes the place of about a
#: hundred simple moves.
FLIGHTS, FLIGHTS_MENDED = 1.0, 0.05

#: Budget of each preset: the number of inversions, and the number of moves with repair.
PRESETS = {"fast": (2e7, 2e4), "default": (4e8, 2e5), "thorough": (1e10, 1e7)}

#: Check the clock after at most this many inversions or moves with repair, about every 10 ms.
MOVES_PER_LOOK, MENDED_PER_LOOK = 500_000, 500

#: Maximum number of nodes without local search. At this size, the costs between all nodes take 0.1 GB.
MOST_NODES = 5000


class PlaceFireflies(Swarm):
    """Fireflies that are closed tours of points. Their moves do not depend on the number of threads."""

    def __init__(
        self,
        instance: Instance,
        flight: Flight,
        options: SolveOptions,
        stop: Stop,
        executor: Executor | None,
        workers: int,
    ) -> None:
        super().__init__(instance, flight, options, workers)
        self.instance, self.stop, self.executor, self.workers = instance, stop, executor, workers
        self.swarm = [self._create_firefly(f) for f in range(flight.fireflies)]
        self.lengths[0] = tour_cost(instance.cost, self.swarm[0].node)
        self.costs = np.zeros((0, 0), dtype=np.float32) if self.mended else cost_table(instance)
        self.breadth = search_breadth(instance, BREADTH)

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the preset's budget as a number of moves."""
        moves = self.flight.fireflies * self.moves_per_flight(self.flight.attractiveness)
        set_preset_budget(stop, options, PRESETS[options.preset][self.mended] / moves)

    def offer_first_solution(self, best: Best) -> None:
        """Offer the first firefly's tour as the first solution."""
        best.offer(self.swarm[0].node, float(self.lengths[0]), 0)

    @property
    def tours(self) -> Ints:
        """Return the swarm's tours, int32[fireflies, h]."""
        return np.stack([tour.node for tour in self.swarm])

    def moves_per_flight(self, attraction: float) -> int:
        """Return the number of moves that a firefly makes in an iteration."""
        flights = self.size * (FLIGHTS_MENDED if self.mended else FLIGHTS)
        return max(1, round(attraction * flights))

    def _create_firefly(self, f: int) -> Tour:
        node = initial_tour(self.instance, self.flight, self.seed, f)
        return tour_with_buffers(node, log=2 * self.size + 1000 if self.mended else 0)

    def construct(self, iteration: int) -> Tours:
        """Move every firefly. Return the swarm's tours, int32[fireflies, h], and their lengths."""
        self.done = completed_share(self.stop, iteration)
        plan = [self._plan_flight(f) for f in range(len(self.swarm))] if iteration else []
        words = random_states(self.seed, iteration, count=len(self.swarm))
        run_on_all_workers(self.executor, self.workers, lambda w: self._move_share(w, plan, words))
        return self.tours, self.lengths

    def count_different_edges(self, one: int, other: int) -> int:
        """Count the edges in tour `one` that are missing in tour `other`."""
        return int(count_different_edges(self.swarm[one].node, self.swarm[other].node, self.swarm[other].place))

    def _plan_flight(self, f: int) -> tuple[int, int]:
        moves, longest = self.moves_to_target(f)
        return moves, min(longest, LONGEST_REWRITE) if self.mended else longest

    def _move_share(self, worker: int, plan: list[tuple[int, int]], words: NDArray[np.uint64]) -> None:
        began, flown = time.perf_counter(), 0
        for f in range(worker, len(self.swarm), self.workers):
            if f and self.stop.must_stop():
                break
            if plan:
                self._fly_to_target(f, *plan[f], words)
            elif self.mended:
                improve_queued_nodes(
                    self.instance, self.swarm[f]._replace(log=np.zeros((0, 2), dtype=np.int32)), BREADTH, self.stop
                )
            self.lengths[f] = tour_cost(self.instance.cost, self.swarm[f].node)
            flown += 1
        mine = self.lengths[worker :: self.workers]
        self.log.add(worker, flown, time.perf_counter() - began, float(mine.min(initial=math.inf)))

    def _fly_to_target(self, f: int, moves: int, longest: int, words: NDArray[np.uint64]) -> None:
        tour, instance, per_look = self.swarm[f], self.instance, MENDED_PER_LOOK if self.mended else MOVES_PER_LOOK
        while moves > 0:
            now = min(moves, per_look)
            if self.mended:
                invert_and_repair(
                    instance.cost, tour, *instance.exchange_candidates, self.breadth, now, longest, words, f
                )
            else:
                make_random_inversions(self.costs, tour.node, tour.place, now, longest, words, f)
            moves -= now
            if self.stop.must_stop():
                return


def cost_table(instance: Instance) -> NDArray[np.float32]:
    """Compute the costs between all nodes, float32[h, h]. Raises SolveError for more than `MOST_NODES` nodes."""
    h = instance.n
    if h > MOST_NODES:
        raise SolveError(
            "fireflies without local search store the costs between all nodes, for at most {} nodes; this problem "
            "has {}; leave out --no-local-search",
            MOST_NODES,
            h,
        )
    costs, there = np.zeros((h, h), dtype=np.float32), np.arange(h, dtype=np.int32)
    for here in range(h):
        others = np.delete(there, here)
        costs[here, others] = costs_of_edges(instance.cost, np.full(h - 1, here, dtype=np.int32), others)
    return costs


class ChoiceFireflies(Swarm):
    """Fireflies that are orders of clusters.

    Each firefly moves towards the most attractive shorter order. The firefly with the shortest order moves at random.
    """

    def __init__(self, instance: DirectedInstance, flight: Flight, options: SolveOptions, stop: Stop) -> None:
        super().__init__(instance, flight, options)
        self.moves, self.stop = Choices(instance, options.local_search), stop
        count, m = flight.fireflies, instance.n
        self.orders = np.zeros((count, m), dtype=np.int32)
        self.place, self.moved = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
        words = random_states(self.seed, 0, count=count)
        for f in range(count):
            self.moves.construct_at_random(words, f, self.orders[f])

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the preset's budget as a number of visited clusters."""
        set_visit_budget(stop, options, self.size * self.flight.fireflies * max(1.0, self.flight.attractiveness))

    def offer_first_solution(self, best: Best) -> None:
        """Give the nearest-neighbour order to the first firefly and offer it as the first solution."""
        self.moves.offer_first_solution(best)
        self.orders[0] = best.tour

    def construct(self, iteration: int) -> Tours:
        """Move every firefly once. Return the swarm's orders, shortest first, and their lengths."""
        began, flown = time.perf_counter(), 0
        words = random_states(self.seed, iteration + 1, count=len(self.orders))
        if iteration:
            self.done = completed_share(self.stop, iteration)
        for f in np.argsort(self.lengths, kind="stable").tolist():
            if self.stop.must_stop() and (iteration or f):
                break
            if iteration:
                self._fly_to_target(f, words)
            else:
                self.lengths[f] = self.moves.improve_and_measure(self.orders[f], self.stop)
            flown += 1
        self.log.add(0, flown, time.perf_counter() - began, float(self.lengths.min()))
        return self.orders, self.lengths

    def count_different_edges(self, one: int, other: int) -> int:
        """Count the directed steps in order `one` that are missing in order `other`."""
        place = np.zeros(self.size, dtype=np.int32)
        place[self.orders[one]] = np.arange(self.size, dtype=np.int32)
        return int(count_different_steps(self.orders[other], place))

    def moves_per_flight(self, attraction: float) -> int:
        """Return the number of moves in a flight."""
        return max(1, round(attraction))

    def _fly_to_target(self, f: int, words: NDArray[np.uint64]) -> None:
        """Make the moves of a flight. A move is undone if it makes the order longer."""
        if self.size < 4:
            return
        moves, longest = self.moves_to_target(f)
        for _ in range(moves):
            self.moved[:] = self.orders[f]
            self.place[self.moved] = np.arange(self.size, dtype=np.int32)
            invert_runs(self.moves.layers, self.moved, self.place, 2 if self.mended else 1, longest, words, f)
            length = self.moves.improve_and_measure(self.moved, self.stop)
            if length <= self.lengths[f]:
                self.orders[f], self.lengths[f] = self.moved, length
            if self.stop.must_stop():
                return

    def instance_nodes(self, tour: Ints) -> Ints:
        """Choose the nodes for an order of clusters."""
        return self.moves.instance_nodes(tour)


def check_fireflies(_: str, __: AcoOptions, firefly: FireflyOptions, choices: bool) -> None:
    """Raise SolveError if the options request a published variant but the problem has choices."""
    if choices and firefly.variant != "leafcut":
        raise SolveError(
            "--variant {} supports only closed tours of points, without precedence, directions or "
            "alternative starts; use --variant leafcut",
            firefly.variant,
        )


def run_fireflies(instance: Instance | DirectedInstance, run: AlgorithmRun) -> SearchResult:
    """Run the firefly algorithm."""
    options, stop, best = run.options, run.stop, run.best
    flight = Flight.from_options(run.firefly, limited=options.is_limited)
    threads = min(thread_count(options), flight.fireflies)
    with thread_pool(threads, stop) as executor:
        if isinstance(instance, DirectedInstance):
            swarm: Swarm = ChoiceFireflies(instance, flight, options, stop)
        elif flight.at_random:
            swarm = PublishedFireflies(instance, flight, options, stop)
        else:
            swarm = PlaceFireflies(instance, flight, options, stop, executor, threads)
        swarm.set_budget(stop, options)
        stop.patience = flight.patience
        swarm.offer_first_solution(best)
        if best.cost <= 0.0:
            return SearchResult(swarm.instance_nodes(best.tour))  # all nodes at the same position: nothing to gain
        iterations = run_population(swarm, best)
    return SearchResult(swarm.instance_nodes(best.tour), iterations, swarm.log.worker_figures())
