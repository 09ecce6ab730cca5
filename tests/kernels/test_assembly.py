"""Edge assembly: cycles contain the edges that two tours do not share, gains are true, and undo is exact."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.assembly import (
    BEGIN,
    CYCLES,
    Assembly,
    apply_child,
    build_cycle_child,
    length_of_piece,
    piece_of_position,
    recombine_by_edge_assembly,
    shell_sort,
    split_into_ab_cycles,
    store_tour_links,
    undo_changes,
)
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import Tour
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.colony import allocate_assembly_buffers
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import BREADTH, improve_queued_nodes, search_breadth, tour_with_buffers
from leafcut.order.stop import Stop
from plain_python import plain_python
from plain_random import Xorshift

SEEDS = st.integers(0, 2**31)
METRICS = st.sampled_from(["euclidean", "linear", "dogleg", "EUC_2D"])
CLOSED: dict[str, object] = {"closed": True}


def instance_of(n: int, seed: int, metric: str = "euclidean", **ends: object) -> Instance:
    """Return an instance of n nodes on a coarse grid, so that ties and doubles occur."""
    xy = np.random.default_rng(seed).integers(0, 25, (n, 2)).astype(np.float64)
    return build_instance(RoutingProblem.of_points(xy, Metric(metric, (10.0, 20.0), (50.0, 40.0)), **ends), 8)


def edges(tour: np.ndarray) -> Counter:
    """Return the edges of a closed tour, each with its smaller node first."""
    return Counter(tuple(sorted((int(a), int(b)))) for a, b in zip(tour, np.roll(tour, -1), strict=True))


def prepared(one: np.ndarray, two: np.ndarray) -> tuple[Tour, Assembly]:
    """Return the work tour and the assembly of two tours."""
    tour, a = tour_with_buffers(one, queued=False), allocate_assembly_buffers(len(one))
    with plain_python():
        store_tour_links(a.links, one, 0)
        store_tour_links(a.links, two, 2)
    return tour, a


def two_tours(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two tours that share some edges: the second is the first with a few pieces turned round."""
    rng = np.random.default_rng(seed)
    one = rng.permutation(n).astype(np.int32)
    two = one.copy()
    for _ in range(rng.integers(1, 6)):
        i, j = sorted(rng.integers(0, n, 2))
        two[i:j] = two[i:j][::-1].copy()
    return one, two


def assembled(instance: Instance, one: np.ndarray, two: np.ndarray, seed: int) -> tuple[np.ndarray, float]:
    """Return the child of two tours and its reported gain."""
    mine, gains = one.copy()[None], np.zeros(1)
    recombine_by_edge_assembly(
        instance.cost,
        tour_with_buffers(one, queued=False),
        allocate_assembly_buffers(len(one)),
        instance.candidates,
        instance.lengths,
        search_breadth(instance, BREADTH),
        mine,
        two[None],
        np.array([seed + 1], dtype=np.uint64),
        gains,
        0,
        1,
    )
    return mine[0], float(gains[0])


@given(st.integers(5, 60), SEEDS)
def test_the_cycles_alternate_and_contain_every_unshared_edge_once(n: int, seed: int) -> None:
    one, two = two_tours(n, seed)
    _, a = prepared(one, two)
    with plain_python():
        count = split_into_ab_cycles(a, np.array([seed + 1], dtype=np.uint64), 0)
    taken: tuple[Counter, Counter] = (Counter(), Counter())
    for c in range(count):
        cycle = a.lists[CYCLES, a.lists[BEGIN, c] : a.lists[BEGIN, c + 1]].tolist()
        assert len(cycle) % 2 == 0
        for k, u in enumerate(cycle):
            taken[k % 2][tuple(sorted((u, cycle[(k + 1) % len(cycle)])))] += 1
    assert taken == (edges(one) - edges(two), edges(two) - edges(one))


@given(st.integers(8, 40), SEEDS, METRICS)
def test_the_gain_of_a_child_is_true_and_undo_restores_the_links(n: int, seed: int, metric: str) -> None:
    instance = instance_of(n, seed, metric, **CLOSED)
    one, two = two_tours(n, seed)
    tour, a = prepared(one, two)
    before = a.links.copy()
    with plain_python():
        for cycle in range(split_into_ab_cycles(a, np.array([seed + 1], dtype=np.uint64), 0)):
            gain, entries = build_cycle_child(
                instance.cost, tour.node, tour.place, a, instance.candidates, instance.lengths, cycle
            )
            if gain > -np.inf:
                mine, place = tour.node.copy(), tour.place.copy()
                assert apply_child(tour, a, entries)
                assert sorted(tour.node.tolist()) == list(range(n))
                assert np.array_equal(tour.node[tour.place], np.arange(n))
                assert tour_cost(instance.cost, tour.node) == pytest.approx(tour_cost(instance.cost, one) - gain)
                assert edges(tour.node) == Counter(
                    tuple(sorted((v, int(w)))) for v in range(n) for w in a.links[v, :2] if v < w
                )
                tour.node[:], tour.place[:] = mine, place
            undo_changes(a, entries)
            assert np.array_equal(a.links, before)


