"""The parts of a drawing, each with its inner contours; lines outside of parts are left out."""

from __future__ import annotations

import pytest

from cut_sheets import part_in_hole, ring, sheet_of, square, two_squares
from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.sheet import Sheet
from leafcut.nesting.run import parts_of_sheet


def test_a_part_has_its_outline_first_then_its_holes_and_marks_and_the_name_of_the_drawing() -> None:
    (part,), issues = parts_of_sheet(ring(), 3, None)
    assert (part.name, part.quantity, part.rotations) == ("test", 3, None)
    assert [c.kind for c in part.contours] == ["cut", "cut", "mark"]
    assert part.area == pytest.approx(3.14159265 * (60**2 - 30**2))
    assert issues == []


def test_several_parts_are_numbered_and_it_is_told_how_many_are_made_of_each() -> None:
    parts, (issue,) = parts_of_sheet(two_squares(), 4, (0.0,))
    assert [part.name for part in parts] == ["test-1", "test-2"]
    assert issue.code == "L432" and "2 parts" in issue.message and "4 times" in issue.message


def test_a_part_in_the_hole_of_another_is_a_part_of_its_own() -> None:
    parts, _ = parts_of_sheet(part_in_hole(), 1, None)
    assert [len(part.contours) for part in parts] == [2, 2]
    assert [part.outline.area for part in parts] == [pytest.approx(160**2), pytest.approx(40**2)]


def test_lines_in_no_part_are_left_out_and_told_with_their_place_and_without_an_outline_there_is_nothing() -> None:
    stray = Contour(Polyline.of_points([(300, 5), (310, 5)]), depth=0, parent=-1, part=0)
    drawn = sheet_of((square(0, 0, 50), 0, -1, 1))
    (part,), (issue,) = parts_of_sheet(Sheet("test", (*drawn.contours, stray)), 1, None)
    assert len(part.contours) == 1
    assert (issue.code, issue.place) == ("L431", "at (300, 5)")
    with pytest.raises(PlanError, match="no closed outline"):
        parts_of_sheet(Sheet("test", (stray,)), 1, None)
