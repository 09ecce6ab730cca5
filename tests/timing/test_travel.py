"""What travel between nodes costs: TSPLIB's rules, the machine's, and keep-out zones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from every import every
from leafcut.errors import PlanError
from leafcut.model.machine import Machine
from leafcut.model.problem import METRICS, Metric
from leafcut.timing.profile import move_time
from leafcut.timing.travel import TIE_BREAK, travel_cost, travel_metric

PLACE = st.tuples(st.floats(-900, 900), st.floats(-900, 900))

#: The towns of ulysses16, latitude and longitude as in TSPLIB; the published optimal tour visits 1 14 13 12 7 6 15 5
#: 11 9 10 16 3 2 4 8 and is 6859 long (TSPLIB 95).
ULYSSES16 = [
    (38.24, 20.42), (39.57, 26.15), (40.56, 25.32), (36.26, 23.12), (33.48, 10.54), (37.56, 12.19), (38.42, 13.11),
    (37.52, 20.44), (41.23, 9.10), (41.17, 13.05), (36.08, -5.21), (38.47, 15.13), (38.15, 15.35), (37.51, 15.17),
    (35.49, 14.32), (39.36, 19.56),
]  # fmt: skip
ULYSSES16_TOUR = [1, 14, 13, 12, 7, 6, 15, 5, 11, 9, 10, 16, 3, 2, 4, 8]


def machine(style: str) -> Machine:
    return Machine(
        "m", "", "linuxcnc", (100.0, 80.0, 50.0), (500.0, 300.0, 250.0), 80.0, (0, 0, 0), (1, 1, 1),
        rapid_style=style, acceleration_factor=0.9,
    )  # fmt: skip


@given(PLACE, PLACE, st.sampled_from(["linear", "dogleg"]))
def test_seconds_between_two_places_are_those_of_the_rapid_between_them(a, b, style: str) -> None:
    metric = travel_metric(machine(style), "time")
    rapid = move_time((b[0] - a[0], b[1] - a[1], 0.0), machine(style))
    shortness = TIE_BREAK * math.dist(a, b)
    assert travel_cost(metric, a, b) == pytest.approx(rapid + shortness, rel=1e-9, abs=1e-12)
    assert metric.name == style


def test_the_published_optimal_tour_of_ulysses_has_its_published_length() -> None:
    places = [ULYSSES16[town - 1] for town in ULYSSES16_TOUR]
    metric = Metric("GEO")
    length = sum(travel_cost(metric, a, b) for a, b in zip(places, [*places[1:], places[0]], strict=True))
    assert length == 6859


@every(
    "name, b, cost",
    [
        ("euclidean", (3.0, 4.0), 5.0),
        ("chebyshev", (3.0, -4.0), 4.0),
        ("manhattan", (3.0, -4.0), 7.0),
        ("EUC_2D", (1.0, 1.0), 1.0),  # √2 = 1.41 → 1
        ("EUC_2D", (1.5, 2.0), 3.0),  # 2.5 → 3, halves go up
        ("CEIL_2D", (1.0, 1.0), 2.0),
        ("CEIL_2D", (3.0, 4.0), 5.0),
        ("MAX_2D", (2.5, 1.0), 3.0),
        ("MAN_2D", (1.2, 1.2), 2.0),  # 2.4 → 2
        ("ATT", (10.0, 0.0), 4.0),  # √10 = 3.16 → 3 < 3.16 → 4
        ("ATT", (0.0, 100.0), 32.0),  # √1000 = 31.62 → 32
    ],
)
def test_distances_by_hand(name: str, b: tuple[float, float], cost: float) -> None:
    assert travel_cost(Metric(name), (0.0, 0.0), b) == pytest.approx(cost)


@given(PLACE, PLACE)
def test_every_metric_is_the_same_both_ways(a, b) -> None:
    for name in set(METRICS) - {"EXPLICIT"}:
        metric = Metric(name, velocity=(9.0, 7.0), acceleration=(50.0, 20.0))
        assert travel_cost(metric, a, b) == pytest.approx(travel_cost(metric, b, a))


def test_a_lift_is_two_rapids_of_z_from_rest_to_rest() -> None:
    """8 mm at 50 mm/s with 0.9 × 250 = 225 mm/s²: v²/a = 11.1 mm > 8, so 2 √(8/225) = 0.3771 s, twice."""
    metric = travel_metric(machine("linear"), "time", zones=[[10, 10, 20, 20]], lift_height_mm=8)
    assert metric.lift == pytest.approx(4 * math.sqrt(8 / 225))
    assert travel_metric(machine("linear"), "distance", lift_height_mm=8).lift == 16
    assert travel_metric(machine("linear"), "time").lift == 0


@every("name", sorted(set(METRICS) - {"EXPLICIT"}))
def test_only_moves_over_a_zone_cost_a_lift_and_only_one(name: str) -> None:
    zones = np.array([[20.0, 20.0, 10.0, 10.0], [30.0, 10.0, 40.0, 20.0]])
    metric, plain = Metric(name, zones=zones, lift=100.0), Metric(name)
    for a, b, over in [
        ((0.0, 0.0), (9.9, 30.0), False),
        ((0.0, 0.0), (30.0, 30.0), True),
        ((0.0, 15.0), (50.0, 15.0), True),
        ((0.0, 10.0), (10.0, 10.0), True),  # touches the corner
        ((12.0, 12.0), (13.0, 13.0), True),  # inside
        ((25.0, 0.0), (25.0, 50.0), False),  # between the two
    ]:
        assert travel_cost(metric, a, b) == pytest.approx(travel_cost(plain, a, b) + (100.0 if over else 0.0))


def test_what_cannot_be_meant_is_refused() -> None:
    with pytest.raises(PlanError, match="keep-out zone"):
        travel_metric(machine("linear"), "time", zones=[[1, 2, 3]])
    with pytest.raises(PlanError, match="keep-out zone"):
        travel_metric(machine("linear"), "time", zones=[[1, 2, 3, math.nan]])
    with pytest.raises(PlanError, match="lift"):
        travel_metric(machine("linear"), "time", lift_height_mm=-1)
    with pytest.raises(PlanError, match="objective"):
        travel_metric(machine("linear"), "money")  # type: ignore[arg-type]
    with pytest.raises(PlanError, match="by index"):
        travel_cost(Metric("EXPLICIT", matrix=np.zeros((2, 2))), (0, 0), (1, 1))


def test_of_two_ways_that_take_equally_long_the_shorter_costs_less() -> None:
    """On equal axes 10 mm along x takes as long as 10 mm along x and y at once, which is 4.14 mm longer."""
    metric = Metric("linear", (50.0, 50.0), (100.0, 100.0), per_mm=TIE_BREAK)
    straight, slant = (travel_cost(metric, (0.0, 0.0), end) for end in ((10.0, 0.0), (10.0, 10.0)))
    assert slant - straight == pytest.approx(TIE_BREAK * (math.sqrt(200.0) - 10.0), rel=1e-6)
