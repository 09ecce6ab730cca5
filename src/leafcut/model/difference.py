"""`Difference`: one thing that is not as it must be, with its place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Difference:
    """One difference between two toolpaths, or one thing that is not safe in one.

    Attributes
    ----------
    what
        In a word or two: ``feed``, ``missing hole``, ``rapid below clearance`` …
    original, new
        Lines of the program texts, from 1; 0 where there is none (a planned toolpath has no lines).
    text
        What was found and what was expected, in a person's words.
    """

    what: str
    original: int
    new: int
    text: str

    def __str__(self) -> str:
        places = [("original line", self.original), ("line", self.new)] if self.original else [("line", self.new)]
        where = ", ".join(f"{word} {line}" for word, line in places if line)
        return f"{self.what}: {self.text}" + (f" ({where})" if where else "")
