"""The answers of `leafcut optimize --json` and `solve --json`: plain values, with the keys that scripts rely on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from leafcut.model.issue import Issue
from leafcut.model.measure import Measure
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Part
from leafcut.model.solution import Solution
from leafcut.report.wording import algorithm_words, feed_mm_min, plain_number


def as_json(outcome: Outcome) -> dict[str, Any]:
    """Return the outcome as a dict of lists, dicts, texts and finite numbers; what is not known is None.

    Lengths are in mm, times in s, feeds in mm/min. `lower_bound` is in the unit of the objective, s or mm,
    and of the travel between holes: the sum over the operations, each from where the one before it ended.
    `gap_percent` is how far at most the travel is above it.
    """
    gap = plain_number(outcome.gap)
    shown = outcome.shown
    before, nearest, after = shown.stated()
    return {
        "input": outcome.part.source or outcome.part.name,
        "output": outcome.output,
        "program_sha256": outcome.program_sha256,
        "report": outcome.report,
        "process": outcome.process,
        "machine": outcome.machine.name,
        "dialect": outcome.dialect,
        "algorithm": algorithm_words(outcome),
        "seed": outcome.seed,
        "counts": shown.counts(),
        "before": _measure(before),
        "nearest": None if nearest is None else _measure(nearest),
        "after": _measure(after),
        "saved_percent": plain_number(outcome.saved_percent),
        "lower_bound": plain_number(outcome.lower_bound),
        "gap_percent": None if gap is None else 100.0 * gap,
        "verified": bool(outcome.verified),
        **shown.answer(),
        "seconds": plain_number(outcome.seconds),
        "tools": [_tool(o) for o in outcome.operations],
        "workers": [w for number, o in enumerate(outcome.operations) for w in _workers(number, o)],
        "issues": issues_as_json(outcome.issues),
        **({"defaults": list(outcome.defaults)} if outcome.defaults else {}),
    }


def solution_as_json(part: Part, solution: Solution) -> dict[str, Any]:
    """Return the answer of `leafcut solve --json`: lengths are in the unit of the map's own rule of distance.

    The gap is against the best known length where the map has one, else against the lower bound.
    """
    gap = solution.cost / part.optimum - 1.0 if part.optimum else solution.gap
    grouped = {} if part.grouping is None else {"clusters": int(part.grouping.cluster.max()) + 1}
    return {
        "instance": part.name,
        "n": len(part.holes),
        **grouped,
        "algorithm": solution.algorithm,
        "seed": solution.seed,
        "length": solution.cost,
        "optimum": part.optimum,
        "gap_percent": None if gap is None else 100.0 * gap,
        "lower_bound": solution.lower_bound,
        "seconds": solution.seconds,
        "iterations": solution.iterations,
        "history": [list(step) for step in solution.history],
        "workers": [
            {"worker": w.worker, "ants": w.ants, "seconds": w.seconds, "best": plain_number(w.best)}
            for w in solution.workers
        ],
        "stopped_early": solution.stopped_early,
        "issues": issues_as_json(part.issues),
    }


def issues_as_json(issues: Iterable[Issue]) -> list[dict[str, str]]:
    """Return issues as plain values."""
    return [{"code": i.code, "severity": i.severity.value, "message": i.message, "place": i.place} for i in issues]


def _measure(measure: Measure) -> dict[str, float | None]:
    return {
        "travel_mm": plain_number(measure.travel_mm),
        "cut_mm": plain_number(measure.cut_mm),
        "time_s": plain_number(measure.time_s),
    }


def _tool(operation: OperationOutcome) -> dict[str, Any]:
    """Return one operation's tool; a tool with two operations (holes and slots) has two entries.

    `staying` is how many of its holes are drilled in their old places, where there are such.
    """
    tool = operation.tool
    return {
        "number": tool.number,
        "kind": tool.kind.value,
        "name": tool.name,
        "diameter_mm": plain_number(tool.diameter),
        "cycle": operation.cycle,
        "feed_mm_min": plain_number(feed_mm_min(tool.feed)),
        "speed_rpm": plain_number(tool.spindle_rpm),
        "slots" if operation.slots else "holes": len(operation.holes),
        **({"staying": len(operation.staying)} if operation.staying else {}),
        **({"cuts": operation.cuts} if operation.cuts else {}),
        "assumed": tool.assumed,
    }


def _workers(number: int, operation: OperationOutcome) -> list[dict[str, Any]]:
    return [
        {
            "operation": number,
            "tool": operation.tool.number,
            "worker": w.worker,
            "ants": w.ants,
            "seconds": plain_number(w.seconds),
            "best": plain_number(w.best),
        }
        for w in operation.solution.workers
    ]
