"""Arcs and ellipses of blocks in top view: axes and angles, computed from their points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.read.dxf_shapes import Curve, arc_span_in_top_view, half_axes, is_parallel_to_plate


def curve(angle: float, mirrored: bool, start: float, sweep: float, ratio: float = 1.0) -> Curve:
    u = (3 * math.cos(angle), 3 * math.sin(angle), 0.0)
    side = -3.0 * ratio if mirrored else 3.0 * ratio
    return Curve((1.0, 2.0, 0.0), u, (-side * math.sin(angle), side * math.cos(angle), 0.0), start, sweep)


def direction(one: Curve, parameter: float) -> float:
    """Return the angle from the centre to the point at a parameter."""
    x, y = (u * math.cos(parameter) + v * math.sin(parameter) for u, v in zip(one.u[:2], one.v[:2], strict=True))
    return math.atan2(y, x)


@pytest.mark.parametrize("angle", [0.0, 0.7, 3.5])
@pytest.mark.parametrize(("start", "sweep"), [(0.0, 1.0), (0.4, 2.0), (5.0, 3.0)])
def test_an_arc_goes_counter_clockwise_in_top_view(angle: float, start: float, sweep: float) -> None:
    """A mirrored arc starts at its other end."""
    for mirrored, first in ((False, start), (True, start + sweep)):
        one = curve(angle, mirrored, start, sweep)
        found, turned = arc_span_in_top_view(one)
        assert math.remainder(found - direction(one, first), math.tau) == pytest.approx(0, abs=1e-9)
        last = direction(one, start + sweep if first == start else start)
        assert math.remainder(found + turned - last, math.tau) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_half_axes_of_an_ellipse_are_its_singular_values(seed: int) -> None:
    u, v = np.random.default_rng(seed).uniform(-5, 5, (2, 3))
    one = Curve((0.0, 0.0, 0.0), tuple(u), tuple(v), 0.0, math.tau)
    assert half_axes(one) == pytest.approx(np.linalg.svd(np.stack([u[:2], v[:2]]), compute_uv=False))


def test_a_curve_that_leans_is_not_flat() -> None:
    flat = curve(0.3, False, 0.0, 1.0)
    assert is_parallel_to_plate(flat)
    assert not is_parallel_to_plate(Curve(flat.center, (3.0, 0.0, 0.1), flat.v, 0.0, 1.0))
    assert not is_parallel_to_plate(Curve(flat.center, flat.u, (0.0, 3.0, -0.1), 0.0, 1.0))
