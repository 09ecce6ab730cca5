"""Steps of ants: probabilities follow the equations, and a tour visits each node once."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.kernels.construct import (
    Decay,
    Unvisited,
    WeightedEdges,
    choose_next_candidate,
    construct_tour,
    nearest_neighbour_tour,
    random_unvisited,
)
from leafcut.kernels.random import random_below, random_uniform
from leafcut.model.problem import RoutingProblem
from leafcut.order.construction import allocate_unvisited_buffers
from leafcut.order.instance import Instance, build_instance
from plain_python import plain_python

#: No local decay of trails.
NONE = Decay(1.0, 0.0, 0.0)

ENDS = [None, (None, None), ((0.0, 0.0), None), ((0.0, 0.0), (9.0, 9.0))]


def words(seed: int = 5) -> np.ndarray:
    """Return the random state of an ant."""
    return np.array([seed * 2**40 + 12345], dtype=np.uint64)


def instance_of(ends: tuple[object, object] | None, n: int = 14, k: int = 4) -> Instance:
    """Return an instance of n random points; a closed tour if `ends` is None."""
    xy = np.random.default_rng(3).uniform(0, 9, (n, 2))
    given = {"closed": True} if ends is None else {"start": ends[0], "end": ends[1]}
    return build_instance(RoutingProblem.of_points(xy, **given), k)  # type: ignore[arg-type]


def test_random_numbers_are_those_of_the_paper() -> None:
    """Marsaglia's xorshift with 13, 7, 17 in whole numbers of Python; the upper 53 bits are the fraction."""
    state, word = words(), int(words()[0])
    with plain_python():
        for _ in range(200):
            for shift in (13, -7, 17):
                word ^= (word << shift if shift > 0 else word >> -shift) & (2**64 - 1)
            assert random_uniform(state, 0) == (word >> 11) / 2**53
            assert int(state[0]) == word
        counts = np.bincount([random_below(state, 0, 4) for _ in range(4000)], minlength=4)
    # Five standard deviations of a binomial with 4000 draws and a chance of a quarter are 137.
    assert (abs(counts - 1000) < 137).all()


@pytest.mark.parametrize("greedy", [0.0, 0.6, 1.0])
def test_an_ant_draws_edges_in_proportion_to_their_weights_or_takes_the_heaviest(greedy: float) -> None:
    """Equations 3.2 and 3.10 with weights 1, 5, 2, of which the second node is visited, and a list that ends early."""
    candidates = np.array([[3, 1, 2, 4, -1]], dtype=np.int32)
    weights, nearness = np.array([[1.0, 9.0, 5.0, 2.0, 99.0]]), np.full((1, 5), 7.0)
    visited = np.array([1, 1, 0, 0, 0], dtype=np.uint8)
    state, draws = words(), 2000
    with plain_python():
        taken = [
            choose_next_candidate(candidates, weights, nearness, visited, 0, greedy, state, 0) for _ in range(draws)
        ]
    counts = np.bincount(taken, minlength=5) / draws
    wanted = (1.0 - greedy) * np.array([1.0, 0.0, 5.0, 2.0, 0.0]) / 8.0 + greedy * np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    assert (abs(counts - wanted) <= 5.0 * np.sqrt(wanted * (1.0 - wanted) / draws) + 1e-12).all()


def test_where_no_edge_has_pheromone_nearness_decides_and_all_visited_is_no_edge() -> None:
    candidates = np.array([[0, 1, 2, -1]], dtype=np.int32)
    nearness, none = np.array([[1.0, 3.0, 6.0, 9.0]]), np.zeros((1, 4))
    visited = np.array([0, 0, 1], dtype=np.uint8)
    with plain_python():
        assert choose_next_candidate(candidates, none, nearness, visited, 0, 1.0, words(), 0) == 1
        state = words()
        taken = [choose_next_candidate(candidates, none, nearness, visited, 0, 0.0, state, 0) for _ in range(1000)]
        assert choose_next_candidate(candidates, none, nearness, np.ones(3, dtype=np.uint8), 0, 0.0, words(), 0) == -1
    assert set(taken) == {0, 1}
    assert abs(taken.count(1) - 750) < 5 * np.sqrt(1000 * 0.75 * 0.25)


