"""Leads: their shape, and that they keep to the scrap; checked with polygons that the planner does not use."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from cut_sheets import (
    FINE,
    LASER,
    PLASMA,
    all_cuts,
    assert_leads_in_scrap,
    assert_nothing_is_gouged,
    cutting_of,
    part_in_hole,
    ring,
    rules_of,
    runs_clockwise,
    sheet_of,
    square,
    two_squares,
)
from leafcut.errors import OptionError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Lead
from leafcut.processes.sheet.plan.cutting import prepare_cutting
from leafcut.processes.sheet.plan.leads import lead_path, lead_shape, lead_variants, place_leads
from leafcut.processes.sheet.plan.starts import start_with_same_leads


def test_a_quarter_arc_begins_its_radius_behind_and_beside_the_contour() -> None:
    """Radius 4, a quarter turn to a contour along +x with the scrap on its left: from (−4, 4), tangent at the end."""
    lead = Lead("arc", 4.0 * 0.5 * math.pi, 0.5 * math.pi)
    path = lead_path(lead, (0.0, 0.0), (1.0, 0.0), left=True)
    assert path is not None
    assert path.start == pytest.approx((-4.0, 4.0))
    assert path.length == pytest.approx(lead.length)
    assert path.direction_at(path.length - 1e-9) == pytest.approx((1.0, 0.0), abs=1e-6)
    assert path.direction_at(0.0) == pytest.approx((0.0, -1.0), abs=1e-6)


def test_a_lead_out_is_the_lead_in_seen_in_a_mirror() -> None:
    lead = Lead("line", 5.0, math.radians(60.0))
    out = lead_path(lead, (1.0, 2.0), (1.0, 0.0), left=False, out=True)
    assert out is not None
    assert out.start == pytest.approx((1.0, 2.0))
    assert out.end == pytest.approx((1.0 + 2.5, 2.0 - 5.0 * math.sin(math.radians(60.0))))


@pytest.mark.parametrize("style", ["line", "arc"])
@pytest.mark.parametrize("left", [True, False])
@pytest.mark.parametrize("out", [True, False])
def test_the_path_of_a_lead_runs_through_the_points_that_were_checked(style: str, left: bool, out: bool) -> None:
    lead, travel = Lead(style, 7.0, 1.2), (0.6, 0.8)
    path = lead_path(lead, (3.0, -2.0), travel, left, out)
    assert path is not None
    points = place_leads(lead_shape(lead), np.array([(3.0, -2.0)]), np.array([travel]), left, out)[0]
    assert points[0] == pytest.approx(path.start)
    assert points[-1] == pytest.approx(path.end)
    line = shapely.LineString(path.flattened(0.001))
    assert shapely.distance(shapely.points(points), line).max() < 0.002


def test_shorter_leads_come_before_other_angles_and_none_is_below_a_kerf() -> None:
    ways = lead_variants(Lead("arc", 6.0, 1.57), 1.5)
    assert ways[0] == Lead("arc", 6.0, 1.57)
    assert [w.style for w in ways[:3]] == ["arc"] * 3
    assert min(w.length for w in ways) >= 1.5


@pytest.mark.parametrize("sheet", [two_squares(), two_squares(4.0), ring(), part_in_hole()])
@pytest.mark.parametrize(
    "options", [{}, {"lead_in": "line", "lead_out": "line"}, {"direction": "free"}, {"corner_loops": True}]
)
def test_every_start_of_every_contour_keeps_to_the_scrap(sheet, options) -> None:
    cuts = all_cuts(cutting_of(sheet, **options))
    assert_nothing_is_gouged(sheet, cuts, PLASMA.kerf)
    assert_leads_in_scrap(sheet, cuts, PLASMA.kerf)


def test_plasma_cuts_outlines_clockwise_and_holes_counter_clockwise() -> None:
    """The swirl leaves the right side of travel square: outside an outline that is the part when it runs clockwise."""
    sheet = part_in_hole()
    for cut in all_cuts(cutting_of(sheet)):
        assert runs_clockwise(cut) != sheet.contours[cut.contours[0]].is_hole


def test_a_laser_cuts_either_way_round() -> None:
    cuts = all_cuts(cutting_of(two_squares(), LASER))
    assert {runs_clockwise(c) for c in cuts} == {True, False}


def test_the_cut_runs_half_a_kerf_beside_the_contour() -> None:
    """A circle of radius 60 is cut on 60.75, its hole of radius 30 on 29.25, with a kerf of 1.5 mm."""
    for cut in all_cuts(cutting_of(ring())):
        if cut.kind == "cut":
            body = cut.path.piece(cut.lead_in, cut.lead_out).flattened(FINE)
            radius = np.hypot(*(body - 100.0).T)
            wanted = 60.75 if cut.contours == (0,) else 29.25
            assert np.abs(radius - wanted).max() < 0.02


def test_without_compensation_the_cut_runs_on_the_contour() -> None:
    for cut in all_cuts(cutting_of(ring(), compensation="none")):
        if cut.kind == "cut":
            body = cut.path.piece(cut.lead_in, cut.lead_out).flattened(FINE)
            assert np.hypot(*(body - 100.0).T) == pytest.approx(60.0 if cut.contours == (0,) else 30.0, abs=0.01)


def test_a_small_hole_is_pierced_in_its_middle_slower_and_without_a_lead_out() -> None:
    sheet = sheet_of((square(0, 0, 100), 0, -1, 1), (Polyline.circle(50, 50, 8), 1, 0, 1))
    hole = [c for c in all_cuts(cutting_of(sheet)) if c.contours == (1,)]
    assert hole
    for cut in hole:
        assert cut.path.start == pytest.approx((50.0, 50.0), abs=1e-3)
        assert cut.lead_in == pytest.approx(8.0 - 0.75, abs=0.01)
        assert cut.small_hole
        assert cut.speeds == ((0.0, 0.6 * PLASMA.feed),)
        # 4 mm of overcut with the torch off, and nothing after it
        assert cut.path.length - cut.torch_off_at == pytest.approx(4.0)
        assert cut.torch_off_at == pytest.approx(cut.lead_out)


def test_a_controller_that_cannot_switch_while_moving_ends_the_hole_where_it_closes() -> None:
    sheet = sheet_of((square(0, 0, 100), 0, -1, 1), (Polyline.circle(50, 50, 8), 1, 0, 1))
    cutting = prepare_cutting(sheet, rules_of(switches=False))
    hole = next(c for c in all_cuts(cutting) if c.contours == (1,))
    assert hole.torch_off_at == hole.path.length
    assert hole.path.length - hole.lead_in == pytest.approx(2 * math.pi * 7.25, rel=1e-3)


def test_leads_get_shorter_where_the_neighbour_is_near() -> None:
    """4 mm between two squares is no room for an arc of 6 mm; elsewhere there is."""
    sheet = two_squares(4.0)
    between = [c for c in all_cuts(cutting_of(sheet)) if 70 < c.path.start[0] < 74]
    assert all(c.lead_in < 24.0 for c in between)
    assert_leads_in_scrap(sheet, between, PLASMA.kerf)


@pytest.mark.parametrize(
    ("compensation", "message"),
    [
        ("geometry", r"no lead fits .*part 1: hole at \(72\.4, 50\).*--lead-in none"),
        pytest.param("controller", r"no lead fits .*--compensation geometry", marks=pytest.mark.slow),
    ],
)
def test_a_contour_without_room_for_any_lead_is_named(compensation: str, message: str) -> None:
    """No lead fits between a part and the ring around it."""
    sheet = sheet_of(
        (Polyline.circle(50, 50, 40), 0, -1, 1), (Polyline.circle(50, 50, 22.4), 1, 0, 1),
        (Polyline.circle(50, 50, 20), 2, 1, 2),
    )  # fmt: skip
    with pytest.raises(PlanError, match=message):
        cutting_of(sheet, compensation=compensation)


def test_a_kerf_that_would_cut_into_the_neighbour_is_refused_with_both_names() -> None:
    with pytest.raises(PlanError, match=r"part 1.* nearer to part 2 than the kerf of 1\.5 mm"):
        cutting_of(two_squares(1.0))


def test_two_parts_one_kerf_apart_may_be_cut() -> None:
    assert cutting_of(two_squares(1.5)).starts


def test_a_part_under_a_clamp_is_refused() -> None:
    sheet = replace(two_squares(), zones=((60.0, 60.0, 80.0, 80.0),))
    with pytest.raises(PlanError, match="keep-out zone 60 60 80 80"):
        cutting_of(sheet)


def test_leads_keep_off_clamps_and_off_the_sheets_edge() -> None:
    sheet = sheet_of((square(8, 8, 60), 0, -1, 1), size=76, zones=[(70, 20, 76, 40)])
    cuts = all_cuts(cutting_of(sheet))
    assert_nothing_is_gouged(sheet, cuts, PLASMA.kerf)
    assert_leads_in_scrap(sheet, cuts, PLASMA.kerf)
    near_the_clamp = [c.path.start for c in cuts if 20 < c.path.start[1] < 40]
    assert max((x for x, _ in near_the_clamp), default=0.0) < 70


@pytest.mark.parametrize("radius", [0.7, 0.76, 1.0, 1.45])
@pytest.mark.parametrize("lead_in", ["auto", "none"])
def test_a_hole_narrower_than_two_kerfs_is_reported_and_not_cut(radius, lead_in) -> None:
    """A pierce is a kerf wide and half a kerf away from the path, which is half a kerf beside the part."""
    sheet = sheet_of((square(0, 0, 50), 0, -1, 1), (Polyline.circle(25, 25, radius), 1, 0, 1))
    cutting = cutting_of(sheet, lead_in=lead_in)
    assert [c.index for c in cutting.contours] == [0]
    assert [i.code for i in cutting.issues].count("L611") == 1


def test_holes_of_which_the_same_is_told_are_told_in_one_line_with_the_first_places() -> None:
    """Five holes too narrow for the kerf of 1.5 mm; four below 9 mm, 1.5 times the thickness, which will be tapered."""
    holes = [(Polyline.circle(20 + 20 * k, 20, 1.0), 1, 0, 1) for k in range(5)]
    holes += [(Polyline.circle(20 + 20 * k, 60, 4.0 + 0.1 * k), 1, 0, 1) for k in range(4)]
    issues = {
        i.code: i for i in cutting_of(sheet_of((square(0, 0, 150), 0, -1, 1), *holes)).issues if "hole" in i.message
    }
    assert issues["L611"].message.startswith("5 holes are not cut, because they are narrower than two kerfs of 1.5 mm")
    assert issues["L611"].place == "contour 2 at (21, 20); contour 3 at (41, 20); contour 4 at (61, 20) …"
    assert issues["L615"].message == "4 holes smaller than 9 mm, which is 1.5 times the thickness, will be tapered"


def test_a_hole_wider_than_two_kerfs_is_cut_and_a_neck_in_one_is_told() -> None:
    sheet = sheet_of((square(0, 0, 50), 0, -1, 1), (Polyline.circle(25, 25, 1.6), 1, 0, 1))
    assert len(cutting_of(sheet).contours) == 2
    dumb_bell = Polyline.of_points(
        [(5, 5), (20, 5), (20, 24.5), (30, 24.5), (30, 5), (45, 5), (45, 45), (30, 45), (30, 25.5), (20, 25.5),
         (20, 45), (5, 45)], closed=True,
    )  # fmt: skip
    issues = cutting_of(sheet_of((square(0, 0, 50), 0, -1, 1), (dumb_bell, 1, 0, 1))).issues
    assert "a neck narrower than the kerf" in next(i.message for i in issues if i.code == "L611")


def test_a_part_with_a_mouth_narrower_than_the_kerf_is_cut_round_and_the_mouth_reported() -> None:
    """A C with a mouth of 1 mm: its hole and the outside are cut; 20 × 20 mm and the mouth of 10 × 1 mm stay."""
    c = Polyline.of_points(
        [(0, 0), (40, 0), (40, 19.5), (30, 19.5), (30, 10), (10, 10), (10, 30), (30, 30), (30, 20.5), (40, 20.5),
         (40, 40), (0, 40)], closed=True,
    )  # fmt: skip
    sheet = sheet_of((c, 0, -1, 1), (Polyline.circle(5, 5, 2), 1, 0, 1), (square(60, 0, 20), 0, -1, 2))
    cutting = cutting_of(sheet)
    assert [c.index for c in cutting.contours] == [0, 1, 2]
    assert cutting.contours[0].path.extents == pytest.approx((-0.75, -0.75, 40.75, 40.75), abs=0.02)
    (issue,) = (i for i in cutting.issues if i.code == "L612")
    assert "a notch of part 1 has a mouth narrower than the kerf of 1.5 mm, so 410 mm²" in issue.message
    assert issue.missing is not None
    assert (issue.missing.what, issue.missing.count) == ("place", 1)
    assert abs(issue.missing.outlines[0].area) == pytest.approx(18.5**2, rel=0.01)


def test_a_slot_narrower_than_the_kerf_is_told_with_its_place() -> None:
    slot = Polyline.of_points([(0, 0), (50, 0), (50, 40), (26, 40), (26, 20), (25, 20), (25, 40), (0, 40)], closed=True)
    issue = next(i for i in cutting_of(sheet_of((slot, 0, -1, 1))).issues if i.code == "L612")
    assert "20)" in issue.place


def test_loops_go_round_every_corner_that_has_room() -> None:
    """3 mm on from where the cuts cross, 0.75·√2 from the corner, and round with radius 3: √2·(0.75 + 3) + 3 away."""
    cuts = all_cuts(cutting_of(two_squares(), corner_loops=True))
    assert {len(c.loops) for c in cuts} == {4}
    for cut in cuts:
        for low, high in cut.loops:
            x, y = cut.path.point_at(0.5 * (low + high))
            away = min(math.dist((x, y), corner) for corner in corners(cut))
            assert away == pytest.approx(math.sqrt(2.0) * 3.75 + 3.0, abs=0.01)


def corners(cut) -> list[tuple[float, float]]:
    x = 20.0 if cut.contours == (0,) else 90.0
    return [(x, 20.0), (x + 50, 20.0), (x, 70.0), (x + 50, 70.0)]


def test_loops_of_two_parts_do_not_touch() -> None:
    sheet = two_squares(8.0)
    cuts = all_cuts(cutting_of(sheet, corner_loops=True))
    loops = {
        (c.contours[0], round(low, 2)): shapely.LineString(c.path.piece(low, high).flattened(FINE))
        for c in (next(c for c in cuts if c.contours == (k,)) for k in (0, 1))
        for low, high in c.loops
    }
    lines = list(loops.values())
    assert len(lines) > 4
    for k, a in enumerate(lines):
        assert all(a.distance(b) >= PLASMA.kerf - 0.04 for b in lines[k + 1 :])


def test_a_laser_leaves_joints_evenly_and_a_plasma_cut_one_at_its_end() -> None:
    laser = next(iter(all_cuts(cutting_of(two_squares(), LASER, micro_joints=3, joint_width="0.4"))))
    assert len(laser.joints) == 3
    assert all(high - low == pytest.approx(0.4 + 0.2) for low, high in laser.joints)
    plasma = next(iter(all_cuts(cutting_of(two_squares(), micro_joints=1, joint_width="0.5"))))
    ends = plasma.path.point_at(plasma.lead_in), plasma.path.end
    assert math.dist(*ends) == pytest.approx(0.5 + 1.5, abs=0.02)
    with pytest.raises(OptionError, match="micro-joints"):
        rules_of(micro_joints=2)


def test_the_joint_at_the_end_of_a_cut_is_never_in_a_loop_round_a_corner() -> None:
    """Otherwise the corner's arc would stay, too: the uncut part ends on the square grown by half a kerf."""
    leads = {"lead_in": "none", "lead_out": "none"}
    cutting = cutting_of(two_squares(), micro_joints=1, joint_width="2", corner_loops=True, **leads)
    moved = [
        start_with_same_leads(cutting.contours[s.contour], cutting.scrap, s, float(at))
        for s in cutting.starts[:1]
        for at in range(300)
    ]
    starts = [s for s in (*cutting.starts, *moved) if s is not None]
    assert len(starts) > 100
    grown = [shapely.box(x, 20, x + 50, 70).buffer(0.75).exterior for x in (20, 90)]
    for start in starts:
        cut = cutting.cut(start)
        ends = cut.path.point_at(cut.lead_in), cut.path.end
        assert all(min(edge.distance(shapely.Point(p)) for edge in grown) < 0.01 for p in ends)


