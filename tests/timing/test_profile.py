"""The time of one move: cases by hand, and bounds that hold for all."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.machine import Machine
from leafcut.timing.profile import move_time, trapezoid_time

LENGTH = st.floats(0, 5000)
POSITIVE = st.floats(0.1, 5000)
SIGNED = st.floats(-3000, 3000)


def mill(style: str = "linear", **facts: object) -> Machine:
    """Return a machine of round numbers: 100/100/50 mm/s, 500/500/250 mm/s²."""
    values: dict[str, object] = {
        "rapid_velocity": (100.0, 100.0, 50.0),
        "acceleration": (500.0, 500.0, 250.0),
        "max_feed": 80.0,
        "travel_min": (-400.0, -200.0, -300.0),
        "travel_max": (0.0, 0.0, 0.0),
        "rapid_style": style,
    }
    return Machine("mill", "", "linuxcnc", **{**values, **facts})  # type: ignore[arg-type]


def simulated(distance: float, velocity: float, acceleration: float) -> float:
    """Return the time by pushing a point along in small steps: full thrust while it could still stop in time."""
    position = speed = time = 0.0
    step = 2e-6
    while distance - position > 1e-6 * distance:
        brake = speed * speed / (2 * acceleration) >= distance - position
        speed = max(1e-4, speed - acceleration * step) if brake else min(velocity, speed + acceleration * step)
        position += speed * step
        time += step
    return time


def test_a_long_move_by_hand() -> None:
    """100 mm at 50 mm/s and 100 mm/s²: 0.5 s up (12.5 mm), 75 mm at 50 mm/s = 1.5 s, 0.5 s down: 2.5 s."""
    assert trapezoid_time(100.0, 50.0, 100.0) == pytest.approx(2.5)


def test_a_short_move_by_hand() -> None:
    """4 mm at most 50 mm/s with 100 mm/s²: 2 mm up in 0.2 s (to 20 mm/s), 2 mm down in 0.2 s: 0.4 s."""
    assert trapezoid_time(4.0, 50.0, 100.0) == pytest.approx(0.4)


def test_both_formulas_meet_where_the_velocity_is_just_reached() -> None:
    """25 mm at 50 mm/s with 100 mm/s²: d = v²/a, so 2 √(d/a) = d/v + v/a = 1 s."""
    assert trapezoid_time(25.0, 50.0, 100.0) == pytest.approx(1.0)
    assert trapezoid_time(25.0 - 1e-9, 50.0, 100.0) == pytest.approx(1.0)


def test_no_way_takes_no_time() -> None:
    assert trapezoid_time(0.0, 50.0, 100.0) == 0.0
    assert trapezoid_time(np.zeros(2), 50.0, 100.0).tolist() == [0.0, 0.0]
    assert move_time((0.0, 0.0, 0.0), mill()) == 0.0
    assert move_time((0.0, 0.0, 0.0), mill(), feed=10.0) == 0.0


@pytest.mark.parametrize("case", [(3.0, 20.0, 100.0), (10.0, 20.0, 100.0), (0.5, 20.0, 300.0)])
def test_a_point_pushed_along_in_small_steps_takes_as_long(case: tuple[float, float, float]) -> None:
    assert trapezoid_time(*case) == pytest.approx(simulated(*case), rel=1e-2)


@given(LENGTH, POSITIVE, POSITIVE)
def test_no_move_is_faster_than_its_velocity_or_its_acceleration_allows(d: float, v: float, a: float) -> None:
    time = trapezoid_time(d, v, a)
    assert time >= d / v * (1 - 1e-12)
    assert time >= 2 * math.sqrt(d / a) * (1 - 1e-12)
    assert time == pytest.approx(float(trapezoid_time(np.array([d]), v, a)[0]))


@given(LENGTH, LENGTH, POSITIVE, POSITIVE)
def test_a_stop_on_the_way_costs_time(d: float, e: float, v: float, a: float) -> None:
    """The triangle inequality, on which bounds and local search rest."""
    assert trapezoid_time(d + e, v, a) <= trapezoid_time(d, v, a) + trapezoid_time(e, v, a) + 1e-9


def test_a_slanting_rapid_on_a_linear_machine_by_hand() -> None:
    """(30, 0, 40) is 50 mm along (0.6, 0, 0.8): v = min(100/0.6, 50/0.8) = 62.5, a = min(500/0.6, 250/0.8) = 312.5;
    v²/a = 12.5 < 50, so t = 50/62.5 + 62.5/312.5 = 0.8 + 0.2 = 1 s."""
    assert move_time((30.0, 0.0, -40.0), mill()) == pytest.approx(1.0)


def test_a_slanting_rapid_on_a_dogleg_machine_is_its_slowest_axis() -> None:
    """x: 30/100 + 100/500 = 0.5 s; z: 40/50 + 50/250 = 1 s."""
    assert move_time((30.0, 0.0, -40.0), mill("dogleg")) == pytest.approx(1.0)
    assert move_time((30.0, 0.0, 0.0), mill("dogleg")) == pytest.approx(0.5)


def test_the_factor_takes_part_of_the_acceleration() -> None:
    """40 mm at 100 mm/s with 0.5 × 500 mm/s² = 250: v²/a = 40: 2 √(40/250) = 0.8 s."""
    assert move_time((40.0, 0.0, 0.0), mill(acceleration_factor=0.5)) == pytest.approx(0.8)


def test_a_cut_runs_at_its_feed_as_far_as_axes_and_machine_allow() -> None:
    """10 mm at 2 mm/s: 5 s + 2/500. At 90 mm/s the machine's 80 rule; z alone is limited to 50 mm/s. No feed counts as
    the highest."""
    assert move_time((10.0, 0.0, 0.0), mill(), feed=2.0) == pytest.approx(5.004)
    assert move_time((100.0, 0.0, 0.0), mill(), feed=90.0) == pytest.approx(100 / 80 + 80 / 500)
    assert move_time((0.0, 0.0, 100.0), mill(), feed=90.0) == pytest.approx(100 / 50 + 50 / 250)
    assert move_time((100.0, 0.0, 0.0), mill(), feed=0.0) == pytest.approx(100 / 80 + 80 / 500)
    assert move_time((30.0, 0.0, 40.0), mill("dogleg"), feed=10.0) == pytest.approx(
        move_time((30, 0, 40), mill(), 10.0)
    )


@given(SIGNED, SIGNED, SIGNED, st.sampled_from(["linear", "dogleg"]))
def test_rapids_keep_every_axis_within_its_limits(x: float, y: float, z: float, style: str) -> None:
    machine = mill(style, acceleration_factor=0.9)
    time = move_time((x, y, z), machine)
    axes = [
        trapezoid_time(abs(d), v, 0.9 * a)
        for d, v, a in zip((x, y, z), machine.rapid_velocity, machine.acceleration, strict=True)
    ]
    assert time >= max(axes) * (1 - 1e-9)
    if style == "dogleg":
        assert time == pytest.approx(max(axes))


@given(SIGNED, SIGNED, SIGNED)
def test_a_linear_rapid_is_the_trapezoid_along_its_line(x: float, y: float, z: float) -> None:
    machine = mill()
    distance = math.hypot(x, y, z)
    if distance < 1e-6:
        return
    unit = [abs(c) / distance for c in (x, y, z)]
    v = min(v / u for v, u in zip(machine.rapid_velocity, unit, strict=True) if u)
    a = min(a / u for a, u in zip(machine.acceleration, unit, strict=True) if u)
    assert move_time((x, y, z), machine) == pytest.approx(trapezoid_time(distance, v, a))


def test_many_moves_at_once_are_the_same_as_one_by_one() -> None:
    delta = np.random.default_rng(1).uniform(-50, 50, (20, 3))
    feeds = np.linspace(0, 60, 20)
    for machine in (mill(), mill("dogleg")):
        assert move_time(delta, machine).tolist() == pytest.approx([move_time(tuple(d), machine) for d in delta])
        each = [move_time(tuple(d), machine, float(f)) for d, f in zip(delta, feeds, strict=True)]
        assert move_time(delta, machine, feeds).tolist() == pytest.approx(each)


def test_what_is_not_known_costs_nothing() -> None:
    assert move_time((math.nan, 30.0, math.nan), mill()) == move_time((0.0, 30.0, 0.0), mill())
