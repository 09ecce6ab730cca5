"""Holes become operations: the right tools, in the right order, at the right depth."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from leafcut.errors import OptionError, PlanError
from leafcut.model.issue import LIMITS, Severity
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.mesh import Mesh
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.problem import Metric
from leafcut.model.tool import BodySegment, Recipe, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import Kind
from leafcut.processes.drilling.plan.drill_toolpath import build_problem, drawing_order, generate_toolpath
from leafcut.processes.drilling.plan.drilling import plan_drilling
from leafcut.processes.zones import crossing_heights, parse_zones
from meshes import box_triangles
from option_groups import drilling

MILL = Machine(
    name="test mill",
    description="",
    controller="linuxcnc",
    rapid_velocity=(100.0, 100.0, 50.0),
    acceleration=(500.0, 500.0, 300.0),
    max_feed=50.0,
    travel_min=(0.0, 0.0, -100.0),
    travel_max=(500.0, 500.0, 0.0),
    spindle_max_rpm=6000.0,
)
CENTRE = Tool(1, 3.15, ToolKind.CENTRE_DRILL, feed=1.0, spindle_rpm=3000, depth=1.5)
DRILL5 = Tool(5, 5.0, feed=2.0, spindle_rpm=2000, flute_length=30.0)
DRILL8 = Tool(8, 8.0, feed=2.0, spindle_rpm=1200)
TAP6 = Tool(16, 6.0, ToolKind.TAP, feed=500 / 60, spindle_rpm=500, pitch=1.0, point_angle=math.pi)
LIBRARY = ToolLibrary((TAP6, DRILL8, CENTRE, DRILL5), (Recipe(6.0, (1, 5, 16), "TAP*"),), "shop.toml")
FOUR = Part("four holes", tuple(Hole(x, y, 5.0) for x, y in ((0, 0), (30, 0), (30, 20), (0, 20))))


def plan(part: Part = FOUR, library: ToolLibrary | None = LIBRARY, **options: object) -> object:
    """Return the plan of a part on the test mill."""
    return plan_drilling(part, MILL, library, *drilling(**{"thickness": 10.0, **options}))


def test_a_drill_goes_through_with_its_full_diameter() -> None:
    """10 mm plate + 0.5 mm break-through + the point of a 118° drill of 5 mm: 2.5 / tan 59° = 1.502 mm."""
    cycle = plan().operations[0].cycle
    assert cycle.bottom == pytest.approx(-(10 + 0.5 + 2.5 / math.tan(math.radians(59))))
    assert cycle.name == "G81"


@pytest.mark.parametrize("depth_to, tip", [("tip", 4.0), ("shoulder", 4.0 + 2.5 / math.tan(math.radians(59)))])
def test_a_blind_hole_is_deep_to_the_tip_or_to_the_shoulder(depth_to: str, tip: float) -> None:
    blind = plan(thickness=None, depth=4.0, depth_to=depth_to)
    assert blind.operations[0].cycle.bottom == pytest.approx(-tip)


def test_holes_without_a_depth_are_refused_unless_the_drawing_gives_it() -> None:
    for part in (FOUR, Part("slot", (), (Slot((5.0, 1.0), (9.0, 1.0), 2.0),))):
        with pytest.raises(
            OptionError, match=f"^{part.name}: drilling needs a depth; give --thickness 6mm .*--depth 5mm"
        ):
            plan(part, None, thickness=None)
        assert plan(part, None, thickness=None, depth=1.0, depth_to="tip").operations[0].cycle.bottom == -1.0
    solid = Mesh(box_triangles(0, 0, -20, 80, 40, 0), "solid")
    own = Part("own", (Hole(30, 20, 10.0, depth=5.0),))
    bottoms = plan_drilling(own, MILL, None, *drilling(), solid).operations[0].cycle.bottom
    assert bottoms == pytest.approx(-5.0 - 5.0 / math.tan(math.radians(59)))


def test_a_depth_below_the_plate_is_refused() -> None:
    with pytest.raises(PlanError, match="more than --thickness"):
        plan(depth=12.0)


def test_a_recipe_makes_its_hole_in_its_order_and_each_tool_is_taken_up_once() -> None:
    part = Part("tapped", (Hole(0, 0, 6.0, "tap_m6"), Hole(9, 0, 5.0), Hole(20, 0, 6.0, "TAP"), Hole(30, 0, 8.0)))
    made = plan(part)
    assert [(o.tool.number, o.targets.tolist()) for o in made.operations] == [
        (1, [0, 2]),
        (5, [0, 1, 2]),
        (8, [3]),
        (16, [0, 2]),
    ]
    assert [o.cycle.name for o in made.operations] == ["G81", "G81", "G81", "G84"]
    assert made.operations[0].cycle.bottom == -1.5


def test_recipes_that_contradict_each_other_are_refused() -> None:
    recipes = (Recipe(5.0, (5, 8)), Recipe(8.0, (8, 5)))
    with pytest.raises(PlanError, match="contradict"):
        plan(Part("x", (Hole(0, 0, 5.0), Hole(9, 0, 8.0))), ToolLibrary((DRILL5, DRILL8), recipes))


def test_centre_drilling_comes_first_when_asked_for() -> None:
    assert [o.tool.number for o in plan(centre_drill=True).operations] == [1, 5]
    with pytest.raises(PlanError, match="centre drill"):
        plan(library=ToolLibrary((DRILL5,)), centre_drill=True)


def test_a_hole_without_a_tool_names_the_nearest() -> None:
    with pytest.raises(PlanError, match=r"no drill of 7 mm .* at \(1, 2\) .*nearest drill has 8 mm"):
        plan(Part("x", (Hole(1, 2, 7.0),)))


def test_a_hole_deeper_than_its_tool_is_refused() -> None:
    with pytest.raises(
        PlanError, match=r"cuts 30 mm deep at most, but the hole requires 32 mm.* for --thickness 30 mm; use"
    ):
        plan(thickness=30.0)
    with pytest.raises(PlanError, match=r"the hole requires 32\.5 mm for --depth 31 mm; use a longer tool$"):
        plan(thickness=None, depth=31.0)


def test_a_tool_too_fast_for_the_spindle_or_the_feed_is_refused() -> None:
    for wrong, words in (
        (replace(DRILL5, spindle_rpm=9000), "turns 0 to 6000 rpm"),
        (replace(DRILL5, feed=60.0), "at most"),
    ):
        with pytest.raises(PlanError, match=words):
            plan(library=ToolLibrary((wrong,)))


def test_assumed_tools_keep_to_careful_cutting_data() -> None:
    """A 10 mm drill at 20 m/min turns 20000 / (π·10) = 637 rpm and feeds 0.02·10 mm a revolution."""
    tool = plan(Part("x", (Hole(0, 0, 10.0),)), None).operations[0].tool
    assert tool.assumed
    assert tool.spindle_rpm == 637
    assert tool.feed * 60 == pytest.approx(0.2 * 637, abs=0.1)


def test_assumed_tools_are_one_per_diameter_and_listed() -> None:
    part = Part("x", (Hole(0, 0, 3.0), Hole(5, 0, 2.0), Hole(9, 0, 3.0)), (Slot((0, 0), (5, 0), 2.0),))
    made = plan(part, None)
    assert [(o.tool.diameter, o.tool.kind, len(o.targets)) for o in made.operations] == [
        (2.0, ToolKind.DRILL, 1),
        (3.0, ToolKind.DRILL, 2),
        (2.0, ToolKind.SLOT_MILL, 1),
    ]
    assert [i.code for i in made.issues] == ["L401"] * 3
    for operation, issue in zip(made.operations, made.issues, strict=True):  # to the three decimals of a program
        assert f"{round(operation.tool.feed * 60, 3):g} mm/min" in issue.message


def test_cycles_need_their_words() -> None:
    for cycle, words in (("G83", "--peck"), ("G82", "--dwell"), ("G84", "not a tap")):
        with pytest.raises(PlanError, match=words):
            plan(cycle=cycle)
    assert plan(peck=2.0).operations[0].cycle.name == "G83"
    assert plan(dwell=0.5).operations[0].cycle.name == "G82"


def test_a_part_without_holes_is_refused() -> None:
    with pytest.raises(PlanError, match="no hole"):
        plan(Part("empty"))


def test_the_r_plane_above_the_initial_plane_is_refused() -> None:
    with pytest.raises(PlanError, match="--retract-height"):
        plan(retract_height=20.0)


def test_zones_are_four_numbers_in_any_corner_order_and_may_have_a_height() -> None:
    assert parse_zones(("10 20 0 5",)).tolist() == [[0.0, 5.0, 10.0, 20.0]]
    assert parse_zones(("0 0 1/2in 2in 1in",)).tolist() == [[0.0, 0.0, 12.7, 50.8]]
    assert crossing_heights(("0 0 1 1", "0 0 1 1 1in"), 10.0).tolist() == [10.0, 26.4]
    for wrong in ("1 2 3", "a b c d", "0 0 nan 1", "0 0 1 1 2 3", "0 0 1 1 inf"):
        with pytest.raises(OptionError, match="--keep-out"):
            parse_zones((wrong,))


def laid(made: object, machine: Machine = MILL, orders: list[np.ndarray] | None = None) -> list[tuple]:
    """Return (kind, end) of every row of the laid toolpath."""
    path = generate_toolpath(made, machine, orders or [drawing_order(o) for o in made.operations])
    return [(m.kind, m.end) for m in path]


def test_every_hole_is_drilled_once_in_the_order_given() -> None:
    rows = laid(plan(), orders=[np.array([2, 0, 3, 1], dtype=np.int32)])
    assert [end[:2] for kind, end in rows if kind is Kind.DRILL] == [(30, 20), (0, 0), (0, 20), (30, 0)]


def test_z_is_safe_before_x_and_y_move_and_after_every_tool_change() -> None:
    part = Part("two tools", (Hole(0, 0, 5.0), Hole(9, 0, 8.0)))
    for machine in (MILL, replace(MILL, safe_z=0.0)):
        rows = laid(plan(part), machine)
        for number, (kind, _) in enumerate(rows):
            if kind is Kind.TOOL:
                after = next(e for k, e in rows[number:] if k <= Kind.DRILL)
                if machine.safe_z is None:
                    assert after[2] == 10.0
                else:
                    before = next(k for k, _ in reversed(rows[:number]) if k in (Kind.RAPID, Kind.MACHINE))
                    assert before is Kind.MACHINE
        first = next((k, e) for k, e in rows if k in (Kind.RAPID, Kind.MACHINE))
        assert first[0] is (Kind.RAPID if machine.safe_z is None else Kind.MACHINE)
        assert all(math.isnan(v) for v in first[1][:2])


def test_moves_over_a_keep_out_zone_are_made_at_the_initial_plane() -> None:
    """From (30, 0) to (30, 20) over a clamp at y 5 … 15: up to 10 mm, across, and down again."""
    rows = laid(plan(keep_out=("20 5 40 15",)))
    drills = [k for k, (kind, _) in enumerate(rows) if kind is Kind.DRILL]
    between = rows[drills[1] + 1 : drills[2]]
    assert [(kind, end) for kind, end in between] == [(Kind.RAPID, (30, 0, 10.0)), (Kind.RAPID, (30, 20, 10.0))]
    assert drills[1] == drills[0] + 1


def test_retract_to_the_initial_plane_is_g98_everywhere() -> None:
    rows = laid(plan(retract="initial"))
    assert {end[2] for kind, end in rows if kind is Kind.DRILL} == {10.0}


SLOTTED = Part("slots", slots=(Slot((0, 0), (10, 0), 2.0), Slot((20, 0), (12, 0), 2.0)))


def test_a_slot_is_a_cluster_of_its_two_ways() -> None:
    made = plan(SLOTTED, None)
    problem = build_problem(made, made.operations[0], Metric(), None, None)
    assert problem.cluster.tolist() == [0, 0, 1, 1]
    assert problem.entry.tolist() == [[0, 0], [10, 0], [20, 0], [12, 0]]
    assert problem.exit.tolist() == [[10, 0], [0, 0], [12, 0], [20, 0]]


def test_slots_are_cut_to_and_fro_one_diameter_at_a_time() -> None:
    made = plan(SLOTTED, None)
    path = generate_toolpath(made, MILL, [np.array([0, 3], dtype=np.int32)])
    feeds = [m.end for m in path if m.kind is Kind.FEED]
    depths = [-10.5 * k / 7 for k in range(1, 7)] + [-10.5]  # 10.5 mm in passes of at most 2 mm, an odd number
    to_and_fro = [10, 0, 10, 0, 10, 0, 10]
    assert feeds[0:14:2] == [(x, 0, z) for x, z in zip([0, *to_and_fro], depths, strict=False)]
    assert feeds[1:14:2] == [(x, 0, z) for x, z in zip(to_and_fro, depths, strict=True)]
    assert feeds[-1] == (20, 0, -10.5)
    assert len(feeds) == 28


def test_inch_and_millimetre_parts_give_the_solver_the_same_numbers() -> None:
    inches = np.random.default_rng(1).uniform(0, 12, (50, 2)).round(4)
    one = Part("in", tuple(Hole(x * 25.4, y * 25.4, 6.35) for x, y in inches))
    other = Part("mm", tuple(Hole(round(x * 25.4, 7), round(y * 25.4, 7), 6.35) for x, y in inches))
    problems = []
    for part in (one, other):
        made = plan(part, None)
        problems.append(build_problem(made, made.operations[0], Metric(), None, None))
    assert np.array_equal(problems[0].entry, problems[1].entry)


def test_a_tap_or_reamer_never_meets_the_cone_that_a_drill_leaves() -> None:
    """A 5 mm drill whose tip is 8 mm deep leaves its full diameter to 6.5 mm only: a tap to 8 mm would break."""
    tapped = Part("tapped", (Hole(0, 0, 6.0, "TAP"),))
    with pytest.raises(PlanError, match="would break at the bottom"):
        plan(tapped, thickness=None, depth=8.0, depth_to="tip")
    drill, tap = plan(tapped, thickness=None, depth=8.0).operations[1:]
    assert -tap.cycle.bottom <= -drill.cycle.bottom - drill.tool.point_length + 1e-9


def test_a_thread_that_is_not_full_at_the_exit_is_said() -> None:
    """M6 × 1: the lead may be 5 mm long, so 0.5 mm of break-through is short and 5 mm is not."""
    part = Part("tapped", (Hole(0, 0, 6.0, "TAP"),))
    assert [i.code for i in plan(part).issues] == ["L402"]
    assert [i.code for i in plan(part, break_through=5.0).issues] == ["L404"]  # the drill before it comes out far


def test_the_tool_is_changed_at_its_own_height_where_the_machine_has_none() -> None:
    """Two tools on a machine without a safe height: up to 25 mm before the second, at the clearance height after it."""
    rows = laid(plan(Part("two tools", (Hole(0, 0, 5.0), Hole(9, 0, 8.0)))))
    change = [k for k, (kind, _) in enumerate(rows) if kind is Kind.TOOL][1]
    heights = [end[2] for kind, end in rows[:change] if kind is Kind.RAPID]
    assert heights[-1] == 25.0
    assert next(end[2] for kind, end in rows[change:] if kind is Kind.RAPID) == 10.0


def test_a_through_hole_is_tapped_as_far_as_it_is_drilled_to_full_diameter() -> None:
    """Not deeper: what lies below the plate is not known, and a tap that meets the table breaks."""
    drill, tap = plan(Part("tapped", (Hole(0, 0, 6.0, "TAP"),))).operations[1:]
    assert tap.cycle.bottom == pytest.approx(drill.cycle.bottom + drill.tool.point_length)


def test_a_blind_hole_stays_blind() -> None:
    """9 mm deep to the shoulder in 10 mm: the point of a 5 mm drill, 1.5 mm long, would come out below."""
    with pytest.raises(PlanError, match=r"is blind, but the tip of T5 drill Ø5 would go 10.5 mm deep"):
        plan(depth=9.0)
    assert plan(depth=9.0, depth_to="tip").operations[0].cycle.bottom == -9.0
    assert plan(depth=8.0).operations[0].cycle.bottom > -10.0


def test_a_hole_or_slot_in_a_keep_out_zone_is_refused_with_the_radius_of_its_tool() -> None:
    """The hole at (30, 20) is 2 mm from a clamp that starts at x 32; its drill has a radius of 2.5 mm."""
    with pytest.raises(
        PlanError, match=r"the hole at \(30, 20\) is in a keep-out zone, or closer to it than the radius of"
    ):
        plan(keep_out=("32 15 50 40",))
    plan(keep_out=("32.6 15 50 40",))
    with pytest.raises(
        PlanError, match=r"the slot at \(0, 0\) is in a keep-out zone, or closer to it than the radius of"
    ):
        plan(SLOTTED, None, keep_out=("4 0.9 6 5",))


def test_the_tool_keeps_its_radius_away_from_a_zone_that_its_centre_passes_by() -> None:
    """From (30, 0) to (30, 20), 2 mm beside a clamp: the 5 mm drill would touch it, so the move is lifted."""
    assert lifts(keep_out=("32 8 50 12",)) == [False, True, False]
    assert lifts(keep_out=("32.6 8 50 12",)) == [False, False, False]


def test_a_zone_is_crossed_a_millimetre_above_its_height() -> None:
    """Rapids at the R plane, 2 mm, cross a clamp of 1 mm; a clamp above the clearance height is refused."""
    assert lifts(keep_out=("20 5 40 15 1",)) == [False, False, False]
    assert lifts(keep_out=("20 5 40 15 1.1",)) == [False, True, False]
    with pytest.raises(
        PlanError, match=r"the hole at \(30, 20\) is in a keep-out zone, or closer to it than the radius of"
    ):
        plan(keep_out=("32 15 50 40 1",))
    with pytest.raises(OptionError, match=r"is 9.5 mm high, but rapids cross it at Z10; use --clearance-height 10.5"):
        plan(keep_out=("20 5 40 15 9.5",))
    rows = laid(plan(keep_out=("20 5 40 15 9.5",), clearance_height=10.5))
    assert (Kind.RAPID, (30, 20, 10.5)) in rows


#: A drill of 5 mm whose holder, Ø 40, is 20 mm above the tip.
HELD = replace(DRILL5, stickout=20.0, holder=(BodySegment(60.0, 40.0, 40.0),))


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("clamp", "refused"),
    [
        ("49 15 80 40 8", True),
        ("49 15 80 40 6.9", False),
        ("50.1 15 80 40 8", False),
        ("44.5 34.5 80 80 8", False),
        ("44 34 80 80 8", True),
        ("49 15 80 40", True),
    ],
)
def test_a_holder_stays_out_of_a_clamp_that_is_as_high(clamp: str, refused: bool) -> None:
    """By hand: the tip goes to -10 - 0.5 - 1.502, so the holder to Z7.998: 1 mm above a clamp of 6.9 mm, not of 8 mm.

    From (30, 20) a corner at (44.5, 34.5) is 20.5 mm away, one at (44, 34) is 19.8 mm away; the holder has 20 mm.
    """
    library = ToolLibrary((HELD,))
    if refused:
        with pytest.raises(PlanError, match=r"at \(30, 20\), its shank or holder enters a keep-out zone below the"):
            plan(library=library, keep_out=(clamp,))
        plan(keep_out=(clamp,))
    else:
        plan(library=library, keep_out=(clamp,))


@pytest.mark.hazard
def test_a_move_is_lifted_where_the_holder_would_meet_a_clamp_and_the_flutes_would_not() -> None:
    """A clamp of 30 mm, 15 mm from the path from (30, 0) to (90, 0); at the R plane the holder is at Z22."""
    part = Part("two holes", (Hole(30, 0, 5.0), Hole(90, 0, 5.0)))
    given: dict[str, object] = {"part": part, "keep_out": ("59 15 61 40 30",), "clearance_height": 40}
    # Over the first hole the tool is at Z40 once before the first hole, and once more before a lifted move.
    for tool, times in ((HELD, 2), (DRILL5, 1), (replace(HELD, stickout=29.0), 1)):
        assert laid(plan(library=ToolLibrary((tool,)), **given)).count((Kind.RAPID, (30, 0, 40))) == times


def test_a_dogleg_rapid_is_lifted_when_the_box_between_its_ends_touches_a_zone() -> None:
    diagonal = Part("diagonal", (Hole(0, 0, 5.0), Hole(30, 20, 5.0)))
    for style, expected in (("linear", [False]), ("dogleg", [True])):
        assert lifts(diagonal, replace(MILL, rapid_style=style), keep_out=("20 2 24 4",)) == expected


def lifts(part: Part = FOUR, machine: Machine = MILL, **options: object) -> list[bool]:
    """Return for every move from hole to hole of the drawing's order whether it is lifted."""
    rows = laid(plan(part, **options), machine)
    drills = [k for k, (kind, _) in enumerate(rows) if kind is Kind.DRILL]
    return [b > a + 1 for a, b in pairwise(drills)]


