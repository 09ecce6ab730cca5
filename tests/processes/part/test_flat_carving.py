"""V-carving with a flat floor: an end mill clears the floor, and the V-bit cuts the slopes and the narrow places."""

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
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.part.model import Carving, Edge, PartRequest, PocketArea, PocketMill, TabRules, VBit
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

CELL, DEPTH = 0.125, 1.0
OUTLINE = [(0, 0), (38, 0), (38, 19), (0, 19)]
#: An L and a square with an island, both with places that are too narrow for the end mill.
SHAPES = [
    [(3, 3), (12, 3), (12, 8.5), (6, 8.5), (6, 16), (3, 16)],
    [(16, 4), (26, 4), (26, 14), (16, 14)],
    [(19, 7), (21, 7), (21, 10), (19, 10)],
]
DOT = (33.0, 9.0, 3.0)
BIG = [(2, 2), (17, 2), (17, 17), (2, 17)]
RULES = '[layer]\n"OUTLINE" = "profile"\n"CARVED" = "vcarve 1mm T6 flat T5"\n'
TOOLS = """
[[tool]]
number = 6
kind = "v-bit"
diameter = "8 mm"
tip_diameter = "0.2 mm"
point_angle = "90 deg"
spindle_speed = "6000 rpm"
feed = "300 mm/min"
[[tool]]
number = 5
kind = "end-mill"
diameter = "2 mm"
spindle_speed = "6000 rpm"
feed = "400 mm/min"
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
        space.add_lwpolyline(shape, close=True, dxfattribs={"layer": "CARVED"})
    space.add_circle(DOT[:2], options.pop("dot", DOT[2]), dxfattribs={"layer": "CARVED"})
    document.saveas(folder / "part.dxf")
    (folder / "tools.toml").write_text(tools)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {"tools": folder / "tools.toml", "tool_number": 7, "operations": folder / "rules.toml"}
    given |= {"thickness": 6, "tabs": 0, "preset": "fast", "threads": 1}
    return leafcut.part(folder / "part.dxf", folder / "part.ngc", **{**given, **options})


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> leafcut.ProgramResult:
    return carved(tmp_path_factory.mktemp("flat"), step_down=0.6)


def drawn() -> Any:
    """Return the area to carve. The last shape is an island."""
    area: Any = shapely.Point(DOT[:2]).buffer(DOT[2], quad_segs=128)
    for shape in SHAPES:
        area = area.symmetric_difference(shapely.Polygon(shape))
    return area


def tools_of(path: Toolpath) -> np.ndarray:
    """Return the tool number of each row."""
    changes = np.where(path.kind == Kind.TOOL, np.arange(len(path)), 0)
    return path.ref[np.maximum.accumulate(changes)]


def check_field(program: Path, tools: Path, angle: float, tip: float) -> None:
    """Check the depth of every cell: the distance to the nearest wall, divided by the tangent of half the angle, but at
    most the depth of the floor.

    A flat tip leaves a little material where two slopes meet.
    """
    field = leafcut.stock(program, workpiece="1,1,-7,37,18,0", cell=CELL, tools=tools).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    area, spread = drawn(), math.tan(math.radians(0.5 * angle))
    away = np.where(shapely.contains_xy(area, x, y), shapely.distance(area.boundary, shapely.points(x, y)), 0.0)
    error = field.heights + np.minimum(away / spread, DEPTH)
    assert (error >= -CELL / spread).all() and (error <= (CELL + tip) / spread).all()
    assert (np.abs(error) <= 0.05).mean() > 0.98
    floor = shapely.contains_xy(area.buffer(-spread * DEPTH - CELL - 2.0 * tip), x, y)
    assert floor.any() and (error[floor] <= 0.05).all()


@pytest.mark.hazard
@pytest.mark.parametrize("angle, tip", [(90, 0.1), (60, 0.25), (120, 0.0)])
def test_the_material_after_the_program_slopes_down_to_a_flat_floor(angle: int, tip: float, tmp_path: Path) -> None:
    tools = TOOLS.replace("90 deg", f"{angle} deg").replace('"0.2 mm"', f'"{2.0 * tip} mm"')
    carved(tmp_path, tools=tools if tip else tools.replace('tip_diameter = "0.0 mm"\n', ""))
    check_field(tmp_path / "part.ngc", tmp_path / "tools.toml", angle, tip)


@pytest.mark.hazard
def test_the_end_mill_clears_the_floor_before_the_v_bit_cuts_the_slopes(outcome: leafcut.ProgramResult) -> None:
    assert [operation.tool.number for operation in outcome.operations] == [5, 6, 7]
    (row,) = (row for row in outcome.detail.layers if row.operation == "vcarve")
    assert (row.depth, row.tool) == (DEPTH, "T5 end-mill Ø2 + T6 v-bit Ø8")
    path = outcome.written
    low = (path.kind == Kind.FEED) & (path.end[:, 2] < 0.0)
    own = low & (tools_of(path) == 5)
    assert {*path.end[own & (path.end[:, 2] == path.before[:, 2]), 2].round(3)} == {-0.5, -1.0}
    floor = drawn().buffer(-DEPTH - 1.0 + 0.02, quad_segs=64)
    assert shapely.contains_xy(floor, *path.end[own, :2].T).all()
    assert {-0.6, -1.0} <= {*path.end[low & (tools_of(path) == 6), 2].round(3)}


@pytest.mark.hazard
def test_the_v_bit_stays_out_of_the_floor_that_the_end_mill_has_cleared(outcome: leafcut.ProgramResult) -> None:
    path, area = outcome.written, drawn()
    low = (tools_of(path) == 6) & (path.end[:, 2] <= -DEPTH) & (path.before[:, 2] <= -DEPTH)
    floor = area.buffer(-DEPTH, quad_segs=64)
    cleared = floor.buffer(-1.0, quad_segs=64).buffer(1.0, quad_segs=64)
    assert low.any() and not shapely.contains_xy(cleared.buffer(-0.3), *path.end[low, :2].T).any()


def test_a_shape_without_a_floor_is_carved_by_the_v_bit_alone(tmp_path: Path) -> None:
    slim = [(3, 3), (10, 3), (10, 4.6), (3, 4.6)]
    outcome = carved(tmp_path, shapes=[slim])
    path = outcome.written
    left = (path.end[:, 0] < 15.0) & (path.kind == Kind.FEED) & (path.end[:, 2] < 0.0) & (tools_of(path) != 7)
    assert {*tools_of(path)[left]} == {6}
    assert path.end[left, 2].min() == pytest.approx(-0.7, abs=0.01)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "old, new, options, words",
    [
        ("flat T5", "flat", {}, "rules.toml:3: 'flat' is only for V-carving with a depth and an end mill, such as"),
        ("vcarve 1mm", "vcarve", {}, "rules.toml:3: 'flat' is only for V-carving with a depth and an end mill"),
        ("vcarve 1mm T6", "pocket 1mm T5", {}, "rules.toml:3: 'flat' is only for V-carving with a depth"),
        ("flat T5", "flat T6", {}, "rules.toml:3: T6 v-bit Ø8 is a v-bit, not an end mill"),
        ("flat T5", "flat T7", {}, "rules.toml:3: T7 end-mill Ø3 is the end mill of the part, which works last"),
        ("flat T5", "flat T9", {}, "tools.toml has no T9"),
        ("1mm", "1mm", {"shapes": [], "dot": 1.5}, "no shape has room for T5 end-mill Ø2 at a depth of 1 mm"),
        ("1mm", "5.95mm", {"shapes": [BIG]}, "5.95 mm deep, but the diameter of T6 v-bit Ø8 allows at most 3.9 mm"),
        ("T5", "T5", {"old": '"2 mm"', "new": '"2 mm"\nflute_length = "0.8 mm"'}, "cuts 0.8 mm deep at most, but 1 mm"),
        ("T5", "T5", {"old": '"2 mm"', "new": '"2 mm"\ncorner_radius = "0.5 mm"'}, "has a corner radius of 0.5 mm and"),
        ("T5", "T5", {"keep_out": ["5 5 8 8"]}, "is in the keep-out zone '5 5 8 8'"),
    ],
)  # fmt: skip
def test_a_floor_that_cannot_be_cleared_is_refused(
    old: str, new: str, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    tools = TOOLS.replace(options.pop("old", "#"), options.pop("new", "#"))
    with pytest.raises(LeafcutError) as refused:
        carved(tmp_path, RULES.replace(old, new), tools, **options)
    assert words in str(refused.value) and not (tmp_path / "part.ngc").exists()


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_a_flat_floor(rs274: str, name: str, tmp_path: Path) -> None:
    status, said = run_rs274(rs274, carved(tmp_path, shapes=SHAPES[:1], dialect=name).text, tmp_path)
    assert status == 0, said[-500:]


# -- errors of a program ---------------------------------------------------------------------------------------------

FLAT = PocketMill(5, 1.0, 1.0, 1.5)


@pytest.mark.hazard
def test_each_path_that_the_v_bit_leaves_out_is_found(outcome: leafcut.ProgramResult) -> None:
    def closed(corners: Any) -> Polyline:
        return Polyline.of_points(corners, closed=True)

    areas = [
        PocketArea(closed(SHAPES[0]), (), DEPTH, "the L"),
        PocketArea(closed(SHAPES[1]), (closed(SHAPES[2]),), DEPTH, "the square"),
        PocketArea(Polyline.circle(*DOT), (), DEPTH, "the dot"),
    ]
    mill = PocketMill(5, 1.0, 0.6, 400.0 / 60.0)
    request = PartRequest(
        (Edge(closed(OUTLINE), inside=False),), (), tool=7, radius=1.5, thickness=6.0, bottom=-6.5,
        tabs=TabRules(0, 5.0, 1.0),
        carvings=tuple(Carving(area, VBit(6, 4.0, 0.1, 1.0), DEPTH, mill) for area in areas),
    )  # fmt: skip
    path = interpret_written_program(outcome.text, load_dialect("linuxcnc"))
    assert judge_part(request, path) == []
    across = (path.kind == Kind.RAPID) & (path.end[:, :2] != path.before[:, :2]).any(axis=1)
    block, low = np.cumsum(across), np.isin(tools_of(path), (5, 6)) & (path.end[:, 2] < 0.0)
    length = np.hypot(*(path.end - path.before)[:, :2].T)
    # Shorter cuts clear dust in corners, which is within the tolerance.
    blocks = [number for number in np.unique(block[low]).tolist() if length[low & (block == number)].sum() > 1.0]
    assert len(blocks) >= 8
    for left_out in blocks:
        kept = np.flatnonzero(~(low & (block == left_out)))
        assert judge_part(request, path.take(kept))


PLATE = Edge(Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True), inside=False, name="outline")
BOX = Polyline.of_points([(10, 10), (20, 10), (20, 16), (10, 16)], closed=True)
REQUEST = PartRequest(
    (PLATE,), (), tool=1, radius=2.0, thickness=3.0, bottom=-3.5, tabs=TabRules(0, 5.0, 1.0),
    carvings=(Carving(PocketArea(BOX, (), 1.0, "the box"), VBit(6, 3.0, 0.5, 1.0), 1.0, FLAT),),
)  # fmt: skip
FLOOR = "T5 M6\nG0 X12 Y12 Z2\nG1 Z-1 F90\nX18\nY14\nX12\nY12\nG0 Z5\n"
SLOPES = """T6 M6
G0 X10.5 Y10.5 Z2
G1 Z0 F90
X11.5 Y11.5 Z-1
X18.5
X19.5 Y10.5 Z0
X18.5 Y11.5 Z-1
Y14.5
X19.5 Y15.5 Z0
X18.5 Y14.5 Z-1
X11.5
X10.5 Y15.5 Z0
X11.5 Y14.5 Z-1
Y11.5
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


