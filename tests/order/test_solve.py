"""One suite for every algorithm: each visits all, states its true cost, and finds the optimum of small problems."""

from __future__ import annotations

import itertools
import math
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import SolveError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import ALGORITHMS, AcoOptions, SolveOptions
from leafcut.order.solve import keep_better, solve
from packages import Installer, shop
from travel_reference import travel_cost

ANTS = ("as", "eas", "asrank", "mmas", "acs")
#: The algorithm of the package in `docs/plugins.md`, installed for these tests; it must satisfy the same rules as
#: leafcut's own.
PACKAGED = "random-insertion"
ALL = (*ALGORITHMS, PACKAGED)
ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]
METRICS = [Metric(), Metric("linear", (40.0, 20.0), (90.0, 70.0)), Metric("dogleg", (40.0, 20.0), (90.0, 70.0))]


@pytest.fixture(autouse=True)
def installed(install: Installer) -> None:
    """Install the package that brings `PACKAGED`."""
    install(*shop())


def problem_of(xy: np.ndarray, metric: Metric, ends: object) -> RoutingProblem:
    """Return a closed problem, or one with the given ends."""
    if ends == "closed":
        return RoutingProblem.of_points(xy, metric, closed=True)
    start, end = ends
    return RoutingProblem.of_points(xy, metric, start=start, end=end)


def added_up(problem: RoutingProblem, nodes: list[int]) -> float:
    """Return the cost of a path edge by edge, by the plain reference."""
    places = [tuple(problem.entry[i]) for i in nodes]
    if problem.closed:
        places.append(places[0])
    else:
        places = [p for p in (problem.start, *places, problem.end) if p is not None]
    return sum(travel_cost(problem.metric, a, b) for a, b in itertools.pairwise(places))


def least_of_all_orders(problem: RoutingProblem) -> float:
    """Return the cost of the cheapest of all orders, by the plain reference; moves between nodes are timed once."""
    places = [tuple(place) for place in problem.entry]
    ways = np.array([[travel_cost(problem.metric, a, b) for b in places] for a in places])
    first, last = (
        np.array([travel_cost(problem.metric, *way(place)) if at is not None else 0.0 for place in places])
        for at, way in ((problem.start, lambda p: (problem.start, p)), (problem.end, lambda p: (p, problem.end)))
    )
    orders = np.array(list(itertools.permutations(range(len(places)))))
    costs = ways[orders[:, :-1], orders[:, 1:]].sum(axis=1) + first[orders[:, 0]] + last[orders[:, -1]]
    costs += ways[orders[:, -1], orders[:, 0]] if problem.closed else 0.0
    assert costs[7] == pytest.approx(added_up(problem, orders[7].tolist()))
    return float(costs.min())


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("metric", METRICS, ids=lambda m: m.name)
def test_the_ants_find_the_optimum_of_seven_nodes(metric: Metric, ends: object) -> None:
    problem = problem_of(np.random.default_rng(11).uniform(0, 40, (7, 2)), metric, ends)
    least = least_of_all_orders(problem)
    for algorithm in (*ANTS, "auto", "kicks"):
        found = solve(problem, SolveOptions(algorithm=algorithm, preset="fast"))
        assert found.cost == pytest.approx(least), algorithm


@pytest.mark.parametrize("algorithm", ALL)
@pytest.mark.parametrize("ends", ENDS)
def test_every_algorithm_visits_each_node_once_and_states_the_true_cost(algorithm: str, ends: object) -> None:
    problem = problem_of(np.random.default_rng(2).integers(0, 20, (40, 2)).astype(float), METRICS[1], ends)
    for local in (True, False):
        options = SolveOptions(algorithm=algorithm, iterations=3, local_search=local)
        found = solve(problem, options, AcoOptions(n_ants=5))
        assert sorted(found.nodes.tolist()) == list(range(40))
        assert found.cost == pytest.approx(added_up(problem, found.nodes.tolist()))
        costs = [c for _, c in found.history]
        assert costs == sorted(costs, reverse=True)
        assert costs[-1] == pytest.approx(found.cost)


