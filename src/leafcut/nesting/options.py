"""Options of nesting."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.errors import OptionError, printable
from leafcut.options.option_spec import OptionGroup, option
from leafcut.options.sheet_word import OFFERED, SheetWord, parse_sheet
from leafcut.units import parse_angles


@dataclass(frozen=True)
class NestOptions(OptionGroup):
    """Options for placing parts on sheets.

    The seed, the time limit and the iterations are in `SolveOptions`.
    """

    section: ClassVar[str] = "nest"
    title: ClassVar[str] = "Nesting"

    sheet: tuple[str, ...] = option(
        "names",
        ("2500x1250",),
        "sheet size, such as 3000x1500 or 120inx60in, with count and price if needed (3000x1500:4@180), or a drawing "
        "of a remnant; of several sheets, the cheapest are used",
        default_words="the table of --machine; 2500x1250 for plasma-table",
        of_file=True,
    )
    gap: float = option(
        "quantity", 5.0, "gap between parts, in addition to the kerf", unit="mm", minimum=0, maximum=1000
    )
    margin: float = option("quantity", 10.0, "margin along the sheet edge", unit="mm", minimum=0, maximum=1000)
    rotations: tuple[str, ...] = option(
        "names",
        ("0", "90", "180", "270"),
        "allowed rotations of parts, or free for any",
        of_file=True,
    )
    nester: str = option(
        "text",
        "auto",
        "nesting method: by true shapes, by bounding rectangles, or whichever suits the parts",
        choices=("auto", "shapes", "rectangles"),
    )
    variants: int | None = option(
        "whole",
        None,
        "number of nests to offer and to write, best first",
        minimum=1,
        maximum=100,
        default_words="3 offered, the best written",
    )
    blocks: str = option(
        "text",
        "none",
        "group equal parts one kerf apart for common-line cutting: pairs, two rows (plasma, oxyfuel), or grids (laser, "
        "water)",
        choices=("none", "pairs", "rows", "grids"),
    )
    remnants_out: Path | None = option(
        "path",
        None,
        "folder for drawings of the remnants, for use as --sheet",
        default_words="none",
        changes_program=False,
        of_file=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for sheet in self.sheets:
            if sheet.size is not None and min(sheet.size) <= 2.0 * self.margin:
                raise OptionError(
                    "--margin: {:g} mm on each side leaves no room on a sheet of {}", self.margin, printable(sheet.name)
                )
        _ = self.angles

    @property
    def sheets(self) -> tuple[SheetWord, ...]:
        """The available kinds of sheet.

        Raises
        ------
        OptionError
            The list is empty, an entry is not a sheet, or only some sizes have a price.
        """
        sheets = tuple(parse_sheet(text) for text in self.sheet)
        if not sheets:
            raise OptionError("--sheet is empty; give a size such as 3000x1500")
        unpriced = next((sheet.name for sheet in sheets if sheet.size is not None and sheet.price is None), None)
        if unpriced is not None and any(sheet.price is not None for sheet in sheets):
            raise OptionError(
                "--sheet: {} has no price, but other sizes do; give every size a price, such as {}@180",
                printable(unpriced),
                unpriced,
            )
        return sheets

    @property
    def n_offered(self) -> int:
        """Number of nests to offer."""
        return self.variants or OFFERED

    @property
    def n_written(self) -> int:
        """Maximum number of nests to write."""
        return self.variants or 1

    @property
    def angles(self) -> tuple[float, ...] | None:
        """The allowed rotations of parts, rad, or None for any rotation."""
        return parse_angles(self.rotations, "--rotations")
