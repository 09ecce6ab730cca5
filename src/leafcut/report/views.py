"""Prepare the rows and texts of the report page. The template arranges them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from leafcut.model.issue import CODES, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome
from leafcut.report import chart
from leafcut.report.drawing import RAMP, Scene, colour_indices_of_cutting_tools, tool_css_class
from leafcut.report.wording import (
    MIN_GAP,
    NO_VALUE,
    SEVERITIES,
    SPARED,
    cost_words,
    count_text,
    ended_without_payoff,
    gap_words,
    group_issues,
    operation_work_words,
    panel_number,
    percent_words,
    printable_lines,
    replace_unprintable,
    time_words,
    to_mm_per_min,
    tool_number_word,
    tool_words,
)

PageRow = dict[str, Any]

MAX_ISSUE_ROWS = 200
MAX_WORKER_ROWS = 128
MAX_TOOL_ROWS = 100
MAX_SEARCHES = 12
#: Maximum length of a program that the page shows completely, lines. For a longer program, it shows the first
#: `HEAD_LINES`.
WHOLE_PROGRAM_LINES = 2000
HEAD_LINES = 200

_KIND_WORDS = {
    "centre-drill": "centre drill",
    "slot-mill": "slot mill",
    "end-mill": "end mill",
    "ball-mill": "ball mill",
    "chamfer-mill": "chamfer mill",
}


def order_card_rows(rows: Sequence[PageRow], measures: Sequence[tuple[str, Measure]]) -> list[PageRow]:
    """Return a card for each order. It combines the row in the summary's table with a bar for the time."""
    longest = max(measure.time_s for _, measure in measures)
    return [
        {
            **row,
            "bar": chart.bar_svg(measure.time_s / longest if longest > 0 else 0.0, "ours" if row["ours"] else "plain"),
        }
        for row, (_, measure) in zip(rows, measures, strict=True)
    ]


def savings_headline(outcome: Outcome, came_in: str, bound: str) -> PageRow:
    """Return the headline figure about the savings, with its text. `bound` is a sentence about the proved gap."""
    seconds = outcome.before.time_s - outcome.after.time_s
    is_slower = seconds < 0
    percent = f"{percent_words(abs(outcome.saved_percent))} {'more' if is_slower else 'less'} machine time"
    hundred = f", {time_words(100 * seconds)} on 100 parts" if seconds > 0 else ""
    return {
        "figure": time_words(abs(seconds)),
        "worse": is_slower,
        "words": f"{'longer than' if is_slower else 'saved compared with'} the {came_in}’s order",
        "percent": f"{percent}{hundred}." if outcome.before.time_s > 0 else "The program cuts nothing.",
        "gap": f"{bound[0].upper()}{bound[1:]}." if bound else "",
    }


def time_bars(outcome: Outcome, measures: Sequence[tuple[str, Measure]]) -> PageRow:
    """Draw the seconds by kind of motion as a stacked bar for each order. Unused kinds are left out."""
    kinds = [k for k in chart.TIME_KINDS if any(m.by_kind.get(k, 0.0) > 0 for _, m in measures)]
    words = chart.names_of_time_kinds(outcome.process if outcome.process in BEAMS else None)
    return stacked_bars({k: words[k] for k in kinds}, [(name, m.by_kind, time_words(m.time_s)) for name, m in measures])


def stacked_bars(kinds: Mapping[str, str], rows: Sequence[tuple[str, dict[str, float], str]]) -> PageRow:
    """Draw stacked bars of the seconds by kind, on a common scale. A row has a name, the seconds, and their total."""
    longest = max(sum(seconds.values()) for _, seconds, _ in rows)
    return {
        "kinds": [{"class": k.replace("_", "-"), "words": words} for k, words in kinds.items()],
        "rows": [
            {
                "name": name,
                "seconds": {k.replace("_", "-"): seconds.get(k, 0.0) for k in kinds},
                "cells": [time_words(seconds.get(k, 0.0)) for k in kinds],
                "total": total,
                "bar": chart.stacked_bar_svg(seconds, longest),
            }
            for name, seconds, total in rows
        ],
    }


def used_tool_columns(outcome: Outcome) -> PageRow:
    """Return which optional columns of the tool table have any content."""
    rows = outcome.operations[:MAX_TOOL_ROWS]
    return {
        "diameter": any(o.tool.diameter > 0 for o in rows),
        "cycle": any(o.cycle for o in rows),
        "power": outcome.process in BEAMS,
    }


def tool_rows(outcome: Outcome, scene: Scene) -> list[PageRow]:
    """Return a row of the tool table for each operation."""
    return [
        {
            "class": tool_css_class(scene, scene.tools.index(o.tool.number)),
            "number": tool_number_word(o.tool) or NO_VALUE,
            "lines": f"{o.lines[0]:,} – {o.lines[1]:,}" if o.lines else NO_VALUE,
            "kind": replace_unprintable(o.tool.name) or _KIND_WORDS.get(o.tool.kind.value, o.tool.kind.value),
            "diameter": f"{o.tool.diameter:.4g}" if o.tool.diameter > 0 else NO_VALUE,
            "cycle": replace_unprintable(o.cycle) or NO_VALUE,
            "feed": panel_number(to_mm_per_min(o.tool.feed)),
            "speed": panel_number(o.tool.spindle_rpm),
            "work": operation_work_words(o),
            "assumed": o.tool.assumed,
        }
        for o in outcome.operations[:MAX_TOOL_ROWS]
    ]


