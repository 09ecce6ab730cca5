"""Moves that run into each other: corners worked by hand, and rules that hold for every path."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import SPEED_ALONE, Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.timing.linuxcnc import CYCLE
from leafcut.timing.profile import trapezoid_time
from leafcut.timing.toolpath import measure_toolpath

MILL = Machine(
    "mill",
    "",
    "linuxcnc",
    (100.0, 100.0, 50.0),
    (500.0, 500.0, 250.0),
    80.0,
    (-400.0, -200.0, -300.0),
    (0.0, 0.0, 0.0),
)
KINKED = replace(MILL, acceleration_factor=0.9)
GRBL = replace(MILL, controller="grbl")
HAAS = replace(MILL, controller="haas", corner_deviation=0.05)

#: What LinuxCNC loses at every stop.
STOP = 0.5 * CYCLE

Place = tuple[float, float]


def lines(places: list[Place], mode: int = 610, tolerance: float = 0.0, feed: float = 50.0) -> Toolpath:
    """Return a path of feed moves from (0, 0) over some places, all joined in one way."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.blending(mode, tolerance)
    for x, y in places:
        builder.feed(x, y, feed=feed)
    return builder.build()


def seconds(path: Toolpath, machine: Machine) -> float:
    return measure_toolpath(path, machine).time_s


def between(distance: float, begin: float, top: float, end: float, acceleration: float) -> float:
    """Return the time of a move long enough to reach its top speed, from one speed to another."""
    ramps = (2 * top**2 - begin**2 - end**2) / (2 * acceleration)
    assert ramps <= distance
    return (2 * top - begin - end) / acceleration + (distance - ramps) / top


@pytest.mark.parametrize("machine, mode", [(MILL, 610), (KINKED, 610), (GRBL, 640), (HAAS, 640)])
def test_two_moves_in_line_are_one_long_move(machine: Machine, mode: int) -> None:
    whole = seconds(lines([(30, 40)], mode), machine)
    assert seconds(lines([(12, 16), (30, 40)], mode), machine) == pytest.approx(whole, rel=1e-12)


def test_linuxcnc_runs_no_move_in_less_than_a_little_more_than_a_cycle() -> None:
    """400 moves of 0.05 mm in line, at a feed of 80 mm/s: no faster than 0.05 mm in 1.02 ms, as LinuxCNC 2.9 does."""
    short = lines([(0.05 * (i + 1), 0) for i in range(400)], feed=80.0)
    by_hand = between(20.0, 0.0, 0.05 / 0.00102, 0.0, 500.0) + STOP
    assert seconds(short, MILL) == pytest.approx(by_hand, rel=1e-6)


def test_exact_stop_mode_stops_between_moves_in_line() -> None:
    """G61.1: 20 mm and 30 mm, each from rest to rest."""
    each = [trapezoid_time(d, 50.0, 500.0) + STOP for d in (20.0, 30.0)]
    assert seconds(lines([(20, 0), (50, 0)], 611), KINKED) == pytest.approx(sum(each))


def test_a_right_angle_in_exact_path_mode_is_two_moves_at_rest_with_a_tenth_kept_back() -> None:
    """G61: both moves of 30 mm at 50 mm/s with 0.9 · 500 mm/s²."""
    each = trapezoid_time(30.0, 50.0, 450.0) + STOP
    assert seconds(lines([(30, 0), (30, 30)]), KINKED) == pytest.approx(2 * each)


