"""Chamfers: the V-bit breaks the top edges of outlines, openings and holes, and cuts nothing else."""

from __future__ import annotations

import math
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
from leafcut.processes.part.model import Chamfer, Edge, PartRequest, TabRules, VBit
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

THICKNESS, DIAMETER, CELL = 6.0, 3.0, 0.1
#: An L with a sharp inner corner.
OUTLINE = [(0, 0), (50, 0), (50, 20), (20, 20), (20, 40), (0, 40)]
WINDOW = [(5, 5), (15, 5), (15, 15), (5, 15)]
DRILLED, BORED = (30.0, 10.0, 2.5), (40.0, 10.0, 2.75)
RULES = """[layer]
"OUTLINE" = "profile + chamfer 0.6mm T6"
"HOLES" = "bore + chamfer 0.6mm T6"
"""
TOOLS = """
[[tool]]
number = 4
diameter = "5 mm"
spindle_speed = "2000 rpm"
feed = "300 mm/min"
[[tool]]
number = 6
kind = "v-bit"
diameter = "6 mm"
point_angle = "90 deg"
spindle_speed = "6000 rpm"
feed = "300 mm/min"
[[tool]]
number = 7
kind = "end-mill"
diameter = "3 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
"""


def milled(folder: Path, rules: str = RULES, tools: str = TOOLS, **options: Any) -> leafcut.ProgramResult:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline(OUTLINE, close=True, dxfattribs={"layer": "OUTLINE"})
    space.add_lwpolyline(WINDOW, close=True, dxfattribs={"layer": "OUTLINE"})
    for x, y, radius in (DRILLED, BORED):
        space.add_circle((x, y), radius, dxfattribs={"layer": "HOLES"})
    document.saveas(folder / "part.dxf")
    (folder / "tools.toml").write_text(tools)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {"tools": folder / "tools.toml", "tool_number": 7, "operations": folder / "rules.toml"}
    given |= {"thickness": THICKNESS, "tabs": 0, "preset": "fast", "threads": 1}
    return leafcut.part(folder / "part.dxf", folder / "part.ngc", **{**given, **options})


def finished_part() -> Any:
    """Return the area of the part with the corners that the mill leaves."""
    r = 0.5 * DIAMETER
    outline = shapely.Polygon(OUTLINE).buffer(r, quad_segs=64).buffer(-r, quad_segs=64)
    window = shapely.Polygon(WINDOW).buffer(-r).buffer(r, quad_segs=64)
    return outline - window - shapely.union_all([shapely.Point(x, y).buffer(r, 64) for x, y, r in (DRILLED, BORED)])


@pytest.mark.hazard
@pytest.mark.parametrize("angle, tip", [(90, 0.0), (60, 0.0), (90, 0.4)])
def test_the_material_after_the_program_is_the_part_with_its_chamfers(angle: int, tip: float, tmp_path: Path) -> None:
    """The height of the bevel is compared in every cell of the part."""
    tools = TOOLS.replace("90 deg", f"{angle} deg")
    if tip:
        tools = tools.replace("point_angle", f'tip_diameter = "{tip} mm"\npoint_angle')
    milled(tmp_path, tools=tools)
    field = leafcut.stock(
        tmp_path / "part.ngc", workpiece="-6,-6,-7,56,46,0", cell=CELL, tools=tmp_path / "tools.toml"
    ).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    part = finished_part()
    away = shapely.distance(part.boundary, shapely.points(x, y))
    inside = shapely.contains_xy(part, x, y) & (away > 0.03)
    spread = math.tan(math.radians(0.5 * angle))
    wanted = np.minimum(away - 0.6, 0.0) / spread
    assert (np.abs(field.heights - wanted)[inside] <= CELL / spread).all()
    assert (field.heights[inside & (away > 0.63)] == 0.0).all()
    assert (np.abs(field.heights - wanted)[inside & (away > 0.1) & (away < 0.5)]).mean() < 0.02