def test_a_flat_floor_that_is_written_by_hand_is_accepted() -> None:
    assert judged(FLOOR, SLOPES, OUTLINE_CUT) == set()


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: "", "not cut"),
        (lambda text: text.replace("T5", "T6"), "not cut"),
        (lambda text: text.replace("T5", "T7"), "tool"),
        (lambda text: text.replace("Z-1 ", "Z-0.9 "), "not cut"),
        (lambda text: text.replace("Z-1 ", "Z-1.1 "), "tool"),
        (lambda text: text.replace("X18", "X18.1"), "gouge"),
        (lambda text: text.replace("X18", "X19.5"), "gouge"),
        (lambda text: text.replace("X18", "X17.8"), "not cut"),
        (lambda text: text.replace("Y14", "Y13.8"), "not cut"),
        (lambda text: text.replace("X12\nY12\nG0", "G0"), "not cut"),
        (lambda text: text.replace("F90", "F100"), "feed"),
        (lambda text: text.replace("G1 Z-1", "G0 Z-0.5\nG1 Z-1"), "rapid into the part"),
    ],
)
def test_errors_of_the_end_mill_are_found(change: Callable[[str], str], what: str) -> None:
    changed = change(FLOOR)
    assert changed != FLOOR and what in judged(changed, SLOPES, OUTLINE_CUT)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: "", "not cut"),
        (lambda text: text.replace("T6", "T5"), "gouge"),
        (lambda text: text.replace("Z-1\n", "Z-0.9\n"), "not cut"),
        (lambda text: text.replace("Z-1\n", "Z-1.1\n"), "tool"),
        (lambda text: text.replace("Y11.5\nG0", "G0"), "not cut"),
        (lambda text: text.replace("X19.5 Y15.5 Z0\nX18.5 Y14.5 Z-1\n", ""), "not cut"),
        (lambda text: text.replace("Y14.5", "Y14.6"), "gouge"),
        (lambda text: text.replace("Y14.5", "Y14.4"), "not cut"),
        (lambda text: text.replace("X18.5", "X18.6"), "gouge"),
    ],
)
def test_errors_of_the_v_bit_are_found(change: Callable[[str], str], what: str) -> None:
    changed = change(SLOPES)
    assert changed != SLOPES and what in judged(FLOOR, changed, OUTLINE_CUT)


