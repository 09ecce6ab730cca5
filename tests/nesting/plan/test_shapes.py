"""Packing by shape: the outlines given to the nester enclose the clearance, and its answer is placed correctly."""

from __future__ import annotations

import itertools
import math
import threading
from collections import Counter
from typing import Any

import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.nesting.plan import shapes as room
from leafcut.nesting.plan.pieces import pieces_from_parts
from leafcut.nesting.plan.shapes import ShapePacker
from leafcut.nesting.plan.strip import Strip, StripBudget, StripItem

pytest.importorskip("spyrrow")

SPACING, MARGIN = 4.0, 10.0
OUTLINES = {
    "box": Polyline.of_points([(3, 4), (33, 4), (33, 14), (3, 14)], closed=True),
    "disc": Polyline.circle(100, 50, 25),
    "needle": Polyline.of_points([(0, 0), (80, 1), (0, 2)], closed=True),
    "star": Polyline.of_points(
        [((30 if k % 2 else 12) * math.cos(k * math.pi / 5), (30 if k % 2 else 12) * math.sin(k * math.pi / 5))
         for k in range(10)], closed=True,
    ),
}  # fmt: skip


def packer(*paths: Polyline, length: float = 300.0, width: float = 120.0, angles: tuple[float, ...] | None = (0.0,)):
    parts = [NestPart(f"p{k}", (Contour(path),), 1, angles) for k, path in enumerate(paths)]
    budget = StripBudget(steps=3, failures=1)
    return ShapePacker(pieces_from_parts(parts), length, width, MARGIN, SPACING, 0, lambda: budget, threading.Event())


def fine(path: Polyline) -> shapely.Polygon:
    return shapely.Polygon(path.flattened(0.0005))


@pytest.mark.parametrize("path", OUTLINES.values(), ids=OUTLINES)
def test_the_outline_that_the_nester_gets_encloses_all_that_is_nearer_than_half_the_spacing(path: Polyline) -> None:
    points, (x, y), area = packer(path).enlarged_outline(0)
    given = shapely.Polygon([(px + x, py + y) for px, py in points])
    assert given.covers(fine(path).buffer(0.5 * SPACING, quad_segs=64))
    # Mitred corners reach twice as far at most, and fewer points take half a millimetre at most.
    assert fine(path).buffer(2.0 * (0.5 * SPACING + 0.6), quad_segs=64).covers(given)
    assert packer(path).required_area(0) == area == pytest.approx(given.area)


def test_a_round_outline_is_given_in_few_points_and_a_box_in_its_four() -> None:
    both = packer(OUTLINES["box"], OUTLINES["disc"])
    assert len(both.enlarged_outline(0)[0]) == 4
    assert len(both.enlarged_outline(1)[0]) < 0.7 * len(OUTLINES["disc"].flattened(0.01))


def test_an_outline_of_many_sharp_corners_is_grown_no_more_than_one_of_few() -> None:
    """Forty corners, of which none can be left out: beside half the spacing stays a hundredth, as for a box."""
    points = [
        (radius * math.cos(k * math.pi / 20), radius * math.sin(k * math.pi / 20))
        for k in range(40)
        for radius in [300.0 if k % 2 else 200.0]
    ]
    star = Polyline.of_points(points, closed=True)
    given = packer(star, length=900.0, width=900.0).enlarged_outline(0)[0]
    assert len(given) >= 40
    assert (
        fine(star).buffer(0.5 * SPACING + 0.02, join_style="mitre", mitre_limit=5.0).area >= shapely.Polygon(given).area
    )


def test_a_piece_has_room_on_an_empty_sheet_where_it_fits_at_one_of_its_angles() -> None:
    box = OUTLINES["box"]
    assert packer(box, length=30.0, width=10.0).fits_on_empty_sheet(0)
    assert not packer(box, length=29.9, width=10.0).fits_on_empty_sheet(0)
    assert not packer(box, length=10.0, width=30.0).fits_on_empty_sheet(0)
    assert packer(box, length=10.0, width=30.0, angles=(0.0, 0.5 * math.pi)).fits_on_empty_sheet(0)


