"""Facts and report page of a pocket job: the chosen strategy in comparison with all other strategies."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from leafcut.geometry.arrays import consecutive_segments
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import polygons, shrink_region, swept_region
from leafcut.material.removal import swept_area
from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.issue import Issue
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome, Which
from leafcut.model.pocket import SAME_PLACE, Pocket, PocketMeasures, PocketPath, PocketPlan, PocketProgram, PocketRules
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Arc, Kind, Toolpath, ToolpathBuilder
from leafcut.processes.pocket.model import PocketDetail
from leafcut.report import chart, views
from leafcut.report.frame import Frame
from leafcut.report.marks import arrow_head_path_data, end_marks_svg
from leafcut.report.missing_drawing import missing_work_svg, points_of_missing_work
from leafcut.report.pace_words import pace_facts
from leafcut.report.path_report import PathReport
from leafcut.report.set_up import coordinate_words, drawing_facts, height_facts, range_facts
from leafcut.report.svg import element, scaled_group_element, segments_path_data, svg_number, title_element
from leafcut.report.wording import (
    NO_VALUE,
    OURS,
    angle_words,
    area_words,
    count_text,
    finite_or_none,
    length_words,
    panel_number,
    percent_words,
    replace_unprintable,
    saved_percent,
    share_words,
    time_words,
    to_mm_per_min,
)

#: Maximum number of path segments for which uncut areas are drawn.
MOST_PIECES = 200_000
#: Minimum additional uncut area that the report mentions, in percentage points more than the usual strategy.
LESS_WORK = 0.1
#: Minimum share of air cuts in a path that the report mentions as a fact.
_AIR = 0.01
#: Height above the material for moves between the sections of a path, mm.
_ABOVE = 2.0
_FEEDS = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)
#: Columns of the strategy table, and the columns that the summary leaves out.
_TITLES = ("feed", "rapid", "retracts", "uncut", "step-over mm", "engagement", "mean", "air", "program time")
_WIDE = ("step-over mm", "air")
#: Chord error for arcs, in user units of the drawing.
_CHORDS = 0.06
#: Tolerance for uncut and unreachable areas in the drawing, mm; coarser than the tolerance of the path.
_SEEN = 0.02
#: Arrowheads: spacing along a path and half length, in user units of the drawing, and maximum number.
_ARROW_APART, _ARROW, _MOST_ARROWS = 70.0, 3.2, 90
_HATCH = 4.0
_WIDE_FROM = 1.9
#: Kinds of path sections, from the lowest layer of the drawing to the highest.
_KINDS = ("rough", "link", "entry", "finish")


class PocketReport(PathReport[PocketDetail]):
    """The facts, the table, the report page and the pictures of cleared pockets."""

    proof = "read back and simulated"
    found = "read back and simulated: it does the work that was planned"
    package = "leafcut.processes.pocket.report"
    template = "pocket"

    def __init__(self, outcome: Outcome[PocketDetail]) -> None:
        super().__init__(outcome)
        plans = outcome.detail.plans
        # A single region needs no order.
        self.ordered = any(len(o.solution.nodes) != 1 for o in outcome.operations)
        self.cleared = outcome.operations[0].tool.diameter
        self.chosen = " and ".join(dict.fromkeys(plan.result.strategy for plan in plans))
        self.usual = " and ".join(dict.fromkeys(plan.usual.strategy for plan in plans))
        self.compared = any(plan.usual is not plan.result for plan in plans)

    @cached_property
    def strategies(self) -> list[StrategyFigures]:
        """The measures of all strategies."""
        return strategy_figures(self.outcome)

    def known_orders(self) -> list[tuple[str, Measure]]:
        """Return the measures of the usual strategy and of the written strategy.

        If both strategies are the same, only the written strategy is included.
        """
        usual = [(self.usual.capitalize(), self.outcome.before)] if self.compared else []
        return [*usual, (f"{OURS}: {self.chosen}", self.outcome.after)]

    @cached_property
    def facts(self) -> list[Fact]:
        """Facts for the operator, and the reasons for rejecting strategies.

        Every user should know why a faster strategy was rejected. Other rejected strategies are details of the
        search.
        """
        reasons = [
            Fact(sentence=replace_unprintable(f"{word}: {reason}"), name=row.name, of_search=name == "refused")
            for word, name in (("not written", "passed_over"), ("not possible", "refused"))
            for row in self.strategies
            if (reason := getattr(row, name))
        ]
        return [
            *self.count_facts(),
            *self._tool_facts(),
            *drawing_facts(self.outcome.part),
            *range_facts(self.outcome),
            *self._time_facts(),
            *self._path_facts(),
            *self.savings_facts(),
            *reasons,
        ]

    def count_facts(self) -> list[Fact]:
        """Return the numbers of pockets, islands, levels and tools.

        For example: ``1 pocket of 180 × 140 mm · 3 islands``.
        """
        plans, tool = self.outcome.detail.plans, self.outcome.operations[0].tool
        largest = max((plan.pocket.outline for plan in plans), key=lambda outline: abs(outline.area))
        x0, y0, x1, y1 = largest.extents
        number, islands = len(plans), sum(len(plan.pocket.islands) for plan in plans)
        levels = sum(len(plan.levels) for plan in plans) if has_several_depths(plans) else len(plans[0].heights)
        words, size = count_text(number, "pocket"), f"{x1 - x0:.4g} × {y1 - y0:.4g} mm"
        sized = Message("{} of {}", words, size) if number == 1 else Message("{}, the largest {}", words, size)
        return [
            Fact("counts.pockets", number, "", sized),
            Fact("counts.islands", islands, "", count_text(islands, "island") if islands else ""),
            Fact("counts.levels", levels, "", count_text(levels, "level") if levels else ""),
            Fact(
                "counts.tools",
                len({o.tool.number for o in self.outcome.operations}),
                "",
                f"end mill Ø{tool.diameter:g}",
            ),
        ]

    def savings_facts(self) -> list[Fact]:
        """Return the time that load-dependent feeds save, if the user requested such feeds."""
        pace = self.outcome.detail.pace
        return [] if pace is None else pace_facts(pace)

    def _time_facts(self) -> list[Fact]:
        outcome = self.outcome
        times = [
            Fact(
                "after.time_s",
                outcome.after.time_s,
                "s",
                Message("by {}", self.chosen),
                Message("Time"),
            )
        ]
        if self.compared:
            saved = saved_percent(outcome, outcome.after)
            words = Message(
                "by {}; {} saved" if saved >= 0.0 else "by {}; now {} longer", self.usual, percent_words(abs(saved))
            )
            times.append(Fact("before.time_s", outcome.before.time_s, "s", words, Message("Usual time")))
        return times

    def _path_facts(self) -> list[Fact]:
        outcome, m = self.outcome, written_measures(self.outcome)
        rules, plain = outcome.detail.plans[0].rules, measures_as_json(m)

        def fact(key: str, unit: str, sentence: str, name: Message, *, of_search: bool = False) -> Fact:
            return Fact(f"pocket.{key}", plain[key], unit, sentence, name, of_search)

        above = 100.0 * ((m.feed_mm + m.rapid_mm) / m.floor_mm - 1.0) if m.floor_mm > 0.0 else math.nan
        rapids, lifted = length_words(m.rapid_mm), Message("never lifted")
        if m.retracts:
            lifted = Message("{}, {} of rapids", count_text(m.retracts, "retract"), rapids)
        asked = Message(
            "{} mm requested; passes that meet in the middle: {} mm apart",
            f"{rules.step_over:.4g}",
            f"{m.max_core:.2f}",
        )
        floor = Message("area ÷ step-over is {}", length_words(m.floor_mm))
        mean = Message("at most; {} on average", angle_words(plain["mean_engagement_deg"]))
        facts = [
            Fact("pocket", self._pocket_as_json(plain)),
            Fact("strategies", [_strategy_as_json(row) for row in self.strategies]),
            fact("uncovered_percent", "%", self._uncut_words(m), Message("Uncut")),
            fact("max_step_over", "mm", asked, Message("Step-over")),
            fact(
                "max_width",
                "mm",
                wide_cut_words(m, rules.tool_diameter) if m.wide_mm > 0.0 else "",
                Message("Widest cut"),
            ),
            fact("feed_mm", "mm", lifted, Message("Path over a level"), of_search=True),
            Fact(value=above, unit="%", sentence=floor, name=Message("Above minimum"), of_search=True),
            fact("gouge_mm2", "mm²", Message("by simulation of the program"), Message("Gouge"), of_search=True),
            fact("max_engagement_deg", "°", mean, Message("Engagement"), of_search=True),
        ]
        path, tool = outcome.path_after, outcome.operations[0].tool
        fast = float(path.value[np.isin(path.kind, _FEEDS)].max(initial=tool.feed))
        is_faster = fast > tool.feed * (1.0 + 1e-6)
        if m.air_mm > 0.0 and (is_faster or m.air_mm >= _AIR * m.feed_mm):
            air = Message("{} of the path cuts air", percent_words(100.0 * m.air_mm / m.feed_mm))
            if is_faster:
                # The judge simulates every faster move (`processes.pocket.proving`).
                air = Message(
                    "{}: moves in cleared areas at up to {} mm/min, simulated clear of material",
                    air,
                    panel_number(to_mm_per_min(fast)),
                )
            facts.append(fact("air_mm", "mm", air, Message("Air")))
        return facts

    def _uncut_words(self, m: PocketMeasures) -> str:
        """Return the uncut and the reachable area as text. Issue L701 reports the unreachable area."""
        area, whole = area_words(m.uncovered_mm2), area_words(m.reachable_mm2)
        if all(issue.code != "L701" for issue in self.outcome.issues):
            return Message("{} of {}", area, whole)
        return Message("{} of the {} that the tool can reach; the rest is reported as uncut", area, whole)

    def _tool_facts(self) -> list[Fact]:
        plans, tool = self.outcome.detail.plans, self.outcome.operations[0].tool
        rules, first, lines = plans[0].rules, plans[0].levels, levels_words(plans)
        levels, words = f"{len(first)} × {abs(first[0]):.4g} mm", "; ".join(lines)
        depth, stock = f"{min(plan.heights[-1] for plan in plans):.4g}", f"{rules.stock:g}"
        if has_several_depths(plans) or any(plan.begin for plan in plans):
            # Each line states its step, its depth, and where the material starts.
            number = sum(len(plan.levels) for plan in plans)
            levels = Message("{} in {} pockets", str(number), str(len(plans)))
            if rules.stock > 0.0:
                words = Message("{}; then {} mm along the walls", words, stock)
        elif rules.stock > 0.0:
            words = Message("to Z{}, then {} mm along the walls", depth, stock)
        else:
            words = Message("to Z{}", depth)
        feed, speed = panel_number(to_mm_per_min(tool.feed)), f"{tool.spindle_rpm:,.0f}"
        cut = Message("{} mm/min, {} rpm, climb" if rules.climb else "{} mm/min, {} rpm, conventional", feed, speed)
        detail = self.outcome.detail
        entries = ", ".join(f"{number:,} × {kind}" for kind, number in detail.entries)
        return [
            Fact(value=f"T{tool.number} Ø{tool.diameter:g} mm", sentence=cut, name=Message("Tool")),
            Fact(value=levels, sentence=words, name=Message("Levels")),
            *height_facts(detail.clearance, f"Z{coordinate_words(detail.retract)}"),
            *([Fact(sentence=entries, name=Message("Entry"))] if entries else []),
        ]

    def _pocket_as_json(self, plain: dict[str, Any]) -> dict[str, Any]:
        plans = self.outcome.detail.plans
        rules = plans[0].rules
        return {
            "strategy": ", ".join(dict.fromkeys(plan.result.strategy for plan in plans)),
            **plain,
            "levels": sorted({z for plan in plans for z in plan.heights}, reverse=True),
            "floors": [plan.heights[-1] for plan in plans],
            "tool_diameter_mm": rules.tool_diameter,
            "step_over_mm": rules.step_over,
            "stock_mm": rules.stock,
        }

    def summary_rows(self) -> list[tuple[tuple[str, ...], bool]]:
        """Return the rows of a table that compares all possible strategies on a single level.

        Each row has a flag that is true for the chosen strategy.
        """
        keep = [k for k, column in enumerate(_TITLES) if column not in _WIDE]
        rows = [
            ((row.name, *(_measure_texts(row)[k] for k in keep)), row.chosen) for row in self.strategies if row.measures
        ]
        return [(("one level", *(_TITLES[k] for k in keep)), False), *rows]

    def template_values(self) -> dict[str, Any]:
        """Return the data for the report page: the drawing, and all strategies side by side."""
        outcome, plans = self.outcome, self.outcome.detail.plans
        scene = build_pocket_scene(plans, outcome.missing)
        paths = [plan.result.path for plan in plans if plan.result.path is not None]
        shapes = [
            unfinished_shapes(plan.pocket, path, plan.rules)
            for plan, path in zip(plans, paths, strict=True)
            if sum(p.path.n_segments for p in path.pieces) <= MOST_PIECES
        ]
        diameter = plans[0].rules.tool_diameter
        svg = pocket_drawing(
            scene, paths, "pocket", self._drawing_title(self.chosen), shapes=shapes, tool_diameter=diameter
        )
        return {
            "size": self._total_size_text(),
            "saved": self.savings_headline(),
            "way": "Rapids",
            "pocket": {
                "svg": svg,
                "wide": scene.frame.needs_both_columns,
                "strategy": self.chosen,
                "kinds": {piece.kind for path in paths for piece in path.pieces},
                "rapids": any(path.retracts for path in paths),
                "uncut": any(not s.uncovered.is_empty for s in shapes),
                "far": any(not s.unreachable.is_empty for s in shapes),
                "small": self._small_drawings(scene),
                "strategies": self._strategy_rows(),
            },
        }

    def savings_headline(self) -> views.PageRow:
        """Return the headline figure and its text.

        The figure is the time saved, or the program time without a comparison.
        """
        outcome = self.outcome
        if not self.compared:
            alone = all(len(plan.results) == 1 for plan in outcome.detail.plans)
            words = "Only this strategy was tried; best compares all of them." if alone else "What most shops run."
            by = f"by {self.chosen}"
            figure = time_words(outcome.after.time_s)
            return {"figure": figure, "worse": False, "words": by, "percent": words, "gap": ""}
        row = views.savings_headline(outcome, self.came_in, "")
        known = [plan.usual.measures for plan in outcome.detail.plans if plan.usual.measures is not None]
        now, usual = written_measures(outcome), sum_measures(known)
        less = ""
        if now.uncovered_percent > usual.uncovered_percent + LESS_WORK:
            less = f" But {share_words(now.uncovered_percent)} of the pocket stays uncut."
        compared = f"{'longer than' if row['worse'] else 'saved compared with'} {self.usual}"
        return {**row, "words": compared, "percent": row["percent"] + less, "gap": _length_change(now, usual)}

    def drawing(self, which: Which) -> str:
        """Draw the paths on one level.

        The drawing shows the usual strategy (``before``) or the written strategy (``after``).
        """
        plans = self.outcome.detail.plans
        chosen = [plan.usual if which == "before" else plan.result for plan in plans]
        paths = [result.path for result in chosen if result.path is not None]
        words = self._drawing_title(self.usual if which == "before" else self.chosen)
        scene, diameter = build_pocket_scene(plans, self.outcome.missing), plans[0].rules.tool_diameter
        return pocket_drawing(scene, paths, which, words, tool_diameter=diameter, size=True)

    def tried_paths(self) -> Iterator[tuple[str, Toolpath]]:
        """Yield the toolpath of each strategy on a single level of all pockets."""
        outcome = self.outcome
        for row in self.strategies:
            paths = self._strategy_paths(row.name)
            if row.measures is not None and paths:
                yield (
                    row.name,
                    toolpath_over_level(paths, outcome.detail.plans[0].levels[0], outcome.operations[0].tool),
                )

    def shown_stock(self) -> ShownStock:
        """Return the tools and the stock.

        The stock is the solid with filled pockets. Without a solid, it is a block around the cuts.
        """
        found, before = super().shown_stock(), self.outcome.detail.before
        return found if before is None else replace(found, surface=before)

    def _drawing_title(self, strategy: str) -> str:
        return f"Tool path over one level of {replace_unprintable(self.outcome.part.name)}, {strategy}"

    def _total_size_text(self) -> str:
        """Format the size of the bounding box of several pockets.

        Return "" for a single pocket, whose size is a separate fact.
        """
        boxes = [plan.pocket.outline.extents for plan in self.outcome.detail.plans]
        if len(boxes) == 1:
            return ""
        x0, y0, x1, y1 = (f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max)))
        return f"together {x1 - x0:.4g} × {y1 - y0:.4g} mm"

    def _strategy_paths(self, strategy: str) -> list[PocketPath]:
        every = (r for p in self.outcome.detail.plans for r in p.results if r.strategy == strategy)
        return [r.path for r in every if r.path is not None]

    def _strategy_rows(self) -> list[views.PageRow]:
        longest = max((r.program_s for r in self.strategies), default=0.0) or 1.0
        return [
            {
                "name": row.name,
                "chosen": row.chosen,
                "refused": replace_unprintable(row.refused),
                "passed_over": replace_unprintable(row.passed_over),
                "cells": _measure_texts(row),
                "bar": chart.bar_svg(row.program_s / longest, "ours" if row.chosen else "plain")
                if row.measures
                else "",
            }
            for row in self.strategies
        ]

    def _small_drawings(self, scene: PocketScene) -> list[views.PageRow]:
        """Return a small drawing and the path length of each strategy that clears all pockets."""
        return [
            {
                "name": row.name,
                "way": length_words(row.measures.feed_mm + row.measures.rapid_mm),
                "chosen": row.chosen,
                "svg": small_drawing(scene, self._strategy_paths(row.name), f"{row.name} over one level"),
            }
            for row in self.strategies
            if row.measures is not None
        ]


def _strategy_as_json(row: StrategyFigures) -> dict[str, Any]:
    measured = (
        {} if row.measures is None else {**measures_as_json(row.measures), "time_s": finite_or_none(row.program_s)}
    )
    reasons = {
        name: replace_unprintable(getattr(row, name)) for name in ("refused", "passed_over") if getattr(row, name)
    }
    return {"strategy": row.name, "chosen": row.chosen, "usual": row.usual, **measured, **reasons}


def _measure_texts(row: StrategyFigures) -> tuple[str, ...]:
    """Format the measures of a strategy as texts, in the order of `_TITLES`. A refused strategy has no texts."""
    m = row.measures
    if m is None:
        return ()
    return (
        length_words(m.feed_mm),
        length_words(m.rapid_mm) if m.retracts else NO_VALUE,
        f"{m.retracts:,}" if m.retracts else NO_VALUE,
        share_words(m.uncovered_percent),
        f"{m.max_step_over:.2f}",
        angle_words(math.degrees(m.max_engagement)),
        angle_words(math.degrees(m.mean_engagement)),
        length_words(m.air_mm),
        time_words(row.program_s),
    )


def _length_change(now: PocketMeasures, usual: PocketMeasures) -> str:
    length, before = (m.feed_mm + m.rapid_mm for m in (now, usual))
    if not before > 0.0:
        return ""
    percent = 100.0 * (1.0 - length / before)
    return f"The path over a level is {percent_words(abs(percent))} {'shorter' if percent >= 0.0 else 'longer'}."


def toolpath_over_level(paths: Sequence[PocketPath], level: float, tool: Tool) -> Toolpath:
    """Combine the paths of all pockets on one level into a toolpath. The tool plunges after each gap in a path."""
    builder = ToolpathBuilder()
    builder.tool(tool.number)
    builder.spindle(tool.spindle_rpm)
    for path in paths:
        for number, piece in enumerate(path.pieces):
            x, y, _ = builder.position
            if not number or math.dist((x, y), piece.path.start) > SAME_PLACE:
                builder.rapid(z=_ABOVE)
                builder.rapid(*piece.path.start)
                builder.feed(z=level, feed=tool.feed)
            for step in piece.path.segments():
                if step.is_arc:
                    builder.arc(step.bulge < 0.0, (*step.end, level), Arc((*step.center, level)), feed=tool.feed)
                else:
                    builder.feed(*step.end, feed=tool.feed)
    builder.rapid(z=_ABOVE)
    return builder.build()


# -- numbers ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StrategyFigures:
    """The measures of a strategy on one level of all pockets.

    Attributes
    ----------
    measures
        Sums and maxima over all pockets, or None if the strategy is refused.
    program_s
        Time of a program that clears all pockets with this strategy, s.
    passed_over
        Why the strategy was rejected although it is cheaper. If several pockets have a reason, the first reason is
        used.
    usual
        Whether the written program is compared with this strategy in any pocket.
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

    If the written program uses a single strategy for all pockets, this strategy gets the machine time of the program.
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
    """Return the measures of each strategy over all pockets. A strategy is refused if it is refused in any pocket.

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
    if program is None:
        return measures
    return replace(measures, rapid_mm=program.rapid_mm, retracts=program.retracts)


def sum_measures(every: Sequence[PocketMeasures]) -> PocketMeasures:
    """Combine the measures of several pockets.

    Lengths and areas are added up. The mean engagement is weighted by path length. All other values are maxima.
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
    """Return the measures of the written path on one level of each pocket, including moves between pockets."""
    known = [plan.result.measures for plan in outcome.detail.plans if plan.result.measures is not None]
    program = next((program for program in outcome.detail.programs if not program.strategy), None)
    return _with_moves_between(sum_measures(known), program)


