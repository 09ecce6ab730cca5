"""The line of an error in a TOML file of a machine or of tools."""

from __future__ import annotations

import re
from dataclasses import dataclass

from leafcut.errors import DataError, OptionError

_HEAD = re.compile(r"\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")


@dataclass(frozen=True)
class TomlPlace:
    """A position in a file. `table` is empty for the top level. `number` counts the tables of an array from 1."""

    table: str = ""
    number: int = 0
    key: str = ""
    line: int | None = None


def place_of(text: str, problem: OptionError) -> TomlPlace:
    """Return the position of an error of `library.check_profile`; without a line if the position is unknown."""
    if not isinstance(problem, DataError):
        return TomlPlace()
    if problem.line is not None:
        return TomlPlace(line=problem.line)
    table, number, key = problem.table, problem.number, problem.key
    line = _line_of(text, table, number, key)
    if line is None and key and not table:
        line = _line_of(text, key, 1, "")  # the key is a table, but another value is expected
    return TomlPlace(table, number, key, line)


def _line_of(text: str, table: str, number: int, key: str) -> int | None:
    counts: dict[str, int] = {}
    current, first_line = "", None if table else 1
    inside = not table
    for number_of_line, line in enumerate(text.splitlines(), 1):
        head = _HEAD.match(line)
        if head:
            current = _plain(head.group(2))
            counts[current] = counts.get(current, 0) + 1
            inside = current == table and counts[current] == max(number, 1)
            if inside and first_line is None:
                first_line = number_of_line
            continue
        match = _KEY.match(line)
        if match is None:
            continue
        name = _plain(match.group(1))
        full_name = f"{current}.{name}" if current else name
        if key and ((inside and name == key) or (not number and full_name == f"{table}.{key}".strip("."))):
            return number_of_line
    return first_line if not key or table else 1


def _plain(name: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in re.findall(r'"[^"]*"|\'[^\']*\'|[^.]+', name))
