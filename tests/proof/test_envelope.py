"""Exceeded limits of the machine are reported, axis by axis."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from leafcut.model.difference import Difference
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.proof.envelope import check_machine_limits

#: 400 × 200 × 300 mm; program zero 100 mm from the left and front limits, 250 mm above the lowest z.
MILL = Machine(
    "mill",
    "",
    "linuxcnc",
    (100.0, 100.0, 50.0),
    (500.0, 500.0, 250.0),
    20.0,
    (-400.0, -200.0, -300.0),
    (0.0, 0.0, 0.0),
    work_offset=(-300.0, -100.0, -50.0),
    spindle_min_rpm=100.0,
    spindle_max_rpm=6000.0,
)


def moves(*places: tuple[float, float, float]) -> Toolpath:
    builder = ToolpathBuilder()
    for line, place in enumerate(places, start=1):
        builder.rapid(*place, line=line)
    return builder.build()


def whats(path: Toolpath, machine: Machine = MILL) -> list[str]:
    return [str(d) for d in check_machine_limits(path, machine)]


def test_a_job_inside_the_travel_has_no_fault_up_to_the_limits() -> None:
    """x −100..300, y −100..100, z −250..50 in the program's coordinates."""
    assert whats(moves((-100, -100, -250), (300, 100, 50))) == []
    assert whats(ToolpathBuilder().build()) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "place, words",
    [
        ((300.1, 0, 0), "X in machine coordinates 0.100 mm is outside the machine's travel, -400.000 to 0.000"),
        ((-100.1, 0, 0), "X in machine coordinates -400.100"),
        ((0, 101, 0), "Y in machine coordinates 1.000"),
        ((0, 0, -251), "Z in machine coordinates -301.000"),
    ],
)
def test_a_place_outside_is_named_with_its_axis_and_line(place: tuple[float, float, float], words: str) -> None:
    found = whats(moves((0, 0, 0), place, (0, 0, 0), place))
    assert len(found) == 1
    assert words in found[0]
    assert "; number of such positions: 2 (line 2)" in found[0]


def test_without_a_work_offset_only_the_size_is_checked() -> None:
    machine = replace(MILL, work_offset=None)
    assert whats(moves((1000, 0, 0), (1400, 0, 0)), machine) == []
    found = whats(moves((1000, 0, 0), (1401, 0, 0)), machine)
    assert found == [
        "too large: X goes from 1000.000 to 1401.000 mm, 401.000 mm in all, but the machine's travel is 400.000 mm"
    ]


def test_bottoms_and_r_planes_of_holes_count() -> None:
    for cycle in (DrillCycle("G81", 2.0, -251.0), DrillCycle("G81", 51.0, -5.0)):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 10.0)
        builder.drill(0.0, 0.0, cycle, feed=2.0)
        assert any("Z in machine coordinates" in text for text in whats(builder.build()))


@pytest.mark.hazard
def test_the_bulge_of_an_arc_counts() -> None:
    """Half a circle from (250, −60) to (250, 60): both ends are inside, its rightmost point x = 310 is not."""
    builder = ToolpathBuilder()
    builder.rapid(250.0, -60.0, 0.0)
    builder.arc(False, (250.0, 60.0, 0.0), Arc((250.0, 0.0, 0.0)), feed=2.0)
    assert any("X in machine coordinates 10.000" in text for text in whats(builder.build()))
    builder = ToolpathBuilder()
    builder.rapid(250.0, -60.0, 0.0)
    builder.arc(True, (250.0, 60.0, 0.0), Arc((250.0, 0.0, 0.0)), feed=2.0)
    assert whats(builder.build()) == []


def test_an_arc_from_an_unknown_place_ends_no_check() -> None:
    builder = ToolpathBuilder()
    builder.arc(False, (0.0, 60.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=2.0)
    assert whats(builder.build()) == []


def test_moves_in_machine_coordinates_are_checked_without_a_work_offset_too() -> None:
    builder = ToolpathBuilder()
    builder.machine(z=1.0)
    for machine in (MILL, replace(MILL, work_offset=None)):
        assert any("Z in machine coordinates 1.000" in text for text in whats(builder.build(), machine))


def test_feeds_must_be_positive_and_not_above_the_highest() -> None:
    """20 mm/s is 1200 mm/min."""
    for feed, words in (
        (20.0, None),
        (20.2, "1212 mm/min, the machine allows at most 1200"),
        (2e6, "120,000,000 mm/min, the machine"),
        (0.0, "above 0"),
        (math.nan, "above 0"),
    ):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0)
        builder.feed(x=1.0, feed=feed)
        builder.drill(2.0, 0.0, DrillCycle("G81", 1.0, -1.0), feed=feed)
        found = whats(builder.build())
        assert (found == []) if words is None else (words in found[0] and found[0].endswith("of such moves: 2"))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "rpm, fine", [(6000, True), (6001, False), (-6001, False), (0, True), (99, False), (-100, True)]
)
def test_spindle_speeds_must_be_among_those_it_has(rpm: float, fine: bool) -> None:
    builder = ToolpathBuilder()
    builder.spindle(rpm)
    assert (whats(builder.build()) == []) is fine


