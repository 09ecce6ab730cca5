"""Spaces between edges that face each other one kerf apart: counted for randomly placed rectangles."""

from __future__ import annotations

import itertools
import random

import pytest
import shapely

from cut_sheets import PLASMA, rectangle, rules_of, sheet_of, split_rectangle, square
from leafcut.geometry.polyline import Polyline
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.common_edges import EdgeGap, facing_edges
from leafcut.processes.sheet.plan.contours import prepare_contours

KERF = PLASMA.kerf


def found(*paths: Polyline) -> list[EdgeGap]:
    return of_sheet(sheet_of(*((path, 0, -1, k) for k, path in enumerate(paths, 1))))


def of_sheet(sheet: Sheet) -> list[EdgeGap]:
    rules = rules_of()
    contours, _ = prepare_contours(sheet, rules)
    return facing_edges(contours, rules)


def test_two_squares_a_kerf_apart_have_one_room_between_them_along_all_that_faces() -> None:
    (slot,) = found(square(0, 0, 50), square(50 + KERF, 10, 50))
    assert slot.parts == (0, 1)
    assert slot.width == pytest.approx(KERF)
    ends = sorted([slot.begin, slot.end])
    assert ends == [pytest.approx((50 + KERF / 2, 10)), pytest.approx((50 + KERF / 2, 50))]
    assert (abs(slot.normal[0]), slot.length) == (pytest.approx(1.0), pytest.approx(40))


def test_edges_a_hundredth_of_a_millimetre_off_still_are_a_kerf_apart_and_three_are_not() -> None:
    assert [len(found(square(0, 0, 50), square(50 + KERF + off, 0, 50))) for off in (0.01, -0.01, 0.03, -0.03)] == [
        *[1, 1],
        *[0, 0],
    ]


def test_edges_that_face_each_other_over_less_than_four_kerfs_are_not_worth_a_cut() -> None:
    assert found(square(0, 0, 50), square(50 + KERF, 44.1, 50)) == []
    assert len(found(square(0, 0, 50), square(50 + KERF, 43.9, 50))) == 1


def test_edges_of_one_part_and_a_part_and_what_lies_in_its_hole_have_no_room_between_them() -> None:
    notched = [(0, 0), (50, 0), (50, 20), (10, 20), (10, 20 + KERF), (50, 20 + KERF), (50, 50), (0, 50)]
    assert found(Polyline.of_points(notched, closed=True)) == []
    inner = square(20 + KERF, 20 + KERF, 60 - 2 * KERF)
    sheet = sheet_of((square(0, 0, 100), 0, -1, 1), (square(20, 20, 60), 1, 0, 1), (inner, 2, 1, 2))
    assert of_sheet(sheet) == []


def test_round_edges_and_edges_at_an_angle_have_none() -> None:
    assert found(Polyline.circle(0, 0, 25), Polyline.circle(50 + KERF, 0, 25)) == []
    tilted = Polyline.of_points([(50 + KERF, 0), (101, 0), (101, 50), (50 + KERF + 0.1, 50)], closed=True)
    assert found(square(0, 0, 50), tilted) == []


@pytest.mark.parametrize("seed", range(25))
def test_of_a_rectangle_split_by_kerfs_the_rooms_are_all_that_lie_a_kerf_wide_between_two_boxes(seed: int) -> None:
    boxes = split_rectangle(seed, KERF)
    random.Random(seed).shuffle(boxes)
    slots = found(*(rectangle(*box) for box in boxes))
    shapes = [shapely.box(x, y, x + w, y + h) for x, y, w, h in boxes]
    length = 0.0
    for (x, y, w, h), (u, v, wide, high) in itertools.combinations(boxes, 2):
        apart = max(u - x - w, x - u - wide), max(v - y - h, y - v - high)
        facing = min(y + h, v + high) - max(y, v), min(x + w, u + wide) - max(x, u)
        length += sum(f for gap, f in zip(apart, facing, strict=True) if abs(gap - KERF) < 1e-6 and f >= 4 * KERF)
    assert sum(slot.length for slot in slots) == pytest.approx(length, abs=1e-3)
    for slot in slots:
        line = shapely.LineString([slot.begin, slot.end])
        assert all(line.distance(shapes[k]) == pytest.approx(KERF / 2, abs=1e-6) for k in slot.parts)
