"""Schedules of the searches: which steps follow each other, how many, and how hot; the steps themselves do nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from leafcut.kernels.annealing import BEST
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order import annealing, colony, path_search
from leafcut.order.annealing import PathAnnealing
from leafcut.order.colony import Colony, improve_by_colony
from leafcut.order.construction import greedy_tour
from leafcut.order.directed import DirectedInstance, build_directed_instance, greedy_path
from leafcut.order.instance import Instance, build_instance
from leafcut.order.path_search import PathSearch, preset_kicks
from leafcut.order.search import Best, run_steps
from leafcut.order.stop import PayoffLimit, Stop
from leafcut.order.workers import WorkerLog, Workers

N = 60


def cuts(closed: bool = False) -> DirectedInstance:
    """Return 60 cuts that take 2 s each."""
    entry, leave = np.random.default_rng(1).uniform(0, 90, (2, N, 2))
    problem = RoutingProblem(
        entry, leave, np.arange(N, dtype=np.int32), np.full(N, 2.0), Metric("euclidean"), closed=closed
    )
    return build_directed_instance(problem, 8)


@pytest.mark.parametrize("worse", [False, True])
def test_hot_kicks_follow_cold_ones_and_the_search_returns_to_the_best_path(
    worse: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """10 n cold kicks, then by turns n hot and 4 n cold ones, in runs of up to 200; after two cold turns without a
    better path the search returns to the best one. A hot turn here takes the path to one of twice the length.
    """
    instance, calls = cuts(closed=True), []
    search = PathSearch(instance, 3, Best(Stop()))

    def note(*given: object) -> float:
        heat, kicks = given[5], given[8]
        calls.append((heat, kicks, search.cost == pytest.approx(search.best.cost)))
        if worse and heat:
            path = np.random.default_rng(len(calls)).permutation(N).astype(np.int32)
            before = instance.length(search.route.node, search.route.enter, search.route.leave)
            search.route.node[:], search.route.place[path] = path, np.arange(N, dtype=np.int32)
            return before - instance.length(path, search.route.enter, search.route.leave)
        return 0.0

    monkeypatch.setattr(path_search, "kick_route", note)
    monkeypatch.setattr(path_search, "is_small_enough_to_anneal", lambda _: False)
    greedy = greedy_path(instance)
    most = 10 * N + 4 * 5 * N + 7
    assert search.run(most, greedy) == search.iteration == len(calls)
    mean = (instance.length(greedy.node, greedy.enter, greedy.leave) - 2.0 * N) / N
    assert search.mean == pytest.approx(min(mean, 1.5 * (search.best.cost - 2.0 * N) / N))
    wanted = [(0.0, 200)] * 3
    for heat in (0.3, 1.0, 3.0, 0.3):
        wanted += [(heat * search.mean, N), (0.0, 200), (0.0, 40)]
    assert [call[:2] for call in calls] == [*wanted, (pytest.approx(search.mean), 7)]
    assert search.kicks == most
    at_best = [call[2] for call in calls if call[0]]
    assert at_best == ([True, True, False, True, False] if worse else [True] * 5)
    assert search.best.cost == pytest.approx(
        instance.length(*instance.path_from_nodes(search.best.tour), instance.leave)
    )


def test_a_small_problem_is_annealed_between_kicks_of_twice_the_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """50 n kicks, as many steps, 100 n kicks, as many steps, until there are enough."""
    instance, turns = cuts(), []
    search = PathSearch(instance, 3, Best(Stop()))

    def kick(*given: object) -> float:
        turns.append(("kicks", given[8]))
        return 0.0

    def anneal(_: PathAnnealing, nodes: np.ndarray, mean: float, steps: int, *__: float) -> Iterator[object]:
        turns.append(("steps", steps))
        yield nodes, steps

    monkeypatch.setattr(path_search, "kick_route", kick)
    monkeypatch.setattr(PathAnnealing, "anneal", anneal)
    search.run(50 * 61 * 5, greedy_path(instance))
    totals: list[list[object]] = []
    for name, count in turns:
        if totals and totals[-1][0] == name:
            totals[-1][1] += count
        else:
            totals.append([name, count])
    phase = 50 * 61
    assert totals == [["kicks", phase], ["steps", phase], ["kicks", 2 * phase], ["steps", phase]]
    assert search.kicks == 5 * phase


def test_the_budget_of_kicks_grows_with_the_clusters_between_a_least_and_a_most() -> None:
    budgets = [[preset_kicks(preset, m) for m in (10, 100, 10_000)] for preset in ("fast", "default", "thorough")]
    assert budgets == [[5e3, 6e3, 1e5], [2e4, 2.5e4, 5e5], [1e5, 2e5, 2e7]]


@pytest.mark.parametrize("closed", [False, True])
def test_annealing_cools_down_from_a_hot_start_to_a_fiftieth_of_a_move(
    closed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In runs of 200 steps; by turns from three moves and from one; the best path of the run is returned, if any."""
    instance, calls = cuts(closed), []
    ant = PathAnnealing(instance, np.array([5], dtype=np.uint64))
    nodes = np.random.default_rng(2).permutation(N).astype(np.int32)
    better = ant.layers.begin[[N, *range(N)] if not closed else [*range(N)]]

    def note(*given: object) -> float:
        _, walk, _, _, heat, cooling, steps, least = given
        calls.append((heat, steps, least))
        assert walk.path.tolist() == [*([] if closed else [N]), *nodes]
        if len(calls) == 5:
            walk.best[:], walk.costs[BEST] = better, 1.0
        return heat * cooling**steps

    monkeypatch.setattr(annealing, "anneal", note)
    turn = list(ant.anneal(nodes, 7.0, 500, 0.25))
    assert [(path.tolist(), made) for path, made in turn] == [(nodes.tolist(), steps) for steps in (200, 200, 100)]
    ratio = 0.02 / 3.0
    assert calls == [
        (pytest.approx(21.0 * ratio**share), steps, 0.25) for share, steps in ((0.0, 200), (0.4, 200), (0.8, 100))
    ]
    path, _ = next(ant.anneal(nodes, 7.0, 500, 0.25))
    assert (path.tolist(), calls[3], len(calls)) == (nodes.tolist(), (7.0, 200, 0.25), 4)
    ((path, _),) = ant.anneal(nodes, 7.0, 150, 0.25)
    assert path.tolist() == list(range(N))
    assert calls[4] == (21.0, 150, 0.25)


