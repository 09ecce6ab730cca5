"""Options of cutting: end mill, cutting data, stock, and the choice of speeds and feeds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.model.kinds import ToolMaterial
from leafcut.options.option_spec import OptionGroup, option, when_absent, when_one_of


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


@dataclass(frozen=True)
class CutDataOptions(OptionGroup):
    """Cutting process and cutting data of a sheet, from a cut chart or given explicitly.

    Material and thickness are in `JobOptions`.
    """

    section: ClassVar[str] = "cut_data"
    title: ClassVar[str] = "Cutting data"

    cut_process: str | None = option(
        "text",
        None,
        "cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW",
        default_words="the machine's, else plasma",
    )
    amps: float | None = option(
        "number",
        None,
        "cutting current, if the chart has several",
        minimum=0,
        default_words="the fastest in the chart that can pierce the sheet",
        of_file=True,
    )
    nozzle: str | None = option(
        "text",
        None,
        "nozzle, if the chart has several",
        default_words="any in the chart",
        of_file=True,
    )
    chart: Path | None = option(
        "path",
        None,
        "cut chart of your own, a CSV file",
        default_words="leafcut's chart",
    )
    kerf: float | None = option(
        "quantity",
        None,
        "kerf width",
        unit="mm",
        minimum=0,
        maximum=50,
        default_words="the chart's; 2 mm for nesting",
    )
    cut_speed: float | None = option(
        "quantity",
        None,
        "cutting speed",
        unit="mm/s",
        minimum=0.01,
        default_words="the chart's",
        of_file=True,
    )


@dataclass(frozen=True)
class StockOptions(OptionGroup):
    """Material before the first cut, and resolution of its model."""

    section: ClassVar[str] = "stock"
    title: ClassVar[str] = "Stock"

    workpiece: str | None = option(
        "text",
        None,
        "material before the first cut, in program coordinates: x,y,z of the lower and of the upper corner of a block, "
        "or an STL file in mm, or a STEP file",
        default_words="derived from the program: a block around the cuts below Z0 (stock), or all space that no rapid "
        "has crossed (reorder --air)",
        may_be_path=(".stl", ".step", ".stp"),
        of_file=True,
    )
    part: str | None = option(
        "text",
        None,
        "STEP file, or STL file in mm, of the finished part that the program was made for; the stock is this part "
        "before the program's own cuts, at the position in the program's header",
        default_words="a block (--workpiece)",
        needs=(when_absent("workpiece"),),
        may_be_path=(".stl", ".step", ".stp"),
        of_file=True,
    )
    cell: float | None = option(
        "quantity",
        None,
        "cell size of the stock model, which has at most 64 million cells of 4 bytes (256 MB)",
        unit="mm",
        minimum=0.001,
        maximum=100,
        default_words="1/40 of the smallest tool diameter, up to 1/5 of it for large stock",
    )


@dataclass(frozen=True)
class FeedOptions(OptionGroup):
    """Feeds of milling tools adapted to their engagement."""

    section: ClassVar[str] = "feeds"
    title: ClassVar[str] = "Feeds by chip thickness"

    feeds: bool = option(
        "flag",
        False,
        "adapt the feeds of milling tools to the chip thickness: faster where the tool cuts less than in its "
        "worst cut, slower where the worst cut exceeds the tool's data; a program of another CAM also needs "
        "--workpiece",
    )


@dataclass(frozen=True)
class SpeedOptions(OptionGroup):
    """Choice of spindle speeds and feeds."""

    section: ClassVar[str] = "speeds"
    title: ClassVar[str] = "Speeds and feeds"

    tool_material: str = option(
        "text",
        ToolMaterial.HSS.value,
        "tool material (HSS or carbide) of tools for which the library does not state it",
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
