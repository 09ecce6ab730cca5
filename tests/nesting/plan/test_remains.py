"""Remnants of a sheet: clear of the parts, without strips, and without overlaps."""

from __future__ import annotations

import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement, Stock
from leafcut.nesting.plan.pieces import chord_polygon
from leafcut.nesting.plan.remains import KeptRemnant, find_remnants


def box(width: float, height: float) -> Polyline:
    return Polyline.of_points([(0, 0), (width, 0), (width, height), (0, height)], closed=True)


def cut_out(*laid: tuple[Polyline, float, float], stock: Stock) -> tuple[Nest, Layout]:
    parts = tuple(NestPart(f"p{k}", (Contour(path),)) for k, (path, _, _) in enumerate(laid))
    layout = Layout(tuple(Placement(k, 0.0, x, y) for k, (_, x, y) in enumerate(laid)))
    return Nest(parts, (stock,), (layout,), (0,) * len(parts), "rectangles", 0), layout


def polygon(kept: KeptRemnant) -> shapely.Polygon:
    """Return a remnant at its position on the sheet."""
    stock, at = kept
    outline, *holes = (chord_polygon(path.moved(*at)) for path in stock.paths)
    return outline.difference(shapely.union_all(holes))


def test_beside_a_part_at_one_end_the_other_end_remains_spacing_away() -> None:
    nest, layout = cut_out((box(300, 200), 0.0, 0.0), stock=Stock(1000.0, 200.0))
    ((stock, at),) = find_remnants(nest, layout, 5.0, 100.0, "rest")
    assert at == (pytest.approx(305, abs=0.2), pytest.approx(0, abs=0.1))
    assert at[0] >= 305
    assert (stock.length, stock.width) == (pytest.approx(695, abs=0.2), pytest.approx(200, abs=0.1))
    assert (stock.name, stock.count, stock.price) == ("rest_1", 1, None)


def test_strips_narrower_than_the_least_are_cut_off_and_small_pieces_left_out() -> None:
    """Above the part 50 mm are left, too few for 60: at most a stub of them as long as that stays at the corner."""
    nest, layout = cut_out((box(300, 145), 0.0, 0.0), stock=Stock(600.0, 200.0))
    ((narrow, _),) = find_remnants(nest, layout, 5.0, 60.0, "r")
    ((whole, _),) = find_remnants(nest, layout, 5.0, 10.0, "r")
    assert 294.8 < narrow.length < 295 + 60
    assert whole.length == pytest.approx(600, abs=0.2)
    assert find_remnants(nest, layout, 5.0, 250.0, "r") == []


def test_the_largest_piece_comes_first_and_all_lie_in_the_sheet_clear_of_the_parts_and_of_each_other() -> None:
    parts = [(Polyline.circle(0, 0, 60), 300.0, 100.0), (box(40, 198), 480.0, 1.0), (box(30, 30), 20.0, 20.0)]
    nest, layout = cut_out(*parts, stock=Stock(800.0, 200.0))
    pieces = [polygon(kept) for kept in find_remnants(nest, layout, 4.0, 50.0, "r")]
    assert len(pieces) >= 2
    assert [p.area for p in pieces] == sorted((p.area for p in pieces), reverse=True)
    assert shapely.union_all(pieces).area == pytest.approx(sum(p.area for p in pieces))
    for piece in pieces:
        assert shapely.box(0, 0, 800, 200).buffer(1e-6).covers(piece)
        for path, x, y in parts:
            assert shapely.Polygon(path.moved(x, y).flattened(0.001)).distance(piece) >= 4.0


def test_a_hole_that_is_in_the_sheet_stays_a_hole_and_a_part_in_the_middle_becomes_one() -> None:
    hole = Polyline.circle(500, 100, 30)
    nest, layout = cut_out((box(60, 60), 200.0, 70.0), stock=Stock(800.0, 200.0, edge=(box(800, 200), hole)))
    (kept,) = find_remnants(nest, layout, 5.0, 20.0, "r")
    assert len(kept[0].paths) == 3
    whole = polygon(kept)
    assert not whole.intersects(shapely.Point(500, 100)) and not whole.intersects(shapely.Point(230, 100))
    assert whole.intersects(shapely.Point(400, 100))
