"""Report on the full experiments of `leafcut lab`, from a results file.

    leafcut lab run machining_time --results all.sqlite          and so on, for the names in `leafcut lab list`
    python -m benchmarks experiments --results all.sqlite

Each section states the number of finished runs, the machine and its load. `--write` replaces the sections of those
experiments that have results, and keeps the other sections.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks import page
from leafcut.lab.analysis_blocks import blocks_of_all_analyses
from leafcut.lab.description import Description
from leafcut.lab.loading import load_experiment, titles_of_included_experiments
from leafcut.lab.page import overview_block, run_environment_sentences
from leafcut.lab.published import Runs, published_blocks
from leafcut.lab.results import ReportBlock, Results, Table
from leafcut.lab.running import has_enough_cores, stored_rows
from leafcut.lab.store import Row, Store

#: Maximum number of rows of a table; `leafcut lab report` writes all rows to a CSV file.
MOST_ROWS = 36
#: Maximum number of rows of a table of published results, which are shown nowhere else on the page.
MOST_PUBLISHED = 100
#: Last column of the tables of pairwise comparisons, which only `leafcut lab report` shows.
_PAIRS = "Differ"


def section(experiment: Description, rows: list[Row]) -> str:
    """Return the section of an experiment."""
    results = Results.from_rows(experiment, rows)
    able = sum(has_enough_cores(experiment, plan) for plan in experiment.runs())
    state = f"{len(results.finished)} of {able} runs"
    if len(results.rows) > len(results.finished):
        state += f", and the search alone of {len(results.rows) - len(results.finished)}"
    if able < experiment.n_runs:
        state += f"; {experiment.n_runs - able} with more threads than cores are left out"
    about = f"`leafcut lab run {experiment.name}`: {state}. {experiment.about}"
    lines = [f"## {experiment.title}", "", about, "", f"After {experiment.source}.", ""]
    for note in experiment.notes:
        lines += [f"* {note}"]
    lines += [""]
    blocks = blocks_of_all_analyses(results)
    if not any(table.columns[-1] != _PAIRS for block in blocks for table in block.tables):
        blocks.append(overview_block(results))
    for block in blocks:
        lines += shown(block)
    for block in published_blocks({experiment.name: Runs(experiment, experiment, rows)}, "en"):
        lines += shown(block, MOST_PUBLISHED)
    lines += [f"* {line}" for line in run_environment_sentences(results.rows)]
    return "\n".join(lines)


def shown(block: ReportBlock, most_rows: int = MOST_ROWS) -> list[str]:
    """Return a report block as lines of Markdown, without its charts."""
    lines = [f"### {block.title}", ""]
    for words in block.words:
        lines += [f"* {words}"]
    lines += [""]
    for table in block.tables:
        if table.columns[-1] == _PAIRS or len(table.rows) > most_rows:
            continue
        lines += [*([f"{table.title}:", ""] if table.title else []), *markdown(table), ""]
    return lines


def markdown(table: Table) -> list[str]:
    """Return a table as lines of Markdown."""
    rules = ["---" if k < table.texts else "---:" for k in range(len(table.columns))]
    return [
        "| " + " | ".join(word.replace("|", "/") for word in row) + " |" for row in (table.columns, rules, *table.rows)
    ]


def replaced(text: str, sections: Sequence[str]) -> str:
    """Replace the sections of a page that have the same headings as the new sections; append the others at the end."""
    head, *old = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    by_heading = {part.partition("\n")[0]: part.strip() for part in (*old, *sections)}
    return "\n\n".join([head.strip(), *by_heading.values()])


def main(argv: Sequence[str]) -> int:
    """Publish the sections of all experiments that have results."""
    parser = page.parser("experiments", __doc__)
    parser.add_argument(
        "names", nargs="*", default=list(titles_of_included_experiments()), help="names of experiments (default: all)"
    )
    parser.add_argument("--results", type=Path, required=True, help="file of `leafcut lab run --results`")
    given = parser.parse_args(argv)
    sections = []
    with Store(given.results, read_only=True) as store:
        for name in given.names:
            experiment = load_experiment(name)
            rows = stored_rows(experiment, store)
            if rows:
                sections.append(section(experiment, rows))
    if not sections:
        print(f"{given.results} has no full results of these experiments", file=sys.stderr)
        return 2
    if given.write:
        before = (page.RESULTS / "experiments.md").read_text(encoding="utf-8")
        page.publish("experiments", replaced(before, sections), write=True)
    else:
        print("\n\n".join(sections))
    return 0