@pytest.mark.hazard
def test_errors_of_the_order_and_of_the_step_down_are_found() -> None:
    assert "order" in judged(SLOPES, FLOOR, OUTLINE_CUT)
    assert "order" in judged(FLOOR, OUTLINE_CUT, SLOPES)
    assert "order" in judged(OUTLINE_CUT, FLOOR, SLOPES)
    (carving,) = REQUEST.carvings
    shallow = replace(carving, flat=replace(FLAT, step=0.6))
    assert "too deep" in judged(FLOOR, SLOPES, OUTLINE_CUT, request=replace(REQUEST, carvings=(shallow,)))


@pytest.mark.hazard
def test_a_floor_without_a_request_for_an_end_mill_is_found() -> None:
    (carving,) = REQUEST.carvings
    request = replace(REQUEST, carvings=(replace(carving, flat=None),))
    assert {"tool", "not cut"} <= judged(FLOOR, SLOPES, OUTLINE_CUT, request=request)


@pytest.mark.hazard
def test_a_ridge_between_two_passes_on_the_floor_is_found() -> None:
    """The V-bit clears a floor of 2.5 mm that the end mill does not fit into. Its flat is 1 mm wide."""
    (carving,) = REQUEST.carvings
    slot = Polyline.of_points([(10, 10), (20, 10), (20, 14.5), (10, 14.5)], closed=True)
    slim = replace(carving, area=replace(carving.area, outline=slot), flat=replace(FLAT, radius=1.5))
    request = replace(REQUEST, carvings=(slim,))
    slopes = SLOPES.replace("Y14.5", "Y13").replace("Y15.5", "Y14")
    middle = slopes.replace("Y11.5\nG0", "Y11.5\nY12.25\nX18.5\nG0")
    assert judged(middle, OUTLINE_CUT, request=request) == set()
    assert judged(slopes, OUTLINE_CUT, request=request) == {"not cut"}