def test_the_least_length_of_strip_is_that_of_the_angle_at_which_a_piece_fits_across() -> None:
    """Grown by half the spacing a box of 30 × 10 takes 34 × 14: upright 14 of the length, where 34 fit across."""
    quarters = (0.0, 0.5 * math.pi)
    assert packer(OUTLINES["box"], angles=quarters).enlarged_extent(0) == pytest.approx((14, 34), abs=0.05)
    assert packer(OUTLINES["box"], angles=quarters, width=20.0).enlarged_extent(0) == pytest.approx((34, 14), abs=0.05)
    assert packer(OUTLINES["box"], angles=quarters, width=9.0).enlarged_extent(0) == (math.inf, math.inf)


@pytest.mark.parametrize("angles", [(0.0,), (0.0, 0.5 * math.pi), None])
def test_what_a_short_search_lays_is_inside_the_margin_and_the_spacing_apart(
    angles: tuple[float, ...] | None,
) -> None:
    paths = [OUTLINES["box"], OUTLINES["star"]]
    made = packer(*paths, angles=angles)
    laid = made.fill(Counter({0: 2, 1: 2}), last=True)
    assert Counter(one.piece for one in laid) == {0: 2, 1: 2}
    lying = [fine(paths[one.piece].turned(one.angle).moved(one.x, one.y)) for one in laid]
    assert all(shapely.box(10, 10, 310, 130).buffer(1e-3).covers(shape) for shape in lying)
    assert min(a.distance(b) for a, b in itertools.combinations(lying, 2)) >= SPACING - 1e-3
    assert angles is None or all(one.angle in angles for one in laid)


def test_what_does_not_fit_the_strip_is_left_out_and_of_nothing_nothing_is_laid() -> None:
    long = Polyline.of_points([(0, 0), (400, 0), (400, 5), (0, 5)], closed=True)
    assert packer(long).fill(Counter({0: 2}), last=False) == []
    assert packer(OUTLINES["box"]).fill(Counter(), last=True) == []


def test_a_piece_that_takes_all_of_the_strip_is_given_to_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plank as long as the sheet fits it to a hair, and waits for one of its own; the others are laid without it."""
    given: list[list[tuple[float, float]]] = []

    def pack_strip(items: list[StripItem], *of: Any, **more: Any) -> Strip:
        given.extend(item.shape for item in items)
        return real(items, *of, **more)

    real = room.pack_strip
    monkeypatch.setattr(room, "pack_strip", pack_strip)
    plank = Polyline.of_points([(0, 0), (300, 0), (300, 115), (0, 115)], closed=True)
    made = packer(plank, OUTLINES["box"])
    assert made.fits_on_empty_sheet(0)
    laid = made.fill(Counter({0: 1, 1: 5}), last=False)
    assert Counter(one.piece for one in laid) == {1: 5}
    assert given
    assert all(max(x for x, _ in shape) - min(x for x, _ in shape) < 300.0 for shape in given)


def test_many_pieces_lie_in_bands_one_like_the_other() -> None:
    """Of 600 small boxes three bands of 200, a third of the sheet each."""
    small = Polyline.of_points([(0, 0), (6, 0), (6, 5), (0, 5)], closed=True)
    made = packer(small, length=896.0, width=296.0)
    laid = made.fill(Counter({0: 600}), last=False)
    assert len(laid) % 3 == 0 and len(laid) > 300
    bands = [laid[k * len(laid) // 3 : (k + 1) * len(laid) // 3] for k in range(3)]
    for k, band in enumerate(bands):
        assert [(b.x - a.x, b.y - a.y) for a, b in zip(bands[0], band, strict=True)] == [
            pytest.approx((300.0 * k, 0.0))
        ] * len(band)
