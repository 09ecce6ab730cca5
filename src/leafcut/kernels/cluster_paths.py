"""An order of clusters with a node chosen from each cluster. `annealing` and `ordering` use this data structure.

A path is an array with one node per cluster. Because every node belongs to a known cluster, the array also determines
the order of the clusters. The array forms a ring: the first position follows the last. An open path has an additional
cluster at position 0, its anchor. Travel from the anchor costs as much as travel from the start of the path, and travel
to the anchor costs as much as travel to the end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel


class Clusters(NamedTuple):
    """Clusters of nodes and their precedence. They do not change during the search.

    The nodes of a cluster have consecutive numbers. A travel cost includes the work at the destination.

    ============ ============== =====================================================================================
    begin        int32[m + 1]   first node of each cluster; n at the end
    owner        int32[n]       cluster of each node
    table        float64[n, n]  cost of travel from u to v, plus the work at v
    back         float64[n, n]  transposed `table`
    least        float64[m, m]  minimum cost from one cluster to another
    least_back   float64[m, m]  transposed `least`
    near         int32[m, k]    other clusters, sorted by the cheapest travel in either direction
    after_begin  int32[m + 1]   direct and indirect successors of cluster c:
    after        int32[k]       after[after_begin[c] … after_begin[c + 1] - 1]
    before_begin int32[m + 1]   predecessors of cluster c, stored likewise
    before       int32[k]
    anchored     int64[1]       1 if the cluster at position 0 is fixed
    ============ ============== =====================================================================================
    """

    begin: NDArray[np.int32]
    owner: NDArray[np.int32]
    table: NDArray[np.float64]
    back: NDArray[np.float64]
    least: NDArray[np.float64]
    least_back: NDArray[np.float64]
    near: NDArray[np.int32]
    after_begin: NDArray[np.int32]
    after: NDArray[np.int32]
    before_begin: NDArray[np.int32]
    before: NDArray[np.int32]
    anchored: NDArray[np.int64]


@inner_kernel
def closed_path_length(layers: Clusters, path: NDArray) -> float:
    """Compute the length of a path, int32[m], as a ring."""
    total = 0.0
    for at in range(len(path)):
        total += layers.table[path[at - 1], path[at]]
    return total


@inner_kernel
def choose_nodes_between(layers: Clusters, path: NDArray, first: int, last: int, sums: NDArray, links: NDArray) -> None:
    """Choose the nodes at positions first … last of a path so that the path is as short as possible.

    The nodes before and after these positions stay fixed. Positions past the end of the array continue at its start.
    The algorithm is dynamic programming, layer by layer.
    Changes: path; sums float64[2, w] and links int32[m, w], where w is the maximum number of nodes in a cluster.
    Source: M. Fischetti, J. J. Salazar González and P. Toth, Operations Research 45 (1997), section 3.
    """
    m, table = len(path), layers.table
    before, c = path[first - 1], layers.owner[path[first]]
    b, count = layers.begin[c], layers.begin[c + 1] - layers.begin[c]
    for i in range(count):
        sums[0, i] = table[before, b + i]
    current = 0
    for position in range(first + 1, last + 1):
        d = layers.owner[path[position if position < m else position - m]]
        e, next_count = layers.begin[d], layers.begin[d + 1] - layers.begin[d]
        row = position - first
        for j in range(next_count):
            sums[1 - current, j] = math.inf
            links[row, j] = 0
        for i in range(count):
            base = sums[current, i]
            for j in range(next_count):
                total = base + table[b + i, e + j]
                if total < sums[1 - current, j]:
                    sums[1 - current, j], links[row, j] = total, i
        current, b, count = 1 - current, e, next_count
    successor = path[last + 1 if last + 1 < m else last + 1 - m]
    best, shortest = 0, math.inf
    for i in range(count):
        total = sums[current, i] + table[b + i, successor]
        if total < shortest:
            best, shortest = i, total
    for position in range(last, first - 1, -1):
        place = position if position < m else position - m
        path[place] = layers.begin[layers.owner[path[place]]] + best
        best = links[position - first, best]
