"""Groups of parts with common lines, and what a sheet's contours become: each module by itself."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
import shapely

from cut_sheets import LASER, PLASMA, rectangle, rules_of, sheet_of, square
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import CutData
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.common_edges import EdgeGap, facing_edges
from leafcut.processes.sheet.plan.common_lines import CommonCutGroup, Grouper, scrap_with_lead_ins, with_common_lines
from leafcut.processes.sheet.plan.contours import CutContour, prepare_contours
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.scrap import Scrap

KERF = PLASMA.kerf
Ready = tuple[list[CutContour], Scrap, CutRules]


def row(*sizes: tuple[float, float], gap: float = KERF) -> Sheet:
    """Return boxes (width, height) from left to right, their feet on one line."""
    lefts = itertools.accumulate((width + gap for width, _ in sizes), initial=40.0)
    boxes = [(rectangle(x, 40, *size), 0, -1, n) for n, (x, size) in enumerate(zip(lefts, sizes, strict=False), 1)]
    return sheet_of(*boxes, size=500)


def ready(sheet: Sheet, data: CutData = PLASMA, **options: Any) -> Ready:
    rules = rules_of(data, common_lines=True, **options)
    contours, _ = prepare_contours(sheet, rules)
    return contours, Scrap(sheet, contours, rules), rules


def grouped(sheet: Sheet, *members: int, data: CutData = PLASMA) -> tuple[CommonCutGroup | None, list[EdgeGap]]:
    contours, scrap, rules = ready(sheet, data)
    slots = facing_edges(contours, rules)
    return Grouper(contours, slots, scrap).group(frozenset(members)), slots


def test_the_shape_of_a_group_is_its_parts_and_the_rooms_between_them() -> None:
    """Two boxes of 60 × 40 and 30 × 40: with the room between 91.5 × 40 mm; the path runs half a kerf around."""
    group, _ = grouped(row((60, 40), (30, 40)), 0, 1)
    assert group is not None
    assert group.shape.area == pytest.approx(91.5 * 40, abs=0.1)
    assert group.path.extents == pytest.approx((40 - 0.75, 40 - 0.75, 131.5 + 0.75, 80.75), abs=0.01)
    assert (group.members, group.parts) == ({0, 1}, {1, 2})


def test_a_line_runs_in_the_middle_between_two_parts_from_kerf_to_kerf() -> None:
    group, _ = grouped(row((60, 40), (30, 40)), 0, 1)
    assert group is not None
    (line,) = group.lines
    assert line.parts == (0, 1)
    assert line.shared == pytest.approx(40.0, abs=1e-6)
    assert sorted(line.ends) == [pytest.approx((100.75, 40 - 0.75), abs=0.02), pytest.approx((100.75, 80.75), abs=0.02)]
    assert all(lead is not None for lead in line.inlets)


def test_parts_that_are_not_a_kerf_apart_make_no_group() -> None:
    contours, _, rules = ready(row((60, 40), (30, 40), gap=2 * KERF))
    assert facing_edges(contours, rules) == []
    # Of three in a row the outer two alone do not hang together.
    assert grouped(row((60, 40), (30, 40), (50, 40)), 0, 2)[0] is None
    assert grouped(row((60, 40), (30, 40), (50, 40)), 0, 1, 2)[0] is not None


def around_a_square(side: float) -> Sheet:
    """Return four boxes around a square, each a kerf from the next, like the sails of a mill."""
    k, low, high = KERF, 100.0, 100.0 + side
    boxes = [
        (40.0, 40.0, high - k - 40.0, 60.0),
        (high, 40.0, 60.0, high - k - 40.0),
        (low + k, high, 98.5 + side - k, 60.0),
        (40.0, low + k, 60.0, 98.5 + side - k),
    ]
    return sheet_of(*((rectangle(*box), 0, -1, n) for n, box in enumerate(boxes, 1)), size=500)


def test_a_room_that_parts_lock_in_is_scrap_that_makes_no_group() -> None:
    """It would hang between the lines, whether 20 mm wide or 2; of a kerf's width nothing remains."""
    for side, whole in ((20.0, False), (2.0, False), (KERF, True)):
        group, slots = grouped(around_a_square(side), 0, 1, 2, 3)
        assert len(slots) >= 4, side
        assert (group is not None) == whole, side


