"""Verify new speeds and heights.

The path must not change, speeds must stay within their limits, and only moves through air may be lower.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import VerifyError
from leafcut.geometry.arrays import Floats
from leafcut.material.loads import Loads
from leafcut.message import Message
from leafcut.model.cutter import Cutter
from leafcut.model.feed_limits import FEED_INCREASE
from leafcut.model.pace import PaceRules, PaceStretch, ToolLimits
from leafcut.model.toolpath import Kind, Toolpath

#: Maximum distance of a division point from its cut, mm. The point is rounded when it is written.
_OFF = 2e-4
#: Points within this distance count as equal, mm.
_SAME = 1e-6
#: Relative tolerance for feeds and limits.
_PART = 1e-6
#: Kinds of straight motions.
_ALONG = (Kind.RAPID, Kind.FEED)
_ARCS = (Kind.ARC_CW, Kind.ARC_CCW)


def changed_stretches(before: Toolpath, after: Toolpath) -> dict[int, tuple[PaceStretch, ...]]:
    """Map each changed row of the original program to its segments with new speeds.

    Raises
    ------
    VerifyError
        The path or the work differs.
    """
    found: dict[int, tuple[PaceStretch, ...]] = {}
    at = 0
    count = len(after)
    for row in range(len(before)):
        kind = Kind(int(before.kind[row]))
        if kind is Kind.FEED:
            parts, at = _match_stretches(before, after, row, at)
            own = float(before.value[row])
            if len(parts) > 1 or not math.isclose(parts[0].speed, own, rel_tol=_PART):
                found[row] = parts
            continue
        if kind in _ARCS and at < count and after.kind[at] == Kind.RAPID and _has_same_end(before, after, row, at):
            # A rapid along the chord; its clearance is checked together with the other rapids.
            found[row] = (PaceStretch(1.0, math.inf),)
            at += 1
            continue
        if at >= count or not _same_row(before, after, row, at):
            raise _path_error(before, after, row, at)
        if kind in _ARCS and not math.isclose(before.value[row], after.value[at], rel_tol=_PART):
            found[row] = (PaceStretch(1.0, float(after.value[at])),)
        at += 1
    if at != count:
        raise VerifyError(
            "line {}: the program with new speeds continues after the end of the original", after.line[at]
        )
    return found


def _match_stretches(before: Toolpath, after: Toolpath, row: int, at: int) -> tuple[tuple[PaceStretch, ...], int]:
    """Return the segments of a divided straight cut and the next row in the new program.

    Each segment has a constant speed.
    """
    begin, end = before.before[row], before.end[row]
    way = end - begin
    known = bool(np.isfinite(way).all())
    length = float(np.linalg.norm(way)) if known else 0.0
    parts: list[PaceStretch] = []
    share = 0.0
    while True:
        if at >= len(after) or after.kind[at] not in (Kind.FEED, Kind.RAPID):
            raise _path_error(before, after, row, at)
        place = after.end[at]
        speed = math.inf if after.kind[at] == Kind.RAPID else float(after.value[at])
        at += 1
        if np.allclose(place, end, rtol=0.0, atol=_SAME, equal_nan=True):
            parts.append(PaceStretch(1.0, speed))
            return tuple(parts), at
        until = float((place - begin) @ way) / length**2 if length > _SAME else math.nan
        off = float(np.linalg.norm(place - begin - until * way))
        if not (share < until < 1.0 and off <= _OFF):
            raise _path_error(before, after, row, at - 1)
        share = until
        parts.append(PaceStretch(until, speed))


def _same_row(before: Toolpath, after: Toolpath, row: int, at: int) -> bool:
    if before.kind[row] != after.kind[at]:
        return False
    kind = Kind(int(before.kind[row]))
    if not _has_same_end(before, after, row, at):
        return False
    if kind in _ARCS:
        one, other = before.arcs[int(before.ref[row])], after.arcs[int(after.ref[at])]
        same = (one.plane, one.turns) == (other.plane, other.turns)
        return same and bool(np.allclose(one.center, other.center, rtol=0.0, atol=_SAME))
    if not math.isclose(before.value[row], after.value[at], rel_tol=_PART):
        return False
    if kind is Kind.DRILL:
        return before.cycles[int(before.ref[row])] == after.cycles[int(after.ref[at])]
    # The number of an origin shift may differ between the programs.
    return kind is Kind.SHIFT or bool(before.ref[row] == after.ref[at])


def _has_same_end(before: Toolpath, after: Toolpath, row: int, at: int) -> bool:
    return bool(np.allclose(before.end[row], after.end[at], rtol=0.0, atol=_SAME, equal_nan=True))


def _path_error(before: Toolpath, after: Toolpath, row: int, at: int) -> VerifyError:
    line = Message("line {}", after.line[at]) if at < len(after) else Message("the end")
    return VerifyError(
        "{}: the program with new speeds differs from line {} of the original in more than its speed",
        line,
        before.line[row],
    )


def highest_new_speeds(loads: Loads, stretches: dict[int, tuple[PaceStretch, ...]]) -> Floats:
    """Return the highest new speed of every simulated move, mm/s. Rapids have an infinite speed."""
    speed = loads.feed.copy()
    every = np.arange(int(loads.source.max(initial=-1)) + 2)
    first = np.searchsorted(loads.source, every, side="left")
    for row, parts in stretches.items():
        if row + 1 >= len(first):
            continue
        low, high = int(first[row]), int(first[row + 1])
        count = high - low
        speed[low:high] = 0.0
        begin = 0.0
        for until, value in parts:
            # A move that the stretch touches only at its edge, by a rounded division point, is not part of it.
            a, b = math.floor(begin * count + 1e-3), math.ceil(until * count - 1e-3)
            mine = slice(low + a, low + max(b, a))
            speed[mine] = np.maximum(speed[mine], value)
            begin = until
    return speed


def check_limits(
    loads: Loads,
    stretches: dict[int, tuple[PaceStretch, ...]],
    limits: dict[int, ToolLimits],
    rules: PaceRules,
    cutters: Mapping[int, Cutter],
) -> Floats:
    """Check the new speeds against the loads, and return the speed of every simulated move, mm/s.

    Raises
    ------
    VerifyError
        A speed exceeds its limit.
    """
    speed = highest_new_speeds(loads, stretches)
    cuts, chip = loads.is_milling | loads.is_ramping, loads.chip
    faster = np.isfinite(speed) & (speed > loads.feed * (1.0 + _PART))
    ratio = np.divide(speed, loads.feed, out=np.ones_like(speed), where=np.isfinite(speed) & (loads.feed > 0))
    # The ratio is slightly reduced, because a speed may equal its limit.
    ratio /= 1.0 + _PART
    upright = loads.is_vertical
    clear = ~loads.removed.cuts & (loads.removed.over <= -rules.clearance * (1.0 - _PART))
    # A move in air has no chip load, so any speed up to a rapid is allowed.
    faster &= ~(clear & rules.air) & ~upright
    wrong = faster & (ratio > FEED_INCREASE)
    for number, limit in limits.items():
        mine = cuts & (loads.moves.tool == number) & np.isfinite(speed)
        diameter = 2.0 * cutters[number].radius
        wrong |= mine & faster & (chip * ratio > limit.chip)
        wrong |= mine & faster & (loads.rate * ratio > limit.rate)
        wrong |= mine & faster & (ratio > loads.max_feed_factor(limit, diameter))
        # Ramps may be faster only if the plunge feed is known.
        known = limit.plunge if math.isfinite(limit.plunge) else 0.0
        wrong |= mine & faster & loads.is_ramping & (loads.descent_speed * ratio > known)
    wrong |= faster & ~np.isin(loads.moves.tool, list(limits))
    wrong |= np.isinf(speed) & ~clear & ~upright
    wrong[_plunges_too_fast(loads, stretches, rules)] = True
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        x, y, z = loads.moves.ends[at, :3].tolist()
        raise VerifyError(
            "T{} at X{:.3f} Y{:.3f} Z{:.3f}: a new speed is higher than is allowed there", loads.moves.tool[at], x, y, z
        )
    return speed


def _plunges_too_fast(loads: Loads, stretches: dict[int, tuple[PaceStretch, ...]], rules: PaceRules) -> list[int]:
    wrong = []
    for at in np.flatnonzero(loads.is_vertical & ~loads.moves.rapid).tolist():
        parts = stretches.get(int(loads.source[at]), ())
        z0, z1 = float(loads.moves.ends[at, 2]), float(loads.moves.ends[at, 5])
        if z1 >= z0:
            continue
        lowest = z1 + float(loads.removed.over[at]) + rules.clearance
        fast = [part.until for part in parts if part.speed > loads.feed[at] * (1.0 + _PART)]
        if fast and z0 + max(fast) * (z1 - z0) < lowest - _OFF:
            wrong.append(at)
    return wrong


def rows_changed_to_rapid(
    before: Toolpath, stretches: dict[int, tuple[PaceStretch, ...]]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of the new program in which a cut became a rapid, and the rows in which an arc became a rapid."""
    rows: list[int] = []
    chords: list[int] = []
    at = 0
    for row in range(len(before)):
        parts = stretches.get(row)
        if parts is None:
            at += 1
            continue
        fast = [at + k for k, part in enumerate(parts) if math.isinf(part.speed)]
        rows += fast
        chords += fast if before.kind[row] in _ARCS else []
        at += len(parts)
    return np.array(rows, dtype=np.int64), np.array(chords, dtype=np.int64)


