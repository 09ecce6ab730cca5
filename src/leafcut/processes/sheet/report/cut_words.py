"""Texts and JSON data about a cutting plan: cycle time, cost, cutting data, and titles of cuts and parts."""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import Any

from leafcut.message import Message
from leafcut.model.cutting import Consumption, ConsumptionRates, Cut, CutMeasures, CutPlan, CutTimes, PartTimes
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.report.norms import consumption_as_json, cycle_times_as_json, rates_as_json
from leafcut.report.wording import (
    NO_VALUE,
    clock_text,
    count_text,
    finite_or_none,
    length_words,
    time_words,
)
from leafcut.units import SECONDS_PER_MINUTE

#: Smallest amount that is printed as a number. A smaller amount is printed as "less than" this value.
_LEAST_AMOUNT = 1e-4


def cut_counts(plan: CutPlan) -> dict[str, int]:
    """Return the numbers of parts, contours, marks and pierces of a plan."""
    return {
        "parts": len({plan.sheet.contours[i].part for c in plan.cuts if c.kind == "cut" for i in c.contours} - {0}),
        "contours": len({i for c in plan.cuts if c.kind == "cut" for i in c.contours}),
        "marks": sum(c.kind == "mark" for c in plan.cuts),
        "pierces": plan.measures.sheet.pierces,
    }


def cutting_as_json(detail: SheetDetail) -> dict[str, Any]:
    """Return a cutting plan as JSON data: its cutting data, cycle time and cost, and the times of the other orders."""
    plan = detail.plan
    data, norm = plan.data, plan.measures
    contours = [plan.sheet.contours[i] for c in plan.cuts if not c.common for i in c.contours]
    cut = Counter(c.part for c in contours if c.kind == "cut")
    return {
        "process": data.process,
        "material": data.material,
        "thickness_mm": data.thickness,
        "amps": data.amps,
        "speed_mm_min": data.feed * SECONDS_PER_MINUTE,
        "kerf_mm": data.kerf,
        "pierce_delay_s": data.pierce_delay,
        "pierce_height_mm": data.pierce_height,
        "cut_height_mm": data.cut_height,
        "volts": data.volts,
        **rates_as_json(data.rates),
        "source": data.source,
        "confidence": data.confidence,
        "sheet": _times_as_json(norm.sheet),
        "quantity": norm.quantity,
        "batch": _times_as_json(norm.batch),
        "utilisation_percent": None if norm.utilisation is None else 100.0 * norm.utilisation,
        "cost": norm.cost,
        "batch_cost": norm.batch_cost,
        "consumption": {"sheet": consumption_as_json(norm.used), "batch": consumption_as_json(norm.batch_used)},
        "norms": cycle_times_as_json(norm),
        "parts": [
            {
                "part": p.part,
                "name": p.name,
                "area_mm2": finite_or_none(p.area),
                "contours": cut[p.part],
                **_times_as_json(p.times),
                "cost": p.cost,
                "consumption": consumption_as_json(p.used),
            }
            for p in norm.parts
        ],
        "pieces": _times_by_name(norm),
        "before": _times_of_order(detail, 0),
        "nearest": _times_of_order(detail, 1),
        "after": _times_of_order(detail, 2),
    }


def _times_by_name(norm: CutMeasures) -> list[dict[str, Any]]:
    """Return the time and cost of the parts, grouped by part name. Parts without a name are left out."""
    found: dict[str, list[PartTimes]] = {}
    for part in norm.parts:
        if part.name:
            found.setdefault(part.name, []).append(part)
    return [
        {
            "name": name,
            "per_sheet": len(own),
            "in_batch": len(own) * norm.quantity,
            "area_mm2": finite_or_none(math.fsum(p.area for p in own) / len(own)),
            "total_s_each": math.fsum(p.times.total_s for p in own) / len(own),
            "cost_each": math.fsum(p.cost for p in own) / len(own),
        }
        for name, own in sorted(found.items())
    ]


def _times_of_order(detail: SheetDetail, which: int) -> dict[str, Any] | None:
    norm = detail.norms[which]
    return None if norm is None else _times_as_json(norm.sheet)


