"""The parts of a nest as a page asks for them: a drawing, how often, and in which angles; and lists of them."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from leafcut.errors import OptionError
from leafcut.units import parse_angles

#: More of one part are a mistake.
MOST_PIECES = 100_000


@dataclass(frozen=True)
class WantedPart:
    """A drawing to be nested.

    Attributes
    ----------
    input
        The id of an upload.
    quantity
        How often its parts are wanted.
    rotations
        Angles in degrees with spaces between, or ``free``; empty for those of the options.
    """

    input: str
    quantity: int = 1
    rotations: str = ""

    @property
    def word(self) -> str:
        """The part as one word, such as ``AbCdEfGhIjKlMnOp:10:0 90``."""
        return f"{self.input}:{self.quantity}" + (f":{self.rotations}" if self.rotations else "")

    @classmethod
    def of(cls, word: str) -> WantedPart:
        """Return the part that a word says.

        Raises
        ------
        OptionError
            A quantity or an angle is none.
        """
        made, _, rest = word.partition(":")
        quantity, _, rotations = rest.partition(":")
        return cls(made, quantity_of(quantity or "1"), rotations_of(rotations))


def quantity_of(typed: str) -> int:
    """Return a quantity that a person typed.

    Raises
    ------
    OptionError
        It is no whole number, or out of bounds.
    """
    text = typed.strip()
    if not text.isdecimal() or not 1 <= int(text[:9]) <= MOST_PIECES or len(text) > 9:
        raise OptionError(f"quantity: '{text[:40]}' is not a whole number from 1 to {MOST_PIECES:,}")
    return int(text)


def rotations_of(typed: str) -> str:
    """Return angles that a person typed, with spaces between; empty for those of the options.

    Raises
    ------
    OptionError
        One is no angle.
    """
    words = typed.replace("/", " ").replace(",", " ").replace(";", " ").split()
    if words:
        parse_angles(words, "rotations")
    return " ".join(words)


def wanted_parts(inputs: Sequence[str], text: str) -> list[WantedPart]:
    """Return uploads with what a program says of each, in their order: quantity and rotations, as JSON.

    Raises
    ------
    OptionError
        It is no such list, or one for another number of drawings.
    """
    try:
        rows = json.loads(text or "[]")
    except (ValueError, RecursionError):
        rows = None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows) or len(rows) > len(inputs):
        raise OptionError("'parts' must be a JSON list with one object per drawing, in the same order")
    rows += [{}] * (len(inputs) - len(rows))
    return [
        WantedPart(made, quantity_of(str(row.get("quantity", 1))), rotations_of(str(row.get("rotations", ""))))
        for made, row in zip(inputs, rows, strict=True)
    ]


def needs_list(parts: Sequence[WantedPart]) -> bool:
    """Return whether parts can be said in a list alone: angles of one part stand nowhere else."""
    return any(one.rotations for one in parts)


def list_text(parts: Sequence[WantedPart], files: Sequence[str]) -> str:
    """Return parts as a list that ``leafcut nest`` takes; `files` are the drawings, one for each."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(("file", "quantity", "rotations"))
    for one, file in zip(parts, files, strict=True):
        writer.writerow((file, one.quantity, one.rotations))
    return text.getvalue()


def listed_parts(path: Path, opened: Mapping[str, str]) -> tuple[list[WantedPart], list[str]]:
    """Return the parts that a list asks for, and the names of the drawings that are not among those opened.

    `opened` are what people call drawings → their ids. Of a path in a list the last name counts: elsewhere the studio
    does not look.

    Raises
    ------
    ReadError, OptionError
        The list cannot be read.
    """
    from leafcut.read.nest_list import read_wanted

    found, missing = [], []
    for wanted in read_wanted([str(path)]):
        name = Path(wanted.file.replace("\\", "/")).name
        if name in opened:
            found.append(WantedPart(opened[name], wanted.quantity, " ".join(wanted.rotations)))
        else:
            missing.append(name)
    return found, list(dict.fromkeys(missing))