@pytest.mark.parametrize("algorithm", [*ANTS, "colony", "firefly"])
def test_the_answer_does_not_depend_on_the_number_of_threads(algorithm: str) -> None:
    problem = problem_of(np.random.default_rng(4).uniform(0, 40, (60, 2)), METRICS[0], "closed")
    answers = [solve(problem, SolveOptions(algorithm=algorithm, iterations=8, threads=t, seed=9)) for t in (1, 2, 3)]
    assert all(np.array_equal(answers[0].nodes, a.nodes) and answers[0].cost == a.cost for a in answers)
    assert [sum(w.ants for w in a.workers) for a in answers] == [sum(w.ants for w in answers[0].workers)] * 3


#: Those that throw no dice: they have one answer whatever the seed.
WITHOUT_DICE = ("none", "nn", "2opt")


@pytest.mark.parametrize("algorithm", [a for a in ALL if a not in WITHOUT_DICE])
def test_another_seed_gives_another_search_and_the_same_seed_the_same(algorithm: str) -> None:
    """With 200 nodes and such a short search, the results of the workers differ between seeds, if not the tour."""
    problem = problem_of(np.random.default_rng(4).uniform(0, 40, (200, 2)), METRICS[0], "closed")
    options = {"algorithm": algorithm, "iterations": 1, "threads": 1}
    one, again, two = (solve(problem, SolveOptions(seed=s, **options), AcoOptions(n_ants=3)) for s in (1, 1, 2))
    first, same, other = ((found.nodes.tolist(), [w.best for w in found.workers]) for found in (one, again, two))
    assert first == same
    assert first != other
    nearest = solve(problem, SolveOptions(algorithm="nn"))
    assert one.cost <= nearest.cost
    assert two.cost <= nearest.cost


@pytest.mark.parametrize("algorithm", ALL)
@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 5])
@pytest.mark.parametrize("ends", ENDS)
def test_tiny_and_degenerate_problems_are_solved(algorithm: str, n: int, ends: object) -> None:
    """No nodes, few nodes, and all nodes on one place."""
    for xy in (np.zeros((n, 2)), np.arange(2.0 * n).reshape(n, 2)):
        problem = problem_of(xy, METRICS[0], ends)
        found = solve(problem, SolveOptions(algorithm=algorithm, iterations=2))
        assert sorted(found.nodes.tolist()) == list(range(n))
        assert math.isfinite(found.cost)


def test_a_part_of_another_size_gives_the_same_tour() -> None:
    """Scaled by 16, which floating point does exactly: nothing in the search may depend on how long a millimetre is."""
    xy = np.random.default_rng(8).uniform(0, 3, (70, 2))
    small, large = (problem_of(xy * scale, Metric(), "closed") for scale in (1.0, 16.0))
    options = SolveOptions(preset="fast", seed=3)
    assert np.array_equal(solve(small, options).nodes, solve(large, options).nodes)


def slots(closed: bool) -> RoutingProblem:
    """Return five slots of two directions each, in general position."""
    rng = np.random.default_rng(6)
    a, b = rng.uniform(0, 50, (5, 2)), rng.uniform(0, 50, (5, 2))
    entry = np.stack([a, b], axis=1).reshape(-1, 2)
    leave = np.stack([b, a], axis=1).reshape(-1, 2)
    cluster = np.repeat(np.arange(5, dtype=np.int32), 2)
    return RoutingProblem(entry, leave, cluster, np.zeros(10), start=None if closed else (0.0, 0.0), closed=closed)


@pytest.mark.parametrize("closed", [True, False])
def test_the_ways_of_clusters_are_chosen_at_their_best_along_an_order(closed: bool) -> None:
    """All 2⁵ combinations of directions along the order: none is cheaper."""
    from leafcut.order.instance import path_cost

    problem = slots(closed)
    found = solve(problem, SolveOptions(preset="fast"))
    order = found.nodes // 2
    assert sorted(order.tolist()) == list(range(5))
    choices = itertools.product((0, 1), repeat=5)
    least = min(path_cost(problem, (2 * order + np.array(c)).astype(np.int32)) for c in choices)
    assert found.cost == pytest.approx(least)


def test_zones_are_avoided_where_a_lift_costs_more_than_the_way_round() -> None:
    """Two rows with a wall between their ends: a path that crosses once is best, whatever its length."""
    xy = np.array([[x, y] for y in (0.0, 10.0) for x in range(6)])
    wall = np.array([[-1.0, 4.0, 4.5, 6.0]])
    problem = RoutingProblem.of_points(xy, Metric(zones=wall, lift=100.0), closed=True)
    found = solve(problem, SolveOptions(preset="fast"))
    assert 100.0 <= found.cost < 200.0


