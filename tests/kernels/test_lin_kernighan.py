"""Moves of up to five edges, and kicks: reported gains are true, and undone moves leave no trace."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import (
    ENDS,
    LEAVES_3,
    LEAVES_4,
    LEAVES_5,
    WAITING,
    find_move,
    improve_queued,
    is_single_tour,
    kick_and_repair,
    make_move,
    segment_kick,
    undo_logged_changes,
)
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import BREADTH, queue_waiting_nodes, tour_with_buffers
from plain_python import plain_python

#: Entries enough for all that a test does.
LOG = 100_000

SEEDS = st.integers(0, 2**31)
METRICS = st.sampled_from(["euclidean", "linear", "dogleg", "EUC_2D"])


def random_instance(n: int, seed: int, metric: str = "euclidean", **ends: object) -> tuple[Instance, np.ndarray]:
    """Return an instance of n nodes on a coarse grid (so that ties and doubles occur) and its candidate lengths."""
    xy = np.random.default_rng(seed).integers(0, 25, (n, 2)).astype(np.float64)
    problem = RoutingProblem.of_points(xy, Metric(metric, (10.0, 20.0), (50.0, 40.0)), **(ends or {"closed": True}))
    instance = build_instance(problem, 8)
    return instance, instance.lengths


def breadth_for(instance: Instance) -> np.ndarray:
    """Return the breadth of the solver, cut to the lists of a small instance."""
    return np.minimum(np.array(BREADTH, dtype=np.int64), instance.candidates.shape[1])


def edges(tour: np.ndarray) -> list[tuple[int, int]]:
    """Return the edges of a closed tour, each with its smaller node first, sorted."""
    return sorted(tuple(sorted((int(a), int(b)))) for a, b in zip(tour, np.roll(tour, -1), strict=True))


def joined_in_one(n: int, old: list[tuple[int, int]], ends: list[int]) -> bool:
    """Return whether removing t0–t1, t2–t3, … and adding t1–t2, …, t(2k-1)–t0 leaves one cycle, by walking it."""
    left = list(old)
    for a, b in zip(ends[::2], ends[1::2], strict=True):
        left.remove(tuple(sorted((a, b))))
    left += [tuple(sorted(p)) for p in zip(ends[1::2], [*ends[2::2], ends[0]], strict=True)]
    near: dict[int, list[int]] = {v: [] for v in range(n)}
    for a, b in left:
        near[a].append(b)
        near[b].append(a)
    came, at, steps = -1, 0, 0
    while True:
        forward = list(near[at])
        if came in forward:
            forward.remove(came)
        came, at, steps = at, forward[0], steps + 1
        if at == 0 or steps > n:
            return steps == n


@given(st.integers(8, 24), SEEDS, st.integers(2, 5))
def test_feasibility_by_sorted_places_agrees_with_a_walk_along_the_tour(n: int, seed: int, k: int) -> None:
    """Random removed edges in random direction: both tests of feasibility agree, and so does the move."""
    rng = np.random.default_rng(seed)
    tour = tour_with_buffers(rng.permutation(n).astype(np.int32), log=LOG)
    cuts = rng.choice(n, k, replace=False)
    ends: list[int] = []
    for cut in cuts.tolist():
        pair = [int(tour.node[cut]), int(tour.node[(cut + 1) % n])]
        ends += pair if rng.random() < 0.5 else pair[::-1]
    tour.move[ENDS, : 2 * k] = ends
    added = {tuple(sorted(p)) for p in zip(ends[1::2], [*ends[2::2], ends[0]], strict=True)}
    old = edges(tour.node)
    if len(added) < k or any(a == b for a, b in added) or added & set(old):
        return  # an edge twice, a loop, or an edge that is there: the search never makes such moves
    with plain_python():
        expected = joined_in_one(n, old, ends)
        assert is_single_tour(tour.place, tour.move, k) == expected
        if expected:
            before = tour.node.copy()
            assert make_move(tour, k)
            removed = {tuple(sorted(p)) for p in zip(ends[::2], ends[1::2], strict=True)}
            assert set(edges(tour.node)) == set(old) - removed | added
            assert np.array_equal(tour.node[tour.place], np.arange(n))
            undo_logged_changes(tour)
            assert np.array_equal(tour.node, before)
            assert np.array_equal(tour.node[tour.place], np.arange(n))


@pytest.mark.parametrize(("k", "table"), [(3, [LEAVES_3]), (4, [LEAVES_4]), (5, LEAVES_5.tolist())])
def test_a_key_tells_whether_a_move_leaves_one_tour(k: int, table: list[int]) -> None:
    """For every order of the removed edges and both traversals, the key's bit agrees with walking the tour."""
    n, seen = 2 * k, set()
    old = edges(np.arange(n))
    for begins in itertools.permutations(range(1, n - 1, 2)):
        for sides in itertools.product((0, 1), repeat=k - 1):
            ends = [0, 1]  # t0 and t1; the edge behind place 1 + m stands m places behind t1
            bits: list[int] = []
            for e in range(k - 1):
                ends += [begins[e] + 1, (begins[e] + 2) % n][:: 1 if sides[e] else -1]
                bits += [sides[e], *(int(begins[earlier] < begins[e]) for earlier in range(e))]
            key = sum(bit << position for position, bit in enumerate(bits))
            seen.add(key)
            assert table[key >> 6] >> (key & 63) & 1 == joined_in_one(n, old, ends)
    assert len(seen) == math.factorial(k - 1) * 2 ** (k - 1)