def test_between_slots_a_zone_is_crossed_at_the_initial_plane_and_all_else_at_the_r_plane() -> None:
    part = Part("slots", slots=(Slot((0, 0), (10, 0), 2.0), Slot((20, 0), (16, 0), 2.0)))
    for zones, height in (((), 2.0), (("12.5 -5 13.5 5",), 10.0)):
        path = generate_toolpath(plan(part, None, keep_out=zones), MILL, [np.array([0, 3], dtype=np.int32)])
        over = next(k for k, m in enumerate(path) if m.kind is Kind.RAPID and m.end[:2] == (16, 0))
        assert path[over].end[2] == path[over - 1].end[2] == height


def test_retract_initial_lifts_between_slots_too() -> None:
    path = generate_toolpath(plan(SLOTTED, None, retract="initial"), MILL, [np.array([0, 3], dtype=np.int32)])
    assert {m.end[2] for m in path if m.kind is Kind.RAPID and m.end[:2] == (12, 0)} == {10.0, 2.0}


def test_the_end_point_is_reached_high_up_and_last() -> None:
    rows = laid(plan(end_point="5,7"))
    moves = [end for kind, end in rows if kind in (Kind.RAPID, Kind.DRILL)]
    assert moves[-1] == (5, 7, 10.0)
    assert moves[-2][2] == 10.0