def test_a_right_angle_within_a_tolerance_by_hand() -> None:
    """G64 P0.02, both legs 30 mm at 50 mm/s. Half the angle is 45°: the arc begins 0.02 · cos 45° / (1 - sin 45°) =
    0.04828 mm before the corner, its radius is the same, its length a quarter turn: 0.07584 mm. √3/2 of 500 mm/s² point
    inwards: √(433.0 · 0.04828) = 4.572 mm/s. The second leg ends in G61, so it has its whole acceleration."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.blending(640, 0.02)
    builder.feed(30.0, 0.0, feed=50.0)
    builder.blending(610)
    builder.feed(30.0, 30.0, feed=50.0)
    reach = 0.02 * math.cos(math.pi / 4) / (1 - math.sin(math.pi / 4))
    speed = math.sqrt(math.sqrt(3) / 2 * 500 * reach)
    leg = between(30.0 - reach, 0.0, 50.0, speed, 500.0)
    expected = 2 * leg + reach * math.pi / 2 / speed + STOP
    assert (reach, speed) == pytest.approx((0.04828, 4.572), rel=1e-3)
    assert seconds(builder.build(), KINKED) == pytest.approx(expected)


def test_the_last_move_before_a_halt_has_half_the_acceleration_under_g64() -> None:
    """LinuxCNC 2.9 (issue 4220): 30 mm at 50 mm/s with 250 mm/s²."""
    assert seconds(lines([(30, 0)], 640), MILL) == pytest.approx(trapezoid_time(30.0, 50.0, 250.0) + STOP)


def test_a_right_angle_by_junction_deviation_by_hand() -> None:
    """δ 0.01 mm; the corner pulls along the diagonal, where both axes together give 500 √2 = 707.1 mm/s². s = sin 45°:
    √(707.1 · 0.01 · s / (1 - s)) = 4.132 mm/s."""
    sine = math.sin(math.pi / 4)
    speed = math.sqrt(500 * math.sqrt(2) * 0.01 * sine / (1 - sine))
    assert speed == pytest.approx(4.132, rel=1e-3)
    found = seconds(lines([(30, 0), (30, 30)], 610), GRBL)
    # Whole ticks of a timer of 16 MHz make it a thousandth slower.
    assert found == pytest.approx(2 * between(30.0, 0.0, 50.0, speed, 500.0), rel=2e-3)


def test_other_controls_round_corners_under_g64_only() -> None:
    at_rest = 2 * trapezoid_time(30.0, 50.0, 500.0)
    assert seconds(lines([(30, 0), (30, 30)], 610), HAAS) == pytest.approx(at_rest)
    assert seconds(lines([(30, 0), (30, 30)], 640), HAAS) < at_rest - 0.01


def test_a_line_that_touches_an_arc_is_left_at_full_speed() -> None:
    """30 mm, a quarter of r = 20, 30 mm, at 25 mm/s: 0.05 s up and 0.05 s down on the lines, 91.4 mm at 25 mm/s."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(30.0, 0.0, feed=25.0)
    builder.arc(False, (50.0, 20.0, 0.0), Arc((30.0, 20.0, 0.0)), feed=25.0)
    builder.feed(50.0, 50.0, feed=25.0)
    expected = (60 + 10 * math.pi) / 25 + 25 / 500
    assert seconds(builder.build(), MILL) == pytest.approx(expected + STOP)


