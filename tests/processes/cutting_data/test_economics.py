"""Time, cost and tool life: closed forms and figures that others have printed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.model.tool import Tool
from leafcut.model.work_material import ToolLife, WorkMaterial
from leafcut.processes.cutting_data.economics import (
    CuttingResults,
    Prices,
    ToolWork,
    cutting_results,
    deep_hole_factor,
    index_of_best,
    tool_life,
)

ANY = WorkMaterial("any", 1700.0, 0.25)


def taylor(c: float, n: float, diameter: float = 0.0, feed: float = 0.0) -> ToolLife:
    """Return Taylor's v T^n = C with C in m/min at a life of 1 min."""
    constant = c * 1000.0 / 60.0 * 60.0**n
    return ToolLife(CuttingWork.MILL, ToolMaterial.HSS, constant, n, diameter, feed)


def turning(c: float, n: float, diameter: float, length: float, handling: float) -> ToolWork:
    """Return a turned part, mm and min. It rotates like a tool: speed and feed are those of a one-toothed mill."""
    return ToolWork(Tool(1, diameter), CuttingWork.MILL, (taylor(c, n),), fed=length, cut=length, idle=60.0 * handling)


def at_speed(work: ToolWork, prices: Prices, speed: float | np.ndarray, feed: float) -> CuttingResults:
    """Return the results of cutting speeds, m/min, at a feed, mm per revolution."""
    rpm = np.atleast_1d(np.asarray(speed, dtype=float)) * 1000.0 / (math.pi * work.tool.diameter)
    return cutting_results(work, ANY, prices, rpm, feed * rpm / 60.0, 1.0)


#: Groover, Fundamentals of Modern Manufacturing, example 23.3: HSS, n 0.125, C 70 m/min; a bar of 100 × 500 mm, 0.25
#: mm/rev; 5 min handling, 2 min tool change; 30 $/h; 3 $ by edge.
GROOVER = turning(70.0, 0.125, 100.0, 500.0, 5.0)
GROOVER_PRICES = Prices(30.0 / 3600.0, 3.0, 120.0, math.inf)


def test_groovers_example_has_its_printed_times_and_tool_lives() -> None:
    """Example 23.4 prints at 50 m/min 12.57 min and 14.76 min, at 42 m/min 14.96 min and 59.54 min."""
    found = at_speed(GROOVER, GROOVER_PRICES, np.array([50.0, 42.0]), 0.25)
    assert (found.life / 60.0) == pytest.approx([14.76, 59.54], abs=0.005)
    cutting = found.time / 60.0 - 5.0 - 2.0 * found.worn
    assert cutting == pytest.approx([12.57, 14.96], abs=0.005)
    assert 1.0 / found.worn == pytest.approx([1.17, 3.98], abs=0.005)


def test_groovers_example_has_its_printed_costs_where_tools_are_changed_between_parts_alone() -> None:
    """It prints 12.79 $ and 11.32 $ with 1 and 3 whole parts by one tool; a part's share of a tool is ours."""
    found = at_speed(GROOVER, GROOVER_PRICES, np.array([50.0, 42.0]), 0.25)
    by_tool = GROOVER_PRICES.rate * GROOVER_PRICES.change + GROOVER_PRICES.tool
    without = found.cost - found.worn * by_tool
    assert without + by_tool / np.array([1.0, 3.0]) == pytest.approx([12.79, 11.32], abs=0.01)
    assert found.cost[1] < 11.32


@pytest.mark.parametrize(("objective", "printed"), [("time", 50.0), ("cost", 42.0)])
def test_the_best_speed_of_a_grid_is_groovers_closed_form(objective: str, printed: float) -> None:
    """v = C (n/(1−n) · Co/(Co Tt + Ct))^n (eq. 23.13); with Ct = 0 it is the speed of the minimum time (eq. 23.7)."""
    n, c, rate, change, edge = 0.125, 70.0, 0.5, 2.0, 3.0 if objective == "cost" else 0.0
    closed = c * (n / (1.0 - n) * rate / (rate * change + edge)) ** n
    grid = np.arange(20.0, 80.0, 0.01)
    found = at_speed(GROOVER, GROOVER_PRICES, grid, 0.25)
    best = grid[index_of_best(found, objective)]
    assert best == pytest.approx(closed, abs=0.011)
    assert best == pytest.approx(printed, abs=0.5)


def test_the_high_speed_steel_of_a_published_batch_has_the_closed_forms_speed_and_life() -> None:
    """C 80 m/min, n 0.13, 3 min change, 20/15 + 2 $ by grind, 40 $/h (answer.ya.guru 7309021, equations i and ii).

    T = (3 + 3.333/0.6667)(1/0.13 − 1) = 8 × 6.6923 = 53.54 min; v = 80/53.54^0.13 = 47.68 m/min.
    """
    work = turning(80.0, 0.13, 73.0, 250.0, 3.0)
    prices = Prices(40.0 / 3600.0, 20.0 / 15.0 + 2.0, 180.0, math.inf)
    grid = np.arange(30.0, 70.0, 0.01)
    found = at_speed(work, prices, grid, 0.3)
    best = index_of_best(found, "cost")
    assert grid[best] == pytest.approx(47.68, abs=0.015)
    assert found.life[best] / 60.0 == pytest.approx(53.54, rel=3e-3)


