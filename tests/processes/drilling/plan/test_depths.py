"""How deep a tip goes: by the plate, by a given depth, and where that would break a tool or leave a plate open."""

from __future__ import annotations

import math

import pytest

from leafcut.errors import PlanError
from leafcut.model.tool import Tool, ToolKind
from leafcut.processes.drilling.plan.drilling import depth_rule, tap_lead_issue
from option_groups import drilling

#: A point of 90° on 6 mm is 3 mm long.
DRILL = Tool(1, 6.0, point_angle=math.radians(90))
TAP = Tool(2, 6.0, ToolKind.TAP, point_angle=math.pi, pitch=1.0)


def test_through_a_plate_the_whole_point_and_the_break_through_hang_below() -> None:
    rule = depth_rule(*drilling(thickness=10.0, break_through=0.5))
    assert rule.tip_depth(DRILL) == pytest.approx(10 + 0.5 + 3)
    assert rule.tip_depth(TAP) == pytest.approx(10 + 0.5)


def test_a_given_depth_is_the_tips_or_with_shoulder_the_full_diameters() -> None:
    assert depth_rule(*drilling(depth=4.0, depth_to="tip")).tip_depth(DRILL) == 4.0
    assert depth_rule(*drilling(depth=4.0, depth_to="shoulder")).tip_depth(DRILL) == pytest.approx(7.0)


def test_a_blind_hole_whose_tip_would_leave_the_plate_is_refused_and_one_that_just_does_not_is_drilled() -> None:
    rule = depth_rule(*drilling(thickness=10.0, depth=8.0, depth_to="shoulder"))
    with pytest.raises(PlanError, match="11 mm deep"):
        rule.tip_depth(DRILL)
    assert depth_rule(*drilling(thickness=11.0, depth=8.0, depth_to="shoulder")).tip_depth(DRILL) == 11.0


def test_a_hole_as_deep_as_its_plate_is_thick_is_no_blind_one() -> None:
    assert depth_rule(*drilling(thickness=8.0, depth=8.0, depth_to="shoulder")).tip_depth(DRILL) == pytest.approx(11)


def test_a_depth_below_the_plate_is_refused_with_both() -> None:
    with pytest.raises(PlanError, match="--depth 9 mm is more than --thickness 8 mm"):
        depth_rule(*drilling(thickness=8.0, depth=9.0))


def test_taps_and_reamers_stay_out_of_the_cone_of_the_drill_before_them() -> None:
    for kind in (ToolKind.TAP, ToolKind.REAMER):
        tool = Tool(3, 6.0, kind, point_angle=math.pi)
        with pytest.raises(PlanError, match="would break at the bottom"):
            depth_rule(*drilling(depth=4.0, depth_to="tip")).tip_depth(tool)
        assert depth_rule(*drilling(depth=4.0, depth_to="shoulder")).tip_depth(tool) == 4.0


def test_a_centre_drill_goes_as_deep_as_its_library_says_or_four_tenths_of_its_width_whatever_the_plate() -> None:
    rule = depth_rule(*drilling(thickness=10.0))
    assert rule.tip_depth(Tool(4, 5.0, ToolKind.CENTRE_DRILL)) == pytest.approx(2.0)
    assert rule.tip_depth(Tool(4, 5.0, ToolKind.CENTRE_DRILL, depth=1.2)) == 1.2


def test_a_thread_is_full_at_the_far_side_when_the_tap_breaks_through_by_five_pitches() -> None:
    short, enough = (depth_rule(*drilling(thickness=10.0, break_through=b)) for b in (4.9, 5.0))
    told = tap_lead_issue(TAP, short)
    assert told is not None and "5 mm long" in told.message
    assert tap_lead_issue(TAP, enough) is None
    assert tap_lead_issue(TAP, depth_rule(*drilling(depth=4.0, depth_to="shoulder"))) is None
    assert tap_lead_issue(DRILL, short) is None
