"""Columns of moves against the same said move by move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.toolpath import Arc, ToolpathBuilder, arc_radius_start_sweep, plane_axes
from leafcut.model.turns import arc_turns
from leafcut.timing.lookahead import MotionSegments, segment_move_seconds

ARC = st.tuples(
    st.sampled_from([17, 18, 19]),
    st.booleans(),
    st.floats(0.5, 30.0),
    st.floats(-3.1, 3.1),
    st.floats(0.01, 6.28),
    st.integers(1, 3),
    st.floats(-5.0, 5.0),
)


@given(st.lists(ARC, min_size=1, max_size=5))
def test_arcs_in_columns_are_those_of_the_model(arcs) -> None:
    """Radius, sweep and length, and the tangents' directions by moving a little along the arc."""
    builder = ToolpathBuilder()
    for plane, clockwise, radius, start, sweep, turns, rise in arcs:
        first, second, normal = plane_axes(plane)
        begin, end, turned = [0.0] * 3, [0.0] * 3, start - sweep if clockwise else start + sweep
        begin[first], begin[second] = radius * math.cos(start), radius * math.sin(start)
        end[first], end[second], end[normal] = radius * math.cos(turned), radius * math.sin(turned), rise
        builder.rapid(*begin)
        builder.arc(clockwise, (end[0], end[1], end[2]), Arc((0.0, 0.0, 0.0), plane, turns), feed=1.0)
    path = builder.build()
    found = arc_turns(path)
    for i, row in enumerate(found.row.tolist()):
        radius, _, sweep = arc_radius_start_sweep(path, row)
        assert found.turn.radius[i] == pytest.approx(radius)
        assert found.turn.sweep[i] == pytest.approx(abs(sweep))
        assert found.length[i] == pytest.approx(math.hypot(radius * sweep, arcs[i][6]))
        assert radius * found.turn.out[i] == pytest.approx(path.end[row - 1], abs=1e-9)
        along = np.cross(found.turn.normal[i], found.turn.out[i])
        turned = math.copysign(1e-6, sweep)
        first, second, _ = plane_axes(arcs[i][0])
        step = path.end[row - 1] / radius
        moved = [math.cos(turned) * step[first] - math.sin(turned) * step[second] - step[first]]
        moved.append(math.sin(turned) * step[first] + math.cos(turned) * step[second] - step[second])
        assert [1e-6 * along[first], 1e-6 * along[second]] == pytest.approx(moved, abs=1e-11)


def by_hand(length, velocity, acceleration, join, depth: int) -> list[float]:
    """Return every piece's seconds by the definition: nowhere faster than allows to stop `depth` pieces on."""
    n = len(length)
    limit = [min(join[i], velocity[i], velocity[i + 1]) for i in range(n - 1)] + [0.0]
    ahead = []
    for i in range(n):
        last = min(i + depth, n - 1)
        square = 0.0 if last == i + depth and depth else limit[last] ** 2
        for j in range(last - 1, i - 1, -1):
            square = min(limit[j] ** 2, square + 2 * acceleration[j + 1] * length[j + 1])
        ahead.append(min(square, limit[i] ** 2))
    times, speed = [], 0.0
    for i in range(n):
        reached = min(ahead[i], speed**2 + 2 * acceleration[i] * length[i])
        end = math.sqrt(reached)
        peak = min(velocity[i], math.sqrt((2 * acceleration[i] * length[i] + speed**2 + end**2) / 2))
        ramp = (2 * peak**2 - speed**2 - end**2) / (2 * acceleration[i])
        times.append((2 * peak - speed - end) / acceleration[i] + max(length[i] - ramp, 0.0) / peak)
        speed = end
    return times


POSITIVE = st.floats(0.1, 40.0)


@given(st.lists(st.tuples(POSITIVE, POSITIVE, POSITIVE, st.floats(0.0, 40.0)), min_size=1, max_size=30), st.data())
def test_running_minima_are_the_passes_from_piece_to_piece(pieces, data) -> None:
    depth = data.draw(st.integers(1, 12))
    columns = np.array(pieces).T
    found = segment_move_seconds(MotionSegments(*columns, move=np.arange(len(pieces))), depth)
    assert found == pytest.approx(by_hand(*columns.tolist(), depth=depth), rel=1e-6, abs=1e-6)
