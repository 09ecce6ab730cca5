"""Copies of a part on one plate: the program is that of a drawing with the copies drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

import leafcut
from leafcut.errors import LeafcutError
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings

FAST = {
    "thickness": 4,
    "tool_diameter": 3,
    "iterations": 5,
    "bound": False,
    "threads": 1,
    "feed": "600mm/min",
    "header": False,
    "mirror": "x",
    "rotate": "90deg",
}
RULES = """[layer]
"EDGE" = "profile"
"HOLE" = "bore"
"MARK" = "engrave 0.5mm"
"DEEP" = "pocket 2mm"
"""
PITCH = (70.0, 50.0)


def drawing(file: Path, places: list[tuple[float, float]], sheet: str = "", stated: bool = False) -> Path:
    """Draw a plate with a hole, an engraved arc and a pocket at each place; a sheet around them, if it has a layer."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for x, y in places:
        for layer, x0, y0, x1, y1 in (("EDGE", 0, 0, 40, 50), ("DEEP", 8, 8, 20, 20)):
            corners = [(x + x0, y + y0), (x + x1, y + y0), (x + x1, y + y1), (x + x0, y + y1)]
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
        space.add_circle((x + 30, y + 40), 4, dxfattribs={"layer": "HOLE"})
        space.add_arc((x + 15, y + 35), 6, 0, 120, dxfattribs={"layer": "MARK"})
    if sheet:
        x1, y1 = (400, 300) if stated else (50, 60)
        corners = [(-x1, -10), (x1, -10), (x1, y1), (-x1, y1)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": sheet})
    document.saveas(file)
    return file


def milled(source: Path, rules: Path | None = None, **options: Any) -> tuple[leafcut.ProgramResult, list[str]]:
    result = leafcut.part(source, source.with_suffix(".ngc"), operations=rules, **{**FAST, **options})
    return result, source.with_suffix(".ngc").read_text().splitlines()


def turned(column: int, row: int) -> tuple[float, float]:
    """Return the place in the drawing of a copy: mirroring and a quarter turn map x, y to -y, -x."""
    return -PITCH[1] * row, -PITCH[0] * column


@pytest.mark.hazard
@pytest.mark.parametrize(("layered", "columns", "rows"), [(False, 1, 2), (True, 2, 2)])
def test_copies_are_milled_as_if_they_were_drawn(layered: bool, columns: int, rows: int, tmp_path: Path) -> None:
    rules = tmp_path / "rules.toml"
    rules.write_text(RULES)
    asked = rules if layered else None
    drawn = drawing(tmp_path / "drawn.dxf", [turned(column, row) for row in range(rows) for column in range(columns)])
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    expected, blocks = milled(drawn, asked)
    result, copied = milled(once, asked, copies=f"{columns}x{rows}", pitch=PITCH)
    assert copied == blocks
    assert result.to_dict()["counts"] == expected.to_dict()["counts"]
    assert result.to_dict()["layers"] == expected.to_dict()["layers"]


def test_the_stated_outline_of_the_sheet_is_not_copied(tmp_path: Path) -> None:
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)], "STOCK", stated=True)
    options = {"mirror": None, "rotate": 0.0, "copies": "2x1", "pitch": PITCH}
    result, _ = milled(once, sheet_layers="STOCK", **options)
    assert result.to_dict()["counts"]["outlines"] == 2
    with pytest.raises(LeafcutError, match="layer 'STOCK' may hold the outline of the part or of the sheet"):
        milled(once, **options)
    with pytest.raises(LeafcutError, match="contours beyond the edge of the sheet"):
        milled(once, sheet_layers="STOCK", **{**options, "copies": "20x1"})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"copies": "3"}, "--copies: '3' is not a number of columns and rows"),
        ({"copies": "0x2"}, "--copies: '0x2' is not"),
        ({"copies": "3x1000"}, "--copies: '3x1000' is not"),
        ({"copies": "2x2"}, "the drawing is 50 x 40 mm; .* such as --pitch 60,50"),
        ({"copies": "2x2", "pitch": (60, 0)}, "--pitch: give two distances above 0"),
        ({"copies": "2x2", "pitch": (60, 50, 5)}, "--pitch: give two distances above 0"),
        ({"pitch": (60, 50)}, "--pitch: only used with --copies"),
        ({"copies": "2x1", "pitch": (45, 50)}, "1 pair of overlapping outlines"),
        ({"copies": "900x900", "pitch": (60, 50)}, "shapes exceed the limit of 20000 shapes; give fewer --copies"),
    ],
)
def test_copies_that_do_not_suit_are_refused(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    with pytest.raises(LeafcutError, match=words):
        milled(once, **options)
    assert not once.with_suffix(".ngc").exists()


def test_copies_of_a_solid_are_refused(examples: Path, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match="--copies: not used for a STEP file"):
        leafcut.part(examples / "stepped_plate.step", tmp_path / "a.ngc", copies="2x1", pitch=(200, 200), **FAST)


def test_the_preview_shows_the_copies(tmp_path: Path) -> None:
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    options = {"copies": "2x3", "pitch": PITCH}
    part = registry.work("part").preview_part(str(once), collect_settings(options))
    assert len(part.contours) == 6 * 4
    x0, y0, x1, y1 = part.extents
    assert (x1 - x0, y1 - y0) == pytest.approx((PITCH[0] + 40, 2 * PITCH[1] + 50))
    without_pitch = registry.work("part").preview_part(str(once), collect_settings({"copies": "2x3"}))
    assert len(without_pitch.contours) == 4
