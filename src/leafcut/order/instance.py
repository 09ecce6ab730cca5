"""`Instance`: a routing problem as a closed tour, stored in arrays for the kernels.

A given start and a given end become additional nodes, joined by a tied edge. A free end becomes a node at zero distance
from all other nodes. Nodes are numbered by location, so nodes that are close in the plane are also close in memory. The
additional nodes come last.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.kernels import candidates as candidate_kernels
from leafcut.kernels import cost as codes
from leafcut.kernels.cost import CostModel, edge_costs, tour_cost
from leafcut.kernels.neighbours import MOST_TWINS, Nearby, Tree, fill_tree
from leafcut.model.problem import Metric, RoutingProblem

#: A candidate list contains this many neighbours per quadrant. The nearest remaining nodes fill the rest of the list.
PER_QUADRANT = 2

#: Process this many rows of the cost matrix at once, to limit memory.
ROWS_AT_ONCE = 256

#: Full candidate lists need n² memory, so they are limited to this many nodes.
FULL_LISTS_LIMIT = 3000

#: Number of candidates per node for exchanges and lower bounds.
CANDIDATES = 8

#: Problem size limits for annealing and for the ants of `auto`. Both store the cost of every move, which takes n²
#: memory. The number of clusters includes the anchor.
FEW_CLUSTERS, FEW_NODES = 500, 2500

#: From this many nodes on, the time is only enough for a few ants. The search therefore shortens the long edges of the
#: first tour when exchanges find no further improvement, and it kicks several pieces of the tour in parallel.
MANY = 20_000


def build_cost_model(
    metric: Metric, xy: NDArray[np.float64], tied: tuple[int, int] = (-1, -1), free: int = -1
) -> CostModel:
    """Build the cost model of a metric over points, float64[n, 2], for the kernels."""
    zones = np.ascontiguousarray(metric.zones, dtype=np.float64).reshape(-1, 4)
    return CostModel(
        code=codes.CODES[metric.name],
        plain=tied == (-1, -1) and free < 0 and not len(zones) and metric.name != "EXPLICIT" and metric.relief is None,
        xy=np.ascontiguousarray(xy, dtype=np.float64),
        vx=float(metric.velocity[0]),
        vy=float(metric.velocity[1]),
        ax=float(metric.acceleration[0]),
        ay=float(metric.acceleration[1]),
        per_mm=float(metric.per_mm),
        zones=zones,
        lift=float(metric.lift),
        matrix=_cost_table(metric, xy),
        tied_a=tied[0],
        tied_b=tied[1],
        free=free,
    )


def _cost_table(metric: Metric, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cost table of an EXPLICIT metric, or the table of point and tile heights (`kernels.cost.RELIEF`)."""
    if metric.matrix is not None:
        return np.ascontiguousarray(metric.matrix, dtype=np.float64)
    relief = metric.relief
    if relief is None:
        return np.zeros((0, 0))
    header = (relief.x, relief.y, relief.side, relief.velocity, relief.acceleration)
    return codes.relief_table(header, relief.safe, relief.at(xy))


