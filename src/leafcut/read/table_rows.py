"""Rows of text tables: their separator, fields and numbers."""

from __future__ import annotations

import csv
import math

from leafcut.errors import shown


def separator_of(lines: list[str]) -> str | None:
    """Return the separator of fields: the strongest sign in at least half of the lines; None for blanks."""
    for sign in (";", "\t", ","):
        if lines and 2 * sum(sign in line for line in lines) >= len(lines):
            return sign
    return None


def split_row(line: str, separator: str | None) -> list[str]:
    """Return the fields of a row."""
    if separator is None:
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.split(separator)]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def cell_number(text: str, separator: str | None) -> float:
    """Return the number in a field; a comma between digits is decimal where semicolons or tabs separate.

    Raises
    ------
    ValueError
        The text is not a number.
    """
    # float() also reads "1_000"; in a table that is a mistake.
    plain = text.replace(",", ".") if separator in (";", "\t") and text.count(",") == 1 and "." not in text else text
    try:
        if "_" in plain:
            raise ValueError
        return float(plain)
    except ValueError:
        raise ValueError(f"'{shown(text, 30)}' is not a number") from None


def is_number(text: str, separator: str | None) -> bool:
    """Return whether a field holds a finite number."""
    try:
        return math.isfinite(cell_number(text, separator))
    except ValueError:
        return False
