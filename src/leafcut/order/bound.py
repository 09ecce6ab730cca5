"""Compute the Held-Karp lower bound on the cost of a tour.

Subgradient ascent looks for node penalties that make the minimum 1-tree as expensive as possible. To save time, the
ascent works on a sparse graph. The penalties are then applied to the complete graph, whose minimum 1-tree proves the
bound. For small instances, every step uses all edges.
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
from leafcut.kernels.one_tree import SLACK, Graph, Sets, TreeScratch, ascend_subgradient, join_sets
from leafcut.kernels.spanning_tree import (
    ForestParts,
    build_dense_spanning_tree,
    find_cheapest_leaving_edges_in_graph,
    find_cheapest_leaving_edges_in_kd_tree,
    join_parts,
)
from leafcut.order.instance import Instance, costs_of_edges

#: Settings for the number of ascent steps. With a few hundred nodes, more steps gain nothing. Clustered boards with
#: 1,000 to 2,000 nodes need many steps, but on larger boards the same number would take too long. A step takes about
#: 0.2 µs per node.
FEWEST_STEPS, STEPS, STEPS_PER_NODE, NODE_STEPS = 50, 200, 0.5, 1.5e6

#: Prove a bound after these fractions of the steps, and add the edges of the resulting 1-tree to the graph. The first
#: proofs come early because the ascent needs many steps to recover from a poor graph.
PROOFS = (0.01, 0.03, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0)

#: Minimum number of steps between two proofs. If a proof checks all pairs of nodes, the minimum is given per node. A
#: proof takes as long as 15 steps, or as long as n / 5 steps if it checks all pairs of n nodes.
STEPS_PER_PROOF, STEPS_PER_DENSE_PROOF = 5, 0.1

#: Call `stop` after this many steps times nodes, which takes about 10 ms.
NODE_STEPS_PER_LOOK = 5e4

#: Add edges from each node to this many nearest candidates to the graph. More edges slow down the ascent without
#: improving the bound, because the proofs add any missing edges.
MOST_NEAR = 6

#: No bound is computed for more nodes than this, because a proof would take too long.
MOST_NODES = 200_000

#: Node limit for metrics without plane coordinates (GEO, EXPLICIT). A proof then checks all pairs, which takes about a
#: second at this limit.
DENSE_LIMIT = 5000

#: Relative allowance for rounding errors when float64 sums millions of numbers. The margin is generous.
ROUNDING = 1e-9

#: Maximum number of pairs and boxes to check, in total and per node. The search only reaches this limit if lifts are
#: more expensive than distances.
MOST_LOOKS, MOST_LOOKS_PER_NODE = 2e7, 2000

#: Up to this many nodes, checking all pairs takes microseconds and requires no further compilation.
ALL_PAIRS = 150

#: Stack size for visiting boxes. It must exceed the height of the k-d tree, which is at most about 60 for a million
#: points.
STACK = 128

StopAsked = Callable[[], bool]

_WHOLE = (codes.EUC_2D, codes.CEIL_2D, codes.ATT, codes.GEO, codes.MAX_2D, codes.MAN_2D)


class SpanningTree(NamedTuple):
    """Edges of a spanning tree of all nodes except one, int32[2, n - 2], with their costs."""

    edges: NDArray[np.int32]
    length: Floats


class Hub(NamedTuple):
    """The node that the spanning tree omits, with its tied neighbour (-1 if none) and the costs of its edges."""

    node: int
    tied: int
    spokes: Floats


def lower_bound(instance: Instance, upper: float, *, stop: StopAsked | None = None) -> float | None:
    """Compute a lower bound on the cost of any tour.

    Parameters
    ----------
    upper
        Cost of a known tour in the metric's unit, without service times. The bound is valid for any value, but a
        shorter tour gives a better bound.
    stop
        Called every few hundredths of a second. If it returns True, the function returns the best bound proved so far.

    Returns
    -------
    float | None
        Every tour that contains the tied edge, if the problem has one, has a `tour_cost` of at least this value. The
        bound allows for rounding errors. If all costs are integers, the bound is an integer too.

        The result is None for clusters of several nodes, nodes whose entry and exit differ, asymmetric matrices, more
        than `MOST_NODES` nodes, or more than `DENSE_LIMIT` nodes without plane coordinates (GEO, EXPLICIT). It is also
        None if sums overflow, or if expensive lifts would force a proof to check too many edges.
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
    """Return the best bound proved during the ascent, or None if the time runs out before the first proof."""
    cost, n = instance.cost, instance.n
    hub = _choose_one_tree_hub(cost, n)
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


def _ascent_step_count(n: int) -> int:
    return int(max(FEWEST_STEPS, min(STEPS + STEPS_PER_NODE * n, NODE_STEPS / n)))


