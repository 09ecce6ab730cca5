"""Grown and shrunk paths against hand calculation and against the distances that shapely measures."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline

STADIUM = Polyline(np.array([[0.0, 0, 0], [10, 0, 1], [10, 4, 0], [0, 4, 1]]), closed=True)
SQUARE = Polyline.of_points([(0, 0), (10, 0), (10, 10), (0, 10)], closed=True)
#: A C whose mouth is 2 mm wide in front of a chamber.
CHAMBER = Polyline.of_points(
    [(0, 0), (20, 0), (20, 9), (15, 9), (15, 5), (5, 5), (5, 15), (15, 15), (15, 11), (20, 11), (20, 20), (0, 20)], True
)
#: Two squares of 10 mm joined by a neck 2 mm wide.
DUMBBELL = Polyline.of_points(
    [(0, 0), (10, 0), (10, 4), (20, 4), (20, 0), (30, 0), (30, 10), (20, 10), (20, 6), (10, 6), (10, 10), (0, 10)], True
)


def arcs(path: Polyline) -> int:
    return int(np.count_nonzero(path.bulges))


def test_a_grown_square_has_round_corners_and_a_shrunk_one_sharp_ones() -> None:
    (grown,) = offset_closed_path(SQUARE, 1.5)
    assert (grown.n_segments, arcs(grown)) == (8, 4)
    assert grown.area == pytest.approx(100 + 4 * 10 * 1.5 + math.pi * 1.5**2)
    (shrunk,) = offset_closed_path(SQUARE, -1.5)
    assert (shrunk.n_segments, arcs(shrunk), shrunk.area) == (4, 0, pytest.approx(49))


@pytest.mark.parametrize("distance", [-1.0, 2.5])
@pytest.mark.parametrize("clockwise", [False, True])
def test_positive_grows_whichever_way_round_the_path_runs(distance: float, clockwise: bool) -> None:
    (circle,) = offset_closed_path(Polyline.circle(3, 4, 5, clockwise), distance)
    assert circle.area == pytest.approx(math.pi * (5 + distance) ** 2)
    assert circle.n_segments == 2
    (stadium,) = offset_closed_path(STADIUM.reversed() if clockwise else STADIUM, distance)
    assert stadium.area == pytest.approx(20 * (2 + distance) + math.pi * (2 + distance) ** 2)
    assert (stadium.n_segments, arcs(stadium)) == (4, 2)


def test_what_is_narrower_than_twice_the_distance_vanishes() -> None:
    assert offset_closed_path(SQUARE, -5) == []
    assert offset_closed_path(STADIUM, -2.0) == []


def test_a_neck_narrower_than_twice_the_distance_leaves_two_pieces() -> None:
    pieces = offset_closed_path(DUMBBELL, -1.5)
    # Each: the square of 7 mm; towards the neck it goes round both corners at 1.5 mm, as far as they reach.
    assert len(pieces) == 2
    region = shapely.Polygon(DUMBBELL.flattened(0.001)).buffer(-1.5, quad_segs=200)
    assert [p.area for p in pieces] == pytest.approx([g.area for g in region.geoms], abs=0.01)


def test_growing_over_a_mouth_leaves_an_outer_edge_and_the_edge_of_a_hole_the_other_way_round() -> None:
    outer, inner = offset_closed_path(CHAMBER, 1.25)
    assert outer.area > 0 > inner.area
    region = shapely.Polygon(CHAMBER.flattened(0.001)).buffer(1.25, quad_segs=200)
    assert outer.area + inner.area == pytest.approx(region.area, abs=0.05)


def test_a_fillet_smaller_than_the_distance_becomes_a_corner() -> None:
    bulge = -math.tan(math.pi / 8)
    rows = [[0, 0, 0], [20, 0, 0], [20, 10, 0], [10.5, 10, bulge], [10, 10.5, 0], [10, 20, 0], [0, 20, 0.0]]
    fillet = Polyline(np.array(rows), closed=True)
    (grown,) = offset_closed_path(fillet, 2.0)
    assert arcs(grown) == 5  # the five outward corners
    assert min(math.dist(v[:2], (12, 12)) for v in grown.vertices) < 0.01


def test_open_and_self_crossing_paths_are_refused_with_a_reason() -> None:
    with pytest.raises(PlanError, match="open"):
        offset_closed_path(Polyline.of_points([(0, 0), (1, 0), (1, 1)]), 1)
    with pytest.raises(PlanError, match=r"crosses or touches itself at \(5, 5\)"):
        offset_closed_path(Polyline.of_points([(0, 0), (10, 10), (10, 0), (0, 10)], closed=True), 1)


#: Radii and bulges round a centre: star-shaped outlines with lines and arcs, hollows and spikes.
stars = st.lists(
    st.tuples(st.floats(5, 30), st.sampled_from([0.0, 0.0, 0.2, -0.2, 0.6, -0.5])), min_size=3, max_size=12
)


def star(spokes: list[tuple[float, float]]) -> Polyline:
    angles = np.arange(len(spokes)) * math.tau / len(spokes)
    radii, bulges = np.array(spokes).T
    return Polyline(np.column_stack([radii * np.cos(angles), radii * np.sin(angles), bulges]), closed=True)


@given(stars, st.sampled_from([-3.0, -0.75, -0.2, 0.2, 0.75, 3.0]))
def test_every_place_of_the_answer_is_at_the_distance_and_nothing_is_missing(
    spokes: list[tuple[float, float]], distance: float
) -> None:
    path = star(spokes)
    region = shapely.Polygon(path.flattened(0.0005))
    assume(region.is_valid)
    tolerance = 0.01
    answer = offset_closed_path(path, distance, tolerance)
    points = [q.flattened(0.0005) for q in answer]
    for ring in points:
        gaps = shapely.distance(region.exterior, shapely.points(ring))
        assert np.abs(gaps - abs(distance)).max() <= 1.2 * tolerance
    whole = region.buffer(distance, quad_segs=64)
    total = sum(q.area for q in answer)
    # GEOS itself leaves flat hollows by a hundredth of the distance.
    slack = (tolerance + 0.01 * abs(distance)) * whole.length + 0.01
    assert total == pytest.approx(whole.area, abs=slack)
    assert sum(q.n_segments for q in answer) <= 8 * path.n_segments + 8
