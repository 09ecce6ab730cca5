"""What the report page says of pockets: the drawing, the strategies side by side, the facts of the program."""

from __future__ import annotations

from typing import Any

from leafcut.model.outcome import Outcome
from leafcut.model.pocket import PocketMeasures, PocketPath
from leafcut.processes.pocket.model import PocketDetail
from leafcut.processes.pocket.report.pocket_drawing import build_pocket_scene, pocket_drawing, shapes_of, small_drawing
from leafcut.processes.pocket.report.pocket_words import (
    StrategyFigures,
    added,
    angle_words,
    area_words,
    chosen_words,
    compared,
    levels_words,
    several_depths,
    strategy_figures,
    uncut_words,
    usual_words,
    wider_words,
    written,
)
from leafcut.report import chart, views
from leafcut.report.overview import Tile
from leafcut.report.pace_words import pace_facts
from leafcut.report.views import PageRow
from leafcut.report.wording import (
    NO_VALUE,
    clean,
    feed_mm_min,
    length_words,
    number_words,
    percent_words,
    said,
    time_words,
)

#: So many pieces of a drawing at most are checked for what stays uncut: it is swept anew for the picture.
MOST_PIECES = 200_000
#: A way that leaves so much more uncut than the usual one does not do the same work, percent.
LESS_WORK = 0.1


def pocket_size(outcome: Outcome[PocketDetail]) -> str:
    """Return ``together 180 × 140 mm``, the box of several pockets; nothing for one, whose counts give its size."""
    boxes = [plan.pocket.outline.extents for plan in outcome.detail.plans]
    if len(boxes) == 1:
        return ""
    x0, y0, x1, y1 = (f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max)))
    return f"together {x1 - x0:.4g} × {y1 - y0:.4g} mm"


def pocket_content(outcome: Outcome[PocketDetail]) -> PageRow:
    """Return all that the template of pockets needs."""
    plans = outcome.detail.plans
    scene = build_pocket_scene(plans, outcome.missing)
    paths = [plan.result.path for plan in plans if plan.result.path is not None]
    shapes = [
        shapes_of(plan.pocket, path, plan.rules)
        for plan, path in zip(plans, paths, strict=True)
        if sum(p.path.n_segments for p in path.pieces) <= MOST_PIECES
    ]
    words = f"Tool path over one level of {clean(outcome.part.name)}, {chosen_words(outcome)}"
    svg = pocket_drawing(scene, paths, "pocket", words, shapes=shapes, tool_diameter=plans[0].rules.tool_diameter)
    kinds = {piece.kind for path in paths for piece in path.pieces}
    return {
        "svg": svg,
        "wide": scene.frame.wide,
        "strategy": chosen_words(outcome),
        "kinds": kinds,
        "rapids": any(path.retracts for path in paths),
        "uncut": any(not s.uncovered.is_empty for s in shapes),
        "far": any(not s.unreachable.is_empty for s in shapes),
        "facts": facts(outcome),
        "pace": [fact.words for fact in pace_facts(outcome.detail.pace)] if outcome.detail.pace else [],
        "small": _small(outcome, scene),
        "strategies": _strategies(outcome),
        "usual": usual_words(outcome),
    }


def pocket_svg(outcome: Outcome[PocketDetail], which: str) -> str:
    """Return the way over one level as a stand-alone drawing: the usual one ``before``, what is written ``after``."""
    plans = outcome.detail.plans
    chosen = [plan.usual if which == "before" else plan.result for plan in plans]
    paths = [result.path for result in chosen if result.path is not None]
    by = usual_words(outcome) if which == "before" else chosen_words(outcome)
    words = f"Tool path over one level of {clean(outcome.part.name)}, {by}"
    diameter = plans[0].rules.tool_diameter
    scene = build_pocket_scene(plans, outcome.missing)
    return pocket_drawing(scene, paths, which, words, tool_diameter=diameter, size=True)


def cards(outcome: Outcome[PocketDetail]) -> list[PageRow]:
    """Return the usual strategy and leafcut's as the cards at the head show them."""
    ours = (f"{views.OURS}: {chosen_words(outcome)}", outcome.after)
    usual = [(usual_words(outcome).capitalize(), outcome.before)] if compared(outcome) else []
    return views.cards(outcome, [*usual, ours])


def saved(outcome: Outcome[PocketDetail]) -> PageRow:
    """Return the large figure and the words around it: the time that is saved, or of the program where it is alone."""
    if not compared(outcome):
        alone = all(len(plan.results) == 1 for plan in outcome.detail.plans)
        words = "Only this strategy was tried; best compares all." if alone else "What most shops run."
        row = {"figure": time_words(outcome.after.time_s), "worse": False, "words": f"by {chosen_words(outcome)}"}
        return {**row, "percent": words, "gap": ""}
    seconds = outcome.before.time_s - outcome.after.time_s
    percent = f"{percent_words(abs(outcome.saved_percent))} {'less' if seconds >= 0 else 'more'} machine time"
    hundred = f", {time_words(100 * seconds)} on 100 parts" if seconds > 0 else ""
    uncut, usual = (m.uncovered_percent for m in (written(outcome), _usual(outcome)))
    less = f" But {uncut_words(uncut)} of the pocket stays uncut." if uncut > usual + LESS_WORK else ""
    return {
        "figure": time_words(abs(seconds)),
        "worse": seconds < 0,
        "words": f"{'longer than' if seconds < 0 else 'saved compared with'} {usual_words(outcome)}",
        "percent": f"{percent}{hundred}.{less}",
        "gap": _shorter(outcome),
    }


