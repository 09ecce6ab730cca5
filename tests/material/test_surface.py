"""A mesh seen from above: tiles, material near them, and the rims of holes, against points on the triangles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.material.surface import build_safe_tiles, heights_around_holes
from meshes import box_triangles

CORNER = st.tuples(st.floats(0, 30), st.floats(0, 20), st.floats(-5, 25))


@given(st.lists(st.tuples(CORNER, CORNER, CORNER), min_size=1, max_size=4), st.floats(0.0, 4.0))
def test_no_place_of_a_surface_is_higher_than_the_tiles_within_reach_of_it(triangles, radius: float) -> None:
    """Places all over the triangles, each looked for from places within the radius around it."""
    surface = np.array(triangles)
    tiles = build_safe_tiles(surface, radius, 2.0, 40)
    share = np.array([(i / 12, j / 12) for i in range(13) for j in range(13 - i)])
    weights = np.column_stack([1 - share.sum(axis=1), share])
    places = np.einsum("pk,tkc->tpc", weights, surface).reshape(-1, 3)
    for angle in np.linspace(0, math.tau, 8, endpoint=False):
        xy = places[:, :2] + 0.999 * radius * np.array([math.cos(angle), math.sin(angle)])
        column, row = np.floor((xy - (tiles.x, tiles.y)) / tiles.side).astype(int).T
        assert (tiles.heights[row, column] >= places[:, 2] + 2.0 - 1e-6).all()


def test_a_tile_is_no_higher_than_what_is_near_it() -> None:
    """Of a plate at 0 with a boss at 9: two tiles and the radius beside the boss it is as high as the plate."""
    surface = np.concatenate([box_triangles(0, 0, -5, 60, 40, 0), box_triangles(20, 10, 0, 30, 20, 9)])
    tiles = build_safe_tiles(surface, 3.0, 1.0, 120)
    rows, columns = np.indices(tiles.heights.shape)
    x, y = tiles.x + (columns + 0.5) * tiles.side, tiles.y + (rows + 0.5) * tiles.side
    away = np.hypot(np.maximum(np.maximum(20 - x, x - 30), 0), np.maximum(np.maximum(10 - y, y - 20), 0))
    assert set(np.unique(tiles.heights[away > 3.0 + 2 * tiles.side]).tolist()) <= {1.0, -math.inf}
    assert (tiles.heights[away < 3.0] == 10.0).all()


def test_the_rim_of_a_hole_tells_where_it_begins_and_how_thick_the_part_is() -> None:
    """A hole that is open in the mesh, one that is not, one half over a step, and one beside the part."""
    plate = [box_triangles(0, 0, -8, 40, 40, 0), box_triangles(40, 0, -8, 80, 40, 6)]
    ring = [box_triangles(80, 0, -8, 120, 18, 2), box_triangles(80, 22, -8, 120, 40, 2),
            box_triangles(80, 18, -8, 98, 22, 2), box_triangles(102, 18, -8, 120, 22, 2)]  # fmt: skip
    surface = np.concatenate([*plate, *ring])
    rims = heights_around_holes(
        surface, np.array([(20.0, 20.0), (60.0, 20.0), (100.0, 20.0), (40.0, 30.0), (130.0, 20.0)]), np.full(5, 2.9)
    )
    assert rims.top[:4].tolist() == [0.0, 6.0, 2.0, 6.0]
    assert rims.lowest[:4].tolist() == [0.0, 6.0, 2.0, 0.0]
    assert rims.under[:4].tolist() == [-8.0] * 4
    assert rims.lowest[4] == -math.inf


def test_a_slope_is_exact_over_a_place() -> None:
    """z = x / 2 − y / 4 over two triangles: the highest of the rim of a hole at 10, 8."""
    corners = [(x, y, x / 2 - y / 4) for x, y in ((0, 0), (30, 0), (30, 30), (0, 30))]
    surface = np.array([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]], dtype=np.float64)
    rims = heights_around_holes(surface, np.array([(10.0, 8.0)]), np.array([1.9]))
    steepest = math.hypot(1 / 2, 1 / 4)
    assert rims.top[0] == pytest.approx(3.0 + 2.0 * steepest, abs=2.0 * steepest * (1 - math.cos(math.pi / 24)))
    assert rims.lowest[0] == pytest.approx(3.0 - 2.0 * steepest, abs=2.0 * steepest * (1 - math.cos(math.pi / 24)))