def measures_as_json(m: PocketMeasures) -> dict[str, Any]:
    """Convert the measures on one level to plain numbers for the JSON result. Angles are in degrees."""
    return {
        "length_mm": finite_or_none(m.feed_mm + m.rapid_mm),
        "feed_mm": finite_or_none(m.feed_mm),
        "rough_mm": finite_or_none(m.feed_mm - m.finish_mm),
        "finish_mm": finite_or_none(m.finish_mm),
        "rapid_mm": finite_or_none(m.rapid_mm),
        "retracts": m.retracts,
        "uncovered_percent": finite_or_none(m.uncovered_percent),
        "gouge_mm2": finite_or_none(m.gouge_mm2),
        "max_step_over": finite_or_none(m.max_step_over),
        "max_core": finite_or_none(m.max_core),
        "max_width": finite_or_none(m.max_width),
        "wide_mm": finite_or_none(m.wide_mm),
        "max_engagement_deg": math.degrees(m.max_engagement),
        "mean_engagement_deg": math.degrees(m.mean_engagement),
        "air_mm": finite_or_none(m.air_mm),
        "floor_mm": finite_or_none(m.floor_mm),
    }


# -- words -----------------------------------------------------------------------------------------------------------


def has_several_depths(plans: Sequence[PocketPlan]) -> bool:
    """Return whether the levels of some pockets are at different heights."""
    return len({plan.heights for plan in plans}) > 1


