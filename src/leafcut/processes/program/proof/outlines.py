"""Find the areas enclosed by a single cut, and the areas enclosed by several cuts with tabs between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.geometry.index import connected_components
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.order_thresholds import FREE, OrderThresholds
from leafcut.processes.program.proof.traces import Traces

#: Cuts within this distance touch each other, mm.
TOUCHING = 0.05
#: Maximum gap between consecutive cuts of a line, mm. Programs write coordinates with three decimals, or four in
#: inches.
MEETING = 0.01
#: Maximum length of a tab, mm. With a mill, the gap between the cuts includes the tool width.
MILL_TAB, BEAM_TAB = 12.0, 3.0
#: Maximum number of connected lines in an outline. Larger groups fill an area.
_MOST_LINES = 64
#: If a line has more points than this, its convex hull replaces its area.
_MOST_POINTS = 20_000
#: Areas are shrunk by this distance, mm. Otherwise, a line could be inside the area that it encloses.
_EDGE = 1e-5
#: Number of chords per quarter circle at the round end of a buffered line.
_END_SEGMENTS = 4
#: For `FREE`: if a third end is within this multiple of the shortest distance, the position of a tab is ambiguous.
_CLEARLY = 1.02
#: Maximum difference in centroid and in length if the same line is cut at two depths, mm.
_SAME_LINE = 0.05


#: For `FREE`: maximum gap of a single line with a tab, as a part of its length.
_TABBED_PART = 0.09


class Line(NamedTuple):
    """A line without gaps (`points`, float64[n, 2], mm), and the number of the task that cuts it."""

    owner: int
    points: Floats


class Outline(NamedTuple):
    """An area, and the numbers of the tasks that cut its outline, in ascending order.

    `alone` means that a single line certainly closes the area. `joined` means that the area is enclosed by several
    lines, or by a single line with a tab.
    """

    area: Any
    owners: list[int]
    alone: bool
    joined: bool = False


def task_lines(features: Features, traces: Traces, owner: Indices, sagitta: float) -> Iterator[Line]:
    """Yield the lines of all tasks. Holes and dwells become lines of zero length.

    `owner` is the task of each feature. Features with -1 are skipped.
    """
    traces = traces.pick(np.flatnonzero(owner[traces.feature] >= 0)).flattened(sagitta)
    waits = features.kind[traces.feature] == Kind.DWELL
    cuts = traces.pick(~waits)
    of = owner[cuts.feature]
    starts = np.ones(len(of), dtype=bool)
    starts[1:] = (of[1:] != of[:-1]) | (np.abs(cuts.begin[1:] - cuts.end[:-1]) > MEETING).any(axis=1)
    heads = np.flatnonzero(starts)
    points = np.insert(cuts.end, heads, cuts.begin[heads], axis=0)
    edges = [*(heads + np.arange(len(heads))).tolist(), len(points)]
    for number, (low, high) in zip(of[heads].tolist(), pairwise(edges), strict=True):
        yield Line(number, points[low:high])
    places = np.column_stack([owner[traces.feature[waits]], traces.end[waits]])
    for number, x, y in np.unique(places, axis=0).tolist():
        yield Line(int(number), np.array([(x, y), (x, y)]))


def is_point(line: Line) -> bool:
    """Return whether a line is a single point."""
    return bool((line.points == line.points[0]).all())


def area_of(points: Floats, doubt: OrderThresholds) -> tuple[Any, bool]:
    """Return the area that a line encloses, or None, and whether the line is certainly closed."""
    if len(points) < 4:
        return None, False
    if doubt.keep and len(points) > _MOST_POINTS:
        hull: Any = shapely.convex_hull(shapely.multipoints(points))
        alone = bool(np.abs(points[-1] - points[0]).max() <= doubt.alone)
        return (hull, alone) if hull.geom_type == "Polygon" else (None, False)
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    gap = float(np.hypot(*(points[-1] - points[0])))
    closed = gap <= max(doubt.gap, doubt.open_part * length) and length > TOUCHING
    whole = np.concatenate([points, points[:1]]) if closed else points
    if closed:
        ring: Any = shapely.polygons(whole)
        if shapely.is_valid(ring) and ring.area > 0:
            return ring, gap <= doubt.alone
    # Lead-in and lead-out cross the outline, or the line runs around several times.
    area = _enclosed_area(shapely.linestrings(whole), MEETING)
    if area is None:
        return None, False
    return area, gap <= doubt.alone or not closed or _enclosed_area(shapely.linestrings(points), MEETING) is not None


def _enclosed_area(lines: Any, meeting: float) -> Any:
    """Return the area that lines enclose when gaps of up to `meeting` (mm) are bridged, or None."""
    # The chords of round ends must reach half the gap.
    reach = 0.5 * meeting / math.cos(math.pi / (4 * _END_SEGMENTS)) + _EDGE
    strip: Any = shapely.get_parts(shapely.buffer(lines, reach, quad_segs=_END_SEGMENTS))
    rings = shapely.get_rings(strip)
    inner: Any = shapely.polygons(rings[~np.isin(np.arange(len(rings)), _exteriors(strip))])
    if not len(inner):
        return None
    if len(inner) == 1:
        return shapely.buffer(inner[0], reach - _EDGE, join_style="mitre")
    # Growing further and shrinking again merges areas that share an edge.
    grown = shapely.union_all(shapely.buffer(inner, 2.0 * reach, join_style="mitre"))
    return shapely.buffer(grown, -reach - _EDGE, join_style="mitre")


def _exteriors(polygons: NDArray[np.object_]) -> Indices:
    count = 1 + shapely.get_num_interior_rings(polygons)
    exteriors: Indices = np.cumsum(count) - count
    return exteriors


def joined_outlines(
    lines: Sequence[Line], tab: float, doubt: OrderThresholds, check_cancelled: Heartbeat = ignore_heartbeat
) -> Iterator[Outline]:
    """Yield the areas that several open lines enclose. With `FREE`, also yield the areas of single lines with one tab.

    Two lines are joined if they touch. They are also joined if their ends are within `tab` (mm) and no other end is
    nearer.
    """
    if len(lines) < (2 if doubt.keep else 1):
        return
    shapes: Any = shapely.linestrings(
        np.concatenate([line.points for line in lines]),
        indices=np.repeat(np.arange(len(lines)), [len(line.points) for line in lines]),
    )
    one, other = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=TOUCHING)
    joint, begins, ends, tabs = _joints(shapes, tab, not doubt.keep)
    links = np.concatenate([one[one < other], begins]), np.concatenate([other[one < other], ends])
    group = connected_components(len(lines), *links)
    order = np.argsort(group, kind="stable")
    edges = np.flatnonzero(np.diff(group[order], prepend=-1, append=-1))
    parts = [order[low:high] for low, high in pairwise(edges.tolist())]
    by_group = np.argsort(group[begins], kind="stable")
    begins, ends, tabs = begins[by_group], ends[by_group], tabs[by_group]
    for members in sorted(parts, key=lambda part: int(part[0])):
        check_cancelled()
        if len(members) < 2 and doubt.keep:
            continue
        # Passes at several depths cut the same line.
        rounded = shapely.set_precision(shapes[members], TOUCHING / 10)
        if len(members) > _MOST_LINES and len(np.unique(shapely.to_wkb(shapely.normalize(rounded)))) > _MOST_LINES:
            continue
        here = slice(*np.searchsorted(group[begins], group[members[0]] + np.arange(2)))
        rings = [members] if doubt.keep else _rings_of_group(members, joint, shapes)
        for ring in rings:
            closing = tabs[here][np.isin(begins[here], ring) & np.isin(ends[here], ring)]
            if len(ring) == 1 and not _has_tab(shapes[ring[0]]):
                continue
            area = _enclosed_area(shapely.multilinestrings([*shapes[ring], *closing]), TOUCHING)
            if area is not None:
                yield Outline(area, sorted({lines[k].owner for k in ring.tolist()}), False, True)


def _has_tab(line: Any) -> bool:
    """Return whether the gap of an open line is a small part of its length.

    The result is False if the line encloses an area by itself.
    """
    points = shapely.get_coordinates(line)
    gap = float(np.hypot(*(points[-1] - points[0])))
    enough = len(points) > 3 and gap <= _TABBED_PART * shapely.length(line)
    return bool(enough and area_of(points, FREE)[0] is None)


def _joints(
    lines: NDArray[np.object_], tab: float, clear: bool
) -> tuple[Indices, Indices, Indices, NDArray[np.object_]]:
    """Return the joints at both ends of each line, and the tabs between the joints.

    A tab connects two joints within `tab` (mm) that are nearest to each other. With `clear`, no third joint may be
    almost as near.

    Returns
    -------
    tuple
        The joints of each line, int64[n, 2], and for each tab its two lines and its gap as a line. Gaps within a joint
        are at the end of the list.
    """
    ends = shapely.get_coordinates(np.stack([shapely.get_point(lines, 0), shapely.get_point(lines, -1)], axis=1))
    _, first, of = np.unique((ends / TOUCHING).round(), axis=0, return_index=True, return_inverse=True)
    spots: Any = shapely.points(ends[first])
    one, other = shapely.STRtree(spots).query(spots, predicate="dwithin", distance=2 * TOUCHING)
    # Rounding may separate nearly equal points.
    stands = np.arange(len(spots))
    np.minimum.at(stands, one, other)
    stands = stands[stands]
    kept = np.unique(stands)
    tree = shapely.STRtree(spots[kept])
    (here, there), apart = tree.query_nearest(
        spots[kept], max_distance=tab, exclusive=True, all_matches=False, return_distance=True
    )
    if clear:
        around, _ = tree.query(spots[kept[here]], predicate="dwithin", distance=_CLEARLY * apart)
        alone = np.bincount(around, minlength=len(here)) == 2
        here, there = here[alone], there[alone]
    nearest = np.full(len(kept), -1)
    nearest[here] = there
    here = np.flatnonzero(nearest >= 0)
    here = here[(nearest[nearest[here]] == here) & (here < nearest[here])]
    one, other = kept[here], kept[nearest[here]]
    joined = np.arange(len(spots))
    joined[other] = one
    joint = joined[stands]
    begin, end = first[one], first[other]
    # The ends of a joint need not touch.
    centre = first[stands[of]]
    apart_from = np.flatnonzero(np.hypot(*(ends - ends[centre]).T) > 0.5 * TOUCHING)
    begin, end = np.append(begin, apart_from), np.append(end, centre[apart_from])
    gaps: Any = shapely.linestrings(np.stack([ends[begin], ends[end]], axis=1))
    return joint[of].reshape(-1, 2), begin // 2, end // 2, gaps


def _rings_of_group(members: Indices, joint: Indices, shapes: NDArray[np.object_]) -> list[Indices]:
    """Return the lines of each ring in a group of lines. In a ring, exactly two distinct lines meet at each joint."""
    lengths, centres = shapely.length(shapes[members]), shapely.get_coordinates(shapely.centroid(shapes[members]))
    same: list[list[int]] = []
    between: dict[tuple[int, int], list[int]] = {}
    for k, (begin, end) in enumerate(joint[members].tolist()):
        known = between.setdefault((min(begin, end), max(begin, end)), [])
        for number in known:
            apart = max(np.abs(centres[k] - centres[same[number][0]]).max(), abs(lengths[k] - lengths[same[number][0]]))
            if apart <= _SAME_LINE:
                same[number].append(k)
                break
        else:
            known.append(len(same))
            same.append([k])
    ends = joint[members[[alike[0] for alike in same]]]
    degree = Counter(ends.ravel().tolist())
    joints, of = np.unique(ends, return_inverse=True)
    joint_of = of.reshape(-1, 2)
    ring_of = connected_components(len(joints), joint_of[:, 0], joint_of[:, 1])
    good = np.ones(len(joints), dtype=bool)
    good[ring_of[[degree[j] != 2 for j in joints.tolist()]]] = False
    of_line = ring_of[joint_of[:, 0]]
    rings = [np.flatnonzero(of_line == root) for root in np.unique(of_line[good[of_line]])]
    return [members[np.concatenate([same[k] for k in ring.tolist()])] for ring in rings]


def outlines_of(
    lines: Sequence[Line],
    tab: float | None,
    doubt: OrderThresholds,
    check_cancelled: Heartbeat = ignore_heartbeat,
    chosen: Mask | None = None,
) -> Iterator[Outline]:
    """Yield the outlines of single lines, followed by the outlines that are joined across tabs.

    Parameters
    ----------
    tab
        Maximum length of a tab, mm; None for no tabs.
    chosen
        Mask of the tasks whose single outlines are yielded, bool[n]; None for all tasks.
    """
    open_: list[Line] = []
    for line in lines:
        check_cancelled()
        area, alone = area_of(line.points, doubt) if chosen is None or chosen[line.owner] else (None, False)
        if area is not None:
            yield Outline(area, [line.owner], alone)
        if (area is None or not doubt.keep) and not is_point(line):
            open_.append(line)
    if tab is not None:
        if not doubt.keep:
            open_ = [line for line in open_ if _is_open(line.points)]
        yield from joined_outlines(open_, tab, doubt, check_cancelled)


def _is_open(points: Floats) -> bool:
    steps = np.hypot(*np.diff(points, axis=0).T)
    return float(steps.sum()) > TOUCHING and float(np.hypot(*(points[-1] - points[0]))) > MEETING


def lines_starting_inside(lines: Sequence[Line], outlines: Iterable[Outline]) -> Iterator[tuple[Outline, Indices]]:
    """Yield each outline with the tasks that have a line which starts inside it, in ascending order."""
    if not lines:
        return
    starts: Any = shapely.points(np.array([line.points[0] for line in lines]))
    tree = shapely.STRtree(starts)
    owner = np.array([line.owner for line in lines])
    for outline in outlines:
        inner = np.unique(owner[tree.query(outline.area, predicate="contains")])
        if len(inner):
            yield outline, inner
