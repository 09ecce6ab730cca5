"""Character counting: keep the controller's receive buffer full, but never send more bytes or lines than it holds.

A controller answers each line once, in order, when it takes the line out of its buffer. Therefore only unanswered lines
can be in the buffer. Source: gnea/grbl wiki, "Grbl v1.1 Interface", streaming protocol: character-counting.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

#: Buffer size of GRBL 1.1 on an Uno, bytes (serial.h).
GRBL_BUFFER = 128
#: Bytes to leave free, because some boards use a byte themselves (gnea/grbl, issue 302).
SPARED = 1
#: Maximum number of bytes to send ahead to boards with large buffers, because buffered lines cannot be taken back.
MAX_AHEAD = 256


@dataclass(frozen=True)
class SentLine:
    """A line to send, without line ending. `number` is its line number in the program; 0 for a line added by
    leafcut.
    """

    text: str
    number: int = 0

    @property
    def data(self) -> bytes:
        """The line as bytes, with line ending."""
        return self.text.encode("ascii") + b"\n"


class CharacterCounter:
    """The sent lines that are not answered yet."""

    def __init__(self, buffer: int = GRBL_BUFFER, max_lines: int | None = None) -> None:
        self.capacity, self.max_lines = min(buffer - SPARED, MAX_AHEAD), max_lines
        self.waiting: deque[SentLine] = deque()
        self.bytes = 0

    def fits(self, line: SentLine) -> bool:
        """Return whether the buffer has space for a line now."""
        full = self.max_lines is not None and len(self.waiting) >= self.max_lines
        return not full and self.bytes + len(line.data) <= self.capacity

    def send(self, line: SentLine) -> None:
        """Record a line as sent; raise `ValueError` if it does not fit into the buffer."""
        if not self.fits(line):
            raise ValueError(f"a line of {len(line.data)} bytes does not fit beside {self.bytes} of {self.capacity}")
        self.waiting.append(line)
        self.bytes += len(line.data)

    def take_answer(self) -> SentLine | None:
        """Record an answer and return its line, which is the oldest unanswered line; None if there is none."""
        if not self.waiting:
            return None
        line = self.waiting.popleft()
        self.bytes -= len(line.data)
        return line

    def forget_lines(self) -> None:
        """Discard all unanswered lines, after a reset of the controller."""
        self.waiting.clear()
        self.bytes = 0
