"""Drawings of every DXF version, plain ones and damaged ones."""

from __future__ import annotations

import io
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut.errors import ReadError
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read import read, read_contours, read_whole
from leafcut.read.format import Source

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.dxf"))
READERS: tuple[Callable[..., Part], ...] = (read, read_contours, read_whole)
VERSIONS = ("R12", "R2000", "R2004", "R2010", "R2018")


def drawing(version: str) -> str:
    """Return a drawing with layers of every kind, and all entities that lie in the plane."""
    document = ezdxf.new(version)
    if version != "R12":
        document.header["$INSUNITS"] = 4
    document.layers.add("A", color=1)
    document.layers.add("B", color=2).off()
    document.layers.add("C").freeze()
    space = document.modelspace()
    for k in range(6):
        space.add_circle((k * 5, 3, 0.5 * k), 1 + k, dxfattribs={"layer": "0ABC"[k % 4]})
    space.add_line((0, 0), (50, 0))
    space.add_arc((10, 10), 2, 0, 180)
    space.add_arc((10, 10), 2, 180, 360)
    space.add_point((3, 4, 5))
    space.add_circle((9, 9), 1, dxfattribs={"invisible": 1})
    if version != "R12":
        space.add_lwpolyline([(0, 0, 0, 0, 1), (4, 0, 0, 0, 1)], close=True)
        space.add_lwpolyline([(0, 0), (9, 0, 0.5, 0.5, 0.3), (9, 9)], dxfattribs={"elevation": 2})
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.name)
def test_every_example_is_read_without_a_repair(file: Path) -> None:
    assert not [issue for issue in read_whole(file).issues if issue.code == "L101"]


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_shows_the_same(version: str) -> None:
    source = Source("part.dxf", drawing(version).encode())
    part, whole = read(source, ReadOptions(units="mm")), read_whole(source)
    r12 = version == "R12"
    # The circles on layers 0 and A, the joined arcs and the point; R12 has neither light polylines nor invisible
    # entities.
    expected = [
        (0.0, 3.0, 2.0, 0.0), (5.0, 3.0, 4.0, 0.5), (20.0, 3.0, 10.0, 2.0), (25.0, 3.0, 12.0, 2.5),
        (10.0, 10.0, 4.0, 0.0), (3.0, 4.0, 0.0, 5.0), (9.0, 9.0, 2.0, 0.0) if r12 else (2.0, 0.0, 4.0, 0.0),
    ]  # fmt: skip
    assert sorted((hole.x, hole.y, hole.diameter, hole.z) for hole in part.holes) == sorted(expected)
    hidden = [issue.message for issue in part.issues if issue.code == "L204"]
    assert hidden == ["left out: 1 on layer B, 1 on layer C" + ("" if r12 else ", 1 invisible")]
    assert len(whole.contours) == (3 if r12 else 5)
    assert all(type(value) is float for hole in part.holes for value in (hole.x, hole.y, hole.diameter))


def test_layers_that_are_asked_for_and_missing_are_reported_with_those_that_exist() -> None:
    with pytest.raises(ReadError, match="6 on layer 0, 2 on layer A"):
        read(Source("part.dxf", drawing("R2010").encode()), ReadOptions(layers=("none",)))


#: Lines that replace others or stand between them.
_ODD = (
    "0", "1", "5", "8", "10", "20", "30", "38", "40", "42", "50", "60", "62", "67", "70", "100", "102", "210", "330",
    "999", "1001", "LINE", "CIRCLE", "POINT", "-3", "1e3", "nan", "abc", "", "INSERT", "ENDSEC", "SECTION", "ENTITIES",
    "BLOCK", "1F", " 7 ", "AcDbEntity", "{ACAD", "}", "A", "\r",
)  # fmt: skip


def damaged(text: str, chance: random.Random) -> str:
    """Return a drawing with up to three lines changed, removed or added, most of them in its entities."""
    lines = text.split("\n")
    entities = lines.index("ENTITIES")
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        first = entities if chance.random() < 0.8 else 0
        at = chance.randrange(first, len(lines) - 3)
        pair = at - at % 2
        match chance.randrange(6):
            case 0:
                del lines[pair : pair + 2]
            case 1:
                del lines[at]
            case 2:
                lines[pair:pair] = [chance.choice(_ODD[:20]), chance.choice(_ODD)]
            case 3:
                other = chance.randrange(first, len(lines) - 3) & ~1
                lines[pair : pair + 2], lines[other : other + 2] = lines[other : other + 2], lines[pair : pair + 2]
            case 4:
                lines[pair:pair] = lines[pair : pair + 2]
            case _:
                lines[at] = chance.choice(_ODD)
    return "\n".join(lines)


@pytest.mark.parametrize("version", ["R12", *(pytest.param(v, marks=pytest.mark.slow) for v in ("R2000", "R2018"))])
def test_a_damaged_drawing_is_read_or_refused_in_one_line(version: str) -> None:
    text, chance, parts = drawing(version), random.Random(version), 0
    for _ in range(60):
        reader: Any = chance.choice(READERS)
        try:
            parts += bool(reader(Source("part.dxf", damaged(text, chance).encode()), ReadOptions()))
        except ReadError as problem:
            assert "\n" not in str(problem)
    assert parts > 5
