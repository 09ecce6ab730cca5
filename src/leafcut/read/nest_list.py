"""The parts to nest: drawings with quantities, given as command-line arguments or CSV lists.

An argument is ``bracket.dxf``, ``bracket.dxf:10`` or ``parts.csv``. A list has one line per drawing: file, quantity,
rotations. The header is optional; the separator is a comma, semicolon or tab; lines starting with # are comments. Paths
are relative to the folder of the list. Rotations are degrees, separated by blanks or slashes, or ``free``.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from leafcut.errors import OptionError, ReadError, parser_errors, printable
from leafcut.message import Message
from leafcut.read.format import load_source
from leafcut.units import parse_angles

#: Words that mark the first line as a header.
HEADER_WORDS = ("file", "part", "drawing", "name", "path")
#: Maximum number of drawings of a nest.
MAX_DRAWINGS = 2_000
_NUMBERED = re.compile(r"(.+):([+-]?[0-9]{1,9})", re.DOTALL)


@dataclass(frozen=True)
class WantedDrawing:
    """A drawing to nest, with its quantity and the allowed rotations as text.

    If the text is empty, the options determine the rotations.
    """

    file: str
    quantity: int = 1
    rotations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.quantity < 1:
            raise OptionError("{}: the quantity must be 1 or more", printable(self.file))


def read_drawings_to_nest(arguments: Sequence[str | WantedDrawing]) -> list[WantedDrawing]:
    """Read the drawings and lists in the command-line arguments.

    The quantity of a list multiplies the quantities of its lines. `WantedDrawing` arguments are returned without
    changes.

    Raises
    ------
    ReadError
        A list cannot be read, or one of its lines is invalid; the message includes the line number.
    OptionError
        The arguments are empty, a quantity is below 1, or a quantity has no drawing.
    """
    drawings = [
        drawing
        for argument in arguments
        for drawing in ([argument] if isinstance(argument, WantedDrawing) else _drawings_of_argument(argument))
    ]
    if not drawings:
        raise OptionError("no parts given; name drawings with quantities, such as bracket.dxf:10, or a list.csv")
    if len(drawings) > MAX_DRAWINGS:
        raise OptionError("more than {:,} drawings; nest them in several runs", MAX_DRAWINGS)
    return drawings


def split_file_and_quantity(argument: str) -> tuple[str, int]:
    """Split an argument such as ``bracket.dxf:10`` into the file and the quantity."""
    match = _NUMBERED.fullmatch(argument)
    return (match[1], int(match[2])) if match else (argument, 1)


def _drawings_of_argument(argument: str) -> Iterator[WantedDrawing]:
    if re.fullmatch(r"x?[0-9]{1,9}x?", argument, re.IGNORECASE) and not Path(argument).exists():
        raise OptionError(
            "{}: file not found; add a quantity to its drawing, such as bracket.dxf:{}", argument, argument.strip("xX")
        )
    file, quantity = split_file_and_quantity(argument)
    if quantity < 1:
        raise OptionError("{}: the quantity must be 1 or more", printable(argument))
    if not file.lower().endswith(".csv"):
        yield WantedDrawing(file, quantity)
        return
    for wanted in _drawings_in_list(file):
        yield WantedDrawing(wanted.file, quantity * wanted.quantity, wanted.rotations)


def _drawings_in_list(file: str) -> Iterator[WantedDrawing]:
    source = load_source(file)
    lines = source.text().splitlines()
    delimiter = next((d for d in (";", "\t") if any(d in line for line in lines)), ",")
    n_drawings = 0
    for number, line in enumerate(lines, 1):
        with parser_errors(file, Message("this line could not be read"), number):
            fields = [field.strip() for field in next(csv.reader([line], delimiter=delimiter), [])]
        if not any(fields) or fields[0].startswith("#"):
            continue
        if not n_drawings and fields[0].lower() in HEADER_WORDS:
            continue
        n_drawings += 1
        if n_drawings > MAX_DRAWINGS:
            raise ReadError(file, Message("more than {:,} drawings; nest them in several runs", MAX_DRAWINGS), number)
        yield _parse_list_line(file, number, fields)
    if not n_drawings:
        raise ReadError(file, "names no drawing; a line is: file, quantity, rotations")


def _parse_list_line(file: str, number: int, fields: list[str]) -> WantedDrawing:
    name, quantity, rotations = [*fields, "", "", ""][:3]
    if not name:
        raise ReadError(file, "names no drawing; a line is: file, quantity, rotations", number)
    try:
        pieces = int(quantity or "1")
    except ValueError:
        raise ReadError(file, Message("the quantity '{}' is not a whole number", printable(quantity)), number) from None
    if pieces < 1:
        raise ReadError(file, Message("the quantity is {}; it must be 1 or more", pieces), number)
    angles = tuple(rotations.replace("/", " ").split())
    try:
        parse_angles(angles or ("free",), "rotations")
    except OptionError as problem:
        raise ReadError(file, str(problem), number) from None
    path = Path(name)
    drawing_path = name if path.is_absolute() else str(Path(file).parent / path)
    return WantedDrawing(drawing_path, pieces, angles)
