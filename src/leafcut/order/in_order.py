"""Running the searches for paths with a direction: costs by direction, several nodes per cluster, precedence."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np

from leafcut.kernels.layers import Clusters
from leafcut.kernels.route import Route
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import WorkerFigures
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import ordering, sequential
from leafcut.order.annealing import is_small, layers_of
from leafcut.order.directed import FEW_CLUSTERS, FEW_NODES, DirectedInstance, build_directed, is_directed
from leafcut.order.instance import path_cost
from leafcut.order.running import SearchResult, set_budget_of_visits, until_interrupted
from leafcut.order.statistics import Best
from leafcut.order.stop import Stop

#: Most generations of Ant Colony System before the first kick on a small problem, and most generations without a gain.
#: Kicks alone stay near their greedy start: on contours around holes their paths were 0 to 2.4 % longer than the paths
#: of the ants of the literature in the same time; after ants, 0 to 0.03 % (tests/order/test_students.py).
GENERATIONS, PATIENCE = 20, 10

#: They take this part of a time limit at most.
ANTS_SHARE = 0.15


def run_in_order(
    instance: DirectedInstance, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions, best: Best
) -> SearchResult:
    """Run the algorithm of `options` on a path with a direction; the tour found is an order of clusters."""
    stop = best.stop
    if options.algorithm == "colony":
        if options.iterations is not None:
            stop.iterations = options.iterations
        limited = options.iterations is not None or options.time_limit is not None
        kicks = math.inf if limited else sequential.budget(options.preset, instance.problem.n_clusters)
        only_time = options.iterations is None and options.time_limit is not None
        threads = (options.threads or os.cpu_count() or 1) if only_time else 1
        return _search_together(instance, options.seed, best, kicks, threads)
    if options.algorithm == "nn":
        path = sequential.greedy_path(instance)
        best.offer(path.node, instance.length(path.node, path.enter, path.leave), 0)
        return SearchResult(instance.problem.cluster[instance.nodes(path.node, path.enter)].astype(np.int32))
    swarm = ordering.Swarm(ordering.Ordering(instance, options.local_search, stop), options, aco, firefly, best)
    set_budget_of_visits(stop, options, swarm.visits)
    if swarm.patience is not None:
        stop.patience = swarm.patience
    iterations = until_interrupted(swarm.run, best)
    figures = WorkerFigures(0, iterations * swarm.size, stop.elapsed(), best.cost)
    return SearchResult(swarm.clusters(best.tour), iterations, (figures,))


def _search_together(instance: DirectedInstance, seed: int, best: Best, kicks: float, threads: int) -> SearchResult:
    """Run as many searches as threads; each goes back to the best path of all now and then.

    With a budget there is one, as what several find depends on who is first.
    """
    layers = layers_of(instance) if is_small(instance) else None
    searches = [
        sequential.PathSearch(instance, seed, best, number, layers, alone=threads == 1) for number in range(threads)
    ]

    def figures() -> tuple[WorkerFigures, ...]:
        seconds = best.stop.elapsed()
        return tuple(WorkerFigures(s.number, s.kicks, seconds, s.shortest) for s in searches)

    if best.watched is not None:
        best.watched.workers = figures

    def run() -> int:
        greedy = sequential.greedy_path(instance)
        if layers is not None:
            _send_ants(instance, layers, greedy, seed, best)
        if threads == 1:
            return searches[0].run(kicks, greedy)
        with ThreadPoolExecutor(threads, thread_name_prefix="ants") as executor:
            jobs = [executor.submit(search.run, kicks, greedy) for search in searches]
            try:
                return sum(job.result() for job in jobs)
            except BaseException:
                best.stop.cancelled.set()  # else the pool waits for the clock
                raise

    iterations = until_interrupted(run, best)
    return SearchResult(instance.problem.cluster[best.tour].astype(np.int32), iterations, figures())


def _send_ants(
    instance: DirectedInstance, layers: Clusters, greedy: Route, seed: int, best: Best, generations: int = GENERATIONS
) -> None:
    """Offer the greedy path, and the best that a few generations of ants find, each of whose tours is improved."""
    stop = best.stop
    best.offer(instance.nodes(greedy.node, greedy.enter), instance.length(greedy.node, greedy.enter, greedy.leave), 0)
    own = Stop(
        iterations=generations, patience=PATIENCE, seconds=ANTS_SHARE * stop.seconds, target=stop.target,
        cancelled=stop.cancelled, began=stop.began,
    )  # fmt: skip
    found = Best(own)
    options = SolveOptions(algorithm="acs", seed=seed)
    swarm = ordering.Swarm(
        ordering.Ordering(instance, True, own, layers, greedy), options, AcoOptions(), FireflyOptions(), found
    )
    swarm.run()
    nodes = swarm.nodes(found.tour)
    node, enter = instance.path_of(nodes)
    path = sequential.route_of(instance, node, enter)
    best.offer(nodes, instance.length(path.node, path.enter, path.leave), 0)


def warm_up_in_order(problem: RoutingProblem, algorithm: str = "colony") -> None:
    """As `warm_up`, for a search for paths with a direction: what it needs for a problem of this kind."""
    several, few = problem.n_nodes > problem.n_clusters, problem.n_clusters < FEW_CLUSTERS
    _warm(is_directed(problem) and not several, few and problem.n_nodes <= FEW_NODES, algorithm)


@cache
def _warm(directed: bool, few: bool, algorithm: str) -> None:
    """Run what `warm_up_in_order` says, once in a process for problems of the same kind."""
    rng = np.random.default_rng(1)
    entry = rng.uniform(0.0, 100.0, (40, 2))
    small = RoutingProblem(
        entry=entry,
        exit=rng.uniform(0.0, 100.0, (40, 2)) if directed else entry,
        cluster=np.arange(40, dtype=np.int32),
        service=np.zeros(40),
        precedence=np.array([[0, 1]], dtype=np.int32),
    )
    instance, best = build_directed(small, sequential.CANDIDATES), Best(Stop(iterations=3))
    if algorithm == "colony":
        greedy = sequential.greedy_path(instance)
        if few:
            _send_ants(instance, layers_of(instance), greedy, 1, best, generations=1)
        sequential.PathSearch(instance, 1, best).run(math.inf, greedy, phase=1)
    else:
        once = SolveOptions(algorithm=algorithm, iterations=2)
        run_in_order(instance, once, AcoOptions(n_ants=1), FireflyOptions(n_fireflies=2), best)
    path_cost(small, np.arange(40, dtype=np.int32))
