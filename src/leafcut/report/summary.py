"""Print the summary on the terminal: the proof, facts for the operator, times before and after, and issues."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from leafcut.model.issue import LIMITS, Issue, Severity, missing_work_text
from leafcut.options.option_spec import flag_name
from leafcut.options.search import AcoOptions, FireflyOptions, SolveOptions
from leafcut.report.wording import (
    MOTION,
    IssueGroup,
    fact_heading,
    fact_line,
    group_issues,
    replace_unprintable,
    title_words,
    verification_limits,
)

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
    from leafcut.report.path_report import PathReport

#: Maximum number of different issues. Issues about motion and machine do not count. The report page lists all issues.
MAX_ISSUES = 12
MAX_CHARACTERS = 219
#: Maximum number of columns with normal spacing. Wider tables use a narrower spacing.
_FEW_COLUMNS = 5
_WORST = (Severity.DANGER, Severity.MISSING)


def summary_renderable(report: PathReport[Any]) -> RenderableType:
    """Create the summary for `rich`: part and machine, facts, a table of the orders, and issues.

    The summary fits into 80 columns, and does not depend on colours. Names from files are printed verbatim, never as
    markup.
    """
    outcome = report.outcome
    parts: list[RenderableType] = [
        *_worst_issue_lines(outcome),
        _title_lines(report),
        "",
        _facts_table(report),
        "",
        _orders_table(report),
    ]
    if any(issue.code not in LIMITS for issue in _other_issues(outcome)):
        parts += ["", _issues_table(outcome)]
    return Group("", *parts, "")


def print_summary(report: PathReport[Any], console: Console) -> None:
    """Print the summary on the terminal."""
    console.print(summary_renderable(report))


def _worst_issue_lines(outcome: Outcome) -> list[RenderableType]:
    issues = [issue for severity in _WORST for issue in outcome.issues if issue.severity is severity]
    lines = [Text(f"{i.severity}: {replace_unprintable(str(i))}", "bold red", overflow="fold") for i in issues]
    return [*lines, ""] if lines else []


def _other_issues(outcome: Outcome) -> list[Issue]:
    return [issue for issue in outcome.issues if issue.severity not in _WORST]


def _title_lines(report: PathReport[Any]) -> Text:
    outcome = report.outcome
    machine = f"{replace_unprintable(outcome.machine.name)} ({replace_unprintable(outcome.dialect)})"
    name = (replace_unprintable(outcome.part.name), "bold")
    return Text.assemble(name, f" · {title_words(report.facts)}", "\n", (machine, "dim"), overflow="fold")


def _orders_table(report: PathReport[Any]) -> Table:
    (titles, _), *rows = report.summary_rows()
    has_many = len(titles) > _FEW_COLUMNS
    table = Table(box=None, padding=(0, 2 if has_many else 3, 0, 0), header_style="dim", pad_edge=False)
    table.add_column(titles[0], no_wrap=has_many)
    for title in titles[1:]:
        table.add_column(title, justify="right", no_wrap=True)
    for cells, is_leafcut in rows:
        table.add_row(*(Text(cell, "bold green" if is_leafcut else "") for cell in cells))
    return table


def _facts_table(report: PathReport[Any]) -> Table:
    outcome = report.outcome
    verified = Text(f"yes, {report.found}", "green") if outcome.verified else Text("no", "bold red")
    if outcome.missing:
        verified.append(f"; missing: {replace_unprintable(missing_work_text(outcome.issues))}", "bold red")
    facts: list[tuple[str, Text]] = [("verified", verified)]
    facts += [(name, Text(words, "yellow")) for name, words in verification_limits(_other_issues(outcome))]
    facts += [
        (fact_heading(fact.name), Text(replace_unprintable(fact_line(fact))))
        for fact in report.facts
        if fact.name and (not fact.of_search or _user_set_search_options(outcome))
    ]
    facts += [(name, Text(words)) for name, words in (outcome.part.zero.facts() if outcome.part.zero else [])]
    facts += [
        (name, Text(replace_unprintable(place), "cyan", overflow="fold"))
        for name, place in (("program", outcome.output), ("report", outcome.report))
        if place
    ]
    if outcome.defaults:
        facts.append(("defaults", Text(replace_unprintable(", ".join(outcome.defaults)))))
    if not outcome.output:
        facts.append(("program", Text("not written")))
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, words in facts:
        table.add_row(name, words)
    return table


def _user_set_search_options(outcome: Outcome) -> bool:
    """Return whether the user set an option of the search. If not, the summary omits the facts about the search."""
    groups = (SolveOptions, AcoOptions, FireflyOptions)
    names = {flag_name(name).removeprefix("--") for group in groups for name in group.specs()}
    return any(flag.removeprefix("--").removeprefix("no-") in names for flag in outcome.options)


def _issue_row(group: IssueGroup) -> tuple[str, str]:
    """Return the code of an issue and the start of its message. Issues with the same values share a row."""
    head, colon, _ = group.message.partition(": ")
    return group.code, head + colon if group.severity is Severity.NOTE and colon else group.message


def _issues_table(outcome: Outcome) -> Table:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, min_width=4)
    table.add_column(overflow="fold")
    groups = group_issues((i for i in _other_issues(outcome) if i.code not in LIMITS), by_message=True)
    folded = [g for g in groups[MAX_ISSUES:] if not g.code.startswith(MOTION)]
    for (code, head), row in groupby((g for g in groups if g not in folded), _issue_row):
        words = Text()
        for group in row:
            style = "yellow" if group.severity is Severity.WARNING else "dim"
            number = f"{group.number:,} × " if group.number > 1 else ""
            place = f" ({group.place})" if group.place else ""
            message = f"; {group.message.removeprefix(head)}" if words else group.message
            text = Text.assemble((number, "dim"), message, (place, "dim"))
            # The end of a message states the remedy, so only messages of more than three lines are truncated.
            text.truncate(MAX_CHARACTERS, overflow="ellipsis")
            words.append_text(text)
        table.add_row(Text(code, style), words)
    rest = sum(group.number for group in folded)
    if rest:
        table.add_row("", Text(f"+ {rest:,} more", "dim"))
    return table