def levels_words(plans: Sequence[PocketPlan]) -> list[str]:
    """Describe each set of levels as text, such as ``3 × 2 mm to Z-6``.

    If there are several sets, each text also gives the number of pockets.
    """
    counted = Counter((plan.begin, plan.levels, plan.heights, plan.in_floor) for plan in plans)
    words = []
    for begin, levels, heights, in_floor in sorted(counted, key=lambda one: (-one[1][-1], -one[0])):
        step = begin - levels[0]
        line = f"{len(levels)} × {step:.4g} mm to Z{heights[-1]:.4g}"
        if len(counted) > 1:
            line += f", {count_text(counted[begin, levels, heights, in_floor], 'pocket')}"
        what = "the floor of another" if in_floor else "the surface around"
        words.append(f"{line} from Z{heights[0] + step:.4g}, {what}" if begin else line)
    return words


def wide_cut_words(m: PocketMeasures, diameter: float) -> str:
    """Describe cuts that are much wider than the step-over, with their share of the path and their maximum width."""
    full = Message("the full width of the tool") if m.max_width > 0.99 * diameter else f"{m.max_width:.2f} mm"
    share = percent_words(100.0 * m.wide_mm / m.feed_mm) if m.feed_mm > 0.0 else NO_VALUE
    return Message("first cuts and corners, {} of the path, are wider than the step-over: up to {}", share, full)


