"""The result of `leafcut nest` as JSON, and as a summary on the terminal."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from leafcut.model.issue import Severity
from leafcut.model.nest import Layout, Nest, NestOutcome, Stock
from leafcut.report.json_answer import issues_as_json, missing_as_json
from leafcut.report.wording import count_text, replace_unprintable

if TYPE_CHECKING:
    from rich.console import Console


def nest_as_json(outcome: NestOutcome) -> dict[str, Any]:
    """Return the outcome as plain values, with the best variant first. Lengths are in mm, and shares in percent."""
    first = outcome.nests[0]
    return {
        "sheet": {"length_mm": first.stocks[0].length, "width_mm": first.stocks[0].width},
        "sheets": [_stock_as_json(stock) for stock in first.stocks],
        "parts": sum(part.quantity for part in first.parts),
        "spacing_mm": outcome.spacing,
        "margin_mm": outcome.margin,
        "variants": [_variant_as_json(nest, files) for nest, files in _nests_with_files(outcome)],
        "remnants": [
            {
                **_stock_as_json(remnant.stock),
                "count": remnant.count,
                "area_mm2": remnant.stock.area,
                "file": remnant.file,
            }
            for remnant in outcome.remnants
        ],
        "dropped": list(outcome.dropped),
        "verified": True,
        "missing": missing_as_json(outcome.missing),
        "seconds": outcome.seconds,
        "issues": issues_as_json(outcome.issues),
        **({"defaults": list(outcome.defaults)} if outcome.defaults else {}),
    }


def _stock_as_json(stock: Stock) -> dict[str, Any]:
    return {
        "name": stock.name,
        "length_mm": stock.length,
        "width_mm": stock.width,
        "count": stock.count,
        "price": stock.price,
    }


def _nests_with_files(outcome: NestOutcome) -> Iterator[tuple[Nest, tuple[str, ...]]]:
    return ((nest, outcome.files[i] if i < len(outcome.files) else ()) for i, nest in enumerate(outcome.nests))


def _variant_as_json(nest: Nest, files: tuple[str, ...]) -> dict[str, Any]:
    return {
        "method": nest.method,
        "seed": nest.seed,
        "repeatable": nest.repeatable,
        "sheets": nest.n_sheets,
        "sheet_area_mm2": nest.sheet_area,
        "cost": nest.cost,
        "utilisation_percent": 100.0 * nest.utilisation,
        "utilisation_of_used_percent": 100.0 * nest.utilisation_of_used,
        "used_length_of_last_mm": nest.used_length,
        "placed": nest.n_placed,
        "unplaced": {part.name: missing for part, missing in zip(nest.parts, nest.unplaced, strict=True) if missing},
        "layouts": [
            {
                "sheets": layout.count,
                "sheet": nest.stock_of(layout).name,
                "price": nest.stock_of(layout).price,
                "parts": _part_counts(nest, layout),
                "file": files[i] if files else None,
            }
            for i, layout in enumerate(nest.layouts)
        ],
    }


def _part_counts(nest: Nest, layout: Layout) -> dict[str, int]:
    counts_by_part = Counter(placement.part for placement in layout.placements)
    counts_by_name: Counter[str] = Counter()
    for number in sorted(counts_by_part):
        counts_by_name[nest.parts[number].name] += counts_by_part[number]
    return dict(counts_by_name)


def print_nests(outcome: NestOutcome, console: Console) -> None:
    """Print the table of variants, the files that were written, and the issues.

    File names are printed without markup.
    """
    from rich.table import Table
    from rich.text import Text

    first = outcome.nests[0]
    parts = count_text(sum(part.quantity for part in first.parts), "part")
    for issue in outcome.issues:
        if issue.missing is not None:
            console.print(Text(replace_unprintable(f"missing: {issue}"), "bold red"), soft_wrap=True)
    spaced = f"{outcome.spacing:g} mm apart, {outcome.margin:g} mm from the edge"
    console.print(
        Text(replace_unprintable(f"{parts} on sheets of {_used_sheets_text(first)}, {spaced}")), soft_wrap=True
    )
    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column("variant", min_width=len("1 by rectangles,"))  # the table fits into 80 columns
    for title in (
        *(["cost"] if first.priced else []),
        "sheets",
        "used length\nof the last",
        "parts cover,\nall sheets",
        "parts cover,\nused length",
    ):
        table.add_column(title, justify="right", no_wrap=True)
    for number, nest in enumerate(outcome.nests, 1):
        shares = (f"{100.0 * share:.1f} %" for share in (nest.utilisation, nest.utilisation_of_used))
        cost = [] if nest.cost is None else [f"{nest.cost:,.2f}"]
        table.add_row(
            f"{number} by {nest.method}, seed {nest.seed}",
            *cost,
            str(nest.n_sheets),
            f"{nest.used_length:.0f} mm",
            *shares,
        )
    console.print(table)
    for line in _file_lines(outcome):
        console.print(Text(replace_unprintable(line)), soft_wrap=True)


def _used_sheets_text(nest: Nest) -> str:
    if len(nest.stocks) == 1:
        return f"{nest.stocks[0].length:g} × {nest.stocks[0].width:g} mm"
    used: Counter[int] = Counter()
    for layout in nest.layouts:
        used[layout.stock] += layout.count
    descriptions = []
    for k, stock in enumerate(nest.stocks):
        available = "" if stock.count is None else f" of {stock.count}"
        price = "" if stock.price is None else f" at {stock.price:g}"
        descriptions.append(f"{stock.name} ({used[k]}{available} taken{price})")
    return ", ".join(descriptions)


def _file_lines(outcome: NestOutcome) -> Iterator[str]:
    for nest, files in _nests_with_files(outcome):
        for layout, file in zip(nest.layouts, files, strict=False):
            kind = f" of {nest.stock_of(layout).name}" if len(nest.stocks) > 1 else ""
            parts = count_text(len(layout.placements), "part")
            yield f"{file}: {parts}, cut {count_text(layout.count, 'sheet')}{kind} like this"
    for remnant in outcome.remnants:
        size = f"{remnant.stock.length:.0f} × {remnant.stock.width:.0f} mm, {remnant.stock.area / 1e6:.3f} m²"
        yield f"{remnant.file}: {count_text(remnant.count, 'remnant')} of {size}"
    best = outcome.files[0] if outcome.files else ()
    if not any(outcome.files):
        yield "not written"
    elif best != ("standard output",):
        yield f"next: leafcut cut {shlex.join(best)} --thickness …"
    if outcome.defaults:
        yield f"of your defaults: {', '.join(outcome.defaults)}"
    for issue in outcome.issues:
        if issue.missing is None:
            yield f"{'warning: ' if issue.severity is Severity.WARNING else ''}{issue}"