def test_the_v_bit_breaks_the_edges_before_the_mill_cuts_them(tmp_path: Path) -> None:
    outcome = milled(tmp_path)
    assert [operation.tool.number for operation in outcome.operations] == [4, 6, 7]
    works = {(row.layer, row.shapes, row.operation, row.depth, row.tool[:2]) for row in outcome.detail.layers}
    assert {("OUTLINE", 2, "chamfer", 0.6, "T6"), ("HOLES", 2, "chamfer", 0.6, "T6")} <= works
    path = outcome.written
    tool = np.maximum.accumulate(np.where(path.kind == Kind.TOOL, path.ref, 0))
    cut = np.isin(path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    assert path.end[cut & (tool == 6), 2].min() == -0.6


def test_a_wide_chamfer_takes_several_passes(tmp_path: Path) -> None:
    path = milled(tmp_path, RULES.replace("0.6mm", "1.5mm"), step_down=1).written
    assert {-0.75, -1.5} <= {*path.end[:, 2].round(3)}


@pytest.mark.hazard
@pytest.mark.parametrize(
    "old, new, words",
    [
        ("profile + chamfer", "chamfer", "rules.toml:2: 'chamfer' needs the operation that mills the edge; write '"),
        ("0.6mm T6", "0.6mm", "rules.toml:2: 'chamfer' needs a V-bit, such as 'chamfer 0.5mm T6'"),
        ("0.6mm T6", "T6", "rules.toml:2: 'chamfer' needs a depth"),
        ("profile +", "pocket 2mm +", "rules.toml:2: 'pocket 2mm + chamfer 0.6mm T6' cannot be combined"),
        ("0.6mm T6", "0.6mm T6 + chamfer 0.2mm T6", "cannot be combined"),
        ("0.6mm T6", "0.6mm T9", "tools.toml has no T9"),
        ("0.6mm T6", "0.6mm T7", "rules.toml:2: T7 end-mill Ø3 is not a V-bit"),
        ("0.6mm T6", "0.6mm T4", "rules.toml:2: T4 drill Ø5 is a drill, not a milling tool"),
        ("0.6mm T6", "3.2mm T6", "a chamfer of 3.2 mm is too wide for T6"),
        ("0.6mm T6", "2.6mm T6", "would cut into"),
    ],
)  # fmt: skip
def test_a_chamfer_that_cannot_be_cut_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError) as refused:
        milled(tmp_path, RULES.replace(old, new))
    assert words in str(refused.value) and not (tmp_path / "part.ngc").exists()


@pytest.mark.hazard
@pytest.mark.parametrize("thickness, tabs, refused", [(2.0, 0, True), (2.5, 0, False), (3.0, 4, True), (4.0, 4, False)])
def test_a_chamfer_into_the_tabs_or_through_the_plate_is_refused(
    thickness: float, tabs: int, refused: bool, tmp_path: Path
) -> None:
    """The chamfer is 2.1 mm high. A plate of 3 mm has tabs of 1.5 mm."""
    rules = RULES.replace("0.6mm", "2.1mm").replace('"bore + chamfer 2.1mm T6"', '"ignore"')
    options: dict[str, Any] = {"thickness": thickness, "tabs": tabs, **({"tab_width": 2} if tabs else {})}
    if refused:
        with pytest.raises(LeafcutError, match="would cut into the tabs or through the plate"):
            milled(tmp_path, rules, **options)
    else:
        milled(tmp_path, rules, **options)


@pytest.mark.hazard
@pytest.mark.parametrize("width, refused", [(2.3, False), (2.4, True)])
def test_chamfers_that_would_meet_on_a_wall_are_refused(width: float, refused: bool, tmp_path: Path) -> None:
    """The wall between the holes is 4.75 mm wide."""
    rules = RULES.replace(" + chamfer 0.6mm T6", "", 1).replace("0.6mm", f"{width}mm")
    if refused:
        with pytest.raises(LeafcutError, match=r"a chamfer of 2.4 mm would cut into .*, 4.75 mm away"):
            milled(tmp_path, rules)
    else:
        milled(tmp_path, rules)


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_chamfers(rs274: str, name: str, tmp_path: Path) -> None:
    status, said = run_rs274(rs274, milled(tmp_path, dialect=name).text, tmp_path)
    assert status == 0, said[-500:]


def test_a_clamp_on_a_chamfer_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match="is in the keep-out zone"):
        milled(tmp_path, keep_out="14.9 9.9 15.1 10.1 5")


