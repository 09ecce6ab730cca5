"""Options for feeds adapted to the chip, in programs of leafcut and of other CAM systems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class FeedOptions(OptionGroup):
    """Feeds of milling tools adapted to their engagement."""

    section: ClassVar[str] = "feeds"
    title: ClassVar[str] = "Feeds by the chips"

    feeds: bool = option(
        "flag",
        False,
        "adapt the feeds of milling tools to the chip thickness: faster where the tool cuts less than in its worst "
        "cut, slower where the worst cut exceeds the tool's data; a foreign program also needs --workpiece",
    )