# -- drawings --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class PocketShapes:
    """The unreachable area of a pocket, and the reachable area that is left uncut (shapely geometry)."""

    unreachable: Any
    uncovered: Any


@dataclass(frozen=True, eq=False)
class PocketScene:
    """The data that all drawings on a page share: the frame, the pockets, and the issues about missing work."""

    frame: Frame
    pockets: tuple[Pocket, ...]
    missing: tuple[Issue, ...] = ()


def build_pocket_scene(plans: Sequence[PocketPlan], missing: tuple[Issue, ...] = ()) -> PocketScene:
    """Create the scene for all pockets of a drawing."""
    boxes = np.array([plan.pocket.outline.extents for plan in plans])
    corners = np.concatenate([boxes.reshape(-1, 2), points_of_missing_work(missing)])
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    frame = Frame.around_corners((low[0], low[1]), (high[0], high[1]), _WIDE_FROM)
    return PocketScene(frame, tuple(p.pocket for p in plans), missing)


def unfinished_shapes(pocket: Pocket, path: PocketPath, rules: PocketRules) -> PocketShapes:
    """Return the unreachable and the uncut area of a pocket. Slivers thinner than the tolerance are ignored."""
    whole = pocket.region(_SEEN)
    reachable = swept_region(shrink_region(whole, rules.radius, _SEEN), rules.radius, _SEEN).intersection(whole)
    steps = np.concatenate([consecutive_segments(piece.path.flattened(0.5 * _SEEN)) for piece in path.pieces])
    cleared = swept_area(steps, rules.radius + _SEEN, 24)
    return PocketShapes(_visible_area(whole.difference(reachable)), _visible_area(reachable.difference(cleared)))


