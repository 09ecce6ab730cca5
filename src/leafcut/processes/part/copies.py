"""Repeat a drawing side by side on one plate."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leafcut.errors import OptionError, PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.part import Part
from leafcut.options import Settings
from leafcut.processes.layers import contour_kinds
from leafcut.processes.part.options import PartOptions

#: Maximum total number of shapes in all copies.
_MOST_SHAPES = 20_000
_COLUMNS_AND_ROWS = re.compile(r"([1-9]\d{0,2}) ?[x×] ?([1-9]\d{0,2})", re.IGNORECASE)


def repeat_part(part: Part, settings: Settings) -> Part:
    """Repeat a part in columns along X and rows along Y. The outline of the sheet is not copied.

    Raises
    ------
    OptionError
        The number or the pitch of the copies is invalid.
    PlanError
        The copies have too many shapes, or it is unclear whether a layer holds the outline of the sheet.
    """
    options = settings.of(PartOptions)
    if options.copies is None:
        return part
    columns, rows = columns_and_rows(options.copies)
    pitch = _pitch(part, options)
    is_sheet = layer_matcher(settings.sheet.sheet_layers)
    copied = [contour for contour in part.contours if contour.kind != "sheet" and not is_sheet(contour.layer)]
    if columns * rows * len(copied) > _MOST_SHAPES:
        raise PlanError(
            "{}: {} copies of {} shapes exceed the limit of {} shapes; give fewer --copies",
            part.name,
            columns * rows,
            len(copied),
            _MOST_SHAPES,
        )
    if options.operations is None:
        _refuse_unclear_sheet(part, copied, settings)
    places = [(column * pitch[0], row * pitch[1]) for row in range(rows) for column in range(columns)]
    more = [_copy(contour, place, number) for number, place in enumerate(places) if number for contour in copied]
    return replace(part, contours=(*part.contours, *more))


def columns_and_rows(text: str) -> tuple[int, int]:
    """Parse a text such as ``3x2`` into the numbers of columns and rows. Raises OptionError for any other text."""
    match = _COLUMNS_AND_ROWS.fullmatch(text.strip())
    if match is None:
        raise OptionError("--copies: '{}' is not a number of columns and rows from 1 to 999, such as 3x2", text)
    return int(match[1]), int(match[2])


def _pitch(part: Part, options: PartOptions) -> Point:
    x0, y0, x1, y1 = part.extents
    if options.pitch is None:
        raise OptionError(
            "--copies: the drawing is {:.6g} x {:.6g} mm; give the distance from copy to copy with --pitch, such as "
            "--pitch {},{}",
            x1 - x0,
            y1 - y0,
            math.ceil(x1 - x0) + 10,
            math.ceil(y1 - y0) + 10,
        )
    if len(options.pitch) != 2 or min(options.pitch) <= 0.0:
        raise OptionError("--pitch: give two distances above 0, in X and Y, such as 60,40")
    return options.pitch[0], options.pitch[1]


def _refuse_unclear_sheet(part: Part, copied: Sequence[Contour], settings: Settings) -> None:
    kinds = contour_kinds(copied, settings.sheet, [])
    layers = {contour.layer for contour, kind in zip(copied, kinds, strict=True) if kind == "maybe sheet"}
    if layers:
        raise PlanError(
            "{}: with --copies, layer '{}' may hold the outline of the part or of the sheet; name the layer "
            "with --cut-layers or --sheet-layers",
            part.name,
            min(layers),
        )


def _copy(contour: Contour, place: Point, number: int) -> Contour:
    path = Polyline(np.add(contour.path.vertices, (*place, 0.0)), contour.path.closed)
    return replace(contour, path=path, handle=contour.handle and f"{contour.handle}.{number + 1}")
