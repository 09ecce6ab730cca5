"""Feeds from the engagement of a mill: chips and power against hand calculations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.material.chip_feeds import (
    allowed_feed,
    chip_thickness,
    cutting_power,
    plunge_feed,
    power_on_plunge,
    power_on_ramp,
    ramp_feed,
)
from leafcut.material.cutting_force import mean_chip_thickness, milling_power
from leafcut.material.engagement import Engaged
from leafcut.material.removal import engaged_tool_path
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.model.work_material import WorkMaterial

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
#: 10 mm/s at 3,000 rpm are 0.2 mm a revolution.
LIMITS = FeedLimits(10.0, 10.0, 3000.0, most=15.0, depth=2.0, film_depth=8.0, film=2.0)
STEEL = WorkMaterial("steel", kc11=1800.0, mc=0.25)


def engaged_on(*lines: list[tuple[float, float]]) -> tuple[np.ndarray, Engaged]:
    """Return the places of the last of some lines, one after another, and what is engaged there."""
    path = PocketPath("", tuple(PocketPiece(Polyline.of_points(line)) for line in lines))
    way, engaged = engaged_tool_path(path, RULES)
    mine = way.piece == len(lines) - 1
    return way.xy[mine], Engaged(*(column[mine] for column in engaged))


def beside(width: float) -> Engaged:
    """Return the engagement in the middle of a straight cut of this width, next to a slot."""
    places, engaged = engaged_on([(0, 0), (60, 0)], [(60, width), (0, width)])
    inside = (places[:, 0] > 25) & (places[:, 0] < 35)
    return Engaged(*(column[inside] for column in engaged))


def test_a_slot_and_a_half_width_cut_have_the_whole_chip_and_narrower_ones_thinner_chips() -> None:
    """h = f_z sin φ: a slot, 5 and 6 mm of 10: 1; 2.5 mm: √(1 − 0.5²) = 0.866; 1 mm: √(1 − 0.8²) = 0.6."""
    _, slot = engaged_on([(0, 0), (60, 0)])
    assert slot.chip == pytest.approx(1.0)
    assert slot.width == pytest.approx(10.0, abs=0.03)
    for width, share in ((6.0, 1.0), (5.0, 1.0), (2.5, 0.8660), (1.0, 0.6)):
        found = beside(width)
        assert found.chip == pytest.approx(share, abs=0.005), width
        assert chip_thickness(found, 10.0, 3000.0) == pytest.approx(0.2 * share, abs=0.001)


def test_before_a_corner_the_wall_that_comes_makes_the_whole_chip() -> None:
    """A way 1 mm outside of a right angle that is cut, s before its corner at (41, −1).

    Straight ahead the edge is at (46 − s, −1), and a disc of 5 mm about (40, 0) is cleared: uncut where (6 − s)² + 1
    is above 25, s < 1.10, and the chip is whole. Where s > 4 the edge at the side, 3 mm on, is still beside the
    straight way: a cut of 1 mm, 0.6.
    """
    places, engaged = engaged_on([(0, 0), (40, 0), (40, 40)], [(0, -1), (41, -1), (41, 40)])
    before = 41.0 - places[:, 0]
    first = places[:, 1] < -0.999
    assert engaged.chip[first & (before < 1.05) & (before > 0.01)] == pytest.approx(1.0)
    assert engaged.chip[first & (before > 4.1) & (before < 20)] == pytest.approx(0.6, abs=0.005)


def test_the_feed_holds_the_chip_and_keeps_the_highest_feed() -> None:
    """10 mm/s in a slot; 10 / 0.866 = 11.55 in a cut of a quarter; 10 / 0.6 = 16.7 would be above 15 at a tenth."""
    slot = Engaged(np.array([math.pi]), np.array([10.0]), np.array([1.0]))
    assert allowed_feed(slot, LIMITS) == pytest.approx(10.0)
    assert allowed_feed(beside(2.5), LIMITS) == pytest.approx(11.55, rel=0.006)
    assert allowed_feed(beside(1.0), LIMITS) == pytest.approx(15.0)


@pytest.mark.parametrize("width", [0.5, 2.5, 5.0, 8.0])
def test_the_power_of_a_side_cut_is_that_of_its_mean_chip(width: float) -> None:
    """By the closed form of a straight cut, hm = f_z (1 − cos φ) / φ, φ = acos(1 − 2 a/D) (Kienzle)."""
    limits = replace(LIMITS, material=STEEL, teeth=4, power=1e9)
    angle, depth = math.acos(1.0 - width / 5.0), 8.0 if width <= 2.0 else 2.0
    engaged = Engaged(np.array([angle]), np.array([width]), np.ones(1))
    expected = milling_power(STEEL, width * depth * 10.0, mean_chip_thickness(0.05, width, 10.0))
    assert cutting_power(engaged, 10.0, limits)[0] == pytest.approx(float(expected))


def test_where_the_power_is_half_of_what_a_slot_needs_its_feed_falls_until_it_needs_that() -> None:
    """Power goes with f^(1 − mc): at half of it the feed is 0.5^(1 / 0.75) = 0.397 of the tool's."""
    slot = Engaged(np.array([math.pi]), np.array([10.0]), np.array([1.0]))
    limits = replace(LIMITS, material=STEEL, teeth=4, power=1e9)
    half = replace(limits, power=0.5 * float(cutting_power(slot, 10.0, limits)[0]))
    feed = allowed_feed(slot, half)
    assert feed == pytest.approx(10.0 * 0.5 ** (1.0 / 0.75))
    assert cutting_power(slot, feed, half) == pytest.approx(half.power)


