"""Searches find every gain of their neighbourhood: compared with trying all exchanges of small tours and paths."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from leafcut.kernels.lin_kernighan import ENDS, find_move, improve_queued
from leafcut.kernels.route import make_exchange, recompute_bias
from leafcut.kernels.sequential import find_exchange
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.directed import DirectedInstance, build_directed_instance, create_route
from leafcut.order.instance import Instance, build_instance, costs_of_edges
from leafcut.order.kicks import tour_with_buffers
from leafcut.order.precedence import satisfies_pairs
from plain_python import plain_python

#: Nodes of a tour, and its edges in the order of `all_tours`.
N = 8
PAIRS = list(itertools.combinations(range(N), 2))
INDEX = {frozenset(pair): index for index, pair in enumerate(PAIRS)}


@functools.cache
def all_tours() -> np.ndarray:
    """Return the edges of every tour of eight nodes, bool[tours, edges]."""
    tours = [(0, *rest) for rest in itertools.permutations(range(1, N)) if rest[0] < rest[-1]]
    contains = np.zeros((len(tours), len(PAIRS)), dtype=bool)
    for row, tour in enumerate(tours):
        contains[row, [INDEX[frozenset(edge)] for edge in itertools.pairwise((*tour, tour[0]))]] = True
    return contains


def is_sequential(removed: np.ndarray, added: np.ndarray) -> bool:
    """Return whether removed and added edges alternate on a single cycle without a repeated node."""
    follower = [{}, {}]
    for side, edges in enumerate((removed, added)):
        for a, b in (PAIRS[e] for e in np.flatnonzero(edges)):
            if a in follower[side] or b in follower[side]:
                return False
            follower[side].update({a: b, b: a})
    first = at = next(iter(follower[0]))
    steps = 0
    while steps == 0 or at != first:
        at, steps = follower[1][follower[0][at]], steps + 1
    return steps == removed.sum()


def costs_of(instance: Instance) -> np.ndarray:
    """Return the costs of all edges."""
    return np.array([float(instance.costs(a, b)[0]) for a, b in PAIRS])


def tour_problem(seed: int, kind: str) -> RoutingProblem:
    """Return a problem whose tour has eight nodes."""
    rng = np.random.default_rng(seed)
    ends = {"closed": {"closed": True}, "tied": {"start": (0.0, 0.0), "end": (20.0, 9.0)}, "free": {}}[kind]
    xy = rng.integers(0, 25, (N - {"closed": 0, "tied": 2, "free": 1}[kind], 2)).astype(float)
    metric = Metric(("euclidean", "linear", "manhattan")[seed % 3], (10.0, 20.0), (50.0, 40.0))
    return RoutingProblem.of_points(xy, metric, **ends)


@pytest.mark.parametrize("most", [2, 3, 4, 5])
@pytest.mark.parametrize("kind", ["closed", "tied", "free"])
def test_no_exchange_of_as_many_edges_as_are_tried_is_left(kind: str, most: int) -> None:
    """All other tours are compared with the result: those that a sequential exchange yields are no shorter."""
    contains = all_tours()
    for seed in range(12):
        instance = build_instance(tour_problem(seed, kind), 0)
        first = np.random.default_rng(seed).permutation(N).astype(np.int32)
        if instance.second >= 0:
            rest = np.setdiff1d(first, [instance.first, instance.second], assume_unique=True)
            first = np.array([instance.first, instance.second, *rest], dtype=np.int32)
        tour = tour_with_buffers(first)
        breadth = np.array([0] + [N] * (most - 1) + [0] * (5 - most), dtype=np.int64)
        breadth = np.minimum(breadth, instance.candidates.shape[1])
        before = instance.length(tour.node)
        gained = improve_queued(instance.cost, tour, instance.candidates, instance.lengths, breadth, 10**6)
        assert before - instance.length(tour.node) == pytest.approx(gained, abs=1e-9)
        own = np.zeros(len(PAIRS), dtype=bool)
        own[[INDEX[frozenset(e)] for e in itertools.pairwise([*tour.node.tolist(), int(tour.node[0])])]] = True
        costs = costs_of(instance)
        shorter = contains[contains @ costs < own @ costs - 1e-7]
        within = shorter[(own & ~shorter).sum(axis=1) <= most]
        assert not any(is_sequential(own & ~other, other & ~own) for other in within), (seed, tour.node)


def test_a_move_has_no_more_edges_than_are_tried_and_its_ends_are_edges_of_the_tour() -> None:
    found = set()
    with plain_python():
        for seed, most in itertools.product(range(6), (2, 3, 4, 5)):
            instance = build_instance(tour_problem(seed, "closed"), 0)
            tour = tour_with_buffers(np.random.default_rng(seed).permutation(N).astype(np.int32))
            breadth = np.array([0] + [N - 1] * (most - 1) + [0] * (5 - most), dtype=np.int64)
            for v in range(N):
                arrays = (tour.node, tour.place, tour.move, tour.gain)
                k = find_move(instance.cost, *arrays, instance.candidates, instance.lengths, breadth, v)
                found.add(k)
                ends = tour.move[ENDS, : 2 * k].tolist()
                assert k <= most
                assert all(
                    abs(tour.place[a] - tour.place[b]) in (1, N - 1) for a, b in zip(ends[::2], ends[1::2], strict=True)
                )
                joined = list(zip(ends[1::2], [*ends[2::2], *ends[:1]], strict=True))
                gain = sum(float(instance.costs(a, b)[0]) for a, b in zip(ends[::2], ends[1::2], strict=True))
                gain -= sum(float(instance.costs(a, b)[0]) for a, b in joined)
                assert k == 0 or tour.gain[0] == pytest.approx(gain)
    assert found >= {0, 2, 3}


def directed_problem(seed: int, pairs: int, closed: bool, n: int = 7) -> RoutingProblem:
    """Return n cuts with random ends and some pairs of precedence."""
    rng = np.random.default_rng(seed)
    hidden = rng.permutation(n)
    precedence = [hidden[np.sort(rng.choice(n, 2, replace=False))] for _ in range(pairs)]
    return RoutingProblem(
        rng.uniform(0, 90, (n, 2)),
        rng.uniform(0, 90, (n, 2)),
        np.arange(n, dtype=np.int32),
        np.zeros(n),
        Metric("linear", (4.0, 3.0), (9.0, 7.0)),
        np.array(precedence, dtype=np.int32).reshape(-1, 2),
        start=None if closed else (1.0, 2.0),
        end=None if closed else (80.0, 70.0),
        closed=closed,
    )


Exchange = tuple[list[list[int]], tuple[float, ...]]


def exchanges_from(path: list[int], x: int, way: np.ndarray) -> Iterator[Exchange]:
    """Yield the exchanges that give the node at place x another successor: the pieces of the new path, and the gains
    along the exchange before its last new edge.

    The path is a circle that starts at its first node; A, B, C and D are its pieces, ' means reversed.
    """
    n = len(path)

    def on(k: int) -> int:
        return path[(k + 1) % n]

    def cut(k: int) -> float:
        return float(way[path[k], on(k)])

    def pieces(p: int, q: int, r: int) -> tuple[list[int], list[int], list[int], list[int]]:
        return path[: p + 1], path[p + 1 : q + 1], path[q + 1 : r + 1], path[r + 1 :]

    for p, q, r in itertools.combinations(range(n), 3):
        a, b, c, d = pieces(p, q, r)
        if x in (p, q, r):
            first, second, third = {p: (p, q, r), q: (q, r, p), r: (r, p, q)}[x]
            one = cut(first) - way[path[first], on(second)]
            yield [a, c, b, d], (one, one + cut(second) - way[path[second], on(third)])
        if x == p:
            one = cut(p) - way[path[p], path[q + 1]]
            yield [a, c, b[::-1], d], (one, one + cut(q) - way[path[r], path[q]])
            one = cut(p) - way[path[p], path[r]]
            yield [a, c[::-1], b, d], (one, one + cut(r) - way[path[q], on(r)])
            if q > p + 1:
                one = cut(p) - way[path[p], path[q]]
                yield [a, b[::-1], c[::-1], d], (one, one + cut(q) - way[path[q + 1], on(r)])
    for q in range(x + 2, n):
        a, b, _, d = pieces(x, q, q)
        yield [a, b[::-1], d], (cut(x) - way[path[x], path[q]],)


def gains_of(instance: DirectedInstance, node: list[int], v: int, s: int, least: float) -> list[float]:
    """Return the gains of all allowed exchanges at node v in direction s, each gain along them more than `least`."""
    here = np.arange(instance.n, dtype=np.int32)
    way = np.array(
        [costs_of_edges(instance.cost, instance.leave[np.full(instance.n, a)], instance.enter) for a in here]
    )
    path, found = node if s > 0 else [node[0], *node[:0:-1]], []
    way = way if s > 0 else way.T

    def length(path: list[int]) -> float:
        return float(sum(way[a, b] for a, b in itertools.pairwise([*path, path[0]])))

    for pieces, along in exchanges_from(path, path.index(v), way):
        new = list(itertools.chain(*pieces))
        gain = length(path) - length(new)
        forward = new if s > 0 else [new[0], *new[:0:-1]]
        orders = [np.array([u for u in forward if u < instance.problem.n_clusters])]
        if not instance.anchored:
            # If no piece follows B on a ring, A C B and B A C are the same path in two orders.
            kept = len(pieces) == 4 and all(piece == sorted(piece, key=path.index) for piece in pieces)
            if kept and (not pieces[3] if s > 0 else len(pieces[0]) == 1):
                orders.append(np.roll(orders[0], len(pieces[2] if s > 0 else pieces[1])))
        if min(*along, gain) > least and any(satisfies_pairs(instance.pairs, order) for order in orders):
            found.append(gain)
    return found


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("pairs", [0, 1, 4])
def test_an_exchange_of_a_path_is_found_exactly_if_one_gains_all_along(closed: bool, pairs: int) -> None:
    """Random paths, all nodes, both directions: the search agrees with trying all exchanges of up to three edges."""
    outcomes = set()
    breadth = np.array([20, 20], dtype=np.int64)
    for seed in range(6):
        instance, rng = build_directed_instance(directed_problem(seed, pairs, closed), 6), np.random.default_rng(seed)
        order = rng.permutation(7)
        while not satisfies_pairs(instance.pairs, order):
            order = rng.permutation(7)
        node = np.concatenate([[7], order] if not closed else [order]).astype(np.int32)
        route = create_route(instance, node, instance.enter)
        recompute_bias(instance.cost, route)
        for v, (s, lists) in itertools.product(
            node.tolist(), ((1, instance.rules.onward), (-1, instance.rules.backward))
        ):
            least = float(rng.choice([1e-7, 3.0, 9.0]))
            expected = gains_of(instance, node.tolist(), v, s, least)
            with plain_python():
                gain = find_exchange(instance.cost, route, instance.rules, lists, breadth, least, s, v)
            outcomes.add(gain > 0.0)
            assert (gain > 0.0) == bool(expected), (seed, v, s)
            assert gain == 0.0 or any(gain == pytest.approx(g) for g in expected), (seed, v, s)
    assert outcomes == {True, False}


class PlainExchanges:
    """The first exchange along candidate lists, on lists of nodes, for paths whose nodes have one option."""

    def __init__(
        self, instance: DirectedInstance, node: list[int], s: int, breadth: tuple[int, int], most: int
    ) -> None:
        rules = instance.rules.onward if s > 0 else instance.rules.backward
        self.near, self.back = rules.near.tolist(), rules.back.tolist()
        self.instance, self.node, self.s, self.breadth, self.most = instance, node, s, breadth, most
        here = np.arange(instance.n, dtype=np.int32)
        way = np.array(
            [costs_of_edges(instance.cost, instance.leave[np.full_like(here, a)], instance.enter) for a in here]
        )
        self.forward, self.way = way, way if s > 0 else way.T
        self.path = node if s > 0 else [node[0], *node[:0:-1]]

    def length(self, node: list[int]) -> float:
        """Return the length of a path along the nodes."""
        return float(sum(self.forward[a, b] for a, b in itertools.pairwise([*node, node[0]])))

    def is_kept(self, node: list[int]) -> bool:
        """Return whether a path keeps the precedence."""
        return satisfies_pairs(self.instance.pairs, np.array([v for v in node if v < self.instance.problem.n_clusters]))

    def made(
        self, x: int, y: int, z: int, swapped: bool, b: bool, c: bool, least: float
    ) -> tuple[float, list[int]] | None:
        """Return the gain and the path of an exchange after the positions x < y <= z of this direction, if allowed."""
        n = len(self.node)
        p, q, r = (x, y, z) if self.s > 0 else (n - 1 - z, n - 1 - y, n - 1 - x)
        b, c = (b, c) if self.s > 0 else (c, b)
        cuts = [(p, q, r)]
        if swapped and not b and not c and r == n - 1 and not self.instance.anchored:
            cuts.append((-1, p, q))  # the same ring from another node on
        for first, second, third in cuts:
            one, two = self.node[first + 1 : second + 1], self.node[second + 1 : third + 1]
            one, two = one[::-1] if b else one, two[::-1] if c else two
            new = self.node[: first + 1] + (two + one if swapped else one + two) + self.node[third + 1 :]
            gain = self.length(self.node) - self.length(new)
            if gain > least and third - first <= self.most and self.is_kept(new):
                return gain, new
        return None

    def candidates(self, lists: list[list[int]], v: int, opened: float, least: float, k: int) -> Iterator[int]:
        """Yield the first candidates of a node, up to the first that leaves no gain."""
        for e in lists[v][: self.breadth[k]]:
            if e < 0 or opened - (self.way[v, e] if lists is self.near else self.way[e, v]) <= least:
                return
            yield e

    def tries(self, t0: int, least: float) -> Iterator[tuple[int, int, int, bool, bool, bool]]:
        """Yield the exchanges that give t0 another successor, in the order in which they are tried."""
        path, way, n = self.path, self.way, len(self.path)
        at = {v: k for k, v in enumerate(path)}
        x0, current = at[t0], way[t0, path[(at[t0] + 1) % n]]
        for c in self.candidates(self.near, t0, current, least, 0):
            if at[c] == (x0 + 1) % n:
                continue
            cut = (at[c] - 1) % n
            t3, opened = path[cut], current - way[t0, c] + way[path[cut], c]
            for e in self.candidates(self.near, t3, opened, least, 1):
                last = (at[e] - 1) % n
                if (last - x0) % n > (cut - x0) % n:
                    yield *sorted((x0, cut, last)), True, False, False  # A C B D
            for e in self.candidates(self.back, t3, opened, least, 1):
                if x0 < cut < at[e]:
                    yield x0, cut, at[e], True, True, False  # A C B' D
            if at[c] < x0:
                continue
            d, opened = path[(at[c] + 1) % n], current - way[t0, c] + way[c, path[(at[c] + 1) % n]]
            yield x0, at[c], at[c], False, True, False  # A B' D
            for e in self.candidates(self.back, d, opened, least, 1):
                if x0 < at[e] < at[c]:
                    yield x0, at[e], at[c], True, False, True  # A C' B D
            for f in self.candidates(self.near, d, opened, least, 1):
                last = (at[f] - 1) % n
                if at[d] > 0 and last > at[c]:
                    yield x0, at[c], last, False, True, True  # A B' C' D

    def first(self, t0: int, least: float) -> tuple[float, list[int]]:
        """Return the gain and the path of the first allowed exchange at t0; 0 and the same path if there is none."""
        found = (self.made(*exchange, least) for exchange in self.tries(t0, least))
        return next((one for one in found if one is not None), (0.0, self.node))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("pairs", [0, 3])
def test_the_first_exchange_is_that_of_a_plain_search(closed: bool, pairs: int) -> None:
    """Short lists, few candidates, and a buffer that is too short for some exchanges; all nodes, both directions."""
    made = 0
    for seed in range(8):
        instance, rng = (
            build_directed_instance(directed_problem(seed, pairs, closed, 12), 6),
            np.random.default_rng(seed),
        )
        order = rng.permutation(12)
        while not satisfies_pairs(instance.pairs, order):
            order = rng.permutation(12)
        node = np.concatenate([[12], order] if not closed else [order]).astype(np.int32)
        breadth, most = ((20, 20), (3, 2), (6, 1), (2, 4))[seed % 4], (99, 99, 6, 9)[seed % 4]
        for v, s in itertools.product(node.tolist(), (1, -1)):
            route = create_route(instance, node, instance.enter)
            route = route._replace(buffer=route.buffer[:most])
            recompute_bias(instance.cost, route)
            lists, least = instance.rules.onward if s > 0 else instance.rules.backward, float(rng.choice([1e-7, 2.0]))
            wanted, path = PlainExchanges(instance, node.tolist(), s, breadth, most).first(v, least)
            with plain_python():
                gain = find_exchange(
                    instance.cost, route, instance.rules, lists, np.array(breadth, dtype=np.int64), least, s, v
                )
                if gain > 0.0:
                    make_exchange(instance.cost, route)
            assert gain == pytest.approx(wanted, abs=1e-9)
            assert route.node.tolist() == path
            made += gain > 0.0
    assert made > 40
