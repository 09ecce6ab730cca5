"""Where a piece has room in a region of any shape: furthest to the left, then lowest, and never over its edge."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.processes.nesting.plan.pieces import NestPiece, pieces_of
from leafcut.processes.nesting.plan.rooms import clear_of, place


def box(width: float, height: float, x: float = 0.0, y: float = 0.0) -> Polyline:
    return Polyline.of_points([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], closed=True)


def piece(path: Polyline) -> NestPiece:
    return pieces_of([NestPart("p", (Contour(path),))])[0]


def test_a_piece_lies_furthest_to_the_left_and_then_lowest() -> None:
    found = place(piece(box(20, 10, 3, 4)), shapely.box(100, 50, 200, 90), [0.0])
    assert found is not None
    angle, x, y, polygon = found
    assert (angle, x, y) == (0.0, pytest.approx(97), pytest.approx(46))
    assert polygon.bounds == pytest.approx((100, 50, 120, 60))


def test_a_piece_that_only_just_has_room_is_laid_in_the_corner_that_holds_it() -> None:
    """An L whose foot alone is high enough: no place of a grid over its box is the only one that there is."""
    room = shapely.union_all([shapely.box(0, 0, 7, 100), shapely.box(0, 0, 61, 13)])
    found = place(piece(box(54, 13)), room, [0.0])
    assert found is not None
    assert room.buffer(1e-5).covers(found[3])


def test_of_several_angles_that_one_is_taken_which_ends_furthest_to_the_left() -> None:
    found = place(piece(box(30, 10)), shapely.box(0, 0, 50, 50), [0.0, 0.5 * math.pi])
    assert found is not None
    assert (found[0], found[3].bounds[2]) == (0.5 * math.pi, pytest.approx(10))


def test_where_a_piece_has_no_room_it_gets_none() -> None:
    plank = piece(box(60, 10))
    assert place(plank, shapely.box(0, 0, 59, 59), [0.0, 0.5 * math.pi]) is None
    assert place(plank, shapely.Polygon(), [0.0]) is None
    # Along the diagonal of a square of 59 it has room.
    assert place(plank, shapely.box(0, 0, 59, 59), [0.25 * math.pi]) is not None


def test_whatever_the_room_a_piece_lies_within_it_and_quick_finds_none_where_the_whole_search_finds_none() -> None:
    dice = np.random.default_rng(5)
    laid = 0
    for _ in range(40):
        room = shapely.Point(0, 0).buffer(40).difference(shapely.box(*sorted(dice.uniform(-40, 0, 2)), 5, 30))
        part = piece(box(*dice.uniform(8, 60, 2)))
        found, quick = (place(part, room, [0.0, 1.0], quick=q) for q in (False, True))
        for one in (found, quick):
            assert one is None or room.buffer(1e-4).covers(one[3])
        assert found is not None or quick is None
        laid += found is not None
    assert 5 < laid < 40


def test_beyond_what_a_polygon_is_grown_by_every_point_is_the_spacing_away_from_its_arcs() -> None:
    """A circle of radius 50 in chords, grown: even where two chords meet it is 5 mm from the true arc."""
    ring = np.asarray(shapely.Polygon(Polyline.circle(0, 0, 50).flattened(0.01)).buffer(clear_of(5.0)).exterior.coords)
    middles = 0.5 * (ring[1:] + ring[:-1])
    assert np.hypot(*middles.T).min() - 50.0 >= 5.0