def test_a_tight_arc_is_slowed_to_the_share_that_points_inwards_and_left_half_along_it() -> None:
    """Half a circle of r = 5 at 80 mm/s: √(√3/2 · 500 · 5) = 46.53 mm/s, reached with 250 mm/s²."""
    builder = ToolpathBuilder()
    builder.rapid(5.0, 0.0, 0.0)
    builder.arc(False, (-5.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=80.0)
    expected = trapezoid_time(5 * math.pi, math.sqrt(math.sqrt(3) / 2 * 2500), 250.0)
    assert seconds(builder.build(), MILL) == pytest.approx(expected + STOP)


def test_grbl_runs_an_arc_as_chords_with_corners_between() -> None:
    """r = 10 with chords 0.002 mm off: corners of φ, s = cos φ/2, so v² = a δ s / (1 - s), near 5 a r = 158² mm²/s²:
    the feed rules."""
    builder = ToolpathBuilder()
    builder.rapid(10.0, 0.0, 0.0)
    builder.arc(False, (-10.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=60.0)
    chords = math.floor(0.5 * math.pi * 10 / math.sqrt(0.002 * (20 - 0.002)))
    # … until the 15 chords that are known are too few to stop in: √(2 · 500 · 15 · length / chords).
    speed = min(60.0, math.sqrt(2 * 500 * 15 * 10 * math.pi / chords))
    assert seconds(builder.build(), GRBL) == pytest.approx(trapezoid_time(10 * math.pi, speed, 500.0), rel=0.02)


@pytest.mark.parametrize("between_moves", ["spindle", "dwell", "coolant", "tool", "offset"])
def test_whatever_is_done_between_moves_stops_them(between_moves: str) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(20.0, 0.0, feed=50.0)
    getattr(builder, between_moves)(0)
    builder.feed(50.0, 0.0, feed=50.0)
    each = [trapezoid_time(d, 50.0, 500.0) for d in (20.0, 30.0)]
    for machine, stops in ((MILL, 2 * STOP), (HAAS, 0.0)):
        assert measure_toolpath(builder.build(), machine).by_kind["feed"] == pytest.approx(sum(each) + stops)


def test_a_block_that_is_not_understood_stops_the_machine_and_keeps_the_place() -> None:
    """FRAME redefines x 20 as x 5: without a move, 30 mm follow to x 35."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(20.0, 0.0, feed=50.0)
    builder.set_place(Kind.FRAME, (5.0, 0.0, 0.0), 550)
    builder.feed(35.0, 0.0, feed=50.0)
    builder.set_place(Kind.FOREIGN, (math.nan, 0.0, 0.0), 0)
    builder.feed(95.0, 0.0, feed=50.0)
    found = measure_toolpath(builder.build(), MILL)
    assert found.cut_mm == pytest.approx(50.0)
    assert found.time_s == pytest.approx(sum(trapezoid_time(d, 50.0, 500.0) + STOP for d in (20.0, 30.0)))


def test_linuxcnc_stops_between_rapid_and_feed_in_line_and_grbl_does_not() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.rapid(30.0, 0.0)
    builder.feed(60.0, 0.0, feed=50.0)
    at_rest = trapezoid_time(30.0, 100.0, 500.0) + trapezoid_time(30.0, 50.0, 500.0)
    assert seconds(builder.build(), MILL) == pytest.approx(at_rest + 2 * STOP)
    assert seconds(builder.build(), HAAS) == pytest.approx(at_rest)
    assert seconds(builder.build(), GRBL) < at_rest - 0.05


def test_canned_cycles_are_run_in_exact_path_mode_under_g64() -> None:
    found = []
    for mode in (610, 640):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 10.0)
        builder.blending(mode)
        for i in range(5):
            builder.drill(7.0 * i, 3.0 * i, DrillCycle("G83", 2.0, -6.0, peck=2.0), feed=5.0)
        found.append(seconds(builder.build(), KINKED))
    assert found[0] == found[1]


def test_a_path_that_was_read_begins_in_g64_and_one_that_was_planned_in_g61() -> None:
    planned, read = (
        replace(path, line=np.full(len(path), line, dtype=np.int32))
        for line in (0, 7)
        for path in [replace(lines([(30, 0), (30, 30)]), kind=np.array([0, Kind.PAUSE, 1, 1], dtype=np.int8))]
    )
    assert seconds(planned, KINKED) == seconds(lines([(30, 0), (30, 30)], 610), KINKED)
    assert seconds(read, KINKED) == seconds(lines([(30, 0), (30, 30)], 640), KINKED)


def test_a_controller_that_sees_fifteen_blocks_goes_no_faster_than_it_can_stop_in_them() -> None:
    """300 moves of 0.2 mm in line: √(2 · 500 · 3) = 54.8 mm/s at most; the block that is run and
    the one that is read take two or three off, with 12 it is 49.0 mm/s, and 0.1 s are for the ramps."""
    path = lines([(0.2 * (i + 1), 0.0) for i in range(300)], feed=70.0)
    slowest = 60.0 / math.sqrt(2 * 500 * 3.0)
    assert slowest < seconds(path, GRBL) < 60.0 / math.sqrt(2 * 500 * 2.4) + 0.1
    assert seconds(path, HAAS) > seconds(lines([(60.0, 0.0)], feed=70.0), HAAS)  # G61: each of them at rest


def test_many_short_chords_within_the_tolerance_take_about_the_time_of_their_length() -> None:
    """1500 chords of 0.3 mm round r = 500 at 50 mm/s: 450 mm take 9 s and 0.1 s for the ramps; from rest to rest they
    take between 2 √(0.3 / 707) s (along the diagonal) and 2 √(0.3 / 500) s each."""
    angle = [0.3 / 500 * (i + 1) for i in range(1500)]
    places = [(500 * math.sin(a), 500 - 500 * math.cos(a)) for a in angle]
    assert 9.0 < seconds(lines(places, 640, 0.02), KINKED) < 9.4
    assert 1500 * 2 * math.sqrt(0.3 / 707.2) < seconds(lines(places, 611), KINKED) < 1500 * 2 * math.sqrt(0.3 / 499)


COORDINATE = st.integers(-400, 400).map(lambda tenths: tenths / 10)
WAY = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=12)
CASES = [(MILL, 610), (KINKED, 610), (GRBL, 610), (HAAS, 640)]


@pytest.mark.parametrize(("machine", "mode"), CASES)
@given(way=WAY)
def test_no_way_is_shorter_than_its_length_at_full_speed_nor_longer_than_at_rest(machine, mode, way) -> None:
    path = lines(way, mode)
    found = measure_toolpath(path, machine)
    assert found.time_s >= found.cut_mm / 50.0 - 1e-9
    slow = replace(machine, acceleration_factor=1.0) if machine is KINKED else machine
    at_rest = lines(way, 611) if machine.controller == "linuxcnc" else halting(way)
    share = machine.acceleration_factor
    assert found.time_s <= seconds(at_rest, slow) / share + 1e-9


@given(way=WAY, tolerance=st.sampled_from([0.0, 0.01, 0.3]))
def test_blending_is_never_slower_than_rest_to_rest_with_half_the_acceleration(way, tolerance) -> None:
    half = replace(MILL, acceleration=(250.0, 250.0, 125.0))
    assert seconds(lines(way, 640, tolerance), KINKED) <= seconds(lines(way, 611), half) + 1e-9


def halting(way: list[Place]) -> Toolpath:
    """Return the same way with a halt after every move."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    for i, (x, y) in enumerate(way):
        builder.feed(x, y, feed=50.0)
        builder.coolant(1 + i % 2)
    return builder.build()


def test_in_laser_mode_a_power_in_the_block_of_a_move_does_not_stop_the_machine() -> None:
    """Two moves in line, S between: one move with `line` 2 for both; but S alone on line 2, and any spindle, stop."""

    def seconds_with(line: int, machine: Machine) -> float:
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0, line=1)
        builder.spindle(300.0, line=1)
        builder.feed(20.0, 0.0, feed=50.0, line=1)
        builder.spindle(200.0, line=line, number=SPEED_ALONE)
        builder.feed(40.0, 0.0, feed=50.0, line=3)
        return seconds(builder.build(), machine)

    laser = replace(GRBL, head=Head.LASER)
    one, stop = trapezoid_time(40.0, 50.0, 500.0), 2 * trapezoid_time(20.0, 50.0, 500.0)
    found = [seconds_with(line, machine) for line, machine in ((3, laser), (2, laser), (3, GRBL))]
    # At every stop the motors are held for 25 ms; then lines are read and planned.
    assert found == pytest.approx([one, stop + 0.025, stop + 0.025], abs=0.012)


@pytest.mark.parametrize(("machine", "mode"), [case for case in CASES if case[0] is not GRBL])
@given(way=WAY)
def test_a_way_back_takes_as_long_as_the_way_there(machine, mode, way) -> None:
    back = [(x - way[-1][0], y - way[-1][1]) for x, y in [*way[-2::-1], (0.0, 0.0)]]
    there = seconds(lines(way, mode), machine)
    assert seconds(lines(back, mode), machine) == pytest.approx(there, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("machine", "mode"), [case for case in CASES if case[0] not in (KINKED, GRBL)])
@given(way=WAY, pieces=st.integers(2, 4))
def test_moves_in_pieces_take_as_long_as_whole_ones(machine, mode, way, pieces) -> None:
    """Not so where a part of the acceleration is kept back: only the pieces at a corner keep it."""
    cut, x, y = [], 0.0, 0.0
    for to_x, to_y in way:
        parts = pieces if math.hypot(to_x - x, to_y - y) > 1.0 else 1
        cut += [(x + (to_x - x) * k / parts, y + (to_y - y) * k / parts) for k in range(1, parts + 1)]
        x, y = to_x, to_y
    whole = seconds(lines(way, mode), machine)
    assert seconds(lines(cut, mode), machine) == pytest.approx(whole, rel=1e-6, abs=1e-6)


def test_a_corner_after_a_kilometre_costs_what_it_costs_anywhere() -> None:
    """Running sums over long paths lose no precision: 1,000,030 mm and then 30 mm, each from rest to rest."""
    path = lines([(1e6, 0.0), (1e6 + 30, 0.0), (1e6 + 30, 30.0)])
    expected = trapezoid_time(1e6 + 30, 50.0, 500.0) + trapezoid_time(30.0, 50.0, 500.0) + 2 * STOP
    assert seconds(path, MILL) == pytest.approx(expected, rel=1e-12)
