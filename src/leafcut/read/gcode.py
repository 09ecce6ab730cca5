"""G-code programs: known by their look, and left to those who run them."""

from __future__ import annotations

import re

from leafcut.errors import ReadError
from leafcut.gcode.languages import other_language
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read.format import Format, Match, Source

EXTENSIONS = (".nc", ".ngc", ".gcode", ".gc", ".tap", ".cnc", ".min", ".eia", ".pim")

#: So many lines are looked at, and so large a part of them must look like blocks.
_LINES, _SHARE = 60, 0.8

# A block: marks, then words of a letter and a number; or a comment, a percent sign, an O-word, an assignment.
# What has matched is not tried in another way: that would take for ever where a long line is cut off.
_BLOCK = re.compile(
    rb"\s*(%.*|[(;].*|[oO]\s*(\d+|<).*|#.*|/?\s*+([A-Za-z]\s*+[+-]?(\d++\.?\d*+|\.\d++|[\[#].*)\s*+)++([(;].*)?|)\s*"
)
_CODE = re.compile(rb"\b[GgMm]\s*0*\d{1,3}(?!\d)")


def _sniff(head: bytes) -> Match:
    if b"\0" in head:
        return Match.NO
    lines = [line[:300] for line in head.splitlines()[:_LINES] if line.strip()]
    blocks = sum(_BLOCK.fullmatch(line) is not None for line in lines)
    codes = sum(_CODE.search(line) is not None for line in lines)
    if lines and codes and blocks >= _SHARE * len(lines):
        return Match.MAYBE
    # Programs in other languages come here, to be refused by their name.
    return Match.MAYBE if other_language(head.decode("latin-1")) else Match.NO


def _read(source: Source, _: ReadOptions) -> Part:
    raise ReadError(source.path, "this is a program, not a drawing; give it to leafcut optimize, simulate or verify")


FORMAT = Format(
    "gcode",
    EXTENSIONS,
    "G-code program of any CAM, to be put in a better order",
    _read,
    _sniff,
    processes=("program",),
)
