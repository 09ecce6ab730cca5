"""Options of engraving."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class EngraveOptions(OptionGroup):
    """Options for engraving lines. `JobOptions` holds depth, heights, and the first and last position."""

    section: ClassVar[str] = "engrave"
    title: ClassVar[str] = "Engraving"

    engraver: int = option("whole", 1, "number of the engraving tool", minimum=1, maximum=9999)
    engraving_feed: float = option("quantity", 5.0, "feed along the lines", unit="mm/s", minimum=0.01)
    engraving_speed: float = option("quantity", 3000.0, "spindle speed", unit="rpm", minimum=1)
