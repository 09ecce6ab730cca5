"""Compute the chip thickness and the power of a pocketing program after it has been read back."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from leafcut.geometry.arrays import Floats, Indices
from leafcut.material.chip_feeds import chip_thickness, cutting_power, power_on_plunge, power_on_ramp, removal_rate
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pace_change import FeedLimit, ToolPace
from leafcut.model.pocket import PocketRules
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.pocket.proof.pocket import (
    HEIGHT_TOLERANCE,
    EarlierCuts,
    PocketCut,
    cutting_moves,
    engaged_levels,
    max_ignored_film,
)
from leafcut.proof.difference import limit_differences, position_text
from leafcut.units import SECONDS_PER_MINUTE

#: Relative tolerance of all limits, because a program contains rounded numbers.
_PART = 1e-4
#: Maximum difference between heights that count as equal, mm.
_SAME = 1e-6
#: Maximum width of material under a plunging tool that is ignored, in tool radii.
_SLIVER = 0.03


@dataclass(frozen=True, eq=False)
class MeasuredChips:
    """The load on the end mill: chips and feeds, number of cuts with a changed feed, and violations of limits."""

    tool: ToolPace
    changed: int
    wrong: tuple[Difference, ...]


@dataclass(frozen=True)
class _Ramp:
    cut: PocketCut
    power: float


@dataclass(frozen=True, eq=False)
class _LevelSamples:
    cuts: list[PocketCut]
    move: Indices
    feed: Floats
    chip: Floats
    chip_before: Floats
    power: Floats
    power_before: Floats
    rate: Floats


def measure_chips(
    written: Toolpath, rules: PocketRules, limits: FeedLimits, tool: Tool, levels: Sequence[float]
) -> MeasuredChips:
    """Measure the chips in a program, and check these rules:

    1. No chip is thicker than with the feed and speed of the tool, and no cut needs more power than the spindle has
       (`material.chip_feeds`). This applies to every sample.
    2. No cutting move exceeds the maximum feed.
    3. No descent below the surface exceeds the feed of the tool or the power of the spindle. A ramp or helix counts as
       a slot as deep as the level. A plunge into a cleared area needs no power.

    Films thinner than `max_ignored_film` are ignored. `levels` contains the heights of cuts, mm. All other moves are
    descents.
    """
    cuts = list(cutting_moves(written, rules.tolerance))
    rpm = np.abs(written.latest(Kind.SPINDLE, written.value))
    # After rounding, a short move of a ramp may be horizontal, but it is not at the height of a level.
    flat = {
        cut.row
        for cut in cuts
        if cut.height_difference <= _SAME and np.abs(np.array(levels) - cut.z).min() <= HEIGHT_TOLERANCE
    }
    samples = list(_sample_levels(cuts, written, rpm, rules, limits, flat))
    wrong = [
        Difference(Message("feed"), 0, cut.line, _feed_message(cut, written, Message("goes down"), limits.feed))
        for cut in cuts
        if cut.row not in flat and written.value[cut.row] > limits.feed * (1.0 + _PART)
    ]
    for level in samples:
        wrong += _limit_differences(level, written, limits)
    ramps = [*_ramps(cuts, written, limits, flat, levels), *_plunge_ramps(cuts, written, rules, limits)]
    wrong += [
        Difference(Message("feed"), 0, ramp.cut.line, _power_message(ramp.cut, written, ramp.power, limits))
        for ramp in ramps
        if ramp.power > limits.power * (1.0 + _PART)
    ]
    feed, chip, before, rate = (_concatenate_levels(samples, name) for name in ("feed", "chip", "chip_before", "rate"))
    low, high = (float(feed.min()), float(feed.max())) if len(feed) else (limits.feed, limits.feed)
    rate_before = float((rate * limits.feed / feed).max(initial=0.0)) if len(feed) else 0.0
    pace = ToolPace(
        tool.number,
        tool.label,
        (limits.feed, limits.feed),
        (low, high),
        float(before.max(initial=0.0)),
        float(chip.max(initial=0.0)),
        limits.chip,
        True,
        rate_before,
        float(rate.max(initial=0.0)),
        tuple(_power_limits(samples, ramps, limits)),
    )
    rows = {level.cuts[k].row for level in samples for k in np.unique(level.move).tolist()}
    changed = sum(abs(float(written.value[row]) - limits.feed) > _PART * limits.feed for row in rows)
    return MeasuredChips(pace, changed, tuple(limit_differences(wrong)))


def _concatenate_levels(samples: list[_LevelSamples], name: str) -> Floats:
    return np.concatenate([np.zeros(0), *(getattr(level, name) for level in samples)])


def _power_limits(samples: list[_LevelSamples], ramps: list[_Ramp], limits: FeedLimits) -> Iterator[FeedLimit]:
    """Yield the power limit of the spindle, if it is known.

    The result includes the maximum power before and after feeds were changed.
    """

    def most(values: Floats) -> float:
        return float(values.max(initial=0.0))

    if math.isfinite(limits.power):
        down = np.array([ramp.power for ramp in ramps])
        power = max(most(_concatenate_levels(samples, "power")), most(down))
        yield FeedLimit("power", max(most(_concatenate_levels(samples, "power_before")), power), power, limits.power)


def _sample_levels(
    cuts: list[PocketCut], written: Toolpath, rpm: Floats, rules: PocketRules, limits: FeedLimits, flat: set[int]
) -> Iterator[_LevelSamples]:
    for there, path, engaged in engaged_levels(cuts, rules, flat):
        rows = np.array([cut.row for cut in there], dtype=np.int64)[path.piece]
        feed, turns = written.value[rows], np.maximum(rpm[rows], 1e-9)
        chip = chip_thickness(engaged, feed, turns)
        met = (engaged.width > max_ignored_film(rules)) & np.isin(rows, list(flat))
        yield _LevelSamples(
            there,
            path.piece[met],
            feed[met],
            chip[met],
            (chip * limits.feed / feed)[met],
            cutting_power(engaged, feed, limits)[met],
            cutting_power(engaged, limits.feed, limits)[met],
            removal_rate(engaged, feed, limits)[met],
        )


def _limit_differences(level: _LevelSamples, written: Toolpath, limits: FeedLimits) -> Iterator[Difference]:
    thick, strong, fast = (
        _worst_samples(level, level.chip / limits.chip),
        _worst_samples(level, level.power / limits.power),
        _worst_samples(level, level.feed / limits.most),
    )
    for cut, at in thick:
        words = Message(
            "{} makes a chip of {:.4g} mm per revolution near {}; the limit is {:.4g} mm",
            _move_text(cut, written),
            level.chip[at],
            position_text(*cut.path[-1]),
            limits.chip,
        )
        yield Difference(Message("feed"), 0, cut.line, words)
    for cut, at in strong:
        yield Difference(Message("feed"), 0, cut.line, _power_message(cut, written, level.power[at], limits))
    for cut, _ in fast:
        yield Difference(Message("feed"), 0, cut.line, _feed_message(cut, written, Message("cuts"), limits.most))


def _worst_samples(level: _LevelSamples, share: Floats) -> Iterator[tuple[PocketCut, int]]:
    """Yield each move that exceeds its limit (`share` above 1), with the index of the worst sample of the move."""
    over = np.flatnonzero(share > 1.0 + _PART)
    for move in np.unique(level.move[over]).tolist():
        mine = over[level.move[over] == move]
        yield level.cuts[move], int(mine[np.argmax(share[mine])])


def _ramps(
    cuts: list[PocketCut], written: Toolpath, limits: FeedLimits, flat: set[int], levels: Sequence[float]
) -> Iterator[_Ramp]:
    """Yield each ramp, with the power that it needs, W.

    Consecutive moves with the same feed form a single ramp. Because heights are rounded, the slope varies from move to
    move.
    """
    descents: list[list[PocketCut]] = []
    for cut in cuts:
        if cut.row in flat or not _horizontal_length(cut) > _SAME or not cut.path[0, 2] > cut.z - _SAME:
            continue
        last = descents[-1][-1] if descents else None
        if last and cut.row == last.row + 1 and written.value[cut.row] == written.value[last.row]:
            descents[-1].append(cut)
        else:
            descents.append([cut])
    tops = np.append(np.array(levels), 0.0)
    for descent in descents:
        last, bottom = descent[-1], descent[-1].z
        across, fall = sum(_horizontal_length(cut) for cut in descent), float(descent[0].path[0, 2]) - bottom
        depth = float(tops[tops > bottom + HEIGHT_TOLERANCE].min(initial=0.0)) - bottom
        by_feed = float(written.value[last.row]) / math.hypot(across, fall)
        yield _Ramp(last, power_on_ramp(limits, by_feed * across, by_feed * fall, depth))


def _plunge_ramps(cuts: list[PocketCut], written: Toolpath, rules: PocketRules, limits: FeedLimits) -> Iterator[_Ramp]:
    """Yield each plunge into material, with the power that it needs, W."""
    if limits.material is None:
        return
    earlier = EarlierCuts(cuts, rules)
    for cut in cuts:
        centre, bottom = cut.path[-1, :2], cut.z
        if _horizontal_length(cut) > _SAME or not cut.path[0, 2] > bottom + _SAME:
            continue
        disc = shapely.Point(centre).buffer((1.0 - _SLIVER) * rules.radius)
        if not earlier.cleared_area(centre, cut.row, bottom + HEIGHT_TOLERANCE).covers(disc):
            yield _Ramp(cut, power_on_plunge(limits, float(written.value[cut.row])))


def _horizontal_length(cut: PocketCut) -> float:
    return float(np.hypot(*np.diff(cut.path[:, :2], axis=0).T).sum())


def _power_message(cut: PocketCut, written: Toolpath, power: float, limits: FeedLimits) -> Message:
    return Message(
        "{} needs {:.4g} kW near {}; the spindle provides at most {:.4g} kW",
        _move_text(cut, written),
        power / 1000.0,
        position_text(*cut.path[-1]),
        limits.power / 1000.0,
    )


def _feed_message(cut: PocketCut, written: Toolpath, what: str, limit: float) -> Message:
    return Message(
        "{} {} near {}; the mill cuts at {:g} mm/min at most",
        _move_text(cut, written),
        what,
        position_text(*cut.path[-1]),
        SECONDS_PER_MINUTE * limit,
    )


def _move_text(cut: PocketCut, written: Toolpath) -> Message:
    return Message("a move at {:g} mm/min", SECONDS_PER_MINUTE * float(written.value[cut.row]))
