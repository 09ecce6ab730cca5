"""V-carving: a V-bit cuts letters and ornaments with sloping walls that end exactly at their outlines."""

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
from leafcut.geometry.medial_axis import medial_axis
from leafcut.geometry.polyline import Polyline
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import Carving, Edge, PartRequest, PocketArea, TabRules, VBit
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

CELL = 0.1
OUTLINE = [(0, 0), (60, 0), (60, 30), (0, 30)]
#: An E, an A with its triangle, a diamond with a square island, and a square.
SHAPES = [
    [(5, 5), (13, 5), (13, 8), (8, 8), (8, 11), (12, 11), (12, 13), (8, 13), (8, 17), (13, 17), (13, 20), (5, 20)],
    [(16, 5), (19, 5), (20, 9), (26, 9), (27, 5), (30, 5), (25, 20), (21, 20)],
    [(20.7, 11), (23, 17), (25.3, 11)],
    [(34, 12), (40, 4), (46, 12), (40, 20)],
    [(39, 11), (41, 11), (41, 13), (39, 13)],
    [(50, 10), (55, 10), (55, 15), (50, 15)],
]
DOT = (52.0, 22.0, 2.0)
RULES = '[layer]\n"OUTLINE" = "profile"\n"CARVED" = "vcarve T6"\n'
TOOLS = """
[[tool]]
number = 6
kind = "v-bit"
diameter = "12 mm"
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


def carved(folder: Path, rules: str = RULES, tools: str = TOOLS, **options: Any) -> leafcut.ProgramResult:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline(OUTLINE, close=True, dxfattribs={"layer": "OUTLINE"})
    for shape in options.pop("shapes", SHAPES):
        space.add_lwpolyline(shape, close=options.get("closed", True), dxfattribs={"layer": "CARVED"})
    options.pop("closed", None)
    space.add_circle(DOT[:2], DOT[2], dxfattribs={"layer": "CARVED"})
    for shape in options.pop("pockets", []):
        space.add_lwpolyline(shape, close=True, dxfattribs={"layer": "POCKET"})
    document.saveas(folder / "part.dxf")
    (folder / "tools.toml").write_text(tools)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {"tools": folder / "tools.toml", "tool_number": 7, "operations": folder / "rules.toml"}
    given |= {"thickness": 6, "tabs": 0, "preset": "fast", "threads": 1}
    return leafcut.part(folder / "part.dxf", folder / "part.ngc", **{**given, **options})


def drawn() -> Any:
    """Return the area to carve. Shapes inside another one are islands."""
    area: Any = shapely.Point(DOT[:2]).buffer(DOT[2], quad_segs=128)
    for shape in SHAPES:
        area = area.symmetric_difference(shapely.Polygon(shape))
    return area


@pytest.mark.hazard
@pytest.mark.parametrize("angle, step", [(90, None), (120, 0.5)])
def test_the_material_after_the_program_slopes_from_the_outlines(
    angle: int, step: float | None, tmp_path: Path
) -> None:
    """In every cell, the depth is the distance to the nearest wall, divided by the tangent of half the angle."""
    options = {} if step is None else {"step_down": step}
    carved(tmp_path, tools=TOOLS.replace("90 deg", f"{angle} deg"), **options)
    field = leafcut.stock(
        tmp_path / "part.ngc", workpiece="1,1,-7,59,29,0", cell=CELL, tools=tmp_path / "tools.toml"
    ).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    area, spread = drawn(), math.tan(math.radians(0.5 * angle))
    wanted = -np.where(shapely.contains_xy(area, x, y), shapely.distance(area.boundary, shapely.points(x, y)), 0.0)
    assert (np.abs(field.heights - wanted / spread) <= CELL / spread).all()
    assert (np.abs(field.heights - wanted / spread) <= 0.03).mean() > 0.99


def test_the_carving_comes_before_the_outline_and_no_pass_exceeds_the_step_down(tmp_path: Path) -> None:
    outcome = carved(tmp_path, step_down=0.8)
    works = {(row.layer, row.operation, row.tool[:2]): row for row in outcome.detail.layers}
    assert works["CARVED", "vcarve", "T6"].shapes == 5
    deepest = max(shapely.maximum_inscribed_circle(piece).length for piece in drawn().geoms)
    assert works["CARVED", "vcarve", "T6"].depth == pytest.approx(deepest, abs=0.02)
    path = outcome.written
    tool = np.maximum.accumulate(np.where(path.kind == Kind.TOOL, path.ref, 0))
    first = np.flatnonzero((tool == 6) & (path.kind == Kind.FEED))
    assert first.max() < np.flatnonzero((tool == 7) & (path.end[:, 2] < 0.0)).min()
    assert {-0.8, -1.6, -2.4} <= {*path.end[first, 2].round(3)} and path.end[first, 2].min() >= -deepest - 0.01
    down = path.before[first, 2] - path.end[first, 2]
    length = np.linalg.norm(path.end[first] - path.before[first], axis=1)
    steep = (down > 0.0) & (path.end[first, 2] < 0.0)
    speeds = path.value[first][steep] * down[steep] / np.maximum(length[steep], 1e-9)
    assert speeds.max() <= 1.01 * 5.0 / 3.0  # a third of the feed


def test_a_tip_that_does_not_fit_everywhere_is_missing_work(tmp_path: Path) -> None:
    """The slot of 0.6 mm is narrower than the tip."""
    wide = TOOLS.replace("point_angle", 'tip_diameter = "0.8 mm"\npoint_angle')
    slot = [(5, 5), (9, 5), (9, 8.7), (15, 8.7), (15, 9.3), (9, 9.3), (9, 13), (5, 13)]
    issues = {issue.code: str(issue) for issue in carved(tmp_path, tools=wide, shapes=[slot]).issues}
    assert "1 shape with places narrower than the tip of the V-bit, not carved there" in issues["L707"]
    assert not any("tip" in str(issue) for issue in carved(tmp_path, tools=wide).issues)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "old, new, options, words",
    [
        ("vcarve T6", "vcarve", {}, "rules.toml:3: 'vcarve' needs a V-bit, such as"),
        ("vcarve T6", "vcarve T7", {}, "rules.toml:3: T7 end-mill Ø3 is not a V-bit or chamfer mill"),
        ("vcarve T6", "vcarve 2mm T6", {}, "mm deep, but the file allows at most 2 mm; use a V-bit with a larger"),
        ("vcarve T6", "vcarve 6mm T6", {}, "a depth of 6 mm goes through the plate of 6 mm"),
        ("vcarve T6", "vcarve T6", {"thickness": 2}, "but the plate allows at most 1.9 mm"),
        ("vcarve T6", "vcarve T6", {"tools": '"4 mm"'}, "but the diameter of T6 v-bit Ø4 allows at most 2 mm"),
        ("vcarve T6", "vcarve T6", {"tools": '"12 mm"\nflute_length = "2 mm"'}, "but the length of T6 v-bit Ø12"),
        ("vcarve T6", "vcarve T6", {"tools": '"12 mm"\ntip_diameter = "6 mm"'}, "is narrower than the tip of T6 v-bit"),
        ("vcarve T6", "vcarve T6", {"closed": False}, "'vcarve' needs closed shapes, but layer 'CARVED' has an"),
        ("vcarve T6", "vcarve T6", {"shapes": [[(70, 0), (75, 0), (75, 5)]]}, "lies outside the parts"),
        ('"CARVED"', '"POCKET" = "pocket 1mm"\n"CARVED"', {"pockets": [[(5, 5), (20, 5), (20, 20), (5, 20)]]},
         "rules.toml:4: the shape at (5, 5) on layer CARVED overlaps the pocket at (5, 5) on layer POCKET"),
    ],
)  # fmt: skip
def test_a_shape_that_cannot_be_carved_is_refused(
    old: str, new: str, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    tools = TOOLS.replace('"12 mm"', options.pop("tools", '"12 mm"'))
    with pytest.raises(LeafcutError) as refused:
        carved(tmp_path, RULES.replace(old, new), tools, **options)
    assert words in str(refused.value) and not (tmp_path / "part.ngc").exists()


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_carved_letters(rs274: str, name: str, tmp_path: Path) -> None:
    status, said = run_rs274(rs274, carved(tmp_path, dialect=name).text, tmp_path)
    assert status == 0, said[-500:]


def test_the_medial_axis_is_in_the_middle_and_ends_in_the_corners() -> None:
    """A bar of 20 mm × 4 mm, a disc, and a ring, whose axes are known."""
    bar = medial_axis(shapely.box(0, 0, 20, 4), 0.02, 0.001)
    ends = {tuple(np.round(branch[k], 1)) for branch in bar for k in (0, -1)}
    inner, corners = {(2.0, 2.0, 2.0), (18.0, 2.0, 2.0)}, {(x, y) for x in (0.1, 19.9) for y in (0.1, 3.9)}
    assert len(bar) == 5 and inner <= ends and len(ends - inner) == len(corners) == 4
    (dot,) = medial_axis(shapely.Point(5, 5).buffer(3, quad_segs=64), 0.02, 0.001)
    np.testing.assert_allclose(dot, [[5, 5, 3]], atol=2e-3)
    (ring,) = medial_axis(shapely.Point(5, 5).buffer(3, quad_segs=64) - shapely.Point(5, 5).buffer(1), 0.02, 0.001)
    np.testing.assert_allclose(np.hypot(*(ring[:, :2] - 5).T), 2.0, atol=0.02)


PLATE = Edge(Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True), inside=False, name="outline")
SQUARE = Polyline.of_points([(10, 10), (14, 10), (14, 14), (10, 14)], closed=True)
REQUEST = PartRequest(
    (PLATE,), (), tool=1, radius=2.0, thickness=3.0, bottom=-3.5, tabs=TabRules(0, 5.0, 1.0),
    carvings=(Carving(PocketArea(SQUARE, (), 2.0, "the square"), VBit(6, 3.0, 0.0, 1.0), 2.5),),
)  # fmt: skip
CARVED = """T6 M6
G0 X10 Y10 Z2
G1 Z0 F90
X12 Y12 Z-2
X14 Y10 Z0
X12 Y12 Z-2
X14 Y14 Z0
X12 Y12 Z-2
X10 Y14 Z0
G0 Z5
"""
OUTLINE_CUT = """T1 M6
G0 X0 Y-2 Z2
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


