"""Places of the plane in horizontal bands: all in a box are found without looking at the others."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import part


class Bands(NamedTuple):
    """n places in m bands, the lowest band first, by x within a band.

    ===== ============ ========================================================
    x, y  float64[n]   the places, mm
    row   int64[n]     the number of each before they were sorted
    first int64[m + 1] the first place of each band; at the end n
    low   float        where the lowest band begins, mm
    side  float        height of a band, mm
    ===== ============ ========================================================
    """

    x: NDArray
    y: NDArray
    row: NDArray
    first: NDArray
    low: float
    side: float


@part
def band_at(bands: Bands, y: float) -> int:
    """Return the band at a height y, or the nearest one."""
    return int(min(max(math.floor((y - bands.low) / bands.side), 0.0), len(bands.first) - 2.0))


@part
def from_left(bands: Bands, band: int, x: float) -> int:
    """Return the first place of a band that is not to the left of x, or where the next band begins."""
    low, high = bands.first[band], bands.first[band + 1]
    while low < high:
        middle = (low + high) // 2
        if bands.x[middle] < x:
            low = middle + 1
        else:
            high = middle
    return int(low)
