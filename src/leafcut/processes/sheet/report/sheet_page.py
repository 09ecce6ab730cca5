"""What the report page says of a sheet: drawings, time norm and cost, parts, cutting data."""

from __future__ import annotations

import re
from itertools import compress

from leafcut.model.cutting import CutPlan, CutTimes
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.report.cut_words import (
    amounts,
    cost_figure,
    money_words,
    name_words,
    part_kinds,
    size_words,
)
from leafcut.processes.sheet.report.norms import NormRow, batch_row, norm_rows, sheet_row
from leafcut.processes.sheet.report.sheet_detail import detail, looked_at
from leafcut.processes.sheet.report.sheet_drawing import (
    SheetScene,
    build_sheet_scene,
    part_id,
    part_window,
    sheet_drawing,
    stretches,
)
from leafcut.report import views
from leafcut.report.drawing import RAMP
from leafcut.report.overview import Tile
from leafcut.report.path_report import PathReport
from leafcut.report.views import PageRow
from leafcut.report.wording import (
    NO_VALUE,
    clean,
    count,
    feed_mm_min,
    length_words,
    percent_words,
    said,
    time_words,
)

MOST_PART_ROWS = 500
#: A table of more parts is scrolled on a screen.
_LONG_TABLE = 24
_LEAST_REST = 0.05


def order_names(report: PathReport[SheetDetail]) -> tuple[str, str, str]:
    """Return the names of the three orders."""
    return (said(f"{report.came_in.capitalize()} order"), said("Nearest neighbour"), said(views.OURS))


def sheet_content(report: PathReport[SheetDetail], plan: CutPlan) -> PageRow:
    """Return all that the template of a sheet needs."""
    scene = build_sheet_scene([p for p in report.outcome.detail.plans if p is not None], report.outcome.missing)
    return {
        "drawings": _drawings(report, scene),
        "wide": scene.frame.wide,
        "details": [detail(plan, number) for number in looked_at(plan)],
        "legend": _legend(scene, [p for p in report.outcome.detail.plans if p is not None]),
        "times": norm_times(report),
        "orders": _norm_rows(report),
        "common": any(n.sheet.common_mm > 0.0 for n in report.outcome.detail.norms if n is not None),
        "facts": facts(report, plan),
        "parts": _parts(scene, plan),
        "norms": norms_table(plan),
        "data": _data(plan),
    }


def sheet_size(plan: CutPlan) -> str:
    """Return ``sheet 900 × 1500 mm``, or how large the work is where nobody said how large the sheet is."""
    sheet = plan.sheet
    boxes = [sheet.outline.extents] if sheet.outline is not None else [c.path.extents for c in plan.cuts]
    if not boxes:
        return "nothing to cut"
    x0, y0, x1, y1 = (f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max)))
    return f"{'sheet' if sheet.outline is not None else 'cuts on'} {x1 - x0:.4g} × {y1 - y0:.4g} mm"


def cards(report: PathReport[SheetDetail]) -> list[PageRow]:
    """Return the three orders as the cards at the head show them."""
    return views.cards(report.outcome, report.orders())


def saved(report: PathReport[SheetDetail], plan: CutPlan) -> PageRow:
    """Return the large figure and the words around it."""
    row = views.saved(report.outcome, report.came_in, report.bound_words())
    seconds, quantity = report.outcome.before.time_s - report.outcome.after.time_s, plan.measures.quantity
    first = report.outcome.detail.norms[0]
    words = [f"{percent_words(abs(report.outcome.saved_percent))} {'more' if row['worse'] else 'less'} machine time"]
    if not report.outcome.before.time_s > 0.0:
        return {**row, "percent": "There is nothing to cut."}
    if seconds > 0.0:
        sheets = f"the batch of {quantity:,} sheets" if quantity > 1 else "100 sheets"
        words.append(f", {time_words((quantity if quantity > 1 else 100) * seconds)} on {sheets}")
    words.append(".")
    if first is not None and first.sheet.rapid_mm > 0.0:
        shorter = 100.0 * (1.0 - plan.measures.sheet.rapid_mm / first.sheet.rapid_mm)
        side = "shorter" if shorter >= 0.0 else "longer"
        words.append(f" The travel between the cuts is {percent_words(abs(shorter))} {side}.")
    return {**row, "percent": "".join(words)}


# -- drawings --------------------------------------------------------------------------------------------------------


def plan_words(report: PathReport[SheetDetail], which: int) -> str:
    """Return the title of a drawing, 0 before, 1 nearest neighbour, 2 after."""
    orders = (f"the {report.came_in}’s order", "nearest-neighbour order", "leafcut’s order")
    return f"Cuts of {clean(report.outcome.part.name)} in {orders[which]}"


