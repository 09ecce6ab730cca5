"""Moving minimum along a path: a feed is reduced before and after the position that requires it."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats


def least_around(values: Floats, length: Floats, reach: float) -> Floats:
    """Return the minimum of the values within a distance along the path before and after every piece; lengths in mm."""
    middles = np.cumsum(length) - 0.5 * length
    first, last = (
        np.searchsorted(middles, middles - reach, side="left"),
        np.searchsorted(middles, middles + reach, side="right"),
    )
    # Minima of 2^k values by doubling; two overlapping ones cover any range.
    table = [values]
    while 2 << len(table) - 1 <= int((last - first).max(initial=1)):
        half, doubled = 1 << len(table) - 1, table[-1].copy()
        doubled[:-half] = np.minimum(doubled[:-half], table[-1][half:])
        table.append(doubled)
    powers = np.log2(np.maximum(last - first, 1)).astype(np.int64)
    result = np.empty_like(values)
    for k, minima in enumerate(table):
        same_power = powers == k
        result[same_power] = np.minimum(minima[first[same_power]], minima[last[same_power] - (1 << k)])
    return result