def _bound_of_small_instance(instance: Instance, upper: float, stop: StopAsked) -> float | None:
    """Run the ascent on dense arrays, where each step proves a bound, and return the best bound.

    Returns None if the ascent does not complete a single step.
    """
    cost, n = instance.cost, instance.n
    hub, steps, penalty, proved = _choose_one_tree_hub(cost, n), _ascent_step_count(n), np.zeros(n), None
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
        excess = np.bincount(np.append(tree.edges, _two_cheapest_hub_neighbours(hub, penalty)), minlength=n) - 2.0
        excess[hub.node] = 0.0
        moves = np.einsum("si,i", sets, excess)
        product = float((moves * moves).sum())
        if not (product > 0.0 and value < upper < math.inf):
            break
        penalty += (1.0 - step / steps) ** 2 * (upper - value) / product * np.einsum("si,s", sets, moves)
    return proved


def _cost_matrix(cost: CostModel, n: int) -> CostModel:
    """Store the costs of all edges in a matrix, without tied and free edges.

    Moves with heights are slow to compute. The matrix avoids computing them repeatedly.
    """
    if cost.code == codes.EXPLICIT:
        return cost
    leave, arrive = np.indices((n, n), dtype=np.int32).reshape(2, -1)
    matrix = costs_with_tied_edges_free(cost, np.stack([leave, arrive])).reshape(n, n)
    return cost._replace(code=codes.EXPLICIT, plain=False, matrix=matrix, zones=np.zeros((0, 4)))


def _dense_merge_sets(tree: SpanningTree, n: int) -> Floats:
    """Return the sets from `_merge_sets` as an array, float64[2n, n].

    Row s describes set s. It contains the square root of the set's width at each node of the set.
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
    """Subtract the largest possible rounding error of sums of magnitude `size` from `value`.

    If all costs are integers, the result is rounded up to the next integer.
    """
    value -= ROUNDING * size
    if cost.code == codes.EXPLICIT:
        whole = bool(np.array_equal(cost.matrix, np.rint(cost.matrix)))
    else:
        whole = cost.code in _WHOLE and len(cost.zones) == 0
    return float(math.ceil(value)) if whole and math.isfinite(value) else value


def _choose_one_tree_hub(cost: CostModel, n: int) -> Hub:
    """Choose the hub: the free node if the problem has it, otherwise a tied node, otherwise the last node.

    All edges between the other nodes then have regular costs.
    """
    node = next((i for i in (cost.free, cost.tied_a) if i >= 0), n - 1)
    tied = {cost.tied_a: cost.tied_b, cost.tied_b: cost.tied_a}.get(node, -1)
    return Hub(node, tied, costs_with_tied_edges_free(cost, np.array([np.full(n, node), np.arange(n)], dtype=np.int32)))


def _candidate_edges(candidates: NDArray[np.int32], hub: int) -> NDArray[np.int32]:
    """Collect the edges from every node to its first candidates, int32[2, e], and leave out edges of the hub."""
    near = candidates[:, :MOST_NEAR]
    a, b = np.repeat(np.arange(len(near), dtype=np.int32), near.shape[1]), near.ravel()
    edges: NDArray[np.int32] = np.stack([a, b])[:, (b >= 0) & (a != hub) & (b != hub)]
    return edges


def _candidate_graph(cost: CostModel, n: int, edges: NDArray[np.int32]) -> Graph:
    """Build the graph of n nodes from a list of edges, int32[2, e]. An edge may occur twice, once in each direction."""
    low, high = np.sort(edges.astype(np.int64), axis=0)
    keys = np.sort(low * n + high)
    once = keys[np.diff(keys, prepend=-1) > 0]
    both = np.sort(np.concatenate([once, once % n * n + once // n]))
    ends = np.stack([both // n, both % n]).astype(np.int32)
    begin = np.searchsorted(ends[0], np.arange(n + 1)).astype(np.int32)
    return Graph(begin, np.ascontiguousarray(ends[1]), costs_with_tied_edges_free(cost, ends))


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
        self.steps = _ascent_step_count(n)
        self.step = 0
        self.penalty = np.zeros(n)
        parent, heap, place = (np.zeros(n, dtype=np.int32) for _ in range(3))
        self.work = TreeScratch(parent, np.zeros(n), heap, place, np.zeros(2 * n))

    def climb(self, graph: Graph, goal: int) -> Floats:
        hub, best, value = self.hub, self.penalty.copy(), -math.inf
        at_once = max(1, int(NODE_STEPS_PER_LOOK / self.n))
        while self.step < goal and not self.stop():
            last = min(goal, self.step + at_once)
            value = ascend_subgradient(
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


def _two_cheapest_hub_neighbours(hub: Hub, penalty: Floats) -> NDArray[np.int64]:
    """Return the hub's neighbours along its two cheapest edges. If the hub has a tied edge, it comes first."""
    costs = hub.spokes + penalty
    costs[hub.node] = math.inf
    if hub.tied >= 0:
        costs[hub.tied] = -math.inf
    ends: NDArray[np.int64] = np.argpartition(costs, 1)[:2]
    return ends


