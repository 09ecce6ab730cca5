"""Local search keeps tours tours, and never makes them longer."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.local_search import exchange_edges, improve_by_two_opt_and_or_opt
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import tour_with_buffers
from leafcut.order.literature.places import improve_locally
from leafcut.order.stop import Stop
from plain_python import plain_python

SIZES = st.integers(5, 60)
SEEDS = st.integers(0, 2**31)


def edges(tour: np.ndarray) -> set[frozenset[int]]:
    """Return the edges of a closed tour."""
    return {frozenset((int(a), int(b))) for a, b in zip(tour, np.roll(tour, -1), strict=True)}


@given(SIZES, SEEDS)
def test_an_exchange_replaces_two_edges_and_no_other(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    tour = rng.permutation(n).astype(np.int32)
    work = tour_with_buffers(tour)
    i, j = sorted(rng.choice(n, 2, replace=False).tolist())
    a, b, c, d = (int(tour[k % n]) for k in (i, i + 1, j, j + 1))
    if b in (c, d) or d == a:
        return
    before = edges(tour)
    with plain_python():
        exchange_edges(work.node, work.place, a, b, c, d)
    assert edges(work.node) == before - {frozenset((a, b)), frozenset((c, d))} | {frozenset((a, c)), frozenset((b, d))}
    assert np.array_equal(work.node[work.place], np.arange(n))


@given(SIZES, SEEDS, st.sampled_from(["euclidean", "linear", "dogleg", "EUC_2D"]))
def test_improvement_keeps_a_permutation_and_lowers_the_cost_by_every_move(n: int, seed: int, metric: str) -> None:
    """One move at a time: after each the tour is a tour, `place` its inverse, and the cost has gone down."""
    rng = np.random.default_rng(seed)
    xy = rng.integers(0, 30, (n, 2)).astype(np.float64)
    problem = RoutingProblem.of_points(xy, Metric(metric, (10.0, 20.0), (50.0, 40.0)), closed=True)
    instance = build_instance(problem, 8)
    tour = rng.permutation(n).astype(np.int32)
    work = tour_with_buffers(tour)
    cost = tour_cost(instance.cost, tour)
    while improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, 1):
        assert np.array_equal(np.sort(work.node), np.arange(n))
        assert np.array_equal(work.node[work.place], np.arange(n))
        lower = tour_cost(instance.cost, work.node)
        assert lower < cost
        cost = lower


@given(SIZES, SEEDS)
def test_a_tied_edge_survives_local_search(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 30, (n, 2))
    problem = RoutingProblem.of_points(xy, start=(0.0, 0.0), end=(30.0, 30.0))
    instance = build_instance(problem, 8)
    tour = np.concatenate([[n + 1, n], rng.permutation(n)]).astype(np.int32)
    improve_locally(instance, tour, Stop())
    assert frozenset((n, n + 1)) in edges(tour)


def test_a_local_optimum_has_no_move_left_of_all_moves() -> None:
    """Tries every exchange of two edges, and every run of up to three nodes at every position, both ways.

    The lists hold all nodes. A run is only tried next to a node that is nearer to it than the length saved by its
    removal.
    """
    n = 10
    for seed in range(5):
        rng = np.random.default_rng(seed)
        xy = rng.uniform(0, 30, (n, 2))
        instance = build_instance(RoutingProblem.of_points(xy, closed=True), n - 1)
        tour, places = rng.permutation(n).astype(np.int32), instance.cost.xy
        with plain_python():
            before = None
            while not np.array_equal(tour, before):
                before = tour.copy()
                improve_locally(instance, tour, Stop())
        assert sorted(tour.tolist()) == list(range(n))

        def way(a: int, b: int, places: np.ndarray = places) -> float:
            return math.dist(places[a], places[b])

        def length(nodes: list[int], way: Callable[[int, int], float] = way) -> float:
            return sum(way(a, b) for a, b in zip(nodes, [*nodes[1:], nodes[0]], strict=True))

        nodes = tour.tolist()
        shortest = length(nodes) - 1e-7
        for i, j in itertools.combinations(range(n), 2):
            assert length([*nodes[:i], *nodes[i : j + 1][::-1], *nodes[j + 1 :]]) >= shortest
        for at, size in itertools.product(range(n), (1, 2, 3)):
            turned = nodes[at:] + nodes[:at]
            run, rest = turned[:size], turned[size:]
            saved = way(rest[-1], run[0]) + way(run[-1], rest[0]) - way(rest[-1], rest[0])
            for k, piece in itertools.product(range(1, len(rest)), (run, run[::-1])):
                nearest = min(way(rest[k - 1], piece[0]), way(piece[-1], rest[k]))
                if nearest < saved - 1e-6:
                    assert length([*rest[:k], *piece, *rest[k:]]) >= shortest


@pytest.mark.parametrize("forward", [True, False])
def test_a_run_of_up_to_three_nodes_moves_to_where_it_belongs(forward: bool) -> None:
    """A ring of 24 places, of which a run stands between two others far away; no exchange of two edges is shorter."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    xy = 100.0 * np.stack([np.cos(angle), np.sin(angle)], 1)
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 6)
    ring = np.argsort(instance.label).tolist()
    best = tour_cost(instance.cost, np.array(ring, dtype=np.int32))
    for size, reverse in itertools.product((1, 2, 3), (False, True)):
        run = ring[5 : 5 + size][:: -1 if reverse else 1]
        tour = [*ring[:5], *ring[5 + size : 8 + size], *run, *ring[8 + size :]]
        tour = np.array(tour if forward else tour[::-1], dtype=np.int32)
        with plain_python():
            improve_locally(instance, tour, Stop())
        assert tour_cost(instance.cost, tour) == pytest.approx(best)


