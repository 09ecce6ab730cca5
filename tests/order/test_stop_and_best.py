"""Stopping criteria, deadlines and the best tour, with a clock that is set by hand."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

import numpy as np
import pytest

from leafcut.model.heartbeat import Progress
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.snapshot import Observer, Snapshot
from leafcut.model.solution import WorkerFigures
from leafcut.options import SolveOptions
from leafcut.order import stop as module
from leafcut.order.instance import build_instance
from leafcut.order.search import Best, SearchView
from leafcut.order.stop import Deadline, PayoffLimit, Stop
from leafcut.order.workers import WorkerLog, Workers, run_on_all_workers, thread_pool


class Clock:
    """A clock set by hand, s."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Return the clock of searches."""
    clock = Clock()
    monkeypatch.setattr(module, "clock", clock)
    return clock


def test_the_clock_of_searches_leaves_out_the_time_of_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.time, "perf_counter", lambda: 50.0)
    monkeypatch.setattr(module, "compile_seconds", lambda: 8.0)
    assert module.clock() == 42.0


def test_a_search_stops_at_its_limit_less_the_time_still_needed(clock: Clock) -> None:
    stop = Stop(seconds=10.0)
    clock.now += 9.5
    assert stop.elapsed() == 9.5
    assert not stop.must_stop()
    assert stop.must_stop(spare=0.5)
    assert not stop.must_stop(spare=0.25)
    clock.now += 0.5
    assert stop.must_stop()
    for unlimited in (Stop(), Stop(iterations=3)):
        clock.now += 1e9
        assert not unlimited.must_stop(1e9)
    cancelled = Stop()
    cancelled.cancelled.set()
    assert cancelled.must_stop()


def test_a_pause_does_not_count_even_if_it_ends_with_an_error(clock: Clock) -> None:
    stop = Stop()
    clock.now += 3.0
    with stop.paused():
        clock.now += 40.0
    assert stop.elapsed() == 3.0
    with pytest.raises(KeyError), stop.paused():
        clock.now += 7.0
        raise KeyError
    clock.now += 1.0
    assert stop.elapsed() == 4.0


def test_a_search_is_over_after_its_iterations_its_patience_or_its_time(clock: Clock) -> None:
    stop = Stop(iterations=5, patience=3, seconds=2.0)
    assert [stop.reached(k, 0) for k in (4, 5, 6)] == [False, True, True]
    assert [stop.reached(0, k) for k in (2, 3, 4)] == [False, True, True]
    clock.now += 2.0
    assert stop.reached(0, 0)


@pytest.mark.parametrize(
    ("options", "unit", "holds"),
    [
        (SolveOptions(), "linear", True),
        (SolveOptions(preset="fast"), "linear", True),
        (SolveOptions(preset="thorough"), "linear", False),
        (SolveOptions(iterations=4), "linear", False),
        (SolveOptions(time_limit=4.0), "linear", False),
        (SolveOptions(), "euclidean", False),
    ],
)
def test_thrift_holds_for_times_without_limits(options: SolveOptions, unit: str, holds: bool) -> None:
    problem = RoutingProblem.of_points(np.zeros((3, 2)), Metric(unit, (1.0, 1.0), (1.0, 1.0)))
    assert PayoffLimit.from_options(options, problem) == PayoffLimit(holds=holds)


def test_a_period_is_worth_what_the_one_before_it_gained() -> None:
    rule = PayoffLimit(holds=True)
    assert rule.is_period_worthwhile(2.0, 2.0)
    assert not rule.spared
    assert not rule.is_period_worthwhile(2.0, 1.9)
    assert rule.spared
    assert not rule.is_period_worthwhile(0.0, 9.0)
    never = PayoffLimit()
    assert never.is_period_worthwhile(9.0, 0.0)
    assert never.is_worth_continuing(0.0, 5.0)
    assert never.is_worth_continuing(99.0, 5.0)
    assert not never.spared


def test_a_deadline_has_the_time_of_the_run_less_that_of_lower_bounds(clock: Clock) -> None:
    limited = SolveOptions(time_limit=20.0)
    assert Deadline.from_options(limited).limit == pytest.approx(18.0)
    assert Deadline.from_options(SolveOptions(time_limit=20.0, bound=False)).limit == 20.0
    assert Deadline.for_bounds(limited).limit == pytest.approx(2.0)
    for none in (
        Deadline.from_options(SolveOptions()),
        Deadline.for_bounds(SolveOptions()),
        Deadline(),
        Deadline().for_share(0.5),
    ):
        assert (none.limit, none.left, none.remaining_time_limit) == (math.inf, math.inf, None)