def matrix_of_nodes(cost: CostModel, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
    """Extract the part of a cost model's matrix that belongs to some nodes, int32[m]: costs, or heights and tiles."""
    if cost.code == codes.EXPLICIT:
        return np.ascontiguousarray(cost.matrix[np.ix_(nodes, nodes)])
    if not len(cost.matrix):
        return cost.matrix
    first, columns = 1 + int(cost.matrix[0, 5]), int(cost.matrix[0, 6])
    heights, header = cost.matrix[1:first].reshape(-1)[nodes], tuple(cost.matrix[0, :5].tolist())
    return codes.relief_table(header, cost.matrix[first:, :columns], heights)


def build_tree(xy: NDArray[np.float64], apart: int = 0) -> tuple[Tree, NDArray[np.int32]]:
    """Build the k-d tree of points, float64[n, 2].

    Returns the tree and the original index of each point in the tree, int32[n]. The last `apart` points (at most two)
    keep their positions.
    """
    n = len(xy)
    x, y = np.ascontiguousarray(xy[:, 0]), np.ascontiguousarray(xy[:, 1])
    label = np.arange(n, dtype=np.int32)
    if n == 0:
        none = np.zeros(0, dtype=np.int32)
        return Tree(x, y, none, none, none, np.zeros((0, 4)), none, none), label
    leaf_of, stack = np.zeros(n, dtype=np.int32), np.zeros(64, dtype=np.int32)
    begin, stop, child, parent = (np.empty(2 * n + 1, dtype=np.int32) for _ in range(4))
    box = np.empty((2 * n + 1, 4))
    m = fill_tree(x, y, label, apart, leaf_of, begin, stop, box, child, parent, stack)
    return Tree(x, y, leaf_of, begin[:m], stop[:m], box[:m], child[:m], parent[:m]), label


def allocate_nearby_buffers(k: int) -> Nearby:
    """Allocate the buffers that a worker needs to search for k neighbours."""
    width = max(k, MOST_TWINS)
    return Nearby(
        found=np.zeros((6, width), dtype=np.int32),
        near=np.zeros((6, width)),
        chosen=np.zeros(width, dtype=np.int32),
        limit=np.zeros(6),
        stack=np.zeros(64, dtype=np.int32),
    )


def candidate_lists(cost: CostModel, tree: Tree, n: int, total: int, k: int) -> tuple[NDArray, NDArray]:
    """Build the candidate lists of the first n nodes.

    With a tree, candidates are chosen by quadrant.

    Returns
    -------
    tuple[NDArray, NDArray]
        The candidates, int32[total, k], padded with -1, and their costs, float64[total, k], padded with infinity.
    """
    candidates, lengths = np.full((total, k), -1, dtype=np.int32), np.full((total, k), np.inf)
    if len(tree.x) == 0 or k >= n - 1:
        _fill_cheapest_candidates(cost, n, candidates, lengths)
        return candidates, lengths
    per_quadrant = min(PER_QUADRANT, max(1, k // 4))
    candidate_kernels.fill_candidates(cost, tree, per_quadrant, 0, n, candidates, lengths, allocate_nearby_buffers(k))
    return candidates, lengths


def costs_of_edges(cost: CostModel, leave: NDArray[np.int32], arrive: NDArray[np.int32]) -> NDArray[np.float64]:
    """Compute the travel cost of each edge from leave[e] to arrive[e], int32[m] each. A tied edge costs `TIED`."""
    costs = np.zeros(len(leave))
    edge_costs(cost, leave, arrive, costs)
    return costs


def _fill_cheapest_candidates(
    cost: CostModel, n: int, candidates: NDArray[np.int32], lengths: NDArray[np.float64]
) -> None:
    """Fill the candidate lists of the first n nodes with the cheapest other nodes. Ties are broken by index."""
    nodes, size = np.arange(n, dtype=np.int32), min(candidates.shape[1], n - 1)
    for begin in range(0, n if size > 0 else 0, ROWS_AT_ONCE):
        rows = nodes[begin : begin + ROWS_AT_ONCE]
        costs = costs_of_edges(cost, np.repeat(rows, n), np.tile(nodes, len(rows))).reshape(len(rows), n)
        costs[np.arange(len(rows)), rows] = np.inf
        row, column = np.nonzero(costs <= np.partition(costs, size - 1, axis=1)[:, size - 1 : size])
        others = column != rows[row]
        row, column = row[others], column[others]
        value = costs[row, column]
        # Stable sort: ties keep the order of the indices.
        order = np.lexsort((value, row))
        place = np.arange(len(row)) - np.searchsorted(row, row)
        kept = place < size
        candidates[begin + row[kept], place[kept]] = column[order[kept]]
        lengths[begin + row[kept], place[kept]] = value[order[kept]]


@dataclass(frozen=True, eq=False)
class Instance:
    """A closed-tour problem.

    Attributes
    ----------
    cost
        Cost model over the positions of the clusters, followed by the start, the end, and the free node, if they exist.
    label
        Cluster of each node, int32[n]. The additional nodes come last and have higher numbers.
    tree
        k-d tree of all nodes that have a position. Empty if costs are explicit.
    candidates
        Candidates of each node, int32[n, k], padded with -1. The free node is the first candidate of every cluster. See
        `exchange_candidates`.
    lengths
        Costs of the candidates, float64[n, k], padded with infinity.
    first, second
        Every constructed tour must start with these two nodes. -1 allows any node.
    """

    problem: RoutingProblem
    cost: CostModel
    label: NDArray[np.int32]
    tree: Tree
    candidates: NDArray[np.int32]
    lengths: NDArray[np.float64]
    first: int
    second: int

    @property
    def n(self) -> int:
        """Number of nodes in the tour, including the additional nodes."""
        return len(self.candidates)

    @cached_property
    def exchange_candidates(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Candidate lists for exchanges, without the free node: nodes, int32[n, k], and costs, float64[n, k].

        Exchanges that start at the free node find all improvements that involve the free node.
        """
        if self.cost.free < 0:
            return self.candidates, self.lengths
        listed = self.candidates[:, :1] == self.cost.free
        return (
            np.where(listed, self.candidates[:, 1:], self.candidates[:, :-1]),
            np.where(listed, self.lengths[:, 1:], self.lengths[:, :-1]),
        )

    @property
    def default_start(self) -> int:
        """Default first node of a tour: the given start, or the first cluster if the problem has no start."""
        return self.first if self.first >= 0 else int(np.flatnonzero(self.label == 0)[0])

    def length(self, tour: NDArray[np.int32]) -> float:
        """Compute the cost of a tour, int32[n], without service times."""
        return float(tour_cost(self.cost, tour))

    def costs(self, leave: ArrayLike, arrive: ArrayLike) -> NDArray[np.float64]:
        """Compute the costs of moves between nodes, with broadcasting. A tied edge costs `TIED`."""
        pairs = np.broadcast_arrays(np.atleast_1d(leave), np.atleast_1d(arrive))
        return costs_of_edges(self.cost, *(np.ascontiguousarray(nodes, dtype=np.int32) for nodes in pairs))

    def cluster_order(self, tour: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the clusters in the order in which a tour, int32[n], visits them from start to end."""
        count = self.problem.n_clusters
        named = self.label[tour]
        begin = int(np.flatnonzero(named == max(0, self.first))[0])
        rolled = np.roll(named, -begin)
        if self.second >= 0 and rolled[1] != self.second:
            rolled = np.roll(rolled[::-1], 1)
        order = rolled[rolled < count]
        if self.problem.closed:
            # Both directions cost the same. The direction is normalized, so that equal tours give equal paths.
            return np.concatenate([order[:1], order[:0:-1]]) if order[1] > order[-1] else order
        if self.problem.start is None and (self.problem.end is not None or order[0] > order[-1]):
            return order[::-1].copy()
        return order

    @property
    def service(self) -> float:
        """Total service time of all nodes. Tour lengths do not include it."""
        return float(self.problem.service.sum())

    @property
    def exact(self) -> bool:
        """Whether every cluster has a single node and costs do not depend on the direction."""
        return is_symmetric(self.problem)

    @cached_property
    def _cluster_positions(self) -> NDArray[np.float64]:
        return cluster_positions(self.problem)

    def path_positions(self, tour: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the positions along a tour, int32[n], including the given start and end, float64[m, 2]."""
        return add_path_ends(self.problem, self._cluster_positions[self.cluster_order(tour)])


def is_directed(problem: RoutingProblem) -> bool:
    """Check whether the cost between two nodes may depend on the direction."""
    matrix = problem.metric.matrix
    if matrix is not None:
        return not np.array_equal(matrix, matrix.T)
    return not np.array_equal(problem.entry, problem.exit)


def is_symmetric(problem: RoutingProblem) -> bool:
    """Check whether an `Instance` represents the problem exactly.

    That requires one node per cluster, and equal costs in both directions.
    """
    return problem.n_nodes == problem.n_clusters and not is_directed(problem)


def add_path_ends(problem: RoutingProblem, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add the problem's start and end to the points of a path, float64[m, 2], if they are given.

    A closed path ends at its first point.
    """
    if problem.closed:
        return np.concatenate([points, points[:1]])
    ends = [None if p is None else np.array([p], dtype=np.float64) for p in (problem.start, problem.end)]
    return np.concatenate([p for p in (ends[0], points, ends[1]) if p is not None])


def build_instance(problem: RoutingProblem, n_candidates: int) -> Instance:
    """Convert a problem to an `Instance`. If `n_candidates` is 0, each node has all other nodes as candidates.

    A cluster with several nodes is represented by the mean of its entries and exits.
    """
    places = cluster_positions(problem)
    n = len(places)
    first = second = free = -1
    tied = (-1, -1)
    if not problem.closed:
        ends = [p for p in (problem.start, problem.end) if p is not None]
        places = np.concatenate([places, np.array(ends, dtype=np.float64).reshape(-1, 2)])
        if len(ends) == 2:
            first, second = n + 1, n
        elif len(ends) == 1:
            first, second, free = n + 1, n, n + 1
        else:
            first = free = n
        if second >= 0:
            tied = (first, second)
    total = len(places) + (1 if free >= 0 else 0)
    explicit = problem.metric.name == "EXPLICIT"
    tree, order = build_tree(np.zeros((0, 2)) if explicit else places, apart=len(places) - n)
    label = np.arange(total, dtype=np.int32)
    label[: len(order)] = order
    xy = np.zeros((total, 2))
    xy[: len(places)] = places[label[: len(places)]]
    cost = build_cost_model(problem.metric, xy, tied, free)
    k = max(1, min(n_candidates or total, len(places) - 1))
    candidates, lengths = candidate_lists(cost, tree, len(places), total, k)
    if free >= 0:
        candidates, lengths = _add_free_node(candidates, lengths, n, free)
    return Instance(problem, cost, label, tree, candidates, lengths, first, second)


def _add_free_node(
    candidates: NDArray[np.int32], lengths: NDArray[np.float64], n: int, free: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Insert the free node as the first candidate of all n clusters, because the path may end at any cluster."""
    total, k = candidates.shape
    wider, costs = np.full((total, k + 1), -1, dtype=np.int32), np.full((total, k + 1), np.inf)
    wider[:n, 0], costs[:n, 0] = free, 0.0
    wider[:n, 1:], costs[:n, 1:] = candidates[:n], lengths[:n]
    wider[n:, :k], costs[n:, :k] = candidates[n:], lengths[n:]
    return wider, costs


def cluster_positions(problem: RoutingProblem) -> NDArray[np.float64]:
    """Compute the mean position of the entries and exits of each cluster, float64[clusters, 2], mm."""
    middle = (problem.entry + problem.exit) / 2.0
    count = np.bincount(problem.cluster, minlength=problem.n_clusters).astype(np.float64)
    columns = [
        np.bincount(problem.cluster, weights=middle[:, a], minlength=problem.n_clusters) / count for a in range(2)
    ]
    return np.stack(columns, axis=1)


def nodes_by_cluster(problem: RoutingProblem) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Sort all nodes by cluster.

    Returns the sorted nodes, int32[nodes], and the index at which each cluster starts, int32[clusters + 1].
    """
    way = np.argsort(problem.cluster, kind="stable").astype(np.int32)
    begin = np.searchsorted(problem.cluster[way], np.arange(problem.n_clusters + 1))
    return way, begin.astype(np.int32)


class MoveCosts:
    """Costs of moves between the nodes of a problem, from its start, and to its end."""

    def __init__(self, problem: RoutingProblem) -> None:
        n, self.problem = problem.n_nodes, problem
        ends = [(0.0, 0.0) if p is None or problem.closed else p for p in (problem.start, problem.end)]
        self.has_start, self.has_end = (not problem.closed and p is not None for p in (problem.start, problem.end))
        self._exits = np.int32(0 if problem.metric.name == "EXPLICIT" else n)
        self._start, self._end = np.int32(2 * n), np.int32(2 * n + 1)
        self._cost = build_cost_model(problem.metric, np.concatenate([problem.entry, problem.exit, np.array(ends)]))

    def between(self, leave: NDArray[np.int32], arrive: NDArray[np.int32]) -> NDArray[np.float64]:
        """Compute the cost of a move from each node in one array to each node in another array, float64[m, k]."""
        pairs = np.repeat(leave, len(arrive)) + self._exits, np.tile(arrive, len(leave))
        return costs_of_edges(self._cost, *pairs).reshape(len(leave), len(arrive))

    def from_start(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Compute the cost of a move from the start to each node. The cost is zero if the problem has no start."""
        if not self.has_start:
            return np.zeros(len(nodes))
        return costs_of_edges(self._cost, np.full(len(nodes), self._start), nodes)

    def to_end(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Compute the cost of a move from each node to the end. The cost is zero if the problem has no end."""
        if not self.has_end:
            return np.zeros(len(nodes))
        return costs_of_edges(self._cost, nodes + self._exits, np.full(len(nodes), self._end))

    def along_path(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Compute the cost of each move along a path, including the moves from the start and to the end."""
        if not len(nodes) and self.has_start and self.has_end:
            return costs_of_edges(self._cost, np.array([self._start]), np.array([self._end]))
        arrive = np.roll(nodes, -1) if self.problem.closed else nodes[1:]
        moves = costs_of_edges(self._cost, nodes[: len(arrive)] + self._exits, arrive)
        first = self.from_start(nodes[:1]) if self.has_start else moves[:0]
        last = self.to_end(nodes[-1:]) if self.has_end else moves[:0]
        return np.concatenate([first, moves, last])


def path_cost(problem: RoutingProblem, nodes: NDArray[np.int32]) -> float:
    """Compute the total cost of a path: travel, including the given start and end, plus service times."""
    nodes = np.asarray(nodes, dtype=np.int32)
    return float(problem.service[nodes].sum()) + float(MoveCosts(problem).along_path(nodes).sum())
