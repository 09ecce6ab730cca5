"""Candidate lists: the few neighbours of every node that are worth an edge."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import kernel
from leafcut.kernels.cost import CostModel, travel
from leafcut.kernels.neighbours import Tree, nearest_k


@kernel
def _insert(cost: CostModel, candidates: NDArray, i: int, have: int, j: int) -> int:
    """Put j into the sorted list of i unless it is there. Changes: candidates[i]."""
    for c in range(have):
        if candidates[i, c] == j:
            return have
    d = travel(cost, i, j)
    place = have
    while place > 0 and travel(cost, i, candidates[i, place - 1]) > d:
        candidates[i, place] = candidates[i, place - 1]
        place -= 1
    candidates[i, place] = j
    return have + 1


@kernel
def fill_candidates(
    cost: CostModel,
    tree: Tree,
    per_quadrant: int,
    candidates: NDArray,
    found: NDArray,
    near: NDArray,
    stack: NDArray,
) -> None:
    """Fill the list of every point in the tree: the nearest in each quadrant, then the nearest of all.

    Drill patterns are clustered: lists of plain nearest neighbours never leave a cluster, quadrants do.

    Changes: candidates int32[n, k] (sorted by cost; -1 where there are fewer points), found int32[k], near float64[k],
    stack int32[64].
    """
    k = candidates.shape[1]
    for i in range(len(tree.x)):
        have = 0
        for quadrant in range(4):
            count = nearest_k(tree, i, per_quadrant, quadrant, found, near, stack)
            for f in range(count):
                if have < k:
                    have = _insert(cost, candidates, i, have, found[f])
        count = nearest_k(tree, i, k, -1, found, near, stack)
        for f in range(count):
            if have < k:
                have = _insert(cost, candidates, i, have, found[f])
        for c in range(have, k):
            candidates[i, c] = -1


@kernel
def fill_candidates_by_cost(cost: CostModel, n: int, candidates: NDArray) -> None:
    """Fill the lists of nodes 0 … n-1 with the cheapest others by looking at all; for matrices, and for full lists.

    Changes: candidates int32[≥n, k] (sorted by cost).
    """
    k = candidates.shape[1]
    for i in range(n):
        have = 0
        for j in range(n):
            if j == i:
                continue
            d = travel(cost, i, j)
            if have == k and d >= travel(cost, i, candidates[i, k - 1]):
                continue
            if have < k:
                have += 1
            place = have - 1
            while place > 0 and travel(cost, i, candidates[i, place - 1]) > d:
                candidates[i, place] = candidates[i, place - 1]
                place -= 1
            candidates[i, place] = j
        for c in range(have, k):
            candidates[i, c] = -1


@kernel
def fill_lengths(cost: CostModel, candidates: NDArray, lengths: NDArray) -> None:
    """Fill the cost of every candidate edge; infinite where there is none. Changes: lengths float64[n, k]."""
    for i in range(candidates.shape[0]):
        for c in range(candidates.shape[1]):
            j = candidates[i, c]
            lengths[i, c] = travel(cost, i, j) if j >= 0 else math.inf


@kernel
def cheapest_unvisited(cost: CostModel, visited: NDArray, i: int) -> int:
    """Return the unvisited node that is cheapest to reach from i, or -1, by looking at all."""
    best, best_d = -1, math.inf
    for j in range(len(visited)):
        if visited[j] == 0:
            d = travel(cost, i, j)
            if d < best_d:
                best, best_d = j, d
    return best
