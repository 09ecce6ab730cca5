"""Outlines that several cuts close together: a contour in two halves, four lines around a panel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Cuts closer than this are at the same place, mm.
TOUCHING = 0.05
#: Lines that hang together in greater number are a filling or a net, no outline.
_MOST_TOGETHER = 64


def closed_together(shapely: Any, paths: Sequence[tuple[int, NDArray[np.float64]]]) -> Iterator[tuple[Any, list[int]]]:
    """Yield (area, chains): what open lines enclose that touch each other, and the chains that they belong to.

    Parameters
    ----------
    paths
        The number of a chain and a line of it, float64[n, 2], mm; none encloses anything by itself.
    """
    if len(paths) < 2:
        return
    lines = shapely.linestrings(
        np.concatenate([points for _, points in paths]),
        indices=np.repeat(np.arange(len(paths)), [len(points) for _, points in paths]),
    )
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=TOUCHING)
    for members in _hanging_together(len(paths), one[one != other], other[one != other]):
        chains = sorted({paths[k][0] for k in members})
        if len(chains) < 2 or len(members) > _MOST_TOGETHER:
            continue
        area = _enclosed(shapely, lines[members])
        if area.area > 0:
            yield area, chains


def _hanging_together(n: int, one: NDArray[np.int64], other: NDArray[np.int64]) -> list[list[int]]:
    """Return the numbers 0 … n - 1 in groups joined by pairs, without those that stand alone."""
    root = list(range(n))

    def find(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        root[find(a)] = find(b)
    groups: dict[int, list[int]] = {}
    for k in range(n):
        groups.setdefault(find(k), []).append(k)
    return [group for group in groups.values() if len(group) > 1]


def _enclosed(shapely: Any, lines: NDArray[np.object_]) -> Any:
    """Return the area inside lines whose ends may miss each other by `TOUCHING`."""
    ends = np.concatenate([shapely.get_point(lines, 0), shapely.get_point(lines, -1)])
    end, line = shapely.STRtree(lines).query(ends, predicate="dwithin", distance=TOUCHING)
    bridges = shapely.shortest_line(ends[end], lines[line])
    noded = shapely.union_all(np.concatenate([lines, bridges[shapely.length(bridges) > 0]]))
    cells = shapely.polygonize(shapely.get_parts(noded))
    return shapely.union_all(shapely.get_parts(cells))