@pytest.mark.parametrize("flag", ["start_point", "end_point"])
def test_start_and_end_are_places_in_the_plane(flag: str) -> None:
    with pytest.raises(OptionError, match="need two numbers"):
        plan(**{flag: "1,2,3"})
    assert plan(**{flag: "free"}) is not None


def test_centre_drilling_every_hole_means_those_with_a_recipe_too() -> None:
    library = ToolLibrary((CENTRE, DRILL5, DRILL8), (Recipe(5.0, (5,)), Recipe(8.0, (5, 8))))
    made = plan(Part("x", (Hole(0, 0, 5.0), Hole(9, 0, 8.0))), library, centre_drill=True)
    assert [(o.tool.number, o.targets.tolist()) for o in made.operations] == [(1, [0, 1]), (5, [0, 1]), (8, [1])]


def test_centre_drilling_needs_a_library() -> None:
    with pytest.raises(PlanError, match="give --tools"):
        plan(library=None, centre_drill=True)


def test_a_tool_without_feed_or_speed_is_refused() -> None:
    for wrong, word in ((replace(DRILL5, feed=0.0), "feed"), (replace(DRILL5, spindle_rpm=0.0), "spindle_speed")):
        with pytest.raises(PlanError, match=f"has no {word}"):
            plan(library=ToolLibrary((wrong,)))


