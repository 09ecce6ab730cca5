"""Improve a path by simulated annealing.

Each step removes a few clusters and inserts each of them where it adds the least cost. Dynamic programming then picks
the nodes. Because every step looks at the whole path, this method works best for paths with few clusters.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.annealing import BEST, AntPath, anneal
from leafcut.kernels.cluster_paths import Clusters
from leafcut.order.directed import DirectedInstance
from leafcut.order.instance import FEW_CLUSTERS, FEW_NODES, costs_of_edges
from leafcut.order.precedence import compressed_rows, transitive_closure

#: Limits how much a step may lengthen the path, as a multiple of the mean move. HOT holds the values at the start,
#: which are used in turn. COLD is the value at the end.
HOT, COLD = (3.0, 1.0), 0.02

#: A step may remove a cluster together with some of this many nearest clusters.
NEAR = 40

#: The search checks the clock after this many steps.
STEPS = 200


def is_small_enough_to_anneal(instance: DirectedInstance) -> bool:
    """Check whether a problem is small enough for annealing."""
    return instance.n <= FEW_CLUSTERS and len(instance.rules.way) <= FEW_NODES


def build_clusters(instance: DirectedInstance) -> Clusters:
    """Build the clusters of an instance, including the cost of every move between their nodes.

    The anchor becomes the last cluster, and its only node becomes the last node.
    """
    rules, n = instance.rules, instance.n
    begin, enter = rules.way_begin.copy(), rules.way
    leave = enter + np.int32(rules.beyond[0])
    if instance.anchored:
        begin[n] += 1
        enter, leave = np.append(enter, instance.enter[n - 1]), np.append(leave, instance.leave[n - 1])
    owner = np.repeat(np.arange(n, dtype=np.int32), np.diff(begin))
    table, least = np.empty((len(enter), len(enter))), np.empty((n, n))
    for c, (first, last) in enumerate(pairwise(begin.tolist())):
        travel = costs_of_edges(instance.cost, np.repeat(leave[first:last], len(enter)), np.tile(enter, last - first))
        table[first:last] = travel.reshape(last - first, -1) + rules.service[enter]
        least[c] = np.minimum.reduceat(table[first:last].min(axis=0), begin[:-1])
    np.fill_diagonal(least, math.inf)
    pairs = np.argwhere(transitive_closure(instance.pairs, n)).astype(np.int32)
    near = np.argsort(np.minimum(least, least.T), axis=1, kind="stable")[:, : min(n - 1, NEAR)]
    return Clusters(
        begin,
        owner,
        table,
        np.ascontiguousarray(table.T),
        least,
        np.ascontiguousarray(least.T),
        np.ascontiguousarray(near, dtype=np.int32),
        *compressed_rows(pairs, n),
        *compressed_rows(pairs[:, ::-1], n),
        np.array([instance.anchored], dtype=np.int64),
    )


class PathAnnealing:
    """Simulated annealing of a path, with the buffers it needs."""

    def __init__(self, instance: DirectedInstance, words: NDArray[np.uint64], layers: Clusters | None = None) -> None:
        """Allocate the buffers.

        Parameters
        ----------
        words
            Random state, uint64[1].
        layers
            The clusters, if they have already been built.
        """
        self.instance, self.words, self.layers = instance, words, layers or build_clusters(instance)
        self.turn = 0
        m, widest = instance.n, int(np.diff(self.layers.begin).max())
        path, trial, best, place, out = (np.zeros(m, dtype=np.int32) for _ in range(5))
        self.walk = AntPath(
            path,
            trial,
            best,
            place,
            out,
            np.zeros(m, dtype=np.uint8),
            np.zeros(2),
            np.zeros((2, widest)),
            np.zeros((m, widest), dtype=np.int32),
        )
        self.number = np.zeros(int(instance.rules.way.max()) + 1, dtype=np.int32)
        self.number[instance.rules.way] = np.arange(len(instance.rules.way), dtype=np.int32)

    def anneal(self, nodes: Ints, mean: float, steps: int, least: float) -> Iterator[tuple[Ints, int]]:
        """Anneal a path for a given number of steps.

        Parameters
        ----------
        mean
            Mean cost of a move.

        Yields
        ------
        tuple[Ints, int]
            The best path so far as nodes of the problem, int32[clusters], and the number of steps since the previous
            yield.
        """
        walk, instance = self.walk, self.instance
        path = self.number[nodes]
        walk.path[:] = np.concatenate([[len(self.layers.owner) - 1], path]) if instance.anchored else path
        walk.costs[:] = math.inf
        hot = HOT[self.turn % len(HOT)]
        heat, cooling = hot * mean, (COLD / hot) ** (1.0 / steps)
        self.turn += 1
        for made in range(0, steps, STEPS):
            count = min(STEPS, steps - made)
            heat = anneal(self.layers, walk, self.words, 0, heat, cooling, count, least)
            found = walk.best if walk.costs[BEST] < math.inf else walk.path
            yield instance.rules.way[found[1:] if instance.anchored else found], count
