"""What whole toolpaths cost: cases by hand, and bounds that hold for all."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.machine import Machine
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.timing.profile import move_time, trapezoid_time
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
    tool_change_s=8.0,
    spindle_start_s=2.0,
)

#: What LinuxCNC loses at every stop: half a servo cycle.
STOP = 0.0005


def drilled(*cycles: DrillCycle) -> Toolpath:
    """From (0, 0, 10), a hole every 30 mm in x."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    for number, cycle in enumerate(cycles, start=1):
        builder.drill(30.0 * number, 0.0, cycle, feed=2.0)
    return builder.build()


def test_two_holes_by_hand() -> None:
    """From (0, 0, 10), R 2, bottom −5, feed 2 mm/s, G99. Rapids: 30 mm in x, 8 mm down, 7 mm up, 30 mm, 7 mm up: 82 mm.
    x: 30/100 + 100/500 = 0.5 s. z, up to v²/a = 10 mm: 2 √(d/250): 8 mm 0.3578 s, 7 mm 0.3347 s. Feeds: two of 7 mm:
    7/2 + 2/250 = 3.508 s. Five rapids and two feeds end at rest."""
    cycle = DrillCycle("G81", 2.0, -5.0)
    found = measure_toolpath(drilled(cycle, cycle), MILL)
    assert found.travel_mm == pytest.approx(82.0)
    assert found.cut_mm == pytest.approx(14.0)
    assert found.by_kind["rapid"] == pytest.approx(2 * 0.5 + 2 * math.sqrt(8 / 250) + 4 * math.sqrt(7 / 250) + 5 * STOP)
    assert found.by_kind["feed"] == pytest.approx(2 * 3.508 + 2 * STOP)
    assert found.time_s == pytest.approx(sum(found.by_kind.values()))
    assert set(found.by_kind) == {"rapid", "feed", "dwell", "tool_change", "spindle"}


def test_a_retract_to_the_initial_plane_costs_its_way_up_and_down() -> None:
    """G98 from 10 instead of G99 at 2: after each hole 8 mm more up, and before the second 8 mm down: 24 mm."""
    low, high = DrillCycle("G81", 2.0, -5.0), DrillCycle("G81", 2.0, -5.0, to_initial=True)
    more = measure_toolpath(drilled(high, high), MILL).travel_mm - measure_toolpath(drilled(low, low), MILL).travel_mm
    assert more == pytest.approx(24.0)


def test_dwells_in_cycles_and_alone_are_added() -> None:
    builder = ToolpathBuilder([0.0, 0.0, 10.0])
    builder.drill(0.0, 0.0, DrillCycle("G82", 2.0, -1.0, dwell=0.5), feed=2.0)
    builder.dwell(1.5)
    assert measure_toolpath(builder.build(), MILL).by_kind["dwell"] == pytest.approx(2.0)


def test_every_change_to_another_tool_costs_and_the_first_one_too() -> None:
    builder = ToolpathBuilder()
    for tool in (1, 1, 2, 1):
        builder.tool(tool)
    assert measure_toolpath(builder.build(), MILL).by_kind["tool_change"] == pytest.approx(3 * 8.0)


def test_the_time_with_each_tool_is_that_of_its_own_path() -> None:
    """Two tools that start and end at the same place; before the first there is a move of 10 mm."""
    paths = []
    for tools in ([1], [2], [1, 2]):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0)
        builder.rapid(10.0)
        for number in tools:
            builder.tool(number)
            builder.feed(10.0 + 30.0 * number, feed=5.0)
            builder.feed(10.0, feed=5.0)
        paths.append(builder.build())
    first, second, both = (measure_toolpath(path, MILL) for path in paths)
    before = first.by_kind["rapid"]
    assert first.by_tool == second.by_tool == {}
    assert both.by_tool == pytest.approx({0: before, 1: first.time_s - before, 2: second.time_s - before})
    assert sum(both.by_tool.values()) == pytest.approx(both.time_s)


