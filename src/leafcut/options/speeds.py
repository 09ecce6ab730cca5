"""Options for choosing spindle speeds and feeds: the work, its costs, and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.model.kinds import ToolMaterial
from leafcut.options.condition import given, input_is_not
from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class SpeedOptions(OptionGroup):
    """Choice of spindle speeds and feeds."""

    section: ClassVar[str] = "speeds"
    title: ClassVar[str] = "Speeds and feeds"

    holes: int | None = option(
        "whole",
        None,
        "holes of every drill in one part",
        minimum=1,
        maximum=1_000_000,
        default_words="from the drawing",
        needs=(input_is_not("drawing"),),
    )
    tool_material: str = option(
        "text",
        ToolMaterial.HSS.value,
        "cutting material of tools whose library does not state it",
        choices=tuple(ToolMaterial),
    )
    cut_length: float | None = option(
        "quantity",
        None,
        "length that every end mill is fed in the material for one part",
        unit="mm",
        minimum=0.001,
        maximum=1e7,
        default_words="end mills are left out",
        needs=(given("tools"),),
    )
    shop_rate: float | None = option(
        "number",
        None,
        "cost of machine and operator by the hour, in any currency",
        minimum=0,
        maximum=1e6,
        default_words="60 for cutting-data, else 0",
    )
