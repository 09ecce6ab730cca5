"""Keep-out zones as a person writes them: rectangles on the table, as texts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.units import parse_quantity


def _coordinate(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return parse_quantity(word, "mm")


def parse_zones(rectangles: Sequence[str]) -> NDArray[np.float64]:
    """Return float64[k, 4] of texts "x0 y0 x1 y1" in mm, or each with a unit of its own, corners in any order.

    Raises
    ------
    OptionError
        A text is not four finite numbers.
    """
    rows = []
    for text in rectangles:
        try:
            x0, y0, x1, y1 = (_coordinate(word) for word in text.split())
        except (OptionError, ValueError):
            raise OptionError(
                f"--keep-out: '{text}' is not a rectangle such as '0 0 40 25': four numbers, with spaces between"
            ) from None
        if not all(math.isfinite(v) for v in (x0, y0, x1, y1)):
            raise OptionError(f"--keep-out: '{text}' contains a number that is not finite")
        rows.append((min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)))
    return np.array(rows, dtype=np.float64).reshape(-1, 4)
