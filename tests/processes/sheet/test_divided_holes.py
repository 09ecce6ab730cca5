"""Holes with necks that the kerf cannot pass: each piece that it reaches is cut, and the necks are reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import pytest
import shapely

from leafcut import api
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import CutData
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cut_rules import CutRules, resolve_rules
from leafcut.processes.sheet.plan.narrow_shapes import with_divided_holes
from leafcut.processes.sheet.proof.sheet_shapes import check_divided_shapes

KERF = 1.5
FAST: dict[str, Any] = {"process": "cut", "thickness": "6", "kerf": "1.5", "iterations": 5, "threads": 1}
PLATE = [(0, 0), (200, 0), (200, 120), (0, 120)]


def bell(neck: float) -> list[tuple[float, float]]:
    """Two windows of 40 × 80 and 60 × 80 mm, joined by a neck of 60 mm."""
    low, high = 50 - 0.5 * neck, 50 + 0.5 * neck
    left = [(60, high), (60, 100), (20, 100), (20, 20), (60, 20), (60, low)]
    return [*left, (120, low), (120, 20), (180, 20), (180, 100), (120, 100), (120, high)]


def drawn(folder: Path, hole: list[tuple[float, float]], *circles: tuple[tuple[float, float], float]) -> Path:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for points in (PLATE, hole):
        space.add_lwpolyline(points, close=True)
    for middle, radius in circles:
        space.add_circle(middle, radius)
    document.saveas(folder / "plate.dxf")
    return folder / "plate.dxf"


def burnt(outcome: Any) -> Any:
    lines = [shapely.LineString(cut.path.flattened(0.002)) for cut in outcome.detail.plan.cuts]
    return shapely.union_all([line.buffer(0.5 * KERF, quad_segs=32) for line in lines])


@pytest.mark.parametrize("more", [{}, {"machine": "laser-table"}, {"chains": True}, {"micro_joints": 1}])
def test_both_windows_beside_a_neck_narrower_than_the_kerf_are_cut_out_as_drawn(
    more: dict[str, Any], tmp_path: Path
) -> None:
    outcome = api.optimize(drawn(tmp_path, bell(1.0)), **{**FAST, **more})
    assert outcome.verified
    hole, cut = shapely.Polygon(bell(1.0)), burnt(outcome)
    reached = hole.buffer(-0.5 * KERF, quad_segs=32)
    followed = shapely.union_all([shapely.LineString(c.path.flattened(0.002)) for c in outcome.detail.plan.cuts])
    assert len(shapely.get_parts(reached)) == 2
    assert reached.boundary.difference(followed.buffer(0.03)).length < (1.0 if "micro_joints" in more else 1e-9)
    assert cut.intersection(shapely.Polygon(PLATE).difference(hole).buffer(-0.03)).is_empty
    first = [
        cut.kind == "cut" and outcome.detail.plan.sheet.contours[i].is_hole
        for cut in outcome.detail.plan.cuts
        for i in cut.contours
    ]
    assert first == [True, True, False]


def test_windows_whose_pieces_overlap_in_a_short_neck_are_both_cut(tmp_path: Path) -> None:
    right = [(50.4, 29.35), (50.4, 20), (60, 20), (60, 40), (50.4, 40), (50.4, 30.65)]
    hole = [*right, *((100 - x, 60 - y) for x, y in right)]
    outcome = api.optimize(drawn(tmp_path, hole), **FAST)
    assert outcome.verified
    assert sorted(cut.contours for cut in outcome.detail.plan.cuts) == [(0,), (1,), (2,)]


def test_the_neck_is_reported_as_missing_with_its_place_and_area(tmp_path: Path) -> None:
    """The neck of 60 × 1 mm less what the kerf takes of its two mouths, about a third of a square millimetre."""
    outcome = api.optimize(drawn(tmp_path, bell(1.0)), **FAST)
    (issue,) = [i for i in outcome.issues if i.code in ("L611", "L612")]
    assert issue.severity == "missing"
    assert issue.missing.where == (pytest.approx((90.0, 50.0)),)
    assert float(issue.message.split(" and ")[1].split()[0]) == pytest.approx(60.0, abs=0.5)


@pytest.mark.parametrize("compensation", ["geometry", "controller"])
def test_a_hole_that_holds_a_part_is_cut_in_pieces_after_that_part(compensation: str, tmp_path: Path) -> None:
    outcome = api.optimize(drawn(tmp_path, bell(1.0), ((150, 60), 20)), compensation=compensation, **FAST)
    assert outcome.verified
    assert [i.code for i in outcome.issues if i.code in ("L611", "L612")] == ["L612"]
    cuts = [cut.contours for cut in outcome.detail.plan.cuts]
    sheet = outcome.detail.plan.sheet
    (part,) = (k for k, one in enumerate(sheet.contours) if one.part == 2)
    around = sheet.contours[part].parent
    assert sheet.contours[around].path.extents[0] == pytest.approx(120.0, abs=1.6)
    assert sorted(cuts) == [(0,), (1,), (2,), (3,)]
    assert cuts.index((part,)) < cuts.index((around,)) < cuts.index((0,))


def test_a_slot_narrower_than_two_kerfs_is_cut_along_its_middle_also_under_controller_compensation(
    tmp_path: Path,
) -> None:
    slot = [(50, 50), (90, 50), (90, 52), (50, 52)]
    outcome = api.optimize(drawn(tmp_path, slot), compensation="controller", **FAST)
    assert outcome.verified
    assert [i.code for i in outcome.issues if i.code in ("L611", "L627")] == ["L627"]


# -- the sheet, and its proof ------------------------------------------------------------------------------------------

RULES: CutRules = resolve_rules(
    CutData("plasma", "mild_steel", 6.0, 30.0, KERF, pierce_height=4.0, pierce_delay=0.5, cut_height=1.5),
    CutOptions(),
)


def sheet_of(hole: list[tuple[float, float]]) -> Sheet:
    plate, window = (Polyline.of_points(points, closed=True) for points in (PLATE, hole))
    contours = Contour(plate, depth=0, parent=-1, part=1), Contour(window, depth=1, parent=0, part=1)
    return Sheet("plate", contours)


def test_a_hole_whose_neck_the_kerf_passes_stays_as_it_is() -> None:
    sheet = sheet_of(bell(2.0 * KERF))
    assert with_divided_holes(sheet, RULES) == (sheet, [])


def test_the_first_piece_takes_the_number_of_the_hole_and_the_others_come_last() -> None:
    sheet = sheet_of(bell(1.0))
    divided, _ = with_divided_holes(sheet, RULES)
    assert divided.contours[0] is sheet.contours[0]
    assert [(c.depth, c.parent, c.part) for c in divided.contours[1:]] == [(1, 0, 1)] * 2
    assert check_divided_shapes(sheet, divided, 0.5 * KERF) == []


def test_a_hole_with_something_outside_of_its_pieces_stays_as_it_is() -> None:
    """The part lies in the neck, where no kerf comes."""
    sheet = sheet_of(bell(1.0))
    tiny = Contour(Polyline.of_points([(80, 49.8), (84, 49.8), (84, 50.2), (80, 50.2)], closed=True))
    held = replace(sheet, contours=(*sheet.contours, replace(tiny, depth=2, parent=1, part=2)))
    assert with_divided_holes(held, RULES) == (held, [])


@pytest.mark.parametrize("fault", ["dropped", "wider", "outline"])
def test_a_fault_of_the_pieces_is_found_from_the_drawn_hole_alone(fault: str) -> None:
    sheet = sheet_of(bell(1.0))
    divided, _ = with_divided_holes(sheet, RULES)
    plate, one, other = divided.contours
    wider = replace(other, path=Polyline.of_points([(119.8, 20), (180, 20), (180, 100), (119.8, 100)], closed=True))
    contours = {
        "dropped": (plate, one),
        "wider": (plate, one, wider),
        "outline": (replace(plate, path=Polyline(plate.path.vertices, closed=True)), one, other),
    }[fault]
    text = {"dropped": "is not cut", "wider": "beyond its edge", "outline": "which only a hole may be"}[fault]
    found = check_divided_shapes(sheet, replace(divided, contours=contours), 0.5 * KERF)
    assert text in " ".join(difference.text for difference in found)
