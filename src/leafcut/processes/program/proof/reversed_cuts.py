"""Compare programs with reversed cuts, by putting every open cut at one level in both into a reference direction.

The conditions are checked again here, from the motion alone: a cut is at one level, it does not close or cross itself,
it has no lead-in or lead-out, and the tool arrives and leaves by rapids.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Indices, Mask
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import AMOUNT, EXACT, Features, is_uniform
from leafcut.processes.program.proof.program_work import STILL, ProgramWork
from leafcut.processes.program.proof.rapids import RapidGaps, group_rapids
from leafcut.processes.program.proof.traces import is_simple

#: Largest gap between the ends of a closed cut, mm.
_CLOSED = 0.01
#: Reference direction of cuts in the comparison. Lines in a usual drawing are not parallel to it.
_ONWARD = np.array([0.8386705679, 0.5446390350])
#: Values that must be constant in a reversible run. Dwells differ in feed and time, arcs in kind, plane and turns.
_STEADY = tuple(name for name in (*EXACT, *AMOUNT) if name not in ("kind", "plane", "turns", "feed", "dwell"))


class DirectedWork(NamedTuple):
    """The work of a program with its open cuts in the reference direction.

    The features are sorted run by run, and a reversed run keeps its place in the order. `run`, int64[n], is the run of
    each feature if that run is reversible, otherwise -1. `turned` marks the features that were reversed.
    """

    work: ProgramWork
    run: Indices
    turned: Mask


def unchanged_work(work: ProgramWork) -> DirectedWork:
    """Return the work with all cuts unchanged."""
    n = len(work.features)
    return DirectedWork(work, np.full(n, -1), np.zeros(n, dtype=bool))


def in_reference_direction(work: ProgramWork) -> DirectedWork:
    """Return the work with every reversible cut in the reference direction."""
    features, gaps = work.features, group_rapids(work)
    n = len(features)
    begins = np.flatnonzero(gaps.rows[gaps.gap_of] | ~gaps.opened_by_feature[gaps.gap_of])
    order, run, turned = np.arange(n), np.full(n, -1), np.zeros(n, dtype=bool)
    new = features.pick(order)
    for first, end in pairwise([*begins.tolist(), n]):
        body = _cuts_of_run(features, gaps, first, end)
        if body is None:
            continue
        run[first:end] = first
        way = features.end[body[-1], :2] - features.start[body[0], :2]
        if float(way @ _ONWARD) < 0.0:
            turned[first:end] = True
            order[body] = body[::-1]
            _reverse_run(new, features, first, end, body)
    if turned.any():
        picked = new.pick(order)
        # The row gives the place among the rapids, which belongs to the run and not to the cut.
        new = replace(picked, row=features.row)
    return DirectedWork(replace(work, features=new), run, turned)


def _cuts_of_run(features: Features, gaps: RapidGaps, first: int, end: int) -> Indices | None:
    """Return the cuts of a run without its plunge and retract, or None if the run is not reversible."""
    rows = np.arange(first, end)
    level = rows[~_vertical_mask(features, rows)]
    if not len(level):
        return None
    body: Indices = np.arange(level[0], level[-1] + 1)
    after = gaps.gap_of[end - 1] + 1
    reached = gaps.rows[gaps.gap_of[first]] and (gaps.rows[after] or not gaps.closed_by_feature[after])
    if len(body) != len(level) or not reached or not _is_constant(features, rows, body):
        return None
    ends = features.start[body[0], :2], features.end[body[-1], :2]
    if not np.isfinite(ends).all() or np.hypot(*(ends[1] - ends[0])) <= _CLOSED:
        return None
    cuts = features.pick(body)
    return body if is_uniform(cuts) and is_simple(cuts) else None


def _vertical_mask(features: Features, rows: Indices) -> Mask:
    """Return a mask of the cuts without sideways movement, and of the dwells."""
    moved = np.abs(features.end[rows, :2] - features.start[rows, :2]) > STILL
    upright: Mask = ((features.kind[rows] == Kind.FEED) & ~moved.any(axis=1)) | (features.kind[rows] == Kind.DWELL)
    return upright


def _is_constant(features: Features, rows: Indices, body: Indices) -> bool:
    """Return whether the machine state is constant in a run, and its body is at one level."""
    steady = features.several(_STEADY, rows)
    kinds = np.isin(features.kind[rows], [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DWELL)])
    arcs = body[features.kind[body] != Kind.FEED]
    flat = (features.of("plane", arcs) == 17) & (features.of("turns", arcs) == 1)
    z = np.concatenate([features.end[body, 2], features.start[body, 2]])
    level = bool(np.isnan(z).all() or np.ptp(z) <= STILL)
    radius, mode = (features.of(name, rows[:1])[0] for name in ("radius", "feed_mode"))
    return bool(
        kinds.all() and (steady == steady[0]).all() and flat.all() and level and radius == 40 and mode in (94, 95)
    )


def _reverse_run(new: Features, old: Features, first: int, end: int, body: Indices) -> None:
    """Reverse each cut of a run in `new` (kind, start, end), and exchange the positions of plunge and retract."""
    new.end[body], new.start[body] = old.start[body], old.end[body]
    kind = old.kind[body]
    back = np.where(kind == Kind.ARC_CW, int(Kind.ARC_CCW), np.where(kind == Kind.ARC_CCW, int(Kind.ARC_CW), kind))
    new.kind[body] = back
    entry, leave = old.start[body[0], :2], old.end[body[-1], :2]
    for part, place in ((slice(first, int(body[0])), leave), (slice(int(body[-1]) + 1, end), entry)):
        new.end[part, :2], new.start[part, :2] = place, place


def reversed_runs(one: DirectedWork, other: DirectedWork, new_of: Indices) -> Indices:
    """Return the run of each feature if the other program cuts it in the opposite direction, otherwise -1."""
    paired = np.flatnonzero((new_of >= 0) & (one.run >= 0))
    differs = paired[one.turned[paired] != other.turned[new_of[paired]]]
    turned = np.isin(one.run, one.run[differs]) & (one.run >= 0)
    return np.where(turned, one.run, -1)
