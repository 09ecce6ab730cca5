"""The Pareto front of three quantities to minimise."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from leafcut.geometry.arrays import Floats, Indices, Mask


def non_dominated(values: Floats) -> Mask:
    """Return a mask of the rows of `values`, finite float64[n, 3], that no other row dominates.

    A row dominates another row if none of its three numbers is larger, and at least one is smaller. Equal rows do not
    dominate each other, so either all or none of them are on the front. The rows are sorted by their first number, and
    the front of the other two numbers is a staircase, which takes O(n log n).

    Source: H. T. Kung, F. Luccio and F. P. Preparata, On Finding the Maxima of a Set of Vectors, J. ACM 22 (1975), for
    three dimensions.
    """
    order: Indices = np.lexsort(values.T[::-1])
    rows = values[order]
    new = np.append(True, (rows[1:] != rows[:-1]).any(axis=1))[: len(rows)]
    kept = np.array(_staircase(rows[new].tolist()), dtype=bool)
    mask = np.zeros(len(values), dtype=bool)
    if len(rows):
        mask[order] = kept[np.cumsum(new) - 1]
    return mask


def _staircase(rows: list[list[float]]) -> list[bool]:
    """Return for each row whether no earlier row dominates it; the rows are distinct and in lexical order."""
    seconds: list[float] = []  # ascending
    thirds: list[float] = []  # descending: the smallest third number of all rows whose second is no larger
    kept: list[bool] = []
    for _, second, third in rows:
        index = bisect_right(seconds, second)
        dominated = index > 0 and thirds[index - 1] <= third
        kept.append(not dominated)
        if dominated:
            continue
        start = index - 1 if index > 0 and seconds[index - 1] == second else index
        stop = index
        while stop < len(thirds) and thirds[stop] >= third:
            stop += 1
        seconds[start:stop], thirds[start:stop] = [second], [third]
    return kept
