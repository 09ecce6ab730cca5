"""Rows that clear a surface: straight, side by side, evenly to one side, three at least."""

from __future__ import annotations

import numpy as np

from leafcut.model.toolpath import Kind, ToolpathBuilder
from leafcut.processes.program.proof.order_rules import build_visits, rows_in_order
from leafcut.processes.program.proof.order_thresholds import KEEP
from leafcut.processes.program.proof.traces import traces_of
from rewriting import features_in


def found(*rows: list[tuple[float, float]], bottoms: dict[int, float] | None = None) -> list[tuple[int, int]]:
    """Return the pairs of rows that keep their order."""
    deep = bottoms or {}
    builder = ToolpathBuilder()
    visit: list[int] = []
    for k, points in enumerate(rows):
        builder.rapid(*points[0], 5.0)
        builder.rapid(z=deep.get(k, -1.0))
        for x, y in points[1:]:
            builder.feed(x, y, feed=1.0)
            visit.append(k)
    path = builder.build()
    features = features_in(path, path.kind == Kind.FEED)
    visits = build_visits(features, traces_of(features), np.array(visit), len(rows), KEEP)
    return [tuple(pair) for pair in rows_in_order(visits, KEEP).tolist()]


def row(y: float, x0: float = 0.0, x1: float = 60.0) -> list[tuple[float, float]]:
    return [(x0, y), (x1, y)]


def test_three_rows_evenly_to_one_side_follow_each_other_and_two_do_not() -> None:
    assert found(row(0), row(8), row(16)) == [(0, 1), (1, 2)]
    assert found(row(0), row(8)) == []


def test_rows_there_and_back_are_rows_too() -> None:
    assert found(row(0), row(8, 60, 0), row(16), row(24, 60, 0)) == [(0, 1), (1, 2), (2, 3)]


def test_rows_that_turn_to_the_other_side_begin_anew_and_rows_that_widen_end() -> None:
    assert found(row(0), row(8), row(16), row(4), row(-8), row(-20)) == [(k, k + 1) for k in range(5)]
    assert found(row(0), row(8), row(16), row(4)) == [(0, 1), (1, 2)]
    assert found(row(0), row(8), row(30)) == []


def test_the_last_row_may_be_nearer_since_what_is_left_is_less() -> None:
    assert found(row(0), row(8), row(16), row(19)) == [(0, 1), (1, 2), (2, 3)]


def test_lines_at_other_depths_at_an_angle_bent_or_beyond_each_others_ends_are_no_rows() -> None:
    assert found(row(0), row(8), row(16), bottoms={1: -2.0}) == []
    assert found(row(0), [(0, 8), (60, 20)], row(32)) == []
    assert found(row(0), [(0, 8), (30, 14), (60, 8)], row(16)) == []
    assert found(row(0), row(8, 70, 130), row(16, 140, 200)) == []


def test_rows_farther_apart_than_they_are_long_or_than_any_mill_is_wide_are_none() -> None:
    assert found(row(0, 0, 20), row(25, 0, 20), row(50, 0, 20)) == []
    assert found(row(0, 0, 400), row(101, 0, 400), row(202, 0, 400)) == []
    assert found(row(0, 0, 400), row(99, 0, 400), row(198, 0, 400)) == [(0, 1), (1, 2)]
