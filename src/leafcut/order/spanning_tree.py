"""The smallest spanning tree of all nodes but one, under penalties: what proves a lower bound."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.kernels import cost as codes
from leafcut.kernels.cost import CostModel
from leafcut.kernels.one_tree import Graph
from leafcut.kernels.spanning_tree import ForestParts, dense_tree, join_parts, leave_by_graph, leave_by_tree
from leafcut.order.instance import Instance, costs_of_edges

#: Most pairs and boxes that are looked at, and the same per node; only lifts that outweigh distances need so many.
MOST_LOOKS, MOST_LOOKS_PER_NODE = 2e7, 2000

#: Up to this many nodes all pairs are looked at: some ten microseconds, and nothing else has to be compiled.
ALL_PAIRS = 150

#: Room for boxes to be looked into: one more than the k-d tree is high, which is at most about 60 for a million points.
STACK = 128

StopAsked = Callable[[], bool]


class SpanningTree(NamedTuple):
    """The edges of a spanning tree of all nodes but one, int32[2, n - 2], and what they cost."""

    edges: NDArray[np.int32]
    length: Floats


def in_the_plane(cost: CostModel) -> bool:
    """Return whether an edge to a box of places cannot cost less than one to the box's nearest point."""
    return cost.code not in (codes.GEO, codes.EXPLICIT) and cost.lift >= 0.0 and cost.per_mm >= 0.0


def edge_lengths(cost: CostModel, edges: NDArray[np.int32]) -> Floats:
    """Return what the edges int32[2, e] cost; a tied edge costs nothing."""
    length = costs_of_edges(cost, edges[0], edges[1])
    return np.where(length == codes.TIED, 0.0, length)


def all_pairs(cost: CostModel, hub: int, penalty: Floats) -> SpanningTree:
    """Return the smallest spanning tree under finite penalties of all nodes but the hub, by looking at all pairs."""
    n = len(penalty)
    edges, left, near = np.zeros((2, n - 2), dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    dense_tree(cost, penalty, hub, left, np.zeros(n), near, edges[0], edges[1])
    return SpanningTree(edges, edge_lengths(cost, edges))


def smallest_tree(instance: Instance, hub: int, penalty: Floats, graph: Graph, stop: StopAsked) -> SpanningTree | None:
    """Return the smallest spanning tree under penalties of all nodes but the hub, over all pairs of them.

    By rounds over the k-d tree in the plane; elsewhere by looking at all pairs. The graph may be any; the more of its
    edges are in the tree, the less has to be looked at. None when `stop` says so, when there would be too much to look
    at, or when costs overflow.
    """
    cost, n = instance.cost, instance.n
    if not in_the_plane(cost):
        return None if stop() or not np.isfinite(penalty).all() else all_pairs(cost, hub, penalty)
    edges = np.zeros((2, n - 2), dtype=np.int32)
    parts = _parts(instance, hub, penalty)
    have, looks, most = 0, 0, int(max(MOST_LOOKS, MOST_LOOKS_PER_NODE * n))
    while have < n - 2:
        _survey(instance, hub, parts)
        leave_by_graph(graph, penalty, parts)
        looked = leave_by_tree(cost, instance.tree, penalty, hub, most - looks, parts)
        if looked < 0 or stop():
            return None
        looks += looked
        had, have = have, join_parts(hub, parts, edges[0], edges[1], have)
        if have == had:  # costs that overflowed
            return None
    return SpanningTree(edges, edge_lengths(cost, edges))


def _parts(instance: Instance, hub: int, penalty: Floats) -> ForestParts:
    """Return the nodes, each a part of its own."""
    n, m = instance.n, len(instance.tree.child)
    up, leave, arrive = (np.arange(n, dtype=np.int64) for _ in range(3))
    part, found = np.arange(n, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    low, high = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
    least = _in_boxes(instance, np.minimum, penalty, hub, math.inf)
    stack = np.zeros(STACK, dtype=np.int64)
    return ForestParts(up, part, low, high, least, found, np.full(n, -math.inf), np.zeros(n), leave, arrive, stack)


def _survey(instance: Instance, hub: int, parts: ForestParts) -> None:
    """Find which parts have nodes in the boxes of the k-d tree. Changes: parts.low, high."""
    parts.low[:] = _in_boxes(instance, np.minimum, parts.part, hub, instance.n)
    parts.high[:] = _in_boxes(instance, np.maximum, parts.part, hub, -1)


def _in_boxes(instance: Instance, extreme: np.ufunc, values: NDArray, hub: int, none: float) -> NDArray:
    """Return the least or the greatest of the values of the nodes in every box; of the hub: none."""
    tree = instance.tree
    runs = np.stack([tree.begin, tree.stop], axis=1).ravel()
    values = np.append(values[: len(tree.x)], none).astype(values.dtype)
    values[min(hub, len(tree.x))] = none
    # Contiguous also for several boxes: the kernels are then compiled for one kind of array only.
    return np.ascontiguousarray(extreme.reduceat(values, runs)[::2])
