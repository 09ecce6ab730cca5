"""Notches whose mouths the kerf closes: their chambers are cut before the outline, and the rest is reported."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

from leafcut import api
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import CutData
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.costs import part_areas
from leafcut.processes.sheet.plan.cut_rules import CutRules, resolve_rules
from leafcut.processes.sheet.plan.narrow_shapes import with_chambers
from leafcut.processes.sheet.proof.sheet_shapes import check_divided_shapes

KERF = 1.5
FAST: dict[str, Any] = {"process": "cut", "thickness": "6", "kerf": "1.5", "iterations": 5, "threads": 1}
Notch = list[tuple[float, float, float]]


def mirrored(right: list[tuple[float, float]], x: float = 50.0) -> Notch:
    """A notch in the upper edge: its right half about a middle at `x`, and the same to the left."""
    left = [(-u, v) for u, v in reversed(right)]
    return [(x + u, 74.0 - v, 0.0) for u, v in (*right, *left)]


def keyhole(width: float, height: float, neck: float = 0.6, length: float = 2.0) -> Notch:
    return mirrored([(neck / 2, 0), (neck / 2, length), (width / 2, length), (width / 2, length + height)])


def two_chambers() -> Notch:
    return mirrored([(0.3, 0), (0.3, 2), (4, 2), (4, 10), (0.3, 10), (0.3, 12), (5, 12), (5, 20)])


def round_keyhole(radius: float) -> Notch:
    angle = math.tau - 2.0 * math.asin(0.3 / radius)
    return [(50.3, 74, 0), (50.3, 72, -math.tan(angle / 4)), (49.7, 72, 0), (49.7, 74, 0)]


def plate(*notches: Notch) -> Notch:
    return [(0, 0, 0), (100, 0, 0), (100, 74, 0), *(corner for notch in notches for corner in notch), (0, 74, 0)]


def path_of(corners: Notch) -> Polyline:
    return Polyline(np.array(corners, dtype=np.float64), closed=True)


def drawn(folder: Path, outline: Notch, *circles: tuple[tuple[float, float], float]) -> Path:
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline(outline, format="xyb", close=True)
    for middle, radius in circles:
        document.modelspace().add_circle(middle, radius)
    document.saveas(folder / "plate.dxf")
    return folder / "plate.dxf"


@pytest.mark.hazard
@pytest.mark.parametrize(
    "notch, chambers, more",
    [
        (keyhole(4, 4), 1, {}),
        (keyhole(20, 6), 1, {"compensation": "controller"}),
        (two_chambers(), 2, {}),
        (round_keyhole(4), 1, {"machine": "laser-table"}),
    ],
    ids=["keyhole", "T-slot", "two chambers in a row", "round chamber"],
)
def test_the_chambers_of_a_notch_are_cut_as_drawn_before_the_outline(
    notch: Notch, chambers: int, more: dict[str, Any], tmp_path: Path
) -> None:
    outcome = api.optimize(drawn(tmp_path, plate(notch)), **{**FAST, **more})
    assert outcome.verified
    sheet, cuts = outcome.detail.plan.sheet, outcome.detail.plan.cuts
    assert [sheet.contours[cut.contours[0]].is_hole for cut in cuts] == [True] * chambers + [False]
    part = shapely.Polygon(path_of(plate(notch)).flattened(0.002))
    reached = part.buffer(0.5 * KERF, quad_segs=32)
    assert len(reached.interiors) == chambers
    if "compensation" not in more:
        followed = shapely.union_all([shapely.LineString(cut.path.flattened(0.002)) for cut in cuts])
        assert reached.boundary.difference(followed.buffer(0.03)).length < 1e-9
        assert followed.buffer(0.5 * KERF, quad_segs=32).intersection(part.buffer(-0.03)).is_empty


def test_the_time_of_a_chamber_is_its_part_s_and_its_perimeter_counts_once(tmp_path: Path) -> None:
    outcome = api.optimize(drawn(tmp_path, plate(two_chambers())), **FAST)
    measures = outcome.detail.plan.measures
    assert [part.part for part in measures.parts] == [1]
    assert measures.sheet.perimeter_mm == pytest.approx(path_of(plate(two_chambers())).length)
    assert measures.parts[0].times.cut_s == pytest.approx(sum(times.cut_s for times in measures.cuts))


def test_what_stays_uncut_of_a_notch_is_its_neck(tmp_path: Path) -> None:
    """The neck of 2 × 0.6 mm, less what the kerf takes of its two ends: segments of a circle of 1.5 mm."""
    outcome = api.optimize(drawn(tmp_path, plate(keyhole(6, 6))), **FAST)
    (issue,) = [i for i in outcome.issues if i.code == "L612"]
    assert issue.severity == "missing"
    area = float(str(issue.message).split(" mm² ")[0].split()[-1])
    assert area == pytest.approx(1.2 - 2.0 * (0.75**2 * math.asin(0.4) - 0.3 * math.sqrt(0.75**2 - 0.3**2)), abs=0.05)
    assert shapely.box(49.6, 71.9, 50.4, 74.1).covers(shapely.Polygon(issue.missing.outlines[0].flattened(0.01)))


@pytest.mark.parametrize("chains", [False, True])
def test_a_part_in_a_chamber_is_cut_before_it_or_in_one_chain_with_it(chains: bool, tmp_path: Path) -> None:
    outcome = api.optimize(drawn(tmp_path, plate(keyhole(40, 40)), ((50, 52), 10)), chains=chains, **FAST)
    assert outcome.verified
    assert [cut.contours for cut in outcome.detail.plan.cuts] == ([(1, 2), (0,)] if chains else [(1,), (2,), (0,)])


# -- the sheet, and its proof ------------------------------------------------------------------------------------------

DATA = CutData("plasma", "mild_steel", 6.0, 30.0, KERF, pierce_height=4.0, pierce_delay=0.5, cut_height=1.5)
RULES: CutRules = resolve_rules(DATA, CutOptions())


def sheet_of(outline: Notch, *held: Contour, **more: Any) -> Sheet:
    contours = (
        Contour(path_of(outline), depth=0, parent=-1, part=1),
        *(replace(one, depth=0, parent=-1, part=2) for one in held),
    )
    return Sheet("plate", contours, **more)


def test_a_chamber_is_a_hole_outside_of_its_outline_and_takes_no_area_of_its_part() -> None:
    sheet = sheet_of(plate(two_chambers()))
    cut = with_chambers(sheet, RULES)
    assert cut.contours[0] is sheet.contours[0]
    assert [(c.is_hole, c.chamber, c.parent, c.part) for c in cut.contours[1:]] == [(True, True, -1, 1)] * 2
    assert part_areas(cut) == part_areas(sheet)
    assert check_divided_shapes(sheet, cut, 0.5 * KERF) == []


@pytest.mark.parametrize(
    "notch",
    [keyhole(3, 3), keyhole(6, 6, neck=1.6), keyhole(6, 6, neck=1.4, length=0.1)],
    ids=["no room for a pierce", "mouth wider than the kerf", "kerf of the chamber runs into that of the outline"],
)
def test_a_chamber_without_room_is_left(notch: Notch) -> None:
    sheet = sheet_of(plate(notch))
    assert with_chambers(sheet, RULES) == sheet


def test_a_chamber_with_a_clamp_or_with_something_in_its_neck_is_left_and_one_from_the_edge_of_the_sheet_too() -> None:
    notch = plate(keyhole(20, 20))
    clamped = sheet_of(notch, zones=((45.0, 55.0, 50.0, 60.0),))
    assert with_chambers(clamped, RULES) == clamped
    marked = sheet_of(notch, Contour(Polyline.of_points([(50, 72.5), (50, 73.5)], closed=False), kind="mark"))
    assert with_chambers(marked, RULES) == marked
    sheet = sheet_of(notch)
    assert with_chambers(sheet, resolve_rules(replace(DATA, can_pierce=False), CutOptions())) == sheet
    assert len(with_chambers(sheet, RULES).contours) == 2


@pytest.mark.hazard
@pytest.mark.parametrize("fault", ["dropped", "wider", "elsewhere"])
def test_a_fault_of_the_chambers_is_found_from_the_drawn_outline_alone(fault: str) -> None:
    sheet = sheet_of(plate(two_chambers()))
    outline, first, second = with_chambers(sheet, RULES).contours
    boxes = {"wider": (44.9, 54, 55.2, 62), "elsewhere": (40, 80, 50, 90)}
    contours = (outline, first)
    if fault != "dropped":
        x0, y0, x1, y1 = boxes[fault]
        path = Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)
        contours = (*contours, replace(second, path=path))
    found = check_divided_shapes(sheet, replace(sheet, contours=contours), 0.5 * KERF)
    text = "is not cut" if fault == "dropped" else "beyond its notch"
    assert text in " ".join(difference.text for difference in found)
