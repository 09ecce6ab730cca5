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
from functools import cache

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.model.heartbeat import OnProgress
from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution, WorkerFigures
from leafcut.options import ALGORITHM_TITLES, ANT_ALGORITHMS, LITERATURE, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.algorithms import PACKAGED, Algorithm, AlgorithmRun, run_packaged
from leafcut.order.certificate import (
    aim,
    aim_without_order,
    certify,
    foresee,
    stands_for_its_tour,
)
from leafcut.order.clusters import choose_nodes
from leafcut.order.colony import improve_by_colony
from leafcut.order.construction import nearest_neighbour
from leafcut.order.deadline import Deadline
from leafcut.order.directed import (
    FEW_CLUSTERS,
    FEW_NODES,
    build_directed,
    is_directed,
    refuse_places_of_a_table,
)
from leafcut.order.exact import best_nodes, within_reach
from leafcut.order.instance import FULL_LISTS_LIMIT, Instance, build_instance, path_cost
from leafcut.order.kicks import (
    CANDIDATES,
    MANY,
    improve_by_kicks,
    kicks_per_iteration,
    shorten_long_edges,
    work_tour,
)
from leafcut.order.observing import ClusterPlaces, brightness_of, on_candidates, watched_instance
from leafcut.order.precedence import broken_pair, checked_pairs, keeps
from leafcut.order.running import SearchResult, set_budget, set_budget_of_visits, until_interrupted
from leafcut.order.statistics import Best, Watched, WorkerLog
from leafcut.order.stop import Stop, Thrift
from leafcut.order.workers import Workers

#: Candidates of each node for ants that choose every edge of a tour among them.
ANTS_CANDIDATES = 16

#: Up to this many clusters every order is tried: local search needs five nodes.
TRY_ALL = 4

#: What `running.PRESETS` are to the ants, for the colony: nodes of all the tours that its ants may build.
COLONY_PRESETS = {"fast": 1e5, "default": 6e5, "thorough": 1e7}

#: The same for local kicks: kicks per node, and most kicks.
KICK_PRESETS = {"fast": (10, 2e4), "default": (100, 2e5), "thorough": (2000, math.inf)}

#: Up to this many clusters of which some have several nodes are ordered together with the choice of their nodes; of
#: more the colony orders the middles in the time there is. Measured on 6000 contours of 8 nodes: 2 % shorter after 3 s
#: and 3 % after 15 s.
MOST_WITH_WAYS = 20_000


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
    """Return a short path for `problem`.

    Parameters
    ----------
    progress
        Called after every iteration, as `model.heartbeat` says.
    observe
        Called after it, as `model.snapshot` says; the answer is the same with and without.
    cancelled
        Set it from another thread to stop and keep the best. Ctrl-C does the same.
    bounds
        Deadline of lower bounds, which the time limit does not count; without it they have no limit.

    Raises
    ------
    OptionError
        The algorithm is of a package, and cannot be used.
    SolveError
        The precedence cannot be kept, or not by the algorithm asked for; full candidate lists are asked for on too many
        nodes, or a gap where no lower bound can be had.
    """
    options, aco, bounds = options or SolveOptions(), aco or AcoOptions(), bounds or Deadline()
    limit = math.inf if options.time_limit is None else options.time_limit
    stop = Stop(seconds=limit, cancelled=cancelled or threading.Event(), thrift=Thrift.of(options, problem))
    pairs = checked_pairs(problem)
    tiny = problem.n_clusters <= TRY_ALL
    auto, options = options.algorithm == "auto", _decided(options)
    if options.algorithm not in ALGORITHM_TITLES:
        PACKAGED.load(options.algorithm)  # one that cannot be used is told of, however few clusters there are
    ordered = not tiny and _goes_in_order(problem, options)
    if ordered and auto and within_reach(problem):
        return _exactly(problem, pairs, options, progress, cancelled)
    if ordered:
        from leafcut.order.in_order import warm_up_in_order

        with stop.paused():
            warm_up_in_order(problem, options.algorithm)
    elif not tiny and options.algorithm != "none":
        if options.algorithm in ANT_ALGORITHMS and aco.parallel == "gpu":
            from leafcut.order.gpu_ants import check_gpu

            if options.algorithm == "acs":
                raise SolveError(
                    "--parallel gpu: the ants of acs change the pheromone as they go; use --parallel threads"
                )
            check_gpu()  # before kernels are compiled, which takes long and would be for nothing
        with stop.paused():
            warm_up(options, aco, problem.n_clusters, firefly.variant if firefly else "leafcut")
    best = Best(stop, progress, float(problem.service.sum()))
    if tiny or options.algorithm == "none":
        return _without_search(problem, pairs, options, best, bounds)
    if options.candidates == 0 and problem.n_clusters > FULL_LISTS_LIMIT:
        raise SolveError(
            f"--candidates 0 makes all {problem.n_clusters} nodes candidates of each other, too much memory above "
            f"{FULL_LISTS_LIMIT} nodes; give a number such as 16"
        )
    if ordered:
        return _in_order(problem, options, aco, firefly or FireflyOptions(), best, observe, bounds)
    instance = build_instance(problem, _candidates(options))
    aim(options, instance, best, bounds)
    best.watched = watched_instance(observe, instance)
    foresee(problem, options, best, instance)
    found = _run(instance, AlgorithmRun(options, aco, firefly or FireflyOptions(), best))
    solution = _solution(problem, instance.path(found.tour), options, found, best)
    if not options.bound:
        return solution
    return certify(problem, solution, best.bound_at_hand(), stop.cancelled, instance, bounds)


