"""Blocks of equal parts for common lines: no part is lost, and neighbours are exactly one kerf apart."""

from __future__ import annotations

import itertools
import math

import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestPart, Placement
from leafcut.nesting.plan.blocks import MAX_MEMBERS, group_in_blocks
from leafcut.nesting.plan.pieces import pieces_from_parts

KERF = 1.5
QUARTERS = tuple(math.radians(a) for a in (0, 90, 180, 270))
SHAPES = {
    "rectangle": [(0, 0), (60, 0), (60, 25), (0, 25)],
    "right triangle": [(5, 5), (65, 5), (5, 45)],
    "trapezoid": [(0, 0), (50, 0), (35, 30), (15, 30)],
    "angle": [(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)],
}


def blocks_of(shape: str, kind: str, count: int, angles: tuple[float, ...] | None = QUARTERS):
    path = Polyline.of_points(SHAPES[shape], closed=True)
    pieces = pieces_from_parts([NestPart(shape, (Contour(path),), count, angles)])
    return path, *group_in_blocks(pieces, [count], KERF, kind, (1000.0, 600.0))


def polygons(path: Polyline, members: tuple[Placement, ...]) -> list[shapely.Polygon]:
    return [shapely.Polygon(m.placed(path).vertices[:, :2]) for m in members]


@pytest.mark.parametrize("kind", ["pairs", "rows", "grids"])
@pytest.mark.parametrize("shape", list(SHAPES))
def test_blocks_hold_every_part_once_and_neighbours_a_kerf_apart(shape: str, kind: str) -> None:
    path, blocks, counts = blocks_of(shape, kind, 17)
    assert sum(len(b.members) * n for b, n in zip(blocks, counts, strict=True)) == 17
    for block in blocks:
        parts = polygons(path, block.members)
        assert len(parts) <= (2 if kind == "pairs" else MAX_MEMBERS)
        gaps = [a.distance(b) for a, b in itertools.combinations(parts, 2)]
        assert all(gap > KERF - 1e-6 for gap in gaps)
        for part in parts if len(parts) > 1 else []:
            assert min(part.distance(other) for other in parts if other is not part) == pytest.approx(KERF)
        whole = shapely.Polygon(block.path.vertices[:, :2]).buffer(1e-6)
        assert all(whole.contains(part) for part in parts)


def test_plasma_has_two_rows_at_most_since_every_line_begins_in_the_scrap() -> None:
    path, blocks, _ = blocks_of("rectangle", "rows", 12)
    x = {round(p.centroid.x, 3) for p in polygons(path, blocks[0].members)}
    y = {round(p.centroid.y, 3) for p in polygons(path, blocks[0].members)}
    assert len(blocks[0].members) == 12
    assert min(len(x), len(y)) == 2


def test_a_part_that_may_not_be_turned_by_half_a_turn_makes_no_pair() -> None:
    _, blocks, counts = blocks_of("trapezoid", "pairs", 4, (0.0, 0.5 * math.pi))
    assert counts == [4]
    assert len(blocks[0].members) == 1
