"""Lines near to each other are found whichever way most of them are decided."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from leafcut.geometry.index import NearLines, ShapeIndex, unique_pairs


def lines_of(seed: int, n: int) -> np.ndarray:
    """Return lines of a few points, crossing, far apart, upright; some are places only."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(n):
        points = rng.uniform(0, 100, 2) + np.cumsum(rng.uniform(-6, 6, (int(rng.integers(1, 6)), 2)), axis=0)
        points = points.round(int(rng.integers(0, 3)))
        found.append(shapely.Point(points[0]) if len(np.unique(points, axis=0)) < 2 else shapely.LineString(points))
    return np.array(found, dtype=object)


@pytest.mark.parametrize("reach", [0.05, 1.0, 12.0, 300.0])
def test_near_lines_are_those_that_geos_finds_by_their_distance(reach: float) -> None:
    """All pairs of two sets of lines, and of one set, against GEOS's distance of every pair."""
    one, other = lines_of(1, 300), lines_of(2, 200)
    for a, b in ((one, other), (one, one)):
        found = [unique_pairs(*pair) for pair in NearLines(a).pairs(NearLines(b), reach)]
        expected = np.argwhere(shapely.distance(a[:, None], b[None, :]) <= reach)
        pairs = np.concatenate(found)
        assert np.array_equal(pairs[np.lexsort(pairs.T[::-1])], expected)


def test_only_pairs_that_are_wanted_are_looked_at() -> None:
    lines = lines_of(3, 100)
    near = NearLines(lines)
    found = np.concatenate([unique_pairs(*p) for p in near.pairs(near, 9.0, lambda a, b: a < b)])
    every = np.concatenate([unique_pairs(*p) for p in near.pairs(near, 9.0)])
    assert np.array_equal(found, every[every[:, 0] < every[:, 1]])


def test_pairs_are_told_once_and_in_order() -> None:
    assert unique_pairs(np.array([3, 0, 3, 0]), np.array([1, 2, 1, 0])).tolist() == [[0, 0], [0, 2], [3, 1]]
    assert unique_pairs(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)).shape == (0, 2)


def panel(rows: int) -> shapely.Polygon:
    """Return a square plate with rows × rows round holes of 4 mm, 10 mm apart."""
    holes = [shapely.Point(10 + 10 * i, 10 + 10 * j).buffer(4.0) for i in range(rows) for j in range(rows)]
    side = 10.0 * (rows + 1)
    return shapely.Polygon(shapely.box(0, 0, side, side).exterior, [hole.exterior for hole in holes])


@pytest.mark.parametrize("distance", [0.0, 0.5, 3.9, 25.0])
def test_shapes_near_points_are_those_of_shapely(distance: float) -> None:
    chance = np.random.default_rng(3)
    line = shapely.LineString(np.column_stack([np.linspace(0, 60, 900), 70 + chance.uniform(-1, 1, 900)]))
    shapes = [panel(5), line, shapely.Point(90, 20).buffer(15, quad_segs=200)]
    places = shapely.points(chance.uniform(-30, 130, (400, 2)))
    near = shapely.dwithin(places[:, None], np.array(shapes)[None, :], distance)
    assert np.array_equal(ShapeIndex(shapes).pairs_near(places, distance), np.nonzero(near))
