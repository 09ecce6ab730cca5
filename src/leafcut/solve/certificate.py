"""How far from the best possible: a lower bound for a solution, and the gap at which a search may stop."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np

from leafcut.errors import SolveError
from leafcut.kernels.cost import tour_cost
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import SolveOptions
from leafcut.solve.construction import nearest_neighbour
from leafcut.solve.instance import Instance, build_instance
from leafcut.solve.statistics import Best

#: Candidates of each node where a bound is asked of an order that no search made.
CANDIDATES = 8

#: A bound is above a cost by no more than this part of it when both are the same number, added up in other orders.
ROUNDING = 1e-9


def aim(options: SolveOptions, instance: Instance, best: Best) -> None:
    """With `--target-gap`, find the lower bound and have the search stop near it; the clock is stopped meanwhile.

    Raises
    ------
    SolveError
        There is no bound of this problem.
    """
    if options.target_gap is None:
        return
    stop = best.stop
    with stop.paused():
        upper = float(tour_cost(instance.cost, nearest_neighbour(instance)))
        best.bound = bound_of(instance, upper, stop.cancelled)
    if best.bound is not None:
        stop.target = best.bound * (1.0 + options.target_gap / 100.0) - best.service
    elif not stop.cancelled.is_set():
        raise SolveError(
            f"--target-gap: no lower bound can be had for {_words(instance.problem)}; "
            "give --time-limit or --iterations instead"
        )


def _words(problem: RoutingProblem) -> str:
    what = f"{problem.n_clusters:,} targets"
    return what if stands_for_its_tour(problem) else what + " that can be worked more than one way"


def certify(
    problem: RoutingProblem, solution: Solution, bound: float | None, cancelled: threading.Event,
    instance: Instance | None = None,
) -> Solution:  # fmt: skip
    """Return `solution` with its lower bound: `bound` where it is known already, else the one that is found now.

    Somebody who stopped the search does not wait for a bound. One that the solution itself disproves is none.
    """
    if bound is None and not cancelled.is_set() and stands_for_its_tour(problem):
        travel = solution.cost - float(problem.service.sum())
        bound = bound_of(instance or build_instance(problem, CANDIDATES), travel, cancelled)
    if bound is None or bound > solution.cost + ROUNDING * abs(solution.cost):
        return solution
    return replace(solution, lower_bound=min(bound, solution.cost))


def bound_of(instance: Instance, upper: float, cancelled: threading.Event) -> float | None:
    """Return what no path of the instance's problem can cost less than, service included, or None.

    `upper` is the travel cost of a path that is known. Ctrl-C sets `cancelled`, which ends the search for a bound.
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
    """Return whether a tour of the clusters' places costs what the path does: one node each, left where entered."""
    return problem.n_nodes == problem.n_clusters and np.array_equal(problem.entry, problem.exit)
