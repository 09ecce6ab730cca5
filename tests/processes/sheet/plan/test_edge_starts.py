"""Starts from beyond the sheet's edge: along the axes, into the metal once, through no part."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cut_sheets import PLASMA, rules_of, sheet_of, square
from leafcut.errors import PlanError
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.contours import prepare_contours
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import IN_THE_AIR, CutStart, edge_starts


def starts(sheet: Sheet, number: int = 0, places: int = 16) -> list[tuple[CutStart, tuple[float, float]]]:
    """Return the starts of a contour at positions along it, each with its position on the path."""
    rules = rules_of()
    contours, _ = prepare_contours(sheet, rules)
    own = contours[number]
    along = [k * own.path.length / places for k in range(places)]
    made = edge_starts(number, own, Scrap(sheet, contours, rules), along)
    return [(start, own.path.point_at(start.at)) for start in made]


def test_every_lead_comes_straight_along_an_axis_from_the_air_beyond_the_edge_without_a_pierce() -> None:
    found = starts(sheet_of((square(60, 60, 80), 0, -1, 1), size=200))
    assert {tuple(np.sign(np.round(np.subtract(s.entry, at), 6)).tolist()) for s, at in found} == {
        *[(1.0, 0.0), (-1.0, 0.0)],
        *[(0.0, 1.0), (0.0, -1.0)],
    }
    sheet, part = shapely.box(0, 0, 200, 200), shapely.box(60, 60, 140, 140)
    for start, at in found:
        lead = shapely.LineString([start.entry, at])
        assert not start.pierce
        assert sheet.distance(shapely.Point(start.entry)) == pytest.approx(IN_THE_AIR + PLASMA.kerf / 2)
        assert lead.distance(part) >= PLASMA.kerf / 2 - 0.01
        assert start.lead_in.length == pytest.approx(lead.length)


def test_no_lead_goes_through_another_part() -> None:
    """The right side of the first square looks at the second one: from there nothing comes in."""
    found = starts(sheet_of((square(20, 60, 60), 0, -1, 1), (square(100, 40, 90), 0, -1, 2), size=200))
    assert found
    for start, at in found:
        assert not shapely.LineString([start.entry, at]).intersects(shapely.box(100, 40, 190, 130))
        assert start.entry[0] < 100


def test_where_nobody_says_how_large_the_sheet_is_that_is_asked_for() -> None:
    with pytest.raises(PlanError, match="--sheet-size"):
        starts(sheet_of((square(60, 60, 80), 0, -1, 1)))