def test_stopping_at_once_still_gives_a_whole_tour() -> None:
    cancelled = threading.Event()
    cancelled.set()
    problem = problem_of(np.random.default_rng(1).uniform(0, 9, (50, 2)), Metric(), "closed")
    found = solve(problem, SolveOptions(), cancelled=cancelled)
    assert sorted(found.nodes.tolist()) == list(range(50))
    assert found.stopped_early


def test_the_order_of_the_drawing_is_kept_when_it_is_better() -> None:
    problem = RoutingProblem.of_points([[0, 0], [1, 0], [2, 0]], start=(0.0, 0.0))
    bad = solve(RoutingProblem.of_points([[0, 0], [2, 0], [1, 0]], start=(0.0, 0.0)), SolveOptions(algorithm="none"))
    kept = keep_better(problem, bad, np.array([0, 1, 2], dtype=np.int32))
    assert kept.cost == 2.0
    assert kept.nodes.tolist() == [0, 1, 2]


def test_full_candidate_lists_are_refused_where_they_take_too_much_memory() -> None:
    problem = problem_of(np.random.default_rng(1).uniform(0, 9, (5000, 2)), Metric(), "closed")
    with pytest.raises(SolveError, match="--candidates 0"):
        solve(problem, SolveOptions(candidates=0))


@pytest.mark.parametrize("algorithm", ["kicks", "2opt", PACKAGED])
def test_an_algorithm_that_cannot_keep_precedence_refuses_it(algorithm: str) -> None:
    pairs = np.array([[0, 1]], dtype=np.int32)
    problem = RoutingProblem.of_points(np.arange(12.0).reshape(6, 2), precedence=pairs)
    with pytest.raises(SolveError, match=f"'{algorithm}' does not support precedence; use --algorithm auto"):
        solve(problem, SolveOptions(algorithm=algorithm))


@given(st.integers(5, 30), st.integers(0, 10_000))
def test_ants_are_never_worse_than_nearest_neighbour(n: int, seed: int) -> None:
    problem = problem_of(np.random.default_rng(seed).integers(0, 15, (n, 2)).astype(float), Metric(), "closed")
    ants = solve(problem, SolveOptions(iterations=1))
    assert ants.cost <= solve(problem, SolveOptions(algorithm="nn")).cost + 1e-9


@pytest.mark.parametrize("algorithm", [*ANTS, "colony", "kicks"])
def test_every_search_tells_what_its_workers_did(algorithm: str) -> None:
    problem = problem_of(np.random.default_rng(3).uniform(0, 40, (50, 2)), Metric(), "closed")
    found = solve(problem, SolveOptions(algorithm=algorithm, iterations=4), AcoOptions(n_ants=6))
    # Kicks: 4 times 200. Colony: 8 ants build and then meet 4 times, before which the first may walk one way.
    made = {"kicks": {800}, "colony": set(range(16, 200))}.get(algorithm, {24})
    assert sum(w.ants for w in found.workers) in made
    assert min(w.best for w in found.workers) >= found.cost - 1e-9


@pytest.mark.parametrize("algorithm", ["kicks", "2opt", PACKAGED])
def test_a_table_that_differs_by_direction_is_refused_by_algorithms_for_equal_costs(algorithm: str) -> None:
    """Their exchanges reverse runs at no cost, so they would not end."""
    matrix = np.random.default_rng(5).uniform(1.0, 9.0, (20, 20))
    problem = RoutingProblem.of_points(np.zeros((20, 2)), Metric("EXPLICIT", matrix=matrix), closed=True)
    with pytest.raises(SolveError, match=f"'{algorithm}' needs equal costs in both directions; use --algorithm auto"):
        solve(problem, SolveOptions(algorithm=algorithm))


@pytest.mark.parametrize("algorithm", ["auto", "kicks", "mmas", "2opt", "nn", PACKAGED])
def test_no_iterations_give_a_start_tour(algorithm: str) -> None:
    """With and without progress reports."""
    problem = RoutingProblem.of_points(np.random.default_rng(4).uniform(0, 50, (30, 2)), closed=True)
    for progress in (None, lambda *_: None):
        found = solve(problem, SolveOptions(algorithm=algorithm, iterations=0), progress=progress)
        assert sorted(found.nodes.tolist()) == list(range(30))
