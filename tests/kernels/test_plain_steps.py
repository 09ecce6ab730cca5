"""Random steps of the searches: the tours and paths of short plain implementations with the same random numbers."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from leafcut.kernels.annealing import BEST, PATH, anneal
from leafcut.kernels.firefly import invert_and_repair, make_random_inversions
from leafcut.kernels.lin_kernighan import ENDS, kick_and_repair, segment_kick
from leafcut.kernels.ordering import invert_runs
from leafcut.kernels.route import recompute_bias
from leafcut.kernels.sequential import kick, kick_route
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import FireflyOptions, SolveOptions
from leafcut.order.annealing import PathAnnealing
from leafcut.order.construction import random_states
from leafcut.order.directed import DirectedInstance, build_directed_instance, create_route
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import tour_with_buffers
from leafcut.order.literature.fireflies import PlaceFireflies
from leafcut.order.literature.flight import Flight
from leafcut.order.precedence import satisfies_pairs
from leafcut.order.stop import Stop
from plain_python import plain_python
from plain_random import Xorshift

#: No exchange is searched after a move.
NO_SEARCH = np.zeros(5, dtype=np.int64)


def words(seed: int) -> tuple[np.ndarray, Xorshift]:
    """Return a random state uint64[1] for a kernel, and the generator in the same state."""
    state = seed * 2**40 + 12345
    return np.array([state], dtype=np.uint64), Xorshift(state)


def places(n: int, seed: int) -> Instance:
    """Return the instance of a closed tour of n places on a grid, so that equal costs occur."""
    xy = np.random.default_rng(seed).integers(0, 9, (n, 2)).astype(float)
    return build_instance(RoutingProblem.of_points(xy, Metric("MAN_2D"), closed=True), 6)


def length(instance: Instance, tour: list[int]) -> float:
    """Return the length of a closed tour, by hand."""
    xy = instance.cost.xy
    return float(sum(abs(xy[a] - xy[b]).sum() for a, b in itertools.pairwise([*tour, tour[0]])))


def inverted(tour: list[int], first: int, size: int, *, keep_run: bool) -> list[int]:
    """Return a closed tour with `size` places inverted from `first` on, or all others if these are fewer.

    With `keep_run`, the others are inverted also if they are as many.
    """
    h = len(tour)
    if 2 * size > h or (keep_run and 2 * size == h):
        first, size = first + size, h - size
    run = [(first + k) % h for k in range(size)]
    new = list(tour)
    for to, of in zip(run, reversed(run), strict=True):
        new[to] = tour[of]
    return new


def flown(costs: np.ndarray, tour: list[int], moves: int, longest: int, random: Xorshift) -> tuple[list[int], float]:
    """Return a tour after inversions of random runs, of which those are kept that do not lengthen it, and the gain."""
    h, gained = len(tour), 0.0
    for _ in range(moves):
        word = random.word()
        first, size = ((word >> 32) * h) >> 32, 2 + (((word & 0xFFFFFFFF) * (longest - 1)) >> 32)
        a, b, c, d = (tour[(first + k) % h] for k in (-1, 0, size - 1, size))
        gain = float(costs[a, b]) + float(costs[c, d]) - float(costs[a, c]) - float(costs[b, d])
        if gain >= 0.0:
            tour, gained = inverted(tour, first, size, keep_run=False), gained + gain
    return tour, gained


@pytest.mark.parametrize(("h", "longest"), [(9, 7), (16, 9), (16, 3), (7, 2)])
def test_flights_are_inversions_that_do_not_lengthen_the_tour(h: int, longest: int) -> None:
    half = np.random.default_rng(h).integers(0, 9, (h, h))
    costs = (half + half.T).astype(np.float32)
    tour = np.random.default_rng(h).permutation(h).astype(np.int32)
    state, random = words(h)
    place = np.argsort(tour).astype(np.int32)
    plain, gained = flown(costs, tour.tolist(), 400, longest, random)
    total = make_random_inversions(costs, tour, place, 400, longest, state, 0)
    assert tour.tolist() == plain
    assert place.tolist() == np.argsort(plain).tolist()
    assert total == gained > 0.0
    assert int(state[0]) == random.state


@pytest.mark.parametrize(("h", "longest"), [(12, 10), (13, 5), (20, 2)])
def test_two_inversions_that_nothing_mends_are_kept_unless_they_lengthen_the_tour(h: int, longest: int) -> None:
    instance = places(h, 1)
    tour = tour_with_buffers(np.random.default_rng(h).permutation(h).astype(np.int32), queued=False, log=1000)
    state, random = words(h)
    kept = 0
    for _ in range(60):
        before = tour.node.tolist()
        plain, centre = before, random.below(h)
        for _ in range(2):
            first = (centre + random.below(longest)) % h
            plain = inverted(plain, first, 2 + random.below(longest - 1), keep_run=True)
        gain = length(instance, before) - length(instance, plain)
        lists = instance.candidates, instance.lengths
        assert invert_and_repair(instance.cost, tour, *lists, NO_SEARCH, 1, longest, state, 0) == max(0.0, gain)
        assert tour.node.tolist() == (plain if gain >= 0.0 else before)
        assert tour.place.tolist() == np.argsort(tour.node).tolist()
        assert tour.counts[1] == 0
        kept += gain > 0.0
    assert kept > 2
    assert int(state[0]) == random.state


def test_a_swarm_flies_as_a_plain_implementation_of_the_paper_does() -> None:
    """Distance r = 10·A/h of A different edges; β = 20·exp(-0.015·r²) times h inversions of 2 to A nodes towards the
    most attractive of the brighter ones; after 27 % of the iterations of at most a quarter of the nodes.
    """
    instance, iterations = places(14, 5), 10
    h, flight = instance.n, Flight.from_options(FireflyOptions(n_fireflies=4, attractiveness=2.0), limited=True)
    options = SolveOptions(seed=3, local_search=False)
    swarm = PlaceFireflies(instance, flight, options, Stop(iterations=iterations), None, 1)
    costs = np.array([[length(instance, [a, b]) / 2.0 for b in range(h)] for a in range(h)])
    swarm.construct(0)
    tours = swarm.tours.tolist()
    for iteration in range(1, iterations):
        lengths = [length(instance, tour) for tour in tours]
        states, new = random_states(3, iteration, count=4), []
        for f, tour in enumerate(tours):
            edges = [{frozenset(e) for e in itertools.pairwise([*t, t[0]])} for t in tours]
            aims = []
            for j in range(4):
                if lengths[j] < lengths[f]:
                    away = len(edges[f] - edges[j])
                    beta = 2.0 * math.exp(-0.015 * (10.0 * away / h) ** 2)
                    aims.append((beta * lengths[f] / lengths[j], -j, beta, away))
            _, _, beta, away = max(aims, default=(0.0, 0, 2.0, h))
            longest = max(2, min(away if iteration / iterations < 0.27 else min(away, 4), h - 2))
            new.append(flown(costs, tour, max(1, round(beta * h)), longest, Xorshift(int(states[f])))[0])
        tours = new
        found, reported = swarm.construct(iteration)
        assert found.tolist() == tours
        assert reported.tolist() == [length(instance, tour) for tour in tours]


def cycle(tour: list[int]) -> list[int]:
    """Return a closed tour from its node 0 on, towards the smaller neighbour."""
    at = tour.index(0)
    turned = tour[at:] + tour[:at]
    return turned if turned[1] < turned[-1] else [0, *turned[:0:-1]]


def swapped(tour: list[int], random: Xorshift) -> tuple[list[int], set[int]]:
    """Return a tour with two adjacent pieces of random lengths swapped, and the nodes at the cuts."""
    n = len(tour)
    longest = min(50, (n - 2) // 2)
    p = random.below(n)
    one, two = 1 + random.below(longest), 1 + random.below(longest)
    turned = [tour[(p + 1 + k) % n] for k in range(n)]
    b, c, rest = turned[:one], turned[one : one + two], turned[one + two :]
    return [*c, *b, *rest], {b[0], b[-1], c[0], c[-1], rest[0], rest[-1]}


@pytest.mark.parametrize("n", [8, 9, 30, 130])
def test_a_kick_swaps_two_random_pieces_and_is_kept_unless_it_lengthens_the_tour(n: int) -> None:
    instance = places(n, 2)
    tour = tour_with_buffers(np.random.default_rng(n).permutation(n).astype(np.int32), queued=False, log=1000)
    lists, (state, random) = (instance.candidates, instance.lengths), words(n)
    kept = 0
    for _ in range(60):
        before = tour.node.tolist()
        plain, _ = swapped(before, random)
        gain = length(instance, before) - length(instance, plain)
        assert kick_and_repair(instance.cost, tour, *lists, NO_SEARCH, state, 0, 1) == max(0.0, gain)
        assert cycle(tour.node.tolist()) == cycle(plain if gain >= 0.0 else before)
        assert tour.counts[1] == 0
        kept += gain > 0.0
    assert kept > 2
    for _ in range(10):
        before = tour.node.tolist()
        plain, cuts = swapped(before, random)
        added = segment_kick(instance.cost, tour, state, 0)
        assert added == length(instance, plain) - length(instance, before)
        assert cycle(tour.node.tolist()) == cycle(plain)
        assert set(tour.move[ENDS, :6].tolist()) == cuts
        assert {v for v in range(n) if tour.queued[v]} >= cuts


def cuts(n: int, pairs: int, closed: bool, ways: int = 1, seed: int = 2) -> DirectedInstance:
    """Return n cuts, with some choices each, and some pairs of precedence."""
    rng = np.random.default_rng(seed)
    hidden = rng.permutation(n)
    precedence = [hidden[np.sort(rng.choice(n, 2, replace=False))] for _ in range(pairs)]
    problem = RoutingProblem(
        rng.uniform(0, 90, (ways * n, 2)),
        rng.uniform(0, 90, (ways * n, 2)),
        np.tile(np.arange(n, dtype=np.int32), ways),
        rng.uniform(0, 3, ways * n),
        precedence=np.array(precedence, dtype=np.int32).reshape(-1, 2),
        start=None if closed else (1.0, 2.0),
        closed=closed,
    )
    return build_directed_instance(problem, 6)


def allowed_order(instance: DirectedInstance, seed: int) -> np.ndarray:
    """Return a random path int32[n] that keeps the pairs: after the anchor, always a random unlocked cluster."""
    rng, m = np.random.default_rng(seed), instance.problem.n_clusters
    order: list[int] = []
    while len(order) < m:
        free = [v for v in range(m) if v not in order and all(a in order for a, b in instance.pairs if b == v)]
        order.append(int(rng.choice(free)))
    return np.array([m, *order] if instance.anchored else order, dtype=np.int32)


def swapped_pieces(instance: DirectedInstance, path: list[int], random: Xorshift) -> list[int]:
    """Return a path with two adjacent pieces swapped: up to 12 draws, the pieces ever shorter, until none is barred."""
    n, first = len(path), 0 if instance.anchored else -1
    for draw in range(12):
        longest = max(1, 50 >> (draw // 2))
        p = first + random.below(n - 2 - first)
        q = p + 1 + random.below(min(longest, n - 2 - p))
        r = q + 1 + random.below(min(longest, n - 1 - q))
        new = path[: p + 1] + path[q + 1 : r + 1] + path[p + 1 : q + 1] + path[r + 1 :]
        whole = p < 0 and r == n - 1  # the same ring
        if not whole and satisfies_pairs(instance.pairs, np.array([v for v in new if v < instance.problem.n_clusters])):
            return new
    return path


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize(("n", "pairs", "ways"), [(9, 0, 1), (9, 14, 1), (70, 6, 1), (12, 8, 2)])
def test_kicks_of_a_path_swap_pieces_or_switch_a_choice(n: int, pairs: int, ways: int, closed: bool) -> None:
    instance = cuts(n, pairs, closed, ways)
    rules, beyond = instance.rules, instance.rules.beyond[0]
    node = allowed_order(instance, 3)
    route, (state, random) = create_route(instance, node, instance.enter), words(n)
    path, enter, leave = node.tolist(), route.enter.copy(), route.leave.copy()
    before = instance.length(node, enter, leave)
    with plain_python():
        recompute_bias(instance.cost, route)
        for _ in range(40):
            added = kick(instance.cost, route, rules, state, 0, 2)
            for _ in range(2):
                if ways > 1 and random.uniform() < 0.3:
                    v = random.below(instance.n)
                    if v < n:
                        enter[v] = rules.way[rules.way_begin[v] + random.below(ways)]
                        leave[v] = enter[v] + beyond
                else:
                    path = swapped_pieces(instance, path, random)
            assert route.node.tolist() == path
            assert route.enter.tolist() == enter.tolist()
            assert route.leave.tolist() == leave.tolist()
            after = instance.length(np.array(path, dtype=np.int32), enter, leave)
            assert added == pytest.approx(after - before)
            before = after


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("heat", [0.0, 20.0])
def test_hot_kicks_of_a_path_are_kept_by_chance_and_cold_ones_unless_they_lengthen_it(
    heat: float, closed: bool
) -> None:
    """No exchange follows; from 1 to 3 kicks at a time if hot; accepted with probability exp(-added / heat)."""
    instance = cuts(10, 5, closed)
    node = allowed_order(instance, 4)
    route, (state, random) = create_route(instance, node, instance.enter, log=500), words(5)
    path, kept = node.tolist(), 0
    for _ in range(50):
        with plain_python():
            gained = kick_route(
                instance.cost, route, instance.rules, np.zeros(2, dtype=np.int64), 1e-7, heat, state, 0, 1
            )
        new = path
        for _ in range(1 + random.below(3) if heat > 0.0 else 1):
            new = swapped_pieces(instance, new, random)
        before, after = (
            instance.length(np.array(p, dtype=np.int32), instance.enter, instance.leave) for p in (path, new)
        )
        accepted = before - after >= (heat * math.log(1.0 - random.uniform()) if heat > 0.0 else -1e-7)
        assert gained == pytest.approx(before - after if accepted else 0.0)
        path = new if accepted else path
        assert route.node.tolist() == path
        kept += accepted and after > before + 1e-6
    assert (kept > 0) == (heat > 0.0)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize(("runs", "longest", "pairs"), [(1, 4, 0), (2, 9, 4), (2, 2, 12)])
def test_runs_of_an_order_are_inverted_at_random_places_where_no_pair_bars_it(
    runs: int, longest: int, pairs: int, closed: bool
) -> None:
    instance = cuts(10, pairs, closed)
    order, (state, random) = allowed_order(instance, 5), words(longest)
    layers, m, fixed = PathAnnealing(instance, state).layers, instance.n, int(instance.anchored)
    place, plain = np.argsort(order).astype(np.int32), order.tolist()
    inversions = 0
    for _ in range(60):
        with plain_python():
            invert_runs(layers, order, place, runs, longest, state, 0)
        near = fixed + random.below(m - fixed)
        for _ in range(runs):
            first = near + random.below(longest)
            if first > m - 2:
                first = fixed + random.below(m - 1 - fixed)
            last = min(m - 1, first + 1 + random.below(longest - 1))
            new = plain[:first] + plain[first : last + 1][::-1] + plain[last + 1 :]
            if satisfies_pairs(instance.pairs, np.array([v for v in new if v < 10])):
                plain, inversions = new, inversions + 1
        assert order.tolist() == plain
        assert place.tolist() == np.argsort(plain).tolist()
    assert inversions > 10


class PlainAnnealing:
    """Ruin and recreate of a path of clusters with one node each, written from the description."""

    def __init__(self, instance: DirectedInstance, ant: PathAnnealing, path: list[int], random: Xorshift) -> None:
        self.table, self.near = ant.layers.table, ant.layers.near.tolist()
        self.m, self.fixed, self.random = instance.n, int(instance.anchored), random
        self.path, self.best, self.least = path, path, math.inf
        self.cost = self.length(path)
        self.before: list[set[int]] = [set() for _ in range(self.m)]
        for _ in range(self.m):
            for a, b in instance.pairs.tolist():
                self.before[b] |= {a} | self.before[a]

    def length(self, path: list[int]) -> float:
        """Return the length of a ring."""
        return float(sum(self.table[a, b] for a, b in itertools.pairwise([*path, path[0]])))

    def removed(self) -> list[int]:
        """Return up to ten clusters: a piece of the path around a random one, then pieces around those near it."""
        out: list[int] = []

        def take(c: int, size: int) -> None:
            start = self.path.index(c) - self.random.below(size)
            for p in ((start + i) % self.m for i in range(size)):
                if self.path[p] not in out and p >= self.fixed and len(out) < self.m - 2:
                    out.append(self.path[p])

        target = 1 + self.random.below(10)
        centre = self.random.below(self.m)
        take(centre, 1 + self.random.below(min(6, target)))
        for c in self.near[centre]:
            if len(out) >= target:
                break
            if c not in out and self.random.uniform() >= 0.3:
                take(c, 1 + self.random.below(min(6, target - len(out))))
        return out

    def insert(self, trial: list[int], c: int) -> None:
        """Insert a cluster into the cheapest gap that precedence allows; each cheaper gap is skipped by chance."""
        first = max([self.fixed, *(1 + trial.index(v) for v in self.before[c] if v in trial)])
        last = min([len(trial), *(k for k, v in enumerate(trial) if c in self.before[v])])
        best, gap = math.inf, last
        for p in range(first, last + 1):
            x, y = trial[p - 1], trial[p % len(trial)]
            added = self.table[x, c] + self.table[c, y] - self.table[x, y]
            if added < best and self.random.uniform() >= 0.01:
                best, gap = added, p
        trial.insert(gap, c)

    def step(self, heat: float) -> None:
        """Remove, shuffle, insert, and accept a path longer by x with probability exp(-x / heat)."""
        out = self.removed()
        trial = [v for v in self.path if v not in out]
        for i in range(len(out) - 1, 0, -1):
            j = self.random.below(i + 1)
            out[i], out[j] = out[j], out[i]
        for c in out:
            self.insert(trial, c)
        length = self.length(trial)
        if length < self.cost - heat * math.log(1.0 - self.random.uniform()):
            self.path, self.cost = trial, length
            if length < self.least - 1e-9:
                self.best, self.least = trial, length


@pytest.mark.parametrize(("closed", "pairs", "heat"), [(False, 0, 5.0), (False, 30, 20.0), (True, 12, 0.0)])
def test_annealing_takes_the_steps_of_a_plain_implementation(closed: bool, pairs: int, heat: float) -> None:
    instance = cuts(45, pairs, closed)
    state, random = words(9)
    ant = PathAnnealing(instance, state)
    path = allowed_order(instance, 6)
    plain = PlainAnnealing(instance, ant, path.tolist(), random)
    ant.walk.path[:], ant.walk.costs[:] = path, math.inf
    for _ in range(6):
        with plain_python():
            left = anneal(ant.layers, ant.walk, state, 0, heat, 0.9, 10, 1e-9)
        for step in range(10):
            plain.step(heat * 0.9**step)
        heat *= 0.9**10
        assert left == pytest.approx(heat)
        assert ant.walk.path.tolist() == plain.path
        assert ant.walk.costs[PATH] == pytest.approx(plain.cost)
        assert ant.walk.best.tolist() == plain.best
        assert ant.walk.costs[BEST] == pytest.approx(plain.least)
    assert plain.least < plain.length(path.tolist())


def test_kicks_of_a_path_that_do_not_all_fit_in_the_log_are_undone() -> None:
    """Hot kicks are all accepted, up to three at a time; the log has space for ten nodes and the ends of two pieces."""
    instance = cuts(12, 0, closed=False)
    route, full, kept = create_route(instance, allowed_order(instance, 4), instance.enter, log=14), 0, 0
    state, _ = words(6)
    for _ in range(60):
        before = route.node.tolist()
        with plain_python():
            gained = kick_route(
                instance.cost, route, instance.rules, np.zeros(2, dtype=np.int64), 1e-7, 1e9, state, 0, 1
            )
        if route.counts[3] == 1:
            full += 1
            assert (gained, route.node.tolist()) == (0.0, before)
        kept += route.node.tolist() != before
        assert route.place.tolist() == np.argsort(route.node).tolist()
    assert min(full, kept) > 10
