"""Look up cutting speed, heights and kerf in a cut chart, by process, material and thickness.

A chart is a CSV file with the same columns as the shipped `cutchart.csv`. Each row states its source and confidence.
The code never makes up missing values: it uses a row without a kerf or a pierce delay only if the user supplies these
values.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from functools import reduce
from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, PlanError, ReadError, name_suggestion, printable
from leafcut.message import Message
from leafcut.model.cutting import ConsumptionRates, CutData
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CutMethod, first_word_of_process
from leafcut.read.format import load_source
from leafcut.units import SECONDS_PER_MINUTE

#: Required and optional columns.
NEEDED = ("process", "material", "thickness_mm", "cut_speed_mm_min")
OPTIONAL = (
    "amps", "pierce_height_mm", "pierce_delay_s", "cut_height_mm", "kerf_width_mm", "arc_volts", "confidence", "source",
    "nozzle", "gas", "gas_l_min", "second_gas", "second_gas_l_min", "power_kw", "abrasive_g_min", "nozzle_life_h",
    "nozzle_life_pierces", "electrode_life_h", "electrode_life_pierces",
)  # fmt: skip

#: Relative tolerance of the thickness: the tolerance of rolled sheet.
SAME_THICKNESS = 0.01

#: Synonyms of materials.
MATERIALS = {
    "steel": "mild_steel",
    "s235": "mild_steel",
    "stainless": "stainless_304",
    "stainless_steel": "stainless_304",
    "aluminum": "aluminium",
    "wood": "plywood",
    "plexiglass": "acrylic",
    "pmma": "acrylic",
}

#: Cut height if the chart has none, mm. These are estimates: a laser head follows the sheet at about 1 mm, and waterjet
#: and oxyfuel heads use the customary heights.
HEIGHTS: dict[str, float] = {CutMethod.LASER: 1.0, CutMethod.WATERJET: 3.0, CutMethod.OXYFUEL: 6.0}

#: Values with which the user can override the chart, and values that together replace a whole row of the chart.
GIVEN = ("feed", "kerf", "pierce_delay", "pierce_height", "cut_height")
ENOUGH = ("feed", "kerf", "pierce_delay")
_OWN_DATA = Message("--cut-speed, --kerf and --pierce-delay")

MOST_ROWS = 100_000
_ESTIMATE = 2
#: Largest value in a chart; narrowest and widest plausible kerf, mm.
LARGEST, NARROWEST, WIDEST = 1e6, 0.001, 50.0


@dataclass(frozen=True)
class ChartRow:
    """A row of a cut chart. Missing values are None, and the feed is in mm/s."""

    process: str
    material: str
    thickness: float
    feed: float
    amps: float | None
    pierce_height: float | None
    pierce_delay: float | None
    cut_height: float | None
    kerf: float | None
    volts: float | None
    confidence: str
    source: str
    rates: ConsumptionRates = ConsumptionRates()

    @property
    def source_rank(self) -> int:
        """Rank of the source: 0 for a chart from the manufacturer or the user, 1 for a copy, 2 for an estimate."""
        text = self.confidence.lower()
        if text.startswith(("low", "sample")):
            return _ESTIMATE
        return 1 if text.startswith("secondary") and "manufacturer" not in text else 0


def load_chart(path: Path | None = None) -> list[ChartRow]:
    """Load a cut chart, by default the shipped chart.

    Raises
    ------
    ReadError
        The file is not a valid chart; the message includes the line number and the problem.
    """
    if path is None:
        place, text = "cutchart.csv", (resources.files("leafcut.read") / "cutchart.csv").read_text(encoding="utf-8")
    else:
        place, text = str(path), load_source(path).text()
    reader = csv.DictReader(io.StringIO(text), restkey="?")
    try:
        names = [name.strip() for name in reader.fieldnames or ()]
        _check_columns(place, names)
        reader.fieldnames = names
        rows: list[ChartRow] = []
        for data in reader:
            if len(rows) >= MOST_ROWS:
                raise ReadError(place, Message("has more than {:,} rows, too many for a cut chart", MOST_ROWS))
            if any((value or "").strip() for key, value in data.items() if key != "?"):
                rows.append(_parse_row(place, reader.line_num, data))
    except csv.Error as problem:
        raise ReadError(place, Message("is not a table ({})", problem), reader.line_num) from None
    if not rows:
        raise ReadError(place, "has no rows")
    return rows


def _check_columns(place: str, names: list[str]) -> None:
    for name in NEEDED:
        if name not in names:
            raise ReadError(
                place, Message("has no column '{}'; a cut chart has {}", name, ", ".join((*NEEDED, *OPTIONAL))), 1
            )


def _parse_row(place: str, line: int, data: dict[str, Any]) -> ChartRow:
    def number(key: str, needed: bool = False) -> float | None:
        text = (data.get(key) or "").strip()
        if not text and not needed:
            return None
        try:
            value = float(text)
        except ValueError:
            raise ReadError(place, Message("'{}' is '{}', not a number", key, printable(text)), line) from None
        kerf = key == "kerf_width_mm" and value != 0.0 and not NARROWEST <= value <= WIDEST
        if not 0.0 <= value <= LARGEST or (needed and value == 0.0) or kerf:
            raise ReadError(place, Message("'{}' is {:g}, out of range", key, value), line)
        return value

    def word(key: str) -> str:
        return printable((data.get(key) or "").strip(), 200)

    thickness, speed = number("thickness_mm", True), number("cut_speed_mm_min", True)
    assert thickness is not None and speed is not None
    return ChartRow(
        process=word("process").lower(),
        material=chart_material_name(word("material")),
        thickness=thickness,
        feed=speed / SECONDS_PER_MINUTE,
        amps=number("amps"),
        pierce_height=number("pierce_height_mm"),
        pierce_delay=number("pierce_delay_s"),
        cut_height=number("cut_height_mm"),
        kerf=number("kerf_width_mm"),
        volts=number("arc_volts"),
        confidence=word("confidence"),
        source=word("source"),
        rates=_consumption_rates(word, number),
    )


def _consumption_rates(word: Callable[[str], str], number: Callable[..., float | None]) -> ConsumptionRates:
    """Convert the consumption in a chart row to SI units (per second, W, kg). A lifetime of 0 is an error."""

    def scaled(key: str, factor: float) -> float | None:
        value = number(key)
        return None if value is None else value * factor

    def life(key: str, factor: float = 1.0) -> float | None:
        return None if number(key) is None else (number(key, True) or 0.0) * factor

    return ConsumptionRates(
        nozzle=word("nozzle"),
        gas=word("gas"),
        gas_flow=scaled("gas_l_min", 1.0 / SECONDS_PER_MINUTE),
        second_gas=word("second_gas"),
        second_gas_flow=scaled("second_gas_l_min", 1.0 / SECONDS_PER_MINUTE),
        power=scaled("power_kw", 1e3),
        abrasive=scaled("abrasive_g_min", 1e-3 / SECONDS_PER_MINUTE),
        nozzle_life=life("nozzle_life_h", 3600.0),
        nozzle_pierces=life("nozzle_life_pierces"),
        electrode_life=life("electrode_life_h", 3600.0),
        electrode_pierces=life("electrode_life_pierces"),
    )


def chart_material_name(material: str) -> str:
    """Convert the name of a material to the spelling in charts: ``Mild Steel`` and ``steel`` become ``mild_steel``."""
    word = "_".join(material.lower().replace("-", " ").split())
    return MATERIALS.get(word, word)


def process_names_for(rows: Iterable[ChartRow], process: str, material: str) -> set[str]:
    """Return the full process names in the chart, such as ``laser_co2_60w``, that match a process and a material."""
    return {
        r.process
        for r in rows
        if is_variant_of_process(r.process, process) and r.material == chart_material_name(material)
    }


def find_cut_data(
    rows: Iterable[ChartRow],
    process: str,
    material: str,
    thickness: float,
    amps: float | None = None,
    nozzle: str | None = None,
    **given: float | None,
) -> tuple[CutData, list[Issue]]:
    """Look up the cutting data for a sheet, and return them with any issues.

    If the chart has no row for the thickness, the function interpolates between the next thinner and the next thicker
    row with the same process, material and current. It interpolates the speed logarithmically, because the speed is a
    power of the thickness, and all other values linearly.

    The function prefers the most trusted chart, and uses estimates only as a last resort. If several currents have
    complete data and can pierce the sheet, it picks the fastest current. The chart needs no matching row if the user
    supplies speed, kerf and pierce delay.

    Parameters
    ----------
    process
        Name of the process in the chart, which may include kind and power: ``plasma``, ``laser_fiber_3kW``. If no row
        has this name, the function falls back to rows without kind and power.
    given
        Values that override the chart: ``feed``, ``kerf``, ``pierce_delay``, ``pierce_height``, ``cut_height``.

    Raises
    ------
    OptionError
        The chart lacks the process or the material, or required values.
    PlanError
        The chart has no row of that thickness; the message lists the nearest rows.
    """
    rows = list(rows)
    known = [r for r in rows if r.process == process.lower()] or [
        r for r in rows if r.process == first_word_of_process(process)
    ]
    own_row = _row_from_options(process, material, thickness, amps, given)
    if not known and own_row is None:
        raise OptionError(_no_process_message(rows, process, material))
    material = chart_material_name(material)
    shown = material.replace("_", "-")  # the spelling of `leafcut list materials`
    of_material = [r for r in known if r.material == material]
    if not of_material and own_row is None:
        raise OptionError(
            "--material: the chart has no '{}' for {}{}; to cut without a row of the chart, give {}",
            shown,
            process,
            name_suggestion(shown, [name.replace("_", "-") for name in _column_values(known, "material")]),
            _OWN_DATA,
        )
    fitting = [r for r in of_material if amps is None or r.amps == amps]
    if not fitting and own_row is None:
        currents = ", ".join(f"{a:g}" for a in sorted({r.amps for r in of_material if r.amps is not None})) or Message(
            "none"
        )
        raise OptionError(
            "--amps {:g}: the chart has {} for {} of {}; to cut without a row of the chart, give {}",
            amps,
            currents,
            process,
            shown,
            _OWN_DATA,
        )
    if nozzle is not None:
        fitting = _rows_of_nozzle(fitting, nozzle, f"{process} of {shown}")
        own_row = None  # a named nozzle must be in the chart
    match = _choose_row(fitting, thickness, given)
    if match is not None:
        row, issues = match
        return _build_cut_data(row, thickness, given, [*issues, *_other_currents_issues(of_material, row)])
    if own_row is None:
        raise PlanError(_no_row_message(fitting, process, shown, thickness))
    return _build_cut_data(own_row, thickness, given, [])


def _no_process_message(rows: list[ChartRow], process: str, material: str) -> Message:
    """Explain that the chart does not contain a process. A process of another kind or power is never a substitute."""
    kinds = sorted(
        process_names_for(rows, process, material)
        or {r.process for r in rows if is_variant_of_process(r.process, process)}
    )
    if kinds:
        return Message(
            "--cut-process: the chart has {}, but nothing for a {} of unknown kind and power; "
            "name yours, here or as cut_process in the machine's profile",
            ", ".join(kinds),
            process,
        )
    alike = sorted({r.process for r in rows if first_word_of_process(r.process) == first_word_of_process(process)})
    if not alike:
        return Message(
            "--cut-process: the chart has no '{}'{}", process, name_suggestion(process, _column_values(rows, "process"))
        )
    return Message(
        "the chart has no data for {}, only for {}; give a --chart that has these data, or {}",
        process,
        ", ".join(alike),
        _OWN_DATA,
    )


def _rows_of_nozzle(rows: list[ChartRow], nozzle: str, label: str) -> list[ChartRow]:
    name = nozzle.strip().lower()
    fitting = [r for r in rows if r.rates.nozzle.lower() == name]
    if not fitting:
        known = ", ".join(dict.fromkeys(r.rates.nozzle for r in rows if r.rates.nozzle)) or Message("none")
        raise OptionError("--nozzle {}: the chart has {} for {}", printable(nozzle), known, label)
    return fitting


def _row_from_options(
    process: str, material: str, thickness: float, amps: float | None, given: dict[str, float | None]
) -> ChartRow | None:
    """Build a chart row from the user's values alone. Return None if required values are missing."""
    if any(given.get(key) is None for key in ENOUGH) or first_word_of_process(process) not in tuple(CutMethod):
        return None
    values = {key: given.get(key) for key in GIVEN}
    return ChartRow(
        process.lower(),
        chart_material_name(material),
        thickness,
        given["feed"] or 0.0,
        amps,
        values["pierce_height"],
        values["pierce_delay"],
        values["cut_height"],
        values["kerf"],
        None,
        "the user's own",
        "the user's own figures",
    )