def search_rows(outcome: Outcome, name_of: Callable[[int], str], nearest_cost: float | None) -> list[PageRow]:
    """Describe the search of each operation, with a chart if the search improved the order."""
    rows = []
    by_size = sorted(range(len(outcome.operations)), key=lambda k: -len(outcome.operations[k].solution.nodes))
    for number in sorted(by_size[:MAX_SEARCHES]):
        operation = outcome.operations[number]
        solution = operation.solution
        facts = [replace_unprintable(solution.algorithm), cost_words(solution.cost, solution.unit)]
        if solution.iterations:
            facts.append(count_text(solution.iterations, "iteration"))
        if solution.gap is not None:
            facts.append(gap_words(solution.gap, solution.unit))
        if solution.stopped_early and (solution.gap is None or solution.gap > MIN_GAP):
            facts.append("stopped early")
        if ended_without_payoff(solution):
            facts.append(SPARED)
        words = name_of(number)
        rows.append(
            {
                "name": words,
                "facts": " · ".join(facts),
                "still": f"No improvement found over the first order: {cost_words(solution.cost, solution.unit)}.",
                "chart": chart.convergence_chart(solution, nearest_cost, f"Cost against seconds: {words}"),
            }
        )
    return rows


def worker_rows(outcome: Outcome) -> PageRow:
    """Return the work of each search thread, and the number of omitted rows.

    Each worker of each operation has a row with bars for its ants and its seconds. The function leaves out workers
    without ants: the optimum was known before they started to search.
    """
    every = [
        (o, w) for o in outcome.operations if o.solution.algorithm != "exact" for w in o.solution.workers if w.ants > 0
    ]
    max_ants = max((w.ants for _, w in every), default=0)
    max_seconds = max((w.seconds for _, w in every), default=0.0)
    several = len({id(o) for o, _ in every}) > 1
    rows = [
        {
            "tool": (tool_number_word(o.tool) or NO_VALUE) if several else "",
            "worker": w.worker,
            "ants": f"{w.ants:,}",
            "ants_bar": chart.bar_svg(w.ants / max_ants if max_ants else 0.0),
            "seconds": f"{w.seconds:.3f}",
            "seconds_bar": chart.bar_svg(w.seconds / max_seconds if max_seconds > 0 else 0.0),
            "best": cost_words(w.best, o.solution.unit),
            "found": w.best <= o.solution.cost * (1 + 1e-9),
        }
        for o, w in every[:MAX_WORKER_ROWS]
    ]
    return {"rows": rows, "several": several, "left_out": len(every) - len(rows)}


def issue_rows(outcome: Outcome) -> PageRow:
    """Return the groups of issues, and at most `MAX_ISSUE_ROWS` issues, starting with the worst."""
    ordered = sorted(outcome.issues, key=lambda i: (SEVERITIES.index(i.severity), i.code))
    rows = [
        {
            "code": i.code,
            "severity": i.severity.value,
            "message": replace_unprintable(i.message),
            "place": replace_unprintable(i.place),
        }
        for i in ordered[:MAX_ISSUE_ROWS]
    ]
    groups = [{"code": g.code, "number": f"{g.number:,}", "words": CODES[g.code]} for g in group_issues(outcome.issues)]
    worst = [row for row in rows if row["severity"] in (Severity.DANGER, Severity.MISSING)]
    missing = [row for row in worst if row["severity"] == Severity.MISSING]
    number, left_out = f"{len(ordered):,}", len(ordered) - len(rows)
    return {"rows": rows, "worst": worst, "missing": missing, "groups": groups, "left_out": left_out, "number": number}


def program_excerpt(outcome: Outcome) -> PageRow:
    """Return the text of the program with a caption. For a long program, return only its first lines."""
    lines = printable_lines(outcome.text)
    whole = len(lines) < WHOLE_PROGRAM_LINES
    shown = lines if whole else lines[:HEAD_LINES]
    return {
        "text": "\n".join(shown),
        "words": count_text(len(lines), "line") + ("" if whole else f", the first {HEAD_LINES} shown"),
    }


def legend_rows(outcome: Outcome, scene: Scene) -> PageRow:
    """Explain the marks and colours in the drawings, with the work of each tool."""
    # A hole has the colour of its last tool, so a tool that is never the last has no holes in its colour.
    holes = {d.tool for d in scene.dots} | {tool for tool, _, _ in scene.slots}
    cutting = colour_indices_of_cutting_tools(scene)
    shown = holes | set(cutting.values())
    entries = [
        (tool_css_class(scene, t), _tool_and_work_words(outcome, scene.tools[t]), t not in holes)
        for t in sorted(shown)
        if t >= 0
    ]
    if -1 in shown:
        entries.append(("idle", "not machined", False))
    return {
        "ramp": None if scene.numbered else [f"r{i}" for i in range(0, RAMP, 3)],
        "cuts": bool(len(scene.after.cuts) or len(scene.before.cuts)) and not cutting,
        "stops": bool(len(scene.after.stops)),
        "tools": entries,
        "enlarged": scene.enlarged,
        "unsized": scene.unsized,
        "edge": bool(len(scene.edge)),
    }


def _tool_and_work_words(outcome: Outcome, number: int) -> str:
    """Describe a tool and the work of all its operations: ``T1 drill Ø6.35, 70 holes and 2 slots``."""
    operations = [o for o in outcome.operations if o.tool.number == number]
    return f"{tool_words(operations[0].tool)}, {' and '.join(operation_work_words(o) for o in operations[:3])}"
