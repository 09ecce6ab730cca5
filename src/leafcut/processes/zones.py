"""Keep-out zones: rectangles on the table that the user gives as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.units import parse_quantity

#: Clearance of rapids above a zone, mm. It allows for chips and for errors in the measured height.
ABOVE = 1.0


def _parse_coordinate(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return parse_quantity(text, "mm")


def parse_zones(rectangles: Sequence[str]) -> NDArray[np.float64]:
    """Parse texts such as "x0 y0 x1 y1" or "x0 y0 x1 y1 height" to rectangles, float64[k, 4], mm.

    Each number may have a unit, and the corners may be in any order. The result does not include the heights; use
    `crossing_heights` for them. Raises OptionError if a text does not have four or five finite numbers.
    """
    rows = [(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)) for x0, y0, x1, y1, _ in map(_parse_zone, rectangles)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def crossing_heights(rectangles: Sequence[str], otherwise: float) -> NDArray[np.float64]:
    """Return the lowest height at which a rapid may cross each zone, float64[k], mm.

    This is `ABOVE` mm above the zone. If a zone has no height, it is `otherwise`.
    """
    tops = np.array([top for *_, top in map(_parse_zone, rectangles)], dtype=np.float64)
    return np.where(np.isnan(tops), otherwise, tops + ABOVE)


def zone_boxes(rectangles: Sequence[str], bottom: float) -> NDArray[np.float64]:
    """Convert each zone that has a height to a box that starts at the height `bottom`.

    A box consists of its lower and upper corner, float64[k, 6], mm.
    """
    heights = crossing_heights(rectangles, math.nan) - ABOVE
    rows = np.column_stack([parse_zones(rectangles), np.full(len(heights), bottom), heights])
    return rows[~np.isnan(heights)][:, [0, 1, 4, 2, 3, 5]]


def refuse_higher_zones(rectangles: Sequence[str], clearance: float) -> None:
    """Raise OptionError if a zone is too high for a rapid at the clearance height, mm, to cross it."""
    for text, height in zip(rectangles, crossing_heights(rectangles, -math.inf).tolist(), strict=True):
        if height > clearance:
            raise OptionError(
                "--keep-out: '{}' is {:g} mm high, but rapids cross it at Z{:g}; use --clearance-height {:g} or more",
                text,
                height - ABOVE,
                clearance,
                height,
            )


def _parse_zone(text: str) -> tuple[float, float, float, float, float]:
    """Return the corners and the height of a zone, mm. If the zone has no height, the height is NaN."""
    try:
        numbers = [_parse_coordinate(word) for word in text.split()]
    except (OptionError, ValueError):
        numbers = []
    if len(numbers) not in (4, 5):
        raise OptionError(
            "--keep-out: '{}' is not a rectangle such as '0 0 40 25', or '0 0 40 25 20' with its height: four or "
            "five numbers, separated by spaces",
            text,
        )
    if not all(map(math.isfinite, numbers)):
        raise OptionError("--keep-out: '{}' contains a number that is not finite", text)
    x0, y0, x1, y1, top = [*numbers, math.nan][:5]
    return x0, y0, x1, y1, top
