"""Options of the stock that a program cuts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.condition import when_absent
from leafcut.options.option_spec import OptionGroup, option


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
        "cell size of the stock model; a cell takes 4 bytes, at most 64 million cells (256 MB)",
        unit="mm",
        minimum=0.001,
        maximum=100,
        default_words="a fortieth of the smallest tool, up to a fifth of it for a large stock",
    )