def test_the_time_left_of_a_deadline_falls_while_a_search_runs_and_stays_afterwards(clock: Clock) -> None:
    whole = Deadline(10.0)
    part = whole.for_share(0.5)
    assert (part.limit, part.left, part.remaining_time_limit) == (5.0, 5.0, 5.0)
    cancelled = threading.Event()
    with part.running(cancelled) as is_late:
        clock.now += 4.0
        assert (part.left, whole.left) == (1.0, 10.0)
        assert not is_late()
        clock.now += 1.0
        assert is_late()
        clock.now += 1.0
        assert (part.left, part.remaining_time_limit) == (0.0, 0.001)
    assert (part.left, whole.left, whole.remaining_time_limit) == (0.0, 4.0, 4.0)
    clock.now += 50.0
    assert whole.left == 4.0
    with whole.running(cancelled) as is_late:
        assert not is_late()
        cancelled.set()
        assert is_late()
    # Each search gets a twentieth of its share, and at least a millisecond.
    whole.subtract(3.9)
    assert whole.for_share(0.5).limit == pytest.approx(0.25)
    assert Deadline(0.0).for_share(1.0).limit == 0.001
    assert Deadline(10.0).for_share(0.3).limit == pytest.approx(3.0)
    with pytest.raises(KeyError), whole.running(threading.Event()):
        clock.now += 0.05
        raise KeyError
    assert whole.left == pytest.approx(0.05)


def test_a_tour_is_kept_if_it_is_shorter_by_more_than_rounding(clock: Clock) -> None:
    best, tour = Best(Stop()), np.array([2, 0, 1], dtype=np.int32)
    assert (best.tour.shape, best.tour.dtype, best.iteration, best.cost) == ((0,), np.int32, 0, math.inf)
    assert best.offer(tour, 10.0, 3)
    tour[:] = 7
    assert best.tour.tolist() == [2, 0, 1]
    clock.now += 2.0
    assert not best.offer(tour, 10.0, 4)
    assert not best.offer(tour, 10.0 - 5e-12, 4)
    assert not best.offer(tour, math.inf, 4)
    assert (best.cost, best.iteration) == (10.0, 3)
    assert best.offer(tour, 10.0 - 2e-11, 5)
    assert best.offer(tour, 4.0, 6)
    assert (best.cost, best.iteration) == (4.0, 6)
    assert best.history == [(0.0, 10.0), (2.0, 10.0 - 2e-11), (2.0, 4.0)]
    # Costs of a table may be negative: a tour of -10 is not shorter than itself by rounding.
    negative = Best(Stop())
    assert negative.offer(tour, -10.0, 0)
    assert not negative.offer(tour, -10.0 - 5e-12, 0)
    assert negative.offer(tour, -10.0 - 2e-11, 0)


def test_a_bound_for_observers_counts_only_for_a_cancelled_search() -> None:
    best = Best(Stop(), shown_bound=3.0)
    assert best.bound_if_cancelled() is None
    best.stop.cancelled.set()
    assert best.bound_if_cancelled() == 3.0


def test_progress_is_the_largest_share_of_iterations_and_time_with_cost_and_gap(clock: Clock) -> None:
    seen: list[Progress] = []
    best = Best(Stop(iterations=8, seconds=10.0), seen.append, service=2.0, shown_bound=5.0)
    best.offer(np.zeros(1, dtype=np.int32), 8.0, 0)
    best.tell(4)
    clock.now += 7.5
    best.tell(4)
    best.tell(9)
    Best(Stop(iterations=0), seen.append, cost=8.0).tell(0)
    Best(Stop(), seen.append, cost=8.0).tell(5)
    assert seen == [
        Progress("searching", 0.5, 10.0, 1.0),
        Progress("searching", 0.75, 10.0, 1.0),
        Progress("searching", 1.0, 10.0, 1.0),
        Progress("searching", 0.0, 8.0, None),
        Progress("searching", 0.0, 8.0, None),
    ]