def test_a_machine_without_a_spindle_does_not_drill() -> None:
    with pytest.raises(PlanError, match="has a torch"):
        plan_drilling(FOUR, replace(MILL, head=Head.TORCH), LIBRARY, *drilling(thickness=1.0))


def test_a_safe_height_of_the_machine_below_the_clearance_height_is_refused() -> None:
    """Program zero at z −95 and the machine's safe height at −90: only 5 mm over the part, below 10 mm."""
    low = replace(MILL, safe_z=-90.0, work_offset=(0.0, 0.0, -95.0))
    with pytest.raises(PlanError, match="5 mm over program zero"):
        plan_drilling(FOUR, low, LIBRARY, *drilling(thickness=1.0))
    plan_drilling(FOUR, replace(low, safe_z=-85.0), LIBRARY, *drilling(thickness=1.0))


def test_circles_out_of_range_are_drilled_only_with_a_warning_or_not_at_all() -> None:
    made = plan(Part("x", (Hole(0, 0, 200.0), Hole(300, 0, 10.0))), None)
    assert [i.message for i in made.issues if i.code == "L401" and i.severity is Severity.WARNING] == [
        "T1 drill Ø200 is unusually large for a drill; use --max-diameter to leave out circles that you do "
        "not want to drill"
    ]
    with pytest.raises(PlanError, match="has no feed"):
        plan(Part("x", (Hole(0, 0, 1e-7),)), None, spindle_speed=6000.0)


