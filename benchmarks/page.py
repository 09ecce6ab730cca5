"""Result pages: a benchmark that is run with `--write` writes docs/results/NAME.md."""

from __future__ import annotations

import argparse
import os
import platform
import re
import shlex
import subprocess
from collections.abc import Callable, Collection, Iterable, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from itertools import takewhile
from pathlib import Path

from benchmarks import ROOT
from leafcut.files.whole_files import write_whole

RESULTS = ROOT / "docs" / "results"

#: Columns of text, which are left-aligned; all other columns contain numbers and are right-aligned.
TEXT_COLUMNS = (
    "answer", "board", "budget", "chip", "drawing", "judged", "note", "program", "run", "solver", "state", "what runs",
    "work",
)  # fmt: skip


def parser(name: str, doc: str | None, *, writes: bool = True) -> argparse.ArgumentParser:
    """Return the argument parser of a benchmark; `doc` is its docstring.

    `writes` is true if the benchmark has a results page.
    """
    made = argparse.ArgumentParser(
        prog=f"python -m benchmarks {name}", description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    if writes:
        made.add_argument("--write", action="store_true", help=f"write the results to docs/results/{name}.md")
    return made


def one_of(names: Collection[str]) -> Callable[[str], str]:
    """Return an argument type that accepts only these names.

    Before Python 3.12, `choices` in argparse refuses an empty list of names.
    """

    def taken(name: str) -> str:
        if name not in names:
            raise argparse.ArgumentTypeError(f"{name!r} is not one of {', '.join(names)}")
        return name

    return taken


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    rules = ["---" if title in TEXT_COLUMNS else "---:" for title in head]
    lines = ["| " + " | ".join(line) + " |" for line in (head, rules)]
    return "\n".join([*lines, *("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in rows)])


def rows_of(text: str) -> list[list[str]]:
    """Return the rows of the first table in a page, without its header."""
    lines = text[text.index("| ") :].splitlines() if "| " in text else []
    rows = [re.split(r" \| ", line[2:-2]) for line in takewhile(lambda line: line.startswith("| "), lines)]
    return rows[2:]


def facts(name: str, argv: Sequence[str], packages: Sequence[str]) -> str:
    """Return the date, machine, versions and command of a run."""
    load = f", load average {os.getloadavg()[0]:.1f} at the end" if hasattr(os, "getloadavg") else ""
    versions = [f"Python {platform.python_version()}", *(f"{package} {_version(package)}" for package in packages)]
    lines = [
        f"* Date: {datetime.now(UTC):%Y-%m-%d}",
        f"* Machine: {_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}{load}",
        f"* Versions: {', '.join(versions)}{_commit()}",
        f"* Command: `{shlex.join(['python', '-m', 'benchmarks', name, *argv])}`",
    ]
    return "\n".join(lines)


def publish(name: str, text: str, write: bool) -> None:
    """Print the results and, if `write`, write them to docs/results/NAME.md."""
    print(text)
    if write:
        RESULTS.mkdir(exist_ok=True)
        write_whole(RESULTS / f"{name}.md", f"{text.strip()}\n")


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """Return the commit that is measured, or an empty text outside a repository."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f", commit {done.stdout.strip()}"
