"""Options of the programs that are read and written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class ResequenceOptions(OptionGroup):
    """How a program of another CAM is put in order."""

    section: ClassVar[str] = "resequence"
    works: ClassVar[str] = "program"

    merge_tools: bool = option("flag", False, "join separated sections of one tool, where nothing forbids it")
    allow_reverse: bool = option(
        "flag",
        False,
        "cut open lines of one depth from either end (slots, engraving, laser), where neither climb milling nor a "
        "lead-in matters; the tool may then go down at what was the end",
    )
    mix_operations: bool = option(
        "flag",
        False,
        "mix the work of operations that a program's comments mark; what frees a part stays behind the work before it",
    )
    keep_order: bool = option(
        "flag", False, "leave the order as it is; of a program, only measure it", works="cut program"
    )
    renumber: bool = option("flag", False, "give the blocks new N-numbers, in steps of 10")


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """How the program is written."""

    section: ClassVar[str] = "post"
    works: ClassVar[str] = "drill cut pocket"

    dialect: str | None = option(
        "text",
        None,
        "controller's dialect: its name, or the path of a TOML file",
        default_words="the machine's own",
        may_be_path=True,
        works="drill cut pocket program",
    )
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option("whole", 1, "number of the program, O0001", minimum=1, maximum=9999)
    header: bool = option(
        "flag",
        True,
        "write the comments at the top: source, options, tools, extents, time",
        works="drill cut pocket program",
    )
    date: bool = option("flag", False, "write the date and time into the header")
    repeat_words: bool = option("flag", False, "repeat modal words on every block")
    coolant: bool = option("flag", False, "coolant on while drilling", works="drill pocket")
    beam_power: int = option(
        "whole", 1000, "S of a laser's beam when it cuts (GRBL: its $30)", minimum=1, maximum=1_000_000, works="cut"
    )
    mark_power: int = option(
        "whole", 200, "S of a laser's beam when it marks", minimum=1, maximum=1_000_000, works="cut"
    )
    path_tolerance: float = option(
        "quantity",
        0.1,
        "how far a torch may cut a corner short to keep its speed (P of G64); 0 for not at all",
        unit="mm",
        minimum=0,
        maximum=1,
        works="cut",
    )
    material_number: int | None = option(
        "whole",
        None,
        "material of the controller's own table that is cut (QtPlasmaC: M190); its feed is then the controller's",
        minimum=0,
        maximum=9_999_999,
        default_words="the material's figures are written",
        works="cut",
    )