def is_variant_of_process(name: str, asked: str) -> bool:
    """Return whether a process from a chart is the requested process, or a variant of it."""
    return name == asked.lower() or name.startswith(f"{asked.lower()}_")


def _column_values(rows: Iterable[ChartRow], field: str) -> list[str]:
    return sorted({getattr(r, field) for r in rows})


def _choose_row(
    rows: list[ChartRow], thickness: float, given: dict[str, float | None]
) -> tuple[ChartRow, list[Issue]] | None:
    """Choose the best row for a thickness.

    Complete rows that can pierce the sheet come first. Charts then win over estimates, and faster rows over slower
    rows.
    """
    groups: dict[float, list[ChartRow]] = {}
    for row in rows:
        groups.setdefault(row.amps or 0.0, []).append(row)
    candidates = [match for amps in sorted(groups) if (match := _row_at_thickness(groups[amps], thickness)) is not None]
    if not candidates:
        return None

    def rank(match: tuple[ChartRow, list[Issue]]) -> tuple[bool, bool, float]:
        row = match[0]
        return bool(_missing_values(row, given)) or not _can_pierce(row, {}), row.source_rank == _ESTIMATE, -row.feed

    best = min(candidates, key=rank)
    if not _can_pierce(best[0], {}) and len(candidates) > 1:
        raise OptionError(_capacity_message(best[0], [row for row, _ in candidates], thickness))
    return best


