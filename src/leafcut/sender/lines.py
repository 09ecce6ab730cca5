"""A program's text as lines to send: no comments, no blanks, nothing that the dialect lacks, and pauses of our own.

M0 and M6 are never sent: the person is asked when the machine stands, and the program goes on when they say so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from leafcut.errors import ReadError, shown
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import BlockError, Word, split_line, words_of
from leafcut.sender.counting import SentLine

#: Longest line that GRBL takes, its end not counted (LINE_BUFFER_SIZE in protocol.h).
LONGEST_LINE = 79
#: The letters that GRBL reads (gcode.c); N is left out of what is sent.
_LETTERS = frozenset("FGIJKLMPRSTXYZ")
#: A comment tells what a pause is for where it stands no more lines above it.
_REACH = 3


@dataclass(frozen=True)
class Pause:
    """A stop of the program at a line: for a tool (its number where it is known), or for what a person shall do."""

    number: int
    tool: int | None = None
    remark: str = ""

    def __str__(self) -> str:
        what = "pause" if self.tool is None else f"put in tool T{self.tool}"
        return f"line {self.number}: {what}" + (f" ({self.remark})" if self.remark else "")


Step = SentLine | Pause


def steps_of(lines: Sequence[str], words: Dialect, file: str, first: int = 1) -> list[Step]:
    """Return the lines of a program as they are sent, with its pauses, from line `first` to its end (M2, M30).

    Raises
    ------
    ReadError
        A line has a word or a letter that the controller does not have, is a command of the controller itself ($), or
        is too long for it.
    """
    steps: list[Step] = []
    tool: int | None = None
    chosen, remark, remarked = False, "", 0
    for number, line in enumerate(lines, 1):
        try:
            body, comments = split_line(line.strip(), nested=True)
            if body.startswith("%"):
                if steps:
                    break
                continue
            found = words_of(body.removeprefix("/"))
        except BlockError as problem:
            raise ReadError(file, str(problem), number) from None
        _check(found, words, file, number)
        if comments:
            remark, remarked = shown(comments[-1]), number
        if number > remarked + _REACH:
            remark = ""
        codes = {int(word.value) for word in found if word.letter == "M"}
        for word in found:
            if word.letter == "T":
                tool, chosen = int(word.value), True
        said: list[Step] = []
        if 6 in codes:
            said.append(Pause(number, tool, remark))
            chosen = False
        text = "".join(_written(word) for word in found if not _is_ours(word))
        if len(text) > LONGEST_LINE:
            reason = (
                f"the line has {len(text)} characters without blanks and comments, {words.name} takes {LONGEST_LINE}"
            )
            raise ReadError(file, reason, number)
        if text:
            said.append(SentLine(text, number))
        if 0 in codes:
            said.append(Pause(number, tool if chosen else None, remark))
            chosen = False
        if number >= first:
            steps += said
        if codes & {2, 30}:
            break
    return steps


def _is_ours(word: Word) -> bool:
    return word.letter == "N" or (word.letter == "M" and word.value in (0, 6))


def _written(word: Word) -> str:
    return f"{word.letter}{word.text.removeprefix('+')}"


def _check(found: Sequence[Word], words: Dialect, file: str, number: int) -> None:
    """Refuse what this controller does not have, whatever an interpreter may make of it."""
    for word in found:
        known = word.letter in _LETTERS or word.letter == "N"
        if word.letter == "G":
            known = round(word.value * 10) in words.g_codes
        elif word.letter == "M":
            known = word.value in words.m_codes or word.value == 6
        if not known:
            reason = (
                f"{word} is not a word of {words.name}; post the program for this controller, or name its --dialect"
            )
            raise ReadError(file, reason, number)
