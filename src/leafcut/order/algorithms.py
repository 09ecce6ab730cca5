"""Registry of algorithms. Each algorithm supports one or both of two move sets:

- *Places*: tours of single nodes, with symmetric costs and no precedence.
- *Choices*: paths with several nodes per cluster, asymmetric costs, or precedence.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from leafcut.errors import SolveError
from leafcut.files.plugins import lazy_function
from leafcut.model.problem import RoutingProblem
from leafcut.options import ALGORITHM_TITLES, ANT_ALGORITHMS, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.construction import nearest_neighbour_tour
from leafcut.order.instance import (
    CANDIDATES,
    FULL_LISTS_LIMIT,
    Instance,
    build_instance,
    is_directed,
)
from leafcut.order.search import AlgorithmRun, SearchResult

if TYPE_CHECKING:
    from leafcut.order.directed import AnyInstance, DirectedInstance

#: When building a tour, ants choose among this many candidates per node.
ANTS_CANDIDATES = 16

#: If some clusters have several nodes, the search uses the move set *choices* for up to this many clusters. Larger
#: problems are ordered by the mean position of the nodes in each cluster. On 6000 contours with 8 nodes each, choices
#: produced paths that were 2 % shorter after 3 s and 3 % shorter after 15 s.
MOST_CHOICES = 20_000

#: Problem size limits for algorithms with choices that store the cost of every move, which takes n² memory.
MOST_CLUSTERS, MOST_NODES = 1000, 6000

Search = Callable[[Any, AlgorithmRun], SearchResult]


@dataclass(frozen=True)
class Algorithm:
    """An algorithm that uses one of the two move sets.

    Attributes
    ----------
    load
        Imports the search function and returns it.
    has_choices
        Whether the algorithm uses the move set *choices*.
    few
        Whether the algorithm is limited to `MOST_CLUSTERS` clusters and `MOST_NODES` nodes.
    check
        Raises an error if an option is not supported. It is called with the algorithm's name, the ant options, the
        firefly options, and whether the move set is *choices*.
    """

    name: str
    load: Callable[[], Search]
    has_choices: bool = False
    few: bool = False
    candidates: int = ANTS_CANDIDATES
    check: Callable[[str, AcoOptions, FireflyOptions, bool], None] = lambda *_: None

    def build_instance(self, problem: RoutingProblem, candidates: int | None) -> AnyInstance:
        """Convert a problem to the type of instance that the algorithm's move set requires."""
        candidates = self.candidates if candidates is None else candidates
        if not self.has_choices:
            return build_instance(problem, candidates)
        from leafcut.order.directed import build_directed_instance

        return build_directed_instance(problem, candidates)


def choose_algorithm(problem: RoutingProblem, options: SolveOptions) -> Algorithm:
    """Look up the algorithm that the options name, with the move set that the problem needs.

    Raises
    ------
    SolveError
        If the algorithm does not support the problem's precedence, asymmetric costs, or number of clusters.
    """
    name = "colony" if options.algorithm == "auto" else options.algorithm
    choices, ordered = CHOICES.get(name), len(problem.precedence) > 0
    if choices is not None and needs_choices(problem) and (fits_cost_table(problem) or not choices.few):
        return choices
    if ordered and choices is not None:
        raise SolveError(
            "algorithm '{}' orders at most {} clusters with {} nodes; there are {} with {}; use --algorithm auto",
            name,
            MOST_CLUSTERS,
            MOST_NODES,
            problem.n_clusters,
            problem.n_nodes,
        )
    if ordered:
        raise SolveError("algorithm '{}' does not support precedence; use --algorithm auto", name)
    if problem.metric.matrix is not None and is_directed(problem):
        raise SolveError("algorithm '{}' needs equal costs in both directions; use --algorithm auto", name)
    return PLACES[name] if name in PLACES else _plugin_algorithm(name)


def _plugin_algorithm(name: str) -> Algorithm:
    from leafcut.order.packaged import run_plugin_algorithm

    return Algorithm(name, lambda: partial(run_plugin_algorithm, name))


def fits_cost_table(problem: RoutingProblem) -> bool:
    """Check whether the problem is small enough to store the cost of every move between its nodes."""
    return problem.n_clusters <= MOST_CLUSTERS and problem.n_nodes <= MOST_NODES