def test_points_without_a_diameter_are_one_millimetre_wide_or_as_wide_as_the_only_drill() -> None:
    points = Part("points", (Hole(0, 0, 0.0), Hole(5, 0, 0.0)))
    for library, diameter in ((None, 1.0), (ToolLibrary((DRILL8, CENTRE)), 8.0)):
        made = plan(points, library)
        assert [o.tool.diameter for o in made.operations] == [diameter]
        assert f"2 points have no diameter and are drilled as {diameter:g} mm holes" in [i.message for i in made.issues]


def test_assumed_feeds_name_the_material_that_they_are_for() -> None:
    """Whoever gives both feed and speed knows the material."""

    def told(**given: float) -> str:
        (words,) = [issue.message for issue in plan(library=None, **given).issues if issue.code == "L401"]
        return words

    advice = "load it under this number and check these values, or give --tools"
    material = f" (for high-speed steel in mild steel or aluminium); {advice}"
    assert told().endswith(f"rpm{material}") and told(feed=2.0).endswith(f"120 mm/min at 1273 rpm{material}")
    assert told(feed=2.0, spindle_speed=3000.0) == f"T1 drill Ø5 is assumed, with 120 mm/min at 3000 rpm; {advice}"
    board = plan(Part("board", FOUR.holes, format="excellon"), None)
    assert [
        "rpm (for circuit boards); load it under this number and check these values, or give" in i.message
        for i in board.issues
        if i.code == "L401"
    ] == [True]
    library = replace(LIBRARY, tools=(replace(DRILL5, feed=0.0, spindle_rpm=0.0),), recipes=(), without_feeds=True)
    (filled,) = [issue.message for issue in plan(library=library).issues if issue.code == "L401"]
    assert filled.endswith("rpm (for high-speed steel in mild steel or aluminium); check both values")


