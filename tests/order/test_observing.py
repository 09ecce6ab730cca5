"""Who watches a search sees where it is, and changes nothing."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest

from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer, Snapshot
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import stop
from leafcut.order.instance import build_instance
from leafcut.order.pheromone_view import FAINT, pheromone_from_tours, pheromone_on_edges
from leafcut.order.solve import solve

ANTS = ("as", "eas", "asrank", "mmas", "acs")
Take = Callable[[], Snapshot]


def points(n: int, closed: bool = True) -> RoutingProblem:
    xy = np.random.default_rng(n).uniform(0.0, 100.0, (n, 2))
    ends = {} if closed else {"start": (0.0, 0.0)}
    return RoutingProblem.of_points(xy, closed=closed, **ends)


def in_order(n: int) -> RoutingProblem:
    """Return contours of two places each, the first of which come before the last."""
    xy = np.random.default_rng(n).uniform(0.0, 100.0, (2 * n, 2))
    pairs = np.array([[0, n - 1], [1, n - 1]], dtype=np.int32)
    cluster = np.repeat(np.arange(n, dtype=np.int32), 2)
    return RoutingProblem(xy, xy[::-1].copy(), cluster, np.zeros(2 * n), precedence=pairs, start=(0.0, 0.0))


def options(algorithm: str, **more: object) -> SolveOptions:
    return SolveOptions(algorithm=algorithm, iterations=4, threads=1, seed=3, **more)  # type: ignore[arg-type]


class Eye(Observer):
    """Takes every snapshot."""

    def __init__(self) -> None:
        self.seen: list[Snapshot] = []
        self.alone: list[bool] = []

    def show(self, take: Take, alone: bool) -> None:
        self.seen.append(take())
        self.alone.append(alone)


def length(path: np.ndarray) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


@pytest.mark.parametrize("algorithm", [*ANTS, "firefly", "colony", "kicks"])
def test_the_answer_is_the_same_watched_or_not_and_every_snapshot_costs_what_it_says(algorithm: str) -> None:
    problem, eye = points(60, closed=algorithm != "colony"), Eye()
    plain = solve(problem, options(algorithm), AcoOptions(n_ants=4), firefly=FireflyOptions(n_fireflies=3))
    watched = solve(
        problem, options(algorithm), AcoOptions(n_ants=4), firefly=FireflyOptions(n_fireflies=3), observe=eye
    )
    np.testing.assert_array_equal(watched.nodes, plain.nodes)
    assert (watched.cost, watched.lower_bound, watched.iterations) == (plain.cost, plain.lower_bound, plain.iterations)
    assert eye.seen
    for one in eye.seen:
        assert length(one.path) == pytest.approx(one.cost)
        assert one.bound is not None
        assert one.bound <= one.cost
    assert eye.seen[-1].cost >= watched.cost - 1e-9
    assert all(eye.alone)


@pytest.mark.parametrize("algorithm", ["mmas", "firefly", "colony"])
def test_paths_in_an_order_are_watched_without_changing_them(algorithm: str) -> None:
    problem, eye = in_order(12), Eye()
    plain = solve(problem, options(algorithm))
    watched = solve(problem, options(algorithm), observe=eye)
    np.testing.assert_array_equal(watched.nodes, plain.nodes)
    for one in eye.seen:
        # The start, then an entry and an exit for each contour: every other leg is travel, the rest is the work.
        assert len(one.path) == 1 + 2 * 12
        travel = np.hypot(*np.diff(one.path, axis=0).T)[::2].sum()
        assert travel == pytest.approx(one.cost)
    last = eye.seen[-1]
    assert (last.pheromone is not None) == (algorithm == "mmas")
    assert (last.brightness is not None) == (algorithm == "firefly")


@pytest.mark.parametrize("algorithm", ANTS)
def test_pheromone_lies_on_edges_between_places_and_more_on_those_of_the_best_path(algorithm: str) -> None:
    problem, eye = points(50), Eye()
    found = solve(problem, SolveOptions(algorithm=algorithm, iterations=60, threads=1), observe=eye)
    laid = eye.seen[-1].pheromone
    assert laid is not None
    assert laid.points.shape == (50, 2)
    np.testing.assert_allclose(laid.points, problem.entry)
    assert (laid.strength > FAINT).all()
    assert (laid.strength <= 1.0).all()
    assert len(np.unique(np.sort(laid.edges, axis=1), axis=0)) == len(laid.edges)
    tour = {frozenset(pair) for pair in zip(found.nodes.tolist(), np.roll(found.nodes, 1).tolist(), strict=True)}
    on_tour = np.array([frozenset(edge) in tour for edge in laid.edges.tolist()])
    others = float(laid.strength[~on_tour].sum()) / max(1, int((~on_tour).sum()))
    assert laid.strength[on_tour].mean() > 2.0 * others


def test_equal_trails_are_shared_evenly_and_a_converged_colony_is_of_one_mind() -> None:
    xy = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    lists = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]], dtype=np.int32)
    owner = np.arange(4, dtype=np.int32)
    even = pheromone_on_edges(xy, owner, lists, np.full((4, 3), 7.0))
    np.testing.assert_allclose(even.strength, 2.0 / 3.0)
    assert len(even.edges) == 6
    ring = np.where((lists - owner[:, None]) % 4 == 2, 0.0, 0.5)  # nothing across
    agreed = pheromone_on_edges(xy, owner, lists, ring)
    np.testing.assert_allclose(agreed.strength, 1.0)
    assert {tuple(e) for e in np.sort(agreed.edges, axis=1).tolist()} == {(0, 1), (1, 2), (2, 3), (0, 3)}


def test_what_the_default_colony_shows_is_the_share_of_its_ants_on_an_edge() -> None:
    eye = Eye()
    solve(points(200), SolveOptions(algorithm="colony", preset="fast", threads=1), observe=eye)
    laid = [one.pheromone for one in eye.seen if one.pheromone is not None]
    assert laid
    for one in laid:
        # Every ant walks n edges: their shares add up to n.
        assert one.strength.sum(dtype=np.float64) == pytest.approx(200.0, rel=1e-4)


def test_the_brighter_a_firefly_the_shorter_its_tour() -> None:
    eye = Eye()
    solve(points(60), options("firefly", bound=False), firefly=FireflyOptions(n_fireflies=5), observe=eye)
    last = eye.seen[-1]
    assert last.brightness is not None
    assert last.brightness.shape == (5,)
    assert 1.0 / last.brightness.max() == pytest.approx(last.cost)
    assert last.bound is None


def test_workers_are_told_of_while_they_work() -> None:
    eye = Eye()
    two = SolveOptions(algorithm="mmas", iterations=3, threads=2)
    solve(points(60), two, AcoOptions(n_ants=4), observe=eye)
    assert [sum(w.ants for w in one.workers) for one in eye.seen] == [4, 8, 12]
    assert all(len(one.workers) == 2 for one in eye.seen)


def test_the_clock_stands_still_while_an_observer_holds_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a second of searching, of which the observer takes twice as much: else the search would end at once."""
    seen: list[float] = []
    now = [0.0]

    def clock() -> float:
        now[0] += 0.001
        return now[0]

    class Hold(Observer):
        def show(self, take: Take, alone: bool) -> None:
            seen.append(take().seconds)
            if alone and len(seen) <= 3:
                now[0] += 0.4

    monkeypatch.setattr(stop, "clock", clock)

    solve(points(40), SolveOptions(algorithm="mmas", time_limit=0.5, threads=1, bound=False), observe=Hold())
    assert len(seen) > 4
    assert seen[3] < 0.5


