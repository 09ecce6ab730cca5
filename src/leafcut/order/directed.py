"""`DirectedInstance`: a routing problem as arrays for kernels that support choices, directed costs, and precedence.

The nodes of a path are clusters, with the same numbers as in the problem. An open path has an additional last node,
called its anchor. A move from the anchor costs as much as a move from the start of the path, and a move to the anchor
costs as much as a move to the end. If the start or the end is free, the cost is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints, Points
from leafcut.kernels.candidates import fill_directed_candidates
from leafcut.kernels.cost import CostModel
from leafcut.kernels.route import BLOCK, RING, TWISTED, Lists, Route, Rules, build_cheapest_path, recompute_bias
from leafcut.model.problem import RoutingProblem
from leafcut.order.instance import (
    PER_QUADRANT,
    Instance,
    MoveCosts,
    add_path_ends,
    allocate_nearby_buffers,
    build_cost_model,
    build_tree,
    candidate_lists,
    cluster_positions,
    costs_of_edges,
    is_directed,
    nodes_by_cluster,
)
from leafcut.order.precedence import CLOSURE_LIMIT, compressed_rows, impossible_moves_and_reduction, validate_pairs

#: Up to this many nodes, candidates are computed from the costs of all pairs, which needs n² memory.
DENSE_LIMIT = 3000

#: An exchange tries this many candidates for its first and its second new edge. For contours with holes that must be
#: cut first, (16, 8) works far better than 8 candidates, because most of those would be the contour's own holes.
BREADTH = (16, 8)

#: Gains below this fraction of a mean move count as rounding errors.
LEAST = 1e-8

#: The search checks the clock after this many exchanges, about every 10 ms.
LOOKS = 5000

#: Nodes, int32[n, k], cheapest first, with their costs, float64[n, k].
Listed = tuple[Ints, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class DirectedInstance:
    """A path problem with choices, asymmetric costs, or precedence.

    Attributes
    ----------
    pairs
        The precedence pairs, int32[k, 2], except pairs that follow from other pairs.
    cost
        Cost model over these positions: the entries of all nodes; the exits of all nodes, if any exit differs from its
        entry; the start; the end.
    rules
        Precedence, nodes of the clusters, and candidates, in the format of the kernels.
    enter, leave
        Rows of `cost` for the entry and the exit of each cluster's first node, int32[n].
    twisted
        Whether some costs depend on the direction.
    anchored
        Whether the last node is an anchor.
    """

    problem: RoutingProblem
    pairs: Ints
    cost: CostModel
    rules: Rules
    enter: Ints
    leave: Ints
    twisted: bool
    anchored: bool

    @property
    def n(self) -> int:
        """Number of nodes, including the anchor."""
        return len(self.enter)

    @property
    def service(self) -> float:
        """Always zero, because path lengths already include the service time."""
        return 0.0

    @property
    def exact(self) -> bool:
        """Always True, because the length of a path equals its cost."""
        return True

    def cluster_order(self, tour: Ints) -> Ints:
        """Convert a tour of the problem's nodes to clusters, int32[clusters]."""
        clusters: Ints = self.problem.cluster[tour].astype(np.int32)
        return clusters

    def path_positions(self, tour: Ints) -> Points:
        """Return the positions along a path from start to end: each node's entry, and its exit if they differ."""
        entry, leave = self.problem.entry[tour], self.problem.exit[tour]
        same = np.array_equal(entry, leave)
        return add_path_ends(self.problem, entry if same else np.stack([entry, leave], axis=1).reshape(-1, 2))

    def nodes_from_path(self, node: Ints, enter: Ints) -> Ints:
        """Convert a path, int32[n], to nodes of the problem, int32[clusters].

        A closed path without precedence starts at cluster 0.
        """
        order = node[1:] if self.anchored else node
        if not self.anchored and not len(self.pairs):
            order = np.roll(order, -int(np.flatnonzero(order == 0)[0]))
        return enter[order]

    def path_from_nodes(self, nodes: Ints) -> tuple[Ints, Ints]:
        """Convert nodes of the problem, int32[clusters], to a path (node, enter), int32[n] each."""
        node, enter = self.problem.cluster[nodes].astype(np.int32), self.enter.copy()
        enter[node] = nodes
        return (np.concatenate([[self.n - 1], node]).astype(np.int32) if self.anchored else node), enter

    def length(self, node: Ints, enter: Ints, leave: Ints) -> float:
        """Compute the total travel cost and service time along a path of n nodes."""
        travels = costs_of_edges(self.cost, leave[node], enter[np.roll(node, -1)])
        return float(travels.sum()) + float(self.rules.service[enter].sum())


