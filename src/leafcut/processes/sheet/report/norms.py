"""The table of cycle times and consumption. It has a row for each kind of part, for the sheet, and for the batch."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from leafcut.model.cutting import Consumption, ConsumptionRates, CutMeasures, CutPlan, PartTimes
from leafcut.report.wording import clock_parts

_MOST_NUMBERS = 6
#: Fields of `Consumption`, in the order of the table.
AMOUNTS = ("gas_l", "second_gas_l", "energy_kwh", "abrasive_kg", "nozzles", "electrodes")
_COLUMNS = (
    "of", "name", "quantity", "perimeter_mm", "total_perimeter_mm", "hours", "minutes", "seconds", "total_s",
    "gas", "gas_l", "second_gas", "second_gas_l", "energy_kwh", "energy_at_arc", "abrasive_kg", "nozzles",
    "electrodes", "process", "material", "thickness_mm", "nozzle",
)  # fmt: skip


@dataclass(frozen=True)
class NormRow:
    """The totals of a sheet, of a batch, or of all parts with the same name, in mm and s."""

    of: str
    name: str
    quantity: int
    total_perimeter: float
    total_s: float
    used: Consumption

    @property
    def perimeter(self) -> float:
        """Perimeter of a single part, mm."""
        return self.total_perimeter / self.quantity

    @property
    def hours_minutes_seconds(self) -> tuple[int, int, int]:
        """The total time as hours, minutes and whole seconds."""
        return clock_parts(self.total_s)


def cycle_time_rows(norm: CutMeasures) -> list[NormRow]:
    """Return a table row for each part name, in the order in which the names first appear.

    Parts without a name share a row if their area and perimeter are equal. Contours outside parts, and the moves at the
    start and end of the program, only count for the sheet.
    """
    return [
        NormRow(
            "part",
            own[0].name or _part_numbers(own),
            len(own),
            math.fsum(p.times.perimeter_mm for p in own),
            math.fsum(p.times.total_s for p in own),
            _total_consumption(p.used for p in own),
        )
        for own in part_kinds(norm)
    ]


def part_kinds(norm: CutMeasures) -> list[list[PartTimes]]:
    """Return the parts by kind: parts with the same name, or without a name and with equal area and perimeter."""
    kinds: dict[object, list[PartTimes]] = {}
    for part in norm.parts:
        if part.part:
            kinds.setdefault(part.name or (round(part.area, 2), round(part.times.perimeter_mm, 2)), []).append(part)
    return list(kinds.values())


def _part_numbers(parts: Sequence[PartTimes]) -> str:
    first = ", ".join(str(p.part) for p in parts[:_MOST_NUMBERS])
    return first if len(parts) <= _MOST_NUMBERS else f"{first} …"


def sheet_row(norm: CutMeasures) -> NormRow:
    """Return the row with the totals of the sheet."""
    return NormRow("sheet", "", 1, norm.sheet.perimeter_mm, norm.sheet.total_s, norm.used)


def batch_row(norm: CutMeasures) -> NormRow:
    """Return the row with the totals of the batch."""
    return NormRow("batch", "", norm.quantity, norm.batch.perimeter_mm, norm.batch.total_s, norm.batch_used)


def _total_consumption(used: Iterable[Consumption]) -> Consumption:
    each = list(used)

    def whole(name: str) -> float | None:
        known = [value for one in each if (value := getattr(one, name)) is not None]
        return math.fsum(known) if len(known) == len(each) else None

    return Consumption(**{name: whole(name) for name in AMOUNTS}, at_arc=any(one.at_arc for one in each))


def consumption_as_json(used: Consumption) -> dict[str, Any]:
    """Return the consumption in litres, kWh, kg and numbers of wear parts.

    If the chart has no data for an amount, the amount is null.
    """
    return {**{name: getattr(used, name) for name in AMOUNTS}, "energy_at_arc": used.at_arc}


def rates_as_json(rates: ConsumptionRates) -> dict[str, Any]:
    """Return the nozzle and the gases in the chart."""
    return {"nozzle": rates.nozzle, "gas": rates.gas, "second_gas": rates.second_gas}


def cycle_times_as_json(norm: CutMeasures) -> list[dict[str, Any]]:
    """Return the rows of the table of cycle times as JSON data."""
    return [
        {
            "of": row.of,
            "name": row.name,
            "quantity": row.quantity,
            "perimeter_mm": row.perimeter,
            "total_perimeter_mm": row.total_perimeter,
            **dict(zip(("hours", "minutes", "seconds"), row.hours_minutes_seconds, strict=True)),
            "total_s": row.total_s,
            **consumption_as_json(row.used),
        }
        for row in (*cycle_time_rows(norm), sheet_row(norm), batch_row(norm))
    ]


def cycle_times_csv(plan: CutPlan) -> str:
    """Return the table of cycle times and consumption as CSV text. Each row also contains the cutting data."""
    data = plan.data
    cutting_data = {
        "process": data.process,
        "material": data.material,
        "thickness_mm": data.thickness,
        **rates_as_json(data.rates),
    }
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n", restval="")
    writer.writeheader()
    for row in cycle_times_as_json(plan.measures):
        writer.writerow({key: _csv_cell(value) for key, value in (cutting_data | row).items()})
    return text.getvalue()


def _csv_cell(value: Any) -> Any:
    """Return the text of a CSV cell.

    Names come from drawings, so a spreadsheet must not interpret the text as a formula.
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return f"'{value}"
    return value
