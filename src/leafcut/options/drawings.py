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
    title: ClassVar[str] = "Reading"

    units: str | None = option(
        "text",
        None,
        "units of a file that does not say them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's own, else mm",
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
    )
    max_diameter: float | None = option(
        "quantity",
        None,
        "leave out round holes larger than this",
        unit="mm",
        minimum=0,
        default_words="none",
    )
    merge_tolerance: float = option(
        "quantity",
        0.01,
        "holes of one diameter closer than this are one hole",
        unit="mm",
        minimum=0,
        maximum=1,
    )
    concentric: str = option(
        "text",
        "smallest",
        "which of several circles with one centre is drilled",
        choices=("smallest", "largest", "all"),
    )
    mirror: str | None = option(
        "text",
        None,
        "mirror the drawing first: x makes X to −X, as a board turned over sideways shows its back; y makes Y to −Y",
        choices=("x", "y"),
        default_words="as it is drawn",
    )
    rotate: float = option(
        "quantity",
        0.0,
        "then turn it about its zero, counter-clockwise",
        unit="rad",
        minimum=-2 * math.pi,
        maximum=2 * math.pi,
    )
    origin: str | tuple[float, ...] | None = option(
        "place",
        None,
        "then make this its zero: lower-left, lower-right, upper-left, upper-right or centre of what is worked, holes "
        "by their centres; or a point x,y",
        unit="mm",
        default_words="the zero of the drawing",
    )
    strict: bool = option(
        "flag",
        False,
        "refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is",
    )


@dataclass(frozen=True)
class SheetOptions(OptionGroup):
    """What in a drawing of a sheet is what, and how its lines are joined."""

    section: ClassVar[str] = "sheet"
    title: ClassVar[str] = "Drawings of sheets"

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
    )
    open_paths: str = option(
        "text",
        "refuse",
        "what becomes of open paths on layers that are cut",
        choices=("refuse", "cut", "mark", "drop"),
    )


@dataclass(frozen=True)
class PocketDrawingOptions(OptionGroup):
    """What in a drawing or a picture is a pocket, and what is an island."""

    section: ClassVar[str] = "pocket_drawing"
    title: ClassVar[str] = "Drawings of pockets"

    pocket_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers with the outlines of pockets, with * and ?",
        default_words="POCKET* where there are such",
        needs="!input=picture",
    )
    island_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers with the outlines of islands",
        default_words="ISLAND* where there are such",
        needs="!input=picture",
    )
    pixel_size: float | None = option(
        "quantity",
        None,
        "width of a pixel of a picture",
        unit="mm",
        minimum=1e-4,
        maximum=100,
        default_words="for pictures: needed",
        needs="input=picture",
    )
    threshold: float | None = option(
        "percent",
        None,
        "brightness below which a pixel is to be milled",
        minimum=0,
        maximum=100,
        default_words="found by Otsu's method",
        needs="input=picture",
    )
    speckle: float = option(
        "quantity",
        1.0,
        "spots of a picture that are narrower than this are dirt",
        unit="mm",
        minimum=0,
        maximum=100,
        needs="input=picture",
    )
    invert: bool = option("flag", False, "mill what is bright in a picture", needs="input=picture")
