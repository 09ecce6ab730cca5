"""Slots one to two kerfs wide, which leave no room for a pierce beside their edge, are cut once along their middle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.issue import Issue
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.plan.cut_contours import FLATNESS, ROUNDING

#: A slot is at least so many times as long as it is wide.
LONGER = 2.0
#: Its area is that of a rectangle, or of one with round ends, to this share.
ALIKE = 0.01


def on_their_middle(sheet: Sheet, kerf: float) -> tuple[Sheet, list[Issue]]:
    """Return a sheet with its narrow slots as open cuts along their middles, and how wide they come out (L627).

    The cut ends half a kerf before the slot does, so that it is as long as drawn. Rectangles and slots with round ends
    are taken, that hold nothing.
    """
    holding = {c.parent for c in sheet.contours}
    contours, widths = list(sheet.contours), []
    for index, one in enumerate(sheet.contours):
        middle = _middle(one, kerf) if one.is_hole and index not in holding else None
        if middle is not None:
            path, width = middle
            contours[index] = replace(one, contour=replace(one.contour, path=path), depth=one.depth - 1)
            widths.append((width, path.point_at(0.5 * path.length)))
    told = [(width, place) for width, place in widths if abs(width - kerf) > ROUNDING]
    if not widths:
        return sheet, []
    places = ", ".join(f"({x:.6g}, {y:.6g})" for _, (x, y) in told[:3]) + (" …" if len(told) > 3 else "")
    many = "a slot is" if len(told) == 1 else f"{len(told)} slots are"
    words = f"{many} narrower than two kerfs and cut once along the middle: {kerf:.4g} mm wide, not as wide as drawn"
    return replace(sheet, contours=tuple(contours)), [Issue("L627", words, f"at {places}")] if told else []


def _middle(one: SheetContour, kerf: float) -> tuple[Polyline, float] | None:
    """Return the middle of a slot, less half a kerf at either end, and its width; None for what is no such slot."""
    x0, y0, x1, y1 = one.contour.path.extents
    # Most holes are wider in both directions however they lie: their area says so.
    if abs(one.contour.path.area) > 2.0 * kerf * math.hypot(x1 - x0, y1 - y0):
        return None
    shape = shapely.Polygon(one.contour.path.flattened(FLATNESS))
    box: Any = shapely.oriented_envelope(shape)
    if box.geom_type != "Polygon":
        return None
    a, b, c, _ = np.array(box.exterior.coords[:4])
    first, second = b - a, c - b
    along, across = (first, second) if np.hypot(*first) >= np.hypot(*second) else (second, first)
    length, width = float(np.hypot(*along)), float(np.hypot(*across))
    if length < LONGER * width or not kerf - ROUNDING <= width < 2.0 * kerf - ROUNDING:
        return None
    round_ends = (length - width) * width + 0.25 * math.pi * width**2
    if not any(abs(shape.area - area) <= ALIKE * area for area in (length * width, round_ends)):
        return None
    half = 0.5 * (length - kerf) / length * along
    middle = 0.5 * (a + c)
    return Polyline.of_points([tuple(middle - half), tuple(middle + half)], closed=False), width
