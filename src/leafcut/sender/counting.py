"""Character counting: keep the controller's buffer full without ever exceeding its bytes or lines.

A controller answers each line once, in order, when it takes the line out of its buffer. Lines without an answer are
therefore all that the buffer can hold. Source: gnea/grbl wiki, "Grbl v1.1 Interface", streaming protocol:
character-counting.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

#: Buffer size of GRBL 1.1 on an Uno, bytes (serial.h).
GRBL_BUFFER = 128
#: Bytes left free: some boards use one themselves (gnea/grbl, issue 302).
SPARED = 1
#: Limit for large buffers, bytes: a hold cannot take back buffered lines.
MAX_AHEAD = 256


@dataclass(frozen=True)
class SentLine:
    """A line to send: the text without line ending, and its program line; 0 for a line added by leafcut."""

    text: str
    number: int = 0

    @property
    def data(self) -> bytes:
        """The bytes to send."""
        return self.text.encode("ascii") + b"\n"


class CharacterCounter:
    """The lines that are sent and not answered yet."""

    def __init__(self, buffer: int = GRBL_BUFFER, max_lines: int | None = None) -> None:
        self.capacity, self.max_lines = min(buffer - SPARED, MAX_AHEAD), max_lines
        self.waiting: deque[SentLine] = deque()
        self.bytes = 0

    def fits(self, line: SentLine) -> bool:
        """Return whether the buffer has space for a line now."""
        full = self.max_lines is not None and len(self.waiting) >= self.max_lines
        return not full and self.bytes + len(line.data) <= self.capacity

    def send(self, line: SentLine) -> None:
        """Record a line as sent; raise `ValueError` if it does not fit."""
        if not self.fits(line):
            raise ValueError(f"a line of {len(line.data)} bytes does not fit beside {self.bytes} of {self.capacity}")
        self.waiting.append(line)
        self.bytes += len(line.data)

    def answered(self) -> SentLine | None:
        """Record an answer and return its line, the oldest; None if no line is waiting."""
        if not self.waiting:
            return None
        line = self.waiting.popleft()
        self.bytes -= len(line.data)
        return line

    def forget(self) -> None:
        """Drop all waiting lines after a reset of the controller."""
        self.waiting.clear()
        self.bytes = 0
