"""`Difference`: one deviation of a program from its original or from the request, with its lines."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Difference:
    """One difference between two toolpaths, or one unsafe position in a toolpath.

    Attributes
    ----------
    what
        Kind of the difference: ``feed``, ``missing hole``, ``rapid below clearance`` …
    original, new
        Lines of both program texts, from 1; 0 for none, because a planned toolpath has no lines.
    text
        Description of the difference.
    also
        Further pairs of lines (original, new), because one difference may affect many blocks.
    """

    what: str
    original: int
    new: int
    text: str
    also: tuple[tuple[int, int], ...] = ()

    def __str__(self) -> str:
        old, new = ([line for line in side if line] for side in zip((self.original, self.new), *self.also, strict=True))
        lines_text = ", ".join(_lines(word, lines) for word, lines in (("original ", old), ("", new)) if lines)
        return f"{self.what}: {self.text}" + (f" ({lines_text})" if lines_text else "")


def _lines(word: str, lines: list[int]) -> str:
    first, last = min(lines), max(lines)
    return f"{word}line {first}" if first == last else f"{word}lines {first} to {last}"
