"""Short moves that become one, against their definition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.chords import MOST_POINTS, merge_chords
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Arc, ToolpathBuilder
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


def off(point: np.ndarray, begin: np.ndarray, end: np.ndarray) -> float:
    """Return the distance of a point from a chord, by testing many positions on it."""
    on_it = begin + np.linspace(0, 1, 20_001)[:, None] * (end - begin)
    return float(np.linalg.norm(on_it - point, axis=1).min())


def merged(point: np.ndarray, joins: np.ndarray, tolerance: float) -> list[bool]:
    begins = np.zeros(len(joins), dtype=bool)
    count = merge_chords(point, joins, np.full(len(joins), tolerance), begins)
    assert count == begins.sum()
    return begins.tolist()


@given(st.lists(st.tuples(*(st.integers(-3, 3),) * 3), min_size=1, max_size=12), st.data())
def test_every_chord_is_as_long_as_it_can_be(steps, data) -> None:
    point = np.concatenate([np.zeros((1, 3)), np.cumsum(np.add(steps, (4.0, 0.0, 0.0)), axis=0)])
    joins = np.array(data.draw(st.lists(st.booleans(), min_size=len(steps), max_size=len(steps))))
    begins = merged(point, joins, 1.7)
    first = 0
    for i in range(len(steps)):
        near = all(off(point[k], point[first], point[i + 1]) <= 1.7 + 1e-4 for k in range(first + 1, i + 1))
        far = any(off(point[k], point[first], point[i + 1]) > 1.7 - 1e-4 for k in range(first + 1, i + 1))
        if begins[i]:
            assert i == 0 or not joins[i] or far
            first = i
        else:
            assert joins[i] and near


def test_a_chord_passes_no_more_than_a_hundred_points() -> None:
    point = np.zeros((302, 3))
    point[:, 0] = np.arange(302)
    begins = merged(point, np.ones(301, dtype=bool), 0.1)
    assert np.flatnonzero(begins).tolist() == [0, MOST_POINTS + 1, 2 * MOST_POINTS + 2]


def test_a_way_there_and_back_is_not_one_chord() -> None:
    point = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])
    assert merged(point, np.ones(2, dtype=bool), 5.0) == [True, True]


@pytest.mark.parametrize("tolerance, one", [(0.06, True), (0.02, False)])
def test_a_bend_within_the_tolerance_is_cut_off(tolerance: float, one: bool) -> None:
    """20 mm to a point 0.05 mm off the line and 20 mm on: under P0.06 a single move of 40 mm, with half the
    acceleration
    as the last one under G64.
    """
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.blending(640, tolerance, tolerance)
    builder.feed(20.0, 0.05, feed=50.0)
    builder.feed(40.0, 0.0, feed=50.0)
    whole = 40 / 50 + 50 / 250 + 0.0005
    assert (measure_toolpath(builder.build(), MILL).time_s == pytest.approx(whole)) is one


def test_short_moves_are_joined_within_q_and_not_within_p() -> None:
    """The same bend of 0.05 mm: with P0.06 Q0.02 it is unchanged, as without P; with P0.02 Q0.06 it is cut off."""
    found = []
    for tolerance, joining in ((0.06, 0.02), (0.02, 0.06), (0.02, 0.0)):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0)
        builder.blending(640, tolerance, joining)
        builder.feed(20.0, 0.05, feed=50.0)
        builder.feed(40.0, 0.0, feed=50.0)
        found.append(measure_toolpath(builder.build(), MILL).time_s == pytest.approx(40 / 50 + 50 / 250 + 0.0005))
    assert found == [False, True, False]


def test_moves_of_another_feed_are_not_joined() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.blending(640, 0.1, 0.1)
    builder.feed(20.0, 0.0, feed=50.0)
    builder.feed(40.0, 0.0, feed=5.0)
    assert measure_toolpath(builder.build(), MILL).time_s > 20 / 50 + 20 / 5


def test_a_flat_arc_is_run_as_chords() -> None:
    """10 mm of r = 10,000 bulge 0.00125 mm: with P0.02 they, and the 10 mm of line that go on from there, are one move
    of 20 mm, with half the acceleration as the last one under G64; with P0.001 the arc stays one, with all of it."""
    angle = 10.0 / 10_000.0
    found = []
    for tolerance in (0.02, 0.001):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0)
        builder.blending(640, tolerance, tolerance)
        end = (10_000 * math.sin(angle), 10_000 * (1 - math.cos(angle)), 0.0)
        builder.arc(False, end, Arc((0.0, 10_000.0, 0.0)), feed=50.0)
        builder.feed(end[0] + 10 * math.cos(angle), end[1] + 10 * math.sin(angle), feed=50.0)
        found.append(measure_toolpath(builder.build(), MILL).time_s)
    assert found == pytest.approx([20 / 50 + 50 / 250 + 0.0005, 20 / 50 + 25 / 500 + 25 / 250 + 0.0005], rel=1e-4)
