"""The least of some values near every piece of a way: a feed gives way before and behind what it gives way to."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats


def least_around(values: Floats, length: Floats, reach: float) -> Floats:
    """Return the least of the values within a distance along the way before and behind every piece.

    Parameters
    ----------
    values, length
        Of every piece, in the order of the way; lengths and `reach` in mm.
    """
    at = np.cumsum(length) - 0.5 * length
    first, last = np.searchsorted(at, at - reach, side="left"), np.searchsorted(at, at + reach, side="right")
    # The least of 2^k values each, by doubling; two of them that overlap make any stretch.
    table = [values]
    while 2 << len(table) - 1 <= int((last - first).max(initial=1)):
        half, longer = 1 << len(table) - 1, table[-1].copy()
        longer[:-half] = np.minimum(longer[:-half], table[-1][half:])
        table.append(longer)
    powers = np.log2(np.maximum(last - first, 1)).astype(np.int64)
    around = np.empty_like(values)
    for k, least in enumerate(table):
        mine = powers == k
        around[mine] = np.minimum(least[first[mine]], least[last[mine] - (1 << k)])
    return around
