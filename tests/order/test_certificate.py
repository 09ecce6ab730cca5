"""Lower bounds, target gaps and histories are true, and a search that stops early keeps the best solution."""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

import leafcut
from leafcut.model.heartbeat import Progress
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.snapshot import Observer
from leafcut.model.solution import gap
from leafcut.options import SolveOptions
from leafcut.order import stop as stop_module
from leafcut.order.bound import lower_bound
from leafcut.order.certificate import symmetric_relaxation
from leafcut.order.instance import build_instance, path_cost
from leafcut.order.search import Best
from leafcut.order.solve import keep_better, solve
from leafcut.order.stop import Deadline, Stop

Bounding = Callable[[float | None], list[float]]


@pytest.fixture
def bounding(monkeypatch: pytest.MonkeyPatch) -> Bounding:
    """Return a function that has every lower bound be a given number; it returns the list of the `upper` asked with."""

    def set_bound(value: float | None) -> list[float]:
        asked: list[float] = []

        def lower_bound(_: object, upper: float, *, stop: object = None) -> float | None:
            asked.append(upper)
            return value

        monkeypatch.setattr("leafcut.order.certificate.lower_bound", lower_bound)
        return asked

    return set_bound


def board(n: int = 60, service: float = 0.0) -> RoutingProblem:
    """Return a closed problem of random points; every node costs `service`."""
    problem = RoutingProblem.of_points(np.random.default_rng(5).uniform(0, 100, (n, 2)), Metric(), closed=True)
    problem.service[:] = service
    return problem


def slots(n: int) -> RoutingProblem:
    """Return n slots with two directions each."""
    xy = np.random.default_rng(6).uniform(0, 50, (2 * n, 2))
    swapped = xy.reshape(n, 2, 2)[:, ::-1].reshape(-1, 2)
    return RoutingProblem(xy, swapped.copy(), np.repeat(np.arange(n, dtype=np.int32), 2), np.zeros(2 * n))


@pytest.mark.parametrize("algorithm", ["auto", "mmas", "2opt", "nn", "none"])
def test_the_bound_is_sought_after_the_search_with_the_travel_found_and_service_is_added(
    algorithm: str, bounding: Bounding
) -> None:
    asked = bounding(100.0)
    found = solve(board(service=2.0), SolveOptions(algorithm=algorithm, iterations=2))
    assert asked == [pytest.approx(found.cost - 120.0)]
    assert found.lower_bound == 220.0
    assert found.gap == pytest.approx(found.cost / 220.0 - 1.0)


def test_without_a_bound_none_is_sought(bounding: Bounding) -> None:
    asked = bounding(100.0)
    assert solve(board(), SolveOptions(iterations=1, bound=False)).lower_bound is None
    assert asked == []


def test_slots_far_apart_are_bounded_by_the_gaps_between_them() -> None:
    """Ten slots of 10 mm in a row, 90 mm from one end to the next: the travel between them is known by hand."""
    left = np.array([(100.0 * i, 0.0) for i in range(10)])
    right = left + np.array([10.0, 0.0])
    entry, exit_ = np.stack([left, right], 1).reshape(-1, 2), np.stack([right, left], 1).reshape(-1, 2)
    row = RoutingProblem(entry, exit_, np.repeat(np.arange(10, dtype=np.int32), 2), np.zeros(20))
    found = solve(row, SolveOptions(iterations=50))
    assert found.cost == pytest.approx(810.0)
    assert found.lower_bound == pytest.approx(810.0)


