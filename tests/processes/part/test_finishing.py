"""A finishing pass: roughing leaves an allowance on each wall, and a pass along the exact edge removes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

import leafcut
from leafcut.errors import LeafcutError, OptionError, PlanError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.part.model import Edge, PartRequest, PocketArea, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

RADIUS, FINISH, THICKNESS = 2.0, 0.3, 3.0
BOTTOM = -3.5
OUTLINE = [(0, 0), (80, 0), (80, 50), (40, 60), (0, 50)]
WINDOW = [(10, 10), (50, 10), (50, 40), (10, 40)]
FAST: dict[str, Any] = {
    "thickness": THICKNESS, "tool_diameter": 2 * RADIUS, "feed": "600mm/min", "spindle_speed": 5000, "preset": "fast",
    "threads": 1,
}  # fmt: skip


def drawing(folder: Path, *outlines: list[tuple[float, float]], bore: float = 0.0) -> Path:
    document = ezdxf.new(units=4)
    for points in outlines:
        document.modelspace().add_lwpolyline(points, close=True)
    if bore:
        document.modelspace().add_circle((65.0, 25.0), bore)
    document.saveas(folder / "part.dxf")
    return folder / "part.dxf"


def plate(folder: Path, **options: Any) -> leafcut.ProgramResult:
    """Return the program of a plate with a window and a bore of 7 mm."""
    return leafcut.part(drawing(folder, OUTLINE, WINDOW, bore=3.5), **{**FAST, "finish": FINISH, "tabs": 3, **options})


def edges() -> Any:
    return shapely.union_all(
        [shapely.LinearRing(OUTLINE), shapely.LinearRing(WINDOW), shapely.Point(65, 25).buffer(3.5, 256).exterior]
    )


def deep_cuts(path: Toolpath) -> tuple[np.ndarray, np.ndarray]:
    """Return the lines of all cuts below the top, and whether each lies at full depth."""
    moves = convert_to_straight_moves(path, 0.002, 1.0)
    cut = ~moves.rapid & (np.minimum(moves.ends[:, 2], moves.ends[:, 5]) < -1e-6)
    ends = moves.ends[cut]
    full = np.maximum(ends[:, 2], ends[:, 5]) <= BOTTOM + 1e-6
    return np.asarray(shapely.linestrings(ends.reshape(-1, 2, 3)[:, :, :2])), full


@pytest.mark.hazard
@pytest.mark.parametrize("milling", ["climb", "conventional"])
def test_roughing_leaves_the_allowance_and_a_pass_at_full_depth_follows(milling: str, tmp_path: Path) -> None:
    """Each edge is roughed before the mill goes nearer to it, and then finished in the direction of milling."""
    lines, full = deep_cuts(plate(tmp_path, milling=milling, tabs=0).written)
    for number, ring in enumerate(shapely.get_parts(edges())):
        mine = np.flatnonzero(shapely.distance(lines, ring) < RADIUS + FINISH + 0.05)
        exact = mine[np.abs(shapely.distance(lines[mine], ring) - RADIUS) < 0.03]
        rough = mine[mine < exact.min()]
        assert shapely.distance(lines[rough[:-12]], ring).min() > RADIUS + FINISH - 0.03
        assert full[exact].all()
        points = np.concatenate([shapely.get_coordinates(lines[k]) for k in exact])
        is_ccw = shapely.LinearRing(points).is_ccw
        assert is_ccw == ((milling == "climb") == (number > 0))
        beside = shapely.Polygon(ring).buffer(RADIUS if number == 0 else -RADIUS, 256)
        assert beside.exterior.difference(shapely.union_all(shapely.buffer(lines[exact], 0.05))).length < 0.01


def test_the_pass_starts_and_ends_with_a_quarter_circle_in_the_allowance(tmp_path: Path) -> None:
    path = plate(tmp_path).written
    arcs = np.isin(path.kind, [Kind.ARC_CW, Kind.ARC_CCW])
    radii = [
        float(np.hypot(*(path.end[row, :2] - path.arcs[path.ref[row]].center[:2]))) for row in np.flatnonzero(arcs)
    ]
    assert sum(abs(radius - FINISH) < 2e-3 for radius in radii) == 2 * 3


@pytest.mark.hazard
def test_tabs_keep_their_height_in_both_passes(tmp_path: Path) -> None:
    """The mill crosses each tab at its top, once while roughing and once while finishing."""
    outcome = plate(tmp_path, tab_height=1.0, tab_width=5.0)
    path = outcome.written
    rises = (path.kind == Kind.FEED) & (path.end[:, 2] == -2.0) & (path.before[:, 2] < -2.0)
    assert outcome.detail.tabs == 6 and rises.sum() == 2 * outcome.detail.tabs


@pytest.mark.hazard
@pytest.mark.parametrize("shape, finish", [("teeth", 0.1), ("teeth", 1.5), ("arcs", 0.8)])
def test_bent_edges_are_finished(shape: str, finish: float, tmp_path: Path) -> None:
    """The wheel has no straight section for a tab, and the lens has two corners."""
    teeth = [
        (r * np.cos(angle), r * np.sin(angle))
        for k in range(48)
        for r, angle in [(40.0 if k % 2 else 36.0, np.pi * k / 24)]
    ]
    source = drawing(tmp_path, teeth)
    if shape == "arcs":
        document = ezdxf.new(units=4)
        document.modelspace().add_lwpolyline([(-30, 0, 0.5), (30, 0, 0.5)], format="xyb", close=True)
        document.saveas(source)
    assert leafcut.part(source, finish=finish, tab_width=3.0, **FAST).detail.tabs == 4


@pytest.mark.hazard
@pytest.mark.parametrize(
    "finish, words",
    [
        (2.0, "--finish 2 mm: the allowance must be less than the radius of the mill, 2 mm"),
        (0.05, "--finish 0.05 mm is too small to be verified; give at least 0.1 mm, or 0 for no finishing pass"),
    ],
)
def test_an_allowance_that_cannot_be_left_is_refused(finish: float, words: str, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=words):
        plate(tmp_path, finish=finish)


SLOT = [(10, 10), (40, 10), (40, 14.5), (10, 14.5)]
NOTCH = [(0, 0), (80, 0), (80, 50), (42, 50), (42, 30), (37.5, 30), (37.5, 50), (0, 50)]
NEAR = [(x + 84.5, y) for x, y in [(0, 0), (30, 0), (30, 50), (0, 50)]]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "outlines, bore", [([OUTLINE], 2.25), ([OUTLINE, SLOT], 0.0), ([NOTCH], 0.0), ([OUTLINE, NEAR], 0.0)]
)
def test_a_bore_slot_or_gap_without_room_for_the_allowance_is_refused(
    outlines: list[list[tuple[float, float]]], bore: float, tmp_path: Path
) -> None:
    """Each is 4.5 mm wide; the mill has 4 mm."""
    source = drawing(tmp_path, *outlines, bore=bore)
    leafcut.part(source, tabs=0, **FAST)
    with pytest.raises(PlanError, match=r"no room for --finish 0.3 mm at \(.*the mill needs 4.6 mm between the walls"):
        leafcut.part(source, tabs=0, finish=FINISH, **FAST)
    leafcut.part(source, tabs=0, finish=0.2, **FAST)


def test_without_an_allowance_nothing_changes(tmp_path: Path) -> None:
    given, none = plate(tmp_path, finish=0.0), leafcut.part(tmp_path / "part.dxf", tabs=3, **FAST)
    assert [line for line in given.text.splitlines() if line[0] != "("] == [
        line for line in none.text.splitlines() if line[0] != "("
    ]


POCKET = [(10, 10), (60, 10), (60, 24), (10, 24)]


def pocketed(folder: Path, pocket: list[tuple[float, float]], **options: Any) -> leafcut.ProgramResult:
    document = ezdxf.new(units=4)
    for points, layer in ((OUTLINE, "OUTLINE"), (pocket, "POCKET")):
        document.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "part.dxf")
    (folder / "rules.toml").write_text('[layer]\n"OUTLINE" = "profile"\n"POCKET" = "pocket 2mm"\n')
    given: dict[str, Any] = {"operations": folder / "rules.toml", "finish": FINISH, "step_down": 1.0, **FAST, **options}
    return leafcut.part(folder / "part.dxf", folder / "part.ngc", **given)


@pytest.mark.hazard
def test_the_walls_of_a_pocket_are_finished_at_its_floor(tmp_path: Path) -> None:
    lines, _ = deep_cuts(pocketed(tmp_path, POCKET, tabs=0).written)
    inside = lines[shapely.covers(shapely.box(10, 10, 60, 24), lines)]
    distance = shapely.distance(shapely.LinearRing(POCKET), inside)
    first = int(np.flatnonzero(distance < RADIUS + FINISH - 0.02)[0])
    wall = shapely.box(12, 12, 58, 22).exterior
    assert distance.min() > RADIUS - 0.01 and first > 0.5 * len(inside)
    assert wall.difference(shapely.union_all(shapely.buffer(inside[first:], 0.02))).is_empty


@pytest.mark.hazard
def test_a_step_at_the_edge_is_finished_with_the_edge(tmp_path: Path) -> None:
    """The pocket crosses the outline, so its cuts are nearer to the edge than the allowance."""
    outcome = pocketed(tmp_path, [(60, -5), (86, -5), (86, 56), (60, 56)], tab_height=0.5)
    assert {row.operation for row in outcome.detail.layers} == {"profile", "pocket"}


@pytest.mark.hazard
def test_a_pocket_without_room_for_the_allowance_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match=r"the pocket at .*there is no room for --finish 0.3 mm at.*needs 4.6 mm"):
        pocketed(tmp_path, [(10, 10), (40, 10), (40, 14.5), (10, 14.5)])


@pytest.mark.parametrize("name", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_a_program_with_a_finishing_pass(rs274: str, name: str, tmp_path: Path) -> None:
    for text in (plate(tmp_path, dialect=name).text, pocketed(tmp_path, POCKET, dialect=name).text):
        status, said = run_rs274(rs274, text, tmp_path)
        assert status == 0, said[-500:]


# -- mutants ---------------------------------------------------------------------------------------------------------

EDGE = Edge(Polyline.of_points([(0, 0), (40, 0), (40, 40), (0, 40)], closed=True), inside=True, name="window")
REQUEST = PartRequest(
    (EDGE,), (), tool=1, radius=RADIUS, thickness=THICKNESS, bottom=BOTTOM, tabs=TabRules(0, 5.0, 1.0), finish=FINISH
)
CLEARED = PartRequest(
    (), (), tool=1, radius=RADIUS, thickness=THICKNESS, bottom=BOTTOM, tabs=TabRules(0, 5.0, 1.0), finish=FINISH,
    pockets=(PocketArea(Polyline.of_points([(0, 0), (40, 0), (40, 7), (0, 7)], closed=True), (), 1.0),),
)  # fmt: skip


def ring(beside: float, z: float, width: float = 40.0, height: float = 40.0, *, climb: bool = True) -> list[str]:
    """Return a rectangular path of the mill, from its left side at half height."""
    low, middle, right, top = beside, 0.5 * height, width - beside, height - beside
    ys = (low, top) if climb else (top, low)
    start = [f"G1 X{low} Y{middle} F90", f"Z{z}"]
    return [*start, f"Y{ys[0]}", f"X{right}", f"Y{ys[1]}", f"X{low}", f"Y{middle}"]


def program(*paths: list[str]) -> Toolpath:
    cuts = [line for path in paths for line in path]
    return interpret_written_program(
        "\n".join(["G21 G90 G17 G94", "T1 M6", "G0 X3 Y20 Z2", *cuts, "G0 Z5", "M2"]), load_dialect("linuxcnc")
    )


ROUGH, EXACT = ring(RADIUS + FINISH, BOTTOM), ring(RADIUS, BOTTOM)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "paths, what",
    [
        ([ROUGH, EXACT], None),
        ([ROUGH], "not cut"),
        ([EXACT], "roughing"),
        ([EXACT, EXACT], "roughing"),
        ([EXACT, ROUGH], "roughing"),
        ([ring(RADIUS + 0.15, BOTTOM), EXACT], "roughing"),
        ([ring(RADIUS + 0.5, BOTTOM), EXACT], "roughing"),
        ([ring(RADIUS + FINISH, BOTTOM + 1.0), EXACT], "roughing"),
        ([ROUGH, ring(RADIUS, BOTTOM + 1.0)], "not cut"),
        ([ROUGH, ring(-RADIUS, BOTTOM)], "cut not drawn"),
        ([ROUGH, ring(RADIUS - 0.1, BOTTOM)], "cut not drawn"),
        ([ROUGH, EXACT[:-2]], "not cut"),
        ([ROUGH[:-2], EXACT], "roughing"),
        ([ROUGH, ring(RADIUS, BOTTOM, climb=False)], "direction"),
    ],
)
def test_a_wrong_finishing_pass_is_found(paths: list[list[str]], what: str | None) -> None:
    differences = {str(one.what) for one in judge_part(REQUEST, program(*paths))}
    assert (what in differences) if what else not differences


def cleared(beside: float, z: float = -1.0) -> list[str]:
    return ring(beside, z, height=7.0)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "paths, what",
    [
        ([cleared(2.3), cleared(2.0)], None),
        ([cleared(2.3)], "not cut"),
        ([cleared(2.0)], "roughing"),
        ([cleared(2.0), cleared(2.3)], "roughing"),
        ([cleared(2.15), cleared(2.0)], "roughing"),
        ([cleared(2.3), cleared(2.0, -0.8)], "not cut"),
        ([cleared(2.3, -0.8), cleared(2.0)], "roughing"),
        ([cleared(2.3), cleared(1.8)], "cut not drawn"),
        ([cleared(2.3), cleared(2.0)[:-2]], "not cut"),
    ],
)
def test_a_wrong_finishing_pass_in_a_pocket_is_found(paths: list[list[str]], what: str | None) -> None:
    start = ["G0 X3 Y3.5"]
    differences = {str(one.what) for one in judge_part(CLEARED, program(start, *paths))}
    assert (what in differences) if what else not differences


@pytest.mark.hazard
def test_a_planned_program_without_its_finishing_passes_is_found(tmp_path: Path) -> None:
    """The program of an allowance of 0.3 mm does not suit a request for 0.5 mm, or for none."""
    source = drawing(tmp_path, [(0, 0), (100, 0), (100, 100), (0, 100)])
    options: dict[str, Any] = {**FAST, "tabs": 2, "tab_width": 5.0, "tab_height": 1.0}
    outline = Edge(Polyline.of_points([(0, 0), (100, 0), (100, 100), (0, 100)], closed=True), inside=False, tabs=2)
    texts = {finish: leafcut.part(source, finish=finish, **options).text for finish in (0.0, 0.3, 0.5)}
    for asked in texts:
        request = PartRequest(
            (outline,), (), tool=1, radius=RADIUS, thickness=THICKNESS, bottom=BOTTOM, tabs=TabRules(2, 5.0, 1.0),
            finish=asked,
        )  # fmt: skip
        for finish, text in texts.items():
            assert (judge_part(request, interpret_written_program(text, load_dialect("linuxcnc"))) == []) == (
                finish == asked
            )


@pytest.mark.parametrize("finish", [0.0, FINISH])
def test_the_answer_states_the_allowance(finish: float, tmp_path: Path) -> None:
    assert plate(tmp_path, finish=finish).to_dict().get("finish_mm", 0.0) == finish