def _row_at_thickness(group: list[ChartRow], thickness: float) -> tuple[ChartRow, list[Issue]] | None:
    """Return the most trusted row for a thickness. If necessary, interpolate between two rows."""
    for trust in range(_ESTIMATE + 1):
        trusted = [r for r in group if r.source_rank <= trust]
        exact = [r for r in trusted if abs(r.thickness - thickness) <= SAME_THICKNESS * thickness]
        if exact:
            return min(exact, key=lambda r: (r.source_rank, abs(r.thickness - thickness))), []
        pairs = [
            neighbours
            for rows in _group_by_nozzle(trusted)
            if (neighbours := _rows_around_thickness(rows, thickness)) is not None
        ]
        neighbours = (
            min(pairs, key=lambda p: p[1].thickness - p[0].thickness)
            if pairs
            else _rows_around_thickness(trusted, thickness)
        )
        if neighbours is not None:
            return _interpolate_rows(*neighbours, thickness)
    return None


def _group_by_nozzle(rows: list[ChartRow]) -> list[list[ChartRow]]:
    """Group the rows by nozzle.

    The function mixes rows of different nozzles only if no nozzle has both a thinner and a thicker row.
    """
    return [[r for r in rows if r.rates.nozzle == name] for name in dict.fromkeys(r.rates.nozzle for r in rows)]


