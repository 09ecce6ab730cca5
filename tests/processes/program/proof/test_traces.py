"""Traces of cuts in XY: points of arcs by hand, and chords within their tolerance."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.arrays import Floats
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.traces import Traces, is_simple, traces_of
from rewriting import features_in

Point = tuple[float, float, float]
PI = math.pi


def features(path: Toolpath, dark: int = 1) -> Features:
    """Return all moves after the first rows as features."""
    return features_in(path, np.arange(len(path)) >= dark)


def arc(start: Point, end: Point, centre: Point, *, clockwise: bool = False, plane: int = 17, turns: int = 1) -> Traces:
    builder = ToolpathBuilder()
    builder.rapid(*start)
    builder.arc(clockwise, end, Arc(centre, plane, turns), feed=1.0)
    return traces_of(features(builder.build()))


def circle(radius: float, *degrees: float, x: float = 0.0, y: float = 0.0) -> Floats:
    angles = np.radians(degrees)
    return np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)


#: Arc → its traces: points from the start to the end, and the distance from the chord.
ARCS: dict[str, tuple[Traces, Floats, float]] = {
    "quarter": (arc((10, 0, 0), (0, 10, 0), (0, 0, 0)), circle(10, 0, 45, 90), 10 * (PI / 4) ** 2 / 8),
    "quarter clockwise": (
        arc((0, 10, 0), (10, 0, 0), (0, 0, 0), clockwise=True), circle(10, 90, 45, 0), 10 * (PI / 4) ** 2 / 8,
    ),
    "the long way round": (
        arc((0, 10, 0), (10, 0, 0), (0, 0, 0)), circle(10, 90, 135, 180, 225, 270, 315, 360), 10 * (PI / 4) ** 2 / 8
    ),
    "small": (arc((13, 4, 0), (12, 5, 0), (12, 4, 0)), circle(1, 0, 45, 90, x=12, y=4), (PI / 4) ** 2 / 8),
    "an eighth": (arc((10, 0, 0), (*circle(10, 45)[0], 0), (0, 0, 0)), circle(10, 0, 45), 10 * (PI / 4) ** 2 / 8),
    "more than an eighth": (
        arc((10, 0, 0), (*circle(10, 46)[0], 0), (0, 0, 0)), circle(10, 0, 23, 46), 10 * math.radians(23) ** 2 / 8
    ),
    "full circle": (
        arc((10, 0, 0), (10, 0, 0), (0, 0, 0)), circle(10, *range(0, 361, 45)), 10 * (PI / 4) ** 2 / 8
    ),
    "full circle clockwise": (
        arc((10, 0, 0), (10, 0, 0), (0, 0, 0), clockwise=True), circle(10, *range(360, -1, -45)), 10 * (PI / 4) ** 2 / 8
    ),
    # All turns of a helix about Z are one circle.
    "helix": (
        arc((10, 0, 0), (0, 10, -3), (0, 0, 0), turns=3), circle(10, *range(0, 361, 45)), 10 * (PI / 4) ** 2 / 8
    ),
    # From radius 10 to 12 in a quarter of a turn.
    "spiral": (
        arc((10, 0, 0), (0, 12, 0), (0, 0, 0)), np.array([(10, 0), circle(11, 45)[0], (0, 12)]),
        12 * (PI / 4) ** 2 / 8 + 1,
    ),
    # From radius 10 to 12 in one turn and a quarter.
    "spiral of two turns": (
        arc((10, 0, 0), (0, 12, 0), (0, 0, 0), turns=2),
        np.concatenate([circle(10 + 0.2 * k, 45 * k) for k in range(11)]), 12 * (PI / 4) ** 2 / 8 + 0.2,
    ),
    # G18: angles from Z to X; the arc rises by 8 in Y.
    "in ZX": (
        arc((0, 0, 10), (10, 8, 0), (0, 0, 0), plane=18), np.array([(0, 0), (10 * math.sqrt(0.5), 4), (10, 8)]),
        10 * (PI / 4) ** 2 / 8,
    ),
    # G19: angles from Y to Z.
    "in YZ": (
        arc((2, 10, 0), (4, 0, 10), (0, 0, 0), plane=19), np.array([(2, 10), (3, 10 * math.sqrt(0.5)), (4, 0)]),
        10 * (PI / 4) ** 2 / 8,
    ),
    # A helix in ZX keeps its turns: in XY it is a wave.
    "two turns in ZX": (
        arc((0, 0, 10), (0, 8, 10), (0, 0, 0), plane=18, turns=2),
        np.array([(10 * math.sin(PI / 4 * k), 0.5 * k) for k in range(17)]), 10 * (PI / 4) ** 2 / 8,
    ),
    # A bow is at most a diameter.
    "many turns": (
        arc((0, 0, 10), (0, 8, 10), (0, 0, 0), plane=18, turns=1280),
        np.array([(10 * math.sin(2.5 * PI * k), k / 128) for k in range(1025)]), 20.0,
    ),
    "no Z": (
        arc((10, 0, math.nan), (0, 10, math.nan), (0, 0, math.nan)), circle(10, 0, 45, 90), 10 * (PI / 4) ** 2 / 8
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ARCS)
def test_an_arc_is_traced_by_its_points(name: str) -> None:
    traces, points, bow = ARCS[name]
    assert traces.begin.tolist() == [pytest.approx(point, abs=1e-9) for point in points[:-1].tolist()]
    assert traces.end.tolist() == [pytest.approx(point, abs=1e-9) for point in points[1:].tolist()]
    n = len(points) - 1
    assert traces.bow.tolist() == [pytest.approx(bow)] * n
    assert (traces.feature.tolist(), traces.arc.tolist()) == ([0] * n, [0] * n)
    assert traces.low.tolist() == pytest.approx([k / n for k in range(n)])
    assert traces.high.tolist() == pytest.approx([(k + 1) / n for k in range(n)])


def test_an_arc_in_another_plane_without_z_is_a_straight_line() -> None:
    traces = arc((0, 0, math.nan), (10, 0, math.nan), (5, 0, math.nan), plane=18)
    assert (traces.begin.tolist(), traces.end.tolist()) == ([[10, 0]], [[10, 0]])
    assert (traces.bow.tolist(), traces.arc.tolist()) == ([0], [-1])


def test_straight_cuts_are_lines_and_other_work_is_a_point() -> None:
    builder = ToolpathBuilder()
    builder.feed(5.0, 6.0, feed=1.0)
    builder.feed(7.0, 8.0, feed=1.0)
    builder.dwell(1.0)
    builder.rapid(9.0, 8.0)
    traces = traces_of(features(builder.build(), 0))
    assert traces.feature.tolist() == [0, 1, 2, 3]
    assert traces.begin.tolist() == [[5, 6], [5, 6], [7, 8], [7, 8]]
    assert traces.end.tolist() == [[5, 6], [7, 8], [7, 8], [9, 8]]
    assert len(traces_of(features(ToolpathBuilder().build(), 0)).feature) == 0
    builder = ToolpathBuilder()
    builder.feed(5.0, feed=1.0)
    assert len(traces_of(features(builder.build(), 0)).feature) == 0


@pytest.mark.parametrize("name", [name for name in ARCS if name != "many turns"])
@pytest.mark.parametrize("sagitta", [0.5, 0.002])
def test_chords_are_within_their_tolerance(name: str, sagitta: float) -> None:
    traces = ARCS[name][0]
    chords = traces.flattened(sagitta)
    middle = traces.arcs.points_at(chords.arc, (chords.low + chords.high) / 2)
    lines = shapely.linestrings(np.stack([chords.begin, chords.end], axis=1))
    assert shapely.distance(lines, shapely.points(middle)).max() <= sagitta * 1.001
    assert chords.end[:-1].tolist() == chords.begin[1:].tolist()
    assert chords.begin[0].tolist() == traces.begin[0].tolist() and chords.end[-1].tolist() == traces.end[-1].tolist()
    assert chords.begin[1:].tolist() == [
        pytest.approx(p) for p in traces.arcs.points_at(chords.arc[1:], chords.low[1:]).tolist()
    ]
    assert (chords.bow <= sagitta).all() and len(set(zip(chords.low, chords.high, strict=True))) == len(chords.low)


@pytest.mark.parametrize(
    ("name", "sagitta", "count"),
    [
        # 0.7711 mm: a circle needs the root of the ratio, a spiral of 1.9253 mm the ratio itself.
        ("quarter", 0.7712, 2), ("quarter", 0.77, 4), ("quarter", 0.1928, 4), ("quarter", 0.19, 6),
        ("spiral", 1.926, 2), ("spiral", 1.92, 4), ("spiral", 0.97, 4), ("spiral", 0.96, 6), ("quarter", 1e-12, 2000),
    ],
)  # fmt: skip
def test_an_arc_has_as_many_chords_as_it_needs(name: str, sagitta: float, count: int) -> None:
    assert len(ARCS[name][0].flattened(sagitta).feature) == count


def test_a_line_beside_an_arc_stays_as_it_is() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(10.0, 0.0, feed=1.0)
    builder.arc(False, (0.0, 10.0, 0.0), Arc((0.0, 0.0, 0.0), 17, 1), feed=1.0)
    builder.feed(0.0, 0.0, feed=1.0)
    chords = traces_of(features(builder.build())).flattened(0.19)
    assert chords.feature.tolist() == [0, *[1] * 6, 2]
    np.testing.assert_allclose(chords.begin[1:7], circle(10, 0, 15, 30, 45, 60, 75), atol=1e-9)
    assert (chords.begin[0].tolist(), chords.end[-1].tolist()) == ([0, 0], [0, 0])


@pytest.mark.parametrize(
    ("points", "simple"),
    [
        ([(1, 0)], True), ([(1, 0), (1, 1)], True), ([(2, 0), (2, 2), (1, 2), (1, -1)], False),
        ([(2, 0), (2, 2), (1, 2), (1, 0)], False), ([(2, 0), (2, 2), (1, 2), (1, 0.5)], True),
        ([(2, 0), (2, 0), (2, 2)], True), ([(2, 0), (1, 0)], False),
    ],
)  # fmt: skip
def test_a_path_is_simple_unless_it_meets_itself(points: list[tuple[float, float]], simple: bool) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    for x, y in points:
        builder.feed(x, y, feed=1.0)
    assert is_simple(features(builder.build())) is simple


@pytest.mark.parametrize(("rise", "simple"), [(0.99, False), (1.01, True)])
def test_a_path_meets_an_arc_and_not_its_chord(rise: float, simple: bool) -> None:
    """From (1, 0) over the circle to (-1, 0), and back to (0, `rise`) inside or outside of it."""
    builder = ToolpathBuilder()
    builder.rapid(1.0, 0.0, 0.0)
    builder.arc(False, (-1.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0), 17, 1), feed=1.0)
    for point in ((-1.0, 3.0), (0.0, 3.0), (0.0, rise)):
        builder.feed(*point, feed=1.0)
    assert is_simple(features(builder.build())) is simple
