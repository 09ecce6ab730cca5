"""Where a piece has room in a region of any shape: furthest to the left, then lowest, and never over its edge."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.nesting.plan.pieces import NestPiece, pieces_from_parts
from leafcut.nesting.plan.positions import buffer_distance, find_position


def box(width: float, height: float, x: float = 0.0, y: float = 0.0) -> Polyline:
    return Polyline.of_points([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], closed=True)


def piece(path: Polyline) -> NestPiece:
    return pieces_from_parts([NestPart("p", (Contour(path),))])[0]


def test_a_piece_lies_furthest_to_the_left_and_then_lowest() -> None:
    found = find_position(piece(box(20, 10, 3, 4)), shapely.box(100, 50, 200, 90), [0.0])
    assert found is not None
    angle, x, y, polygon = found
    assert (angle, x, y) == (0.0, pytest.approx(97), pytest.approx(46))
    assert polygon.bounds == pytest.approx((100, 50, 120, 60))


def test_a_piece_that_only_just_has_room_is_laid_in_the_corner_that_holds_it() -> None:
    """An L whose foot alone is high enough: no place of a grid over its box is the only one that there is."""
    room = shapely.union_all([shapely.box(0, 0, 7, 100), shapely.box(0, 0, 61, 13)])
    found = find_position(piece(box(54, 13)), room, [0.0])
    assert found is not None
    assert room.buffer(1e-5).covers(found[3])


def test_of_several_angles_that_one_is_taken_which_ends_furthest_to_the_left() -> None:
    found = find_position(piece(box(30, 10)), shapely.box(0, 0, 50, 50), [0.0, 0.5 * math.pi])
    assert found is not None
    assert (found[0], found[3].bounds[2]) == (0.5 * math.pi, pytest.approx(10))


def test_where_a_piece_has_no_room_it_gets_none() -> None:
    plank = piece(box(60, 10))
    assert find_position(plank, shapely.box(0, 0, 59, 59), [0.0, 0.5 * math.pi]) is None
    assert find_position(plank, shapely.Polygon(), [0.0]) is None
    # Along the diagonal of a square of 59 it has room.
    assert find_position(plank, shapely.box(0, 0, 59, 59), [0.25 * math.pi]) is not None


def test_whatever_the_room_a_piece_lies_within_it_and_quick_finds_none_where_the_whole_search_finds_none() -> None:
    dice = np.random.default_rng(5)
    laid = 0
    for _ in range(40):
        room = shapely.Point(0, 0).buffer(40).difference(shapely.box(*sorted(dice.uniform(-40, 0, 2)), 5, 30))
        part = piece(box(*dice.uniform(8, 60, 2)))
        found, quick = (find_position(part, room, [0.0, 1.0], quick=q) for q in (False, True))
        for one in (found, quick):
            assert one is None or room.buffer(1e-4).covers(one[3])
        assert found is not None or quick is None
        laid += found is not None
    assert 5 < laid < 40


def test_beyond_what_a_polygon_is_grown_by_every_point_is_the_spacing_away_from_its_arcs() -> None:
    """A circle of radius 50 in chords, grown: even where two chords meet it is 5 mm from the true arc."""
    ring = np.asarray(
        shapely.Polygon(Polyline.circle(0, 0, 50).flattened(0.01)).buffer(buffer_distance(5.0)).exterior.coords
    )
    middles = 0.5 * (ring[1:] + ring[:-1])
    assert np.hypot(*middles.T).min() - 50.0 >= 5.0


def corner(angle: float) -> Polyline:
    """Return a right-angled triangle with legs of 30 and 20 mm, its right angle at the origin, turned."""
    return Polyline.of_points([(0, 0), (30, 0), (0, 20)], closed=True).turned(angle)


@pytest.mark.parametrize("turn", [0.3, 1.1, 2.0, 4.4])
def test_in_a_room_that_is_its_own_shape_a_piece_lies_upon_it(turn: float) -> None:
    """Two crumbs enlarge the bounding box, so no grid position fits exactly; only the corners do."""
    path = corner(turn).moved(13.0, 7.0)
    crumbs = shapely.box(-61.3, -53.7, -61, -53), shapely.box(200, 300, 201, 301)
    room = shapely.union_all([shapely.Polygon(path.flattened(0.001)), *crumbs])
    found = find_position(piece(path), room, [0.0])
    assert found is not None
    assert found[1:3] == (pytest.approx(0.0, abs=1e-5), pytest.approx(0.0, abs=1e-5))
    assert find_position(piece(path), room, [0.0], quick=True) is None


@pytest.mark.parametrize("turn", [0.3, 1.1, 2.0, 4.4])
def test_any_corner_of_a_piece_may_be_the_one_that_lies_in_a_corner(turn: float) -> None:
    """The room is larger at the first corner of the square: the other three fit."""
    whole = Polyline.of_points([(-3, -3), (20, 0), (20, 20), (0, 20)], closed=True).turned(turn)
    crumbs = shapely.box(-61.3, -53.7, -61, -53), shapely.box(200, 300, 201, 301)
    room = shapely.union_all([shapely.Polygon(whole.flattened(0.001)), *crumbs])
    found = find_position(piece(box(20, 20).turned(turn)), room, [0.0])
    assert found is not None
    assert found[1:3] == (pytest.approx(0.0, abs=1e-5), pytest.approx(0.0, abs=1e-5))


def test_a_round_piece_lies_in_an_alcove_by_the_corners_of_the_box_around_it() -> None:
    """Only in the alcove, 20 mm wide and high, a disc of that diameter has room."""
    room = shapely.Polygon([(0, 0), (100, 0), (100, 5), (53.3, 5), (53.3, 20), (33.3, 20), (33.3, 5), (0, 5)])
    found = find_position(piece(Polyline.circle(0, 0, 10)), room, [0.0])
    assert found is not None
    assert found[1:3] == (pytest.approx(43.3, abs=1e-5), pytest.approx(10.0, abs=1e-5))


def test_among_more_corners_than_are_looked_at_some_are_taken_evenly() -> None:
    """A comb of 400 teeth 3 mm wide, 20 mm high on the right: a bar 15 mm high fits into a corner there."""
    points = [(-1.7, -1.0)]
    for k in range(400):
        high = 20.0 if k >= 200 else 10.0
        points += [(5.0 * k, 0.0), (5.0 * k, high), (5.0 * k + 3.0, high), (5.0 * k + 3.0, 0.0)]
    room = shapely.Polygon([*points, (1999.3, -1.0)])
    found = find_position(piece(box(3, 20)), room, [0.0])
    assert found is not None
    assert found[3].bounds[0] >= 1000.0 - 1e-5
