"""The parts of a nest in a page's request (drawing, quantity and angles), and parts lists."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from leafcut.errors import OptionError
from leafcut.units import parse_angles

#: Maximum quantity of a part. A larger quantity is considered a mistake.
MAX_PIECES = 100_000


@dataclass(frozen=True)
class WantedPart:
    """A drawing to be nested.

    Attributes
    ----------
    input
        Id of the upload.
    rotations
        Angles in degrees, separated by spaces, or ``free``. If empty, the angles of the options apply.
    """

    input: str
    quantity: int = 1
    rotations: str = ""

    @property
    def encoded(self) -> str:
        """The part as a string, such as ``AbCdEfGhIjKlMnOp:10:0 90``."""
        return f"{self.input}:{self.quantity}" + (f":{self.rotations}" if self.rotations else "")

    @classmethod
    def decode(cls, word: str) -> WantedPart:
        """Decode a part from the string `word`. Raises `OptionError` if the quantity or an angle is invalid."""
        input_id, _, rest = word.partition(":")
        quantity, _, rotations = rest.partition(":")
        return cls(input_id, parse_quantity_field(quantity or "1"), parse_rotations(rotations))


def parse_quantity_field(typed: str) -> int:
    """Parse the quantity that a user has typed. Raises `OptionError` if it is not a whole number or is out of range."""
    text = typed.strip()
    if not text.isdecimal() or not 1 <= int(text[:9]) <= MAX_PIECES or len(text) > 9:
        raise OptionError("quantity: '{}' is not a whole number from 1 to {:,}", text[:40], MAX_PIECES)
    return int(text)


def parse_rotations(typed: str) -> str:
    """Return the angles that a user has typed, separated by spaces. If empty, the angles of the options apply.

    Raises `OptionError` if an angle is invalid.
    """
    words = typed.replace("/", " ").replace(",", " ").replace(";", " ").split()
    if words:
        parse_angles(words, "rotations")
    return " ".join(words)


def wanted_parts(inputs: Sequence[str], text: str) -> list[WantedPart]:
    """Combine uploads with their quantities and rotations, which come from a JSON list in the same order.

    Raises `OptionError` if the list is invalid.
    """
    try:
        rows = json.loads(text or "[]")
    except (ValueError, RecursionError):
        rows = None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows) or len(rows) > len(inputs):
        raise OptionError("'parts' must be a JSON list with one object per drawing, in the same order")
    rows += [{}] * (len(inputs) - len(rows))
    return [
        WantedPart(
            input_id, parse_quantity_field(str(row.get("quantity", 1))), parse_rotations(str(row.get("rotations", "")))
        )
        for input_id, row in zip(inputs, rows, strict=True)
    ]


def needs_list(parts: Sequence[WantedPart]) -> bool:
    """Return whether the command needs a parts list. This is the case if a part has its own angles."""
    return any(part.rotations for part in parts)


def parts_list_text(parts: Sequence[WantedPart], files: Sequence[str]) -> str:
    """Write the parts as a list for ``leafcut nest``. `files` contains the name of each part's drawing."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(("file", "quantity", "rotations"))
    for part, file in zip(parts, files, strict=True):
        writer.writerow((file, part.quantity, part.rotations))
    return text.getvalue()


def read_parts_list(path: Path, opened: Mapping[str, str]) -> tuple[list[WantedPart], list[str]]:
    """Read a parts list. Return its parts, and the names of all drawings that are not open.

    `opened` maps displayed names to ids. The studio does not read other folders, so folder names in the list are
    ignored. Raises `ReadError` or `OptionError` if the list is invalid.
    """
    from leafcut.read.nest_list import read_drawings_to_nest

    parts, missing = [], []
    for entry in read_drawings_to_nest([str(path)]):
        name = Path(entry.file.replace("\\", "/")).name
        if name in opened:
            parts.append(WantedPart(opened[name], entry.quantity, " ".join(entry.rotations)))
        else:
            missing.append(name)
    return parts, list(dict.fromkeys(missing))
