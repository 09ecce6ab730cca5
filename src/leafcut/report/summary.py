"""The summary on the terminal: what there was, what there is now, and whether to trust it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut.model.issue import Severity
from leafcut.model.outcome import Outcome
from leafcut.processes.pocket.report.pocket_words import (
    STRATEGY_TITLES,
    chosen_words,
    pocket_counts_words,
    strategy_cells,
)
from leafcut.processes.pocket.report.pocket_words import facts as pocket_facts
from leafcut.processes.pocket.report.pocket_words import figures as strategy_figures
from leafcut.processes.sheet.report.cut_words import cut_counts_words, norm_facts
from leafcut.report.wording import (
    NO_VALUE,
    bound_words,
    clean,
    counts_words,
    group_issues,
    length_words,
    method_words,
    order_words,
    percent_words,
    saved_percent,
    staying_words,
    time_words,
)

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

#: So many different issues are named; the report page has them all.
MOST_ISSUES = 12
#: So many reasons why pieces of a program stay.
MOST_REASONS = 6
MOST_CHARACTERS = 219
_WORST = (Severity.DANGER, Severity.MISSING)


def summary(outcome: Outcome) -> RenderableType:
    """Return what `rich` prints: part and machine, a table of the three orders, facts, issues. Fits 80 columns.

    Colour only underlines what the words say; names from files are printed as they are, never as markup.
    """
    from rich.console import Group

    table = _strategies(outcome) if outcome.pocket_plans else _orders(outcome)
    parts: list[RenderableType] = [*_worst(outcome), _title(outcome), "", table, "", _facts(outcome)]
    if any(issue.severity not in _WORST for issue in outcome.issues):
        parts += ["", _issues(outcome)]
    return Group("", *parts, "")


def print_summary(outcome: Outcome, console: Console) -> None:
    """Print the summary on a console of `rich`."""
    console.print(summary(outcome))


def _worst(outcome: Outcome) -> list[RenderableType]:
    """Return what is dangerous in the program, and what is missing from it, before anything else is said."""
    from rich.text import Text

    found = [issue for severity in _WORST for issue in outcome.issues if issue.severity is severity]
    lines = [Text(f"{i.severity}: {clean(str(i))}", "bold red", overflow="fold") for i in found]
    return [*lines, ""] if lines else []


def _title(outcome: Outcome) -> Text:
    from rich.text import Text

    machine = f"{clean(outcome.machine.name)} ({clean(outcome.dialect)})"
    if outcome.pocket_plans:
        counts = pocket_counts_words(outcome)
    else:
        counts = counts_words(outcome) if outcome.cut_plan is None else cut_counts_words(outcome.cut_plan)
    return Text.assemble((clean(outcome.part.name), "bold"), "\n", (f"{counts} · {machine}", "dim"), overflow="fold")


def _orders(outcome: Outcome) -> Table:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column("order")
    # Of a sheet the ways from cut to cut are said, as in its plan; its travel would count every rise and descent.
    for title in ("between" if outcome.norms else "travel", "cutting", "time", "saved"):
        table.add_column(title, justify="right", no_wrap=True)
    before, nearest, after = outcome.stated
    rows = (
        (order_words(outcome), before, ""),
        ("nearest neighbour", nearest, ""),
        ("leafcut", after, "bold green"),
    )
    for name, measure, style in rows:
        if measure is None:
            continue
        saved = NO_VALUE if measure is before else percent_words(saved_percent(outcome, measure))
        lengths = (length_words(measure.travel_mm), length_words(measure.cut_mm))
        figures = (*lengths, time_words(measure.time_s), saved)
        table.add_row(Text(name, style), *(Text(f, style) for f in figures))
    return table


def _strategies(outcome: Outcome) -> Table:
    """Return every strategy over one level, and why some are not possible."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", pad_edge=False)
    table.add_column("one level", no_wrap=True)
    for title in STRATEGY_TITLES:
        table.add_column(title, justify="right", no_wrap=True)
    for row in strategy_figures(outcome.pocket_plans, outcome.pocket_programs):
        if row.measures is None:
            continue
        style = "bold green" if row.chosen else ""
        table.add_row(Text(row.name, style), *(Text(cell, style) for cell in strategy_cells(row)))
    return table


def _facts(outcome: Outcome) -> Table:
    from rich.table import Table
    from rich.text import Text

    work = "the work that was planned" if outcome.certificate is None else "the same work as the original"
    verified = Text(f"yes, read back{' and simulated' if outcome.pocket_plans else ''}: it does {work}", "green")
    facts: list[tuple[str, Text]] = [
        ("verified", verified if outcome.verified else Text("no", "bold red")),
    ]
    if outcome.cut_plan is not None:
        facts += [(name, Text(clean(words))) for name, words in norm_facts(outcome.cut_plan)]
    if outcome.pocket_plans:
        facts += [("program", Text(f"{time_words(outcome.after.time_s)} by {chosen_words(outcome)}", "bold"))]
        facts += [(name, Text(clean(words))) for name, words in pocket_facts(outcome)]
        facts += [
            (row.name, Text(f"not possible: {clean(row.refused)}", "dim"))
            for row in strategy_figures(outcome.pocket_plans, outcome.pocket_programs)
            if row.measures is None
        ]
    elif outcome.gap is not None:
        facts.append(("gap", Text(bound_words(outcome))))
    head, *reasons = staying_words(outcome, MOST_REASONS) or [""]
    if head:
        facts.append(("stays", Text(f"{head}: {'; '.join(reasons)}")))
    if outcome.operations and not outcome.pocket_plans:
        facts.append(("method", Text(method_words(outcome))))
    facts += [
        (name, Text(clean(place), "cyan", overflow="fold"))
        for name, place in (
            ("file", outcome.output) if outcome.pocket_plans else ("program", outcome.output),
            ("report", outcome.report),
        )
        if place
    ]
    if outcome.defaults:
        facts.append(("defaults", Text(clean(", ".join(outcome.defaults)))))
    if not outcome.output:
        facts.append(("program", Text("not written: name a file for it, -o FILE")))
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, words in facts:
        table.add_row(name, words)
    return table


def _issues(outcome: Outcome) -> Table:
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, min_width=4)
    table.add_column(overflow="fold")
    groups = group_issues((i for i in outcome.issues if i.severity not in _WORST), by_message=True)
    for group in groups[:MOST_ISSUES]:
        style = "yellow" if group.severity is Severity.WARNING else "dim"
        number = f"{group.number:,} × " if group.number > 1 else ""
        place = f" ({group.place})" if group.place else ""
        words = Text.assemble((number, "dim"), group.message, (place, "dim"))
        # The end of a message says what to do, so it is cut only when it is longer than three lines.
        words.truncate(MOST_CHARACTERS, overflow="ellipsis")
        table.add_row(Text(group.code, style), words)
    rest = sum(group.number for group in groups[MOST_ISSUES:])
    if rest:
        table.add_row("", Text(f"+ {rest:,} more", "dim"))
    return table