@pytest.mark.parametrize(("closed", "gaps"), [(True, 10), (False, 9)])
def test_slots_in_a_ring_are_bounded_by_the_gaps_and_a_closed_path_by_the_way_back(closed: bool, gaps: int) -> None:
    """Ten slots, each at the middle of a side of a regular decagon: all moves from slot to slot are equally long."""
    corner = np.array([(50.0 * math.cos(k * math.pi / 5), 50.0 * math.sin(k * math.pi / 5)) for k in range(11)])
    one, two = 0.8 * corner[:-1] + 0.2 * corner[1:], 0.2 * corner[:-1] + 0.8 * corner[1:]
    entry, exit_ = np.stack([one, two], 1).reshape(-1, 2), np.stack([two, one], 1).reshape(-1, 2)
    cluster = np.repeat(np.random.default_rng(1).permutation(10).astype(np.int32), 2)
    ring = RoutingProblem(entry, exit_, cluster, np.zeros(20), closed=closed)
    found = solve(ring, SolveOptions(iterations=50))
    way = math.dist(two[0], one[1])
    assert found.cost == pytest.approx(gaps * way)
    assert found.lower_bound == pytest.approx(gaps * way)


def test_of_too_many_ways_no_bound_is_told(bounding: Bounding, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = bounding(1.0)
    monkeypatch.setattr("leafcut.order.certificate.MOST_WAYS", 39)
    assert solve(slots(20), SolveOptions(iterations=1)).lower_bound is None
    assert asked == []


def test_a_bound_that_the_solution_disproves_is_not_told(bounding: Bounding) -> None:
    bounding(1e9)
    assert solve(board(), SolveOptions(iterations=1)).lower_bound is None


def test_a_bound_that_is_above_the_cost_by_rounding_is_the_cost(bounding: Bounding) -> None:
    cost = solve(board(), SolveOptions(iterations=1, bound=False)).cost
    bounding(cost * (1 + 1e-14))
    assert solve(board(), SolveOptions(iterations=1)).gap == 0.0


@pytest.mark.parametrize("algorithm", ["auto", "none"])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 4])
def test_of_up_to_four_targets_the_bound_is_the_optimum(n: int, algorithm: str) -> None:
    problem = slots(n)
    found = solve(problem, SolveOptions(algorithm=algorithm))
    ways = itertools.product(itertools.permutations(range(n)), itertools.product((0, 1), repeat=n))
    least = min(path_cost(problem, np.array([2 * c + w for c, w in zip(*o, strict=True)], np.int32)) for o in ways)
    assert found.lower_bound == pytest.approx(least)
    assert algorithm == "none" or found.gap == 0.0


def test_somebody_who_stops_the_search_does_not_wait_for_a_bound(bounding: Bounding) -> None:
    asked = bounding(1.0)
    cancelled = threading.Event()
    options = SolveOptions(algorithm="mmas")
    found = solve(board(), options, progress=lambda *_: cancelled.set(), cancelled=cancelled)
    assert found.stopped_early
    assert (found.iterations, found.lower_bound, asked) == (1, None, [])


def test_ctrl_c_while_a_bound_is_sought_keeps_the_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    def lower_bound(*_: object, **__: object) -> float:
        raise KeyboardInterrupt

    monkeypatch.setattr("leafcut.order.certificate.lower_bound", lower_bound)
    cancelled = threading.Event()
    found = solve(board(), SolveOptions(iterations=2), cancelled=cancelled)
    assert sorted(found.nodes.tolist()) == list(range(60))
    assert found.lower_bound is None
    assert cancelled.is_set()