def _exactly(
    problem: RoutingProblem, pairs: NDArray[np.int32], options: SolveOptions, progress: OnProgress | None,
    cancelled: threading.Event | None,
) -> Solution:  # fmt: skip
    """Return the best path there is of a few clusters: its cost is the bound."""
    refuse_places_of_a_table(problem)
    best = Best(Stop(cancelled=cancelled or threading.Event()), progress, 0.0)
    order = problem.cluster[best_nodes(problem, pairs)].astype(np.int32)
    solution = _solution(problem, order, options, SearchResult(order), best)
    return replace(solution, algorithm="exact", lower_bound=solution.cost if options.bound else None)


def _decided(options: SolveOptions) -> SolveOptions:
    """Return the options with the name of what `auto` stands for."""
    return replace(options, algorithm="colony") if options.algorithm == "auto" else options


def _goes_in_order(problem: RoutingProblem, options: SolveOptions) -> bool:
    """Return whether a search for paths with a direction is the one for this problem.

    Raises
    ------
    SolveError
        One is asked for that cannot keep the precedence, or not of so many clusters.
    """
    name, several = options.algorithm, problem.n_nodes > problem.n_clusters
    few = problem.metric.matrix is not None or problem.n_clusters <= MOST_WITH_WAYS
    wanted = len(problem.precedence) > 0 or (few if several else is_directed(problem))
    if name in ("colony", "nn", "none"):
        return wanted and name != "none"
    small = problem.n_clusters < FEW_CLUSTERS and problem.n_nodes <= FEW_NODES
    if wanted and small and name in LITERATURE:
        return True
    if name in LITERATURE and len(problem.precedence):
        raise SolveError(
            f"algorithm '{name}' orders fewer than {FEW_CLUSTERS} clusters with at most {FEW_NODES} nodes; there are "
            f"{problem.n_clusters} with {problem.n_nodes}; use --algorithm auto"
        )
    if len(problem.precedence):
        raise SolveError(f"algorithm '{name}' cannot keep what must come before what; use --algorithm auto, which can")
    return False


def _in_order(
    problem: RoutingProblem, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions, best: Best,
    observe: Observer | None, bounds: Deadline,
) -> Solution:  # fmt: skip
    """Return what a search for paths with a direction finds; its costs have the service in them."""
    stop, best.service = best.stop, 0.0
    aim_without_order(options, problem, best, bounds)
    from leafcut.order.in_order import run_in_order

    if observe is not None:
        best.watched = Watched(observe, ClusterPlaces(problem).along_nodes)
        foresee(problem, options, best)
    instance = build_directed(problem, _candidates(options))
    found = run_in_order(instance, options, aco, firefly, best)
    solution = _solution(problem, found.tour, options, found, best, known=True)
    if not options.bound:
        return solution
    return certify(problem, solution, best.bound_at_hand(), stop.cancelled, deadline=bounds)


def _candidates(options: SolveOptions) -> int:
    if options.candidates is not None:
        return options.candidates
    return CANDIDATES if options.algorithm in ("colony", "kicks") else ANTS_CANDIDATES


def _without_search(
    problem: RoutingProblem, pairs: NDArray[np.int32], options: SolveOptions, best: Best, bounds: Deadline
) -> Solution:
    """Return the drawing's order when asked for, else the best of the few orders there are: its cost is the bound."""
    drawn = options.algorithm == "none"
    order = np.arange(problem.n_clusters, dtype=np.int32) if drawn else _try_all(problem, pairs)
    broken = broken_pair(pairs, order)
    if broken is not None:
        raise SolveError(
            f"the order as drawn has cluster {broken[1]} before cluster {broken[0]}, which must come first; "
            "use --algorithm auto"
        )
    solution = _solution(problem, order, options, SearchResult(order), best)
    if not options.bound:
        return solution
    bound = None
    if problem.n_clusters <= TRY_ALL:
        bound = path_cost(problem, choose_nodes(problem, _try_all(problem, pairs) if drawn else order))
    return certify(problem, solution, bound, best.stop.cancelled, deadline=bounds)


