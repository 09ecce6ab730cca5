"""Minimum spanning tree of all nodes but one under node penalties; it proves a lower bound."""

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

#: Maximum number of pairs and boxes checked, in total and per node; reached only if lifts outweigh distances.
MOST_LOOKS, MOST_LOOKS_PER_NODE = 2e7, 2000

#: Maximum number of nodes for checking all pairs, which takes microseconds and needs no further compilation.
ALL_PAIRS = 150

#: Stack size for boxes: one more than the height of the k-d tree, which is at most about 60 for a million points.
STACK = 128

StopAsked = Callable[[], bool]


class SpanningTree(NamedTuple):
    """Edges of a spanning tree of all nodes but one, int32[2, n - 2], and their costs."""

    edges: NDArray[np.int32]
    length: Floats


def in_the_plane(cost: CostModel) -> bool:
    """Return whether the nearest point of a box gives a lower bound on the cost of an edge to any point in the box."""
    return cost.code not in (codes.GEO, codes.EXPLICIT) and cost.lift >= 0.0 and cost.per_mm >= 0.0


def edge_lengths(cost: CostModel, edges: NDArray[np.int32]) -> Floats:
    """Return the costs of the edges int32[2, e]; a tied edge costs 0."""
    length = costs_of_edges(cost, edges[0], edges[1])
    return np.where(length == codes.TIED, 0.0, length)


def all_pairs(cost: CostModel, hub: int, penalty: Floats) -> SpanningTree:
    """Return the minimum spanning tree of all nodes but the hub under finite penalties, by checking all pairs."""
    n = len(penalty)
    edges, left, near = np.zeros((2, n - 2), dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    dense_tree(cost, penalty, hub, left, np.zeros(n), near, edges[0], edges[1])
    return SpanningTree(edges, edge_lengths(cost, edges))


def smallest_tree(instance: Instance, hub: int, penalty: Floats, graph: Graph, stop: StopAsked) -> SpanningTree | None:
    """Return the minimum spanning tree of all nodes but the hub under penalties, over all pairs of nodes.

    In the plane it is built in rounds over the k-d tree, otherwise by checking all pairs. Any graph is valid; the more
    of its edges are in the tree, the faster the search. Returns None if `stop` returns True, if too many pairs would
    have to be checked, or if costs overflow.
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
    n, m = instance.n, len(instance.tree.child)
    up, leave, arrive = (np.arange(n, dtype=np.int64) for _ in range(3))
    part, found = np.arange(n, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    low, high = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
    least = _in_boxes(instance, np.minimum, penalty, hub, math.inf)
    stack = np.zeros(STACK, dtype=np.int64)
    return ForestParts(up, part, low, high, least, found, np.full(n, -math.inf), np.zeros(n), leave, arrive, stack)


def _survey(instance: Instance, hub: int, parts: ForestParts) -> None:
    """Set the range of part numbers in each box of the k-d tree. Changes: parts.low, high."""
    parts.low[:] = _in_boxes(instance, np.minimum, parts.part, hub, instance.n)
    parts.high[:] = _in_boxes(instance, np.maximum, parts.part, hub, -1)


def _in_boxes(instance: Instance, extreme: np.ufunc, values: NDArray, hub: int, none: float) -> NDArray:
    """Return the minimum or maximum node value in every box; the hub has the value `none`."""
    tree = instance.tree
    runs = np.stack([tree.begin, tree.stop], axis=1).ravel()
    values = np.append(values[: len(tree.x)], none).astype(values.dtype)
    values[min(hub, len(tree.x))] = none
    # Always contiguous, so that the kernels are compiled for one array type only.
    return np.ascontiguousarray(extreme.reduceat(values, runs)[::2])
