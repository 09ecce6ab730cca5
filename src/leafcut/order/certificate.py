"""Compute the lower bound of a solution."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.order.bound import lower_bound
from leafcut.order.construction import nearest_neighbour
from leafcut.order.directed import AnyInstance, least_costs
from leafcut.order.instance import CANDIDATES, Instance, build_instance, is_symmetric
from leafcut.order.search import Best
from leafcut.order.stop import Deadline

#: Maximum number of clusters and of nodes for a bound with asymmetric costs or several nodes per cluster, which uses a
#: table of the cheapest moves between clusters.
MOST_CLUSTERS, MOST_WAYS = 2000, 6000

#: Maximum number of clusters for the lower bound that observers see.
MOST_BOUNDED = 20_000

#: Maximum relative excess of a bound over an equal cost, because both are sums in different orders.
ROUNDING = 1e-9


def compute_shown_bound(instance: AnyInstance, best: Best) -> None:
    """Compute a lower bound for the observer of a search, while the clock is stopped.

    The bound does not change the result of the search.
    """
    if instance.problem.n_clusters > MOST_BOUNDED:
        return
    cancelled = best.stop.cancelled
    with best.stop.paused():
        best.shown_bound = _prove_bound(instance.problem, instance, None, cancelled, cancelled.is_set)


def _prove_bound(
    problem: RoutingProblem,
    instance: AnyInstance | None,
    cost: float | None,
    cancelled: threading.Event,
    late: Callable[[], bool],
) -> float | None:
    """Return a lower bound on the cost of any path of the problem, or None.

    `cost` is the cost of a known path, or None. `instance` is reused if it also represents the relaxed problem.
    """
    relaxed = symmetric_relaxation(problem, late)
    if relaxed is None:
        return None
    if relaxed is not problem or not isinstance(instance, Instance):
        instance = build_instance(relaxed, CANDIDATES)
    upper = instance.length(nearest_neighbour(instance)) if cost is None else cost - instance.service
    try:
        bound = lower_bound(instance, upper, stop=late)
    except KeyboardInterrupt:
        cancelled.set()
        return None
    return None if bound is None else bound + instance.service


def symmetric_relaxation(problem: RoutingProblem, late: Callable[[], bool] = lambda: False) -> RoutingProblem | None:
    """Return a symmetric problem whose lower bound also holds for `problem`, or None.

    It has no precedence and one node per cluster. Moves between two clusters cost as much as the cheapest move between
    their nodes in either direction; the service time of a cluster is the minimum over its nodes. A path from a start to
    an end becomes a closed tour with an additional node. Returns None after the deadline (`late`), or if the table
    would be too large.
    """
    if is_symmetric(problem):
        return problem
    if problem.n_clusters > MOST_CLUSTERS or problem.n_nodes > MOST_WAYS:
        return None
    table = least_costs(problem, late)
    if table is None:
        return None
    service = np.zeros(len(table))
    service[: problem.n_clusters] = _minimum_service(problem)
    metric = Metric("EXPLICIT", matrix=np.minimum(table, table.T))
    relaxed = RoutingProblem.of_points(np.zeros((len(table), 2)), metric, closed=True)
    return replace(relaxed, service=service)


def _minimum_service(problem: RoutingProblem) -> Floats:
    least = np.full(problem.n_clusters, np.inf)
    np.minimum.at(least, problem.cluster, problem.service)
    return least


def certify(
    problem: RoutingProblem,
    solution: Solution,
    bound: float | None,
    cancelled: threading.Event,
    instance: AnyInstance | None = None,
    deadline: Deadline | None = None,
) -> Solution:
    """Return `solution` with a lower bound: the given `bound`, or else a computed one.

    No bound is computed for a cancelled search. The bound ignores precedence, which can only raise the cost
    (`symmetric_relaxation`). A bound above the cost is dropped.
    """
    if bound is None and not cancelled.is_set():
        with (deadline or Deadline()).running(cancelled) as late:
            bound = _prove_bound(problem, instance, solution.cost, cancelled, late)
    if bound is None or bound > solution.cost + ROUNDING * abs(solution.cost):
        return solution
    return replace(solution, lower_bound=min(bound, solution.cost))
