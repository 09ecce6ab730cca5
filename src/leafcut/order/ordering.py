"""Ants and fireflies that order clusters: trails and distances are between clusters, their nodes are chosen exactly.

An order may have a direction and keeps the precedence. Which node of every cluster is taken comes from dynamic
programming along each order; with local search the path is then improved by the exchanges of `order.sequential`.

Source: of the ants, `order.aco`; of the fireflies, `order.firefly`. Differs from there: the distance of two orders
counts steps, which have a direction; runs that precedence holds are not inverted; an iteration is one flight of every
firefly, since every inversion is followed by the choice of all nodes.
"""

from __future__ import annotations

import math
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.kernels.layers import Clusters
from leafcut.kernels.ordering import choose_all, invert_runs, lay_order, steps_apart
from leafcut.kernels.route import Route, begin_bias
from leafcut.kernels.sequential import improve_route
from leafcut.model.snapshot import Pheromone
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.aco import ColonyParameters, Trails
from leafcut.order.annealing import layers_of
from leafcut.order.ant_processes import AntProcesses, WorkerStart, starts_of
from leafcut.order.construction import random_words
from leafcut.order.directed import DirectedInstance
from leafcut.order.firefly import Flight, learn_nothing, share_done
from leafcut.order.instance import cluster_places
from leafcut.order.loop import Propose, Reinforce, search
from leafcut.order.observing import ClusterPlaces, brightness_of, on_lists
from leafcut.order.sequential import BREADTH, LEAST, LOOKS, greedy_path, route_of
from leafcut.order.statistics import Best
from leafcut.order.steps import branching_of, step_of_ants, step_of_fireflies
from leafcut.order.stop import Stop

OrdersAndCosts = tuple[Ints, NDArray[np.float64]]


class Ordering:
    """What all searches for an order need: the clusters, the exact choice of nodes, and the local search."""

    def __init__(
        self, instance: DirectedInstance, local_search: bool, stop: Stop, layers: Clusters | None = None,
        greedy: Route | None = None,
    ) -> None:  # fmt: skip
        """Begin; `layers` and the `greedy` path are those of the instance, where they are there already."""
        self.instance, self.local_search, self.stop = instance, local_search, stop
        self.layers, self.greedy = layers or layers_of(instance), greedy
        m, widest = instance.n, int(np.diff(self.layers.begin).max())
        self.path, self.trial, self.missing = (np.zeros(m, dtype=np.int32) for _ in range(3))
        self.sums, self.links = np.zeros((2, widest)), np.zeros((m, widest), dtype=np.int32)
        self.breadth = np.array(BREADTH, dtype=np.int64)

    def nearest_neighbour(self) -> tuple[Ints, float]:
        """Return the order int32[m] that always goes on to the cheapest cluster that may come next, and its length."""
        order = (greedy_path(self.instance) if self.greedy is None else self.greedy).node.copy()
        return order, self.length(order)

    def length(self, order: Ints) -> float:
        """Return the length of the best path of an order; its nodes are in `path` then."""
        return float(choose_all(self.layers, order, self.path, self.trial, self.sums, self.links))

    def nodes(self) -> Ints:
        """Return the problem's nodes int32[clusters] of the path that `length` left."""
        instance = self.instance
        chosen = self.path[1:] if instance.anchored else self.path
        enter = instance.enter.copy()
        enter[self.layers.owner[chosen]] = instance.rules.way[chosen]
        return instance.nodes(self.layers.owner[self.path], enter)

    def improve(self, order: Ints) -> float:
        """Choose the nodes of an order int32[m], improve both if that is wanted, and return the length.

        Changes: order.
        """
        length = self.length(order)
        if not self.local_search or self.instance.n < 5:
            return length
        instance = self.instance
        route = route_of(instance, *instance.path_of(self.nodes()))
        route.queue[:], route.queued[:] = route.node, 1
        route.counts[1] = instance.n
        begin_bias(instance.cost, route)
        least = LEAST * max(length, 0.0) / instance.n
        while route.counts[1] > 0 and not self.stop.now():
            improve_route(instance.cost, route, instance.rules, self.breadth, least, LOOKS)
        order[:] = route.node
        return self.length(order)


class OrderTrails(Trails):
    """Pheromone between all pairs of clusters; on both directions of a step where they cost the same."""

    def __init__(self, ordering: Ordering, parameters: ColonyParameters, c_nn: float, seed: int) -> None:
        m = ordering.instance.n
        lists = np.tile(np.arange(m, dtype=np.int32), (m, 1))
        one_way = ordering.instance.twisted or len(ordering.instance.pairs) > 0
        super().__init__(lists, parameters, c_nn, one_way, seed=seed)
        near = ordering.layers.least.copy()
        np.fill_diagonal(near, np.inf)
        self.nearness[:] = (1.0 / (near + self.offset)) ** parameters.beta
        self.weigh()


