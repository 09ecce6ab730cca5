"""Which nests are made of a task, and of which pieces it consists."""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Nest, NestPart, Stock
from leafcut.nesting.options import NestOptions
from leafcut.nesting.plan.fill import NestTask
from leafcut.nesting.plan.nesting import nest_variants, prepare_task
from leafcut.nesting.plan.rectangles import RULES
from leafcut.options import SolveOptions

SHEET = Stock(200.0, 100.0)


def box(width: float, height: float, count: int = 1) -> NestPart:
    path = Polyline.of_points([(0, 0), (width, 0), (width, height), (0, height)], closed=True)
    return NestPart(f"{width:g}x{height:g}", (Contour(path),), count, (0.0, 0.5 * math.pi))


def task_of(*parts: NestPart, stocks: tuple[Stock, ...] = (SHEET,), **options: Any) -> NestTask:
    given = {"gap": 3.0, "margin": 10.0, **options}
    return prepare_task(parts, NestOptions(**given), 2.0, stocks)


def nests(task: NestTask, cancelled: threading.Event | None = None, **search: Any) -> Iterator[Nest | str]:
    return nest_variants(task, SolveOptions(**search), lambda _: None, cancelled or threading.Event())


def test_by_rectangles_there_is_one_nest_for_each_rule() -> None:
    found = list(nests(task_of(box(50, 30, 5))))
    assert [(one.method, one.seed) for one in found if isinstance(one, Nest)] == [
        ("rectangles", rule) for rule in range(len(RULES))
    ]
    for one in found:
        assert isinstance(one, Nest)
        assert sum(layout.count * len(layout.placements) for layout in one.layouts) == 5
        assert one.unplaced == (0,)


def test_where_nobody_wants_more_no_further_nest_is_made() -> None:
    cancelled = threading.Event()
    found = nests(task_of(box(50, 30, 5)), cancelled)
    next(found)
    cancelled.set()
    assert list(found) == []


def test_a_nest_that_is_stopped_before_any_was_found_is_one_by_rectangles() -> None:
    """Who stops and keeps the best gets a nest, however early."""
    cancelled = threading.Event()
    cancelled.set()
    triangle = NestPart("triangle", (Contour(Polyline.of_points([(0, 0), (80, 0), (0, 80)], closed=True)),), 2, (0.0,))
    (one,) = nests(task_of(triangle, variants=2), cancelled)
    assert isinstance(one, Nest)
    assert (one.method, one.unplaced) == ("rectangles", (0,))


def test_of_several_kinds_of_sheet_the_cheapest_that_hold_all_are_taken() -> None:
    """Two of 80 × 80: both on the sheet of 200 mm for 9, or one each on two of 100 mm for 4."""
    dear, cheap = Stock(200.0, 100.0, None, 9.0), Stock(100.0, 100.0, None, 4.0)
    found = [one for one in nests(task_of(box(80, 80, 2), stocks=(dear, cheap))) if isinstance(one, Nest)]
    assert len(found) == len(RULES)
    for one in found:
        assert Counter({layout.stock: layout.count for layout in one.layouts}) == Counter({1: 2})
        assert one.cost == 8.0


def test_nested_by_shape_every_variant_uses_the_cheapest_sheets() -> None:
    """Two triangles make one square of 80 × 80. Only the expensive sheet holds their rectangles."""
    pytest.importorskip("spyrrow")
    triangle = Polyline.of_points([(0, 0), (80, 0), (0, 80)], closed=True)
    part = NestPart("triangle", (Contour(triangle),), 2, (0.0, math.pi))
    dear, cheap = Stock(200.0, 120.0, None, 20.0), Stock(120.0, 120.0, None, 11.0)
    task = task_of(part, stocks=(dear, cheap), variants=2)
    found = [one for one in nests(task, iterations=10, threads=1) if isinstance(one, Nest)]
    by_shapes = [one for one in found if one.method == "shapes"]
    assert len(by_shapes) == 2 and len(found) == 2 + len(RULES)
    for one in by_shapes:
        assert Counter({layout.stock: layout.count for layout in one.layouts}) == Counter({1: 1})
        assert one.cost == 11.0


def test_a_remnant_is_filled_by_its_shape_and_its_packer_is_shared() -> None:
    """In an L of 100 × 100 with arms of 45 mm only the arms have room: two boxes of 70 × 20 lie in them."""
    edge = Polyline.of_points([(0, 0), (100, 0), (100, 45), (45, 45), (45, 100), (0, 100)], closed=True)
    remnant = Stock(100.0, 100.0, 1, None, (edge,), "rest")
    found = [one for one in nests(task_of(box(70, 20, 2), stocks=(remnant,))) if isinstance(one, Nest)]
    assert all(one.unplaced == found[0].unplaced for one in found)
    assert all(one.layouts[0].placements == found[0].layouts[0].placements for one in found)
    for placement in found[0].layouts[0].placements:
        x0, y0, x1, y1 = placement.placed(box(70, 20).outline).extents
        assert x0 >= 10 - 1e-6 and y0 >= 10 - 1e-6 and (x1 <= 35 + 1e-6 or y1 <= 35 + 1e-6)


def test_what_fits_no_sheet_less_its_margins_is_refused() -> None:
    assert task_of(box(180, 80)).counts == (1,)
    with pytest.raises(
        PlanError,
        match=r"180.5x80: the part measures 180.5 × 80 mm, but a sheet without its margins measures only 180 × 80 mm",
    ):
        task_of(box(180.5, 80))


def test_blocks_are_as_large_as_the_smallest_sheet_that_holds_the_part_allows() -> None:
    """Parts of 50 × 30 on sheets of 120 and 1000 mm: blocks must fit the smaller one, 100 × 80 less its margins."""
    small, large = Stock(120.0, 100.0), Stock(1000.0, 800.0)
    task = task_of(box(50, 30, 12), stocks=(large, small), blocks="grids", gap=1.0)
    assert max(len(piece.members) for piece in task.pieces) > 1
    assert all(piece.fits(100.0, 80.0) for piece in task.pieces)
    assert sum(len(p.members) * n for p, n in zip(task.pieces, task.counts, strict=True)) == 12


def test_small_parts_lie_in_the_holes_of_large_ones() -> None:
    outline = box(90, 70).outline
    hole = Polyline.of_points([(20, 15), (70, 15), (70, 55), (20, 55)], closed=True)
    frame = NestPart("frame", (Contour(outline), Contour(hole)), 1, (0.0,))
    inside = task_of(frame, box(30, 20))
    assert [len(piece.members) for piece, count in zip(inside.pieces, inside.counts, strict=True) if count] == [2]