def _times_as_json(times: CutTimes) -> dict[str, Any]:
    return {
        "time": clock_text(times.total_s),
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


def size_words(mm: float) -> str:
    """Format a kerf or a thickness, mm, with three significant digits. Examples are ``0.237``, ``6`` and ``25.4``."""
    return f"{mm:.3g}" if mm < 100.0 else f"{mm:.0f}"


def name_words(name: str) -> str:
    """Make a name from the cut chart readable. Examples are ``mild steel`` and ``laser fiber 3 kW``."""
    return re.sub(r"(\d)kw\b", r"\1 kW", name.replace("_", " "), flags=re.IGNORECASE)


def cost_figure(cost: float, places: int) -> str:
    """Format a cost with the given number of decimals and with thousands separators."""
    return f"{cost:,.{places}f}"


def contour_words(plan: CutPlan, cut: Cut) -> str:
    """Return the kinds of the contours in a cut.

    This is ``hole``, ``outline`` or ``mark``, or ``4 holes, outline`` for a chain.
    """
    if cut.common:
        return "common line"
    names: Counter[str] = Counter()
    for number in cut.contours:
        contour = plan.sheet.contours[number]
        open_or_outline = "outline" if contour.path.closed else "open cut"
        names["mark" if contour.kind == "mark" else "hole" if contour.is_hole else open_or_outline] += 1
    return ", ".join(name if number == 1 else count_text(number, name) for name, number in names.items())


def cut_name(plan: CutPlan, cut: Cut) -> str:
    """Return the name of a cut, such as ``part 3, hole``. For a chain, it is ``parts 1, 2, hole, outline``."""
    parts = list(dict.fromkeys(plan.sheet.contours[i].part for i in cut.contours))
    of_part = f"{'part' if len(parts) == 1 else 'parts'} {', '.join(map(str, parts))}, " if any(parts) else ""
    return of_part + contour_words(plan, cut)


def cut_title(plan: CutPlan, number: int) -> str:
    """Return the title of a cut, such as ``12: part 3, hole · 120.5 mm · cutting 2.4 s, piercing 0.7 s``."""
    cut = plan.cuts[number]
    words = [f"{number + 1}: {cut_name(plan, cut)}", length_words(cut.path.length)]
    if number < len(plan.measures.cuts):
        times = plan.measures.cuts[number]
        pierce = f", piercing {time_words(times.pierce_s)}" if times.pierce_s > 0.0 else ""
        words.append(f"{'marking' if cut.kind == 'mark' else 'cutting'} {time_words(times.cut_s)}{pierce}")
    return " · ".join(words)


def part_contour_kinds(plan: CutPlan, part: int) -> list[str]:
    """Return ``cut`` or ``mark`` for each contour of a part."""
    contours = (plan.sheet.contours[i] for cut in plan.cuts if not cut.common for i in cut.contours)
    return [c.kind for c in contours if c.part == part]


def part_title(plan: CutPlan, part: int) -> str:
    """Return the title of a part, such as ``part 3 · 5 contours · 31.0 s``."""
    words = [f"part {part}", count_text(part_contour_kinds(plan, part).count("cut"), "contour")]
    words += [time_words(p.times.total_s) for p in plan.measures.parts if p.part == part]
    return " · ".join(words)


def consumption_texts(used: Consumption, rates: ConsumptionRates) -> list[tuple[str, str]]:
    """Return the name and amount of each medium and wear part. If the chart has no data, the amount is a dash."""
    # Names in the chart are the same in each language.
    gas: str = name_words(rates.gas) if rates.gas else Message("gas")
    second: str = name_words(rates.second_gas) if rates.second_gas else Message("second gas")
    return [
        (gas, _amount(used.gas_l, "l")),
        *([(second, _amount(used.second_gas_l, "l"))] if rates.second_gas or used.second_gas_l is not None else []),
        (
            Message("electricity at the arc") if used.at_arc else Message("electricity"),
            _amount(used.energy_kwh, "kWh"),
        ),
        (Message("abrasive"), _amount(used.abrasive_kg, "kg")),
        (Message("nozzles"), _amount(used.nozzles, "")),
        (Message("electrodes"), _amount(used.electrodes, "")),
    ]


def _amount(value: float | None, unit: str) -> str:
    """Format an amount with three significant digits and its unit, for example ``0.084 kWh``."""
    if value is None:
        return NO_VALUE
    figure = f"{value:,.0f}" if value >= 100.0 else f"{value:#.3g}"
    if 0.0 < value < _LEAST_AMOUNT:
        figure = f"< {_LEAST_AMOUNT:.4f}"
    return f"{figure.rstrip('.') if value else 0} {unit}".rstrip()
