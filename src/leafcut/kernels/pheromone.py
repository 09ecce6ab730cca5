"""Pheromone on candidate edges: evaporate it, deposit it, and compute the weights by which ants choose an edge.

`pheromone[i, c]` belongs to the edge from node i to its c-th candidate. If an edge is in the lists of both its nodes,
it has two equal entries. Memory grows with n·k instead of n².
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost


@kernel
def fill_nearness(cost: CostModel, candidates: NDArray, weight: float, offset: float, nearness: NDArray) -> None:
    """Compute η^β = (1 / (cost + offset))^β for each candidate edge. The offset keeps the value finite at distance 0.

    Changes: nearness float64[n, k].
    """
    for i in range(candidates.shape[0]):
        for c in range(candidates.shape[1]):
            j = candidates[i, c]
            nearness[i, c] = (1.0 / (node_travel_cost(cost, i, j) + offset)) ** weight if j >= 0 else 0.0


@kernel
def fill_weights(pheromone: NDArray, nearness: NDArray, pheromone_weight: float, weights: NDArray) -> None:
    """Compute weights = τ^α · η^β. Changes: weights float64[n, k]."""
    for i in range(pheromone.shape[0]):
        for c in range(pheromone.shape[1]):
            trail = pheromone[i, c]
            weights[i, c] = (trail if pheromone_weight == 1.0 else trail**pheromone_weight) * nearness[i, c]


@kernel
def evaporate(pheromone: NDArray, rate: float, lowest: float) -> None:
    """Reduce each trail by the fraction `rate`, but not below `lowest`. Changes: pheromone.

    Source: Dorigo and Stützle 2004, equations 3.3 and 3.5 (lower trail limit of MAX–MIN: section 3.3.4).
    """
    for i in range(pheromone.shape[0]):
        for c in range(pheromone.shape[1]):
            pheromone[i, c] = max(lowest, (1.0 - rate) * pheromone[i, c])


@kernel
def deposit(
    candidates: NDArray, tour: NDArray, kept: float, amount: float, highest: float, one_way: bool, pheromone: NDArray
) -> None:
    """Change the pheromone on each edge of a closed tour to τ ← kept·τ + amount, but not above `highest`.

    If `one_way` is set, only edges in the direction of the tour change.
    Changes: pheromone.
    Source: Dorigo and Stützle 2004, equation 3.4 (kept = 1) and 3.11 (Ant Colony System: kept = 1 − ρ); upper trail
    limit of MAX–MIN: section 3.3.4.
    """
    for step in range(len(tour)):
        a, b = tour[step - 1], tour[step]
        for c in range(candidates.shape[1]):
            if candidates[a, c] == b:
                pheromone[a, c] = min(highest, kept * pheromone[a, c] + amount)
            if candidates[b, c] == a and not one_way:
                pheromone[b, c] = min(highest, kept * pheromone[b, c] + amount)


@inner_kernel
def decay_edge(
    pheromone: NDArray,
    nearness: NDArray,
    weights: NDArray,
    pheromone_weight: float,
    rate: float,
    initial: float,
    i: int,
    c: int,
) -> None:
    """Let the pheromone on an edge decay towards `initial`, τ ← (1 − ξ)τ + ξτ0, and update the weight of the edge.

    Changes: pheromone, weights.
    Source: Dorigo and Stützle 2004, equation 3.12 (local update of Ant Colony System).
    """
    trail = (1.0 - rate) * pheromone[i, c] + rate * initial
    pheromone[i, c] = trail
    weights[i, c] = trail**pheromone_weight * nearness[i, c]


@kernel
def branching_factor(candidates: NDArray, pheromone: NDArray, share: float) -> float:
    """Compute the mean number of edges per node whose trail τ is at least τ_min + λ·(τ_max − τ_min).

    τ_min and τ_max are the node's smallest and largest trail, and λ is `share`. As the ants converge, the factor falls
    from the length of the candidate lists to 2. Source: Dorigo and Stützle 2004, section 3.3.4 (mean λ-branching
    factor; λ = 0.05 there). Differs: only edges in the candidate lists count. An edge from a node to itself is ignored.
    """
    total, nodes = 0, 0
    for i in range(candidates.shape[0]):
        low, high = math.inf, -math.inf
        for c in range(candidates.shape[1]):
            if candidates[i, c] >= 0 and candidates[i, c] != i:
                low, high = min(low, pheromone[i, c]), max(high, pheromone[i, c])
        if low == math.inf:
            continue
        threshold = low + share * (high - low)
        nodes += 1
        for c in range(candidates.shape[1]):
            if candidates[i, c] >= 0 and candidates[i, c] != i and pheromone[i, c] >= threshold:
                total += 1
    return total / nodes if nodes else 1.0
