"""Which tools make a hole: a recipe of its layer, a recipe, the nearest drill, or one assumed of its diameter."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from leafcut.errors import PlanError
from leafcut.model import Hole, Machine, Recipe, Slot, Tool, ToolKind, ToolLibrary
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
    with pytest.raises(PlanError, match=r"no drill of 3 mm for the hole at 7, 8 .*the nearest is 5 mm"):
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
    assert len(chooser.sequences) == 2
    assert ToolChooser(ToolLibrary((FIVE, TAP), (), ""), MILL, *drilling()).point_diameter == 5.0
    assert ToolChooser(SHOP, MILL, *drilling()).point_diameter == 1.0
    assert any("1 points have no diameter" in issue.message for issue in chooser.issues())


def test_a_slot_is_routed_by_a_slot_mill_of_its_width_and_by_no_drill() -> None:
    slot = Slot((1.0, 2.0), (9.0, 2.0), 5.0)
    with pytest.raises(PlanError, match="no slot mill of 5 mm for the slot at 1, 2"):
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
