"""Strategies of pockets compared, as plain values and in words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from leafcut.model.outcome import Outcome
from leafcut.model.pocket import PocketMeasures, PocketPlan, PocketProgram
from leafcut.model.toolpath import Kind
from leafcut.processes.pocket.model import PocketDetail
from leafcut.report.wording import (
    NO_VALUE,
    clean,
    count,
    feed_mm_min,
    length_words,
    number_words,
    percent_words,
    plain_number,
    said,
    saved_percent,
    time_words,
)

#: Smaller shares of air cutting are not reported.
AIR_TOLD = 0.01
_FEEDS = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)


@dataclass(frozen=True)
class StrategyFigures:
    """Measures of a strategy over all pockets, one level each: sums and maxima; None if it is refused.

    `mean_engagement` is averaged over the feed length; `program_s` is the time of a program of all pockets.
    `passed_over` is the reason why a cheaper strategy is not written, from the first pocket that has one.
    """

    name: str
    chosen: bool
    measures: PocketMeasures | None
    refused: str = ""
    program_s: float = 0.0
    passed_over: str = ""


def strategy_figures(outcome: Outcome[PocketDetail]) -> list[StrategyFigures]:
    """Return all strategies over all pockets of an outcome.

    A strategy that is written, or usual, in each pocket has the time of that program.
    """
    detail = outcome.detail
    whole = {
        tuple({plan.usual.strategy for plan in detail.plans}): outcome.before.time_s,
        tuple({plan.result.strategy for plan in detail.plans}): outcome.after.time_s,
    }
    rows = figures(detail.plans, detail.programs)
    return [replace(row, program_s=whole.get((row.name,), row.program_s)) for row in rows]


def figures(plans: Sequence[PocketPlan], programs: Sequence[PocketProgram] = ()) -> list[StrategyFigures]:
    """Return all strategies over all pockets; a strategy that is refused in a pocket is refused.

    `programs` join several pockets.
    """
    rows, whole = [], {program.strategy: program for program in programs}
    for name in dict.fromkeys(r.strategy for plan in plans for r in plan.results):
        mine = [r for plan in plans for r in plan.results if r.strategy == name]
        chosen = any(plan.result.strategy == name for plan in plans)
        refused = next((r.refused for r in mine if r.measures is None), "")
        known = [r.measures for r in mine if r.measures is not None]
        found = None if refused else _between(added(known), whole.get(name))
        time_s = whole[name].time_s if name in whole else sum(r.program_s for r in mine)
        passed_over = next((r.passed_over for r in mine if r.passed_over), "")
        rows.append(StrategyFigures(name, chosen, found, refused, time_s, passed_over))
    return rows


def _between(measures: PocketMeasures, program: PocketProgram | None) -> PocketMeasures:
    """Return the measures of several pockets, including the moves between them."""
    if program is None:
        return measures
    return replace(measures, rapid_mm=program.rapid_mm, retracts=program.retracts)


def added(every: Sequence[PocketMeasures]) -> PocketMeasures:
    """Return the joint measures of several pockets: sums of lengths and areas, maxima of all else."""
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
        time_s=sum(m.time_s for m in every),
    )


def written(outcome: Outcome[PocketDetail]) -> PocketMeasures:
    """Return the measures of the written path: one level of each pocket, and the moves between pockets."""
    known = [plan.result.measures for plan in outcome.detail.plans if plan.result.measures is not None]
    program = next((program for program in outcome.detail.programs if not program.strategy), None)
    return _between(added(known), program)


def compared(outcome: Outcome[PocketDetail]) -> bool:
    """Return whether a usual strategy exists for comparison."""
    return any(plan.usual is not plan.result for plan in outcome.detail.plans)


# -- plain values ----------------------------------------------------------------------------------------------------


def pockets_as_json(outcome: Outcome[PocketDetail]) -> dict[str, Any]:
    """Return the written path over one level, and all strategies.

    Lengths are measured in the plane, without approach and departure. Several pockets give sums of lengths, and maxima
    of step-over and engagement.
    """
    plans = outcome.detail.plans
    names = list(dict.fromkeys(plan.result.strategy for plan in plans))
    first = plans[0]
    return {
        "pocket": {
            "strategy": ", ".join(names),
            **_plain(written(outcome)),
            "levels": sorted({z for plan in plans for z in plan.heights}, reverse=True),
            "floors": [plan.heights[-1] for plan in plans],
            "tool_diameter_mm": first.rules.tool_diameter,
            "step_over_mm": first.rules.step_over,
            "stock_mm": first.rules.stock,
        },
        "strategies": [
            {
                "strategy": row.name,
                "chosen": row.chosen,
                **({} if row.measures is None else {**_plain(row.measures), "time_s": plain_number(row.program_s)}),
                **({"refused": clean(row.refused)} if row.measures is None else {}),
                **({"passed_over": clean(row.passed_over)} if row.passed_over else {}),
            }
            for row in strategy_figures(outcome)
        ],
    }


def _plain(m: PocketMeasures) -> dict[str, Any]:
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


def pocket_counts(outcome: Outcome[PocketDetail]) -> dict[str, int]:
    """Return the numbers of pockets, islands and levels."""
    plans = outcome.detail.plans
    return {
        "pockets": len(plans),
        "islands": sum(len(plan.pocket.islands) for plan in plans),
        "levels": sum(len(plan.levels) for plan in plans) if several_depths(plans) else len(plans[0].heights),
        "tools": len({o.tool.number for o in outcome.operations}),
    }


# -- words -----------------------------------------------------------------------------------------------------------


def pocket_counts_words(outcome: Outcome[PocketDetail]) -> str:
    """Return ``1 pocket of 180 × 140 mm · 3 islands · 2 levels · end mill Ø10``."""
    counts = pocket_counts(outcome)
    tool = outcome.operations[0].tool
    largest = max((plan.pocket.outline for plan in outcome.detail.plans), key=lambda outline: abs(outline.area))
    x0, y0, x1, y1 = largest.extents
    number = counts["pockets"]
    size = f"{count(number, 'pocket')}{' of' if number == 1 else ', the largest'} {x1 - x0:.4g} × {y1 - y0:.4g} mm"
    words = [count(counts[name], name[:-1]) for name in ("islands", "levels") if counts[name]]
    return " · ".join([size, *words, f"end mill Ø{tool.diameter:g}"])


def angle_words(angle: float) -> str:
    """Return an angle in whole degrees."""
    return f"{math.degrees(angle):.0f}°"


def area_words(area: float) -> str:
    """Return an area in mm², whole from 100 on."""
    return f"{area:,.0f} mm²" if area >= 100.0 else f"{area:.3g} mm²"


def uncut_words(percent: float) -> str:
    """Return an uncut share: two decimals below one percent; 0 only if it rounds to none."""
    return percent_words(percent, 2 if percent < 1.0 else 1)


def usual_words(outcome: Outcome[PocketDetail]) -> str:
    """Return the strategy of comparison: ``zigzag``."""
    return " and ".join(dict.fromkeys(plan.usual.strategy for plan in outcome.detail.plans))


def chosen_words(outcome: Outcome[PocketDetail]) -> str:
    """Return the strategies that are written: ``contour``."""
    return " and ".join(dict.fromkeys(plan.result.strategy for plan in outcome.detail.plans))


def strategy_cells(row: StrategyFigures) -> tuple[str, ...]:
    """Return the figures of a strategy: feed, rapid, retracts, uncut, engagement at most and on average, time."""
    m = row.measures
    if m is None:
        return ()
    return (
        length_words(m.feed_mm),
        length_words(m.rapid_mm) if m.retracts else NO_VALUE,
        f"{m.retracts:,}" if m.retracts else NO_VALUE,
        uncut_words(m.uncovered_percent),
        angle_words(m.max_engagement),
        angle_words(m.mean_engagement),
        time_words(row.program_s),
    )


#: Headings of `strategy_cells`.
STRATEGY_TITLES = ("feed", "rapid", "retracts", "uncut", "engaged", "mean", "program")


def facts(outcome: Outcome[PocketDetail]) -> list[tuple[str, str]]:
    """Return facts for the operator, name and words."""
    plans = outcome.detail.plans
    rules, tool = plans[0].rules, outcome.operations[0].tool
    walls = f", {rules.stock:g} mm for the walls" if rules.stock > 0.0 else ""
    m = written(outcome)
    fast = float(outcome.path_after.value[np.isin(outcome.path_after.kind, _FEEDS)].max(initial=tool.feed))
    faster = f", at up to {number_words(feed_mm_min(fast))} mm/min" if fast > tool.feed * (1.0 + 1e-6) else ""
    air = f"{percent_words(100.0 * m.air_mm / m.feed_mm)} of the path cuts nothing{faster}" if m.feed_mm > 0.0 else ""
    beside = f"{time_words(outcome.before.time_s)} by {usual_words(outcome)}, {_saved(outcome)}"
    above = 100.0 * ((m.feed_mm + m.rapid_mm) / m.floor_mm - 1.0) if m.floor_mm > 0.0 else math.nan
    return [
        *(("levels", f"{words}{walls}") for words in levels_words(plans)),
        ("milling", f"{'climb' if rules.climb else 'conventional'}, {_step_over_words(m, rules.step_over)}"),
        *([("wider", wider_words(m, rules.tool_diameter))] if m.wide_mm > 0.0 else []),
        *([("air", air)] if m.air_mm >= AIR_TOLD * m.feed_mm else []),
        ("tool", f"Ø{tool.diameter:g}, {number_words(feed_mm_min(tool.feed))} mm/min, {tool.spindle_rpm:,.0f} rpm"),
        ("minimum", f"{length_words(m.floor_mm)} = area ÷ step-over; this path is {percent_words(above)} above it"),
        *([("against", beside)] if compared(outcome) else []),
    ]


def several_depths(plans: Sequence[PocketPlan]) -> bool:
    """Return whether pockets have levels at different heights."""
    return len({plan.heights for plan in plans}) > 1


def levels_words(plans: Sequence[PocketPlan]) -> list[str]:
    """Return ``3 × 2 mm to Z-6`` for each set of levels, with the number of pockets if they differ."""
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


def _step_over_words(m: PocketMeasures, step_over: float) -> str:
    """Return the planned and the measured step-over; a single pass has none."""
    kept = f"step-over {step_over:.4g} mm at most"
    return f"{kept}, {m.max_step_over:.2f} mm measured" if m.max_step_over > 0.0 else kept


def wider_words(m: PocketMeasures, diameter: float) -> str:
    """Return the share of the path that cuts much wider than the step-over, and the widest cut."""
    full = said("the full width of the tool") if m.max_width > 0.99 * diameter else f"{m.max_width:.2f} mm"
    share = percent_words(100.0 * m.wide_mm / m.feed_mm) if m.feed_mm > 0.0 else NO_VALUE
    words = "first cuts and corners, {share} of the path, are wider than the step-over: up to {full}"
    return said(words, share=share, full=full)


def _saved(outcome: Outcome[PocketDetail]) -> str:
    percent = saved_percent(outcome, outcome.after)
    return f"{percent_words(abs(percent))} {'saved' if percent >= 0.0 else 'more'}"
