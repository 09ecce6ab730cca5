"""Sections of docs/benchmarks.md: each script writes its own, between marks, and leaves the others as they are."""

from __future__ import annotations

import argparse
import os
import platform
import shlex
import subprocess
from collections.abc import Callable, Collection, Iterable, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from history import DOCS, keep

from leafcut.files import write_whole

HEAD = """# Benchmarks

Every section is written by the script that it names, with `--write docs/benchmarks.md`. Every tour was checked to
visit each node once, and its length added up again by code that shares nothing with its maker.
"""


#: Columns of words, to the left; the others are figures, to the right.
WORDS = ("board", "shape", "solver", "note", "program", "work", "judged", "what stays and why", "instance")


def one_of(names: Collection[str]) -> Callable[[str], str]:
    """Return what takes one of these names from a command line, and says which there are where it is none of them.

    Before Python 3.12 `choices` of argparse refuses a list of names that is empty.
    """

    def taken(name: str) -> str:
        if name not in names:
            raise argparse.ArgumentTypeError(f"{name!r} is not one of {', '.join(names)}")
        return name

    return taken


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    rules = ["---" if title in WORDS else "---:" for title in head]
    lines = ["| " + " | ".join(line) + " |" for line in (head, rules)]
    return "\n".join([*lines, *("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in rows)])


def facts(script: str, arguments: Sequence[str], packages: Sequence[str]) -> str:
    """Return when, on what machine, with which versions and by which command the figures were made."""
    load = f", load average {os.getloadavg()[0]:.1f} at the end" if hasattr(os, "getloadavg") else ""
    versions = [f"Python {platform.python_version()}", *(f"{name} {_version(name)}" for name in packages)]
    lines = [
        f"* Date: {datetime.now(UTC):%Y-%m-%d}",
        f"* Machine: {_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}{load}",
        f"* Versions: {', '.join(versions)}{_commit()}",
        f"* Command: `{shlex.join(['python', f'benchmarks/{script}.py', *arguments])}`",
    ]
    return "\n".join(lines)


def write_section(page: Path, name: str, text: str) -> None:
    """Put `text` in place of the section `name` of a page, or at its end; make the page where there is none.

    What goes into the pages of docs/ is kept in benchmarks/history.jsonl, too.
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    whole = page.read_text(encoding="utf-8") if page.exists() else HEAD
    section = f"{begin}\n{text.strip()}\n{end}"
    before, found, rest = whole.partition(begin)
    _, closed, after = rest.partition(end)
    if found and not closed:
        raise ValueError(f"{page}: the section {name} begins and does not end")
    whole = before + section + after if found else f"{whole.rstrip()}\n\n{section}\n"
    write_whole(page, whole)
    if page.resolve().parent == DOCS:
        keep(name, text)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "processor not known"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """Return the commit that was measured, where it is known."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f", commit {done.stdout.strip()}"
