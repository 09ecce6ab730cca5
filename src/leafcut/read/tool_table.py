"""Read tables of tools (CSV), such as Fusion exports.

The first row names the columns, in any order. The names can be leafcut's own keys, common words, or Fusion's names
(``Diameter (tool_diameter)``). The unit of a length is in its cell, in the header (``Diameter [in]``) or in the column
``unit``. Otherwise the caller provides the unit. Fusion writes one row per preset of a tool.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, printable
from leafcut.files.whole_files import decode_text
from leafcut.message import Message
from leafcut.model.tool import CONES, MILLS, ToolKind
from leafcut.read.tool_kinds import FUSION_KINDS, RawRow, tool_kind_in_comment

#: Maximum number of rows of a table.
_MOST_ROWS = 10_000

#: Column name → key of a tool.
_COLUMNS = {
    "number": "number", "t": "number", "tool": "number", "no": "number", "nr": "number",
    "toolnumber": "number",
    "kind": "kind", "type": "kind", "tooltype": "kind",
    "diameter": "diameter", "dia": "diameter", "d": "diameter", "ø": "diameter", "tooldiameter": "diameter",
    "name": "name", "description": "name", "comment": "name", "remark": "name", "tooldescription": "name",
    "feed": "feed", "feedrate": "feed", "cuttingfeedrate": "feed", "toolfeedcutting": "feed",
    "plungefeed": "plunge_feed", "plunge": "plunge_feed", "plungefeedrate": "plunge_feed", "plungerate": "plunge_feed",
    "toolfeedplunge": "plunge_feed",
    "spindlespeed": "spindle_speed", "speed": "spindle_speed", "rpm": "spindle_speed", "s": "spindle_speed",
    "toolspindlespeed": "spindle_speed",
    "teeth": "teeth", "flutes": "teeth", "numberofflutes": "teeth", "toolnumberofflutes": "teeth",
    "flutelength": "flute_length", "cuttinglength": "flute_length", "toolflutelength": "flute_length",
    "pointangle": "point_angle", "tipangle": "point_angle", "angle": "point_angle", "tooltipangle": "point_angle",
    "tooltaperangle": "taper_angle", "taperangle": "taper_angle",
    "cornerradius": "corner_radius", "toolcornerradius": "corner_radius",
    "tipdiameter": "tip_diameter", "tooltipdiameter": "tip_diameter",
    "pitch": "pitch", "threadpitch": "pitch", "toolthreadpitch": "pitch",
    "peck": "peck", "dwell": "dwell", "cycle": "cycle", "unit": "unit", "units": "unit", "toolunit": "unit",
    "preset": "preset", "presetname": "preset",
}  # fmt: skip
_LENGTHS = ("diameter", "flute_length", "corner_radius", "tip_diameter", "pitch", "peck")
_FEEDS = ("feed", "plunge_feed")
_UNIT_WORDS = {"mm": "mm", "millimeters": "mm", "millimetres": "mm", "in": "in", "inch": "in", "inches": "in"}
_HEAD = re.compile(r"^(.*?)\s*[\(\[]\s*([^\)\]]*?)\s*[\)\]]\s*$")
_PLAIN = re.compile(r"[-+]?[0-9.,]+(e[-+]?[0-9]+)?", re.IGNORECASE)


def read_tool_table(path: Path, data: bytes, units: str) -> Iterator[RawRow]:
    """Yield the name of each tool in a table, with its values, its presets, or the reason why the tool is left out.

    Raises
    ------
    DataError
        The file is not text, has too many rows, or has no column for number or diameter. The error is also raised if a
        length has no unit and `units` is "".
    """
    if b"\0" in data:
        raise DataError("{}: is a binary file; a table of tools was expected", path)
    text = decode_text(data)[0]
    first = text.partition("\n")[0]
    delimiter = max(",;\t", key=first.count)
    try:
        rows = list(csv.reader(io.StringIO(text), delimiter=delimiter))
    except csv.Error as problem:
        raise DataError("{}: is not a table ({})", path, printable(str(problem), 60)) from None
    if len(rows) > _MOST_ROWS:
        raise DataError("{}: has more than {} rows", path, _MOST_ROWS)
    columns = [_parse_column_header(cell) for cell in rows[0]] if rows else []
    keys = [key for key, _ in columns]
    if "number" not in keys or "diameter" not in keys:
        missing = " or ".join(key for key in ("number", "diameter") if key not in keys)
        raise DataError("{}: line 1: no column is called {}; the first row must name the columns", path, missing)
    tools_read: list[tuple[str, str, dict[str, Any] | str]] = []
    for count, row in enumerate(rows[1:], 2):
        if not any(cell.strip() for cell in row):
            continue
        cells: dict[str, tuple[str, str]] = {}
        for (key, unit), cell in zip(columns, row, strict=False):
            if key and cell.strip():
                cells.setdefault(key, (cell.strip(), unit))
        number = cells.get("number", ("", ""))[0].upper().removeprefix("T").strip()
        name = f"T{number}" if number.isdigit() else Message("line {}", count)
        try:
            tools_read.append((name, cells.get("preset", ("", ""))[0], _parse_tool(cells, number, units)))
        except DataError as problem:
            raise DataError("{}: line {}: {}", path, count, problem) from None
    for (name, with_preset), group in groupby(tools_read, lambda row: (row[0], bool(row[1]))):
        tools = [(preset, values) for _, preset, values in group]
        presets = [(preset, values) for preset, values in tools if isinstance(values, dict)]
        if with_preset and len(presets) == len(tools):
            yield name, presets
        else:
            yield from ((name, values) for _, values in tools)


def _parse_column_header(cell: str) -> tuple[str, str]:
    """Return the key of a column, or "" if it is unknown, and the unit in the header of the column."""
    head, unit = cell.strip(), ""
    match = _HEAD.match(head)
    if match:
        head, inner = match[1], match[2]
        if inner.lower().startswith("tool_"):
            head = inner
        else:
            unit = inner
    return _COLUMNS.get(re.sub(r"[^a-z0-9ø]", "", head.lower()), ""), unit


def _parse_tool(cells: Mapping[str, tuple[str, str]], number: str, units: str) -> dict[str, Any] | str:
    if not re.fullmatch(r"[0-9]{1,9}", number):
        return Message("the tool number '{}' is not a whole number", printable(number, 20))
    unit = units
    if "unit" in cells:
        word = cells["unit"][0].lower()
        if word not in _UNIT_WORDS:
            return Message("the unit '{}' is not mm or in", printable(word, 20))
        unit = _UNIT_WORDS[word]
    name = cells.get("name", ("", ""))[0]
    word = cells.get("kind", ("", ""))[0]
    kind = _tool_kind(word, name)
    if kind is None:
        return Message("'{}' is not a kind of tool", printable(word or name, 30))
    row: dict[str, Any] = {"number": int(number), "kind": kind}
    if name:
        row["name"] = printable(name, 40)
    for key in _LENGTHS:
        _store_quantity(row, cells, key, unit)
    for key in _FEEDS:
        _store_quantity(row, cells, key, f"{unit}/min")
    for key, default_unit in (("spindle_speed", "rpm"), ("point_angle", "deg"), ("dwell", "s")):
        _store_quantity(row, cells, key, default_unit)
    if "cycle" in cells:
        row["cycle"] = cells["cycle"][0].upper()
    teeth = cells.get("teeth", ("", ""))[0].partition(".")[0]
    if teeth.isdigit() and int(teeth[:9]) > 0:
        row["teeth"] = int(teeth[:9])
    taper = cells.get("taper_angle", ("", ""))[0]
    if kind in CONES and "point_angle" not in row and _PLAIN.fullmatch(taper):
        row["point_angle"] = f"{2 * float(taper.replace(',', '.')):g} deg"  # Fusion states the angle of one side
    return _without_foreign_keys(row, ToolKind(kind))


def _store_quantity(row: dict[str, Any], cells: Mapping[str, tuple[str, str]], key: str, unit: str) -> None:
    """Store a quantity of a tool.

    A number without a unit uses the unit in the header, or else `unit`. The value 0 means that the quantity is missing.
    """
    cell, head = cells.get(key, ("", ""))
    if _PLAIN.fullmatch(cell):
        if not re.search(r"[1-9]", cell):
            return
        if not head and unit in ("", "/min"):
            raise DataError("'{}' has no unit; give it with --units", key)
        cell = f"{cell} {head or unit}"
    if cell:
        row[key] = cell


def _tool_kind(word: str, name: str) -> str | None:
    plain = word.strip().lower()
    kind_name = re.sub(r"[\s_]+", "-", plain)
    if kind_name in tuple(ToolKind):
        return kind_name
    return FUSION_KINDS.get(plain) or tool_kind_in_comment(word) or (tool_kind_in_comment(name) if not plain else None)


def _without_foreign_keys(row: dict[str, Any], kind: ToolKind) -> dict[str, Any]:
    """Remove the keys that other programs write for every tool, but that do not apply to this kind of tool."""
    mill = kind in MILLS
    unused = {"plunge_feed", "teeth"} if not mill else {"cycle", "peck", "dwell", "pitch"}
    if kind is not ToolKind.TAP:
        unused.add("pitch")
    if kind is not ToolKind.END_MILL:
        unused.add("corner_radius")
    if kind not in CONES:
        unused.add("tip_diameter")
        if mill or kind not in (ToolKind.DRILL, ToolKind.CENTRE_DRILL):
            unused.add("point_angle")
    if not mill and "plunge_feed" in row:
        row = {**row, "feed": row["plunge_feed"]}  # a drill only moves down
    if kind is ToolKind.TAP:
        unused.add("feed")
    return {key: value for key, value in row.items() if key not in unused}
