"""Rectangles on a sheet: apart, inside its margins, and where they fill it without waste."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.nesting.plan.pieces import NestPiece, pieces_from_parts
from leafcut.nesting.plan.rectangles import RULES, PlacedPiece, RectanglePacker

QUARTERS = (0.0, 0.5 * math.pi)


def box(width: float, height: float, x: float = 0.0, y: float = 0.0) -> Polyline:
    return Polyline.of_points([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], closed=True)


def some(paths: list[Polyline], angles: tuple[float, ...] = QUARTERS) -> list[NestPiece]:
    return pieces_from_parts([NestPart(f"p{k}", (Contour(path),), 1, angles) for k, path in enumerate(paths)])


def shapes(pieces: list[NestPiece], laid: list[PlacedPiece]) -> list[shapely.Polygon]:
    return [shapely.Polygon(pieces[a.piece].path.turned(a.angle).moved(a.x, a.y).flattened(0.001)) for a in laid]


@pytest.mark.parametrize("rule", range(len(RULES)))
def test_by_every_rule_pieces_lie_inside_the_margin_and_the_spacing_apart(rule: int) -> None:
    dice = np.random.default_rng(rule)
    paths = [box(*dice.uniform(20, 90, 2), *dice.uniform(-50, 50, 2)) for _ in range(8)] + [Polyline.circle(9, 9, 25)]
    pieces = some(paths)
    packer = RectanglePacker(pieces, 280.0, 180.0, 10.0, 3.0, rule)
    laid = packer.fill(Counter(dict.fromkeys(range(len(pieces)), 2)), last=False)
    lying = shapes(pieces, laid)
    assert len(lying) > 5
    assert max(Counter(a.piece for a in laid).values()) <= 2
    assert all(shapely.box(10, 10, 290, 190).buffer(1e-6).covers(shape) for shape in lying)
    assert min(a.distance(b) for a, b in itertools.combinations(lying, 2)) >= 3.0 - 1e-6


def test_pieces_whose_sides_add_up_to_the_sheet_fill_it_to_the_last_hair() -> None:
    """3 × 2 of 30.1 × 20.3 with 2.7 between them: 3 · 30.1 + 2 · 2.7 = 95.7 and 2 · 20.3 + 2.7 = 43.3."""
    pieces = some([box(30.1, 20.3)], (0.0,))
    assert len(RectanglePacker(pieces, 95.7, 43.3, 0.0, 2.7, 0).fill(Counter({0: 9}), last=False)) == 6
    assert len(RectanglePacker(pieces, 95.6, 43.3, 0.0, 2.7, 0).fill(Counter({0: 9}), last=False)) < 6


def test_the_last_pieces_end_as_far_to_the_left_as_they_can() -> None:
    """Two planks that stand beside each other take 22 mm of the sheet; one on the other they would take 60."""
    pieces = some([box(60, 10)])
    packer = RectanglePacker(pieces, 500.0, 60.0, 0.0, 2.0, 0)
    last = shapes(pieces, packer.fill(Counter({0: 2}), last=True))
    assert max(shape.bounds[2] for shape in last) == pytest.approx(22, abs=1.0)


def test_what_may_not_be_turned_lies_as_it_is_drawn() -> None:
    pieces = some([box(60, 10)], (0.0,))
    laid = RectanglePacker(pieces, 200.0, 59.0, 0.0, 2.0, 0).fill(Counter({0: 4}), last=False)
    assert [a.angle for a in laid] == [0.0] * 4
    upright = some([box(60, 10)], (0.5 * math.pi,))
    assert RectanglePacker(upright, 200.0, 59.0, 0.0, 2.0, 0).fill(Counter({0: 4}), last=False) == []
    assert not RectanglePacker(upright, 200.0, 59.0, 0.0, 2.0, 0).fits_on_empty_sheet(0)


def test_a_sheet_has_room_for_as_much_as_its_pieces_weigh() -> None:
    pieces = some([box(48, 28)], (0.0,))
    packer = RectanglePacker(pieces, 148.0, 88.0, 10.0, 2.0, 0)
    assert packer.required_area(0) == pytest.approx(50 * 30)
    assert packer.sheet_area / packer.required_area(0) == pytest.approx(9)
    assert len(packer.fill(Counter({0: 20}), last=False)) == 9


def test_round_pieces_stay_apart_by_the_spacing_and_what_their_chords_lose() -> None:
    """Chords leave an arc by 0.01 mm: between two of them, and at the sheet's edge on either side, 0.02 mm more."""
    disc = some([Polyline.circle(0, 0, 25)], (0.0,))
    laid = RectanglePacker(disc, 102.03, 50.0, 0.0, 2.0, 0).fill(Counter({0: 2}), last=False)
    assert abs(laid[0].x - laid[1].x) == pytest.approx(50.0 + 2.0 + 0.02, abs=0.002)
    assert len(RectanglePacker(disc, 102.01, 50.0, 0.0, 2.0, 0).fill(Counter({0: 2}), last=False)) == 1
    straight = some([box(50, 50)], (0.0,))
    laid = RectanglePacker(straight, 102.0, 50.0, 0.0, 2.0, 0).fill(Counter({0: 2}), last=False)
    assert abs(laid[0].x - laid[1].x) == pytest.approx(52.0, abs=0.002)


@pytest.mark.parametrize("rule", range(len(RULES)))
def test_by_every_rule_the_last_pieces_stand_in_no_more_columns_than_they_need(rule: int) -> None:
    """Two of 40 × 40 fit beside each other across a sheet of 82: all four take 82 mm, in two columns."""
    pieces = some([box(40, 40)], (0.0,))
    packer = RectanglePacker(pieces, 1000.0, 82.0, 0.0, 2.0, rule)
    last = shapes(pieces, packer.fill(Counter({0: 4}), last=True))
    assert len(last) == 4
    assert max(shape.bounds[2] for shape in last) <= 83.0


@pytest.mark.parametrize("rule", range(len(RULES)))
@pytest.mark.parametrize("columns", [8, 40])
def test_the_last_pieces_end_within_a_thousandth_of_the_sheet_of_where_they_could(rule: int, columns: int) -> None:
    """Three slats lie on each other: their columns of 10 mm on a sheet of 10 m, and no further column is begun.

    On the whole sheet the bottom-left and the skyline rules lay them in a row, which is three times as long.
    """
    pieces = some([box(10, 30)], (0.0,))
    packer = RectanglePacker(pieces, 10_000.0, 92.0, 0.0, 0.0, rule)
    last = shapes(pieces, packer.fill(Counter({0: 3 * columns}), last=True))
    assert len(last) == 3 * columns
    assert max(shape.bounds[2] for shape in last) < 10.0 * columns + 9.9


def test_where_not_all_of_the_pieces_fit_the_whole_sheet_is_filled() -> None:
    pieces = some([box(40, 40)], (0.0,))
    packer = RectanglePacker(pieces, 124.0, 82.0, 0.0, 2.0, 0)
    assert len(packer.fill(Counter({0: 9}), last=True)) == 6
