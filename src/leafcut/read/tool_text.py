"""Convert a tool library of another program to TOML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, count_of, printable
from leafcut.files.schemas import TOOLS
from leafcut.files.whole_files import check_file_exists
from leafcut.model.tool import ToolLibrary
from leafcut.read.machine_keys import toml_value
from leafcut.read.tool_formats import READERS
from leafcut.read.tool_keys import TOOL_KEYS
from leafcut.read.tools import load_foreign_library


def convert_library_to_toml(file: str, units: str = "", material: str = "") -> tuple[str, ToolLibrary]:
    """Convert the tool library of another program to TOML, and return the TOML text and the tools.

    `units` (``mm`` or ``in``) applies to lengths without a unit. `material` selects a preset of each tool.

    Raises
    ------
    OptionError
        The file cannot be read, has an unknown format, needs `units`, or contains no usable tool.
    """
    path = Path(file)
    if path.suffix.lower() not in READERS:
        known = ", ".join(READERS)
        problem = "is a library of leafcut's own" if path.suffix.lower() == ".toml" else "not a tool library"
        raise OptionError(f"{file}: {problem}; leafcut imports {known}")
    check_file_exists("FILE", path)
    rows, library = load_foreign_library(path, units, material)
    lines = [
        f"# Tool library from {printable(path.name, 60)}: {count_of(len(library.tools), 'tool')}.",
        *(f"# left out: {printable(line, 110)}" for line in library.left_out),
    ]
    if library.without_feeds:
        lines.append("# The file has no feeds and speeds: add 'feed' and 'spindle_speed', else leafcut assumes them.")
    lines.append(TOOLS.toml_line)
    for row in rows:
        lines += ["", "[[tool]]", *_toml_lines(row)]
    return "\n".join(lines) + "\n", library


def _toml_lines(row: dict[str, Any]) -> list[str]:
    return [f"{key.name} = {toml_value(row[key.name])}" for key in TOOL_KEYS if key.name in row]
