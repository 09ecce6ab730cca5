"""Read strip-packing instances of the nesting literature (ESICUP, in the JSON format of sparrow and spyrrow).

An item has an ``id``, a ``demand``, ``allowed_orientations`` in degrees (missing or null: any), and a ``shape``: a
``simple_polygon`` of points. The height of the strip is ignored; the option --sheet sets the sheet.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from leafcut.errors import ReadError, parser_errors, printable
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.read.format import MAX_COORDINATE, Source, parse_json

#: Maximum number of items, and of points per item.
MAX_ITEMS, MAX_POINTS = 2_000, 100_000


def is_strip_instance(file: str) -> bool:
    """Return whether the file name indicates a strip-packing instance rather than a Sirius sheet."""
    name = file.lower()
    return name.endswith(".json") and not name.endswith(".dbs.json")


def read_strip_instance(
    source: Source, quantity: int, angles: tuple[float, ...] | None, turned: bool, unit: float = 1.0
) -> list[NestPart]:
    """Read the items of an instance as parts. The quantity of each part is `quantity` times the demand of the item.

    Parameters
    ----------
    angles
        Rotations of all parts, rad, or None for any rotation. They apply only if `turned` is true.
    turned
        Whether `angles` override the rotations in the file.
    unit
        Length of the unit of the file, mm, because the file does not state it.

    Raises
    ------
    ReadError
        The file is not an instance, or an item is incomplete; the message names the item.
    """
    file, text = source.path, source.text()
    with parser_errors(file, Message("this is not valid JSON")):
        data = parse_json(text)
    items = data.get("items") if isinstance(data, dict) else None
    if not isinstance(items, list) or not 0 < len(items) <= MAX_ITEMS:
        raise ReadError(file, Message("a strip instance has a list 'items' of 1 to {:,} items", MAX_ITEMS))
    name = printable(str(data.get("name") or "strip"))
    parts = [_parse_item(file, name, number, item, quantity, unit) for number, item in enumerate(items)]
    return [replace(part, rotations=angles) for part in parts] if turned else parts


def _parse_item(file: str, name: str, number: int, item: Any, quantity: int, unit: float) -> NestPart:
    try:
        kind, points = item["shape"]["type"], item["shape"]["data"]
        if kind != "simple_polygon":
            raise ReadError(file, Message("item {} is a {}; only simple_polygon is read", number, printable(str(kind))))
        demand, turns = item["demand"], item.get("allowed_orientations")
        corners = [(unit * float(x), unit * float(y)) for x, y in points[:MAX_POINTS]]
        rotations = None if turns is None else tuple(math.radians(float(turn)) % math.tau for turn in turns)
        label = f"{name}-{printable(str(item.get('id', number)))}"
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as problem:
        raise ReadError(
            file, Message("item {} is incomplete ({}: {})", number, type(problem).__name__, printable(str(problem)))
        ) from None
    if type(demand) is not int or demand < 1:
        raise ReadError(file, Message("item {}: the demand must be a whole number, 1 or more", number))
    if len(corners) < 3 or not all(abs(v) <= MAX_COORDINATE for corner in corners for v in corner):
        raise ReadError(
            file,
            Message(
                "item {}: at least 3 points are needed, with coordinates of {:g} mm at most", number, MAX_COORDINATE
            ),
        )
    if rotations is not None and (not rotations or not all(map(math.isfinite, rotations))):
        raise ReadError(file, Message("item {}: its angles must be a list of numbers", number))
    outline = Contour(Polyline.of_points(corners, closed=True))
    return NestPart(label, (outline,), demand * quantity, rotations)
