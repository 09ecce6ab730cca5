"""Compute a lower bound for a solution."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.order.bound import lower_bound
from leafcut.order.construction import nearest_neighbour_tour
from leafcut.order.directed import AnyInstance, cheapest_move_costs
from leafcut.order.instance import CANDIDATES, Instance, build_instance, is_symmetric
from leafcut.order.search import Best
from leafcut.order.stop import Deadline

#: Limits for computing a bound if costs are asymmetric or clusters have several nodes. The computation stores the
#: cheapest move between every two clusters in a table.
MOST_CLUSTERS, MOST_WAYS = 2000, 6000

#: Observers see a lower bound for problems with up to this many clusters.
MOST_BOUNDED = 20_000

#: A bound may exceed an equal cost by this relative amount, because the two are summed in different orders.
ROUNDING = 1e-9


def compute_bound_for_observers(instance: AnyInstance, best: Best) -> None:
    """Compute a lower bound for the observer of a search while the search clock is stopped.

    The bound has no effect on the search result.
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
    """Compute a lower bound on the cost of any path, or return None if that is not possible.

    `cost` is the cost of a known path, or None. If `instance` also represents the relaxed problem, it is reused.
    """
    relaxed = symmetric_relaxation(problem, late)
    if relaxed is None:
        return None
    if relaxed is not problem or not isinstance(instance, Instance):
        instance = build_instance(relaxed, CANDIDATES)
    upper = instance.length(nearest_neighbour_tour(instance)) if cost is None else cost - instance.service
    try:
        bound = lower_bound(instance, upper, stop=late)
    except KeyboardInterrupt:
        cancelled.set()
        return None
    return None if bound is None else bound + instance.service


def symmetric_relaxation(problem: RoutingProblem, late: Callable[[], bool] = lambda: False) -> RoutingProblem | None:
    """Relax a problem to a symmetric problem whose lower bound is also valid for the original problem.

    The relaxed problem has no precedence and only one node per cluster. A move between two clusters costs as much as
    the cheapest move between their nodes, in either direction. The service time of a cluster is the smallest service
    time of its nodes. If the path is open, an additional node closes it to a tour.

    Returns None after the deadline (`late`) or if the table would be too large.
    """
    if is_symmetric(problem):
        return problem
    if problem.n_clusters > MOST_CLUSTERS or problem.n_nodes > MOST_WAYS:
        return None
    table = cheapest_move_costs(problem, late)
    if table is None:
        return None
    service = np.zeros(len(table))
    service[: problem.n_clusters] = _minimum_service_times(problem)
    metric = Metric("EXPLICIT", matrix=np.minimum(table, table.T))
    relaxed = RoutingProblem.of_points(np.zeros((len(table), 2)), metric, closed=True)
    return replace(relaxed, service=service)


def _minimum_service_times(problem: RoutingProblem) -> Floats:
    least = np.full(problem.n_clusters, np.inf)
    np.minimum.at(least, problem.cluster, problem.service)
    return least


def add_lower_bound(
    problem: RoutingProblem,
    solution: Solution,
    bound: float | None,
    cancelled: threading.Event,
    instance: AnyInstance | None = None,
    deadline: Deadline | None = None,
) -> Solution:
    """Add a lower bound to `solution`. If no `bound` is given, compute one.

    If the user cancels the search, no bound is computed. The bound ignores precedence, which can only raise the cost
    (`symmetric_relaxation`). A bound that exceeds the cost is discarded.
    """
    if bound is None and not cancelled.is_set():
        with (deadline or Deadline()).running(cancelled) as late:
            bound = _prove_bound(problem, instance, solution.cost, cancelled, late)
    if bound is None or bound > solution.cost + ROUNDING * abs(solution.cost):
        return solution
    return replace(solution, lower_bound=min(bound, solution.cost))