def needs_choices(problem: RoutingProblem) -> bool:
    """Check whether the search needs the move set *choices*.

    If a problem has more than `MOST_CHOICES` clusters, the search uses the mean position of each cluster instead.
    """
    if len(problem.precedence):
        return True
    if problem.n_nodes > problem.n_clusters:
        return problem.metric.matrix is not None or problem.n_clusters <= MOST_CHOICES
    return is_directed(problem)


def algorithm_titles() -> dict[str, str]:
    """Return the title of each value of ``--algorithm``.

    If a plug-in is broken, its error message serves as the title.
    """
    from leafcut.order.packaged import PACKAGED

    titles = {one.name: one.refusal if one.adds is None else one.adds.title for one in PACKAGED.plugins()}
    return {**titles, **ALGORITHM_TITLES}


def check_algorithm(name: str) -> None:
    """Raise OptionError if no algorithm has this name or if its package cannot be loaded."""
    if name not in ALGORITHM_TITLES:
        from leafcut.order.packaged import PACKAGED

        PACKAGED.load(name)


def check_options(
    problem: RoutingProblem, algorithm: Algorithm, options: SolveOptions, aco: AcoOptions, firefly: FireflyOptions
) -> None:
    """Check the options of an algorithm before compiling any kernel.

    Raises
    ------
    SolveError
        If the algorithm does not support an option, or if full candidate lists would be too large.
    """
    algorithm.check(algorithm.name, aco, firefly, algorithm.has_choices)
    if options.candidates == 0 and problem.n_clusters > FULL_LISTS_LIMIT:
        raise SolveError(
            "--candidates 0 makes all {} nodes candidates of each other, which needs too much memory above {} "
            "nodes; give a number such as 16",
            problem.n_clusters,
            FULL_LISTS_LIMIT,
        )


def _run_nearest_neighbour(instance: Instance, run: AlgorithmRun) -> SearchResult:
    tour = nearest_neighbour_tour(instance)
    run.best.offer(tour, instance.length(tour), 0)
    return SearchResult(tour)


def _run_greedy_path(instance: DirectedInstance, run: AlgorithmRun) -> SearchResult:
    from leafcut.order.directed import greedy_path

    path = greedy_path(instance)
    nodes = instance.nodes_from_path(path.node, path.enter)
    run.best.offer(nodes, instance.length(path.node, path.enter, path.leave), 0)
    return SearchResult(nodes)


def _lazy_search(place: str) -> Callable[[], Search]:
    return partial(resolve_name, f"leafcut.order.{place}")


_ants, _fireflies = (
    _lazy_search("literature.ant_algorithms:run_ants"),
    _lazy_search("literature.fireflies:run_fireflies"),
)
_check_ants = lazy_function("leafcut.order.literature.ant_algorithms:check_ants")
_check_fireflies = lazy_function("leafcut.order.literature.fireflies:check_fireflies")

#: Built-in algorithms for places. `auto` selects `colony`. `none` does not search at all.
PLACES = {
    one.name: one
    for one in (
        Algorithm("colony", _lazy_search("colony:run_colony"), candidates=CANDIDATES),
        *(Algorithm(name, _ants, check=_check_ants) for name in ANT_ALGORITHMS),
        Algorithm("firefly", _fireflies, check=_check_fireflies),
        Algorithm("kicks", _lazy_search("kicks:run_iterated_local_search"), candidates=CANDIDATES),
        Algorithm("2opt", _lazy_search("literature.places:run_local_search")),
        Algorithm("nn", lambda: _run_nearest_neighbour),
    )
}

#: Built-in algorithms for choices.
CHOICES = {
    one.name: one
    for one in (
        Algorithm("colony", _lazy_search("path_search:run_path_search"), has_choices=True, candidates=CANDIDATES),
        *(Algorithm(name, _ants, has_choices=True, few=True, check=_check_ants) for name in ANT_ALGORITHMS),
        Algorithm("firefly", _fireflies, has_choices=True, few=True, check=_check_fireflies),
        Algorithm("nn", lambda: _run_greedy_path, has_choices=True),
    )
}