def warm_up(options: SolveOptions, aco: AcoOptions, n: int = 0, variant: str = "leafcut") -> None:
    """Have every kernel compiled, or loaded from disk, that `options` need for n nodes, before any clock starts.

    Forty nodes and one iteration: next to nothing when the kernels are there already.
    """
    options = replace(
        _decided(options), seed=1, threads=1, preset="fast", time_limit=None, iterations=None, target_gap=None
    )
    _warm(options, aco, n >= MANY, variant)


@cache
def _warm(options: SolveOptions, aco: AcoOptions, many: bool, variant: str) -> None:
    """Run what `warm_up` says, once in a process for the same options."""
    # Spread as by chance; NumPy's own chance takes longer to import than all this takes.
    small = RoutingProblem.of_points(np.arange(40.0)[:, None] * (75.4878, 56.9840) % 100.0)
    # Fireflies fly from the second iteration on.
    once = replace(options, iterations=2 if options.algorithm == "firefly" else 1)
    build_instance(small, 0)
    instance = build_instance(small, CANDIDATES)
    for name in ["colony", "kicks"] if options.algorithm == "colony" else [options.algorithm]:
        few = replace(aco, n_ants=1, parallel="threads"), FireflyOptions(n_fireflies=2, variant=variant)
        found = _run(instance, AlgorithmRun(replace(once, algorithm=name), *few, Best(Stop())))
    if many and options.algorithm in ("colony", "kicks"):
        shorten_long_edges(instance, work_tour(found.tour))
    path_cost(small, instance.path(found.tour))


def _nearest(instance: Instance, run: AlgorithmRun) -> SearchResult:
    tour = nearest_neighbour(instance)
    run.best.offer(tour, instance.length(tour), 0)
    return SearchResult(tour)


def _kicks(instance: Instance, run: AlgorithmRun) -> SearchResult:
    options, stop, best = run.options, run.stop, run.best
    per_node, most = KICK_PRESETS[options.preset]
    set_budget(stop, options, min(per_node * instance.n, most) / kicks_per_iteration(instance.n))
    iterations = until_interrupted(lambda: improve_by_kicks(instance, options.seed, stop, best), best)
    kicks = iterations * kicks_per_iteration(instance.n)
    return SearchResult(best.tour, iterations, (WorkerFigures(0, kicks, stop.elapsed(), best.cost),))