@pytest.mark.parametrize(
    ("diameter", "told"),
    [
        (1.6, []),  # 0.5 mm and the point, 0.481 mm
        (3.2, ["T1 drill Ø3.2 exits up to 1.46 mm below the board; use a thicker backing board"]),
        (10.0, []),  # that is a warning of its own
    ],
)
def test_more_than_a_millimetre_below_a_board_is_stated(diameter: float, told: list[str]) -> None:
    holes = (Hole(0, 0, diameter), Hole(30, 0, diameter))
    for format_, expected in (("excellon", told), ("dxf", [])):
        made = plan(Part("board", holes, format=format_), None, thickness=1.6, spindle_speed=6000.0)
        assert [issue.message for issue in made.issues if issue.code == "L402"] == expected
    assert len(far_below(made)) == (diameter == 10.0)


def deep_strokes(made: object) -> list[str]:
    return [issue.message for issue in made.issues if issue.code == "L446"]


@pytest.mark.hazard
def test_a_hole_deeper_than_five_diameters_in_one_stroke_is_a_warning_beside_verified() -> None:
    """A plate of 60 mm is 10 times a drill of 6 mm, 5 times one of 12 mm: below the plate a drill is free."""
    part = Part("two", (Hole(0, 0, 6.0), Hole(30, 12.5, 6.0), Hole(50, 0, 12.0)))
    made = plan(part, None, thickness=60.0)
    assert deep_strokes(made) == [
        "T1 drill Ø6 at (0, 0) drills 60 mm deep, which is 10.0 diameters, in one stroke (2 holes deeper than 5 "
        "diameters); give --peck, or set the tool's 'cycle' to G83 and its 'peck' in the library"
    ]
    assert {i.severity for i in made.issues if i.code == "L446"} == {Severity.WARNING} and "L446" in LIMITS
    assert deep_strokes(plan(part, None, thickness=60.0, cycle="G81", peck=6.0)) != []
    blind = plan(part, None, thickness=None, depth=30.5, depth_to="tip")
    assert "Ø6 at (0, 0) drills 30.5 mm deep, which is 5.1 diameters, in one stroke (2" in deep_strokes(blind)[0]
    assert deep_strokes(plan(part, None, thickness=None, depth=30.0, depth_to="tip")) == []


