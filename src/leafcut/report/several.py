"""Report the results for several inputs, as a table on the terminal or as a JSON object."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from leafcut.report.wording import NO_VALUE, count_text, length_words, percent_words, replace_unprintable, time_words

#: Severities that the table reports, starting with the worst.
_SEVERITIES = ("danger", "missing", "warning")


def batch_as_json(rows: Sequence[dict[str, Any]], status: int) -> dict[str, Any]:
    """Combine the answers for several inputs.

    ``runs`` lists the answers, and ``status`` is the worst exit status.
    """
    return {"runs": list(rows), "failed": sum("error" in row for row in rows), "status": status}


def print_batch(rows: Sequence[tuple[Mapping[str, Any], dict[str, Any]]], folder: str | None, console: Console) -> None:
    """Print the result for each of several inputs, and the folder that contains the programs.

    Each entry of `rows` contains the row of an input in the batch table, and the ``--json`` answer for the input.
    """
    table = _empty_table("input", "before", "leafcut", "saved", "verified")
    total = [0.0, 0.0]
    for row, answer in rows:
        if "error" in answer:
            _add_row(table, row["input"], [NO_VALUE, NO_VALUE, NO_VALUE], "refused", "bold red")
            continue
        times = [float(row["before_s"] or 0.0), float(row["after_s"] or 0.0)]
        total = [a + b for a, b in zip(total, times, strict=True)]
        missing = sum(work["count"] for work in answer.get("missing", ()))
        worst = _worst_issues(answer.get("issues", ()), missing)
        words = "; ".join(filter(None, ["yes, in an earlier run" if answer.get("done_before") else "yes", worst]))
        saved = percent_words(float(row["saved_percent"])) if row["saved_percent"] else NO_VALUE
        _add_row(
            table,
            row["input"],
            [*map(time_words, times), saved],
            words,
            "bold red" if missing else "yellow" if worst else "",
        )
    done = [(row, answer) for row, answer in rows if "error" not in answer]
    if len(done) > 1:
        saved_in_all = 100.0 * (1.0 - total[1] / total[0]) if total[0] > 0.0 else None
        _add_row(table, f"{len(done)} in all", [*map(time_words, total), percent_words(saved_in_all)], "", "bold")
    lines = _defaults_lines([answer for _, answer in done])
    written = [row["program"] for row, _ in done if row["state"] == "written"]
    if folder:
        lines.append(f"programs  {count_text(len(written), 'file')} in {folder}, with batch.csv and batch.html")
    elif written:
        lines.append(f"programs  {count_text(len(written), 'file')} beside the inputs")
    elif done:
        lines.append("programs  not written (--dry-run)")
    answers = [answer for _, answer in rows]
    _print_table_and_lines(table, lines, answers, console, "input")


def print_simulations(rows: Sequence[dict[str, Any]], console: Console) -> None:
    """Print the times and dangers of several simulated programs."""
    table = _empty_table("program", "time", "rapid", "feed", "issues")
    total = 0.0
    for row in rows:
        if "error" in row:
            _add_row(table, row["program"], [NO_VALUE, NO_VALUE, NO_VALUE], "refused", "bold red")
            continue
        total += row["time_s"]
        worst = _worst_issues(row["issues"])
        cells = [time_words(row["time_s"]), length_words(row["rapid_mm"]), length_words(row["feed_mm"])]
        _add_row(table, row["program"], cells, worst, "bold red" if "danger" in worst else "")
    done = [row for row in rows if "error" not in row]
    if len(done) > 1:
        _add_row(table, f"{len(done)} in all", [time_words(total), "", ""], "", "bold")
    _print_table_and_lines(table, _defaults_lines(done), rows, console, "program")


def _defaults_lines(done: Sequence[dict[str, Any]]) -> list[str]:
    """Return a line that lists the user's defaults for any of the inputs. Each kind of input uses its own defaults."""
    options = dict.fromkeys(words for row in done for words in row.get("defaults", ()))
    return [f"defaults  {', '.join(options)}"] if options else []


def _empty_table(first: str, *columns: str) -> Table:
    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column(first, overflow="fold")
    for title in columns[:-1]:
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column(columns[-1], overflow="fold")
    return table


def _add_row(table: Table, name: str, cells: Iterable[str], last: str, style: str) -> None:
    table.add_row(*(Text(replace_unprintable(words), style) for words in (name, *cells, last)))


def _worst_issues(issues: Iterable[dict[str, str]], missing: int = 0) -> str:
    """Count the worst issues: ``2 dangers`` or ``3 missing``. Return "" if all issues are notes."""
    kinds = [issue["severity"] for issue in issues]
    worst = next((kind for kind in _SEVERITIES if kind in kinds), "")
    if worst == "missing":
        return f"{missing} missing"
    return count_text(kinds.count(worst), worst) if worst else ""


def _print_table_and_lines(
    table: Table, lines: Sequence[str], rows: Sequence[dict[str, Any]], console: Console, key: str
) -> None:
    console.print("")
    worst = [
        f"{severity}: {row[key]}: {issue['code']} {issue['message']}"
        + (f" ({issue['place']})" if issue["place"] else "")
        for severity in _SEVERITIES[:2]
        for row in rows
        for issue in row.get("issues", ())
        if issue["severity"] == severity
    ]
    for line in worst:
        console.print(Text(replace_unprintable(line), "bold red", overflow="fold"))
    if worst:
        console.print("")
    console.print(table)
    console.print("")
    failed = sum("error" in row for row in rows)
    footer = [f"refused   {count_text(failed, 'input')}, listed above", *lines] if failed else lines
    for line in footer:
        console.print(Text(replace_unprintable(line), overflow="fold"))
    if footer:
        console.print("")


def batch_page_html(rows: Sequence[Mapping[str, Any]], version: str) -> str:
    """Write the HTML page of a batch. `rows` contains the rows of the batch table as dicts."""
    from leafcut.report.styles import drawing_css, page_templates, style_sheet

    done = [row for row in rows if row["state"] == "written"]
    timed = [row for row in done if row["before_s"] and row["after_s"]]
    before, after = (sum(float(row[name]) for row in timed) for name in ("before_s", "after_s"))
    saved = 100.0 * (1.0 - after / before) if before else None
    state = [f"{count_text(len(done), 'program')} written"]
    if len(done) < len(rows):
        state.append(f"{len(rows) - len(done)} refused")
    return (
        page_templates("leafcut.report")
        .get_template("batch.html.jinja")
        .render(
            css=drawing_css() + style_sheet("page.css"),
            version=version,
            state=state,
            refused=[row for row in rows if row["state"] != "written"],
            rows=[_batch_cells(row) for row in done],
            total=[
                time_words(before),
                time_words(after),
                percent_words(saved),
            ],
        )
    )


def _batch_cells(row: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    times = [time_words(float(row[name])) if row[name] else NO_VALUE for name in ("before_s", "after_s")]
    saved = percent_words(float(row["saved_percent"])) if row["saved_percent"] else NO_VALUE
    issues = f"{count_text(int(row['issues']), 'issue')}, worst: {row['worst']}" if row["worst"] else "none"
    return (str(row["input"]), *times, saved, issues)  # type: ignore[return-value]