def _one_tree_bound(cost: CostModel, hub: Hub, tree: SpanningTree, penalty: Floats) -> float:
    """Compute the lower bound of the 1-tree: a minimum spanning tree under the penalties, plus two edges of the hub."""
    a, b = tree.edges
    spokes = _two_cheapest_hub_neighbours(hub, penalty)
    added = np.concatenate([tree.length + (penalty[a] + penalty[b]), hub.spokes[spokes] + penalty[spokes]])
    value = float(added.sum()) - 2.0 * float(penalty.sum())
    return _rounded_lower_bound(cost, value, float(np.abs(added).sum()) + 4.0 * float(np.abs(penalty).sum()))


def has_box_bounds(cost: CostModel) -> bool:
    """Check whether the nearest point of a box gives a lower bound on the cost of an edge into that box."""
    return cost.code not in (codes.GEO, codes.EXPLICIT) and cost.lift >= 0.0 and cost.per_mm >= 0.0


def costs_with_tied_edges_free(cost: CostModel, edges: NDArray[np.int32]) -> Floats:
    """Return the cost of each edge (`edges`: int32[2, e]). Tied edges cost 0."""
    length = costs_of_edges(cost, edges[0], edges[1])
    return np.where(length == codes.TIED, 0.0, length)


def dense_spanning_tree(cost: CostModel, hub: int, penalty: Floats) -> SpanningTree:
    """Build the minimum spanning tree of all nodes except the hub by checking all pairs. Penalties must be finite."""
    n = len(penalty)
    edges, left, near = np.zeros((2, n - 2), dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    build_dense_spanning_tree(cost, penalty, hub, left, np.zeros(n), near, edges[0], edges[1])
    return SpanningTree(edges, costs_with_tied_edges_free(cost, edges))


def minimum_spanning_tree(
    instance: Instance, hub: int, penalty: Floats, graph: Graph, stop: StopAsked
) -> SpanningTree | None:
    """Build the minimum spanning tree over all pairs of nodes except the hub, under the given penalties.

    In the plane, the algorithm grows the tree in rounds with the help of the k-d tree. Otherwise, it checks all pairs.
    Any `graph` is valid, but the search is faster if many of the graph's edges belong to the minimum spanning tree.

    Returns None if `stop` returns True, if the search would have to check too many pairs, or if costs overflow.
    """
    cost, n = instance.cost, instance.n
    if not has_box_bounds(cost):
        return None if stop() or not np.isfinite(penalty).all() else dense_spanning_tree(cost, hub, penalty)
    edges = np.zeros((2, n - 2), dtype=np.int32)
    parts = _forest_parts(instance, hub, penalty)
    have, looks, most = 0, 0, int(max(MOST_LOOKS, MOST_LOOKS_PER_NODE * n))
    while have < n - 2:
        _set_part_ranges_of_boxes(instance, hub, parts)
        find_cheapest_leaving_edges_in_graph(graph, penalty, parts)
        looked = find_cheapest_leaving_edges_in_kd_tree(cost, instance.tree, penalty, hub, most - looks, parts)
        if looked < 0 or stop():
            return None
        looks += looked
        had, have = have, join_parts(hub, parts, edges[0], edges[1], have)
        if have == had:  # costs that overflowed
            return None
    return SpanningTree(edges, costs_with_tied_edges_free(cost, edges))


def _forest_parts(instance: Instance, hub: int, penalty: Floats) -> ForestParts:
    n, m = instance.n, len(instance.tree.child)
    up, leave, arrive = (np.arange(n, dtype=np.int64) for _ in range(3))
    part, found = np.arange(n, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    low, high = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
    least = _extremes_in_boxes(instance, np.minimum, penalty, hub, math.inf)
    stack = np.zeros(STACK, dtype=np.int64)
    return ForestParts(up, part, low, high, least, found, np.full(n, -math.inf), np.zeros(n), leave, arrive, stack)


def _set_part_ranges_of_boxes(instance: Instance, hub: int, parts: ForestParts) -> None:
    """Store the lowest and the highest part number that occurs in each box of the k-d tree.

    Each tree of the current forest is a part.

    Changes: parts.low, high.
    """
    parts.low[:] = _extremes_in_boxes(instance, np.minimum, parts.part, hub, instance.n)
    parts.high[:] = _extremes_in_boxes(instance, np.maximum, parts.part, hub, -1)


def _extremes_in_boxes(instance: Instance, extreme: np.ufunc, values: NDArray, hub: int, none: float) -> NDArray:
    """Compute the minimum or the maximum of the node values in every box. The hub counts with the value `none`."""
    tree = instance.tree
    runs = np.stack([tree.begin, tree.stop], axis=1).ravel()
    values = np.append(values[: len(tree.x)], none).astype(values.dtype)
    values[min(hub, len(tree.x))] = none
    # Always contiguous, so that the kernels are compiled for a single array type.
    return np.ascontiguousarray(extreme.reduceat(values, runs)[::2])
