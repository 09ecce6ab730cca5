"""The start of a chain: its first position, with leads clear of its bridges; checked by shapely's distances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from cut_sheets import (
    FINE,
    PLASMA,
    assert_nothing_is_gouged,
    bridges_of,
    cutting_of,
    lead_in_of,
    lead_out_of,
    two_squares,
)
from leafcut.processes.sheet.plan.chains import Chain, chain_starts, find_bridges
from leafcut.processes.sheet.plan.cutting import Cutting
from leafcut.processes.sheet.plan.starts import CutStart

KERF = PLASMA.kerf


def chain_in(cutting: Cutting) -> Chain:
    """Return the chain of the first contour and the second, by the shortest bridge between them."""
    found = find_bridges(cutting.contours, [0, 1], cutting.scrap, 40.0)
    there = np.flatnonzero(found.contour[found.begin] == 0)
    best = there[np.argmin(found.length[there])]
    return found.step(cutting, int(found.begin[best])), found.step(cutting, int(found.end[best]))


def begun(cutting: Cutting, chain: Chain | None = None) -> list[CutStart]:
    return chain_starts(cutting, chain or chain_in(cutting), cutting.scrap)


def keeps_clear(lead: Any, bridge: Any) -> bool:
    """Return whether a lead, from its far end on, comes within a kerf of a bridge only to stay there."""
    points = [lead.interpolate(share, normalized=True) for share in np.linspace(0.0, 1.0, 200)]
    near = [point.distance(bridge) < KERF - 0.02 for point in points]
    return not near[0] and near == sorted(near)


def test_every_way_to_begin_a_chain_starts_at_its_first_place_and_has_all_its_contours() -> None:
    cutting = cutting_of(two_squares())
    chain = chain_in(cutting)
    starts = begun(cutting, chain)
    assert 1 <= len(starts) <= 4
    assert len(set(starts)) == len(starts)
    for start in starts:
        assert start.contours == (0, 1)
        assert (start.at, start.clockwise) == (pytest.approx(chain[0].at, abs=0.01), chain[0].clockwise)
        (other,) = start.then
        assert (other.contour, other.at, other.clockwise) == (1, chain[1].at, chain[1].clockwise)
        assert other.entry == chain[1].entry
        assert start.exit == other.exit


def test_the_leads_of_a_chain_keep_clear_of_its_bridge_and_of_the_parts() -> None:
    """The torch comes down a kerf away from the bridge, and goes out as far from it; nowhere is there another lead."""
    cutting = cutting_of(two_squares())
    for start in begun(cutting):
        cut = cutting.cut(start)
        (bridge,) = bridges_of(cut)
        lead_in, lead_out = lead_in_of(cut), lead_out_of(cut)
        assert lead_in is not None and lead_out is not None
        assert start.lead_out.style == "none" != start.then[-1].lead_out.style
        assert keeps_clear(shapely.LineString(lead_in.flattened(FINE)), bridge)
        assert keeps_clear(shapely.LineString(lead_out.flattened(FINE)[::-1]), bridge)
        assert_nothing_is_gouged(cutting.sheet, [cut], KERF)


def test_a_lead_out_that_would_run_along_the_bridge_is_left_out() -> None:
    """Perpendicular to the contour, like the arriving bridge: there is no room for it."""
    cutting = cutting_of(two_squares(), lead_out="line", overcut=0.0)
    chain = chain_in(cutting)
    assert abs(chain[0].exit[1] - chain[1].entry[1]) < 0.5
    for start in begun(cutting, chain):
        assert start.then[-1].lead_out.style == "none"
        assert start.exit == pytest.approx(start.then[-1].exit)
        assert shapely.Point(start.exit).distance(shapely.box(90, 20, 140, 70)) == pytest.approx(0.5 * KERF, abs=0.02)


def test_where_clamps_leave_room_for_the_bridge_alone_no_chain_begins() -> None:
    """The bridge is 20 mm long at y = 45 and runs between two clamps that leave 3 mm."""
    free = two_squares()
    clamped = replace(free, zones=((71.6, 15.0, 88.4, 43.5), (71.6, 46.5, 88.4, 75.0)))
    cutting = cutting_of(free)
    chain: Chain = ()
    for link, end in zip(chain_in(cutting), ((70.75, 45.0), (89.25, 45.0)), strict=True):
        at = float(shapely.line_locate_point(cutting.contours[link.contour].line, shapely.Point(end)))
        chain = (*chain, replace(link, at=at, entry=end, exit=end))
    assert begun(cutting, chain)
    assert begun(cutting_of(clamped), chain) == []


def test_a_start_that_a_plan_holds_is_kept_or_the_chain_does_not_begin() -> None:
    cutting = cutting_of(two_squares())
    fixed = replace(cutting, fixed={0: ("start",)})
    chain = chain_in(cutting)
    own = [cutting.starts[n] for n in cutting.starts_by_contour[0]]
    elsewhere = [s for s in own if abs(s.at - chain[0].at) > 1.0]
    assert begun(replace(fixed, starts=elsewhere), chain) == []
    for start in begun(fixed, chain):
        assert start.lead_in in [s.lead_in for s in own if abs(s.at - start.at) <= 0.01]


def test_without_leads_the_torch_comes_down_where_the_chain_begins() -> None:
    cutting = cutting_of(two_squares(), lead_in="none", lead_out="none")
    (start,) = begun(cutting)
    assert start.entry == pytest.approx(cutting.contours[0].path.point_at(start.at), abs=1e-6)
    assert start.lead_in.style == start.lead_out.style == start.then[-1].lead_out.style == "none"
    assert shapely.Point(start.entry).distance(shapely.box(20, 20, 70, 70)) == pytest.approx(0.5 * KERF, abs=0.01)
