"""The colony: no ant's tour gets longer, costs are true, and where the work is done changes nothing."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor

import numpy as np
import pytest

from leafcut.kernels.cost import tour_cost
from leafcut.model.heartbeat import Progress
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import colony as colony_module
from leafcut.order.colony import (
    FIRST_ANTS,
    MOST_ANTS,
    Colony,
    _colony_size,
    _has_improved,
    _have_time_to_kick,
    costs_differ,
    create_colony,
    next_generation,
    recombine_tours,
    run_colony,
)
from leafcut.order.construction import greedy_tour, random_states
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import improve_queued_nodes, kick_within_time, tour_with_buffers
from leafcut.order.search import AlgorithmRun, Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, WorkerLog, Workers


def instance_of(n: int, seed: int = 1) -> Instance:
    """Return a closed instance of n random places."""
    return build_instance(RoutingProblem.of_points(np.random.default_rng(seed).uniform(0, 90, (n, 2)), closed=True), 8)


def workers(executor: Executor | None = None, count: int = 1) -> Workers:
    """Return workers without a clock."""
    return Workers(executor, count, Stop(), WorkerLog.empty(count))


def lived(instance: Instance, where: Workers, generations: int = 4) -> Colony:
    """Return a colony of ten ants after some generations."""
    colony = create_colony(instance, 10, 7, 0, where)
    for _ in range(generations):
        colony = next_generation(instance, colony, 7, where)
    return colony


def test_no_ants_tour_gets_longer_and_every_cost_is_that_of_its_tour() -> None:
    instance = instance_of(150)
    colony = create_colony(instance, 10, 3, 0, workers())
    for _ in range(5):
        after = next_generation(instance, colony, 3, workers())
        assert (after.costs <= colony.costs).all()
        assert all(sorted(t.tolist()) == list(range(150)) for t in after.tours)
        assert after.costs.tolist() == pytest.approx([tour_cost(instance.cost, t) for t in after.tours])
        colony = after
    assert colony.generation == 5


def test_a_generation_is_the_same_in_threads() -> None:
    instance = instance_of(80)
    here = lived(instance, workers())
    with ThreadPoolExecutor(3) as threads:
        assert np.array_equal(here.tours, lived(instance, workers(threads, 3)).tours)


def test_the_best_ant_of_another_colony_joins_if_there_is_any() -> None:
    one, other = (
        Colony(np.arange(k, k + 6, dtype=np.int32).reshape(2, 3), np.array([5.0 + k, 4.0 + k]), k, 9) for k in (0, 10)
    )
    joined = one.with_best_of(other)
    assert joined.tours.tolist() == [[0, 1, 2], [3, 4, 5], [13, 14, 15]]
    assert joined.costs.tolist() == [5.0, 4.0, 14.0]
    assert (joined.number, joined.generation) == (0, 9)
    assert one.with_best_of(Colony(other.tours[:0], other.costs[:0])) is one


def test_every_ant_meets_one_other_and_all_belong_to_one_ring(monkeypatch: pytest.MonkeyPatch) -> None:
    instance, met = instance_of(12), []

    def note(_: Instance, mine: np.ndarray, other: np.ndarray, costs: np.ndarray, *__: object) -> Share:
        met.extend(zip(mine.tolist(), other.tolist(), costs.tolist(), strict=True))
        return mine, costs

    monkeypatch.setattr(colony_module, "recombine_tours", note)
    tours = np.array([np.roll(np.arange(12), k) for k in range(9)], dtype=np.int32)
    colony = Colony(tours, np.arange(9.0))
    after = next_generation(instance, colony, 7, workers())
    assert np.array_equal(after.tours, colony.tours)
    assert np.array_equal(after.costs, colony.costs)
    assert after.generation == 1
    follows = {-mine[0] % 12: -other[0] % 12 for mine, other, _ in met}
    assert [cost for *_, cost in met] == [-mine[0] % 12 for mine, *_ in met]
    ring = [0]
    for _ in range(8):
        ring.append(follows[ring[-1]])
    assert sorted(ring) == list(range(9))
    assert follows[ring[-1]] == 0


def test_ants_that_meet_after_the_time_is_up_keep_their_tours_and_costs() -> None:
    instance = instance_of(150)
    colony = create_colony(instance, 4, 7, 0, workers())
    mine = colony.tours.copy()
    meetings = mine, np.roll(mine, 1, axis=0), colony.costs, np.arange(1, 5, dtype=np.uint64)
    tours, costs = recombine_tours(instance, *meetings, Stop(seconds=0.0))
    assert np.array_equal(tours, colony.tours)
    assert np.array_equal(costs, colony.costs)
    tours, costs = recombine_tours(instance, *meetings, Stop())
    assert (costs < colony.costs).any()
    assert np.array_equal(mine, colony.tours)


def test_a_generation_leaves_the_colony_it_comes_from_alone() -> None:
    instance = instance_of(80)
    colony = create_colony(instance, 6, 1, 0, workers())
    before = colony.tours.copy()
    assert np.array_equal(next_generation(instance, colony, 1, workers()).tours.shape, before.shape)
    assert np.array_equal(colony.tours, before)


def test_a_colony_grows_until_time_or_budget_is_short_and_then_takes_what_is_left() -> None:
    stop = Stop(seconds=math.inf)
    assert [_colony_size(100, k, 1.0, stop, math.inf) for k in range(3)] == [FIRST_ANTS, 4 * FIRST_ANTS, 100]
    assert _colony_size(100, 0, 1.0, stop, 1500.0) == 15
    assert _colony_size(100, 0, 1.0, Stop(seconds=0.0), math.inf) == 1


def test_with_a_clock_one_colony_takes_the_time_that_would_not_do_for_much_larger_ones() -> None:
    """44 % of the time is for building, at one second an ant."""
    assert _colony_size(1000, 0, 1.0, Stop(seconds=228.5), math.inf) == 100
    assert _colony_size(1000, 0, 1.0, Stop(seconds=400.0), math.inf) == FIRST_ANTS
    assert _colony_size(1000, 1, 1.0, Stop(seconds=1000.0), math.inf) == MOST_ANTS


def test_ants_kick_when_the_time_does_for_a_dozen_of_them_and_never_on_a_budget_of_work() -> None:
    """75 % of the time is for building, at five seconds an ant."""
    assert _have_time_to_kick(1.0, Stop(seconds=80.5))
    assert not _have_time_to_kick(1.0, Stop(seconds=79.5))
    assert not _have_time_to_kick(1.0, Stop())
    assert _colony_size(1000, 0, 1.0, Stop(seconds=80.5), math.inf, kicking=True) == 12


def test_ants_that_kick_have_tours_no_longer_the_same_for_a_seed_and_none_when_the_time_is_up() -> None:
    instance = instance_of(150)
    plain, kicked, again = (create_colony(instance, 6, 3, 0, workers(), kicks) for kicks in (0, 300, 300))
    assert (kicked.costs <= plain.costs + 1e-9).all()
    assert kicked.costs.mean() < plain.costs.mean()
    assert np.array_equal(kicked.tours, again.tours)
    assert all(sorted(t.tolist()) == list(range(150)) for t in kicked.tours)
    assert kicked.costs.tolist() == pytest.approx([tour_cost(instance.cost, t) for t in kicked.tours])
    late = Workers(None, 1, Stop(seconds=0.0), WorkerLog.empty(1))
    assert len(create_colony(instance, 6, 3, 0, late, 300).costs) == 0


def test_a_generation_is_of_use_when_the_best_ant_gained_or_the_others_came_nearer_to_it() -> None:
    before = np.array([100.0, 110.0, 120.0])
    assert _has_improved(before, np.array([99.0, 110.0, 120.0]), little=0.5)
    assert _has_improved(before, np.array([100.0, 105.0, 110.0]), little=0.5)
    assert not _has_improved(before, np.array([100.0, 109.9, 120.0]), little=0.5)
    assert _has_improved(before, np.array([100.0, 109.9, 120.0]), little=0.0)
    assert not _has_improved(before, before, little=0.0)


@pytest.mark.parametrize("n", [5, 6, 7, 12])
def test_all_nodes_on_one_place_or_in_a_line_are_no_trouble(n: int) -> None:
    for xy in (np.ones((n, 2)), np.stack([np.arange(n), np.zeros(n)], axis=1)):
        for closed in (True, False):
            found = solve(RoutingProblem.of_points(xy, closed=closed), SolveOptions(preset="fast"))
            assert sorted(found.nodes.tolist()) == list(range(n))
            assert found.cost == pytest.approx((2 if closed else 1) * float(np.ptp(xy[:, 0])))


def test_a_search_that_is_stopped_keeps_the_best_that_it_has() -> None:
    cancelled = threading.Event()
    seen: list[float] = []

    def stop_soon(progress: Progress) -> None:
        assert progress.cost is not None
        seen.append(progress.cost)
        if len(seen) == 3:
            cancelled.set()

    problem = RoutingProblem.of_points(np.random.default_rng(5).uniform(0, 90, (400, 2)), Metric(), closed=True)
    found = solve(problem, SolveOptions(iterations=10_000), progress=stop_soon, cancelled=cancelled)
    assert found.stopped_early
    assert found.cost <= min(seen) + 1e-9
    assert sorted(found.nodes.tolist()) == list(range(400))


@pytest.mark.parametrize(
    ("options", "cores", "threads", "visits"),
    [
        (SolveOptions(), 3, 3, 6e5),
        (SolveOptions(preset="fast"), None, 1, 1e5),
        (SolveOptions(preset="thorough", threads=2), 3, 2, 1e7),
        (SolveOptions(iterations=7), 3, 3, math.inf),
        (SolveOptions(time_limit=9.0, threads=1, seed=5), 3, 1, math.inf),
    ],
)
def test_a_run_has_the_work_budget_of_its_preset_unless_it_is_limited(
    options: SolveOptions, cores: int | None, threads: int, visits: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    instance, best, seen = instance_of(20), Best(Stop()), []

    def improve(*given: object) -> Iterator[None]:
        seen.append(given)
        given[3].log.add(0, 6, 0.5, 70.0)  # type: ignore[attr-defined]
        best.offer(np.arange(20, dtype=np.int32), 70.0, 4)
        yield from [None] * 9

    monkeypatch.setattr("os.cpu_count", lambda: cores)
    monkeypatch.setattr(colony_module, "improve_by_colony", improve)
    found = run_colony(instance, AlgorithmRun(options, AcoOptions(), FireflyOptions(), best))
    ((first, seed, same, crew, _, budget),) = seen
    assert (first, seed, same, budget) == (instance, options.seed, best, visits - instance.n)
    assert (crew.count, crew.stop, crew.executor is None) == (threads, best.stop, threads == 1)
    assert (best.view.shown, best.view.log) == (instance, crew.log)
    assert (found.iterations, found.tour.tolist(), found.workers) == (9, list(range(20)), crew.log.worker_figures())
    assert len(found.workers) == threads
    assert (found.workers[0].ants, found.workers[0].best) == (6, 70.0)


def test_tours_that_differ_by_rounding_alone_are_equal() -> None:
    tours = np.zeros((3, 4), dtype=np.int32)
    assert not costs_differ(Colony(tours, np.array([5.0, 5.0 + 9e-10, 5.0])))
    assert costs_differ(Colony(tours, np.array([5.0, 5.0 + 2e-9, 5.0])))
    assert not costs_differ(Colony(tours[:1], np.array([5.0])))
    assert not costs_differ(Colony(tours[:0], np.zeros(0)))


def test_a_gain_is_more_than_rounding() -> None:
    """Of the best ant, and of any other ant beyond a share of the mean excess over the best."""
    before = np.array([100.0, 110.0])
    assert not _has_improved(before, before - 9e-10, 0.0)
    assert _has_improved(before, before - [2e-9, 0.0], 0.0)
    assert not _has_improved(before, before - [0.0, 9e-10], 0.0)
    assert _has_improved(before, before - [0.0, 2e-9], 0.0)
    # A mean gain of 0.5 is more than a tenth of the mean excess of 4.5, and not more than a ninth.
    assert _has_improved(before, np.array([100.0, 109.0]), 0.111)
    assert not _has_improved(before, np.array([100.0, 109.0]), 0.112)


@pytest.mark.parametrize("kicks", [0, 150])
def test_an_ant_builds_a_random_greedy_tour_which_is_improved_and_kicked(kicks: int) -> None:
    instance = instance_of(60)
    word, same = np.array([77], dtype=np.uint64), np.array([77], dtype=np.uint64)
    (node,), (cost,) = colony_module.build_tour(instance, word, kicks, Stop())
    tour = tour_with_buffers(greedy_tour(instance, np.random.default_rng(77)))
    assert improve_queued_nodes(instance, tour, (0, 8, 5, 3, 1), Stop())
    if kicks:
        tour = tour_with_buffers(tour.node, queued=False, log=2 * 60 + 1000)
        kick_within_time(instance, tour, same, kicks, Stop())
    assert node.tolist() == tour.node.tolist()
    assert cost == tour_cost(instance.cost, tour.node)
    assert word.tolist() == same.tolist()
    late = Stop()
    late.cancelled.set()
    tours, costs = colony_module.build_tour(instance, word, kicks, late)
    assert (tours.tolist(), costs.tolist()) == ([[0] * 60], [math.inf])


def test_the_states_of_ants_depend_on_the_seed_and_the_number_of_the_colony(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tours that were not finished are left out."""
    instance, seen = instance_of(8), []

    def build(one: Instance, word: np.ndarray, kicks: int, stop: Stop) -> Share:
        seen.append((one, int(word[0]), kicks))
        cost = math.inf if len(seen) == 2 else 10.0 + len(seen)
        return np.full((1, 8), len(seen), dtype=np.int32), np.array([cost])

    monkeypatch.setattr(colony_module, "build_tour", build)
    colony = create_colony(instance, 4, 7, 3, workers(), 25)
    assert seen == [(instance, int(word), 25) for word in random_states(7, 1, 3, count=4)]
    assert colony.costs.tolist() == [11.0, 13.0, 14.0]
    assert colony.tours[:, 0].tolist() == [1, 3, 4]
    assert (colony.number, colony.generation) == (3, 0)


