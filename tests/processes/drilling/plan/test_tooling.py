"""Which tools make a hole: a recipe of its layer, a recipe, the nearest drill, or one assumed of its diameter."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from leafcut.errors import PlanError
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.part import Hole, Slot
from leafcut.model.tool import Recipe, Tool, ToolKind, ToolLibrary
from leafcut.processes.drilling.plan.tooling import ToolChooser
from option_groups import drilling

MILL = Machine(
    name="test mill",
    description="",
    controller="linuxcnc",
    rapid_velocity=(100.0, 100.0, 50.0),
    acceleration=(500.0, 500.0, 300.0),
    max_feed=2.0,
    travel_min=(0.0, 0.0, -100.0),
    travel_max=(500.0, 500.0, 0.0),
    spindle_min_rpm=500.0,
    spindle_max_rpm=6000.0,
)
CENTRE = Tool(1, 3.0, ToolKind.CENTRE_DRILL, feed=1.0, spindle_rpm=3000)
FIVE, SIX = (Tool(n, float(n), feed=2.0, spindle_rpm=2000) for n in (5, 6))
TAP = Tool(16, 6.0, ToolKind.TAP, feed=8.0, spindle_rpm=500, pitch=1.0)
RECIPES = (Recipe(6.0, (1, 5, 16)), Recipe(6.1, (6,)), Recipe(6.0, (6,), "ream*"))
SHOP = ToolLibrary((CENTRE, FIVE, SIX, TAP), RECIPES, "shop.toml")


def numbers(library: ToolLibrary | None, hole: Hole, **options: object) -> list[int]:
    chooser = ToolChooser(library, MILL, *drilling(**options))
    return [step.tool.number for step in chooser.steps_for_hole(hole)]


def test_of_recipes_that_fit_that_of_the_layer_comes_first_then_the_nearest_diameter() -> None:
    wide = {"diameter_tolerance": 0.2}
    assert numbers(SHOP, Hole(0, 0, 6.0, layer="REAMED"), **wide) == [6]
    assert numbers(SHOP, Hole(0, 0, 6.02, layer="other"), **wide) == [1, 5, 16]
    assert numbers(SHOP, Hole(0, 0, 6.08, layer="other"), **wide) == [6]


def test_without_a_recipe_the_nearest_drill_within_the_tolerance_is_taken_and_no_other_kind() -> None:
    bare = replace(SHOP, recipes=())
    assert numbers(bare, Hole(0, 0, 5.4), diameter_tolerance=0.5) == [5]
    assert numbers(bare, Hole(0, 0, 5.6), diameter_tolerance=0.5) == [6]
    with pytest.raises(
        PlanError, match=r"there is no drill of 3 mm for the hole at \(7, 8\) on layer '.*the nearest drill has 5 mm"
    ):
        numbers(bare, Hole(7, 8, 3.0), diameter_tolerance=0.5)


def test_a_centre_drill_that_is_asked_for_goes_first_and_only_once() -> None:
    bare = replace(SHOP, recipes=())
    assert numbers(bare, Hole(0, 0, 5.0), centre_drill=True) == [1, 5]
    assert numbers(SHOP, Hole(0, 0, 6.0), centre_drill=True) == [1, 5, 16]
    with pytest.raises(PlanError, match="needs a centre drill"):
        numbers(ToolLibrary((FIVE,), (), "shop.toml"), Hole(0, 0, 5.0), centre_drill=True)
    with pytest.raises(PlanError, match="give --tools"):
        numbers(None, Hole(0, 0, 5.0), centre_drill=True)


def test_an_assumed_drill_turns_at_twenty_metres_a_minute_within_what_the_spindle_can() -> None:
    """v = π·d·n: 20 m/min on 4 mm are 1592 rpm; on 1 mm it would be 6366, on 20 mm 318."""
    for diameter, rpm in ((4.0, round(20_000 / (math.pi * 4))), (1.0, 6000), (20.0, 500)):
        (step,) = ToolChooser(None, MILL, *drilling()).steps_for_hole(Hole(0, 0, diameter))
        assert step.tool.spindle_rpm == rpm
        assert step.tool.feed == pytest.approx(min(0.02 * diameter * rpm / 60, MILL.max_feed), abs=0.1 / 60)


def test_a_speed_and_a_feed_that_are_asked_for_stay_as_they_are() -> None:
    (step,) = ToolChooser(None, MILL, *drilling(spindle_speed=9000.0, feed=7.0)).steps_for_hole(Hole(0, 0, 4.0))
    assert (step.tool.spindle_rpm, step.tool.feed) == (9000.0, 7.0)


def test_holes_of_one_diameter_share_a_drill_and_bare_points_are_as_wide_as_the_only_drill_or_a_millimetre() -> None:
    chooser = ToolChooser(None, MILL, *drilling())
    drawn = [chooser.steps_for_hole(Hole(x, 0, d)) for x, d in enumerate((3.0, 0.0, 3.0, 1.0))]
    assert [steps[0].tool.diameter for steps in drawn] == [3.0, 1.0, 3.0, 1.0]
    assert len(chooser.tool_sequences) == 2
    assert ToolChooser(ToolLibrary((FIVE, TAP), (), ""), MILL, *drilling()).point_diameter == 5.0
    assert ToolChooser(SHOP, MILL, *drilling()).point_diameter == 1.0
    assert any("1 points have no diameter" in issue.message for issue in chooser.issues())


#: 28 holes as a real drawing has them: 12.40 to 12.53 mm, in steps of 0.005 mm.
DRAWN = [12.40 + 0.005 * k for k in range(27)] + [12.40]


def test_holes_of_nearly_one_size_share_the_assumed_drill_of_the_nearest_catalogue_size() -> None:
    """By hand: up to 12.45 mm the nearest tenth is 12.4 mm (a tie goes down), above it 12.5 mm."""
    chooser = ToolChooser(None, MILL, *drilling())
    chosen = [chooser.steps_for_hole(Hole(0, 0, diameter))[0].tool.diameter for diameter in DRAWN]
    assert chosen == [12.4 if diameter < 12.4501 else 12.5 for diameter in DRAWN]
    told = [issue.message for issue in chooser.issues() if "catalogue size" in issue.message]
    assert told == [
        "T1 drill Ø12.4 makes 10 holes of Ø12.405 to 12.45, because it is the nearest catalogue size within "
        "--diameter-tolerance 0.05 mm",
        "T2 drill Ø12.5 makes 15 holes of Ø12.455 to 12.53, because it is the nearest catalogue size within "
        "--diameter-tolerance 0.05 mm",
    ]


@pytest.mark.parametrize(
    "diameter",
    [0.8, 1.05, 2.95, 3.0, 3.3, 3.25, 6.75, 10.2, 14.25, 25.4, 0.5 * 25.4, 25.4 / 4, 25.4 / 8, 25.4 * 17 / 64,
     0.201 * 25.4, 0.1695 * 25.4, 0.413 * 25.4, 0.0135 * 25.4, 0.257 * 25.4],
)  # fmt: skip
def test_metric_fractional_number_and_letter_sizes_stay(diameter: float) -> None:
    for drawn in (diameter, round(diameter, 3)):
        chooser = ToolChooser(None, MILL, *drilling(spindle_speed=2000))
        assert chooser.steps_for_hole(Hole(0, 0, drawn))[0].tool.diameter == pytest.approx(diameter, abs=1e-4)
        assert not [issue for issue in chooser.issues() if "catalogue size" in issue.message]


@pytest.mark.parametrize(
    ("drawn", "tolerance", "drill"),
    [
        (12.43, 0.05, 12.4),
        (12.43, 0.03, 12.4),
        (12.43, 0.029, 12.43),
        (12.43, 0.0, 12.43),
        (6.36, 0.05, 6.35),
        (2.93, 0.05, 2.95),
        (15.12, 0.05, 15.1),
        (0.134, 0.05, 0.13),
        (0.003, 0.05, 0.003),
    ],
)
def test_no_assumed_drill_is_farther_from_its_hole_than_the_tolerance(
    drawn: float, tolerance: float, drill: float
) -> None:
    chooser = ToolChooser(None, MILL, *drilling(spindle_speed=2000, diameter_tolerance=tolerance))
    assert chooser.steps_for_hole(Hole(0, 0, drawn))[0].tool.diameter == drill


def test_slots_share_assumed_mills_of_catalogue_sizes_and_boards_keep_all_diameters() -> None:
    for board, widths in ((False, [6.0, 6.0]), (True, [6.02, 5.98])):
        chooser = ToolChooser(None, MILL, *drilling(spindle_speed=2000), board=board)
        slots = [Slot((0.0, 0.0), (9.0, 0.0), width) for width in (6.02, 5.98)]
        assert [chooser.step_for_slot(slot).tool.diameter for slot in slots] == widths
        assert chooser.steps_for_hole(Hole(0, 0, 1.53))[0].tool.diameter == (1.53 if board else 1.55)
        told = [issue.message for issue in chooser.issues() if "makes 2 slots of Ø5.98 to 6.02" in issue.message]
        assert len(told) == (not board)


def test_a_slot_is_routed_by_a_slot_mill_of_its_width_and_by_no_drill() -> None:
    slot = Slot((1.0, 2.0), (9.0, 2.0), 5.0)
    with pytest.raises(
        PlanError, match=r"there is no slot mill of 5 mm for the slot at \(1, 2\); add one to the library"
    ):
        ToolChooser(SHOP, MILL, *drilling()).step_for_slot(slot)
    mill = Tool(9, 5.0, ToolKind.SLOT_MILL, feed=1.0, spindle_rpm=3000)
    assert ToolChooser(ToolLibrary((FIVE, mill), (), ""), MILL, *drilling()).step_for_slot(slot).tool == mill
    assumed = ToolChooser(None, MILL, *drilling()).step_for_slot(slot)
    assert (assumed.tool.kind, assumed.tool.diameter, assumed.slots) == (ToolKind.SLOT_MILL, 5.0, True)


def test_feeds_are_assumed_for_a_library_without_any_and_never_for_a_tap() -> None:
    still = tuple(replace(tool, feed=0.0, spindle_rpm=0.0) for tool in (FIVE, TAP))
    library = ToolLibrary(still, (Recipe(6.0, (5, 16)),), "shop.toml", without_feeds=True)
    chooser = ToolChooser(library, MILL, *drilling())
    drill, tap = (step.tool for step in chooser.steps_for_hole(Hole(0, 0, 6.0)))
    assert drill.assumed and drill.feed > 0.0 and drill.spindle_rpm > 0.0
    assert (tap.assumed, tap.feed) == (False, 0.0)
    assert [issue.code for issue in chooser.issues()] == ["L401"]


def chosen(hole: Hole, machine: Machine, board: bool = False, **options: object) -> tuple[Tool, list[Issue]]:
    """Return the assumed drill of a hole, and what is reported of it."""
    chooser = ToolChooser(None, machine, *drilling(**options), board=board)
    (step,) = chooser.steps_for_hole(hole)
    return step.tool, list(chooser.issues())


@pytest.mark.hazard
def test_a_drill_that_needs_less_than_half_of_the_lowest_speed_or_more_than_twice_the_highest_is_refused() -> None:
    """v = π·d·n: 20 m/min on 25.6 mm are 249 rpm, on 2.2 mm 2894, on 0.13 mm 48,971."""
    router = replace(MILL, name="router", spindle_min_rpm=6000.0, spindle_max_rpm=24000.0)
    for diameter, words in (
        (25.6, r"drill Ø25\.6 needs 249 rpm, but the spindle of router turns 6000 to 24000 rpm; mill the hole"),
        (
            2.2,
            r"drill Ø2\.2 needs 2894 rpm, .*turns 6000 to 24000 rpm; mill the hole, or give the --spindle-speed "
            r"that your",
        ),
        (
            0.13,
            r"drill Ø0\.13 needs 48971 rpm, .*turns 6000 to 24000 rpm; use a faster spindle, or give the "
            r"--spindle-speed that",
        ),
    ):
        with pytest.raises(PlanError, match=words) as refused:
            chosen(Hole(0, 0, diameter), router)
        assert "\n" not in str(refused.value)
    with pytest.raises(
        PlanError,
        match=r"slot-mill Ø25\.6 needs 249 rpm, .*; mill the slot as a pocket",
    ):
        ToolChooser(None, router, *drilling()).step_for_slot(Slot((0, 0), (9, 0), 25.6))
    assert chosen(Hole(0, 0, 2.1), router)[0].spindle_rpm == 6000.0
    assert chosen(Hole(0, 0, 0.14), router)[0].spindle_rpm == 24000.0
    assert chosen(Hole(0, 0, 25.6), router, spindle_speed=7000.0)[0].spindle_rpm == 7000.0


def test_a_library_without_feeds_gets_no_speed_that_its_drill_cannot_take() -> None:
    router = replace(MILL, name="router", spindle_min_rpm=6000.0, spindle_max_rpm=24000.0)
    library = ToolLibrary((Tool(4, 25.6), Tool(6, 20.0, spindle_rpm=7000)), (), "shop.toml", without_feeds=True)
    chooser = ToolChooser(library, router, *drilling())
    with pytest.raises(PlanError, match=r"T4 drill Ø25\.6 needs 249 rpm, but the spindle of router turns 6000 to"):
        chooser.steps_for_hole(Hole(0, 0, 25.6))
    (step,) = chooser.steps_for_hole(Hole(0, 0, 20.0))
    assert step.tool.spindle_rpm == 7000 and step.tool.feed == pytest.approx(min(0.4 * 7000 / 60, router.max_feed))


def test_an_assumed_speed_that_is_much_too_high_is_a_warning_that_names_the_right_one() -> None:
    """20 m/min on 2.1 mm are 3032 rpm, on 1.5 mm 4244: the spindle turns 6000 at least."""
    router = replace(MILL, name="router", spindle_min_rpm=6000.0, spindle_max_rpm=24000.0)
    (issue,) = chosen(Hole(0, 0, 2.1), router)[1]
    assert issue.severity is Severity.WARNING
    assert issue.message.endswith(
        ". The recommended spindle speed is 3032 rpm, but the minimum speed of the spindle of router is 6000 rpm"
    )
    (issue,) = chosen(Hole(0, 0, 1.5), router)[1]
    assert issue.severity is Severity.NOTE and "recommended" not in issue.message
    (issue,) = chosen(Hole(0, 0, 2.1), router, spindle_speed=6000.0)[1]
    assert "recommended" not in issue.message


@pytest.mark.hazard
def test_a_feed_that_is_assumed_for_a_speed_far_above_the_right_one_is_a_warning() -> None:
    """20 m/min on 25.6 mm are 249 rpm; a person who gives the speed alone gets a feed of 3,072 mm/min."""
    router = replace(MILL, name="router", spindle_min_rpm=6000.0, spindle_max_rpm=24000.0)
    (issue,) = chosen(Hole(0, 0, 25.6), router, spindle_speed=6000.0)[1]
    assert issue.severity is Severity.WARNING
    assert issue.message.endswith(
        "mm/min at 6000 rpm (for high-speed steel in mild steel or aluminium); load it under this number and "
        "check these values, or give --tools. The recommended spindle speed is 249 rpm"
    )
    (issue,) = chosen(Hole(0, 0, 25.6), router, spindle_speed=6000.0, feed=1.0)[1]
    assert issue.severity is Severity.NOTE and "recommended" not in issue.message


def test_drills_of_circuit_boards_may_turn_as_fast_as_carbide_in_their_material() -> None:
    """150 m/min on 3.2 mm are 14,921 rpm, so 5000 rpm are no danger; on 25.6 mm they are 1865 rpm."""
    drill = replace(MILL, name="pcb", spindle_min_rpm=5000.0, spindle_max_rpm=60000.0)
    tool, [issue] = chosen(Hole(0, 0, 3.2), drill, board=True)
    assert (tool.spindle_rpm, issue.severity) == (5000.0, Severity.NOTE)
    with pytest.raises(PlanError, match=r"Ø3\.2 needs 1989 rpm"):
        chosen(Hole(0, 0, 3.2), drill)
    with pytest.raises(PlanError, match=r"Ø25\.6 needs 1865 rpm, .* turns 5000 to 60000 rpm; mill the hole"):
        chosen(Hole(0, 0, 25.6), drill, board=True)
