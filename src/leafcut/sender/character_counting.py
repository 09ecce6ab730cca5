"""Character counting: keeps the controller's receive buffer full without overflowing it.

A controller answers each line once, in order, when it takes the line out of its buffer. This means that only unanswered
lines can still be in the buffer. Source: gnea/grbl wiki, "Grbl v1.1 Interface", streaming protocol: character-counting.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

#: Size of the receive buffer of GRBL 1.1 on an Uno, bytes (serial.h).
GRBL_BUFFER = 128
#: Number of bytes to leave free, because some boards use one byte themselves (gnea/grbl, issue 302).
SPARED = 1
#: Maximum number of bytes to send ahead, even if the board has a large buffer. Sent lines cannot be taken back.
MAX_AHEAD = 256


@dataclass(frozen=True)
class SentLine:
    """A line to send, without its line ending.

    `number` is the line number in the program. It is 0 for a line that leafcut adds.
    """

    text: str
    number: int = 0

    @property
    def data(self) -> bytes:
        """The bytes to send, including the line ending."""
        return self.text.encode("ascii") + b"\n"


class CharacterCounter:
    """Keeps track of the sent lines that the controller has not answered yet."""

    def __init__(self, buffer: int = GRBL_BUFFER, max_lines: int | None = None) -> None:
        self.capacity, self.max_lines = min(buffer - SPARED, MAX_AHEAD), max_lines
        self.waiting: deque[SentLine] = deque()
        self.bytes = 0

    def fits(self, line: SentLine) -> bool:
        """Return whether the buffer currently has enough space for a line."""
        full = self.max_lines is not None and len(self.waiting) >= self.max_lines
        return not full and self.bytes + len(line.data) <= self.capacity

    def record_sent(self, line: SentLine) -> None:
        """Record that a line was sent. Raises `ValueError` if the line does not fit into the buffer."""
        if not self.fits(line):
            raise ValueError(f"a line of {len(line.data)} bytes does not fit beside {self.bytes} of {self.capacity}")
        self.waiting.append(line)
        self.bytes += len(line.data)

    def record_answer(self) -> SentLine | None:
        """Record an answer, and return the line that it belongs to.

        This is always the oldest unanswered line. Returns None if all lines have been answered.
        """
        if not self.waiting:
            return None
        line = self.waiting.popleft()
        self.bytes -= len(line.data)
        return line

    def forget_lines(self) -> None:
        """Forget all unanswered lines. Call this after a reset of the controller."""
        self.waiting.clear()
        self.bytes = 0
