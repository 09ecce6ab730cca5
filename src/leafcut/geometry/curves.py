"""Convert B-splines, Bézier curves and ellipses to points or to a small number of arcs, within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Point, Points
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline

#: Maximum degree. The effort grows with the square of the degree.
MAX_DEGREE = 25
#: Maximum number of points of a curve.
MAX_POINTS = 200_000
#: Number of chords per knot span in the first pass, and the maximum number.
SAMPLE_CHORDS, MOST_CHORDS = 8, 1024

#: Maximum plausible coordinate, mm. Larger curves would take hours.
FARTHEST = 1e6

#: Callback that receives the number of points of a curve before they are processed. It can raise an error to refuse the
#: curve.
Spend = Callable[[int], None]
#: Maximum difference between the half axes of a circle, mm (or a millionth of their length).
ROUND = 1e-3


def accept_any_point_count(_: int) -> None:
    """Accept any number of points. This function is the default for `spend`."""


def spline_points(control: Floats, degree: int, knots: Floats, weights: Floats | None, tolerance: float) -> Points:
    """Return points along a B-spline, with a chord error of about `tolerance`. With `weights`, the spline is rational.

    The function only evaluates the domain of the spline, knots[degree] … knots[n]. The knots therefore do not need to
    be repeated at the ends.

    Parameters
    ----------
    control
        Control points, float64[n, 2 or 3]. The third coordinate is ignored.
    knots
        Non-decreasing knots, float64[n + degree + 1].

    Raises
    ------
    PlanError
        The numbers do not define a spline.

    Source: Piegl and Tiller, The NURBS Book, 2nd edition, equations 2.5 and 4.1; evaluated by de Boor's algorithm.
    """
    n = len(control)
    if not 1 <= degree <= MAX_DEGREE or n <= degree or len(knots) != n + degree + 1:
        raise PlanError("{} control points, {} knots and degree {} do not define a spline", n, len(knots), degree)
    positive_weights = np.ones(n) if weights is None else np.asarray(weights, dtype=np.float64)
    if len(positive_weights) != n or not (positive_weights > 0.0).all() or not np.isfinite(positive_weights).all():
        raise PlanError("the weights of a spline must be positive, one per control point")
    if not (np.isfinite(control).all() and np.isfinite(knots).all() and (np.diff(knots) >= 0.0).all()):
        raise PlanError("a spline has a number that is not finite, or decreasing knots")
    homogeneous = np.column_stack([control[:, :2] * positive_weights[:, None], positive_weights])
    spans = np.flatnonzero(np.diff(knots[degree : n + 1]) > 0.0) + degree
    if not len(spans):
        raise PlanError("a spline has no length: all its knots are equal")
    sample = _evaluate_spans(homogeneous, degree, knots, spans, SAMPLE_CHORDS)
    chords = 1.0 if degree == 1 else _chords_needed(sample, tolerance)
    counts = np.broadcast_to(chords, len(spans)).astype(np.int64)
    if int(counts.sum()) > MAX_POINTS:
        raise PlanError("a spline needs more than {:,} points", MAX_POINTS)
    pieces: list[Points] = [np.zeros((0, 2))] * len(spans)
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        for index, points in zip(
            chosen, _evaluate_spans(homogeneous, degree, knots, spans[chosen], int(count)), strict=True
        ):
            pieces[index] = points[:-1]
    end = _evaluate_spans(homogeneous, degree, knots, spans[-1:], 1)[0][-1:]
    return np.concatenate([*pieces, end])


def _chords_needed(sample: Floats, tolerance: float) -> Floats:
    """Return the number of chords for each knot span, which is a power of two.

    The chord error decreases with the square of this number.
    """
    middles = 0.5 * (sample[:, :-2] + sample[:, 2:])
    # The height over a chord of two steps is four times the height over one step.
    height = np.hypot(*np.moveaxis(sample[:, 1:-1] - middles, -1, 0)).max(axis=1) / 4.0
    counts = np.ceil(SAMPLE_CHORDS * np.sqrt(height / tolerance))
    # With powers of two, the spans form few groups.
    powers: Floats = 2.0 ** np.ceil(np.log2(np.clip(counts, 4, MOST_CHORDS)))
    return powers


def _evaluate_spans(homogeneous: Floats, degree: int, knots: Floats, spans: NDArray[np.int64], count: int) -> Floats:
    """Evaluate equally spaced points in each knot span by de Boor's algorithm, float64[spans, count + 1, 2]."""
    start, end = knots[spans], knots[spans + 1]
    t = start[:, None] + (end - start)[:, None] * np.linspace(0.0, 1.0, count + 1)
    d = [np.repeat(homogeneous[spans - degree + j][:, None, :], count + 1, axis=1) for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low, high = knots[j + spans - degree], knots[j + 1 + spans - r]
            share = ((t - low[:, None]) / (high - low)[:, None])[:, :, None]
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    points: Floats = d[degree][:, :, :2] / d[degree][:, :, 2:]
    return points


def bezier_points(control: Floats, tolerance: float) -> Points:
    """Return points along the Bézier curve with the control points `control`, float64[n, 2]."""
    degree = len(control) - 1
    knots = np.repeat([0.0, 1.0], degree + 1)
    return spline_points(control, degree, knots, None, tolerance)


def ellipse_path(
    center: Point,
    u: Point,
    v: Point,
    start: float,
    sweep: float,
    tolerance: float,
    spend: Spend = accept_any_point_count,
) -> Polyline:
    """Return arcs along the curve centre + u·cos(t) + v·sin(t), where t runs from `start` over `sweep` (rad).

    A full turn gives a closed path. If u and v are perpendicular and have equal lengths, the result is an exact
    circular arc. Otherwise, the arcs stay within `tolerance` mm of the ellipse.

    Raises
    ------
    PlanError
        A coordinate is out of range. `spend` may also raise an error.
    """
    cross = u[0] * v[1] - u[1] * v[0]
    even, odd = math.hypot(u[0] + v[1], u[1] - v[0]) / 2.0, math.hypot(u[0] - v[1], u[1] + v[0]) / 2.0
    large, small = even + odd, abs(even - odd)
    closed = abs(abs(sweep) - math.tau) < 1e-9
    is_circle = large - small <= min(max(ROUND, 1e-6 * large), 0.5 * large)
    if is_circle:
        count = max(math.ceil(abs(sweep) / (math.pi * (1.0 + 1e-9))), 1)
    else:
        step = 2.0 * math.acos(max(1.0 - 0.25 * tolerance / max(large, tolerance), 0.0))
        count = min(max(math.ceil(abs(sweep) / step), 8), MAX_POINTS)
    t = start + sweep * np.linspace(0.0, 1.0, count + 1)
    points: Points = np.array(center) + np.outer(np.cos(t), u) + np.outer(np.sin(t), v)
    if not is_circle:
        return fit_arcs_to_curve(points, tolerance, closed, spend)
    bulges = np.full(count + 1, math.copysign(math.tan(0.25 * abs(sweep) / count), cross * sweep))
    rows = np.column_stack([points, bulges])
    if closed:
        return Polyline(rows[:-1], closed=True)
    rows[-1, 2] = 0.0
    return Polyline(rows)


def fit_arcs_to_curve(
    points: Points, tolerance: float, closed: bool, spend: Spend = accept_any_point_count
) -> Polyline:
    """Fit arcs to points that lie within a quarter of `tolerance` of a curve.

    If the curve is closed, the last point must equal the first point.

    Raises
    ------
    PlanError
        A coordinate is out of range. `spend` may also raise an error.
    """
    if not np.abs(points).max(initial=0.0) <= FARTHEST:
        raise PlanError("coordinates or radius out of range")

    spend(len(points))
    return fit_arcs(points[:-1] if closed else points, 0.7 * tolerance, closed)