@pytest.mark.parametrize(
    "head, told",
    [
        (Head.TORCH, []),
        (Head.WATER, []),
        (Head.LASER, ["S6001 is out of range; the laser power ranges from S100 to S6000"]),
    ],
)
def test_no_spindle_is_named_where_none_turns(head: Head, told: list[str]) -> None:
    """S is the power of a laser, and has no meaning for a torch or a jet."""
    builder = ToolpathBuilder()
    builder.spindle(6001)
    assert [found.text for found in check_machine_limits(builder.build(), replace(MILL, head=head))] == told


def test_every_exceeded_limit_is_one_difference_with_its_first_line_and_numbers() -> None:
    """20 mm/s is 1200 mm/min; the first place outside is that with the lowest line, not the farthest."""
    builder = ToolpathBuilder()
    builder.machine(y=0.5, line=1)
    builder.rapid(0.0, 0.0, 0.0, line=2)
    builder.rapid(x=301.0, line=3)
    builder.rapid(x=-102.0, line=4)
    builder.spindle(-50.5, line=5)
    builder.spindle(7000, line=6)
    builder.feed(x=0.0, feed=25.0, line=7)
    builder.arc(False, (0.0, 2.0, 0.0), Arc((0.0, 1.0, 0.0)), feed=0.0, line=8)
    builder.drill(2.0, 0.0, DrillCycle("G81", 1.0, -1.0), feed=30.0, line=9)
    assert check_machine_limits(builder.build(), MILL) == [
        Difference(
            "outside travel",
            0,
            3,
            "X in machine coordinates 1.000 mm is outside the machine's travel, -400.000 to 0.000 mm; "
            "number of such positions: 2",
        ),
        Difference(
            "outside travel",
            0,
            1,
            "Y in machine coordinates 0.500 mm is outside the machine's travel, -200.000 to 0.000 mm; "
            "number of such positions: 1",
        ),
        Difference(
            "feed too high", 0, 7, "the feed is 1500 mm/min, the machine allows at most 1200; number of such moves: 2"
        ),
        Difference("no feed", 0, 8, "the feed is 0 mm/min, the feed must be above 0; number of such moves: 1"),
        Difference("spindle speed", 0, 5, "50.5 rpm is out of range; the spindle turns 100 to 6000 rpm"),
        Difference("spindle speed", 0, 6, "7000 rpm is out of range; the spindle turns 100 to 6000 rpm"),
    ]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("beyond", "outside"), [(0.0009, False), (0.0011, True)])
def test_a_position_may_exceed_the_travel_by_its_rounding(axis: int, beyond: float, outside: bool) -> None:
    """Program coordinates without and with a work offset, and machine coordinates; at both ends."""
    low, high = [(-100.0, 300.0), (-100.0, 100.0), (-250.0, 50.0)][axis]
    zero = (MILL.work_offset or (0.0, 0.0, 0.0))[axis]
    for limit, sign in ((low, -1), (high, 1)):
        end = [0.0, 0.0, 0.0]
        end[axis] = limit + sign * beyond
        assert bool(whats(moves((0, 0, 0), tuple(end)))) is outside  # type: ignore[arg-type]
        builder = ToolpathBuilder()
        builder.machine(**{"xyz"[axis]: end[axis] + zero})
        assert bool(whats(builder.build())) is outside
    start, end = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    start[axis], end[axis] = low, high + beyond
    path = moves(tuple(start), tuple(end))  # type: ignore[arg-type]
    assert bool(whats(path, replace(MILL, work_offset=None))) is outside


@pytest.mark.parametrize(("feed", "high"), [(20.09, False), (20.11, True)])
def test_a_feed_may_exceed_the_limit_by_half_a_percent(feed: float, high: bool) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=1.0, feed=feed)
    assert [d.what for d in check_machine_limits(builder.build(), MILL)] == ["feed too high"] * high


@pytest.mark.parametrize(
    ("feed", "shown"), [(1e6 / 60, "1,000,000"), (999_999 / 60, "999999"), (123.4567 / 6, "1234.57")]
)
def test_a_feed_is_shown_with_six_digits_or_in_thousands(feed: float, shown: str) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=1.0, feed=feed)
    (found,) = check_machine_limits(builder.build(), replace(MILL, max_feed=10.0))
    assert found.text.startswith(f"the feed is {shown} mm/min, the machine allows at most 600;")


@pytest.mark.parametrize(
    ("rpm", "fine"), [(99.6, True), (99.4, False), (6000.4, True), (6000.6, False), (-99.4, False), (0.2, False)]
)
def test_a_spindle_speed_may_exceed_its_range_by_half_a_revolution(rpm: float, fine: bool) -> None:
    builder = ToolpathBuilder()
    builder.spindle(rpm)
    assert (whats(builder.build()) == []) is fine


def test_every_hole_counts_with_its_own_cycle() -> None:
    """Two places of the second hole exceed z by 1 mm above and below: -251 and 51."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    builder.drill(0.0, 0.0, DrillCycle("G81", 2.0, -5.0), feed=2.0, line=4)
    builder.drill(1.0, 0.0, DrillCycle("G81", 51.0, -251.0), feed=2.0, line=5)
    builder.drill(2.0, 0.0, DrillCycle("G81", 2.0, -5.0), feed=2.0, line=6)
    (found,) = check_machine_limits(builder.build(), MILL)
    assert found.new == 5 and found.text.endswith("; number of such positions: 3")
