"""Orders of clusters with precedence.

Ants construct them, fireflies invert parts of them, and nodes are chosen for them.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import NONE, inner_kernel, kernel
from leafcut.kernels.cluster_paths import Clusters, choose_nodes_between, closed_path_length
from leafcut.kernels.pheromone import decay_edge
from leafcut.kernels.random import random_below, random_uniform


@inner_kernel
def choose_next_cluster(
    weights: NDArray, nearness: NDArray, missing: NDArray, last: int, greedy_probability: float, states: NDArray, k: int
) -> int:
    """Choose the next cluster for an ant. Changes: states[k].

    With probability `greedy_probability`, the ant takes the cluster with the largest weight. Otherwise, it takes a
    random cluster with a probability proportional to the weight. If no step has pheromone, only the nearness counts.
    Symbols: weights, nearness float64[m, m]; missing int32[m] is 0 for clusters that may come next; last is the current
    cluster, or -1.
    Source: Dorigo and Stützle 2004, equations 3.2 and 3.10.
    """
    m, best, total, n_available = len(missing), -1, 0.0, 0
    for c in range(m):
        if missing[c] == 0:
            n_available += 1
            if last >= 0:
                total += weights[last, c]
                if best < 0 or weights[last, c] > weights[last, best]:
                    best = c
    if last >= 0 and n_available > 0 and total == 0.0:
        weights = nearness
        for c in range(m):
            if missing[c] == 0:
                total += weights[last, c]
                if weights[last, c] > weights[last, best]:
                    best = c
    if last >= 0 and 0.0 < total < math.inf:
        if random_uniform(states, k) < greedy_probability:
            return best
        remaining = random_uniform(states, k) * total
        for c in range(m):
            if missing[c] == 0:
                remaining -= weights[last, c]
                if remaining <= 0.0:
                    return c
        return best
    rank = random_below(states, k, n_available)
    for c in range(m):
        if missing[c] == 0:
            rank -= 1
            if rank < 0:
                return c
    return best


@kernel
def construct_order(
    layers: Clusters,
    pheromone: NDArray,
    nearness: NDArray,
    weights: NDArray,
    pheromone_weight: float,
    greedy_probability: float,
    local_rate: float,
    initial: float,
    states: NDArray,
    k: int,
    missing: NDArray,
    order: NDArray,
) -> None:
    """Construct an order of clusters as an ant does.

    If `local_rate` > 0, the trail of each step that the ant takes decays towards `initial`.
    Symbols: pheromone, nearness (η^β), weights (τ^α·η^β) float64[m, m]; missing int32[m] is a work array.
    Changes: order int32[m], missing, states[k]; pheromone and weights if `local_rate` > 0.
    Source: Dorigo and Stützle 2004, equations 3.2, 3.10 and 3.12.
    Differs: a cluster can only be chosen when all its predecessors are already in the order.
    """
    m, last = len(order), NONE
    for c in range(m):
        missing[c] = layers.before_begin[c + 1] - layers.before_begin[c]
    for at in range(m):
        c = (
            m - 1
            if at == 0 and layers.anchored[0] == 1
            else choose_next_cluster(weights, nearness, missing, last, greedy_probability, states, k)
        )
        order[at] = c
        missing[c] = -1
        for e in range(layers.after_begin[c], layers.after_begin[c + 1]):
            missing[layers.after[e]] -= 1
        if local_rate > 0.0 and last >= 0:
            decay_edge(pheromone, nearness, weights, pheromone_weight, local_rate, initial, last, c)
        last = c


@kernel
def choose_nodes_of_order(
    layers: Clusters, order: NDArray, path: NDArray, trial: NDArray, sums: NDArray, links: NDArray
) -> float:
    """Choose the best node for each cluster of an order, int32[m], and return the length of the closed path.

    The result is optimal: the algorithm cuts the path at its smallest cluster and tries all nodes of this cluster.
    Changes: path, trial int32[m]; for sums and links, see `choose_nodes_between`.
    """
    m, cut = len(order), 0
    for at in range(m):
        c, d = order[at], order[cut]
        if layers.begin[c + 1] - layers.begin[c] < layers.begin[d + 1] - layers.begin[d]:
            cut = at
    best = math.inf
    for v in range(layers.begin[order[cut]], layers.begin[order[cut] + 1]):
        for at in range(m):
            trial[at] = layers.begin[order[at]]
        trial[cut] = v
        if m > 1:
            first = cut + 1 if cut + 1 < m else 0
            choose_nodes_between(layers, trial, first, first + m - 2, sums, links)
        length = closed_path_length(layers, trial)
        if length < best:
            best = length
            for at in range(m):
                path[at] = trial[at]
    return best


@inner_kernel
def may_invert(layers: Clusters, order: NDArray, place: NDArray, first: int, last: int) -> bool:
    """Check whether positions first … last of an order contain no precedence pair and may therefore be inverted."""
    for at in range(first, last):
        c = order[at]
        for e in range(layers.after_begin[c], layers.after_begin[c + 1]):
            if place[layers.after[e]] <= last:
                return False
    return True


@kernel
def invert_runs(
    layers: Clusters, order: NDArray, place: NDArray, runs: int, longest: int, states: NDArray, k: int
) -> None:
    """Invert `runs` runs of 2 … `longest` clusters around a random position, wherever precedence allows it.

    A run does not wrap around the end of the order. If the first cluster is fixed, no run contains it.
    Changes: order, place int32[m], states[k].
    """
    m, fixed = len(order), int(layers.anchored[0])
    near = fixed + random_below(states, k, m - fixed)
    for _ in range(runs):
        first = near + random_below(states, k, longest)
        if first > m - 2:
            first = fixed + random_below(states, k, m - 1 - fixed)
        last = min(m - 1, first + 1 + random_below(states, k, longest - 1))
        if not may_invert(layers, order, place, first, last):
            continue
        while first < last:
            order[first], order[last] = order[last], order[first]
            place[order[first]], place[order[last]] = first, last
            first, last = first + 1, last - 1


@kernel
def count_different_steps(order: NDArray, place: NDArray) -> int:
    """Count the steps of an order, int32[m], that are missing in a second order.

    `place`, int32[m], contains the position of each cluster in the second order.
    """
    count = 0
    for index in range(1, len(order)):
        if place[order[index]] != place[order[index - 1]] + 1:
            count += 1
    return count
