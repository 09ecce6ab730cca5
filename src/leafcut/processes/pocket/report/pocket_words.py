"""Measures of pockets and their strategies, as numbers and as text."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from leafcut.message import Message
from leafcut.model.outcome import Outcome
from leafcut.model.pocket import PocketMeasures, PocketPlan, PocketProgram
from leafcut.processes.pocket.model import PocketDetail
from leafcut.report.wording import (
    NO_VALUE,
    count,
    percent_words,
    plain_number,
)


@dataclass(frozen=True)
class StrategyFigures:
    """Measures of a strategy over one level of all pockets.

    `measures` contains sums and maxima; it is None if the strategy is refused. `program_s` is the time of a program
    that clears all pockets by this strategy. `passed_over` states why the strategy was rejected although it is cheaper,
    for the first pocket with a reason. `usual` is true if the written program is compared with this strategy in any
    pocket.
    """

    name: str
    chosen: bool
    measures: PocketMeasures | None
    refused: str = ""
    program_s: float = 0.0
    passed_over: str = ""
    usual: bool = False


def strategy_figures(outcome: Outcome[PocketDetail]) -> list[StrategyFigures]:
    """Return the measures of each strategy over all pockets.

    If the written program uses the same strategy in all pockets, the strategy gets the machine time of this program.
    The same applies to the program for comparison.
    """
    detail = outcome.detail
    whole = {
        tuple({plan.usual.strategy for plan in detail.plans}): outcome.before.time_s,
        tuple({plan.result.strategy for plan in detail.plans}): outcome.after.time_s,
    }
    rows = figures_by_strategy(detail.plans, detail.programs)
    return [replace(row, program_s=whole.get((row.name,), row.program_s)) for row in rows]


def figures_by_strategy(plans: Sequence[PocketPlan], programs: Sequence[PocketProgram] = ()) -> list[StrategyFigures]:
    """Return the measures of each strategy over all pockets. A strategy that is refused in any pocket is refused.

    `programs` contains the times and rapids of programs for several pockets.
    """
    rows, whole = [], {program.strategy: program for program in programs}
    for name in dict.fromkeys(r.strategy for plan in plans for r in plan.results):
        mine = [r for plan in plans for r in plan.results if r.strategy == name]
        chosen = any(plan.result.strategy == name for plan in plans)
        refused = next((r.refused for r in mine if r.measures is None), "")
        known = [r.measures for r in mine if r.measures is not None]
        found = None if refused else _with_moves_between(sum_measures(known), whole.get(name))
        time_s = whole[name].time_s if name in whole else sum(r.program_s for r in mine)
        passed_over = next((r.passed_over for r in mine if r.passed_over), "")
        usual = any(plan.usual.strategy == name for plan in plans)
        rows.append(StrategyFigures(name, chosen, found, refused, time_s, passed_over, usual))
    return rows


def _with_moves_between(measures: PocketMeasures, program: PocketProgram | None) -> PocketMeasures:
    """Return the measures with the rapids and retracts of a program for several pockets, if there is a program."""
    if program is None:
        return measures
    return replace(measures, rapid_mm=program.rapid_mm, retracts=program.retracts)


def sum_measures(every: Sequence[PocketMeasures]) -> PocketMeasures:
    """Return the combined measures of several pockets.

    Lengths and areas are added, the mean engagement is weighted by path length, and all other values are maxima.
    """
    feed = sum(m.feed_mm for m in every)
    return PocketMeasures(
        feed_mm=feed,
        rapid_mm=sum(m.rapid_mm for m in every),
        retracts=sum(m.retracts for m in every),
        finish_mm=sum(m.finish_mm for m in every),
        gouge_mm2=sum(m.gouge_mm2 for m in every),
        reachable_mm2=sum(m.reachable_mm2 for m in every),
        uncovered_mm2=sum(m.uncovered_mm2 for m in every),
        max_step_over=max((m.max_step_over for m in every), default=0.0),
        max_core=max((m.max_core for m in every), default=0.0),
        max_engagement=max((m.max_engagement for m in every), default=0.0),
        max_width=max((m.max_width for m in every), default=0.0),
        wide_mm=sum(m.wide_mm for m in every),
        mean_engagement=sum(m.mean_engagement * m.feed_mm for m in every) / feed if feed > 0.0 else 0.0,
        air_mm=sum(m.air_mm for m in every),
        floor_mm=sum(m.floor_mm for m in every),
    )


def written_measures(outcome: Outcome[PocketDetail]) -> PocketMeasures:
    """Return the measures of the written path on one level of each pocket, including the moves between pockets."""
    known = [plan.result.measures for plan in outcome.detail.plans if plan.result.measures is not None]
    program = next((program for program in outcome.detail.programs if not program.strategy), None)
    return _with_moves_between(sum_measures(known), program)


def plain_measures(m: PocketMeasures) -> dict[str, Any]:
    """Return the measures on one level as plain numbers for the JSON result; angles are in degrees."""
    return {
        "length_mm": plain_number(m.feed_mm + m.rapid_mm),
        "feed_mm": plain_number(m.feed_mm),
        "rough_mm": plain_number(m.feed_mm - m.finish_mm),
        "finish_mm": plain_number(m.finish_mm),
        "rapid_mm": plain_number(m.rapid_mm),
        "retracts": m.retracts,
        "uncovered_percent": plain_number(m.uncovered_percent),
        "gouge_mm2": plain_number(m.gouge_mm2),
        "max_step_over": plain_number(m.max_step_over),
        "max_core": plain_number(m.max_core),
        "max_width": plain_number(m.max_width),
        "wide_mm": plain_number(m.wide_mm),
        "max_engagement_deg": math.degrees(m.max_engagement),
        "mean_engagement_deg": math.degrees(m.mean_engagement),
        "air_mm": plain_number(m.air_mm),
        "floor_mm": plain_number(m.floor_mm),
    }


# -- words -----------------------------------------------------------------------------------------------------------


def several_depths(plans: Sequence[PocketPlan]) -> bool:
    """Return whether the pockets differ in the heights of their levels."""
    return len({plan.heights for plan in plans}) > 1


def levels_words(plans: Sequence[PocketPlan]) -> list[str]:
    """Return a text such as ``3 × 2 mm to Z-6`` for each set of levels.

    If there are several sets, each text also states the number of pockets.
    """
    counted = Counter((plan.begin, plan.levels, plan.heights, plan.in_floor) for plan in plans)
    words = []
    for begin, levels, heights, in_floor in sorted(counted, key=lambda one: (-one[1][-1], -one[0])):
        step = begin - levels[0]
        line = f"{len(levels)} × {step:.4g} mm to Z{heights[-1]:.4g}"
        if len(counted) > 1:
            line += f", {count(counted[begin, levels, heights, in_floor], 'pocket')}"
        what = "the floor of another" if in_floor else "the surface around"
        words.append(f"{line} from Z{heights[0] + step:.4g}, {what}" if begin else line)
    return words


def wide_cut_words(m: PocketMeasures, diameter: float) -> str:
    """Return a sentence about cuts that are much wider than the step-over: their share of the path, and the widest
    cut.
    """
    full = Message("the full width of the tool") if m.max_width > 0.99 * diameter else f"{m.max_width:.2f} mm"
    share = percent_words(100.0 * m.wide_mm / m.feed_mm) if m.feed_mm > 0.0 else NO_VALUE
    return Message("first cuts and corners, {} of the path, are wider than the step-over: up to {}", share, full)