@given(st.integers(8, 30), SEEDS, METRICS)
def test_the_gain_of_every_move_is_true(n: int, seed: int, metric: str) -> None:
    instance, lengths = random_instance(n, seed, metric)
    tour = tour_with_buffers(np.random.default_rng(seed).permutation(n).astype(np.int32), log=LOG)
    breadth = breadth_for(instance)
    with plain_python():
        for v in range(n):
            cost = tour_cost(instance.cost, tour.node)
            arrays = (tour.node, tour.place, tour.move, tour.gain)
            k = find_move(instance.cost, *arrays, instance.candidates, lengths, breadth, v)
            if k:
                assert tour.gain[0] > 0
                assert make_move(tour, k)
                assert tour_cost(instance.cost, tour.node) == pytest.approx(cost - tour.gain[0])
                assert sorted(tour.node.tolist()) == list(range(n))


@given(st.integers(8, 60), SEEDS, METRICS)
def test_kicks_never_make_a_tour_longer_and_count_their_gains_right(n: int, seed: int, metric: str) -> None:
    instance, lengths = random_instance(n, seed, metric)
    tour = tour_with_buffers(np.random.default_rng(seed).permutation(n).astype(np.int32), log=LOG)
    arrays = (tour, instance.candidates, lengths, breadth_for(instance))
    words = np.array([seed + 1], dtype=np.uint64)
    first = tour_cost(instance.cost, tour.node)
    gained = improve_queued(instance.cost, *arrays, 10**6)
    optimum = tour_cost(instance.cost, tour.node)
    assert optimum == pytest.approx(first - gained)
    more = kick_and_repair(instance.cost, *arrays, words, 0, 30)
    assert more >= -1e-9  # sums of gains, some of them nothing but rounding
    assert tour_cost(instance.cost, tour.node) == pytest.approx(optimum - more)
    assert sorted(tour.node.tolist()) == list(range(n))
    assert np.array_equal(tour.node[tour.place], np.arange(n))


@given(st.integers(8, 60), SEEDS)
def test_an_undone_kick_leaves_no_trace(n: int, seed: int) -> None:
    instance, _ = random_instance(n, seed)
    tour = tour_with_buffers(np.random.default_rng(seed).permutation(n).astype(np.int32), log=LOG)
    before, place = tour.node.copy(), tour.place.copy()
    cost = tour_cost(instance.cost, before)
    with plain_python():
        worse = segment_kick(instance.cost, tour, np.array([seed + 1], dtype=np.uint64), 0)
        assert tour_cost(instance.cost, tour.node) == pytest.approx(cost + worse)
        undo_logged_changes(tour)
    assert np.array_equal(tour.node, before)
    assert np.array_equal(tour.place, place)


@given(st.integers(6, 40), SEEDS)
def test_a_tied_edge_survives_kicks(n: int, seed: int) -> None:
    instance, lengths = random_instance(n, seed, start=(0.0, 0.0), end=(9.0, 9.0))
    tour = tour_with_buffers(
        np.concatenate([[n + 1, n], np.random.default_rng(seed).permutation(n)]).astype(np.int32), log=LOG
    )
    arrays = (tour, instance.candidates, lengths, breadth_for(instance))
    improve_queued(instance.cost, *arrays, 10**6)
    kick_and_repair(instance.cost, *arrays, np.array([seed + 1], dtype=np.uint64), 0, 30)
    assert (n, n + 1) in edges(tour.node)