def _rows_around_thickness(rows: list[ChartRow], thickness: float) -> tuple[ChartRow, ChartRow] | None:
    thin = [r for r in rows if r.thickness < thickness]
    thick = [r for r in rows if r.thickness > thickness]
    if not (thin and thick):
        return None
    return max(thin, key=lambda r: (r.thickness, -r.source_rank)), min(
        thick, key=lambda r: (r.thickness, r.source_rank)
    )


def _join_with_and(values: list[Message]) -> Message:
    return reduce(lambda message, value: Message("{} and the {}", message, value), values[1:], values[0])


def _capacity_message(edge: ChartRow, rows: list[ChartRow], thickness: float) -> Message:
    higher = [r for r in rows if r.pierce_height is not None]
    message = Message("{:g} mm is above the pierce capacity of {}", thickness, _describe_process(edge))
    edge_start = Message("use --amps {:g} to start cuts at the sheet's edge", edge.amps or 0)
    if not higher:
        return Message("{}; {}, or give --pierce-delay to pierce it anyway", message, edge_start)
    names = Message.joined_by_and(f"{r.amps or 0:g} A" for r in higher)
    missing_values = _join_with_and(_missing_values(higher[0], {}))
    return Message(
        "{}; for {}, the cut chart does not give the {}: give these values, or {}",
        message,
        names,
        missing_values,
        edge_start,
    )


