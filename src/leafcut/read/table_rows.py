"""Split the rows of text tables: detect the separator, and parse fields and numbers."""

from __future__ import annotations

import csv
import math

from leafcut.errors import printable
from leafcut.message import Message


def detect_separator(lines: list[str]) -> str | None:
    """Detect the field separator of a table.

    The separator is the first of ``;``, tab and ``,`` that occurs in at least half of the lines. The function returns
    None if blanks separate the fields.
    """
    for sign in (";", "\t", ","):
        if lines and 2 * sum(sign in line for line in lines) >= len(lines):
            return sign
    return None


def split_row(line: str, separator: str | None) -> list[str]:
    """Split a row at the separator, or at blanks if the separator is None."""
    if separator is None:
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.split(separator)]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def parse_cell_number(text: str, separator: str | None) -> float:
    """Parse the number in a field.

    If semicolons or tabs separate the fields, a comma in the number is a decimal comma.

    Raises
    ------
    ValueError
        The text is not a number.
    """
    # float() also accepts "1_000", which is an error in a table.
    plain = text.replace(",", ".") if separator in (";", "\t") and text.count(",") == 1 and "." not in text else text
    try:
        if "_" in plain:
            raise ValueError
        return float(plain)
    except ValueError:
        raise ValueError(Message("'{}' is not a number", printable(text, 30))) from None


def is_number(text: str, separator: str | None) -> bool:
    """Return whether a field contains a finite number."""
    try:
        return math.isfinite(parse_cell_number(text, separator))
    except ValueError:
        return False
