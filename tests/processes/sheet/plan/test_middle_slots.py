"""Slots one to two kerfs wide become open cuts along their middle: found by hand at any angle, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cut_sheets import sheet_of, square
from leafcut.geometry.polyline import Polyline
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.narrow_shapes import with_slot_cuts

KERF = 1.5


def plain(length: float, width: float) -> Polyline:
    return Polyline.of_points([(0, 0), (length, 0), (length, width), (0, width)], closed=True)


def round_ended(length: float, width: float) -> Polyline:
    """A slot with half circles at both ends, `length` over all."""
    r = 0.5 * width
    return Polyline(np.array([[r, 0, 0], [length - r, 0, 1], [length - r, width, 0], [r, width, 1]]), closed=True)


def plate_with(*holes: Polyline) -> Sheet:
    return sheet_of((square(0, 0, 200), 0, -1, 1), *((hole, 1, 0, 1) for hole in holes))


def middle_of(slot: Polyline, kerf: float = KERF) -> Polyline | None:
    path = with_slot_cuts(plate_with(slot), kerf)[0].contours[1].path
    return None if path.closed else path


@pytest.mark.parametrize("shape", [plain, round_ended])
@pytest.mark.parametrize("degrees", [0, 30, 90, 133])
def test_a_slot_is_cut_on_its_middle_half_a_kerf_short_of_either_end(shape, degrees: int) -> None:
    turn = math.radians(degrees)
    path = middle_of(shape(20.0, 2.0).turned(turn).moved(90, 80))
    assert path is not None
    ends = [(90 + x * math.cos(turn) - math.sin(turn), 80 + x * math.sin(turn) + math.cos(turn)) for x in (0.75, 19.25)]
    found = sorted([path.start, path.end])
    assert found == [pytest.approx(end, abs=1e-3) for end in sorted(ends)]


def test_only_slots_from_one_to_two_kerfs_wide_are_and_only_long_ones() -> None:
    assert [middle_of(plain(20.0, w)) is not None for w in (1.3, 1.5, 2.0, 2.9, 3.0, 3.2)] == [
        *[False, True, True, True],
        *[False, False],
    ]
    assert middle_of(plain(3.9, 2.0)) is None
    assert middle_of(plain(4.1, 2.0)) is not None


def test_what_is_as_narrow_and_no_slot_stays_as_it_is() -> None:
    wedge = Polyline.of_points([(0, 0), (20, 0), (20, 2)], closed=True)
    corner = Polyline.of_points([(0, 0), (20, 0), (20, 2), (2, 2), (2, 20), (0, 20)], closed=True)
    assert middle_of(wedge) is None
    assert middle_of(corner) is None


def test_outlines_of_parts_and_slots_that_hold_something_stay_closed() -> None:
    narrow = sheet_of((plain(20.0, 2.0), 0, -1, 1))
    assert with_slot_cuts(narrow, KERF) == (narrow, [])
    holding = sheet_of((square(0, 0, 200), 0, -1, 1), (plain(20, 2.0), 1, 0, 1), (plain(3, 0.2).moved(5, 1), 2, 1, 2))
    assert with_slot_cuts(holding, KERF)[0].contours[1].path.closed


def test_a_slot_as_wide_as_the_kerf_is_as_drawn_and_of_wider_ones_it_is_told_how_many_and_where() -> None:
    sheet, issues = with_slot_cuts(plate_with(plain(20.0, KERF)), KERF)
    assert (sheet.contours[1].path.closed, issues) == (False, [])
    slots = [plain(20.0, 2.0).moved(20, 20 * k) for k in range(1, 6)]
    _, (issue,) = with_slot_cuts(plate_with(*slots), KERF)
    assert issue.code == "L627"
    assert "5 slots" in issue.message and "(30, 21)" in issue.place and issue.place.endswith("…")
