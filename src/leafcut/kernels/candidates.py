"""Candidate lists: for each node, a few neighbours that are likely to be next to it in a good tour."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.cost import CostModel, node_travel_cost
from leafcut.kernels.neighbours import MOST_TWINS, REST, TWINS, Nearby, Tree, find_nearby


@inner_kernel
def _drop_farthest_in_fullest_quadrants(points: NDArray, distances: NDArray, per_quadrant: int) -> None:
    """Remove the point farthest from the centre from the fullest quadrants. Changes: points."""
    for c in range(per_quadrant - 1, -1, -1):
        worst = -1
        for quadrant in range(4):
            if points[quadrant, c] >= 0 and (worst < 0 or distances[quadrant, c] > distances[worst, c]):
                worst = quadrant
        if worst >= 0:
            points[worst, c] = -1
            return


@inner_kernel
def _choose_candidates(points: NDArray, distances: NDArray, per_quadrant: int, k: int, chosen: NDArray) -> int:
    """Choose up to k points, and return their number.

    Coincident points come first, followed by the nearest points in each quadrant, and then by the nearest remaining
    points.
    Changes: points, chosen int32[≥k + 4·per_quadrant].
    """
    count = 0
    while count < min(k, MOST_TWINS) and points[TWINS, count] >= 0:
        chosen[count] = points[TWINS, count]
        count += 1
    size = count
    for quadrant in range(4):
        for c in range(per_quadrant):
            if points[quadrant, c] >= 0:
                size += 1
    for _ in range(k, size):
        _drop_farthest_in_fullest_quadrants(points, distances, per_quadrant)
    for c in range(per_quadrant):
        for quadrant in range(4):
            if points[quadrant, c] >= 0:
                chosen[count] = points[quadrant, c]
                count += 1
    c = 0
    while count < k and points[REST, c] >= 0:
        chosen[count] = points[REST, c]
        count += 1
        c += 1
    return count


@inner_kernel
def _insert_candidate(candidates: NDArray, lengths: NDArray, count: int, j: int, length: float) -> None:
    """Insert a candidate into a sorted list that has `count` candidates. Changes: candidates, lengths."""
    slot = count
    while slot > 0 and lengths[slot - 1] > length:
        lengths[slot], candidates[slot] = lengths[slot - 1], candidates[slot - 1]
        slot -= 1
    lengths[slot], candidates[slot] = length, j


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
    """Fill the candidate lists of points first … last - 1 in the tree.

    A list contains coincident points, the nearest points in each quadrant, and the nearest points overall. Drill
    patterns are clustered. Lists of only the nearest neighbours would never leave a cluster, but lists by quadrant do.
    Changes: rows first … last - 1 of candidates int32[n, k] (sorted by cost; -1 if fewer points exist) and of lengths
    float64[n, k] (their costs, or infinity); nearby.
    """
    k = candidates.shape[1]
    for i in range(first, last):
        find_nearby(tree, i, per_quadrant, k, nearby)
        count = _choose_candidates(nearby.found, nearby.near, per_quadrant, k, nearby.chosen)
        for f in range(count):
            _insert_candidate(
                candidates[i], lengths[i], f, nearby.chosen[f], node_travel_cost(cost, i, nearby.chosen[f])
            )
        for c in range(count, k):
            candidates[i, c], lengths[i, c] = -1, math.inf


@kernel
def fill_directed_candidates(
    cost: CostModel,
    tree: Tree,
    goal: NDArray,
    query: NDArray,
    per_quadrant: int,
    candidates: NDArray,
    lengths: NDArray,
    nearby: Nearby,
) -> None:
    """For each query, list the nearest goals in each quadrant and the nearest goals overall.

    The lists contain point numbers of the tree. A query's own goal is left out. Symbols: tree contains the m goals and
    has space for one more point after them; goal int32[m] and query int32[n] are rows of `CostModel.xy`. The cost of
    travel between a query and a goal is symmetric.
    Changes: candidates int32[n, k] (sorted by cost; -1 if fewer goals exist) and lengths float64[n, k]; the last point
    of the tree; nearby.
    """
    m, k = len(goal), candidates.shape[1]
    for i in range(len(query)):
        tree.x[m], tree.y[m] = cost.xy[query[i], 0], cost.xy[query[i], 1]
        tree.leaf_of[m] = 0  # the search starts at the root and covers all points
        nearby.limit[:] = math.inf
        find_nearby(tree, m, per_quadrant, k, nearby)
        count = _choose_candidates(nearby.found, nearby.near, per_quadrant, k, nearby.chosen)
        for f in range(count):
            j = nearby.chosen[f]
            _insert_candidate(candidates[i], lengths[i], f, j, node_travel_cost(cost, query[i], goal[j]))
        for c in range(count, k):
            candidates[i, c], lengths[i, c] = -1, math.inf


@inner_kernel
def cheapest_unvisited(cost: CostModel, visited: NDArray, i: int) -> int:
    """Scan all nodes and return the unvisited node that is cheapest to reach from node i, or -1 if all are visited."""
    best, best_d = -1, math.inf
    for j in range(len(visited)):
        if visited[j] == 0:
            d = node_travel_cost(cost, i, j)
            if d < best_d:
                best, best_d = j, d
    return best
