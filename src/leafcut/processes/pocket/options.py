"""Options for pockets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class PocketOptions(OptionGroup):
    """Options for clearing pockets.

    `JobOptions` contains the depth, safe height, retract height, spindle speed, and start and end points.
    """

    section: ClassVar[str] = "pocket"
    title: ClassVar[str] = "Pockets"

    strategy: str = option(
        "text",
        "best",
        "clearing strategy; best tries all and writes the one with the fewest retracts within 5 % of the lowest cost",
        choices=("best", "zigzag", "contour", "connected", "firefly", "ants", "adaptive"),
    )
    pocket_top: str = option(
        "text",
        "highest",
        "top of the material over the pockets of a solid: its highest point, or the surface around each pocket if the "
        "rest of the solid is already milled",
        choices=("highest", "surface"),
        of_file=True,
    )
    stock: float = option(
        "quantity",
        0.0,
        "stock that roughing leaves on the walls for the finishing pass",
        unit="mm",
        minimum=0,
        maximum=100,
    )
    max_engagement: float | None = option(
        "quantity",
        None,
        "maximum tool engagement angle",
        unit="rad",
        minimum=0.17,
        maximum=3.1416,
        default_words="unlimited",
    )
    entry: str = option(
        "text",
        "ramp",
        "entry move to each level; without room for it, a helix replaces a ramp and vice versa, or the tool plunges",
        choices=("ramp", "helix", "plunge", "predrilled"),
        default_words="ramp: along the start of the path",
    )
