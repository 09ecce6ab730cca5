"""Lines and arcs through noisy points: the fewest that explain them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.geometry.arrays import Points
from leafcut.geometry.best_fit import circle_fit_error, fit_outline, line_fit_error, running_moments
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.tracing import trace_level_lines

RNG = np.random.default_rng(5)


def noisy(path: Polyline, sigma: float) -> Points:
    """Return points about 1 apart along a closed path, off by a normal deviation."""
    places = np.arange(0.0, path.length - 0.5, 1.0)
    points = np.array([path.point_at(s) for s in places])
    return points + RNG.normal(0.0, sigma, points.shape)


def test_a_circle_is_found_with_its_centre_and_radius() -> None:
    points = noisy(Polyline.circle(30.0, -20.0, 100.0), 0.1)
    found = fit_outline(points, np.full(len(points), 0.1))
    assert found is not None
    assert found.n_segments == 2
    arc = found.segment(0)
    assert (*arc.center, arc.radius) == pytest.approx((30.0, -20.0, 100.0), abs=0.1)


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_slot_is_two_lines_and_two_half_circles(clockwise: bool) -> None:
    slot = Polyline(np.array([[0.0, 0.0, 0.0], [90.0, 0.0, 1.0], [90.0, 50.0, 0.0], [0.0, 50.0, 1.0]]), closed=True)
    slot = slot.turned(0.3).reversed() if clockwise else slot.turned(0.3)
    points = noisy(slot, 0.15)
    found = fit_outline(points, np.full(len(points), 0.15))
    assert found is not None
    assert found.n_segments == 4
    assert found.area == pytest.approx(slot.area, rel=4e-3)
    assert found.length == pytest.approx(slot.length, rel=4e-3)


def test_corners_are_where_the_lines_meet() -> None:
    corners = [(0.0, 0.0), (120.0, 10.0), (100.0, 90.0), (-20.0, 70.0)]
    points = noisy(Polyline.of_points(corners, closed=True), 0.1)
    found = fit_outline(points, np.full(len(points), 0.1))
    assert found is not None
    assert found.n_segments == 4
    for corner in corners:
        assert np.hypot(*(found.vertices[:, :2] - corner).T).min() <= 0.15


def test_too_few_points_and_a_line_there_and_back_are_no_path() -> None:
    assert fit_outline(np.zeros((2, 2)), np.ones(2)) is None
    there = np.column_stack([np.arange(20.0), np.zeros(20)])
    flat = fit_outline(np.concatenate([there, there[::-1]]), np.full(40, 0.3))
    assert flat is None or abs(flat.area) < 1e-6


def test_the_moments_give_the_distances_from_the_best_line_and_circle() -> None:
    angles = np.linspace(0.3, 2.0, 60)
    points = np.column_stack([50.0 * np.cos(angles), 50.0 * np.sin(angles)]) + RNG.normal(0.0, 0.1, (60, 2))
    m = running_moments((points - points[0])[None], np.ones((1, 60)))
    smaller = np.linalg.eigvalsh(np.cov(points.T, bias=True))[0]
    assert line_fit_error(m)[0, -1] == pytest.approx(smaller, rel=1e-9)
    off, x, y, radius = (float(t[0, -1]) for t in circle_fit_error(m))
    center = np.array([x, y]) + points.mean(axis=0)
    distances = np.hypot(*(points - center).T) - radius
    assert off == pytest.approx(float((distances**2).mean()), rel=0.02)
    assert (*center, radius) == pytest.approx((0.0, 0.0, 50.0), abs=0.6)


def test_level_lines_lie_in_the_middle_between_dark_and_bright_pixels() -> None:
    height = np.ones((6, 8), np.float32)
    height[2:4, 3:6] = -1.0
    (line,) = trace_level_lines(height)
    assert (line.min(axis=0).tolist(), line.max(axis=0).tolist()) == ([3.0, 2.0], [6.0, 4.0])
    height[2:4, 6] = 0.5  # a third of the way further to the right: −1 at 5.5, 0 at 6.1667, 0.5 at 6.5
    (line,) = trace_level_lines(height)
    assert line[:, 0].max() == pytest.approx(5.5 + 1.0 / 1.5, abs=1e-6)
    assert math.isclose(line[:, 0].min(), 3.0)
