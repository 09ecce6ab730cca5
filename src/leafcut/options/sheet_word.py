"""Parse the sheets requested for a nest: size or drawing, count and price."""

from __future__ import annotations

import re
from dataclasses import dataclass

from leafcut.errors import OptionError, printable
from leafcut.units import parse_quantity

#: Number of nests to offer if the user does not state it.
OFFERED = 3
#: Maximum length of a sheet, mm, because the nester computes with seven digits.
LARGEST_SHEET = 20_000.0
#: A sheet as text: size or drawing, optional count, optional price.
_SHEET = re.compile(r"(.+?)(?::(\d{1,9}))?(?:@(\d{1,12}(?:\.\d{1,6})?))?", re.DOTALL)


@dataclass(frozen=True)
class SheetWord:
    """A requested kind of sheet: ``3000x1500:4@180`` or ``remnant.dxf``.

    `name` is the size as text, or the file of the drawing. `size` is length and width, mm, or None for a drawing.
    `count` and `price` are None if not given; the default count of a drawing is 1.
    """

    name: str
    size: tuple[float, float] | None
    count: int | None = None
    price: float | None = None


def parse_sheet(word: str) -> SheetWord:
    """Parse a sheet such as ``3000x1500:4@180``. Raises OptionError if the text is invalid or the count is 0."""
    match = _SHEET.fullmatch(word.strip())
    name, count, price = match.groups() if match else (word, None, None)
    number, cost = None if count is None else int(count), None if price is None else float(price)
    if number == 0:
        raise OptionError("--sheet: '{}' has a count of 0; leave it out", printable(word))
    if name.lower().endswith(".dxf"):
        return SheetWord(name, None, number or 1, cost)
    try:
        length, width = (parse_quantity(side, "mm") for side in name.lower().replace("×", "x").split("x"))
    except (OptionError, ValueError):
        raise OptionError(
            "--sheet: '{}' is not a sheet; write a size such as 3000x1500 or 120inx60in, "
            "with count and price 3000x1500:4@180, or a drawing such as remnant.dxf",
            printable(word),
        ) from None
    if not (0.0 < length <= LARGEST_SHEET and 0.0 < width <= LARGEST_SHEET):
        raise OptionError(
            "--sheet: {} is out of range; each side must be above 0 and at most {:g} m",
            printable(name),
            LARGEST_SHEET / 1000,
        )
    return SheetWord(name, (length, width), number, cost)
