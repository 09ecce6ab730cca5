"""Classes of cutting: their sums, saving and loading."""

from __future__ import annotations

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut, CutChoice, CutTimes, Lead


def slow_start() -> Cut:
    path = Polyline.of_points([(0, 0), (30, 0), (30, 70)])
    choice = CutChoice((0,), (0.0, 0.0), "clockwise", Lead("line", 10.0, 1.5))
    return Cut((0,), path, 10.0, 90.0, 95.0, ((0.0, 5.0), (10.0, 20.0)), choice, part=1)


def test_the_time_of_a_cut_is_the_sum_over_its_speeds() -> None:
    assert slow_start().seconds == pytest.approx(10 / 5 + 90 / 20)  # 2 s of lead-in, then 90 mm at 20 mm/s


def test_a_batch_is_so_many_sheets() -> None:
    one = CutTimes(10.0, 2.0, 3.0, 400.0, 90.0, 380.0, 20.0, 4)
    assert one.total_s == 15.0
    assert one.length_mm == 380.0 - 20.0 + 90.0
    assert one.multiplied_by(3) == CutTimes(30.0, 6.0, 9.0, 1200.0, 270.0, 1140.0, 60.0, 12)
