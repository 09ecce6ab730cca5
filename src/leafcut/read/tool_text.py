"""A tool library of another program, written as one of leafcut's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, count_of, shown
from leafcut.files import check_is_there
from leafcut.model.tool import ToolLibrary
from leafcut.read.machine_keys import toml_value
from leafcut.read.tool_formats import READERS
from leafcut.read.tool_keys import TOOL_KEYS
from leafcut.read.tools import foreign_rows
from leafcut.schemas import TOOLS


def imported_tools(file: str, units: str = "mm") -> tuple[str, ToolLibrary]:
    """Return the library as TOML, and what it holds; read again it has the same tools.

    `units` are those of lengths where the file does not say them: of LinuxCNC's table, and of tables without units.

    Raises
    ------
    OptionError
        The file cannot be read, is of no kind that leafcut knows, or has no tool that can be used.
    """
    path = Path(file)
    if path.suffix.lower() not in READERS:
        known = ", ".join(READERS)
        what = "is a library of leafcut's own" if path.suffix.lower() == ".toml" else "is no tool library"
        raise OptionError(f"{file}: {what}; importable are {known}")
    check_is_there("FILE", path)
    rows, library = foreign_rows(path, units)
    lines = [
        f"# Tool library from {shown(path.name, 60)}: {count_of(len(library.tools), 'tool')}.",
        *(f"# left out: {shown(line, 110)}" for line in library.left_out),
    ]
    if library.without_feeds:
        lines.append("# The file has no feeds and speeds: add 'feed' and 'spindle_speed', else leafcut assumes them.")
    lines.append(TOOLS.line)
    for row in rows:
        lines += ["", "[[tool]]", *_lines(row)]
    return "\n".join(lines) + "\n", library


def _lines(row: dict[str, Any]) -> list[str]:
    return [f"{key.name} = {toml_value(row[key.name])}" for key in TOOL_KEYS if key.name in row]
