"""Kicks on pieces: the joined pieces form one path of the reported length, wherever they were kicked."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor

import numpy as np
import pytest

from leafcut.kernels.cost import tour_cost
from leafcut.model.problem import Metric, Relief, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order import colony, kicks
from leafcut.order.construction import greedy_tour
from leafcut.order.instance import Instance, build_instance, costs_of_edges, matrix_of_nodes
from leafcut.order.kicks import build_piece_instance, kick_piece, kick_pieces, split_tour
from leafcut.order.search import Best, run_steps
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog, Workers

#: Closed, and paths with both ends, one or none given.
ENDS = ["closed", "both", "start", "end", "open"]

Given = tuple[float, float]


def board(ends: str, n: int = 90) -> Instance:
    """Return random places with such ends."""
    start: Given | None = (0.0, 0.0) if ends in ("both", "start") else None
    end: Given | None = (90.0, 20.0) if ends in ("both", "end") else None
    xy = np.random.default_rng(3).uniform(0, 90, (n, 2))
    return build_instance(RoutingProblem.of_points(xy, closed=ends == "closed", start=start, end=end), 6)


def word() -> np.ndarray:
    """Return a random state."""
    return np.array([77], dtype=np.uint64)


def kicked(instance: Instance, rounds: int, executor: Executor | None = None) -> Best:
    """Return the best after some rounds of kicks on the pieces of the greedy tour."""
    best = Best(Stop(iterations=rounds))
    workers = Workers(executor, 2, best.stop, WorkerLog.empty(2))
    assert run_steps(kick_pieces(instance, greedy_tour(instance), 5, best, workers, 0, 1e9), best) == rounds
    return best


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make pieces of twenty nodes, and many kicks on each."""
    monkeypatch.setattr(kicks, "PIECE", 20)
    monkeypatch.setattr(kicks, "KICKS_PER_NODE", 5.0)


@pytest.mark.parametrize("ends", ENDS)
def test_a_kicked_path_visits_all_once_keeps_its_ends_and_costs_what_is_said(ends: str) -> None:
    instance = board(ends)
    start = greedy_tour(instance)
    best = kicked(instance, 12)
    assert sorted(best.tour.tolist()) == list(range(instance.n))
    assert best.cost == pytest.approx(tour_cost(instance.cost, best.tour))
    assert best.cost < tour_cost(instance.cost, start) - 1.0
    if instance.cost.tied_a >= 0:
        places = [int(np.flatnonzero(best.tour == v)[0]) for v in (instance.cost.tied_a, instance.cost.tied_b)]
        assert abs(places[0] - places[1]) in (1, instance.n - 1)
    assert sorted(instance.cluster_order(best.tour).tolist()) == list(range(90))


@pytest.mark.parametrize("ends", ENDS)
def test_pieces_follow_each_other_and_no_cut_parts_the_ends_of_a_path_from_their_side(ends: str) -> None:
    instance = board(ends)
    tour = greedy_tour(instance)
    for seed in range(20):
        parts = split_tour(instance, tour, np.random.default_rng(seed))
        assert min(map(len, parts)) >= 4
        joined = np.concatenate(parts)
        at = int(np.flatnonzero(tour == joined[0])[0])
        assert np.array_equal(joined, np.roll(tour, -at))
        if instance.cost.tied_a >= 0:
            assert {int(joined[0]), int(joined[-1])} == {instance.cost.tied_a, instance.cost.tied_b}


@pytest.mark.parametrize("ends", ENDS)
def test_a_piece_costs_what_it_costs_in_the_whole_and_its_candidates_are_those_of_the_whole(ends: str) -> None:
    instance = board(ends)
    for nodes in split_tour(instance, greedy_tour(instance), np.random.default_rng(1)):
        own, tour, label = build_piece_instance(instance, nodes)
        assert np.array_equal(label[tour], nodes)
        inside = set(nodes.tolist())
        for v, row in enumerate(own.candidates):
            wanted = [c for c in instance.candidates[label[v]].tolist() if c in inside]
            assert label[row[row >= 0]].tolist() == wanted
            assert (row[len(wanted) :] == -1).all()
        for a, b in zip(range(own.n - 1), range(1, own.n), strict=True):
            pair = np.array([a, b], dtype=np.int32)
            if {a, b} != {own.cost.tied_a, own.cost.tied_b}:
                assert tour_cost(own.cost, pair) == tour_cost(instance.cost, label[pair])


