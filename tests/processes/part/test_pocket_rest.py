"""Pockets of two mills: the large mill clears what it can reach, and then the small mill clears the rest."""

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
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.part.model import Edge, PartRequest, PocketArea, PocketMill, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

CELL, DEPTH = 0.2, 2.0
OUTLINE = [(0, 0), (48, 0), (48, 26), (0, 26)]
#: Two chambers with a neck that only the small mill can enter, and a slot that is only wide enough for it.
CHAMBERS = [
    (4, 4), (16, 4), (16, 11), (24, 11), (24, 4), (36, 4), (36, 18), (24, 18), (24, 14), (16, 14), (16, 18), (4, 18),
]  # fmt: skip
SLOT = [(40, 4), (43, 4), (43, 16), (40, 16)]
RULES = '[layer]\n"OUTLINE" = "profile"\n"POCKET" = "pocket 2mm T2 rest T3"\n'
TOOLS = """
[[tool]]
number = 1
kind = "end-mill"
diameter = "3 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
[[tool]]
number = 2
kind = "end-mill"
diameter = "6 mm"
spindle_speed = "4000 rpm"
feed = "800 mm/min"
[[tool]]
number = 3
kind = "end-mill"
diameter = "2 mm"
spindle_speed = "6000 rpm"
feed = "300 mm/min"
flute_length = "4 mm"
[[tool]]
number = 4
diameter = "2 mm"
spindle_speed = "2000 rpm"
feed = "300 mm/min"
"""


def milled(folder: Path, rules: str = RULES, pockets: Any = (CHAMBERS, SLOT), **options: Any) -> leafcut.ProgramResult:
    document = ezdxf.new(units=4)
    for layer, corners in [("OUTLINE", OUTLINE), *(("POCKET", corners) for corners in pockets)]:
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "part.dxf")
    (folder / "tools.toml").write_text(TOOLS)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {"tools": folder / "tools.toml", "tool_number": 1, "operations": folder / "rules.toml"}
    given |= {"tabs": 0, "thickness": 6, "preset": "fast", "threads": 1}
    return leafcut.part(folder / "part.dxf", folder / "part.ngc", **{**given, **options})


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> leafcut.ProgramResult:
    return milled(tmp_path_factory.mktemp("rest"))


def tools_of(path: Toolpath) -> np.ndarray:
    """Return the tool number of each row."""
    changes = np.where(path.kind == Kind.TOOL, np.arange(len(path)), 0)
    return path.ref[np.maximum.accumulate(changes)]


def opened(shape: Any, radius: float) -> Any:
    return shape.buffer(-radius, quad_segs=64).buffer(radius, quad_segs=64)


def check_field(program: Path, tools: Path, shape: Any, radius: float) -> None:
    """Check that the pocket is the drawing except for the corners of a mill; cells at edges are not compared."""
    field = leafcut.stock(program, workpiece="-6,-6,-7,54,32,0", cell=CELL, tools=tools).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    area = opened(shape, radius - 1e-3)
    assert (np.round(field.heights[shapely.contains_xy(area.buffer(-CELL), x, y)], 3) == -DEPTH).all()
    around = shapely.contains_xy(shape.buffer(0.5) - area.buffer(CELL), x, y)
    assert around.any() and (field.heights[around] == 0.0).all()