@pytest.mark.parametrize("width", [2.19, 2.2, 2.205, 2.21, 2.3])
def test_a_bar_about_as_wide_as_the_v_bit_at_the_floor_is_carved(width: float, tmp_path: Path) -> None:
    """At a depth of 1 mm, the V-bit is 2.2 mm wide."""
    bar = [(3, 3), (12, 3), (12, 3 + width), (8, 3 + width), (8, 12), (3, 12)]
    path = carved(tmp_path, shapes=[bar]).written
    bar_rows = (tools_of(path) == 6) & (path.end[:, 0] > 9.0) & (path.end[:, 0] < 12.0)
    assert path.end[bar_rows, 2].min() == pytest.approx(-DEPTH, abs=0.01)


def test_the_v_bit_clears_an_arm_that_tapers(tmp_path: Path) -> None:
    """Each pass of the V-bit ends at another place of the arm. The program is refused if any place is left."""
    arm = [(28, 8), (21, 10), (18, 13), (14, 13), (13, 10.6), (2.5, 7.9), (13, 7), (12.5, 4), (22, 4.5), (27, 6)]
    tools = TOOLS.replace('"0.2 mm"', '"0.1 mm"')
    outcome = carved(tmp_path, RULES.replace("1mm", "0.8mm"), tools, shapes=[arm])
    assert [operation.tool.number for operation in outcome.operations] == [5, 6, 7]
