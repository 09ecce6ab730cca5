"""Areas that cuts enclose: squares by hand, for both thresholds in doubt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
import shapely

from leafcut.model.toolpath import Arc, DrillCycle, ToolpathBuilder
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.order_thresholds import FREE, KEEP, OrderThresholds
from leafcut.processes.program.proof.outlines import (
    Line,
    Outline,
    area_of,
    is_point,
    joined_outlines,
    lines_starting_inside,
    outlines_of,
    task_lines,
)
from leafcut.processes.program.proof.traces import traces_of
from rewriting import features_in

BOTH = pytest.mark.parametrize("doubt", [KEEP, FREE], ids=["keep", "free"])
SIDE = 10.0
SQUARE = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)]


def line(*points: tuple[float, float], owner: int = 0) -> Line:
    return Line(owner, np.array(points))


def square_with_gap(gap: float) -> np.ndarray:
    """A square that starts at a corner and ends `gap` short of it."""
    return np.array([*SQUARE, (0.0, gap)])


@BOTH
def test_a_closed_square_is_its_area_for_certain(doubt: OrderThresholds) -> None:
    for points in ([*SQUARE, SQUARE[0]], [*SQUARE[::-1], SQUARE[3]]):
        area, alone = area_of(np.array(points), doubt)
        assert area.equals(shapely.Polygon(SQUARE)) and alone


@pytest.mark.parametrize(
    ("doubt", "gap", "closed", "alone"),
    [
        (FREE, 0.009, True, True),
        (FREE, 0.011, False, False),
        (KEEP, 0.004, True, True),
        (KEEP, 0.006, True, False),
        # A tenth of the length of 40 mm less the gap.
        (KEEP, 3.6, True, False),
        (KEEP, 3.7, False, False),
    ],
)
def test_a_gap_leaves_a_line_closed_in_doubt_or_open(
    doubt: OrderThresholds, gap: float, closed: bool, alone: bool
) -> None:
    area, certain = area_of(square_with_gap(gap), doubt)
    assert (area is not None) is closed and certain is alone
    if closed:
        assert area.equals(shapely.Polygon([*SQUARE, (0.0, gap)]))


@BOTH
def test_fewer_than_four_points_or_a_spot_enclose_nothing(doubt: OrderThresholds) -> None:
    triangle = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)])
    assert area_of(triangle, doubt)[0].area == 0.5
    assert area_of(triangle[:3], doubt) == (None, False)
    assert area_of(triangle * 0.01, doubt) == (None, False)
    assert area_of(np.array([(0.0, 0.0), (9.0, 0.0), (0.0, 0.0), (9.0, 0.0), (0.0, 0.0)]), doubt) == (None, False)


@BOTH
def test_leads_that_cross_the_outline_are_no_part_of_its_area(doubt: OrderThresholds) -> None:
    """The lead-in starts outside; the lead-out ends inside, farther away than any gap that may be closed."""
    points = [(5.0, -9.0), (5.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0), (5.0, 0.0), (5.0, 5.0)]
    area, alone = area_of(np.array(points), doubt)
    assert alone and area.symmetric_difference(shapely.Polygon(SQUARE)).area < 0.01
    assert shapely.Polygon(SQUARE).buffer(1e-6).covers(area)


@BOTH
def test_two_rounds_of_an_outline_are_one_area_and_a_figure_of_eight_both_loops(doubt: OrderThresholds) -> None:
    twice = [*SQUARE, *SQUARE, SQUARE[0]]
    area, alone = area_of(np.array(twice), doubt)
    assert alone and area.symmetric_difference(shapely.Polygon(SQUARE)).area < 0.01
    eight = [(0.0, 0.0), (SIDE, SIDE), (SIDE, 0.0), (0.0, SIDE), (0.0, 0.0)]
    area, alone = area_of(np.array(eight), doubt)
    loops = shapely.union_all(shapely.polygonize([shapely.node(shapely.LineString(eight))]))
    assert alone and loops.area == pytest.approx(50.0)
    assert area.symmetric_difference(loops).area < 0.05


def test_a_line_of_very_many_points_encloses_its_hull_in_doubt() -> None:
    """A star of 20,001 points: its hull is the circle through its tips."""
    angle = np.linspace(0.0, math.tau, 20_001)
    radius = np.where(np.arange(20_001) % 2, 5.0, 10.0)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    area, alone = area_of(points, KEEP)
    assert area.equals(shapely.MultiPoint(points).convex_hull) and alone
    points[-1] += 0.01
    assert not area_of(points, KEEP)[1]
    assert area_of(np.column_stack([angle, angle]), KEEP) == (None, False)
    points[-1] -= 0.01
    fewer = points[:-2]
    assert area_of(fewer, KEEP)[0].area < 0.8 * area.area


def sides(gap: float, leave_out: int = -1, reverse: Sequence[int] = ()) -> list[Line]:
    """The sides of the square as lines 3, 2, 1 and 0, each shorter by half the gap at both ends."""
    lines = []
    corners = np.array([*SQUARE, SQUARE[0]])
    for k, (a, b) in enumerate(pairwise(corners)):
        step = 0.5 * gap * (b - a) / SIDE
        points = np.array([a + step, b - step])
        if k != leave_out:
            lines.append(Line(3 - k, points[::-1] if k in reverse else points))
    return lines


@BOTH
@pytest.mark.parametrize("reverse", [(), (0,), (1, 3)])
def test_sides_that_meet_within_the_tab_are_one_outline_of_all_their_pieces(
    doubt: OrderThresholds, reverse: Sequence[int]
) -> None:
    """The ends at a corner are gap/√2 apart."""
    for gap, joined in ((0.0, True), (1.0, True), (1.4, True), (1.45, False)):
        found = list(joined_outlines(sides(gap, reverse=reverse), 1.0, doubt))
        assert [(o.owners, o.alone, o.joined) for o in found] == [([0, 1, 2, 3], False, True)] * joined
        for outline in found:
            assert outline.area.area == pytest.approx(100.0 - gap * gap / 2.0, abs=1.0)
            assert shapely.Polygon(SQUARE).buffer(0.01).covers(outline.area)


@BOTH
def test_three_sides_or_a_side_that_crosses_close_nothing_or_in_doubt_only(doubt: OrderThresholds) -> None:
    assert list(joined_outlines(sides(1.0, leave_out=2), 1.0, doubt)) == []
    assert list(joined_outlines([], 1.0, doubt)) == []


@BOTH
def test_two_halves_of_an_outline_are_one(doubt: OrderThresholds) -> None:
    halves = [line(*SQUARE[:3], owner=5), line(*SQUARE[2:], SQUARE[0], owner=2)]
    (found,) = joined_outlines(halves, 0.05, doubt)
    assert found.owners == [2, 5] and found.area.symmetric_difference(shapely.Polygon(SQUARE)).area < 0.05


def test_a_cut_from_an_unknown_place_and_a_hole_are_points() -> None:
    builder = ToolpathBuilder()
    builder.feed(x=5.0, feed=1.0)
    builder.feed(y=6.0, feed=1.0)
    builder.feed(x=9.0, feed=1.0)
    builder.drill(3.0, 4.0, DrillCycle("G81", 2.0, -1.0), feed=1.0)
    builder.arc(True, (5.0, 4.0, 2.0), Arc((4.0, 4.0, 2.0)), feed=1.0)
    traces = traces_of(features(builder))
    straight = traces.pick(traces.arc < 0)
    assert straight.feature.tolist() == [1, 2, 3]
    assert straight.begin.tolist() == [[5.0, 6.0], [5.0, 6.0], [3.0, 4.0]]
    assert straight.end.tolist() == [[5.0, 6.0], [9.0, 6.0], [3.0, 4.0]]
    curved = traces.pick(traces.arc >= 0)
    assert curved.feature.tolist() == [4] * 4 and curved.low.tolist() == [0.0, 0.25, 0.5, 0.75]
    half = math.sqrt(0.5)
    middle = [(3.0, 4.0), (4.0 - half, 4.0 + half), (4.0, 5.0), (4.0 + half, 4.0 + half), (5.0, 4.0)]
    assert curved.begin == pytest.approx(np.array(middle[:-1])) and curved.end == pytest.approx(np.array(middle[1:]))


def test_lines_that_enclose_an_area_without_a_ring_do_so_only_in_doubt() -> None:
    """Four lines crossing at the corners: an area, but three ends beyond each corner are free."""
    cross = [
        line((-2.0, 0.0), (12.0, 0.0), owner=0),
        line((10.0, -2.0), (10.0, 12.0), owner=1),
        line((12.0, 10.0), (-2.0, 10.0), owner=2),
        line((0.0, 12.0), (0.0, -2.0), owner=3),
    ]
    (found,) = joined_outlines(cross, 0.05, KEEP)
    assert found.owners == [0, 1, 2, 3]
    assert found.area.symmetric_difference(shapely.Polygon(SQUARE)).area < 0.05
    assert list(joined_outlines(cross, 0.05, FREE)) == []


@pytest.mark.parametrize(("gap", "tabbed"), [(0.5, True), (3.0, True), (3.4, False)])
def test_a_single_line_with_a_small_tab_is_an_outline_for_certain_rules_only(gap: float, tabbed: bool) -> None:
    """0.09 of 40 mm less the gap is 3.3 mm."""
    open_square = Line(7, square_with_gap(gap))
    found = list(joined_outlines([open_square], 12.0, FREE))
    assert [(o.owners, o.alone, o.joined) for o in found] == [([7], False, True)] * tabbed
    if tabbed:
        assert found[0].area.area == pytest.approx(100.0, abs=0.1)
    assert list(joined_outlines([open_square], 12.0, KEEP)) == []
    assert list(joined_outlines([open_square], 0.9 * gap, FREE)) == []


def test_two_levels_of_the_same_sides_are_one_outline() -> None:
    twice = [*sides(1.0), *(Line(one.owner + 4, one.points) for one in sides(1.0))]
    (found,) = joined_outlines(twice, 1.0, FREE)
    assert found.owners == list(range(8))
    (found,) = joined_outlines(twice, 1.0, KEEP)
    assert found.owners == list(range(8))


@BOTH
@pytest.mark.parametrize(("beyond", "clear"), [(0.1853, False), (0.21, True)])
def test_an_end_with_a_third_one_about_as_near_is_joined_only_in_doubt(
    doubt: OrderThresholds, beyond: float, clear: bool
) -> None:
    """The ends at the corner (10, 10) are 0.707 mm apart; a fifth line ends 0.710 or 0.741 mm away from both."""
    fifth = line((SIDE + beyond, SIDE + beyond), (30.0, 30.0), owner=4)
    found = list(joined_outlines([*sides(1.0), fifth], 1.0, doubt))
    assert len(found) == int(clear or doubt.keep)


@BOTH
def test_outlines_of_single_lines_come_first_and_joined_ones_need_a_tab(doubt: OrderThresholds) -> None:
    closed = Line(9, np.array([(20.0, 0.0), (24.0, 0.0), (24.0, 4.0), (20.0, 0.0)]))
    spot = line((50.0, 50.0), (50.0, 50.0), owner=8)
    lines = [*sides(1.0), spot, closed]
    assert [o.owners for o in outlines_of(lines, 1.0, doubt)] == [[9], [0, 1, 2, 3]]
    assert [o.owners for o in outlines_of(lines, None, doubt)] == [[9]]
    chosen = np.zeros(10, dtype=bool)
    assert [o.owners for o in outlines_of(lines, None, doubt, chosen=chosen)] == []
    chosen[9] = True
    (found,) = outlines_of(lines, None, doubt, chosen=chosen)
    assert found.owners == [9] and found.alone and not found.joined and found.area.area == 8.0
    assert [is_point(one) for one in lines] == [False] * 4 + [True, False]


def test_work_that_starts_inside_an_outline_is_listed_once_and_in_order() -> None:
    area = Outline(shapely.Polygon(SQUARE), [5], True)
    away = Outline(shapely.box(90, 90, 91, 91), [6], True)
    lines = [line((1.0, 1.0), (50.0, 1.0), owner=2), line((50.0, 1.0), (1.0, 1.0), owner=3),
             line((2.0, 2.0), (3.0, 2.0), owner=1), line((4.0, 2.0), (3.0, 2.0), owner=2)]  # fmt: skip
    (found,) = lines_starting_inside(lines, [away, area])
    assert found[0] is area and found[1].tolist() == [1, 2]
    assert list(lines_starting_inside([], [area])) == []


def features(builder: ToolpathBuilder) -> Features:
    path = builder.build()
    return features_in(path, ~np.isin(path.kind, [0, int(path.kind.max()) + 1]))


def test_consecutive_cuts_of_a_piece_are_one_line_until_a_gap_or_the_next_piece() -> None:
    """Cuts within 0.01 mm of each other are joined; a dwell is a point, once for each place."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=5.0, feed=1.0)
    builder.feed(y=5.0, feed=1.0)
    builder.rapid(x=5.009)
    builder.feed(x=9.0, feed=1.0)
    builder.rapid(y=5.011)
    builder.feed(x=12.0, feed=1.0)
    builder.dwell(1.0)
    builder.dwell(2.0)
    builder.feed(x=13.0, feed=1.0)
    made = features(builder)
    owner = np.array([0, 0, 0, 0, 0, 0, 1])
    found = [(one.owner, one.points.tolist()) for one in task_lines(made, traces_of(made), owner, 0.01)]
    assert found == [
        (0, [[0.0, 0.0], [5.0, 0.0], [5.0, 5.0], [9.0, 5.0]]),
        (0, [[9.0, 5.011], [12.0, 5.011]]),
        (1, [[12.0, 5.011], [13.0, 5.011]]),
        (0, [[12.0, 5.011], [12.0, 5.011]]),
    ]
    left_out = np.array([-1, -1, 2, -1, -1, -1, -1])
    assert [(one.owner, one.points.tolist()) for one in task_lines(made, traces_of(made), left_out, 0.01)] == [
        (2, [[5.009, 5.0], [9.0, 5.0]])
    ]