def test_a_random_unvisited_node_is_any_of_them() -> None:
    visited = np.array([1, 0, 1, 1, 0], dtype=np.uint8)
    state = words()
    with plain_python():
        taken = [random_unvisited(visited, state, 0) for _ in range(1000)]
    # From 0 and 1 on to 1, from 2, 3 and 4 on to 4.
    assert set(taken) == {1, 4}
    assert abs(taken.count(1) - 400) < 5 * np.sqrt(1000 * 0.4 * 0.6)


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("decays", [False, True])
def test_a_tour_of_an_ant_is_whole_and_wears_off_its_own_edges(
    ends: tuple[object, object] | None, decays: bool
) -> None:
    instance = instance_of(ends)
    n, shape = instance.n, instance.candidates.shape
    rng = np.random.default_rng(1)
    nearness, tau = rng.uniform(1, 2, shape), rng.uniform(1, 2, shape)
    tau_before = tau.copy()
    weights = tau**2.0 * nearness
    tour, state, starts = np.zeros(n, dtype=np.int32), words(), set()
    with plain_python():
        for _ in range(6):
            tau[:], weights[:] = tau_before, tau_before**2.0 * nearness
            rest = (
                0.1,
                instance.first,
                instance.second,
                state,
                0,
                tour,
                Unvisited(*allocate_unvisited_buffers(instance)),
            )
            edges = WeightedEdges(instance.candidates, tau, nearness, weights)
            construct_tour(instance.cost, instance.tree, edges, Decay(2.0, 0.25 if decays else 0.0, 0.5), *rest)
            assert sorted(tour.tolist()) == list(range(n))
            starts.add(int(tour[0]))
            if instance.first >= 0:
                assert tour[0] == instance.first
            if instance.second >= 0:
                assert tour[1] == instance.second
            # Edges chosen by the ant: all except the edge between given first nodes, and the closing edge.
            given = 1 + (instance.first >= 0 and instance.second >= 0)
            taken = {frozenset((int(a), int(b))) for a, b in zip(tour[given - 1 : -1], tour[given:], strict=True)}
            for i in range(n):
                for c, j in enumerate(instance.candidates[i].tolist()):
                    worn = decays and frozenset((i, j)) in taken
                    wanted = 0.75 * tau_before[i, c] + 0.25 * 0.5 if worn else tau_before[i, c]
                    assert tau[i, c] == pytest.approx(wanted)
                    assert weights[i, c] == pytest.approx(wanted**2.0 * nearness[i, c])
    assert len(starts) > 1 or instance.first >= 0


@pytest.mark.parametrize("greedy", [0.0, 1.0])
def test_an_ant_follows_overwhelming_trails_and_goes_to_the_nearest_where_its_list_is_visited(greedy: float) -> None:
    """Trails along a ring are followed all around; with lists that contain only visited nodes, the result is the
    nearest-neighbour tour.
    """
    instance = instance_of(None)
    n = instance.n
    ring = np.random.default_rng(4).permutation(n)
    candidates, weights = np.zeros((n, 2), dtype=np.int32), np.full((n, 2), 1e-12)
    for a, b, c in zip(ring, np.roll(ring, -1), np.roll(ring, -2), strict=True):
        candidates[a], weights[a] = (c, b), (1e-12, 1.0)
    tour, unvisited = np.zeros(n, dtype=np.int32), Unvisited(*allocate_unvisited_buffers(instance))
    rest = (instance.cost, instance.tree)

    def trails(lists: np.ndarray) -> WeightedEdges:
        return WeightedEdges(lists, weights, weights, weights)

    with plain_python():
        construct_tour(*rest, trails(candidates), NONE, greedy, -1, -1, words(), 0, tour, unvisited)
        assert np.roll(ring, -int(np.flatnonzero(ring == tour[0])[0])).tolist() == tour.tolist()
        first = int(tour[0])
        own = np.full((n, 1), first, dtype=np.int32)
        construct_tour(*rest, trails(own), NONE, greedy, first, -1, words(), 0, tour, unvisited)
        nearest = np.zeros(n, dtype=np.int32)
        nearest_neighbour_tour(*rest, first, -1, words(), nearest, unvisited)
    assert tour.tolist() == nearest.tolist()
    at, left, places = first, set(range(n)) - {first}, instance.cost.xy
    for node in tour[1:].tolist():
        assert node == min(left, key=lambda j: np.hypot(*(places[at] - places[j])))
        left.remove(node)
        at = node