def _visible_area(shape: Any) -> Any:
    film = 2.0 * _SEEN
    return shape.buffer(-film).buffer(film, join_style="mitre").intersection(shape)


def pocket_drawing(
    scene: PocketScene,
    paths: Sequence[PocketPath],
    name: str,
    words: str,
    *,
    shapes: Sequence[PocketShapes] = (),
    tool_diameter: float = 0.0,
    size: bool = False,
) -> str:
    """Return an SVG element that shows the pockets, with a path in each pocket.

    The element has the title `words`, and its `name` must be unique on the page.
    """
    frame, window = scene.frame, f"window-{name}"
    parts = (
        *(_draw_pocket(frame, pocket) for pocket in scene.pockets),
        *(_unfinished_areas(frame, one, f"{name}-{k}") for k, one in enumerate(shapes)),
        *(_draw_tool_path(frame, path) for path in paths),
        *(_draw_arrows(frame, path) for path in paths),
    )
    lost = missing_work_svg(frame, scene.missing)
    inside = (element("g", *parts, clip_path=f"url(#{window})"), lost, *_draw_marks(frame, paths, tool_diameter))
    return frame.drawing_svg(words, window, inside, "drawing pocket", size)


def small_drawing(scene: PocketScene, paths: Sequence[PocketPath], words: str) -> str:
    """Return a small SVG drawing of pockets and paths without axes or marks."""
    frame = scene.frame
    parts = (*(_draw_pocket(frame, p) for p in scene.pockets), *(_draw_tool_path(frame, path) for path in paths))
    box = f"0 0 {svg_number(frame.width)} {svg_number(frame.height)}"
    return element("svg", title_element(words), *parts, viewBox=box, class_="drawing pocket small", role="img")


