"""`solve`: search for a short path that solves a routing problem."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.model.heartbeat import OnProgress
from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.algorithms import check_algorithm, check_options, choose_algorithm, needs_choices
from leafcut.order.exact import TRY_ALL, choose_nodes_for_order, is_exactly_solvable, solve_exactly, try_all_orders
from leafcut.order.instance import path_cost
from leafcut.order.precedence import satisfies_pairs, validate_pairs, violated_pair
from leafcut.order.search import AlgorithmRun, Best, SearchResult, SearchView
from leafcut.order.stop import Deadline, Stop


def solve(
    problem: RoutingProblem,
    options: SolveOptions | None = None,
    aco: AcoOptions | None = None,
    *,
    firefly: FireflyOptions | None = None,
    progress: OnProgress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    bounds: Deadline | None = None,
) -> Solution:
    """Search for a short path that solves `problem`.

    Parameters
    ----------
    progress
        Called after every iteration (`model.heartbeat`).
    observe
        Observer that follows the search without affecting its result (`model.snapshot`).
    cancelled
        Event that another thread can set to stop the search and keep the best path. Ctrl-C has the same effect.
    bounds
        Deadline for the lower bounds, in addition to the search's time limit. None means no limit.

    Raises
    ------
    OptionError
        If an algorithm from another package cannot be used.
    SolveError
        If no order satisfies the precedence, if the algorithm does not support precedence, or if the problem has too
        many nodes for full candidate lists.
    """
    options, aco, firefly = options or SolveOptions(), aco or AcoOptions(), firefly or FireflyOptions()
    cancelled, bounds = cancelled or threading.Event(), bounds or Deadline()
    check_algorithm(options.algorithm)
    if options.bound:
        from leafcut.order.certificate import add_lower_bound, compute_bound_for_observers
    stop = Stop.from_options(options, problem, cancelled)
    pairs = validate_pairs(problem)
    known = _order_without_search(problem, pairs, options, stop)
    if known is not None:
        solution, bound = known
        return add_lower_bound(problem, solution, bound, cancelled, deadline=bounds) if options.bound else solution
    with stop.paused():
        algorithm = choose_algorithm(problem, options)
        options = replace(options, algorithm=algorithm.name)
        check_options(problem, algorithm, options, aco, firefly)
        search = algorithm.load()
    instance = algorithm.build_instance(problem, options.candidates)
    best = Best(stop, progress, instance.service, view=SearchView(instance), observer=observe or Observer())
    best.observer.begin()
    if observe is not None and options.bound:
        compute_bound_for_observers(instance, best)
    try:
        found = search(instance, AlgorithmRun(options, aco, firefly, best))
    except KeyboardInterrupt:
        cancelled.set()
        if not len(best.tour):
            raise
        found = SearchResult(best.view.instance_nodes(best.tour), best.iteration, best.view.log.worker_figures())
    nodes = choose_nodes_for_order(problem, instance.cluster_order(found.tour))
    cost, seconds = path_cost(problem, nodes), stop.elapsed()
    solution = Solution(
        nodes=nodes,
        cost=cost,
        unit=problem.metric.unit,
        algorithm=algorithm.name,
        seed=options.seed,
        iterations=found.iterations,
        seconds=seconds,
        history=_cost_history(best, seconds, cost, instance.exact),
        workers=found.workers,
        stopped_early=cancelled.is_set() or seconds >= stop.seconds,
        spared=stop.payoff_limit.spared,
    )
    return (
        add_lower_bound(problem, solution, best.bound_if_cancelled(), cancelled, instance, bounds)
        if options.bound
        else solution
    )


def _order_without_search(
    problem: RoutingProblem, pairs: Ints, options: SolveOptions, stop: Stop
) -> tuple[Solution, float | None] | None:
    """If the problem needs no search, return an order and its lower bound. Otherwise, return None.

    The algorithm `none` keeps the order of the drawing. For a few clusters, the order is the exact optimum.
    """
    name, few, bound = options.algorithm, problem.n_clusters <= TRY_ALL, None
    if name == "none":
        order = np.arange(problem.n_clusters, dtype=np.int32)
        broken = violated_pair(pairs, order)
        if broken is not None:
            raise SolveError(
                "the order as drawn has cluster {} before cluster {}, which must come first; use --algorithm auto",
                broken[1],
                broken[0],
            )
        nodes = choose_nodes_for_order(problem, order)
    elif few:
        nodes, name = try_all_orders(problem, pairs), "colony" if name == "auto" else name
    elif name == "auto" and needs_choices(problem) and is_exactly_solvable(problem):
        from leafcut.order.directed import refuse_ends_with_cost_table

        refuse_ends_with_cost_table(problem)
        nodes, name = solve_exactly(problem, pairs), "exact"
    else:
        return None
    cost = path_cost(problem, nodes)
    if few and name == "none":
        bound = path_cost(problem, try_all_orders(problem, pairs))
    elif name != "none":
        bound = cost
    seconds, stopped = stop.elapsed(), stop.cancelled.is_set()
    unit, history = problem.metric.unit, ((seconds, cost),)
    solution = Solution(nodes, cost, unit, name, options.seed, seconds=seconds, history=history, stopped_early=stopped)
    return solution, bound


def _cost_history(best: Best, seconds: float, cost: float, exact: bool) -> tuple[tuple[float, float], ...]:
    if not best.history or not exact:
        return ((seconds, cost),)
    *before, (last, _) = best.history
    return (*((t, max(cost, c + best.service)) for t, c in before), (last, cost))


def keep_better(problem: RoutingProblem, solution: Solution, other: Ints) -> Solution:
    """Replace the nodes of `solution` with `other`, int32[clusters], if they are cheaper and satisfy the precedence."""
    cost = path_cost(problem, other)
    if cost >= solution.cost or not satisfies_pairs(validate_pairs(problem), problem.cluster[other]):
        return solution
    bound = solution.lower_bound
    return replace(
        solution,
        nodes=other,
        cost=cost,
        history=(*solution.history, (solution.seconds, cost)),
        lower_bound=None if bound is None else min(bound, cost),
    )
