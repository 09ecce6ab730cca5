"""Round holes of a sheet are left out by their diameter, and nothing else is."""

from __future__ import annotations

import math

import pytest

from cut_sheets import rectangle, square
from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.part import Part
from leafcut.model.sheet import Sheet
from leafcut.options import ReadOptions
from leafcut.processes.contours import diameter_if_round, prepare_sheet, without_excluded_holes


def sheet(*paths: Polyline) -> Sheet:
    return prepare_sheet(Part("test", contours=tuple(Contour(p) for p in paths)))


def circle_in_chords(x: float, y: float, radius: float, count: int) -> Polyline:
    turns = [2.0 * math.pi * k / count for k in range(count)]
    return Polyline.of_points([(x + radius * math.cos(a), y + radius * math.sin(a)) for a in turns], closed=True)


def test_round_holes_beyond_the_limits_go_and_are_told_in_one_issue() -> None:
    drawn = sheet(
        Polyline.circle(20, 20, 3),
        square(0, 0, 100),
        Polyline.circle(50, 20, 5),
        circle_in_chords(80, 20, 4, 36),
        Polyline.circle(50, 60, 20),
    )
    found = without_excluded_holes(drawn, ReadOptions(min_diameter=10.0, max_diameter=30.0))
    assert [c.path.extents[2] for c in found.contours] == pytest.approx([100.0, 55.0])
    assert [(c.depth, c.parent, c.part) for c in found.contours] == [(0, -1, 1), (1, 0, 1)]
    (issue,) = found.issues
    assert issue.code == "L205"
    assert issue.message == "left out 3 holes outside the selected range of diameters"


def test_a_hole_as_large_as_a_limit_stays() -> None:
    drawn = sheet(square(0, 0, 100), Polyline.circle(30, 30, 5), Polyline.circle(70, 30, 10))
    assert without_excluded_holes(drawn, ReadOptions(min_diameter=10.0, max_diameter=20.0)) is drawn


def test_round_parts_slots_and_windows_stay_whatever_their_size() -> None:
    slot = Polyline.of_points([(20, 20), (40, 20), (40, 24), (20, 24)], closed=True)
    drawn = sheet(square(0, 0, 100), slot, square(60, 60, 5), Polyline.circle(150, 50, 4))
    assert without_excluded_holes(drawn, ReadOptions(min_diameter=50.0)) is drawn


def test_a_hole_with_a_part_in_it_is_not_left_out_but_refused() -> None:
    """Without the hole the part in it would be a hole of the other, and be cut on the wrong side."""
    drawn = sheet(square(0, 0, 100), Polyline.circle(50, 50, 40), square(40, 40, 20))
    with pytest.raises(PlanError, match=r"part 1 is excluded by its diameter.*\(40, 40\); change --min-diameter"):
        without_excluded_holes(drawn, ReadOptions(max_diameter=30.0))


def test_only_circles_are_round() -> None:
    assert diameter_if_round(Polyline.circle(3, 4, 5)) == pytest.approx(10.0)
    assert diameter_if_round(circle_in_chords(0, 0, 5, 24)) == pytest.approx(10.0)
    assert diameter_if_round(circle_in_chords(0, 0, 5, 8)) is None
    assert diameter_if_round(square(0, 0, 10)) is None
    assert diameter_if_round(rectangle(0, 0, 10, 4)) is None
