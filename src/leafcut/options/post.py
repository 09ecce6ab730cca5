"""Options of the programs that are written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """How the program is written."""

    section: ClassVar[str] = "post"
    title: ClassVar[str] = "Program"

    dialect: str | None = option(
        "text",
        None,
        "name of the controller's dialect (see `leafcut dialects`), or the path of a TOML file",
        default_words="the machine's own",
        may_be_path=True,
    )
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option("whole", 1, "number of the program, O0001", minimum=1, maximum=9999)
    header: bool = option(
        "flag",
        True,
        "write the comments at the top: source, options, tools, extents, time",
    )
    date: bool = option("flag", False, "write the date and time into the header")
    repeat_words: bool = option("flag", False, "repeat modal words on every block")
    coolant: bool = option("flag", False, "coolant on while drilling")
    beam_power: int = option(
        "whole", 1000, "S of a laser's beam when it cuts (GRBL: its $30)", minimum=1, maximum=1_000_000
    )
    mark_power: int = option("whole", 200, "S of a laser's beam when it marks", minimum=1, maximum=1_000_000)
    path_tolerance: float = option(
        "quantity",
        0.1,
        "how far a torch may cut a corner short to keep its speed (P of G64); 0 for not at all",
        unit="mm",
        minimum=0,
        maximum=1,
    )
    material_number: int | None = option(
        "whole",
        None,
        "material of the controller's own table that is cut (QtPlasmaC: M190); its feed is then the controller's",
        minimum=0,
        maximum=9_999_999,
        default_words="the material's figures are written",
    )
