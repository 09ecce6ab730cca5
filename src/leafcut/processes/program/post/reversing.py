"""Write an open cut in reverse, with the words and numbers of its own lines.

Each block leads back to its start point, and arcs change direction but keep their centre. Coordinates are copied as
text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal

from leafcut.gcode.modal_dependencies import BlockReader
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.reversible_cut import ReversibleCut
from leafcut.model.toolpath import Kind
from leafcut.processes.program.post.insertion import (
    code_without_comments,
    format_length,
    insert_words,
    line_ending,
    replace_all_words,
    replace_words,
)

#: Number of the G word for the reversed motion, by kind of the original motion.
_BACK = {int(Kind.FEED): 1, int(Kind.ARC_CW): 3, int(Kind.ARC_CCW): 2}

#: (letter, number, block) → the word in the spelling that the program last used before the block.
Spelled = Callable[[str, float, int], str]


class ReversedCut:
    """Writes the lines of a cut in reverse.

    Parameters
    ----------
    lines
        All lines of the cut, including comments.
    offset
        Number of lines of the program before the cut.
    spelled
        Function that writes a feed or a speed in the spelling of the program.
    """

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
        #: Modal values active in the new lines; None if no earlier word sets them.
        modal = program.modal(stroke.body)
        known = reader.modal_use(stroke.begin, stroke.body).sets | reader.modal_use(stroke.begin, stroke.end).inherited
        self.motion = modal.motion if "motion" in known else None
        self.feed = modal.feed if "feed" in known else None
        self.rpm = modal.rpm if "rpm" in known else None

    def write(self) -> tuple[list[str], Modal]:
        """Return the reversed lines, and the modal state after them."""
        new = [*self._lead(), *self._body(), *self._tail()]
        # The last line of a file may lack a line ending; after reversal it may no longer be last.
        end = line_ending(self.program.lines)
        new = [line if line.endswith(("\n", "\r")) else line + end for line in new]
        return new, replace(self.program.modal(self.stroke.end), motion=self.motion)

    def _lines_up_to(self, block: int) -> int:
        """Return the number of lines up to and including the line of a block."""
        return int(self.program.line[block]) - self.offset

    def _line_of_block(self, block: int) -> int:
        return self._lines_up_to(block) - 1

    def _lead(self) -> list[str]:
        """Return the lines before the cut, changed so that they lead to the former end of the cut."""
        lines = self.lines[: self._lines_up_to(self.stroke.body - 1)]
        for block in range(self.stroke.begin, self.stroke.body):
            lines[self._line_of_block(block)] = replace_words(
                lines[self._line_of_block(block)], self._axes(len(self.stroke.rows))
            )
        return lines

    def _body(self) -> list[str]:
        """Return the lines of the cut, the last block first. Comments above a block move with the block."""
        stroke = self.stroke
        found: list[str] = []
        for block in range(stroke.tail - 1, stroke.body - 1, -1):
            found += self.lines[self._lines_up_to(block - 1) : self._line_of_block(block)]
            found.append(self._cut(block))
        return found

    def _tail(self) -> list[str]:
        """Return the lines after the cut, changed so that they retract at the former start of the cut."""
        lines = self.lines[self._lines_up_to(self.stroke.tail - 1) :]
        begin = self._lines_up_to(self.stroke.tail - 1)
        for block in range(self.stroke.tail, self.stroke.end):
            at = self._line_of_block(block) - begin
            modal_use, need = self.reader.modal_use(block, block + 1), self.program.modal(block)
            # Feed and speed need no words: a reversible cut has the same values at both ends.
            front = [f"G{need.motion}"] if "motion" in modal_use.inherited and need.motion != self.motion else []
            lines[at] = insert_words(replace_words(lines[at], self._axes(0)), front, [])
            if "motion" in modal_use.sets:
                self.motion = self.program.modal(block + 1).motion
        return lines

    # -- words -------------------------------------------------------------------------------------------------------

    def _axes(self, place: int) -> dict[str, str]:
        """Return the texts of X and Y at a point of the cut, by letter."""
        texts = self.stroke.places[place]
        # An axis without text does not move in its block: its position is the same before and after.
        at = self.program.path.before[self.stroke.rows[max(place - 1, 0)]]
        return {
            letter: format_length(float(value), self.unit) if text is None else text
            for letter, text, value in zip("XY", texts, at, strict=False)
        }

    def _cut(self, block: int) -> str:
        """Return the line of one block of the cut in reverse."""
        number = block - self.stroke.body
        line, row = self.lines[self._line_of_block(block)], self.stroke.rows[number]
        words = self.reader.words(block)
        assert words is not None  # reversible cuts have only plain words
        letters, need = words.letters, self.program.modal(block + 1)
        motion = _BACK[int(self.program.path.kind[row])]
        texts = []
        if "motion" in words.states or motion != self.motion:
            texts.append(self._motion_word(line, motion))
        # An axis missing from the line does not move, in either direction.
        back = self._axes(number)
        texts += [letter + back[letter] for letter in "XY" if letter in letters]
        texts += [f"Z{letters['Z']}"] if "Z" in letters else []
        texts += self._centre(letters, number, need)
        if "F" in letters or need.feed != self.feed:
            texts.append(self.spelled("F", need.feed, block + 1))
        if "S" in letters or (need.spindle and need.rpm != self.rpm):
            texts.append(self.spelled("S", need.rpm, block + 1))
        self.motion, self.feed, self.rpm = motion, need.feed, need.rpm
        return replace_all_words(line, texts)

    def _motion_word(self, line: str, motion: int) -> str:
        """Return G1, G2 or G3, with a leading zero if the original line uses one."""
        return f"G0{motion}" if re.search(r"[Gg]0[123](?![0-9])", code_without_comments(line)) else f"G{motion}"

    def _centre(self, letters: dict[str, str], number: int, need: Modal) -> list[str]:
        """Return the words for the centre of an arc as seen from its new start."""
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
    """Format a number with a decimal point, without an exponent and without rounding."""
    text = f"{value:f}"
    if "." not in text:
        return text + ".0"
    text = text.rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text
