"""Chips and power of a mill, from slots worked out by hand: a slot is as wide as the tool, its chip as thick as f/n."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from leafcut.material.chip_feeds import power_on_plunge, power_on_ramp
from leafcut.model.difference import Difference
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pocket import PocketRules
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.processes.pocket.proof.chips import MeasuredChips, measure_chips
from leafcut.read.work_materials import load_material

#: 10 mm/s at 6000 rpm are 0.1 mm a revolution.
LIMITS = FeedLimits(6.0, 10.0, 6000.0, most=15.0, depth=2.0, film_depth=2.0, film=1.2)
STEEL = replace(LIMITS, power=300.0, material=load_material("c45"), teeth=3)
RULES = PocketRules(tool_diameter=6.0, step_over=3.0)
MILL = Tool(1, 6.0, ToolKind.END_MILL, name="mill")

Move = tuple[float | None, float | None, float]


def path_of(*moves: Move, rpm: float = 6000.0) -> Toolpath:
    """From (0, 0, 0.5): x, z and feed of each move; lines from 2."""
    builder = ToolpathBuilder()
    builder.spindle(rpm)
    builder.rapid(0.0, 0.0, 0.5, line=1)
    for line, (x, z, feed) in enumerate(moves, 2):
        builder.feed(x=x, z=z, feed=feed, line=line)
    return builder.build()


def measured(
    *moves: Move, limits: FeedLimits = LIMITS, levels: tuple[float, ...] = (-2.0,), rpm: float = 6000.0
) -> MeasuredChips:
    return measure_chips(path_of(*moves, rpm=rpm), RULES, limits, MILL, levels)


def found(*moves: Move, limits: FeedLimits = LIMITS, levels: tuple[float, ...] = (-2.0,)) -> list[tuple[int, str]]:
    wrong = measured(*moves, limits=limits, levels=levels).wrong
    assert {(d.what, d.original) for d in wrong} <= {("feed", 0)}
    return [(d.new, d.text) for d in wrong]


DOWN = (None, -2.0, 2.0)


def test_the_figures_of_a_slot_are_those_of_its_feed_and_speed() -> None:
    """30 mm at 10, 30 mm at 9 mm/s, 2 mm deep: 6 · 2 · 10 = 120 mm³/s at most; the second cut has another feed."""
    result = measured(DOWN, (30.0, None, 10.0), (60.0, None, 9.0))
    assert result.wrong == () and result.changed == 1
    pace = result.tool
    assert (pace.feed_before, pace.feed_after) == ((10.0, 10.0), (9.0, 10.0))
    assert (pace.chip_before, pace.chip_after, pace.chip_limit) == pytest.approx((0.1, 0.1, 0.1))
    assert (pace.number, pace.limits) == (1, ())
    assert pace.limit_stated and pace.label == MILL.label
    assert (pace.rate_before, pace.rate_after) == pytest.approx((120.0, 120.0), rel=1e-3)


def test_without_a_cut_the_feed_is_the_tools_own() -> None:
    result = measured()
    assert result.wrong == () and result.changed == 0
    assert (result.tool.feed_before, result.tool.feed_after) == ((10.0, 10.0), (10.0, 10.0))
    assert (result.tool.chip_before, result.tool.chip_after) == (0.0, 0.0)


@pytest.mark.parametrize(("feed", "wrong"), [(10.0, False), (10.0005, False), (10.002, True), (12.0, True)])
def test_a_slot_faster_than_the_tools_feed_makes_too_thick_a_chip(feed: float, wrong: bool) -> None:
    result = found(DOWN, (30.0, None, feed))
    assert [line for line, _ in result] == [3] * wrong
    if feed == 12.0:
        place = "X30.000 Y0.000 Z-2.000"
        text = f"a move at 720 mm/min makes a chip of 0.12 mm per revolution near {place}; the limit is 0.1 mm"
        assert result == [(3, text)]


def test_half_of_the_speed_makes_a_chip_of_twice_the_thickness() -> None:
    (wrong,) = measured(DOWN, (30.0, None, 10.0), rpm=-3000.0).wrong
    assert wrong.text.startswith("a move at 600 mm/min makes a chip of 0.2 mm per revolution near")


def test_in_air_only_the_greatest_feed_limits_a_move() -> None:
    """Back along its own slot."""
    assert found(DOWN, (30.0, None, 10.0), (0.0, None, 90.0)) == []
    slow = replace(LIMITS, most=8.0)
    assert found(DOWN, (30.0, None, 9.0), (0.0, None, 90.0), limits=slow) == [
        (3, "a move at 540 mm/min cuts near X30.000 Y0.000 Z-2.000; the mill cuts at 480 mm/min at most")
    ]


@pytest.mark.parametrize(("feed", "wrong"), [(10.0005, False), (10.002, True)])
def test_a_descent_is_no_faster_than_the_tools_feed(feed: float, wrong: bool) -> None:
    for x, z in ((None, -2.0), (20.0, -2.0), (20.0, -1.0)):
        result = found((x, z, feed))
        assert [line for line, _ in result] == [2] * wrong
    if wrong:
        assert found((None, -2.0, 12.0)) == [
            (2, "a move at 720 mm/min goes down near X0.000 Y0.000 Z-2.000; the mill cuts at 600 mm/min at most")
        ]


@pytest.mark.parametrize(("z", "level"), [(-1.999, True), (-2.001, True), (-1.99, False)])
def test_a_horizontal_move_beside_the_heights_of_the_levels_belongs_to_a_descent(z: float, level: bool) -> None:
    (wrong,) = found((None, z, 2.0), (30.0, None, 12.0))
    assert ("makes a chip" in wrong[1]) is level and ("goes down" in wrong[1]) is not level


def test_the_worst_sample_of_each_move_is_reported_in_order_of_the_levels() -> None:
    lower = found(DOWN, (30.0, None, 12.0), (None, -4.0, 2.0), (0.0, None, 13.0), levels=(-2.0, -4.0))
    assert [(line, text.split(" makes")[0]) for line, text in lower] == [
        (5, "a move at 780 mm/min"),
        (3, "a move at 720 mm/min"),
    ]


def power(result: MeasuredChips) -> tuple[float, float, float]:
    (limit,) = result.tool.limits
    assert limit.name == "power"
    return limit.before, limit.after, limit.limit


@pytest.mark.parametrize("feeds", [(5.0, 5.0), (5.0, 4.0)])
def test_moves_of_a_ramp_at_one_feed_are_one_ramp(feeds: tuple[float, float]) -> None:
    """From Z0.5 to Z-2 over 30 mm in two parts of different slope."""
    result = measured((10.0, 0.0, feeds[0]), (30.0, -2.0, feeds[1]), limits=replace(STEEL, power=1e6))

    def needed(across: float, fall: float, depth: float, feed: float) -> float:
        by_feed = feed / math.hypot(across, fall)
        return power_on_ramp(STEEL, by_feed * across, by_feed * fall, depth)

    # The first part ends at the surface, so it is no cut.
    assert power(result)[1] == pytest.approx(needed(20.0, 2.0, 2.0, feeds[1]))
    first = measured((10.0, -0.5, feeds[0]), (30.0, -2.0, feeds[1]), limits=replace(STEEL, power=1e6))
    whole = needed(30.0, 2.5, 2.0, 5.0)
    parts = max(needed(10.0, 1.0, 0.5, feeds[0]), needed(20.0, 1.5, 2.0, feeds[1]))
    assert power(first)[1] == pytest.approx(whole if feeds == (5.0, 5.0) else parts)


def test_a_helix_is_a_ramp_as_long_as_its_arcs() -> None:
    """Two full turns of 4 mm radius from Z0.5 to Z-2, then up again, which is no ramp."""
    limits = replace(STEEL, power=1e6)
    builder = ToolpathBuilder()
    builder.spindle(6000.0)
    builder.rapid(0.0, 0.0, 0.5)
    for z in (-0.75, -2.0):
        builder.arc(True, (0.0, 0.0, z), Arc((4.0, 0.0, 0.0)), feed=5.0)
    builder.arc(True, (0.0, 0.0, -1.0), Arc((4.0, 0.0, 0.0)), feed=9.0)
    found = measure_chips(builder.build(), RULES, limits, MILL, (-2.0,))
    across, fall = 16.0 * math.pi, 2.5
    by_feed = 5.0 / math.hypot(across, fall)
    needed = power_on_ramp(limits, by_feed * across, by_feed * fall, 2.0)
    assert power(found)[1] == pytest.approx(needed, rel=1e-4)


def test_a_ramp_cuts_from_the_level_above_it() -> None:
    deep = replace(STEEL, power=1e6, depth=0.5)
    two = measured(DOWN, (30.0, None, 1.0), (0.0, -4.0, 9.0), limits=deep, levels=(-2.0, -4.0))
    by_feed = 9.0 / math.hypot(30.0, 2.0)
    assert power(two)[1] == pytest.approx(power_on_ramp(deep, by_feed * 30.0, by_feed * 2.0, 2.0))
    one = measured(DOWN, (30.0, None, 1.0), (0.0, -4.0, 9.0), limits=deep, levels=(-4.0,))
    assert power(one)[1] == pytest.approx(power_on_ramp(deep, by_feed * 30.0, by_feed * 2.0, 4.0))


def test_a_steep_ramp_that_needs_more_power_than_the_spindle_has_is_found() -> None:
    """From Z0.5 to Z-2 over 3 mm: its length across is that of the plan, and it may need all power but not more."""
    by_feed = 5.0 / math.hypot(3.0, 2.5)
    needed = power_on_ramp(STEEL, by_feed * 3.0, by_feed * 2.5, 2.0)
    for share, wrong in ((1.0, False), (0.9995, True)):
        weak = replace(STEEL, power=share * needed)
        text = (
            f"a move at 300 mm/min needs {needed / 1000.0:.4g} kW near X3.000 Y0.000 Z-2.000; the spindle "
            f"provides at most {share * needed / 1000.0:.4g} kW"
        )
        assert found((3.0, -2.0, 5.0), limits=weak) == ([(2, text)] if wrong else [])


def test_a_plunge_needs_power_only_in_uncleared_material() -> None:
    """Down at X0 in full material, then along, and down again in the middle of the slot."""
    limits = replace(STEEL, power=1e6)
    plunged = measured((None, -2.0, 9.0), limits=limits)
    assert power(plunged) == pytest.approx((power_on_plunge(limits, 9.0), power_on_plunge(limits, 9.0), 1e6))
    weak = replace(STEEL, power=0.9 * power_on_plunge(STEEL, 9.0))
    (wrong,) = found((None, -2.0, 9.0), limits=weak)
    kilowatts = power_on_plunge(STEEL, 9.0) / 1000.0
    assert wrong == (
        2,
        f"a move at 540 mm/min needs {kilowatts:.4g} kW near X0.000 Y0.000 Z-2.000; the spindle "
        f"provides at most {0.9 * kilowatts:.4g} kW",
    )
    builder = ToolpathBuilder()
    builder.spindle(6000.0)
    builder.rapid(0.0, 0.0, 0.5)
    builder.feed(z=-2.0, feed=0.1, line=2)
    builder.feed(x=30.0, feed=0.1, line=3)
    builder.rapid(z=0.5)
    builder.rapid(x=15.0)
    builder.feed(z=-2.0, feed=9.0, line=4)
    assert measure_chips(builder.build(), RULES, weak, MILL, (-2.0,)).wrong == ()


def test_the_power_of_a_slot_grows_with_its_feed_and_is_limited() -> None:
    """Before the change of feeds, the slot was cut at the tool's own feed."""
    limits = replace(STEEL, power=1e6)
    fast, slow = (measured((None, -2.0, 0.01), (30.0, None, feed), limits=limits) for feed in (10.0, 5.0))
    assert power(slow)[0] == pytest.approx(power(fast)[1]) and power(slow)[1] < 0.7 * power(fast)[1]
    needed = power(fast)[1]
    for share, lines in ((0.9998, [3]), (1.0001, [])):
        weak = replace(STEEL, power=share * needed)
        assert [line for line, _ in found((None, -2.0, 0.01), (30.0, None, 10.0), limits=weak)] == lines
    assert measured(DOWN, (30.0, None, 10.0)).tool.limits == ()


def test_of_many_wrong_moves_fifty_are_listed() -> None:
    wrong = measured(DOWN, *((10.0 + k, None, 12.0) for k in range(60))).wrong
    assert len(wrong) == 51 and wrong[-1] == Difference("and more", 0, 0, "10 more differences")
