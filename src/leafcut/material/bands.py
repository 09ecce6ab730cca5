"""Sort points into horizontal bands, so that kernels can look up nearby points quickly."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats, Indices
from leafcut.kernels.bands import Bands, list_points_near_segments


def sort_into_bands(points: Floats, side: float) -> Bands:
    """Sort points, float64[n, 2], into bands with a height of `side`, mm.

    If there would be more bands than points, wider bands are used.
    """
    x, y = points.T
    low, high = float(y.min()), float(y.max())
    side = max(side, (high - low) / len(points))
    band = np.floor((y - low) / side).astype(np.int64)
    order = np.lexsort((x, band))
    first = np.searchsorted(band[order], np.arange(int(band.max()) + 2))
    return Bands(x[order], y[order], order, first, low, side)


def segment_point_pairs_within(start: Floats, end: Floats, points: Floats, limits: Floats) -> tuple[Indices, Indices]:
    """Find all pairs of a segment and a point whose distance is within the limit of the point.

    Parameters
    ----------
    start, end
        End points of the segments, float64[m, 2], mm.
    points
        Points, float64[n, 2], mm.
    limits
        Maximum distance of each point, float64[n], mm.

    Returns
    -------
    segments, points
        Indices of the segments, in ascending order, and indices of the points.
    """
    count, rows = np.zeros(len(start), np.int64), np.zeros(0, np.int64)
    if len(start) and len(points):
        limit = float(limits.max())
        bands = sort_into_bands(points, 0.5 * limit)
        while (total := list_points_near_segments(bands, limits, limit, start, end, count, rows)) > len(rows):
            rows = np.zeros(total, np.int64)
    return np.repeat(np.arange(len(start)), count), rows
