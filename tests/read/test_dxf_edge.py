"""The lines of a drilling drawing: shown as the edge of the plate, placed with the holes, never worked."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
import pytest

import leafcut
from leafcut.model.part import Part
from leafcut.processes.registry import report_of
from leafcut.report.drawing import build_scene
from leafcut.report.page import path_svg


def plate(tmp_path: Path, *, far: bool = False, hidden: bool = False) -> Path:
    """Write a plate of 200 × 100 mm of four LINEs with three holes; `far`: a frame of paper around it."""
    document = ezdxf.new("R2000", units=4)
    document.layers.add("EDGE").off() if hidden else document.layers.add("EDGE")
    space = document.modelspace()
    corners = [(0, 0), (200, 0), (200, 100), (0, 100)]
    for number, corner in enumerate(corners):
        space.add_line(corner, corners[(number + 1) % 4], dxfattribs={"layer": "EDGE"})
    for x, y in ((20, 20), (100, 50), (180, 80)):
        space.add_circle((x, y), 3, dxfattribs={"layer": "HOLES"})
    space.add_arc((50, 80), 4, 0, 180, dxfattribs={"layer": "HOLES"})
    space.add_arc((50, 80), 4, 180, 360, dxfattribs={"layer": "HOLES"})
    if far:
        space.add_line((-4000, -3000), (9000, -3000))
    document.saveas(tmp_path / "plate.dxf")
    return tmp_path / "plate.dxf"


def box(part: Part) -> tuple[float, ...]:
    corners = np.array([c.path.extents for c in part.edge]).reshape(-1, 2)
    return (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())


def test_lines_are_the_edge_and_arcs_that_became_a_hole_are_not(tmp_path: Path) -> None:
    part = leafcut.read_part(plate(tmp_path))
    assert len(part.holes) == 4
    assert [c.kind for c in part.edge] == ["sheet"] * 4
    assert box(part) == (0.0, 0.0, 200.0, 100.0)
    assert [i.message for i in part.issues if i.code == "L201"] == [
        "the outline around all holes, 200 × 100 mm, is not cut"
    ]


def test_choosing_the_layer_of_the_holes_hides_no_edge_but_a_layer_that_is_off_does(tmp_path: Path) -> None:
    assert len(leafcut.read_part(plate(tmp_path), leafcut.ReadOptions(layers=("HOLES",))).edge) == 4
    assert leafcut.read_part(plate(tmp_path, hidden=True)).edge == ()


def test_the_edge_does_not_change_the_program_but_its_corner_can_be_zero(tmp_path: Path) -> None:
    fast = {"thickness": 5, "algorithm": "nn", "bound": False, "process": "drill"}
    with_edge = leafcut.optimize(plate(tmp_path), **fast)
    without = leafcut.optimize(plate(tmp_path, hidden=True), **fast)
    assert with_edge.text == without.text
    at_corner = leafcut.optimize(plate(tmp_path), origin="lower-left", **fast)
    assert box(at_corner.part) == pytest.approx((0.0, 0.0, 200.0, 100.0))


def test_the_edge_is_turned_with_its_holes(tmp_path: Path) -> None:
    fast = {"thickness": 5, "algorithm": "nn", "bound": False, "process": "drill"}
    part = leafcut.optimize(plate(tmp_path), rotate=90, **fast).part
    assert box(part) == pytest.approx((-100.0, 0.0, 0.0, 200.0))


def test_the_report_draws_it_and_a_frame_of_paper_does_not_make_the_plate_small(tmp_path: Path) -> None:
    fast = {"thickness": 5, "algorithm": "nn", "bound": False, "process": "drill"}
    near, far = (leafcut.optimize(plate(tmp_path, far=f), **fast) for f in (False, True))
    frames = [build_scene(outcome).frame for outcome in (near, far)]
    assert frames[0] == frames[1]
    assert frames[0].low[0] < 0.0
    assert frames[0].high[0] > 200.0
    assert path_svg(report_of(near), "after").count('class="plate"') == 1


def test_a_built_in_plate_has_the_edge_of_its_drawing() -> None:
    built_in = leafcut.read_part("example:plate-70")
    drawn = leafcut.read_part(Path(__file__).parents[2] / "examples" / "plate_70.dxf")
    assert box(built_in) == pytest.approx(box(drawn))
