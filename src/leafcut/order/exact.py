"""Compute exact solutions: the best nodes for a given cluster order, or the best order of a few clusters.

Sources: M. Fischetti, J. J. Salazar González and P. Toth, Operations Research 45 (1997), section 3, for choosing the
nodes (a shortest path through the layered network of an order). M. Held and R. M. Karp, Journal of the SIAM 10 (1962),
section 2, for choosing the order. Differs: a state consists of a set of clusters and the last node. The method
therefore also handles several nodes per cluster, asymmetric costs, and precedence.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Ints
from leafcut.model.problem import RoutingProblem
from leafcut.order.instance import MoveCosts, nodes_by_cluster, path_cost
from leafcut.order.precedence import satisfies_pairs

#: Up to this many clusters, we compare all orders, because local search needs at least five nodes.
TRY_ALL = 4

#: Maximum number of states (a set of clusters and a node, 8 bytes each) and of clusters.
MOST_STATES, MOST_CLUSTERS = 5_000_000, 18

#: Maximum number of times the algorithm extends a state by a move, counting all possible first nodes of a closed path.
#: At this limit, it takes about a second.
MOST_SUMS = 2e8


def try_all_orders(problem: RoutingProblem, pairs: Ints) -> Ints:
    """Find the cheapest path through at most `TRY_ALL` clusters that satisfies the precedence int32[k, 2]."""
    orders = (np.array(o, dtype=np.int32) for o in itertools.permutations(range(problem.n_clusters)))
    paths = (choose_nodes_for_order(problem, order) for order in orders if satisfies_pairs(pairs, order))
    return min(paths, key=lambda nodes: path_cost(problem, nodes))


def choose_nodes_for_order(problem: RoutingProblem, order: NDArray[np.int32]) -> Ints:
    """Choose the nodes, int32[clusters], of the cheapest path that visits the clusters in the given order."""
    nodes, begin = nodes_by_cluster(problem)
    if problem.n_nodes == problem.n_clusters:
        return nodes[order]
    layers = [nodes[begin[c] : begin[c + 1]] for c in order]
    # For a closed tour, each node of the first layer is tried. The smallest cluster is therefore the first layer.
    first = int(np.argmin([len(layer) for layer in layers])) if problem.closed else 0
    layers = layers[first:] + layers[:first]
    return np.roll(_cheapest_path_through_layers(problem, layers), first)


def _cheapest_path_through_layers(problem: RoutingProblem, layers: list[Ints]) -> Ints:
    """Find the cheapest path that visits one node of each layer, int32[layers]."""
    moves, first, last = MoveCosts(problem), layers[0], layers[-1]
    arrival = problem.service[first].astype(np.float64)

    def cheapest_from(arrival: Floats, home: Floats) -> tuple[float, Ints]:
        """Return the cost of the cheapest path and its nodes.

        `arrival` is the cost of reaching and serving each first node.
        """
        came_from = []
        for before, layer in itertools.pairwise(layers):
            total = arrival[:, None] + moves.between(before, layer)
            came_from.append(np.argmin(total, axis=0))
            arrival = total.min(axis=0) + problem.service[layer]
        total = arrival + home
        at = [int(np.argmin(total))]
        for links in reversed(came_from):
            at.append(int(links[at[-1]]))
        nodes = [layer[i] for layer, i in zip(layers, reversed(at), strict=True)]
        return float(total.min()), np.array(nodes, dtype=np.int32)

    if not problem.closed:
        return cheapest_from(arrival + moves.from_start(first), moves.to_end(last))[1]
    paths = [
        cheapest_from(np.where(first == node, arrival, np.inf), moves.between(last, node[None])[:, 0]) for node in first
    ]
    return min(paths, key=lambda path: path[0])[1]


def is_exactly_solvable(problem: RoutingProblem) -> bool:
    """Check whether an exact solution takes at most about a second."""
    m, n = problem.n_clusters, problem.n_nodes
    if not 0 < m <= MOST_CLUSTERS:
        return False
    firsts = n if problem.closed else 1
    return n << m <= MOST_STATES and firsts * n * n << m <= MOST_SUMS


def solve_exactly(problem: RoutingProblem, pairs: Ints) -> Ints:
    """Find the cheapest path under the acyclic precedence int32[k, 2] and return its nodes, int32[clusters].

    The problem must satisfy `is_exactly_solvable`.
    """
    moves, node = MoveCosts(problem), np.arange(problem.n_nodes, dtype=np.int32)
    between = moves.between(node, node)
    if not problem.closed:
        return _solve_by_dynamic_programming(
            problem, pairs, between, problem.service + moves.from_start(node), moves.to_end(node)
        )[1]
    # Without precedence, a closed path starts with cluster 0. Otherwise all clusters without predecessors are tried.
    firsts = np.setdiff1d(np.arange(problem.n_clusters), pairs[:, 1]) if len(pairs) else np.array([0])
    paths = []
    for first in np.flatnonzero(np.isin(problem.cluster, firsts)):
        begun = np.where(node == first, problem.service, np.inf)
        paths.append(_solve_by_dynamic_programming(problem, pairs, between, begun, between[:, first]))
    return min(paths, key=lambda path: path[0])[1]


def _solve_by_dynamic_programming(
    problem: RoutingProblem, pairs: Ints, between: Floats, begun: Floats, home: Floats
) -> tuple[float, Ints]:
    """Find the cheapest path by dynamic programming over sets of clusters and last nodes.

    Parameters
    ----------
    between
        Cost from each node's exit to each other node's entry, float64[nodes, nodes].
    begun
        Cost of starting the path with each node, including the node itself, float64[nodes].
    home
        Cost from each last node to the end, float64[nodes].

    Returns
    -------
    tuple[float, Ints]
        The cost of the path and its nodes.
    """
    m, cluster = problem.n_clusters, problem.cluster
    needs = np.zeros(m, dtype=np.int64)  # bit mask of the predecessors of each cluster
    np.bitwise_or.at(needs, pairs[:, 1], np.int64(1) << pairs[:, 0].astype(np.int64))
    sets = np.arange(1 << m, dtype=np.int64)
    size = sum((sets >> c & 1 for c in range(m)), np.zeros(len(sets), dtype=np.int64))
    members = [np.flatnonzero(cluster == c) for c in range(m)]
    spent = np.full((1 << m, problem.n_nodes), np.inf)
    for c in np.flatnonzero(needs == 0).tolist():
        spent[1 << c, members[c]] = begun[members[c]]
    for k in range(1, m):
        level = sets[size == k]
        for c in range(m):
            done = level[(level >> c & 1 == 0) & (level & needs[c] == needs[c])]
            for node in members[c]:
                least = (spent[done] + between[:, node]).min(axis=1)
                spent[done | 1 << c, node] = least + problem.service[node]
    left = (1 << m) - 1
    total = spent[left] + home
    nodes = [int(np.argmin(total))]
    while left := left & ~(1 << int(cluster[nodes[-1]])):
        nodes.append(int(np.argmin(spent[left] + between[:, nodes[-1]])))
    return float(total.min()), np.array(nodes[::-1], dtype=np.int32)
