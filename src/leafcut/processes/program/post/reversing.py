"""A stroke written the other way round, in the words and the numbers of its own lines.

Where the cut ended, the tool now arrives, goes down and begins; every block of the cut goes back to where it came
from, arcs turn the other way about the same centre. Places are the very texts by which the original named them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal

from leafcut.gcode.modal_dependencies import BlockReader
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.reversible_cut import ReversibleCut
from leafcut.model.toolpath import Kind, position_before
from leafcut.processes.program.post.insertion import (
    code_of,
    format_length,
    insert_words,
    line_end,
    replace_words,
    with_words,
)

#: The G words of motions the other way.
_BACK = {int(Kind.FEED): 1, int(Kind.ARC_CW): 3, int(Kind.ARC_CCW): 2}

#: Finds the text of a letter's number as the program last wrote it before a block: (letter, number, block) → word.
Spelled = Callable[[str, float, int], str]


def reverse_stroke(
    program: Program, reader: BlockReader, stroke: ReversibleCut, lines: list[str], offset: int, spelled: Spelled
) -> tuple[list[str], Modal]:
    """Return the lines of a stroke the other way round, and what they leave active.

    Parameters
    ----------
    lines
        All lines of the piece that the stroke is, comments included.
    offset
        The number of lines of the program before them.
    spelled
        How the program writes a feed or a speed.
    """
    writer = _BlockWriter(program, reader, stroke, lines, offset, spelled)
    new = [*writer.lead(), *writer.body(), *writer.tail()]
    # The last line of a file may have no end; it need not be the last one now.
    end = line_end(program.lines)
    new = [line if line.endswith(("\n", "\r")) else line + end for line in new]
    return new, writer.leaves()


class _BlockWriter:
    def __init__(
        self,
        program: Program,
        reader: BlockReader,
        stroke: ReversibleCut,
        lines: list[str],
        offset: int,
        spelled: Spelled,
    ) -> None:
        self.program, self.reader, self.stroke, self.spelled = program, reader, stroke, spelled
        self.lines, self.offset = lines, offset
        self.unit = program.modal(stroke.body).unit
        #: What the new lines have active; None where nothing before them says it.
        modal = program.modal(stroke.body)
        known = reader.reliance(stroke.begin, stroke.body).sets | reader.reliance(stroke.begin, stroke.end).relies
        self.motion = modal.motion if "motion" in known else None
        self.feed = modal.feed if "feed" in known else None
        self.rpm = modal.rpm if "speed" in known else None

    def _upto(self, block: int) -> int:
        """Return how many of the lines end with that of a block."""
        return int(self.program.line[block]) - self.offset

    def _own(self, block: int) -> int:
        return self._upto(block) - 1

    def lead(self) -> list[str]:
        """Return the lines up to the cut, which lead to its end now."""
        lines = self.lines[: self._upto(self.stroke.body - 1)]
        for block in range(self.stroke.begin, self.stroke.body):
            lines[self._own(block)] = replace_words(lines[self._own(block)], self._axes(len(self.stroke.rows)))
        return lines

    def body(self) -> list[str]:
        """Return the lines of the cut, the last first; remarks above a block go with it."""
        stroke = self.stroke
        found: list[str] = []
        for block in range(stroke.tail - 1, stroke.body - 1, -1):
            found += self.lines[self._upto(block - 1) : self._own(block)]
            found.append(self._cut(block))
        return found

    def tail(self) -> list[str]:
        """Return the lines behind the cut, which come up where it began."""
        lines = self.lines[self._upto(self.stroke.tail - 1) :]
        begin = self._upto(self.stroke.tail - 1)
        for block in range(self.stroke.tail, self.stroke.end):
            at = self._own(block) - begin
            reliance, need = self.reader.reliance(block, block + 1), self.program.modal(block)
            front, back = [], []
            if "motion" in reliance.relies and need.motion != self.motion:
                front.append(f"G{need.motion}")
            if "feed" in reliance.relies and need.feed != self.feed:
                back.append(self.spelled("F", need.feed, block))
            if "speed" in reliance.relies and need.rpm != self.rpm:
                back.append(self.spelled("S", need.rpm, block))
            lines[at] = insert_words(replace_words(lines[at], self._axes(0)), front, back)
            after = self.program.modal(block + 1)
            self.motion = after.motion if "motion" in reliance.sets else self.motion
            self.feed = after.feed if "feed" in reliance.sets else self.feed
            self.rpm = after.rpm if "speed" in reliance.sets else self.rpm
        return lines

    def leaves(self) -> Modal:
        """Return what is active behind the new lines."""
        end = self.program.modal(self.stroke.end)
        feed, rpm = (b if a is None else a for a, b in ((self.feed, end.feed), (self.rpm, end.rpm)))
        return replace(end, motion=self.motion, feed=feed, rpm=rpm)

    # -- words -------------------------------------------------------------------------------------------------------

    def _axes(self, place: int) -> dict[str, str]:
        """Return the texts of X and Y of a place of the cut, by letter."""
        said = self.stroke.places[place]
        # An axis without text does not move in its block, so its place before the block is that behind it.
        at = position_before(self.program.path, self.stroke.rows[max(place - 1, 0)])
        return {
            letter: format_length(float(value), self.unit) if text is None else text
            for letter, text, value in zip("XY", said, at, strict=False)
        }

    def _cut(self, block: int) -> str:
        """Return the line of a block of the cut, the way back."""
        number = block - self.stroke.body
        line, row = self.lines[self._own(block)], self.stroke.rows[number]
        words = self.reader.words(block)
        assert words is not None  # a stroke has plain words only
        letters, need = words.letters, self.program.modal(block + 1)
        motion = _BACK[int(self.program.path.kind[row])]
        said = []
        if "motion" in words.states or motion != self.motion:
            said.append(self._motion_word(line, motion))
        # An axis that the line does not name stays where it is, there and back.
        back = self._axes(number)
        said += [letter + back[letter] for letter in "XY" if letter in letters]
        said += [f"Z{letters['Z']}"] if "Z" in letters else []
        said += self._centre(letters, number, need)
        if "F" in letters or need.feed != self.feed:
            said.append(f"F{letters['F']}" if "F" in letters else self.spelled("F", need.feed, block + 1))
        if "S" in letters or (need.spindle and need.rpm != self.rpm):
            said.append(f"S{letters['S']}" if "S" in letters else self.spelled("S", need.rpm, block + 1))
        self.motion, self.feed = motion, need.feed
        self.rpm = need.rpm if "S" in letters or need.spindle else self.rpm
        return with_words(line, said)

    def _motion_word(self, line: str, motion: int) -> str:
        """Return G1, G2 or G3, with a zero before it where the line has one."""
        return f"G0{motion}" if re.search(r"[Gg]0[123](?![0-9])", code_of(line)) else f"G{motion}"

    def _centre(self, letters: dict[str, str], number: int, need: Modal) -> list[str]:
        """Return the words for the centre of an arc, from where it begins now."""
        if "R" in letters:
            return [f"R{letters['R']}"]
        if need.absolute_centres:
            return [letter + letters[letter] for letter in "IJ" if letter in letters]
        found = []
        old, new = self._axes(number), self._axes(number + 1)
        for letter, axis in (("I", "X"), ("J", "Y")):
            if letter in letters or old[axis] != new[axis]:
                shift = Decimal(old[axis]) - Decimal(new[axis]) + Decimal(letters.get(letter, "0"))
                found.append(letter + _decimal(shift))
        return found if {"I", "J"} & letters.keys() else []


def _decimal(value: Decimal) -> str:
    """Return a number with a decimal point and without an exponent; nothing is rounded."""
    text = f"{value:f}"
    if "." not in text:
        return text + ".0"
    text = text.rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text