PLACES = 50


def colonies(
    monkeypatch: pytest.MonkeyPatch, gains: Callable[[int], float], stop: Stop, visits: float, many: bool = False
) -> tuple[list[int], int, float, bool]:
    """Return the sizes of the colonies of a search whose k-th colony gains `gains(k)`, the generations, the kicks that
    follow, and whether they are applied to pieces of the tour.
    """
    xy = np.random.default_rng(3).uniform(0, 90, (PLACES, 2))
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 8)
    sizes: list[int] = []
    last: list[tuple[int, float, bool]] = []
    best = Best(stop)

    def found(_: Instance, ants: int, seed: int, number: int, *__: object) -> Colony:
        assert (seed, number) == (7, len(sizes))
        sizes.append(ants)
        costs = best.cost - gains(number) + np.arange(3.0)
        return Colony(np.stack([best.tour] * 3), costs, number)

    def kicked(*given: object) -> Iterator[None]:
        last.append((given[4], given[5], False))  # type: ignore[arg-type]
        return iter(())

    def kicked_in_pieces(*given: object) -> Iterator[None]:
        last.append((given[5], given[6], True))  # type: ignore[arg-type]
        return iter(())

    monkeypatch.setattr(colony, "MANY", 0 if many else 10**6)
    monkeypatch.setattr(colony, "create_colony", found)
    monkeypatch.setattr(colony, "next_generation", lambda _, c, *__: replace(c, generation=c.generation + 1))
    monkeypatch.setattr(colony, "kick_repeatedly", kicked)
    monkeypatch.setattr(colony, "kick_pieces", kicked_in_pieces)
    best.offer(greedy_tour(instance), 5000.0, 0)
    workers = Workers(None, 1, stop, WorkerLog.empty(1))
    generations = run_steps(improve_by_colony(instance, 7, best, workers, 1.0, visits - PLACES), best)
    return (sizes, *(last[0] if last else (generations, 0.0, False)))