@pytest.mark.hazard
@pytest.mark.parametrize("cycle", ["G83", "G73"])
def test_pecks_longer_than_five_diameters_are_a_warning_and_shorter_ones_are_none(cycle: str) -> None:
    part = Part("one", (Hole(0, 0, 6.0),))
    assert deep_strokes(plan(part, None, thickness=60.0, cycle=cycle, peck=6.0)) == []
    assert (
        "in strokes of 40 mm (1 hole with strokes longer than 5 diameters)"
        in deep_strokes(plan(part, None, thickness=60.0, cycle=cycle, peck=40.0))[0]
    )
    assert "in one stroke" in deep_strokes(plan(part, None, thickness=60.0, cycle=cycle, peck=200.0))[0]


def test_boards_other_tools_and_slots_have_no_warning_of_deep_holes() -> None:
    board = Part("board", (Hole(0, 0, 0.2),), format="excellon")
    assert deep_strokes(plan(board, None, thickness=1.6, spindle_speed=6000.0)) == []
    drill = replace(DRILL5, peck=2.0, flute_length=None)
    made = plan(Part("one", (Hole(0, 0, 6.0),)), ToolLibrary((TAP6, drill), (Recipe(6.0, (5, 16)),)), thickness=40.0)
    assert [o.tool for o in made.operations] == [drill, TAP6] and deep_strokes(made) == []
    slot = Part("slot", slots=(Slot((0, 0), (9, 0), 1.0),))
    assert deep_strokes(plan(slot, None, thickness=10.0)) == []


def far_below(made: object) -> list[str]:
    return [issue.message for issue in made.issues if issue.code == "L404"]


@pytest.mark.hazard
def test_a_drill_that_comes_out_more_than_three_millimetres_below_the_plate_is_a_warning() -> None:
    """Below the plate: 0.5 mm and the point, 5 / tan 59° = 3.004 mm for a drill of 10 mm, 2.403 mm for 8 mm."""
    part = Part("two", (Hole(0, 0, 8.0), Hole(30, 12.5, 10.0), Hole(50, 0, 10.0)))
    told = far_below(plan(part, None))
    assert told == [
        "T2 drill Ø10 at (30, 12.5) exits 3.50 mm below the part (2 places with more than 3 mm); leave room "
        "for the tip below the part, or use a smaller --break-through"
    ]
    assert far_below(plan(Part("one", part.holes[:1]), None)) == []
    assert (
        "drill Ø8 at (0, 0) exits 3.40 mm" in far_below(plan(Part("one", part.holes[:1]), None, break_through=1.0))[0]
    )
    assert far_below(plan(part, None, thickness=None, depth=10.0)) == []
    slot = Part("slot", (), (Slot((5.0, 1.0), (9.0, 1.0), 2.0),))
    assert far_below(plan(slot, None)) == []
    assert "slot-mill Ø2 at (5, 1) exits 3.20 mm" in far_below(plan(slot, None, break_through=3.2))[0]


