"""Find the largest empty discs next to a path, and the point where each of them touches the path again."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import kernel, part
from leafcut.kernels.bands import Bands, band_at, first_right_of

#: Search radius around the centre of a disc, as a multiple of the reach, with a margin for rounding.
HALF = 0.5 + 1e-9


class Reaches(NamedTuple):
    """Search distance for a neighbour, mm: it starts at `least`, doubles each time, and ends at `most`."""

    least: float
    most: float


@part
def smallest_disc(bands: Bands, x: float, y: float, nx: float, ny: float, reach: float) -> float:
    """Return the radius of the smallest disc that touches the tangent at (x, y) and passes through a point of the
    bands.
    """
    smallest, middle_x, middle_y, half = math.inf, x + 0.5 * reach * nx, y + 0.5 * reach * ny, HALF * reach
    for band in range(band_at(bands, middle_y - half), band_at(bands, middle_y + half) + 1):
        index = first_right_of(bands, band, middle_x - half)
        while index < bands.first[band + 1] and bands.x[index] <= middle_x + half:
            dx, dy = bands.x[index] - x, bands.y[index] - y
            height = dx * nx + dy * ny
            square = dx * dx + dy * dy
            if height > 0.0 and square <= reach * height:
                smallest = min(smallest, square / (2.0 * height))
            index += 1
    return smallest


@part
def highest_touched(bands: Bands, x: float, y: float, nx: float, ny: float, reach: float, largest: float) -> int:
    """Return the index of the point that is highest above the tangent and whose disc is small enough. Of equally high
    points, return the last.

    largest radius of the disc, mm, at most half the reach
    """
    highest, result = 0.0, -1
    middle_x, middle_y, half = x + 0.5 * reach * nx, y + 0.5 * reach * ny, HALF * reach
    for band in range(band_at(bands, middle_y - half), band_at(bands, middle_y + half) + 1):
        index = first_right_of(bands, band, middle_x - half)
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
def find_neighbours(
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
    """For each point, find the smallest disc that touches its tangent, on the side of its normal, and another point.

    A disc through q that touches the tangent at p has the radius (q − p)² / (2 n·(q − p)). The points q within the
    reach determine all discs smaller than half the reach, so the reach grows until a disc is found. Among discs with
    equal radii (within a relative tolerance), the disc with the highest q above the tangent is used.

    ============ =========== ==============================================
    x, y, nx, ny float64[n]  points p, mm, and unit normals there
    equal        float       relative tolerance
    height       float64[n]  height of q above the tangent, mm; 0 if none is found
    row          int64[n]    number of q
    radius       float64[n]  radius of the disc, mm
    ============ =========== ==============================================

    Changes: height, row, radius.
    """
    for i in range(len(x)):
        reach, previous = reaches.least, 0.0
        while reach > previous:
            smallest = smallest_disc(bands, x[i], y[i], nx[i], ny[i], reach)
            if smallest < math.inf:
                index = highest_touched(bands, x[i], y[i], nx[i], ny[i], reach, smallest * (1.0 + equal))
                dx, dy = bands.x[index] - x[i], bands.y[index] - y[i]
                height[i], row[i] = dx * nx[i] + dy * ny[i], bands.row[index]
                radius[i] = (dx * dx + dy * dy) / (2.0 * height[i])
                break
            previous, reach = reach, min(2.0 * reach, reaches.most)
