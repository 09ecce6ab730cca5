"""Plan the speed of each segment of a program.

Moves through air become rapids. Other feeds are raised until the load matches the heaviest cut of the program.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats
from leafcut.material.chip_feeds import sliding_minimum_along_path
from leafcut.material.loads import Loads, tool_limits
from leafcut.model.cutter import Cutter
from leafcut.model.feed_limits import FEED_INCREASE
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.machine import Machine
from leafcut.model.pace import Pace, PaceRules, PaceStretch, ToolLimits
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.corners import RapidCorners, rows_with_free_rounding
from leafcut.timing.profile import move_time

#: A feed can be changed only in lines with these letters and G codes.
_LETTERS = frozenset("NGXYZIJKRF")
_MOTION_CODES = frozenset((1, 2, 3))
_BESIDE = frozenset((17, 18, 19, 90, 94))
#: A faster stretch must save at least this much time, s.
_WORTH = 0.03
#: Neighbouring slow stretches are merged if their speeds differ by less than this ratio.
_ALIKE = 0.02
#: Feeds are raised in powers of this factor.
_STEP = 1.1
#: A cut at most this wide, as a share of the tool diameter, is a finishing cut and keeps its feed.
FINISH = 0.05
#: A move's speed is also limited by neighbouring moves up to this distance before and after it, as a share of the tool
#: diameter.
_AROUND = 0.5
#: These tools leave their hole at the plunge feed.
_FED_OUT = (ToolKind.TAP, ToolKind.REAMER)
#: A rapid stays slow over this distance from a rounded corner, mm.
_SLOWLY = 0.5
#: Maximum number of passes that lower the speeds of short stretches.
_PASSES = 100
#: Shorter motions are ignored, mm.
_SAME = 1e-6


def plan_pace(
    program: Program,
    loads: Loads,
    tools: Mapping[int, Tool],
    cutters: Mapping[int, Cutter],
    rules: PaceRules,
    machine: Machine,
    top: float,
    check_cancelled: Heartbeat = ignore_heartbeat,
    chords: Collection[int] = (),
) -> Pace:
    """Plan new speeds for a program, segment by segment.

    A straight cut is divided wherever its speed changes. An arc has a single speed. Finishing cuts and plunges into the
    material are never sped up. Ramps are sped up only if the tool library lists a plunge feed.

    Parameters
    ----------
    top
        Height of the highest point of the material, mm.
    chords
        Rows of arcs that a rapid along the chord may replace (`arcs_in_air`).
    """
    limits = tool_limits(loads, tools, rules) if rules.feeds else {}
    speed = _speeds_in_material(loads, limits, cutters, rules, machine)
    pieces, path = loads.moves, program.path
    vertical = loads.is_vertical
    clear = loads.removed.over <= -rules.clearance
    candidates = ~pieces.rapid & ((clear | vertical) & rules.air | (speed != loads.feed))
    upwards = (
        vertical
        & (pieces.ends[:, 5] > pieces.ends[:, 2])
        & ~np.isin(pieces.tool, [number for number, tool in tools.items() if tool.kind in _FED_OUT])
    )
    fast = np.zeros(len(path), dtype=np.bool_)
    fast[loads.source[clear | vertical]] = True
    corners = RapidCorners(path, machine, rules.clearance, top, fast)
    every = np.arange(len(path))
    begins, ends = (np.searchsorted(loads.source, every, side=side) for side in ("left", "right"))
    stretches: dict[int, tuple[PaceStretch, ...]] = {}
    for row in np.unique(loads.source[candidates]).tolist():
        check_cancelled()
        divisible = _can_divide(program, row)
        if divisible is None:
            continue
        which = slice(int(begins[row]), int(ends[row]))
        own = float(path.value[row])
        if divisible:
            length = float(np.linalg.norm(path.end[row] - path.before[row]))
            if length < _SAME:
                continue
            found = _merge_small_gains(_speed_runs(speed[which]), length, own)
            way = _StraightCut(path.before[row], path.end[row], own)
            over = loads.removed.over[which]
            if loads.is_plunging[which].any():
                found = _set_speed_in_intervals(found, way.interval_above_material(over, rules), own)
            if rules.air:
                if upwards[which].all():
                    free = [(0.0, 1.0)]
                elif vertical[which].all():
                    free = way.interval_above_material(over, rules)
                else:
                    free = _clear_intervals(clear[which])
                free = way.intervals_worth_rapid(free, machine)
                found = _set_speed_in_intervals(found, free, min(max(own, corners.slow), way.fastest_in_air(machine)))
                found = _set_speed_in_intervals(
                    found, way.without_rounded_ends(free, corners.rounded_ends(row)), way.fastest_in_air(machine)
                )
        else:
            in_air = rules.air and bool(clear[which].all()) and not corners.free[row]
            fastest = max(machine.max_feed, own) if in_air else own
            length = float(loads.length[which].sum())
            chord = path.end[row] - path.before[row]
            if in_air and row in chords and length / own - float(move_time(chord[None], machine)[0]) > _WORTH:
                fastest = math.inf
            pays = length * (1.0 / own - 1.0 / fastest) > _WORTH
            found = [PaceStretch(1.0, fastest if pays else float(speed[which].min()))]
        if any(abs(one.speed - own) > 1e-9 * own for one in found):
            stretches[row] = tuple(found)
    return Pace(stretches, limits)


def arcs_in_air(program: Program, loads: Loads, rules: PaceRules, machine: Machine) -> list[int]:
    """Return the rows of arcs through air that could become a rapid along the chord.

    The caller must check that the chord is clear. If the rapids of the machine are not straight, only chords along a
    single axis qualify.
    """
    path = program.path
    free = rows_with_free_rounding(path, machine, rules.clearance)
    met = loads.removed.cuts | (loads.removed.over > -rules.clearance)
    blocked = np.zeros(len(path), dtype=np.bool_)
    blocked[loads.source[met]] = True
    found = []
    for row in np.flatnonzero(np.isin(path.kind, (Kind.ARC_CW, Kind.ARC_CCW)) & ~blocked & ~free).tolist():
        chord = np.abs(path.end[row] - path.before[row])
        if not (np.isfinite(chord).all() and chord.max() > _SAME) or path.arcs[int(path.ref[row])].turns > 1:
            continue
        bent = machine.rapid_style == "dogleg" and np.count_nonzero(chord > _SAME) > 1
        if not bent and _can_divide(program, row) is False:
            found.append(row)
    return found


def _speeds_in_material(
    loads: Loads,
    limits: Mapping[int, ToolLimits],
    cutters: Mapping[int, Cutter],
    rules: PaceRules,
    machine: Machine,
) -> Floats:
    """Return the speed at which each simulated move stays within the limits of its tool, mm/s.

    Tools without limits keep their feed.
    """
    speed = loads.feed.copy()
    chip = loads.chip
    for number, limit in limits.items():
        diameter = 2.0 * cutters[number].radius
        of_tool = loads.moves.tool == number
        mine = (loads.is_milling | loads.is_ramping) & of_tool & (chip > 0)
        bounds = _feed_factors(loads, limit, diameter, mine, rules)
        factor = np.minimum.reduce(list(bounds.values()))
        # Raise the speed in steps, so that it changes less often, but reduce excessive feeds at once.
        factor = np.where(factor > 1.0, np.minimum(_round_to_steps(factor), factor), factor)
        factor = sliding_minimum_along_path(np.where(mine, factor, np.inf), loads.length, _AROUND * diameter)
        speed[mine] *= factor[mine]
        plunges = loads.is_plunging & of_tool
        slower = np.minimum(np.minimum(_plunge_feed_factor(loads, limit), bounds["spindle"]), 1.0)
        speed[plunges] *= _least_by_row(slower, loads.source, plunges)
    speed = np.where(speed > loads.feed, np.maximum(np.minimum(speed, machine.max_feed), loads.feed), speed)
    return _limit_to_reachable(speed, loads.feed, loads.length, min(machine.acceleration) * machine.acceleration_factor)


def _feed_factors(
    loads: Loads, limit: ToolLimits, diameter: float, mine: NDArray[np.bool_], rules: PaceRules
) -> dict[str, Floats]:
    """Return the factors that each limit allows for the feeds of the moves in `mine`.

    Factors below 1 reduce the feed.
    """
    by_chip = limit.chip / np.where(mine, loads.chip, 1.0)
    none = np.full_like(by_chip, np.inf)
    by_rate = np.divide(limit.rate, loads.rate, out=none.copy(), where=loads.rate > 0)
    down = _plunge_feed_factor(loads, limit)
    return {
        # If several limits are equal, the first of them is the reported reason.
        "ramp": np.where(loads.is_ramping, np.minimum(down, 1.0) if math.isinf(limit.plunge) else down, np.inf),
        "finish": np.where(~loads.is_ramping & (loads.width <= FINISH * diameter), 1.0, np.inf),
        # Without library data, the level cuts define the worst chip; ramps with thicker chips are not slowed.
        "chip": by_chip if limit.stated else np.maximum(by_chip, 1.0),
        "rate": np.maximum(by_rate, 1.0),
        "increase": np.full_like(by_chip, FEED_INCREASE),
        "spindle": loads.max_feed_factor(limit, diameter),
    }


def _plunge_feed_factor(loads: Loads, limit: ToolLimits) -> Floats:
    return np.divide(
        limit.plunge, loads.descent_speed, out=np.full_like(loads.feed, np.inf), where=loads.descent_speed > 0
    )


class KeptFeed(NamedTuple):
    """Explains why a tool keeps its feed.

    Attributes
    ----------
    reason
        The limit that applies for the largest share of the cutting time. This is a key of `_feed_factors`, ``machine``
        (maximum feed), ``lines`` (the lines cannot be changed) or ``short`` (a higher feed saves no time).
    line
        First line to which the reason applies. If the tool library has no chip limit, this is the line of the heaviest
        cut. The heaviest cut has the thickest chip; among equals, it is the widest cut.
    share
        Share of the cutting time, from 0 to 1.
    width
        Width of cut at that line, mm.
    """

    reason: str
    line: int
    share: float
    width: float


def reason_for_kept_feed(
    program: Program, loads: Loads, number: int, limit: ToolLimits, diameter: float, rules: PaceRules, machine: Machine
) -> KeptFeed | None:
    """Explain why a tool does not cut faster. Return None if the tool only plunges."""
    mine = loads.main_cuts_of_tool(number) & (loads.is_milling | loads.is_ramping) & (loads.chip > 0)
    at = np.flatnonzero(mine)
    if not len(at):
        return None
    bounds = {name: values[at] for name, values in _feed_factors(loads, limit, diameter, mine, rules).items()}
    names = np.array([*bounds, "machine", "lines", "short"])
    table = np.array(list(bounds.values()))
    least = np.argmin(table, axis=0)
    rows = loads.source[at]
    changeable = {row: _can_divide(program, row) is not None for row in np.unique(rows).tolist()}
    free = table.min(axis=0) >= _STEP * (1.0 - 1e-9)
    lines = np.array([changeable[row] for row in rows.tolist()])
    above = np.where(loads.feed[at] >= machine.max_feed * (1.0 - 1e-9), "machine", np.where(lines, "short", "lines"))
    reason = np.where(free, above, names[least])
    seconds = loads.length[at] / loads.feed[at]
    by_reason = {name: float(seconds[reason == name].sum()) for name in names.tolist()}
    chosen = max(by_reason, key=lambda name: by_reason[name])
    which = reason == chosen
    if chosen == "chip" and not limit.stated:
        # The chip reaches its maximum at half the tool diameter, so a slot and its entry differ only in width.
        for values in (loads.chip[at], loads.width[at]):
            which &= values >= values[which].max() * (1.0 - 1e-6)
    first = int(np.flatnonzero(which)[0])
    return KeptFeed(
        chosen,
        int(program.path.line[rows[first]]),
        by_reason[chosen] / float(seconds.sum()),
        float(loads.width[at[first]]),
    )


def _least_by_row(factor: Floats, source: NDArray[np.int64], which: NDArray[np.bool_]) -> Floats:
    """Return the smallest factor in the source row of each chosen move.

    A plunge has a single speed for its whole row.
    """
    least = np.full(int(source.max(initial=-1)) + 1, np.inf)
    np.minimum.at(least, source[which], factor[which])
    return np.asarray(least[source[which]])


def _round_to_steps(factor: Floats) -> Floats:
    """Round factors down to a power of `_STEP`. The result is at least 1."""
    return np.asarray(_STEP ** np.floor(np.log(np.maximum(factor, 1.0)) / math.log(_STEP) + 1e-9))


def _limit_to_reachable(speed: Floats, own: Floats, length: Floats, acceleration: float) -> Floats:
    """Lower raised speeds that the machine cannot reach within a segment.

    Over a distance s, v² changes by at most 2as. Unreachable speeds are lowered step by step. Speeds at or below the
    programmed feed do not change.
    """
    speed = speed.copy()
    gains = 2.0 * acceleration * length
    way = np.append(0.0, np.cumsum(gains))
    for _ in range(_PASSES):
        raised = speed > own
        if not raised.any():
            break
        ends = np.minimum(np.append(speed[:1], speed), np.append(speed, speed[-1:])) ** 2
        ends = way + np.minimum.accumulate(ends - way)
        ends = np.minimum.accumulate((ends + way)[::-1])[::-1] - way
        peak = np.minimum(speed, np.sqrt(np.maximum(0.5 * (ends[:-1] + ends[1:] + gains), 0.0)))
        begins = np.append(0, np.flatnonzero(np.diff(speed)) + 1)
        best = np.repeat(np.maximum.reduceat(peak, begins), np.diff(np.append(begins, len(speed))))
        short = raised & (best < speed * (1.0 - 1e-6))
        if not short.any():
            break
        speed = np.where(short, np.minimum(own * _round_to_steps(best / np.where(own > 0, own, 1.0)), speed), speed)
    return speed


def _can_divide(program: Program, row: int) -> bool | None:
    """Return whether a motion can be divided, or None if not even its feed may change."""
    kind = int(program.path.kind[row])
    if kind not in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW):
        return None
    block = int(program.row_block[row])
    if not program.is_plain(row) or program.modal(block + 1).feed_mode != 94 or program.modal(block).radius != 40:
        return None
    words = program.words(block)
    codes = {word.value for word in words if word.letter == "G"}
    if not {word.letter for word in words} <= _LETTERS or not codes <= _MOTION_CODES | _BESIDE:
        return None
    known = np.isfinite(program.path.before[row]).all() and np.isfinite(program.path.end[row]).all()
    if not known or not program.path.value[row] > 0:
        return None
    return kind == Kind.FEED


def _speed_runs(speeds: Floats) -> list[PaceStretch]:
    """Combine consecutive moves of the same speed into segments. All moves must have the same length."""
    changes = np.append(np.flatnonzero(np.diff(speeds)), len(speeds) - 1)
    return [PaceStretch((k + 1) / len(speeds), float(speeds[k])) for k in changes.tolist()]


def _merge_small_gains(found: list[PaceStretch], length: float, own: float) -> list[PaceStretch]:
    """Undo raised speeds that save almost no time, and merge slowed segments of similar speed.

    Merged segments get the lowest of their speeds.
    """
    if len(found) == 1:
        return found
    kept: list[PaceStretch] = []
    before = fastest = 0.0
    for one in found:
        saves = length * (one.until - before) * (1.0 / own - 1.0 / one.speed)
        speed = own if one.speed > own and saves < _WORTH else one.speed
        before = one.until
        if kept and kept[-1].speed == speed:
            kept.pop()
        elif kept and max(kept[-1].speed, speed) < own and abs(speed - fastest) <= _ALIKE * fastest:
            speed = min(speed, kept.pop().speed)
        else:
            fastest = speed
        kept.append(PaceStretch(one.until, speed))
    return kept


def _clear_intervals(clear: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return the clear intervals of a motion as shares of its length.

    All moves of the motion must have the same length.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], clear, [False]]).astype(np.int8)))
    return [(first / len(clear), last / len(clear)) for first, last in edges.reshape(-1, 2).tolist()]


def _set_speed_in_intervals(
    found: list[PaceStretch], free: list[tuple[float, float]], speed: float
) -> list[PaceStretch]:
    for low, high in free:
        cut_up: list[PaceStretch] = []
        before = 0.0
        for one in found:
            if before < low:
                cut_up.append(PaceStretch(min(one.until, low), one.speed))
            if before < high <= one.until:
                cut_up.append(PaceStretch(high, speed))
            if one.until > high:
                cut_up.append(one)
            before = one.until
        found = cut_up
    return found


class _StraightCut(NamedTuple):
    """A straight cut: start and end, mm, and feed, mm/s."""

    begin: Floats
    end: Floats
    feed: float

    def interval_above_material(self, over: Floats, rules: PaceRules) -> list[tuple[float, float]]:
        """Return the interval of a vertical move that is above all material, as shares of its length."""
        z0, z1 = float(self.begin[2]), float(self.end[2])
        low, high = min(z0, z1), max(z0, z1)
        height = low + float(over.max()) + rules.clearance
        if height >= high:
            return []
        if height <= low:
            return [(0.0, 1.0)]
        share = (z0 - height) / (z0 - z1)
        return [(0.0, share)] if z1 < z0 else [(share, 1.0)]

    def without_rounded_ends(
        self, free: list[tuple[float, float]], rounds: tuple[bool, bool]
    ) -> list[tuple[float, float]]:
        """Shorten the clear intervals at corners that the controller may round."""
        keeps = _SLOWLY / float(np.linalg.norm(self.end - self.begin))
        low, high = (keeps if rounds[0] else 0.0), (1.0 - keeps if rounds[1] else 1.0)
        return [(max(a, low), min(b, high)) for a, b in free if max(a, low) < min(b, high)]

    def fastest_in_air(self, machine: Machine) -> float:
        """Return the speed through air, mm/s: infinite for a rapid, or the maximum feed if rapids are not straight."""
        axes = np.count_nonzero(np.abs(self.end - self.begin) > _SAME)
        return max(machine.max_feed, self.feed) if machine.rapid_style == "dogleg" and axes > 1 else math.inf

    def intervals_worth_rapid(self, free: list[tuple[float, float]], machine: Machine) -> list[tuple[float, float]]:
        """Return the clear intervals in which a rapid saves time, even though it starts and ends at rest."""
        found = []
        for low, high in free:
            delta = (high - low) * (self.end - self.begin)
            fastest = self.fastest_in_air(machine)
            feed = None if math.isinf(fastest) else fastest
            if float(np.linalg.norm(delta)) / self.feed - float(move_time(delta[None], machine, feed)[0]) > _WORTH:
                found.append((low, high))
        return found
