"""A way is made shorter only where all ground stays as near to it as it asks: by brute force over that ground."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from pocket_shapes import box, only_region

from leafcut.geometry.arrays import Points
from leafcut.model.pocket import Pocket
from leafcut.processes.pocket.plan.coverage_points import CoverageGrid
from leafcut.processes.pocket.plan.shorten import chamfer_corners, shorten_path, subdivide_path

REGION = only_region(Pocket(box(0, 0, 80, 60)))
ALLOWED = REGION.polygon.buffer(1e-7)
NONE = np.zeros((0, 2))
#: Maximum distance of the ground from the path, mm.
NEAR = 4.0
#: Along the middle of the pocket, with a detour of 5 mm to the side.
DETOUR = np.array([[15.0, 30.0], [40.0, 30.0], [40.0, 35.0], [41.0, 35.0], [41.0, 30.0], [65.0, 30.0]])
BEND = np.array([[15.0, 15.0], [65.0, 15.0], [65.0, 45.0]])


def ground(low: float, high: float) -> CoverageGrid:
    """Return ground that asks for a way within `NEAR` where its height is between two, and elsewhere for none."""

    def limit(points: Points, pitch: float) -> Points:
        return np.where((points[:, 1] > low) & (points[:, 1] < high), NEAR, 1000.0)

    return CoverageGrid(shapely.box(15, low, 65, high), 0.5, NEAR, limit)


def length(way: Points) -> float:
    return float(shapely.LineString(way).length)


def farthest(way: Points, places: Points) -> float:
    return float(shapely.distance(shapely.LineString(way), shapely.points(places)).max())


def places(low: float, high: float) -> Points:
    xs, ys = np.meshgrid(np.arange(15.0, 65.1, 0.5), np.arange(low, high + 0.1, 0.5))
    return np.column_stack([xs.ravel(), ys.ravel()])


def test_a_fine_way_is_the_same_way_in_pieces_no_longer_than_asked() -> None:
    way = np.array([[0.0, 0.0], [0.0, 0.0], [10.0, 0.0], [10.0, 7.0], [10.3, 7.0]])
    made = subdivide_path(way, 3.0)
    assert np.hypot(*np.diff(made, axis=0).T).max() <= 3.0 + 1e-12
    assert np.hypot(*np.diff(made, axis=0).T).min() > 0.0
    assert len(made) == 1 + 4 + 3 + 1
    assert shapely.LineString(made).equals(shapely.LineString(way))


def test_a_detour_that_no_ground_needs_is_left_out() -> None:
    made = shorten_path(DETOUR, ground(28.0, 32.0), REGION, ALLOWED, NONE, lambda: False)
    assert length(made) < length(DETOUR) - 8.0
    assert farthest(made, places(28.0, 32.0)) <= NEAR + 1e-6


def test_ground_that_only_the_detour_is_near_to_keeps_it() -> None:
    """Ground up to a height of 38 at the detour: 8 mm from the straight way, and so the tip is needed."""
    polygon = shapely.union_all([shapely.box(15, 28, 65, 32), shapely.box(40, 30, 41, 38)])
    whole = CoverageGrid(polygon, 0.5, NEAR, lambda points, pitch: np.full(len(points), NEAR))
    made = shorten_path(DETOUR, whole, REGION, ALLOWED, NONE, lambda: False)
    asked = np.array([[40.5, y] for y in np.arange(30.0, 38.01, 0.5)])
    assert farthest(made, asked) <= NEAR + 0.36
    assert made[:, 1].max() > 33.5


def test_what_is_beside_kept_places_stays_and_what_is_stopped_is_whole() -> None:
    kept = np.array([[40.5, 35.0], [40.5, 32.0], [40.5, 30.0]])
    made = shorten_path(DETOUR, ground(28.0, 32.0), REGION, ALLOWED, kept, lambda: False)
    detour = shapely.LineString([[40, 30], [40, 35], [41, 35], [41, 30]])
    assert shapely.LineString(made).buffer(1e-6).covers(detour)
    stopped = shorten_path(DETOUR, ground(28.0, 32.0), REGION, ALLOWED, NONE, lambda: True)
    assert stopped.tolist() == DETOUR.tolist()


def test_a_way_that_is_shortened_stays_where_the_tool_may_be() -> None:
    """A notch in the allowed region lies behind the bend: no curve goes over it."""
    notched = ALLOWED.difference(shapely.box(40.2, 29.9, 40.8, 34.9))
    made = shorten_path(DETOUR, ground(28.0, 32.0), REGION, notched, NONE, lambda: False)
    assert shapely.LineString(made).difference(notched.buffer(1e-6)).length == pytest.approx(0.0, abs=1e-6)


def test_a_sharp_corner_is_cut_off_where_the_ground_in_it_is_near_enough_and_not_beside_links() -> None:
    near = CoverageGrid(shapely.box(15, 15, 65, 45), 0.5, NEAR, lambda points, pitch: np.full(len(points), NEAR))
    made = chamfer_corners(BEND, near, REGION, ALLOWED, NONE, lambda: False)
    assert length(made) < length(BEND) - 0.5
    beside = [p for p in places(15.0, 45.0) if shapely.LineString(BEND).distance(shapely.Point(p)) <= NEAR - 0.5]
    assert farthest(made, np.array(beside)) <= NEAR + 0.5
    assert length(chamfer_corners(BEND, near, REGION, ALLOWED, BEND[1:2], lambda: False)) == pytest.approx(length(BEND))
    assert chamfer_corners(BEND, near, REGION, ALLOWED, NONE, lambda: True) is BEND
