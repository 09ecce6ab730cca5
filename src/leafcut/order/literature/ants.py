"""Ant algorithms as populations. Ants construct tours or orders of clusters, and deposit pheromone on them."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.order.construction import random_states
from leafcut.order.directed import AnyInstance, DirectedInstance
from leafcut.order.literature.choices import Choices
from leafcut.order.literature.pheromone import TRAILS, AntParameters, Trails
from leafcut.order.literature.places import Places
from leafcut.order.search import Best, Population, Tours
from leafcut.order.stop import Stop, clock
from leafcut.order.workers import WorkerLog, run_on_all_workers

MoveSet = Places | Choices


def create_move_set(instance: AnyInstance, local_search: bool, workers: int = 1) -> MoveSet:
    """Create the move set that fits an instance."""
    if isinstance(instance, DirectedInstance):
        return Choices(instance, local_search)
    return Places(instance, local_search, workers)


def initial_trails(moves: MoveSet, parameters: AntParameters, c_nn: float, seed: int) -> Trails:
    """Create an algorithm's pheromone trails with their initial values."""
    trails = TRAILS[parameters.algorithm](moves.lists, parameters, c_nn, moves.one_way, seed=seed)
    moves.fill_nearness(trails)
    trails.update_weights()
    return trails


class AntColony(Population):
    """Ants that share pheromone trails. If each worker has its own trails, `trails` is None."""

    def __init__(self, moves: MoveSet, trails: Trails | None, ants: int, workers: int) -> None:
        super().__init__(moves.instance, WorkerLog.empty(workers))
        self.moves, self.trails = moves, trails
        self.tours = np.zeros((ants, moves.instance.n), dtype=np.int32)
        self.costs = np.full(ants, math.inf)

    def reinforce(self, iteration: int, tours: Ints, costs: NDArray[np.float64], best: Best) -> None:
        """Update the pheromone trails by the algorithm's rule."""
        if self.trails is not None:
            self.trails.reinforce(iteration, tours, costs, best)

    def instance_nodes(self, tour: Ints) -> Ints:
        """Convert a tour to nodes of the instance."""
        return self.moves.instance_nodes(tour)

    def snapshot_fields(self, best: Best) -> dict[str, Any]:
        """Return the fields that this algorithm adds to a snapshot: worker statistics, pheromone, and last step."""
        shown = {} if self.trails is None else self.moves.snapshot_fields(self.trails, best)
        return super().snapshot_fields(best) | shown

    def branching_factor(self) -> float | None:
        """Return the mean λ-branching factor of the pheromone trails."""
        return None if self.trails is None else self.trails.branching_factor()


class Ants(AntColony):
    """Constructs and improves the tours of an iteration in threads.

    The tours do not depend on the number of threads.
    """

    trails: Trails

    def __init__(
        self, moves: MoveSet, trails: Trails, seed: int, stop: Stop, executor: Executor | None = None, workers: int = 1
    ) -> None:
        super().__init__(moves, trails, trails.parameters.ants, workers)
        self.seed, self.stop, self.executor, self.workers = seed, stop, executor, workers

    def construct(self, iteration: int) -> Tours:
        """Return the ants' tours, int32[m, n], and their costs, float64[m].

        The cost of an unfinished tour is infinite.
        """
        words = self._random_states(iteration)
        built = self._construct_all(words)
        run_on_all_workers(self.executor, self.workers, lambda w: self._run_ants(w, words, built, self.workers))
        return self.tours, self.costs

    def construct_share(self, iteration: int, worker: int, workers: int) -> Tours:
        """Return the tours and costs of ants `worker`, `worker` + `workers`, `worker` + 2 `workers`, and so on."""
        words = self._random_states(iteration)
        self._run_ants(worker, words, self._construct_in_turn(words, worker, workers), workers)
        return self.tours[worker::workers], self.costs[worker::workers]

    def _random_states(self, iteration: int) -> NDArray[np.uint64]:
        self.costs[:] = math.inf
        return random_states(self.seed, iteration, count=len(self.costs))

    def _construct_all(self, words: NDArray[np.uint64]) -> int | None:
        """If the algorithm requires it, construct all tours before the workers start.

        Returns the number of tours, or None if each worker constructs its own tours.
        """
        return self._construct_in_turn(words, 0, 1)

    def _construct_in_turn(self, words: NDArray[np.uint64], first: int, step: int) -> int | None:
        """If ants change the pheromone while they move, construct every `step`-th tour, one after the other.

        Returns the index of the first ant that ran out of time.
        """
        if not self.trails.parameters.local_rate:
            return None
        for ant in range(first, len(self.tours), step):
            if ant > first and self.stop.must_stop():
                return ant
            self.moves.construct(self.trails, words, ant, self.tours[ant], 0)
        return len(self.tours)

    def _run_ants(self, worker: int, words: NDArray[np.uint64], built: int | None, step: int) -> None:
        """Construct and improve the tours of every `step`-th ant.

        If `built` is set, the tours already exist, and only the first `built` of them are improved.
        """
        began, ants, mine = clock(), 0, worker % self.workers
        for ant in range(worker, len(self.costs) if built is None else built, step):
            if ant >= step and self.stop.must_stop():
                break
            if built is None:
                self.moves.construct(self.trails, words, ant, self.tours[ant], mine)
            self.costs[ant] = self.moves.improve_and_measure(self.tours[ant], self.stop)
            ants += 1
        best = float(self.costs[worker::step].min(initial=math.inf))
        self.log.add(mine, ants, clock() - began, best)
