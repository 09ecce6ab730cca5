"""The answer of `leafcut nest`: as JSON, and as a summary on the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from leafcut.model.issue import Severity
from leafcut.model.nest import Layout, Nest, NestOutcome
from leafcut.report.json_answer import issues_as_json
from leafcut.report.wording import clean, count

if TYPE_CHECKING:
    from rich.console import Console

#: So many parts without a place are named on the terminal.
MOST_NAMED = 5


def nest_as_json(outcome: NestOutcome) -> dict[str, Any]:
    """Return the outcome as a dict of plain values: lengths in mm, shares in percent, the best variant first."""
    first = outcome.nests[0]
    return {
        "sheet": {"length_mm": first.length, "width_mm": first.width},
        "parts": sum(part.quantity for part in first.parts),
        "spacing_mm": outcome.spacing,
        "margin_mm": outcome.margin,
        "variants": [_variant(one, files) for one, files in _with_files(outcome)],
        "dropped": list(outcome.dropped),
        "verified": True,
        "seconds": outcome.seconds,
        "issues": issues_as_json(outcome.issues),
    }


def _with_files(outcome: NestOutcome) -> Iterator[tuple[Nest, tuple[str, ...]]]:
    return ((one, outcome.files[i] if i < len(outcome.files) else ()) for i, one in enumerate(outcome.nests))


def _variant(one: Nest, files: tuple[str, ...]) -> dict[str, Any]:
    return {
        "method": one.method,
        "seed": one.seed,
        "repeatable": one.repeatable,
        "sheets": one.n_sheets,
        "utilisation_percent": 100.0 * one.utilisation,
        "utilisation_of_used_percent": 100.0 * one.utilisation_of_used,
        "used_length_of_last_mm": one.used_length,
        "placed": one.n_placed,
        "unplaced": {part.name: left for part, left in zip(one.parts, one.unplaced, strict=True) if left},
        "layouts": [
            {"sheets": layout.count, "parts": _parts(one, layout), "file": files[i] if files else None}
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
    """Print the variants, the files written and what was noticed; names from files are printed as they are."""
    from rich.table import Table
    from rich.text import Text

    first = outcome.nests[0]
    parts = count(sum(part.quantity for part in first.parts), "part")
    size = f"{first.length:g} × {first.width:g} mm"
    console.print(
        Text(f"{parts} on sheets of {size}, {outcome.spacing:g} mm apart, {outcome.margin:g} mm from the edge")
    )
    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column("variant")
    for title in ("sheets", "used of the last", "utilisation", "of what is used"):
        table.add_column(title, justify="right", no_wrap=True)
    for number, one in enumerate(outcome.nests, 1):
        shares = (f"{100.0 * share:.1f} %" for share in (one.utilisation, one.utilisation_of_used))
        table.add_row(
            f"{number} by {one.method}, seed {one.seed}", str(one.n_sheets), f"{one.used_length:.0f} mm", *shares
        )
    console.print(table)
    for line in _lines(outcome):
        console.print(Text(clean(line)), soft_wrap=True)


def left_over(outcome: NestOutcome) -> str:
    """Return which parts the best nest has no room for, as a line; empty for none."""
    first = outcome.nests[0]
    left = [f"{n} of {part.name}" for part, n in zip(first.parts, first.unplaced, strict=True) if n]
    more = f" and {len(left) - MOST_NAMED} kinds more" if len(left) > MOST_NAMED else ""
    return f"no room for {', '.join(left[:MOST_NAMED])}{more}" if left else ""


def _lines(outcome: NestOutcome) -> Iterator[str]:
    for one, files in _with_files(outcome):
        for layout, file in zip(one.layouts, files, strict=False):
            yield f"{file}: {count(len(layout.placements), 'part')}, cut {count(layout.count, 'sheet')} like this"
    if missing := left_over(outcome):
        yield missing
    for issue in outcome.issues:
        yield f"{'warning: ' if issue.severity is Severity.WARNING else ''}{issue}"
