"""What was measured, kept as it is written: one line of JSON for every section that a script wrote into docs/.

    python benchmarks/history.py                     the sections there are, and how often each was measured
    python benchmarks/history.py tsplib              its last two records side by side
    python benchmarks/history.py tsplib --last 4     its last four
    python benchmarks/history.py import PAGE         keep what a page holds that is not kept yet

A record holds the section's name and title, date, machine, versions with the commit, command, and the tables as they
are on the page. The figures stay texts: a range or a note belongs to its number.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any

#: Where scripts keep what they write into the pages of docs/.
HISTORY = Path(__file__).with_name("history.jsonl")
DOCS = Path(__file__).parents[1] / "docs"

_FACTS = ("date", "machine", "versions", "command")
_RULE = re.compile(r"[-: |]+")
_SECTION = re.compile(r"<!-- (?P<name>.+?): begin -->\n(?P<text>.*?)\n<!-- (?P=name): end -->", re.DOTALL)

Record = dict[str, Any]


def record_of(name: str, text: str) -> Record:
    """Return the record of a section of a page."""
    found = {key: re.search(rf"^\* {key.title()}: (.*)$", text, re.MULTILINE) for key in _FACTS}
    title = re.search(r"^#+ (.*)$", text, re.MULTILINE)
    facts = {key: match[1].strip("`") if match else "" for key, match in found.items()}
    commit = re.search(r", commit (\S+)$", facts["versions"])
    version = re.search(r"\bleafcut (\S+?)(?:,|$)", facts["versions"])
    return {
        "section": name,
        "title": title[1] if title else name,
        "date": facts["date"],
        "version": version[1] if version else "",
        "commit": commit[1] if commit else "",
        "machine": facts["machine"],
        "versions": facts["versions"],
        "command": facts["command"],
        "tables": list(_tables(text)),
    }


def _tables(text: str) -> Iterator[dict[str, Any]]:
    """Yield the tables of a text in Markdown: head and rows."""
    for is_table, lines in groupby(text.splitlines(), key=lambda line: line.startswith("|")):
        cells = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines] if is_table else []
        if len(cells) > 1 and _RULE.fullmatch(" ".join(cells[1])):
            yield {"head": cells[0], "rows": cells[2:]}


def keep(name: str, text: str, history: Path = HISTORY) -> None:
    """Add the record of a section at the end of the history; what is there already is not added again."""
    record = record_of(name, text)
    if record["tables"] and record not in records(history):
        with history.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record, ensure_ascii=False) + "\n")


def records(history: Path = HISTORY) -> list[Record]:
    """Return all that is kept, the oldest first."""
    if not history.exists():
        return []
    return [json.loads(line) for line in history.read_text(encoding="utf-8").splitlines() if line]


def import_page(page: Path, history: Path = HISTORY) -> None:
    """Keep every section of a page."""
    for match in _SECTION.finditer(page.read_text(encoding="utf-8")):
        keep(match["name"], match["text"], history)


def side_by_side(some: Sequence[Record]) -> str:
    """Return records of one section beside each other: for each row and column a line, and a column for each record."""
    lines = [["", *(f"{r['date']} {r['commit']}".strip() for r in some)], ["machine", *(r["machine"] for r in some)]]
    lines += [["versions", *(r["versions"] for r in some)]] if len({r["versions"] for r in some}) > 1 else []
    figures = [dict(_figures(record)) for record in some]
    for key in dict.fromkeys(key for each in figures for key in each):
        lines.append([key, *(each.get(key, "") for each in figures)])
    widths = [max(map(len, column)) for column in zip_longest(*lines, fillvalue="")]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines)


def _figures(record: Record) -> Iterator[tuple[str, str]]:
    """Yield (row and column, figure); of rows with the same first cell the second one is told by a number."""
    several = len(record["tables"]) > 1
    for number, table in enumerate(record["tables"], 1):
        seen: dict[str, int] = {}
        for row in table["rows"]:
            seen[row[0]] = seen.get(row[0], 0) + 1
            name = row[0] if seen[row[0]] == 1 else f"{row[0]} ({seen[row[0]]})"
            for title, cell in zip(table["head"][1:], row[1:], strict=False):
                yield f"{f'{number}: ' if several else ''}{name} · {title}", cell


def main(arguments: Sequence[str] | None = None) -> int:
    """Show what is kept; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("section", nargs="?", help="a section of the page, or 'import'")
    parser.add_argument("page", nargs="?", type=Path, default=DOCS / "benchmarks.md", help="what is imported")
    parser.add_argument("--last", type=int, default=2, help="how many records (default 2)")
    parser.add_argument("--history", type=Path, default=HISTORY, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.section == "import":
        import_page(given.page, given.history)
        return 0
    kept = records(given.history)
    names = sorted({record["section"] for record in kept})
    if given.section is None:
        for name in names:
            mine = [record for record in kept if record["section"] == name]
            print(f"{name:24} {len(mine):3} since {mine[0]['date']}, last {mine[-1]['date']} {mine[-1]['commit']}")
        return 0
    mine = [record for record in kept if record["section"] == given.section]
    if not mine:
        print(f"unknown section '{given.section}'; choose one of {', '.join(names) or 'none yet'}", file=sys.stderr)
        return 2
    print(side_by_side(mine[-max(given.last, 1) :]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
