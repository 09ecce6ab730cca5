"""Options of what is read: drawings, drill files, maps, and sheets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from leafcut.option_spec import PLACES, OptionGroup, option

#: The places that an origin can be named by, and how far they are across and up what is worked, 0 to 1.
ORIGINS = PLACES


@dataclass(frozen=True)
class ReadOptions(OptionGroup):
    """What to take from a file."""

    section: ClassVar[str] = "read"
    works: ClassVar[str] = "drill cut pocket nest solve"

    units: str | None = option(
        "text",
        None,
        "units of a file that does not say them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's own, else mm",
        works="drill cut pocket nest solve program simulate verify",
    )
    layers: tuple[str, ...] = option(
        "names", (), "only these layers, with * and ? as wildcards", default_words="all that are on"
    )
    min_diameter: float | None = option(
        "quantity",
        None,
        "leave out round holes smaller than this",
        unit="mm",
        minimum=0,
        default_words="none",
        works="drill cut solve",
    )
    max_diameter: float | None = option(
        "quantity",
        None,
        "leave out round holes larger than this",
        unit="mm",
        minimum=0,
        default_words="none",
        works="drill cut solve",
    )
    merge_tolerance: float = option(
        "quantity",
        0.01,
        "holes of one diameter closer than this are one hole",
        unit="mm",
        minimum=0,
        maximum=1,
        works="drill solve",
    )
    concentric: str = option(
        "text",
        "smallest",
        "which of several circles with one centre is drilled",
        choices=("smallest", "largest", "all"),
        works="drill solve",
    )
    mirror: str | None = option(
        "text",
        None,
        "mirror the drawing first: x makes X to −X, as a board turned over sideways shows its back; y makes Y to −Y",
        choices=("x", "y"),
        default_words="as it is drawn",
        works="drill cut pocket",
    )
    rotate: float = option(
        "quantity",
        0.0,
        "then turn it about its zero, counter-clockwise",
        unit="rad",
        minimum=-2 * math.pi,
        maximum=2 * math.pi,
        works="drill cut pocket",
    )
    origin: str | tuple[float, ...] | None = option(
        "place",
        None,
        "then make this its zero: lower-left, lower-right, upper-left, upper-right or centre of what is worked, holes "
        "by their centres; or a point x,y",
        unit="mm",
        default_words="the zero of the drawing",
        works="drill cut pocket",
    )
    strict: bool = option(
        "flag",
        False,
        "refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is",
        works="drill cut pocket nest solve program simulate",
    )


@dataclass(frozen=True)
class SheetOptions(OptionGroup):
    """What in a drawing of a sheet is what, and how its lines are joined."""

    section: ClassVar[str] = "sheet"
    works: ClassVar[str] = "cut nest"

    cut_layers: tuple[str, ...] = option(
        "names", (), "layers that are cut, with * and ?; no others are then", default_words="all others"
    )
    mark_layers: tuple[str, ...] = option(
        "names", (), "layers that are marked, not cut through", default_words="MARK*, SCRIBE*, ENGRAV*, ETCH*"
    )
    sheet_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers that show the edge of the sheet",
        default_words="SHEET*, PLATE*, STOCK* where they hold one outline round all else",
    )
    ignore_layers: tuple[str, ...] = option("names", (), "layers that are left out", default_words="none")
    join_tolerance: float = option(
        "quantity",
        0.05,
        "ends closer than this are one point",
        unit="mm",
        minimum=1e-4,
        maximum=5,
        works="cut nest pocket",
    )
    open_paths: str = option(
        "text",
        "refuse",
        "what becomes of open paths on layers that are cut",
        choices=("refuse", "cut", "mark", "drop"),
        works="cut nest pocket",
    )
