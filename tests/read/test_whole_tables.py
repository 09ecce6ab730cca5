"""Whole tables of the readers: the keys of profiles and libraries, and the letters that are engraved.

`tables/` has each table as text. The keys are those of the manual; the strokes were checked by eye in a drawing.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.read.controllers.importing import KINDS
from leafcut.read.controllers.questions import QUESTIONS
from leafcut.read.dxf_texts import text_line_strokes
from leafcut.read.machine_keys import PROFILE_KEYS
from leafcut.read.registry import BUILT_IN, detect_format_name
from leafcut.read.tool_keys import HOLE_KEYS, TOOL_KEYS
from plain_text import number, text_of

TABLES = Path(__file__).parent / "tables"

#: One letter for each accent, each composed letter and each substitute, and letters of different heights.
LETTERS = "ag1ÀàÁáÂâÃãÄäÅåČčÇçìíïØø±⌀∅°–—−’‘“”\u00a0\tı"


def stroke_text(letter: str) -> str:
    """Return the strokes of a letter between two others, in units of the font: 21 to the height of a capital."""
    strokes, width = text_line_strokes(f"I{letter}I")
    lines = [" ".join(f"{number(21 * x)},{number(21 * y)}" for x, y in stroke) for stroke in strokes]
    return f"{letter!a}: width {number(21 * width)}: {'; '.join(lines)}"


TEXTS: dict[str, Callable[[], list[str]]] = {
    "profile keys": lambda: [text_of(key) for key in PROFILE_KEYS],
    "tool keys": lambda: [text_of(key) for key in (*TOOL_KEYS, *HOLE_KEYS)],
    "questions": lambda: [text_of(question) for question in QUESTIONS],
    "kinds of settings": lambda: [f"{name}: {kind.name}, {kind.help}" for name, kind in KINDS.items()],
    "formats": lambda: [
        f"{f.name} {' '.join((*f.extensions, *f.prefix))}: {f.help}; for {', '.join(f.processes)}" for f in BUILT_IN
    ],
    "letters": lambda: [stroke_text(letter) for letter in LETTERS],
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_table_is_the_one_that_was_checked(name: str) -> None:
    assert TEXTS[name]() == (TABLES / f"{name}.txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("letter", ["я", "ĕ"])
def test_a_letter_without_strokes_is_named(letter: str) -> None:
    with pytest.raises(ValueError, match=f"^no strokes for '{letter}'$"):
        text_line_strokes(f"a{letter}")


@pytest.mark.parametrize(
    "geometry",
    [
        "POINT",
        "LINESTRING",
        "LINEARRING",
        "POLYGON",
        "MULTIPOINT",
        "MULTILINESTRING",
        "MULTIPOLYGON",
        "GEOMETRYCOLLECTION",
        "CIRCULARSTRING",
        "COMPOUNDCURVE",
        "CURVEPOLYGON",
        "MULTICURVE",
        "MULTISURFACE",
        "POLYHEDRALSURFACE",
        "TIN",
        "TRIANGLE",
    ],
)
@pytest.mark.parametrize("text", ["{} ((0 0, 9 0, 9 9, 0 0))\n", "SRID=4326;{} Z ((0 0 1, 9 0 1))\n", "{} EMPTY\n"])
def test_each_geometry_of_well_known_text_is_recognised(geometry: str, text: str, tmp_path: Path) -> None:
    for written in (geometry, geometry.lower()):
        (tmp_path / "drawing.x").write_text(text.format(written))
        assert detect_format_name(tmp_path / "drawing.x") == "wkt"


@pytest.mark.parametrize("axis", "ABCUVW")
def test_a_block_with_an_axis_beside_xyz_is_kept(axis: str) -> None:
    program = interpret_program(f"G21 G90 F100\nG0 X0 Y0 Z0\nG1 X1 {axis}5\nM2\n", load_dialect("linuxcnc"))
    assert list(program.fixed.values()) == [f"the axis {axis} is not understood"]
