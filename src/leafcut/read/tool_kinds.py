"""What other programs call the kinds of tools."""

from __future__ import annotations

import re
from typing import Any

#: Name of a preset (feeds and speeds for one material), and the tool with it as the values of a ``[[tool]]``.
Preset = tuple[str, dict[str, Any]]
#: Name of a tool, and its values, or the reason why leafcut leaves it out.
ToolRow = tuple[str, dict[str, Any] | str]
#: The same before one of its presets is chosen.
RawRow = tuple[str, dict[str, Any] | str | list[Preset]]

#: What a comment calls a tool, the first that fits.
_IN_WORDS = (
    ("centre-drill", r"\b(centre|center|spot)[\s-]*drill|\bspot(ting)?\b"),
    ("reamer", r"\bream"),
    ("slot-mill", r"\bslot[\s-]*(mill|drill|cutter)|\brouter\b"),
    ("ball-mill", r"\bball[\s-]*(nose|end)"),
    ("end-mill", r"\b(flat\s*)?end[\s-]*mill"),
    ("drill", r"\bdrill\b"),
)
#: What cuts otherwise than by its words: no flat end, no hole of its width.
_OTHER_WORDS = re.compile(r"\b(tap|bull|chamfer|v-?bit|engrav|face|fly|thread|probe|dove)(?!\s*drill)", re.IGNORECASE)
FUSION_KINDS = {
    "drill": "drill", "center drill": "centre-drill", "spot drill": "centre-drill", "reamer": "reamer",
    "flat end mill": "end-mill", "bull nose end mill": "end-mill", "ball end mill": "ball-mill",
    "chamfer mill": "chamfer-mill", "slot mill": "slot-mill", "tap right hand": "tap",
}  # fmt: skip


def kind_in(comment: str) -> str | None:
    """Return the kind that a comment says, or None."""
    if _OTHER_WORDS.search(comment):
        return None
    return next((kind for kind, words in _IN_WORDS if re.search(words, comment, re.IGNORECASE)), None)
