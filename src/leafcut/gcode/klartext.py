"""Reader for the subset of Heidenhain Klartext that leafcut writes: drilling with cycle 200, and straight moves.

    0 BEGIN PGM LEAFCUT MM
    5 TOOL CALL 1 Z S1000
    6 M3
    7 L Z+25 R0 FMAX
    8 CYCL DEF 200 DRILLING ~
      Q200=+2 ;SET-UP CLEARANCE ~
      …
    9 L X+10 Y+5 R0 FMAX M99
    10 END PGM LEAFCUT MM

M99 runs cycle 200: a rapid to the XY position, a rapid down to Q203 + Q200, a feed move to Q203 + Q201, and a rapid up
to Q203 + Q204.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from leafcut.errors import ReadError
from leafcut.gcode.words import MAX_LINE, BlockError, numbered_lines
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.units import SECONDS_PER_MINUTE

#: The parameters of cycle 200, in the order of the control, with the comments that leafcut writes.
CYCLE_200 = {
    "Q200": "SET-UP CLEARANCE",
    "Q201": "DEPTH",
    "Q206": "FEED RATE FOR PLNGNG",
    "Q202": "PLUNGING DEPTH",
    "Q210": "DWELL TIME AT TOP",
    "Q203": "SURFACE COORDINATE",
    "Q204": "2ND SET-UP CLEARANCE",
    "Q211": "DWELL TIME AT DEPTH",
}
#: Tolerance for sums of lengths, mm. The program states lengths with three decimals.
_SAME = 1e-6

_NUMBER = r"[+-]?\d{1,7}(?:\.\d{1,6})?"
_NUMBERED = re.compile(r"(\d{1,7})\s+(.*)")
_BEGIN = re.compile(r"BEGIN PGM (\w{1,32}) MM")
_IGNORED = re.compile(rf"BLK FORM 0\.[12](?: Z)? X{_NUMBER} Y{_NUMBER} Z{_NUMBER}|;.*")
_TOOL = re.compile(r"TOOL CALL (\d{1,5}) Z(?: S(\d{1,6}))?")
_LINE = re.compile(
    rf"L(?: X({_NUMBER}))?(?: Y({_NUMBER}))?(?: Z({_NUMBER}))? R0 F(MAX|\d{{1,6}}(?:\.\d{{1,3}})?)( M99)?"
)
_DWELL = re.compile(rf"CYCL DEF 9\.([01]) DWELL(?: TIME| ({_NUMBER}))")
_Q = re.compile(rf"(Q\d{{3}})=({_NUMBER}) ;[^~]*")
_M_WORDS = ("M0", "M1", "M3", "M4", "M5", "M8", "M9", "M30")


def interpret_klartext(text: str, file: str = "program") -> Toolpath:
    """Interpret a program and return its motions.

    Raises
    ------
    ReadError
        The program has no end, or a block is outside the subset. The message names the line.
    """
    reader = _Reader()
    last = 0
    try:
        for last, block in _split_blocks(text):
            reader.run(block, last)
    except BlockError as problem:
        raise ReadError(file, str(problem), reader.line or last or None) from None
    if not reader.ended:
        raise ReadError(file, "the program has no end; END PGM is missing")
    return reader.path.build()


def _split_blocks(program: str) -> Iterator[tuple[int, str]]:
    """Yield the line number and the text of each block. A continuation line (~) belongs to the block before it.

    Block numbers must be consecutive.
    """
    begin, parts, expected = 0, list[str](), 0
    for number, line in numbered_lines(program):
        if len(line) > MAX_LINE:
            raise BlockError("the line has {} characters; this is not a program", len(line))
        text = " ".join(line.split())
        if not text:
            continue
        if not parts:
            numbered = _NUMBERED.fullmatch(text)
            if numbered is None or int(numbered[1]) != expected:
                raise BlockError(
                    "line {}: block {} is missing, but a Klartext (conversational) program numbers its blocks "
                    "from 0 without gaps; take the file as the controller saved it, or choose the machine of "
                    "this program",
                    number,
                    expected,
                )
            begin, text, expected = number, numbered[2], expected + 1
        more = text.endswith("~") and not text.startswith(";")
        parts.append(text.removesuffix("~").rstrip() if more else text)
        if not more:
            yield begin, "\n".join(parts)
            parts = []
    if parts:
        raise BlockError("the last block is incomplete (~)")


class _Reader:
    def __init__(self) -> None:
        self.path = ToolpathBuilder()
        self.line = 0
        self.ended = self.stopped = False
        self.name = ""
        self.rpm: float | None = None
        self.tool: int | None = None
        self.dwelling = False
        self.cycle: DrillCycle | None = None
        self.after = self.feed = 0.0
        self.coolant = 0

    def run(self, block: str, line: int) -> None:
        self.line = line
        if not self.name:
            self._begin_program(block)
        elif not self._end_program(block) and not _IGNORED.fullmatch(block):
            self._run_block(block)

    def _begin_program(self, block: str) -> None:
        begin = _BEGIN.fullmatch(block)
        if begin is None:
            raise BlockError("a program must start with BEGIN PGM, its name and MM")
        self.name = begin[1]

    def _end_program(self, block: str) -> bool:
        """Return whether the block ends the program. Blocks after the end are refused."""
        if self.ended:
            raise BlockError("the program continues after END PGM")
        if self.dwelling and not block.startswith("CYCL DEF 9.1"):
            raise BlockError("CYCL DEF 9.1, which states the dwell time, is missing")
        if block == f"END PGM {self.name} MM":
            if not self.stopped:
                raise BlockError("the program ends without M30")
            self.ended = True
        elif self.stopped:
            raise BlockError("the program continues after M30")
        return self.ended

    def _run_block(self, block: str) -> None:
        if block in _M_WORDS:
            self._run_m_word(block)
        elif (tool := _TOOL.fullmatch(block)) is not None:
            self.tool, self.rpm = int(tool[1]), None if tool[2] is None else float(tool[2])
            self.path.tool(self.tool, line=self.line)
            self.cycle = None
        elif (dwell := _DWELL.fullmatch(block)) is not None:
            self._run_dwell(dwell)
        elif block.startswith("CYCL DEF 200 DRILLING\n"):
            self._define_cycle(block.split("\n")[1:])
        elif (move := _LINE.fullmatch(block)) is not None:
            self._run_move(move)
        else:
            shown = re.sub(r"[^\x20-\x7e]+", " ", block[:30])
            raise BlockError(
                "'{}' is not understood: leafcut reads only Heidenhain programs that it wrote itself", shown
            )

    def _run_m_word(self, word: str) -> None:
        path = self.path
        if word in ("M3", "M4"):
            if self.rpm is None:
                raise BlockError("{} has no speed, because TOOL CALL lacks S", word)
            path.spindle(self.rpm if word == "M3" else -self.rpm, line=self.line)
        elif word == "M5":
            path.spindle(0.0, line=self.line)
        elif word in ("M8", "M9"):
            path.coolant(2 if word == "M8" else 0, line=self.line)
        elif word == "M30":
            path.end(line=self.line)
            self.stopped = True
        else:
            path.pause(optional=word == "M1", line=self.line)

    def _run_dwell(self, found: re.Match[str]) -> None:
        if (found[1] == "1") != self.dwelling or (found[1] == "1") != (found[2] is not None):
            raise BlockError(
                "a dwell must be written as CYCL DEF 9.0 DWELL TIME, then CYCL DEF 9.1 DWELL and the time in seconds"
            )
        self.dwelling = not self.dwelling
        if found[2] is not None:
            if float(found[2]) < 0.0:
                raise BlockError("a dwell cannot be negative")
            self.path.dwell(float(found[2]), line=self.line)

    def _define_cycle(self, words: list[str]) -> None:
        found = [_Q.fullmatch(one) for one in words]
        names = [one[1] for one in found if one is not None]
        if names != list(CYCLE_200):
            raise BlockError("cycle 200 needs {}, in this order", " ".join(CYCLE_200))
        q = {one[1]: float(one[2]) for one in found if one is not None}
        surface = q["Q203"]
        r_plane, bottom, after = (round(surface + q[key], 6) for key in ("Q200", "Q201", "Q204"))
        if not (q["Q200"] > 0.0 > q["Q201"] and after >= r_plane and q["Q206"] > 0.0):
            raise BlockError("cycle 200: Q200 and Q206 must be above 0, Q201 below it, and Q204 not below Q200")
        if q["Q202"] < -q["Q201"] - _SAME or q["Q210"] != 0.0 or q["Q211"] < 0.0:
            raise BlockError(
                "cycle 200: Q202 must not be less than the depth, Q210 must be 0, and Q211 must not be negative"
            )
        name = "G82" if q["Q211"] else "G81"
        self.path.end_cycles()
        self.cycle = DrillCycle(name, r_plane, bottom, after > r_plane, dwell=q["Q211"])
        self.after, self.feed = after, q["Q206"] / SECONDS_PER_MINUTE

    def _run_move(self, found: re.Match[str]) -> None:
        x, y, z = (None if one is None else float(one) for one in found.groups()[:3])
        if x is None and y is None and z is None:
            raise BlockError("the L block has no axis")
        if self.tool is None:
            raise BlockError("the tool moves before the first TOOL CALL, while its length is unknown")
        rapid = found[4] == "MAX"
        if found[5]:
            self._drill_hole(x, y, z, rapid)
        elif rapid:
            self.path.rapid(x, y, z, line=self.line)
        else:
            if not float(found[4]) > 0.0:
                raise BlockError("the cut has no feed")
            self.path.feed(x, y, z, feed=float(found[4]) / SECONDS_PER_MINUTE, line=self.line)

    def _drill_hole(self, x: float | None, y: float | None, z: float | None, rapid: bool) -> None:
        path, cycle = self.path, self.cycle
        if cycle is None:
            raise BlockError("M99 calls no cycle, because CYCL DEF 200 is missing after the last tool call")
        here = path.position
        place = (here[0] if x is None else x, here[1] if y is None else y)
        if z is not None or not rapid or not all(map(math.isfinite, (*place, here[2]))):
            raise BlockError("a hole must be approached with L X Y R0 FMAX M99, from a known height")
        if here[2] < cycle.r_plane - _SAME:
            raise BlockError("a hole is approached from below its set-up clearance")
        initial = here[2] if path.initial_plane is None else path.initial_plane
        if abs(cycle.height_after(initial) - self.after) > _SAME:
            raise BlockError("Q204 is neither Q200 nor the height of the tool before the cycle")
        path.drill(*place, cycle, feed=self.feed, line=self.line)