def test_colonies_grow_by_four_up_to_the_number_of_nodes_and_five_without_a_gain_end_the_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each lives three generations without a gain, as do the champions if they differ; 20 kicks per node follow."""
    found = colonies(monkeypatch, lambda _: 0.0, Stop(), math.inf)
    assert found == ([8, 32, 50, 50, 50], 5 * 3, 20 * PLACES, False)
    found = colonies(monkeypatch, lambda k: float(k == 2), Stop(), math.inf)
    assert found == ([8, 32, *[50] * 6], 8 * 3 + 6 * 3, 20 * PLACES, False)


def test_the_last_colony_takes_the_rest_of_a_budget_that_no_much_larger_one_would_fit_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """100 tours are left after the first: 8, 32, and 60 instead of 50; two colonies without a gain are enough."""
    visits = PLACES * 101.0
    assert colonies(monkeypatch, lambda _: 1.0, Stop(), visits) == ([8, 32, 60], 3 * 6, 0.0, False)
    assert colonies(monkeypatch, lambda _: 0.0, Stop(), visits) == ([8, 32], 2 * 3, 0.1 * 60 * PLACES, False)
    # Of three tours none is built: fewer than four ants gain little.
    assert colonies(monkeypatch, lambda _: 1.0, Stop(), PLACES * 4.0) == ([], 0, pytest.approx(0.1 * 3 * PLACES), False)
    assert colonies(monkeypatch, lambda _: 1.0, Stop(), PLACES * 4.0, many=True)[0] == [3]
    assert colonies(monkeypatch, lambda _: 1.0, Stop(), PLACES * 2.0, many=True) == ([], 0, 0.1 * PLACES, True)


def test_a_colony_that_takes_longer_than_the_last_one_gained_is_not_founded(monkeypatch: pytest.MonkeyPatch) -> None:
    """30 µs per node and ant: 32 ants take 0.048 s, 50 take 0.075 s; kicks get a tenth of the visits of the gain."""
    stop = Stop(payoff_limit=PayoffLimit(True))
    sizes, generations, kicks, _ = colonies(monkeypatch, lambda _: 0.05, stop, math.inf)
    assert (sizes, generations) == ([8, 32], 12)
    assert kicks == pytest.approx(0.1 * 0.05 / 3e-5)


def test_generations_end_with_the_iterations_or_once_all_tours_cost_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    assert colonies(monkeypatch, lambda _: 0.0, Stop(iterations=8), math.inf)[:2] == ([8, 32, 50], 8)
    monkeypatch.setattr(colony, "costs_differ", lambda _: False)
    assert colonies(monkeypatch, lambda _: 0.0, Stop(), math.inf)[1] == 0


def test_ants_that_kick_are_founded_while_there_is_time_for_them_and_none_without_kicks_after_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each kicks half as often as there are nodes; kicks of the best tour follow."""
    time_left, given = iter([True, True, False]), []
    monkeypatch.setattr(colony, "_have_time_to_kick", lambda *_: next(time_left))
    monkeypatch.setattr(colony, "_colony_size", lambda *a: given.append(a[5]) or 8)
    found = colonies(monkeypatch, lambda _: 1.0, Stop(), math.inf)
    assert found == ([8, 8], 12, math.inf, False)
    assert given == [True, True]


@pytest.mark.parametrize(("kicking", "seconds"), [(True, 60.0 / (5.0 * 3)), (False, 60.0 / 8)])
def test_the_time_of_an_ant_is_measured_while_a_colony_is_founded(
    kicking: bool, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock is set by hand: the first tour took 20 s, and a colony takes 60 s. Ants that kick have three quarters
    of the time left, and each takes five times as long.
    """
    now, asked, founded = [120.0], [], []
    monkeypatch.setattr("leafcut.order.stop.clock", lambda: now[0])
    instance = build_instance(
        RoutingProblem.of_points(np.random.default_rng(3).uniform(0, 90, (PLACES, 2)), closed=True), 8
    )
    stop = Stop(seconds=1000.0, began=100.0)
    best = Best(stop)
    best.offer(np.arange(PLACES, dtype=np.int32), 5000.0, 0)

    def how_many(n: int, number: int, each: float, same: Stop, visits: float, kicks: bool) -> int:
        asked.append((n, number, each, visits, kicks))
        return 8 if number < 2 else 1

    def found(_: Instance, ants: int, seed: int, number: int, crew: Workers, kicks: int = 0) -> Colony:
        founded.append((ants, seed, number, crew.stop.seconds, crew.count, kicks))
        now[0] += 60.0
        return Colony(np.stack([best.tour] * 3), best.cost - 1.0 - np.arange(3.0), number)

    monkeypatch.setattr(colony, "_have_time_to_kick", lambda each, same: kicking)
    monkeypatch.setattr(colony, "_colony_size", how_many)
    monkeypatch.setattr(colony, "create_colony", found)
    monkeypatch.setattr(colony, "next_generation", lambda _, c, *__: replace(c, generation=c.generation + 1))
    monkeypatch.setattr(colony, "kick_repeatedly", lambda *_: iter(()))
    assert run_steps(improve_by_colony(instance, 7, best, Workers(None, 2, stop, WorkerLog.empty(2)), 13.0), best) > 0
    assert [(n, number, visits, kicks) for n, number, _, visits, kicks in asked] == [
        (PLACES, k, math.inf, kicking) for k in range(3)
    ]
    assert [each for _, _, each, *_ in asked] == pytest.approx([13.0, seconds, seconds])
    limits = [20.0 + 0.75 * 980.0, 80.0 + 0.75 * 920.0] if kicking else [1000.0] * 2
    assert founded == [(8, 7, k, pytest.approx(limits[k]), 2, 25 if kicking else 0) for k in range(2)]