PLATE = Edge(Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True), inside=False, name="outline")
HOLE = Edge(Polyline.of_points([(10, 10), (20, 10), (20, 20), (10, 20)], closed=True), True, (0,), name="window")
BIT = VBit(6, 3.0, 0.2, 1.0)
REQUEST = PartRequest(
    (PLATE, HOLE), (), tool=1, radius=2.0, thickness=3.0, bottom=-3.5, tabs=TabRules(0, 5.0, 1.0),
    chamfers=(Chamfer(HOLE.path, True, 2.0, 0.5, BIT, "window"),),
)  # fmt: skip
CHAMFER = """T6 M6
G0 X12 Y10.2 Z2
G1 Z-0.5 F90
X18
G3 X19.8 Y12 J1.8 I0
G1 Y18
G3 X18 Y19.8 I-1.8 J0
G1 X12
G3 X10.2 Y18 I0 J-1.8
G1 Y12
G3 X12 Y10.2 I1.8 J0
G0 Z5
"""
WINDOW_CUT = "T1 M6\nG0 X12 Y12 Z2\nG1 Z-3.5 F90\nX18\nY18\nX12\nY12\nG0 Z5\n"
OUTLINE_CUT = """G0 X0 Y-2 Z2
G1 Z-3.5 F90
X40
G3 X42 Y0 I0 J2
G1 Y30
G3 X40 Y32 I-2 J0
G1 X0
G3 X-2 Y30 I0 J-2
G1 Y0
G3 X0 Y-2 I2 J0
G0 Z5
"""
START, END = "G21 G90 G17 G94\n", "M2\n"


def judged(*parts: str, request: PartRequest = REQUEST) -> set[str]:
    text = "".join([START, *parts, END])
    return {str(one.what) for one in judge_part(request, interpret_written_program(text, load_dialect("linuxcnc")))}


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: text, None),
        (lambda text: "", "not cut"),
        (lambda text: text.replace("Z-0.5", "Z-0.45"), "not cut"),
        (lambda text: text.replace("Z-0.5", "Z-0.55"), "tool"),
        (lambda text: text.replace("X18\nG3", "X16\nX18 Z0\nZ-0.5\nG3"), "not cut"),
        (lambda text: text.replace("10.2", "9.8").replace("19.8", "20.2").replace("1.8", "2.2"), "tool"),
        (lambda text: text.replace("10.2", "10.4").replace("19.8", "19.6").replace("1.8", "1.6"), "tool"),
        (lambda text: text.replace("T6", "T5"), "tool"),
        (lambda text: text + text, "cut twice"),
        (lambda text: text.replace("G0 Z5", "G1 X14 Y12\nG0 Z5"), "cut not drawn"),
        (lambda text: text.replace("G1 Z-0.5", "G0 Z-0.5\nG1 X12"), "rapid into the part"),
    ],
)
def test_errors_of_a_chamfer_are_found(change: Callable[[str], str], what: str | None) -> None:
    """A cut of the V-bit beside or below the chamfer counts as a cut with the wrong tool."""
    differences = judged(change(CHAMFER), WINDOW_CUT, OUTLINE_CUT)
    assert (what in differences) if what else not differences


@pytest.mark.hazard
def test_a_chamfer_after_its_edge_is_found() -> None:
    assert judged(WINDOW_CUT, CHAMFER, "T1 M6\n", OUTLINE_CUT) == {"order"}


@pytest.mark.hazard
def test_a_chamfer_that_cuts_into_another_wall_is_found() -> None:
    """The wall between the window and a slot is 0.4 mm wide."""
    slot = Edge(Polyline.of_points([(20.4, 10), (26, 10), (26, 20), (20.4, 20)], closed=True), True, (0,), name="slot")
    request = replace(REQUEST, edges=(*REQUEST.edges, slot))
    slot_cut = "G0 X22.4 Y12 Z2\nG1 Z-3.5 F90\nX24\nY18\nX22.4\nY12\nG0 Z5\n"
    assert judged(CHAMFER, WINDOW_CUT, slot_cut, OUTLINE_CUT, request=request) == {"gouge"}
