"""Facts and report page of a sheet: its parts and cuts, and the time and cost of the sheet and of the batch."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.cutting import Cut, CutMeasures, CutPlan, CutTimes
from leafcut.model.fact import Fact
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome, Which
from leafcut.model.sheet import Sheet
from leafcut.model.shown_stock import CUT_THROUGH, ShownStock
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.report.cut_words import (
    consumption_texts,
    cost_figure,
    cut_counts,
    cut_name,
    cutting_as_json,
    name_words,
    part_contour_kinds,
    size_words,
)
from leafcut.processes.sheet.report.norms import NormRow, batch_row, cycle_time_rows, cycle_times_csv, sheet_row
from leafcut.processes.sheet.report.sheet_drawing import (
    SheetScene,
    build_sheet_scene,
    dot_class,
    legend,
    part_id,
    part_window,
    path_sections,
    sheet_drawing,
)
from leafcut.report.marks import arrow_head_path_data
from leafcut.report.path_report import PathReport
from leafcut.report.svg import (
    STEPS,
    element,
    scaled_group_element,
    segments_path_data,
    text_element,
    tick_label,
    tick_step,
    title_element,
)
from leafcut.report.wording import (
    NO_VALUE,
    count_text,
    gap_words,
    length_words,
    money_words,
    percent_words,
    replace_unprintable,
    time_words,
    to_mm_per_min,
)

if TYPE_CHECKING:
    from leafcut.report.views import PageRow

#: Maximum number of rows in the table of parts.
MOST_PART_ROWS = 500
#: A table of parts with more rows than this is scrolled on a screen.
_LONG_TABLE = 24
#: Time outside all parts gets its own row if it is at least this long, s.
_LEAST_REST = 0.05
_WHICH = ("before", "nearest", "after")

BoundingBox = tuple[float, float, float, float]
#: Width and height of a detail drawing, in user units of the drawing.
_WIDTH, _HEIGHT = 300.0, 190.0
#: Half the height of a detail drawing, in lengths of the lead-in and in kerf widths; and its minimum, mm.
_LEADS, _KERFS, _LEAST = 1.6, 5.0, 4.0
_CHORDS = 0.08
#: A wide line may still be visible if it is outside the window by no more than this margin, in user units.
_BEYOND = 60.0
_ARROW = 4.5
_SMALLEST_DOT = 2.4


class SheetReport(PathReport[SheetDetail]):
    """The facts, tables, report page and pictures for a sheet."""

    package = "leafcut.processes.sheet.report"
    template = "sheet"
    # Use the travel between cuts, as in the plan; total travel would include every retract and descent.
    travel = "between"

    def __init__(self, outcome: Outcome[SheetDetail]) -> None:
        super().__init__(outcome)
        self.cuts = outcome.detail.plan
        if "--plan" in outcome.options:
            self.came_in = "plan"

    def compared_measures(self) -> tuple[Measure, Measure | None, Measure]:
        """Return the measures of the original, nearest-neighbour and final orders.

        The lengths are totals of the sheet.
        """
        outcome, (before, nearest, after) = self.outcome, self.outcome.detail.norms
        near = (
            outcome.nearest
            if outcome.nearest is None or nearest is None
            else _with_sheet_lengths(outcome.nearest, nearest)
        )
        return _with_sheet_lengths(outcome.before, before), near, _with_sheet_lengths(outcome.after, after)

    def count_facts(self) -> list[Fact]:
        """Return the numbers of parts, contours, marks and pierces."""
        numbers = cut_counts(self.cuts)
        counted = {
            "parts": count_text(numbers["parts"], "part"),
            "contours": count_text(numbers["contours"], "contour"),
            "marks": count_text(numbers["marks"], "mark"),
            "pierces": count_text(numbers["pierces"], "pierce"),
        }
        return [Fact(f"counts.{name}", n, "", counted[name] if n else "") for name, n in numbers.items()]

    def process_facts(self) -> list[Fact]:
        """Return the cutting data, and the time, lengths, cost and consumption of the sheet and of the batch."""
        plan, (first, _, norm) = self.cuts, self.outcome.detail.norms
        times, answer = norm.sheet, cutting_as_json(self.outcome.detail)
        cutting, rapids, pierced = map(time_words, (times.cut_s, times.rapid_s, times.pierce_s))
        cut, between = length_words(times.cut_mm), length_words(times.rapid_mm)
        path = Message("perimeters + {} between", between)
        if times.common_mm > 0.0:
            common = length_words(times.common_mm)
            path = Message("perimeters − {} of common edges + {} between", common, between)
        on_sheet = Message("{} of cutting, {} of rapids", cutting, rapids)
        facts = [
            Fact("cutting", answer),
            Fact(sentence="; ".join(words for _, words in _cutting_data_rows(plan)), name="cut with"),
            Fact("cutting.sheet.total_s", times.total_s, "s", on_sheet, Message("Time of a sheet")),
            Fact(
                "cutting.sheet.pierces", times.pierces, "", Message("{} of piercing", pierced),
                Message("Pierces"),
            ),
            Fact("cutting.sheet.perimeter_mm", times.perimeter_mm, "mm",
                 Message("{} cut, leads included", cut), Message("Perimeter")),
            Fact("cutting.sheet.length_mm", times.length_mm, "mm", path, Message("Path length")),
        ]  # fmt: skip
        if norm.utilisation is not None:
            parts = Message("{} m² of parts", f"{sum(p.area for p in norm.parts) / 1000000.0:.3g}")
            used = 100.0 * norm.utilisation
            facts.append(Fact("cutting.utilisation_percent", used, "%", parts, Message("Sheet used")))
        if norm.cost > 0.0:
            earlier = Message(
                "{} in the plan’s order" if self.came_in == "plan" else "{} in the drawing’s order",
                money_words(first.cost),
            )
            facts.append(Fact("cutting.cost", norm.cost, "", earlier, Message("Cost of a sheet")))
        if norm.quantity > 1:
            each, cost = cut_counts(plan)["parts"], money_words(norm.batch_cost)
            words = Message("{:,} parts in all, {:,} on each sheet", norm.quantity * each, each)
            words = Message("cost {}; {}", cost, words) if norm.cost > 0.0 else words
            name = Message("Batch of {} sheets", f"{norm.quantity:,}")
            facts.append(Fact("cutting.batch.total_s", norm.batch.total_s, "s", words, name))
        uses = [
            f"{amount} {name}" for name, amount in consumption_texts(norm.used, plan.data.rates) if amount != NO_VALUE
        ]
        return [*facts, *([Fact(sentence=", ".join(uses), name="uses")] if uses else [])]

    def gap_sentence(self) -> str:
        """Describe the proved gap to the optimum. The optimum only considers the starts that were tried."""
        outcome = self.outcome
        if outcome.gap is None:
            return ""
        unit = outcome.operations[0].solution.unit
        words = f"{'time' if unit == 's' else 'travel'} {gap_words(outcome.gap, unit)} with the starts that were tried"
        several = len(outcome.operations) > 1
        return words + (", each band from the end of the last" if several else "")

    def operation_title(self, number: int) -> str:
        """Return a name for the cuts that one search orders. These are all cuts, or the cuts of one band."""
        operations = self.outcome.operations
        cuts = count_text(operations[number].cuts, "cut")
        return cuts if len(operations) == 1 else f"band {number + 1}, {cuts}"

    def nearest_neighbour_cost(self) -> float | None:
        """Return None. The costs cannot be compared, because starts still move after the order is known."""
        return None

    def page_tables(self) -> dict[str, Any]:
        """Return the tables: times by order, parts, and cycle times with consumption."""
        from leafcut.report.views import stacked_bars

        kinds = {"feed": Message("cutting"), "dwell": Message("piercing"), "rapid": Message("rapids")}
        rows = [
            (name, {"feed": t.cut_s, "dwell": t.pierce_s, "rapid": t.rapid_s}, time_words(t.total_s))
            for name, t in self._times_by_order()
        ]
        return {
            "times": stacked_bars(kinds, rows),
            "parts": parts_table(self.cuts),
            "norms": cycle_time_table(self.cuts),
        }

    def cycle_time_csv(self) -> str:
        """Return the table of cycle times and consumption as CSV text."""
        return cycle_times_csv(self.cuts)

    def template_values(self) -> dict[str, Any]:
        """Return the data of the report page: drawings, orders, parts and cutting data."""
        known, plan = self._plans(), self.cuts
        scene = build_sheet_scene(known, self.outcome.missing)
        return {
            "size": sheet_size(plan),
            "saved": self.savings_headline(),
            "way": "Between cuts",
            "parts": _parts_section(scene, plan),
            "sheet": {
                "drawings": self._drawings(scene),
                "wide": scene.frame.needs_both_columns,
                "details": [draw_cut_detail(plan, number) for number in detailed_cuts(plan)],
                "legend": legend(scene, known),
                "orders": [
                    (f"{t.pierces:,}", length_words(t.rapid_mm), length_words(t.length_mm))
                    for _, t in self._times_by_order()
                ],
                "common": any(n.sheet.common_mm > 0.0 for n in self.outcome.detail.norms if n is not None),
                "data": _cutting_data_section(plan),
            },
        }

    def savings_headline(self) -> PageRow:
        """Return the headline of the report page: the time saved, with an explanation."""
        outcome, row = self.outcome, super().savings_headline()
        if not outcome.before.time_s > 0.0:
            return {**row, "percent": "The program cuts nothing."}
        seconds, quantity = outcome.before.time_s - outcome.after.time_s, self.cuts.measures.quantity
        first = outcome.detail.norms[0].sheet.rapid_mm
        words = f"{percent_words(abs(outcome.saved_percent))} {'more' if row['worse'] else 'less'} machine time"
        if seconds > 0.0:
            sheets = f"the batch of {quantity:,} sheets" if quantity > 1 else "100 sheets"
            words += f", {time_words((quantity if quantity > 1 else 100) * seconds)} on {sheets}"
        words += "."
        if first > 0.0:
            shorter = 100.0 * (1.0 - self.cuts.measures.sheet.rapid_mm / first)
            side = "shorter" if shorter >= 0.0 else "longer"
            words += f" The travel between the cuts is {percent_words(abs(shorter))} {side}."
        return {**row, "percent": words}

    def drawing(self, which: Which) -> str:
        """Draw the sheet as SVG, with the cuts in the order of the input or of the program."""
        scene = build_sheet_scene(self._plans(), self.outcome.missing)
        return sheet_drawing(scene, self.cut_plan(which), which, self._order_title(which), size=True)

    def cut_plan(self, which: Which) -> CutPlan:
        """Return the cuts in the order of the input or of the program."""
        before, _, after = self.outcome.detail.plans
        return before if which == "before" else after

    def shown_stock(self) -> ShownStock:
        """Return the stock for the 3D view: a sheet that the cuts go all the way through."""
        return CUT_THROUGH

    def _plans(self) -> list[CutPlan]:
        return [plan for plan in self.outcome.detail.plans if plan is not None]

    def _times_by_order(self) -> list[tuple[str, CutTimes]]:
        norms = zip(self.order_names(), self.outcome.detail.norms, strict=True)
        return [(name, norm.sheet) for name, norm in norms if norm is not None]

    def _drawings(self, scene: SheetScene) -> list[PageRow]:
        captions = (f"Before: the {self.came_in}’s order", "Nearest neighbour", "After: leafcut")
        rows: list[PageRow] = []
        # The orders before and after are side by side, and the third order is below them.
        for k in (0, 2, 1):
            plan = self.outcome.detail.plans[k]
            if plan is not None:
                parts = "#sheet-parts" if rows else "=sheet-parts"
                svg = sheet_drawing(scene, plan, _WHICH[k], self._order_title(_WHICH[k]), parts=parts)
                way = f"{length_words(plan.measures.sheet.rapid_mm)} between the cuts"
                rows.append({"caption": captions[k], "way": way, "svg": svg})
        return rows

    def _order_title(self, which: str) -> str:
        orders = {"before": f"the {self.came_in}’s order", "nearest": "nearest-neighbour order"}
        return f"Cuts of {replace_unprintable(self.outcome.part.name)} in {orders.get(which, 'leafcut’s order')}"


def _with_sheet_lengths(measure: Measure, norm: CutMeasures) -> Measure:
    return replace(measure, travel_mm=norm.sheet.rapid_mm, cut_mm=norm.sheet.cut_mm)


def sheet_size(plan: CutPlan) -> str:
    """Return the size of the sheet, such as ``sheet 900 × 1500 mm``.

    If the size is unknown, the area that the cuts cover is used instead.
    """
    sheet = plan.sheet
    boxes = [sheet.outline.extents] if sheet.outline is not None else [c.path.extents for c in plan.cuts]
    if not boxes:
        return "nothing to cut"
    x0, y0, x1, y1 = (f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max)))
    return f"{'sheet' if sheet.outline is not None else 'cuts on'} {x1 - x0:.4g} × {y1 - y0:.4g} mm"


def _time_cells(times: CutTimes) -> dict[str, str]:
    return {
        "cutting": time_words(times.cut_s),
        "piercing": time_words(times.pierce_s),
        "rapids": time_words(times.rapid_s),
        "total": time_words(times.total_s),
    }


# -- parts -----------------------------------------------------------------------------------------------------------


def parts_table(plan: CutPlan) -> PageRow:
    """Build the table of parts. It has a row for each part, and rows with totals."""
    norm = plan.measures
    with_cost = norm.cost > 0.0
    places = 3 if with_cost and min((p.cost for p in norm.parts), default=1.0) < 0.1 else 2
    rows = [
        {
            "part": p.part,
            "number": replace_unprintable(f"{p.part} {p.name}".rstrip()) if p.part else Message("in no part"),
            "contours": _contours_words(plan, p.part),
            "area": f"{p.area / 100.0:,.4g}" if p.area else NO_VALUE,
            **_totals_cells(p.times, p.cost, places),
        }
        for p in norm.parts[:MOST_PART_ROWS]
    ]
    # Moves outside cuts, at the start and the end of the program.
    rest = norm.sheet.total_s - sum(p.times.total_s for p in norm.parts)
    feet = []
    if rest >= _LEAST_REST:
        ends = CutTimes(rapid_s=rest)
        only = {"perimeter": "", "pierces": "", "cutting": "", "piercing": "", "cost": "", "total": time_words(rest)}
        feet.append({"name": Message("start and end"), **_totals_cells(ends, 0.0, places), **only})
    feet.append({"name": Message("Sheet"), **_totals_cells(norm.sheet, norm.cost, places)})
    if norm.quantity > 1:
        sheets = Message("{} sheets", f"{norm.quantity:,}")
        feet.append({"name": sheets, **_totals_cells(norm.batch, norm.batch_cost, places)})
    left_out = len(norm.parts) - len(rows)
    return {"rows": rows, "feet": feet, "cost": with_cost, "left_out": left_out, "long": len(rows) > _LONG_TABLE}


def _parts_section(scene: SheetScene, plan: CutPlan) -> PageRow:
    table = parts_table(plan)
    shown = [
        {**row, "href": f"#{part_id(row['part'])}" if window else "", "window": window}
        for row in table["rows"]
        for window in [part_window(scene, row["part"])]
    ]
    return {**table, "rows": shown}


def _totals_cells(times: CutTimes, cost: float, places: int) -> dict[str, str]:
    return {
        "perimeter": length_words(times.perimeter_mm),
        "pierces": f"{times.pierces:,}",
        **_time_cells(times),
        "cost": cost_figure(cost, places),
    }


def _contours_words(plan: CutPlan, part: int) -> str:
    mine = part_contour_kinds(plan, part)
    marks = mine.count("mark")
    return f"{len(mine) - marks}" + (f" + {count_text(marks, 'mark')}" if marks else "")


# -- norms -----------------------------------------------------------------------------------------------------------


def cycle_time_table(plan: CutPlan) -> PageRow:
    """Build the table of cycle times and consumption. It has a row for each kind of part, and rows with totals."""
    norm, rates = plan.measures, plan.data.rates
    found = cycle_time_rows(norm)
    rows = found[:MOST_PART_ROWS]
    feet = [(Message("Sheet"), sheet_row(norm))]
    if norm.quantity > 1:
        feet.append((Message("{} sheets", f"{norm.quantity:,}"), batch_row(norm)))
    of_sheet = consumption_texts(norm.used, rates)
    known = [amount != NO_VALUE for _, amount in of_sheet]

    def cells(row: NormRow) -> PageRow:
        shown = [amount for _, amount in compress(consumption_texts(row.used, rates), known)]
        perimeter = length_words(row.total_perimeter)
        return {
            "perimeter": perimeter,
            "clock": [f"{figure:,}" for figure in row.hours_minutes_seconds],
            "amounts": shown,
        }

    return {
        "rows": [
            {
                "name": replace_unprintable(row.name),
                "each": length_words(row.perimeter),
                "quantity": f"{row.quantity:,}",
                **cells(row),
            }
            for row in rows
        ],
        "feet": [{"name": name, **cells(row)} for name, row in feet],
        "names": [name for name, _ in compress(of_sheet, known)],
        "unknown": [name for name, amount in of_sheet if amount == NO_VALUE],
        "left_out": len(found) - len(rows),
        "long": len(rows) > _LONG_TABLE,
    }


# -- cutting data ----------------------------------------------------------------------------------------------------


def _cutting_data_rows(plan: CutPlan) -> list[tuple[str, str]]:
    """Return the cutting data as pairs (heading, text). Each text also makes sense without its heading."""
    data = plan.data
    amps = f" {data.amps:g} A" if data.amps is not None else ""
    place = f"{data.pierce_delay:.3g} s at {size_words(data.pierce_height)} mm" if data.can_pierce else "at the edge"
    rows = [
        ("process", name_words(data.process) + amps),
        ("material", f"{name_words(data.material)}, {size_words(data.thickness)} mm"),
        ("speed", f"{to_mm_per_min(data.feed):,.0f} mm/min"),
        ("kerf", f"kerf {size_words(data.kerf)} mm"),
        ("pierce", f"pierce {place}"),
        ("cut height", f"cut height {size_words(data.cut_height)} mm"),
    ]
    if data.volts is not None:
        rows.append(("arc", f"arc {data.volts:g} V"))
    if data.rates.nozzle:
        rows.append(("nozzle", f"nozzle {data.rates.nozzle}"))
    gases = [name_words(gas) for gas in (data.rates.gas, data.rates.second_gas) if gas]
    return rows + ([("gas", f"gas {' and '.join(gases)}")] if gases else [])


def _cutting_data_section(plan: CutPlan) -> PageRow:
    # The confidence is one or two words; in some charts, it is followed by a comma and the reason.
    confidence, why = [*re.split(r"[,;:]\s*", replace_unprintable(plan.data.confidence), maxsplit=1), ""][:2]
    return {
        "rows": [
            (name, replace_unprintable(words.removeprefix(f"{name} "))) for name, words in _cutting_data_rows(plan)
        ],
        "source": replace_unprintable(plan.data.source),
        "confidence": confidence,
        "why": why,
        "sure": not plan.data.confidence.startswith("low"),
    }


# -- details of single cuts ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DetailView:
    """A window that shows a section of the sheet. It has a centre in mm, and a scale in user units per mm."""

    middle: tuple[float, float]
    scale: float

    @property
    def box(self) -> BoundingBox:
        """The corners of the window, mm: smallest x and y, then largest x and y."""
        (x, y), half = self.middle, (0.5 * _WIDTH / self.scale, 0.5 * _HEIGHT / self.scale)
        return (x - half[0], y - half[1], x + half[0], y + half[1])

    def to_user_units(self, points: Points) -> Points:
        """Convert points in mm, float64[…, 2], to user units. In the result, y points down."""
        x, y = self.middle
        placed: Points = np.stack(
            [0.5 * _WIDTH + (points[..., 0] - x) * self.scale, 0.5 * _HEIGHT - (points[..., 1] - y) * self.scale],
            axis=-1,
        )
        return placed

    def shows(self, box: BoundingBox) -> bool:
        """Return whether any part of a box, given in mm, may be visible in the window."""
        own = self.box
        return box[0] <= own[2] and box[2] >= own[0] and box[1] <= own[3] and box[3] >= own[1]

    def complete_path_data(self, path: Polyline) -> str:
        """Return the SVG path data of a complete path, in steps of 1 / `report.svg.STEPS` user units."""
        return segments_path_data(self._segments(path))

    def visible_path_data(self, path: Polyline) -> str:
        """Return the SVG path data of the visible segments, in steps of 1 / `report.svg.STEPS` user units."""
        segments = self._segments(path)
        low, high = segments.min(axis=1), segments.max(axis=1)
        seen = (low <= (_WIDTH + _BEYOND, _HEIGHT + _BEYOND)).all(axis=1) & (high >= -_BEYOND).all(axis=1)
        return segments_path_data(segments[seen])

    def _segments(self, path: Polyline) -> Points:
        points = self.to_user_units(path.flattened(_CHORDS / self.scale))
        return np.stack([points[:-1], points[1:]], axis=1)


def detailed_cuts(plan: CutPlan) -> list[int]:
    """Choose the cuts to draw in detail: the first hole and the first outline with a lead-in. Return their indices."""
    found: dict[bool, int] = {}
    for number, cut in enumerate(plan.cuts):
        if cut.kind == "cut" and cut.lead_in > 0.0 and cut.contours:
            found.setdefault(plan.sheet.contours[cut.contours[0]].is_hole, number)
    return sorted(found.values())


def draw_cut_detail(plan: CutPlan, number: int) -> dict[str, str]:
    """Draw the start and end of a cut.

    Return the drawing (``svg``), its ``caption``, and its lead lengths (``words``).
    """
    cut = plan.cuts[number]
    half = max(_LEADS * cut.lead_in, _KERFS * plan.data.kerf, _LEAST)
    view = DetailView(cut.path.point_at(cut.lead_in), 0.5 * _HEIGHT / half)
    window = f"window-look-{number}"
    edge = element("rect", x=0.0, y=0.0, width=_WIDTH, height=_HEIGHT)
    near = [c for c in plan.cuts if c is not cut and view.shows(c.path.extents)]
    inside = (
        _draw_parts(view, plan.sheet),
        *(_draw_kerf_band(view, c, plan.data.kerf) for c in (*near, cut)),
        _draw_start_marks(view, plan, cut),
    )
    words = f"Cut {number + 1}: {cut_name(plan, cut)}"
    svg = element(
        "svg",
        title_element(words),
        element("clipPath", edge, id=window),
        element("rect", x=0.0, y=0.0, width=_WIDTH, height=_HEIGHT, class_="look"),
        element("g", *inside, clip_path=f"url(#{window})"),
        _draw_scale_bar(view),
        viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}",
        class_="drawing sheet closer",
        role="img",
    )
    return {"svg": svg, "caption": words, "words": _lead_words(cut)}


def _lead_words(cut: Cut) -> str:
    """Return the lengths of the leads, and of the path with the torch off, as text.

    For example: ``lead-in 6.0 mm, lead-out 4.0 mm``.
    """
    after = [(kind, high - low) for kind, low, high in path_sections(cut) if low >= cut.lead_out]
    words = [f"lead-in {length_words(cut.lead_in)}"]
    for kind, phrase in (("lead", "lead-out {}"), ("dark", "{} with the torch off")):
        length = sum(part for of_kind, part in after if of_kind == kind)
        words += [phrase.format(length_words(length))] if length > 0.0 else []
    return ", ".join(words)


def _draw_parts(view: DetailView, sheet: Sheet) -> str:
    areas: dict[int, str] = {}
    for c in sheet.contours:
        if c.kind == "cut" and c.path.closed and c.part and not c.chamber:
            areas[c.part] = areas.get(c.part, "") + view.complete_path_data(c.path) + "z"
    seen = {c.part for c in sheet.contours if view.shows(c.path.extents)}
    return scaled_group_element(
        *(element("path", d=data, class_="part rim") for part, data in areas.items() if part in seen)
    )


def _draw_kerf_band(view: DetailView, cut: Cut, kerf: float) -> str:
    lines = []
    for kind, low, high in path_sections(cut):
        data = view.visible_path_data(cut.path.piece(low, high))
        if kind in ("kerf", "lead", "bridge"):
            lines.append(element("path", d=data, class_=f"{kind} band", stroke_width=kerf * view.scale * STEPS))
        lines.append(element("path", d=data, class_=kind, stroke_width=1.2 * STEPS))
    return scaled_group_element(*lines)


def _draw_start_marks(view: DetailView, plan: CutPlan, cut: Cut) -> str:
    x, y = view.to_user_units(np.array(cut.path.start)).tolist()
    heads = []
    for at in (0.55 * cut.lead_in, cut.lead_in + 1.1 * max(cut.lead_in, _LEAST)):
        place, (dx, dy) = view.to_user_units(np.array(cut.path.point_at(at))).tolist(), cut.path.direction_at(at)
        heads.append(
            element("path", d=arrow_head_path_data((place[0], place[1]), (dx, -dy), _ARROW), class_="kerf-arrow")
        )
    radius = max(0.5 * plan.data.kerf * view.scale, _SMALLEST_DOT)
    return "".join(heads) + element("circle", cx=x, cy=y, r=radius, class_=dot_class(cut))


def _draw_scale_bar(view: DetailView) -> str:
    step = tick_step(_WIDTH / view.scale, 6)
    length = step * view.scale
    bar = element("path", d=f"M{_WIDTH - 10 - length:.2f} {_HEIGHT - 13}v6m0 -3h{length:.2f}m0 -3v6", class_="bar")
    words = text_element(
        f"{tick_label(step, step)} mm", _WIDTH - 16 - length, _HEIGHT - 10, text_anchor="end", dy="0.34em", class_="on"
    )
    return bar + words
