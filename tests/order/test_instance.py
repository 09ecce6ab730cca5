"""The closed tour of a problem: nodes have their own numbers, paths consist of clusters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import tour_cost
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.instance import Instance, build_instance, candidate_lists, cost_model, path_cost, plant_tree

ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]
MATRIX = np.random.default_rng(1).integers(1, 99, (60, 60))


def instance_of(n: int, seed: int, ends: object, metric: str = "euclidean") -> Instance:
    """Return an instance of n places on a coarse grid."""
    xy = np.random.default_rng(seed).integers(0, 20, (n, 2)).astype(np.float64)
    matrix = (MATRIX + MATRIX.T)[:n, :n].astype(np.float64) if metric == "EXPLICIT" else None
    kind = Metric(metric, (10.0, 20.0), (50.0, 40.0), matrix=matrix)
    if ends == "closed":
        return build_instance(RoutingProblem.of_points(xy, kind, closed=True), 6)
    return build_instance(RoutingProblem.of_points(xy, kind, start=ends[0], end=ends[1]), 6)


def random_tour(instance: Instance, seed: int) -> np.ndarray:
    """Return any tour that keeps the tied edge, turned and begun anywhere."""
    rng = np.random.default_rng(seed)
    named = [v for v in (instance.first, instance.second) if v >= 0]
    rest = np.setdiff1d(np.arange(instance.n), named)
    tour = np.roll(np.concatenate([named, rng.permutation(rest)]), rng.integers(instance.n)).astype(np.int32)
    return tour[::-1].copy() if rng.integers(2) else tour


@pytest.mark.parametrize("ends", ENDS, ids=str)
@given(n=st.integers(5, 60), seed=st.integers(0, 2**31), metric=st.sampled_from(["euclidean", "linear", "EUC_2D"]))
def test_a_tour_costs_what_its_path_costs(n: int, seed: int, metric: str, ends: object) -> None:
    """So the path visits the right clusters in the right order, from the right end."""
    instance = instance_of(n, seed, ends, metric)
    tour = random_tour(instance, seed)
    path = instance.path(tour)
    assert sorted(path.tolist()) == list(range(n))
    assert path_cost(instance.problem, path) == pytest.approx(tour_cost(instance.cost, tour))


@pytest.mark.parametrize("ends", ENDS)
def test_the_path_does_not_depend_on_where_and_which_way_the_tour_is_written_down(ends: object) -> None:
    instance = instance_of(12, 3, ends)
    for seed in range(8):
        tour = random_tour(instance, seed)
        paths = [instance.path(np.roll(way, by)) for way in (tour, tour[::-1]) for by in range(instance.n)]
        assert all(np.array_equal(paths[0], p) for p in paths)
        if ends == "closed":
            assert paths[0][0] == 0
            assert paths[0][1] < paths[0][-1]
        if ends == (None, None):
            assert paths[0][0] < paths[0][-1]


@pytest.mark.parametrize("ends", ENDS)
def test_the_places_of_a_tour_are_those_of_its_path_with_the_given_ends(ends: object) -> None:
    instance = instance_of(12, 3, ends)
    tour = random_tour(instance, 5)
    path = instance.problem.entry[instance.path(tour)].tolist()
    first, last = ([], [path[0]]) if ends == "closed" else ([list(p)] if p is not None else [] for p in ends)
    assert instance.places(tour).tolist() == [*first, *path, *last]


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", [5, 9, 60])
def test_extra_nodes_come_last_and_every_node_stands_where_its_cluster_is(n: int, ends: object) -> None:
    instance = instance_of(n, 8, ends)
    assert sorted(instance.label[:n].tolist()) == list(range(n))
    assert instance.label[n:].tolist() == list(range(n, instance.n))
    assert np.array_equal(instance.cost.xy[:n], instance.problem.entry[instance.label[:n]])
    given_ends = [] if ends == "closed" else [p for p in ends if p is not None]
    assert instance.cost.xy[n : n + len(given_ends)].tolist() == [list(p) for p in given_ends]
    assert instance.label[instance.home] == max(0, instance.first)


@pytest.mark.parametrize("ends", ENDS)
def test_lists_for_exchanges_are_the_candidates_without_the_free_node(ends: object) -> None:
    instance = instance_of(40, 8, ends)
    lists, costs = instance.exchange_lists
    for v in range(instance.n):
        wanted = [c for c in instance.candidates[v].tolist() if c not in (-1, instance.cost.free)]
        assert [c for c in lists[v].tolist() if c >= 0] == wanted
        assert costs[v, : len(wanted)].tolist() == instance.costs(v, wanted).tolist()
        assert np.isinf(costs[v, len(wanted) :]).all()


def test_near_numbers_are_near_in_the_plane() -> None:
    """The distance between consecutive numbers is at most a twentieth of the distance in random order."""
    xy = np.random.default_rng(5).uniform(0, 1, (20000, 2))
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 5)
    steps, before = (np.hypot(*np.diff(p, axis=0).T).mean() for p in (instance.cost.xy, xy))
    assert steps < before / 20


def test_costs_from_a_matrix_keep_the_numbers_of_the_clusters() -> None:
    instance = instance_of(60, 2, "closed", "EXPLICIT")
    assert instance.label.tolist() == list(range(60))
    assert len(instance.tree.x) == 0
    tour = random_tour(instance, 6)
    assert path_cost(instance.problem, instance.path(tour)) == tour_cost(instance.cost, tour)


def test_the_same_points_always_get_the_same_numbers_and_lists() -> None:
    one, two = (instance_of(60, 2, ENDS[1]) for _ in range(2))
    assert np.array_equal(one.label, two.label)
    assert np.array_equal(one.candidates, two.candidates)


@given(st.integers(1, 60), st.integers(1, 30), st.integers(0, 10_000))
def test_lists_of_a_matrix_are_those_of_sorting_all(n: int, k: int, seed: int) -> None:
    """Ties are broken by the lower number; rows and columns without nodes stay empty.

    A third of the moves are forbidden: those come last, and a node is never in its own list.
    """
    rng = np.random.default_rng(seed)
    matrix = rng.integers(-3, 9, (n, n)).astype(float)
    matrix[rng.random((n, n)) < (seed % 3) / 6.0] = np.inf
    cost = cost_model(Metric("EXPLICIT", matrix=matrix), np.zeros((n, 2)))
    lists, lengths = candidate_lists(cost, plant_tree(np.zeros((0, 2)))[0], n, n + 1, k)
    for i in range(n):
        order = [j for j in np.argsort(matrix[i], kind="stable").tolist() if j != i][:k]
        assert lists[i].tolist() == order + [-1] * (k - len(order))
        assert lengths[i].tolist() == [*matrix[i, order].tolist()] + [np.inf] * (k - len(order))
    assert (lists[n] == -1).all()
