"""Groups of cuts: bridges over detached scrap, and common lines without a cut around them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut.model.difference import Difference
from leafcut.processes.sheet.proof.sheet import _crossing_faults, _detached_scrap_faults, _group_faults


def claim(index: int, shape: Any) -> Any:
    return SimpleNamespace(target=SimpleNamespace(index=index, shape=shape))


RUN: Any = SimpleNamespace(line=7)


@pytest.mark.parametrize(
    ("bridge", "contour"),
    [([(0, 5), (10, 5)], 4), ([(0, 0), (2, 5)], 0), ([(20, 5), (40, 5)], 0), ([(0, 5), (29, 5)], 5)],
)
def test_a_bridge_over_detached_scrap_is_found_by_its_middle(bridge: list[tuple[int, int]], contour: int) -> None:
    done = [claim(2, None), claim(3, shapely.box(2, 0, 8, 10)), claim(4, shapely.box(12, 0, 18, 10))]
    text = f"a bridge crosses scrap or a part that contour {contour} has detached"
    expected = [Difference("chain", 0, 7, text)] if contour else []
    assert _detached_scrap_faults(RUN, done, shapely.LineString(bridge)) == expected


def runs_of(*lines: list[tuple[float, float]]) -> Any:
    """Return runs along lines, which start in program lines 10, 20, …"""
    runs = [
        SimpleNamespace(line=10 * k, points=np.array(points, dtype=float), start=points[0])
        for k, points in enumerate(lines, 1)
    ]
    return SimpleNamespace(runs=runs, kerf_lines=[shapely.LineString(points) for points in lines], kerf=1.5)


@pytest.mark.parametrize("around", [0, 2])
def test_common_lines_have_one_cut_around_them(around: int) -> None:
    laid = runs_of([(5, 0), (5, 10)], *[[(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]] * around)
    cuts = [SimpleNamespace(group=3, common=10.0), *[SimpleNamespace(group=3, common=0.0)] * around]
    laid.plan = SimpleNamespace(cuts=[*cuts, SimpleNamespace(group=4, common=0.0)])
    text = f"{around} cuts, instead of a single one, go around parts with common lines"
    assert list(_group_faults(laid, 3, [0])) == [Difference("out of order", 0, 10, text)]


@pytest.mark.parametrize(
    ("late", "place"),
    [
        ([(0, 5), (10, 5)], "X5.000 Y5.000"), ([(0, 5), (5.05, 5)], ""), ([(0, 5), (5.11, 5)], "X5.000 Y5.000"),
        ([(0, 5), (4, 5)], ""), ([(5, 5), (10, 5)], "X5.000 Y5.000"),
    ],
)  # fmt: skip
def test_a_common_line_meets_an_earlier_one_only_at_its_end(late: list[tuple[float, float]], place: str) -> None:
    laid = runs_of([(5, 0), (5, 10)], late)
    text = f"a common line crosses an earlier one at {place}"
    assert list(_crossing_faults(laid, [1, 0])) == ([Difference("crosses a kerf", 0, 20, text)] if place else [])
