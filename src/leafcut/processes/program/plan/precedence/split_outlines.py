"""Outlines that several cuts close together: a contour in two halves, four lines around a panel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.index import linked
from leafcut.model.heartbeat import Heartbeat, unseen

#: Cuts closer than this are at the same place, mm.
TOUCHING = 0.05
#: Two ends that are nearer to each other than to all others may have a tab between them: so wide for a mill, whose own
#: width is part of the gap, and for a beam, mm.
MILL_TAB, BEAM_TAB = 12.0, 3.0
#: Lines that hang together in greater number are a filling or a net, no outline.
_MOST_TOGETHER = 64


def closed_together(
    paths: Sequence[tuple[int, NDArray[np.float64]]], tab: float, look: Heartbeat = unseen
) -> Iterator[tuple[Any, list[int]]]:
    """Yield (area, pieces): what open lines enclose that touch each other, and the pieces that they belong to.

    Parameters
    ----------
    paths
        The number of a piece and a line of it, float64[n, 2], mm; none encloses anything by itself.
    tab
        How far two ends may lie from each other, mm, that only a tab parts.
    look
        Called as it goes on.
    """
    if len(paths) < 2:
        return
    lines: Any = shapely.linestrings(
        np.concatenate([points for _, points in paths]),
        indices=np.repeat(np.arange(len(paths)), [len(points) for _, points in paths]),
    )
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=TOUCHING)
    begins, ends, tabs = _tabs(lines, tab)
    one, other = np.concatenate([one[one != other], begins]), np.concatenate([other[one != other], ends])
    group = linked(len(paths), one, other)
    order = np.argsort(group[begins], kind="stable")
    tabs, of = tabs[order], group[begins[order]]
    for members in _together(group):
        look()
        pieces = sorted({paths[k][0] for k in members})
        # Passes at several depths go along the same line.
        alone = np.unique(shapely.to_wkb(shapely.normalize(shapely.set_precision(lines[members], TOUCHING / 10))))
        if len(alone) > _MOST_TOGETHER:
            continue
        here = slice(*np.searchsorted(of, group[members[0]] + np.arange(2)))
        area = _enclosed(np.concatenate([lines[members], tabs[here]]))
        if area.area > 0:
            yield area, pieces


def _tabs(lines: NDArray[np.object_], tab: float) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.object_]]:
    """Return (int64[k], int64[k], lines[k]): lines an end of each of which has an end of the other as its nearest.

    Ends at the same place are one; the line goes from place to place.
    """
    ends = shapely.get_coordinates(np.concatenate([shapely.get_point(lines, 0), shapely.get_point(lines, -1)]))
    line_of = np.tile(np.arange(len(lines)), 2)
    _, first = np.unique((ends / TOUCHING).round(), axis=0, return_index=True)
    spots: Any = shapely.points(ends[first])
    # A place that was rounded to two is one.
    one, other = shapely.STRtree(spots).query(spots, predicate="dwithin", distance=2 * TOUCHING)
    first = np.delete(first, one[one > other])
    spots = shapely.points(ends[first])
    one, other = shapely.STRtree(spots).query_nearest(spots, max_distance=tab, exclusive=True, all_matches=False)
    nearest = np.full(len(spots), -1)
    nearest[one] = other
    here = np.flatnonzero(nearest >= 0)
    here = here[(nearest[nearest[here]] == here) & (here < nearest[here])]
    begin, end = first[here], first[nearest[here]]
    tabs: Any = shapely.linestrings(np.stack([ends[begin], ends[end]], axis=1))
    return line_of[begin], line_of[end], tabs


def _together(group: NDArray[np.int64]) -> list[list[int]]:
    """Return the places that have the same number, without those that stand alone; groups by their first place."""
    groups: dict[int, list[int]] = {}
    for k, number in enumerate(group.tolist()):
        groups.setdefault(number, []).append(k)
    return [members for members in groups.values() if len(members) > 1]


def _enclosed(lines: NDArray[np.object_]) -> Any:
    """Return the area inside lines whose ends may miss each other by `TOUCHING`."""
    ends = np.concatenate([shapely.get_point(lines, 0), shapely.get_point(lines, -1)])
    end, line = shapely.STRtree(lines).query(ends, predicate="dwithin", distance=TOUCHING)
    bridges = shapely.shortest_line(ends[end], lines[line])
    noded = shapely.union_all(np.concatenate([lines, bridges[shapely.length(bridges) > 0]]))
    cells = shapely.polygonize(shapely.get_parts(noded))
    return shapely.union_all(shapely.get_parts(cells))