@given(st.floats(0.1, 0.5), st.floats(20.0, 800.0), st.floats(0.2, 3.0), st.floats(0.5, 10.0), st.floats(0.0, 50.0))
def test_the_closed_form_speed_is_no_dearer_than_any_other(
    n: float, c: float, rate: float, change: float, edge: float
) -> None:
    """For any Taylor tool and prices, min and currency by min."""
    work = turning(c, n, 50.0, 200.0, 1.0)
    prices = Prices(rate / 60.0, edge, 60.0 * change, math.inf)
    closed = c * (n / (1.0 - n) * rate / (rate * change + edge)) ** n
    found = at_speed(work, prices, closed * np.linspace(0.3, 3.0, 271), 0.2)
    best = at_speed(work, prices, closed, 0.2)
    assert (found.cost >= best.cost * (1.0 - 1e-9)).all()


def test_the_time_of_a_published_hole_is_its_length_by_its_feed() -> None:
    """A drill of 28 mm, 0.4 mm/rev, 250 rpm, 133 mm with run-in and overrun: 1.33 min (Nefedov and Osipov, ex. 33)."""
    work = replace(
        GROOVER, tool=Tool(1, 28.0), work=CuttingWork.DRILL, fed=133.0, cut=120.0, idle=0.0, hole_depth=120.0
    )
    found = cutting_results(
        work, ANY, Prices(0.0, 0.0, 0.0, math.inf), np.array([250.0]), np.array([100.0 / 60.0]), 1.0
    )
    assert found.time[0] / 60.0 == pytest.approx(1.33)
    assert found.chip[0] == pytest.approx(0.4)


def test_published_drills_go_down_as_fast_as_printed() -> None:
    """5/16 in, 0.005 in/rev, 300 ft/min: roughly 18 in/min (Cutting Tool Engineering, Economics of Drilling, 2025)."""
    diameter, chip = 5 / 16 * 25.4, 0.005 * 25.4
    rpm = 300.0 * 304.8 / (math.pi * diameter)
    work = replace(GROOVER, tool=Tool(1, diameter), work=CuttingWork.DRILL, fed=12.7, cut=12.7, idle=0.0)
    found = cutting_results(
        work, ANY, Prices(0.0, 0.0, 0.0, math.inf), np.array([rpm]), np.array([chip * rpm / 60.0]), 1.0
    )
    assert found.speed[0] * 60.0 / 304.8 == pytest.approx(300.0)
    assert found.chip[0] == pytest.approx(chip)
    assert 0.5 / (found.time[0] / 60.0) == pytest.approx(18.0, abs=0.5)


def test_each_feed_has_the_life_of_the_law_in_whose_range_it_is() -> None:
    """7.0 D^0.4/(T^0.2 f^0.7) up to 0.2 mm, 9.8 D^0.4/(T^0.2 f^0.5) from there."""
    low = taylor(7.0, 0.2, diameter=0.4, feed=0.7)
    high = replace(taylor(9.8, 0.2, diameter=0.4, feed=0.5), least_feed=0.2)
    work = ToolWork(Tool(1, 10.0), CuttingWork.MILL, (low, high), 1.0, 1.0)
    speed = 20.0 * 1000.0 / 60.0
    found = tool_life(work, np.full(3, speed), np.array([0.1, 0.2, 0.3])) / 60.0
    expected = [
        (7.0 * 10**0.4 / (20.0 * 0.1**0.7)) ** 5,
        (9.8 * 10**0.4 / (20.0 * 0.2**0.5)) ** 5,
        (9.8 * 10**0.4 / (20.0 * 0.3**0.5)) ** 5,
    ]
    assert found == pytest.approx(expected)


def test_a_drill_stands_less_speed_in_a_deep_hole() -> None:
    """Three diameters 1, four 0.85, eight and more 0.6; with m = 0.2 four diameters leave 0.85^5 of the life."""
    assert [deep_hole_factor(d, 10.0) for d in (5, 30, 35, 40, 80, 200)] == pytest.approx([1, 1, 0.925, 0.85, 0.6, 0.6])
    work = ToolWork(Tool(1, 10.0), CuttingWork.DRILL, (taylor(9.8, 0.2),), 1.0, 1.0, hole_depth=40.0)
    flat = replace(work, hole_depth=30.0)
    speed, chip = np.array([300.0]), np.array([0.2])
    assert tool_life(work, speed, chip) == pytest.approx(0.85**5 * tool_life(flat, speed, chip))


def test_a_tool_is_replaced_at_the_longest_life_that_is_counted_on() -> None:
    """At 20 m/min a part is 31.4 min in the cut: of an hour 0.52 tools."""
    slow = at_speed(GROOVER, GROOVER_PRICES._replace(longest=3600.0), 20.0, 0.25)
    assert slow.life == pytest.approx([3600.0])
    assert slow.worn == pytest.approx([math.pi * 100 * 500 / (0.25 * 20_000.0) / 60.0])


def test_equals_are_told_apart_by_the_other_objectives_then_by_the_lower_speed() -> None:
    columns = {name: np.zeros(4) for name in CuttingResults._fields}
    columns |= {
        "rpm": np.array([300.0, 100.0, 200.0, 50.0]),
        "time": np.array([1.0, 2.0, 1.0, 1.0]),
        "cost": np.array([2.0, 1.0, 1.0, 1.0]),
        "life": np.array([9.0, 9.0, 5.0, 5.0]),
    }
    found = CuttingResults(**columns)
    assert {objective: index_of_best(found, objective) for objective in ("time", "cost", "life")} == {
        "time": 3,
        "cost": 3,
        "life": 1,
    }