@pytest.mark.parametrize("ends", ENDS)
def test_a_kicked_piece_keeps_its_ends_and_gets_no_longer_until_it_is_stopped(
    ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    instance = board(ends)
    monkeypatch.setattr(kicks, "KICKS_PER_LOOK", 10)
    stopped, asked = Stop(), []
    monkeypatch.setattr(stopped, "must_stop", lambda spare=0.0: asked.append(spare) or len(asked) > 2, raising=False)
    gained = 0
    for nodes in split_tour(instance, greedy_tour(instance), np.random.default_rng(1)):
        (after,), none = kick_piece(instance, nodes, word(), 100, Stop())
        assert len(none) == 0
        assert (after[0], after[-1]) == (nodes[0], nodes[-1])
        assert sorted(after.tolist()) == sorted(nodes.tolist())
        before, now = (sum(instance.costs(n[:-1], n[1:])) for n in (nodes, after))
        assert now <= before + 1e-9
        gained += now < before - 1e-6
        # Stopped at the third look, 20 kicks are made.
        asked.clear()
        some = kick_piece(instance, nodes, word(), 20, Stop())
        assert np.array_equal(kick_piece(instance, nodes, word(), 100, stopped)[0], some[0])
        assert len(asked) == 3
        assert asked[0] == pytest.approx(kicks.PUTTING_TOGETHER * instance.n)
    assert gained


def test_kicks_on_pieces_end_with_their_number() -> None:
    """A round has five kicks a node; iterations go on from the given number."""
    instance = board("closed")
    best = Best(Stop())
    workers = Workers(None, 1, best.stop, WorkerLog.empty(1))
    tour = greedy_tour(instance)
    assert run_steps(kick_pieces(instance, tour, 5, best, workers, 3, 0), best, 3) == 3
    assert run_steps(kick_pieces(instance, tour, 5, best, workers, 3, 5 * 90), best, 3) == 4
    assert run_steps(kick_pieces(instance, tour, 5, best, workers, 3, 5 * 90 + 1), best, 3) == 5


def test_pieces_are_the_same_kicked_here_and_in_threads() -> None:
    instance = board("start")
    here = kicked(instance, 3)
    with ThreadPoolExecutor(3) as threads:
        assert np.array_equal(here.tour, kicked(instance, 3, threads).tour)


def test_a_search_with_pieces_gives_the_same_answer_on_one_thread_and_on_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colony, "MANY", 60)
    monkeypatch.setattr(kicks, "MANY", 60)
    monkeypatch.setattr(colony, "MOST_ANTS", 20)
    rounds: list[int] = []
    whole = colony.kick_pieces

    def counted(*given: object) -> Iterator[None]:
        rounds.append(0)
        for _ in whole(*given):  # type: ignore[arg-type]
            rounds[-1] += 1
            yield

    monkeypatch.setattr(colony, "kick_pieces", counted)
    problem = RoutingProblem.of_points(np.random.default_rng(8).uniform(0, 90, (70, 2)), closed=True)
    found = [solve(problem, SolveOptions(preset="fast", threads=k, seed=4)) for k in (1, 2)]
    assert found[0].nodes.tolist() == found[1].nodes.tolist()
    assert found[0].cost == found[1].cost
    assert len(rounds) == 2
    assert rounds[0] == rounds[1] > 0


@pytest.mark.slow
def test_a_piece_of_a_tour_over_a_surface_has_the_costs_of_the_whole() -> None:
    """Every edge has the same cost in the piece and in the whole tour, also between ends of chains."""
    random = np.random.default_rng(4)
    xy = random.uniform(0, 100, (60, 2)).round(3)
    tiles = np.where(random.random((20, 20)) < 0.3, random.uniform(5, 30, (20, 20)), -np.inf)
    relief = Relief(xy, random.uniform(0, 5, 60), 40.0, tiles, 0.0, 0.0, 5.0, 50.0, 200.0)
    metric = Metric("linear", (100.0, 80.0), (500.0, 300.0), relief=relief)
    whole = build_instance(RoutingProblem.of_points(xy, metric, start=(1.0, 2.0)), 8)
    nodes = random.permutation(whole.n - 2)[:25].astype(np.int32)
    piece, tour, label = build_piece_instance(whole, nodes)
    pairs = [(i, j) for i in range(25) for j in range(25) if {i, j} != {int(tour[0]), int(tour[-1])}]
    leave, arrive = np.array(pairs, dtype=np.int32).T
    assert np.array_equal(piece.costs(leave, arrive), whole.costs(label[leave], label[arrive]))
    among = whole.cost._replace(
        xy=whole.cost.xy[nodes], matrix=matrix_of_nodes(whole.cost, nodes), tied_a=-1, tied_b=-1, free=-1
    )
    leave, arrive = np.array([(i, j) for i in range(25) for j in range(25)], dtype=np.int32).T
    assert np.array_equal(costs_of_edges(among, leave, arrive), whole.costs(nodes[leave], nodes[arrive]))
