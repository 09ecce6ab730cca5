"""The experiments of `leafcut lab` in full: their findings into docs/experiments.md, from a file of results.

    leafcut lab run machining_time --results all.sqlite          and every other of `leafcut lab list`
    python benchmarks/experiments.py --results all.sqlite --write docs/experiments.md

Each section says how many of its runs are done, on what machine and under what load.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from page import write_section

from leafcut.lab.description import Description
from leafcut.lab.judging import judged
from leafcut.lab.loading import load, shipped
from leafcut.lab.overviews import overview
from leafcut.lab.page import circumstances
from leafcut.lab.results import ReportBlock, Results, Table
from leafcut.lab.running import can_run, rows_of
from leafcut.lab.store import Row, Store

#: Tables of more rows are in the CSV alone.
MOST_ROWS = 36
#: What says whether every two levels differ is in the page of the report.
_PAIRS = "Differ"


def section(of: Description, rows: list[Row]) -> str:
    """Return the section of an experiment."""
    results = Results.of(of, rows)
    able = sum(can_run(of, plan) for plan in of.runs())
    state = f"{len(results.rows)} of {able} runs"
    if able < of.n_runs:
        state += f"; {of.n_runs - able} of more threads than the machine has cores are left out"
    lines = [f"## {of.title}", "", f"`leafcut lab run {of.name}`: {state}. {of.about}", "", f"After {of.source}.", ""]
    for note in of.notes:
        lines += [f"* {note}"]
    lines += [""]
    blocks = judged(results)
    if not any(table.columns[-1] != _PAIRS for block in blocks for table in block.tables):
        blocks.append(overview(results))
    for block in blocks:
        lines += shown(block)
    for one in of.published:
        head = (f"**Published**, figures of {one.source}: {one.title}.", "")
        lines += [*head, *markdown(Table(one.columns, one.rows)), "", " ".join(one.note.split()), ""]
    lines += [f"* {line}" for line in circumstances(results.rows)]
    return "\n".join(lines)


def shown(block: ReportBlock) -> list[str]:
    """Return a part of a report without its charts."""
    lines = [f"### {block.title}", ""]
    for words in block.words:
        lines += [f"* {words}"]
    lines += [""]
    for table in block.tables:
        if table.columns[-1] == _PAIRS or len(table.rows) > MOST_ROWS:
            continue
        lines += [*([f"{table.title}:", ""] if table.title else []), *markdown(table), ""]
    return lines


def markdown(table: Table) -> list[str]:
    """Return a table in Markdown."""
    rules = ["---" if k < table.texts else "---:" for k in range(len(table.columns))]
    return [
        "| " + " | ".join(word.replace("|", "/") for word in row) + " |" for row in (table.columns, rules, *table.rows)
    ]


def main() -> None:
    """Print the sections of the experiments that have results; write them into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", default=list(shipped()))
    made.add_argument("--results", type=Path, required=True)
    made.add_argument("--write", type=Path, help="the page whose sections are replaced")
    given = made.parse_args()
    with Store(given.results, read_only=True) as store:
        for name in given.names:
            of = load(name)
            rows = rows_of(of, store)
            if not rows:
                continue
            text = section(of, rows)
            if given.write:
                write_section(given.write, f"experiment_{name}", text)
            else:
                print(text)


if __name__ == "__main__":
    main()
