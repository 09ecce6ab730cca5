"""Fireflies as published: the same tours as a plain implementation, a step by hand, survivors, refusals."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

import leafcut
from leafcut.errors import OptionError, SolveError
from leafcut.kernels.firefly import PairRules, move_firefly_pairs
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import FireflyOptions, SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.instance import Instance, build_instance
from leafcut.order.literature.flight import Flight
from leafcut.order.literature.published_fireflies import PublishedFireflies
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings, settings_for
from plain_random import Xorshift

SIMPLE, COMPLEX = (
    Flight.from_options(FireflyOptions(variant=variant), limited=False)
    for variant in ("published", "published-complex")
)


def instance_of(n: int, seed: int = 1) -> Instance:
    """Return a closed tour of n places with whole costs, so that equal lengths are exactly equal."""
    rng = np.random.default_rng(seed)
    places = rng.integers(0, 50, (n, 2)).astype(float)
    matrix = np.abs(places[:, None] - places).sum(axis=2)
    return build_instance(RoutingProblem.of_points(places, Metric("EXPLICIT", matrix=matrix), closed=True), 5)


def plain_iteration(
    d: list[list[float]], tours: list[list[int]], done: float, flight: Flight, draw: Callable[[int], int]
) -> list[list[int]]:
    """Return the next swarm, written from the description of the algorithm alone."""

    def length(tour: list[int]) -> float:
        return sum(d[a][b] for a, b in zip(tour, tour[1:] + tour[:1], strict=True))

    h, results = len(tours[0]), []
    beta_0 = int(flight.attractiveness)
    for i in range(len(tours)):
        for j in range(i, len(tours)):
            a = sum(x != y for x, y in zip(tours[i], tours[j], strict=True))
            beta = math.floor(beta_0 * math.exp(-flight.absorption * (10 * a / h) ** 2))
            brightness_i, brightness_j = -length(tours[i]), -length(tours[j])
            mover, other = (i, j) if brightness_i < brightness_j else (j, i)
            if not flight.darker_moves and brightness_i != brightness_j:
                mover, other = other, mover
            if flight.complex and done < 0.37:
                mover, beta = j, beta_0
            shortest_limit = a if flight.short_by_distance else math.ceil(h / 10)
            for u in range(1, beta_0 + 1):
                tour = tours[mover if u <= beta else other]
                if (flight.complex and done < 0.27) or brightness_i == brightness_j:
                    p = draw(h)
                    q = draw(h - 1)
                    p, q = (p, q + 1) if q >= p else (q, p)
                else:
                    nodes = 2 + draw(max(2, min(shortest_limit, h - 2)) - 1)
                    p = draw(h - nodes + 1)
                    q = p + nodes - 1
                results.append(tour[:p] + tour[p : q + 1][::-1] + tour[q + 1 :])
    return sorted(results, key=length)[: len(tours)]


@pytest.mark.parametrize("variant", ["published", "published-complex"])
@pytest.mark.parametrize("moving", ["darker", "brighter"])
@pytest.mark.parametrize("short", ["distance", "tenth"])
def test_twelve_places_have_the_tours_of_a_plain_implementation(variant: str, moving: str, short: str) -> None:
    instance = instance_of(12)
    flight = Flight.from_options(
        FireflyOptions(variant=variant, reading=f"{moving}-{short}", n_fireflies=5), limited=True
    )
    swarm = PublishedFireflies(instance, flight, SolveOptions(seed=3), Stop(iterations=20))
    d, plain = instance.cost.matrix.tolist(), swarm.tours.tolist()
    swarm.construct(0)
    for iteration in range(1, 20):
        draw = Xorshift(int(random_states(3, iteration, count=1)[0])).below
        plain = plain_iteration(d, plain, iteration / 20, flight, draw)
        tours, lengths = swarm.construct(iteration)
        assert tours.tolist() == plain
        assert lengths.tolist() == sorted(lengths.tolist())


@pytest.mark.parametrize(("darker_first", "most_moves_of"), [(True, 1), (False, 0)])
def test_near_tours_give_most_moves_to_the_firefly_that_moves_first(darker_first: bool, most_moves_of: int) -> None:
    """a = 0 1 2 3 4 5, 10 mm, and b = 0 2 1 3 4 5, 12 mm, differ at two of six places: r = 10·2/6.

    β = 20·exp(-0.015·11.1) = 16.9: 16 moves of the first firefly, 4 of the other. Each alone makes 20 long moves.
    """
    points = [(float(x), 0.0) for x in range(6)]
    instance = build_instance(RoutingProblem.of_points(points, closed=True), 0)
    node = {int(x): k for k, x in enumerate(instance.cost.xy[:, 0])}
    tours = np.array([[node[x] for x in order] for order in ((0, 1, 2, 3, 4, 5), (0, 2, 1, 3, 4, 5))], dtype=np.int32)
    kept, lengths = np.zeros((100, 3), dtype=np.int32), np.full(100, np.inf)
    rules = PairRules(20, 0.015, False, False, darker_first, 0)
    words = np.array([7], dtype=np.uint64)
    move_firefly_pairs(instance.cost, tours, np.array([10.0, 12.0]), 0, 2, rules, words, 0, kept, lengths)
    assert np.isfinite(lengths).sum() == 60
    moves = np.bincount(kept[:60, 0], minlength=2) - 20
    assert moves.tolist() == ([4, 16] if most_moves_of else [16, 4])
    assert lengths[:60].tolist() == sorted(lengths[:60].tolist())


def test_the_published_swarm_is_random_and_has_the_published_numbers() -> None:
    assert SIMPLE.at_random
    assert COMPLEX.at_random
    assert (SIMPLE.fireflies, SIMPLE.attractiveness, COMPLEX.fireflies, COMPLEX.attractiveness) == (11, 20, 10, 15)
    assert not Flight.from_options(FireflyOptions(), limited=False).at_random


@pytest.mark.parametrize(
    ("flight", "done", "long", "explore"),
    [
        (SIMPLE, 0.0, False, False),  # simple pockets use neither percentage
        (SIMPLE, 0.9, False, False),
        (COMPLEX, 0.26, True, True),
        (COMPLEX, 0.28, False, True),
        (COMPLEX, 0.38, False, False),
    ],
)
def test_only_complex_pockets_begin_with_long_moves_and_exploration(
    flight: Flight, done: float, long: bool, explore: bool
) -> None:
    rules = PublishedFireflies(instance_of(8), flight, SolveOptions(), Stop()).pair_rules(done)
    assert (rules.long, rules.explore) == (long, explore)


@pytest.mark.parametrize("variant", ["published", "published-complex"])
def test_the_same_seed_gives_the_same_tour_and_given_ends_stay_ends(variant: str) -> None:
    problem = RoutingProblem.of_points(
        np.random.default_rng(3).uniform(0, 50, (25, 2)), start=(0.0, 0.0), end=(50.0, 50.0)
    )
    ways = [
        solve(
            problem,
            SolveOptions(algorithm="firefly", iterations=10, seed=seed, threads=threads, bound=False),
            firefly=FireflyOptions(variant=variant),
        )
        for seed, threads in ((1, 1), (1, 2), (2, 1))
    ]
    assert ways[0].nodes.tolist() == ways[1].nodes.tolist() != ways[2].nodes.tolist()
    path = np.concatenate([[(0.0, 0.0)], problem.entry[ways[0].nodes], [(50.0, 50.0)]])
    assert ways[0].cost == pytest.approx(float(np.hypot(*np.diff(path, axis=0).T).sum()))
    assert sorted(ways[0].nodes.tolist()) == list(range(25))


def test_eight_places_have_the_shortest_of_all_orders() -> None:
    xy = np.random.default_rng(2).uniform(0.0, 100.0, (8, 2))
    d = np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1))
    orders = np.array([(0, *rest) for rest in itertools.permutations(range(1, 8))])
    shortest = (d[orders[:, :-1], orders[:, 1:]].sum(axis=1) + d[orders[:, -1], 0]).min()
    found = solve(
        RoutingProblem.of_points(xy, closed=True),
        SolveOptions(algorithm="firefly", iterations=400, bound=False),
        firefly=FireflyOptions(variant="published"),
    )
    assert found.cost == pytest.approx(shortest)


def test_it_ends_after_twenty_iterations_that_brought_nothing() -> None:
    xy = [(0, 0), (0, 9), (9, 9), (9, 0), (5, 5)]
    found = solve(
        RoutingProblem.of_points(xy, closed=True),
        SolveOptions(algorithm="firefly", bound=False),
        firefly=FireflyOptions(variant="published"),
    )
    assert 20 <= found.iterations < 60


def test_options_that_it_would_not_use_are_refused_and_off_is_off() -> None:
    drill = registry.work("drill")
    published = {"algorithm": "firefly", "variant": "published"}
    with pytest.raises(OptionError, match="only used with --variant leafcut"):
        settings_for(collect_settings({**published, "local_search": True}), drill)
    with pytest.raises(OptionError, match="--variant: only used with --algorithm firefly"):
        settings_for(collect_settings({"variant": "published"}), drill)
    assert settings_for(collect_settings({**published, "local_search": False}), drill).firefly.variant == "published"
    with pytest.raises(OptionError, match="only used with --variant published"):
        settings_for(collect_settings({"algorithm": "firefly", "reading": "brighter-tenth"}), drill)
    pocket = registry.work("pocket")
    assert settings_for(collect_settings({"variant": "published"}), pocket).firefly.variant == "published"
    with pytest.raises(OptionError, match="only used with --variant leafcut"):
        settings_for(collect_settings({"variant": "published", "local_search": True}), pocket)


def test_an_order_with_a_direction_is_refused_in_one_line() -> None:
    places = np.random.default_rng(1).uniform(0, 50, (12, 2))
    problem = RoutingProblem(
        entry=places, exit=places + 1.0, cluster=np.arange(12, dtype=np.int32), service=np.zeros(12)
    )
    with pytest.raises(SolveError, match="--variant published supports only closed tours of points"):
        solve(problem, SolveOptions(algorithm="firefly"), firefly=FireflyOptions(variant="published"))


def test_a_pocket_is_milled_along_a_grid_that_the_published_variant_orders(tmp_path) -> None:
    file = tmp_path / "pocket.wkt"
    file.write_text("POLYGON ((0 0, 60 0, 60 40, 0 40, 0 0))")
    common = {"process": "pocket", "depth": 2, "tool_diameter": 8, "strategy": "firefly", "preset": "fast"}
    made = [leafcut.optimize(file, variant=variant, **common) for variant in ("leafcut", "published")]
    assert all(one.verified for one in made)
    assert made[0].text != made[1].text
    assert "--variant published" in made[1].text
