"""Long edges: the gain of a walk equals the reduction of the tour length, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import Tour, reverse_positions
from leafcut.kernels.long_edges import shorten_by_walking
from leafcut.model.problem import RoutingProblem
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import shorten_long_edges, tour_with_buffers
from plain_python import plain_python


def field(n: int, seed: int) -> Instance:
    """Return random places on a fine grid."""
    xy = np.random.default_rng(seed).integers(0, 60, (n, 2)).astype(float)
    return build_instance(RoutingProblem.of_points(xy, closed=True), 5)


def is_whole(tour: Tour) -> bool:
    """Return whether every node occurs once in the tour, at its recorded position."""
    n = len(tour.node)
    return bool((np.sort(tour.node) == np.arange(n)).all() and (tour.place[tour.node] == np.arange(n)).all())


@pytest.mark.parametrize("seed", range(4))
def test_the_gain_is_what_the_tour_becomes_shorter(seed: int) -> None:
    instance = field(120, seed)
    node = np.random.default_rng(seed).permutation(120).astype(np.int32)
    tour = tour_with_buffers(node, queued=False)
    edges = np.stack([node, np.roll(node, -1)], axis=1)
    onto, steps = np.full(120, -1, dtype=np.int32), np.zeros((50, 2), dtype=np.int32)
    before = tour_cost(instance.cost, node)
    gain = shorten_by_walking(instance.cost, tour, instance.candidates, instance.lengths, edges, onto, steps, 100_000)
    assert gain > 0.2 * before
    assert is_whole(tour)
    assert tour_cost(instance.cost, tour.node) == pytest.approx(before - gain)
    assert (onto == -1).all()


def plain_walk(instance: Instance, path: list[int], most: int, queue: dict[int, None]) -> tuple[float, list[int]]:
    """Let the first node of a path walk towards the last, its neighbour on the tour; return the gain and the path.

    A step joins the first node to the candidate that leaves the shortest tour; the node before that becomes the first.
    The last edge that was added at a node is not removed again.
    """

    def way(a: int, b: int) -> float:
        return float(instance.costs(a, b)[0])

    paths, gains, ends = [path], [0.0], []
    joined: dict[int, int] = {}
    open_length = way(path[0], path[-1])
    while len(ends) < most:
        options = []
        for x in instance.candidates[path[0]].tolist():
            y = path[path.index(x) - 1]
            if x < 0 or x == path[-1] or y == path[0] or joined.get(x) == y or joined.get(y) == x:
                continue
            gain = open_length - way(path[0], x) + way(y, x)
            if gain > max(gains) + 1e-9:
                options.append((way(y, path[-1]) - gain, gain, x))
        if not options:
            break
        length, open_length, x = min(options)
        joined[path[0]] = x
        ends.append((path[0], x))
        at = path.index(x)
        path = path[:at][::-1] + path[at:]
        paths.append(path)
        gains.append(-length)
    kept = max(range(len(gains)), key=lambda k: (gains[k] > 1e-9, gains[k]))
    if gains[kept] <= 1e-9:
        return 0.0, paths[0]
    for pair in reversed(ends[:kept]):
        queue.update(dict.fromkeys(pair))
    queue.update(dict.fromkeys((path[-1], paths[kept][0])))
    return gains[kept], paths[kept]


@pytest.mark.parametrize("most", [1, 4, 50])
def test_long_edges_are_shortened_as_by_a_plain_implementation(most: int) -> None:
    gained = 0
    for seed in range(4):
        rng, n = np.random.default_rng(seed), 40
        instance = build_instance(RoutingProblem.of_points(rng.uniform(0, 60, (n, 2)), closed=True), 5)
        node = rng.permutation(n).astype(np.int32)
        tour = tour_with_buffers(node, queued=False)
        edges = np.stack([node, np.roll(node, -1)], axis=1)[::3].copy()
        onto, steps = np.full(n, -1, dtype=np.int32), np.zeros((most, 2), dtype=np.int32)
        gain = shorten_by_walking(instance.cost, tour, instance.candidates, instance.lengths, edges, onto, steps, 10**6)
        plain, total = node.tolist(), 0.0
        queue: dict[int, None] = {}
        for pair in edges.tolist():
            for fixed, moving in (pair, pair[::-1]):
                for turned in (plain, plain[::-1]):
                    at = turned.index(moving)
                    path = turned[at:] + turned[:at]
                    if path[-1] == fixed:
                        one, plain = plain_walk(instance, path, most, queue)
                        total, gained = total + one, gained + (one > 0.0)
                        break
        assert gain == pytest.approx(total)
        at = plain.index(int(tour.node[0]))
        wanted = plain[at:] + plain[:at]
        assert tour.node.tolist() in (wanted, [wanted[0], *wanted[:0:-1]])
        assert tour.queue[: tour.counts[1]].tolist() == list(queue)
    assert gained > 8


@pytest.mark.parametrize("places", [0, 1, 40])
def test_few_places_to_write_end_the_search_with_a_whole_tour_that_is_no_longer(places: int) -> None:
    instance = field(80, 9)
    node = np.random.default_rng(9).permutation(80).astype(np.int32)
    tour = tour_with_buffers(node, queued=False)
    edges = np.stack([node, np.roll(node, -1)], axis=1)
    onto, steps = np.full(80, -1, dtype=np.int32), np.zeros((50, 2), dtype=np.int32)
    gain = shorten_by_walking(instance.cost, tour, instance.candidates, instance.lengths, edges, onto, steps, places)
    assert gain >= 0.0
    assert is_whole(tour)
    assert tour_cost(instance.cost, tour.node) == pytest.approx(tour_cost(instance.cost, node) - gain)


def test_nothing_is_done_where_no_edge_is_longer_than_all_candidates_of_its_ends() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    instance = build_instance(RoutingProblem.of_points(np.stack([np.cos(angle), np.sin(angle)], 1), closed=True), 5)
    ring = np.argsort(instance.label).astype(np.int32)
    tour = tour_with_buffers(ring, queued=False)
    assert not shorten_long_edges(instance, tour)
    assert np.array_equal(tour.node, ring)


@pytest.mark.parametrize("n", [6, 7])
def test_every_part_of_a_tour_can_be_turned(n: int) -> None:
    for first in range(n):
        for last in range(n):
            tour = tour_with_buffers(np.arange(n, dtype=np.int32), queued=False)
            with plain_python():
                assert reverse_positions(tour.node, tour.place, first, last) <= n // 2
            assert is_whole(tour)
            inside = [(first + k) % n for k in range((last - first) % n + 1)]
            turned = inside[::-1] + [(last + 1 + k) % n for k in range(n - len(inside))]
            edges = {frozenset((turned[k - 1], turned[k])) for k in range(n)}
            assert {frozenset((int(tour.node[k - 1]), int(tour.node[k]))) for k in range(n)} == edges