def test_searches_in_threads_are_not_held_but_seen() -> None:
    """A search with an hour of time ends when it was observed three times."""

    class Enough(Exception):
        pass

    class Glance(Eye):
        def show(self, take: Take, alone: bool) -> None:
            super().show(take, alone)
            if len(self.seen) == 3:
                raise Enough

    eye = Glance()
    with pytest.raises(Enough):
        solve(in_order(30), SolveOptions(algorithm="colony", time_limit=3600.0, threads=2, bound=False), observe=eye)
    assert not any(eye.alone)
    assert len(eye.seen[-1].workers) == 2


def test_what_an_observer_raises_ends_the_search() -> None:
    class Broken(Observer):
        def show(self, take: Take, alone: bool) -> None:
            raise threading.BrokenBarrierError

    with pytest.raises(threading.BrokenBarrierError):
        solve(points(40), options("mmas"), observe=Broken())


@pytest.mark.parametrize("closed", [False, True])
def test_edges_of_a_colony_have_the_share_of_ants_that_use_them(closed: bool) -> None:
    """Strongest first; edges of the free end are left out; of 40 ants 32 count, evenly spaced."""
    rng, n = np.random.default_rng(3), 9
    instance = build_instance(RoutingProblem.of_points(rng.uniform(0, 9, (n, 2)), closed=closed), 5)
    for ants in (4, 40):
        tours = np.array([rng.permutation(instance.n) for _ in range(ants)], dtype=np.int32)
        shown = tours if ants == 4 else tours[[int(k * 39 / 31) for k in range(32)]]
        used: dict[tuple[int, int], float] = {}
        for tour in shown:
            clusters = instance.label[tour].tolist()
            for a, b in zip(clusters, [*clusters[1:], clusters[0]], strict=True):
                if max(a, b) < n:
                    edge = (min(a, b), max(a, b))
                    used[edge] = used.get(edge, 0.0) + 1.0 / len(shown)
        laid = pheromone_from_tours(instance, tours)
        assert laid.strength.tolist() == sorted(laid.strength.tolist(), reverse=True)
        found = dict(zip(map(tuple, laid.edges.tolist()), laid.strength.tolist(), strict=True))
        assert found == pytest.approx(used, abs=1e-6)


def test_an_edge_is_as_strong_as_twice_its_larger_share_of_the_pheromone_at_an_end() -> None:
    """Trails to the cluster itself, to none, and to nodes that are no cluster do not count; nor do faint edges."""
    xy = np.random.default_rng(1).uniform(0, 9, (5, 2))
    owner = np.array([2, 0, 1, 4, 3], dtype=np.int32)
    lists = np.array([[0, 1, 2, -1], [1, 2, 3, 9], [0, 3, 4, 2], [0, 1, 5, 3], [4, 1, -1, -1]], dtype=np.int32)
    trails = np.random.default_rng(2).uniform(0.1, 1.0, lists.shape)
    trails[2, 2] = 0.001
    wanted: dict[tuple[int, int], float] = {}
    for own, row, amounts in zip(owner.tolist(), lists.tolist(), trails.tolist(), strict=True):
        counted = {j: a for j, a in zip(row, amounts, strict=True) if 0 <= j < 5 and j != own}
        for j, amount in counted.items():
            share = 2.0 * amount / sum(counted.values())
            edge = (min(own, j), max(own, j))
            if share > 0.02:
                wanted[edge] = max(wanted.get(edge, 0.0), min(share, 1.0))
    laid = pheromone_on_edges(xy, owner, lists, trails)
    found = dict(zip(map(tuple, laid.edges.tolist()), laid.strength.tolist(), strict=True))
    assert found == pytest.approx(wanted, abs=1e-6)
