"""Search for short paths with choices: clusters of several nodes, asymmetric costs, and precedence.

The search works like `order.kicks`, but it sometimes lets the path become longer, because asymmetric costs and
precedence create many more local optima. For a small problem, the search starts with a few ants and then alternates
with `order.annealing`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from concurrent.futures import Executor, as_completed

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cluster_paths import Clusters
from leafcut.kernels.route import Route
from leafcut.kernels.sequential import improve_route, kick_route
from leafcut.options import AcoOptions
from leafcut.order.annealing import PathAnnealing, build_clusters, is_small_enough_to_anneal
from leafcut.order.construction import random_states
from leafcut.order.directed import BREADTH, LEAST, LOOKS, DirectedInstance, create_route, greedy_path, queue_all_nodes
from leafcut.order.kicks import LONGEST_REWRITE, OFFER_EVERY, kicks_per_iteration
from leafcut.order.literature.ants import Ants, initial_trails
from leafcut.order.literature.choices import Choices
from leafcut.order.literature.pheromone import AntParameters
from leafcut.order.search import AlgorithmRun, Best, SearchResult, SearchView, run_population, run_steps
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog, thread_count, thread_pool

#: Budget of each preset in kicks: kicks per node, minimum, and maximum.
PRESETS = {"fast": (60, 5e3, 1e5), "default": (250, 2e4, 5e5), "thorough": (2000, 1e5, math.inf)}

#: Kicks per node. The search starts with cold kicks, which must improve the path. It then alternates between hot kicks,
#: which may make the path longer, and cold kicks.
FIRST_COLD, HOT, COLD = 10, 1, 4

#: A hot kick may lengthen the path by this multiple of the mean move. The search uses the values in turn, because the
#: best value depends on the problem: the more precedence, the larger the best value.
HEATS = (0.3, 1.0, 3.0)

#: The search returns to the best path after this many turns without improvement.
TURNS_AWAY = 2

#: In a smaller problem, a turn has as many kicks as in a problem with this many nodes.
FEWEST_KICKS = 50

#: Number of kicks per node before the first annealing (`PathAnnealing`).
PHASE = 50

#: A greedy path is implausible if it is longer than the improved path by more than this factor. Forbidden moves cause
#: larger ratios.
GREEDY = 1.5

#: Assumed time of a kick in seconds, divided by the square root of the number of nodes. It was measured on one core in
#: 2024 with 30 to 3000 nodes. Because this is a constant, results are reproducible.
SECONDS_PER_KICK = 5e-6

#: On a small problem, Ant Colony System runs before the first kick. These are its maximum number of generations, in
#: total and without a gain. Kicks alone do not get far from the greedy path. On contours around holes, their paths were
#: 0 to 2.4 % longer than paths of published ant algorithms after the same time. With ants first, they were 0 to 0.03 %
#: longer (tests/order/test_students.py).
GENERATIONS, PATIENCE = 20, 10

#: These ants take at most this fraction of a time limit.
ANTS_SHARE = 0.15


def preset_kicks(preset: str, clusters: int) -> float:
    """Return the preset's number of kicks."""
    per_node, fewest, most = PRESETS[preset]
    return min(max(per_node * clusters, fewest), most)


