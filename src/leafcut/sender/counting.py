"""Counting: the controller's buffer is kept full, and never given a byte, or a line, more than it holds.

A controller answers each line once, in order, when it has taken it out of its buffer. So the lines without an answer
are all that can be in there. Source: gnea/grbl wiki, "Grbl v1.1 Interface", streaming protocol: character-counting.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

#: Bytes of the buffer of GRBL 1.1 on an Uno (serial.h).
GRBL_BUFFER = 128
#: One byte stays free: some boards use it themselves (gnea/grbl, issue 302).
SPARED = 1
#: A large buffer is not filled: what is in it cannot be taken back by a hold.
MOST_AHEAD = 256


@dataclass(frozen=True)
class SentLine:
    """One line as it is sent: the text without its end, and the line of the program it is of; 0 for one of our own."""

    text: str
    number: int = 0

    @property
    def data(self) -> bytes:
        """The bytes that go over the line."""
        return self.text.encode("ascii") + b"\n"


class CharacterCounter:
    """The lines that are on their way: sent, and not answered yet."""

    def __init__(self, buffer: int = GRBL_BUFFER, most_lines: int | None = None) -> None:
        self.capacity, self.most_lines = min(buffer - SPARED, MOST_AHEAD), most_lines
        self.waiting: deque[SentLine] = deque()
        self.bytes = 0

    def fits(self, line: SentLine) -> bool:
        """Return whether the buffer has room for a line now."""
        full = self.most_lines is not None and len(self.waiting) >= self.most_lines
        return not full and self.bytes + len(line.data) <= self.capacity

    def send(self, line: SentLine) -> None:
        """Wait for the answer to a line.

        Raises
        ------
        ValueError
            There is no room for it.
        """
        if not self.fits(line):
            raise ValueError(f"a line of {len(line.data)} bytes does not fit beside {self.bytes} of {self.capacity}")
        self.waiting.append(line)
        self.bytes += len(line.data)

    def answered(self) -> SentLine | None:
        """Return the line that an answer is for, the oldest; None where no line waits for one."""
        if not self.waiting:
            return None
        line = self.waiting.popleft()
        self.bytes -= len(line.data)
        return line

    def forget(self) -> None:
        """Wait for nothing any more: the controller was reset."""
        self.waiting.clear()
        self.bytes = 0
