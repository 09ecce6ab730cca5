"""Which algorithm with which moves orders a problem, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from leafcut.errors import SolveError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import ALGORITHM_TITLES, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import algorithms
from leafcut.order.algorithms import (
    CHOICES,
    PLACES,
    Algorithm,
    check_options,
    choose_algorithm,
    fits_cost_table,
    needs_choices,
)
from leafcut.order.directed import build_directed_instance, greedy_path
from leafcut.order.instance import Instance, build_instance
from leafcut.order.search import AlgorithmRun, Best, SearchResult
from leafcut.order.stop import Stop

ANTS = ("as", "eas", "asrank", "mmas", "acs")


def points(n: int, **more: object) -> RoutingProblem:
    """Return n points on a line."""
    return RoutingProblem.of_points(np.arange(2.0 * n).reshape(-1, 2), **more)  # type: ignore[arg-type]


def pair(n: int) -> RoutingProblem:
    """Return n points of which the first must come before the second."""
    return points(n, precedence=np.array([[0, 1]], dtype=np.int32))


def cuts(n: int) -> RoutingProblem:
    """Return n points with another exit each."""
    problem = points(n)
    return replace(problem, exit=problem.entry + 1.0)


def ways(clusters: int, nodes: int) -> RoutingProblem:
    """Return points of which the last cluster has several."""
    problem = points(nodes)
    return replace(problem, cluster=np.minimum(np.arange(nodes), clusters - 1).astype(np.int32))


def table(n: int, one_way: bool) -> RoutingProblem:
    """Return points with a table of costs."""
    matrix = np.arange(float(n * n)).reshape(n, n)
    return RoutingProblem.of_points(
        np.zeros((n, 2)), Metric("EXPLICIT", matrix=matrix if one_way else matrix + matrix.T), closed=True
    )


def test_each_entry_of_a_registry_has_its_key_as_name_and_the_move_set_of_the_registry() -> None:
    for registry, has_choices in ((PLACES, False), (CHOICES, True)):
        assert all((name, has_choices) == (a.name, a.has_choices) for name, a in registry.items())


def test_every_value_of_the_option_but_auto_and_none_is_an_algorithm_for_places() -> None:
    assert set(ALGORITHM_TITLES) == {"auto", "none", *PLACES}
    assert CHOICES.keys() <= PLACES.keys()


@pytest.mark.parametrize(
    ("problem", "needs"),
    [
        (points(9), False),
        (pair(9), True),
        (cuts(9), True),
        (ways(8, 9), True),
        (ways(20, 40), True),
        (ways(21, 40), False),
        (table(5, one_way=False), False),
        (table(5, one_way=True), True),
        (replace(table(25, one_way=False), cluster=np.minimum(np.arange(25), 23).astype(np.int32)), True),
    ],
    ids=range(9),
)
def test_choices_are_for_precedence_directions_and_not_too_many_alternatives(
    problem: RoutingProblem, needs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More than 20 clusters with alternatives are ordered by their middles, unless a table has no middles."""
    monkeypatch.setattr(algorithms, "MOST_CHOICES", 20)
    assert needs_choices(problem) is needs


def test_few_clusters_are_a_thousand_with_six_thousand_nodes() -> None:
    assert fits_cost_table(ways(1000, 6000))
    assert not fits_cost_table(ways(1000, 6001))
    assert not fits_cost_table(ways(1001, 1002))


@pytest.mark.parametrize(
    ("name", "problem", "choices"),
    [
        ("auto", points(9), False),
        ("auto", pair(9), True),
        ("colony", cuts(9), True),
        ("colony", cuts(1001), True),
        ("acs", pair(9), True),
        ("acs", cuts(1000), True),
        ("acs", cuts(1001), False),
        ("firefly", ways(8, 6001), False),
        ("nn", cuts(1001), True),
        ("kicks", cuts(9), False),
        ("2opt", points(9), False),
        ("mmas", table(5, one_way=True), True),
        ("kicks", table(5, one_way=False), False),
    ],
)
def test_an_algorithm_has_the_moves_that_a_problem_needs(name: str, problem: RoutingProblem, choices: bool) -> None:
    """Too many clusters with directions are ordered as points."""
    found = choose_algorithm(problem, SolveOptions(algorithm=name))
    assert found is (CHOICES if choices else PLACES)["colony" if name == "auto" else name]


@pytest.mark.parametrize(
    ("name", "problem", "message"),
    [
        (
            "acs",
            pair(1001),
            "algorithm 'acs' orders at most 1000 clusters with 6000 nodes; there are 1001 with 1001; use --algorithm "
            "auto",
        ),
        ("kicks", pair(9), "algorithm 'kicks' does not support precedence; use --algorithm auto"),
        (
            "2opt",
            table(5, one_way=True),
            "algorithm '2opt' needs equal costs in both directions; use --algorithm auto",
        ),
    ],
)
def test_an_algorithm_refuses_what_it_cannot_order(name: str, problem: RoutingProblem, message: str) -> None:
    with pytest.raises(SolveError) as refused:
        choose_algorithm(problem, SolveOptions(algorithm=name))
    assert str(refused.value) == message


def test_full_candidate_lists_are_refused_for_more_than_three_thousand_clusters() -> None:
    given = PLACES["kicks"], SolveOptions(candidates=0), AcoOptions(), FireflyOptions()
    check_options(points(3000), *given)
    check_options(points(3001), PLACES["kicks"], SolveOptions(candidates=1), AcoOptions(), FireflyOptions())
    with pytest.raises(SolveError) as refused:
        check_options(points(3001), *given)
    assert str(refused.value) == (
        "--candidates 0 makes all 3001 nodes candidates of each other, which needs too much memory above 3000 nodes; "
        "give a number such as 16"
    )


@pytest.mark.parametrize("choices", [False, True])
def test_an_algorithm_checks_the_options_of_ants_and_fireflies(choices: bool) -> None:
    given: list[tuple[object, ...]] = []
    algorithm = Algorithm(
        "toy",
        lambda *_: SearchResult(np.zeros(0, dtype=np.int32)),
        choices,
        check=lambda *a: given.append(a),
    )
    aco, firefly = AcoOptions(n_ants=3), FireflyOptions(n_fireflies=4)
    check_options(points(9), algorithm, SolveOptions(), aco, firefly)
    assert given == [("toy", aco, firefly, choices)]


def test_lists_have_the_candidates_of_the_algorithm_or_those_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[int] = []
    monkeypatch.setattr(algorithms, "build_instance", lambda _, k: given.append(k))
    algorithm = Algorithm("toy", lambda *_: None, candidates=7)  # type: ignore
    for candidates in (None, 0, 5):
        algorithm.build_instance(points(9), candidates)
    assert given == [7, 0, 5]


def test_nearest_neighbours_are_offered_with_their_cost() -> None:
    for problem, build, name in ((points(9), build_instance, PLACES), (cuts(9), build_directed_instance, CHOICES)):
        instance, best = build(problem, 5), Best(Stop())
        run = AlgorithmRun(SolveOptions(algorithm="nn"), AcoOptions(), FireflyOptions(), best)
        found = name["nn"].load()(instance, run)
        assert np.array_equal(found.tour, best.tour)
        if isinstance(instance, Instance):
            assert best.cost == instance.length(best.tour)
        else:
            path = greedy_path(instance)
            assert best.cost == instance.length(path.node, path.enter, path.leave)
            assert best.tour.tolist() == instance.nodes_from_path(path.node, path.enter).tolist()
        assert best.iteration == 0