def test_no_lead_is_not_a_lead_without_room() -> None:
    assert not [i for i in cutting_of(part_in_hole(), lead_in="none", lead_out="none").issues if i.code == "L613"]


@pytest.mark.parametrize("loops", [False, True])
def test_no_joint_lies_in_a_corner_or_where_the_cut_begins(loops: bool) -> None:
    """Four joints of a square that is begun in the middle of a side would lie in its corners."""
    sheet, many = two_squares(), 0
    corners = [(x, y) for left in (20, 90) for x in (left, left + 50) for y in (20, 70)]
    for cut in all_cuts(cutting_of(sheet, LASER, micro_joints=4, joint_width="0.4", corner_loops=loops)):
        assert len(cut.joints) == 4
        many += 1
        places = [cut.path.point_at(at) for low, high in cut.joints for at in (low, high)]
        begin = cut.path.point_at(cut.lead_in)
        assert all(math.dist(p, q) > 0.15 for p in places for q in (*corners, begin))
        assert all(a[1] < b[0] for a, b in itertools.pairwise(sorted(cut.joints)))
        assert not any(low < at < high for low, high in cut.loops for span in cut.joints for at in span)
    assert many > 8


def test_holes_have_no_joints() -> None:
    """A plasma hole keeps its overcut."""
    sheet = part_in_hole()
    for data, joints in ((LASER, 3), (PLASMA, 1)):
        cuts = all_cuts(cutting_of(sheet, data, micro_joints=joints, joint_width="0.4"))
        hole = next(c for c in cuts if c.contours == (1,))
        assert not hole.joints
        if data is PLASMA:
            assert hole.torch_off_at < hole.path.length


