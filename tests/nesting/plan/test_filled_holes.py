"""Small parts in the holes of large parts: none is lost, and all keep the spacing from the edge of the hole."""

from __future__ import annotations

import math
from collections import Counter

import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart
from leafcut.nesting.plan.nesting import nest_in_holes
from leafcut.nesting.plan.pieces import NestPiece, pieces_from_parts

#: A frame of 200 with a hole of 120, and what may lie in it.
HOLE = (40.0, 40.0, 160.0, 160.0)


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def frame(quantity: int, rotations: tuple[float, ...] | None = (0.0,)) -> NestPart:
    return NestPart("frame", (Contour(box(0, 0, 200, 200)), Contour(box(*HOLE))), quantity, rotations)


def small(side: float, quantity: int, rotations: tuple[float, ...] | None = (0.0,)) -> NestPart:
    return NestPart("small", (Contour(box(0, 0, side, side)),), quantity, rotations)


def made(*parts: NestPart, spacing: float = 5.0) -> tuple[list[NestPiece], list[int], Counter[int]]:
    """Return the pieces, their counts, and how many of each part there are in all of them."""
    pieces, counts = nest_in_holes(parts, pieces_from_parts(parts), spacing)
    every = Counter[int]()
    for piece, count in zip(pieces, counts, strict=True):
        for member in piece.members:
            every[member.part] += count
    return pieces, counts, every


def test_no_part_is_lost_or_made_twice_by_being_laid_into_a_hole() -> None:
    for wanted in ((1, 3), (2, 3), (3, 40), (4, 1)):
        *_, every = made(frame(wanted[0]), small(50.0, wanted[1]))
        assert (every[0], every[1]) == wanted


def test_as_many_as_have_room_lie_in_the_hole_the_spacing_away_from_its_edge_and_from_each_other() -> None:
    """2 · 50 + 3 · 5 = 115 of 120 mm: four squares of 50."""
    pieces, counts, _ = made(frame(1), small(50.0, 9))
    (full,) = [p for p in pieces if len(p.members) > 1]
    laid = [shapely.box(m.x, m.y, m.x + 50, m.y + 50) for m in full.members[1:]]
    assert len(laid) == 4
    edge = shapely.box(*HOLE).boundary
    assert all(shapely.box(*HOLE).covers(s) and s.distance(edge) >= 5.0 for s in laid)
    assert min(a.distance(b) for a in laid for b in laid if a is not b) >= 5.0
    assert sorted(counts) == [1, 5]


def test_what_is_too_large_for_the_hole_with_its_spacing_stays_outside() -> None:
    pieces, counts, _ = made(frame(1), small(111.0, 2))
    assert all(len(piece.members) == 1 for piece in pieces)
    assert counts == [1, 2]


def test_what_lies_in_a_hole_may_hold_something_itself() -> None:
    ring = NestPart("ring", (Contour(box(0, 0, 100, 100)), Contour(box(20, 20, 80, 80))), 1, (0.0,))
    pieces, counts, every = made(frame(1), ring, small(30.0, 1))
    assert (len(pieces), counts, dict(every)) == (1, [1], {0: 1, 1: 1, 2: 1})


def test_a_part_lies_in_a_hole_only_at_its_own_angles_however_the_other_is_turned() -> None:
    """The frame may be turned by a quarter: what may only lie upright would then lie across."""
    quarters = (0.0, 0.5 * math.pi)
    assert all(len(p.members) == 1 for p in made(frame(1, quarters), small(50.0, 4))[0])
    pieces, _, _ = made(frame(1, quarters), small(50.0, 4, tuple(k * 0.5 * math.pi for k in range(4))))
    assert max(len(p.members) for p in pieces) == 5


def test_frames_are_filled_alike_as_long_as_there_is_enough_and_the_last_gets_the_rest() -> None:
    pieces, counts, _ = made(frame(3), small(50.0, 9))
    assert sorted(zip((len(p.members) for p in pieces), counts, strict=True)) == [(2, 1), (5, 2)]


def test_a_hole_that_crosses_itself_holds_nothing() -> None:
    bow = Polyline.of_points([(40, 40), (160, 160), (160, 40), (40, 160)], closed=True)
    part = NestPart("bow", (Contour(box(0, 0, 200, 200)), Contour(bow)), 1, (0.0,))
    pieces, counts, every = made(part, small(20.0, 3))
    assert (dict(every), counts) == ({0: 1, 1: 3}, [1, 3])
    assert sum(len(p.members) for p in pieces) == pytest.approx(2)
