"""Which node of every cluster: exact, by dynamic programming along a given order of the clusters.

Source: M. Fischetti, J. J. Salazar González and P. Toth, Operations Research 45 (1997), section 3 (cluster optimisation
by shortest path through the layered network of an order).
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Ints
from leafcut.model.problem import RoutingProblem
from leafcut.order.instance import cost_model, costs_of_edges


def choose_nodes(problem: RoutingProblem, order: NDArray[np.int32]) -> Ints:
    """Return int32[clusters]: for the given order of clusters, the nodes that make the path cheapest."""
    way = np.argsort(problem.cluster, kind="stable").astype(np.int32)
    if problem.n_nodes == problem.n_clusters:
        return way[order]
    ends = np.cumsum(np.bincount(problem.cluster))
    layers = [
        way[ends[c] - count : ends[c]] for c, count in zip(order, np.bincount(problem.cluster)[order], strict=True)
    ]
    # A closed tour: one path per node of the first cluster, which is chosen to be small, closed by hand.
    first = int(np.argmin([len(layer) for layer in layers])) if problem.closed else 0
    layers = layers[first:] + layers[:first]
    return np.roll(_Layers(problem, layers).cheapest(), first)


class _Layers:
    """The network of an order: a layer of nodes per cluster, and what the ways between neighbouring layers cost."""

    def __init__(self, problem: RoutingProblem, layers: list[Ints]) -> None:
        n = problem.n_nodes
        self.problem, self.layers = problem, layers
        ends = [p if p is not None else (0.0, 0.0) for p in (problem.start, problem.end)]
        explicit = problem.metric.name == "EXPLICIT"
        self.exits = 0 if explicit else n
        self.cost = cost_model(problem.metric, np.concatenate([problem.entry, problem.exit, np.array(ends)]))
        self.start, self.end = np.array([2 * n], dtype=np.int32), np.array([2 * n + 1], dtype=np.int32)

    def cheapest(self) -> Ints:
        """Return the nodes of the cheapest path through all layers, int32[layers]."""
        first, last, problem = self.layers[0], self.layers[-1], self.problem
        arrival = problem.service[first].astype(np.float64)
        if problem.closed:
            paths = [
                self._through(np.where(first == node, arrival, np.inf), self._legs(last, node[None])) for node in first
            ]
            return min(paths, key=lambda path: path[0])[1]
        if problem.start is not None:
            arrival += self._ways(self.start, first)[0]
        home = (
            self._ways(last + np.int32(self.exits), self.end) if problem.end is not None else np.zeros((len(last), 1))
        )
        return self._through(arrival, home)[1]

    def _through(self, arrival: Floats, home: Floats) -> tuple[float, Ints]:
        """Return the cheapest path and its cost, from what it costs to have worked each node of the first layer."""
        came_from = []
        for before, layer in itertools.pairwise(self.layers):
            total = arrival[:, None] + self._legs(before, layer)
            came_from.append(np.argmin(total, axis=0))
            arrival = total.min(axis=0) + self.problem.service[layer]
        total = arrival + home[:, 0]
        at = [int(np.argmin(total))]
        for links in reversed(came_from):
            at.append(int(links[at[-1]]))
        nodes = [layer[i] for layer, i in zip(self.layers, reversed(at), strict=True)]
        return float(total.min()), np.array(nodes, dtype=np.int32)

    def _legs(self, before: Ints, layer: Ints) -> Floats:
        return self._ways(before + np.int32(self.exits), layer)

    def _ways(self, leave: Ints, arrive: Ints) -> Floats:
        costs = costs_of_edges(self.cost, np.repeat(leave, len(arrive)), np.tile(arrive, len(leave)))
        return costs.reshape(len(leave), len(arrive))
