"""Splines and ellipses against other evaluations of the same curves."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from ezdxf.math import BSpline

from leafcut.errors import PlanError
from leafcut.geometry.curves import bezier_points, ellipse_path, fit_arcs_to_curve, spline_points

CONTROL = np.array([(0, 0), (10, 30), (30, -20), (40, 20), (60, 0), (70, 25.0)])


def basis(k: int, degree: int, t: float, knots: np.ndarray) -> float:
    """Return the basis function N_k by its recursive definition (Cox and de Boor)."""
    if degree == 0:
        return 1.0 if knots[k] <= t < knots[k + 1] else 0.0
    total = 0.0
    if (low := knots[k + degree] - knots[k]) > 0:
        total += (t - knots[k]) / low * basis(k, degree - 1, t, knots)
    if (high := knots[k + degree + 1] - knots[k + 1]) > 0:
        total += (knots[k + degree + 1] - t) / high * basis(k + 1, degree - 1, t, knots)
    return total


@pytest.mark.parametrize("weights", [None, np.array([1, 2, 0.5, 3, 1, 1.0])])
@pytest.mark.parametrize(
    "knots", [[0, 0, 0, 0, 1, 2, 3, 3, 3, 3], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], [0, 0, 0, 0, 1, 1, 3, 3, 3, 3]]
)
def test_points_of_a_spline_lie_on_the_curve_of_its_definition(weights: np.ndarray | None, knots: list[float]) -> None:
    table = np.array(knots, dtype=float)
    points = spline_points(CONTROL, 3, table, weights, 0.001)
    heavy = np.ones(6) if weights is None else weights
    exact = []
    for t in np.linspace(table[3], table[6], 200, endpoint=False):
        share = np.array([basis(k, 3, t, table) for k in range(6)]) * heavy
        exact.append(share @ CONTROL / share.sum())
    assert shapely.distance(shapely.LineString(points), shapely.points(np.array(exact))).max() <= 0.0015


def test_points_of_a_spline_are_those_of_ezdxf() -> None:
    spline = BSpline(CONTROL, order=4)
    points = spline_points(CONTROL, 3, np.array(spline.knots()), None, 0.001)
    theirs = np.array([(p.x, p.y) for p in spline.flattening(0.0005)])
    assert shapely.hausdorff_distance(shapely.LineString(points), shapely.LineString(theirs), 0.01) <= 0.003


def test_a_bezier_curve_has_its_ends_and_its_middle() -> None:
    control = np.array([(0, 0), (0, 10), (20, 10), (20, 0.0)])
    points = bezier_points(control, 0.001)
    assert points[0] == pytest.approx((0, 0)) and points[-1] == pytest.approx((20, 0))
    assert np.abs(points - np.array([10, 7.5])).sum(axis=1).min() < 0.01
    path = fit_arcs_to_curve(points, 0.01, closed=False)
    assert path.n_segments < len(points) / 2


@pytest.mark.parametrize(
    "count, degree, knots, weights",
    [
        (3, 3, range(7), None),
        (4, 3, range(7), None),
        (4, 3, [0] * 8, None),
        (4, 99, range(104), None),
        (4, 3, [0, 0, 0, 0, 1, 1, 1, 1], [1, 0, 1, 1]),
        (4, 3, [0, 0, 0, 0, math.nan, 1, 1, 1], None),
    ],
)
def test_numbers_that_make_no_spline_are_refused(count: int, degree: int, knots: list[float], weights: object) -> None:
    table = None if weights is None else np.array(weights, dtype=float)
    with pytest.raises(PlanError):
        spline_points(CONTROL[:count], degree, np.array(list(knots), dtype=float), table, 0.01)


def test_a_circle_stays_a_circle_and_an_ellipse_becomes_arcs_within_the_tolerance() -> None:
    circle = ellipse_path((1, 2), (5, 0), (0, 5), 0.3, math.tau, 0.01)
    assert (circle.closed, circle.n_segments) == (True, 2)
    assert circle.area == pytest.approx(25 * math.pi)
    mirrored = ellipse_path((1, 2), (5, 0), (0, -5), 0.0, 0.5 * math.pi, 0.01)
    assert mirrored.end == pytest.approx((1, -3)) and mirrored.length == pytest.approx(2.5 * math.pi)
    assert mirrored.bulges[0] < 0
    ellipse = ellipse_path((0, 0), (40, 0), (0, 15), 0.0, math.tau, 0.01)
    t = np.linspace(0, math.tau, 1000)
    exact = shapely.points(40 * np.cos(t), 15 * np.sin(t))
    assert shapely.distance(shapely.LineString(ellipse.flattened(0.0005)), exact).max() <= 0.01
    assert 8 <= ellipse.n_segments <= 48
