"""Options of a part: operations by layer, and tabs that hold it while it is milled."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_given


@dataclass(frozen=True)
class PartOptions(OptionGroup):
    """Operations by layer, and tabs: bridges of material that hold a part, or the slug of a large opening."""

    section: ClassVar[str] = "part"
    title: ClassVar[str] = "Parts"

    operations: Path | None = option(
        "path",
        None,
        "file of operations (TOML) with the operation of each layer, such as profile, pocket or engrave",
        default_words="closed outlines are milled through the plate",
        of_file=True,
    )
    tabs: int = option(
        "whole",
        4,
        "number of tabs on each outline, and on each opening that is long enough; 0 for none",
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
        "height of a tab over the underside of the plate",
        unit="mm",
        minimum=0.05,
        maximum=100,
        default_words="1.5; half the thickness of a plate below 3",
        needs=(when_given("tabs"),),
    )