def test_a_full_log_stops_the_work_and_nothing_is_lost() -> None:
    """A log too small for any move: the move is not made, the tour stays, and the node stays in the queue."""
    instance, lengths = random_instance(40, 3)
    tour = tour_with_buffers(np.random.default_rng(3).permutation(40).astype(np.int32))
    tour = tour._replace(log=np.zeros((1, 2), dtype=np.int32))
    before = tour.node.copy()
    assert improve_queued(instance.cost, tour, instance.candidates, lengths, breadth_for(instance), 10**6) == 0.0
    assert np.array_equal(tour.node, before)
    assert tour.counts[3] == 1
    assert tour.counts[1] == 40


def test_a_move_too_long_for_the_buffer_waits_until_there_is_a_longer_one() -> None:
    instance, lengths = random_instance(300, 3)
    tour = tour_with_buffers(np.random.default_rng(3).permutation(300).astype(np.int32))
    rest = (instance.candidates, lengths, breadth_for(instance), 10**6)
    first = tour_cost(instance.cost, tour.node)
    some = improve_queued(instance.cost, tour._replace(buffer=tour.buffer[:20]), *rest)
    assert tour_cost(instance.cost, tour.node) == pytest.approx(first - some)
    waiting = int((tour.queued == WAITING).sum())
    assert waiting > 0
    assert tour.counts[1] == 0
    queue_waiting_nodes(tour)
    assert tour.counts[1] == waiting
    more = improve_queued(instance.cost, tour, *rest)
    assert more > 0
    assert tour_cost(instance.cost, tour.node) == pytest.approx(first - some - more)
    assert not tour.queued.any()


def first_move(
    instance: Instance, tour: list[int], breadth: list[int], ends: list[int], gain: float
) -> tuple[list[int], float] | None:
    """Return the ends and the gain of the first improving move that begins with `ends`, searched depth first.

    `gain` is that of the removed and the added edges so far.
    """
    n, last, depth = len(tour), ends[-1], len(ends) // 2
    at = {v: k for k, v in enumerate(tour)}
    if depth == len(breadth):
        return None
    removed = [set(pair) for pair in zip(ends[::2], ends[1::2], strict=True)]
    for c, length in list(zip(*(a[last].tolist() for a in instance.exchange_candidates), strict=True))[
        : breadth[depth]
    ]:
        if c < 0 or gain - length <= 1e-9:
            break
        beside = [tour[(at[c] + 1) % n], tour[at[c] - 1]]
        for d in beside if last not in beside else []:
            if {c, d} in removed:
                continue
            longer, opened = [*ends, c, d], gain - length + cost_of(instance, c, d)
            closed = opened - cost_of(instance, d, ends[0])
            if closed > 1e-9 and joined_in_one(n, edges(np.array(tour)), longer):
                return longer, closed
            deeper = first_move(instance, tour, breadth, longer, opened)
            if deeper is not None:
                return deeper
    return None


def cost_of(instance: Instance, a: int, b: int) -> float:
    """Return the cost of an edge."""
    return float(instance.costs(a, b)[0])


@pytest.mark.parametrize("ends", [{"closed": True}, {"start": (0.0, 0.0)}, {"start": (0.0, 0.0), "end": (9.0, 9.0)}])
@pytest.mark.parametrize("metric", ["EUC_2D", "linear"])
def test_the_first_improving_move_is_that_of_a_plain_search(metric: str, ends: dict[str, object]) -> None:
    """Tours with 2, 3, 4 and 5 edges left to exchange; from every node, forward and backward."""
    lengths = set()
    for seed, breadth in enumerate(
        ([0, 5, 3, 2, 1], [0, 8, 0, 0, 0], [0, 3, 2, 0, 0], [0, 2, 2, 2, 2], [0, 4, 3, 2, 0])
    ):
        instance, _ = random_instance(14, seed, metric, **ends)
        tour = tour_with_buffers(np.random.default_rng(seed).permutation(instance.n).astype(np.int32))
        improve_queued(instance.cost, tour, *instance.exchange_candidates, np.array([0, 8, 1, 0, 0]), 4 * seed)
        for v in range(instance.n):
            with plain_python():
                k = find_move(
                    instance.cost,
                    tour.node,
                    tour.place,
                    tour.move,
                    tour.gain,
                    *instance.exchange_candidates,
                    np.array(breadth, dtype=np.int64),
                    v,
                )
            lengths.add(k)
            order, at = tour.node.tolist(), int(tour.place[v])
            found = None
            for t1 in (order[(at + 1) % len(order)], order[at - 1]):
                found = found or first_move(instance, order, breadth, [v, t1], cost_of(instance, v, t1))
            if found is None:
                assert k == 0
            else:
                assert tour.move[ENDS, : 2 * k].tolist() == found[0]
                assert tour.gain[0] == pytest.approx(found[1])
    assert lengths == {0, 2, 3, 4, 5}
