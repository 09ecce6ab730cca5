"""Runs of the path search: how many searches, with which kicks, and the ants before them."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from leafcut.kernels.route import Route
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import WorkerFigures
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import path_search
from leafcut.order.annealing import build_clusters
from leafcut.order.directed import DirectedInstance, build_directed_instance, greedy_path
from leafcut.order.literature.ants import Ants
from leafcut.order.path_search import PathSearch, offer_ant_path, preset_kicks, run_path_search
from leafcut.order.search import AlgorithmRun, Best
from leafcut.order.stop import PayoffLimit, Stop

N = 12


def cuts(table: bool = False) -> DirectedInstance:
    """Return twelve cuts that take 2 s each; with a table, all moves gain."""
    rng = np.random.default_rng(1)
    entry, leave = rng.uniform(0, 90, (2, N, 2))
    metric = Metric("EXPLICIT", matrix=rng.uniform(-9, -8, (N, N))) if table else Metric("euclidean")
    problem = RoutingProblem(entry, leave, np.arange(N, dtype=np.int32), np.full(N, 2.0), metric, closed=table)
    return build_directed_instance(problem, 8)


def path_of(route: Route) -> list[int]:
    """Return the problem's nodes along a path with an anchor, whose nodes have one option."""
    return route.node[1:].tolist()


