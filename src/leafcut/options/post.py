"""Options of written programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """Format of the written program."""

    section: ClassVar[str] = "post"
    title: ClassVar[str] = "Program"

    dialect: str | None = option(
        "text",
        None,
        "dialect of the controller (see `leafcut list dialects`), or path of a TOML file",
        default_words="the machine's",
        may_be_path=".toml",
    )
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option("whole", 1, "program number, O0001", minimum=1, maximum=9999, of_file=True)
    header: bool = option(
        "flag",
        True,
        "write header comments: source, options, tools, extents, time",
    )
    coolant: bool = option("flag", False, "turn coolant on while cutting")
    beam_power: int = option(
        "whole",
        1000,
        "laser power for cutting, S word (GRBL: value of $30)",
        minimum=1,
        maximum=1_000_000,
        of_file=True,
    )
    mark_power: int = option(
        "whole", 200, "laser power for marking, S word", minimum=1, maximum=1_000_000, of_file=True
    )
    material_number: int | None = option(
        "whole",
        None,
        "material number in the controller's table (QtPlasmaC M190); the controller then sets the feed",
        minimum=0,
        maximum=9_999_999,
        default_words="none: the program contains the cutting data",
        of_file=True,
    )