def _drawings(report: PathReport[SheetDetail], scene: SheetScene) -> list[PageRow]:
    captions = (f"Before: the {report.came_in}’s order", "Nearest neighbour", "After: leafcut")
    rows: list[PageRow] = []
    # The page reads from left to right and on: before and after stand side by side, the third order under them.
    for which in (0, 2, 1):
        plan = report.outcome.detail.plans[which]
        if plan is None:
            continue
        name = ("before", "nearest", "after")[which]
        words = plan_words(report, which)
        svg = sheet_drawing(scene, plan, name, words, parts="#sheet-parts" if rows else "=sheet-parts")
        way = f"{length_words(plan.measures.sheet.rapid_mm)} between the cuts"
        rows.append({"caption": captions[which], "way": way, "svg": svg})
    return rows


def _legend(scene: SheetScene, plans: list[CutPlan]) -> PageRow:
    """Return what the drawings show; only what is there is explained."""
    cuts = [cut for plan in plans for cut in plan.cuts]
    kinds = {kind for cut in cuts for kind, _, _ in stretches(cut)}
    return {
        "kinds": kinds,
        "true_kerf": scene.true_kerf,
        "stock": scene.sheet.outline is not None,
        "clamps": bool(scene.sheet.zones),
        "edges": any(c.kind == "cut" and not c.pierce for c in cuts),
        "pierces": any(c.kind == "cut" and c.pierce for c in cuts),
        "every": {1: "numbers give the order", 2: "every second has its number in the order"}.get(
            scene.every, f"every {scene.every}th has its number in the order"
        ),
        "ramp": [f"r{i}" for i in range(0, RAMP, 3)] if scene.many else None,
    }


# -- time norm and cost ----------------------------------------------------------------------------------------------


def norm_times(report: PathReport[SheetDetail]) -> PageRow:
    """Return the seconds of cutting, piercing and rapids of the three orders, with stacked bars."""
    kinds = {"feed": said("cutting"), "dwell": said("piercing"), "rapid": said("rapids")}
    rows = [
        (name, {"feed": t.cut_s, "dwell": t.pierce_s, "rapid": t.rapid_s}, time_words(t.total_s))
        for name, t in _known_norms(report)
    ]
    return views.stacked(kinds, rows)


def _known_norms(report: PathReport[SheetDetail]) -> list[tuple[str, CutTimes]]:
    norms = zip(order_names(report), report.outcome.detail.norms, strict=True)
    return [(name, norm.sheet) for name, norm in norms if norm is not None]


def _norm_rows(report: PathReport[SheetDetail]) -> list[PageRow]:
    bars = norm_times(report)["rows"]
    return [
        {
            **bar,
            **_time_cells(t),
            "pierces": f"{t.pierces:,}",
            "way": length_words(t.rapid_mm),
            "path": length_words(t.length_mm),
        }
        for bar, (_, t) in zip(bars, _known_norms(report), strict=True)
    ]


def _time_cells(times: CutTimes) -> dict[str, str]:
    return {
        "cutting": time_words(times.cut_s),
        "piercing": time_words(times.pierce_s),
        "rapids": time_words(times.rapid_s),
        "total": time_words(times.total_s),
    }


def facts(report: PathReport[SheetDetail], plan: CutPlan) -> list[Tile]:
    """Return the figures of a sheet: (name, figure, words under it)."""
    norm, times = plan.measures, plan.measures.sheet
    cut, pierced = length_words(times.cut_mm), time_words(times.pierce_s)
    found: list[Tile] = [
        (said("Time of a sheet"), time_words(times.total_s), said("{time} of cutting", time=time_words(times.cut_s))),
        (said("Pierces"), f"{times.pierces:,}", said("{time} of piercing", time=pierced)),
        (said("Perimeter"), length_words(times.perimeter_mm), said("{length} cut, leads included", length=cut)),
        (said("Path length"), length_words(times.length_mm), _path_words(times)),
    ]
    if norm.utilisation is not None:
        area = sum(p.area for p in norm.parts) / 1e6
        parts = said("{area} m² of parts", area=f"{area:.3g}")
        found.append((said("Sheet used"), percent_words(100.0 * norm.utilisation), parts))
    if norm.cost > 0.0:
        found.append((said("Cost of a sheet"), money_words(norm.cost), _cost_before(report)))
    if norm.quantity > 1:
        every = said("all sheets, one after the other")
        cost = said("cost {cost}", cost=money_words(norm.batch_cost)) if norm.cost > 0.0 else every
        name = said("Batch of {number}", number=f"{norm.quantity:,}")
        found.append((name, time_words(norm.batch.total_s), cost))
    return found


def _path_words(times: CutTimes) -> str:
    between = length_words(times.rapid_mm)
    if times.common_mm > 0.0:
        common = length_words(times.common_mm)
        return said("perimeters − {common} of common edges + {between} between", common=common, between=between)
    return said("perimeters + {between} between", between=between)


def _cost_before(report: PathReport[SheetDetail]) -> str:
    first = report.outcome.detail.norms[0]
    return said(f"{{cost}} in the {report.came_in}’s order", cost=money_words(first.cost))


# -- parts -----------------------------------------------------------------------------------------------------------