def check_lowered(
    before: Toolpath, after: Toolpath, loads: Loads, rules: PaceRules, bent_above: float = -math.inf
) -> None:
    """Check that a program differs only in lower moves, and that these moves stay clear of the material.

    `loads` are the loads of the program with the lower heights. If rapids are not straight, a lowered rapid in both X
    and Y must stay above `bent_above` plus the clearance, mm.

    Raises
    ------
    VerifyError
        Another difference exists, or a lower move comes too close to the material.
    """
    lowered = _lowered_rows(before, after)
    if lowered is None:
        raise VerifyError("the program with lower heights differs from the original in more than its heights")
    # A move with a lower start is a changed move as well.
    starts = np.abs(before.before[:, 2] - after.before[:, 2]) > _SAME
    rows = np.union1d(lowered, np.flatnonzero(starts & np.isin(after.kind, (*_ALONG, Kind.DRILL))))
    ends, over = loads.moves.ends, loads.removed.over
    rises = loads.is_vertical & (ends[:, 5] > ends[:, 2])
    # Plunges with a lower start and pecks into their own hole may touch material, but sideways moves may not.
    digs = loads.is_vertical & ~loads.moves.rapid
    drills = after.kind[loads.source] == Kind.DRILL
    cycle = after.ref[loads.source[drills]]
    planes = np.full(len(ends), -math.inf)
    planes[drills] = np.array([one.r_plane for one in after.cycles])[cycle] if len(cycle) else 0.0
    pecks = drills & (np.minimum(ends[:, 2], ends[:, 5]) < planes - _SAME)
    mine = np.isin(loads.source, rows) & ~rises & ~digs & ~pecks
    # A vertical approach to an unchanged R plane differs only in its lower start.
    alike = np.zeros(len(after), dtype=np.bool_)
    for row in np.flatnonzero(after.kind == Kind.DRILL).tolist():
        one, other = before.cycles[int(before.ref[row])], after.cycles[int(after.ref[row])]
        alike[row] = one.r_plane == other.r_plane and one.to_initial == other.to_initial
    unchanged = (~np.isin(loads.source, lowered) | alike[loads.source]) & loads.is_vertical
    near = mine & ~unchanged & (over > -rules.clearance * (1.0 - _PART))
    bent = loads.moves.rapid & (np.abs(ends[:, 3:5] - ends[:, :2]) > _SAME).all(axis=1)
    near |= mine & ~unchanged & bent & (np.minimum(ends[:, 2], ends[:, 5]) < bent_above + rules.clearance - _OFF)
    if near.any():
        line = int(after.line[loads.source[int(np.flatnonzero(near)[0])]])
        raise VerifyError("line {}: a lowered move comes too close to the material", line)


