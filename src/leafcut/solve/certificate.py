"""The lower bound of a solution, and the gap at which a search may stop."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np

from leafcut.errors import SolveError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import SolveOptions
from leafcut.solve.construction import nearest_neighbour
from leafcut.solve.directed import build_directed, is_directed
from leafcut.solve.instance import Instance, build_instance, costs_of_edges
from leafcut.solve.observing import MOST_BOUNDED
from leafcut.solve.statistics import Best

#: Candidates of each node for the bound of an order that no search made.
CANDIDATES = 8

#: With costs that differ by direction the bound is computed up to this many nodes, on a table of all costs.
MOST_DIRECTED = 2000

#: A bound that equals the cost may exceed it by this share, since both are sums in different orders.
ROUNDING = 1e-9


def aim(options: SolveOptions, instance: Instance, best: Best) -> None:
    """With `--target-gap`, find the lower bound and let the search stop near it. The clock is stopped meanwhile.

    Raises
    ------
    SolveError
        There is no bound for this problem.
    """
    if options.target_gap is None:
        return
    stop = best.stop
    with stop.paused():
        upper = instance.length(nearest_neighbour(instance))
        best.bound = bound_of(instance, upper, stop.cancelled)
    if best.bound is not None:
        stop.target = best.bound * (1.0 + options.target_gap / 100.0) - best.service
    elif not stop.cancelled.is_set():
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


def aim_without_order(options: SolveOptions, problem: RoutingProblem, best: Best) -> None:
    """As `aim`, for a problem with direction or precedence: by the bound of its relaxation.

    Raises
    ------
    SolveError
        There is no bound for this problem.
    """
    if options.target_gap is None:
        return
    relaxed = relaxation(problem)
    if relaxed is None:
        raise _no_bound(problem)
    aim(options, build_instance(relaxed, CANDIDATES), best)


def _no_bound(problem: RoutingProblem) -> SolveError:
    what = f"{problem.n_clusters:,} targets"
    if problem.n_nodes > problem.n_clusters:
        what += " that can be worked more than one way"
    elif is_directed(problem):
        what += " with costs that differ by direction"
    return SolveError(
        f"--target-gap: no lower bound is available for {what}; give --time-limit or --iterations instead"
    )


def relaxation(problem: RoutingProblem) -> RoutingProblem | None:
    """Return a problem with equal costs in both directions whose bound also holds for `problem`, or None.

    It has no precedence, and between two nodes the smaller of the two costs. A path from a start to an end becomes a
    closed tour with one node more.
    """
    if problem.n_nodes > problem.n_clusters:
        return None
    if not is_directed(problem):
        return problem
    if problem.n_nodes > MOST_DIRECTED:
        return None
    directed = build_directed(replace(problem, precedence=np.zeros((0, 2), dtype=np.int32)), 1)
    n = directed.n
    table = costs_of_edges(directed.cost, np.repeat(directed.leave, n), np.tile(directed.enter, n)).reshape(n, n)
    service = np.zeros(n)
    service[: problem.n_nodes] = problem.service
    metric = Metric("EXPLICIT", matrix=np.minimum(table, table.T))
    relaxed = RoutingProblem.of_points(np.zeros((n, 2)), metric, closed=True)
    return replace(relaxed, service=service)


def certify(
    problem: RoutingProblem, solution: Solution, bound: float | None, cancelled: threading.Event,
    instance: Instance | None = None,
) -> Solution:  # fmt: skip
    """Return `solution` with its lower bound: `bound` if it is known, else a new one.

    The bound ignores precedence, which can only raise the cost (`relaxation`). A stopped search gets no new bound. A
    bound above the cost of the solution is dropped.
    """
    relaxed = relaxation(problem) if bound is None and not cancelled.is_set() else None
    if relaxed is not None:
        if instance is None or relaxed is not problem:
            instance = build_instance(relaxed, CANDIDATES)
        bound = bound_of(instance, solution.cost - float(problem.service.sum()), cancelled)
    if bound is None or bound > solution.cost + ROUNDING * abs(solution.cost):
        return solution
    return replace(solution, lower_bound=min(bound, solution.cost))


def bound_of(instance: Instance, upper: float, cancelled: threading.Event) -> float | None:
    """Return the lower bound of the cost of any path of the problem, service included, or None.

    `upper` is the travel cost of a known path. Ctrl-C sets `cancelled`, which ends the search for a bound.
    """
    from leafcut.solve.bound import lower_bound

    problem = instance.problem
    if not stands_for_its_tour(problem):
        return None
    try:
        bound = lower_bound(instance, upper, stop=cancelled.is_set)
    except KeyboardInterrupt:
        cancelled.set()
        return None
    return None if bound is None else bound + float(problem.service.sum())


def stands_for_its_tour(problem: RoutingProblem) -> bool:
    """Return whether a tour of the clusters costs as much as the path: one node each, same costs both ways."""
    return problem.n_nodes == problem.n_clusters and not is_directed(problem)