class PathSearch:
    """Local search for a path with choices. `iteration` counts runs of at most `kicks_per_iteration` kicks."""

    def __init__(
        self,
        instance: DirectedInstance,
        seed: int,
        best: Best,
        number: int = 0,
        layers: Clusters | None = None,
        log: WorkerLog | None = None,
    ) -> None:
        """Create a search. Parallel searches have different numbers and share `best`, `layers`, and `log`."""
        self.instance, self.stop, self.best, self.layers = instance, best.stop, best, layers
        self.log = log or WorkerLog.empty(1)
        self.alone = len(self.log.ants) == 1
        self.words, self.number = random_states(seed, number, count=1), number
        self.breadth = np.array(BREADTH, dtype=np.int64)
        self.iteration = self.kicks = 0

    def run(self, most: float, start: Route, phase: float = PHASE) -> int:
        """Improve a path to a local optimum, then kick it at most `most` times or until `stop`.

        Returns the number of iterations.
        """
        instance = self.instance
        self.route = create_route(instance, start.node, start.enter, log=3 * instance.n + 1000)
        self._offer_path()
        self.mean = self._mean_move_cost()
        self.least = LEAST * self.mean
        self._improve_to_local_optimum()
        self.mean = min(self.mean, self._mean_move_cost() * GREEDY)
        if self.best.cost < self.cost:
            self._replace_route(self.best.tour)
        self._is_worthwhile()
        return run_steps(self._kick_and_anneal(most, phase), self.best, self.iteration, self._report_progress)

    def _kick_and_anneal(self, most: float, phase: float) -> Iterator[None]:
        """Kick the path. For a small problem, alternate between kicks and annealing.

        The first phase has `phase` kicks per node. Each later phase has twice as many kicks as the previous phase.
        """
        if not is_small_enough_to_anneal(self.instance):
            yield from self._kick_by_schedule(most)
            return
        annealing = PathAnnealing(self.instance, self.words, self.layers)
        kicks = phase * max(self.instance.n, FEWEST_KICKS)
        while True:
            yield from self._kick_by_schedule(min(self.kicks + kicks, most))
            if self._is_finished(most):
                return
            yield from self._anneal(annealing, int(min(kicks, most - self.kicks)))
            if self._is_finished(most):
                return
            kicks *= 2

    def _is_finished(self, most: float) -> bool:
        return self.kicks >= most or not self._is_worthwhile()

    def _is_worthwhile(self) -> bool:
        """Check whether more kicks are worth their time.

        Parallel searches stop by the clock. For them, the result is always True.
        """
        seconds = SECONDS_PER_KICK * math.sqrt(self.instance.n) * self.kicks
        return not self.alone or self.stop.payoff_limit.is_worth_continuing(seconds, self.best.cost)

    def _mean_move_cost(self) -> float:
        rules, route = self.instance.rules, self.route
        return max(self.cost - float(rules.service[route.enter].sum()), 0.0) / self.instance.n

    def _kick_by_schedule(self, most: float) -> Iterator[None]:
        away = 0
        for heat, kicks in _kick_schedule(max(self.instance.n, FEWEST_KICKS)):
            before, last = self.best.cost, min(self.kicks + kicks, most)
            while self.kicks < last and self._is_worthwhile():
                self._kick(heat, int(min(kicks_per_iteration(self.instance.n), last - self.kicks)))
                yield
            if self._is_finished(most):
                return
            if heat == 0.0:
                away = 0 if self.best.cost < before else away + 1
                if away >= TURNS_AWAY:
                    self._replace_route(self.best.tour)
                    away = 0

    def _anneal(self, annealing: PathAnnealing, steps: int) -> Iterator[None]:
        """Anneal the best path and continue the search with the result. An annealing step counts as a kick."""
        for path, made in annealing.anneal(self.best.tour, self.mean, steps, self.least):
            self.iteration, self.kicks = self.iteration + 1, self.kicks + made
            self._replace_route(path)
            self._offer_path()
            yield

    def _improve_to_local_optimum(self) -> None:
        """Improve the path to a local optimum. Exchanges that rewrite few positions come first."""
        instance, route = self.instance, self.route._replace(log=np.zeros(0, dtype=np.int32))
        offered = self.stop.elapsed()
        for longest in (LONGEST_REWRITE, instance.n):
            working = route._replace(buffer=route.buffer[:longest])
            queue_all_nodes(instance, route)
            while route.counts[1] > 0 and not self.stop.must_stop():
                self.cost -= improve_route(instance.cost, working, instance.rules, self.breadth, self.least, LOOKS)
                if self.stop.elapsed() > offered + OFFER_EVERY:
                    self._offer_path()
                    self._report_progress(0)
                    offered = self.stop.elapsed()
        route.queued[:], route.counts[:] = 0, 0
        self._offer_path()

    def _kick(self, heat: float, kicks: int) -> None:
        self.cost -= kick_route(
            self.instance.cost,
            self.route,
            self.instance.rules,
            self.breadth,
            self.least,
            heat * self.mean,
            self.words,
            0,
            kicks,
        )
        self.iteration, self.kicks = self.iteration + 1, self.kicks + kicks
        if self.cost < self.best.cost - self.least:
            self._offer_path()

    def _report_progress(self, iteration: int, _: NDArray[np.float64] | None = None) -> None:
        """Update the log. If several searches run in parallel, the first of them also reports progress."""
        self.log.ants[self.number], self.log.seconds[self.number] = self.kicks, self.stop.elapsed()
        if self.number == 0:
            self.best.tell(iteration, alone=self.alone)

    def _offer_path(self) -> None:
        route, instance = self.route, self.instance
        self.cost = instance.length(route.node, route.enter, route.leave)
        self.log.best[self.number] = min(self.log.best[self.number], self.cost)
        self.best.offer(instance.nodes_from_path(route.node, route.enter), self.cost, self.iteration)

    def _replace_route(self, nodes: Ints) -> None:
        route, instance = self.route, self.instance
        again = create_route(instance, *instance.path_from_nodes(nodes))
        for name in ("node", "place", "enter", "leave"):
            getattr(route, name)[:] = getattr(again, name)
        self.cost = instance.length(route.node, route.enter, route.leave)


