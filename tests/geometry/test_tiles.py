"""Shapes in tiles are as near to a place as the shapes themselves."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from leafcut.geometry.tiles import MOST_POINTS, Tiles


def panel(rows: int) -> shapely.Polygon:
    """A square plate with rows × rows round holes of 4 mm, 10 mm apart."""
    holes = [shapely.Point(10 + 10 * i, 10 + 10 * j).buffer(4.0) for i in range(rows) for j in range(rows)]
    side = 10.0 * (rows + 1)
    return shapely.Polygon(shapely.box(0, 0, side, side).exterior, [hole.exterior for hole in holes])


@pytest.mark.parametrize("distance", [0.0, 0.5, 3.9, 25.0])
def test_what_is_near_a_tiled_shape_is_what_shapely_says_is_near_the_whole(distance: float) -> None:
    chance = np.random.default_rng(3)
    line = shapely.LineString(np.column_stack([np.linspace(0, 60, 900), 70 + chance.uniform(-1, 1, 900)]))
    shapes = [panel(5), line, shapely.Point(90, 20).buffer(15, quad_segs=200)]
    places = shapely.points(chance.uniform(-30, 130, (400, 2)))
    first, second = Tiles(shapes).near(places, distance)
    near = shapely.dwithin(places[:, None], np.array(shapes)[None, :], distance)
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == set(zip(*map(list, np.nonzero(near)), strict=True))


def test_a_tile_of_a_part_with_many_holes_has_few_points_and_the_tiles_make_the_part() -> None:
    whole = panel(12)
    tiles = Tiles([whole])
    assert shapely.get_num_coordinates(whole) > 9000
    assert shapely.get_num_coordinates(tiles.shapes).max() <= MOST_POINTS
    assert shapely.area(tiles.shapes).sum() == pytest.approx(whole.area)
    assert shapely.union_all(tiles.shapes).symmetric_difference(whole).area < 1e-6
