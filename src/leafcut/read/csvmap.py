"""Read tables of points: ``x, y[, diameter][, name]``, with or without a header. A header may also name z and layer.

Fields are separated by commas, semicolons, tabs or blanks. With semicolons or tabs, a comma between digits is a decimal
comma. Lines starting with # are comments. Invalid rows are skipped and reported, unless all rows are invalid.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

from leafcut.errors import ReadError, printable
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.filter_holes import part_of_points
from leafcut.read.format import (
    MAX_COORDINATE,
    MAX_HOLES,
    Source,
    drawing_unit_mm,
    to_mm,
    too_many_holes_error,
)
from leafcut.read.table_rows import detect_separator, is_number, parse_cell_number, split_row

#: Header word → field.
HEADER_WORDS = {
    "x": "x",
    "y": "y",
    "z": "z",
    "d": "d",
    "dia": "d",
    "diam": "d",
    "diameter": "d",
    "size": "d",
    "name": "name",
    "id": "name",
    "label": "name",
    "city": "name",
    "layer": "layer",
}
_UNIT_IN_HEADER = re.compile(r"^(\w*?[^\W_])[ _]*+[\[(]?(mm|cm|in|inch|mil|m)[\])]?$")
#: Number of invalid rows reported one by one; the rest is counted.
NAMED_ROWS = 10


@dataclass(frozen=True)
class _Columns:
    """The column numbers in a table of points, and the unit in the header."""

    x: int = 0
    y: int = 1
    d: int | None = 2
    name: int | None = 3
    layer: int | None = None
    z: int | None = None
    unit: str | None = None
    from_header: bool = False


def read_csv(source: Source, options: ReadOptions) -> Part:
    """Read the points of a table as holes, in mm.

    Raises
    ------
    ReadError
        No row has two numbers, or the header names no columns x and y.
    """
    lines = source.text().splitlines()
    separator = detect_separator([line for line in lines[:200] if line.strip() and not line.lstrip().startswith("#")])
    rows = _split_rows(lines, separator)
    columns, data_rows = _find_columns(source, rows, separator)
    factor = drawing_unit_mm(options, columns.unit)
    holes: list[Hole] = []
    bad: list[tuple[int, str]] = []
    for number, fields in data_rows:
        source.on_progress(number / len(lines))
        try:
            holes.append(_hole_of_row(fields, columns, separator, factor))
        except ValueError as problem:
            bad.append((number, str(problem)))
        if len(holes) > MAX_HOLES:
            raise too_many_holes_error(source.path)
    if not holes:
        line, reason = bad[0] if bad else (None, Message("the table has a header but no rows"))
        raise ReadError(source.path, Message("no points: {}", reason), line)
    issues = [
        Issue(
            "L208",
            Message("row skipped: {}", reason),
            Message("{}:{}", source.file_name, line),
            missing=MissingWork("hole"),
        )
        for line, reason in bad[:NAMED_ROWS]
    ]
    if len(bad) > NAMED_ROWS:
        more = len(bad) - NAMED_ROWS
        issues.append(Issue("L208", Message("{} further rows skipped", more), missing=MissingWork("hole", more)))
    return part_of_points(source, holes, issues, options, "csv", columns.unit, Message("the table"))


def _split_rows(lines: list[str], separator: str | None) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, split_row(line, separator)


def _find_columns(
    source: Source, rows: Iterator[tuple[int, list[str]]], separator: str | None
) -> tuple[_Columns, Iterator[tuple[int, list[str]]]]:
    number, fields = next(rows, (0, []))
    if not fields:
        raise ReadError(source.path, "no points: the file contains only comments")
    if any(is_number(f, separator) for f in fields[:2]):
        return _Columns(), chain([(number, fields)], rows)
    indices: dict[str, int] = {}
    unit = None
    for index, field in enumerate(fields):
        word = field.strip().lower()
        if word not in HEADER_WORDS and (match := _UNIT_IN_HEADER.match(word)) and match.group(1) in HEADER_WORDS:
            word, unit = match.group(1), match.group(2)
        if word in HEADER_WORDS:
            indices.setdefault(HEADER_WORDS[word], index)
    if "x" not in indices or "y" not in indices:
        given = printable(", ".join(fields))
        raise ReadError(source.path, Message("the header '{}' has no columns x and y", given), number)
    return (
        _Columns(
            indices["x"],
            indices["y"],
            indices.get("d"),
            indices.get("name"),
            indices.get("layer"),
            indices.get("z"),
            unit,
            True,
        ),
        rows,
    )


def _hole_of_row(fields: list[str], columns: _Columns, separator: str | None, factor: float) -> Hole:
    if len(fields) <= max(columns.x, columns.y):
        raise ValueError(Message("'{}' has {} field(s), expected x and y", printable(" ".join(fields)), len(fields)))
    x, y = (to_mm(parse_cell_number(fields[i], separator), factor) for i in (columns.x, columns.y))
    name_index, diameter = columns.name, 0.0
    if (text := _optional_field(fields, columns.d)) and not columns.from_header and not is_number(text, separator):
        name_index = columns.d  # x, y, name: this row has no diameter
    elif text:
        diameter = to_mm(parse_cell_number(text, separator), factor)
    if not (abs(x) <= MAX_COORDINATE and abs(y) <= MAX_COORDINATE and 0 <= diameter <= MAX_COORDINATE):
        raise ValueError(Message("x {:g}, y {:g}, diameter {:g} mm is out of range", x, y, diameter))
    height = _optional_field(fields, columns.z)
    z = to_mm(parse_cell_number(height, separator), factor) if height else 0.0
    if not abs(z) <= MAX_COORDINATE:
        raise ValueError(Message("z {:g} mm is out of range", z))
    return Hole(x, y, diameter, _optional_field(fields, columns.layer), _optional_field(fields, name_index), z)


def _optional_field(fields: list[str], index: int | None) -> str:
    return fields[index][:100] if index is not None and index < len(fields) else ""


def holes_as_csv(part: Part) -> str:
    """Write the holes of a part as a CSV table, in mm, so that `read_csv` can read the same points back.

    The table has a column for diameters if any hole has a diameter.
    """
    sized = any(hole.diameter for hole in part.holes)
    rows = [f"{hole.x!r},{hole.y!r}{f',{hole.diameter!r}' if sized else ''}" for hole in part.holes]
    return "\n".join(["x,y,diameter" if sized else "x,y", *rows, ""])
