"""Options of nesting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from leafcut.errors import OptionError
from leafcut.option_spec import OptionGroup, option
from leafcut.units import parse_quantity

#: No sheet is longer, mm: the nester reckons with seven digits.
LARGEST_SHEET = 20_000.0


@dataclass(frozen=True)
class NestOptions(OptionGroup):
    """How parts are laid on sheets.

    The seed, the time limit and the budget of work are those of `SolveOptions`.
    """

    section: ClassVar[str] = "nest"
    works: ClassVar[str] = "nest"

    sheet: str = option(
        "text",
        "2500x1250",
        "length and width of a sheet, such as 3000x1500 or 120inx60in",
        default_words="as large as the table of --machine: 2500x1250 of plasma-table",
    )
    kerf: float = option("quantity", 2.0, "width of the cut", unit="mm", minimum=0, maximum=50)
    gap: float = option(
        "quantity", 5.0, "what stays between two parts besides the kerf", unit="mm", minimum=0, maximum=1000
    )
    margin: float = option(
        "quantity", 10.0, "strip along the edge of the sheet that stays free", unit="mm", minimum=0, maximum=1000
    )
    rotations: tuple[str, ...] = option(
        "names", ("0", "90", "180", "270"), "angles in which a part may lie, or free for any"
    )
    nester: str = option(
        "text",
        "auto",
        "how parts are laid: by their shapes, by the rectangles around them, or the one that suits them",
        choices=("auto", "shapes", "rectangles"),
    )
    max_sheets: int | None = option(
        "whole",
        None,
        "sheets at hand; parts that find no room are told",
        minimum=1,
        maximum=100_000,
        default_words="as many as it takes",
    )
    variants: int = option("whole", 3, "nests to offer, the best first", minimum=1, maximum=100)
    all_variants: bool = option("flag", False, "write every variant, not only the best")
    blocks: str = option(
        "text",
        "none",
        "lay equal parts in blocks, a kerf apart, to be cut with common lines: pairs, two rows at most (plasma, "
        "flame), or grids (laser, water)",
        choices=("none", "pairs", "rows", "grids"),
    )
    into_holes: bool = option("flag", True, "lay small parts into the holes of large ones, where that saves sheet")

    def __post_init__(self) -> None:
        super().__post_init__()
        length, width = self.size
        if min(length, width) <= 2.0 * self.margin:
            raise OptionError(f"--margin: {self.margin:g} mm on both sides leaves nothing of a sheet of {self.sheet}")
        if self.blocks != "none" and self.kerf <= 0.0:
            raise OptionError("--blocks: parts of a block lie a kerf apart; give --kerf, that of the cutting data")
        _ = self.angles

    @property
    def size(self) -> tuple[float, float]:
        """Length (x) and width (y) of a sheet, mm."""
        sides = self.sheet.lower().replace("×", "x").split("x")
        try:
            length, width = (parse_quantity(side, "mm") for side in sides)
        except (OptionError, ValueError):
            raise OptionError(f"--sheet: '{self.sheet}' is not a size such as 3000x1500 or 120inx60in") from None
        if not (0.0 < length <= LARGEST_SHEET and 0.0 < width <= LARGEST_SHEET):
            raise OptionError(f"--sheet: {self.sheet} is not between 0 and {LARGEST_SHEET / 1000:g} m a side")
        return length, width

    @property
    def angles(self) -> tuple[float, ...] | None:
        """The angles in which a part may lie, rad; None for any."""
        return parse_angles(self.rotations, "--rotations")


def parse_angles(words: Sequence[str], where: str) -> tuple[float, ...] | None:
    """Return angles in rad, once each, from words in degrees; None for the one word ``free``.

    Raises
    ------
    OptionError
        A word is no angle; `where` names what was asked for.
    """
    if tuple(words) == ("free",):
        return None
    try:
        angles = [parse_quantity(word, "rad") % math.tau for word in words]
    except OptionError as problem:
        raise OptionError(f"{where}: {problem}; angles are such as 0,90,180,270, or free for any") from None
    if not angles:
        raise OptionError(f"{where}: names no angle; angles are such as 0,90,180,270, or free for any")
    return tuple(dict.fromkeys(angles))
