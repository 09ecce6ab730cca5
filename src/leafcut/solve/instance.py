"""`Instance`: a routing problem in the arrays that kernels take, as one closed tour.

An open path becomes a closed tour by extra nodes: a given start and end are nodes whose edge to each other is tied; a
free end is a node that costs nothing to reach. A tour over these nodes is a path over the clusters, at the same cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import candidates as candidate_kernels
from leafcut.kernels import cost as codes
from leafcut.kernels.cost import CostModel, sequence_cost
from leafcut.kernels.neighbours import LEAF_SIZE, Tree, grow_tree
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

#: Up to this many nodes "all nodes are candidates" may be asked for: the lists then take n² memory.
FULL_LISTS_LIMIT = 3000


def cost_model(metric: Metric, xy: NDArray[np.float64], tied: tuple[int, int] = (-1, -1), free: int = -1) -> CostModel:
    """Return the kernel's form of a metric over the points float64[n, 2]."""
    zones = np.ascontiguousarray(metric.zones, dtype=np.float64).reshape(-1, 4)
    return CostModel(
        code=_CODES[metric.name],
        plain=tied == (-1, -1) and free < 0 and not len(zones) and metric.name != "EXPLICIT",
        xy=np.ascontiguousarray(xy, dtype=np.float64),
        vx=float(metric.velocity[0]),
        vy=float(metric.velocity[1]),
        ax=float(metric.acceleration[0]),
        ay=float(metric.acceleration[1]),
        per_mm=float(metric.per_mm),
        zones=zones,
        lift=float(metric.lift),
        matrix=np.zeros((0, 0)) if metric.matrix is None else np.ascontiguousarray(metric.matrix, dtype=np.float64),
        tied_a=tied[0],
        tied_b=tied[1],
        free=free,
    )


def plant_tree(xy: NDArray[np.float64]) -> Tree:
    """Return the k-d tree of the points float64[n, 2]; n may be 0."""
    n = len(xy)
    room = max(1, 8 * n // LEAF_SIZE + 4)
    x, y = np.ascontiguousarray(xy[:, 0]), np.ascontiguousarray(xy[:, 1])
    order, leaf_of = np.arange(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    begin, stop, child, parent = (np.zeros(room, dtype=np.int32) for _ in range(4))
    axis, split = np.zeros(room, dtype=np.int8), np.zeros(room)
    m = grow_tree(x, y, order, leaf_of, begin, stop, axis, split, child, parent)
    parts: list[Any] = [np.ascontiguousarray(a[:m]) for a in (begin, stop, axis, split, child, parent)]
    return Tree(x, y, order, leaf_of, *parts)


@dataclass(frozen=True, eq=False)
class Instance:
    """One closed tour to be found.

    Attributes
    ----------
    problem
        What it was made of.
    cost
        Over the clusters' places, then the start, the end and the free node, as far as there are any.
    tree
        Of all nodes that have a place; of none when costs are explicit.
    candidates
        int32[n, k], -1 where there are fewer.
    first, second
        The nodes that every construction begins with; -1 for any.
    """

    problem: RoutingProblem
    cost: CostModel
    tree: Tree
    candidates: NDArray[np.int32]
    first: int
    second: int

    @property
    def n(self) -> int:
        """Number of nodes of the tour, extra ones included."""
        return len(self.candidates)

    def path(self, tour: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the clusters in the order in which the tour int32[n] visits them, from start to end."""
        count = self.problem.n_clusters
        begin = int(np.flatnonzero(tour == (self.first if self.first >= 0 else 0))[0])
        rolled = np.roll(tour, -begin)
        if self.second >= 0 and rolled[1] != self.second:
            rolled = np.roll(rolled[::-1], 1)
        order = rolled[rolled < count].astype(np.int32)
        if self.problem.closed:
            # Both ways round cost the same: say it always the same way.
            return np.concatenate([order[:1], order[:0:-1]]) if order[1] > order[-1] else order
        if self.problem.start is None and (self.problem.end is not None or order[0] > order[-1]):
            return order[::-1].copy()
        return order


def build_instance(problem: RoutingProblem, n_candidates: int) -> Instance:
    """Return the closed tour that stands for `problem`; `n_candidates` = 0 makes every node a candidate of every other.

    A cluster of several nodes stands at the mean of its entries and exits; which node serves is chosen afterwards
    (`solve.clusters`).
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
    xy = np.concatenate([places, np.zeros((total - len(places), 2))])
    cost = cost_model(problem.metric, xy, tied, free)
    tree = plant_tree(np.zeros((0, 2)) if explicit else places)
    wanted = n_candidates or total
    k = max(1, min(wanted, len(places) - 1))
    lists = np.full((total, k), -1, dtype=np.int32)
    if explicit or k >= len(places) - 1:
        candidate_kernels.fill_candidates_by_cost(cost, len(places), lists)
    else:
        found, near = np.zeros(k, dtype=np.int32), np.zeros(k)
        per_quadrant = min(PER_QUADRANT, max(1, k // 4))
        candidate_kernels.fill_candidates(cost, tree, per_quadrant, lists, found, near, np.zeros(64, dtype=np.int32))
    return Instance(problem, cost, tree, lists, first, second)


def cluster_places(problem: RoutingProblem) -> NDArray[np.float64]:
    """Return the place of every cluster, float64[clusters, 2]: the mean of its nodes' entries and exits, mm."""
    middle = (problem.entry + problem.exit) / 2.0
    count = np.bincount(problem.cluster, minlength=problem.n_clusters).astype(np.float64)
    columns = [
        np.bincount(problem.cluster, weights=middle[:, a], minlength=problem.n_clusters) / count for a in range(2)
    ]
    return np.stack(columns, axis=1)


def path_cost(problem: RoutingProblem, nodes: NDArray[np.int32]) -> float:
    """Return travel and service along `nodes`, added up edge by edge, ends included."""
    n = problem.n_nodes
    given = [problem.start if not problem.closed else None, problem.end if not problem.closed else None]
    if problem.metric.name == "EXPLICIT":
        xy, exits = problem.entry, nodes
    else:
        ends = np.array([p if p is not None else (0.0, 0.0) for p in given])
        xy, exits = np.concatenate([problem.entry, problem.exit, ends]), nodes + n
    leave = np.concatenate([[2 * n] if given[0] is not None else [], exits]).astype(np.int32)
    arrive = np.concatenate([nodes, [2 * n + 1] if given[1] is not None else []]).astype(np.int32)
    if problem.closed:
        arrive = np.roll(arrive, -1)
    elif given[0] is None:
        arrive = arrive[1:]
    legs = min(len(leave), len(arrive))
    return float(problem.service[nodes].sum()) + sequence_cost(
        cost_model(problem.metric, xy), leave[:legs], arrive[:legs]
    )
