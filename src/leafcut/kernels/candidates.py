"""Candidate lists: the few neighbours of every node that are worth an edge."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import kernel
from leafcut.kernels.cost import CostModel, travel
from leafcut.kernels.neighbours import MOST_TWINS, REST, TWINS, Nearby, Tree, find_nearby


@kernel
def _drop_farthest(found: NDArray, near: NDArray, per_quadrant: int) -> None:
    """Drop the farthest of those points that are last of their quadrant, from the fullest. Changes: found."""
    for c in range(per_quadrant - 1, -1, -1):
        worst = -1
        for quadrant in range(4):
            if found[quadrant, c] >= 0 and (worst < 0 or near[quadrant, c] > near[worst, c]):
                worst = quadrant
        if worst >= 0:
            found[worst, c] = -1
            return


@kernel
def _choose(found: NDArray, near: NDArray, per_quadrant: int, k: int, chosen: NDArray) -> int:
    """Choose k of the points found: twins, the nearest by quadrant, the nearest of the rest; return how many there are.

    Changes: found, chosen int32[≥k + 4·per_quadrant].
    """
    have = 0
    while have < min(k, MOST_TWINS) and found[TWINS, have] >= 0:
        chosen[have] = found[TWINS, have]
        have += 1
    size = have
    for quadrant in range(4):
        for c in range(per_quadrant):
            if found[quadrant, c] >= 0:
                size += 1
    for _ in range(k, size):
        _drop_farthest(found, near, per_quadrant)
    for c in range(per_quadrant):
        for quadrant in range(4):
            if found[quadrant, c] >= 0:
                chosen[have] = found[quadrant, c]
                have += 1
    c = 0
    while have < k and found[REST, c] >= 0:
        chosen[have] = found[REST, c]
        have += 1
        c += 1
    return have


@kernel
def fill_candidates(
    cost: CostModel,
    tree: Tree,
    per_quadrant: int,
    first: int,
    last: int,
    candidates: NDArray,
    lengths: NDArray,
    nearby: Nearby,
) -> None:
    """Fill the lists of points first … last - 1 of the tree: twins, the nearest in each quadrant, the nearest of all.

    Drill patterns are clustered: lists of plain nearest neighbours never leave a cluster, quadrants do.

    Changes: rows first … last - 1 of candidates int32[n, k] (sorted by cost; -1 where there are fewer points) and of
    lengths float64[n, k] (their costs; infinite where there are none); nearby.
    """
    k = candidates.shape[1]
    for i in range(first, last):
        find_nearby(tree, i, per_quadrant, k, nearby)
        have = _choose(nearby.found, nearby.near, per_quadrant, k, nearby.chosen)
        for f in range(have):
            j = nearby.chosen[f]
            d = travel(cost, i, j)
            place = f
            while place > 0 and lengths[i, place - 1] > d:
                lengths[i, place], candidates[i, place] = lengths[i, place - 1], candidates[i, place - 1]
                place -= 1
            lengths[i, place], candidates[i, place] = d, j
        for c in range(have, k):
            candidates[i, c], lengths[i, c] = -1, math.inf


@kernel
def _sink(candidates: NDArray, lengths: NDArray, i: int, place: int, size: int) -> None:
    """Bring the entry at `place` down to where it belongs in the heap of i, the costliest on top.

    Changes: candidates[i], lengths[i].
    """
    j, d = candidates[i, place], lengths[i, place]
    while 2 * place + 1 < size:
        below = 2 * place + 1
        if below + 1 < size and (
            lengths[i, below + 1] > lengths[i, below]
            or (lengths[i, below + 1] == lengths[i, below] and candidates[i, below + 1] > candidates[i, below])
        ):
            below += 1
        if lengths[i, below] < d or (lengths[i, below] == d and candidates[i, below] < j):
            break
        lengths[i, place], candidates[i, place] = lengths[i, below], candidates[i, below]
        place = below
    lengths[i, place], candidates[i, place] = d, j


@kernel
def fill_candidates_by_cost(cost: CostModel, n: int, candidates: NDArray, lengths: NDArray) -> None:
    """Fill the lists of nodes 0 … n-1 with the cheapest others by looking at all; for matrices, and for full lists.

    Of equally cheap ones the first.

    Changes: rows 0 … n - 1 of candidates int32[≥n, k] (sorted by cost) and lengths float64[≥n, k] (their costs), as far
    as there are others.
    """
    k = candidates.shape[1]
    size = min(k, n - 1)
    for i in range(n):
        for j in range(size + 1):
            if j != i:
                place = j if j < i else j - 1
                if place < size:
                    candidates[i, place], lengths[i, place] = j, travel(cost, i, j)
        for place in range(size // 2 - 1, -1, -1):
            _sink(candidates, lengths, i, place, size)
        for j in range(size if i >= size else size + 1, n):
            d = travel(cost, i, j)
            if j != i and d < lengths[i, 0]:
                candidates[i, 0], lengths[i, 0] = j, d
                _sink(candidates, lengths, i, 0, size)
        for end in range(size - 1, 0, -1):
            candidates[i, 0], candidates[i, end] = candidates[i, end], candidates[i, 0]
            lengths[i, 0], lengths[i, end] = lengths[i, end], lengths[i, 0]
            _sink(candidates, lengths, i, 0, end)


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