@pytest.mark.parametrize(("count", "blocks"), [(1, [4, 4, 1]), (2, [2, 2, 2, 2, 1]), (9, [1] * 9)])
def test_a_generation_is_shared_in_two_blocks_per_worker(
    count: int, blocks: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The state of an ant belongs to its place among the meetings, and the first one also mixes them."""
    instance, seen = instance_of(12), []

    def note(
        _: Instance, mine: np.ndarray, other: np.ndarray, costs: np.ndarray, words: np.ndarray, *__: object
    ) -> Share:
        seen.append((mine[:, 0].tolist(), other[:, 0].tolist(), costs.tolist(), words.tolist()))
        return mine, costs - 1.0

    monkeypatch.setattr(colony_module, "recombine_tours", note)
    tours = np.arange(9, dtype=np.int32)[:, None] * np.ones(12, dtype=np.int32)
    after = next_generation(instance, Colony(tours, np.arange(9.0), 3, 5), 7, workers(count=count))
    words = random_states(7, 2, 3, 5, count=9)
    mixed = np.random.default_rng(words[0]).permutation(9).tolist()
    assert [len(mine) for mine, *_ in seen] == blocks
    assert [v for mine, *_ in seen for v in mine] == mixed
    assert [v for _, other, *_ in seen for v in other] == [*mixed[1:], mixed[0]]
    assert [v for *_, costs, _ in seen for v in costs] == [float(v) for v in mixed]
    assert [v for *_, given in seen for v in given] == words.tolist()
    assert after.tours[:, 0].tolist() == list(range(9))
    assert after.costs.tolist() == [float(k) - 1.0 for k in range(9)]
    assert (after.number, after.generation) == (3, 6)


def test_meetings_are_assembled_in_groups_between_two_looks_at_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """12 nodes and 30 nodes a look: two pairs at once. Costs are summed again where a tour has gained."""
    monkeypatch.setattr(colony_module, "NODES_PER_LOOK", 30)
    instance, ranges = instance_of(12), []
    lists = instance.exchange_candidates

    def assemble(*given: object) -> None:
        _, tour, assembly, *rest = given
        near, lengths, breadth, tours, _, words, gains, first, stop = rest
        assert (near is lists[0], lengths is lists[1], breadth.tolist()) == (True, True, [0, 8, 5, 3, 1])  # type: ignore
        assert (len(tour.queue), tour.counts[1], assembly.links.shape) == (12, 0, (12, 4))  # type: ignore
        assert words.tolist() == [1, 2, 3, 4, 5]  # type: ignore[attr-defined]
        ranges.append((first, stop))
        if first == 2:
            tours[3], gains[3] = np.arange(12), 0.5  # type: ignore[index]

    monkeypatch.setattr(colony_module, "recombine_by_edge_assembly", assemble)
    mine = np.array([np.roll(np.arange(12), k) for k in range(5)], dtype=np.int32)[:, ::-1].copy()
    costs, words = np.full(5, 7.0), np.arange(1, 6, dtype=np.uint64)
    tours, after = recombine_tours(instance, mine, mine[::-1].copy(), costs, words, Stop())
    assert ranges == [(0, 2), (2, 4), (4, 5)]
    length = tour_cost(instance.cost, np.arange(12, dtype=np.int32))
    assert after.tolist() == [7.0, 7.0, 7.0, length, 7.0]
    assert tours[3].tolist() == list(range(12))
    assert tours[[0, 1, 2, 4]].tolist() == mine[[0, 1, 2, 4]].tolist()
    assert costs.tolist() == [7.0] * 5


def test_the_buffers_of_an_assembly_hold_two_tours_and_the_longest_cycle() -> None:
    a = colony_module.allocate_assembly_buffers(7)
    shapes = [(7, 4), (7, 8), (4, 16), (4, 6000), (6000, 3)]
    assert [buffer.shape for buffer in a] == shapes
    assert {buffer.dtype for buffer in a} == {np.dtype(np.int32)}