def test_an_observer_takes_a_snapshot_while_the_clock_stands_still(clock: Clock) -> None:
    instance = build_instance(RoutingProblem.of_points([(0, 0), (3, 0), (3, 4), (0, 4)], closed=True), 3)
    log, snapshots = WorkerLog([5], [1.5], [9.0]), []

    class Watch(Observer):
        def show(self, take: Callable[[], Snapshot], alone: bool) -> None:
            clock.now += 100.0
            snapshots.append((take(), alone))

    best = Best(Stop(), service=2.0, shown_bound=3.0, view=SearchView(instance, log), observer=Watch())
    best.tell(0)
    tour = np.argsort(instance.label).astype(np.int32)
    clock.now += 1.0
    best.offer(tour, 14.0, 0)
    best.tell(1)
    assert best.stop.elapsed() == 1.0
    best.tell(2, alone=False)
    assert best.stop.elapsed() == 101.0
    figures = (WorkerFigures(0, 5, 1.5, 9.0),)
    (first, alone), (second, _), (third, together) = snapshots
    assert (alone, together) == (True, False)
    assert isinstance(first, Snapshot)
    assert (first.path.shape, first.cost, first.iteration) == ((0, 2), math.inf, 0)
    assert second.path.tolist() == instance.path_positions(tour).tolist()
    assert (second.cost, second.bound, second.iteration, second.seconds) == (16.0, 3.0, 1, 1.0)
    assert (second.workers, second.pheromone, third.seconds) == (figures, None, 1.0)
    hidden = Best(Stop(), observer=Watch(), tour=tour, cost=14.0)
    hidden.tell(1)
    assert snapshots[-1][0].path.shape == (0, 2)
    assert SearchView(instance, log, lambda: "trails").snapshot_fields(best) == {
        "workers": figures,
        "pheromone": "trails",
    }  # type: ignore
    assert SearchView().snapshot_fields(best) == {"workers": ()}
    assert SearchView().branching_factor() is None
    assert SearchView().instance_nodes(tour) is tour


def test_an_observer_gets_the_costs_of_an_iteration_with_service(clock: Clock) -> None:
    noted: list[tuple[object, ...]] = []

    class Notes(Observer):
        def note(self, *given: object) -> None:
            noted.append(given)

        def show(self, take: object, alone: bool) -> None:
            noted.append((alone,))

    class View(SearchView):
        def branching_factor(self) -> float:
            return 2.5

    best = Best(Stop(), service=2.0, cost=8.0, view=View(), observer=Notes())
    best.view.log = WorkerLog.empty(2)
    best.view.log.add(0, 1, 0.5, 9.0)
    best.view.log.add(1, 1, 0.25, 8.0)
    clock.now += 3.0
    best.tell(4, costs=np.array([8.0, 9.0]))
    best.tell(5)
    (iteration, seconds, cost, costs, branching, working), _, without, _ = noted
    assert (iteration, seconds, cost, branching(), working) == (4, 3.0, 10.0, 2.5, 0.75)  # type: ignore[operator]
    assert costs.tolist() == [10.0, 11.0]  # type: ignore[attr-defined]
    assert without == (5, 3.0, 10.0, None, branching, 0.75)


def test_the_work_of_each_worker_is_added_up() -> None:
    log = WorkerLog.empty(2)
    assert [log.number_of_thread(thread) for thread in (77, 99, 77, 55, 99)] == [0, 1, 0, 0, 1]
    log.add(1, 3, 0.5, 9.0)
    log.add(1, 2, 0.25, 8.0)
    log.add(1, 1, 0.25, 8.5)
    assert log.worker_figures() == (WorkerFigures(0, 0, 0.0, math.inf), WorkerFigures(1, 6, 1.0, 8.0))


@pytest.mark.parametrize("threads", [1, 2])
def test_tasks_have_their_results_in_order(threads: int) -> None:
    stop, log = Stop(), WorkerLog.empty(threads)
    with thread_pool(threads, stop) as executor:
        assert (executor is None) == (threads == 1)
        workers = Workers(executor, threads, stop, log)

        def task(k: int) -> object:
            def run(given: Stop) -> tuple[np.ndarray, np.ndarray]:
                assert given is stop
                return np.full((k, 2), k, dtype=np.int32), np.arange(float(k)) + 10.0 - k

            return run

        shares = workers.run_tasks([task(k) for k in range(4)])  # type: ignore[misc]
        tours, costs = workers.run_and_join([task(k) for k in (2, 1)])  # type: ignore[misc]
        called: list[int] = []
        run_on_all_workers(executor, 3, called.append)
    assert [len(costs) for _, costs in shares] == [0, 1, 2, 3]
    assert (tours.tolist(), costs.tolist()) == ([[2, 2], [2, 2], [1, 1]], [8.0, 9.0, 9.0])
    assert sorted(called) == [0, 1, 2]
    figures = log.worker_figures()
    assert sum(f.ants for f in figures) == 9
    assert min(f.best for f in figures) == 7.0
    assert sum(f.seconds for f in figures) > 0.0
