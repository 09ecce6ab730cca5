"""Which node of every cluster: exact, by dynamic programming along a given order of the clusters.

Source: M. Fischetti, J. J. Salazar González and P. Toth, Operations Research 45 (1997), section 3 (cluster optimisation
by shortest path through the layered network of an order).
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from leafcut.model.problem import RoutingProblem
from leafcut.solve.instance import path_cost


def choose_nodes(problem: RoutingProblem, order: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return int32[clusters]: for the given order of clusters, the nodes that make the path cheapest."""
    if problem.n_nodes == problem.n_clusters:
        return np.argsort(problem.cluster)[order].astype(np.int32)
    members: list[list[int]] = [[] for _ in range(problem.n_clusters)]
    for node, cluster in enumerate(problem.cluster):
        members[int(cluster)].append(node)
    layers = [members[int(c)] for c in order]
    if not problem.closed:
        return _shortest(problem, layers)
    # A closed tour: one path per node of the first cluster, closed by hand.
    tours = [_shortest(problem, [[node], *layers[1:]], back_to=node) for node in layers[0]]
    return min(tours, key=lambda nodes: path_cost(problem, nodes))


def _shortest(problem: RoutingProblem, layers: list[list[int]], back_to: int | None = None) -> NDArray[np.int32]:
    arrival = {node: _from_start(problem, node) for node in layers[0]}
    came_from: list[dict[int, int]] = []
    for before, layer in itertools.pairwise(layers):
        links = {node: min(before, key=lambda b: arrival[b] + _leg(problem, b, node)) for node in layer}
        arrival = {node: arrival[b] + _leg(problem, b, node) for node, b in links.items()}
        came_from.append(links)
    last = min(arrival, key=lambda node: arrival[node] + _to_end(problem, node, back_to))
    path = [last]
    for links in reversed(came_from):
        path.append(links[path[-1]])
    return np.array(path[::-1], dtype=np.int32)


def _leg(problem: RoutingProblem, a: int, b: int) -> float:
    return _pair(problem, problem.exit[a], problem.entry[b], a, b) + float(problem.service[b])


def _from_start(problem: RoutingProblem, node: int) -> float:
    service = float(problem.service[node])
    if problem.start is None or problem.closed:
        return service
    return service + _pair(problem, np.array(problem.start), problem.entry[node], node, node)


def _to_end(problem: RoutingProblem, node: int, back_to: int | None) -> float:
    if back_to is not None:
        return _pair(problem, problem.exit[node], problem.entry[back_to], node, back_to)
    if problem.end is None or problem.closed:
        return 0.0
    return _pair(problem, problem.exit[node], np.array(problem.end), node, node)


def _pair(problem: RoutingProblem, a: NDArray[np.float64], b: NDArray[np.float64], i: int, j: int) -> float:
    """Return the travel cost from place a to place b, or between nodes i and j where costs are explicit."""
    if problem.metric.matrix is not None:
        return float(problem.metric.matrix[i, j])
    step = RoutingProblem.of_points([a, b], problem.metric)
    return path_cost(step, np.array([0, 1], dtype=np.int32))
