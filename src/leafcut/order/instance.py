"""`Instance`: a routing problem in the arrays that kernels take, as one closed tour.

An open path becomes a closed tour by extra nodes: a given start and end are nodes whose edge to each other is tied; a
free end is a node that costs nothing to reach. A tour over these nodes is a path over the clusters, at the same cost.

Nodes are numbered for locality: what is near in the plane is near in memory. `Instance.label` says which cluster a node
is; the extra nodes come last.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.kernels import candidates as candidate_kernels
from leafcut.kernels import cost as codes
from leafcut.kernels.cost import CostModel, edge_costs, tour_cost
from leafcut.kernels.neighbours import MOST_TWINS, Nearby, Tree, grow_tree
from leafcut.model.problem import Metric, RoutingProblem

_CODES = {
    "euclidean": codes.EUCLIDEAN,
    "chebyshev": codes.CHEBYSHEV,
    "manhattan": codes.MANHATTAN,
    "EUC_2D": codes.EUC_2D,
    "CEIL_2D": codes.CEIL_2D,
    "ATT": codes.ATT,
    "GEO": codes.GEO,
    "MAX_2D": codes.MAX_2D,
    "MAN_2D": codes.MAN_2D,
    "EXPLICIT": codes.EXPLICIT,
    "linear": codes.LINEAR,
    "dogleg": codes.DOGLEG,
}

#: Neighbours per quadrant in a candidate list, before the nearest of all fill it.
PER_QUADRANT = 2

#: So many rows of a table are looked at in one go: bounds memory.
ROWS_AT_ONCE = 256

#: Up to this many nodes "all nodes are candidates" may be asked for: the lists then take n² memory.
FULL_LISTS_LIMIT = 3000


def cost_model(metric: Metric, xy: NDArray[np.float64], tied: tuple[int, int] = (-1, -1), free: int = -1) -> CostModel:
    """Return the kernel's form of a metric over the points float64[n, 2]."""
    zones = np.ascontiguousarray(metric.zones, dtype=np.float64).reshape(-1, 4)
    return CostModel(
        code=_CODES[metric.name],
        plain=tied == (-1, -1) and free < 0 and not len(zones) and metric.name != "EXPLICIT" and metric.relief is None,
        xy=np.ascontiguousarray(xy, dtype=np.float64),
        vx=float(metric.velocity[0]),
        vy=float(metric.velocity[1]),
        ax=float(metric.acceleration[0]),
        ay=float(metric.acceleration[1]),
        per_mm=float(metric.per_mm),
        zones=zones,
        lift=float(metric.lift),
        matrix=_table(metric, xy),
        tied_a=tied[0],
        tied_b=tied[1],
        free=free,
    )


