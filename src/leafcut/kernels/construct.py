"""Construct tours by nearest neighbour or with ants."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.candidates import cheapest_unvisited
from leafcut.kernels.cost import CostModel
from leafcut.kernels.neighbours import Tree, mark_point_visited, nearest_unvisited
from leafcut.kernels.pheromone import decay_edge
from leafcut.kernels.random import random_below, random_uniform


class Unvisited(NamedTuple):
    """The visited nodes of a partial tour, and work arrays for finding the nearest unvisited node.

    ======= ========= ================================================
    visited uint8[n]  1 for nodes in the tour
    alive   int32[m]  number of unvisited points below a tree node
    stack   int32[64] tree nodes to visit
    ======= ========= ================================================
    """

    visited: NDArray[np.uint8]
    alive: NDArray[np.int32]
    stack: NDArray[np.int32]


class WeightedEdges(NamedTuple):
    """Candidate edges, and how attractive they are to ants.

    ========== ============= ================================
    candidates int32[n, k]   neighbours of every node, -1 for none
    pheromone  float64[n, k] τ
    nearness   float64[n, k] η^β
    weights    float64[n, k] τ^α · η^β
    ========== ============= ================================
    """

    candidates: NDArray[np.int32]
    pheromone: NDArray[np.float64]
    nearness: NDArray[np.float64]
    weights: NDArray[np.float64]


class Decay(NamedTuple):
    """Parameters for the decay of an edge that an ant takes, τ ← (1 − ξ)τ + ξτ0, and the pheromone exponent α.

    If the rate ξ is 0, the edge does not decay.
    """

    pheromone_weight: float
    rate: float
    initial: float


@inner_kernel
def _start_tour(
    tree: Tree, first: int, second: int, states: NDArray, ant: int, tour: NDArray, unvisited: Unvisited
) -> int:
    """Write the first node or the first two nodes of a tour, and return the number of nodes written.

    -1 selects a random node. Changes: all arrays.
    """
    visited, alive = unvisited.visited, unvisited.alive
    visited[:] = 0
    for node in range(len(tree.parent)):
        alive[node] = tree.stop[node] - tree.begin[node]
    n = len(tour)
    step = 0
    if first >= 0:
        tour[0] = first
        visited[first] = 1
        step = 1
    if step == 0 or second >= 0:
        node = second if second >= 0 else random_below(states, ant, n)
        tour[step] = node
        visited[node] = 1
        step += 1
    for k in range(step):
        if tour[k] < len(tree.x):
            mark_point_visited(tree, alive, tour[k])
    return step


@inner_kernel
def _nearest_unvisited_node(cost: CostModel, tree: Tree, unvisited: Unvisited, i: int) -> int:
    """Find the nearest unvisited node in the k-d tree. If nodes have no positions, scan all nodes instead."""
    if len(tree.x) == 0:
        return cheapest_unvisited(cost, unvisited.visited, i)
    return nearest_unvisited(tree, unvisited.alive, unvisited.visited, i, unvisited.stack)


@kernel
def nearest_neighbour_tour(
    cost: CostModel,
    tree: Tree,
    first: int,
    second: int,
    states: NDArray,
    tour: NDArray,
    unvisited: Unvisited,
) -> None:
    """Build a tour that always continues with the nearest unvisited node.

    Changes: tour int32[n], unvisited, states[0].
    """
    n, visited = len(tour), unvisited.visited
    for step in range(_start_tour(tree, first, second, states, 0, tour, unvisited), n):
        last = tour[step - 1]
        # The free node has no position, so all nodes are equally near; the first is used.
        node = (
            cheapest_unvisited(cost, visited, last)
            if last == cost.free
            else _nearest_unvisited_node(cost, tree, unvisited, last)
        )
        tour[step] = node
        visited[node] = 1
        if node < len(tree.x):
            mark_point_visited(tree, unvisited.alive, node)


@inner_kernel
def choose_next_candidate(
    candidates: NDArray,
    weights: NDArray,
    nearness: NDArray,
    visited: NDArray,
    i: int,
    greedy_probability: float,
    states: NDArray,
    ant: int,
) -> int:
    """Choose an ant's next edge at node i. Return its index in the candidate list, or -1 if all candidates are visited.

    With probability q0, the ant takes the edge with the largest weight. Otherwise, it takes a random edge with a
    probability proportional to the weight. This is the pseudorandom proportional rule. With q0 = 0, it becomes the
    random proportional rule. If no edge has pheromone, only the nearness counts, as if all trails were equal.
    Changes: states[ant].
    Source: Dorigo and Stützle, Ant Colony Optimization, MIT Press 2004, equations 3.2 and 3.10.
    """
    total, best, best_weight = 0.0, -1, -1.0
    k = candidates.shape[1]
    for c in range(k):
        j = candidates[i, c]
        if j < 0:
            break
        if visited[j] == 0:
            weight = weights[i, c]
            total += weight
            if weight > best_weight:
                best, best_weight = c, weight
    if best >= 0 and total == 0.0:
        weights, best_weight = nearness, -1.0
        for c in range(k):
            j = candidates[i, c]
            if j < 0:
                break
            if visited[j] == 0:
                total += weights[i, c]
                if weights[i, c] > best_weight:
                    best, best_weight = c, weights[i, c]
    if best < 0 or (greedy_probability > 0.0 and random_uniform(states, ant) < greedy_probability):
        return best
    remaining = random_uniform(states, ant) * total
    last = best
    for c in range(k):
        j = candidates[i, c]
        if j < 0:
            break
        if visited[j] == 0:
            last = c
            remaining -= weights[i, c]
            if remaining < 0.0:
                return c
    return last


@inner_kernel
def random_unvisited(visited: NDArray, states: NDArray, ant: int) -> int:
    """Return a random unvisited node. While few nodes are visited, all unvisited nodes are about equally likely.

    Changes: states[ant].
    """
    n = len(visited)
    node = random_below(states, ant, n)
    while visited[node] == 1:
        node = (node + 1) % n
    return node


@inner_kernel
def _next_node(
    cost: CostModel,
    tree: Tree,
    edges: WeightedEdges,
    greedy_probability: float,
    states: NDArray,
    ant: int,
    unvisited: Unvisited,
    last: int,
) -> int:
    """Choose the next node for an ant at node `last`, and mark it as visited. Changes: states, unvisited."""
    visited = unvisited.visited
    if last == cost.free:
        node = random_unvisited(visited, states, ant)
    else:
        c = choose_next_candidate(
            edges.candidates, edges.weights, edges.nearness, visited, last, greedy_probability, states, ant
        )
        node = edges.candidates[last, c] if c >= 0 else _nearest_unvisited_node(cost, tree, unvisited, last)
    visited[node] = 1
    if node < len(tree.x):
        mark_point_visited(tree, unvisited.alive, node)
    return node


@inner_kernel
def _decay_edge(edges: WeightedEdges, decay: Decay, a: int, b: int) -> None:
    """If b is a candidate of a, apply the local decay to the edge from a to b. Changes: pheromone, weights."""
    for c in range(edges.candidates.shape[1]):
        if edges.candidates[a, c] == b:
            decay_edge(
                edges.pheromone,
                edges.nearness,
                edges.weights,
                decay.pheromone_weight,
                decay.rate,
                decay.initial,
                a,
                c,
            )


@kernel
def construct_tour(
    cost: CostModel,
    tree: Tree,
    edges: WeightedEdges,
    decay: Decay,
    greedy_probability: float,
    first: int,
    second: int,
    states: NDArray,
    ant: int,
    tour: NDArray,
    unvisited: Unvisited,
) -> None:
    """Let an ant build a tour, guided by pheromone and nearness.

    In Ant Colony System, the trail of each edge that the ant takes decays immediately, τ ← (1 − ξ)τ + ξτ0. The edge
    then attracts the next ant less.

    ========== =============== ==========================================================
    first      int             first node, or -1 for a random one; `second` likewise
    states     uint64[ants]    random state; this ant uses row `ant`
    ========== =============== ==========================================================

    Changes: tour int32[n], states[ant], unvisited; pheromone and weights of the edges if decay.rate > 0.
    Source: Dorigo and Stützle 2004, section 3.8.2 (candidate lists) and section 3.4.1, equations 3.10 and 3.12 (decay).
    Differs: if every candidate is visited, the ant goes to the nearest unvisited node, because all edges outside the
    candidate lists are treated as having equal pheromone. The ants of an iteration run one after another, not in
    parallel steps.
    """
    for step in range(_start_tour(tree, first, second, states, ant, tour, unvisited), len(tour)):
        last = tour[step - 1]
        node = _next_node(cost, tree, edges, greedy_probability, states, ant, unvisited, last)
        if decay.rate > 0.0:
            _decay_edge(edges, decay, last, node)
            _decay_edge(edges, decay, node, last)
        tour[step] = node