def _interpolate_rows(a: ChartRow, b: ChartRow, thickness: float) -> tuple[ChartRow, list[Issue]]:
    share = (thickness - a.thickness) / (b.thickness - a.thickness)
    power = math.log(thickness / a.thickness) / math.log(b.thickness / a.thickness)

    def interpolated(field: str) -> float | None:
        first, second = getattr(a, field), getattr(b, field)
        return None if first is None or second is None else first + share * (second - first)

    row = replace(
        b if b.source_rank > a.source_rank else a,
        thickness=thickness,
        feed=a.feed * (b.feed / a.feed) ** power,
        rates=_interpolate_rates(a.rates, b.rates, share),
        **{f: interpolated(f) for f in ("pierce_height", "pierce_delay", "cut_height", "kerf", "volts")},  # type: ignore[arg-type]
    )
    message = Message(
        "the cut chart has no row for {:g} mm, so its data were interpolated between {:g} and {:g} mm",
        thickness,
        a.thickness,
        b.thickness,
    )
    return row, [
        Issue("L411", Message("{}, {:.0f} mm/min", message, row.feed * SECONDS_PER_MINUTE), severity=Severity.NOTE)
    ]


def _interpolate_rates(a: ConsumptionRates, b: ConsumptionRates, share: float) -> ConsumptionRates:
    """Interpolate the consumption linearly. Drop texts that differ, and flow rates that belong to different gases."""
    rates: dict[str, Any] = {}
    for name in (field.name for field in fields(ConsumptionRates)):
        first, second = getattr(a, name), getattr(b, name)
        gas = name.removesuffix("_flow")
        if isinstance(first, str):
            rates[name] = first if first == second else ""
        elif first is not None and second is not None and (gas == name or getattr(a, gas) == getattr(b, gas)):
            rates[name] = first + share * (second - first)
    return ConsumptionRates(**rates)


def _no_row_message(rows: list[ChartRow], process: str, material: str, thickness: float) -> Message:
    nearest_thicknesses = sorted({r.thickness for r in rows}, key=lambda t: abs(t - thickness))[:3]
    texts = ", ".join(f"{t:g}" for t in sorted(nearest_thicknesses))
    return Message(
        "the cut chart has no row for {} of {}, {:g} mm; the nearest are {} mm; "
        "give another --thickness, your own chart with --chart, or {}",
        process,
        material,
        thickness,
        texts,
        _OWN_DATA,
    )


def _other_currents_issues(rows: list[ChartRow], chosen: ChartRow) -> list[Issue]:
    chosen_label = _describe_process(chosen)
    other_labels = {
        _describe_process(r): None
        for r in rows
        if _describe_process(r) != chosen_label
        and abs(r.thickness - chosen.thickness) <= max(1.0, 0.1 * chosen.thickness)
    }
    if not other_labels:
        return []
    text = Message("cut with {}; for similar thicknesses, the chart also has {}", chosen_label, ", ".join(other_labels))
    return [Issue("L412", Message("{}: choose with --amps", text), severity=Severity.NOTE)]


def _describe_process(row: ChartRow) -> str:
    return row.process if row.amps is None else f"{row.process} {row.amps:g} A"


def _row_values_or_given(row: ChartRow, given: dict[str, float | None]) -> dict[str, float | None]:
    return {key: getattr(row, key) if given.get(key) is None else given[key] for key in GIVEN}


def _can_pierce(row: ChartRow, given: dict[str, float | None]) -> bool:
    """Return whether a cut with the data of a row can start with a pierce.

    Plasma needs a pierce height from the chart, or a pierce delay from the user.
    """
    if first_word_of_process(row.process) != CutMethod.PLASMA:
        return True
    return row.pierce_height is not None or _row_values_or_given(row, given)["pierce_delay"] is not None