def judged(*parts: str, request: PartRequest = REQUEST) -> set[str]:
    text = "".join(["G21 G90 G17 G94\n", *parts, "M2\n"])
    return {str(one.what) for one in judge_part(request, interpret_written_program(text, load_dialect("linuxcnc")))}


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: text, None),
        (lambda text: text.replace("Z0 F90\n", "Z0 F90\nX12 Y12 Z-1.2\nX10 Y10 Z0\n"), None),
        (lambda text: "", "not cut"),
        (lambda text: text.replace("Z-2", "Z-1.9"), "not cut"),
        (lambda text: text.replace("Z-2", "Z-2.1"), "gouge"),
        (lambda text: text.replace("Z-2", "Z-2.6"), "tool"),
        (lambda text: text.replace("X14 Y14 Z0\n", ""), "not cut"),
        (lambda text: text.replace("X14 Y14 Z0", "X13.7 Y13.7 Z-0.3"), "not cut"),
        (lambda text: text.replace("X14 Y14 Z0", "X14.2 Y14.2 Z0"), "tool"),
        (lambda text: text.replace("Y14 Z0", "Y14 Z-0.1"), "gouge"),
        (lambda text: text.replace("X12 Y12", "X12.2 Y12"), "gouge"),
        (lambda text: text.replace("X1", "X2"), "not cut"),
        (lambda text: text.replace("T6", "T5"), "not cut"),
        (lambda text: text.replace("G0 Z5", "G0 X12 Y12\nZ-1\nZ5"), "rapid into the part"),
        (lambda text: "T6 M6\nG0 X10.5 Y10.5 Z2\nG1 Z-0.5 F90\nX13.5\nY13.5\nX10.5\nY10.5\nG0 Z5\n", "not cut"),
    ],
)  # fmt: skip
def test_errors_of_a_carved_shape_are_found(change: Callable[[str], str], what: str | None) -> None:
    """The last program touches the whole outline, but leaves the middle standing."""
    differences = judged(change(CARVED), OUTLINE_CUT)
    assert (what in differences) if what else not differences


@pytest.mark.hazard
def test_a_shape_that_is_carved_after_its_outline_is_found() -> None:
    assert judged(OUTLINE_CUT, CARVED) == {"order"}


@pytest.mark.hazard
@pytest.mark.parametrize("bit, limit", [(VBit(6, 1.5, 0.0, 1.0), 2.5), (VBit(6, 3.0, 0.0, 0.5), 2.5), (None, 1.9)])
def test_a_wrong_v_bit_or_depth_is_found(bit: VBit | None, limit: float) -> None:
    """The V-bit is too thin or too pointed for the walls, or the shape is deeper than allowed."""
    (carving,) = REQUEST.carvings
    request = replace(REQUEST, carvings=(replace(carving, bit=bit or carving.bit, limit=limit),))
    assert "not cut" in judged(CARVED, OUTLINE_CUT, request=request)
