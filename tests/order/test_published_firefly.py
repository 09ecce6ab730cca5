"""Fireflies as published: distances by brute force, a step worked by hand, the n best of m × n, modes, refusals."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import leafcut
from leafcut.errors import OptionError, SolveError
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import best_inversion, places_apart
from leafcut.model.problem import RoutingProblem
from leafcut.options import FireflyOptions, SolveOptions
from leafcut.order.instance import Instance, build_instance
from leafcut.order.literature.flight import Flight
from leafcut.order.literature.published_fireflies import MOVES, PublishedFireflies, longest_run
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from leafcut.processes import registry
from leafcut.processes.settings import collect, settings_for

SIMPLE, COMPLEX = (
    Flight.of(FireflyOptions(variant=variant), limited=False) for variant in ("published", "published-complex")
)


def instance_of(n: int, seed: int = 1, **ends: tuple[float, float] | bool) -> Instance:
    """Return an instance of n random places."""
    places = np.random.default_rng(seed).uniform(0.0, 100.0, (n, 2))
    return build_instance(RoutingProblem.of_points(places, **ends), 5)


@given(st.integers(1, 60), st.integers(0, 999))
def test_the_distance_is_that_of_hamming_place_by_place(h: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = (rng.permutation(h).astype(np.int32) for _ in range(2))
    assert places_apart(one, other) == sum(a != b for a, b in zip(one.tolist(), other.tolist(), strict=True))


def test_a_tour_turned_by_one_place_is_as_far_as_can_be_though_it_has_the_same_edges() -> None:
    tour = np.arange(7, dtype=np.int32)
    assert places_apart(tour, np.roll(tour, 1)) == 7
    assert places_apart(tour, tour) == 0


def test_the_published_swarm_is_random_and_has_the_published_numbers() -> None:
    assert SIMPLE.at_random
    assert COMPLEX.at_random
    assert (SIMPLE.fireflies, SIMPLE.attractiveness, COMPLEX.fireflies, COMPLEX.attractiveness) == (11, 20, 10, 15)
    assert not Flight.of(FireflyOptions(), limited=False).at_random


@pytest.mark.parametrize(
    "flight, as_bright, done, apart, longest",
    [
        (SIMPLE, True, 0.5, 30, 98),  # as bright: far
        (SIMPLE, False, 0.0, 30, 25),  # else short, from the first iteration to the last: a quarter of 100 nodes
        (SIMPLE, False, 0.9, 12, 12),  # and no longer than the distance
        (SIMPLE, False, 0.9, 0, 2),
        (COMPLEX, False, 0.26, 12, 98),  # below 27 %: far
        (COMPLEX, False, 0.28, 12, 25),  # below 37 %: explores, whatever the distance
        (COMPLEX, False, 0.38, 12, 12),
        (COMPLEX, True, 0.38, 12, 12),  # as bright counts for simple pockets only
    ],
)
def test_moves_are_as_long_as_the_mode_says(
    flight: Flight, as_bright: bool, done: float, apart: int, longest: int
) -> None:
    assert longest_run(flight, as_bright, done, apart, 100) == longest


def test_one_step_worked_by_hand() -> None:
    """Six places, x = 0 … 5; closed tours a = 0 1 2 3 4 5 (10 mm), b = 0 2 1 3 4 5 (12 mm), c = 2 0 1 3 4 5 (10 mm).

    a and c are as bright and differ at three places: r = 10·3/6 = 5, β = 20·exp(-0.015·25) = 13.7, so 14 inversions are
    tried; both move far, by runs of up to 6 - 2 nodes. b sees both; each has another node at two places, r = 10·2/6,
    β = 20·exp(-0.015·11.1) = 16.9: 17 inversions of 2 nodes, which is the distance and a quarter of six nodes.
    """
    instance = build_instance(RoutingProblem.of_points([(x, 0.0) for x in range(6)], closed=True), 0)
    node = {int(x): k for k, x in enumerate(instance.cost.xy[:, 0])}
    swarm = PublishedFireflies(instance, SIMPLE, SolveOptions(seed=1), Stop(iterations=100))
    orders = [(0, 1, 2, 3, 4, 5), (0, 2, 1, 3, 4, 5), (2, 0, 1, 3, 4, 5)]
    swarm.tours = np.array([[node[x] for x in order] for order in orders], dtype=np.int32)
    swarm.lengths = np.array([tour_cost(instance.cost, tour) for tour in swarm.tours])
    assert swarm.lengths == pytest.approx([10.0, 12.0, 10.0])
    assert [20.0 * math.exp(-0.015 * (10.0 * apart / 6) ** 2) for apart in (3, 2)] == pytest.approx(
        [13.75, 16.93], abs=0.01
    )
    assert [swarm.aim_of(f) for f in range(3)] == [(14, 4), (17, 2), (14, 4)]


@given(st.integers(6, 30), st.integers(0, 99), st.integers(1, 40), st.integers(2, 28))
def test_a_move_has_the_best_of_its_inversions_and_adds_what_it_says(n: int, seed: int, tries: int, most: int) -> None:
    """Of one inversion it is that; of very many, the best of all runs there are, tried one by one."""
    instance = instance_of(n, seed, closed=True)
    tour = np.random.default_rng(seed).permutation(n).astype(np.int32)
    longest, moved = min(most, n - 2), np.zeros(n, dtype=np.int32)
    added = best_inversion(instance.cost, tour, tries, longest, np.array([seed + 1], dtype=np.uint64), 0, moved)
    assert sorted(moved.tolist()) == list(range(n))
    before = tour_cost(instance.cost, tour)
    assert tour_cost(instance.cost, moved) == pytest.approx(before + added)
    every_run = [
        np.concatenate([tour[:a], tour[a:b][::-1], tour[b:]])
        for a, b in itertools.combinations(range(n + 1), 2)
        if 2 <= b - a <= longest
    ]
    lengths = [float(tour_cost(instance.cost, one)) for one in every_run]
    assert any(np.array_equal(moved, one) for one in every_run)
    best_inversion(instance.cost, tour, 60 * n * n, longest, np.array([7], dtype=np.uint64), 0, moved)
    assert tour_cost(instance.cost, moved) == pytest.approx(min(lengths))


def test_of_m_times_n_moves_the_n_shortest_are_kept_and_no_tour_of_before() -> None:
    instance = instance_of(30, closed=True)
    swarm = PublishedFireflies(instance, SIMPLE, SolveOptions(seed=5), Stop(iterations=100))
    swarm.construct(0)
    before = swarm.tours.copy()
    tours, lengths = swarm.construct(1)
    made = sorted(float(tour_cost(instance.cost, tour)) for tour in swarm.moved)
    assert len(swarm.moved) == MOVES * len(before) == 22
    assert sorted(lengths.tolist()) == made[:11]
    assert all(not np.array_equal(tour, old) for tour in tours for old in before)


@pytest.mark.parametrize("variant", ["published", "published-complex"])
def test_the_same_seed_gives_the_same_tour_and_given_ends_stay_ends(variant: str) -> None:
    problem = RoutingProblem.of_points(
        np.random.default_rng(3).uniform(0, 50, (25, 2)), start=(0.0, 0.0), end=(50.0, 50.0)
    )
    ways = [
        solve(
            problem, SolveOptions(algorithm="firefly", iterations=300, seed=seed, threads=threads, bound=False),
            firefly=FireflyOptions(variant=variant),
        )
        for seed, threads in ((1, 1), (1, 2), (2, 1))
    ]  # fmt: skip
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
        RoutingProblem.of_points(xy, closed=True), SolveOptions(algorithm="firefly", iterations=400, bound=False),
        firefly=FireflyOptions(variant="published"),
    )  # fmt: skip
    assert found.cost == pytest.approx(shortest)


def test_it_ends_after_twenty_iterations_that_brought_nothing() -> None:
    xy = [(0, 0), (0, 9), (9, 9), (9, 0), (5, 5)]
    found = solve(
        RoutingProblem.of_points(xy, closed=True), SolveOptions(algorithm="firefly", bound=False),
        firefly=FireflyOptions(variant="published"),
    )  # fmt: skip
    assert 20 <= found.iterations < 60


def test_options_that_it_would_not_use_are_refused_and_off_is_off() -> None:
    drill = registry.work("drill")
    published = {"algorithm": "firefly", "variant": "published"}
    with pytest.raises(OptionError, match="only used with --variant leafcut"):
        settings_for(collect({**published, "local_search": True}), drill)
    with pytest.raises(OptionError, match="--variant: only used with --algorithm firefly"):
        settings_for(collect({"variant": "published"}), drill)
    assert settings_for(collect({**published, "local_search": False}), drill).firefly.variant == "published"
    pocket = registry.work("pocket")
    assert settings_for(collect({"variant": "published"}), pocket).firefly.variant == "published"
    with pytest.raises(OptionError, match="only used with --variant leafcut"):
        settings_for(collect({"variant": "published", "local_search": True}), pocket)


def test_an_order_with_a_direction_is_refused_in_one_line() -> None:
    places = np.random.default_rng(1).uniform(0, 50, (12, 2))
    problem = RoutingProblem(
        entry=places, exit=places + 1.0, cluster=np.arange(12, dtype=np.int32), service=np.zeros(12)
    )
    with pytest.raises(SolveError, match="--variant published moves closed tours of places"):
        solve(problem, SolveOptions(algorithm="firefly"), firefly=FireflyOptions(variant="published"))


def test_a_pocket_is_milled_along_a_grid_that_the_published_variant_orders(tmp_path) -> None:
    file = tmp_path / "pocket.wkt"
    file.write_text("POLYGON ((0 0, 60 0, 60 40, 0 40, 0 0))")
    common = {"process": "pocket", "depth": 2, "tool_diameter": 8, "strategy": "firefly", "preset": "fast"}
    made = [leafcut.optimize(file, variant=variant, **common) for variant in ("leafcut", "published")]
    assert all(one.verified for one in made)
    assert made[0].text != made[1].text
    assert "--variant published" in made[1].text