def test_above_the_pierce_capacity_outlines_start_beyond_the_sheets_edge() -> None:
    thick = replace(PLASMA, thickness=20.0, can_pierce=False)
    sheet = sheet_of((square(20, 20, 60), 0, -1, 1), size=100)
    cuts = all_cuts(cutting_of(sheet, thick))
    assert cuts
    for cut in cuts:
        x, y = cut.path.start
        assert not (-0.75 <= x <= 100.75 and -0.75 <= y <= 100.75)
        assert not cut.pierce
    assert_nothing_is_gouged(sheet, cuts, PLASMA.kerf)


def test_a_hole_cannot_start_at_the_edge_and_is_named() -> None:
    thick = replace(PLASMA, thickness=20.0, can_pierce=False)
    sheet = sheet_of((square(20, 20, 60), 0, -1, 1), (Polyline.circle(50, 50, 20), 1, 0, 1), size=100)
    with pytest.raises(PlanError, match="drill a hole there first"):
        cutting_of(sheet, thick)
    with pytest.raises(PlanError, match="--sheet-size"):
        cutting_of(two_squares(), thick)


def test_a_part_at_the_edge_of_the_sheet_is_refused_before_its_kerf_runs_off() -> None:
    """The middle of a kerf of 1.5 mm is 0.75 mm beyond the part."""
    with pytest.raises(PlanError, match=r"part 1: outline at \(0.7, 50\) lies so near the edge of the sheet"):
        cutting_of(sheet_of((square(0.7, 50, 50), 0, -1, 1), size=200))
    cutting_of(sheet_of((square(0.8, 50, 50), 0, -1, 1), size=200))