def test_the_most_moves_are_kept_and_a_stop_ends_the_search() -> None:
    xy = np.random.default_rng(1).uniform(0, 30, (40, 2))
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 8)
    stop = Stop()
    stop.cancelled.set()
    start = np.random.default_rng(2).permutation(40).astype(np.int32)
    work = tour_with_buffers(start)
    with plain_python():
        assert improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, 3) == 3
        assert work.queued.sum() == work.counts[1] > 0
        rest = improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, 10**6)
        assert 0 < rest < 10**6
        assert work.counts[1] == work.queued.sum() == 0
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("leafcut.order.literature.places.MOVES_PER_LOOK", 2)
            looked, again = start.copy(), tour_with_buffers(start)
            improve_locally(instance, looked, stop)
            improve_by_two_opt_and_or_opt(instance.cost, again, instance.candidates, 2)
            assert np.array_equal(looked, again.node)
            improve_locally(instance, looked, Stop())
    assert tour_cost(instance.cost, looked) < tour_cost(instance.cost, again.node)


def test_a_crossing_is_taken_out() -> None:
    """Four corners and a middle of an edge, visited crosswise: the convex order is the only 2-optimal one."""
    xy = np.array([[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0], [5.0, 0.0]])
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 4)
    tour = np.array([0, 1, 2, 3, 4], dtype=np.int32)
    improve_locally(instance, tour, Stop())
    assert tour_cost(instance.cost, tour) == 40.0


def plain_move(instance: Instance, tour: list[int], a: int) -> tuple[list[int], list[int]] | None:
    """Return the tour after the first improving move at a node, and the nodes at its ends: an exchange of two edges,
    otherwise a run of up to three nodes that starts at the node; each is tried in the direction of the tour first.
    """

    def way(u: int, v: int) -> float:
        return float(instance.costs(u, v)[0])

    near = [c for c in instance.candidates[a].tolist() if c >= 0]
    at = tour.index(a)
    onward = tour[at:] + tour[:at]
    directions = onward, [a, *onward[:0:-1]]
    for path in directions:
        b = path[1]
        for c in near:
            gain = way(a, b) - way(a, c)
            if gain <= 1e-9:
                break
            k = path.index(c)
            d = path[(k + 1) % len(path)]
            if c != b and d != a and gain + way(c, d) - way(b, d) > 1e-9:
                return [a, *path[1 : k + 1][::-1], *path[k + 1 :]], [a, b, c, d]
    for path in directions:
        for size in (1, 2, 3):
            run, rest = path[:size], path[size:]
            p, e, q = rest[-1], run[-1], rest[0]
            removed = way(p, a) + way(e, q) - way(p, q)
            for c in near:
                gain = removed - way(a, c)
                if gain <= 1e-9:
                    break
                if c in run:
                    continue
                k = rest.index(c)
                for d, new in (
                    (path[(size + k + 1) % len(path)], [*rest[: k + 1], *run, *rest[k + 1 :]]),
                    (path[size + k - 1], [*rest[:k], *run[::-1], *rest[k:]]),
                ):
                    if d not in run and gain + way(c, d) - way(e, d) > 1e-9:
                        return new, [p, a, e, q, c, d]
    return None


@pytest.mark.parametrize("seed", range(4))
def test_every_move_is_that_of_a_plain_implementation(seed: int) -> None:
    """One at a time, with the nodes that wait to be examined."""
    rng, n, kinds = np.random.default_rng(seed), 24, set()
    instance = build_instance(RoutingProblem.of_points(rng.uniform(0, 30, (n, 2)), closed=True), 7)
    work = tour_with_buffers(rng.permutation(n).astype(np.int32))
    queue = work.node.tolist()
    while queue:
        tour, moved = work.node.tolist(), None
        while queue and moved is None:
            moved = plain_move(instance, tour, queue.pop(0))
        with plain_python():
            assert improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, 1) == (moved is not None)
        if moved is not None:
            tour, touched = moved
            queue += [v for k, v in enumerate(touched) if v not in queue and v not in touched[:k]]
            kinds.add(len(touched))
        at = tour.index(int(work.node[0]))
        wanted = tour[at:] + tour[:at]
        assert work.node.tolist() in (wanted, [wanted[0], *wanted[:0:-1]])
        assert [int(work.queue[(work.counts[0] + k) % n]) for k in range(work.counts[1])] == queue
    assert kinds == {4, 6}