@given(st.integers(8, 80), SEEDS, METRICS)
def test_assembling_never_makes_a_tour_longer_and_counts_its_gain_right(n: int, seed: int, metric: str) -> None:
    instance = instance_of(n, seed, metric, **CLOSED)
    one, two = two_tours(n, seed)
    mine, gain = assembled(instance, one, two, seed)
    first = tour_cost(instance.cost, one)
    assert gain >= 0
    assert sorted(mine.tolist()) == list(range(n))
    assert tour_cost(instance.cost, mine) == pytest.approx(first - gain)


@given(st.integers(8, 60), SEEDS)
def test_a_tour_assembled_with_itself_stays_unchanged(n: int, seed: int) -> None:
    instance = instance_of(n, seed, **CLOSED)
    tour = tour_with_buffers(np.random.default_rng(seed).permutation(n).astype(np.int32))
    improve_queued_nodes(instance, tour, BREADTH, Stop())
    mine, gain = assembled(instance, tour.node, tour.node, seed)
    assert gain == 0
    assert np.array_equal(mine, tour.node)


@given(st.integers(6, 40), SEEDS)
def test_a_tied_edge_is_never_given_up(n: int, seed: int) -> None:
    instance = instance_of(n, seed, start=(0.0, 0.0), end=(9.0, 9.0))
    rng = np.random.default_rng(seed)
    mine, other = (np.concatenate([[n + 1, n], rng.permutation(n)]).astype(np.int32) for _ in range(2))
    child, _ = assembled(instance, mine, other, seed)
    assert edges(child)[(n, n + 1)] == 1


@given(st.lists(st.integers(-1000, 1000), max_size=200))
def test_only_the_first_values_are_sorted(values: list[int]) -> None:
    array = np.array([*values, -7, -8], dtype=np.int32)
    with plain_python():
        shell_sort(array, len(values))
    assert array.tolist() == [*sorted(values), -7, -8]


@given(st.sets(st.integers(0, 99), min_size=2), st.integers(0, 99))
def test_every_place_lies_in_the_piece_that_ends_at_the_next_cut(cuts: set[int], place: int) -> None:
    cut = np.array(sorted(cuts), dtype=np.int32)
    after = [k for k, c in enumerate(cut) if c >= place]
    with plain_python():
        assert piece_of_position(cut, len(cut), place) == (after[0] if after else 0)
        assert sum(length_of_piece(cut, len(cut), s, 100) for s in range(len(cut))) == 100


