"""Converts a program to the lines to send. Comments, blanks and words that the dialect lacks are removed.

M0 and M6 become pauses and are never sent. At a pause, the machine is at rest, and the operator is asked to continue.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from leafcut.errors import ReadError, printable
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import BlockError, Word, parse_words, split_line
from leafcut.message import Message
from leafcut.sender.character_counting import SentLine

#: Maximum line length in GRBL without the line ending (LINE_BUFFER_SIZE in protocol.h).
LONGEST_LINE = 79
#: Letters that GRBL understands (gcode.c). N is not sent.
_LETTERS = frozenset("FGIJKLMPRSTXYZ")
#: Maximum number of lines between a pause and the comment above it that explains the pause.
_REACH = 3


@dataclass(frozen=True)
class Pause:
    """A stop at a program line.

    The program pauses for a tool change, for the operator, or before a hole. `hole` is the number of that hole, or 0
    for other pauses. `tool` is the number of the new tool, if it is known.
    """

    number: int
    change: bool = False
    tool: int | None = None
    remark: str = ""
    hole: int = 0

    def __str__(self) -> str:
        if self.hole:
            return Message("line {}: before hole {}", self.number, self.hole)
        if not self.change:
            message = Message("line {}: pause", self.number)
        elif self.tool is None:
            message = Message("line {}: change the tool", self.number)
        else:
            message = Message("line {}: mount tool T{}", self.number, self.tool)
        return Message("{} ({})", message, self.remark) if self.remark else message


SentStep = SentLine | Pause

#: Units of the P word in a dwell, s.
_DWELL_UNITS = {"s": 1.0, "ms": 0.001, "cs": 0.01}


def convert_to_dialect(dialect: Dialect, *texts: str) -> list[str]:
    """Convert lines such as ``G21 G90 F100`` to a controller's dialect, and remove the words that the dialect lacks.

    Some controllers accept only one command per line. For these, a lone ``F100`` becomes ``G1 F100``, which does not
    move the machine. All other words without a command are removed.
    """
    return [line for text in texts for line in _convert_line(dialect, text)]


def _convert_line(dialect: Dialect, text: str) -> list[str]:
    commands: list[list[str]] = []
    for word in parse_words(text):
        if word.letter == "G" and round(word.value * 10) not in dialect.g_codes:
            continue
        if word.letter == "M" and word.value not in dialect.m_codes:
            continue
        if not commands or (dialect.one_command and word.letter in "GM"):
            alone = dialect.one_command and word.letter not in "GM"
            if alone and word.letter != "F":
                continue
            commands.append(["G1"] if alone else [])
        commands[-1].append(_word_text(word))
    return [_join_words(dialect, command) for command in commands]


def dwell_command(dialect: Dialect, seconds: float) -> str:
    """Return the command that makes the controller wait for `seconds`."""
    return f"G4 P{seconds / _DWELL_UNITS[dialect.dwell_unit]:g}"


def _join_words(dialect: Dialect, parts: Sequence[str]) -> str:
    return (" " if dialect.one_command else "").join(parts)


@dataclass(frozen=True)
class DrilledHole:
    """A hole with its position (x, y) in mm, the line of the move to the hole, and the line of its last cut.

    Holes are numbered in program order.
    """

    number: int
    x: float
    y: float
    first: int
    last: int


def insert_pauses_at_holes(steps: Sequence[SentStep], holes: Sequence[DrilledHole]) -> list[SentStep]:
    """Insert a pause before the first line of each hole."""
    waiting = deque(holes)
    with_pauses: list[SentStep] = []
    for step in steps:
        while waiting and step.number >= waiting[0].first:
            hole = waiting.popleft()
            if step.number == hole.first:
                with_pauses.append(Pause(hole.first, hole=hole.number))
        with_pauses.append(step)
    return with_pauses


def steps_from_lines(lines: Sequence[str], dialect: Dialect, file: str, first: int = 1) -> list[SentStep]:
    """Convert a program from line `first` to its end (M2, M30) into steps to send, including its pauses.

    Raises `ReadError` if a line is too long, contains a word or letter that the controller lacks, or is a system
    command ($).
    """
    reader = _LineReader(dialect)
    steps: list[SentStep] = []
    for number, line in enumerate(lines, 1):
        try:
            line_steps = reader.read(line, number)
        except BlockError as problem:
            raise ReadError(file, str(problem), number) from None
        if number >= first:
            steps += line_steps
        if reader.ended:
            break
    return steps


class _LineReader:
    def __init__(self, dialect: Dialect) -> None:
        self.dialect, self.ended, self.begun = dialect, False, False
        # Marlin treats M1 as M0 (M0_M1.cpp); other firmwares ignore it.
        self.stops = {0, 1} if dialect.one_command else {0}
        self.tool: int | None = None
        self.chosen = self.remarked = -_REACH
        self.remark = ""

    def read(self, line: str, number: int) -> list[SentStep]:
        body, comments = split_line(line.strip(), nested=True)
        if body.startswith("%"):
            self.ended = self.begun
            return []
        words = parse_words(body.removeprefix("/"))
        self._refuse_unknown_words(words)
        if comments:
            self.remark, self.remarked = printable(comments[-1]), number
        for word in words:
            if word.letter == "T":
                self.tool, self.chosen = int(word.value), number
        self.begun |= bool(words)
        codes = {int(word.value) for word in words if word.letter == "M"}
        self.ended = bool(codes & {2, 30})
        text = _join_words(self.dialect, [_word_text(word) for word in words if not _is_handled_by_sender(word)])
        if self.dialect.one_command and codes & {*self.stops, 6}:
            text = ""  # text after M0 is a message for the operator
        if len(text) > LONGEST_LINE:
            reason = Message("the line has {} characters without blanks and comments", len(text))
            raise BlockError("{}, {} takes {}", reason, self.dialect.name, LONGEST_LINE)
        steps: list[SentStep] = [SentLine(text, number)] if text else []
        if 6 in codes:
            steps.insert(0, self._create_pause(number, change=True))
        if codes & self.stops:
            # A stop directly after a tool selection is a manual tool change.
            steps.append(self._create_pause(number, change=number - self.chosen < _REACH))
        return steps

    def _create_pause(self, number: int, *, change: bool) -> Pause:
        self.chosen = -_REACH
        remark = self.remark if number - self.remarked <= _REACH else ""
        return Pause(number, change, self.tool if change else None, remark)

    def _refuse_unknown_words(self, words: Sequence[Word]) -> None:
        for word in words:
            known = word.letter in _LETTERS or word.letter == "N"
            if word.letter == "G":
                known = round(word.value * 10) in self.dialect.g_codes
            elif word.letter == "M":
                known = word.value in self.dialect.m_codes or word.value == 6
            elif word.letter == "T" and self.dialect.one_command:
                known = words[0].letter == "M" and words[0].value in (0, 6)
            if not known:
                advice = Message("post the program for this controller, or name its --dialect")
                raise BlockError("{} is not a word of {}; {}", word, self.dialect.name, advice)


def _is_handled_by_sender(word: Word) -> bool:
    return word.letter == "N" or (word.letter == "M" and word.value in (0, 6))


def _word_text(word: Word) -> str:
    return f"{word.letter}{word.text.removeprefix('+')}"
