"""Registry of algorithms, each with one or both move sets: *places* (tours of single nodes, symmetric costs, no
precedence) and *choices* (paths with several nodes per cluster, asymmetric costs, or precedence).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.model.problem import RoutingProblem
from leafcut.options import ALGORITHM_TITLES, ANT_ALGORITHMS, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.best import Best
from leafcut.order.colony import run_colony, warm_colony
from leafcut.order.construction import nearest_neighbour
from leafcut.order.directed import FEW_CLUSTERS, FEW_NODES, AnyInstance, DirectedInstance, build_directed, greedy_path
from leafcut.order.exact import choose_nodes
from leafcut.order.instance import (
    FULL_LISTS_LIMIT,
    Instance,
    build_instance,
    is_directed,
    path_cost,
)
from leafcut.order.kicks import CANDIDATES, MANY, run_kicks, warm_kicks
from leafcut.order.packaged import PACKAGED, run_packaged
from leafcut.order.search import AlgorithmRun, SearchResult
from leafcut.order.stop import Stop

#: Candidates per node for ants, which choose every edge of a tour from them.
ANTS_CANDIDATES = 16

#: Maximum number of clusters for the move set of choices if some have several nodes. More are ordered by the mean
#: positions of their nodes. Measured on 6000 contours of 8 nodes: choices 2 % shorter after 3 s and 3 % after 15 s.
MOST_CHOICES = 20_000

#: Nodes of the problem for which kernels are compiled.
WARM_NODES = 40

#: Maximum size of a problem with choices for algorithms that store the costs of all moves (n² memory).
MOST_CLUSTERS, MOST_NODES = 1000, 6000

Search = Callable[[Any, AlgorithmRun], SearchResult]
#: A short search that calls all kernels; the flag marks a large problem.
Warm = Callable[[Any, AlgorithmRun, bool], Ints]


@dataclass(frozen=True)
class Algorithm:
    """An entry of the registry.

    Attributes
    ----------
    places, choices
        Search functions of the two move sets; None if not available. `warm_places` and `warm_choices` call their
        kernels.
    few
        `choices` is limited to few clusters (`MOST_CLUSTERS`, `MOST_NODES`).
    check
        Raises an error for unsupported options, given those of ants and fireflies and whether there are choices.
    """

    places: Search
    choices: Search | None = None
    warm_places: Warm | None = None
    warm_choices: Warm | None = None
    few: bool = False
    candidates: int = ANTS_CANDIDATES
    check: Callable[[str, AcoOptions, FireflyOptions, bool], None] = lambda *_: None


@dataclass(frozen=True)
class Method:
    """An algorithm and its move set for a problem."""

    name: str
    algorithm: Algorithm
    has_choices: bool

    @property
    def search(self) -> Search:
        """Search function of the move set."""
        return self.algorithm.choices if self.has_choices and self.algorithm.choices else self.algorithm.places

    def warm(self, instance: AnyInstance, run: AlgorithmRun, large: bool) -> Ints:
        """Run a short search that calls every kernel of `search`, and return its tour."""
        warm = self.algorithm.warm_choices if self.has_choices else self.algorithm.warm_places
        return self.search(instance, run).tour if warm is None else warm(instance, run, large)

    def instance(self, problem: RoutingProblem, candidates: int | None) -> AnyInstance:
        """Return the instance of the problem for the move set."""
        k = self.algorithm.candidates if candidates is None else candidates
        return build_directed(problem, k) if self.has_choices else build_instance(problem, k)


def method_for(problem: RoutingProblem, options: SolveOptions) -> Method:
    """Return the algorithm named in the options, with its move set for a problem. Raises SolveError if the algorithm
    does not support precedence, asymmetric costs, or the number of clusters.
    """
    name = "colony" if options.algorithm == "auto" else options.algorithm
    algorithm = OWN[name] if name in OWN else _on_demand(name)
    wanted, ordered = needs_choices(problem), len(problem.precedence) > 0
    if wanted and algorithm.choices is not None and (is_few(problem) or not algorithm.few):
        return Method(name, algorithm, True)
    if ordered and algorithm.few:
        raise SolveError(
            f"algorithm '{name}' orders at most {MOST_CLUSTERS} clusters with {MOST_NODES} nodes; there are "
            f"{problem.n_clusters} with {problem.n_nodes}; use --algorithm auto"
        )
    if ordered:
        raise SolveError(f"algorithm '{name}' does not support precedence; use --algorithm auto")
    if problem.metric.matrix is not None and is_directed(problem):
        raise SolveError(f"algorithm '{name}' needs equal costs in both directions; use --algorithm auto")
    return Method(name, algorithm, False)


@cache
def _on_demand(name: str) -> Algorithm:
    """Return the entry of an algorithm of the literature or of a package, whose modules and kernels only it needs.

    Always the same entry, so that its warm-up runs once.
    """
    if name in ANT_ALGORITHMS:
        from leafcut.order.literature.ant_algorithms import check_ants, run_ants

        return Algorithm(run_ants, run_ants, few=True, check=check_ants)
    if name == "firefly":
        from leafcut.order.literature.fireflies import check_fireflies, run_fireflies

        return Algorithm(run_fireflies, run_fireflies, few=True, check=check_fireflies)
    if name == "2opt":
        from leafcut.order.literature.places import run_local_search

        return Algorithm(run_local_search)
    return Algorithm(partial(run_packaged, name))


def is_few(problem: RoutingProblem) -> bool:
    """Return whether the problem is small enough to store the costs of all moves between its nodes."""
    return problem.n_clusters <= MOST_CLUSTERS and problem.n_nodes <= MOST_NODES


def needs_choices(problem: RoutingProblem) -> bool:
    """Return whether the move set of choices is needed; above `MOST_CHOICES`, mean positions are used instead."""
    if len(problem.precedence):
        return True
    if problem.n_nodes > problem.n_clusters:
        return problem.metric.matrix is not None or problem.n_clusters <= MOST_CHOICES
    return is_directed(problem)


def algorithm_titles() -> dict[str, str]:
    """Return the values of ``--algorithm`` with their titles; a broken plug-in has its error instead."""
    titles = {one.name: one.refusal if one.adds is None else one.adds.title for one in PACKAGED.plugins()}
    return {**titles, **ALGORITHM_TITLES}


def check_algorithm(name: str) -> None:
    """Check the name of an algorithm. Raises OptionError if it is unknown, or its package cannot be loaded."""
    if name not in ALGORITHM_TITLES:
        PACKAGED.load(name)


def check_options(
    problem: RoutingProblem, method: Method, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions
) -> None:
    """Check the options of an algorithm before anything is compiled. Raises SolveError if the algorithm does not
    support an option, or full candidate lists would be too large.
    """
    method.algorithm.check(method.name, aco, firefly, method.has_choices)
    if options.candidates == 0 and problem.n_clusters > FULL_LISTS_LIMIT:
        raise SolveError(
            f"--candidates 0 makes all {problem.n_clusters} nodes candidates of each other, too much memory above "
            f"{FULL_LISTS_LIMIT} nodes; give a number such as 16"
        )


def warm_up(
    problem: RoutingProblem, options: SolveOptions, aco: AcoOptions | None = None, firefly: FireflyOptions | None = None
) -> None:
    """Compile every kernel that the search needs, or load it from disk, before the clock starts, by an iteration or
    two on a small problem of the same kind. After Ctrl-C, the next call runs it again.
    """
    method, firefly = method_for(problem, options), firefly or FireflyOptions()
    options = replace(
        options, algorithm=method.name, seed=1, threads=1, preset="fast", time_limit=None, target_gap=None,
        candidates=None, iterations=2 if method.name == "firefly" else 1,  # fireflies move from the second one
    )  # fmt: skip
    aco = replace(aco or AcoOptions(), n_ants=1, parallel="threads")
    directed = method.has_choices and is_directed(problem) and problem.n_nodes == problem.n_clusters
    many = problem.n_clusters >= FEW_CLUSTERS or problem.n_nodes > FEW_NODES
    large = many if method.has_choices else problem.n_clusters >= MANY
    _warm_up(method, directed, large, options, aco, FireflyOptions(n_fireflies=2, variant=firefly.variant))


@cache
def _warm_up(
    method: Method, directed: bool, large: bool, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions
) -> None:
    # Pseudo-random points; importing NumPy's generator would take longer than the rest.
    places = np.arange(2.0 * WARM_NODES)[:, None] * (75.4878, 56.9840) % 100.0
    entry, pairs = places[:WARM_NODES], [(0, 1)] if method.has_choices else []
    small = RoutingProblem(
        entry=entry,
        exit=places[WARM_NODES:] if directed else entry,
        cluster=np.arange(WARM_NODES, dtype=np.int32),
        service=np.zeros(WARM_NODES),
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
    )
    instance = method.instance(small, CANDIDATES)
    stop = Stop()
    tour = method.warm(instance, AlgorithmRun(options, aco, firefly, Best(stop)), large)
    if stop.cancelled.is_set():
        raise KeyboardInterrupt  # the search caught it to keep its best tour; an aborted warm-up is not cached
    path_cost(small, choose_nodes(small, instance.path(tour)))


def _nearest_tour(instance: Instance, run: AlgorithmRun) -> SearchResult:
    tour = nearest_neighbour(instance)
    run.best.offer(tour, instance.length(tour), 0)
    return SearchResult(tour)


def _nearest_path(instance: DirectedInstance, run: AlgorithmRun) -> SearchResult:
    path = greedy_path(instance)
    nodes = instance.nodes(path.node, path.enter)
    run.best.offer(nodes, instance.length(path.node, path.enter, path.leave), 0)
    return SearchResult(nodes)


def _run_paths(instance: DirectedInstance, run: AlgorithmRun) -> SearchResult:
    """Run the search for paths, whose kernels tours of places do not need."""
    from leafcut.order.path_search import run_paths

    return run_paths(instance, run)


def _warm_paths(instance: DirectedInstance, run: AlgorithmRun, large: bool) -> Ints:
    from leafcut.order.path_search import warm_paths

    return warm_paths(instance, run, large)


#: Algorithms of leafcut by name; `auto` selects `colony`, and `none` needs no search.
OWN = {
    "colony": Algorithm(run_colony, _run_paths, warm_colony, _warm_paths, candidates=CANDIDATES),
    "kicks": Algorithm(run_kicks, warm_places=warm_kicks, candidates=CANDIDATES),
    "nn": Algorithm(_nearest_tour, _nearest_path),
}
