"""The result of `leafcut nest`: as JSON, and as a summary on the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from leafcut.model.issue import Severity
from leafcut.model.nest import Layout, Nest, NestOutcome, Stock
from leafcut.report.json_answer import issues_as_json, missing_as_json
from leafcut.report.wording import clean, count

if TYPE_CHECKING:
    from rich.console import Console


def nest_as_json(outcome: NestOutcome) -> dict[str, Any]:
    """Return the outcome as plain values: lengths in mm, shares in percent, the best variant first."""
    first = outcome.nests[0]
    return {
        "sheet": {"length_mm": first.stocks[0].length, "width_mm": first.stocks[0].width},
        "sheets": [_stock(stock) for stock in first.stocks],
        "parts": sum(part.quantity for part in first.parts),
        "spacing_mm": outcome.spacing,
        "margin_mm": outcome.margin,
        "variants": [_variant(one, files) for one, files in _with_files(outcome)],
        "remnants": [
            {**_stock(one.stock), "count": one.count, "area_mm2": one.stock.area, "file": one.file}
            for one in outcome.remnants
        ],
        "dropped": list(outcome.dropped),
        "verified": True,
        "missing": missing_as_json(outcome.missing),
        "seconds": outcome.seconds,
        "issues": issues_as_json(outcome.issues),
        **({"defaults": list(outcome.defaults)} if outcome.defaults else {}),
    }


def _stock(stock: Stock) -> dict[str, Any]:
    return {
        "name": stock.name,
        "length_mm": stock.length,
        "width_mm": stock.width,
        "count": stock.count,
        "price": stock.price,
    }


def _with_files(outcome: NestOutcome) -> Iterator[tuple[Nest, tuple[str, ...]]]:
    return ((one, outcome.files[i] if i < len(outcome.files) else ()) for i, one in enumerate(outcome.nests))


def _variant(one: Nest, files: tuple[str, ...]) -> dict[str, Any]:
    return {
        "method": one.method,
        "seed": one.seed,
        "repeatable": one.repeatable,
        "sheets": one.n_sheets,
        "sheet_area_mm2": one.sheet_area,
        "cost": one.cost,
        "utilisation_percent": 100.0 * one.utilisation,
        "utilisation_of_used_percent": 100.0 * one.utilisation_of_used,
        "used_length_of_last_mm": one.used_length,
        "placed": one.n_placed,
        "unplaced": {part.name: left for part, left in zip(one.parts, one.unplaced, strict=True) if left},
        "layouts": [
            {
                "sheets": layout.count,
                "sheet": one.stock_of(layout).name,
                "price": one.stock_of(layout).price,
                "parts": _parts(one, layout),
                "file": files[i] if files else None,
            }
            for i, layout in enumerate(one.layouts)
        ],
    }


def _parts(one: Nest, layout: Layout) -> dict[str, int]:
    found = Counter(placement.part for placement in layout.placements)
    named: Counter[str] = Counter()
    for number in sorted(found):
        named[one.parts[number].name] += found[number]
    return dict(named)


def print_nests(outcome: NestOutcome, console: Console) -> None:
    """Print the variants, the files written and the issues; names from files are printed literally."""
    from rich.table import Table
    from rich.text import Text

    first = outcome.nests[0]
    parts = count(sum(part.quantity for part in first.parts), "part")
    for issue in outcome.issues:
        if issue.missing is not None:
            console.print(Text(clean(f"missing: {issue}"), "bold red"), soft_wrap=True)
    spaced = f"{outcome.spacing:g} mm apart, {outcome.margin:g} mm from the edge"
    console.print(Text(clean(f"{parts} on sheets of {_sizes(first)}, {spaced}")), soft_wrap=True)
    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column("variant")
    for title in (*(["cost"] if first.priced else []), "sheets", "used of the last", "utilisation", "of what is used"):
        table.add_column(title, justify="right", no_wrap=True)
    for number, one in enumerate(outcome.nests, 1):
        shares = (f"{100.0 * share:.1f} %" for share in (one.utilisation, one.utilisation_of_used))
        cost = [] if one.cost is None else [f"{one.cost:,.2f}"]
        table.add_row(
            f"{number} by {one.method}, seed {one.seed}", *cost, str(one.n_sheets), f"{one.used_length:.0f} mm", *shares
        )
    console.print(table)
    for line in _lines(outcome):
        console.print(Text(clean(line)), soft_wrap=True)


def _sizes(one: Nest) -> str:
    """Describe the kinds of sheet: ``3000 × 1500 mm``, or the numbers taken of each."""
    if len(one.stocks) == 1:
        return f"{one.stocks[0].length:g} × {one.stocks[0].width:g} mm"
    taken: Counter[int] = Counter()
    for layout in one.layouts:
        taken[layout.stock] += layout.count
    each = []
    for k, stock in enumerate(one.stocks):
        there = "" if stock.count is None else f" of {stock.count}"
        price = "" if stock.price is None else f" at {stock.price:g}"
        each.append(f"{stock.name} ({taken[k]}{there} taken{price})")
    return ", ".join(each)


def _lines(outcome: NestOutcome) -> Iterator[str]:
    for one, files in _with_files(outcome):
        for layout, file in zip(one.layouts, files, strict=False):
            of = f" of {one.stock_of(layout).name}" if len(one.stocks) > 1 else ""
            parts = count(len(layout.placements), "part")
            yield f"{file}: {parts}, cut {count(layout.count, 'sheet')}{of} like this"
    for rest in outcome.remnants:
        size = f"{rest.stock.length:.0f} × {rest.stock.width:.0f} mm, {rest.stock.area / 1e6:.3f} m²"
        yield f"{rest.file}: {count(rest.count, 'remnant')} of {size}"
    if not any(outcome.files):
        yield "not written: name a file for the sheet, -o FILE.dxf"
    if outcome.defaults:
        yield f"of your defaults: {', '.join(outcome.defaults)}"
    for issue in outcome.issues:
        if issue.missing is None:
            yield f"{'warning: ' if issue.severity is Severity.WARNING else ''}{issue}"
