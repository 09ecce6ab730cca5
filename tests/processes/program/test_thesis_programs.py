"""Drilling programs of a Fagor as the thesis writes them: timed and reordered, as schools have them on paper."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from leafcut import api
from leafcut.model.toolpath import Kind

#: The feed stands before the units, T1.1 is tool 1 with offset 1, N80 is given twice, and X0 Y0 after G80 has no G0.
TEXT = """\
%PLATE,MX,
N10 F150 G71
N20 G90 G17 G94
N30 T1.1
N40 M6
N50 S1200 M3
N60 G0 G43 X0 Y0 Z20
N70 G81 G99 X10 Y10 Z2 I-8
N80 X90 Y80
N80 X20 Y12
N90 X80 Y85
N100 X30 Y15
N110 X70 Y78
N120 G80
N130 X0 Y0
N140 G0 Z20
N150 M30
"""
HOLES = [(10, 10), (90, 80), (20, 12), (80, 85), (30, 15), (70, 78)]


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "plate.pim").write_text(TEXT)
    return tmp_path / "plate.pim"


def along(order: tuple[tuple[int, int], ...] | list[tuple[int, int]]) -> float:
    """Return the distance from zero over the holes and back."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise([(0, 0), *order, (0, 0)]))


def test_it_takes_the_time_of_its_feeds_and_its_tool_change(program: Path) -> None:
    """Six holes of 10 mm at 150 mm/min are 24 s; the rapids visit the holes in the written order and return."""
    found = api.simulate(program, machine="fagor-8055")
    assert found.measure.by_kind["feed"] == pytest.approx(24.0, abs=0.02)  # and to speed up
    assert found.measure.cut_mm == pytest.approx(60.0)
    rises = 18.0 + 6 * 10.0 + 18.0  # to the R plane, out of each hole, up at the end
    assert found.measure.travel_mm == pytest.approx(along(HOLES) + rises, abs=0.01)


def test_it_is_reordered_to_the_shortest_of_all_orders(program: Path, tmp_path: Path) -> None:
    outcome = api.optimize(program, tmp_path / "new.pim", machine="fagor-8055", objective="distance", iterations=50)
    path = outcome.path_after
    order = [tuple(place) for place in path.end[path.kind == Kind.DRILL][:, :2].tolist()]
    assert sorted(order) == sorted(HOLES)
    best = min(along(one) for one in itertools.permutations(HOLES))
    assert outcome.after.travel_mm - (outcome.before.travel_mm - along(HOLES)) == pytest.approx(best, abs=0.01)
    lines = [line for line in outcome.text.splitlines() if "leafcut" not in line]
    assert lines[1:7] == TEXT.splitlines()[1:7]
    again = api.simulate(tmp_path / "new.pim", machine="fagor-8055")
    assert again.measure.time_s == pytest.approx(outcome.after.time_s)
    assert np.array_equal(again.path.kind, path.kind)