def test_a_ramp_needs_the_power_of_a_slot_at_its_side_and_of_what_its_end_sinks() -> None:
    """By hand: 10 mm/s along, 0.5 mm/s down, a mill of 10 mm with 4 teeth at 3000 1/min, in a level of 2 mm."""
    limits = replace(LIMITS, material=STEEL, teeth=4, power=1e9, rpm=3000.0, diameter=10.0, depth=2.0)
    side_chip, end_chip = 10.0 / 200.0 * 2.0 / math.pi, 0.5 / 200.0
    side = 10.0 * 2.0 * 10.0 * STEEL.kc11 * side_chip**-STEEL.mc / 1000.0
    end = 25.0 * math.pi * 0.5 * STEEL.kc11 * end_chip**-STEEL.mc / 1000.0
    assert power_on_ramp(limits, 10.0, 0.5, 2.0) == pytest.approx(side + end)
    assert power_on_ramp(limits, 10.0, 0.5, 1.0) == pytest.approx(side + end)  # never less than the level
    assert power_on_ramp(limits, 10.0, 0.5, 4.0) == pytest.approx(2.0 * side + end)


def test_straight_down_the_end_of_a_mill_needs_the_power_of_all_of_its_area() -> None:
    """By hand: 78.54 mm² × 2 mm/s of 0.01 mm a tooth; at half of that power, 0.5^(1 / 0.75) of the feed."""
    limits = replace(LIMITS, material=STEEL, teeth=4, power=1e9, rpm=3000.0, diameter=10.0)
    needs = 25.0 * math.pi * 2.0 * STEEL.kc11 * 0.01**-STEEL.mc / 1000.0
    assert power_on_plunge(limits, 2.0) == pytest.approx(needs)
    assert plunge_feed(limits, 2.0) == 2.0
    feed = plunge_feed(replace(limits, power=0.5 * needs), 2.0)
    assert feed == pytest.approx(2.0 * 0.5 ** (1.0 / (1.0 - STEEL.mc)))
    assert power_on_plunge(limits, feed) == pytest.approx(0.5 * needs)
    assert plunge_feed(LIMITS, 2.0) == 2.0  # no limit is known


@pytest.mark.parametrize("angle", [1.0, 3.0, 20.0, 45.0])
def test_a_ramp_is_slower_until_it_keeps_the_power_and_never_above_it(angle: float) -> None:
    limits = replace(LIMITS, material=STEEL, teeth=4, power=1e9)
    slope = math.radians(angle)
    assert ramp_feed(limits, 10.0, slope, 2.0) == 10.0
    whole = power_on_ramp(limits, 10.0 * math.cos(slope), 10.0 * math.sin(slope), 2.0)
    weak = replace(limits, power=0.6 * whole)
    feed = ramp_feed(weak, 10.0, slope, 2.0)
    needs = power_on_ramp(weak, feed * math.cos(slope), feed * math.sin(slope), 2.0)
    assert 0.6 * weak.power < needs <= weak.power * (1.0 + 1e-9)
    assert ramp_feed(LIMITS, 10.0, slope, 2.0) == 10.0  # no limit is known
