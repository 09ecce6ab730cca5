"""The cost of travel against hand calculations and the plain reference of `timing.travel`."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.cost import (
    TIED,
    node_travel_cost,
    rest_to_rest_seconds,
    straight_travel_cost,
    tour_cost,
    uses_straight_cost,
)
from leafcut.model.problem import METRICS, Metric
from leafcut.order.instance import build_cost_model
from plain_python import plain_python
from travel_reference import travel_cost

# Rounded to the nanometre: squares of numbers below 1e-154 underflow to 0.
COORDINATES = st.floats(-300, 300).map(lambda v: round(v, 6))
PLACES = st.tuples(COORDINATES, COORDINATES)


@pytest.fixture(scope="module", autouse=True)
def plain() -> Iterator[None]:
    """Run `travel` as plain Python: to compile it takes longer than all cases."""
    with plain_python():
        yield


def test_a_long_move_takes_distance_over_velocity_and_one_ramp() -> None:
    """100 mm at 50 mm/s and 100 mm/s²: 100/50 + 50/100 = 2.5 s."""
    assert rest_to_rest_seconds(100.0, 50.0, 100.0) == pytest.approx(2.5)


def test_a_short_move_never_reaches_its_velocity() -> None:
    """4 mm at 100 mm/s²: up 2 mm and down 2 mm take √(2·2/100) = 0.2 s each, whatever the velocity."""
    assert rest_to_rest_seconds(4.0, 1000.0, 100.0) == pytest.approx(0.4)


@pytest.mark.parametrize("name", [m for m in METRICS if m != "EXPLICIT"])
@given(a=PLACES, b=PLACES)
def test_every_metric_equals_its_plain_reference(name: str, a: tuple[float, float], b: tuple[float, float]) -> None:
    zones = np.zeros((0, 4)) if name == "GEO" else np.array([[10.0, -20.0, 60.0, 40.0], [-90.0, -90.0, -80.0, 90.0]])
    limits = {"velocity": (250.0, 150.0), "acceleration": (800.0, 300.0), "per_mm": 0.001}
    metric = Metric(name, **limits, zones=zones, lift=3.25)
    model = build_cost_model(metric, np.array([a, b]))
    assert node_travel_cost(model, 0, 1) == pytest.approx(travel_cost(metric, a, b), rel=1e-12, abs=1e-9)
    assert node_travel_cost(model, 1, 0) == node_travel_cost(model, 0, 1)


@pytest.mark.parametrize("name", METRICS)
@given(a=PLACES, b=PLACES)
def test_a_straight_cost_is_that_of_travel(name: str, a: tuple[float, float], b: tuple[float, float]) -> None:
    table = np.zeros((2, 2)) if name == "EXPLICIT" else None
    model = build_cost_model(Metric(name, matrix=table), np.array([a, b]))
    assert uses_straight_cost(model) == (name in ("euclidean", "EUC_2D", "CEIL_2D"))
    if uses_straight_cost(model):
        assert straight_travel_cost(model.xy, model.code, 0, 1) == node_travel_cost(model, 0, 1)
    assert not uses_straight_cost(model._replace(zones=np.zeros((1, 4))))


@pytest.mark.parametrize("name", [m for m in METRICS if m != "EXPLICIT"])
def test_nodes_beside_free_and_tied_ones_cost_what_they_cost_without_them(name: str) -> None:
    places = np.array([[0.0, 0.0], [30.0, 41.0], [10.0, 25.5], [7.0, 9.0], [1.0, 2.0]])
    plain, model = build_cost_model(Metric(name), places), build_cost_model(Metric(name), places, tied=(2, 3), free=4)
    ordinary = [(0, 1), (1, 0), (0, 2), (3, 1), (2, 0)]
    assert [node_travel_cost(model, i, j) for i, j in ordinary] == [node_travel_cost(plain, i, j) for i, j in ordinary]
    assert [node_travel_cost(model, 2, 3), node_travel_cost(model, 3, 2), node_travel_cost(model, 4, 0)] == [
        TIED,
        TIED,
        0.0,
    ]


def test_the_geographical_distance_is_that_of_tsplib() -> None:
    """burma14, nodes 1 and 2 (16.47 96.10, 16.47 94.44): 153 km as in the TSPLIB paper's own optimal tour sums."""
    model = build_cost_model(Metric("GEO"), np.array([[16.47, 96.10], [16.47, 94.44]]))
    assert node_travel_cost(model, 0, 1) == 153


def test_a_free_node_costs_nothing_and_a_tied_edge_stands_out() -> None:
    model = build_cost_model(Metric(), np.array([[0.0, 0.0], [30.0, 40.0], [0.0, 0.0]]), tied=(1, 2), free=2)
    assert node_travel_cost(model, 0, 1) == 50.0
    assert node_travel_cost(model, 0, 2) == 0.0
    assert node_travel_cost(model, 1, 2) == TIED


def test_a_tied_edge_adds_nothing_to_a_tour() -> None:
    model = build_cost_model(Metric(), np.array([[0.0, 0.0], [30.0, 40.0], [0.0, 0.0]]), tied=(1, 2), free=2)
    assert tour_cost(model, np.array([0, 1, 2], dtype=np.int32)) == 50.0


def test_explicit_costs_are_read_from_the_matrix() -> None:
    matrix = np.array([[0.0, 7.0], [7.0, 0.0]])
    assert node_travel_cost(build_cost_model(Metric("EXPLICIT", matrix=matrix), np.zeros((2, 2))), 0, 1) == 7.0


def test_a_move_along_the_edge_of_a_zone_is_lifted() -> None:
    metric = Metric(zones=np.array([[0.0, 0.0, 10.0, 10.0]]), lift=5.0)
    model = build_cost_model(metric, np.array([[-5.0, 10.0], [15.0, 10.0], [15.0, 10.001], [-5.0, 10.001]]))
    assert node_travel_cost(model, 0, 1) == 25.0
    assert node_travel_cost(model, 2, 3) == 20.0


def test_a_move_that_just_touches_a_zone_costs_the_same_both_ways() -> None:
    """(131.4, 21.9) to (0, 0) passes the corner (60, 10) at no distance: rounding must not hang on the direction."""
    metric = Metric(zones=np.array([[20.0, 10.0, 60.0, 300.0]]), lift=5.0)
    model = build_cost_model(metric, np.array([[131.4, 21.9], [0.0, 0.0], [43.8, 7.3]]))
    assert node_travel_cost(model, 0, 1) == node_travel_cost(model, 1, 0)
    assert node_travel_cost(model, 0, 2) == node_travel_cost(model, 2, 0)


def test_a_dogleg_move_round_a_corner_counts_as_crossing() -> None:
    """The axes do not arrive together: the way may run anywhere in the box between the places."""
    zones = np.array([[8.0, 0.0, 10.0, 2.0]])
    xy = np.array([[0.0, 0.0], [10.0, 10.0]])
    linear = build_cost_model(Metric("linear", (10.0, 10.0), (1e9, 1e9), 0.0, zones, 4.0), xy)
    dogleg = build_cost_model(Metric("dogleg", (10.0, 10.0), (1e9, 1e9), 0.0, zones, 4.0), xy)
    assert node_travel_cost(linear, 0, 1) == pytest.approx(math.sqrt(200) / math.hypot(10, 10), rel=1e-6)
    assert node_travel_cost(dogleg, 0, 1) == pytest.approx(5.0, rel=1e-6)
