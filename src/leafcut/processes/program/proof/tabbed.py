"""Outlines in several cuts, between which tabs hold the part: what lies inside was made before the last of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Indices
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.processes.program.proof.inner_first import loops_in, outline_of, within_loop
from leafcut.processes.program.proof.passes import ways_of
from leafcut.processes.program.proof.traces import Traces
from leafcut.proof.difference import MOST_LISTED

#: Two ends that are nearest to each other may have a tab between them: of a mill, with its width, or of a beam, mm.
MILL_TAB, BEAM_TAB = 12.0, 3.0
#: Ends that are nearer than this are one place, mm.
_ONE_PLACE = 0.05
#: A single cut with one tab is open by no more than this part of its length.
_OPEN_PART = 0.09
#: A cut that comes as near to its begin is closed by itself, mm.
_CLOSED = 0.01
#: An outline that is a single cut has as many pieces at least.
_LEAST_PIECES = 3
#: An outline has no more cuts than this; what has more is a filling.
_MOST_CUTS = 64
#: Who else is no farther away than so many times the nearest one might be the nearest as well.
_CLEARLY = 1.02
#: Lines at two depths are one if their middles and lengths differ by no more, mm.
_SAME_LINE = 0.05


class _Cuts(NamedTuple):
    """Runs of cuts without a rapid in between, an entry each.

    Attributes
    ----------
    first, last
        int64[n]: the features that it begins and ends with.
    begins, ends
        int64[n]: the places of the first and of the latest feature of it in the new program, -1 where it is gone.
    at, stop
        int64[n]: its traces.
    tips
        float64[n, 2, 2]: where it begins and ends.
    length, middle
        float64[n], float64[n, 2]: how long it is, and its centre of gravity.
    """

    first: Indices
    last: Indices
    begins: Indices
    ends: Indices
    at: Indices
    stop: Indices
    tips: Floats
    length: Floats
    middle: Floats


class _TabbedLine(NamedTuple):
    """A line between two joints, and the cuts along it, one for every depth; the first begins at the first joint."""

    joints: tuple[int, int]
    cuts: list[int]


def freed(
    traces: Traces, run: Indices, rank: Indices, tab: float, look: Heartbeat = unseen, *, inner_may_come_first: bool
) -> list[tuple[int, int]]:
    """Return (inner, outer) features that have changed places: outer ends the last cut of an outline around inner.

    `run`, `rank` and `inner_may_come_first` are as for `inner_first.exchanged`; `tab` is how wide a tab
    may be, mm; `look` is called as it goes on.
    """
    if not len(traces.feature):
        return []

    cuts = _cuts(traces, run, rank)
    spots = cuts.tips[:, 0]
    places: Any = shapely.points(spots)
    tree = shapely.STRtree(places)
    found: list[tuple[int, int]] = []
    for loop in _outlines(traces, cuts, tab):
        look()
        outer = np.array(sorted({cut for line, _ in loop for cut in line.cuts}))
        if (cuts.begins[outer] < 0).any():
            continue
        around = _around(traces, cuts, loop)
        if not len(around):
            continue
        near = _near(tree, around)
        closes, closed, begins = outer[-1], cuts.ends[outer].max(), cuts.begins[near]
        changed = (near < closes) & (begins > closed)
        if not inner_may_come_first:
            changed |= (near > closes) & (begins < closed) & (begins >= 0)
        inner = np.setdiff1d(near[changed], outer)
        inner = inner[within_loop(spots[inner], around)]
        found += [(int(cuts.first[k]), int(cuts.last[closes])) for k in inner]
        if len(found) > MOST_LISTED:
            break
    return found


def _near(tree: Any, corners: Floats) -> Indices:
    """Return which points of an index are in the box around some corners, or a hair outside, rising."""
    low, high = corners.min(axis=0) - _ONE_PLACE, corners.max(axis=0) + _ONE_PLACE
    return np.sort(tree.query(shapely.box(*low, *high)))


def _around(traces: Traces, cuts: _Cuts, loop: Sequence[tuple[_TabbedLine, bool]]) -> Floats:
    """Return the corners of an outline; none of a single cut that meets itself, which is closed without a tab."""
    ways = []
    for line, forward in loop:
        way = outline_of(traces.pick(np.arange(cuts.at[line.cuts[0]], cuts.stop[line.cuts[0]])))
        ways.append(way if forward else way[::-1])
    if len(ways) == 1 and next(loops_in(ways[0]), None) is not None:
        return np.zeros((0, 2))
    return np.concatenate(ways)


def _cuts(traces: Traces, run: Indices, rank: Indices) -> _Cuts:
    owner = run[traces.feature]
    numbers, at = np.unique(owner, return_index=True)
    stop = np.append(at[1:], len(owner))
    step = np.hypot(*(traces.end - traces.begin).T)
    length = np.add.reduceat(step, at)
    moment = np.add.reduceat(0.5 * step[:, None] * (traces.begin + traces.end), at, axis=0)
    first = np.searchsorted(run, numbers)
    return _Cuts(
        first,
        np.searchsorted(run, numbers, side="right") - 1,
        rank[first],
        np.maximum.reduceat(rank, first),
        at,
        stop,
        np.stack([traces.begin[at], traces.end[stop - 1]], axis=1),
        length,
        moment / np.where(length > 0, length, 1.0)[:, None],
    )


def _outlines(traces: Traces, cuts: _Cuts, tab: float) -> Iterator[list[tuple[_TabbedLine, bool]]]:
    """Yield the lines around every outline in several parts, and whether each of them goes the way that it is cut."""
    gap = np.hypot(*(cuts.tips[:, 1] - cuts.tips[:, 0]).T)
    chosen = np.flatnonzero((cuts.length > _ONE_PLACE) & (gap > _CLOSED))
    if not len(chosen):
        return
    lines = _lines(cuts, chosen, _joints(cuts.tips[chosen], tab))
    around: dict[int, list[int]] = {}
    for number, line in enumerate(lines):
        for joint in line.joints:
            around.setdefault(joint, []).append(number)
    first = np.array([line.cuts[0] for line in lines])
    owner = np.searchsorted(cuts.stop, np.arange(len(traces.feature)), side="right")
    order = np.argsort(first)
    mine = np.flatnonzero(np.isin(owner, first))
    ways = np.empty(len(lines), dtype=object)
    ways[order] = ways_of(traces.pick(mine), owner[mine], len(traces.feature) << 2)[0]
    tree = shapely.STRtree(ways)
    done: set[int] = set()
    for number in range(len(lines)):
        loop = _walk(lines, number, around) if number not in done else []
        done.update(k for k, _ in loop)
        cut = lines[number].cuts[0]
        if len(loop) == 1 and (
            gap[cut] > _OPEN_PART * cuts.length[cut] or cuts.stop[cut] - cuts.at[cut] < _LEAST_PIECES
        ):
            continue
        if loop and not _in_a_net(tree, ways, lines, around, number):
            yield [(lines[k], forward) for k, forward in loop]


def _in_a_net(
    tree: Any, ways: NDArray[np.object_], lines: Sequence[_TabbedLine], around: dict[int, list[int]], number: int
) -> bool:
    """Return whether so many lines hang together with one that they are a filling, and no outline."""
    known, new = {number}, [number]
    while new and len(known) <= _MOST_CUTS:
        reached = set(tree.query(ways[new], predicate="dwithin", distance=_ONE_PLACE)[1].tolist())
        reached.update(k for line in new for joint in lines[line].joints for k in around[joint])
        new = list(reached - known)
        known |= reached
    return len(known) > _MOST_CUTS


def _walk(lines: Sequence[_TabbedLine], number: int, around: dict[int, list[int]]) -> list[tuple[int, bool]]:
    """Return the lines on the way around from one of them back to it; none where the way ends or parts."""
    walked: list[tuple[int, bool]] = []
    goal = joint = lines[number].joints[0]
    while len(walked) < _MOST_CUTS:
        begin, end = lines[number].joints
        forward = begin == joint
        walked.append((number, forward))
        joint = end if forward else begin
        if len(around[joint]) != 2:
            return []
        if joint == goal:
            return walked
        one, other = around[joint]
        number = other if one == number else one
    return []


def _joints(tips: Floats, tab: float) -> Indices:
    """Return int64[k, 2]: numbers of the places where cuts begin and end; those on both sides of a tab are one."""
    places = tips.reshape(-1, 2)
    points: Any = shapely.points(places)
    one, other = shapely.STRtree(points).query(points, predicate="dwithin", distance=_ONE_PLACE)
    # The first of those that are near stands for all.
    joint = np.arange(len(places))
    np.minimum.at(joint, one, other)
    joint = joint[joint]
    spots = np.unique(joint)
    near = np.full(len(places), -1)
    tree = shapely.STRtree(points[spots])
    (here, there), apart = tree.query_nearest(
        points[spots], max_distance=tab, exclusive=True, all_matches=False, return_distance=True
    )
    # Between more than two ends it is not clear which of them a tab parts. Each end also meets itself.
    around, _ = tree.query(points[spots[here]], predicate="dwithin", distance=_CLEARLY * apart)
    clear = np.bincount(around) == 2
    near[spots[here[clear]]] = spots[there[clear]]
    mutual = spots[(near[spots] > spots) & (near[near[spots]] == spots)]
    joined = np.arange(len(places))
    joined[near[mutual]] = mutual
    both: Indices = joined[joint].reshape(-1, 2)
    return both


def _lines(cuts: _Cuts, chosen: Indices, joints: Indices) -> list[_TabbedLine]:
    """Return the lines between joints; cuts along one line, one way or the other, are one."""
    between: dict[tuple[int, int], list[_TabbedLine]] = {}
    for cut, (begin, end) in zip(chosen.tolist(), joints.tolist(), strict=True):
        known = between.setdefault((min(begin, end), max(begin, end)), [])
        for line in known:
            same = line.cuts[0]
            apart = np.abs(cuts.middle[cut] - cuts.middle[same]).max()
            if max(apart, abs(cuts.length[cut] - cuts.length[same])) <= _SAME_LINE:
                line.cuts.append(cut)
                break
        else:
            known.append(_TabbedLine((begin, end), [cut]))
    return [line for known in between.values() for line in known]