def _kick_schedule(n: int) -> Iterator[tuple[float, int]]:
    """Yield an endless schedule: how much a kick may lengthen the path, and how many kicks use this limit."""
    yield 0.0, FIRST_COLD * n
    for heat in itertools.cycle(HEATS):
        yield heat, HOT * n
        yield 0.0, COLD * n


def run_path_search(instance: DirectedInstance, run: AlgorithmRun) -> SearchResult:
    """Run one search per thread. A search may restart from the best path that any search has found.

    With a work budget, only one search runs.
    """
    options, stop, best = run.options, run.stop, run.best
    kicks = math.inf if options.is_limited else preset_kicks(options.preset, instance.problem.n_clusters)
    only_time = options.iterations is None and options.time_limit is not None
    threads = thread_count(options) if only_time else 1
    layers = build_clusters(instance) if is_small_enough_to_anneal(instance) else None
    log = WorkerLog.empty(threads)
    searches = [PathSearch(instance, options.seed, best, number, layers, log) for number in range(threads)]
    best.view = SearchView(instance, log)
    greedy = greedy_path(instance)
    if layers is not None:
        offer_ant_path(instance, layers, greedy, options.seed, best)
    with thread_pool(threads, stop) as executor:
        if executor is None:
            iterations = searches[0].run(kicks, greedy)
        else:
            iterations = _run_searches_in_threads(executor, searches, kicks, greedy, stop)
    return SearchResult(best.tour, iterations, log.worker_figures())


def _run_searches_in_threads(
    executor: Executor, searches: list[PathSearch], kicks: float, greedy: Route, stop: Stop
) -> int:
    jobs = [executor.submit(one.run, kicks, greedy) for one in searches]
    try:
        return sum(job.result() for job in as_completed(jobs))
    except BaseException:
        stop.cancelled.set()  # otherwise the pool waits for the time limit
        raise


def offer_ant_path(instance: DirectedInstance, layers: Clusters, greedy: Route, seed: int, best: Best) -> None:
    """Offer the greedy path. Then run a few generations of ants with local search, and offer their best path."""
    stop = best.stop
    best.offer(
        instance.nodes_from_path(greedy.node, greedy.enter), instance.length(greedy.node, greedy.enter, greedy.leave), 0
    )
    own_stop = Stop(
        iterations=GENERATIONS,
        patience=PATIENCE,
        seconds=ANTS_SHARE * stop.seconds,
        cancelled=stop.cancelled,
        began=stop.began,
    )
    own = Best(own_stop)
    moves = Choices(instance, True, layers, greedy)
    parameters = AntParameters.from_options("acs", AcoOptions(), instance.n, True)
    ants = Ants(moves, initial_trails(moves, parameters, moves.offer_first_solution(own), seed), seed, own_stop)
    try:
        if own.cost > 0.0:
            run_population(ants, own)
    finally:  # also after Ctrl-C
        nodes = moves.instance_nodes(own.tour)
        path = create_route(instance, *instance.path_from_nodes(nodes))
        best.offer(nodes, instance.length(path.node, path.enter, path.leave), 0)