def _fireflies(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the swarm."""
    from leafcut.order import firefly as room
    from leafcut.order import steps
    from leafcut.order.loop import search

    options, stop, best = run.options, run.stop, run.best
    flight = room.Flight.of(run.firefly, limited=options.is_limited)
    if run.firefly.variant != "leafcut":
        from leafcut.order.published_firefly import run_published

        return run_published(instance, run, flight)
    threads = min(options.threads or os.cpu_count() or 1, flight.fireflies)
    with _pool(threads) as executor:
        swarm = room.Fireflies(instance, flight, options.local_search, options.seed, stop, executor, threads)
        moves = flight.fireflies * swarm.moves_of(flight.attractiveness)
        set_budget(stop, options, room.PRESETS[options.preset][options.local_search] / moves)
        stop.patience = flight.patience
        room.first_tour(swarm, best)
        if best.watched is not None:
            best.watched.workers = swarm.log.figures
            best.watched.brightness = lambda: brightness_of(swarm.lengths)
            best.watched.step = lambda: steps.step_of_fireflies(swarm, best)
        if best.cost <= 0.0:
            return SearchResult(best.tour)  # all nodes on one place: nothing to gain
        iterations = until_interrupted(lambda: search(swarm.propose, room.learn_nothing, stop, best), best)
    return SearchResult(best.tour, iterations, swarm.log.figures())


def _local_search(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the local search that ants use."""
    from leafcut.order.aco import first_tour

    first_tour(instance, True, run.stop, run.best)
    return SearchResult(run.best.tour)


def _ants(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run one of the classical five."""
    from leafcut.order import steps
    from leafcut.order.aco import Ants, ColonyParameters, ColonyTrails, first_tour
    from leafcut.order.loop import search

    options, stop, best = run.options, run.stop, run.best
    parameters = ColonyParameters.of(options.algorithm, run.aco, instance.n, options.local_search)
    c_nn = first_tour(instance, options.local_search, stop, best)
    if c_nn <= 0.0:
        return SearchResult(best.tour)  # all nodes on one place: nothing to gain, and trails of 1/0
    set_budget_of_visits(stop, options, parameters.ants * instance.n)
    if run.aco.parallel in ("processes", "exchange"):
        from leafcut.order.ant_processes import run_in_processes

        return run_in_processes(instance, run, parameters, c_nn)
    threads = min(options.threads or os.cpu_count() or 1, parameters.ants)
    with _pool(threads) as executor:
        made = Ants
        if run.aco.parallel == "gpu":
            from leafcut.order.gpu_ants import GpuAnts as made
        ants = made(ColonyTrails(instance, parameters, c_nn, options.seed), options.seed, stop, executor, threads)
        if best.watched is not None:
            best.watched.workers = ants.log.figures
            best.watched.pheromone = lambda: on_candidates(instance, ants.colony.lists, ants.colony.pheromone)
            best.watched.step = lambda: steps.step_of_ants(ants.colony, best, steps.choices_of(ants.colony))
            best.watched.branching = lambda: steps.branching_of(ants.colony)
        iterations = until_interrupted(lambda: search(ants.propose, ants.colony.reinforce, stop, best), best)
    return SearchResult(best.tour, iterations, ants.log.figures())


def _colony(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the colony: without a clock and without a number of generations, on the preset's budget."""
    options, stop, best = run.options, run.stop, run.best
    counted = options.iterations is not None or options.time_limit is not None
    visits = math.inf if counted else COLONY_PRESETS[options.preset]
    if options.iterations is not None:
        stop.iterations = options.iterations
    threads = options.threads or os.cpu_count() or 1
    with _pool(threads) as executor:
        workers = Workers(executor, threads, stop, WorkerLog.of(threads))
        if best.watched is not None:
            best.watched.workers = workers.log.figures
        iterations = until_interrupted(
            lambda: improve_by_colony(instance, options.seed, stop, best, workers, visits), best
        )
    return SearchResult(best.tour, iterations, workers.log.figures())


@dataclass(frozen=True)
class _OwnAlgorithm:
    """One that leafcut brings."""

    title: str
    solve: Callable[[Instance, AlgorithmRun], SearchResult]


#: What seeks a closed tour: name → algorithm; `auto` stands for one of them, and `none` seeks nothing.
_OWN: dict[str, Algorithm] = {
    name: _OwnAlgorithm(ALGORITHM_TITLES[name], search)
    for name, search in {
        "colony": _colony,
        **dict.fromkeys(("as", "eas", "asrank", "mmas", "acs"), _ants),
        "firefly": _fireflies,
        "kicks": _kicks,
        "2opt": _local_search,
        "nn": _nearest,
    }.items()
}


def _run(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the algorithm of the options, which is not `auto` any more."""
    name = run.options.algorithm
    return _OWN[name].solve(instance, run) if name in _OWN else run_packaged(name, instance, run)


@contextmanager
def _pool(threads: int) -> Iterator[Executor | None]:
    if threads <= 1:
        yield None
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="ants") as executor:
        yield executor


def _try_all(problem: RoutingProblem, pairs: NDArray[np.int32]) -> NDArray[np.int32]:
    orders = [np.array(o, dtype=np.int32) for o in itertools.permutations(range(problem.n_clusters))]
    return min(
        (o for o in orders if keeps(pairs, o)), key=lambda order: path_cost(problem, choose_nodes(problem, order))
    )


def _solution(
    problem: RoutingProblem, order: NDArray[np.int32], options: SolveOptions, found: SearchResult, best: Best,
    known: bool = False,
) -> Solution:  # fmt: skip
    """Return the solution; `known`: the search knew what its paths cost."""
    nodes = choose_nodes(problem, order)
    cost = path_cost(problem, nodes)
    seconds = best.stop.elapsed()
    return Solution(
        nodes=nodes,
        cost=cost,
        unit=problem.metric.unit,
        algorithm=options.algorithm,
        seed=options.seed,
        iterations=found.iterations,
        seconds=seconds,
        history=_history(best, seconds, cost, known or stands_for_its_tour(problem)),
        workers=found.workers,
        stopped_early=best.stop.cancelled.is_set() or seconds >= best.stop.seconds,
        spared=best.stop.thrift.spared,
    )


def _history(best: Best, seconds: float, cost: float, known: bool) -> tuple[tuple[float, float], ...]:
    """Return what the best path cost at every improvement, service included, ending with `cost`.

    Where the search knew only the middle of a cluster, the answer's cost is all that is known.
    """
    if not best.history or not known:
        return ((seconds, cost),)
    *before, (last, _) = best.history
    return (*((t, max(cost, c + best.service)) for t, c in before), (last, cost))


def keep_better(problem: RoutingProblem, solution: Solution, other: NDArray[np.int32]) -> Solution:
    """Return `solution`, with the nodes int32[clusters] of `other` instead when those cost less and keep precedence."""
    cost = path_cost(problem, other)
    if cost >= solution.cost or not keeps(checked_pairs(problem), problem.cluster[other]):
        return solution
    bound = solution.lower_bound
    return replace(
        solution,
        nodes=other,
        cost=cost,
        history=(*solution.history, (solution.seconds, cost)),
        lower_bound=None if bound is None else min(bound, cost),
    )
