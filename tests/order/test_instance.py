"""The closed tour of a problem: nodes have their own numbers, paths consist of clusters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import CODES, tour_cost
from leafcut.model.problem import Metric, Relief, RoutingProblem
from leafcut.order.instance import (
    Instance,
    build_cost_model,
    build_instance,
    build_tree,
    candidate_lists,
    cluster_positions,
    is_directed,
    is_symmetric,
    matrix_of_nodes,
    path_cost,
)

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
    path = instance.cluster_order(tour)
    assert sorted(path.tolist()) == list(range(n))
    assert path_cost(instance.problem, path) == pytest.approx(tour_cost(instance.cost, tour))


@pytest.mark.parametrize("ends", ENDS)
def test_the_path_does_not_depend_on_where_and_which_way_the_tour_is_written_down(ends: object) -> None:
    instance = instance_of(12, 3, ends)
    for seed in range(8):
        tour = random_tour(instance, seed)
        paths = [instance.cluster_order(np.roll(way, by)) for way in (tour, tour[::-1]) for by in range(instance.n)]
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
    path = instance.problem.entry[instance.cluster_order(tour)].tolist()
    first, last = ([], [path[0]]) if ends == "closed" else ([list(p)] if p is not None else [] for p in ends)
    assert instance.path_positions(tour).tolist() == [*first, *path, *last]


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", [5, 9, 60])
def test_extra_nodes_come_last_and_every_node_stands_where_its_cluster_is(n: int, ends: object) -> None:
    instance = instance_of(n, 8, ends)
    assert sorted(instance.label[:n].tolist()) == list(range(n))
    assert instance.label[n:].tolist() == list(range(n, instance.n))
    assert np.array_equal(instance.cost.xy[:n], instance.problem.entry[instance.label[:n]])
    given_ends = [] if ends == "closed" else [p for p in ends if p is not None]
    assert instance.cost.xy[n : n + len(given_ends)].tolist() == [list(p) for p in given_ends]
    assert instance.label[instance.default_start] == max(0, instance.first)


@pytest.mark.parametrize("ends", ENDS)
def test_lists_for_exchanges_are_the_candidates_without_the_free_node(ends: object) -> None:
    instance = instance_of(40, 8, ends)
    lists, costs = instance.exchange_candidates
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
    assert path_cost(instance.problem, instance.cluster_order(tour)) == tour_cost(instance.cost, tour)


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
    cost = build_cost_model(Metric("EXPLICIT", matrix=matrix), np.zeros((n, 2)))
    lists, lengths = candidate_lists(cost, build_tree(np.zeros((0, 2)))[0], n, n + 1, k)
    for i in range(n):
        order = [j for j in np.argsort(matrix[i], kind="stable").tolist() if j != i][:k]
        assert lists[i].tolist() == order + [-1] * (k - len(order))
        assert lengths[i].tolist() == [*matrix[i, order].tolist()] + [np.inf] * (k - len(order))
    assert (lists[n] == -1).all()


def test_a_cost_model_has_the_numbers_of_its_metric_and_is_plain_without_anything_else() -> None:
    xy = np.array([(1, 2), (3, 4)])
    zones = np.array([(0, 1, 2, 3)])
    plain = Metric("dogleg", (10.0, 20.0), (30.0, 40.0), per_mm=0.5)
    model = build_cost_model(plain, xy)
    assert (model.code, model.plain, model.lift, model.per_mm) == (CODES["dogleg"], True, 0.0, 0.5)
    assert (model.vx, model.vy, model.ax, model.ay) == (10.0, 20.0, 30.0, 40.0)
    assert (model.xy.tolist(), model.xy.dtype) == ([[1.0, 2.0], [3.0, 4.0]], np.float64)
    assert (model.zones.shape, model.matrix.shape, model.tied_a, model.tied_b, model.free) == (
        (0, 4),
        (0, 0),
        -1,
        -1,
        -1,
    )
    relief = Relief(xy.astype(float), np.array([5.0, 6.0]), 7.0, np.zeros((1, 1)), 0, 0, 9, 2, 3)
    for more, metric in (
        ({"tied": (1, 0)}, plain),
        ({"free": 0}, plain),
        ({}, replace(plain, zones=zones, lift=0.25)),
        ({}, Metric("EXPLICIT", matrix=np.array([[0, 1], [2, 3]]))),
        ({}, replace(plain, relief=relief)),
    ):
        model = build_cost_model(metric, xy, **more)  # type: ignore[arg-type]
        assert not model.plain
        assert (model.tied_a, model.tied_b) == more.get("tied", (-1, -1))
        assert model.free == more.get("free", -1)
    assert build_cost_model(replace(plain, zones=zones, lift=0.25), xy).zones.tolist() == [[0.0, 1.0, 2.0, 3.0]]
    assert build_cost_model(replace(plain, zones=zones, lift=0.25), xy).lift == 0.25
    table = build_cost_model(Metric("EXPLICIT", matrix=np.array([[0, 1], [2, 3]])), xy).matrix
    assert (table.tolist(), table.dtype) == ([[0.0, 1.0], [2.0, 3.0]], np.float64)
    # With travel heights: lower left corner, side, speed and acceleration, rows of heights, columns; heights; tiles.
    assert model.matrix.tolist() == [[0.0, 0.0, 9.0, 2.0, 3.0, 1.0, 1.0], [5.0, 6.0, 0, 0, 0, 0, 0], [0.0] * 7]


def test_a_part_of_a_table_of_costs_is_that_of_its_nodes() -> None:
    model = build_cost_model(Metric("EXPLICIT", matrix=np.arange(9.0).reshape(3, 3)), np.zeros((3, 2)))
    assert matrix_of_nodes(model, np.array([2, 0])).tolist() == [[8.0, 6.0], [2.0, 0.0]]
    assert matrix_of_nodes(build_cost_model(Metric(), np.zeros((3, 2))), np.array([2, 0])).shape == (0, 0)


@pytest.mark.parametrize(
    ("ends", "first", "second", "tied", "free", "n"),
    [
        ("closed", -1, -1, (-1, -1), -1, 9),
        ((None, None), 9, -1, (-1, -1), 9, 10),
        (((1.0, 2.0), None), 10, 9, (10, 9), 10, 11),
        ((None, (3.0, 5.0)), 10, 9, (10, 9), 10, 11),
        (((1.0, 2.0), (3.0, 5.0)), 10, 9, (10, 9), -1, 11),
    ],
    ids=str,
)
@pytest.mark.parametrize("k", [0, 1, 4, 50])
def test_the_extra_nodes_of_an_instance(
    ends: object, first: int, second: int, tied: tuple[int, int], free: int, n: int, k: int
) -> None:
    """The start and the end follow the nine places, then the free node; it is the first candidate of every place."""
    xy = np.random.default_rng(4).uniform(0, 9, (9, 2))
    named = {"closed": True} if ends == "closed" else {"start": ends[0], "end": ends[1]}  # type: ignore[index]
    instance = build_instance(RoutingProblem.of_points(xy, **named), k)  # type: ignore[arg-type]
    cost = instance.cost
    assert (instance.first, instance.second, instance.n) == (first, second, n)
    assert ((cost.tied_a, cost.tied_b), cost.free) == (tied, free)
    places = 9 + sum(p is not None for p in ([] if ends == "closed" else ends))  # type: ignore[union-attr]
    width = min(k or n, places - 1)
    assert instance.candidates.shape == instance.lengths.shape == (n, width + (free >= 0))
    assert len(instance.tree.x) == places
    if free >= 0:
        assert instance.candidates[:9, 0].tolist() == [free] * 9
        assert instance.lengths[:9, 0].tolist() == [0.0] * 9
        assert (instance.candidates[9:, -1] == -1).all()
        assert np.isinf(instance.lengths[9:, -1]).all()
        assert (instance.candidates[free] == -1).all()
        assert cost.xy[free].tolist() == [0.0, 0.0]
    lists, costs = instance.exchange_candidates
    assert lists.shape == (n, width)
    for v in range(places):
        known = lists[v] >= 0
        assert costs[v, known].tolist() == instance.costs(v, lists[v, known]).tolist()
    assert instance.service == 0.0


def test_costs_are_exact_for_one_node_per_cluster_and_equal_directions() -> None:
    xy = np.random.default_rng(4).uniform(0, 9, (6, 2))
    points = replace(RoutingProblem.of_points(xy, closed=True), service=np.arange(6.0))
    assert build_instance(points, 3).exact
    assert build_instance(points, 3).service == 15.0
    assert not build_instance(replace(points, exit=xy + 1.0), 3).exact
    two = replace(points, cluster=np.array([0, 1, 2, 3, 4, 4], dtype=np.int32))
    assert not build_instance(two, 3).exact
    assert cluster_positions(two).tolist() == [*xy[:4].tolist(), ((xy[4] + xy[5]) / 2).tolist()]
    assert cluster_positions(replace(points, exit=xy + 1.0)) == pytest.approx(xy + 0.5)
    matrix = np.arange(36.0).reshape(6, 6)
    table = RoutingProblem.of_points(xy, Metric("EXPLICIT", matrix=matrix + matrix.T), closed=True)
    assert build_instance(table, 3).exact
    assert is_symmetric(table)
    assert not is_symmetric(replace(table, metric=Metric("EXPLICIT", matrix=matrix)))
    assert is_directed(replace(table, metric=Metric("EXPLICIT", matrix=matrix)))
