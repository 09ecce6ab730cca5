"""Start tours: greedy, and nearest neighbour."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import leafcut
from leafcut.kernels.cost import tour_cost
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order import construction
from leafcut.order.construction import greedy_tour, nearest_neighbour_tour
from leafcut.order.instance import build_instance
from plain_python import plain_python

ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]


def problem_of(xy: np.ndarray, ends: object, metric: Metric | None = None) -> RoutingProblem:
    """Return a closed problem, or one with the given ends."""
    if ends == "closed":
        return RoutingProblem.of_points(xy, metric or Metric(), closed=True)
    return RoutingProblem.of_points(xy, metric or Metric(), start=ends[0], end=ends[1])


def plain_greedy(places: list[tuple[float, float]], tied: tuple[int, int] | None, full: set[int]) -> set[frozenset]:
    """Return the edges of the greedy path through all places, by sorting all pairs; `full` have one neighbour already.

    With `tied` that edge is the first.
    """
    pairs = sorted(itertools.combinations(range(len(places)), 2), key=lambda p: math.dist(places[p[0]], places[p[1]]))
    if tied:
        pairs.insert(0, tied)
    degree = [1 if v in full else 0 for v in range(len(places))]
    part = list(range(len(places)))
    edges = set()
    for a, b in pairs:
        if degree[a] < 2 and degree[b] < 2 and part[a] != part[b]:
            degree[a] += 1
            degree[b] += 1
            gone = part[b]
            part = [part[a] if p == gone else p for p in part]
            edges.add(frozenset((a, b)))
    return edges


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", [5, 6, 9, 30, 200])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_with_full_lists_it_is_the_greedy_tour_by_sorting_all_pairs(n: int, seed: int, ends: object) -> None:
    """The reference lacks the closing edge; with a start and an end, that is the tied edge."""
    xy = np.random.default_rng(seed).uniform(0, 50, (n, 2))
    problem = problem_of(xy, ends)
    instance = build_instance(problem, 0)
    given_ends = [] if ends == "closed" else [p for p in ends if p is not None]
    places = [*map(tuple, xy.tolist()), *given_ends]
    tied = (n, n + 1) if len(given_ends) == 2 else None
    expected = plain_greedy(places, tied, {n} if len(given_ends) == 1 else set())
    tour = instance.label[greedy_tour(instance)]
    found = {frozenset(p) for p in zip(tour.tolist(), np.roll(tour, 1).tolist(), strict=True)}
    found = {e for e in found if max(e) < len(places)}
    assert expected <= found
    assert len(found) == len(expected) + (1 if instance.cost.free < 0 else 0)


@pytest.mark.parametrize("ends", ENDS, ids=str)
@given(
    n=st.integers(1, 70),
    grid=st.sampled_from([1, 3, 40]),
    seed=st.integers(0, 2**31),
    k=st.sampled_from([0, 2, 5, 8]),
)
def test_a_greedy_tour_visits_each_node_once_and_keeps_the_tied_edge(
    n: int, grid: int, seed: int, k: int, ends: object
) -> None:
    """Few places and many, all on one place, and with random changes too."""
    xy = np.random.default_rng(seed).integers(0, grid, (n, 2)).astype(np.float64)
    instance = build_instance(problem_of(xy, ends), k)
    for random in (None, np.random.default_rng(seed)):
        tour = greedy_tour(instance, random)
        assert tour.dtype == np.int32
        assert sorted(tour.tolist()) == list(range(instance.n))
        if instance.second >= 0:
            places = np.argsort(tour)
            assert abs(places[instance.first] - places[instance.second]) in (1, instance.n - 1)


@given(st.integers(5, 40), st.integers(0, 2**31), st.sampled_from([0, 3]))
def test_a_greedy_tour_of_a_matrix_visits_each_node_once(n: int, seed: int, k: int) -> None:
    matrix = np.random.default_rng(seed).integers(0, 50, (n, n)).astype(np.float64)
    metric = Metric("EXPLICIT", matrix=matrix + matrix.T)
    for ends in ("closed", (None, None)):
        instance = build_instance(problem_of(np.zeros((n, 2)), ends, metric), k)
        assert sorted(greedy_tour(instance).tolist()) == list(range(instance.n))


def test_places_visited_often_cost_nothing_more() -> None:
    """Forty holes on each of thirty places: a greedy tour goes through a place once, not forty times."""
    xy = np.random.default_rng(9).uniform(0, 100, (30, 2))
    once = build_instance(problem_of(xy, "closed"), 0)
    often = build_instance(problem_of(np.repeat(xy, 40, axis=0), "closed"), 8)
    many = greedy_tour(often)
    steps = np.hypot(*(often.cost.xy[many] - often.cost.xy[np.roll(many, 1)]).T)
    assert (steps > 0).sum() == 30
    assert tour_cost(often.cost, many) < 1.3 * tour_cost(once.cost, greedy_tour(once))


def test_random_changes_give_other_tours_that_are_nearly_as_good() -> None:
    instance = build_instance(problem_of(np.random.default_rng(3).uniform(0, 90, (500, 2)), "closed"), 8)
    plain = tour_cost(instance.cost, greedy_tour(instance))
    tours = [greedy_tour(instance, np.random.default_rng(seed)) for seed in (1, 2, 1)]
    assert np.array_equal(tours[0], tours[2])
    assert not np.array_equal(tours[0], tours[1])
    assert all(tour_cost(instance.cost, t) < 1.1 * plain for t in tours)


@pytest.mark.parametrize("name", ["rl1304", "fl1577", "u2319", "pcb3038", "rl11849"])
def test_greedy_is_better_than_nearest_neighbour(name: str, data: Path) -> None:
    part = leafcut.read_part(data / "tsplib" / f"{name}.tsp")
    metric = Metric(part.edge_weight_type)
    instance = build_instance(RoutingProblem.of_points(part.hole_xy, metric, closed=True), 8)
    cost, nearest = (tour_cost(instance.cost, make(instance)) for make in (greedy_tour, nearest_neighbour_tour))
    assert part.optimum <= cost < nearest
    assert cost < 1.25 * part.optimum


@given(st.integers(5, 40), st.integers(0, 2**31), st.sampled_from(ENDS))
def test_the_nearest_neighbours_of_few_nodes_are_those_of_the_tree(n: int, seed: int, ends: object) -> None:
    xy = np.random.default_rng(seed).integers(0, 40, (n, 2)).astype(float) + np.arange(n)[:, None] * 1e-3
    instance = build_instance(problem_of(xy, ends), 8)
    few = nearest_neighbour_tour(instance)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(construction, "FEW", 0)
        assert np.array_equal(few, nearest_neighbour_tour(instance))


def test_the_nearest_neighbours_of_a_matrix_are_the_cheapest() -> None:
    matrix = np.array(
        [[0, 5, 1, 9, 7], [5, 0, 4, 2, 8], [1, 4, 0, 6, 3], [9, 2, 6, 0, 5], [7, 8, 3, 5, 0]], dtype=float
    )
    problem = RoutingProblem.of_points(np.zeros((5, 2)), Metric("EXPLICIT", matrix=matrix), closed=True)
    assert nearest_neighbour_tour(build_instance(problem, 3)).tolist() == [0, 2, 4, 3, 1]


@pytest.mark.parametrize("closed", [True, False])
def test_the_nearest_neighbour_of_a_table_always_goes_to_the_cheapest_that_is_left(closed: bool) -> None:
    """The free end of an open path has no row in the table."""
    xy = np.random.default_rng(4).uniform(0.0, 90.0, (30, 2))
    matrix = np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1))
    instance = build_instance(RoutingProblem.of_points(xy, Metric("EXPLICIT", matrix=matrix), closed=closed), 6)
    path = [node for node in instance.label[nearest_neighbour_tour(instance)].tolist() if node < 30]
    assert sorted(path) == list(range(30))
    for k in range(29):
        assert matrix[path[k], path[k + 1]] == min(matrix[path[k], later] for later in path[k + 1 :])


@pytest.mark.parametrize("name", ["euclidean", "EXPLICIT"])
@pytest.mark.parametrize("ends", ENDS)
def test_the_nearest_neighbours_of_many_nodes_are_found_by_the_kernel(
    name: str, ends: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without positions and after the free node, all nodes are compared; the free node is left for the first one."""
    if name == "EXPLICIT" and ends not in ("closed", (None, None)):
        return  # a table has no costs to a given start or end
    monkeypatch.setattr(construction, "FEW", 0)
    half = np.random.default_rng(2).uniform(0, 50, (25, 25))
    metric = Metric(name, matrix=half + half.T) if name == "EXPLICIT" else None
    instance = build_instance(problem_of(np.random.default_rng(1).uniform(0, 50, (25, 2)), ends, metric), 6)
    xy, free = instance.cost.xy, instance.cost.free
    tour = [instance.default_start] if instance.second < 0 else [instance.first, instance.second]
    while len(tour) < instance.n:
        here, left = tour[-1], [v for v in range(instance.n) if v not in tour]
        if here == free or name == "EXPLICIT":
            tour.append(min(left, key=lambda v: float(instance.costs(here, v)[0])))
        else:
            tour.append(min((v for v in left if v != free), key=lambda v: math.dist(xy[here], xy[v])))
    with plain_python():
        assert nearest_neighbour_tour(instance).tolist() == tour
