"""The report of a batch: one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leafcut.report.wording import NO_VALUE, count, percent_words, time_words


def batch_page(rows: Sequence[Mapping[str, Any]], version: str) -> str:
    """Return the page of a batch; `rows` are those of its table, by name."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    from leafcut.report.colours import drawing_css, style_sheet

    environment = Environment(
        loader=PackageLoader("leafcut.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["drawn"] = Markup  # our own style sheets
    done = [row for row in rows if row["state"] == "written"]
    timed = [row for row in done if row["before_s"] and row["after_s"]]
    before, after = (sum(float(row[name]) for row in timed) for name in ("before_s", "after_s"))
    saved = 100.0 * (1.0 - after / before) if before else None
    state = [f"{count(len(done), 'program')} written"]
    if len(done) < len(rows):
        state.append(f"{len(rows) - len(done)} refused")
    return environment.get_template("batch.html.jinja").render(
        css=drawing_css() + style_sheet("page.css"),
        version=version,
        state=state,
        refused=[row for row in rows if row["state"] != "written"],
        rows=[_cells(row) for row in done],
        total=[
            time_words(before),
            time_words(after),
            percent_words(saved),
        ],
    )


def _cells(row: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    times = [time_words(float(row[name])) if row[name] else NO_VALUE for name in ("before_s", "after_s")]
    saved = percent_words(float(row["saved_percent"])) if row["saved_percent"] else NO_VALUE
    issues = f"{count(int(row['issues']), 'issue')}, worst: {row['worst']}" if row["worst"] else "none"
    return (str(row["input"]), *times, saved, issues)  # type: ignore[return-value]