# -- shapes ----------------------------------------------------------------------------------------------------------


def _draw_pocket(frame: Frame, pocket: Pocket) -> str:
    walls = "".join(f"{_line_data(frame, path)}z" for path in (pocket.outline, *pocket.islands))
    named = title_element(Message("pocket {}", pocket.name)) if pocket.name else ""
    return scaled_group_element(element("path", named, d=walls, class_="floor"))


def _unfinished_areas(frame: Frame, shapes: PocketShapes, name: str) -> str:
    drawn = []
    if not shapes.unreachable.is_empty:
        clip, hatch = f"far-{name}", _draw_hatch(frame, shapes.unreachable)
        outline = scaled_group_element(element("path", d=_area_path(frame, shapes.unreachable)))
        drawn.append(element("clipPath", clip_path_outline(frame, shapes.unreachable), id=clip))
        drawn.append(element("g", outline, element("g", hatch, clip_path=f"url(#{clip})"), class_="far"))
    if not shapes.uncovered.is_empty:
        drawn.append(
            scaled_group_element(
                element("path", title_element("stays uncut"), d=_area_path(frame, shapes.uncovered), class_="uncut")
            )
        )
    return "".join(drawn)


def clip_path_outline(frame: Frame, shape: Any) -> str:
    """Return the SVG path around an area, for use in a clip path."""
    return element("path", d=_area_path(frame, shape), transform="scale(0.03125)", clip_rule="evenodd")