class OrderAnts:
    """Lays the orders of one iteration, one ant after another."""

    def __init__(self, ordering: Ordering, trails: OrderTrails, seed: int) -> None:
        self.ordering, self.trails, self.seed, self.stop = ordering, trails, seed, ordering.stop
        self.orders = np.zeros((trails.parameters.ants, ordering.instance.n), dtype=np.int32)

    def propose(self, iteration: int) -> OrdersAndCosts:
        """Return the orders int32[ants, m] and their lengths (inf: there was no time)."""
        return self.share(iteration, 0, 1)

    def share(self, iteration: int, worker: int, workers: int) -> OrdersAndCosts:
        """Return the orders of every `workers`-th ant, the first of them `worker`, and their lengths."""
        trails, ordering, p = self.trails, self.ordering, self.trails.parameters
        ordering.stop = self.stop
        words = random_words(self.seed, iteration, count=p.ants)
        lengths = np.full(p.ants, math.inf)
        for ant in range(worker, p.ants, workers):
            if ant > worker and self.stop.now():
                break
            lay_order(
                ordering.layers, trails.pheromone, trails.nearness, trails.weights, p.alpha, p.greedy_probability,
                p.local_rate if p.algorithm == "acs" else 0.0, trails.initial, words, ant, ordering.missing,
                self.orders[ant],
            )  # fmt: skip
            lengths[ant] = ordering.improve(self.orders[ant])
        return self.orders[worker::workers], lengths[worker::workers]


def make_order_ants(
    instance: DirectedInstance, parameters: ColonyParameters, c_nn: float, seed: int
) -> tuple[OrderTrails, OrderAnts]:
    """Return pheromone and ants for orders of clusters."""
    ordering = Ordering(instance, parameters.local_search, Stop())
    trails = OrderTrails(ordering, parameters, c_nn, seed)
    return trails, OrderAnts(ordering, trails, seed)


class OrderFireflies:
    """A swarm of orders: every one flies towards the most attractive of the shorter ones, the shortest at random."""

    def __init__(self, ordering: Ordering, flight: Flight, seed: int, first: Ints) -> None:
        self.ordering, self.flight, self.seed = ordering, flight, seed
        count, m = flight.fireflies, ordering.instance.n
        self.orders, self.lengths = np.zeros((count, m), dtype=np.int32), np.full(count, math.inf)
        self.place, self.moved = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
        self.size, self.mended, self.done = m, ordering.local_search, 0.0
        even, words = np.ones((m, m)), random_words(seed, 0, count=count)
        for f in range(count):
            lay_order(ordering.layers, even, even, even, 1.0, 0.0, 0.0, 1.0, words, f, ordering.missing, self.orders[f])
        self.orders[0] = first

    def propose(self, iteration: int) -> OrdersAndCosts:
        """Return the swarm after every firefly has flown once."""
        words = random_words(self.seed, iteration + 1, count=len(self.orders))
        if iteration == 0:
            for f in range(len(self.orders)):
                if f == 0 or not self.ordering.stop.now():
                    self.lengths[f] = self.ordering.improve(self.orders[f])
            return self.orders, self.lengths
        self.done = share_done(self.ordering.stop, iteration)
        for f in np.argsort(self.lengths, kind="stable"):
            if self.ordering.stop.now():
                break
            self._fly(int(f), words)
        return self.orders, self.lengths

    def apart(self, one: int, other: int) -> int:
        """Return how many steps of a firefly are none of another one's."""
        place = np.zeros(self.size, dtype=np.int32)
        place[self.orders[one]] = np.arange(self.size, dtype=np.int32)
        return int(steps_apart(self.orders[other], place))

    @staticmethod
    def moves_of(attraction: float) -> int:
        """Return how many moves a flight has."""
        return max(1, round(attraction))

    def _fly(self, f: int, words: NDArray[np.uint64]) -> None:
        """Make the moves of one flight: each is kept unless it makes the order longer."""
        m, flight, mended = self.size, self.flight, self.mended
        if m < 4:
            return
        self.place[self.orders[f]] = np.arange(m, dtype=np.int32)
        attraction, longest = flight.aim(
            self.lengths, f, lambda j: int(steps_apart(self.orders[j], self.place)), m, self.done, mended
        )
        for _ in range(self.moves_of(attraction)):
            self.moved[:] = self.orders[f]
            self.place[self.moved] = np.arange(m, dtype=np.int32)
            invert_runs(self.ordering.layers, self.moved, self.place, 2 if mended else 1, longest, words, f)
            length = self.ordering.improve(self.moved)
            if length <= self.lengths[f]:
                self.orders[f], self.lengths[f] = self.moved, length
            if self.ordering.stop.now():
                return