def test_a_hole_barely_wider_than_two_kerfs_of_a_laser_is_begun_in_its_middle() -> None:
    sheet = sheet_of((square(0, 0, 50), 0, -1, 1), (Polyline.circle(25, 25, 0.22), 1, 0, 1))
    cutting = cutting_of(sheet, LASER)
    hole = next(c for c in all_cuts(cutting) if c.contours == (1,))
    assert hole.path.start == pytest.approx((25.0, 25.0), abs=1e-3)


@pytest.mark.parametrize("off, free", [(0.0, True), (0.015, True), (0.026, False)])
def test_no_lead_is_taken_that_the_proof_would_refuse(off: float, free: bool) -> None:
    """The proof accepts a kerf up to 0.025 mm too near to a part; the edge is at x = 70, the kerf 1.5 mm wide."""
    sheet = two_squares()
    cutting = cutting_of(sheet)
    x = 70.0 + 0.75 - off
    line = shapely.LineString([(x, 35.0), (x, 55.0)])
    assert cutting.scrap.allowed_mask([line], cutting.contours[0])[0] == free


def test_an_open_cut_is_not_pierced_above_the_pierce_capacity() -> None:
    thick = replace(PLASMA, thickness=20.0, pierce_delay=0.0, can_pierce=False)
    sheet = sheet_of((square(20, 20, 60), 0, -1, 1), (Polyline.of_points([(100, 30), (100, 60)]), 0, -1, 0), size=150)
    with pytest.raises(PlanError, match=r"no cut from there reaches cut at \(100, 30\)"):
        cutting_of(sheet, thick)


def test_cuts_start_at_the_edge_above_the_pierce_capacity_unless_a_pierce_delay_is_given() -> None:
    thick = replace(PLASMA, thickness=20.0, pierce_delay=0.0, can_pierce=False)
    assert rules_of(thick).edge_start
    assert not rules_of(replace(thick, pierce_delay=2.0, can_pierce=True)).edge_start
