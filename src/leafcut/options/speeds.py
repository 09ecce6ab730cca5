"""Options for choosing spindle speeds and feeds: the work, its costs, and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.model.kinds import ToolMaterial
from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class SpeedOptions(OptionGroup):
    """Choice of spindle speeds and feeds."""

    section: ClassVar[str] = "speeds"
    title: ClassVar[str] = "Speeds and feeds"

    tool_material: str = option(
        "text",
        ToolMaterial.HSS.value,
        "cutting material of tools whose library does not state it",
        choices=tuple(ToolMaterial),
    )
    shop_rate: float | None = option(
        "number",
        None,
        "cost of machine and operator per hour, in any currency",
        minimum=0,
        maximum=1e6,
        default_words="60 for cutting-data, else 0",
    )
