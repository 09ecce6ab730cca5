"""Options for reading drawings, drill files, maps, and sheets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import PLACES, OptionGroup, option, when_input_is, when_input_is_not

#: Names of an origin → position as fractions of the width and height of the machined area, 0 to 1.
ORIGINS = PLACES

#: Default layer names by purpose; * and ? are wildcards.
MARK_NAMES = ("MARK*", "SCRIBE*", "ENGRAV*", "ETCH*")
SHEET_NAMES = ("SHEET*", "PLATE*", "STOCK*")
POCKET_NAMES = ("POCKET*",)
ISLAND_NAMES = ("ISLAND*",)


@dataclass(frozen=True)
class ReadOptions(OptionGroup):
    """Input file: units, layers, filters, and position of the part."""

    section: ClassVar[str] = "read"
    title: ClassVar[str] = "Input"

    units: str | None = option(
        "text",
        None,
        "units of a file that does not state them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's, else mm",
        of_file=True,
    )
    layers: tuple[str, ...] = option(
        "names",
        (),
        "read only these layers; * and ? are wildcards",
        default_words="all visible layers",
        of_file=True,
    )
    min_diameter: float | None = option(
        "quantity",
        None,
        "skip round holes smaller than this",
        unit="mm",
        minimum=0,
        default_words="none",
        of_file=True,
    )
    max_diameter: float | None = option(
        "quantity",
        None,
        "skip round holes larger than this",
        unit="mm",
        minimum=0,
        default_words="none",
        of_file=True,
    )
    concentric: str = option(
        "text",
        "smallest",
        "which of several concentric circles to drill, or to cut as a hole in a sheet",
        choices=("smallest", "largest", "all"),
        of_file=True,
    )
    solid: int | None = option(
        "whole",
        None,
        "number of the solid in a STEP file with several solids; without this option, the solids are listed",
        minimum=1,
        maximum=1_000_000,
        default_words="the file's only one",
        of_file=True,
    )
    up: str | None = option(
        "text",
        None,
        "turn a solid until this direction points up; x, y and z are the axes of the solid",
        choices=("x", "y", "z", "-x", "-y", "-z"),
        default_words="z",
        needs=(when_input_is("step"),),
    )
    z_zero: str | None = option(
        "text",
        None,
        "Z0 of the program: the highest point, the lowest point or the drawn Z0 of a solid after it is turned; "
        "for a drawing, drawn keeps its Z0, and each hole starts at its drawn height",
        choices=("top", "bottom", "drawn"),
        default_words="top; drawn for a --workpiece",
        needs=(when_input_is("step"),),
    )
    side: str = option(
        "text",
        "top",
        "side of a circuit board; the bottom is mirrored about a line along Y through the middle of the board",
        choices=("top", "bottom"),
        needs=(when_input_is("gerber"),),
        of_file=True,
    )
    mirror: str | None = option(
        "text",
        None,
        "mirror the drawing: x reverses X (a board flipped sideways), y reverses Y",
        choices=("x", "y"),
        default_words="as drawn",
        of_file=True,
    )
    rotate: float = option(
        "quantity",
        0.0,
        "rotate the drawing about its origin, counter-clockwise, after mirroring",
        unit="rad",
        minimum=-2 * math.pi,
        maximum=2 * math.pi,
        of_file=True,
    )
    origin: str | tuple[float, ...] | None = option(
        "place",
        None,
        "program zero after rotating: lower-left, lower-right, upper-left, upper-right or centre of the part's outline "
        "(the same for all commands), or a point x,y",
        unit="mm",
        default_words="the drawing's origin",
        of_file=True,
    )
    strict: bool = option(
        "flag",
        False,
        "refuse input with skipped or repaired entities, and programs with dangerous moves",
    )


@dataclass(frozen=True)
class SheetOptions(OptionGroup):
    """Layers and open lines of sheet drawings."""

    section: ClassVar[str] = "sheet"
    title: ClassVar[str] = "Sheet drawings"
    of_file: ClassVar[bool] = True

    cut_layers: tuple[str, ...] = option(
        "names", (), "layers to cut; * and ? are wildcards", default_words="all others"
    )
    mark_layers: tuple[str, ...] = option(
        "names", (), "layers to mark instead of cutting", default_words="MARK*, SCRIBE*, ENGRAV*, ETCH*"
    )
    sheet_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers with the sheet outline",
        default_words="SHEET*, PLATE*, STOCK* if they hold one outline around everything else",
    )
    ignore_layers: tuple[str, ...] = option("names", (), "layers to ignore", default_words="none")
    join_tolerance: float = option(
        "quantity",
        0.05,
        "join line ends closer than this",
        unit="mm",
        minimum=1e-4,
        maximum=5,
    )
    open_paths: str = option(
        "text",
        "refuse",
        "what to do with open paths on cut layers",
        choices=("refuse", "cut", "mark", "drop"),
    )


@dataclass(frozen=True)
class PocketDrawingOptions(OptionGroup):
    """Pockets and islands in drawings and pictures."""

    section: ClassVar[str] = "pocket_drawing"
    title: ClassVar[str] = "Pocket drawings"
    of_file: ClassVar[bool] = True

    outline: str | None = option(
        "text",
        None,
        "meaning of the outermost outlines: edges of plates that contain pockets (edge), or pockets that may contain "
        "islands (pocket)",
        choices=("edge", "pocket"),
        default_words="by layer; required for nested outlines",
        needs=(when_input_is_not("picture", "wkt", "step"),),
    )
    pocket_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers with pocket outlines; * and ? are wildcards",
        default_words="POCKET* if present",
        needs=(when_input_is_not("picture", "wkt"),),
    )
    island_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers with island outlines; * and ? are wildcards",
        default_words="ISLAND* if present",
        needs=(when_input_is_not("picture", "wkt"),),
    )
    pixel_size: float | None = option(
        "quantity",
        None,
        "size of one pixel, such as 0.1mm",
        unit="mm",
        minimum=1e-4,
        maximum=100,
        default_words="required for pictures",
        needs=(when_input_is("picture"),),
    )
    threshold: float | None = option(
        "percent",
        None,
        "brightness threshold: mill pixels darker than this",
        minimum=0,
        maximum=100,
        default_words="Otsu's method",
        needs=(when_input_is("picture"),),
    )
    speckle: float = option(
        "quantity",
        1.0,
        "ignore spots that are narrower than this in a picture",
        unit="mm",
        minimum=0,
        maximum=100,
        needs=(when_input_is("picture"),),
    )
    invert: bool = option("flag", False, "mill the bright areas of a picture", needs=(when_input_is("picture"),))