class Swarm:
    """Ants or fireflies, as the options say, from the nearest-neighbour order on.

    Attributes
    ----------
    size
        Orders of one iteration; `visits`, clusters that are visited to make them.
    patience
        Iterations without a shorter order after which the search ends; None: as the preset says.
    """

    def __init__(
        self, ordering: Ordering, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions, best: Best
    ) -> None:
        self.ordering, self.best, m = ordering, best, ordering.instance.n
        self.patience: float | None
        #: What workers in processes begin with, and the pheromone that a master has; none where there are no such.
        self.starts: list[WorkerStart] = []
        self.trails: OrderTrails | None = None
        first, length = ordering.nearest_neighbour()
        best.offer(first, length, 0)
        self.reinforce: Reinforce = learn_nothing
        if options.algorithm == "firefly":
            if firefly.variant != "leafcut":
                raise SolveError(
                    f"--variant {firefly.variant} moves closed tours of places: it keeps no precedence, direction or "
                    "choice of starts; use --variant leafcut"
                )
            flight = Flight.of(firefly, limited=options.is_limited)
            swarm = OrderFireflies(ordering, flight, options.seed, first)
            self._show(brightness=lambda: brightness_of(swarm.lengths), step=lambda: step_of_fireflies(swarm, best))
            self.propose: Propose = swarm.propose
            self.size, self.patience = flight.fireflies, flight.patience
            self.visits = m * flight.fireflies * max(1.0, flight.attractiveness)
            return
        if aco.parallel == "gpu":
            raise SolveError("--parallel gpu: paths with directions or precedence are ordered on the CPU; leave it out")
        parameters = ColonyParameters.of(options.algorithm, aco, m, options.local_search)
        trails = OrderTrails(ordering, parameters, max(length, 1e-9), options.seed)
        self._show(
            pheromone=lambda: self._pheromone(trails),
            step=lambda: step_of_ants(trails, best),
            branching=lambda: branching_of(trails),
        )
        self.propose, self.reinforce = OrderAnts(ordering, trails, options.seed).propose, trails.reinforce
        if aco.parallel != "threads":
            self.starts = starts_of(
                make_order_ants, ordering.instance, aco, parameters, trails.c_nn, options.seed, best
            )
            self.trails = None if self.starts[0].exchange else trails
        if self.starts and self.trails is None:  # workers have the pheromone, each its own
            self._show(pheromone=lambda: None, step=lambda: None, branching=lambda: None)
        self.size, self.visits, self.patience = parameters.ants, float(m * parameters.ants), None

    def _show(self, **what: Any) -> None:
        """Let those who watch see the best path, and what else there is to see by its name in `Watched`."""
        watched, places = self.best.watched, ClusterPlaces(self.ordering.instance.problem)
        if watched is None:
            return
        watched.path = lambda order: places.along_nodes(self.nodes(order))
        for name, look in what.items():
            setattr(watched, name, look)

    def _pheromone(self, trails: OrderTrails) -> Pheromone:
        problem = self.ordering.instance.problem
        m = problem.n_clusters
        owner = np.arange(m, dtype=np.int32)
        return on_lists(cluster_places(problem), owner, trails.lists[:m], trails.pheromone[:m])

    def run(self) -> int:
        """Run until `stop`; return the iterations that were finished."""
        if self.ordering.stop.reached(0, 0) or self.best.cost <= 0.0:
            return 0
        if self.starts:
            with closing(AntProcesses(self.starts, self.trails, self.ordering.stop)) as ants:
                learn = learn_nothing if self.trails is None else self.trails.reinforce
                return search(ants.propose, learn, self.ordering.stop, self.best)
        return search(self.propose, self.reinforce, self.ordering.stop, self.best)

    def clusters(self, order: Ints) -> Ints:
        """Return the problem's clusters int32[clusters] of an order int32[m], from its start to its end."""
        clusters: Ints = self.ordering.instance.problem.cluster[self.nodes(order)].astype(np.int32)
        return clusters

    def nodes(self, order: Ints) -> Ints:
        """Return the problem's nodes int32[clusters] of the best path of an order int32[m]."""
        self.ordering.length(order)
        return self.ordering.nodes()