@pytest.mark.hazard
def test_the_small_mill_leaves_only_its_own_corners(outcome: leafcut.ProgramResult, tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text(outcome.text)
    (tmp_path / "tools.toml").write_text(TOOLS)
    shape = shapely.union_all([shapely.Polygon(CHAMBERS), shapely.Polygon(SLOT)])
    check_field(tmp_path / "part.ngc", tmp_path / "tools.toml", shape, 1.0)
    issues = [str(issue) for issue in outcome.issues if issue.code == "L701"]
    assert len(issues) == 2 and all("a tool of 2 mm" in issue for issue in issues)


@pytest.mark.hazard
def test_the_end_mill_of_the_part_may_clear_the_rest_beside_a_finishing_pass(tmp_path: Path) -> None:
    box = [(8, 6), (30, 6), (30, 20), (8, 20)]
    outcome = milled(tmp_path, RULES.replace("T3", "T1"), [box], finish=0.3)
    assert [(operation.tool.number, operation.cuts) for operation in outcome.operations] == [(2, 1), (1, 5)]
    check_field(tmp_path / "part.ngc", tmp_path / "tools.toml", shapely.Polygon(box), 1.5)


@pytest.mark.hazard
def test_the_small_mill_follows_with_its_own_feed_and_levels(outcome: leafcut.ProgramResult) -> None:
    path = outcome.written
    tool = tools_of(path)
    level = (path.kind == Kind.FEED) & (path.end[:, 2] == path.before[:, 2]) & (path.end[:, 2] < 0.0)
    assert [operation.tool.number for operation in outcome.operations] == [2, 3, 1]
    assert {*np.round(60.0 * path.value[level & (tool == 2)])} == {800.0}
    assert {*path.end[level & (tool == 2), 2]} == {-2.0}
    assert 300.0 in {*np.round(60.0 * path.value[level & (tool == 3)])}
    assert {*path.end[level & (tool == 3), 2]} == {-1.0, -2.0}
    assert {row.tool for row in outcome.detail.layers if row.operation == "pocket"} >= {
        "T2 end-mill Ø6 + T3 end-mill Ø2"
    }


@pytest.mark.hazard
def test_the_small_mill_stays_near_the_rest_and_enters_in_the_air(outcome: leafcut.ProgramResult) -> None:
    path, chambers = outcome.written, shapely.Polygon(CHAMBERS)
    low = (tools_of(path) == 3) & (path.end[:, 2] < 0.0) & (path.end[:, 0] < 38.0)
    places = shapely.points(path.end[low, :2])
    reached = opened(chambers, 3.0)
    rest = (opened(chambers, 1.0) - reached).buffer(-0.02).buffer(0.02)
    assert shapely.dwithin(rest, places, 1.3).all()
    down = path.before[low, 2] > path.end[low, 2]
    assert down.any()
    assert all(reached.buffer(0.02).covers(place.buffer(1.0)) for place in places[down])


@pytest.mark.hazard
@pytest.mark.parametrize(
    "old, new, words",
    [
        ("T2 rest T3", "T3 rest T2", "rules.toml:3: T2 end-mill Ø6 is not smaller than T3 end-mill Ø2"),
        ("T2 rest T3", "T2 rest T2", "rules.toml:3: T2 end-mill Ø6 is not smaller than T2 end-mill Ø6"),
        ("T2 rest T3", "T1 rest T3", "rules.toml:3: T1 .* is the end mill of the part, which works last"),
        ("2mm T2", "5mm T2", "rules.toml:3: T3 end-mill Ø2 cuts 4 mm deep at most, but 5 mm are needed"),
        ("rest T3", "rest T4", "rules.toml:3: T4 .* is a drill, not an end mill"),
        ("rest T3", "rest T9", "rules.toml:3: .*tools.toml has no T9"),
        ("T2 rest T3", "rest T3", "rules.toml:3: 'rest' is only for a pocket with two mills"),
        ("T2 rest T3", "T2 rest", "rules.toml:3: 'rest' is only for a pocket with two mills"),
        ("pocket 2mm", "engrave 2mm", "rules.toml:3: 'rest' is only for a pocket with two mills"),
    ],
)
def test_a_mill_that_cannot_clear_the_rest_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match=words):
        milled(tmp_path, RULES.replace(old, new))


