"""Searches by kicks: every tour is whole, every stated cost is true, and every reason to stop ends the search."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import WAITING, improve_queued
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import kicks
from leafcut.order.construction import greedy_tour
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import (
    BREADTH,
    build_improved_greedy_tour,
    improve_queued_nodes,
    kick_repeatedly,
    queue_waiting_nodes,
    run_iterated_local_search,
    search_breadth,
    tour_with_buffers,
)
from leafcut.order.search import AlgorithmRun, Best, run_steps
from leafcut.order.stop import Stop


def field(n: int, seed: int) -> Instance:
    """Return an instance of n random places."""
    xy = np.random.default_rng(seed).uniform(0, 100, (n, 2))
    return build_instance(RoutingProblem.of_points(xy, closed=True), 8)


def check_best(instance: Instance, best: Best) -> None:
    """Check that the best tour is complete, and that its cost equals the sum of its edges."""
    tour, xy = best.tour, instance.cost.xy
    assert sorted(tour.tolist()) == list(range(instance.n))
    added_up = sum(math.dist(xy[a], xy[b]) for a, b in zip(tour, np.roll(tour, -1), strict=True))
    assert best.cost == pytest.approx(added_up)
    costs = [cost for _, cost in best.history]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == best.cost


def first_of(instance: Instance) -> Best:
    """Return the best tour after the first improvement."""
    best = Best(Stop())
    tour = build_improved_greedy_tour(instance, BREADTH, best)
    check_best(instance, best)
    assert float(tour_cost(instance.cost, tour)) == pytest.approx(best.cost)
    return best


def test_the_first_tour_is_better_than_greedy_and_no_worse_with_long_edges_shortened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shortened = 0
    for seed in range(4):
        instance = field(200, seed)
        monkeypatch.setattr(kicks, "MANY", 201)
        usual = first_of(instance)
        assert usual.cost < tour_cost(instance.cost, greedy_tour(instance)) == usual.history[0][1]
        assert [cost for _, cost in usual.history] == [usual.history[0][1], usual.cost]
        monkeypatch.setattr(kicks, "MANY", 200)
        shorter = first_of(instance)
        assert shorter.cost <= usual.cost
        shortened += shorter.cost < usual.cost - 1e-6
    assert shortened, "none of these tours has a long edge; try other places"


@pytest.mark.parametrize("many", [0, 1000])
def test_a_first_tour_that_takes_long_is_offered_on_the_way(many: int, monkeypatch: pytest.MonkeyPatch) -> None:
    reported: list[float] = []
    instance = field(200, 2)
    monkeypatch.setattr(kicks, "NODES_PER_LOOK", 20)
    monkeypatch.setattr(kicks, "OFFER_EVERY", -1.0)
    monkeypatch.setattr(kicks, "MANY", many)
    best = Best(Stop(iterations=10), progress=lambda now: reported.append(now.cost or 0.0))
    build_improved_greedy_tour(instance, BREADTH, best)
    check_best(instance, best)
    assert len(best.history) > 5
    assert len(reported) > 5
    assert reported == sorted(reported, reverse=True)
    monkeypatch.setattr(kicks, "OFFER_EVERY", math.inf)
    once = Best(Stop())
    build_improved_greedy_tour(instance, BREADTH, once)
    assert len(once.history) == 2
    assert once.cost == pytest.approx(best.cost)


@pytest.mark.parametrize("long_edges", [False, True])
def test_a_stop_ends_the_first_improvement_with_a_whole_tour(long_edges: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped after some looks at the clock, before the first or before the second descent."""
    instance = field(200, 2)
    monkeypatch.setattr(kicks, "NODES_PER_LOOK", 20)
    monkeypatch.setattr(kicks, "MANY", 0)
    whole = first_of(instance).cost
    shorten = kicks.shorten_long_edges
    asked: list[bool] = []

    class StopsThen(Stop):
        armed = not long_edges

        def must_stop(self, spare: float = 0.0) -> bool:
            if self.armed:
                asked.append(True)
            return self.armed and len(asked) > (0 if long_edges else 3)

    stop = StopsThen()

    def shorten_then_stop(*given: object) -> bool:
        shorter = shorten(*given)  # type: ignore[arg-type]
        stop.armed = True
        return shorter

    monkeypatch.setattr(kicks, "shorten_long_edges", shorten_then_stop)
    best = Best(stop)
    build_improved_greedy_tour(instance, BREADTH, best)
    check_best(instance, best)
    assert best.cost > whole + 1e-6
    assert len(asked) == (1 if long_edges else 4)


