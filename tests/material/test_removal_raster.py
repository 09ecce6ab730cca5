"""Removal by polygons and by pixels agree: two methods that share no code."""

from __future__ import annotations

import math

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from removal_raster import raster_areas

from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline
from leafcut.material.removal import measure_removal
from leafcut.model.pocket import Pocket, PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.clearing import measure_path

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
PIXEL = 0.25


def room_for(*shapes: object) -> float:
    """What counting pixels may be off by: half a pixel along every edge, and a little for few pixels, mm²."""
    return sum(0.5 * PIXEL * shape.length for shape in shapes) + 20 * PIXEL**2


def agree(pocket: Pocket, path: PocketPath) -> None:
    """Compare the areas of both methods."""
    found, raster = measure_removal(pocket, path, RULES), raster_areas(pocket, path, RULES, PIXEL)
    assert raster.pixel == PIXEL
    assert raster.pocket_mm2 == pytest.approx(found.pocket.area, abs=room_for(found.pocket))
    assert raster.reachable_mm2 == pytest.approx(found.reachable.area, abs=room_for(found.reachable))
    # Both leave out films: the tolerance along their edges.
    film = 0.02 * found.swept.length
    assert raster.uncovered_mm2 == pytest.approx(found.uncovered.area, abs=room_for(found.uncovered) + film)
    assert raster.gouge_mm2 == pytest.approx(found.gouges.area, abs=room_for(found.gouges) + film)


def test_a_disc_of_pixels_has_the_area_of_a_circle() -> None:
    pocket = Pocket(Polyline.circle(3, -2, 20), (Polyline.circle(3, -2, 5, clockwise=True),))
    raster = raster_areas(pocket, PocketPath("test", ()), RULES, 0.1)
    assert raster.pocket_mm2 == pytest.approx(math.pi * (400 - 25), rel=1e-3)
    assert raster.uncovered_mm2 == raster.reachable_mm2 == pytest.approx(raster.pocket_mm2, rel=2e-3)


def test_a_large_pocket_gets_larger_pixels_and_not_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("removal_raster.MOST_PIXELS", 1_000_000)
    side = 20_000.0
    pocket = Pocket(Polyline.of_points([(0, 0), (side, 0), (side, side), (0, side)], closed=True))
    path = PocketPath("test", (PocketPiece(Polyline.of_points([(100, 100), (200, 100)])),))
    rules = PocketRules(tool_diameter=200.0, step_over=120.0)
    raster = raster_areas(pocket, path, rules, 0.1)
    assert raster.pixel > 16.0
    swept = 100 * 200 + math.pi * 100**2
    assert raster.reachable_mm2 - raster.uncovered_mm2 == pytest.approx(swept, rel=0.03)


def test_round_an_island_both_say_the_same_of_what_is_cut_left_and_hurt() -> None:
    island = Polyline.of_points([(-6, -6), (-6, 6), (6, 6), (6, -6)], closed=True)
    pocket = Pocket(Polyline.circle(0, 0, 30), (island,))
    pieces = (Polyline.circle(0, 0, 25), Polyline.circle(0, 0, 12), Polyline.of_points([(0, 12), (0, 27)]))
    agree(pocket, PocketPath("test", tuple(PocketPiece(piece) for piece in pieces)))


numbers = st.floats(-30.0, 30.0).map(lambda v: round(v, 3))
points = st.tuples(numbers, numbers)


@given(
    corners=st.lists(points, min_size=3, max_size=7),
    lines=st.lists(st.lists(points, min_size=2, max_size=5), max_size=4),
)
def test_random_paths_in_random_pockets_have_the_same_areas_by_both(
    corners: list[tuple[float, float]], lines: list[list[tuple[float, float]]]
) -> None:
    hull = shapely.MultiPoint(corners).convex_hull.buffer(7.0, quad_segs=6)
    agree(
        Pocket(as_polyline(hull.exterior.coords, True)),
        PocketPath("test", tuple(PocketPiece(Polyline.of_points(line)) for line in lines)),
    )


@given(line=st.lists(points, min_size=2, max_size=8, unique=True))
def test_of_any_path_the_measures_keep_their_bounds(line: list[tuple[float, float]]) -> None:
    pocket = Pocket(Polyline.of_points([(-40, -40), (40, -40), (40, 40), (-40, 40)], closed=True))
    m = measure_path(pocket, PocketPath("test", (PocketPiece(Polyline.of_points(line)),)), RULES)
    assert m.gouge_mm2 == 0.0
    assert 0.0 <= m.mean_engagement <= m.max_engagement + 1e-9 <= math.pi + 2e-9
    assert m.max_engagement == pytest.approx(math.pi)  # starts in full material
    assert 0.0 <= m.air_mm <= m.feed_mm + 1e-6
    # Removed area, by the engagement: the width of material at every step is at least half of the swept width.
    assert m.reachable_mm2 - m.uncovered_mm2 <= math.pi * 25 + 10.0 * m.feed_mm + 1e-6
