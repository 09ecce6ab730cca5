"""Options of putting another CAM's program in order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class ResequenceOptions(OptionGroup):
    """How a program of another CAM is put in order."""

    section: ClassVar[str] = "resequence"
    title: ClassVar[str] = "Programs of other CAMs"

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
    renumber: bool = option("flag", False, "give the blocks new N-numbers, in steps of 10")
