"""What a cutting plan says of itself: time norm, cost and data, as plain values and in words."""

from __future__ import annotations

from typing import Any

from leafcut.model.cutting import CutMeasures, CutPlan, CutTimes
from leafcut.model.outcome import Outcome
from leafcut.report.wording import count, length_words, percent_words, plain_number
from leafcut.units import SECONDS_PER_MINUTE


def clock(seconds: float) -> str:
    """Return a time as a work sheet has it: ``1:02:07``, hours, minutes and whole seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"


def cut_counts(plan: CutPlan) -> dict[str, int]:
    """Return how many parts, contours, marks and pierces a plan has."""
    return {
        "parts": len({plan.sheet.contours[i].part for c in plan.cuts if c.kind == "cut" for i in c.contours} - {0}),
        "contours": sum(len(c.contours) for c in plan.cuts if c.kind == "cut"),
        "marks": sum(c.kind == "mark" for c in plan.cuts),
        "pierces": plan.measures.sheet.pierces,
    }


def cut_counts_words(plan: CutPlan) -> str:
    """Return ``4 parts · 16 contours · 16 pierces``."""
    return " · ".join(count(number, name[:-1]) for name, number in cut_counts(plan).items() if number)


def cutting_as_json(outcome: Outcome) -> dict[str, Any]:
    """Return data, time norm and cost of a cutting plan, and what its orders before would have cost."""
    plan = outcome.cut_plan
    if plan is None:
        return {}
    data, norm = plan.data, plan.measures
    return {
        "cutting": {
            "process": data.process,
            "material": data.material,
            "thickness_mm": data.thickness,
            "amps": data.amps,
            "speed_mm_min": data.feed * SECONDS_PER_MINUTE,
            "kerf_mm": data.kerf,
            "pierce_delay_s": data.pierce_delay,
            "source": data.source,
            "sheet": _times(norm.sheet),
            "quantity": norm.quantity,
            "batch": _times(norm.batch),
            "utilisation_percent": None if norm.utilisation is None else 100.0 * norm.utilisation,
            "cost": norm.cost,
            "batch_cost": norm.batch_cost,
            "parts": [
                {"part": p.part, "area_mm2": plain_number(p.area), **_times(p.times), "cost": p.cost}
                for p in norm.parts
            ],
            "before": _order(outcome, 0),
            "nearest": _order(outcome, 1),
            "after": _order(outcome, 2),
        }
    }


def _order(outcome: Outcome, which: int) -> dict[str, Any] | None:
    norm = outcome.norms[which] if which < len(outcome.norms) else None
    return None if norm is None else _times(norm.sheet)


def _times(times: CutTimes) -> dict[str, Any]:
    return {
        "time": clock(times.total_s),
        "total_s": times.total_s,
        "cut_s": times.cut_s,
        "pierce_s": times.pierce_s,
        "rapid_s": times.rapid_s,
        "cut_mm": times.cut_mm,
        "rapid_mm": times.rapid_mm,
        "perimeter_mm": times.perimeter_mm,
        "length_mm": times.length_mm,
        "pierces": times.pierces,
    }


def norm_facts(plan: CutPlan) -> list[tuple[str, str]]:
    """Return the lines of the summary: (name, words)."""
    data, norm = plan.data, plan.measures
    how = f"{data.process}{f' {data.amps:g} A' if data.amps is not None else ''}"
    facts = [
        (
            "cut with",
            f"{how}, {data.material} {data.thickness:g} mm, {data.feed * SECONDS_PER_MINUTE:.0f} mm/min, "
            f"kerf {data.kerf:g} mm, pierce {data.pierce_delay:g} s",
        ),
        ("sheet", _norm_words(norm.sheet)),
        ("route", f"{length_words(norm.sheet.perimeter_mm)} of contours, {length_words(norm.sheet.rapid_mm)} between"),
    ]
    if norm.quantity > 1:
        facts.append(("batch", f"{count(norm.quantity, 'sheet')}, {clock(norm.batch.total_s)}"))
    if norm.utilisation is not None:
        facts.append(("used", f"{percent_words(100.0 * norm.utilisation)} of the sheet"))
    if norm.cost:
        facts.append(("cost", _cost_words(norm)))
    return facts


def _norm_words(times: CutTimes) -> str:
    return (
        f"{clock(times.total_s)}: cutting {clock(times.cut_s)}, piercing {clock(times.pierce_s)}, "
        f"rapids {clock(times.rapid_s)}"
    )


def _cost_words(norm: CutMeasures) -> str:
    batch = f", {norm.batch_cost:.2f} for the batch" if norm.quantity > 1 else ""
    return f"{norm.cost:.2f} a sheet{batch}"
