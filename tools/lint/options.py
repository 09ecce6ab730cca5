"""Check that the program reads every option."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import sources

from leafcut.options.option_spec import flag_name
from leafcut.processes.settings import all_options


def faults() -> Iterator[str]:
    """Yield every option that no code reads, so that it has no effect."""
    read = {
        node.attr
        for file in sources.modules()
        if file.parent.name != "options" and file != sources.PACKAGE / "cli/app.py" and file.name != "options.py"
        for node in sources.nodes_of(file)
        if isinstance(node, ast.Attribute)
    }
    for group, name, _ in all_options():
        if name not in read:
            file = Path(str(sys.modules[group.__module__].__file__)).resolve()
            place = next((place for place, _ in sources.matches(rf"^    {name}:", file)), sources.place(file))
            yield f"{place}: no code reads {flag_name(name)}"
