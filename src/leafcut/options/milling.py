"""Options of end mills: tool number, milling direction, and feeds into the material."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_one_of


@dataclass(frozen=True)
class MillingOptions(OptionGroup):
    """The end mill of pockets and outlines."""

    section: ClassVar[str] = "milling"
    title: ClassVar[str] = "Milling"

    tool_number: int | None = option(
        "whole",
        None,
        "tool number of the end mill, also used to select it in the tool library",
        minimum=1,
        maximum=99_999_999,
        default_words="1; with a library, the end mill of --tool-diameter, or the only end mill",
    )
    milling: str = option("text", "climb", "milling direction", choices=("climb", "conventional"))
    entry_angle: float = option(
        "quantity",
        0.05235987755982989,
        "maximum ramp angle",
        unit="rad",
        minimum=0.001,
        maximum=0.8,
        needs=(when_one_of("entry", "ramp", "helix"),),
    )
    plunge_feed: float | None = option(
        "quantity",
        None,
        "plunge rate",
        unit="mm/s",
        minimum=0.001,
        default_words="the tool library's, else a third of the feed rate",
    )
