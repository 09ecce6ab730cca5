"""Lines and arcs end to end, against hand calculation and against shapely's flattened polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline, concatenate

#: A stadium: two lines of 10 mm and two half circles of radius 2 mm, counter-clockwise.
STADIUM = Polyline(np.array([[0.0, 0, 0], [10, 0, 1], [10, 4, 0], [0, 4, 1]]), closed=True)


def test_the_stadium_has_the_length_the_area_and_the_extents_of_the_hand_calculation() -> None:
    assert STADIUM.length == pytest.approx(20 + 4 * math.pi)
    assert STADIUM.area == pytest.approx(40 + 4 * math.pi)
    assert STADIUM.extents == pytest.approx((-2, 0, 12, 4))


def test_a_circle_is_a_circle_either_way_round() -> None:
    for clockwise in (False, True):
        circle = Polyline.circle(5, 6, 3, clockwise)
        assert circle.length == pytest.approx(6 * math.pi)
        assert circle.area == pytest.approx(-9 * math.pi if clockwise else 9 * math.pi)
        assert circle.extents == pytest.approx((2, 3, 8, 9))


def test_places_and_directions_along_an_arc_are_those_of_the_hand_calculation() -> None:
    quarter = 10 + math.pi  # a quarter circle past the end of the first line
    assert STADIUM.point_at(quarter) == pytest.approx((12, 2))
    assert STADIUM.direction_at(quarter) == pytest.approx((0, 1))
    assert STADIUM.direction_at(STADIUM.length - math.pi) == pytest.approx((0, -1))
    assert STADIUM.reversed().direction_at(math.pi) == pytest.approx((0, 1))
    assert STADIUM.point_at(STADIUM.length + 1) == pytest.approx((1, 0))


polylines = st.lists(
    st.tuples(
        st.floats(-50, 50).map(lambda v: round(v, 3)),
        st.floats(-50, 50).map(lambda v: round(v, 3)),
        st.floats(-2, 2).map(lambda v: round(v, 3)),
    ),
    min_size=2,
    max_size=7,
    unique_by=lambda row: row[:2],
)


@given(polylines, st.booleans())
def test_its_length_and_area_are_those_of_very_short_chords(
    rows: list[tuple[float, float, float]], closed: bool
) -> None:
    path = Polyline(np.array(rows), closed)
    chords = path.flattened(1e-4)
    assert path.length == pytest.approx(shapely.LineString(chords).length, rel=1e-3, abs=1e-6)
    if closed:
        x, y = chords.T
        shoelace = 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
        assert path.area == pytest.approx(shoelace, abs=1e-3 * path.length + 1e-6)
    low = path.extents
    assert (*chords.min(axis=0), *chords.max(axis=0)) == pytest.approx(low, abs=1e-3)


@given(polylines, st.booleans(), st.floats(0, 1), st.floats(0, 1))
def test_pieces_put_together_are_the_whole(
    rows: list[tuple[float, float, float]], closed: bool, first: float, second: float
) -> None:
    path = Polyline(np.array(rows), closed)
    a, b = sorted((first * path.length, second * path.length))
    parts = [path.piece(0, a), path.piece(a, b), path.piece(b, path.length)]
    assert sum(p.length for p in parts) == pytest.approx(path.length, abs=1e-6)
    assert parts[1].start == pytest.approx(path.point_at(a), abs=1e-6)
    whole = concatenate(*parts)
    for share in (0.1, 0.5, 0.9):
        assert whole.point_at(share * path.length) == pytest.approx(path.point_at(share * path.length), abs=1e-5)


@given(polylines, st.floats(0, 1), st.floats(0, 1))
def test_a_whole_round_from_anywhere_or_the_path_reversed_is_the_same_place_for_place(
    rows: list[tuple[float, float, float]], share: float, at: float
) -> None:
    path = Polyline(np.array(rows), closed=True)
    d = share * path.length
    again = path.piece(d, d + path.length)
    assert again.length == pytest.approx(path.length)
    assert again.point_at(at * path.length) == pytest.approx(path.point_at(d + at * path.length), abs=1e-5)
    back = path.reversed()
    assert back.area == pytest.approx(-path.area, abs=1e-6)
    assert back.point_at(at * path.length) == pytest.approx(path.point_at(-at * path.length), abs=1e-5)


def test_a_piece_of_a_closed_path_goes_on_past_the_start() -> None:
    over = STADIUM.piece(STADIUM.length - 1, STADIUM.length + 3)
    assert over.length == pytest.approx(4)
    assert over.end == pytest.approx((3, 0))


def test_vertices_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(PlanError, match="not a number"):
        Polyline(np.array([[0.0, math.nan, 0.0]]))
    with pytest.raises(PlanError, match=r"shape \(n, 3\)"):
        Polyline(np.zeros((3, 2)))