def _table(metric: Metric, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the costs of an EXPLICIT metric, or the heights of places and tiles (`kernels.cost.RELIEF`)."""
    if metric.matrix is not None:
        return np.ascontiguousarray(metric.matrix, dtype=np.float64)
    relief = metric.relief
    if relief is None:
        return np.zeros((0, 0))
    rows, columns = relief.safe.shape
    width = max(columns, codes.RELIEF)
    above = -(-len(xy) // width)
    table = np.zeros((1 + above + rows, width))
    table[0, : codes.RELIEF] = (
        relief.x, relief.y, relief.side, relief.velocity, relief.acceleration, above, columns,
    )  # fmt: skip
    table[1 : 1 + above].reshape(-1)[: len(xy)] = relief.at(xy)
    table[1 + above :, :columns] = relief.safe
    return table


def matrix_of(cost: CostModel, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the matrix of a cost model over some nodes, int32[m]: their costs, or their heights and the tiles."""
    if cost.code == codes.EXPLICIT:
        return np.ascontiguousarray(cost.matrix[np.ix_(nodes, nodes)])
    if not len(cost.matrix):
        return cost.matrix
    first, width = 1 + int(cost.matrix[0, 5]), cost.matrix.shape[1]
    heights = cost.matrix[1:first].reshape(-1)[nodes]
    above = -(-len(nodes) // width)
    table = np.zeros((1 + above + len(cost.matrix) - first, width))
    table[0], table[1 + above :] = cost.matrix[0], cost.matrix[first:]
    table[0, 5] = above
    table[1 : 1 + above].reshape(-1)[: len(nodes)] = heights
    return table


def plant_tree(xy: NDArray[np.float64], apart: int = 0) -> tuple[Tree, NDArray[np.int32]]:
    """Return the k-d tree of the points float64[n, 2], and int32[n]: which of them each point of the tree is.

    The tree numbers the points in the order of its leaves; the last `apart` of them (at most two) keep their numbers.
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
    m = grow_tree(x, y, label, apart, leaf_of, begin, stop, box, child, parent, stack)
    return Tree(x, y, leaf_of, begin[:m], stop[:m], box[:m], child[:m], parent[:m]), label


def nearby_buffers(k: int) -> Nearby:
    """Return what one worker needs to search for k neighbours."""
    width = max(k, MOST_TWINS)
    return Nearby(
        found=np.zeros((6, width), dtype=np.int32),
        near=np.zeros((6, width)),
        chosen=np.zeros(width, dtype=np.int32),
        limit=np.zeros(6),
        stack=np.zeros(64, dtype=np.int32),
    )


def candidate_lists(cost: CostModel, tree: Tree, n: int, total: int, k: int) -> tuple[NDArray, NDArray]:
    """Return candidates int32[total, k] of the first n nodes, and their costs float64[total, k].

    By the tree, each in its quadrant; by looking at all nodes where the tree is of none, or where all are wanted. Where
    there are fewer than k: -1, at an infinite cost.
    """
    candidates, lengths = np.full((total, k), -1, dtype=np.int32), np.full((total, k), np.inf)
    if len(tree.x) == 0 or k >= n - 1:
        _list_cheapest(cost, n, candidates, lengths)
        return candidates, lengths
    per_quadrant = min(PER_QUADRANT, max(1, k // 4))
    candidate_kernels.fill_candidates(cost, tree, per_quadrant, 0, n, candidates, lengths, nearby_buffers(k))
    return candidates, lengths


def costs_of_edges(cost: CostModel, leave: NDArray[np.int32], arrive: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return what it costs to travel from leave[e] to arrive[e], int32[m] each; `TIED` for a tied edge."""
    costs = np.zeros(len(leave))
    edge_costs(cost, leave, arrive, costs)
    return costs


def _list_cheapest(cost: CostModel, n: int, candidates: NDArray[np.int32], lengths: NDArray[np.float64]) -> None:
    """Fill the lists of the first n nodes with the cheapest others, of equally cheap ones the first."""
    nodes, size = np.arange(n, dtype=np.int32), min(candidates.shape[1], n - 1)
    if cost.code == codes.EXPLICIT and cost.tied_a < 0 and not 0 <= cost.free < n and 0 < size < n - 1:
        for begin in range(0, n, ROWS_AT_ONCE):
            rows = nodes[begin : begin + ROWS_AT_ONCE]
            _list_cheapest_of_table(cost.matrix[rows, :n], rows, candidates[rows[0] :], lengths[rows[0] :], size)
        return
    for i in range(n):
        others = np.delete(nodes, i)
        costs = costs_of_edges(cost, np.full(n - 1, i, dtype=np.int32), others)
        if size < n - 1:
            few = np.flatnonzero(costs <= np.partition(costs, size - 1)[size - 1])
            others, costs = others[few], costs[few]
        order = np.argsort(costs, kind="stable")[:size]
        candidates[i, :size], lengths[i, :size] = others[order], costs[order]


def _list_cheapest_of_table(
    costs: NDArray[np.float64],
    rows: NDArray[np.int32],
    candidates: NDArray[np.int32],
    lengths: NDArray[np.float64],
    size: int,
) -> None:
    """Fill the first lists as `_list_cheapest` does, for some rows of a table of costs float64[m, n], in one go."""
    own = np.arange(len(rows))
    costs[own, rows] = np.inf
    row, column = np.nonzero(costs <= np.partition(costs, size - 1, axis=1)[:, size - 1 : size])
    others = column != rows[row]
    row, column = row[others], column[others]
    value = costs[row, column]
    # Stable: of equally cheap ones the first stays first.
    order = np.lexsort((value, row))
    place = np.arange(len(row)) - np.searchsorted(row, row)
    kept = place < size
    candidates[row[kept], place[kept]] = column[order[kept]]
    lengths[row[kept], place[kept]] = value[order[kept]]


@dataclass(frozen=True, eq=False)
class Instance:
    """One closed tour to be found.

    Attributes
    ----------
    problem
        What it was made of.
    cost
        Over the clusters' places, then the start, the end and the free node, as far as there are any.
    label
        int32[n]: the cluster that a node stands for; the extra nodes, which come last, have their own numbers.
    tree
        Of all nodes that have a place; of none when costs are explicit.
    candidates
        int32[n, k], -1 where there are fewer. The free node is the first of every cluster; see `exchange_lists`.
    lengths
        float64[n, k]: their costs, infinite where there are fewer.
    first, second
        The nodes that every construction begins with; -1 for any.
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
        """Number of nodes of the tour, extra ones included."""
        return len(self.candidates)

    @cached_property
    def exchange_lists(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """The candidates and their costs without the free node, int32[n, k] and float64[n, k]: those for exchanges.

        Moves that begin at the free node find all there is to gain with it. As first candidate of every node it made
        the search longer, and its tours no shorter.
        """
        if self.cost.free < 0:
            return self.candidates, self.lengths
        listed = self.candidates[:, :1] == self.cost.free
        return (
            np.where(listed, self.candidates[:, 1:], self.candidates[:, :-1]),
            np.where(listed, self.lengths[:, 1:], self.lengths[:, :-1]),
        )

    @property
    def home(self) -> int:
        """The node that a tour begins with when nothing else is said: the given start, or the first cluster."""
        return self.first if self.first >= 0 else int(np.flatnonzero(self.label == 0)[0])

    def length(self, tour: NDArray[np.int32]) -> float:
        """Return what a tour int32[n] costs."""
        return float(tour_cost(self.cost, tour))

    def costs(self, leave: ArrayLike, arrive: ArrayLike) -> NDArray[np.float64]:
        """Return what it costs to go from nodes to nodes, one by one or each from the same; `TIED` for a tied edge."""
        pairs = np.broadcast_arrays(np.atleast_1d(leave), np.atleast_1d(arrive))
        return costs_of_edges(self.cost, *(np.ascontiguousarray(nodes, dtype=np.int32) for nodes in pairs))

    def path(self, tour: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the clusters in the order in which the tour int32[n] visits them, from start to end."""
        count = self.problem.n_clusters
        named = self.label[tour]
        begin = int(np.flatnonzero(named == max(0, self.first))[0])
        rolled = np.roll(named, -begin)
        if self.second >= 0 and rolled[1] != self.second:
            rolled = np.roll(rolled[::-1], 1)
        order = rolled[rolled < count]
        if self.problem.closed:
            # Both ways round cost the same: say it always the same way.
            return np.concatenate([order[:1], order[:0:-1]]) if order[1] > order[-1] else order
        if self.problem.start is None and (self.problem.end is not None or order[0] > order[-1]):
            return order[::-1].copy()
        return order

    @property
    def service(self) -> float:
        """The service time of all nodes, which lengths of tours leave out."""
        return float(self.problem.service.sum())

    @property
    def exact(self) -> bool:
        """Whether each cluster has one node and the costs are the same in both directions."""
        return is_symmetric(self.problem)

    @cached_property
    def _places(self) -> NDArray[np.float64]:
        return cluster_places(self.problem)

    def places(self, tour: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the places of the clusters along the tour int32[n], float64[m, 2], with the ends of the problem."""
        return with_ends(self.problem, self._places[self.path(tour)])


def is_directed(problem: RoutingProblem) -> bool:
    """Return whether the costs between two nodes may differ by direction."""
    matrix = problem.metric.matrix
    if matrix is not None:
        return not np.array_equal(matrix, matrix.T)
    return not np.array_equal(problem.entry, problem.exit)


def is_symmetric(problem: RoutingProblem) -> bool:
    """Return whether a tour of the clusters costs as much as the path: one node each, same costs in both directions."""
    return problem.n_nodes == problem.n_clusters and not is_directed(problem)


def with_ends(problem: RoutingProblem, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points float64[m, 2] of a path with the given ends; a closed path ends at its first point."""
    if problem.closed:
        return np.concatenate([points, points[:1]])
    ends = [None if p is None else np.array([p], dtype=np.float64) for p in (problem.start, problem.end)]
    return np.concatenate([p for p in (ends[0], points, ends[1]) if p is not None])


def build_instance(problem: RoutingProblem, n_candidates: int) -> Instance:
    """Return the closed tour that stands for `problem`; `n_candidates` = 0 makes every node a candidate of every other.

    A cluster of several nodes stands at the mean of its entries and exits; which node serves is chosen afterwards
    (`order.exact.choose_nodes`).
    """
    places = cluster_places(problem)
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
    tree, order = plant_tree(np.zeros((0, 2)) if explicit else places, apart=len(places) - n)
    label = np.arange(total, dtype=np.int32)
    label[: len(order)] = order
    xy = np.zeros((total, 2))
    xy[: len(places)] = places[label[: len(places)]]
    cost = cost_model(problem.metric, xy, tied, free)
    k = max(1, min(n_candidates or total, len(places) - 1))
    candidates, lengths = candidate_lists(cost, tree, len(places), total, k)
    if free >= 0:
        candidates, lengths = _with_free(candidates, lengths, n, free)
    return Instance(problem, cost, label, tree, candidates, lengths, first, second)


def _with_free(
    candidates: NDArray[np.int32], lengths: NDArray[np.float64], n: int, free: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the lists with the free node as the first candidate of the n clusters: any of them may be an end."""
    total, k = candidates.shape
    wider, costs = np.full((total, k + 1), -1, dtype=np.int32), np.full((total, k + 1), np.inf)
    wider[:n, 0], costs[:n, 0] = free, 0.0
    wider[:n, 1:], costs[:n, 1:] = candidates[:n], lengths[:n]
    wider[n:, :k], costs[n:, :k] = candidates[n:], lengths[n:]
    return wider, costs


def cluster_places(problem: RoutingProblem) -> NDArray[np.float64]:
    """Return the place of every cluster, float64[clusters, 2]: the mean of its nodes' entries and exits, mm."""
    middle = (problem.entry + problem.exit) / 2.0
    count = np.bincount(problem.cluster, minlength=problem.n_clusters).astype(np.float64)
    columns = [
        np.bincount(problem.cluster, weights=middle[:, a], minlength=problem.n_clusters) / count for a in range(2)
    ]
    return np.stack(columns, axis=1)


class MoveCosts:
    """Costs of moves between the nodes of a problem, and from and to its given ends."""

    def __init__(self, problem: RoutingProblem) -> None:
        n, self.problem = problem.n_nodes, problem
        ends = [(0.0, 0.0) if p is None or problem.closed else p for p in (problem.start, problem.end)]
        self.has_start, self.has_end = (not problem.closed and p is not None for p in (problem.start, problem.end))
        self._exits = np.int32(0 if problem.metric.name == "EXPLICIT" else n)
        self._start, self._end = np.int32(2 * n), np.int32(2 * n + 1)
        self._cost = cost_model(problem.metric, np.concatenate([problem.entry, problem.exit, np.array(ends)]))

    def between(self, leave: NDArray[np.int32], arrive: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the costs from each node of one array to each node of another, float64[m, k]."""
        pairs = np.repeat(leave, len(arrive)) + self._exits, np.tile(arrive, len(leave))
        return costs_of_edges(self._cost, *pairs).reshape(len(leave), len(arrive))

    def from_start(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the costs from the start to each node; zero without a start."""
        if not self.has_start:
            return np.zeros(len(nodes))
        return costs_of_edges(self._cost, np.full(len(nodes), self._start), nodes)

    def to_end(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the costs from each node to the end; zero without an end."""
        if not self.has_end:
            return np.zeros(len(nodes))
        return costs_of_edges(self._cost, nodes + self._exits, np.full(len(nodes), self._end))

    def along(self, nodes: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the costs of the moves along a path, given ends included."""
        if not len(nodes) and self.has_start and self.has_end:
            return costs_of_edges(self._cost, np.array([self._start]), np.array([self._end]))
        arrive = np.roll(nodes, -1) if self.problem.closed else nodes[1:]
        moves = costs_of_edges(self._cost, nodes[: len(arrive)] + self._exits, arrive)
        first = self.from_start(nodes[:1]) if self.has_start else moves[:0]
        last = self.to_end(nodes[-1:]) if self.has_end else moves[:0]
        return np.concatenate([first, moves, last])


def path_cost(problem: RoutingProblem, nodes: NDArray[np.int32]) -> float:
    """Return travel and service along `nodes`, added up edge by edge, ends included."""
    nodes = np.asarray(nodes, dtype=np.int32)
    return float(problem.service[nodes].sum()) + float(MoveCosts(problem).along(nodes).sum())
