"""Which lines of a text belong to which piece of it, comments and blank lines included."""

from __future__ import annotations

from leafcut.gcode.program import Program
from leafcut.model.sequence import Section, Sequence


class Territory:
    """Divides the lines of a program between its pieces.

    Comments directly before the first block of a piece travel with it, unless a blank line parts them from it and more
    comments follow. The first piece of a section takes as many lines above it as the second one has: what stands
    higher is about the section.
    """

    def __init__(self, program: Program, sequence: Sequence) -> None:
        self._lines = tuple(program.lines)
        self._line = program.text_line.tolist()
        self._cut: dict[int, int] = {}
        for section in sequence.sections:
            self._divide(section)

    @property
    def head(self) -> tuple[str, ...]:
        """The lines that stay above the first piece, where that may move."""
        return self._lines[: self._at(0)]

    @property
    def tail(self) -> tuple[str, ...]:
        """The lines behind the last block."""
        return self._lines[self._line[-1] :] if self._line else self._lines

    def of(self, begin: int, end: int) -> tuple[str, ...]:
        """Return the lines of blocks begin … end - 1."""
        return self._lines[self._at(begin) : self._at(end)]

    def first_block_in(self, begin: int, block: int) -> int:
        """Return where the line of `block` is among the lines of a piece that begins with block `begin`."""
        return int(self._line[block]) - 1 - self._at(begin)

    def _at(self, block: int) -> int:
        """Return the number of lines before those of a block's piece."""
        if block in self._cut:
            return self._cut[block]
        return int(self._line[block - 1]) if block else 0

    def _divide(self, section: Section) -> None:
        pieces = section.pieces
        for number, piece in enumerate(pieces):
            if number and pieces[number - 1].end == piece.begin:
                self._cut[piece.begin] = self._between(piece.begin)
        for number, piece in enumerate(pieces):
            if piece.begin in self._cut:
                continue
            follower = pieces[number + 1] if number + 1 < len(pieces) else None
            alike = follower is not None and follower.begin == piece.end
            above = self._line[follower.begin] - 1 - self._cut[follower.begin] if alike and follower else 0
            low, high = self._line[piece.begin - 1] if piece.begin else 0, self._line[piece.begin] - 1
            self._cut[piece.begin] = max(low, high - above)

    def _between(self, block: int) -> int:
        """Return where the lines of a piece begin that follows another one."""
        low, high = int(self._line[block - 1]), int(self._line[block]) - 1
        blank = [n for n in range(low, high) if not self._lines[n].strip()]
        if blank and any(self._lines[n].strip() for n in range(blank[0], high)):
            return blank[0]
        return low
