"""Options of the choice of spindle speeds and feeds: what is made, what it costs, and what limits it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.model.kinds import ToolMaterial
from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class SpeedOptions(OptionGroup):
    """How speeds and feeds are chosen."""

    section: ClassVar[str] = "speeds"
    title: ClassVar[str] = "Speeds and feeds"

    holes: int | None = option(
        "whole",
        None,
        "holes of every drill in one part",
        minimum=1,
        maximum=1_000_000,
        default_words="from the drawing",
        needs="!input=drawing",
    )
    move_time: float = option(
        "quantity",
        1.5,
        "time from one hole to the next, up and down included",
        unit="s",
        minimum=0,
        maximum=3600,
        needs="holes",
    )
    drill_diameter: float | None = option(
        "quantity",
        None,
        "diameter of the drill, without --tools",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        needs="!tools !input=drawing",
    )
    tool_material: str = option(
        "text",
        ToolMaterial.HSS.value,
        "cutting edges of tools whose library does not say their material",
        choices=tuple(ToolMaterial),
    )
    tool_numbers: tuple[str, ...] = option(
        "names",
        (),
        "numbers of the tools to choose speeds for, such as 1,3",
        default_words="all drills, and with --cut-length all end mills",
    )
    cut_length: float | None = option(
        "quantity",
        None,
        "length that every end mill is fed in the material for one part",
        unit="mm",
        minimum=0.001,
        maximum=1e7,
        default_words="end mills are left out",
        needs="tools",
    )
    cut_width: float | None = option(
        "quantity",
        None,
        "width of an end mill's cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="the tool's diameter: a slot",
        needs="cut_length",
    )
    cut_depth: float | None = option(
        "quantity",
        None,
        "depth of an end mill's cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="half of the tool's diameter",
        needs="cut_length",
    )
    shop_rate: float = option(
        "number", 60.0, "cost of machine and operator by the hour, in any currency", minimum=0, maximum=1e6
    )
    tool_cost: float = option(
        "number",
        10.0,
        "cost of one life of a tool, new or reground, in the same currency; `life_cost` in the library goes before",
        minimum=0,
        maximum=1e6,
    )
    worn_change: float = option(
        "quantity",
        120.0,
        "time to replace a worn tool and to set its length",
        unit="s",
        minimum=0,
        maximum=36_000,
    )
    min_life: float = option(
        "quantity", 300.0, "shortest tool life allowed, in the cut", unit="s", minimum=1, maximum=360_000
    )
    max_life: float = option(
        "quantity",
        14_400.0,
        "longest tool life that is counted on, in the cut: then the tool is replaced",
        unit="s",
        minimum=1,
        maximum=3_600_000,
    )
    speed_step: float = option("quantity", 10.0, "step of spindle speeds", unit="rpm", minimum=1, maximum=10_000)
    feed_step: float = option("quantity", 5.0 / 60.0, "step of feed rates", unit="mm/s", minimum=1e-3, maximum=100)
    min_chip: float | None = option(
        "quantity",
        None,
        "least feed of a drill per revolution, of a mill per tooth",
        unit="mm",
        minimum=1e-4,
        maximum=10,
        default_words="a quarter of the highest",
    )
    max_chip: float | None = option(
        "quantity",
        None,
        "highest feed of a drill per revolution, of a mill per tooth",
        unit="mm",
        minimum=1e-4,
        maximum=10,
        default_words="from the material, by the tool's diameter",
    )
    max_power: float | None = option(
        "quantity",
        None,
        "limit of the spindle's power",
        unit="W",
        minimum=1,
        maximum=1e6,
        default_words="the machine's, else none",
    )
    max_torque: float | None = option(
        "quantity",
        None,
        "limit of the spindle's torque",
        unit="N·mm",
        minimum=1,
        maximum=1e8,
        default_words="the machine's, else none",
    )
    max_thrust: float | None = option(
        "quantity",
        None,
        "limit of a drill's thrust",
        unit="N",
        minimum=1,
        maximum=1e6,
        default_words="the machine's, else none",
    )
    drive_efficiency: float = option(
        "share", 0.75, "part of the spindle's power that reaches the tool", minimum=0.05, maximum=1
    )
