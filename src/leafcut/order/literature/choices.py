"""The move set *choices*: ants construct orders of clusters that satisfy the precedence.

Dynamic programming picks the nodes. With local search, the exchanges in `order.path_search` improve the path.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cluster_paths import Clusters
from leafcut.kernels.ordering import choose_nodes_of_order, construct_order
from leafcut.kernels.route import Route
from leafcut.kernels.sequential import improve_route
from leafcut.order.annealing import build_clusters
from leafcut.order.directed import BREADTH, LEAST, LOOKS, DirectedInstance, create_route, greedy_path, queue_all_nodes
from leafcut.order.instance import cluster_positions
from leafcut.order.literature.pheromone import Trails
from leafcut.order.pheromone_view import pheromone_on_edges
from leafcut.order.search import Best
from leafcut.order.stop import Stop


class Choices:
    """The move set for orders of clusters, with a worker's buffers."""

    def __init__(
        self,
        instance: DirectedInstance,
        local_search: bool,
        layers: Clusters | None = None,
        greedy: Route | None = None,
    ) -> None:
        """Allocate the buffers.

        If the clusters (`layers`) or the greedy path (`greedy`) already exist, they are reused.
        """
        self.instance, self.local_search = instance, local_search
        self.layers, self.greedy = layers or build_clusters(instance), greedy
        m, widest = instance.n, int(np.diff(self.layers.begin).max())
        self.lists = np.tile(np.arange(m, dtype=np.int32), (m, 1))
        self.one_way = instance.twisted or len(instance.pairs) > 0
        self.chosen, self.trial, self.missing = (np.zeros(m, dtype=np.int32) for _ in range(3))
        self.sums, self.links = np.zeros((2, widest)), np.zeros((m, widest), dtype=np.int32)
        self.breadth = np.array(BREADTH, dtype=np.int64)

    def nearest_neighbour_order(self) -> tuple[Ints, float]:
        """Return the nearest-neighbour order, int32[m], and its length.

        The order always continues with the cheapest cluster whose predecessors have all been visited.
        """
        order = (greedy_path(self.instance) if self.greedy is None else self.greedy).node.copy()
        return order, self.length(order)

    def offer_first_solution(self, best: Best) -> float:
        """Offer the nearest-neighbour order as the first solution, and return its cost C_nn."""
        order, length = self.nearest_neighbour_order()
        best.offer(order, length, 0)
        return max(length, 1e-9)

    def fill_nearness(self, trails: Trails) -> None:
        """Compute the nearness η^β of each pair of clusters. Changes: trails.nearness."""
        near = self.layers.least.copy()
        np.fill_diagonal(near, np.inf)
        trails.nearness[:] = (1.0 / (near + trails.offset)) ** trails.parameters.beta

    def construct(self, trails: Trails, words: NDArray[np.uint64], ant: int, order: Ints, worker: int) -> None:
        """Construct an ant's order. Changes: order, words[ant]; in Ant Colony System, also pheromone and weights."""
        p = trails.parameters
        construct_order(
            self.layers,
            trails.pheromone,
            trails.nearness,
            trails.weights,
            p.alpha,
            p.greedy_probability,
            p.local_rate,
            trails.initial,
            words,
            ant,
            self.missing,
            order,
        )

    def construct_at_random(self, words: NDArray[np.uint64], number: int, order: Ints) -> None:
        """Construct a random order. Changes: order, words[number]."""
        even = np.ones((self.instance.n, self.instance.n))
        construct_order(self.layers, even, even, even, 1.0, 0.0, 0.0, 1.0, words, number, self.missing, order)

    def length(self, order: Ints) -> float:
        """Compute the length of the shortest path through the clusters in the given order.

        Store the nodes of that path.
        """
        return float(choose_nodes_of_order(self.layers, order, self.chosen, self.trial, self.sums, self.links))

    def nodes_of_last_order(self) -> Ints:
        """Return the path that `length` stored, as nodes of the problem, int32[clusters]."""
        instance = self.instance
        chosen = self.chosen[1:] if instance.anchored else self.chosen
        enter = instance.enter.copy()
        enter[self.layers.owner[chosen]] = instance.rules.way[chosen]
        return instance.nodes_from_path(self.layers.owner[self.chosen], enter)

    def improve_and_measure(self, order: Ints, stop: Stop) -> float:
        """Choose the nodes for an order of clusters, int32[m], and return the length of the path.

        If local search is requested, it improves both the order and the nodes.

        Changes: order.
        """
        length = self.length(order)
        if not self.local_search or self.instance.n < 5:
            return length
        instance = self.instance
        route = create_route(instance, *instance.path_from_nodes(self.nodes_of_last_order()))
        queue_all_nodes(instance, route)
        least = LEAST * max(length, 0.0) / instance.n
        while route.counts[1] > 0 and not stop.must_stop():
            improve_route(instance.cost, route, instance.rules, self.breadth, least, LOOKS)
        order[:] = route.node
        return self.length(order)

    def instance_nodes(self, order: Ints) -> Ints:
        """Return the nodes, int32[clusters], of the shortest path that visits the clusters in this order, int32[m]."""
        self.length(order)
        return self.nodes_of_last_order()

    def snapshot_fields(self, trails: Trails, best: Best) -> dict[str, Any]:
        """Return the pheromone and the last step for observers.

        The step has no example move, because moves are directed.
        """
        problem = self.instance.problem
        m = problem.n_clusters
        owner = np.arange(m, dtype=np.int32)
        pheromone = pheromone_on_edges(cluster_positions(problem), owner, trails.lists[:m], trails.pheromone[:m])
        return {"pheromone": pheromone, "step": trails.describe_iteration(best)}
