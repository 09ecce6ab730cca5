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
    also
        The lines, original and new, of all else that it is about: what is one to a person may be in many blocks.
    """

    what: str
    original: int
    new: int
    text: str
    also: tuple[tuple[int, int], ...] = ()

    def __str__(self) -> str:
        old, new = ([line for line in side if line] for side in zip((self.original, self.new), *self.also, strict=True))
        where = ", ".join(_lines(word, lines) for word, lines in (("original ", old), ("", new)) if lines)
        return f"{self.what}: {self.text}" + (f" ({where})" if where else "")


def _lines(word: str, lines: list[int]) -> str:
    first, last = min(lines), max(lines)
    return f"{word}line {first}" if first == last else f"{word}lines {first} to {last}"