class PlainAssembly:
    """Edge assembly of two tours without a final local search, written from the description."""

    def __init__(self, instance: Instance, one: np.ndarray, two: np.ndarray, random: Xorshift) -> None:
        self.instance, self.random, self.gain, self.ties = instance, random, 0.0, False
        self.near = self.neighbours(one)
        self.cycles = self.alternating_cycles(self.near, self.neighbours(two))

    @staticmethod
    def neighbours(tour: np.ndarray) -> list[list[int]]:
        """Return the node before and the node after every node."""
        near: list[list[int]] = [[] for _ in tour]
        for before, v, after in zip(np.roll(tour, 1), tour, np.roll(tour, -1), strict=True):
            near[v] = [int(before), int(after)]
        return near

    def cost(self, u: int, v: int) -> float:
        """Return the cost of an edge."""
        return float(self.instance.costs(u, v)[0])

    def alternating_cycles(self, one: list[list[int]], two: list[list[int]]) -> list[list[int]]:
        """Return AB-cycles of a random walk: it alternates between unused edges of both tours, and a cycle ends where
        the walk has left a node by an edge of the same tour before.
        """
        unused = [
            [[w for w in a if w not in b] for a, b in zip(x, y, strict=True)] for x, y in ((one, two), (two, one))
        ]
        starts = [v for v, edges in enumerate(unused[0]) if edges]
        cycles: list[list[int]] = []
        walk: list[int] = []
        while True:
            if not walk:
                while starts:
                    i = self.random.below(len(starts))
                    starts[i], starts[-1] = starts[-1], starts[i]
                    if unused[0][starts[-1]]:
                        break
                    starts.pop()
                if not starts:
                    return cycles
                walk = [starts[-1]]
            kind, u = (len(walk) - 1) % 2, walk[-1]
            v = unused[kind][u].pop(self.random.below(2) if len(unused[kind][u]) == 2 else 0)
            unused[kind][v].remove(u)
            since = [k for k in range(len(walk)) if walk[k] == v and k % 2 == len(walk) % 2]
            if not since:
                walk.append(v)
                continue
            closed = walk[since[0] :]
            cycles.append(closed if since[0] % 2 == 0 else [*closed[1:], closed[0]])
            walk = walk[: since[0] + 1] if since[0] else []

    def relinked(self, near: list[list[int]], removed: list[tuple[int, int]], added: list[tuple[int, int]]) -> float:
        """Replace edges in `near`; return the gain."""
        for u, v in removed:
            near[u].remove(v)
            near[v].remove(u)
        for u, v in added:
            near[u].append(v)
            near[v].append(u)
        return sum(self.cost(*edge) for edge in removed) - sum(self.cost(*edge) for edge in added)

    def subtours(self, near: list[list[int]]) -> list[set[int]]:
        """Return the nodes of every cycle."""
        left, found = set(range(len(near))), []
        while left:
            subtour, reached = set(), [next(iter(left))]
            while reached:
                v = reached.pop()
                if v not in subtour:
                    subtour.add(v)
                    reached += near[v]
            found.append(subtour)
            left -= subtour
        return found

    def child(self, cycle: list[int]) -> tuple[float, list[list[int]]]:
        """Return the gain of a cycle, -inf if it has none of its own, and the neighbours of every node afterwards."""
        near = [list(w) for w in self.near]
        pairs = list(zip(cycle, [*cycle[1:], cycle[0]], strict=True))
        gain = self.relinked(near, pairs[::2], pairs[1::2])
        if gain <= 1e-9:
            return -np.inf, near
        while len(subtours := sorted(self.subtours(near), key=len)) > 1:
            small = subtours[0]
            self.ties |= len(subtours[1]) == len(small)
            joins = [
                (self.cost(u, v) + self.cost(w, x) - self.cost(u, w) - self.cost(v, x), (u, v, w, x))
                for u in small
                for v in near[u]
                for w in self.instance.candidates[u].tolist()
                if w >= 0 and w not in small
                for x in near[w]
            ]
            if not joins:
                return -np.inf, near
            added, (u, v, w, x) = max(joins)
            self.relinked(near, [(u, v), (w, x)], [(u, w), (v, x)])
            gain += added
        return gain, near

    def run(self) -> None:
        """Apply every cycle that gains, in random order; cycles whose edges are gone are left out."""
        order = list(range(len(self.cycles)))
        for c in range(len(order)):
            pick = c + self.random.below(len(order) - c)
            order[c], order[pick] = order[pick], order[c]
            cycle = self.cycles[order[c]]
            if all(v in self.near[u] for u, v in zip(cycle[::2], cycle[1::2], strict=True)):
                gain, near = self.child(cycle)
                if gain > 1e-9:
                    self.gain, self.near = self.gain + gain, near


def test_a_child_is_that_of_a_plain_implementation() -> None:
    """Random tours, whose cycles leave many subtours; where two are the smallest, either may be joined first."""
    compared, gained = 0, 0
    for seed in range(40):
        n = 12 + seed % 14
        rng = np.random.default_rng(seed)
        xy = rng.uniform(0, 25, (n, 2))
        instance = build_instance(RoutingProblem.of_points(xy, closed=True), 8)
        one = rng.permutation(n).astype(np.int32)
        two = rng.permutation(n).astype(np.int32) if seed % 2 else two_tours(n, seed)[1][one]
        plain = PlainAssembly(instance, one, two, Xorshift(seed + 1))
        mine, gains, state = one.copy()[None], np.zeros(1), np.array([seed + 1], dtype=np.uint64)
        recombine_by_edge_assembly(
            instance.cost,
            tour_with_buffers(one, queued=False),
            allocate_assembly_buffers(n),
            instance.candidates,
            instance.lengths,
            np.zeros(5, dtype=np.int64),
            mine,
            two[None],
            state,
            gains,
            0,
            1,
        )
        plain.run()
        if not plain.ties:
            compared, gained = compared + 1, gained + (plain.gain > 0.0)
            assert gains[0] == pytest.approx(plain.gain)
            assert edges(mine[0]) == Counter(tuple(sorted((v, w))) for v in range(n) for w in plain.near[v] if v < w)
            assert int(state[0]) == plain.random.state
    assert compared > 10
    assert gained > 10
