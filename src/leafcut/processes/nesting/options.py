"""Options of nesting."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.errors import OptionError, shown
from leafcut.option_spec import OptionGroup, option
from leafcut.options.sheet_word import SheetWord, parse_sheet
from leafcut.units import parse_angles


@dataclass(frozen=True)
class NestOptions(OptionGroup):
    """How parts are laid on sheets.

    The seed, the time limit and the budget of work are those of `SolveOptions`.
    """

    section: ClassVar[str] = "nest"
    title: ClassVar[str] = "Nesting"

    sheet: tuple[str, ...] = option(
        "names",
        ("2500x1250",),
        "length and width of a sheet, such as 3000x1500 or 120inx60in; or several, with how many there are and what "
        "one costs, 3000x1500:4@180, and drawings of remnants; those are taken that cost least",
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
        "sheets at most; parts that find no room are told",
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
    remnants_out: Path | None = option(
        "path",
        None,
        "folder for drawings of what remains of the sheets, to be given as --sheet again",
        default_words="none",
        changes_program=False,
    )
    remnant_size: float = option(
        "quantity",
        150.0,
        "a remnant is kept where it is so wide, and a disc of this diameter fits in",
        unit="mm",
        minimum=10,
        maximum=10_000,
        needs="remnants_out",
    )
    into_holes: bool = option("flag", True, "lay small parts into the holes of large ones, where that saves sheet")

    def __post_init__(self) -> None:
        super().__post_init__()
        for one in self.sheets:
            if one.size is not None and min(one.size) <= 2.0 * self.margin:
                raise OptionError(
                    f"--margin: {self.margin:g} mm on both sides leaves nothing of a sheet of {shown(one.name)}"
                )
        if self.blocks != "none" and self.kerf <= 0.0:
            raise OptionError("--blocks: parts of a block lie a kerf apart; give --kerf, that of the cutting data")
        _ = self.angles

    @property
    def sheets(self) -> tuple[SheetWord, ...]:
        """The kinds of sheet that parts may be laid on.

        Raises
        ------
        OptionError
            There are none, one is not a sheet, or only some sizes have a price.
        """
        found = tuple(parse_sheet(word) for word in self.sheet)
        if not found:
            raise OptionError("--sheet: names no sheet; give a size such as 3000x1500")
        free = next((one.name for one in found if one.size is not None and one.price is None), None)
        if free is not None and any(one.price is not None for one in found):
            raise OptionError(f"--sheet: {shown(free)} has no price, and others have; give all one, such as {free}@180")
        return found

    @property
    def angles(self) -> tuple[float, ...] | None:
        """The angles in which a part may lie, rad; None for any."""
        return parse_angles(self.rotations, "--rotations")
