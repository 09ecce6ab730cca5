"""`solve`: a routing problem in, a solution out; the assembly of this room."""

from __future__ import annotations

import itertools
import math
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.kernels.cost import tour_cost
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution, WorkerFigures
from leafcut.options import AcoOptions, SolveOptions
from leafcut.solve.aco import Ants, Colony, Parameters, first_tour
from leafcut.solve.clusters import choose_nodes
from leafcut.solve.construction import nearest_neighbour
from leafcut.solve.instance import FULL_LISTS_LIMIT, Instance, build_instance, path_cost
from leafcut.solve.kicks import CANDIDATES, improve_by_kicks, kicks_per_iteration
from leafcut.solve.loop import search
from leafcut.solve.statistics import Best, Progress
from leafcut.solve.stop import Stop

#: Up to this many clusters every order is tried: local search needs five nodes.
TRY_ALL = 4

#: A preset is a budget of nodes visited by ants, and how many iterations without a better tour end it.
PRESETS = {"fast": (2e5, 30), "default": (4e6, 40), "thorough": (1e8, 2000)}

#: The same for local kicks: kicks per node, and most kicks.
KICK_PRESETS = {"fast": (10, 2e4), "default": (100, 2e5), "thorough": (2000, math.inf)}

#: Above this many clusters `auto` kicks one tour instead of building whole ones: an ant costs n steps, a kick a few.
ANTS_LIMIT = 1500


@dataclass(frozen=True)
class Found:
    """What an algorithm returns to `solve`."""

    tour: NDArray[np.int32]
    iterations: int = 0
    workers: tuple[WorkerFigures, ...] = ()


def solve(
    problem: RoutingProblem,
    options: SolveOptions | None = None,
    aco: AcoOptions | None = None,
    *,
    progress: Progress | None = None,
    cancelled: threading.Event | None = None,
) -> Solution:
    """Return a short path for `problem`.

    Parameters
    ----------
    progress
        Called after every iteration with (iteration, cost, seconds, share done).
    cancelled
        Set it from another thread to stop and keep the best. Ctrl-C does the same.

    Raises
    ------
    SolveError
        The problem has precedence pairs, or asks for full candidate lists on too many nodes.
    """
    options, aco = options or SolveOptions(), aco or AcoOptions()
    options = replace(options, algorithm=choose_algorithm(options.algorithm, problem.n_clusters))
    if len(problem.precedence):
        raise SolveError("this algorithm cannot keep precedence pairs inside one routing problem")
    tiny = problem.n_clusters <= TRY_ALL
    if not tiny and options.algorithm != "none":
        warm_up(options, aco)
    stop = Stop(cancelled=cancelled or threading.Event())
    if options.time_limit is not None:
        stop.seconds = options.time_limit
    best = Best(stop, progress)
    if tiny or options.algorithm == "none":
        order = _try_all(problem) if options.algorithm != "none" else np.arange(problem.n_clusters, dtype=np.int32)
        return _solution(problem, order, options, Found(order), best)
    if not options.candidates and problem.n_clusters > FULL_LISTS_LIMIT:
        raise SolveError(
            f"--candidates 0 makes all {problem.n_clusters} nodes candidates of each other, too much memory above "
            f"{FULL_LISTS_LIMIT} nodes; give a number such as 16"
        )
    instance = build_instance(problem, CANDIDATES if options.algorithm == "kicks" else options.candidates)
    found = _run(instance, options, aco, stop, best)
    return _solution(problem, instance.path(found.tour), options, found, best)


def warm_up(options: SolveOptions, aco: AcoOptions) -> None:
    """Have every kernel that `options` need compiled, or loaded from disk, before any clock starts.

    Six nodes and one iteration: next to nothing when the kernels are there already.
    """
    tiny = RoutingProblem.of_points(np.arange(12.0).reshape(6, 2) ** 2)
    once = replace(options, iterations=1, threads=1)
    for lists in (3, 0):
        stop = Stop()
        found = _run(build_instance(tiny, lists), once, replace(aco, n_ants=1), stop, Best(stop))
    path_cost(tiny, found.tour[found.tour < tiny.n_clusters])


