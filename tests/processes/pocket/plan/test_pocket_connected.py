"""The connected path: the sample points it checks, and stopping it at any time."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from pocket_shapes import RULES, box, l_shape, leaves, only_region, plate, uncovered_share

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Points
from leafcut.material.step_over import WidePlaceFinder
from leafcut.model.pocket import Pocket
from leafcut.processes.pocket.plan import connected_rings as pocket_best
from leafcut.processes.pocket.plan.connected_rings import connected_path
from leafcut.processes.pocket.plan.coverage_points import CoverageGrid
from leafcut.processes.pocket.plan.stationed_path import StationedPath


@pytest.mark.parametrize("name", ["plate", "l_shape"])
@pytest.mark.parametrize("asked", [0, 40])
def test_a_connected_way_that_is_stopped_at_any_time_is_one_and_clears_all_ground(name: str, asked: int) -> None:
    region, count = only_region({"plate": plate, "l_shape": l_shape}[name]()), itertools.count()
    path = connected_path(region, WidePlaceFinder(region.polygon, RULES), lambda: next(count) >= asked)
    assert next(count) > asked
    assert path.retracts == 0
    assert leaves(region, path) < 1e-6
    assert uncovered_share(region, path) < 1e-4


def test_a_connected_way_that_is_stopped_is_no_shorter_than_one_that_is_not() -> None:
    region = only_region(plate())
    assert connected_path(region).feed_mm < connected_path(region, stopped=lambda: True).feed_mm


def test_what_is_stopped_while_it_is_corrected_is_the_way_that_was_there_before() -> None:
    """A judge that finds something wrong everywhere, and time that is over when it has done so once."""
    region, judged = only_region(Pocket(box(0, 0, 80, 60))), []
    path = connected_path(region, lambda path: judged.append(path) or np.array([[20.0, 20.0]]), lambda: bool(judged))
    assert [path] == judged


def test_the_places_beside_a_way_are_all_that_it_is_near_enough_to() -> None:
    """By brute force over the whole grid: every pair of a piece that is looked at and a place near enough to it."""
    polygon = only_region(plate()).polygon
    way = np.column_stack([np.linspace(8.0, 62.0, 160), 14.0 + 5.0 * np.sin(np.linspace(0.0, 9.0, 160))])
    looked = np.zeros(159, dtype=bool)
    looked[20:40] = looked[150:] = True

    def limit(points: Points, pitch: float) -> Points:
        return 2.0 + 0.5 * np.sin(points[:, 0])

    ground = CoverageGrid(polygon, 0.5, 2.5, limit)
    ground.points_near(way, ~looked)  # known points change nothing
    places = ground.points_near(way, looked)
    piece, place = places.pairs_within_limit(way)
    found = {(int(p), *places.points[k].round(6)) for p, k in zip(piece, place, strict=True) if looked[p]}
    low = np.array(polygon.bounds[:2])
    grid = low + 0.5 * np.array(list(itertools.product(range(140), range(140))))
    grid = grid[shapely.contains_xy(polygon, grid[:, 0], grid[:, 1])]
    lines = shapely.linestrings(np.stack([way[:-1], way[1:]], axis=1))[looked]
    near = shapely.distance(lines[:, None], shapely.points(grid)[None]) <= limit(grid, 0.5)
    rows = np.flatnonzero(looked)
    assert found == {(int(rows[i]), *grid[k].round(6)) for i, k in np.argwhere(near)}


def test_ground_that_would_have_too_many_places_has_them_further_apart() -> None:
    ground = CoverageGrid(shapely.box(0, 0, 1000, 1000), 0.01, 2.0, lambda points, pitch: np.full(len(points), 2.0))
    way = np.column_stack([np.linspace(100.0, 900.0, 1601), np.full(1601, 500.0)])
    places = ground.points_near(way, np.ones(1600, dtype=bool))
    assert 20_000 < len(places.points) <= 200_000
    assert ground.pitch > 0.01


def test_a_track_is_nearest_where_shapely_finds_it() -> None:
    points = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 7.0), (3.0, 9.0)])
    places = np.random.default_rng(3).uniform(-4.0, 14.0, (50, 2))
    line = shapely.LineString(points)
    away, stations = StationedPath(points).nearest_stations(places)
    assert away == pytest.approx(shapely.distance(line, shapely.points(places)))
    feet = StationedPath(points).positions_at(stations)
    assert np.hypot(*(feet - places).T) == pytest.approx(away)
    assert StationedPath(points).stations[-1] == pytest.approx(17.0 + math.hypot(7.0, 2.0))


def test_more_rings_in_each_other_than_can_be_joined_are_refused_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rings of 80 × 60 mm by a tool of 10 mm, 6 mm apart: there are five."""
    region = only_region(Pocket(box(0, 0, 80, 60)))
    monkeypatch.setattr(pocket_best, "MOST_LEVELS", 4)
    with pytest.raises(PlanError, match="4 nested rings or more; use --strategy contour"):
        connected_path(region)
    monkeypatch.setattr(pocket_best, "MOST_LEVELS", 5)
    assert connected_path(region).retracts == 0
