"""Type aliases for arrays and points in signatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: A point in the plane: x and y, mm unless stated otherwise.
Point = tuple[float, float]
#: A point in space: x, y and z, mm unless stated otherwise.
Point3 = tuple[float, float, float]
#: Points, float64[n, 2] (or [n, 3] with z).
Points = NDArray[np.float64]
#: Numbers of any shape.
Floats = NDArray[np.float64]
#: Numbers of nodes or clusters in kernels, such as orders and tours.
Ints = NDArray[np.int32]
#: Row indices for NumPy.
Indices = NDArray[np.int64]
#: Mask that selects rows.
Mask = NDArray[np.bool_]


def consecutive_segments(points: Points) -> Floats:
    """Return the straight segments between consecutive points, float64[n - 1, 2, …]."""
    return np.stack([points[:-1], points[1:]], axis=1)


def occurrence_keys(number: Indices) -> Indices:
    """Return a unique key for each row, based on its number and on how many earlier rows have the same number."""
    order = np.argsort(number, kind="stable")
    ordered = number[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-1))
    nth = np.arange(len(number)) - np.repeat(begins, np.diff(np.append(begins, len(number))))
    key = np.empty(len(number), dtype=np.int64)
    key[order] = ordered * (1 << 31) + nth
    return key
