"""Whether moves touch keep-out rectangles."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from leafcut.geometry.zones import touches_any_zone, widen_zones

WHOLE = st.integers(-6, 6)
POINT = st.tuples(WHOLE, WHOLE)


def clipped(a: tuple[int, int], b: tuple[int, int], low: tuple[int, int], high: tuple[int, int]) -> bool:
    """Return whether anything of the segment is left when it is cut off at the four sides, in exact fractions."""
    enter, leave = Fraction(0), Fraction(1)
    for axis in (0, 1):
        step = b[axis] - a[axis]
        if step == 0:
            if not low[axis] <= a[axis] <= high[axis]:
                return False
            continue
        ends = sorted(Fraction(side - a[axis], step) for side in (low[axis], high[axis]))
        enter, leave = max(enter, ends[0]), min(leave, ends[1])
    return enter <= leave


@given(POINT, POINT, POINT, POINT)
def test_a_segment_touches_a_rectangle_exactly_when_something_of_it_lies_inside(a, b, c, d) -> None:
    low, high = (min(c[0], d[0]), min(c[1], d[1])), (max(c[0], d[0]), max(c[1], d[1]))
    zone = (float(c[0]), float(c[1]), float(d[0]), float(d[1]))
    assert bool(touches_any_zone([a], [b], [zone])[0]) is clipped(a, b, low, high)


def test_on_a_dogleg_machine_the_whole_rectangle_of_a_move_counts() -> None:
    """From (0, 0) to (10, 10) the straight way misses the corner at (9, 1); with unequal axes it need not."""
    zone = [(8.0, 0.0, 10.0, 2.0)]
    assert not touches_any_zone([(0, 0)], [(10, 10)], zone)[0]
    assert touches_any_zone([(0, 0)], [(10, 10)], zone, dogleg=True)[0]


def test_an_unknown_place_touches_nothing() -> None:
    assert not touches_any_zone([(np.nan, 0)], [(10, 10)], [(0, 0, 20, 20)])[0]


def test_a_zone_is_widened_on_every_side() -> None:
    assert widen_zones([[0.0, 1.0, 10.0, 5.0]], 2.5).tolist() == [[-2.5, -1.5, 12.5, 7.5]]
    assert widen_zones(np.zeros((0, 4)), 1.0).shape == (0, 4)
