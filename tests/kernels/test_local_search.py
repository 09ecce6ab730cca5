"""Local search keeps tours tours, and never makes them longer."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.local_search import exchange, improve, queue_all
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.solve.instance import build_instance
from leafcut.solve.local_search import LocalSearch
from leafcut.solve.stop import Stop

SIZES = st.integers(5, 60)
SEEDS = st.integers(0, 2**31)


def edges(tour: np.ndarray) -> set[frozenset[int]]:
    """Return the edges of a closed tour."""
    return {frozenset((int(a), int(b))) for a, b in zip(tour, np.roll(tour, -1), strict=True)}


@given(SIZES, SEEDS)
def test_an_exchange_replaces_two_edges_and_no_other(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    tour = rng.permutation(n).astype(np.int32)
    place = np.argsort(tour).astype(np.int32)
    i, j = sorted(rng.choice(n, 2, replace=False).tolist())
    a, b, c, d = (int(tour[k % n]) for k in (i, i + 1, j, j + 1))
    if b in (c, d) or d == a:
        return
    before = edges(tour)
    exchange(tour, place, a, b, c, d)
    assert edges(tour) == before - {frozenset((a, b)), frozenset((c, d))} | {frozenset((a, c)), frozenset((b, d))}
    assert np.array_equal(tour[place], np.arange(n))


@given(SIZES, SEEDS, st.sampled_from(["euclidean", "linear", "dogleg", "EUC_2D"]), st.booleans())
def test_improvement_keeps_a_permutation_and_lowers_the_cost_by_every_move(
    n: int, seed: int, metric: str, or_opt: bool
) -> None:
    """One move at a time: after each the tour is a tour, `place` its inverse, and the cost has gone down."""
    rng = np.random.default_rng(seed)
    xy = rng.integers(0, 30, (n, 2)).astype(np.float64)
    problem = RoutingProblem.of_points(xy, Metric(metric, (10.0, 20.0), (50.0, 40.0)), closed=True)
    instance = build_instance(problem, 8)
    tour = rng.permutation(n).astype(np.int32)
    search = LocalSearch.of(instance, or_opt)
    queue_all(tour, search.place, search.queue, search.queued, search.state)
    cost = tour_cost(instance.cost, tour)
    arrays = (tour, search.place, instance.candidates, search.queue, search.queued, search.state, search.touched)
    while improve(instance.cost, *arrays, or_opt, 1):
        assert np.array_equal(np.sort(tour), np.arange(n))
        assert np.array_equal(tour[search.place], np.arange(n))
        lower = tour_cost(instance.cost, tour)
        assert lower < cost
        cost = lower


@given(SIZES, SEEDS)
def test_a_tied_edge_survives_local_search(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 30, (n, 2))
    problem = RoutingProblem.of_points(xy, start=(0.0, 0.0), end=(30.0, 30.0))
    instance = build_instance(problem, 8)
    tour = np.concatenate([[n + 1, n], rng.permutation(n)]).astype(np.int32)
    LocalSearch.of(instance)(tour, Stop())
    assert frozenset((n, n + 1)) in edges(tour)


def test_a_crossing_is_taken_out() -> None:
    """Four corners and a middle of an edge, visited crosswise: the convex order is the only 2-optimal one."""
    xy = np.array([[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0], [5.0, 0.0]])
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 4)
    tour = np.array([0, 1, 2, 3, 4], dtype=np.int32)
    LocalSearch.of(instance)(tour, Stop())
    assert tour_cost(instance.cost, tour) == 40.0
