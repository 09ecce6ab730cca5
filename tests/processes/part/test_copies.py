"""Copies of a part on one plate: the program is that of a drawing with the copies drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

import leafcut
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.processes import registry
from leafcut.processes.part.model import Edge, PartRequest, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.processes.part.report import PartReport
from leafcut.processes.settings import collect_settings
from leafcut.proof.program import interpret_written_program
from leafcut.report.wording import fact_line
from leafcut.units import format_time

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


def drawing(
    file: Path, places: list[tuple[float, float]], sheet: str = "", stated: bool = False, notes: bool = False
) -> Path:
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
    if notes:
        space.add_line((-30, -20), (90, 100), dxfattribs={"layer": "NOTES"})
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
        ({"copies": "2x2"}, "distance between the copies is missing; .* such as --copy-spacing 9mm, or"),
        ({"copies": "2x2", "copy_spacing": 8.9}, "--copy-spacing 8.9 mm is too small, .* give --copy-spacing 9mm"),
        ({"copies": "1x2", "copy_spacing": 8.9, "finish": 0.25}, "need 9.5 mm between two copies"),
        ({"copies": "2x1", "copy_spacing": 3, "tabs": 0}, "give --copy-spacing 3.1mm"),
        ({"copies": "2x2", "copy_spacing": 9, "pitch": (60, 50)}, "--copy-spacing: not used with --pitch"),
        ({"copy_spacing": 9}, "--copy-spacing: only used with --copies"),
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


def test_the_preview_shows_the_copies(tmp_path: Path) -> None:
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    options = {"copies": "2x3", "pitch": PITCH}
    part = registry.work("part").preview_part(str(once), collect_settings(options))
    assert len(part.contours) == 6 * 4
    x0, y0, x1, y1 = part.extents
    assert (x1 - x0, y1 - y0) == pytest.approx((PITCH[0] + 40, 2 * PITCH[1] + 50))
    spaced = registry.work("part").preview_part(str(once), collect_settings({"copies": "2x3", "copy_spacing": 30.0}))
    assert spaced.extents == pytest.approx((x0, y0, x0 + 2 * 40 + 30, y0 + 3 * 50 + 2 * 30))
    without_pitch = registry.work("part").preview_part(str(once), collect_settings({"copies": "2x3"}))
    assert len(without_pitch.contours) == 4


@pytest.mark.parametrize("layered", [False, True])
def test_the_spacing_is_the_gap_between_the_milled_shapes(layered: bool, tmp_path: Path) -> None:
    """A sheet and an ignored layer are larger than the part, which is 50 x 40 mm after a quarter turn."""
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)], "STOCK", stated=True, notes=True)
    rules = tmp_path / "rules.toml"
    rules.write_text(RULES + '"NOTES" = "ignore"\n')
    selection = {} if layered else {"ignore_layers": "NOTES"}
    asked = {"copies": "1x2", "sheet_layers": "STOCK", **selection}
    result, blocks = milled(once, rules if layered else None, copy_spacing=9.5, **asked)
    _, expected = milled(once, rules if layered else None, pitch=(59.5, 49.5), **asked)
    assert blocks == expected
    assert result.to_dict()["copies"]["pitch_mm"] == [59.5, 49.5]


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("options", "spacing"),
    [
        ({}, 9.0),
        ({"tab_width": 8}, 10.0),
        ({"tabs": 0}, 3.1),
        pytest.param({"finish": 0.2}, 9.4, marks=pytest.mark.slow),
        ({"tabs": 0, "finish": 0.2}, 3.5),
    ],
)
def test_the_least_spacing_leaves_room_for_every_cut_and_tab(
    options: dict[str, Any], spacing: float, tmp_path: Path
) -> None:
    """A smaller spacing is refused, and this spacing gives the same work for each copy."""
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    single, _ = milled(once, **options)
    result, _ = milled(once, copies="2x1", copy_spacing=spacing, **options)
    expected = {name: 2 * number for name, number in single.to_dict()["counts"].items()}
    assert result.to_dict()["counts"] == expected
    assert [issue.missing.count for issue in result.missing] == [2 * issue.missing.count for issue in single.missing]
    with pytest.raises(LeafcutError, match=f"give --copy-spacing {spacing:g}mm"):
        milled(once, copies="1x2", copy_spacing=spacing - 0.1, **options)


def test_the_report_gives_the_number_of_copies_and_the_time_of_each(tmp_path: Path) -> None:
    once = drawing(tmp_path / "once.dxf", [(0.0, 0.0)])
    result, _ = milled(once, copies="2x1", pitch=PITCH)
    answer = result.to_dict()
    time = answer["after"]["time_s"]
    assert answer["copies"] == {"count": 2, "pitch_mm": list(PITCH), "time_each_s": pytest.approx(0.5 * time)}
    lines = {str(fact.name): fact_line(fact) for fact in PartReport(result).facts if fact.name}
    assert lines["Copies"] == "2, 2 x 1, pitch 70 mm in X and 50 mm in Y"
    assert lines["Time per copy"] == f"{format_time(0.5 * time)}, average of all copies"
    assert "copies" not in milled(once)[0].to_dict()


SQUARE, SPACING = 40.0, 20.0


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("copies", "spacing", "what"),
    [("2x1", SPACING, None), ("1x1", SPACING, "not cut"), ("3x1", SPACING, "cut not drawn"), ("2x1", 18.0, "gouge")],
)
def test_a_copy_that_is_missing_or_misplaced_is_found(
    copies: str, spacing: float, what: str | None, tmp_path: Path
) -> None:
    """The request has two squares. The programs have one, two or three squares."""
    document = ezdxf.new(units=4)
    corners = [(0.0, 0.0), (SQUARE, 0.0), (SQUARE, SQUARE), (0.0, SQUARE)]
    document.modelspace().add_lwpolyline(corners, close=True)
    document.saveas(tmp_path / "square.dxf")
    squares = [[(x + dx, y) for x, y in corners] for dx in (0.0, SQUARE + SPACING)]
    request = PartRequest(
        tuple(Edge(Polyline.of_points(one, closed=True), inside=False, name="square", tabs=2) for one in squares),
        (),
        tool=1,
        radius=1.5,
        thickness=4.0,
        bottom=-4.5,
        tabs=TabRules(2, 5.0, 1.0),
    )
    options = {**FAST, "mirror": None, "rotate": 0.0, "tabs": 2, "tab_width": 5.0, "tab_height": 1.0}
    program = leafcut.part(tmp_path / "square.dxf", copies=copies, copy_spacing=spacing, **options).text
    differences = judge_part(request, interpret_written_program(program, load_dialect("linuxcnc")))
    assert (what in {one.what for one in differences}) if what else differences == []
