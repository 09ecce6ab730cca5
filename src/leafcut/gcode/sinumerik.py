"""Parser for the subset of Siemens SINUMERIK blocks that leafcut writes. All other blocks are errors.

    N10 G0 X1 Y2 ; a comment
    T="3"
    G2 X5 Y0 CR=2.5
    G0 SUPA Z0 D0
    MCALL CYCLE82(25,2,0,-5.5,,0.25)

Parentheses do not enclose comments. The arguments RTP, RFP, SDIS and DP of a cycle are the height after the cycle, the
reference plane, the clearance above that plane, and the bottom of the hole. R on other controls corresponds to RFP +
SDIS.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from leafcut.gcode.interpreter import Interpreter
from leafcut.gcode.state import InterpreterState
from leafcut.gcode.word_groups import SortedBlock
from leafcut.gcode.words import NUMBER, Block, BlockError, Word, parse_words
from leafcut.message import Message
from leafcut.model.toolpath import DrillCycle

_CALL = re.compile(r"(?:N\d+\s*)?MCALL(?:\s+(CYCLE8[1-3])\s*\(([^()]*)\))?\s*", re.IGNORECASE)
_NUMBER = re.compile(NUMBER)
_TOOL = re.compile(r'\bT\s*=\s*"(\d{1,5})"', re.IGNORECASE)
_RADIUS = re.compile(r"\bCR\s*=\s*", re.IGNORECASE)
_SUPA = re.compile(r"\bSUPA\b", re.IGNORECASE)
_MOST_ARGUMENTS = {"CYCLE81": 4, "CYCLE82": 6, "CYCLE83": 12}


class SinumerikInterpreter(Interpreter):
    """Executes programs for Siemens controls line by line.

    `state.call` is the cycle that runs at every position (MCALL).
    """

    def run_line(self, line: str, number: int) -> None:
        """Parse and execute one line."""
        call = _CALL.fullmatch(line.partition(";")[0].strip())
        if call is None:
            self.run(parse_block(line, number))
            return
        self._reset_block_results()
        self.state.line = number
        self._blocks += 1
        if call[1]:
            _call_cycle(self.state, call[1].upper(), [argument.strip() for argument in call[2].split(",")])
        else:
            self.state.call = None
            self.state.path.end_cycles()

    def _move(self, words: SortedBlock) -> None:
        if self.state.call is None:
            super()._move(words)
        else:
            _drill_position(self.state, self.state.call, words)


def parse_block(line: str, number: int) -> Block:
    """Parse a line without MCALL.

    Raises
    ------
    BlockError
        A word is unsupported, such as an expression or a parameter.
    """
    body, _, comment = line.partition(";")
    body = body.strip()
    comments = (comment.strip(),) if comment.strip() else ()
    if re.search(r"\bR\s*[+-]?[\d.]", body, re.IGNORECASE):
        raise BlockError("R is a parameter of Siemens controls; the radius of an arc is CR=")
    plain = _SUPA.sub("G53", _RADIUS.sub("R", _TOOL.sub(r"T\1", body)))
    if "(" in plain or "=" in plain or '"' in plain:
        raise BlockError(
            "'{}' is not understood: leafcut reads only Siemens programs that it wrote itself", _printable(body)
        )
    return Block(number, parse_words(plain), comments)


def _printable(text: str) -> str:
    return re.sub(r"[^\x20-\x7e]+", " ", text[:30])


def _call_cycle(state: InterpreterState, name: str, arguments: Sequence[str]) -> None:
    """Execute MCALL with a cycle. The cycle then runs in every following block with a position.

    Raises
    ------
    BlockError
        An argument is missing, or has a value that leafcut does not write.
    """
    if state.call is not None:
        raise BlockError("MCALL within MCALL; an MCALL without a cycle is missing before it")
    if len(arguments) > _MOST_ARGUMENTS[name]:
        raise BlockError("{} with {} arguments: leafcut reads only its own Siemens programs", name, len(arguments))
    values = dict(zip(_ARGUMENTS[name], arguments, strict=False))
    if state.incremental or state.plane != 17:
        raise BlockError("{} is understood only in the XY plane (G17) with G90", name)
    rtp, rfp, sdis, bottom = (_length_argument(state, name, values, key) for key in ("RTP", "RFP", "SDIS", "DP"))
    if sdis < 0.0:
        raise BlockError("{}: SDIS must not be negative", name)
    r_plane, here = rfp + sdis, state.path.position[2]
    if not (math.isfinite(here) and here >= r_plane and rtp >= r_plane > bottom):
        raise BlockError("{}: RTP and the tool must be at the reference plane or above it, and DP below it", name)
    if rtp not in (r_plane, here):
        raise BlockError("{}: RTP is neither the reference plane nor the height of the tool", name)
    peck = dwell = 0.0
    if name == "CYCLE82":
        dwell = _number_argument(name, values, "DTB")
        if dwell < 0.0:
            raise BlockError("CYCLE82: a negative dwell is a number of revolutions, which leafcut does not read")
    if name == "CYCLE83":
        wrong = [key for key, value in _FIXED.items() if values.get(key, "") != value]
        if wrong:
            raise BlockError("CYCLE83: {} must be {}", wrong[0], _FIXED[wrong[0]] or Message("empty"))
        peck = r_plane - _length_argument(state, name, values, "FDEP")
        if not peck > 0.0:
            raise BlockError("CYCLE83: FDEP must be below the reference plane")
    of_name = {"CYCLE81": "G81", "CYCLE82": "G82"}.get(name) or {"0": "G73", "1": "G83"}.get(values.get("VARI", ""))
    if of_name is None:
        raise BlockError("CYCLE83: VARI must be 0 or 1")
    state.call = DrillCycle(of_name, r_plane, bottom, rtp > r_plane, peck, dwell)


_BASE = ("RTP", "RFP", "SDIS", "DP", "DPR")
_ARGUMENTS = {
    "CYCLE81": _BASE,
    "CYCLE82": (*_BASE, "DTB"),
    "CYCLE83": (*_BASE, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI"),
}
#: Fixed arguments of CYCLE83: all pecks have the same depth, the cycle does not dwell, and the first peck runs at the
#: full feed.
_FIXED = {"DPR": "", "FDPR": "", "DAM": "0", "DTB": "0", "DTS": "0", "FRF": "1"}


def _number_argument(name: str, values: dict[str, str], key: str) -> float:
    text = values.get(key, "")
    if not _NUMBER.fullmatch(text):
        raise BlockError("{} needs {}, a number", name, key)
    return float(text)


def _length_argument(state: InterpreterState, name: str, values: dict[str, str], key: str) -> float:
    return state.mm(Word(key, _number_argument(name, values, key), values[key]))


def _drill_position(state: InterpreterState, cycle: DrillCycle, words: SortedBlock) -> None:
    """Drill at the position of a block. While MCALL is active, every block that moves drills, even with only F or G0.

    Raises
    ------
    BlockError
        The block contains more than a position and G0, and would drill an unintended hole.
    """
    letters = words.letters
    if words.m or set(words.g) - {"motion"} or not letters or not set(letters) <= {"X", "Y"}:
        raise BlockError(
            "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow MCALL"
        )
    if state.motion != 0:
        raise BlockError("a hole must be approached with G0")
    x, y = (state.take_target(letters, axis) for axis in range(2))
    here = state.path.position
    place = (here[0] if x is None else x, here[1] if y is None else y)
    if not all(map(math.isfinite, place)):
        raise BlockError("the position of the hole is unknown, because X and Y are not both given")
    state.path.drill(*place, cycle, feed=state.feed_for(letters, math.nan), line=state.line)
