"""Exchanges in directed paths: reported gains are true, precedence is kept, and undo is exact."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.kernels.route import BLOCK, Route, begin_bias, make_exchange, push, take_back
from leafcut.kernels.sequential import find_exchange, kick
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.solve.construction import random_words
from leafcut.solve.directed import DirectedInstance, build_directed
from leafcut.solve.instance import costs_of_edges
from leafcut.solve.precedence import keeps
from leafcut.solve.sequential import greedy_path, route_of

# Slow: compiles parts of kernels that no cache keeps. `tests/solve/test_sequential.py` checks the sums of all gains.
pytestmark = pytest.mark.slow

BREADTH = np.array([10, 10], dtype=np.int64)


def instance_of(kind: str, n: int, pairs: int, closed: bool, seed: int = 2) -> DirectedInstance:
    """Return n holes, cuts, or cuts with two choices each, and some pairs of precedence."""
    rng = np.random.default_rng(seed)
    ways = 2 if kind == "ways" else 1
    entry = rng.uniform(0, 90, (ways * n, 2))
    hidden = rng.permutation(n)
    return build_directed(
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
    route = route_of(instance, first.node, first.enter, log=50_000)
    begin_bias(instance.cost, route)
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
    assert keeps(instance.pairs, order)
    if instance.twisted:
        u, v = route.node[:-1], route.node[1:]
        back = costs_of_edges(instance.cost, route.leave[v], route.enter[u])
        there = costs_of_edges(instance.cost, route.leave[u], route.enter[v])
        sums = np.concatenate([[0.0], np.cumsum(back - there)])
        # Not by pytest.approx, which asks Python for each number: two thirds of the test's time.
        assert np.allclose(route.bias + route.shift[np.arange(n) >> BLOCK], sums, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize(
    "kind, n, pairs", [("holes", 200, 0), ("holes", 60, 20), ("cuts", 60, 0), ("cuts", 600, 90), ("ways", 70, 20)]
)
def test_the_gain_of_every_exchange_is_true_and_precedence_is_kept(kind: str, n: int, pairs: int, closed: bool) -> None:
    """Start from a path that many kicks made worse, so that each kind of exchange has a gain."""
    instance = instance_of(kind, n, pairs, closed)
    route, rules, words = started(instance), instance.rules, random_words(1, 0, count=1)
    for _ in range(5):
        route.counts[2] = 0
        kick(instance.cost, route, rules, words, 0, 40)
    kinds = set()
    for v in np.random.default_rng(1).permutation(instance.n):
        for s, lists in ((1, rules.onward), (-1, rules.backward)):
            gain = find_exchange(instance.cost, route, rules, lists, BREADTH, 1e-7, s, v)
            if gain > 0.0:
                before = cost_of(instance, route)
                kinds.add(tuple(route.move[3:].tolist()))
                route.counts[2] = 0
                assert make_exchange(instance.cost, route)
                assert before - cost_of(instance, route) == pytest.approx(gain, abs=1e-7)
                check(instance, route)
    assert (1, 0, 0) in kinds
    if kind == "holes" and not pairs:
        assert kinds >= {(1, 1, 0), (1, 0, 1), (0, 1, 1)}
        assert kinds & {(0, 1, 0), (0, 0, 1)}


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind, n, pairs", [("holes", 60, 20), ("cuts", 600, 90), ("ways", 70, 20)])
def test_kicks_and_exchanges_are_undone_exactly(kind: str, n: int, pairs: int, closed: bool) -> None:
    instance = instance_of(kind, n, pairs, closed)
    route, words = started(instance), random_words(1, 0, count=1)
    for _ in range(40):
        kept = [a.copy() for a in (route.node, route.place, route.enter, route.leave)]
        before = cost_of(instance, route)
        worse = kick(instance.cost, route, instance.rules, words, 0, 3)
        assert cost_of(instance, route) - before == pytest.approx(worse, abs=1e-7)
        check(instance, route)
        for v in range(0, instance.n, 7):
            if find_exchange(instance.cost, route, instance.rules, instance.rules.onward, BREADTH, 1e-7, 1, v) > 0.0:
                make_exchange(instance.cost, route)
        take_back(instance.cost, route, instance.rules)
        assert route.counts[2] == 0
        changed = zip(kept, (route.node, route.place, route.enter, route.leave), strict=True)
        assert all(np.array_equal(a, b) for a, b in changed)
        check(instance, route)


def test_an_exchange_that_does_not_fit_in_the_log_is_not_applied() -> None:
    instance = instance_of("holes", 60, 0, closed=True)
    first = greedy_path(instance)
    route = route_of(instance, first.node, first.enter, log=4)
    words, node = random_words(1, 0, count=1), first.node.copy()
    for _ in range(20):
        route.counts[2] = route.counts[3] = 0
        kick(instance.cost, route, instance.rules, words, 0, 1)
        take_back(instance.cost, route, instance.rules)
        assert np.array_equal(route.node, node)
    assert route.counts[3] == 1


def test_a_node_is_queued_once_and_the_queue_is_circular() -> None:
    instance = instance_of("holes", 8, 0, closed=True)
    route = started(instance)
    route.counts[0] = 6
    for v in (3, 5, 3, 1):
        push(route, v)
    assert route.counts[1] == 3
    assert [route.queue[k % 8] for k in (6, 7, 8)] == [3, 5, 1]
