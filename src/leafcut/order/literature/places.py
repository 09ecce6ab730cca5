"""The move set *places*: ants construct closed tours of points and improve them with 2-opt and Or-opt."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.construct import Decay, WeightedEdges, construct_tour
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.local_search import improve_by_two_opt_and_or_opt
from leafcut.kernels.pheromone import fill_nearness
from leafcut.model.snapshot import NextPlace
from leafcut.order.construction import allocate_unvisited_buffers, nearest_neighbour_tour
from leafcut.order.instance import Instance
from leafcut.order.kicks import tour_with_buffers
from leafcut.order.literature.pheromone import MOST_CHOICES, Trails
from leafcut.order.pheromone_view import pheromone_on_candidates
from leafcut.order.search import AlgorithmRun, Best, SearchResult
from leafcut.order.stop import Stop

#: Check the clock after this many moves, which take a few milliseconds.
MOVES_PER_LOOK = 2000


def improve_locally(instance: Instance, tour: Ints, stop: Stop) -> None:
    """Improve a tour, int32[n], in place with 2-opt and Or-opt.

    The search ends when the tour is locally optimal or `stop.must_stop()` returns True.
    """
    work = tour_with_buffers(tour)
    while (
        improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, MOVES_PER_LOOK) == MOVES_PER_LOOK
        and not stop.must_stop()
    ):
        pass
    tour[:] = work.node


def offer_first_tour(instance: Instance, local_search: bool, stop: Stop, best: Best) -> float:
    """Offer the nearest-neighbour tour as the first solution. With `local_search`, also offer the improved tour.

    Returns the cost C_nn of the nearest-neighbour tour.
    """
    tour = nearest_neighbour_tour(instance)
    c_nn = float(tour_cost(instance.cost, tour))
    best.offer(tour, c_nn, 0)
    if local_search:
        improve_locally(instance, tour, stop)
        best.offer(tour, float(tour_cost(instance.cost, tour)), 0)
    return c_nn


class Places:
    """The move set for closed tours of points, with each worker's buffers."""

    #: Whether the two directions of an edge have separate trails.
    one_way = False

    def __init__(self, instance: Instance, local_search: bool, workers: int = 1) -> None:
        self.instance, self.local_search, self.lists = instance, local_search, instance.candidates
        self._unvisited = [allocate_unvisited_buffers(instance) for _ in range(workers)]

    def offer_first_solution(self, best: Best) -> float:
        """Offer the first tours and return the cost C_nn of the nearest-neighbour tour."""
        return offer_first_tour(self.instance, self.local_search, best.stop, best)

    def fill_nearness(self, trails: Trails) -> None:
        """Compute the nearness η^β of each edge. Changes: trails.nearness."""
        fill_nearness(self.instance.cost, self.lists, trails.parameters.beta, trails.offset, trails.nearness)

    def construct(self, trails: Trails, words: NDArray[np.uint64], ant: int, tour: Ints, worker: int) -> None:
        """Construct an ant's tour. Changes: tour, words[ant]; in Ant Colony System, also pheromone and weights."""
        i, p = self.instance, trails.parameters
        edges = WeightedEdges(i.candidates, trails.pheromone, trails.nearness, trails.weights)
        decay = Decay(p.alpha, p.local_rate, trails.initial)
        construct_tour(
            i.cost,
            i.tree,
            edges,
            decay,
            p.greedy_probability,
            i.first,
            i.second,
            words,
            ant,
            tour,
            self._unvisited[worker],
        )

    def improve_and_measure(self, tour: Ints, stop: Stop) -> float:
        """Improve a tour if local search is requested, and return its cost. Changes: tour."""
        if self.local_search:
            improve_locally(self.instance, tour, stop)
        return float(tour_cost(self.instance.cost, tour))

    def instance_nodes(self, tour: Ints) -> Ints:
        """Convert a tour to nodes of the instance."""
        return tour

    def snapshot_fields(self, trails: Trails, best: Best) -> dict[str, Any]:
        """Return the pheromone and the last step for observers."""
        pheromone = pheromone_on_candidates(self.instance, trails.lists, trails.pheromone)
        return {"pheromone": pheromone, "step": trails.describe_iteration(best, *self._example_step(trails))}

    def _example_step(self, trails: Trails) -> tuple[int, tuple[NextPlace, ...]]:
        instance = self.instance
        here = int(np.flatnonzero(instance.label == 0)[0])
        near = instance.candidates[here]
        there = np.flatnonzero((near >= 0) & (instance.label[near] < instance.problem.n_clusters))
        weights = trails.weights[here, there]
        total = float(trails.weights[here][near >= 0].sum())
        if not 0.0 < total < math.inf:
            return 1, ()
        likeliest = there[np.argsort(-weights, kind="stable")[:MOST_CHOICES]]
        return 1, tuple(self._next_place(trails, here, int(c), total) for c in likeliest)

    def _next_place(self, trails: Trails, here: int, c: int, total: float) -> NextPlace:
        cost = float(self.instance.lengths[here, c])
        return NextPlace(
            place=int(self.instance.label[self.instance.candidates[here, c]]) + 1,
            cost=cost,
            pheromone=float(trails.pheromone[here, c]),
            attraction=1.0 / (cost + trails.offset),
            probability=float(trails.weights[here, c]) / total,
        )


def run_local_search(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Improve the nearest-neighbour tour with the local search that the ants use."""
    offer_first_tour(instance, True, run.stop, run.best)
    return SearchResult(run.best.tour)
