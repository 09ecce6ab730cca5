"""Catalogue sizes of twist drills, used for assumed drills if close enough to the hole."""

from __future__ import annotations

import numpy as np

from leafcut.units import MM_PER_INCH

#: Tolerance of a catalogue size, mm: rounding of drawings to three decimals in mm, or four in inches (0.0013 mm).
EQUAL = 1.5e-3
#: Metric drill sizes: upper end of each range, and the increments within it, mm (DIN 1899 below 1 mm, DIN 338 above).
_METRIC = ((1.0, (0.01,)), (3.0, (0.05,)), (np.inf, (0.1, 0.25)))
#: An inch fraction this close to a metric size, mm, is used only for a hole of exactly its diameter.
_BESIDE_METRIC = 0.02
#: Number drills 1 to 80 and letter drills A to Z, thousandths of an inch: ASME B94.11M.
_NUMBERS = (
    228, 221, 213, 209, 205.5, 204, 201, 199, 196, 193.5, 191, 189, 185, 182, 180, 177, 173, 169.5, 166, 161, 159, 157,
    154, 152, 149.5, 147, 144, 140.5, 136, 128.5, 120, 116, 113, 111, 110, 106.5, 104, 101.5, 99.5, 98, 96, 93.5, 89,
    86, 82, 81, 78.5, 76, 73, 70, 67, 63.5, 59.5, 55, 52, 46.5, 43, 42, 41, 40, 39, 38, 37, 36, 35, 33, 32, 31, 29.2,
    28, 26, 25, 24, 22.5, 21, 20, 18, 16, 14.5, 13.5,
)  # fmt: skip
_LETTERS = (
    234, 238, 242, 246, 250, 257, 261, 266, 272, 277, 281, 290, 295, 302, 316, 323, 332, 339, 348, 358, 368, 377, 386,
    397, 404, 413,
)  # fmt: skip
_NUMBERED = np.array([*_NUMBERS, *_LETTERS]) * 1e-3 * MM_PER_INCH


def catalogue_size(diameter: float, tolerance: float) -> float:
    """Return the size of the drill for a hole, mm.

    This is the catalogue size equal to the diameter; otherwise the nearest within `tolerance`, mm; otherwise the
    diameter itself. Number and letter drills are only used for holes of exactly their size, because they are close to
    metric sizes.
    """
    metric, inch = _metric(diameter), round(diameter / MM_PER_INCH * 64.0) / 64.0 * MM_PER_INCH
    numbered = float(_NUMBERED[np.argmin(np.abs(_NUMBERED - diameter))])
    for size in (metric, inch, numbered):
        if size > 0.0 and abs(size - diameter) <= min(EQUAL, tolerance):
            return round(size, 4)
    sizes = [metric]
    if abs(inch - _metric(inch)) > _BESIDE_METRIC:
        sizes.append(inch)
    # Of two equally near sizes, take the smaller: a hole can be opened up.
    away, size = min((round(abs(size - diameter), 6), size) for size in sizes)
    return round(size, 4) if size > 0.0 and away <= tolerance + 1e-9 else diameter


def _metric(diameter: float) -> float:
    steps = next(steps for limit, steps in _METRIC if diameter <= limit)
    sizes = {round(count * step, 4) for step in steps for count in (int(diameter / step), int(diameter / step) + 1)}
    return min((round(abs(size - diameter), 6), size) for size in sizes)[1]