@pytest.mark.parametrize("small", [True, False])
@pytest.mark.parametrize(
    ("options", "cores", "threads", "kicks"),
    [
        (SolveOptions(), 3, 1, 20_000),
        (SolveOptions(preset="fast"), 3, 1, 5000),
        (SolveOptions(iterations=7), 3, 1, math.inf),
        (SolveOptions(iterations=7, time_limit=9.0), 3, 1, math.inf),
        (SolveOptions(time_limit=9.0), 3, 3, math.inf),
        (SolveOptions(time_limit=9.0), None, 1, math.inf),
        (SolveOptions(time_limit=9.0, threads=2), 3, 2, math.inf),
        (SolveOptions(threads=2), 3, 1, 20_000),
    ],
)
def test_a_search_per_thread_runs_if_only_the_time_is_limited(
    options: SolveOptions, cores: int | None, threads: int, kicks: float, small: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a small problem, ants order the greedy path first, and all searches share its layers."""
    instance, best = cuts(), Best(Stop())
    ran: list[tuple[int, float, list[int]]] = []
    before: list[tuple[object, ...]] = []

    def ran_by(self: PathSearch, most: float, start: Route, phase: float = 50.0) -> int:
        assert (self.instance, self.best, self.stop) == (instance, best, best.stop)
        assert (self.layers is not None) == small
        assert self.alone == (threads == 1)
        assert self.words.tolist() == PathSearch(instance, options.seed, best, self.number).words.tolist()
        ran.append((self.number, most, path_of(start)))
        self.log.ants[self.number] = 100 + self.number
        best.offer(np.arange(N, dtype=np.int32), 50.0, 0)
        return 5 + self.number

    monkeypatch.setattr("os.cpu_count", lambda: cores)
    monkeypatch.setattr(path_search, "is_small_enough_to_anneal", lambda one: small and one is instance)
    monkeypatch.setattr(path_search, "offer_ant_path", lambda *given: before.append(given))
    monkeypatch.setattr(PathSearch, "run", ran_by)
    found = run_path_search(instance, AlgorithmRun(options, AcoOptions(), FireflyOptions(), best))
    greedy = path_of(greedy_path(instance))
    assert sorted(ran) == [(k, kicks, greedy) for k in range(threads)]
    assert found.iterations == sum(5 + k for k in range(threads))
    assert found.tour.tolist() == list(range(N))
    assert found.workers == tuple(WorkerFigures(k, 100 + k, 0.0, math.inf) for k in range(threads))
    assert best.view.shown is instance
    assert best.view.log.ants == [100 + k for k in range(threads)]
    if small:
        ((first, layers, route, seed, same),) = before
        assert (first, seed, same, path_of(route)) == (instance, options.seed, best, greedy)
        assert layers.table.shape == (N + 1, N + 1)
    else:
        assert not before


@pytest.mark.parametrize("failing", [0, 1])
def test_an_error_in_one_of_several_searches_ends_the_others(failing: int, monkeypatch: pytest.MonkeyPatch) -> None:
    best = Best(Stop())

    def fail(self: PathSearch, *_: object) -> int:
        if self.number == failing:
            raise KeyError("lost")
        assert best.stop.cancelled.wait(300.0)
        return 1

    monkeypatch.setattr(PathSearch, "run", fail)
    monkeypatch.setattr(path_search, "is_small_enough_to_anneal", lambda _: False)
    options = SolveOptions(time_limit=9.0, threads=2)
    with pytest.raises(KeyError, match="lost"):
        run_path_search(cuts(), AlgorithmRun(options, AcoOptions(), FireflyOptions(), best))
    assert best.stop.cancelled.is_set()


def test_ctrl_c_in_one_of_several_searches_ends_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    best = Best(Stop())

    def interrupt(self: PathSearch, *_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(PathSearch, "run", interrupt)
    monkeypatch.setattr(path_search, "is_small_enough_to_anneal", lambda _: False)
    options = SolveOptions(time_limit=9.0, threads=2)
    with pytest.raises(KeyboardInterrupt):
        run_path_search(cuts(), AlgorithmRun(options, AcoOptions(), FireflyOptions(), best))
    assert best.stop.cancelled.is_set()


def test_ants_with_local_search_order_a_path_in_a_share_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twenty generations of Ant Colony System, ten without a gain; at most 15 % of the time limit."""
    instance, seen = cuts(), []
    layers, greedy, cancelled = build_clusters(instance), greedy_path(instance), threading.Event()
    best = Best(Stop(seconds=200.0, cancelled=cancelled, began=17.0))
    optimum = np.random.default_rng(3).permutation(N)

    def searched(ants: Ants, own: Best) -> int:
        seen.append((ants, own))
        assert own.cost <= instance.length(greedy.node, greedy.enter, greedy.leave)
        own.offer(np.array([N, *optimum], dtype=np.int32), 0.5, 1)
        return 1

    monkeypatch.setattr(path_search, "run_population", searched)
    offer_ant_path(instance, layers, greedy, 9, best)
    ((ants, own),) = seen
    stop = own.stop
    assert (stop.iterations, stop.patience) == (20, 10)
    assert stop.seconds == pytest.approx(30.0)
    assert (stop.began, stop.cancelled) == (17.0, cancelled)
    assert stop.payoff_limit == PayoffLimit()
    assert (ants.stop, ants.seed, ants.trails.parameters.algorithm) == (stop, 9, "acs")
    assert ants.trails.parameters.local_search
    assert ants.moves.local_search
    assert ants.moves.layers is layers
    assert ants.trails.c_nn == pytest.approx(instance.length(greedy.node, greedy.enter, greedy.leave))
    # The greedy path was offered first; the path of the ants is kept only if it is shorter.
    assert best.history[0][1] == instance.length(greedy.node, greedy.enter, greedy.leave)
    length = instance.length(*instance.path_from_nodes(optimum.astype(np.int32)), instance.leave)
    assert best.cost == pytest.approx(min(length, best.history[0][1]))
    assert best.iteration == 0


def test_no_ant_starts_where_a_table_has_no_costs_to_save(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> int:
        raise AssertionError

    monkeypatch.setattr(path_search, "run_population", never)
    instance = cuts(table=True)
    best, greedy = Best(Stop()), greedy_path(instance)
    offer_ant_path(instance, build_clusters(instance), greedy, 1, best)
    assert best.cost == pytest.approx(instance.length(greedy.node, greedy.enter, greedy.leave))


def test_the_budget_of_a_preset_lies_between_its_fewest_and_most() -> None:
    assert [preset_kicks("thorough", m) for m in (50, 51, 100)] == [1e5, 1.02e5, 2e5]
    assert [preset_kicks("default", m) for m in (80, 81, 2000, 2001)] == [2e4, 20_250, 5e5, 5e5]
    assert [preset_kicks("fast", m) for m in (83, 84, 1666, 1667)] == [5e3, 5040, 99_960, 1e5]
