"""Loops round sharp corners and micro-joints, by hand on a square."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest
import shapely

from cut_sheets import LASER, PLASMA, cutting_of, rules_of, sheet_of, square, two_squares
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.contours import prepare_contours
from leafcut.processes.sheet.plan.cutting import (
    chain_length,
    joint_spans,
    make_chain,
    make_cut,
    path_from_start,
    with_corner_loops,
    without_tiny_segments,
)
from leafcut.processes.sheet.plan.scrap import Scrap

SQUARE = sheet_of((square(50, 50, 100), 0, -1, 1), size=200)


def test_a_loop_crosses_itself_where_the_two_straight_cuts_meet_and_runs_in_the_scrap() -> None:
    rules = rules_of(corner_loops=True)
    contours, _ = prepare_contours(SQUARE, rules)
    (looped,) = with_corner_loops(contours, Scrap(SQUARE, contours, rules))
    assert len(looped.loops) == 4
    half, part = PLASMA.kerf / 2, shapely.box(50, 50, 150, 150)
    corners = [(50 - half, 50 - half), (150 + half, 50 - half), (150 + half, 150 + half), (50 - half, 150 + half)]
    met = []
    for low, high in looped.loops:
        line = shapely.LineString(looped.path.piece(low, high).flattened(0.001))
        assert line.distance(part) >= half - 0.01
        assert not line.is_simple
        met += [k for k, corner in enumerate(corners) if line.distance(shapely.Point(corner)) < 0.01]
        # On past the crossing by its length, round three quarters of a circle, and back.
        reach = rules.loop_length
        bow = 1.5 * math.pi * reach
        assert high - low == pytest.approx(2 * (half + reach) + bow, rel=0.01)
    assert sorted(met) == [0, 1, 2, 3]


def test_round_corners_blunt_ones_and_holes_get_no_loop_nor_corners_that_have_no_room() -> None:
    rules = rules_of(corner_loops=True)
    for sheet, loops in (
        (sheet_of((Polyline.circle(100, 100, 50), 0, -1, 1), size=200), 0),
        (sheet_of((square(20, 20, 160), 0, -1, 1), (square(60, 60, 80), 1, 0, 1), size=200), 4),
        (two_squares(4.0), 4),
    ):
        contours, _ = prepare_contours(sheet, rules)
        made = with_corner_loops(contours, Scrap(sheet, contours, rules))
        assert sum(len(c.loops) for c in made) == loops, sheet
        assert not any(c.loops for c in made if c.hole)


def test_joints_lie_evenly_keep_from_corners_and_are_as_long_as_asked_with_a_kerf() -> None:
    """Four joints of 0.4 mm on a square: one per side, none near a corner or the start of the cut."""
    cutting = cutting_of(SQUARE, LASER, micro_joints=4, joint_width="0.4")
    contour = cutting.contours[0]
    for start in cutting.starts[:6]:
        joints = joint_spans(contour, start, 0.0)
        assert len(joints) == 4
        assert all(high - low == pytest.approx(0.4 + LASER.kerf) for low, high in joints)
        body, _ = path_from_start(contour, start, overcut=False)
        places = [body.point_at(0.5 * (low + high)) for low, high in joints]
        for x, y in places:
            corner = min(math.dist((x, y), (cx, cy)) for cx in (50, 150) for cy in (50, 150))
            assert corner > 0.2 + LASER.kerf
        gaps = [b[0] - a[1] for a, b in itertools.pairwise(joints)]
        assert max(gaps) < 2.5 * min(gaps)


def test_a_cut_goes_once_round_and_its_overcut_further_in_its_own_direction() -> None:
    cutting = cutting_of(SQUARE, overcut="2", direction="free")
    contour = cutting.contours[0]
    ways = set()
    for start in cutting.starts:
        body, past = path_from_start(contour, start)
        bare, none = path_from_start(contour, start, overcut=False)
        assert (body.length, bare.length) == (
            pytest.approx(contour.path.length + 2),
            pytest.approx(contour.path.length),
        )
        assert (past, none) == (pytest.approx(2), pytest.approx(0))
        assert body.start == pytest.approx(contour.path.point_at(start.at), abs=1e-6)
        ring = shapely.LinearRing(bare.flattened(0.01)[:-1])
        assert ring.is_ccw != start.clockwise
        ways.add(start.clockwise)
    assert ways == {True, False}


def test_the_path_of_a_cut_is_its_leads_and_its_body_end_to_end() -> None:
    cutting = cutting_of(SQUARE, lead_in="line", lead_out="line")
    for start in cutting.starts[:8]:
        cut = make_cut(cutting.contours, start, {})
        assert cut.path.start == pytest.approx(start.entry, abs=1e-6)
        assert cut.lead_in == pytest.approx(start.lead_in.length)
        whole = start.lead_in.length + cutting.contours[0].path.length + start.lead_out.length
        assert cut.path.length == pytest.approx(whole + cutting.rules.overcut, abs=1e-3)


def test_pieces_that_only_rounding_made_are_left_out_and_the_ends_stay() -> None:
    path = Polyline.of_points([(0, 0), (1e-8, 0), (5, 0), (5, 1e-9), (5, 5)])
    assert len(without_tiny_segments(path).vertices) == 3
    assert (without_tiny_segments(path).end, without_tiny_segments(path).length) == ((5, 5), pytest.approx(10))
    whole = Polyline.of_points([(0, 0), (5, 5)])
    assert without_tiny_segments(whole) is whole


def test_a_chain_is_as_long_as_its_contours_with_the_bridges_between_them() -> None:
    cutting = cutting_of(two_squares(), lead_in="line", lead_out="line")
    one, other = (cutting.starts[numbers[0]] for numbers in cutting.starts_by_contour)
    chain = replace(one, then=(replace(other, pierce=False),))
    cut = make_chain(cutting.contours, chain, {})
    assert cut.contours == (0, 1)
    assert cut.path.length == pytest.approx(chain_length(cutting.contours, chain), abs=1e-3)
    ((low, high),) = cut.bridges
    places = [cutting.contours[s.contour].path.point_at(s.at) for s in (one, other)]
    assert high - low == pytest.approx(math.dist(*places))
    assert [cut.path.point_at(at) for at in (low, high)] == [pytest.approx(p, abs=1e-6) for p in places]
