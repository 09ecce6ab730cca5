"""What is told of a machine profile that was made: each value with where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table


def print_profile(
    title: str, values: Sequence[tuple[str, Any, str, str]], notes: Sequence[str], console: Console
) -> None:
    """Print the values, each with its key, how it was come by and from what; those that were assumed last."""
    table = Table("Key", "Value", "", "From", title=title, box=None, pad_edge=False, title_justify="left")
    for key, value, how, source in sorted(values, key=lambda row: row[2] == "assumed"):
        words = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
        table.add_row(key, words.replace("True", "true").replace("False", "false"), how, source)
    console.print(table, markup=False)
    for note in notes:
        console.print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
