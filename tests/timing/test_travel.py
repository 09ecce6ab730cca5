"""What travel between nodes costs: TSPLIB's rules, the machine's, and keep-out zones."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.kernels.cost import edge_costs
from leafcut.model.machine import Machine
from leafcut.model.problem import METRICS, Metric, Relief
from leafcut.order.instance import build_cost_model
from leafcut.timing import travel
from leafcut.timing.profile import move_time
from leafcut.timing.travel import TIE_BREAK, travel_heights, travel_metric
from travel_reference import travel_cost, travel_height

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
        "m",
        "",
        "linuxcnc",
        (100.0, 80.0, 50.0),
        (500.0, 300.0, 250.0),
        80.0,
        (0, 0, 0),
        (1, 1, 1),
        rapid_style=style,
        acceleration_factor=0.9,
    )


@given(PLACE, PLACE, st.sampled_from(["linear", "dogleg"]))
def test_seconds_between_two_places_are_those_of_the_rapid_between_them(a, b, style: str) -> None:
    metric = travel_metric(machine(style), "time")
    rapid = move_time((b[0] - a[0], b[1] - a[1], 0.0), machine(style))
    shortness = TIE_BREAK * math.dist(a, b)
    assert travel_cost(metric, a, b) == pytest.approx(rapid + shortness, rel=1e-9, abs=1e-12)
    assert travel.travel_cost(metric, a, b) == pytest.approx(rapid + shortness, rel=1e-9, abs=1e-12)
    assert metric.name == style


def test_the_published_optimal_tour_of_ulysses_has_its_published_length() -> None:
    places = [ULYSSES16[town - 1] for town in ULYSSES16_TOUR]
    metric = Metric("GEO")
    length = sum(travel_cost(metric, a, b) for a, b in zip(places, [*places[1:], places[0]], strict=True))
    assert length == 6859


@pytest.mark.parametrize(
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


@pytest.mark.parametrize("name", sorted(set(METRICS) - {"EXPLICIT"}))
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
    with pytest.raises(PlanError, match="for maps, not for machines"):
        travel.travel_cost(Metric("EXPLICIT", matrix=np.zeros((2, 2))), (0, 0), (1, 1))


def test_of_two_ways_that_take_equally_long_the_shorter_costs_less() -> None:
    """On equal axes 10 mm along x takes as long as 10 mm along x and y at once, which is 4.14 mm longer."""
    metric = Metric("linear", (50.0, 50.0), (100.0, 100.0), per_mm=TIE_BREAK)
    straight, slant = (travel_cost(metric, (0.0, 0.0), end) for end in ((10.0, 0.0), (10.0, 10.0)))
    assert slant - straight == pytest.approx(TIE_BREAK * (math.sqrt(200.0) - 10.0), rel=1e-6)


#: Four tiles of 10 mm in a row, the third one 30 mm high.
RELIEF = Relief(
    np.array([(5.0, 5.0), (15.0, 5.0), (35.0, 5.0)]), np.array([2.0, 4.0, 2.0]), 40.0,
    np.array([[2.0, 4.0, 30.0, 2.0]]), 0.0, 0.0, 10.0, 50.0, 250.0,
)  # fmt: skip


@pytest.mark.parametrize(
    "a, b, height",
    [
        ((5.0, 5.0), (15.0, 5.0), 4.0),  # over two low tiles: no higher than the higher of its ends
        ((15.0, 5.0), (35.0, 5.0), 30.0),  # over the high one
        ((35.0, 5.0), (35.0, 9.0), 40.0),  # to a place that is none of the holes
        ((5.0, 20.0), (35.0, 20.0), 40.0),
    ],
)
def test_a_way_is_as_high_as_what_it_crosses(a, b, height: float) -> None:
    assert travel_heights(RELIEF, np.array([a, b, a]), False).tolist() == [height, height]


def test_a_way_over_what_stands_costs_the_rise_and_the_fall() -> None:
    """From 4 to 30 mm and down to 2: with 50 mm/s and 250 mm/s², 10 mm are needed to speed up and to slow down."""
    plain, over = travel_metric(machine("linear"), "time"), travel_metric(machine("linear"), "time", relief=RELIEF)
    a, b = (15.0, 5.0), (35.0, 5.0)
    rise_and_fall = 26.0 / 50.0 + 50.0 / 250.0 + 28.0 / 50.0 + 50.0 / 250.0
    assert travel_cost(over, a, b) - travel_cost(plain, a, b) == pytest.approx(rise_and_fall)
    length = travel_metric(machine("linear"), "distance", relief=RELIEF)
    assert travel_cost(length, a, b) == pytest.approx(20.0 + 26.0 + 28.0)


@given(st.lists(PLACE, min_size=2, max_size=8, unique=True), st.integers(0, 999), st.sampled_from(["linear", "dogleg"]))
def test_the_compiled_code_goes_as_high_and_costs_as_much_both_ways(places, seed: int, style: str) -> None:
    """Compared with the plain reference, over random tiles."""
    xy, random = np.array(places).round(6), np.random.default_rng(seed)
    tiles = np.where(random.random((9, 11)) < 0.3, random.uniform(0, 50, (9, 11)), -np.inf)
    relief = Relief(xy[1:], random.uniform(0, 20, len(xy) - 1), 60.0, tiles, -850.0, -700.0, 150.0, 50.0, 200.0)
    metric = travel_metric(machine(style), "time", relief=relief)
    heights = travel_heights(relief, xy, style == "dogleg")
    assert heights.tolist() == [travel_height(relief, *pair, style == "dogleg") for pair in pairwise(map(tuple, xy))]
    leave, arrive = (side.ravel().astype(np.int32) for side in np.meshgrid(np.arange(len(xy)), np.arange(len(xy))))
    model = build_cost_model(metric, xy)
    costs = np.zeros(len(leave))
    edge_costs(model, leave, arrive, costs)
    pairs = [(tuple(xy[i]), tuple(xy[j])) for i, j in zip(leave, arrive, strict=True)]
    assert costs == pytest.approx([travel_cost(metric, a, b) for a, b in pairs], rel=1e-12, abs=1e-12)
    assert np.array_equal(costs.reshape(len(xy), -1), costs.reshape(len(xy), -1).T)
