"""Describe blocks whose effects are unknown. Verification compares such blocks by their descriptions.

    A[#3+90]        A93.
    G65 P100 A5.    G65 P100. A5., and digests of the parameters and of the subprograms
    (MSG, turn it)  itself, and the comments after it

Two descriptions are equal only if all inputs of the blocks are equal. The inputs include the values of the words and
the messages. They also include the parameters that a macro of the controller may read. After the end of the program,
there may be text that the block can call, which is another input.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import COMMENT, Block, Word
from leafcut.message import Message

#: M words of LinuxCNC that never call a macro. Their effect is unknown, but they only read their own words.
_PLAIN_M = frozenset({19, *range(48, 54), 60, 61, *range(62, 69), 190})
_END = re.compile(r"M0*(?:2|30|99)(?![0-9.])")
_SUB = re.compile(r"O([0-9]+|<[^<>]*>)(SUB|ENDSUB)")
_NUMBER = re.compile(r"^(/?)N[0-9]+")


class BlockDescription(NamedTuple):
    """Describes a block by its inputs: the values of its words, its active comments, and digests of other inputs.

    Attributes
    ----------
    text
        The words with their values, and the active comments. A block with block delete has a leading slash.
    parameters
        Digest of the parameters that a macro or a message of the block may read; None if it reads no parameters.
    calls, again
        Digests of the subprograms that the block may call, and of the code that it may repeat, or "".
    """

    text: str = ""
    parameters: str | None = None
    calls: str = ""
    again: str = ""

    @property
    def is_closed(self) -> bool:
        """Whether the text contains all inputs of the block."""
        return self.parameters is None and not self.calls and not self.again

    def changed_inputs(self, other: BlockDescription) -> list[Message]:
        """Return the names of the inputs that differ from another block with the same text."""
        digests = zip(_INPUTS, self[1:], other[1:], strict=True)
        return [words for words, one, two in digests if one != two]


#: The input that has changed, for each digest of a description.
_INPUTS = (
    Message("a parameter that it may read has a different value"),
    Message("the text of a subprogram that it may call has changed"),
    Message("the code that it may repeat has changed"),
)


def describe_block(
    block: Block, comments: Sequence[str], parameters: str | None, called: str, dialect: Dialect
) -> BlockDescription:
    """Describe a block.

    On Fanuc, a number with a decimal point differs from a number without one, because their units may differ.

    Parameters
    ----------
    parameters
        Digest of the parameters that the block may read.
    called
        Digest of the subprograms that the block may call.
    """
    points = dialect.groups == "fanuc"
    words = [
        f"{w.letter}{_format_number(w.value)}" + ("." if points and "." in w.text else "")
        for w in block.words
        if w.letter not in "NO"
    ]
    parts = ["/"] * block.deleted + words + [" ".join(text.split()) for text in comments]
    return BlockDescription(" ".join(parts), parameters, called)


def may_read_parameters(unknown: Iterable[Word], comments: Sequence[str], dialect: Dialect) -> bool:
    """Return whether a macro or a message in a block may read parameters that do not appear in its words."""
    plain_m = _PLAIN_M if dialect.groups == "rs274" else ()
    macro = any(w.letter != "M" or w.value not in plain_m for w in unknown)
    return macro or any("#" in text or "%" in text or text[:2].lower() == "py" for text in comments)


def _format_number(value: float) -> str:
    # Nine decimals: sums are not exact, and no machine has a finer resolution.
    return f"{round(value, 9) + 0.0:.12g}"


def digest_of_callable_text(lines: Sequence[str], dialect: Dialect) -> str:
    """Return a digest of all text that an unsupported block can call, or "" without such text.

    A block can call the text after the end of a program, and the subroutines of the program (o… sub). It does not
    matter whether the program states the called number, computes it, or implies it.
    """
    kept, ended, started, sub = [], False, False, ""
    for line in lines:
        text = significant_text(line, dialect)
        word = _SUB.match(text)
        if word is not None and not sub and word.group(2) == "SUB":
            sub = word.group(1)
        if (ended or sub) and text not in ("", "%"):
            kept.append(text)
        if word is not None and word.group(1) == sub and word.group(2) == "ENDSUB":
            sub = ""
        ended = ended or (started and text.startswith("%")) or (not sub and _END.search(text) is not None)
        started = started or bool(text)
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:16] if kept else ""


class RangeDigests:
    """Digests of ranges of lines. A prefix hash computes each digest in constant time (Rabin and Karp 1987)."""

    _BASE, _PRIME = 0x1E3779B97F4A7C15F39CC0605CEDC835, 2**127 - 1

    def __init__(self, texts: Iterable[str]) -> None:
        self._upto, self._count = [0], [0]
        for text in texts:
            own = int.from_bytes(hashlib.sha256(text.encode()).digest()[:15], "big")
            last = self._upto[-1]
            self._upto.append((last * self._BASE + own) % self._PRIME if text else last)
            self._count.append(self._count[-1] + bool(text))

    def digest_of_lines(self, first: int, last: int) -> str:
        """Return the digest of lines `first` to `last`, inclusive."""
        count = self._count[last + 1] - self._count[first]
        value = self._upto[last + 1] - self._upto[first] * pow(self._BASE, count, self._PRIME)
        return f"{count}:{value % self._PRIME:032x}"


def significant_text(line: str, dialect: Dialect) -> str:
    """Return the part of a line that affects the program.

    On Fagor, comments are included because they may be statements.
    """
    return "".join(line.split()).upper() if dialect.cycle_words == "fagor" else normalize_line(line)


def normalize_line(line: str) -> str:
    """Convert a line to capitals, and remove its line number, comments and spaces."""
    return _NUMBER.sub(r"\1", "".join(COMMENT.sub("", line).split()).upper())