def test_on_a_surface_what_comes_out_is_measured_from_the_underside() -> None:
    """A plate of 20 mm at Z0, and holes of 10 mm: through 3.504 mm below it; 18 mm deep with the point 1.004 mm."""
    plate = Mesh(box_triangles(0, 0, -20, 80, 40, 0), "plate")
    part = Part("one", (Hole(30, 20, 10.0),))
    for options, found in (({"depth": "through"}, 1), ({"depth": 18.0}, 0), ({"depth": 20.1}, 1)):
        job, ours = drilling(**options)
        assert len(far_below(plan_drilling(part, MILL, None, job, ours, plate))) == found


def test_a_hole_of_a_solid_that_opens_into_a_cavity_is_measured_from_where_it_opens() -> None:
    solid = Mesh(box_triangles(0, 0, -20, 80, 40, 0), "solid")
    part = Part("one", (Hole(30, 20, 10.0, depth=5.0, through=True),))
    (told,) = far_below(plan_drilling(part, MILL, None, *drilling(), solid))
    assert "exits 3.50 mm below the part" in told


#: A centre drill of 10 mm and 90 degrees, whose point goes 1.5 mm deep.
WIDE_CENTRE = Tool(1, 10.0, ToolKind.CENTRE_DRILL, feed=1.0, spindle_rpm=3000, depth=1.5, point_angle=0.5 * math.pi)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("x", "height", "refused"),
    [(44.2, 15, True), (44.9, 15, True), (45.1, 15, False), (44.2, 3, True), (44.2, 2.5, False), (43, 0.5, False)],
)
def test_a_centre_drill_wider_than_a_hole_of_a_solid_does_not_cut_the_wall_beside_it(
    x: float, height: float, refused: bool
) -> None:
    """By hand: the wall ends at X40. The point is 1.5 mm wide aside at Z0, and 1 mm wider for each mm above, up to 5.

    So a wall 4.2 mm away is met from Z2.7 up, one 5 mm away from Z3.5 up.
    """
    wall = np.concatenate([box_triangles(0, 0, -10, 100, 60, 0), box_triangles(30, 0, 0, 40, 60, height)])
    part = Part("one", (Hole(x, 30, 5.0, depth=5.0), Hole(80, 30, 5.0, depth=5.0)))
    library, (job, ours) = ToolLibrary((WIDE_CENTRE, DRILL5)), drilling(centre_drill=True)
    if refused:
        with pytest.raises(PlanError, match=rf"the tool is wider than the hole at \({x}, 30\) and would cut its wall"):
            plan_drilling(part, MILL, library, job, ours, Mesh(wall, "solid"))
        plan_drilling(part, MILL, library, *drilling(), Mesh(wall, "solid"))
    else:
        plan_drilling(part, MILL, library, job, ours, Mesh(wall, "solid"))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "rpm, spindle, words",
    [
        (
            249.0,
            (6000.0, 24000.0),
            "Ø5 requires 249 rpm, but the spindle of test mill turns 6000 to 24000 rpm: mill the hole",
        ),
        (
            9000.0,
            (0.0, 6000.0),
            "Ø5 requires 9000 rpm, but the spindle of test mill turns 0 to 6000 rpm: change the speed",
        ),
    ],
)
def test_a_speed_of_the_library_outside_the_spindles_range_is_refused_with_what_to_do(
    rpm: float, spindle: tuple[float, float], words: str
) -> None:
    machine = replace(MILL, spindle_min_rpm=spindle[0], spindle_max_rpm=spindle[1])
    with pytest.raises(PlanError, match=words):
        plan_drilling(FOUR, machine, ToolLibrary((replace(DRILL5, spindle_rpm=rpm),)), *drilling(thickness=10.0))


def test_a_speed_asked_for_outside_the_spindles_range_is_refused_by_its_option() -> None:
    with pytest.raises(
        PlanError, match=r"^--spindle-speed 9000: the spindle of test mill turns 0 to 6000 rpm; choose a"
    ):
        plan(library=None, spindle_speed=9000.0)


@pytest.mark.parametrize(
    "distance, height, fits",
    [(2.8, " 0", True), (2.3, " 0", False), (5.1, " 3", True), (4.9, " 3", False), (4.9, "", False), (5.1, "", True)],
)
def test_a_spot_drill_is_as_wide_at_a_clamp_as_its_cone(distance: float, height: str, fits: bool) -> None:
    """Its tip is at Z-1.5 and its cone has 90 degrees: 1 mm above a clamp of height h its radius is h + 2.5 mm."""
    zone = f"{30 + distance:g} 15 60 40{height}"
    with (
        nullcontext()
        if fits
        else pytest.raises(
            PlanError, match=r"the hole at \(30, 20\) is in a keep-out zone, or closer to it than the radius of"
        )
    ):
        plan(library=ToolLibrary((WIDE_CENTRE, DRILL5)), centre_drill=True, keep_out=(zone,))