def _draw_hatch(frame: Frame, shape: Any) -> str:
    x0, y0, x1, y1 = shape.bounds
    (left, bottom), (right, top) = frame.to_user_units(np.array([[x0, y0], [x1, y1]])).tolist()
    height = bottom - top
    number = min(math.ceil((right - left + height) / _HATCH) + 1, 400)
    lines = [
        f"M{svg_number(left + k * _HATCH - height)} {svg_number(bottom)}l{svg_number(height)} {svg_number(-height)}"
        for k in range(number)
    ]
    return element("path", d="".join(lines), class_="hatch")


def _area_path(frame: Frame, shape: Any) -> str:
    rings = [ring for p in polygons(shape) for ring in (p.exterior, *p.interiors)]
    return "".join(
        f"{segments_path_data(consecutive_segments(frame.to_user_units(np.asarray(r.coords)[:, :2])))}z" for r in rings
    )


def _line_data(frame: Frame, path: Polyline) -> str:
    return segments_path_data(consecutive_segments(frame.to_user_units(path.flattened(_CHORDS / frame.scale))))


# -- the tool path ---------------------------------------------------------------------------------------------------


def _draw_tool_path(frame: Frame, path: PocketPath) -> str:
    data: dict[str, str] = {}
    for piece in path.pieces:
        data[piece.kind] = data.get(piece.kind, "") + _line_data(frame, piece.path)
    rapids = [
        [a.path.end, b.path.start]
        for a, b, gap in zip(path.pieces[:-1], path.pieces[1:], path.gaps, strict=True)
        if gap > 0.0
    ]
    lines = [element("path", d=data[kind], class_=f"way {kind}") for kind in _KINDS if kind in data]
    if rapids:
        moves = segments_path_data(frame.to_user_units(np.array(rapids)))
        lines.append(element("path", d=moves, class_="rapid"))
    return scaled_group_element(*lines)


