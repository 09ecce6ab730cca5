"""Inside and distance, by which the proof finds moves over detached parts, against shapely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from leafcut.processes.sheet.proof.sheet import _comes_near, _distances, _is_inside


@pytest.mark.parametrize("seed", range(4))
def test_inside_and_distance_are_those_of_shapely(seed: int) -> None:
    """Stars with slanted and level edges, and random points."""
    chance = np.random.default_rng(seed)
    angles = np.sort(chance.uniform(0, 2 * np.pi, 12))
    reach = chance.uniform(2, 10, 12)
    corners = np.round(np.column_stack([reach * np.cos(angles), reach * np.sin(angles)]))
    edge = np.concatenate([corners, corners[:1]])
    polygon = shapely.Polygon(edge).buffer(0)
    assert np.isclose(polygon.area, shapely.Polygon(edge).area)  # it does not cross itself
    points = chance.uniform(-11, 11, (300, 2))
    assert _is_inside(points, edge).tolist() == shapely.contains_xy(polygon, points).tolist()
    exact = shapely.distance(shapely.LineString(edge), shapely.points(points))
    assert _distances(points, edge) == pytest.approx(exact)
    for point, away in zip(points[:40], exact[:40].tolist(), strict=True):
        assert _comes_near(point[None], edge, away + 1e-6)
        assert not _comes_near(point[None], edge, away - 1e-6)
