"""Ants: the same tours, orders and trails as short plain implementations with the same random numbers."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.kernels.construct import Decay, WeightedEdges, construct_tour
from leafcut.kernels.ordering import construct_order
from leafcut.model.problem import RoutingProblem
from leafcut.order.annealing import build_clusters
from leafcut.order.construction import allocate_unvisited_buffers
from leafcut.order.directed import build_directed_instance
from leafcut.order.instance import build_instance
from plain_python import plain_python
from plain_random import Xorshift

ALPHA, INITIAL = 1.5, 0.2


def words(seed: int) -> tuple[np.ndarray, Xorshift]:
    """Return a random state uint64[2], of which the second is used, and the generator in the same state."""
    state = seed * 2**40 + 12345
    return np.array([1, state], dtype=np.uint64), Xorshift(state)


class PlainTrails:
    """Pheromone and nearness of moves between nodes, and the choice of an ant."""

    def __init__(self, tau: np.ndarray, eta: np.ndarray, rate: float, greedy: float, random: Xorshift) -> None:
        self.tau, self.eta, self.rate, self.greedy, self.random = tau, eta, rate, greedy, random
        self.weights = tau**ALPHA * eta

    def wear(self, a: int, b: int) -> None:
        """Move a trail towards its initial value (equation 3.12)."""
        self.tau[a, b] = (1.0 - self.rate) * self.tau[a, b] + self.rate * INITIAL
        self.weights[a, b] = self.tau[a, b] ** ALPHA * self.eta[a, b]

    def drawn(self, here: int, options: list[int], always: bool) -> int:
        """Return the heaviest option with the probability of greed, otherwise one in proportion to its weight
        (equation 3.10). With `always`, greed is drawn even if it is 0.
        """
        if (self.greedy > 0.0 or always) and self.random.uniform() < self.greedy:
            return max(options, key=lambda j: self.weights[here, j])
        rest = self.random.uniform() * sum(self.weights[here, j] for j in options)
        for j in options:
            rest -= self.weights[here, j]
            if rest <= 0.0:
                return j
        raise AssertionError


@pytest.mark.parametrize(("rate", "greedy"), [(0.0, 0.0), (0.0, 0.5), (0.3, 0.2)])
@pytest.mark.parametrize(
    "ends", [{"closed": True}, {}, {"start": (1.0, 2.0)}, {"start": (1.0, 2.0), "end": (9.0, 8.0)}]
)
def test_an_ant_builds_the_tour_of_a_plain_implementation(ends: dict, rate: float, greedy: float) -> None:
    """Trails of candidate edges; where all candidates are visited the ant goes to the nearest node."""
    rng, m = np.random.default_rng(4), 30
    instance = build_instance(RoutingProblem.of_points(rng.uniform(0, 50, (m, 2)), **ends), 5)
    n, lists, free = instance.n, instance.candidates, instance.cost.free
    tau, eta = rng.uniform(0.1, 1.0, (n, n)), rng.uniform(0.5, 2.0, (n, n))
    state, random = words(7)
    plain = PlainTrails(tau, eta, rate, greedy, random)
    pheromone, nearness, weights = (
        np.take_along_axis(table, np.maximum(lists, 0), axis=1).copy() for table in (plain.tau, eta, plain.weights)
    )
    edges, decay = WeightedEdges(lists, pheromone, nearness, weights), Decay(ALPHA, rate, INITIAL)
    tour, beyond = np.zeros(n, dtype=np.int32), 0
    for _ in range(5):
        with plain_python():
            construct_tour(
                instance.cost,
                instance.tree,
                edges,
                decay,
                greedy,
                instance.first,
                instance.second,
                state,
                1,
                tour,
                allocate_unvisited_buffers(instance),
            )
        path = [v for v in (instance.first, instance.second) if v >= 0]
        path = path or [random.below(n)]
        while len(path) < n:
            here, left = path[-1], [v for v in range(n) if v not in path]
            options = [v for v in lists[here].tolist() if v in left]
            if here == free:
                v = random.below(n)
                while v in path:
                    v = (v + 1) % n
            elif options:
                v = plain.drawn(here, options, always=False)
            else:
                beyond += 1
                far = np.hypot(*(instance.cost.xy - instance.cost.xy[here]).T)
                v = min((v for v in left if v != free), key=lambda v: far[v])
            if rate > 0.0:
                for a, b in ((here, v), (v, here)):
                    if b in lists[a].tolist():
                        plain.wear(a, b)
            path.append(v)
        assert tour.tolist() == path
    assert beyond > 3
    listed = lists >= 0
    assert pheromone[listed] == pytest.approx(np.take_along_axis(plain.tau, np.maximum(lists, 0), axis=1)[listed])
    assert weights[listed] == pytest.approx(np.take_along_axis(plain.weights, np.maximum(lists, 0), axis=1)[listed])
    assert state.tolist() == [1, random.state]


@pytest.mark.parametrize(("rate", "greedy"), [(0.0, 0.0), (0.3, 0.4)])
@pytest.mark.parametrize("closed", [False, True])
def test_an_order_is_that_of_a_plain_implementation(closed: bool, rate: float, greedy: float) -> None:
    """Only clusters whose predecessors are in the order are drawn; the first one is drawn without trails."""
    rng, m = np.random.default_rng(5), 12
    pairs = np.array([(0, 3), (3, 5), (1, 2), (7, 8), (2, 9)], dtype=np.int32)
    entry, leave = rng.uniform(0, 50, (2, m, 2))
    instance = build_directed_instance(
        RoutingProblem(
            entry,
            leave,
            np.arange(m, dtype=np.int32),
            np.zeros(m),
            precedence=pairs,
            closed=closed,
            start=None if closed else (1.0, 2.0),
        ),
        5,
    )
    n, layers = instance.n, build_clusters(instance)
    tau, eta = rng.uniform(0.1, 1.0, (n, n)), rng.uniform(0.5, 2.0, (n, n))
    state, random = words(8)
    plain = PlainTrails(tau.copy(), eta, rate, greedy, random)
    weights = plain.weights.copy()
    order, missing = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    for _ in range(6):
        with plain_python():
            construct_order(layers, tau, eta, weights, ALPHA, greedy, rate, INITIAL, state, 1, missing, order)
        path = [] if closed else [m]
        while len(path) < n:
            options = [v for v in range(m) if v not in path and all(a in path for a, b in pairs if b == v)]
            if path:
                v = plain.drawn(path[-1], options, always=True)
                if rate > 0.0:
                    plain.wear(path[-1], v)
            else:
                v = options[random.below(len(options))]
            path.append(v)
        assert order.tolist() == path
    assert tau == pytest.approx(plain.tau)
    assert weights == pytest.approx(plain.weights)
    assert state.tolist() == [1, random.state]
