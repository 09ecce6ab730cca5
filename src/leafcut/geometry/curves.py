"""Convert B-splines, Bézier curves and ellipses to points or to a few arcs, within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Point, Points
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline

#: Maximum degree; the effort grows with its square.
MAX_DEGREE = 25
#: Maximum number of points of a curve.
MAX_POINTS = 200_000
#: Number of chords per knot span in the first pass, and maximum number.
SAMPLE_CHORDS, MOST_CHORDS = 8, 1024

#: Maximum plausible coordinate, mm; larger curves would take hours.
FARTHEST = 1e6

#: Callback that receives the number of points of a curve before they are processed. It may raise an error to refuse the
#: curve.
Spend = Callable[[int], None]
#: Maximum difference between the half axes of a circle, mm (or a millionth of their length).
ROUND = 1e-3


def allow_any_number(_: int) -> None:
    """Accept any number of points. This is the default of `spend`."""


def spline_points(control: Floats, degree: int, knots: Floats, weights: Floats | None, tolerance: float) -> Points:
    """Return points along a B-spline, which is rational if `weights` are given; the chord error is about `tolerance`.

    Only the domain of the spline, knots[degree] … knots[n], is evaluated, so knots need not be repeated at the ends.

    `control` is float64[n, 2 or 3]; the third coordinate is ignored. `knots` is float64[n + degree + 1],
    non-decreasing.

    Raises
    ------
    PlanError
        The numbers define no spline.

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
    sample = _evaluate(homogeneous, degree, knots, spans, SAMPLE_CHORDS)
    chords = 1.0 if degree == 1 else _chords_needed(sample, tolerance)
    counts = np.broadcast_to(chords, len(spans)).astype(np.int64)
    if int(counts.sum()) > MAX_POINTS:
        raise PlanError("a spline needs more than {:,} points", MAX_POINTS)
    pieces: list[Points] = [np.zeros((0, 2))] * len(spans)
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        for index, points in zip(chosen, _evaluate(homogeneous, degree, knots, spans[chosen], int(count)), strict=True):
            pieces[index] = points[:-1]
    end = _evaluate(homogeneous, degree, knots, spans[-1:], 1)[0][-1:]
    return np.concatenate([*pieces, end])


def _chords_needed(sample: Floats, tolerance: float) -> Floats:
    """Return the number of chords for each knot span, a power of two.

    The chord error decreases with the square of the number of chords.
    """
    middles = 0.5 * (sample[:, :-2] + sample[:, 2:])
    # The height over a chord of two steps is four times the height over one step.
    height = np.hypot(*np.moveaxis(sample[:, 1:-1] - middles, -1, 0)).max(axis=1) / 4.0
    counts = np.ceil(SAMPLE_CHORDS * np.sqrt(height / tolerance))
    # With powers of two, the spans form few groups.
    powers: Floats = 2.0 ** np.ceil(np.log2(np.clip(counts, 4, MOST_CHORDS)))
    return powers


def _evaluate(homogeneous: Floats, degree: int, knots: Floats, spans: NDArray[np.int64], count: int) -> Floats:
    """Return equally spaced points of each knot span, computed by de Boor's algorithm, float64[spans, count + 1, 2]."""
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
    """Return points along a Bézier curve, float64[n, 2]; `control` contains its control points."""
    degree = len(control) - 1
    knots = np.repeat([0.0, 1.0], degree + 1)
    return spline_points(control, degree, knots, None, tolerance)


def ellipse_path(
    center: Point, u: Point, v: Point, start: float, sweep: float, tolerance: float, spend: Spend = allow_any_number
) -> Polyline:
    """Return the curve centre + u·cos(t) + v·sin(t) as arcs, for t from `start` over `sweep` (rad).

    A full turn gives a closed path. If u and v have equal lengths and are perpendicular, the result is an exact
    circular arc. Otherwise its arcs lie within `tolerance` mm of the ellipse.

    Raises
    ------
    PlanError
        A coordinate is out of range; also any error of `spend`.
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


def fit_arcs_to_curve(points: Points, tolerance: float, closed: bool, spend: Spend = allow_any_number) -> Polyline:
    """Fit arcs to points that lie within a quarter of `tolerance` of a curve.

    In a closed curve, the last point equals the first point.

    Raises
    ------
    PlanError
        A coordinate is out of range; also any error of `spend`.
    """
    if not np.abs(points).max(initial=0.0) <= FARTHEST:
        raise PlanError("coordinates or radius out of range")

    spend(len(points))
    return fit_arcs(points[:-1] if closed else points, 0.7 * tolerance, closed)
