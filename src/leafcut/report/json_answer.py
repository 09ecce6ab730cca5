"""Convert results to the JSON answers of the commands. Scripts rely on the keys, so the keys must not change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from leafcut.model.certificate import Certificate
from leafcut.model.issue import Issue
from leafcut.model.kinds import BEAMS
from leafcut.model.measure import Measure
from leafcut.model.outcome import OperationOutcome
from leafcut.model.simulation import Simulation
from leafcut.model.solution import Solved, WorkerFigures
from leafcut.report.path_report import PathReport
from leafcut.report.set_up import axis_ranges
from leafcut.report.wording import (
    algorithm_names,
    fact_value_text,
    finite_or_none,
    search_seconds,
    to_mm_per_min,
)


def program_as_json(report: PathReport[Any]) -> dict[str, Any]:
    """Convert an outcome to plain values. Unknown values are None.

    Lengths are in mm, times in s, and feeds in mm/min. `lower_bound` is the lower bound of the travel, summed over the
    operations, in the unit of the objective, s or mm. It assumes that each operation starts at the end of the previous
    operation. `gap_percent` is the maximum excess of the travel over the optimum, based on this bound.
    """
    outcome = report.outcome
    gap = finite_or_none(outcome.gap)
    before, nearest, after = report.compared_measures()
    answer: dict[str, Any] = {
        "input": outcome.part.source or outcome.part.name,
        "output": outcome.output,
        "program_sha256": outcome.program_sha256,
        "report": outcome.report,
        "process": outcome.process,
        "machine": outcome.machine.name,
        "dialect": outcome.dialect,
        "algorithm": algorithm_names(outcome),
        "seed": outcome.seed,
        "counts": {},
        "zero": None if outcome.part.zero is None else asdict(outcome.part.zero),
        "before": _measure_as_json(before),
        "nearest": None if nearest is None else _measure_as_json(nearest),
        "after": _measure_as_json(after),
        "saved_percent": finite_or_none(outcome.saved_percent),
        "lower_bound": finite_or_none(outcome.lower_bound),
        "gap_percent": None if gap is None else 100.0 * gap,
        "verified": bool(outcome.verified),
        "missing": missing_as_json(outcome.missing),
    }
    for fact in report.facts:
        if fact.key:
            _set_nested(answer, fact.key.split("."), fact.value)
    return answer | {
        "seconds": finite_or_none(outcome.seconds),
        "search_seconds": finite_or_none(search_seconds(outcome)),
        "compile_seconds": finite_or_none(outcome.compile_seconds),
        "tools": [_operation_as_json(o, outcome.process in BEAMS) for o in outcome.operations],
        "workers": [
            {"operation": number, "tool": o.tool.number, **_worker_as_json(w)}
            for number, o in enumerate(outcome.operations)
            for w in o.solution.workers
        ],
        "issues": issues_as_json(outcome.issues),
        **_defaults_entry(outcome.defaults),
    }


def _set_nested(answer: dict[str, Any], key: Sequence[str], value: Any) -> None:
    for name in key[:-1]:
        answer = answer.setdefault(name, {})
    answer[key[-1]] = finite_or_none(value) if isinstance(value, float) else value


def tour_as_json(solved: Solved) -> dict[str, Any]:
    """Return the answer of `leafcut solve --json`. Lengths are in the unit of the map's metric."""
    part, solution, gap = solved.part, solved.solution, solved.gap
    grouped = {} if part.grouping is None else {"clusters": part.grouping.n_clusters}
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
        "workers": [_worker_as_json(w) for w in solution.workers],
        "stopped_early": solution.stopped_early,
        "issues": issues_as_json(part.issues),
        **_defaults_entry(solved.defaults),
    }


