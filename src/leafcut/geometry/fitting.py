"""Convert points along a curve to few lines and arcs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline

#: Maximum bulge of an arc, slightly above a half circle, so that it is well-conditioned.
MAX_BULGE = 1.05
#: A fitted arc flatter than this is a line: over 100 mm it rises by half a micrometre.
FLAT = 1e-5


def fit_arcs(points: Points, tolerance: float, closed: bool = False) -> Polyline:
    """Return lines and arcs that pass within `tolerance` of all points and of the middles of their chords.

    Greedy: from each point the longest arc or line within the tolerance, ending at a point. A closed line starts at its
    sharpest corner. O(n log n).

    Parameters
    ----------
    points
        float64[n, 2], mm, dense in curves; the first is not repeated at the end of a closed line.
    """
    if closed:
        points = np.roll(points, -_sharpest(points), axis=0)
        points = np.concatenate([points, points[:1]])
    rows: list[tuple[float, float, float]] = []
    at, last = 0, len(points) - 1
    while at < last:
        to, bulge = _longest(points, at, tolerance, last - 1 if closed and at == 0 else last)
        rows.append((float(points[at, 0]), float(points[at, 1]), bulge))
        at = to
    if not closed:
        rows.append((float(points[-1, 0]), float(points[-1, 1]), 0.0))
    return Polyline(np.array(rows), closed)


def _sharpest(points: Points) -> int:
    """Return the index of the point of a ring with the largest change of direction."""
    ahead = np.roll(points, -1, axis=0) - points
    behind = np.roll(ahead, 1, axis=0)
    cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    dot = (behind * ahead).sum(axis=1)
    return int(np.argmax(np.abs(np.arctan2(cross, dot)).round(6)))


def _longest(points: Points, at: int, tolerance: float, last: int) -> tuple[int, float]:
    """Return the end of the longest segment from `at` (index ≤ `last`), and its bulge: doubling, then bisection."""
    good, bulge = at + 1, 0.0
    step, bad = 2, last + 1
    while at + step < bad:
        found = _fitted(points[at : at + step + 1], tolerance)
        if found is None:
            bad = at + step
        else:
            good, bulge = at + step, found
            step = min(2 * step, max(last - at, step + 1))
    while bad - good > 1:
        middle = (good + bad) // 2
        found = _fitted(points[at : middle + 1], tolerance) if middle - at > 1 else 0.0
        if found is None:
            bad = middle
        else:
            good, bulge = middle, found
    return good, bulge


def _fitted(points: Points, tolerance: float) -> float | None:
    """Return the bulge of the line or arc from the first to the last point that fits all points between, or None."""
    start, chord = points[0], points[-1] - points[0]
    length = float(np.hypot(*chord))
    if length <= tolerance:
        return None
    places = np.concatenate([points, 0.5 * (points[1:] + points[:-1])]) - start
    along, off = places @ chord / length, (places @ np.array([-chord[1], chord[0]])) / length
    if float(np.abs(off).max()) <= 0.5 * tolerance:
        return 0.0 if _goes_on(np.diff(along[: len(points)])) else None
    rise = _rise(along[: len(points)], off[: len(points)], length)
    bulge = -2.0 * rise / length
    if not FLAT < abs(bulge) <= MAX_BULGE:
        return None
    # The centre lies on the chord's bisector, (1 − b²)/4b of the chord to its left; distances of all points from it.
    cy = (1.0 - bulge * bulge) / (4.0 * bulge) * length
    radius = np.hypot(0.5 * length, cy)
    if float(np.abs(np.hypot(along - 0.5 * length, off - cy) - radius).max()) > tolerance:
        return None
    angles = np.unwrap(np.arctan2(off[: len(points)] - cy, along[: len(points)] - 0.5 * length))
    return bulge if _goes_on(np.diff(angles) * np.sign(bulge)) else None


def _rise(along: NDArray[np.float64], off: NDArray[np.float64], length: float) -> float:
    """Return the height of the arc above its chord, from the point nearest to the chord's bisector."""
    k = int(np.argmin(np.abs(along - 0.5 * length)))
    x, y = float(along[k]) - 0.5 * length, float(off[k])
    if y == 0.0:
        return 0.0
    # The circle through both ends and this point: centre (0, c), c = (x² + y² − (l/2)²) / 2y.
    half = 0.5 * length
    c = (x * x + y * y - half * half) / (2.0 * y)
    return float(c + np.sign(y) * np.hypot(half, c))


def _goes_on(steps: NDArray[np.float64]) -> bool:
    return bool((steps >= -1e-12).all())