def test_the_clock_of_a_search_stands_still_while_a_bound_is_sought(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(stop_module, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr("leafcut.order.stop.compile_seconds", lambda: 0.0)
    stop = Stop(seconds=5.0, began=100.0)
    now[0] = 103.0
    with stop.paused():
        now[0] = 160.0
    assert stop.elapsed() == 3.0
    assert not stop.must_stop()
    now[0] = 162.0
    assert stop.must_stop()


def test_progress_tells_cost_gap_and_share(bounding: Bounding) -> None:
    bounding(400.0)
    told: list[Progress] = []
    found = solve(
        board(service=1.0),
        SolveOptions(algorithm="mmas", iterations=5),
        progress=told.append,
        observe=Observer(),
    )
    assert [now.share for now in told] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert told[-1].cost == pytest.approx(found.cost)
    assert all(now.gap == pytest.approx(now.cost / 460.0 - 1.0) for now in told)


@pytest.mark.parametrize("service", [0.0, 0.1])
@pytest.mark.parametrize("algorithm", ["auto", "as", "eas", "asrank", "mmas", "acs", "2opt", "nn"])
def test_every_entry_of_the_history_is_what_a_tour_really_cost(
    algorithm: str, service: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every tour that was offered is added up edge by edge, apart from the search."""
    problem, costs = board(80, service), []
    instance = build_instance(problem, 8)
    inner = Best.offer

    def offer(self: Best, tour: np.ndarray, cost: float, iteration: int) -> bool:
        costs.append(path_cost(problem, instance.cluster_order(tour)))
        return inner(self, tour, cost, iteration)

    monkeypatch.setattr(Best, "offer", offer)
    found = solve(problem, SolveOptions(algorithm=algorithm, iterations=4, bound=False))
    seconds, history = zip(*found.history, strict=True)
    assert all(min(abs(cost - c) for c in costs) < 1e-9 for cost in history)
    assert history[-1] == found.cost
    assert history[0] >= found.cost
    assert list(history) == sorted(history, reverse=True)
    assert list(seconds) == sorted(seconds)
    assert 0.0 <= seconds[0] <= seconds[-1] <= found.seconds


def test_where_ways_are_chosen_with_the_order_the_history_falls_to_the_answer() -> None:
    found = solve(slots(7), SolveOptions(algorithm="mmas", preset="fast"))
    costs = [cost for _, cost in found.history]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == found.cost


def test_a_better_order_from_elsewhere_ends_the_history_and_keeps_the_bound(bounding: Bounding) -> None:
    problem = RoutingProblem.of_points([[k, 0] for k in (0, 2, 1, 4, 3, 5)], start=(0.0, 0.0))
    bounding(4.5)
    drawn = solve(problem, SolveOptions(algorithm="none"))
    kept = keep_better(problem, drawn, np.array([0, 2, 1, 4, 3, 5], dtype=np.int32))
    assert (kept.cost, kept.lower_bound) == (5.0, 4.5)
    assert [cost for _, cost in kept.history] == [drawn.cost, 5.0]
    assert kept.history[-1][0] >= kept.history[0][0]


@pytest.mark.parametrize(
    "cost, bound, expected",
    [(42.0, 40.0, 0.05), (40.0, 40.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, None), (3.0, None, None), (3.0, 4.0, None)],
)
def test_the_gap_is_told_only_where_it_says_something(cost: float, bound: float | None, expected: float | None) -> None:
    assert gap(cost, bound) == (None if expected is None else pytest.approx(expected))


def test_of_tools_in_a_row_the_bound_is_the_sum_and_the_nearest_neighbour_needs_none(
    bounding: Bounding, monkeypatch: pytest.MonkeyPatch
) -> None:
    from leafcut.order import solve as room

    asked = bounding(0.001)
    outcome = leafcut.optimize("example:board-97", thickness="2mm", preset="fast")
    bounds = [o.solution.lower_bound for o in outcome.operations]
    assert len(asked) == bounds.count(0.001) == len([o for o in outcome.operations if len(o.hole_order) > room.TRY_ALL])
    assert outcome.lower_bound == pytest.approx(sum(b for b in bounds if b is not None))


def test_the_best_is_kept_when_the_caller_cancels(bounding: Bounding) -> None:
    bounding(1.0)
    cancelled = threading.Event()

    def press(progress: Progress) -> None:
        if progress.step.startswith(("solving", "ordering")):
            cancelled.set()

    options = {"progress": press, "cancelled": cancelled, "iterations": 100_000}
    part = leafcut.read_part("random:80")
    found = leafcut.solve(part, **options).solution
    assert found.stopped_early
    assert sorted(found.nodes.tolist()) == list(range(80))
    cancelled.clear()
    outcome = leafcut.optimize("random:80", thickness=2, **options)
    assert outcome.verified
    assert outcome.operations[0].solution.stopped_early
    assert sorted(outcome.operations[0].hole_order) == list(range(len(outcome.part.holes)))


def test_a_bound_of_several_ways_that_is_late_is_given_up() -> None:
    """The deadline is checked before each row of the table of cheapest moves; half a table proves no bound."""
    for rows in (0, 1, 12):
        looks = iter([False] * rows + [True])
        assert symmetric_relaxation(slots(20), lambda looks=looks: next(looks)) is None  # type: ignore[misc]
        assert list(looks) == []
    few = SolveOptions(preset="fast", threads=1)
    late, whole = (solve(slots(20), few, bounds=Deadline(limit)) for limit in (0.0, None))
    assert late.lower_bound is None
    assert whole.lower_bound is not None
    assert list(late.nodes) == list(whole.nodes)


@pytest.mark.parametrize("n", [60, pytest.param(400, marks=pytest.mark.slow)])
def test_a_bound_that_ends_early_is_the_bound_proved_so_far(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bound that ends early is below the cost, and never above the bound without a limit. A look takes a second."""
    ticks = itertools.count()
    monkeypatch.setattr("leafcut.order.stop.clock", lambda: float(next(ticks)))
    bounds = []
    for most in (0.5, 1.5, 3.5, None):
        found = solve(board(n), SolveOptions(preset="fast", threads=1), bounds=Deadline(most))
        bounds.append(-math.inf if found.lower_bound is None else found.lower_bound)
        assert bounds[-1] <= found.cost
    assert bounds == sorted(bounds)
    assert bounds[0] < bounds[-1] == solve(board(n), SolveOptions(preset="fast", threads=1)).lower_bound


@pytest.mark.parametrize("kind", ["cuts", "slots"])
@pytest.mark.parametrize("closed", [False, True])
def test_a_relaxation_takes_the_cheapest_way_and_the_cheapest_work(kind: str, closed: bool) -> None:
    """Tries all moves between two of six targets, in both directions; the start is next to a free end."""
    rng = np.random.default_rng(2)
    cluster = rng.permutation(np.repeat(np.arange(6), 2 if kind == "slots" else 1)).astype(np.int32)
    entry, exit_ = rng.uniform(0, 50, (2, len(cluster), 2))
    start = None if closed else (1.0, 2.0)
    problem = RoutingProblem(
        entry,
        exit_,
        cluster,
        rng.uniform(0, 9, len(cluster)),
        closed=closed,
        start=start,
        precedence=np.array([[0, 1]], dtype=np.int32),
    )
    relaxed = symmetric_relaxation(problem)
    assert relaxed is not None
    assert relaxed.closed
    assert not len(relaxed.precedence)
    assert relaxed.n_nodes == relaxed.n_clusters == (6 if closed else 7)
    members = [np.flatnonzero(cluster == c).tolist() for c in range(6)]
    for a, b in itertools.permutations(range(6), 2):
        ways = [math.dist(exit_[v], entry[w]) for v, w in itertools.product(members[a], members[b])]
        ways += [math.dist(exit_[w], entry[v]) for v, w in itertools.product(members[a], members[b])]
        assert relaxed.metric.matrix[a, b] == pytest.approx(min(ways))
    if not closed:
        assert (relaxed.metric.matrix[6, :6] == 0.0).all()  # the end is free
        assert (relaxed.metric.matrix[:6, 6] == 0.0).all()
    service = [min(problem.service[m]) for m in members] + [0.0] * (not closed)
    assert relaxed.service.tolist() == service
    # The problem itself has no tour that stands for its path, so no bound of its own.
    assert lower_bound(build_instance(problem, 5), 1e9) is None
