"""Pieces on a remnant: within its edge, clear of its holes and of each other, the largest first."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import pytest
import shapely
from shapely.affinity import rotate, translate

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart, Stock
from leafcut.nesting.plan.pieces import pieces_from_parts
from leafcut.nesting.plan.rectangles import PlacedPiece
from leafcut.nesting.plan.remnant import RemnantPacker

MARGIN, SPACING = 5.0, 4.0


def box(width: float, height: float) -> Polyline:
    return Polyline.of_points([(0, 0), (width, 0), (width, height), (0, height)], closed=True)


def packer(sizes: list[tuple[float, float]], paths: tuple[Polyline, ...], **limits: float) -> RemnantPacker:
    """Return a packer of rectangles, that are not turned, on a remnant."""
    parts = [NestPart(f"p{k}", (Contour(box(*size)),)) for k, size in enumerate(sizes)]
    x0, y0, x1, y1 = paths[0].extents
    stock = Stock(x1 - x0, y1 - y0, 1, None, paths, "rest")
    return RemnantPacker(pieces_from_parts(parts), stock, MARGIN, SPACING, **limits)


def polygons(sizes: list[tuple[float, float]], laid: list[PlacedPiece]) -> list[shapely.Polygon]:
    """Return the polygons of the placed pieces."""
    shapes = [shapely.box(0, 0, *sizes[one.piece]) for one in laid]
    return [
        translate(rotate(s, one.angle, (0, 0), use_radians=True), one.x, one.y)
        for s, one in zip(shapes, laid, strict=True)
    ]


def test_a_strip_holds_as_many_squares_as_fit_beside_each_other_within_its_margin() -> None:
    """Of 100 mm 90 are left by two margins of 5: two squares of 30 take 64 with their spacing, three 98."""
    one = packer([(30, 30)], (box(100, 40),))
    assert one.sheet_area == pytest.approx(90 * 30)
    assert one.fits_on_empty_sheet(0) and one.required_area(0) == pytest.approx(900)
    assert len(one.fill(Counter({0: 5}), last=True)) == 2
    assert not packer([(91, 10)], (box(100, 40),)).fits_on_empty_sheet(0)


def test_on_an_l_with_a_hole_pieces_keep_off_edges_holes_and_each_other_and_the_largest_is_laid_first() -> None:
    ell = Polyline.of_points([(0, 0), (200, 0), (200, 60), (80, 60), (80, 150), (0, 150)], closed=True)
    hole = Polyline.circle(120, 30, 12, clockwise=True)
    sizes = [(20.0, 10.0), (50.0, 40.0), (30.0, 30.0)]
    laid = packer(sizes, (ell, hole)).fill(Counter({0: 6, 1: 2, 2: 3}), last=True)
    areas = [sizes[one.piece][0] * sizes[one.piece][1] for one in laid]
    assert areas == sorted(areas, reverse=True) and len(laid) >= 8
    shapes = polygons(sizes, laid)
    room = shapely.Polygon(ell.flattened(0.01), [hole.flattened(0.01)])
    assert all(room.covers(shape) and room.exterior.distance(shape) > MARGIN - 0.01 for shape in shapes)
    assert all(room.interiors[0].distance(shape) > MARGIN - 0.01 for shape in shapes)
    assert all(a.distance(b) > SPACING - 0.01 for a, b in combinations(shapes, 2))


def test_a_sheet_that_has_no_time_is_left_as_it_is_and_said_not_to_repeat() -> None:
    late = packer([(30, 30)], (box(100, 40),), end=0.0)
    assert late.fill(Counter({0: 1}), last=True) == [] and not late.repeatable
