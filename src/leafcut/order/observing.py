"""How a search shows itself to an observer: nothing of this is done unless a snapshot is taken.

Memory and time of a snapshot grow with the number of nodes and their candidates. The search is not changed by it: it
reads what is there between two steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints, Points
from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer, Pheromone
from leafcut.order.instance import Instance, cluster_places
from leafcut.order.statistics import Watched

#: Edges with less on them are not shown, nor more of them than so many, the strongest first.
FAINT, MOST_EDGES = 0.02, 60_000

#: So many ants, evenly out of all, stand for a large colony; fewer where their tours have more nodes than that in all.
MOST_ANTS, MOST_STEPS = 32, 4_000_000

#: Up to this many clusters a lower bound is sought before an observed search, to tell its gap from the beginning.
MOST_BOUNDED = 20_000


@dataclass
class ClusterPlaces:
    """Where the clusters of a problem lie."""

    problem: RoutingProblem

    @cached_property
    def of_cluster(self) -> Points:
        """The middle of each cluster, float64[clusters, 2]."""
        return cluster_places(self.problem)

    def along_clusters(self, order: Ints) -> Points:
        """Return the places along an order of clusters."""
        return self._whole(self.of_cluster[order])

    def along_nodes(self, nodes: Ints) -> Points:
        """Return the places along nodes: of each its entry, and its exit where exits lie elsewhere."""
        entry, leave = self.problem.entry[nodes], self.problem.exit[nodes]
        same = np.array_equal(entry, leave)
        return self._whole(entry if same else np.stack([entry, leave], axis=1).reshape(-1, 2))

    def _whole(self, points: Points) -> Points:
        """Return the path with its ends."""
        if self.problem.closed:
            return np.concatenate([points, points[:1]])
        ends = [None if p is None else np.array([p], dtype=np.float64) for p in (self.problem.start, self.problem.end)]
        return np.concatenate([p for p in (ends[0], points, ends[1]) if p is not None])


def watched_instance(observer: Observer | None, instance: Instance) -> Watched | None:
    """Return how a search for tours of an instance is shown."""
    places = ClusterPlaces(instance.problem)
    return None if observer is None else Watched(observer, lambda tour: places.along_clusters(instance.path(tour)))


def on_candidates(instance: Instance, lists: Ints, trails: NDArray[np.float64]) -> Pheromone:
    """Return pheromone float64[n, k] on the candidate edges int32[n, k] of an instance."""
    label = instance.label
    named = np.where(lists >= 0, label[lists], -1)
    known = label < instance.problem.n_clusters
    return on_lists(cluster_places(instance.problem), label[known], named[known], trails[known])


def on_lists(points: Points, owner: Ints, lists: Ints, trails: NDArray[np.float64]) -> Pheromone:
    """Return pheromone float64[n, k] on edges from clusters int32[n] to clusters int32[n, k] (-1 or beyond: none).

    How far ants agree on an edge is its share of all pheromone at an end: half of it where all ants go along it, since
    a path has two edges at every place. The larger share of its two ends counts.
    """
    there = (lists >= 0) & (lists < len(points)) & (lists != owner[:, None])
    amount = np.where(there, trails, 0.0)
    share = 2.0 * amount / np.maximum(amount.sum(axis=1, keepdims=True), 1e-300)
    seen = share > FAINT
    here = np.broadcast_to(owner[:, None], lists.shape)[seen]
    return _strongest(points, here, lists[seen], share[seen], np.maximum)


def of_tours(instance: Instance, tours: Ints) -> Pheromone:
    """Return tours int32[m, n] of a colony as pheromone: on an edge, the share of the ants that walk it."""
    ants, n = tours.shape
    few = max(1, min(MOST_ANTS, MOST_STEPS // n))
    chosen = tours[np.linspace(0, ants - 1, min(few, ants)).astype(np.int64)]
    named = instance.label[chosen]
    here, there = named.ravel(), np.roll(named, -1, axis=1).ravel()
    known = (here < instance.problem.n_clusters) & (there < instance.problem.n_clusters)
    share = np.full(int(known.sum()), 1.0 / len(chosen))
    return _strongest(cluster_places(instance.problem), here[known], there[known], share, np.add)


def _strongest(points: Points, here: Ints, there: Ints, share: NDArray[np.float64], join: np.ufunc) -> Pheromone:
    """Return the edges, each once, with what is on both directions of it joined; no more than `MOST_EDGES`."""
    low, high = np.minimum(here, there).astype(np.int64), np.maximum(here, there).astype(np.int64)
    key = low * len(points) + high
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    strength = join.reduceat(share[order], first) if len(first) else share[:0]
    edges = np.column_stack([low, high])[order[first]]
    kept = np.argsort(-strength, kind="stable")[:MOST_EDGES]
    return Pheromone(points, edges[kept].astype(np.int32), np.minimum(strength[kept], 1.0).astype(np.float32))


def brightness_of(lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how bright fireflies with tours of these lengths are, 1 / length; none where a length says nothing."""
    return np.where(np.isfinite(lengths) & (lengths > 0.0), 1.0 / np.where(lengths > 0.0, lengths, 1.0), 0.0)
