"""Parts that come free: what was made before a mill had cut around a part must not be made after it.

A part that nothing holds may move when its neighbours are machined, so it matters everywhere on the sheet, not only
inside the outline. The deepest that a mill cuts sideways is taken to be the underside of the material. What is judged
here is judged from the cuts alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import shapely

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import FIRST_CYCLE, Features
from leafcut.processes.program.proof.inner_first import loops_in, outline_of
from leafcut.processes.program.proof.traces import Traces
from leafcut.proof.difference import MOST_LISTED

#: A cut this near to the deepest one goes through the material, mm: for certain, most likely, and perhaps.
_SURELY, _LIKELY, _PERHAPS = 0.4, 0.9, 1.1
#: What rises by no more than this is at one level, and no tab, mm.
_FLAT = 0.15
_STEADY = 0.005
#: Depths within this are one, mm; pieces whose ends are nearer than this follow each other.
_ALIKE, _FOLLOWS = 0.02, 0.01
#: A loop inside another one is smaller than so much of it; else both are passes of one outline.
_SMALLER = 0.94
#: A part is larger than this, for certain and perhaps, mm²: less is a hole that a mill makes as a drill would.
_LEAST_AREA, _SMALL_AREA = 1.5, 0.5


class _CutVisits(NamedTuple):
    """What is made between two ways across, an entry each.

    Attributes
    ----------
    first, last
        int64[n]: its features.
    ends
        int64[n]: the place of the latest of them in the new program, -1 where all are gone.
    bottom
        float64[n]: the lowest place that it cuts sideways, mm; infinite where it does not.
    spot
        float64[n, 2]: where it begins to work.
    above
        float64[n]: how far it stays above the deepest cut, mm; infinite where it does not cut sideways.
    """

    first: Indices
    last: Indices
    ends: Indices
    bottom: Floats
    spot: Floats
    above: Floats


def loosened(
    features: Features, traces: Traces, visit: Indices, origin: Indices, new_of: Indices
) -> list[tuple[int, int]]:
    """Return (other, outline): features of work that was made before a part came free, and is now made after it.

    `outline` is the last feature of the cut that frees the part. Two parts may come free in either order.

    Parameters
    ----------
    visit
        int64[n], rising: features between which the tool goes nowhere by a rapid have one number.
    origin
        int64[n]: features with different numbers are measured from origins that may differ.
    new_of
        int64[n]: the place of every feature in the new program, -1 where it is gone.
    """
    if not len(features):
        return []
    visit = np.unique(visit, return_inverse=True)[1].ravel()
    aside = _sideways(features, traces)
    visits = _visits(features, aside, visit, origin, new_of)
    before = np.maximum.accumulate(np.concatenate([[-1], visits.ends]))[:-1]
    overtakes = (visits.above <= _LIKELY) & (visits.ends >= 0) & (before > visits.ends)
    if not overtakes.any():
        return []
    parts, perhaps = _parts(features, traces, aside, visits)
    found: list[tuple[int, int]] = []
    for outline in np.flatnonzero(overtakes & parts).tolist():
        later = visits.ends[:outline] > visits.ends[outline]
        later &= ~(perhaps[:outline] & (visits.bottom[:outline] <= visits.bottom[outline] + _ALIKE))
        if later.any():
            other = int(np.flatnonzero(later)[0])
            found.append((int(visits.first[other]), int(visits.last[outline])))
        if len(found) > MOST_LISTED:
            break
    return found


def _sideways(features: Features, traces: Traces) -> Mask:
    """Return which features cut sideways."""
    step = np.maximum(np.hypot(*(traces.end - traces.begin).T), traces.bow)
    length = np.bincount(traces.feature, step, minlength=len(features))
    aside: Mask = (features.kind != Kind.DWELL) & (features.kind < FIRST_CYCLE) & (length > _FOLLOWS)
    return aside


def _visits(features: Features, aside: Mask, visit: Indices, origin: Indices, new_of: Indices) -> _CutVisits:
    n = int(visit[-1]) + 1
    first = np.searchsorted(visit, np.arange(n))
    last = np.searchsorted(visit, np.arange(n), side="right") - 1
    ends = np.full(n, -1, dtype=np.int64)
    np.maximum.at(ends, visit, new_of)
    bottom = np.full(n, np.inf)
    np.fmin.at(bottom, visit[aside], features.end[aside, 2])
    frame = features.of("frame", first)
    _, zero = np.unique(np.column_stack([frame, origin[first]]), axis=0, return_inverse=True)
    zero = zero.ravel()
    deepest = np.full(int(zero.max()) + 1, np.inf)
    np.minimum.at(deepest, zero, bottom)
    with np.errstate(invalid="ignore"):
        above = np.where(np.isfinite(bottom), bottom - deepest[zero], np.inf)
    start, end = features.start[first, :2], features.end[first, :2]
    drilled = ~np.isfinite(start) | (features.kind[first] >= FIRST_CYCLE)[:, None]
    return _CutVisits(first, last, ends, bottom, np.where(drilled, end, start), above)


def _parts(features: Features, traces: Traces, aside: Mask, visits: _CutVisits) -> tuple[Mask, Mask]:
    """Return which visits surely cut a part free, and which may: they go round it, and it is no scrap of a cut-out."""
    owner: list[int] = []
    shapes = []
    for number in np.flatnonzero(visits.above <= _PERHAPS).tolist():
        for loop in _loops(features, traces, aside, visits, number):
            shape = shapely.make_valid(shapely.polygons(loop))
            if shapely.area(shape) > _SMALL_AREA:
                owner.append(number)
                shapes.append(shape)
    surely, perhaps = np.zeros((2, len(visits.first)), dtype=bool)
    if not shapes:
        return surely, perhaps
    loops, of = np.array(shapes, dtype=object), np.array(owner)
    size, above = shapely.area(loops), visits.above[of]
    tree = shapely.STRtree(loops)
    inner, outer = tree.query(shapely.point_on_surface(loops), predicate="within")
    smaller = size[inner] < _SMALLER * size[outer]
    inner, outer = inner[smaller], outer[smaller]
    clearly = (above[outer] <= _SURELY) & shapely.within(loops[inner], loops[outer])
    known = np.flatnonzero(np.isfinite(visits.spot).all(axis=1))
    spots: Any = shapely.points(visits.spot[known])
    around, spot = shapely.STRtree(spots).query(loops, predicate="contains")
    holds = np.zeros(len(loops), dtype=bool)
    holds[around[of[around] != known[spot]]] = True
    surely[of[(~_any(len(loops), inner) | holds) & (above <= _LIKELY) & (size > _LEAST_AREA)]] = True
    perhaps[of[~_any(len(loops), inner[clearly]) | holds]] = True
    return surely, perhaps


def _any(n: int, which: Indices) -> Mask:
    found = np.zeros(n, dtype=bool)
    found[which] = True
    return found


def _loops(features: Features, traces: Traces, aside: Mask, visits: _CutVisits, number: int) -> list[Floats]:
    """Return what a visit goes round at its lowest level, float64[k, 2] each."""
    mine = np.arange(int(visits.first[number]), int(visits.last[number]) + 1)
    mine = mine[aside[mine]]
    z, start = features.end[mine, 2], features.start[mine, 2]
    steady = bool((z <= start + _STEADY).all() and (z[:-1] + _STEADY >= start[1:]).all())
    limit = float(visits.bottom[number]) + _FLAT
    level = mine if steady else mine[(z <= limit) & (start <= limit)]
    low, high = np.searchsorted(traces.feature, [mine[0], mine[-1] + 1])
    rows = np.arange(low, high)[np.isin(traces.feature[low:high], level)]
    if not len(rows):
        return []
    apart = np.hypot(*(traces.begin[rows[1:]] - traces.end[rows[:-1]]).T) > _FOLLOWS
    return [
        loop
        for run in np.split(rows, 1 + np.flatnonzero(apart))
        for loop in loops_in(outline_of(traces.pick(run)))
        if len(loop) > 2
    ]
