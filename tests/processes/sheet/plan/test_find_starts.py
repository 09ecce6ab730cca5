"""Starts of cuts: their number and position on a contour, and the message if there are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from cut_sheets import LASER, PLASMA, part_in_hole, rectangle, ring, rules_of, sheet_of, square
from leafcut.errors import PlanError
from leafcut.model.cutting import CutData
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan import starts as room
from leafcut.processes.sheet.plan.contours import CutContour, prepare_contours
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import CutStart

HALF = 0.5 * PLASMA.kerf


def found(sheet: Sheet, data: CutData = PLASMA, **options: Any) -> tuple[list[CutContour], list[CutStart]]:
    rules = rules_of(data, **options)
    contours, _ = prepare_contours(sheet, rules)
    return contours, room.find_starts(contours, Scrap(sheet, contours, rules))


def places_of(starts: list[CutStart], contour: int = 0) -> list[float]:
    """Return the positions of starts along a contour, without duplicates, sorted."""
    return sorted({s.at for s in starts if s.contour == contour})


def test_starts_come_contour_by_contour_and_each_has_some() -> None:
    for sheet in (part_in_hole(), ring()):
        contours, starts = found(sheet)
        numbers = [s.contour for s in starts]
        assert numbers == sorted(numbers)
        assert set(numbers) == set(range(len(contours)))


def test_the_torch_comes_down_in_the_scrap_on_the_side_that_is_thrown_away() -> None:
    """Beside an outline and in a hole, half a kerf or more from every edge."""
    contours, starts = found(part_in_hole())
    shapes = [shapely.Polygon(c.source.path.flattened(0.005)) for c in contours]
    for start in starts:
        point, contour = shapely.Point(start.entry), contours[start.contour]
        assert shapes[start.contour].contains(point) == contour.hole
        assert min(shape.exterior.distance(point) for shape in shapes) >= HALF - 0.01


@pytest.mark.parametrize(
    "width, height, least, most",
    [
        (200.0, 200.0, 16, 20),  # a sixteenth of 0.8 m between two places, and the four corners
        (3000.0, 1500.0, 32, 36),  # every 100 mm would be 90 places
        (14.0, 14.0, 4, 10),  # every 10 mm
    ],
)
def test_a_contour_has_places_all_around_and_not_too_many(width: float, height: float, least: int, most: int) -> None:
    contours, starts = found(sheet_of((rectangle(20, 20, width, height), 0, -1, 1)))
    at = places_of(starts)
    assert least <= len(at) <= most
    length = contours[0].path.length
    assert max(np.diff([*at, at[0] + length])) <= 1.5 * length / least


def test_a_cut_can_begin_at_every_corner_and_elsewhere() -> None:
    corners = shapely.MultiPoint([(20, 20), (220, 20), (220, 220), (20, 220)])
    sheet = sheet_of((square(20, 20, 200), 0, -1, 1))
    contours, starts = found(sheet)
    points = [shapely.Point(contours[0].path.point_at(at)) for at in places_of(starts)]
    near = [point.distance(corners) < 2.0 * HALF for point in points]
    assert 4 <= sum(near) < len(near)


@pytest.mark.parametrize("contours, most", [(1, 32), (625, 32), (1000, 20), (10_000, 4)])
def test_the_more_contours_there_are_the_fewer_places_each_has(contours: int, most: int) -> None:
    """All together have twenty thousand at most, and each four at least."""
    asked = []

    def find_contour_starts(number: int, *given: Any) -> list[CutStart]:
        asked.append(given[-1])
        return [CutStart(number, 0.0, True, (0.0, 0.0), (0.0, 0.0))]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "find_contour_starts", find_contour_starts)
        some: Any = [None] * contours
        scrap: Any = None
        assert [s.contour for s in room.find_starts(some, scrap)] == list(range(contours))
    assert set(asked) == {most}


def test_without_leads_every_cut_begins_on_its_path_whichever_way_round_it_goes() -> None:
    contours, starts = found(ring(), LASER, lead_in="none")
    for number, contour in enumerate(contours):
        own = [s for s in starts if s.contour == number]
        for start in own:
            assert start.entry == contour.path.point_at(start.at)
            assert start.lead_in.style == "none"
        if contour.kind == "cut":
            assert {(s.at, s.clockwise) for s in own} == {(s.at, way) for s in own for way in (True, False)}


def test_of_contours_without_room_the_first_three_are_named_and_the_others_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sheet = sheet_of(*((square(40 + 60 * k, 40, 30), 0, -1, k + 1) for k in range(6)))
    find = room.find_contour_starts
    monkeypatch.setattr(room, "find_contour_starts", lambda number, *given: find(number, *given) if number == 2 else [])
    with pytest.raises(PlanError) as refused:
        found(sheet)
    contours, _ = prepare_contours(sheet, rules_of())
    named = "; ".join(contours[k].name() for k in (0, 1, 3))
    assert str(refused.value).startswith(f"no lead fits into the scrap at {named} and 2 more; give a shorter ")
