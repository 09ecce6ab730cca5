"""Sort points into horizontal bands so that the points in a box or near a segment can be looked up quickly."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel


class Bands(NamedTuple):
    """n points in m bands, lowest band first. Within each band, the points are sorted by x.

    ===== ============ ========================================================
    x, y  float64[n]   the points, mm
    row   int64[n]     number of each point before sorting
    first int64[m + 1] first point of each band; n at the end
    low   float        lower edge of the lowest band, mm
    side  float        height of a band, mm
    ===== ============ ========================================================
    """

    x: NDArray
    y: NDArray
    row: NDArray
    first: NDArray
    low: float
    side: float


@inner_kernel
def band_at(bands: Bands, y: float) -> int:
    """Return the number of the band at height y. If no band is at that height, return the nearest band."""
    return int(min(max(math.floor((y - bands.low) / bands.side), 0.0), len(bands.first) - 2.0))


@inner_kernel
def first_point_right_of(bands: Bands, band: int, x: float) -> int:
    """Return the index of the first point in a band whose x coordinate is at least `x`.

    If the band has no such point, return the start of the next band.
    """
    low, high = bands.first[band], bands.first[band + 1]
    while low < high:
        middle = (low + high) // 2
        if bands.x[middle] < x:
            low = middle + 1
        else:
            high = middle
    return int(low)


@inner_kernel
def distance_to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Compute the distance from a point to the segment a–b."""
    length2 = (bx - ax) * (bx - ax) + (by - ay) * (by - ay)
    share = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length2 if length2 > 0.0 else 0.0
    if share <= 0.0:
        return math.sqrt((x - ax) * (x - ax) + (y - ay) * (y - ay))
    if share >= 1.0:
        return math.sqrt((x - bx) * (x - bx) + (y - by) * (y - by))
    return abs(((ay - y) * (bx - ax) - (ax - x) * (by - ay)) / length2) * math.sqrt(length2)


@kernel
def list_points_near_segments(
    points: Bands, limit: NDArray, max_limit: float, start: NDArray, end: NDArray, count: NDArray, rows: NDArray
) -> int:
    """For each segment of a path, count the nearby points. List them if there is enough space.

    Each point has its own distance limit.

    =========== ============= =======================================================
    limit       float64[n]    maximum distance of each point from a segment, mm
    max_limit   float         largest limit, mm
    start, end  float64[m, 2] ends of each segment, mm
    count       int64[m]      points per segment
    rows        int64[k]      points, segment by segment, in band order
    =========== ============= =======================================================

    Changes: count, rows. Returns the sum of `count`.
    """
    total = 0
    for i in range(len(start)):
        ax, ay, bx, by = start[i, 0], start[i, 1], end[i, 0], end[i, 1]
        first = total
        for band in range(band_at(points, min(ay, by) - max_limit), band_at(points, max(ay, by) + max_limit) + 1):
            at = first_point_right_of(points, band, min(ax, bx) - max_limit)
            while at < points.first[band + 1] and points.x[at] <= max(ax, bx) + max_limit:
                if distance_to_segment(points.x[at], points.y[at], ax, ay, bx, by) <= limit[points.row[at]]:
                    if total < len(rows):
                        rows[total] = points.row[at]
                    total += 1
                at += 1
        count[i] = total - first
    return total