def test_without_a_rest_the_small_mill_has_no_work(tmp_path: Path) -> None:
    corners = Polyline.circle(20.0, 12.0, 7.0).flattened(0.001)
    outcome = milled(tmp_path, pockets=[[tuple(corner) for corner in corners]])
    assert [operation.tool.number for operation in outcome.operations] == [2, 1]


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_a_pocket_of_two_mills(rs274: str, name: str, tmp_path: Path) -> None:
    pockets = [SLOT, [(4, 4), (14, 4), (14, 12), (4, 12)]]
    status, said = run_rs274(rs274, milled(tmp_path, pockets=pockets, dialect=name).text, tmp_path)
    assert status == 0, said[-500:]


# -- errors of a program ---------------------------------------------------------------------------------------------

LARGE, SMALL = PocketMill(2, 3.0, 3.0, 800.0 / 60.0), PocketMill(3, 1.0, 1.0, 5.0)
PLANNED = PartRequest(
    (Edge(Polyline.of_points(OUTLINE, closed=True), inside=False),), (), tool=1, radius=1.5, thickness=6.0,
    bottom=-6.5, tabs=TabRules(0, 5.0, 1.0), feed=10.0, steps={1: 1.5},
    pockets=(
        PocketArea(Polyline.of_points(CHAMBERS, closed=True), (), DEPTH, "the pocket", mill=LARGE, rest=SMALL),
        PocketArea(Polyline.of_points(SLOT, closed=True), (), DEPTH, "the slot", mill=SMALL),
    ),
)  # fmt: skip


@pytest.mark.hazard
def test_each_place_that_the_small_mill_leaves_out_is_found(outcome: leafcut.ProgramResult) -> None:
    path = interpret_written_program(outcome.text, load_dialect("linuxcnc"))
    assert judge_part(PLANNED, path) == []
    across = (path.kind == Kind.RAPID) & (path.end[:, :2] != path.before[:, :2]).any(axis=1)
    block, low = np.cumsum(across), (tools_of(path) == 3) & (path.end[:, 2] < 0.0)
    blocks = np.unique(block[low]).tolist()
    assert len(blocks) >= outcome.operations[1].cuts >= 6
    for left_out in blocks:
        kept = np.flatnonzero(~(low & (block == left_out)))
        assert "not cut" in {str(one.what) for one in judge_part(PLANNED, path.take(kept))}


@pytest.mark.hazard
def test_a_program_of_one_mill_does_not_suit_a_request_for_two(outcome: leafcut.ProgramResult) -> None:
    path, (pocket, slot) = interpret_written_program(outcome.text, load_dialect("linuxcnc")), PLANNED.pockets
    alone = judge_part(replace(PLANNED, pockets=(replace(pocket, rest=None), slot)), path)
    assert "tool" in {str(one.what) for one in alone}


PLATE = Edge(Polyline.of_points([(-9, -9), (60, -9), (60, 40), (-9, 40)], closed=True), inside=False)
BOX = Polyline.of_points([(10, 10), (30, 10), (30, 20), (10, 20)], closed=True)
REQUEST = PartRequest(
    (PLATE,), (), tool=1, radius=2.0, thickness=3.0, bottom=-3.5, tabs=TabRules(0, 5.0, 1.0),
    pockets=(PocketArea(BOX, (), 1.0, "box", mill=PocketMill(5, 3.0, 1.0, 1.5), rest=PocketMill(6, 1.0, 1.0, 1.5)),),
)  # fmt: skip
FIRST = "T5 M6\nG0 X13 Y13 Z2\nG1 Z-1 F90\nX27\nY17\nX13\nY13\nG0 Z5\n"
CORNERS = [
    "G0 X13 Y11 Z2\nG1 Z-1 F90\nX11\nY13\nG0 Z5\n",
    "G0 X27 Y11 Z2\nG1 Z-1 F90\nX29\nY13\nG0 Z5\n",
    "G0 X27 Y19 Z2\nG1 Z-1 F90\nX29\nY17\nG0 Z5\n",
    "G0 X13 Y19 Z2\nG1 Z-1 F90\nX11\nY17\nG0 Z5\n",
]
REST = "T6 M6\n" + "".join(CORNERS)
EDGE = """T1 M6
G0 X-11 Y-9 Z2
G1 Z-3.5 F90
Y40
G2 X-9 Y42 I2 J0
G1 X60
G2 X62 Y40 I0 J-2
G1 Y-9
G2 X60 Y-11 I-2 J0
G1 X-9
G2 X-11 Y-9 I0 J2
G0 Z5
"""