#: A problem as arrays for either move set. Both classes provide `problem`, `n`, `service`, `exact`,
#: `cluster_order`, and `path_positions`.
AnyInstance = Instance | DirectedInstance


def refuse_ends_with_cost_table(problem: RoutingProblem) -> None:
    """Raise SolveError if the problem combines a cost table with a start or an end."""
    ends = () if problem.closed else (problem.start, problem.end)
    if problem.metric.name == "EXPLICIT" and any(p is not None for p in ends):
        raise SolveError("a cost table has no costs to or from a point; leave out the start and the end point")


def build_directed_instance(problem: RoutingProblem, k: int) -> DirectedInstance:
    """Convert a problem to a `DirectedInstance` with k candidates per node.

    Raises
    ------
    SolveError
        If the precedence has a cycle, or if the problem combines a cost table with a start or an end.
    """
    m, twisted = problem.n_clusters, is_directed(problem)
    pairs, barred = validate_pairs(problem), None
    if len(pairs) and m <= CLOSURE_LIMIT:
        barred, pairs = impossible_moves_and_reduction(pairs, m)
    cost, ends, beyond = _build_cost_model(problem, twisted)
    way, begin = nodes_by_cluster(problem)
    near, back = _build_candidate_lists(problem, cost, way, beyond, k + (k // 2 if len(pairs) else 0))
    near, back = _feasible_candidates(near, pairs, barred, False, k), _feasible_candidates(back, pairs, barred, True, k)
    enter = way[begin[:m]]
    leave = enter + np.int32(beyond)
    if ends is not None:
        last = _cheapest_end_moves(cost, way + np.int32(beyond), begin, ends[1], pairs[:, 0])
        first = _cheapest_end_moves(cost, way, begin, ends[0], pairs[:, 1])
        near, back = _add_anchor(near, last, first), _add_anchor(back, first, last)
        enter, leave, begin = np.append(enter, ends[1]), np.append(leave, ends[0]), np.append(begin, begin[-1])
    n, here, there = len(enter), list(map(np.ascontiguousarray, near)), list(map(np.ascontiguousarray, back))
    service = np.zeros(len(cost.xy))
    service[: problem.n_nodes] = problem.service
    rules = Rules(
        *compressed_rows(pairs, n),
        *compressed_rows(pairs[:, ::-1], n),
        begin,
        way,
        np.array([beyond]),
        service,
        Lists(*here, *there),
        Lists(*there, *here),
    )
    return DirectedInstance(problem, pairs, cost, rules, enter, leave, twisted, ends is not None)


def create_route(instance: DirectedInstance, node: Ints, enter: Ints, log: int = 0) -> Route:
    """Create a `Route` for a path (`node` and `enter`, int32[n] each), with all the buffers that the kernels need.

    The queue starts empty. `log` is the capacity of the log.
    """
    n = instance.n
    leave = enter + np.int32(instance.rules.beyond[0])
    if instance.anchored:
        leave[n - 1] = instance.leave[n - 1]
    route = Route(
        node=node.copy(),
        place=np.zeros(n, dtype=np.int32),
        enter=enter.copy(),
        leave=leave,
        bias=np.zeros(n),
        shift=np.zeros((n >> BLOCK) + 1),
        flags=np.zeros(2, dtype=np.int64),
        queue=np.zeros(n, dtype=np.int32),
        queued=np.zeros(n, dtype=np.uint8),
        counts=np.zeros(4, dtype=np.int64),
        log=np.zeros(log, dtype=np.int32),
        buffer=np.zeros(n, dtype=np.int32),
        move=np.zeros(6, dtype=np.int64),
    )
    route.place[node] = np.arange(n, dtype=np.int32)
    route.flags[TWISTED], route.flags[RING] = instance.twisted, not instance.anchored
    return route


def queue_all_nodes(instance: DirectedInstance, route: Route) -> None:
    """Add all nodes of a route to its empty queue. Changes: queue, queued, counts, bias, shift."""
    route.queue[:], route.queued[:] = route.node, 1
    route.counts[:2] = 0, instance.n
    recompute_bias(instance.cost, route)


def greedy_path(instance: DirectedInstance) -> Route:
    """Build a path that always continues with the cheapest cluster whose predecessors have all been visited."""
    n, rules = instance.n, instance.rules
    missing = np.diff(rules.before_begin).astype(np.int32)
    free = np.flatnonzero(missing == 0).astype(np.int32)
    first = n - 1 if instance.anchored else int(free[0])
    free = free[free != first]
    waiting, spot = np.full(n, -1, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    waiting[: len(free)], spot[free] = free, np.arange(len(free), dtype=np.int32)
    route = create_route(instance, np.full(n, first, dtype=np.int32), instance.enter)
    build_cheapest_path(instance.cost, route, rules, waiting, spot, missing)
    return route


def cheapest_move_costs(
    problem: RoutingProblem, late: Callable[[], bool] = lambda: False
) -> NDArray[np.float64] | None:
    """Compute the cost of the cheapest move from each cluster to each other cluster, float64[n, n].

    For an open path, the last row and column belong to its anchor. Precedence is ignored. The function returns None if
    `late` returns True before the last row is complete. It raises SolveError if the problem combines a cost table with
    a start or an end.
    """
    refuse_ends_with_cost_table(problem)
    moves, m = MoveCosts(problem), problem.n_clusters
    way, begin = nodes_by_cluster(problem)
    least = np.zeros((m, m) if problem.closed else (m + 1, m + 1))
    for c, (first, last) in enumerate(pairwise(begin.tolist())):
        if late():
            return None
        least[c, :m] = np.minimum.reduceat(moves.between(way[first:last], way).min(axis=0), begin[:-1])
    if not problem.closed:
        least[:m, m] = np.minimum.reduceat(moves.to_end(way), begin[:-1])
        least[m, :m] = np.minimum.reduceat(moves.from_start(way), begin[:-1])
        least[m, m] = moves.along_path(way[:0]).sum()
    return least


def _build_cost_model(
    problem: RoutingProblem, twisted: bool
) -> tuple[CostModel, tuple[np.int32, np.int32] | None, int]:
    """Build the cost model of a problem, and describe its rows.

    Returns
    -------
    cost
        Cost model over the entries, the exits, and the two ends.
    ends
        Rows of the two ends. None for a closed path.
    beyond
        Offset from the row of a node's entry to the row of its exit.
    """
    explicit = problem.metric.name == "EXPLICIT"
    beyond = problem.n_nodes if twisted and not explicit else 0
    places = np.concatenate([problem.entry, problem.exit]) if beyond else problem.entry
    if problem.closed:
        return build_cost_model(problem.metric, places), None, beyond
    refuse_ends_with_cost_table(problem)
    given = [p for p in (problem.start, problem.end) if p is not None]
    count = len(places)
    free = count + len(given)
    ends = (
        np.int32(count if problem.start is not None else free),
        np.int32(free - 1 if problem.end is not None else free),
    )
    rest = np.array([*given, (0.0, 0.0)], dtype=np.float64)
    cost = build_cost_model(problem.metric, np.concatenate([places, rest]), free=free if len(given) < 2 else -1)
    return cost, ends, beyond


def _build_candidate_lists(
    problem: RoutingProblem, cost: CostModel, way: Ints, beyond: int, k: int
) -> tuple[Listed, Listed]:
    m, nodes = problem.n_clusters, len(way)
    k = min(k, m - 1)
    if problem.metric.name == "EXPLICIT" or m < nodes <= DENSE_LIMIT:
        least = cheapest_move_costs(problem)
        assert least is not None
        grid = least[:m, :m]
        np.fill_diagonal(grid, np.inf)
        return _cheapest_per_row(grid, k), _cheapest_per_row(grid.T, k)
    if m == nodes and beyond:
        exits = way + np.int32(beyond)
        return _nearest_rows(cost, exits, way, k + 1), _nearest_rows(cost, way, exits, k + 1)
    # With many nodes, near clusters are found by their centres, which is accurate enough.
    xy = cluster_positions(problem)
    tree, label = build_tree(xy)
    lists, costs = candidate_lists(build_cost_model(problem.metric, xy[label]), tree, m, m, k)
    named, lengths = np.empty_like(lists), np.empty_like(costs)
    named[label], lengths[label] = np.where(lists >= 0, label[lists], -1), costs
    return (named, lengths), (named, lengths)


def _cheapest_per_row(grid: NDArray[np.float64], k: int) -> Listed:
    few = np.sort(np.argpartition(grid, k - 1, axis=1)[:, :k], axis=1)
    costs = np.take_along_axis(grid, few, axis=1)
    order = np.argsort(costs, axis=1, kind="stable")
    return np.take_along_axis(few, order, axis=1).astype(np.int32), np.take_along_axis(costs, order, axis=1)


def _nearest_rows(cost: CostModel, query: Ints, goal: Ints, k: int) -> Listed:
    """For each row in `query`, return the indices in `goal` of nearby rows. The row itself may be among them."""
    tree, label = build_tree(cost.xy[goal])
    tree = tree._replace(
        x=np.append(tree.x, 0.0), y=np.append(tree.y, 0.0), leaf_of=np.append(tree.leaf_of, np.int32(0))
    )
    lists, costs = np.empty((len(query), k), dtype=np.int32), np.empty((len(query), k))
    per_quadrant = min(PER_QUADRANT, max(1, k // 4))
    fill_directed_candidates(cost, tree, goal[label], query, per_quadrant, lists, costs, allocate_nearby_buffers(k))
    return np.where(lists >= 0, label[lists], -1).astype(np.int32), costs


def _feasible_candidates(listed: Listed, pairs: Ints, barred: NDArray[np.bool_] | None, back: bool, k: int) -> Listed:
    """Keep the first k entries in each list that precedence allows as successors (as predecessors if `back`)."""
    near, costs = listed
    m = len(near)
    own = np.arange(m)[:, None]
    wrong = (near < 0) | (near == own)
    leave, arrive = (near, own) if back else (own, near)
    if barred is not None:
        wrong |= barred[leave, arrive]
    elif len(pairs):
        wrong |= np.isin(leave * np.int64(m) + arrive, pairs[:, 1] * np.int64(m) + pairs[:, 0])
    near, costs = np.where(wrong, -1, near), np.where(wrong, np.inf, costs)
    order = np.argsort(costs, axis=1, kind="stable")[:, :k]
    return np.take_along_axis(near, order, axis=1), np.take_along_axis(costs, order, axis=1)


def _cheapest_end_moves(cost: CostModel, ways: Ints, begin: Ints, end: np.int32, barred: Ints) -> NDArray[np.float64]:
    """Compute the minimum travel cost between each cluster and an end of the path.

    Excluded clusters have infinite cost.
    """
    costs = np.minimum.reduceat(costs_of_edges(cost, ways, np.full(len(ways), end)), begin[:-1])
    costs[barred] = np.inf
    return costs


def _add_anchor(listed: Listed, there: NDArray[np.float64], back: NDArray[np.float64]) -> Listed:
    """Insert the anchor into the candidate lists and add a list for the anchor itself.

    `there` and `back`, float64[clusters], are the costs of moves to and from the anchor. If all moves from the anchor
    are free, its list stays empty.
    """
    near, costs = listed
    m, k = near.shape
    own, own_costs = np.full(k + 1, -1, dtype=np.int32), np.full(k + 1, np.inf)
    if back[np.isfinite(back)].any():
        first = np.argsort(back, kind="stable")[: k + 1]
        own[: len(first)], own_costs[: len(first)] = np.where(np.isfinite(back[first]), first, -1), back[first]
    wider = np.concatenate([near, np.where(np.isfinite(there), m, -1)[:, None]], axis=1)
    lengths = np.concatenate([costs, there[:, None]], axis=1)
    order = np.argsort(lengths, axis=1, kind="stable")
    wider, lengths = np.take_along_axis(wider, order, axis=1), np.take_along_axis(lengths, order, axis=1)
    return np.concatenate([wider, own[None]]).astype(np.int32), np.concatenate([lengths, own_costs[None]])
