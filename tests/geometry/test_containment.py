"""Which outline lies in which, against shapely pair by pair."""

from __future__ import annotations

import random

import numpy as np
import pytest
import shapely

from leafcut.errors import PlanError
from leafcut.geometry import index, tidying
from leafcut.geometry.containment import find_outline_conflicts, nesting_depths_and_parents
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.tidying import chord_polygons


def squares(rows: list[tuple[float, float, float]]) -> np.ndarray:
    return np.array([shapely.box(x, y, x + a, y + a) for x, y, a in rows], dtype=object)


def test_depth_and_parent_are_those_of_all_pairs() -> None:
    draw = random.Random(3)
    rows = [(20.0 * i, 20.0 * j, 18.0) for i in range(6) for j in range(6)]
    rows += [(x + 2, y + 2, 14.0) for x, y, _ in rows if draw.random() < 0.7]
    rows += [(x + 1, y + 1, 5.0) for x, y, a in list(rows) if draw.random() < 0.5 and a == 14.0]
    draw.shuffle(rows)
    shapes = squares(rows)
    depth, parent = nesting_depths_and_parents(shapes)
    for k, shape in enumerate(shapes):
        holders = [j for j, other in enumerate(shapes) if j != k and other.contains(shape)]
        assert depth[k] == len(holders)
        assert parent[k] == (min(holders, key=lambda j: shapes[j].area) if holders else -1)


@pytest.mark.parametrize(
    "second, kind",
    [
        ((5, 5, 10), "overlap"),
        ((10, 0, 10), "touch"),
        ((10, 10, 3), "touch"),
        ((0, 2, 5), "touch"),
        ((0, 0, 10), "same"),
        ((9.995, 0, 10), "touch"),
        ((9.9, 0, 10), "overlap"),
    ],
)
def test_edges_that_meet_are_told_apart(second: tuple[float, float, float], kind: str) -> None:
    (found,) = find_outline_conflicts(squares([(0, 0, 10), second]))
    assert (found.first, found.second, found.kind) == (0, 1, kind)
    assert -0.1 <= found.place[0] <= 10.1 and -0.1 <= found.place[1] <= 10.1


def test_outlines_apart_or_inside_each_other_have_no_conflict() -> None:
    assert find_outline_conflicts(squares([(0, 0, 10), (11, 0, 10), (2, 2, 3), (30, 30, 1)])) == []


def test_more_outlines_inside_each_other_than_any_sheet_has_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(index, "MOST_PAIRS", 10)
    monkeypatch.setattr(index, "MOST_PER_SHAPE", 1)
    with pytest.raises(PlanError, match="millions of outlines inside each other"):
        nesting_depths_and_parents(squares([(k, k, 100 - 2 * k) for k in range(20)]))


def test_arcs_that_would_need_millions_of_chords_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tidying, "MOST_CHORDS", 500)
    with pytest.raises(PlanError, match="units"):
        chord_polygons([Polyline.circle(0, 0, 1e5)])
