"""Exchanges in directed paths: reported gains are true, precedence is kept, and undo is exact."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from leafcut.kernels.lin_kernighan import pop_from_queue, push_to_queue
from leafcut.kernels.route import (
    BLOCK,
    Route,
    keeps_precedence,
    make_exchange,
    recompute_bias,
    switch_option,
    switch_to_best_option,
    undo_exchanges,
)
from leafcut.kernels.sequential import find_exchange, kick
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.construction import random_states
from leafcut.order.directed import DirectedInstance, build_directed_instance, create_route, greedy_path
from leafcut.order.instance import costs_of_edges
from leafcut.order.precedence import satisfies_pairs
from plain_python import plain_python

#: Small cases in plain Python; the slow ones compile parts of kernels that no cache keeps.
EXCHANGES = [("holes", 30, 0), ("holes", 20, 8), ("cuts", 24, 0), ("cuts", 270, 20), ("ways", 14, 4)]
SLOW_EXCHANGES = [("holes", 200, 0), ("holes", 60, 20), ("cuts", 60, 0), ("cuts", 600, 90), ("ways", 70, 20)]
KICKS = [("holes", 20, 8), ("cuts", 270, 20), ("ways", 14, 4)]
SLOW_KICKS = [("holes", 60, 20), ("cuts", 600, 90), ("ways", 70, 20)]

BREADTH = np.array([10, 10], dtype=np.int64)

#: Whether an exchange swaps its pieces, reverses B, and reverses C.
EXCHANGE_KINDS = [kind for kind in itertools.product((False, True), repeat=3) if any(kind)]


def instance_of(kind: str, n: int, pairs: int, closed: bool, seed: int = 2) -> DirectedInstance:
    """Return n holes, cuts, or cuts with two choices each, and some pairs of precedence."""
    rng = np.random.default_rng(seed)
    ways = 2 if kind == "ways" else 1
    entry = rng.uniform(0, 90, (ways * n, 2))
    hidden = rng.permutation(n)
    return build_directed_instance(
        RoutingProblem(
            entry,
            entry if kind == "holes" else rng.uniform(0, 90, (ways * n, 2)),
            np.tile(np.arange(n, dtype=np.int32), ways),
            rng.uniform(0, 3, ways * n),
            Metric("linear", (4.0, 3.0), (9.0, 7.0)),
            np.array([hidden[np.sort(rng.choice(n, 2, replace=False))] for _ in range(pairs)], np.int32).reshape(-1, 2),
            start=None if closed else (1.0, 2.0),
            closed=closed,
        ),
        10,
    )


def started(instance: DirectedInstance) -> Route:
    """Return the greedy path of an instance with an empty log and its sums."""
    first = greedy_path(instance)
    route = create_route(instance, first.node, first.enter, log=50_000)
    recompute_bias(instance.cost, route)
    return route


def cost_of(instance: DirectedInstance, route: Route) -> float:
    """Return the cost of the path by adding its arcs."""
    return instance.length(route.node, route.enter, route.leave)


def check(instance: DirectedInstance, route: Route) -> None:
    """Check that the path is complete, that it keeps the pairs, and that its sums are true."""
    n = instance.n
    assert sorted(route.node.tolist()) == list(range(n))
    assert np.array_equal(route.place[route.node], np.arange(n))
    order = route.node[route.node < instance.problem.n_clusters]
    assert satisfies_pairs(instance.pairs, order)
    if instance.twisted:
        u, v = route.node[:-1], route.node[1:]
        back = costs_of_edges(instance.cost, route.leave[v], route.enter[u])
        there = costs_of_edges(instance.cost, route.leave[u], route.enter[v])
        sums = np.concatenate([[0.0], np.cumsum(back - there)])
        # Not by pytest.approx, which asks Python for each number: two thirds of the test's time.
        assert np.allclose(route.bias + route.shift[np.arange(n) >> BLOCK], sums, rtol=0.0, atol=1e-8)


def check_exchanges(instance: DirectedInstance, nodes: list[int]) -> set[tuple[int, ...]]:
    """Make the exchanges at some nodes, check each, and return their kinds: swapped, B reversed, C reversed.

    The path was made worse by many kicks, so that each kind of exchange has a gain.
    """
    route, rules, words = started(instance), instance.rules, random_states(1, 0, count=1)
    for _ in range(5):
        route.counts[2] = 0
        kick(instance.cost, route, rules, words, 0, 40)
    kinds = set()
    for v in nodes:
        for s, lists in ((1, rules.onward), (-1, rules.backward)):
            gain = find_exchange(instance.cost, route, rules, lists, BREADTH, 1e-7, s, v)
            if gain > 0.0:
                before, follower = cost_of(instance, route), neighbour_of(route, v, s)
                kinds.add(tuple(route.move[3:].tolist()))
                route.counts[2] = 0
                assert make_exchange(instance.cost, route)
                assert before - cost_of(instance, route) == pytest.approx(gain, abs=1e-7)
                assert neighbour_of(route, v, s) != follower
                check(instance, route)
    return kinds


def neighbour_of(route: Route, v: int, s: int) -> int:
    """Return the node before (s = -1) or after (s = 1) node v on the path, taken as a circle."""
    return int(route.node[(route.place[v] + s) % len(route.node)])


def check_kinds(kinds: set[tuple[int, ...]], kind: str, pairs: int) -> None:
    """Check that exchanges of all kinds were made: A C B D always, the others where nothing forbids them."""
    assert (1, 0, 0) in kinds
    if kind == "holes" and not pairs:
        assert kinds >= {(1, 1, 0), (1, 0, 1), (0, 1, 1)}
        assert kinds & {(0, 1, 0), (0, 0, 1)}


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind, n, pairs", EXCHANGES)
def test_the_gain_of_an_exchange_is_true_and_precedence_is_kept(kind: str, n: int, pairs: int, closed: bool) -> None:
    kinds = set()
    for seed in range(8 if kind == "holes" else 1):
        with plain_python():
            instance = instance_of(kind, n, pairs, closed, seed)
            nodes = np.random.default_rng(1).permutation(instance.n)[:40].tolist()
            kinds |= check_exchanges(instance, nodes)
    check_kinds(kinds, kind, pairs)


@pytest.mark.slow
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind, n, pairs", SLOW_EXCHANGES)
def test_compiled_exchanges_have_true_gains_and_keep_precedence(kind: str, n: int, pairs: int, closed: bool) -> None:
    instance = instance_of(kind, n, pairs, closed)
    check_kinds(check_exchanges(instance, np.random.default_rng(1).permutation(instance.n).tolist()), kind, pairs)


def check_undo(instance: DirectedInstance, rounds: int) -> None:
    """Kick, check the cost of the kicks, make some exchanges, take all back, and check that no trace is left."""
    route, words = started(instance), random_states(1, 0, count=1)
    for _ in range(rounds):
        kept = [a.copy() for a in (route.node, route.place, route.enter, route.leave)]
        before = cost_of(instance, route)
        worse = kick(instance.cost, route, instance.rules, words, 0, 3)
        assert cost_of(instance, route) - before == pytest.approx(worse, abs=1e-7)
        check(instance, route)
        for v in range(0, instance.n, 7):
            if find_exchange(instance.cost, route, instance.rules, instance.rules.onward, BREADTH, 1e-7, 1, v) > 0.0:
                make_exchange(instance.cost, route)
        undo_exchanges(instance.cost, route, instance.rules)
        assert route.counts[2] == 0
        changed = zip(kept, (route.node, route.place, route.enter, route.leave), strict=True)
        assert all(np.array_equal(a, b) for a, b in changed)
        check(instance, route)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind, n, pairs", KICKS)
def test_kicks_and_exchanges_are_undone_exactly(kind: str, n: int, pairs: int, closed: bool) -> None:
    with plain_python():
        instance = instance_of(kind, n, pairs, closed)
        check_undo(instance, 12 if n < 100 else 3)


@pytest.mark.slow
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind, n, pairs", SLOW_KICKS)
def test_compiled_kicks_and_exchanges_are_undone_exactly(kind: str, n: int, pairs: int, closed: bool) -> None:
    check_undo(instance_of(kind, n, pairs, closed), 40)


def test_an_exchange_that_does_not_fit_in_the_log_is_not_applied() -> None:
    instance = instance_of("holes", 20, 0, closed=True)
    first = greedy_path(instance)
    route = create_route(instance, first.node, first.enter, log=4)
    words, node = random_states(1, 0, count=1), first.node.copy()
    with plain_python():
        for _ in range(20):
            route.counts[2] = route.counts[3] = 0
            worse = kick(instance.cost, route, instance.rules, words, 0, 1)
            assert (route.counts[3] == 0) or (worse == 0.0 and np.array_equal(route.node, node))
            undo_exchanges(instance.cost, route, instance.rules)
            assert np.array_equal(route.node, node)
    assert route.counts[3] == 1


def test_a_way_that_does_not_fit_in_the_log_is_not_taken() -> None:
    instance = instance_of("ways", 8, 0, closed=True)
    first = greedy_path(instance)
    with plain_python():
        for log, fits in ((2, False), (3, True)):
            route = create_route(instance, first.node, first.enter, log=log)
            v = int(route.node[3])
            other = next(w for w in instance.rules.way[2 * v : 2 * v + 2].tolist() if w != route.enter[v])
            assert switch_option(instance.cost, route, instance.rules, v, other) == fits
            assert route.counts[3] == (not fits)
            assert (route.enter[v] == other) == fits
            # The node and its two neighbours may gain now.
            assert sorted(route.queue[: route.counts[1]].tolist()) == (sorted(route.node[2:5].tolist()) if fits else [])


@pytest.mark.parametrize("closed", [False, True])
def test_the_chosen_way_of_a_node_is_the_best_of_all_its_ways(closed: bool) -> None:
    """Every way is tried by hand: of the others none makes the path shorter."""
    instance = instance_of("ways", 12, 0, closed)
    rules, n = instance.rules, instance.problem.n_clusters
    route = started(instance)
    words, gains = random_states(1, 0, count=1), []
    with plain_python():
        kick(instance.cost, route, rules, words, 0, 40)
        for v in range(instance.n):
            before = cost_of(instance, route)
            gain = switch_to_best_option(instance.cost, route, rules, v, 1e-9)
            gains.append(gain)
            assert before - cost_of(instance, route) == pytest.approx(gain, abs=1e-9)
            check(instance, route)
            for row in rules.way[rules.way_begin[v] : rules.way_begin[v + 1]].tolist():
                enter, leave = route.enter.copy(), route.leave.copy()
                enter[v], leave[v] = row, row + rules.beyond[0]
                assert instance.length(route.node, enter, leave) >= cost_of(instance, route) - 1e-9
    assert max(gains[:n]) > 0.0
    assert min(gains) >= 0.0


@pytest.mark.parametrize("pairs", [1, 6, 15])
def test_order_is_kept_by_an_exchange_exactly_if_no_pair_is_reversed(pairs: int) -> None:
    """All exchanges of a path of 8 nodes: make each, and look at every pair."""
    instance = instance_of("holes", 8, pairs, closed=True)
    with plain_python():
        for p in range(-1, 6):
            for q in range(p + 1, 7):
                for r in range(q + 1, 8):
                    for kind in EXCHANGE_KINDS:
                        route = started(instance)
                        answer = keeps_precedence(route, instance.rules, p, q, r, *kind)
                        route.move[:] = (p, q, r, *kind)
                        assert make_exchange(instance.cost, route)
                        assert answer == satisfies_pairs(instance.pairs, route.node)


def test_an_exchange_puts_the_pieces_together_as_stated() -> None:
    """A = 0, 1; B = 2, 3, 4; C = 5, 6; D = 7: swapped or not, each piece reversed or not, and the cut nodes queued."""
    instance = instance_of("holes", 8, 0, closed=True)
    b, c = [2, 3, 4], [5, 6]
    with plain_python():
        for kind in EXCHANGE_KINDS:
            swapped, b_reversed, c_reversed = kind
            route = create_route(instance, np.arange(8, dtype=np.int32), instance.enter, log=100)
            route.move[:] = (1, 4, 6, *kind)
            assert make_exchange(instance.cost, route)
            pieces = [b[::-1] if b_reversed else b, c[::-1] if c_reversed else c]
            first, second = pieces[::-1] if swapped else pieces
            assert route.node.tolist() == [0, 1, *first, *second, 7]
            assert route.place[route.node].tolist() == list(range(8))
            at_cuts = {1, first[0], first[-1], second[0], second[-1], 7}
            assert set(route.queue[: route.counts[1]].tolist()) == at_cuts
            undo_exchanges(instance.cost, route, instance.rules)
            assert route.node.tolist() == list(range(8))


def test_a_node_is_queued_once_and_the_queue_is_circular() -> None:
    instance = instance_of("holes", 8, 0, closed=True)
    route = started(instance)
    route.counts[0] = 6
    with plain_python():
        for v in (3, 5, 3, 1):
            push_to_queue(route, v)
        assert route.counts[1] == 3
        assert [route.queue[k % 8] for k in (6, 7, 8)] == [3, 5, 1]
        assert [pop_from_queue(route) for _ in range(3)] == [3, 5, 1]
        assert route.counts[:2].tolist() == [1, 0]
        assert not route.queued.any()
        push_to_queue(route, 3)
        assert pop_from_queue(route) == 3