def test_the_spindle_costs_at_every_start_or_change_and_covers_the_dwell_after_it() -> None:
    """Start 2 s; the same speed again nothing; another speed 2 s; stop nothing; start with a dwell of 3 s: 3 s; after a
    tool change the same speed is a start again, with a dwell of 1 s: 2 s. A later dwell is a dwell."""
    builder = ToolpathBuilder()
    builder.spindle(1000)
    builder.spindle(1000)
    builder.spindle(-1000)
    builder.spindle(0)
    builder.spindle(500)
    builder.coolant(2)
    builder.dwell(3.0)
    builder.tool(1)
    builder.spindle(500)
    builder.dwell(1.0)
    builder.dwell(0.25)
    found = measure_toolpath(builder.build(), MILL).by_kind
    assert found["spindle"] == pytest.approx(2 + 2 + 3 + 2)
    assert found["dwell"] == pytest.approx(0.25)


def test_dwells_that_all_wait_for_a_beam_leave_no_other_dwell() -> None:
    """Ten pierces of 0.1 s, which add up to 0.9999999999999999 s in one order and to 1 s in another."""
    builder = ToolpathBuilder()
    for _ in range(10):
        builder.spindle(1000)
        builder.dwell(0.1)
        builder.spindle(0)
    found = measure_toolpath(builder.build(), replace(MILL, spindle_start_s=0.0)).by_kind
    assert found["dwell"] == 0.0
    assert math.copysign(1.0, found["dwell"]) == 1.0
    assert found["spindle"] == pytest.approx(1.0)


