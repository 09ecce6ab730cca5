"""Leads of two cuts never enter each other's kerf if one of the cuts can start elsewhere."""

from __future__ import annotations

import math
from dataclasses import replace

import shapely

from cut_sheets import (
    FINE,
    PLASMA,
    ROOM,
    chained,
    cutting_of,
    in_order,
    lead_in_of,
    lead_out_of,
    sheet_of,
    square,
    two_squares,
)
from leafcut.geometry.polyline import Polyline
from leafcut.model.problem import Metric
from leafcut.processes.sheet.plan.cutting import Cutting, HeadTravel
from leafcut.processes.sheet.plan.moved_starts import with_leads_apart
from leafcut.processes.sheet.plan.starts import CutStart


def leads(cutting: Cutting, start: CutStart) -> list[shapely.LineString]:
    cut = cutting.cut(start)
    return [shapely.LineString(p.flattened(FINE)) for p in (lead_in_of(cut), lead_out_of(cut)) if p is not None]


def apart(cutting: Cutting, one: CutStart, other: CutStart) -> float:
    return min(a.distance(b) for a in leads(cutting, one) for b in leads(cutting, other))


def crossing(cutting: Cutting) -> list[CutStart]:
    """The two starts in the gap between two squares whose leads are nearest."""
    both = [[cutting.starts[n] for n in own] for own in cutting.starts_by_contour]
    return list(min(((a, b) for a in both[0] for b in both[1]), key=lambda pair: apart(cutting, *pair)))


def test_one_of_two_cuts_whose_leads_cross_begins_elsewhere() -> None:
    cutting = cutting_of(two_squares(9.0))
    order = crossing(cutting)
    assert apart(cutting, *order) < PLASMA.kerf - ROOM
    moved = list(with_leads_apart(in_order(cutting, order), HeadTravel(Metric())).starts)
    assert [s.contour for s in moved] == [s.contour for s in order]
    assert sum(a is not b for a, b in zip(moved, order, strict=True)) == 1
    assert apart(cutting, *moved) >= PLASMA.kerf - ROOM


def test_a_start_that_a_plan_file_fixes_stays_and_the_other_one_moves() -> None:
    cutting = replace(cutting_of(two_squares(9.0)), fixed={1: ("start",)})
    order = crossing(cutting)
    moved = list(with_leads_apart(in_order(cutting, order), HeadTravel(Metric())).starts)
    assert moved[1] is order[1]
    assert moved[0] is not order[0]


def test_leads_that_are_apart_stay_where_they_are() -> None:
    cutting = cutting_of(two_squares(60.0))
    order = [cutting.starts[own[0]] for own in cutting.starts_by_contour]
    assert list(with_leads_apart(in_order(cutting, order), HeadTravel(Metric(), start=(0.0, 0.0))).starts) == order


def test_the_leads_of_a_chain_count_too() -> None:
    """A small part beside a chain's lead-in is begun on its other side."""
    pair = chained(cutting_of(two_squares()))
    x, y = pair.starts[0].entry
    corner = min(((0, 0), (70, 90), (135, 0), (0, 90)), key=lambda p: math.dist(p, (x, y)))
    sheet = sheet_of(
        (square(20, 20, 50), 0, -1, 1), (square(90, 20, 50), 0, -1, 2), (Polyline.circle(*corner, 6), 0, -1, 3)
    )
    cutting = chained(cutting_of(sheet))
    order = [cutting.starts[own[0]] for own in cutting.starts_by_contour if own]
    moved = list(with_leads_apart(in_order(cutting, order), HeadTravel(Metric())).starts)
    for k, s in enumerate(moved):
        for other in moved[k + 1 :]:
            assert apart(cutting, s, other) >= PLASMA.kerf - ROOM
