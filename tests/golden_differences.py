"""Golden differences: all that a proof finds in a damaged program, word for word.

After a change that is meant: LEAFCUT_WRITE_GOLDEN=1 pytest -n 0 with the tests that use it, and look at the diff.
Several workers would overwrite the changes of each other.
"""

from __future__ import annotations

import functools
import os
import tomllib
from collections.abc import Iterable
from pathlib import Path

FOLDER = Path(__file__).parent / "golden"


@functools.cache
def golden(file: str) -> dict[str, dict[str, list[str]]]:
    """Return the tables of a golden file: name of the damage → differences."""
    path = FOLDER / file
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def check_golden(file: str, table: str, name: str, differences: Iterable[object]) -> None:
    """Compare the differences that a proof found, or its refusal, with the golden ones."""
    texts = [str(difference) for difference in differences]
    tables = golden(file)
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        tables.setdefault(table, {})[name] = texts
        (FOLDER / file).write_text(as_toml(tables), encoding="utf-8")
    assert tables[table][name] == texts


def as_toml(tables: dict[str, dict[str, list[str]]]) -> str:
    """Return tables of lists of texts, one text on each line."""
    lines: list[str] = []
    for table, lists in tables.items():
        lines.append(f"[{quoted(table)}]")
        for name, texts in lists.items():
            lines += [f"{quoted(name)} = [", *(f"    {quoted(text)}," for text in texts), "]"]
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """Return a text as a TOML string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r") + '"'
