"""Plain drawings are read without ezdxf, and as ezdxf reads them; all others are left to it."""

from __future__ import annotations

import io
import random
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut.model.heartbeat import unseen
from leafcut.options import ReadOptions
from leafcut.read import dxf_document, read, read_contours, read_whole
from leafcut.read.dxf_plain import read_plain
from leafcut.read.format import Source

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.dxf"))
READERS: tuple[Callable[..., Any], ...] = (read, read_contours, read_whole)
VERSIONS = ("R12", "R2000", "R2004", "R2010", "R2018")


def drawing(version: str = "R2010", draw: Callable[[Any, Any], None] = lambda *_: None) -> str:
    """Return a drawing of all that is plain, with layers of every kind."""
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
    draw(document, space)
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


def told(reader: Callable[..., Any], data: bytes, monkeypatch: pytest.MonkeyPatch, *, plain: bool) -> str:
    """Return what a reader makes of a drawing, or its refusal, in words; with ezdxf unless it may be read as plain."""
    with monkeypatch.context() as patch:
        if not plain:
            patch.setattr(dxf_document, "read_plain", lambda *_: None)
        try:
            found = repr(reader(Source("part.dxf", data), ReadOptions()))
        except Exception as problem:
            found = repr(problem)
    return re.sub(r"np\.float64\(([^)]*)\)", r"\1", found)  # ezdxf keeps the places of polylines as arrays


def is_plain(text: str) -> bool:
    return read_plain(text.encode(), unseen) is not None


@pytest.mark.parametrize("reader", READERS)
def test_every_example_is_plain_and_is_read_as_by_ezdxf(
    reader: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert EXAMPLES
    for file in EXAMPLES:
        data = file.read_bytes()
        assert is_plain(data.decode()), file.name
        assert told(reader, data, monkeypatch, plain=True) == told(reader, data, monkeypatch, plain=False), file.name


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_is_read_as_by_ezdxf(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = drawing(version)
    assert is_plain(text)
    for reader in READERS:
        mine, theirs = (told(reader, text.encode(), monkeypatch, plain=plain) for plain in (True, False))
        assert mine == theirs
        assert mine.startswith("Part(")


def test_layers_that_are_asked_for_and_missing_are_told_with_the_same_names(monkeypatch: pytest.MonkeyPatch) -> None:
    def reader(source: Source, _: ReadOptions) -> Any:
        return read(source, ReadOptions(layers=("none",)))

    data = drawing().encode()
    mine, theirs = (told(reader, data, monkeypatch, plain=plain) for plain in (True, False))
    assert mine == theirs
    assert "6 on layer 0, 2 on layer A" in mine


#: What ezdxf must read, by what is in it.
NOT_PLAIN: dict[str, Callable[[Any, Any], Any]] = {
    "a text": lambda _, space: space.add_text("x"),
    "an ellipse": lambda _, space: space.add_ellipse((0, 0), (3, 0), 0.5),
    "a spline": lambda _, space: space.add_spline([(0, 0), (3, 1), (5, 0)]),
    "a block": lambda document, space: (
        document.blocks.new("B").add_circle((0, 0), 2),
        space.add_blockref("B", (1, 1)),
    ),
    "a turned plane": lambda _, space: space.add_circle((0, 0), 2, dxfattribs={"extrusion": (0, 0, -1)}),
    "a letter": lambda document, _: document.layers.add("Bohrung Ø"),
    "extended data": lambda document, space: (
        document.appids.add("X"),
        space.add_circle((0, 0), 2).set_xdata("X", [(1000, "y")]),
    ),
    "a polyline of old": lambda _, space: space.add_polyline2d([(0, 0), (5, 5)]),
    "paper space": lambda document, _: document.paperspace().add_circle((0, 0), 2),
}


@pytest.mark.parametrize("what", NOT_PLAIN)
def test_what_is_not_plain_is_left_to_ezdxf(what: str) -> None:
    assert not is_plain(drawing(draw=NOT_PLAIN[what]))


#: What is put in place of lines, or between them.
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
def test_a_damaged_drawing_is_read_as_by_ezdxf_or_by_ezdxf(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for those that ezdxf refuses for what no hole or line depends on: objects, styles and layouts."""
    text, chance, read_both = drawing(version), random.Random(version), 0
    for _ in range(120):
        odd = damaged(text, chance)
        if not is_plain(odd):
            continue
        reader = chance.choice(READERS)
        mine, theirs = (told(reader, odd.encode(), monkeypatch, plain=plain) for plain in (True, False))
        if "the drawing is damaged and could not be repaired" not in theirs:
            assert mine == theirs
            read_both += 1
    assert read_both > 5


def test_a_plain_drawing_is_read_without_importing_ezdxf() -> None:
    code = f"import sys; from leafcut.read import read; read({str(EXAMPLES[0])!r}); print('ezdxf' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
