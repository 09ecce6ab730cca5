"""The runs of the torch in a program: rows by hand, compensated paths against the offsets of shapely."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut.model.toolpath import Arc, ToolpathBuilder
from leafcut.processes.sheet.proof.torch_runs import (
    FLATNESS,
    Lighting,
    TorchRun,
    arc_chord_ends,
    burning_sections,
    compensated_path,
    torch_runs,
)

#: An outline with outer and inner corners, counter-clockwise.
OUTLINE = [(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (25.0, 30.0), (25.0, 10.0), (15.0, 10.0), (15.0, 30.0), (0.0, 20.0)]


def lit(x: float = 0.0, y: float = 0.0) -> ToolpathBuilder:
    """At a place, with the torch on since line 3, and half a second waited."""
    builder = ToolpathBuilder()
    builder.rapid(z=10.0)
    builder.rapid(x, y)
    builder.feed(z=3.8, feed=5.0)
    builder.spindle(-1000.0, line=3, number=2)
    builder.dwell(0.2)
    builder.dwell(0.3)
    return builder


def values(run: TorchRun) -> dict[str, list[Any]]:
    names = ("points", "burning", "feed", "height", "row_line")
    return {name: getattr(run, name).tolist() for name in names}


def test_each_chord_has_the_state_of_its_row() -> None:
    """The second chord is dark, the third lower and faster; a feed in Z alone has no chord and ends the delay."""
    builder = lit(1.0, 2.0)
    builder.feed(z=1.5, feed=4.0)
    builder.dwell(9.0)
    builder.feed(x=11.0, feed=25.0, line=5)
    builder.torch(False)
    builder.feed(y=12.0, feed=25.0, line=6)
    builder.torch(True)
    builder.feed(1.0, 12.0, 1.0, feed=30.0, line=7)
    builder.spindle(0)
    builder.rapid(x=50.0)
    (run,) = torch_runs(builder.build())
    assert values(run) == {
        "points": [[1.0, 2.0], [11.0, 2.0], [11.0, 12.0], [1.0, 12.0]],
        "burning": [True, False, True],
        "feed": [25.0, 25.0, 30.0],
        "height": [1.5, 1.5, 1.0],
        "row_line": [5, 6, 7],
    }
    assert run.line == 3 and run.start == (1.0, 2.0) and run.along.tolist() == [0.0, 10.0, 20.0, 30.0]
    assert run.lightings == (Lighting(3, 3.8, 1000.0, 2, 0.5),)
    assert [line.tolist() for line in run.lines()] == [[[1.0, 2.0], [11.0, 2.0]], [[11.0, 12.0], [1.0, 12.0]]]


def test_a_rapid_across_ends_a_run_and_one_in_z_alone_does_not() -> None:
    builder = lit()
    builder.feed(x=10.0, feed=25.0)
    builder.rapid(z=5.0)
    builder.feed(x=20.0, feed=25.0)
    builder.machine(z=0.0)
    builder.feed(x=30.0, feed=25.0)
    builder.rapid(y=9.0)
    builder.feed(x=40.0, feed=25.0, line=8)
    builder.machine(x=0.0)
    builder.feed(x=50.0, feed=25.0, line=9)
    builder.spindle(0)
    builder.rapid(y=0.0)
    builder.feed(x=60.0, feed=25.0)
    runs = torch_runs(builder.build())
    assert [len(run.feed) for run in runs] == [3, 1, 1]
    assert [run.line for run in runs] == [3, 8, 9]
    assert [len(run.lightings) for run in runs] == [1, 0, 0]


def test_a_torch_that_is_lit_and_put_out_in_place_is_a_run_without_chords() -> None:
    builder = lit(7.0, 8.0)
    builder.spindle(0)
    builder.rapid(x=50.0)
    (run,) = torch_runs(builder.build())
    assert run.points.tolist() == [[7.0, 8.0]] and len(run.burning) == 0 and run.lines() == []
    assert torch_runs(ToolpathBuilder().build()) == []


def test_a_dwell_after_the_torch_is_off_or_after_a_move_is_no_pierce_delay() -> None:
    builder = lit()
    builder.spindle(0)
    builder.dwell(1.0)
    builder.spindle(500.0)
    builder.feed(x=1.0, feed=2.0)
    builder.dwell(1.0)
    builder.rapid(x=50.0)
    (run,) = torch_runs(builder.build())
    assert [(one.power, one.waited) for one in run.lightings] == [(1000.0, 0.5), (500.0, 0.0)]


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("sweep", [0.5, math.pi, 5.0])
def test_the_chords_of_an_arc_lie_within_the_flatness_and_end_at_its_end(ccw: bool, sweep: float) -> None:
    radius, sign = 20.0, 1 if ccw else -1
    angle = 0.3 + sign * sweep
    builder = lit(5.0 + radius * math.cos(0.3), 6.0 + radius * math.sin(0.3))
    end = (5.0 + radius * math.cos(angle), 6.0 + radius * math.sin(angle), 3.8)
    builder.arc(not ccw, end, Arc((5.0, 6.0, 0.0)), feed=25.0, line=4)
    path = builder.build()
    row = len(path) - 1
    chords = arc_chord_ends(path, row)
    assert chords[-1].tolist() == list(end[:2])
    assert np.hypot(*(chords - [5.0, 6.0]).T) == pytest.approx(radius)
    steps = np.diff(np.unwrap(np.concatenate([[0.3], np.arctan2(chords[:, 1] - 6.0, chords[:, 0] - 5.0)])))
    assert steps == pytest.approx(np.full(len(chords), sign * sweep / len(chords)))
    sagitta = radius * (1.0 - math.cos(0.5 * sweep / len(chords)))
    fewer = radius * (1.0 - math.cos(0.5 * sweep / (len(chords) - 1)))
    assert sagitta <= FLATNESS < fewer
    (run,) = torch_runs(path)
    assert run.points[1:].tolist() == chords.tolist() and set(run.row_line.tolist()) == {4}


def test_an_arc_as_small_as_the_flatness_has_two_chords_at_most() -> None:
    builder = lit(0.001, 0.0)
    builder.arc(False, (-0.001, 0.0, 3.8), Arc((0.0, 0.0, 0.0)), feed=25.0)
    path = builder.build()
    assert arc_chord_ends(path, len(path) - 1).tolist() == [[-0.001, 0.0]]


@pytest.mark.parametrize("side", [0.75, -0.75])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_compensated_outline_is_the_offset_of_shapely(side: float, reverse: bool) -> None:
    """Rounded at outer corners, at the intersection at inner ones; the first chord leads from the outline to it."""
    corners = OUTLINE[::-1] if reverse else OUTLINE
    start = (0.5 * (corners[0][0] + corners[-1][0]), 0.5 * (corners[0][1] + corners[-1][1]))
    points = np.array([start, *corners, start])
    path, chord = compensated_path(points, np.full(len(points) - 1, side))
    outward = (side > 0) == reverse
    # The ring starts at the offset of the first point; the path reaches the ring at the end of the first chord.
    area = shapely.Polygon(corners).buffer(abs(side) if outward else -abs(side), quad_segs=64)
    ring = area.exterior
    assert max(ring.distance(shapely.Point(p)) for p in path[1:].tolist()) <= 2.0 * FLATNESS
    assert path[0].tolist() == list(start)
    length = float(np.hypot(*np.diff(path[1:], axis=0).T).sum())
    first = float(np.hypot(*(path[1] - path[-1])))
    assert length + first == pytest.approx(ring.length, abs=0.05)
    assert len(chord) == len(path) - 1 and (np.diff(chord) >= 0).all()
    assert sorted(set(chord.tolist())) == list(range(len(points) - 1))


def test_a_path_without_compensation_stays_and_one_that_ends_returns_to_its_line() -> None:
    points = np.array([(0.0, 0.0), (10.0, 0.0), (20.0, 0.0), (30.0, 0.0), (40.0, 0.0)])
    same, chord = compensated_path(points, np.zeros(4))
    assert same.tolist() == points.tolist() and chord.tolist() == [0, 1, 2, 3]
    path, chord = compensated_path(points, np.array([0.0, 2.0, 2.0, 0.0]))
    assert path.tolist() == [[0, 0], [10, 0], [20, 2], [30, 2], [40, 0]] and chord.tolist() == [0, 1, 2, 3]
    path, _ = compensated_path(points, np.array([0.0, -2.0, -2.0, 0.0]))
    assert path.tolist() == [[0, 0], [10, 0], [20, -2], [30, -2], [40, 0]]


@pytest.mark.parametrize(
    ("mode", "register", "kerf", "y"), [(41, 1.5, None, 0.75), (42, 1.5, None, -0.75), (40, 1.5, None, 0.0),
                                        (41, 31.0, 2.0, 1.0), (42, 31.0, 2.0, -1.0)]
)  # fmt: skip
def test_the_controller_offsets_by_half_the_kerf_to_its_side(
    mode: int, register: float, kerf: float | None, y: float
) -> None:
    """G41 is to the left. The D word is the kerf, or the register whose content is given."""
    builder = lit()
    builder.radius(mode, register)
    builder.feed(x=10.0, feed=25.0)
    builder.feed(x=20.0, feed=25.0)
    builder.rapid(x=50.0)
    (run,) = torch_runs(builder.build(), kerf)
    assert run.points.tolist() == [[0.0, 0.0], [10.0, y], [20.0, y]]


def test_burning_pieces_are_as_many_equal_parts_as_their_length_needs() -> None:
    """Chords of 10, 3 (dark) and 4 mm in pieces of at most 4 mm: three, and one."""
    run = TorchRun(
        1,
        np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 3.0), (6.0, 3.0)]),
        np.array([True, False, True]),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3, dtype=np.int32),
        (),
    )
    middle, length, along = burning_sections(run, 4.0)
    third = 10.0 / 3.0
    assert middle == pytest.approx(np.array([(0.5 * third, 0.0), (1.5 * third, 0.0), (2.5 * third, 0.0), (8.0, 3.0)]))
    assert length.tolist() == pytest.approx([third, third, third, 4.0])
    assert along.tolist() == pytest.approx([0.5 * third, 1.5 * third, 2.5 * third, 15.0])
