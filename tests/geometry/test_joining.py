"""Strokes become outlines: joined, with closed gaps and without duplicates."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.geometry import index
from leafcut.geometry.cleaning import clean_path
from leafcut.geometry.joining import join_paths
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.tidying import tidy_outlines, without_overlaps


def line(*points: tuple[float, float]) -> Polyline:
    return Polyline.of_points(points)


def rectangle(x: float, y: float, w: float, h: float) -> list[Polyline]:
    """Return four lines, one after the other."""
    corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
    return [line(corners[k], corners[(k + 1) % 4]) for k in range(4)]


def areas(strokes: list[Polyline]) -> list[float]:
    return sorted(round(abs(made.path.area), 6) for made in tidy_outlines(strokes, 0.05).paths)


@given(st.lists(st.floats(1, 20), min_size=3, max_size=12), st.randoms(use_true_random=False))
def test_the_sides_of_a_polygon_in_any_order_and_direction_become_it_again(
    radii: list[float], draw: random.Random
) -> None:
    angles = np.arange(len(radii)) * math.tau / len(radii)
    corners = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    sides = [line(tuple(a), tuple(b)) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    sides = [s.reversed() if draw.random() < 0.5 else s for s in sides]
    draw.shuffle(sides)
    (made,) = join_paths(sides, 0.05).paths
    assert made.path.closed
    assert abs(made.path.area) == pytest.approx(Polyline.of_points(corners, closed=True).area)
    assert sorted(made.members) == list(range(len(sides)))


def test_gaps_up_to_the_tolerance_are_closed_and_said_with_their_place() -> None:
    sides = rectangle(0, 0, 10, 10)
    sides[2] = line((10, 10), (0, 10.04))
    (made,) = join_paths(sides, 0.05).paths
    assert made.path.closed
    ((place, width),) = made.gaps
    assert place == pytest.approx((0, 10.02)) and width == pytest.approx(0.04)
    assert [m.path.closed for m in join_paths(sides, 0.03).paths] == [False]


def test_of_ends_within_reach_those_drawn_in_one_point_are_joined_first() -> None:
    lines = [line((k * 0.02, 0), ((k + 1) * 0.02, 0)) for k in range(50)]
    (made,) = join_paths(lines, 0.05).paths
    assert made.path.length == pytest.approx(1.0)
    assert not made.gaps and not made.path.closed


def test_a_third_end_in_one_place_is_a_branch_and_stays_open() -> None:
    joining = join_paths([*rectangle(0, 0, 10, 10), line((10, 10), (20, 20))], 0.05)
    assert [made.path.closed for made in joining.paths] == [True, False]
    assert joining.branches == [(10.0, 10.0)]


def test_a_path_that_ends_where_it_began_is_closed() -> None:
    (made,) = join_paths([line((0, 0), (5, 0), (5, 5), (0, 0.001))], 0.05).paths
    assert made.path.closed


@pytest.mark.parametrize(
    "strokes, left",
    [
        (rectangle(0, 0, 10, 10) * 2, [100]),
        ([*rectangle(0, 0, 10, 10), line((10, 0), (0, 0))], [100]),
        ([*rectangle(0, 0, 10, 10)[1:], line((0, 0), (7, 0)), line((4, 0), (10, 0))], [100]),
        ([*rectangle(0, 0, 10, 10), line((0, 0), (5, 0)), line((5, 0), (10, 0))], [100]),
        ([Polyline.of_points([(0, 0), (10, 0), (10, 10), (0, 10)], True), line((2, 0), (7, 0))], [100]),
        ([line((0, 0), (10, 0), (20, 5)), line((20, 5), (10, 0), (0, 0))], [0]),
        (
            [
                Polyline(np.array([[10, 0, 1], [10, 4, 0.0]])),
                line((10, 4), (0, 4)),
                Polyline(np.array([[0, 4, 1], [0, 0, 0.0]])),
                line((0, 0), (10, 0)),
                Polyline(np.array([[12, 2, math.tan(math.pi / 8)], [10, 4, 0.0]])),
            ],
            [round(40 + 4 * math.pi, 6)],
        ),
    ],
    ids=["all twice", "one twice", "partly over", "one over two", "over a closed one", "open twice", "arc over arc"],
)
def test_what_is_drawn_twice_is_taken_once(strokes: list[Polyline], left: list[float]) -> None:
    assert areas(strokes) == left
    assert tidy_outlines(strokes, 0.05).doubles


@pytest.mark.parametrize("low", [0.0, 2.0])
def test_neighbours_that_share_an_edge_both_keep_it(low: float) -> None:
    assert areas([*rectangle(0, 0, 10, 10), *rectangle(10, low, 5, 10)]) == [50, 100]
    closed = Polyline.of_points([(0, 0), (10, 0), (10, 10), (0, 10)], True)
    assert areas([closed, *rectangle(10, low, 5, 10)]) == [50, 100]


def test_a_grid_of_touching_squares_stays_a_grid() -> None:
    squares = [side for x in range(4) for y in range(4) for side in rectangle(10 * x, 10 * y, 10, 10)]
    assert areas(squares) == [100] * 16


def test_lines_that_cross_or_only_touch_are_no_overlap() -> None:
    strokes = [line((0, 0), (10, 0)), line((5, -5), (5, 5)), line((10, 0), (20, 0)), line((10, 0), (10, 9))]
    assert without_overlaps(strokes).removed == []
    assert [p for p, _ in without_overlaps(strokes).paths] == strokes


def test_millions_of_ends_in_one_place_are_refused_before_they_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(index, "MOST_PAIRS", 1000)
    strokes = [line((0, 0), (math.cos(k), math.sin(k))) for k in range(300)]
    with pytest.raises(PlanError, match="millions of points"):
        join_paths(strokes, 0.05)


def test_cleaning_drops_what_has_no_length_and_halves_long_arcs() -> None:
    path = Polyline(np.array([[0, 0, 0], [0, 0, 0], [10, 0, 2.0], [10, 5, 0], [10, 5, 0.0]]), closed=True)
    good = clean_path(path)
    assert good is not None
    assert good.n_segments == 4
    assert good.area == pytest.approx(path.area)
    assert np.abs(good.bulges).max() <= 1
    assert clean_path(line((3, 3), (3, 3))) is None


@pytest.mark.parametrize("radius", [4_900.0, 20_000.0, 2_000_000.0])
@pytest.mark.parametrize("closed", [True, False])
def test_cleaning_replaces_arcs_of_a_huge_radius_by_lines_that_are_as_true(radius: float, closed: bool) -> None:
    bulge = math.tan(0.25 * 2.0 * math.asin(300.0 / radius))
    path = Polyline(np.array([[0, 0, 0], [600, 0, 0], [600, 200, bulge], [0, 200, 0.0]]), closed)
    good = clean_path(path)
    assert good is not None
    assert any(s.is_arc for s in good.segments()) is (radius < 5_000.0)
    rise = radius - math.sqrt(radius**2 - 300.0**2)
    chords = math.ceil(math.sqrt(rise / 0.002)) if radius > 5_000.0 else 1
    assert good.n_segments <= path.n_segments + chords
    apart = shapely.hausdorff_distance(
        shapely.LineString(good.flattened(1e-4)), shapely.LineString(path.flattened(1e-4)), densify=0.01
    )
    assert apart <= 0.0025
