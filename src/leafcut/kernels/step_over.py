"""For each point of a path, find the largest empty disc next to it, and the other point that this disc touches."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.bands import Bands, band_at, first_point_right_of

#: Half of the side length of the search box around a disc's centre, as a multiple of the reach. It includes a margin
#: for rounding.
HALF = 0.5 + 1e-9


class Reaches(NamedTuple):
    """Distances in mm within which to search for a neighbour.

    They start at `least`, double each time, and end at `most`.
    """

    least: float
    most: float


@inner_kernel
def radius_of_smallest_touching_disc(bands: Bands, x: float, y: float, nx: float, ny: float, reach: float) -> float:
    """Compute the radius of the smallest disc that touches the tangent at (x, y) and also another point."""
    smallest, middle_x, middle_y, half = math.inf, x + 0.5 * reach * nx, y + 0.5 * reach * ny, HALF * reach
    for band in range(band_at(bands, middle_y - half), band_at(bands, middle_y + half) + 1):
        index = first_point_right_of(bands, band, middle_x - half)
        while index < bands.first[band + 1] and bands.x[index] <= middle_x + half:
            dx, dy = bands.x[index] - x, bands.y[index] - y
            height = dx * nx + dy * ny
            square = dx * dx + dy * dy
            if height > 0.0 and square <= reach * height:
                smallest = min(smallest, square / (2.0 * height))
            index += 1
    return smallest


@inner_kernel
def highest_touched_point(bands: Bands, x: float, y: float, nx: float, ny: float, reach: float, largest: float) -> int:
    """Return the index of the point highest above the tangent whose disc has at most the radius `largest`.

    If several points are equally high, the last of them is returned. `largest` is in mm and is at most half the reach.
    """
    highest, result = 0.0, -1
    middle_x, middle_y, half = x + 0.5 * reach * nx, y + 0.5 * reach * ny, HALF * reach
    for band in range(band_at(bands, middle_y - half), band_at(bands, middle_y + half) + 1):
        index = first_point_right_of(bands, band, middle_x - half)
        while index < bands.first[band + 1] and bands.x[index] <= middle_x + half:
            dx, dy = bands.x[index] - x, bands.y[index] - y
            height = dx * nx + dy * ny
            square = dx * dx + dy * dy
            higher = height > highest or (height == highest > 0.0 and bands.row[index] > bands.row[result])
            if higher and square <= reach * height and square / (2.0 * height) <= largest:
                highest, result = height, index
            index += 1
    return result


@kernel
def find_smallest_touching_discs(
    bands: Bands,
    x: NDArray,
    y: NDArray,
    nx: NDArray,
    ny: NDArray,
    reaches: Reaches,
    equal: float,
    height: NDArray,
    row: NDArray,
    radius: NDArray,
) -> None:
    """For each point p, find the smallest disc that touches the tangent at p and another point q.

    The disc lies on the side of the normal.

    The radius of the disc is (q − p)² / (2 n·(q − p)). The points within the reach determine all discs smaller than
    half the reach, so the search increases the reach until it finds a disc. If several discs have equal radii (within a
    relative tolerance), the disc whose q is highest above the tangent is used.

    ============ =========== ==============================================
    x, y, nx, ny float64[n]  points p, mm, and unit normals there
    equal        float       relative tolerance
    height       float64[n]  height of q above the tangent, mm; 0 if the search finds no q
    row          int64[n]    number of q
    radius       float64[n]  radius of the disc, mm
    ============ =========== ==============================================

    Changes: height, row, radius.
    """
    for i in range(len(x)):
        reach, previous = reaches.least, 0.0
        while reach > previous:
            smallest = radius_of_smallest_touching_disc(bands, x[i], y[i], nx[i], ny[i], reach)
            if smallest < math.inf:
                index = highest_touched_point(bands, x[i], y[i], nx[i], ny[i], reach, smallest * (1.0 + equal))
                dx, dy = bands.x[index] - x[i], bands.y[index] - y[i]
                height[i], row[i] = dx * nx[i] + dy * ny[i], bands.row[index]
                radius[i] = (dx * dx + dy * dy) / (2.0 * height[i])
                break
            previous, reach = reach, min(2.0 * reach, reaches.most)