def test_a_notch_where_four_parts_meet_locks_scrap_in() -> None:
    """All lines of a laser would come to a kerf, and yet what is in the notch would stay, held by nothing."""
    for data, notch, whole in ((LASER, 0.0, True), (LASER, 0.12, False), (PLASMA, 0.6, False)):
        far = 100 + data.kerf
        boxes = [(square(x, y, 60), 0, -1, n) for n, (x, y) in enumerate(((40, 40), (far, 40), (far, far)), 1)]
        corner = [(100 - notch, far), (100 - notch, far + notch), (100, far + notch)] if notch else [(100.0, far)]
        notched = Polyline.of_points([(40, far), *corner, (100, far + 60), (40, far + 60)], closed=True)
        group, _ = grouped(sheet_of(*boxes, (notched, 0, -1, 4), size=500), 0, 1, 2, 3, data=data)
        assert (group is not None) == whole, (data.process, notch)


def test_where_lines_cross_a_plasma_divides_the_one_and_a_laser_cuts_both_through() -> None:
    def four(kerf: float) -> Sheet:
        far = 100 + kerf
        corners = ((40, 40), (far, 40), (40, far), (far, far))
        return sheet_of(*((square(x, y, 60), 0, -1, n) for n, (x, y) in enumerate(corners, 1)), size=500)

    torch, _ = grouped(four(KERF), 0, 1, 2, 3)
    beam, _ = grouped(four(LASER.kerf), 0, 1, 2, 3, data=LASER)
    assert torch is not None and beam is not None
    assert [round(line.shared) for line in torch.lines] == [120, 60, 60]
    assert {(0, 1), (0, 2)} <= set(torch.order)
    assert [round(line.shared) for line in beam.lines] == [120, 120]


def test_of_a_group_the_lines_come_first_and_what_is_around_it_last() -> None:
    contours, scrap, _ = ready(row((60, 40), (30, 40), (50, 40)))
    made, order, issues = with_common_lines(contours, scrap)
    *lines, around = made
    assert [c.common > 0.0 for c in made] == [True, True, False]
    assert set(order) == {(0, 2), (1, 2)}
    assert [line.covers for line in lines] == [(0, 1), (1, 2)]
    assert around.covers == (0, 1, 2)
    assert len({c.index for c in made}) == 3
    assert [i.message for i in issues] == ["80 mm of edges shared by 3 parts are cut only once, in 2 lines"]


def test_two_groups_have_numbers_and_indices_of_their_own() -> None:
    boxes = [(40, 40), (101.5, 40), (40, 240), (101.5, 240)]
    contours, scrap, _ = ready(sheet_of(*((square(x, y, 60), 0, -1, n) for n, (x, y) in enumerate(boxes, 1)), size=500))
    made, order, _ = with_common_lines(contours, scrap)
    assert [(c.group, c.common > 0.0) for c in made] == [(1, True), (1, False), (2, True), (2, False)]
    assert set(order) == {(0, 1), (2, 3)}
    assert len({c.index for c in made}) == 4


def test_holes_of_the_parts_and_their_marks_come_before_the_lines() -> None:
    sheet = sheet_of((square(40, 40, 60), 0, -1, 1), (square(101.5, 40, 60), 0, -1, 2), (square(60, 60, 20), 1, 0, 1),
                     size=500)  # fmt: skip
    contours, scrap, _ = ready(sheet)
    made, order, _ = with_common_lines(contours, scrap)
    (hole,) = (k for k, c in enumerate(made) if c.hole)
    line, around = (next(k for k, c in enumerate(made) if bool(c.common) == wanted and c.group) for wanted in (1, 0))
    assert set(order) == {(hole, line), (hole, around), (line, around)}


def test_parts_apart_stay_as_they_are_and_that_is_said() -> None:
    contours, scrap, _ = ready(row((60, 40), (30, 40), gap=10.0))
    made, order, issues = with_common_lines(contours, scrap)
    assert (made, order) == (contours, [])
    assert [i.code for i in issues] == ["L616"]


def test_leads_of_common_lines_are_kept_clear_of_others() -> None:
    contours, scrap, rules = ready(row((60, 40), (30, 40)))
    made, _, _ = with_common_lines(contours, scrap)
    line = next(c for c in made if c.common)
    bare = Scrap(row((60, 40), (30, 40)), made, rules)
    lead = shapely.LineString([(80.0, 36.0), (120.0, 36.0)])
    assert shapely.Point(line.path.start).distance(lead) < 8.0
    assert bare.allowed_mask([lead], line)[0]
    assert not scrap_with_lead_ins(bare, made).allowed_mask([lead], line)[0]
    far = shapely.LineString([(80.0, 15.0), (120.0, 15.0)])
    assert np.all(scrap_with_lead_ins(bare, made).allowed_mask([far], line))
