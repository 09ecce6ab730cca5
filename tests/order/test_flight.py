"""Parameters of the fireflies, and where each of them flies, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import SearchStep
from leafcut.options import FireflyOptions, SolveOptions
from leafcut.order.instance import build_instance
from leafcut.order.literature.flight import Flight, Swarm, completed_share, initial_tour
from leafcut.order.search import Best
from leafcut.order.stop import Stop


@pytest.mark.parametrize(
    ("options", "limited", "expected"),
    [
        ({}, False, (11, 20.0, 0.015, 20, False, False, False, False)),
        ({}, True, (11, 20.0, 0.015, math.inf, False, False, False, False)),
        ({"variant": "published"}, False, (11, 20.0, 0.015, 20, True, False, False, False)),
        ({"variant": "published-complex"}, False, (10, 15.0, 0.015, 20, True, True, False, False)),
        (
            {"variant": "published", "reading": "darker-distance"},
            True,
            (11, 20.0, 0.015, math.inf, True, False, True, True),
        ),
        ({"n_fireflies": 4, "attractiveness": 0.0, "absorption": 0.5}, False, (4, 0.0, 0.5, 20) + (False,) * 4),
    ],
)
def test_options_and_the_defaults_of_the_variant_give_the_parameters(
    options: dict[str, object], limited: bool, expected: tuple[object, ...]
) -> None:
    assert Flight.from_options(FireflyOptions(**options), limited) == Flight(*expected)  # type: ignore[arg-type]


#: β₀ = 8, γ = 0.02.
FLIGHT = Flight(3, 8.0, 0.02, 20, False, False, False, False)


def test_the_target_is_the_brighter_firefly_with_the_largest_attraction_times_brightness() -> None:
    """Of 40 nodes, 8 edges apart is r = 2, β = 8·exp(-0.08) = 7.385; 20 edges are r = 5, β = 8·exp(-0.5) = 4.852."""
    assert FLIGHT.attraction(8, 40) == pytest.approx(8.0 * math.exp(-0.08))
    assert FLIGHT.attraction(20, 40) == pytest.approx(8.0 * math.exp(-0.5))
    # 4.852 / 60 = 0.0809 is less than 7.385 / 90 = 0.0821, and 4.852 / 59 = 0.0822 is more.
    assert FLIGHT.most_attractive(np.array([60.0, 90.0, 95.0]), 2, {0: 20, 1: 8}, 40) == 1
    assert FLIGHT.most_attractive(np.array([59.0, 90.0, 95.0]), 2, {0: 20, 1: 8}, 40) == 0
    # Lengths of a table may be negative: all are equally bright, so the nearest attracts.
    assert FLIGHT.most_attractive(np.array([-60.0, -50.0, -40.0]), 2, {0: 20, 1: 8}, 40) == 1


def test_a_firefly_aims_at_its_target_and_the_brightest_one_at_random() -> None:
    """Long inversions have at most as many nodes as edges differ, short ones a quarter of 40, or 50 with repair."""
    lengths, apart, h = np.array([60.0, 90.0, 95.0]), {0: 20, 1: 8}.__getitem__, 40
    near = pytest.approx(8.0 * math.exp(-0.08))
    assert FLIGHT.choose_target(lengths, 2, apart, h, 0.0, mended=False) == (near, 8)
    far = pytest.approx(8.0 * math.exp(-0.5))
    assert FLIGHT.choose_target(lengths, 1, apart, h, 0.26, mended=False) == (far, 20)
    assert FLIGHT.choose_target(lengths, 1, apart, h, 0.27, mended=False) == (far, 10)
    assert FLIGHT.choose_target(lengths, 1, apart, h, 0.27, mended=True) == (far, 20)
    assert FLIGHT.choose_target(lengths, 0, apart, h, 0.0, mended=False) == (8.0, 38)
    assert FLIGHT.choose_target(lengths, 0, apart, h, 0.5, mended=False) == (8.0, 10)
    assert FLIGHT.choose_target(lengths, 0, apart, 41, 0.5, mended=False) == (8.0, 11)
    assert FLIGHT.choose_target(lengths, 0, apart, 90, 0.5, mended=True) == (8.0, 50)
    # Fireflies of equal length do not attract each other.
    assert FLIGHT.choose_target(np.array([60.0, 60.0]), 1, apart, h, 0.0, mended=False) == (8.0, 38)


def test_an_inversion_has_from_two_nodes_to_all_but_two() -> None:
    assert [FLIGHT.longest_inversion(a, 10, 0.0, 3) for a in (0, 1, 2, 3, 7, 8, 9)] == [2, 2, 2, 3, 7, 8, 8]
    assert [FLIGHT.longest_inversion(a, 10, 1.0, 3) for a in (0, 2, 3, 4, 9)] == [2, 2, 3, 3, 3]
    assert FLIGHT.longest_inversion(0, 3, 0.0, 3) == 2


class Three(Swarm):
    """Three fireflies on 40 nodes whose differing edges are given."""

    def count_different_edges(self, one: int, other: int) -> int:
        """Return the number of differing edges."""
        return {(2, 0): 20, (2, 1): 8, (1, 0): 12}[one, other]

    def moves_per_flight(self, attraction: float) -> int:
        """Return the number of moves of a flight."""
        return round(10.0 * attraction)


def three(lengths: list[float], done: float = 0.0) -> Three:
    """Return the swarm with these lengths."""
    xy = np.random.default_rng(1).uniform(0, 9, (40, 2))
    swarm = Three(
        build_instance(RoutingProblem.of_points(xy, closed=True), 5), FLIGHT, SolveOptions(local_search=False)
    )
    swarm.lengths[:], swarm.done = lengths, done
    return swarm


def test_a_swarm_begins_in_the_dark() -> None:
    swarm = three([math.inf] * 3)
    assert swarm.brightness().tolist() == [0.0, 0.0, 0.0]
    assert three([4.0, 0.0, -5.0]).brightness().tolist() == [0.25, 0.0, 0.0]
    assert (swarm.size, swarm.seed, swarm.mended) == (40, 1, False)
    assert Three(swarm.shown, FLIGHT, SolveOptions(seed=6)).done == 0.0  # type: ignore[arg-type]
    assert len(swarm.log.ants) == 1


def test_the_moves_and_the_longest_inversion_of_a_firefly_are_those_of_its_aim() -> None:
    swarm = three([60.0, 90.0, 95.0])
    assert swarm.moves_to_target(2) == (round(80.0 * math.exp(-0.08)), 8)
    assert swarm.moves_to_target(1) == (round(80.0 * math.exp(-0.02 * 9.0)), 12)
    assert swarm.moves_to_target(0) == (80, 38)
    assert three([60.0, 90.0, 95.0], done=0.3).moves_to_target(1)[1] == 10


def test_the_step_shown_is_that_of_the_darkest_firefly_with_a_known_length() -> None:
    best = Best(Stop())
    best.cost = 55.0
    own = {"n": 3, "beta_0": 8.0, "gamma": 0.02, "h": 40, "c_best": 55.0}
    beta = 8.0 * math.exp(-0.08)
    there = {"target": 2, "c_target": 90.0, "edges_apart": 8, "r": 2.0}
    flown = {"beta": pytest.approx(beta), "moves": round(10 * beta), "longest": 8}
    swarm = three([60.0, 90.0, 95.0])
    assert swarm.describe_next_flight(best) == SearchStep("firefly", own | {"dark": 3, "c_dark": 95.0} | there | flown)
    # The length of the third is unknown.
    beta = 8.0 * math.exp(-0.18)
    there = {"target": 1, "c_target": 60.0, "edges_apart": 12, "r": 3.0}
    flown = {"beta": pytest.approx(beta), "moves": round(10 * beta), "longest": 10}
    swarm = three([60.0, 90.0, math.inf], done=0.9)
    assert swarm.describe_next_flight(best) == SearchStep("firefly", own | {"dark": 2, "c_dark": 90.0} | there | flown)
    swarm = three([60.0, 60.0, 60.0])
    alone = {"dark": 1, "c_dark": 60.0, "beta": 8.0, "moves": 80, "longest": 38}
    assert swarm.describe_next_flight(best) == SearchStep("firefly", own | alone)
    shown = three([4.0, 60.0, math.inf]).snapshot_fields(best)
    assert shown["brightness"].tolist() == [0.25, 1 / 60.0, 0.0]
    assert shown["step"].values["dark"] == 2
    assert shown["workers"] is not None


@pytest.mark.parametrize("ends", [{"closed": True}, {"start": (0.0, 0.0), "end": (9.0, 9.0)}])
def test_the_first_tours_are_greedy_or_random_with_a_tied_edge(ends: dict[str, object]) -> None:
    xy = np.random.default_rng(2).uniform(0, 9, (30, 2))
    instance = build_instance(RoutingProblem.of_points(xy, **ends), 8)  # type: ignore[arg-type]
    published = Flight.from_options(FireflyOptions(variant="published"), limited=True)
    for flight in (FLIGHT, published):
        tours = [initial_tour(instance, flight, 5, f).tolist() for f in range(4)]
        assert tours == [initial_tour(instance, flight, 5, f).tolist() for f in range(4)]
        assert all(sorted(tour) == list(range(instance.n)) for tour in tours)
        assert len({tuple(tour) for tour in tours}) > 2
        if flight is published and "start" in ends:
            assert all(tour[-2:] == [instance.first, instance.second] for tour in tours)
    lengths = [[instance.length(initial_tour(instance, f, 5, k)) for k in range(4)] for f in (FLIGHT, published)]
    assert max(lengths[0]) < min(lengths[1])
    # Only the first greedy tour is the same for every seed.
    assert initial_tour(instance, FLIGHT, 5, 0).tolist() == initial_tour(instance, FLIGHT, 6, 0).tolist()
    assert initial_tour(instance, FLIGHT, 5, 1).tolist() != initial_tour(instance, FLIGHT, 6, 1).tolist()
    assert initial_tour(instance, published, 5, 0).tolist() != initial_tour(instance, published, 6, 0).tolist()


def test_the_larger_share_of_the_iterations_and_of_the_time_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("leafcut.order.stop.clock", lambda: 107.0)
    assert completed_share(Stop(iterations=10, seconds=20.0, began=100.0), 5) == 0.5
    assert completed_share(Stop(iterations=10, seconds=20.0, began=100.0), 3) == pytest.approx(0.35)
    assert completed_share(Stop(seconds=20.0, began=100.0), 3) == pytest.approx(0.35)
    assert completed_share(Stop(iterations=4, began=100.0), 3) == 0.75
    assert completed_share(Stop(began=100.0), 3) == 0.0
