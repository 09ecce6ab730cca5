"""Points become lines and arcs that are true to them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline


def test_the_chords_of_a_stadium_become_its_lines_and_arcs_again() -> None:
    stadium = Polyline(np.array([[0.0, 0, 0], [10, 0, 1], [10, 4, 0], [0, 4, 1]]), closed=True)
    again = fit_arcs(stadium.flattened(0.001)[:-1], 0.005, closed=True)
    assert again.n_segments <= 6
    assert again.area == pytest.approx(stadium.area, abs=0.01 * stadium.length)


def test_corners_and_straight_lines_stay_what_they_are() -> None:
    square = np.array([(0.0, 0), (5, 0), (10, 0), (10, 10), (0, 10)])
    fitted = fit_arcs(square, 0.01, closed=True)
    assert fitted.n_segments == 4
    assert fitted.area == 100.0


def test_an_open_curve_keeps_its_ends() -> None:
    t = np.linspace(0, 2 * math.pi, 400)
    wave = np.column_stack([10 * t, 5 * np.sin(t)])
    fitted = fit_arcs(wave, 0.01)
    assert fitted.start == tuple(wave[0]) and fitted.end == tuple(wave[-1])
    assert fitted.n_segments < 40
    gaps = shapely.distance(shapely.LineString(fitted.flattened(0.0005)), shapely.points(wave))
    assert gaps.max() <= 0.011


@given(
    st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30)), min_size=2, max_size=30, unique=True),
    st.sampled_from([0.001, 0.1, 3.0]),
)
def test_whatever_the_points_are_the_fit_passes_within_the_tolerance_of_each(
    rows: list[tuple[float, float]], tolerance: float
) -> None:
    points = np.array(rows)
    fitted = fit_arcs(points, tolerance)
    line = shapely.LineString(fitted.flattened(tolerance / 50))
    assert shapely.distance(line, shapely.points(points)).max() <= 1.1 * tolerance + 1e-9
