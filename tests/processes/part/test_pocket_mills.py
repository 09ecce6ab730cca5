"""Pockets of other end mills of the library: each mill clears its pockets with its own diameter, feed and step-down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

import leafcut
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import Edge, PartRequest, PocketArea, PocketMill, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

CELL = 0.2
OUTLINE, SMALL, LARGE, WINDOW = (0, 0, 90, 50), (8, 8, 28, 20), (40, 8, 80, 42), (52, 18, 66, 32)
RULES = """[layer]
"OUTLINE" = "profile"
"WINDOW" = "profile"
"SMALL" = "pocket 2mm T5"
"LARGE" = "pocket 3mm T6"
"""
TOOLS = """
[[tool]]
number = 4
diameter = "5 mm"
spindle_speed = "2000 rpm"
feed = "300 mm/min"
[[tool]]
number = 5
kind = "end-mill"
diameter = "2 mm"
spindle_speed = "6000 rpm"
feed = "300 mm/min"
[[tool]]
number = 6
kind = "end-mill"
diameter = "6 mm"
spindle_speed = "4000 rpm"
feed = "800 mm/min"
[[tool]]
number = 7
kind = "end-mill"
diameter = "3 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
[[tool]]
number = 8
kind = "v-bit"
diameter = "6 mm"
point_angle = "60 deg"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
[[tool]]
number = 9
kind = "end-mill"
diameter = "3 mm"
stickout = "1 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
"""


def milled(folder: Path, rules: str = RULES, **options: Any) -> leafcut.ProgramResult:
    document = ezdxf.new(units=4)
    for layer, (x0, y0, x1, y1) in {"OUTLINE": OUTLINE, "SMALL": SMALL, "LARGE": LARGE, "WINDOW": WINDOW}.items():
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "part.dxf")
    (folder / "tools.toml").write_text(TOOLS)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {
        "tools": folder / "tools.toml",
        "tool_number": 7,
        "operations": folder / "rules.toml",
        "tabs": 0,
    }
    return leafcut.part(
        folder / "part.dxf", folder / "part.ngc", **{**given, "thickness": 6, "preset": "fast", "threads": 1, **options}
    )


@pytest.mark.hazard
@pytest.mark.parametrize("finish", [0.0, 0.3])
def test_a_pocket_is_cleared_by_its_own_mill(finish: float, tmp_path: Path) -> None:
    """The material after the program is the drawing with the corners of each mill; cells at edges are not compared."""
    outcome = milled(tmp_path, finish=finish)
    assert [operation.tool.number for operation in outcome.operations] == [5, 6, 7]
    field = leafcut.stock(
        tmp_path / "part.ngc", workpiece="-6,-6,-7,96,56,0", cell=CELL, tools=tmp_path / "tools.toml"
    ).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    window = shapely.box(*WINDOW).buffer(CELL)
    for (box, radius), depth in {(SMALL, 1.0): 2.0, (LARGE, 3.0): 3.0}.items():
        area = shapely.box(*box).buffer(-radius).buffer(radius, quad_segs=64)
        floor = shapely.contains_xy(area.buffer(-CELL) - window, x, y)
        assert (np.round(field.heights[floor], 3) == -depth).all()
        around = shapely.contains_xy(shapely.box(*box).buffer(2.0) - area.buffer(CELL), x, y)
        assert (field.heights[around] == 0.0).all()


def test_the_feed_and_the_step_down_are_those_of_the_mill(tmp_path: Path) -> None:
    path = milled(tmp_path).written
    tool = np.maximum.accumulate(np.where(path.kind == Kind.TOOL, path.ref, 0))
    level = (path.kind == Kind.FEED) & (path.end[:, 2] == path.before[:, 2]) & (path.end[:, 2] < 0.0)
    assert {*np.round(60.0 * path.value[level & (tool == 5)])} == {300.0}
    assert {*path.end[level & (tool == 5), 2]} == {-1.0, -2.0} and {*path.end[level & (tool == 6), 2]} == {-3.0}
    assert np.flatnonzero(tool == 6).max() < np.flatnonzero(level & (tool == 7)).min()


def test_all_pockets_of_a_mill_are_one_stage(tmp_path: Path) -> None:
    rules = RULES.replace("3mm T6", "3mm T5").replace('"WINDOW" = "profile"', '"WINDOW" = "ignore"')
    outcome = milled(tmp_path, rules)
    works = {(row.layer, row.operation, row.tool[:2]) for row in outcome.detail.layers if row.tool}
    assert works == {("OUTLINE", "profile", "T7"), ("SMALL", "pocket", "T5"), ("LARGE", "pocket", "T5")}
    assert [(operation.tool.number, operation.cuts) for operation in outcome.operations] == [(5, 2), (7, 1)]


def test_the_corners_that_are_left_are_those_of_the_mill(tmp_path: Path) -> None:
    issues = [str(issue) for issue in milled(tmp_path).issues if issue.code == "L701"]
    assert len(issues) == 2 and "2 mm" in issues[0] and "6 mm" in issues[1]


def test_the_mill_of_the_part_may_be_named(tmp_path: Path) -> None:
    named = milled(tmp_path, RULES.replace("T5", "T7").replace("T6", "T7"))
    unnamed = milled(tmp_path, RULES.replace(" T5", "").replace(" T6", ""))
    np.testing.assert_array_equal(named.written.end, unnamed.written.end)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "tool, options, words",
    [
        ("T3", {}, "rules.toml:4: .*tools.toml has no T3"),
        ("T4", {}, "rules.toml:4: .* is a drill, not an end mill"),
        ("T8", {}, "rules.toml:4: .* is a .*, not an end mill"),
        ("T9", {}, "rules.toml:4: .* cuts 1 mm deep at most, but 2 mm are needed"),
        ("T5", {"tools": None, "tool_number": None, "tool_diameter": 3}, "T5 needs a tool library; give --tools"),
        ("T5", {"finish": 1.2}, "--finish 1.2 mm: the allowance must be less than the radius of the mill, 1 mm"),
    ],
)
def test_a_mill_that_cannot_clear_a_pocket_is_refused(
    tool: str, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(LeafcutError, match=words):
        milled(tmp_path, RULES.replace("T5", tool), **options)


def test_a_pocket_narrower_than_its_mill_is_refused(tmp_path: Path) -> None:
    rules = RULES.replace('"WINDOW" = "profile"', '"WINDOW" = "ignore"').replace("T5", "T6")
    (tmp_path / "wide.toml").write_text(TOOLS.replace('"6 mm"', '"13 mm"'))
    with pytest.raises(LeafcutError, match=r"the pocket at .* on layer SMALL is narrower than the mill of 13 mm"):
        milled(tmp_path, rules, tools=tmp_path / "wide.toml")


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_pockets_of_several_mills(rs274: str, name: str, tmp_path: Path) -> None:
    status, said = run_rs274(rs274, milled(tmp_path, dialect=name).text, tmp_path)
    assert status == 0, said[-500:]


PLATE = Edge(Polyline.of_points([(-9, -9), (60, -9), (60, 30), (-9, 30)], closed=True), inside=False)
AREA = Polyline.of_points([(10, 10), (30, 10), (30, 13), (10, 13)], closed=True)
REQUEST = PartRequest(
    (PLATE,), (), tool=1, radius=2.0, thickness=3.0, bottom=-3.5, tabs=TabRules(0, 5.0, 1.0),
    pockets=(PocketArea(AREA, (), 1.0, "the pocket", mill=PocketMill(5, 1.0, 1.0, 1.5)),),
)  # fmt: skip
PROGRAM = """G21 G90 G17 G94
T5 M6
G0 X11 Y11 Z2
G1 Z-1 F90
X29
Y12
X11
Y11
G0 Z5
T1 M6
G0 X-11 Y-9 Z2
G1 Z-3.5 F90
Y30
G2 X-9 Y32 I2 J0
G1 X60
G2 X62 Y30 I0 J-2
G1 Y-9
G2 X60 Y-11 I-2 J0
G1 X-9
G2 X-11 Y-9 I0 J2
G0 Z5
M2
"""


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: text, None),
        (lambda text: text.replace("T5", "T1"), "not cut"),
        (lambda text: text.replace("T5", "T6"), "tool"),
        (lambda text: text.replace("X29", "X28"), "not cut"),
        (lambda text: text.replace("X29", "X29.1"), "gouge"),
        (lambda text: text.replace("Z-1 ", "Z-1.1 "), "gouge"),
        (lambda text: text.replace("Z-1 ", "Z-0.9 "), "not cut"),
        (lambda text: text.replace("F90\nX29", "F100\nX29"), "feed"),
        (lambda text: text.replace("G1 Z-1 F90", "G0 Z-0.5\nG1 Z-1 F90"), "rapid into the part"),
        (lambda text: text.replace("Y11\nG0 Z5\nT1", "Y11\nG0 Z5\nG0 Z-0.5\nG0 Z5\nT1"), None),
    ],
)
def test_errors_of_a_pocket_of_another_mill_are_found(change: Callable[[str], str], what: str | None) -> None:
    differences = {
        str(one.what)
        for one in judge_part(REQUEST, interpret_written_program(change(PROGRAM), load_dialect("linuxcnc")))
    }
    assert (what in differences) if what else not differences


@pytest.mark.hazard
def test_a_pocket_of_another_mill_that_is_cut_too_deep_at_once_is_found() -> None:
    (pocket,) = REQUEST.pockets
    request = replace(REQUEST, pockets=(replace(pocket, mill=PocketMill(5, 1.0, 0.6, 1.5)),), steps={1: 9.0})
    differences = {
        str(one.what) for one in judge_part(request, interpret_written_program(PROGRAM, load_dialect("linuxcnc")))
    }
    assert "too deep" in differences