def _draw_arrows(frame: Frame, path: PocketPath) -> str:
    apart = max(_ARROW_APART / frame.scale, path.feed_mm / _MOST_ARROWS)
    heads: dict[str, list[str]] = {}
    waiting = 0.5 * apart
    for piece in path.pieces:
        at = waiting
        while at < piece.path.length:
            (x, y), (dx, dy) = (
                frame.to_user_units(np.array(piece.path.point_at(at))).tolist(),
                piece.path.direction_at(at),
            )
            heads.setdefault(piece.kind, []).append(arrow_head_path_data((x, y), (dx, -dy), _ARROW))
            at += apart
        waiting = at - piece.path.length
    return "".join(element("path", d="".join(h), class_=f"head {kind}") for kind, h in sorted(heads.items()))


def _draw_marks(frame: Frame, paths: Sequence[PocketPath], tool_diameter: float) -> list[str]:
    drawn = [path for path in paths if path.pieces]
    if not drawn:
        return []
    first = frame.to_user_units(np.array(drawn[0].pieces[0].path.start)).tolist()
    last = frame.to_user_units(np.array(drawn[-1].pieces[-1].path.end)).tolist()
    marks = []
    if tool_diameter > 0.0:
        radius = 0.5 * tool_diameter * frame.scale
        marks.append(
            element("circle", title_element("the tool"), cx=first[0], cy=first[1], r=radius, class_="tool-disc")
        )
    downs = [
        frame.to_user_units(np.array(piece.path.start)).tolist()
        for path in drawn
        for piece, gap in zip(path.pieces, (math.inf if path is not drawn[0] else 0.0, *path.gaps), strict=True)
        if gap > 0.0
    ]
    marks += [element("circle", cx=x, cy=y, r=2.4, class_="down") for x, y in downs]
    return [*marks, *end_marks_svg((*first, 4.6), (*last, 4.2), (frame.width, frame.height))]