def test_an_arc_by_hand() -> None:
    """Half a circle of r = 10: 31.416 mm. The axes could run it at 100 mm/s, so half of 500 mm/s² is left along it: at
    20 mm/s 31.416/20 + 20/250. At 79 mm/s √(√3/2 · 500 · 10) = 65.8 rules. Other controls: √(a r) = 70.7, all of a."""
    for feed, speed in ((20.0, 20.0), (79.0, math.sqrt(math.sqrt(3) / 2 * 5000.0))):
        builder = ToolpathBuilder([10.0, 0.0, 0.0])
        builder.rapid(10.0, 0.0, 0.0)
        builder.arc(False, (-10.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=feed)
        found = measure_toolpath(builder.build(), MILL)
        assert found.cut_mm == pytest.approx(10 * math.pi)
        assert found.by_kind["feed"] == pytest.approx(trapezoid_time(10 * math.pi, speed, 250.0) + STOP)
        other = measure_toolpath(builder.build(), replace(MILL, controller="haas")).by_kind["feed"]
        assert other == pytest.approx(trapezoid_time(10 * math.pi, min(feed, math.sqrt(5000.0)), 500.0))


def test_a_helix_has_the_length_of_its_slope() -> None:
    """Two turns of r = 3 down 4 mm: √((2 · 2π · 3)² + 4²) = 37.91 mm."""
    builder = ToolpathBuilder()
    builder.rapid(3.0, 0.0, 0.0)
    builder.arc(True, (3.0, 0.0, -4.0), Arc((0.0, 0.0, 0.0), turns=2), feed=5.0)
    assert measure_toolpath(builder.build(), MILL).cut_mm == pytest.approx(math.hypot(12 * math.pi, 4.0))


def test_an_arc_from_a_place_that_is_not_known_costs_nothing() -> None:
    builder = ToolpathBuilder()
    builder.arc(True, (3.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=5.0)
    assert measure_toolpath(builder.build(), MILL).time_s == 0.0


def test_the_way_to_a_first_place_is_not_known_and_costs_nothing() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=10.0)
    builder.rapid(50.0, 60.0)
    assert measure_toolpath(builder.build(), MILL).time_s == 0.0


def up_and_back() -> Toolpath:
    """To z 10, up to machine zero, again, and back down to z 10."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    builder.machine(z=0.0)
    builder.machine(z=0.0)
    builder.rapid(z=10.0)
    return builder.build()


def test_moves_in_machine_coordinates_are_exact_where_the_work_offset_is_known() -> None:
    """Program zero at machine z −210: z 10 is machine −200, so 200 mm up and down, each 200/50 + 50/250 = 4.2 s."""
    found = measure_toolpath(up_and_back(), replace(MILL, work_offset=(-200.0, -100.0, -210.0)))
    assert found.travel_mm == pytest.approx(400.0)
    assert found.time_s == pytest.approx(8.4 + 2 * STOP)


def test_moves_in_machine_coordinates_are_estimated_as_half_the_travel_elsewhere() -> None:
    """Travel 300 mm: 150 mm up and 150 mm down, each 150/50 + 50/250 = 3.2 s; a length that is not known counts 0."""
    found = measure_toolpath(up_and_back(), MILL)
    assert found.time_s == pytest.approx(6.4 + 2 * STOP)
    assert found.travel_mm == 0.0


def test_moves_in_machine_coordinates_cost_nothing_where_the_travel_is_unknown_too() -> None:
    unknown = replace(MILL, travel_min=(-math.inf,) * 3, travel_max=(math.inf,) * 3)
    found = measure_toolpath(up_and_back(), unknown)
    assert (found.time_s, found.travel_mm) == (0.0, 0.0)


MOVE = st.tuples(
    st.sampled_from(["rapid", "feed", "drill"]),
    st.floats(-300, 300),
    st.floats(-300, 300),
    st.floats(-20, 20),
)


@given(st.lists(MOVE, max_size=12), st.sampled_from(["linear", "dogleg"]))
def test_no_toolpath_is_faster_than_its_lengths_at_full_speed(moves, style: str) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 30.0)
    for what, x, y, z in moves:
        if what == "rapid":
            builder.rapid(x, y, z)
        elif what == "feed":
            builder.feed(x, y, z, feed=7.0)
        else:
            builder.drill(x, y, DrillCycle("G83", 2.0, -9.0, peck=2.0), feed=7.0)
    found = measure_toolpath(builder.build(), replace(MILL, rapid_style=style))
    fastest = math.hypot(100.0, 100.0, 50.0)
    assert found.by_kind["rapid"] >= found.travel_mm / fastest - 1e-9
    assert found.by_kind["feed"] >= found.cut_mm / 7.0 - 1e-9


PLACE = st.integers(-900, 900).map(lambda tenths: tenths / 10)


@given(st.lists(st.tuples(PLACE, PLACE), min_size=1, max_size=8))
def test_holes_cost_the_sum_of_their_moves(places) -> None:
    """Added up move by move: across, down at the first, drill, up; every one from rest to rest."""
    cycle = DrillCycle("G81", 2.0, -5.0)
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    seconds = move_time((0.0, 0.0, -8.0), MILL) + STOP
    last = (0.0, 0.0)
    for place in places:
        builder.drill(*place, cycle, feed=2.0)
        seconds += move_time((place[0] - last[0], place[1] - last[1], 0.0), MILL) + STOP * (place != last)
        seconds += move_time((0.0, 0.0, -7.0), MILL, 2.0) + move_time((0.0, 0.0, 7.0), MILL) + 2 * STOP
        last = place
    assert measure_toolpath(builder.build(), MILL).time_s == pytest.approx(seconds)


def test_a_probe_is_a_feed_from_rest_to_the_height_that_is_said_after_it() -> None:
    """From 10 mm to the surface and 2 mm into the switch at 20 mm/s: 12 mm, with a cycle of drills before it."""
    builder = ToolpathBuilder([0.0, 0.0, 10.0])
    builder.rapid(0.0, 0.0, 10.0)
    builder.drill(0.0, 0.0, DrillCycle("G83", 2.0, -5.0, to_initial=True, peck=1.0), feed=5.0)
    without = measure_toolpath(builder.build(), MILL)
    builder.probe(-50.0, feed=20.0)
    builder.set_place(Kind.SHIFT, (0.0, 0.0, -2.0), 0)
    found = measure_toolpath(builder.build(), MILL)
    assert found.cut_mm - without.cut_mm == pytest.approx(12.0)
    alone = trapezoid_time(12.0, 20.0, MILL.acceleration[2] * MILL.acceleration_factor)
    assert found.time_s - without.time_s == pytest.approx(alone, abs=0.01)


def test_a_probe_whose_end_nobody_says_costs_nothing() -> None:
    builder = ToolpathBuilder([0.0, 0.0, 10.0])
    builder.probe(-50.0, feed=20.0)
    assert measure_toolpath(builder.build(), MILL).time_s == 0.0
