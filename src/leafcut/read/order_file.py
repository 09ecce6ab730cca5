"""Read and write order files, in which a user sets the drilling order of holes.

    {"leafcut_order": 1, "drawing": {"holes": 45, "print": "5f0c2a91d3b4"},
     "operations": [{"operation": 1, "holes": [12, 3, 7]}]}

Operations are numbered from 1 in program order, and holes from 1 in file order. The program drills the listed holes
first, in this order. The search orders the remaining holes after them.

``drawing`` contains the number of holes and a fingerprint of their relative positions. Without it, leafcut accepts the
file for any drawing that has the listed holes.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leafcut.errors import ReadError, printable
from leafcut.files.schemas import ORDER, check_schema
from leafcut.message import Message
from leafcut.read.format import load_json

#: Grid of the fingerprint, mm: the accuracy that survives another export.
_CELL = 0.01
#: Offset of the grid, in cells. Round lengths are far from the cell borders, so noise cannot move them to another cell.
_CELL_OFFSET = 0.381966
#: Number of digits in the fingerprint. It is enough to avoid collisions among a million orders.
_DIGITS = 12

PlacesInOrder = Iterable[tuple[float, float]]


@dataclass(frozen=True)
class Drawing:
    """Identifies a drawing by its number of holes, and by a fingerprint of their positions in file order."""

    holes: int
    print: str


@dataclass(frozen=True)
class OrderFile:
    """The contents of an order file: the holes of each operation, and the identity of the drawing if known.

    Operations and holes are numbered from 0.
    """

    operations: dict[int, tuple[int, ...]]
    drawing: Drawing | None


def identify_drawing(positions: PlacesInOrder) -> Drawing:
    """Compute the identity of a drawing from the positions of its holes in file order, mm.

    The identity does not change when the whole drawing is moved.
    """
    xy = [(float(x), float(y)) for x, y in positions]
    x0, y0 = (min(values) for values in zip(*xy, strict=True)) if xy else (0.0, 0.0)
    cells = [(math.floor((x - x0) / _CELL + _CELL_OFFSET), math.floor((y - y0) / _CELL + _CELL_OFFSET)) for x, y in xy]
    return Drawing(len(xy), hashlib.sha256(json.dumps(cells).encode()).hexdigest()[:_DIGITS])


def order_file_text(operations: dict[int, tuple[int, ...]], drawing: Drawing | None = None) -> str:
    """Write the text of an order file.

    `operations` lists the holes of each operation. Operations and holes are numbered from 0.
    """
    rows = [
        f'  {{"operation": {number + 1}, "holes": {json.dumps([hole + 1 for hole in holes])}}}'
        for number, holes in sorted(operations.items())
    ]
    drawing_text = f'"drawing": {{"holes": {drawing.holes}, "print": "{drawing.print}"}}, ' if drawing else ""
    return f'{{"{ORDER.key}": {ORDER.current}, {drawing_text}"operations": [\n' + ",\n".join(rows) + "\n]}\n"


def load_order(path: Path) -> OrderFile:
    """Read an order file.

    Raises
    ------
    ReadError
        The file is not an order file; the message describes the operation and the problem.
    DataError
        This version of leafcut does not support the schema of the file.
    """
    place = str(path)
    data = load_json(path)
    if not isinstance(data, dict) or ORDER.key not in data:
        raise ReadError(place, Message("is not an order file: '{}' is missing", ORDER.key))
    check_schema(ORDER, data[ORDER.key], place)
    rows = data.get("operations")
    if not isinstance(rows, list):
        raise ReadError(place, "'operations' must be a list")
    operations: dict[int, tuple[int, ...]] = {}
    for k, row in enumerate(rows, 1):
        if not isinstance(row, dict) or set(row) != {"operation", "holes"} or not isinstance(row["holes"], list):
            raise ReadError(place, Message('row {}: {{"operation": number, "holes": [numbers]}} was expected', k))
        number = _parse_number_from_1(place, row["operation"], Message("row {}: 'operation'", k))
        if number in operations:
            raise ReadError(place, Message("operation {} is listed twice", number + 1))
        operations[number] = tuple(
            _parse_number_from_1(place, hole, Message("operation {}: hole", number + 1)) for hole in row["holes"]
        )
    return OrderFile(operations, _parse_drawing(place, data.get("drawing")))


def _parse_drawing(place: str, data: Any) -> Drawing | None:
    if data is None:
        return None
    if not isinstance(data, dict) or set(data) != {"holes", "print"} or not isinstance(data["print"], str):
        raise ReadError(
            place, '\'drawing\': {"holes": number, "print": text} was expected; leave it out to accept any drawing'
        )
    return Drawing(_parse_number_from_1(place, data["holes"], "'drawing': 'holes'") + 1, data["print"])


def _parse_number_from_1(place: str, value: Any, label: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**31:
        raise ReadError(
            place, Message("{}: {} is not a whole number of 1 or more", label, printable(json.dumps(value)))
        )
    return value - 1
