"""Round holes of a sheet left out by their diameter: a drill makes them later, or another machine."""

from __future__ import annotations

import math
from dataclasses import replace

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.issue import Issue, Severity
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.options import ReadOptions

#: A hole is round when 4π area is within this part of its length's square, and its width of its height: circles, and
#: circles drawn with 24 chords or more.
ROUND = 0.01
#: Inches become mm with a rounding error: a limit of 6.35 means the hole of 1/4 in too, mm.
_SLACK = 1e-6


def with_chosen_holes(sheet: Sheet, options: ReadOptions) -> Sheet:
    """Return a sheet without the round holes that `options` leaves out, which are counted (L205).

    Slots, windows, outlines of parts and marks stay, whatever their size.

    Raises
    ------
    PlanError
        A hole that is to be left out has something in it, which would then lie in the metal of the part.
    """
    low = options.min_diameter if options.min_diameter is not None else 0.0
    high = options.max_diameter if options.max_diameter is not None else math.inf
    gone = {
        k
        for k, c in enumerate(sheet.contours)
        if c.is_hole and (d := round_diameter(c.contour.path)) is not None and not low - _SLACK <= d <= high + _SLACK
    }
    if not gone:
        return sheet
    _check_empty(sheet, gone)
    places = {k: at for at, k in enumerate(k for k in range(len(sheet.contours)) if k not in gone)}
    kept = tuple(replace(sheet.contours[k], parent=places.get(sheet.contours[k].parent, -1)) for k in places)
    number = "1 hole" if len(gone) == 1 else f"{len(gone)} holes"
    first = ", ".join(_place(sheet.contours[k]) for k in sorted(gone)[:3]) + (" …" if len(gone) > 3 else "")
    words = f"{number} outside the selected diameters left out"
    return replace(sheet, contours=kept, issues=(*sheet.issues, Issue("L205", words, f"at {first}", Severity.NOTE)))


def round_diameter(path: Polyline) -> float | None:
    """Return the diameter of a closed path that is a circle, or a circle in chords, mm; None for another shape."""
    low_x, low_y, high_x, high_y = path.extents
    narrow, wide = sorted((high_x - low_x, high_y - low_y))
    if narrow < (1.0 - ROUND) * wide or 4.0 * math.pi * abs(path.area) < (1.0 - ROUND) * path.length**2:
        return None
    return wide


def _check_empty(sheet: Sheet, gone: set[int]) -> None:
    held = [c for c in sheet.contours if c.parent in gone]
    if held:
        around = sheet.contours[held[0].parent]
        raise PlanError(
            f"the hole at {_place(around)} of part {around.part} is left out by its diameter, but something to cut or "
            f"mark lies in it, at {_place(held[0])}; change --min-diameter or --max-diameter"
        )


def _place(contour: SheetContour) -> str:
    x, y = contour.contour.path.start
    return f"({x:g}, {y:g})"
