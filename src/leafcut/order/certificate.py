"""The lower bound of a solution, and the gap at which a search may stop."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Floats
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import SolveOptions
from leafcut.order.construction import nearest_neighbour
from leafcut.order.deadline import Deadline
from leafcut.order.directed import is_directed, least_costs
from leafcut.order.instance import Instance, build_instance
from leafcut.order.observing import MOST_BOUNDED
from leafcut.order.statistics import Best

#: Candidates of each node for the bound of an order that no search made.
CANDIDATES = 8

#: Where costs differ by direction, or a target can be worked in several ways, the bound is computed on a table of the
#: cheapest ways between targets: of at most so many targets, which can be worked in so many ways in all.
MOST_CLUSTERS, MOST_WAYS = 2000, 6000

#: A bound that equals the cost may exceed it by this share, since both are sums in different orders.
ROUNDING = 1e-9


def aim(options: SolveOptions, instance: Instance, best: Best, deadline: Deadline) -> None:
    """With `--target-gap`, find the lower bound and let the search stop near it. The clock is stopped meanwhile.

    Without a bound before the deadline the search has no target.

    Raises
    ------
    SolveError
        There is no bound for this problem.
    """
    if options.target_gap is None:
        return
    stop = best.stop
    with stop.paused(), deadline.running(stop.cancelled) as late:
        upper = instance.length(nearest_neighbour(instance))
        best.bound = bound_of(instance, upper, stop.cancelled, late)
        over = late()
    if best.bound is not None:
        stop.target = best.bound * (1.0 + options.target_gap / 100.0) - best.service
    elif not over:
        raise _no_bound(instance.problem)


def foresee(problem: RoutingProblem, options: SolveOptions, best: Best, instance: Instance | None = None) -> None:
    """Find a lower bound for a search that is watched, so that the gap is shown from the start.

    The clock is stopped meanwhile. The bound of the certificate is computed afterwards as usual: watching changes
    nothing.
    """
    wanted = best.watched is not None and best.bound is None and options.bound
    relaxed = relaxation(problem) if wanted and problem.n_clusters <= MOST_BOUNDED else None
    if relaxed is None:
        return
    with best.stop.paused():
        if instance is None or relaxed is not problem:
            instance = build_instance(relaxed, CANDIDATES)
        upper = instance.length(nearest_neighbour(instance))
        best.shown_bound = bound_of(instance, upper, best.stop.cancelled)


def aim_without_order(options: SolveOptions, problem: RoutingProblem, best: Best, deadline: Deadline) -> None:
    """As `aim`, for a problem with direction or precedence: by the bound of its relaxation.

    Raises
    ------
    SolveError
        There is no bound for this problem.
    """
    if options.target_gap is None:
        return
    with best.stop.paused(), deadline.running(best.stop.cancelled) as late:
        relaxed, over = relaxation(problem, late), late()
        instance = None if relaxed is None else build_instance(relaxed, CANDIDATES)
    if instance is not None:
        aim(options, instance, best, deadline)
    elif not over:
        raise _no_bound(problem)


def _no_bound(problem: RoutingProblem) -> SolveError:
    what = f"{problem.n_clusters:,} targets"
    if problem.n_nodes > problem.n_clusters:
        what += " that can be worked more than one way"
    elif is_directed(problem):
        what += " with costs that differ by direction"
    return SolveError(
        f"--target-gap: no lower bound is available for {what}; give --time-limit or --iterations instead"
    )


def relaxation(problem: RoutingProblem, late: Callable[[], bool] = lambda: False) -> RoutingProblem | None:
    """Return a problem with equal costs in both directions whose bound also holds for `problem`, or None.

    It has no precedence, and a node for each cluster: a way between two of them costs what the cheapest between any of
    their nodes does, in the cheaper direction, and the work in one what it costs by its cheapest node. A path from a
    start to an end becomes a closed tour with one node more. When it is `late`, it is given up: None.
    """
    if stands_for_its_tour(problem):
        return problem
    if problem.n_clusters > MOST_CLUSTERS or problem.n_nodes > MOST_WAYS:
        return None
    table = least_costs(problem, late)
    if table is None:
        return None
    service = np.zeros(len(table))
    service[: problem.n_clusters] = _least_service(problem)
    metric = Metric("EXPLICIT", matrix=np.minimum(table, table.T))
    relaxed = RoutingProblem.of_points(np.zeros((len(table), 2)), metric, closed=True)
    return replace(relaxed, service=service)


def _least_service(problem: RoutingProblem) -> Floats:
    """Return what the work in each cluster costs at least, float64[clusters]."""
    least = np.full(problem.n_clusters, np.inf)
    np.minimum.at(least, problem.cluster, problem.service)
    return least


def certify(
    problem: RoutingProblem, solution: Solution, bound: float | None, cancelled: threading.Event,
    instance: Instance | None = None, deadline: Deadline | None = None,
) -> Solution:  # fmt: skip
    """Return `solution` with its lower bound: `bound` if it is known, else a new one.

    The bound ignores precedence, which can only raise the cost (`relaxation`). A stopped search gets no new bound. A
    bound above the cost of the solution is dropped. At the deadline it is what was proved until then, if anything.
    """
    if bound is None and not cancelled.is_set():
        with (deadline or Deadline()).running(cancelled) as late:
            relaxed = relaxation(problem, late)
            if relaxed is not None:
                if instance is None or relaxed is not problem:
                    instance = build_instance(relaxed, CANDIDATES)
                upper = solution.cost - float(relaxed.service.sum())
                bound = bound_of(instance, upper, cancelled, late)
    if bound is None or bound > solution.cost + ROUNDING * abs(solution.cost):
        return solution
    return replace(solution, lower_bound=min(bound, solution.cost))


def bound_of(
    instance: Instance, upper: float, cancelled: threading.Event, late: Callable[[], bool] = lambda: False
) -> float | None:
    """Return the lower bound of the cost of any path of the problem, service included, or None.

    `upper` is the travel cost of a known path. Ctrl-C sets `cancelled`, which ends the search for a bound, as does
    being `late`.
    """
    from leafcut.order.bound import lower_bound

    problem = instance.problem
    if not stands_for_its_tour(problem):
        return None
    try:
        bound = lower_bound(instance, upper, stop=lambda: cancelled.is_set() or late())
    except KeyboardInterrupt:
        cancelled.set()
        return None
    return None if bound is None else bound + float(problem.service.sum())


def stands_for_its_tour(problem: RoutingProblem) -> bool:
    """Return whether a tour of the clusters costs as much as the path: one node each, same costs both ways."""
    return problem.n_nodes == problem.n_clusters and not is_directed(problem)
