"""Options for milling a part: operations by layer, copies, finishing passes, and tabs that hold the part during
milling.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_absent, when_given


@dataclass(frozen=True)
class PartOptions(OptionGroup):
    """Operations by layer, finishing, and tabs: bridges of material that hold a part, or a slug."""

    section: ClassVar[str] = "part"
    title: ClassVar[str] = "Parts"

    operations: Path | None = option(
        "path",
        None,
        'file of operations (TOML): under [layer], one line for each layer, such as POCKET = "pocket 3mm"; the '
        "operations are profile, bore, pocket, engrave and ignore",
        default_words="closed outlines are milled through the plate",
        of_file=True,
    )
    copies: str | None = option(
        "text",
        None,
        "columns and rows of copies on the plate, such as 3x2; the first has the place of the drawing, the others "
        "follow in X and Y; or the work offsets of several fixtures, such as G54,G55, each of which holds a plate",
        default_words="the drawing once",
        of_file=True,
    )
    copy_spacing: float | None = option(
        "quantity",
        None,
        "gap between two copies; it must leave room for the mill and the tabs",
        unit="mm",
        minimum=0.1,
        maximum=10_000,
        default_words="needed with columns and rows of --copies, unless --pitch is given",
        needs=(when_given("copies"), when_absent("pitch")),
        of_file=True,
    )
    pitch: tuple[float, ...] | None = option(
        "point",
        None,
        "distance from a point of a copy to the same point of the next copy, in X and Y, such as 60,40",
        unit="mm",
        default_words="size of the part plus --copy-spacing",
        needs=(when_given("copies"),),
        of_file=True,
    )
    finish: float = option(
        "quantity",
        0.0,
        "allowance that roughing leaves on walls, at least 0.1 mm; a finishing pass at full depth removes it; "
        "0 for none",
        unit="mm",
        minimum=0,
        maximum=50,
    )
    tabs: int = option(
        "whole",
        4,
        "number of tabs on each outline, and on each opening that is long enough; a short outline has at least two; "
        "0 for none",
        minimum=0,
        maximum=100,
    )
    tab_width: float = option(
        "quantity",
        6.0,
        "width of a tab between the cuts",
        unit="mm",
        minimum=0.1,
        maximum=200,
        needs=(when_given("tabs"),),
    )
    tab_height: float = option(
        "quantity",
        1.5,
        "height of a tab above the underside of the plate",
        unit="mm",
        minimum=0.05,
        maximum=100,
        default_words="1.5; half the thickness of a plate below 3",
        needs=(when_given("tabs"),),
    )