def simulation_as_json(simulation: Simulation) -> dict[str, Any]:
    """Return the answer of `leafcut simulate --json`, with lengths in mm and times in s.

    An axis without a known position is None.
    """
    known = {axis.lower(): [low, high] for axis, low, high in axis_ranges(simulation.path)}
    return {
        "program": simulation.program,
        "machine": simulation.machine.name,
        "head": simulation.machine.head,
        "time_s": simulation.measure.time_s,
        "rapid_mm": simulation.measure.travel_mm,
        "feed_mm": simulation.measure.cut_mm,
        "by_kind": simulation.measure.by_kind,
        "by_tool": {str(tool): spent for tool, spent in simulation.measure.by_tool.items()},
        "extents": {axis: known.get(axis) for axis in "xyz"},
        "issues": issues_as_json(simulation.issues),
        **_defaults_entry(simulation.defaults),
    }


def verification_as_json(proof: Certificate) -> dict[str, Any]:
    """Return the answer of `leafcut verify --json`. It contains the proof, and the message of each difference."""
    answer = proof.as_json()
    for row, difference in zip(answer["differences"], proof.differences, strict=True):
        row["words"] = str(difference)
    return {**answer, **_defaults_entry(proof.defaults)}


def issues_as_json(issues: Iterable[Issue]) -> list[dict[str, str]]:
    """Convert issues to plain values."""
    return [{"code": i.code, "severity": i.severity.value, "message": i.message, "place": i.place} for i in issues]


def missing_as_json(issues: Iterable[Issue]) -> list[dict[str, Any]]:
    """Convert missing work to plain values: kind, number, positions in program coordinates (mm), and reason."""
    return [
        {
            "what": i.missing.what,
            "count": i.missing.count,
            "where": [list(place) for place in i.missing.where],
            "why": i.message,
            "code": i.code,
            "place": i.place,
        }
        for i in issues
        if i.missing is not None
    ]


def _defaults_entry(options: tuple[str, ...]) -> dict[str, list[str]]:
    return {"defaults": list(options)} if options else {}


def _measure_as_json(measure: Measure) -> dict[str, float | None]:
    return {
        "travel_mm": finite_or_none(measure.travel_mm),
        "cut_mm": finite_or_none(measure.cut_mm),
        "time_s": finite_or_none(measure.time_s),
    }


def _operation_as_json(operation: OperationOutcome, beam: bool) -> dict[str, Any]:
    """Return the JSON entry of an operation.

    A tool for holes and slots has two entries. For a laser or torch (`beam`), the entry has a power instead of a
    spindle speed.
    """
    tool = operation.tool
    return {
        "number": tool.number,
        "kind": tool.kind.value,
        "name": tool.name,
        "diameter_mm": finite_or_none(tool.diameter),
        "cycle": operation.cycle,
        "feed_mm_min": finite_or_none(to_mm_per_min(tool.feed)),
        "power_s" if beam else "speed_rpm": finite_or_none(tool.spindle_rpm),
        "slots" if operation.slots else "holes": len(operation.holes),
        **({"staying": len(operation.staying)} if operation.staying else {}),
        **({"cuts": operation.cuts} if operation.cuts else {}),
        "assumed": tool.assumed,
    }


def _worker_as_json(worker: WorkerFigures) -> dict[str, Any]:
    return {
        "worker": worker.worker,
        "ants": worker.ants,
        "seconds": finite_or_none(worker.seconds),
        "best": finite_or_none(worker.best),
    }


def studio_overview_as_json(report: PathReport[Any]) -> dict[str, Any]:
    """Return the figures and tables of an outcome for the studio.

    The studio can translate texts of the form ``{"words": template, "values": {…}}``.
    """
    tables = {"parts": {"rows": [], "feet": []}, "norms": {"rows": []}, **report.page_tables()}
    times = {
        "kinds": tables["times"]["kinds"],
        "rows": [{key: row[key] for key in ("name", "seconds", "total")} for row in tables["times"]["rows"]],
    }
    title = [fact.sentence for fact in report.facts if fact.sentence and not fact.name]
    shown = [(fact.name, fact_value_text(fact), fact.sentence) for fact in report.facts if fact.name]
    tiles = [dict(zip(("name", "figure", "words"), tile, strict=True)) for tile in shown if tile[1]]
    return {**tables, "title": title, "tiles": tiles, "times": times}