def _shorter(outcome: Outcome[PocketDetail]) -> str:
    """Return how much shorter the way over one level is than the usual one."""
    length, beside = (m.feed_mm + m.rapid_mm for m in (written(outcome), _usual(outcome)))
    if not beside > 0.0:
        return ""
    percent = 100.0 * (1.0 - length / beside)
    return f"The path over a level is {percent_words(abs(percent))} {'shorter' if percent >= 0.0 else 'longer'}."


def _usual(outcome: Outcome[PocketDetail]) -> PocketMeasures:
    return added([plan.usual.measures for plan in outcome.detail.plans if plan.usual.measures is not None])


def times(outcome: Outcome[PocketDetail]) -> PageRow:
    """Return the seconds by kind of the usual strategy and of leafcut's, with stacked bars."""
    usual = [(usual_words(outcome).capitalize(), outcome.before)] if compared(outcome) else []
    return views.times(outcome, [*usual, (said(views.OURS), outcome.after)])


def facts(outcome: Outcome[PocketDetail]) -> list[Tile]:
    """Return the figures of the program: (name, figure, words under it)."""
    plans, m = outcome.detail.plans, written(outcome)
    rules, tool = plans[0].rules, outcome.operations[0].tool
    length, lowest = m.feed_mm + m.rapid_mm, min(plan.heights[-1] for plan in plans)
    first, several = plans[0].levels, several_depths(plans)
    number = sum(len(plan.levels) for plan in plans)
    levels = said("{number} in {pockets} pockets", number=str(number), pockets=str(len(plans))) if several else ""
    lines = "; ".join(levels_words(plans))
    above = percent_words(100.0 * (length / m.floor_mm - 1.0)) if m.floor_mm > 0.0 else NO_VALUE
    retracts = said("{number} retracts, {length} of rapids", number=f"{m.retracts:,}", length=length_words(m.rapid_mm))
    lifted = said("1 retract, {length} of rapids", length=length_words(m.rapid_mm)) if m.retracts == 1 else retracts
    walls = said("to Z{depth}, then {stock} mm along the walls", depth=f"{lowest:.4g}", stock=f"{rules.stock:g}")
    asked, middle = f"{rules.step_over:.4g}", f"{m.max_core:.2f}"
    feed, speed = number_words(feed_mm_min(tool.feed)), f"{tool.spindle_rpm:,.0f}"
    side = "climb" if rules.climb else "conventional"
    return [
        (said("Path over a level"), length_words(m.feed_mm), lifted if m.retracts else said("never lifted")),
        (said("Above minimum"), above, said("area ÷ step-over is {length}", length=length_words(m.floor_mm))),
        (
            said("Uncut"),
            uncut_words(m.uncovered_percent),
            said("{area} of {whole}", area=area_words(m.uncovered_mm2), whole=area_words(m.reachable_mm2)),
        ),
        (said("Gouge"), f"{m.gouge_mm2:.3g} mm²", said("by simulation of the program")),
        (
            said("Engagement"),
            angle_words(m.max_engagement),
            said("at most; {angle} on average", angle=angle_words(m.mean_engagement)),
        ),
        (
            said("Step-over"),
            f"{m.max_step_over:.2f} mm",
            said("{asked} mm asked for; passes that meet in the middle: {middle} mm apart", asked=asked, middle=middle),
        ),
        (
            said("Widest cut"),
            f"{m.max_width:.2f} mm",
            wider_words(m, rules.tool_diameter) if m.wide_mm > 0.0 else "",
        ),
        (
            said("Levels"),
            levels or f"{len(first)} × {abs(first[0]):.4g} mm",
            lines if several else walls if rules.stock > 0.0 else said("to Z{depth}", depth=f"{lowest:.4g}"),
        ),
        (
            said("Tool"),
            f"Ø{tool.diameter:g} mm",
            said(f"{{feed}} mm/min, {{speed}} rpm, {side}", feed=feed, speed=speed),
        ),
    ]


def _strategies(outcome: Outcome[PocketDetail]) -> list[PageRow]:
    rows = strategy_figures(outcome)
    longest = max((r.program_s for r in rows), default=0.0)
    return [
        {
            "name": row.name,
            "chosen": row.chosen,
            "refused": clean(row.refused),
            "passed_over": clean(row.passed_over),
            "cells": () if row.measures is None else _cells(row),
            "bar": ""
            if row.measures is None
            else chart.bar(row.program_s / longest if longest > 0 else 0.0, "ours" if row.chosen else "plain"),
        }
        for row in rows
    ]


def _cells(row: StrategyFigures) -> tuple[str, ...]:
    m = row.measures
    if m is None:
        return ()
    return (
        length_words(m.feed_mm),
        length_words(m.rapid_mm) if m.retracts else NO_VALUE,
        f"{m.retracts:,}",
        uncut_words(m.uncovered_percent),
        f"{m.max_step_over:.2f}",
        angle_words(m.max_engagement),
        angle_words(m.mean_engagement),
        length_words(m.air_mm),
        time_words(row.program_s),
    )


def _small(outcome: Outcome[PocketDetail], scene: Any) -> list[PageRow]:
    """Return a small drawing of every strategy that has a path in all pockets."""
    rows = []
    for row in strategy_figures(outcome):
        if row.measures is None:
            continue
        paths: list[PocketPath] = [
            r.path for p in outcome.detail.plans for r in p.results if r.strategy == row.name and r.path is not None
        ]
        svg = small_drawing(scene, paths, f"{row.name} over one level")
        way = length_words(row.measures.feed_mm + row.measures.rapid_mm)
        rows.append({"name": row.name, "way": way, "chosen": row.chosen, "svg": svg})
    return rows