def test_a_descent_does_nothing_once_stopped_and_everything_otherwise() -> None:
    instance = field(60, 1)
    stop = Stop()
    tour = tour_with_buffers(np.random.default_rng(1).permutation(60).astype(np.int32))
    before = tour.node.copy()
    stop.cancelled.set()
    assert not improve_queued_nodes(instance, tour, BREADTH, stop)
    assert np.array_equal(tour.node, before)
    assert tour.counts[1] == 60
    assert improve_queued_nodes(instance, tour, BREADTH, Stop())
    assert tour.counts[1] == 0
    assert tour_cost(instance.cost, tour.node) < tour_cost(instance.cost, before)


def test_moves_too_long_at_first_are_made_in_a_second_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a buffer of 5 places nodes wait; with all places they get their moves, and none waits."""
    instance = field(120, 4)
    node = np.random.default_rng(4).permutation(120).astype(np.int32)
    monkeypatch.setattr(kicks, "LONGEST_REWRITE", 5)
    tour, short = tour_with_buffers(node), tour_with_buffers(node)
    assert improve_queued_nodes(instance, tour, BREADTH, Stop())
    assert not tour.queued.any()
    breadth = search_breadth(instance, BREADTH)
    improve_queued(
        instance.cost, short._replace(buffer=short.buffer[:5]), *instance.exchange_candidates, breadth, 10**6
    )
    waiting = short.node[short.queued[short.node] == WAITING].tolist()
    assert waiting
    queue_waiting_nodes(short)
    assert short.queue[: short.counts[1]].tolist() == waiting
    assert short.counts[0] == 0
    assert tour_cost(instance.cost, tour.node) < tour_cost(instance.cost, short.node)


def improve_by_kicks(instance: Instance, seed: int, best: Best) -> int:
    """Improve the first tour by kicks; return the iterations."""
    return run_steps(kick_repeatedly(instance, build_improved_greedy_tour(instance, BREADTH, best), seed, best), best)


@pytest.mark.parametrize("budget", [0, 1, 4])
def test_kicks_stop_after_the_given_iterations(budget: int) -> None:
    instance = field(60, 2)
    reported: list[float] = []
    best = Best(Stop(iterations=budget), progress=lambda now: reported.append(now.cost or 0.0))
    assert improve_by_kicks(instance, 3, best) == budget
    check_best(instance, best)
    assert len(reported) == budget + 1  # one after the first tour
    assert best.iteration <= budget


def test_kicks_stop_after_their_number_and_their_patience() -> None:
    instance = field(60, 2)
    start = first_of(instance)
    each = kicks.kicks_per_iteration(60)
    best = Best(Stop())
    best.offer(start.tour, start.cost, 0)
    # Iterations go on from the given number; begun ones are whole.
    assert run_steps(kick_repeatedly(instance, start.tour, 3, best, 7, 2 * each + 1), best, 7) == 10
    assert run_steps(kick_repeatedly(instance, start.tour, 3, best, 7, 0), best, 7) == 7
    check_best(instance, best)
    patient = Best(Stop(patience=3))
    last = improve_by_kicks(instance, 3, patient)
    assert last - patient.iteration == 3


def test_kicks_depend_on_the_seed_alone_and_improve_the_tour() -> None:
    instance = field(150, 6)
    results = []
    for seed in (1, 1, 2, 3):
        best = Best(Stop(iterations=2))
        improve_by_kicks(instance, seed, best)
        check_best(instance, best)
        assert best.cost < first_of(instance).cost
        results.append(best.tour.tolist())
    assert results[0] == results[1]
    assert len({tuple(tour) for tour in results}) > 1


def test_no_more_candidates_are_tried_than_there_are() -> None:
    xy = np.random.default_rng(1).uniform(0, 9, (6, 2))
    few = build_instance(RoutingProblem.of_points(xy, closed=True), 3)
    assert search_breadth(few, (0, 8, 4, 2, 1)).tolist() == [0, 3, 3, 2, 1]


@pytest.mark.parametrize(
    ("n", "options", "iterations"),
    [
        (60, {"preset": "fast"}, 3),
        (90, {"preset": "fast"}, 5),
        (15, {"preset": "default"}, 8),
        (40, {"iterations": 4}, 4),
    ],
)
def test_a_preset_has_a_number_of_kicks_per_node_and_the_result_counts_them(
    n: int, options: dict[str, object], iterations: int
) -> None:
    """200 kicks an iteration; 10 per node if fast, 100 by default."""
    instance = field(n, 3)
    best = Best(Stop(iterations=options.get("iterations", math.inf)))  # type: ignore[arg-type]
    run = AlgorithmRun(SolveOptions(algorithm="kicks", **options), AcoOptions(), FireflyOptions(), best)  # type: ignore[arg-type]
    found = run_iterated_local_search(instance, run)
    assert found.iterations == best.stop.iterations == iterations
    assert np.array_equal(found.tour, best.tour)
    check_best(instance, best)
    (worker,) = found.workers
    assert (worker.worker, worker.ants, worker.best) == (0, 200 * iterations, best.cost)
    assert worker.seconds > 0.0
