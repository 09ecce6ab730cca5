"""Everything that readers return for small drawings: each field of each hole, contour, pocket and issue.

Each folder of `parts` has a drawing and `expected.txt`, checked by eye against the drawing.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from leafcut.errors import LeafcutError
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read import read, read_contours, read_pockets, read_whole
from plain_text import text_of

PARTS = Path(__file__).parent / "parts"

#: Drawing → the functions that read it, each with its options.
READ: dict[str, tuple[Callable[..., Part], ReadOptions]] = {
    "holes": (read, ReadOptions()),
    "holes of one layer, 3 to 9 mm": (read, ReadOptions(layers=("HOLES",), min_diameter=3.0, max_diameter=9.0)),
    "holes of the layers T1 and H*": (read, ReadOptions(layers=("T1", "H*"))),
    "all concentric circles": (read, ReadOptions(concentric="all")),
    "contours": (read_contours, ReadOptions()),
    "contours in inches": (read_contours, ReadOptions(units="in")),
    "pockets": (read_pockets, ReadOptions()),
    "everything": (read_whole, ReadOptions()),
    "holes from the corner of the drawing": (read, ReadOptions(origin="lower-left", rotate=math.pi / 2)),
}


def lines_of(part: Part) -> list[str]:
    """Return the fields of a part that are not empty; each element of a long one has a line of its own."""
    lines = []
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if isinstance(value, Part):
            lines += [f"{field.name}: {line}" for line in lines_of(value)]
        elif isinstance(value, tuple):
            lines += [f"{field.name}: {text_of(element)}" for element in value]
        elif value is not None and not (isinstance(value, str) and not value):
            lines.append(f"{field.name}: {text_of(value)}")
    return lines


def readings_of(file: Path, readers: Mapping[str, tuple[Callable[..., Part], ReadOptions]] = READ) -> str:
    """Return all that is read of a file; titles of equal results are joined."""
    titles: dict[str, str] = {}
    for title, (reader, options) in readers.items():
        try:
            text = "\n".join(lines_of(reader(file, options))).replace(str(file), file.name)
        except LeafcutError as problem:
            text = f"{type(problem).__name__}: {str(problem).removeprefix(str(file))}"
        titles[text] = f"{titles[text]}; {title}" if text in titles else title
    return "\n\n".join(f"== {title}\n{text}" for text, title in titles.items()) + "\n"


@pytest.mark.parametrize("folder", sorted(PARTS.iterdir()), ids=lambda folder: folder.name)
def test_a_drawing_is_read_as_it_was_drawn(folder: Path) -> None:
    (file,) = (file for file in folder.iterdir() if file.name != "expected.txt")
    assert readings_of(file) == (folder / "expected.txt").read_text(encoding="utf-8")
