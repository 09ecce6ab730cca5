"""Programs of a mill that cuts parts out of a sheet of 6 mm: bores, pockets, outlines with and without tabs, skins."""

from __future__ import annotations

HEAD = "G21 G90 G17 G94 / T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"
#: Where the parts lie, each 40 by 40 mm.
PARTS = [(50 * i, 50 * j) for i in range(3) for j in range(2)]
THROUGH = -6.2


def outline(x: float, y: float, side: float = 40, z: float = THROUGH, tab: float | None = None) -> str:
    """Return a square cut in one go, on the first side with a tab of this height where one is given."""
    over = f"X{x + 15} / Z{z + tab} / X{x + 25} / Z{z} / " if tab else ""
    corners = f"X{x + side} Y{y} / X{x + side} Y{y + side} / X{x} Y{y + side} / X{x} Y{y}"
    return f"G0 X{x} Y{y} / G1 Z{z} F100 / {over}{corners} / G0 Z5"


def bore(x: float, y: float, radius: float = 2, z: float = THROUGH - 0.1) -> str:
    """Return a hole milled through the sheet: a circle, which frees a scrap."""
    return f"G0 X{x + radius} Y{y} / G1 Z{z} F100 / G2 X{x + radius} Y{y} I{-radius} J0 / G0 Z5"


def slot(x: float, y: float, length: float = 10, z: float = -2) -> str:
    """Return a slot that is not through."""
    return f"G0 X{x} Y{y} / G1 Z{z} F100 / X{x + length} / G0 Z5"


def text_of(cuts: list[str]) -> str:
    return HEAD + " / ".join(cuts) + FOOT


BORES = [bore(x + 10 * k, y + 10 * k) for x, y in PARTS for k in (1, 2)]
SLOTS = [slot(x + 20, y + 10) for x, y in PARTS]
OUTLINES = [outline(x, y) for x, y in PARTS]
#: Outlines down to a skin of 0.2 mm.
SKINS = [outline(x, y, z=-5.8) for x, y in PARTS]
TABBED = [outline(x, y, tab=1.5) for x, y in PARTS]
