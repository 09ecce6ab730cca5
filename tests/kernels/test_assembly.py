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
    assemble,
    fill_links,
    find_cycles,
    length_of_piece,
    piece_at,
    rewrite,
    sort_few,
    try_cycle,
    undo,
)
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import Tour
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.colony import assembly_for
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import BREADTH, choices, descend, work_tour
from leafcut.order.stop import Stop
from plain_python import plain_python

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
    tour, a = work_tour(one, queued=False), assembly_for(len(one))
    with plain_python():
        fill_links(a.links, one, 0)
        fill_links(a.links, two, 2)
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
    assemble(
        instance.cost, work_tour(one, queued=False), assembly_for(len(one)), instance.candidates, instance.lengths,
        choices(instance, BREADTH), mine, two[None], np.array([seed + 1], dtype=np.uint64), gains, 0, 1,
    )  # fmt: skip
    return mine[0], float(gains[0])


@given(st.integers(5, 60), SEEDS)
def test_the_cycles_alternate_and_contain_every_unshared_edge_once(n: int, seed: int) -> None:
    one, two = two_tours(n, seed)
    _, a = prepared(one, two)
    with plain_python():
        count = find_cycles(a, np.array([seed + 1], dtype=np.uint64), 0)
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
        for cycle in range(find_cycles(a, np.array([seed + 1], dtype=np.uint64), 0)):
            gain, entries = try_cycle(
                instance.cost, tour.node, tour.place, a, instance.candidates, instance.lengths, cycle
            )
            if gain > -np.inf:
                mine, place = tour.node.copy(), tour.place.copy()
                assert rewrite(tour, a, entries)
                assert sorted(tour.node.tolist()) == list(range(n))
                assert np.array_equal(tour.node[tour.place], np.arange(n))
                assert tour_cost(instance.cost, tour.node) == pytest.approx(tour_cost(instance.cost, one) - gain)
                assert edges(tour.node) == Counter(
                    tuple(sorted((v, int(w)))) for v in range(n) for w in a.links[v, :2] if v < w
                )
                tour.node[:], tour.place[:] = mine, place
            undo(a, entries)
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
    tour = work_tour(np.random.default_rng(seed).permutation(n).astype(np.int32))
    descend(instance, tour, BREADTH, Stop())
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
        sort_few(array, len(values))
    assert array.tolist() == [*sorted(values), -7, -8]


@given(st.sets(st.integers(0, 99), min_size=2), st.integers(0, 99))
def test_every_place_lies_in_the_piece_that_ends_at_the_next_cut(cuts: set[int], place: int) -> None:
    cut = np.array(sorted(cuts), dtype=np.int32)
    after = [k for k, c in enumerate(cut) if c >= place]
    with plain_python():
        assert piece_at(cut, len(cut), place) == (after[0] if after else 0)
        assert sum(length_of_piece(cut, len(cut), s, 100) for s in range(len(cut))) == 100
