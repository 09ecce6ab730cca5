"""Held-Karp lower bound on the cost of a tour.

Subgradient ascent on a sparse graph finds node penalties that maximize the cost of the minimum 1-tree. The minimum
1-tree over all edges under these penalties proves the bound. For few nodes, every step uses all edges.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.kernels import cost as codes
from leafcut.kernels.cost import CostModel, tour_cost
from leafcut.kernels.one_tree import SLACK, Graph, Sets, TreeScratch, climb, join_sets
from leafcut.kernels.spanning_tree import (
    ForestParts,
    dense_tree,
    find_leaving_edges_in_graph,
    find_leaving_edges_in_tree,
    join_parts,
)
from leafcut.order.instance import Instance, costs_of_edges

#: Number of steps of the ascent. On a few hundred nodes, more steps gained nothing. Clustered boards of 1,000 to 2,000
#: nodes need many steps; on larger boards, so many would take too long. A step takes about 0.2 µs per node.
FEWEST_STEPS, STEPS, STEPS_PER_NODE, NODE_STEPS = 50, 200, 0.5, 1.5e6

#: Shares of the steps after which a bound is proved. The edges of its 1-tree are then added to the graph. The first
#: proofs come early, because many steps are needed to correct the errors of a poor graph.
PROOFS = (0.01, 0.03, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0)

#: Minimum number of steps between proofs; the same per node, if a proof checks all pairs. A proof takes as long as 15
#: steps, or n / 5 steps if it checks all pairs of n nodes.
STEPS_PER_PROOF, STEPS_PER_DENSE_PROOF = 5, 0.1

#: Steps times nodes between two calls of `stop`: about 10 ms.
NODE_STEPS_PER_LOOK = 5e4

#: Number of nearest candidates of each node that become edges of the graph. More edges take time but do not improve the
#: bound, because the proofs add the missing edges.
MOST_NEAR = 6

#: Maximum number of nodes; a proof for more nodes takes too long.
MOST_NODES = 200_000

#: Maximum number of nodes for metrics without plane coordinates (GEO, EXPLICIT), where a proof checks all pairs: about
#: a second.
DENSE_LIMIT = 5000

#: Relative allowance for rounding errors of float64 sums of millions of numbers, with a wide margin.
ROUNDING = 1e-9

#: Maximum number of pairs and boxes checked, in total and per node; reached only if lifts outweigh distances.
MOST_LOOKS, MOST_LOOKS_PER_NODE = 2e7, 2000

#: Maximum number of nodes for checking all pairs, which takes microseconds and needs no further compilation.
ALL_PAIRS = 150

#: Stack size for boxes: one more than the height of the k-d tree, which is at most about 60 for a million points.
STACK = 128

StopAsked = Callable[[], bool]

_WHOLE = (codes.EUC_2D, codes.CEIL_2D, codes.ATT, codes.GEO, codes.MAX_2D, codes.MAN_2D)


class SpanningTree(NamedTuple):
    """The edges of a spanning tree of all nodes except one, int32[2, n - 2], and their costs."""

    edges: NDArray[np.int32]
    length: Floats


class Hub(NamedTuple):
    """The node of a 1-tree outside the spanning tree, its tied neighbour (-1 for none), and the costs of its edges."""

    node: int
    tied: int
    spokes: Floats


def lower_bound(instance: Instance, upper: float, *, stop: StopAsked | None = None) -> float | None:
    """Return a lower bound on the cost of any tour, or None if none can be proved in reasonable time.

    Parameters
    ----------
    upper
        Cost of a known tour, in the unit of the metric, without service times. The bound is valid for any value, but
        better for a shorter tour.
    stop
        Called every few hundredths of a second. If it returns True, the search ends with the best bound proved so far.

    Returns
    -------
    float | None
        A bound that is at most the `tour_cost` of any tour that contains the tied edge (if any). It allows for rounding
        errors, and is an integer if all costs are integers.

        None for clusters of several nodes, nodes with different entry and exit, asymmetric matrices, more than
        `MOST_NODES` nodes, or more than `DENSE_LIMIT` nodes without plane coordinates (GEO, EXPLICIT). Also None if
        sums overflow, or if lifts are so expensive that a proof would check too many edges.
    """
    problem, cost, n = instance.problem, instance.cost, instance.n
    if problem.n_nodes > problem.n_clusters or not np.array_equal(problem.entry, problem.exit):
        return None
    explicit = cost.code == codes.EXPLICIT
    if (explicit and not np.array_equal(cost.matrix, cost.matrix.T)) or n > (
        MOST_NODES if has_box_bounds(cost) else DENSE_LIMIT
    ):
        return None
    if n <= 3:
        only = float(tour_cost(cost, np.arange(n, dtype=np.int32)))
        value: float | None = _rounded_lower_bound(cost, only, abs(only))
    else:
        prove = _bound_of_small_instance if n <= ALL_PAIRS else _bound_of_large_instance
        value = prove(instance, upper, stop if stop is not None else lambda: False)
    return value if value is not None and math.isfinite(value) else None


def _bound_of_large_instance(instance: Instance, upper: float, stop: StopAsked) -> float | None:
    """Return the best bound proved during the ascent, or None if the time ran out before the first proof."""
    cost, n = instance.cost, instance.n
    hub = _choose_hub(cost, n)
    edges = _candidate_edges(instance.candidates, hub.node)
    tree = minimum_spanning_tree(instance, hub.node, np.zeros(n), _candidate_graph(cost, n, edges), stop)
    if tree is None or not np.isfinite(tree.length).all():
        return None
    proved = _one_tree_bound(cost, hub, tree, np.zeros(n))
    ascent = _Ascent(n, _merge_sets(tree, n), hub, upper, stop)
    put_off = STEPS_PER_PROOF if has_box_bounds(cost) else STEPS_PER_DENSE_PROOF * n
    for goal in (math.ceil(share * ascent.steps) for share in PROOFS):
        if goal - ascent.step < put_off and goal < ascent.steps:
            continue
        edges = np.concatenate([edges, tree.edges], axis=1)
        graph = _candidate_graph(cost, n, edges)
        penalty = ascent.climb(graph, goal)
        tree = None if stop() else minimum_spanning_tree(instance, hub.node, penalty, graph, stop)
        if tree is None:
            break
        proved = max(proved, _one_tree_bound(cost, hub, tree, penalty))
        if proved >= upper:
            break
    return proved


def _ascent_steps(n: int) -> int:
    return int(max(FEWEST_STEPS, min(STEPS + STEPS_PER_NODE * n, NODE_STEPS / n)))


def _bound_of_small_instance(instance: Instance, upper: float, stop: StopAsked) -> float | None:
    """Return the best bound of an ascent on dense arrays; None if no step was finished. Each step proves a bound."""
    cost, n = instance.cost, instance.n
    hub, steps, penalty, proved = _choose_hub(cost, n), _ascent_steps(n), np.zeros(n), None
    looked_up = _cost_matrix(cost, n)
    for step in range(steps):
        if stop() or not np.isfinite(penalty).all():
            break
        tree = dense_spanning_tree(looked_up, hub.node, penalty)
        if not np.isfinite(tree.length).all():
            return None
        if step == 0:
            sets = _dense_merge_sets(tree, n)
        value = _one_tree_bound(cost, hub, tree, penalty)
        proved = value if proved is None else max(proved, value)
        excess = np.bincount(np.append(tree.edges, _two_spokes(hub, penalty)), minlength=n) - 2.0
        excess[hub.node] = 0.0
        moves = np.einsum("si,i", sets, excess)
        product = float((moves * moves).sum())
        if not (product > 0.0 and value < upper < math.inf):
            break
        penalty += (1.0 - step / steps) ** 2 * (upper - value) / product * np.einsum("si,s", sets, moves)
    return proved


def _cost_matrix(cost: CostModel, n: int) -> CostModel:
    """Return the costs of all edges as a matrix, without tied and free edges.

    The matrix avoids repeated computation of moves with heights, which is slow.
    """
    if cost.code == codes.EXPLICIT:
        return cost
    leave, arrive = np.indices((n, n), dtype=np.int32).reshape(2, -1)
    matrix = edge_lengths(cost, np.stack([leave, arrive])).reshape(n, n)
    return cost._replace(code=codes.EXPLICIT, plain=False, matrix=matrix, zones=np.zeros((0, 4)))


def _dense_merge_sets(tree: SpanningTree, n: int) -> Floats:
    """Return the sets of `_merge_sets` as an array, float64[2n, n]: row s contains the square root of the width of set
    s at each of its nodes.
    """
    inside, formed, width = np.zeros((2 * n, n)), np.zeros(2 * n), np.zeros(2 * n)
    inside[:n] = np.eye(n)
    part_of = np.arange(n)
    for new, e in enumerate(np.argsort(tree.length, kind="stable").tolist(), n):
        for part in part_of[tree.edges[:, e]].tolist():
            room = float(tree.length[e]) - formed[part]
            width[part] = max(0.0, room, SLACK * float(tree.length[e]) / inside[part].sum())
            inside[new] += inside[part]
        formed[new] = tree.length[e]
        part_of[inside[new] > 0.0] = new
    return inside * np.sqrt(width)[:, None]


def _rounded_lower_bound(cost: CostModel, value: float, size: float) -> float:
    """Return `value` minus the possible rounding error of sums of magnitude `size`.

    The result is rounded up if all costs are integers.
    """
    value -= ROUNDING * size
    if cost.code == codes.EXPLICIT:
        whole = bool(np.array_equal(cost.matrix, np.rint(cost.matrix)))
    else:
        whole = cost.code in _WHOLE and len(cost.zones) == 0
    return float(math.ceil(value)) if whole and math.isfinite(value) else value


def _choose_hub(cost: CostModel, n: int) -> Hub:
    """Return the free node, or else a tied node, or else the last node. All edges of other nodes have regular costs."""
    node = next((i for i in (cost.free, cost.tied_a) if i >= 0), n - 1)
    tied = {cost.tied_a: cost.tied_b, cost.tied_b: cost.tied_a}.get(node, -1)
    return Hub(node, tied, edge_lengths(cost, np.array([np.full(n, node), np.arange(n)], dtype=np.int32)))


def _candidate_edges(candidates: NDArray[np.int32], hub: int) -> NDArray[np.int32]:
    """Return the edges from every node to its first candidates, int32[2, e], without edges of the hub."""
    near = candidates[:, :MOST_NEAR]
    a, b = np.repeat(np.arange(len(near), dtype=np.int32), near.shape[1]), near.ravel()
    edges: NDArray[np.int32] = np.stack([a, b])[:, (b >= 0) & (a != hub) & (b != hub)]
    return edges


def _candidate_graph(cost: CostModel, n: int, edges: NDArray[np.int32]) -> Graph:
    """Return the graph of n nodes with the given edges, int32[2, e], which may contain duplicates in both
    directions.
    """
    low, high = np.sort(edges.astype(np.int64), axis=0)
    keys = np.sort(low * n + high)
    once = keys[np.diff(keys, prepend=-1) > 0]
    both = np.sort(np.concatenate([once, once % n * n + once // n]))
    ends = np.stack([both // n, both % n]).astype(np.int32)
    begin = np.searchsorted(ends[0], np.arange(n + 1)).astype(np.int32)
    return Graph(begin, np.ascontiguousarray(ends[1]), edge_lengths(cost, ends))


def _merge_sets(tree: SpanningTree, n: int) -> Sets:
    order = np.argsort(tree.length, kind="stable")
    a, b = np.ascontiguousarray(tree.edges[:, order])
    left, right, up = (np.zeros(2 * n, dtype=np.int32) for _ in range(3))
    sets = Sets(left, right, np.zeros(2 * n))
    join_sets(a, b, tree.length[order], n, up, np.zeros(2 * n), np.zeros(2 * n), sets)
    return sets


class _Ascent:
    def __init__(self, n: int, sets: Sets, hub: Hub, upper: float, stop: StopAsked) -> None:
        self.n, self.sets, self.hub, self.upper, self.stop = n, sets, hub, upper, stop
        self.steps = _ascent_steps(n)
        self.step = 0
        self.penalty = np.zeros(n)
        parent, heap, place = (np.zeros(n, dtype=np.int32) for _ in range(3))
        self.work = TreeScratch(parent, np.zeros(n), heap, place, np.zeros(2 * n))

    def climb(self, graph: Graph, goal: int) -> Floats:
        """Continue the ascent up to step `goal`, and return the best penalties since the last call."""
        hub, best, value = self.hub, self.penalty.copy(), -math.inf
        at_once = max(1, int(NODE_STEPS_PER_LOOK / self.n))
        while self.step < goal and not self.stop():
            last = min(goal, self.step + at_once)
            value = climb(
                graph,
                self.sets,
                hub.spokes,
                hub.node,
                hub.tied,
                self.upper,
                self.step,
                last,
                self.steps,
                self.penalty,
                best,
                value,
                self.work,
            )
            self.step = last
        return best


def _two_spokes(hub: Hub, penalty: Floats) -> NDArray[np.int64]:
    """Return the neighbours of the hub along its two cheapest edges; the tied edge, if any, comes first."""
    costs = hub.spokes + penalty
    costs[hub.node] = math.inf
    if hub.tied >= 0:
        costs[hub.tied] = -math.inf
    ends: NDArray[np.int64] = np.argpartition(costs, 1)[:2]
    return ends


def _one_tree_bound(cost: CostModel, hub: Hub, tree: SpanningTree, penalty: Floats) -> float:
    """Return the lower bound of the 1-tree: a minimum spanning tree under the penalties, plus two edges of the hub."""
    a, b = tree.edges
    spokes = _two_spokes(hub, penalty)
    added = np.concatenate([tree.length + (penalty[a] + penalty[b]), hub.spokes[spokes] + penalty[spokes]])
    value = float(added.sum()) - 2.0 * float(penalty.sum())
    return _rounded_lower_bound(cost, value, float(np.abs(added).sum()) + 4.0 * float(np.abs(penalty).sum()))


def has_box_bounds(cost: CostModel) -> bool:
    """Return whether the nearest point of a box gives a lower bound on the cost of an edge to any point of the box."""
    return cost.code not in (codes.GEO, codes.EXPLICIT) and cost.lift >= 0.0 and cost.per_mm >= 0.0


def edge_lengths(cost: CostModel, edges: NDArray[np.int32]) -> Floats:
    """Return the cost of each edge (`edges`: int32[2, e]); a tied edge costs 0."""
    length = costs_of_edges(cost, edges[0], edges[1])
    return np.where(length == codes.TIED, 0.0, length)


def dense_spanning_tree(cost: CostModel, hub: int, penalty: Floats) -> SpanningTree:
    """Return the minimum spanning tree of all nodes but the hub under finite penalties, by checking all pairs."""
    n = len(penalty)
    edges, left, near = np.zeros((2, n - 2), dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    dense_tree(cost, penalty, hub, left, np.zeros(n), near, edges[0], edges[1])
    return SpanningTree(edges, edge_lengths(cost, edges))


def minimum_spanning_tree(
    instance: Instance, hub: int, penalty: Floats, graph: Graph, stop: StopAsked
) -> SpanningTree | None:
    """Return the minimum spanning tree of all nodes but the hub under penalties, over all pairs of nodes.

    In the plane, the tree is built in rounds over the k-d tree; otherwise all pairs are checked. Any `graph` is valid,
    but the search is faster if more edges of the graph are in the minimum spanning tree. Returns None if `stop` returns
    True, if too many pairs would have to be checked, or if costs overflow.
    """
    cost, n = instance.cost, instance.n
    if not has_box_bounds(cost):
        return None if stop() or not np.isfinite(penalty).all() else dense_spanning_tree(cost, hub, penalty)
    edges = np.zeros((2, n - 2), dtype=np.int32)
    parts = _forest_parts(instance, hub, penalty)
    have, looks, most = 0, 0, int(max(MOST_LOOKS, MOST_LOOKS_PER_NODE * n))
    while have < n - 2:
        _set_part_ranges(instance, hub, parts)
        find_leaving_edges_in_graph(graph, penalty, parts)
        looked = find_leaving_edges_in_tree(cost, instance.tree, penalty, hub, most - looks, parts)
        if looked < 0 or stop():
            return None
        looks += looked
        had, have = have, join_parts(hub, parts, edges[0], edges[1], have)
        if have == had:  # costs that overflowed
            return None
    return SpanningTree(edges, edge_lengths(cost, edges))


def _forest_parts(instance: Instance, hub: int, penalty: Floats) -> ForestParts:
    n, m = instance.n, len(instance.tree.child)
    up, leave, arrive = (np.arange(n, dtype=np.int64) for _ in range(3))
    part, found = np.arange(n, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    low, high = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
    least = _extremes_in_boxes(instance, np.minimum, penalty, hub, math.inf)
    stack = np.zeros(STACK, dtype=np.int64)
    return ForestParts(up, part, low, high, least, found, np.full(n, -math.inf), np.zeros(n), leave, arrive, stack)


def _set_part_ranges(instance: Instance, hub: int, parts: ForestParts) -> None:
    """Store the lowest and highest part number of the nodes in each box of the k-d tree.

    The parts are the trees of the current forest.

    Changes: parts.low, high.
    """
    parts.low[:] = _extremes_in_boxes(instance, np.minimum, parts.part, hub, instance.n)
    parts.high[:] = _extremes_in_boxes(instance, np.maximum, parts.part, hub, -1)


def _extremes_in_boxes(instance: Instance, extreme: np.ufunc, values: NDArray, hub: int, none: float) -> NDArray:
    """Return the minimum or maximum of the node values in every box, with the value `none` for the hub."""
    tree = instance.tree
    runs = np.stack([tree.begin, tree.stop], axis=1).ravel()
    values = np.append(values[: len(tree.x)], none).astype(values.dtype)
    values[min(hub, len(tree.x))] = none
    # Always contiguous, so that the kernels are compiled for a single array type.
    return np.ascontiguousarray(extreme.reduceat(values, runs)[::2])
