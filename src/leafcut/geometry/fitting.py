"""Fit a small number of lines and arcs to points along a curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline

#: Maximum bulge of a fitted arc. It slightly exceeds a half circle, so that the fit is well-conditioned.
MAX_BULGE = 1.05
#: Minimum bulge of a fitted arc. An arc with a smaller bulge becomes a line: over 100 mm, it rises by half a
#: micrometre.
FLAT = 1e-5


def fit_arcs(points: Points, tolerance: float, closed: bool = False) -> Polyline:
    """Fit lines and arcs that stay within `tolerance` of all points and of the midpoints between neighbouring points.

    The greedy algorithm always uses the longest line or arc that ends at a point and stays within the tolerance. A
    closed line starts at its sharpest corner. The run time is O(n log n).

    `points` is float64[n, 2], mm. Curves need closely spaced points. A closed line does not repeat its first point.
    """
    if closed:
        points = np.roll(points, -_sharpest_corner(points), axis=0)
        points = np.concatenate([points, points[:1]])
    rows: list[tuple[float, float, float]] = []
    start, last = 0, len(points) - 1
    while start < last:
        stop, bulge = _longest_segment(points, start, tolerance, last - 1 if closed and start == 0 else last)
        rows.append((float(points[start, 0]), float(points[start, 1]), bulge))
        start = stop
    if not closed:
        rows.append((float(points[-1, 0]), float(points[-1, 1]), 0.0))
    return Polyline(np.array(rows), closed)


def _sharpest_corner(points: Points) -> int:
    forward = np.roll(points, -1, axis=0) - points
    backward = np.roll(forward, 1, axis=0)
    cross = backward[:, 0] * forward[:, 1] - backward[:, 1] * forward[:, 0]
    dot = (backward * forward).sum(axis=1)
    return int(np.argmax(np.abs(np.arctan2(cross, dot)).round(6)))


def _longest_segment(points: Points, start: int, tolerance: float, last: int) -> tuple[int, float]:
    """Fit the longest possible line or arc to the points from `start` to `last`. Return its end index and its bulge.

    The function finds the end by doubling and bisection.
    """
    good, bulge = start + 1, 0.0
    step, bad = 2, last + 1
    while start + step < bad:
        candidate = _fitted_bulge(points[start : start + step + 1], tolerance)
        if candidate is None:
            bad = start + step
        else:
            good, bulge = start + step, candidate
            step = min(2 * step, max(last - start, step + 1))
    while bad - good > 1:
        middle = (good + bad) // 2
        candidate = _fitted_bulge(points[start : middle + 1], tolerance) if middle - start > 1 else 0.0
        if candidate is None:
            bad = middle
        else:
            good, bulge = middle, candidate
    return good, bulge


def _fitted_bulge(points: Points, tolerance: float) -> float | None:
    """Return the bulge of an arc from the first to the last point that fits all other points.

    Return None if no arc fits.
    """
    start, chord = points[0], points[-1] - points[0]
    length = float(np.hypot(*chord))
    if length <= tolerance:
        return None
    offsets = np.concatenate([points, 0.5 * (points[1:] + points[:-1])]) - start
    along, off = offsets @ chord / length, (offsets @ np.array([-chord[1], chord[0]])) / length
    if float(np.abs(off).max()) <= 0.5 * tolerance:
        return 0.0 if _is_monotonic(np.diff(along[: len(points)])) else None
    rise = _arc_height(along[: len(points)], off[: len(points)], length)
    bulge = -2.0 * rise / length
    if not FLAT < abs(bulge) <= MAX_BULGE:
        return None
    # The centre lies on the chord's bisector, to the left of the chord by (1 − b²)/4b of its length.
    cy = (1.0 - bulge * bulge) / (4.0 * bulge) * length
    radius = np.hypot(0.5 * length, cy)
    if float(np.abs(np.hypot(along - 0.5 * length, off - cy) - radius).max()) > tolerance:
        return None
    angles = np.unwrap(np.arctan2(off[: len(points)] - cy, along[: len(points)] - 0.5 * length))
    return bulge if _is_monotonic(np.diff(angles) * np.sign(bulge)) else None


def _arc_height(along: NDArray[np.float64], off: NDArray[np.float64], length: float) -> float:
    """Return the height of the arc above its chord, computed from the point closest to the perpendicular bisector."""
    k = int(np.argmin(np.abs(along - 0.5 * length)))
    x, y = float(along[k]) - 0.5 * length, float(off[k])
    if y == 0.0:
        return 0.0
    # The circle through both ends and this point: centre (0, c), c = (x² + y² − (l/2)²) / 2y.
    half = 0.5 * length
    c = (x * x + y * y - half * half) / (2.0 * y)
    return float(c + np.sign(y) * np.hypot(half, c))


def _is_monotonic(steps: NDArray[np.float64]) -> bool:
    return bool((steps >= -1e-12).all())