def judged(*blocks: str, request: PartRequest = REQUEST) -> set[str]:
    text = "".join(["G21 G90 G17 G94\n", *blocks, "M2\n"])
    return {str(one.what) for one in judge_part(request, interpret_written_program(text, load_dialect("linuxcnc")))}


def test_a_pocket_of_two_mills_that_is_written_by_hand_is_accepted() -> None:
    assert judged(FIRST, REST, EDGE) == set()


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        *((lambda rest, corner=corner: rest.replace(corner, ""), "not cut") for corner in CORNERS),
        (lambda rest: "", "not cut"),
        (lambda rest: rest.replace("T6", "T5"), "not cut"),
        (lambda rest: rest.replace("T6", "T1"), "not cut"),
        (lambda rest: rest.replace("T6", "T7"), "tool"),
        (lambda rest: rest.replace("Z-1 ", "Z-0.9 ", 1), "not cut"),
        (lambda rest: rest.replace("Z-1 ", "Z-1.1 ", 1), "gouge"),
        (lambda rest: rest.replace("X11\n", "X10.9\n", 1), "gouge"),
        (lambda rest: rest.replace("X11\n", "X11.2\n", 1), "not cut"),
        (lambda rest: rest.replace("X29\n", "X32\n", 1), "gouge"),
        (lambda rest: rest.replace("F90\nX11", "F100\nX11", 1), "feed"),
        (lambda rest: rest.replace("G1 Z-1", "G0 Z-0.5\nG1 Z-1", 1), "rapid into the part"),
        (lambda rest: rest.replace("X13 Y11 Z2\nG1 Z-1 F90\nX11\nY13", "X11 Y13 Z2\nG1 Z-1 F90\nY11\nX13"), None),
        (lambda rest: rest.replace("X13 Y11 Z2\nG1 Z-1 F90\nX11", "X11 Y11 Z2\nG1 Z-1 F90\nX13\nX11"), "plunge"),
        (lambda rest: rest.replace("X13 Y11 Z2\nG1 Z-1 F90\n", "X11.8 Y11 Z2\nG1 X11 Z-1 F90\n"), "plunge"),
    ],
)
def test_errors_of_the_small_mill_are_found(change: Callable[[str], str], what: str | None) -> None:
    changed = change(REST)
    assert changed != REST
    found = judged(FIRST, changed, EDGE)
    assert (what in found) if what else not found


@pytest.mark.hazard
def test_errors_of_the_large_mill_and_of_the_order_are_found() -> None:
    assert "order" in judged(REST, FIRST, EDGE)
    assert "order" in judged(REST.replace("".join(CORNERS[1:]), ""), FIRST, "T6 M6\n", *CORNERS[1:], EDGE)
    assert "order" in judged(FIRST, EDGE, REST)
    assert "not cut" in judged(REST, EDGE)
    assert "not cut" in judged(FIRST.replace("Y17\n", ""), REST, EDGE)
    # The small mill must not do the work of the large mill.
    assert "not cut" in judged(FIRST.replace("T5", "T6"), REST, EDGE)


@pytest.mark.hazard
def test_a_rest_that_is_cut_too_deep_at_once_is_found() -> None:
    (pocket,) = REQUEST.pockets
    shallow = replace(pocket, rest=PocketMill(6, 1.0, 0.6, 1.5))
    assert "too deep" in judged(FIRST, REST, EDGE, request=replace(REQUEST, pockets=(shallow,)))
