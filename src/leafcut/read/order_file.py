"""Order files: in which order a person wants holes to be drilled.

    {"leafcut_order": 1, "operations": [{"operation": 1, "holes": [12, 3, 7]}]}

Operations are counted from 1 as the program has them, holes from 1 in the order of the drawing. The holes named come
first, in this order; those of an operation that are not named come after them as the search finds best.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from leafcut.errors import ReadError
from leafcut.read.format import load_json, shown

#: The version of the format; another one is refused.
VERSION = 1


def order_text(operations: dict[int, tuple[int, ...]]) -> str:
    """Return the text of an order file: operation → holes, both counted from 0."""
    rows = [
        f'  {{"operation": {number + 1}, "holes": {json.dumps([hole + 1 for hole in holes])}}}'
        for number, holes in sorted(operations.items())
    ]
    return f'{{"leafcut_order": {VERSION}, "operations": [\n' + ",\n".join(rows) + "\n]}\n"


def load_order(path: Path) -> dict[int, tuple[int, ...]]:
    """Return what an order file wants: operation → holes, both counted from 0.

    Raises
    ------
    ReadError
        It is no order file; says what is wrong, and in which operation.
    """
    place = str(path)
    data = load_json(path)
    if not isinstance(data, dict) or data.get("leafcut_order") != VERSION:
        raise ReadError(place, f"is no order file of this version of leafcut: 'leafcut_order' must be {VERSION}")
    rows = data.get("operations")
    if not isinstance(rows, list):
        raise ReadError(place, "'operations' must be a list")
    wanted: dict[int, tuple[int, ...]] = {}
    for k, row in enumerate(rows, 1):
        if not isinstance(row, dict) or set(row) != {"operation", "holes"} or not isinstance(row["holes"], list):
            raise ReadError(place, f'row {k}: {{"operation": number, "holes": [numbers]}} was expected')
        number = _number(place, row["operation"], f"row {k}: 'operation'")
        if number in wanted:
            raise ReadError(place, f"operation {number + 1} is there twice")
        wanted[number] = tuple(_number(place, hole, f"operation {number + 1}: hole") for hole in row["holes"])
    return wanted


def _number(place: str, value: Any, what: str) -> int:
    """Return a number that is counted from 1 in the file, from 0."""
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**31:
        raise ReadError(place, f"{what}: {shown(json.dumps(value))} is not a number from 1 on")
    return value - 1
