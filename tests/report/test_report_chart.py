"""Charts of the search and bars of time."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.solution import Solution
from leafcut.report.chart import bar_svg, convergence_chart, stacked_bar_svg
from leafcut.report.svg import tick_step

FOUND = Solution(
    nodes=np.arange(3, dtype=np.int32),
    cost=20.0,
    unit="s",
    algorithm="mmas",
    seed=1,
    seconds=4.0,
    history=((1.0, 40.0), (2.0, 30.0), (3.0, 20.0)),
    lower_bound=10.0,
)


def curve(svg: str) -> list[float]:
    (path,) = [e for e in ET.fromstring(svg).iter("path") if e.get("class") == "curve"]
    return [float(n) for n in re.findall(r"-?[\d.]+", path.get("d", ""))]


def words(svg: str) -> set[str]:
    return {e.text or "" for e in ET.fromstring(svg).iter("text")}


def test_the_curve_is_a_staircase_in_the_right_proportions():
    """Seconds 1, 2, 3 and the end at 4 are evenly spaced; costs 40, 30, 20 too, falling down the page."""
    x1, y40, x2, y30, x3, y20, x4 = curve(convergence_chart(FOUND, None, "t"))
    assert [x3 - x2, x4 - x3] == pytest.approx([x2 - x1] * 2, abs=0.02)
    assert y30 - y40 == pytest.approx(y20 - y30, abs=0.02)
    assert y40 < y30


def test_bound_and_nearest_neighbour_are_lines_with_their_costs():
    svg = convergence_chart(FOUND, 50.0, "t")
    assert {"best 20.00 s", "lower bound 10.00 s", "nearest neighbour 50.00 s"} <= words(svg)
    levels = [e.get("class") for e in ET.fromstring(svg).iter("path") if "level" in (e.get("class") or "")]
    assert levels == ["level nearest", "level lower"]
    assert not any("bound" in w for w in words(convergence_chart(replace(FOUND, lower_bound=None), None, "t")))


def test_seconds_of_different_powers_of_ten_are_on_a_logarithmic_axis():
    history = ((0.01, 40.0), (0.1, 30.0), (1.0, 25.0), (10.0, 20.0))
    x = curve(convergence_chart(replace(FOUND, history=history, seconds=10.0), None, "t"))[::2]
    assert [x[2] - x[1], x[3] - x[2]] == pytest.approx([x[1] - x[0]] * 2, abs=0.02)
    assert {"0.01", "0.1", "1", "10"} <= words(convergence_chart(replace(FOUND, history=history), None, "t"))


def test_without_improvement_there_is_no_chart():
    for history in ((), ((0.0, 20.0),), ((math.nan, 1.0), (1.0, math.inf))):
        assert convergence_chart(replace(FOUND, history=history), None, "t") == ""


def test_a_long_history_is_thinned_but_keeps_its_ends():
    history = tuple((0.001 * i, 100_000.0 - i) for i in range(1, 50_000))
    svg = convergence_chart(replace(FOUND, history=history, cost=50_001.0, seconds=50.0), None, "t")
    whole = convergence_chart(
        replace(FOUND, history=history[:1] + history[-1:], cost=50_001.0, seconds=50.0), None, "t"
    )
    assert len(svg) < 20_000
    assert curve(svg)[:2] == curve(whole)[:2]
    assert curve(svg)[-2:] == curve(whole)[-2:]


@pytest.mark.parametrize("history", [((0.0, 5.0), (0.0, 5.0)), ((0.0, 0.0), (0.5, 0.0)), ((1e-9, -3.0), (1e9, -4.0))])
def test_degenerate_histories_are_drawn_with_finite_numbers(history):
    svg = convergence_chart(replace(FOUND, history=history, seconds=0.0, lower_bound=None), None, "t")
    assert "nan" not in svg
    assert "inf" not in svg


def rects(svg: str) -> dict[str, tuple[float, float]]:
    return {
        e.get("class", ""): (float(e.get("x", 0)), float(e.get("width", 0))) for e in ET.fromstring(svg).iter("rect")
    }


def test_times_are_stacked_in_proportion():
    """30 s of rapids and 20 s of cutting, beside a longest bar of 200 s: 15 % and 10 % of the width."""
    found = rects(stacked_bar_svg({"feed": 20.0, "rapid": 30.0, "dwell": 0.0}, 200.0))
    assert found == {"time rapid": (0.0, 15.0), "time feed": (15.0, 10.0)}
    assert rects(stacked_bar_svg({"rapid": 0.0}, 0.0)) == {}


@pytest.mark.parametrize("part, width", [(0.25, 25.0), (-1.0, 0.0), (2.0, 100.0), (math.nan, 0.0)])
def test_a_bar_stays_in_its_track(part, width):
    assert rects(bar_svg(part))["fill plain"] == (0.0, width)


@pytest.mark.parametrize("span, step", [(6.0, 1.0), (12.0, 2.0), (15.0, 2.0), (30.0, 5.0), (0.06, 0.01), (0.0, 1.0)])
def test_ticks_are_one_two_or_five_times_a_power_of_ten(span, step):
    assert tick_step(span, 6) == pytest.approx(step)


def test_the_words_of_the_lower_bound_stand_under_its_line():
    """Also where the bound is all but reached and the curve runs just above it."""
    root = ET.fromstring(convergence_chart(replace(FOUND, lower_bound=19.99), None, "t"))
    (line,) = [e for e in root.iter("path") if "lower" in (e.get("class") or "")]
    (said,) = [e for e in root.iter("text") if (e.text or "").startswith("lower bound")]
    level = float(re.findall(r"[\d.]+", line.get("d", ""))[1])
    assert level + 10 < float(said.get("y", "0")) < 190
