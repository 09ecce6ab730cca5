"""What the kernels of kicks are given: pieces, random states, numbers of kicks, long edges, and passes of a descent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import WAITING, Tour
from leafcut.model.problem import RoutingProblem
from leafcut.order import kicks
from leafcut.order.construction import greedy_tour, random_states
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import (
    BREADTH,
    build_piece_instance,
    improve_queued_nodes,
    kick_pieces,
    kick_repeatedly,
    kick_within_time,
    kicks_per_iteration,
    shorten_long_edges,
    split_tour,
    tour_with_buffers,
)
from leafcut.order.search import Best, run_steps
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog, Workers

N = 90


def board(n: int = N, **ends: object) -> Instance:
    """Return n random places with such ends."""
    xy = np.random.default_rng(3).uniform(0, 90, (n, 2))
    return build_instance(RoutingProblem.of_points(xy, **(ends or {"closed": True})), 6)  # type: ignore[arg-type]


class Draws:
    """A generator whose draws are given."""

    def __init__(self, whole: int, part: float) -> None:
        self.whole, self.part = whole, part

    def integers(self, high: int) -> int:
        """Return the given whole number."""
        assert self.whole < high
        return self.whole

    def uniform(self, low: float, high: float) -> float:
        """Return the given number."""
        assert (low, high) == (0.25, 0.75)
        return self.part


def test_an_iteration_has_two_hundred_kicks_or_one_for_a_hundred_nodes() -> None:
    assert [kicks_per_iteration(n) for n in (9, 20_000, 20_099, 20_100, 10**6)] == [200, 200, 200, 201, 10_000]


def test_a_work_tour_has_all_or_no_nodes_in_its_queue() -> None:
    node = np.array([2, 0, 3, 1], dtype=np.int32)
    tour, idle = tour_with_buffers(node), tour_with_buffers(node, queued=False, log=7)
    assert tour.place.tolist() == idle.place.tolist() == [1, 3, 0, 2]
    assert (tour.queue.tolist(), tour.queued.tolist(), tour.counts.tolist()) == ([2, 0, 3, 1], [1] * 4, [0, 4, 0, 0])
    assert (idle.queued.tolist(), idle.counts.tolist()) == ([0] * 4, [0] * 4)
    assert (tour.log.shape, idle.log.shape, tour.buffer.shape) == ((0, 2), (7, 2), (4,))
    tour.node[0] = 9
    assert node[0] == 2


@pytest.mark.parametrize(("n", "count"), [(9, 2), (49, 2), (51, 3), (90, 4), (109, 5), (111, 6)])
def test_a_closed_tour_is_cut_into_equal_pieces_from_a_random_node_on(
    n: int, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kicks, "PIECE", 20)
    tour = np.random.default_rng(1).permutation(n).astype(np.int32)
    pieces = split_tour(board(n), tour, Draws(7, 0.0))  # type: ignore[arg-type]
    assert np.concatenate(pieces).tolist() == [*tour[7:].tolist(), *tour[:7].tolist()]
    assert [len(piece) for piece in pieces] == [n // count + (k < n % count) for k in range(count)]


@pytest.mark.parametrize("turned", [False, True])
def test_a_path_is_cut_at_its_ends_and_between_them(turned: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """92 nodes make five pieces of 18.4 nodes; the first cut is after 0.5 of a piece, and so on."""
    monkeypatch.setattr(kicks, "PIECE", 20)
    instance = board(start=(0.0, 0.0), end=(9.0, 9.0))
    a, b, n = instance.cost.tied_a, instance.cost.tied_b, instance.n
    inner = np.random.default_rng(1).permutation(N).tolist()
    path = [a, *inner, b] if turned else [b, *inner, a]
    for shift in (0, 1, 30, n - 1):
        tour = np.roll(np.array(path, dtype=np.int32), shift)
        pieces = split_tour(instance, tour, Draws(0, 0.5))  # type: ignore[arg-type]
        assert np.concatenate(pieces).tolist() == path
        assert [len(p) for p in pieces] == [9, 18, 19, 18, 18, 10]


@pytest.mark.parametrize("ends", [{"closed": True}, {"start": (0.0, 0.0)}])
def test_a_piece_is_an_instance_with_tied_ends_and_the_costs_of_the_whole(ends: dict[str, object]) -> None:
    instance = board(**ends)
    nodes = np.random.default_rng(2).permutation(instance.n)[:20].astype(np.int32)
    if instance.cost.free >= 0 and instance.cost.free not in nodes:
        nodes[5] = instance.cost.free
    own, tour, label = build_piece_instance(instance, nodes)
    assert label.tolist() == sorted(nodes.tolist())
    assert label[tour].tolist() == nodes.tolist()
    cost = own.cost
    assert (own.n, own.first, own.second, cost.plain) == (20, -1, -1, False)
    assert (cost.tied_a, cost.tied_b) == (tour[0], tour[-1])
    assert cost.free == (-1 if "closed" in ends else label.tolist().index(instance.cost.free))
    assert cost.xy.tolist() == instance.cost.xy[label].tolist()
    for v in range(20):
        listed = own.candidates[v] >= 0
        wanted = [c for c in instance.candidates[label[v]].tolist() if c in nodes]
        assert label[own.candidates[v, listed]].tolist() == wanted
        assert own.lengths[v, listed].tolist() == [float(instance.costs(label[v], c)[0]) for c in wanted]
        assert np.isinf(own.lengths[v, ~listed]).all()
        assert (listed == sorted(listed, reverse=True)).all()


def test_every_round_cuts_elsewhere_and_kicks_each_piece_with_a_state_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """0.1 kicks a node, one at least; the round has its number in the random streams."""
    monkeypatch.setattr(kicks, "PIECE", 20)
    instance, given = board(), []
    workers = Workers(None, 1, Stop(), WorkerLog.empty(1))

    def turned(one: Instance, piece: np.ndarray, word: np.ndarray, count: int, stop: Stop) -> tuple[np.ndarray, object]:
        assert (one, stop) == (instance, workers.stop)
        given.append((piece.tolist(), word.tolist(), count))
        return piece[::-1][None], np.zeros(0)

    monkeypatch.setattr(kicks, "kick_piece", turned)
    tour = start = greedy_tour(instance)
    best, reported = Best(Stop()), []
    monkeypatch.setattr(best, "tell", lambda iteration, _: reported.append(iteration))
    assert run_steps(kick_pieces(instance, start, 5, best, workers, 3, 3 * (2 * 2 + 2 * 2) - 1), best, 3) == 6
    wanted, costs = [], []
    for iteration in (3, 4, 5):
        pieces = split_tour(instance, tour, np.random.default_rng((5, 4, iteration)))
        words = random_states(5, 3, iteration, count=4)
        wanted += [(p.tolist(), [int(w)], max(1, len(p) // 10)) for p, w in zip(pieces, words, strict=True)]
        tour = np.concatenate([p[::-1] for p in pieces])
        costs.append(tour_cost(instance.cost, tour))
    assert given == wanted
    assert best.cost == min(costs)
    assert best.iteration == 4 + int(np.argmin(costs))
    assert reported == [4, 5, 6]


def test_iterations_of_kicks_offer_a_tour_that_has_gained(monkeypatch: pytest.MonkeyPatch) -> None:
    instance, gains, seen = board(), iter([0.0, 2.0, 0.0, 1.0]), []
    start = greedy_tour(instance)
    breadth = np.minimum(BREADTH, instance.exchange_candidates[0].shape[1]).tolist()

    def kick(cost: object, tour: Tour, lists: np.ndarray, lengths: np.ndarray, *rest: object) -> float:
        tries, words, k, count = rest
        assert (lists is instance.exchange_candidates[0], lengths is instance.exchange_candidates[1]) == (True, True)
        seen.append((tries.tolist(), words.tolist(), k, count, tour.log.shape, tour.counts.tolist()))  # type: ignore
        return next(gains)

    best, offered, reported = Best(Stop()), [], []
    monkeypatch.setattr(kicks, "kick_and_repair", kick)
    monkeypatch.setattr(best, "offer", lambda tour, cost, iteration: offered.append((tour.tolist(), cost, iteration)))
    monkeypatch.setattr(best, "tell", lambda iteration, _: reported.append(iteration))
    assert run_steps(kick_repeatedly(instance, start, 5, best, 7, 601), best, 7) == 11
    word = random_states(5, 0, count=1).tolist()
    assert seen == [(breadth, word, 0, 200, (2 * N + 1000, 2), [0] * 4)] * 4
    length = tour_cost(instance.cost, start)
    assert offered == [(start.tolist(), length, 9), (start.tolist(), length, 11)]
    assert reported == [8, 9, 10, 11]


def test_kicks_of_a_piece_are_counted_between_two_looks_at_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    instance, counts, spared = board(), [], []

    class Looks(Stop):
        def must_stop(self, spare: float = 0.0) -> bool:
            spared.append(spare)
            return len(spared) == 6

    monkeypatch.setattr(kicks, "kick_and_repair", lambda *given: counts.append(given[-1]))
    tour, word = tour_with_buffers(greedy_tour(instance), queued=False), np.ones(1, dtype=np.uint64)
    kick_within_time(instance, tour, word, 250, Looks(), 0.5)
    assert counts == [100, 100, 50]
    kick_within_time(instance, tour, word, 900, Looks(), 0.5)
    assert counts == [100, 100, 50, 100, 100]
    assert spared == [0.5] * 6


def test_edges_longer_than_all_candidates_at_their_ends_are_shortened_the_longest_excess_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    instance, given = board(), []

    def home(*all_given: object) -> float:
        given.append(all_given)
        return 0.25

    monkeypatch.setattr(kicks, "shorten_by_walking", home)
    tour = tour_with_buffers(np.random.default_rng(1).permutation(N).astype(np.int32), queued=False)
    assert shorten_long_edges(instance, tour) is True
    cost, same, lists, lengths, edges, onto, steps, places = given[0]
    assert (cost, same, lists, lengths) == (instance.cost, tour, *instance.exchange_candidates)
    node = tour.node.tolist()
    excess = {}
    for a, b in zip(node, [*node[1:], node[0]], strict=True):
        longest = max(instance.exchange_candidates[1][v].max() for v in (a, b))
        if instance.costs(a, b)[0] > longest:
            excess[a, b] = instance.costs(a, b)[0] - longest
    assert len(excess) > 10
    assert edges.tolist() == [list(e) for e in sorted(excess, key=lambda e: -excess[e])]
    assert onto.tolist() == [-1] * N
    assert (steps.shape, places) == ((3000, 2), 50 * N)
    monkeypatch.setattr(kicks, "shorten_by_walking", lambda *_: 0.0)
    assert shorten_long_edges(instance, tour) is False


def test_a_descent_makes_short_moves_first_and_looks_every_five_thousand_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kicks, "LONGEST_REWRITE", 12)
    instance, seen, looks = board(), [], []
    tour = tour_with_buffers(greedy_tour(instance))

    def improve(cost: object, working: Tour, *rest: object) -> None:
        assert rest[:2] == instance.exchange_candidates
        seen.append((len(working.buffer), rest[3], int(tour.counts[1])))
        if len(seen) == 2:
            tour.queued[:], tour.queued[[3, 5]], tour.counts[:2] = 0, WAITING, (7, 0)
        elif len(seen) == 3:
            tour.counts[1] = 0

    monkeypatch.setattr(kicks, "improve_queued", improve)
    assert improve_queued_nodes(instance, tour, BREADTH, Stop(), lambda: looks.append(len(seen)))
    assert seen == [(12, 5000, N), (12, 5000, N), (N, 5000, 2)]
    assert looks == [1, 2, 3]
    order = [v for v in tour.node.tolist() if v in (3, 5)]
    assert tour.queue[:2].tolist() == order
    assert tour.counts[0] == 0
    # What the first pass leaves in the queue, the second takes up.
    seen.clear()
    stopped = Stop()
    stopped.cancelled.set()
    full = tour_with_buffers(greedy_tour(instance))
    assert improve_queued_nodes(instance, full, BREADTH, stopped) is False
    assert seen == []
    assert math.isinf(stopped.seconds)