def _lowered_rows(before: Toolpath, after: Toolpath) -> list[int] | None:
    """Return the rows of the new toolpath with lower heights, or None if anything else differs."""
    if len(before) != len(after) or (before.kind != after.kind).any():
        return None
    lowered = []
    close = np.isclose(before.end, after.end, rtol=0.0, atol=_SAME, equal_nan=True)
    if not close[:, :2].all() or not np.isclose(before.value, after.value, rtol=1e-9, atol=0.0).all():
        return None
    for row in range(len(before)):
        kind = before.kind[row]
        if kind == Kind.DRILL:
            one, other = before.cycles[int(before.ref[row])], after.cycles[int(after.ref[row])]
            if one == other and close[row, 2]:
                continue
            if (one.name, one.bottom, one.peck, one.dwell) != (other.name, other.bottom, other.peck, other.dwell):
                return None
            # A hole may now retract to the R plane instead of the initial height, but never higher than before.
            rises = (other.to_initial and not one.to_initial) or other.r_plane > one.r_plane
            if rises or not after.end[row, 2] <= before.end[row, 2] + _SAME:
                return None
            lowered.append(row)
            continue
        if kind in _ARCS:
            if before.arcs[int(before.ref[row])] != after.arcs[int(after.ref[row])] or not close[row, 2]:
                return None
        elif kind != Kind.SHIFT and before.ref[row] != after.ref[row]:
            return None
        if not close[row, 2]:
            if kind not in _ALONG or not after.end[row, 2] < before.end[row, 2]:
                return None
            lowered.append(row)
    return lowered
