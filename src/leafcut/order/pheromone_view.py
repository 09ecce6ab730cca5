"""Convert pheromone to a form for observers. Memory and time grow with the number of nodes and candidates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints, Points
from leafcut.model.snapshot import Pheromone
from leafcut.order.instance import Instance, cluster_positions

#: Only show edges of at least this strength, and at most this many of them, strongest first.
FAINT, MOST_EDGES = 0.02, 60_000

#: Sample at most this many ants from a colony, and at most this many nodes in all their tours.
MOST_ANTS, MOST_STEPS = 32, 4_000_000


def pheromone_on_candidates(instance: Instance, lists: Ints, trails: NDArray[np.float64]) -> Pheromone:
    """Convert pheromone trails, float64[n, k], on an instance's candidate edges, int32[n, k], for observers."""
    label = instance.label
    named = np.where(lists >= 0, label[lists], -1)
    known = label < instance.problem.n_clusters
    return pheromone_on_edges(cluster_positions(instance.problem), label[known], named[known], trails[known])


def pheromone_on_edges(points: Points, owner: Ints, lists: Ints, trails: NDArray[np.float64]) -> Pheromone:
    """Convert pheromone trails, float64[n, k], on edges between clusters for observers.

    The edges lead from the clusters `owner`, int32[n], to the clusters `lists`, int32[n, k]. A negative number means
    that the entry holds no edge. For each end of an edge, we compute the edge's share of the pheromone on all edges at
    this end. The strength of the edge is twice the larger share.
    """
    there = (lists >= 0) & (lists < len(points)) & (lists != owner[:, None])
    amount = np.where(there, trails, 0.0)
    share = 2.0 * amount / np.maximum(amount.sum(axis=1, keepdims=True), 1e-300)
    seen = share > FAINT
    here = np.broadcast_to(owner[:, None], lists.shape)[seen]
    return _strongest_edges(points, here, lists[seen], share[seen], np.maximum)


def pheromone_from_tours(instance: Instance, tours: Ints) -> Pheromone:
    """Convert a colony's tours, int32[m, n], to pheromone: for each edge, the fraction of ants that use it."""
    ants, n = tours.shape
    few = max(1, min(MOST_ANTS, MOST_STEPS // n))
    chosen = tours[np.linspace(0, ants - 1, min(few, ants)).astype(np.int64)]
    named = instance.label[chosen]
    here, there = named.ravel(), np.roll(named, -1, axis=1).ravel()
    known = (here < instance.problem.n_clusters) & (there < instance.problem.n_clusters)
    share = np.full(int(known.sum()), 1.0 / len(chosen))
    return _strongest_edges(cluster_positions(instance.problem), here[known], there[known], share, np.add)


def _strongest_edges(points: Points, here: Ints, there: Ints, share: NDArray[np.float64], join: np.ufunc) -> Pheromone:
    """Return at most `MOST_EDGES` edges, strongest first. `join` combines the shares of both directions."""
    low, high = np.minimum(here, there).astype(np.int64), np.maximum(here, there).astype(np.int64)
    key = low * len(points) + high
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    strength = join.reduceat(share[order], first) if len(first) else share[:0]
    edges = np.column_stack([low, high])[order[first]]
    kept = np.argsort(-strength, kind="stable")[:MOST_EDGES]
    return Pheromone(points, edges[kept].astype(np.int32), np.minimum(strength[kept], 1.0).astype(np.float32))
