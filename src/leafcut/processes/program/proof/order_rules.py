"""Order rules that detect tasks whose order matters. Planning and verification share these rules.

Some rules depend on unknown facts, such as the tool width, and therefore have two sets of thresholds. Planning uses
`KEEP`, which returns every pair whose order may matter. Verification uses `FREE`, which only returns pairs whose order
certainly matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.geometry.index import NearLines, unique_pairs
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import FIRST_CYCLE, Features
from leafcut.processes.program.proof.order_thresholds import FREE, OrderThresholds
from leafcut.processes.program.proof.outlines import TOUCHING, Line, Outline, outlines_of, task_lines
from leafcut.processes.program.proof.traces import Traces

#: Cuts whose depths differ by at most this distance are on the same level, mm.
LEVEL = 0.01
#: If less than this part of a cut's length is at its lowest level, the cut follows a surface.
_LEVEL_PART = 0.25
#: A cut is closed if the gap between its ends is at most this large, mm.
_CLOSED = 1.0
#: The distance between two cuts is measured at this many points of a cut.
_PLACES = 40
#: Number of segments per line in the spatial index (short lines have small bounding boxes), and number of line pairs
#: compared at a time.
_SEGMENTS, _PAIRS = 32, 2000
#: The search stops after this many touching pairs in changed order. If more than `_MOST_COMPARED` pairs would have to
#: be compared, the order is not proved.
_ENOUGH, _MOST_COMPARED = 1_000, 1_000_000_000
#: A row is straight if its length is at most this multiple of the distance between its ends.
_STRAIGHT = 1.01
#: Maximum spacing of the rows of a surface, mm, and minimum number of rows.
_WIDEST_ROW, _LEAST_ROWS = 100.0, 3


@dataclass(frozen=True, eq=False)
class Visits:
    """Visits, stored in columns. A visit is the work between two travel moves.

    Attributes
    ----------
    first, last
        First and last feature, int64[n].
    start
        Start point, float64[n, 2], mm.
    bottom, floor
        Lowest Z of all cuts, and of the sideways cuts, float64[n], mm; infinite without a cut.
    cuts
        Whether the visit cuts sideways, bool[n].
    level
        Whether a large part of the visit is at its lowest level, bool[n].
    closed
        Whether the sideways cuts of the visit end where they start, bool[n].
    ends
        Start and end of the sideways cuts, float64[n, 2, 2], mm; NaN without a cut.
    length
        XY length of the sideways cuts, float64[n], mm.
    sideways
        Whether each feature cuts sideways, bool[m].
    """

    first: Indices
    last: Indices
    start: Floats
    bottom: Floats
    floor: Floats
    cuts: Mask
    level: Mask
    closed: Mask
    ends: Floats
    length: Floats
    sideways: Mask


def build_visits(features: Features, traces: Traces, visit: Indices, n: int, doubt: OrderThresholds) -> Visits:
    """Build the columns of n visits.

    `visit` is the visit number of each feature. The numbers ascend, and each number occurs. `doubt` contains the
    minimum length of a sideways move.
    """
    kind, z, start = features.kind, features.end[:, 2], features.of("start z")
    made = kind != Kind.DWELL
    bottom, floor = np.full((2, n), np.inf)
    np.fmin.at(bottom, visit[made], z[made])
    step = np.hypot(*(traces.end - traces.begin).T)
    curved, arcs = traces.arc >= 0, traces.arcs
    turn = np.abs(arcs.sweep) * (arcs.radius + 0.5 * arcs.grows) * np.all(arcs.axes[:, :2] == (0, 1), axis=1)
    step[curved] = np.maximum(step[curved], turn[traces.arc[curved]] * (traces.high - traces.low)[curved])
    of_feature = np.bincount(traces.feature, step, minlength=len(features))
    sideways = made & (kind < FIRST_CYCLE) & (of_feature > doubt.still)
    np.fmin.at(floor, visit[sideways], z[sideways])
    length = np.bincount(visit, np.where(sideways, of_feature, 0.0), minlength=n).astype(np.float64)
    lowest = bottom[visit] + LEVEL
    flat = np.bincount(visit, np.where(sideways & (z <= lowest) & (start <= lowest), of_feature, 0.0), minlength=n)
    ends = np.full((n, 2, 2), np.nan)
    rows = np.flatnonzero(sideways[traces.feature])
    for side, at, order in ((0, traces.begin, rows[::-1]), (1, traces.end, rows)):
        ends[visit[traces.feature[order]], side] = at[order]
    first = np.searchsorted(visit, np.arange(n))
    last = np.searchsorted(visit, np.arange(n), side="right") - 1
    begin, end = features.start[first, :2], features.end[first, :2]
    drilled = ~np.isfinite(begin) | (kind[first] >= FIRST_CYCLE)[:, None]
    return Visits(
        first,
        last,
        np.where(drilled, end, begin),
        bottom,
        floor,
        length > 0,
        flat >= _LEVEL_PART * length,
        np.hypot(*(ends[:, 1] - ends[:, 0]).T) <= _CLOSED,
        ends,
        length,
        sideways,
    )


def line_index(lines: Iterable[Line]) -> tuple[NearLines, Indices]:
    """Return a spatial index of lines that are split into short parts, and the task of each part."""
    coordinates: list[Floats] = []
    owner: list[int] = []
    for line in lines:
        for begin in range(0, len(line.points) - 1, _SEGMENTS):
            coordinates.append(line.points[begin : begin + _SEGMENTS + 1])
            owner.append(line.owner)
    shapes: Any = shapely.linestrings(
        np.concatenate([np.zeros((0, 2)), *coordinates]),
        indices=np.repeat(np.arange(len(owner)), [len(part) for part in coordinates]),
    )
    # GEOS does not find lines of zero length.
    still = np.flatnonzero([(part == part[0]).all() for part in coordinates])
    shapes[still] = shapely.points(np.array([coordinates[k][0] for k in still]).reshape(-1, 2))
    return NearLines(shapes), np.array(owner, dtype=np.int64)


def touching_in_new_order(
    features: Features, traces: Traces, new_of: Indices, tolerance: float, check_cancelled: Heartbeat = ignore_heartbeat
) -> tuple[Indices, bool]:
    """Find touching features whose order changed. The search stops after `_ENOUGH` pairs.

    Parameters
    ----------
    new_of
        Position of each feature in the new order, int64[n], or -1 if it is missing.

    Returns
    -------
    tuple
        The pairs of features, int64[k, 2], with the earlier feature first, and whether the search is complete.
    """
    found, compared = np.zeros((0, 2), dtype=np.int64), 0
    of_feature = np.where(new_of >= 0, np.arange(len(new_of)), -1)
    near, owner = line_index(task_lines(features, traces, of_feature, FREE.sagitta))

    def changed(a: Indices, b: Indices) -> Mask:
        nonlocal compared
        a, b = owner[a], owner[b]
        mask: Mask = (a < b) & (new_of[a] > new_of[b])
        compared += int(np.count_nonzero(mask))
        return mask

    for a, b in near.pairs(near, tolerance + 2 * FREE.sagitta, changed):
        check_cancelled()
        found = np.concatenate([found, unique_pairs(owner[a], owner[b])])
        if len(found) > _ENOUGH or compared > _MOST_COMPARED:
            break
    return unique_pairs(*found.T), compared <= _MOST_COMPARED


#: Type of a function that selects pairs of visits: (int64[k], int64[k]) → bool[k].
PairFilter = Callable[[Indices, Indices], Mask]


def passes_at_levels(
    visits: Visits, near: NearLines, owner: Indices, doubt: OrderThresholds, width: float, wanted: PairFilter
) -> Iterator[Indices]:
    """Yield pairs of cuts at different depths that are closer than the tool width, int64[k, 2].

    A pair is skipped if it contains a hole or a cut that follows a surface. With `KEEP`, a pair is skipped only if both
    cuts follow a surface or both are holes.
    """
    both = np.logical_and if doubt.keep else np.logical_or
    follows, still = visits.cuts & ~visits.level, ~visits.cuts

    def chosen(a: Indices, b: Indices) -> Mask:
        a, b = owner[a], owner[b]
        apart = _at_different_depths(visits, a, b) & ~both(follows[a], follows[b]) & ~both(still[a], still[b])
        found: Mask = apart & wanted(a, b)
        return found

    depths = visits.bottom[owner]
    depths = depths[np.isfinite(depths)]
    if np.ptp(depths) > LEVEL if len(depths) else False:
        for a, b in near.pairs(near, max(min(doubt.width, width), min(doubt.beside, width)), chosen):
            yield unique_pairs(owner[a], owner[b])


def passes_side_by_side(
    visits: Visits, near: NearLines, owner: Indices, doubt: OrderThresholds, width: float, wanted: PairFilter
) -> Iterator[Indices]:
    """Yield pairs of cuts at the same depth that are within a finishing allowance of each other, int64[k, 2].

    Two closed cuts never form a pair.
    """
    both = np.logical_and if doubt.keep else np.logical_or
    follows, reach = visits.cuts & ~visits.level, min(doubt.beside, width)

    def chosen(a: Indices, b: Indices) -> Mask:
        a, b = owner[a], owner[b]
        found: Mask = visits.cuts[a] & visits.cuts[b] & ~(visits.closed[a] & visits.closed[b]) & (a != b)
        found &= ~_at_different_depths(visits, a, b) & ~both(follows[a], follows[b]) & wanted(a, b)
        return found

    for a, b in near.pairs(near, reach, chosen):
        pairs = unique_pairs(owner[a], owner[b])
        for k in range(0, len(pairs), _PAIRS):
            part = pairs[k : k + _PAIRS]
            yield part[_shares_beside(near.lines, owner, part, reach) >= doubt.beside_part]


def nearby_passes(
    visits: Visits, near: NearLines, owner: Indices, doubt: OrderThresholds, width: float, wanted: PairFilter
) -> Iterator[tuple[Message, Indices]]:
    """Yield pairs of nearby passes with the relation between them, int64[k, 2].

    The same pair may occur several times.
    """
    for relation, rule in (
        (Message("is at another level beside"), passes_at_levels),
        (Message("runs beside"), passes_side_by_side),
    ):
        for pairs in rule(visits, near, owner, doubt, width, wanted):
            yield relation, pairs


def _at_different_depths(visits: Visits, a: Indices, b: Indices) -> Mask:
    """Return a mask of the pairs at different depths. Pairs with an unknown depth are not included."""
    with np.errstate(invalid="ignore"):
        gap = np.abs(visits.bottom[a] - visits.bottom[b])
    different: Mask = (gap > LEVEL) & np.isfinite(gap)
    return different


def _shares_beside(lines: NDArray[np.object_], owner: Indices, pairs: Indices, reach: float) -> Floats:
    """Measure how much of the shorter cut runs alongside the longer cut, for each pair.

    Returns
    -------
    Floats
        Fraction of the shorter cut that is within `reach` (mm) of the longer cut, float64[k].
    """
    used, number = np.unique(pairs, return_inverse=True)
    mine = np.flatnonzero(np.isin(owner, used) & (shapely.get_type_id(lines) == 1))
    whole = np.full(len(used), shapely.MultiLineString(), dtype=object)
    order = mine[np.argsort(owner[mine], kind="stable")]
    if len(order):
        shapely.multilinestrings(lines[order], indices=np.searchsorted(used, owner[order]), out=whole)
    shapely.prepare(whole)
    both = whole[number.reshape(-1, 2)]
    rows = np.arange(len(pairs))
    short = np.argmin(shapely.length(both), axis=1)
    where = (np.arange(_PLACES) + 0.5) / _PLACES
    places = shapely.line_interpolate_point(both[rows, short][:, None], where, normalized=True)
    part: Floats = shapely.dwithin(both[rows, 1 - short][:, None], places, reach).mean(axis=1)
    return part


def rows_in_order(visits: Visits, doubt: OrderThresholds, width: float = math.inf) -> Indices:
    """Return the pairs of consecutive surface rows that advance to one side, int64[k, 2]."""
    found: list[tuple[int, int]] = []
    run: list[tuple[int, int]] = []
    last = 0.0
    with np.errstate(invalid="ignore"):
        size = np.hypot(*(visits.ends[:, 1] - visits.ends[:, 0]).T)
    row = visits.cuts & (visits.length <= _STRAIGHT * size) & (visits.level | doubt.keep)
    for number in range(1, len(row)):
        step = math.nan
        if row[number - 1] and row[number] and abs(visits.bottom[number] - visits.bottom[number - 1]) <= LEVEL:
            step = _row_spacing(visits.ends[number - 1], visits.ends[number], doubt.lean, min(_WIDEST_ROW, width))
        if not run or math.isnan(step) or step * last < 0 or abs(step) > doubt.widening * abs(last):
            found += run if len(run) + 1 >= _LEAST_ROWS else []
            run = []
        if not math.isnan(step):
            run.append((number - 1, number))
            last = step
    found += run if len(run) + 1 >= _LEAST_ROWS else []
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _row_spacing(row: Floats, follower: Floats, lean: float, widest: float) -> float:
    """Return the signed distance from a row to the next row, mm, or NaN if the rows are not parallel.

    To define the sign, the row is directed along +x (or +y). The distance is positive if the next row is to its left.
    """
    along, other = row[1] - row[0], follower[1] - follower[0]
    length, other_length = float(np.hypot(*along)), float(np.hypot(*other))
    along = along / length
    if along[0] < -1e-9 or (abs(along[0]) <= 1e-9 and along[1] < 0):
        along = -along
    across = np.array([-along[1], along[0]])
    step = float((follower.mean(axis=0) - row.mean(axis=0)) @ across)
    common = min(np.max(row @ along), np.max(follower @ along)) - max(np.min(row @ along), np.min(follower @ along))
    shorter = min(length, other_length)
    even = abs(float(other @ across)) <= lean * other_length
    wide = LEVEL < abs(step) <= min(widest, shorter)
    return step if even and wide and common >= 0.5 * shorter else math.nan


def lowest_level(features: Features, visits: Visits, visit: Indices, doubt: OrderThresholds) -> Mask:
    """Return a mask of the features that cut sideways at the lowest level of their visit. Tabs are above this level.

    A cut that never rises has no tabs, so the whole cut belongs to the lowest level.
    """
    z, start = features.end[:, 2], features.start[:, 2]
    aside = np.flatnonzero(visits.sideways)
    of = visit[aside]
    with np.errstate(invalid="ignore"):
        rises = ~(z[aside] <= start[aside] + LEVEL)
        follows = of[1:] == of[:-1]
        rises[1:] |= follows & ~(start[aside][1:] <= z[aside][:-1] + LEVEL)
    steady = np.ones(len(visits.first), dtype=bool)
    steady[of[rises]] = False
    limit = visits.floor[visit] + doubt.tab
    level: Mask = visits.sideways & (steady[visit] | ((z <= limit) & (start <= limit)))
    return level


def detaching_visits(
    features: Features,
    traces: Traces,
    visits: Visits,
    visit: Indices,
    above: Floats,
    doubt: OrderThresholds,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> tuple[Mask, Mask]:
    """Detect the visits that detach a part.

    Parameters
    ----------
    visit
        The visit of each feature.
    above
        Height of each visit above the deepest cut, mm.

    Returns
    -------
    tuple
        Masks of the visits that may detach a part, and of the visits that certainly detach a part, bool[n].
    """
    level = lowest_level(features, visits, visit, doubt) & (above <= doubt.through)[visit]
    lines = task_lines(features, traces, np.where(level, visit, -1), doubt.sagitta)
    tab = TOUCHING if doubt.keep else None
    return detaching_visits_of_outlines(
        visits, list(outlines_of(list(lines), tab, doubt, check_cancelled)), above, doubt
    )


def detaching_visits_of_outlines(
    visits: Visits, outlines: Sequence[Outline], above: Floats, doubt: OrderThresholds
) -> tuple[Mask, Mask]:
    """Detect the visits whose outlines detach a part.

    If an outline is inside another outline that goes through the material, its area is scrap unless other work starts
    inside it.

    Parameters
    ----------
    outlines
        Outlines at the lowest level of the visits that may cut through.
    above
        Height of each visit above the deepest cut, float64[n], mm.

    Returns
    -------
    tuple
        Masks of the visits that may detach a part, and of the visits that certainly detach a part, bool[n].
    """
    n = len(visits.first)
    # If several cuts form an outline, any of them may be the last.
    parts = [(outline, owner) for outline in outlines for owner in outline.owners if outline.area.area >= doubt.area]
    if not parts:
        return np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    owner = np.array([number for _, number in parts])
    alone = np.array([outline.alone for outline, _ in parts], dtype=bool)
    shapes = np.array([outline.area for outline, _ in parts], dtype=object)
    size, depth = shapely.area(shapes), above[owner]
    starts = np.flatnonzero(np.isfinite(visits.start).all(axis=1))
    spots: Any = shapely.points(visits.start[starts])
    around, spot = shapely.STRtree(spots).query(shapes, predicate="contains")
    holds = _mask_of(len(shapes), around[owner[around] != starts[spot]])
    tree = shapely.STRtree(shapes)
    inner, outer = tree.query(shapes, predicate="within")
    smaller = size[inner] < doubt.smaller * size[outer]
    scrap = _mask_of(len(shapes), inner[smaller & (depth[outer] <= doubt.around_through)])
    inner, outer = tree.query(shapely.point_on_surface(shapes), predicate="within")
    doubtful = _mask_of(len(shapes), inner[size[inner] < doubt.smaller * size[outer]])
    may = (~scrap | holds) & (depth <= doubt.through)
    surely = alone & (~doubtful | holds) & (depth <= doubt.surely_through) & (size >= doubt.sure_area)
    return _mask_of(n, owner[may]), _mask_of(n, owner[surely])


def _mask_of(n: int, which: Indices) -> Mask:
    found = np.zeros(n, dtype=bool)
    found[which] = True
    return found
