"""`Difference`: a deviation of a program from its original or from the request, with its lines."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.message import Message


@dataclass(frozen=True)
class Difference:
    """A difference between two toolpaths, or an unsafe position in a toolpath.

    Attributes
    ----------
    what
        Kind of difference: ``feed``, ``missing hole``, ``rapid below clearance`` …
    original, new
        Lines of both program texts, from 1. 0 if the toolpath was planned, because it then has no lines.
    text
        Description of the difference.
    also
        Further pairs of lines (original, new), because one difference may affect many blocks.
    """

    what: Message
    original: int
    new: int
    text: Message
    also: tuple[tuple[int, int], ...] = ()

    def __str__(self) -> Message:
        old, new = ([line for line in side if line] for side in zip((self.original, self.new), *self.also, strict=True))
        lines = [_original_line_range_text(min(old), max(old))] if old else []
        lines += [_line_range_text(min(new), max(new))] if new else []
        message = Message("{}: {}", self.what, self.text)
        return Message("{} ({})", message, Message.joined(", ", lines)) if lines else message


def _line_range_text(first: int, last: int) -> Message:
    return Message("line {}", first) if first == last else Message("lines {} to {}", first, last)


def _original_line_range_text(first: int, last: int) -> Message:
    return Message("original line {}", first) if first == last else Message("original lines {} to {}", first, last)
