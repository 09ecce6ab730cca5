"""Orders of clusters: chances of steps, exact choice of nodes, and what is forgotten and found again."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from leafcut.kernels.annealing import (
    BEST,
    PATH,
    anneal,
    close_gaps,
    mark_nearby_positions,
    rechoose_marked_nodes,
    remove_pieces_around_neighbours,
    start_trial,
)
from leafcut.kernels.cluster_paths import Clusters, choose_nodes_between, closed_path_length
from leafcut.kernels.ordering import choose_next_cluster, choose_nodes_of_order, construct_order, may_invert
from leafcut.model.problem import RoutingProblem
from leafcut.order.annealing import PathAnnealing, build_clusters
from leafcut.order.directed import DirectedInstance, build_directed_instance
from plain_python import plain_python

M = 6
PAIRS = [(0, 3), (3, 5), (1, 2)]


def words(seed: int = 3) -> np.ndarray:
    """Return a random state."""
    return np.array([seed * 2**40 + 12345], dtype=np.uint64)


def instance_of(closed: bool, pairs: list[tuple[int, int]], m: int = M, seed: int = 1) -> DirectedInstance:
    """Return an instance of m cuts with one to three nodes each."""
    rng = np.random.default_rng(seed)
    cluster = np.repeat(np.arange(m, dtype=np.int32), rng.integers(1, 4, m))
    entry, leave = rng.uniform(0, 50, (2, len(cluster), 2))
    precedence = np.array(pairs, dtype=np.int32).reshape(-1, 2)
    return build_directed_instance(
        RoutingProblem(
            entry,
            leave,
            cluster,
            rng.uniform(0, 9, len(cluster)),
            precedence=precedence,
            closed=closed,
            start=None if closed else (1.0, 2.0),
        ),
        5,
    )


def ring_of(layers: Clusters, path: list[int]) -> float:
    """Return the length of a path taken as a ring, added up way by way."""
    return sum(layers.table[a, b] for a, b in zip(path, [*path[1:], path[0]], strict=True))


def test_a_step_is_drawn_in_proportion_to_its_weight_among_clusters_that_may_come_next() -> None:
    """Equation 3.2: weights 1, 2, 5 of three clusters that may come next; two others are heavier and may not."""
    missing = np.array([0, 1, 0, -1, 0], dtype=np.int32)
    weights, nearness = np.zeros((5, 5)), np.ones((5, 5))
    weights[3] = [1.0, 50.0, 2.0, 50.0, 5.0]
    state, draws = words(), 1500
    chances = np.array([1.0, 0.0, 2.0, 0.0, 5.0]) / 8.0
    with plain_python():
        for greedy, wanted in ((0.0, chances), (0.4, 0.6 * chances + 0.4 * np.eye(5)[4])):
            taken = [choose_next_cluster(weights, nearness, missing, 3, greedy, state, 0) for _ in range(draws)]
            counts = np.bincount(taken, minlength=5) / draws
            assert (abs(counts - wanted) <= 5.0 * np.sqrt(wanted * (1.0 - wanted) / draws) + 1e-12).all()
        # Without trails nearness decides; without a last cluster, or with infinite weights, all are equal.
        weights[3] = 0.0
        nearness[3] = [1.0, 50.0, 2.0, 50.0, 5.0]
        taken = [choose_next_cluster(weights, nearness, missing, 3, 0.0, state, 0) for _ in range(draws)]
        assert (abs(np.bincount(taken, minlength=5) / draws - chances) < 0.07).all()
        assert choose_next_cluster(weights, nearness, missing, 3, 1.0, state, 0) == 4
        nearness[3, 0] = math.inf
        for last in (-1, 3):
            taken = [choose_next_cluster(weights, nearness, missing, last, 0.5, state, 0) for _ in range(600)]
            counts = np.bincount(taken, minlength=5)
            assert counts[[1, 3]].tolist() == [0, 0]
            assert (abs(counts[[0, 2, 4]] - 200) < 5 * math.sqrt(600 * 2 / 9)).all()


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("rate", [0.0, 0.25])
def test_an_order_keeps_precedence_and_wears_off_the_steps_it_takes(closed: bool, rate: float) -> None:
    instance = instance_of(closed, PAIRS)
    m, layers = instance.n, build_clusters(instance)
    rng, state = np.random.default_rng(4), words()
    seen = set()
    with plain_python():
        for _ in range(40):
            tau, nearness = rng.uniform(1, 2, (2, m, m))
            before, weights = tau.copy(), tau**2.0 * nearness
            order, missing = np.zeros(m, dtype=np.int32), np.zeros(m, dtype=np.int32)
            construct_order(layers, tau, nearness, weights, 2.0, 0.2, rate, 0.5, state, 0, missing, order)
            assert sorted(order.tolist()) == list(range(m))
            assert closed or order[0] == m - 1
            place = np.argsort(order)
            assert all(place[a] < place[b] for a, b in PAIRS)
            steps = set(itertools.pairwise(order.tolist()))
            for a, b in itertools.product(range(m), repeat=2):
                wanted = 0.75 * before[a, b] + 0.125 if rate and (a, b) in steps else before[a, b]
                assert tau[a, b] == pytest.approx(wanted)
                assert weights[a, b] == pytest.approx(wanted**2.0 * nearness[a, b])
            seen.add(tuple(order.tolist()))
    assert len(seen) > 20


@pytest.mark.parametrize("closed", [False, True])
def test_the_nodes_of_an_order_are_the_best_of_all_choices(closed: bool) -> None:
    instance = instance_of(closed, [])
    m, layers = instance.n, build_clusters(instance)
    widest = int(np.diff(layers.begin).max())
    sums, links = np.zeros((2, widest)), np.zeros((m, widest), dtype=np.int32)
    path, trial = np.zeros((2, m), dtype=np.int32)
    with plain_python():
        for seed in range(4):
            order = np.random.default_rng(seed).permutation(m).astype(np.int32)
            choices = itertools.product(*(range(layers.begin[c], layers.begin[c + 1]) for c in order))
            best = min(ring_of(layers, list(nodes)) for nodes in choices)
            assert choose_nodes_of_order(layers, order, path, trial, sums, links) == pytest.approx(best)
            assert layers.owner[path].tolist() == order.tolist()
            assert ring_of(layers, path.tolist()) == pytest.approx(best)
            assert closed_path_length(layers, path) == pytest.approx(best)


def test_nodes_between_two_places_are_the_best_and_the_others_stay() -> None:
    """All stretches of a ring, also those that go on beyond its end."""
    instance = instance_of(True, [])
    m, layers = instance.n, build_clusters(instance)
    widest = int(np.diff(layers.begin).max())
    sums, links = np.zeros((2, widest)), np.zeros((m, widest), dtype=np.int32)
    with plain_python():
        for first, length in itertools.product(range(m), range(1, m)):
            path = layers.begin[np.random.default_rng(first).permutation(m)].astype(np.int32)
            free = [(first + k) % m for k in range(length)]
            choices = itertools.product(
                *(
                    range(layers.begin[layers.owner[v]], layers.begin[layers.owner[v] + 1]) if at in free else [int(v)]
                    for at, v in enumerate(path)
                )
            )
            best = min(ring_of(layers, list(nodes)) for nodes in choices)
            kept = path.copy()
            choose_nodes_between(
                layers,
                path,
                first - m if first + length > m else first,
                first + length - 1 - (m if first + length > m else 0),
                sums,
                links,
            )
            assert ring_of(layers, path.tolist()) == pytest.approx(best)
            assert layers.owner[path].tolist() == layers.owner[kept].tolist()
            assert all(path[at] == kept[at] for at in range(m) if at not in free)


def test_a_run_may_be_inverted_exactly_if_no_pair_is_in_it() -> None:
    layers = build_clusters(instance_of(True, PAIRS))
    after = {*PAIRS, (0, 5)}  # 0 before 3 before 5
    order = np.array([4, 0, 1, 3, 2, 5], dtype=np.int32)
    place = np.argsort(order).astype(np.int32)
    with plain_python():
        for first, last in itertools.combinations(range(M), 2):
            pairs = set(itertools.combinations(order[first : last + 1].tolist(), 2))
            assert may_invert(layers, order, place, first, last) == (not pairs & after)


@pytest.mark.parametrize("closed", [False, True])
def test_what_is_forgotten_leaves_gaps_whose_neighbours_are_marked(closed: bool) -> None:
    instance = instance_of(closed, PAIRS, m=14)
    ant, m, sizes = PathAnnealing(instance, words()), instance.n, set()
    layers, walk = ant.layers, ant.walk
    order = [*([m - 1] if instance.anchored else []), 0, 3, 1, 6, 5, 2, 4, *range(7, 14)]
    walk.path[:] = layers.begin[order]
    with plain_python():
        for _ in range(30):
            start_trial(layers, walk)
            assert walk.trial.tolist() == walk.path.tolist()
            assert not walk.dirty.any()
            out = remove_pieces_around_neighbours(layers, walk, ant.words, 0)
            gone = walk.out[:out].tolist()
            assert len(set(gone)) == out
            assert 1 <= out <= 10
            assert not instance.anchored or m - 1 not in gone
            sizes.add(out)
            have = close_gaps(layers, walk)
            left = [c for c in order if c not in gone]
            assert have == len(left) == m - out
            assert layers.owner[walk.trial[:have]].tolist() == left
            assert [int(walk.place[c]) for c in left] == list(range(have))
            assert all(walk.place[c] < 0 for c in gone)
            after = {c for c in left if order[order.index(c) - 1] in gone}
            before = {c for c in left if order[(order.index(c) + 1) % m] in gone}
            marked = {left[k] for k in range(have) if walk.dirty[k]}
            # At the start of a closed path, the cluster after the gap suffices.
            assert after <= marked <= after | before
            assert order[0] in gone or marked == after | before
    assert len(sizes) > 4


@pytest.mark.parametrize("marked", [[0], [5], [9], [2, 3], [0, 9], []])
def test_marks_spread_two_places_to_both_sides_round_the_ring(marked: list[int]) -> None:
    ant = PathAnnealing(instance_of(True, [], m=10), words())
    ant.walk.dirty[marked] = 1
    with plain_python():
        mark_nearby_positions(ant.walk)
    wanted = {(at + d) % 10 for at in marked for d in (-2, -1, 0, 1, 2)}
    assert set(np.flatnonzero(ant.walk.dirty).tolist()) == wanted


@pytest.mark.parametrize("marked", [[0], [1, 2], [4, 5], [0, 1, 5], [0, 5], [1, 3], []])
def test_nodes_at_marked_places_are_chosen_best_and_the_others_stay(marked: list[int]) -> None:
    ant = PathAnnealing(instance_of(True, []), words())
    layers, walk = ant.layers, ant.walk
    walk.trial[:] = layers.begin[[3, 1, 5, 0, 2, 4]]
    kept = walk.trial.copy()
    walk.dirty[:] = 0
    walk.dirty[marked] = 1
    choices = itertools.product(
        *(
            range(layers.begin[layers.owner[v]], layers.begin[layers.owner[v] + 1]) if at in marked else [int(v)]
            for at, v in enumerate(kept)
        )
    )
    with plain_python():
        rechoose_marked_nodes(layers, walk, ant.words, 0)
    assert ring_of(layers, walk.trial.tolist()) == pytest.approx(min(ring_of(layers, list(p)) for p in choices))
    assert all(walk.trial[at] == kept[at] for at in range(M) if at not in marked)


@pytest.mark.parametrize("heat", [0.0, 1e9])
def test_a_cold_ant_takes_shorter_paths_only_and_a_hot_one_nearly_all(heat: float) -> None:
    instance = instance_of(False, PAIRS, m=9)
    ant = PathAnnealing(instance, words())
    layers, walk, m = ant.layers, ant.walk, instance.n
    walk.path[:] = layers.begin[[m - 1, 0, 3, 1, 6, 5, 2, 4, 7, 8]]
    walk.costs[:] = math.inf
    lengths, bests = [closed_path_length.py_func(layers, walk.path)], [math.inf]
    with plain_python():
        for _ in range(40):
            assert anneal(layers, walk, ant.words, 0, heat, 0.5, 1, 1e-9) == heat * 0.5
            lengths.append(ring_of(layers, walk.path.tolist()))
            assert walk.costs[PATH] == pytest.approx(lengths[-1])
            place = np.argsort(layers.owner[walk.path])
            assert all(place[a] < place[b] for a, b in PAIRS)
            assert layers.owner[walk.path[0]] == m - 1
            bests.append(float(walk.costs[BEST]))
            if bests[-1] < math.inf:
                assert ring_of(layers, walk.best.tolist()) == pytest.approx(bests[-1])
    assert bests == sorted(bests, reverse=True)
    assert bests[-1] == pytest.approx(min(lengths[1:]))
    steps = [b - a for a, b in itertools.pairwise(lengths)]
    assert (max(steps) > 1.0) == (heat > 0.0)
    assert lengths[-1] < lengths[0]