def _run(instance: Instance, options: SolveOptions, aco: AcoOptions, stop: Stop, best: Best) -> Found:
    """Run the algorithm of `options`, which is not `auto` any more."""
    algorithm = options.algorithm
    if algorithm == "nn":
        tour = nearest_neighbour(instance)
        best.offer(tour, float(tour_cost(instance.cost, tour)), 0)
        return Found(tour)
    if algorithm == "2opt":
        first_tour(instance, True, stop, best)
        return Found(best.tour)
    if algorithm == "kicks":
        per_node, most = KICK_PRESETS[options.preset]
        _set_budget(stop, options, min(per_node * instance.n, most) / kicks_per_iteration(instance.n))
        iterations = _until_interrupted(lambda: improve_by_kicks(instance, options.seed, stop, best), best)
        kicks = iterations * kicks_per_iteration(instance.n)
        return Found(best.tour, iterations, (WorkerFigures(0, kicks, stop.elapsed(), best.cost),))
    parameters = Parameters.of(algorithm, aco, instance.n, options.local_search)
    c_nn = first_tour(instance, options.local_search, stop, best)
    if c_nn <= 0.0:
        return Found(best.tour)  # all nodes on one place: nothing to gain, and trails of 1/0
    visits, patience = PRESETS[options.preset]
    _set_budget(stop, options, visits / (parameters.ants * instance.n), patience)
    threads = min(options.threads or os.cpu_count() or 1, parameters.ants)
    with _pool(threads) as executor:
        ants = Ants(Colony(instance, parameters, c_nn), options.seed, stop, executor, threads)
        iterations = _until_interrupted(lambda: search(ants.propose, ants.colony.reinforce, stop, best), best)
    return Found(best.tour, iterations, ants.log.figures())


def choose_algorithm(name: str, n_clusters: int) -> str:
    """Return what `auto` stands for at this size, or the name itself."""
    if name != "auto":
        return name
    return "mmas" if n_clusters <= ANTS_LIMIT else "kicks"


def _set_budget(stop: Stop, options: SolveOptions, iterations: float, patience: float = math.inf) -> None:
    """Stop after the iterations asked for; without any, and without a time limit, after the preset's."""
    if options.iterations is not None:
        stop.iterations = options.iterations
    elif options.time_limit is None:
        stop.iterations = max(1, math.ceil(iterations))
        stop.patience = patience


def _until_interrupted(work: Callable[[], int], best: Best) -> int:
    """Return the iterations that `work` made; Ctrl-C ends it, and what is in `best` is kept."""
    try:
        return work()
    except KeyboardInterrupt:
        best.stop.cancelled.set()
        return best.iteration


@contextmanager
def _pool(threads: int) -> Iterator[Executor | None]:
    if threads <= 1:
        yield None
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="ants") as executor:
        yield executor


def _try_all(problem: RoutingProblem) -> NDArray[np.int32]:
    orders = [np.array(o, dtype=np.int32) for o in itertools.permutations(range(problem.n_clusters))]
    return min(orders, key=lambda order: path_cost(problem, choose_nodes(problem, order)))


def _solution(
    problem: RoutingProblem, order: NDArray[np.int32], options: SolveOptions, found: Found, best: Best
) -> Solution:
    nodes = choose_nodes(problem, order)
    cost = path_cost(problem, nodes)
    seconds = best.stop.elapsed()
    # Costs of the search are without service; the history is told in the costs of the answer.
    extra = cost - best.cost if best.history else 0.0
    history = [(t, c + extra) for t, c in best.history] or [(seconds, cost)]
    return Solution(
        nodes=nodes,
        cost=cost,
        unit=problem.metric.unit,
        algorithm=options.algorithm,
        seed=options.seed,
        iterations=found.iterations,
        seconds=seconds,
        history=tuple(history),
        workers=found.workers,
        stopped_early=best.stop.cancelled.is_set() or seconds >= best.stop.seconds,
    )


def keep_better(problem: RoutingProblem, solution: Solution, other: NDArray[np.int32]) -> Solution:
    """Return `solution`, with the nodes int32[clusters] of `other` instead when those cost less."""
    cost = path_cost(problem, other)
    return solution if cost >= solution.cost else replace(solution, nodes=other, cost=cost)