def _missing_values(row: ChartRow, given: dict[str, float | None]) -> list[Message]:
    values = _row_values_or_given(row, given)
    missing = []
    if not values["kerf"]:  # 0 in a chart means not measured
        missing.append(Message("kerf (--kerf)"))
    if values["pierce_delay"] is None and _can_pierce(row, given):
        missing.append(Message("pierce delay (--pierce-delay)"))
    return missing


def _build_cut_data(
    row: ChartRow, thickness: float, given: dict[str, float | None], issues: list[Issue]
) -> tuple[CutData, list[Issue]]:
    values = _row_values_or_given(row, given)
    kind = first_word_of_process(row.process)
    can_pierce, missing = _can_pierce(row, given), _missing_values(row, given)
    if missing:
        raise OptionError(
            "the cut chart does not give the {} of {} in {}, {:g} mm; give the missing values",
            _join_with_and(missing),
            _describe_process(row),
            row.material,
            thickness,
        )
    if row.source_rank == _ESTIMATE:
        message = Message(
            "the cutting data of {} in {} are uncertain ({}); test them on scrap first",
            _describe_process(row),
            row.material,
            row.confidence,
        )
        issues.append(Issue("L413", message))
    cut_height, assumed = values.get("cut_height"), HEIGHTS.get(kind, 1.5)
    if cut_height is None:
        cut_height = assumed
        issues.append(
            Issue("L414", Message("the cut chart gives no cut height; {:g} mm is assumed (--cut-height)", assumed))
        )
    pierce_height = values.get("pierce_height")
    if pierce_height is None and can_pierce and kind == CutMethod.PLASMA:
        message = Message(
            "the cut chart gives no pierce height; the cut height, {:g} mm, is assumed (--pierce-height)", cut_height
        )
        issues.append(Issue("L414", message))
    return CutData(
        process=row.process,
        material=row.material,
        thickness=thickness,
        feed=values.get("feed") or row.feed,
        kerf=values["kerf"] or 0.0,
        amps=row.amps,
        pierce_height=cut_height if pierce_height is None else pierce_height,
        pierce_delay=values.get("pierce_delay") or 0.0,
        cut_height=cut_height,
        volts=row.volts,
        can_pierce=can_pierce,
        source=row.source,
        confidence=row.confidence,
        rates=row.rates,
    ), issues


@dataclass(frozen=True)
class ChartChoices:
    """The values in a cut chart that the user can still choose after earlier choices, in ascending order.

    Thicknesses are in mm and currents in A.
    """

    processes: tuple[str, ...]
    materials: tuple[str, ...]
    thicknesses: tuple[float, ...]
    amps: tuple[float, ...]
    nozzles: tuple[str, ...]


def available_choices(
    rows: Iterable[ChartRow],
    process: str = "",
    material: str = "",
    thickness: float | None = None,
    amps: float | None = None,
) -> ChartChoices:
    """List the choices in a cut chart. An empty argument matches all rows.

    Earlier choices filter the later ones, and the thickness also filters the current. The function ignores a choice
    without a matching row, so that the user still sees the alternatives.
    """
    rows = list(rows)
    cut = [row for row in rows if not process or is_variant_of_process(row.process, process)] or rows
    made_of = [row for row in cut if not material or row.material == chart_material_name(material)]
    with_amps = [row for row in made_of if amps is None or row.amps == amps] or made_of
    near = [row for row in made_of if thickness is None or _has_thickness(row, thickness)] or made_of
    return ChartChoices(
        tuple(sorted({row.process for row in rows})),
        tuple(sorted({row.material for row in cut})),
        tuple(sorted({row.thickness for row in with_amps})),
        tuple(sorted({row.amps for row in near if row.amps is not None})),
        tuple(dict.fromkeys(row.rates.nozzle for row in near if row.rates.nozzle)),
    )


def _has_thickness(row: ChartRow, thickness: float) -> bool:
    return abs(row.thickness - thickness) <= SAME_THICKNESS * thickness