def parts_table(plan: CutPlan) -> PageRow:
    """Return one row per part, and the sums under them."""
    norm = plan.measures
    with_cost = norm.cost > 0.0
    places = 3 if with_cost and min((p.cost for p in norm.parts), default=1.0) < 0.1 else 2
    rows = [
        {
            "part": p.part,
            "number": clean(f"{p.part} {p.name}".rstrip()) if p.part else said("in no part"),
            "contours": _contours_words(plan, p.part),
            "area": f"{p.area / 100.0:,.4g}" if p.area else NO_VALUE,
            **_cells(p.times, p.cost, places),
        }
        for p in norm.parts[:MOST_PART_ROWS]
    ]
    # What is in no cut: the ways at the beginning and the end of the program.
    rest = norm.sheet.total_s - sum(p.times.total_s for p in norm.parts)
    feet = []
    if rest >= _LEAST_REST:
        ends = CutTimes(rapid_s=rest)
        only = {"perimeter": "", "pierces": "", "cutting": "", "piercing": "", "cost": "", "total": time_words(rest)}
        feet.append({"name": said("beginning and end"), **_cells(ends, 0.0, places), **only})
    feet.append({"name": said("Sheet"), **_cells(norm.sheet, norm.cost, places)})
    if norm.quantity > 1:
        sheets = said("{number} sheets", number=f"{norm.quantity:,}")
        feet.append({"name": sheets, **_cells(norm.batch, norm.batch_cost, places)})
    left_out = len(norm.parts) - len(rows)
    return {"rows": rows, "feet": feet, "cost": with_cost, "left_out": left_out, "long": len(rows) > _LONG_TABLE}


def _parts(scene: SheetScene, plan: CutPlan) -> PageRow:
    """Return the table of the parts, each with its picture."""
    table = parts_table(plan)
    shown = [
        {**row, "href": f"#{part_id(row['part'])}" if window else "", "window": window}
        for row in table["rows"]
        for window in [part_window(scene, row["part"])]
    ]
    return {**table, "rows": shown}


def _cells(times: CutTimes, cost: float, places: int) -> dict[str, str]:
    return {
        "perimeter": length_words(times.perimeter_mm),
        "pierces": f"{times.pierces:,}",
        **_time_cells(times),
        "cost": cost_figure(cost, places),
    }


def _contours_words(plan: CutPlan, part: int) -> str:
    """Return how many contours of a part are cut, and how many marks it has."""
    mine = part_kinds(plan, part)
    marks = mine.count("mark")
    return f"{len(mine) - marks}" + (f" + {count(marks, 'mark')}" if marks else "")


# -- norms -----------------------------------------------------------------------------------------------------------


def norms_table(plan: CutPlan) -> PageRow:
    """Return a row of time and consumption for each kind of part, and the sums under them."""
    norm, rates = plan.measures, plan.data.rates
    found = norm_rows(norm)
    rows = found[:MOST_PART_ROWS]
    feet = [(said("Sheet"), sheet_row(norm))]
    if norm.quantity > 1:
        feet.append((said("{number} sheets", number=f"{norm.quantity:,}"), batch_row(norm)))
    of_sheet = amounts(norm.used, rates)
    known = [amount != NO_VALUE for _, amount in of_sheet]

    def cells(row: NormRow) -> PageRow:
        told = [amount for _, amount in compress(amounts(row.used, rates), known)]
        perimeter = length_words(row.total_perimeter)
        return {"perimeter": perimeter, "clock": [f"{figure:,}" for figure in row.clock], "amounts": told}

    return {
        "rows": [
            {
                "name": clean(row.name),
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


def _data(plan: CutPlan) -> PageRow:
    """Return the row of the cut chart that was used."""
    data = plan.data
    amps = f", {data.amps:g} A" if data.amps is not None else ""
    pierce = f"{data.pierce_delay:.3g} s at {size_words(data.pierce_height)} mm" if data.can_pierce else "at the edge"
    rows = [
        ("process", name_words(data.process) + amps),
        ("material", f"{name_words(data.material)}, {size_words(data.thickness)} mm"),
        ("speed", f"{feed_mm_min(data.feed):,.0f} mm/min"),
        ("kerf", f"{size_words(data.kerf)} mm"),
        ("pierce", pierce),
        ("cut height", f"{size_words(data.cut_height)} mm"),
    ]
    confidence, why = [*re.split(r"[,;:]\s*", clean(data.confidence), maxsplit=1), ""][:2]
    if data.volts is not None:
        rows.append(("arc", f"{data.volts:g} V"))
    if data.rates.nozzle:
        rows.append(("nozzle", data.rates.nozzle))
    gases = [name_words(gas) for gas in (data.rates.gas, data.rates.second_gas) if gas]
    if gases:
        rows.append(("gas", " and ".join(gases)))
    return {
        "rows": [(name, clean(words)) for name, words in rows],
        "source": clean(data.source),
        # A word or two, and in some charts the reason after a comma.
        "confidence": confidence,
        "why": why,
        "sure": not data.confidence.startswith("low"),
    }
