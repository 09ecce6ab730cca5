"""Heights of a mesh in the cells of a grid: compared with clipped polygons and with every cell and triangle by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import Point, Polygon, box

from leafcut.kernels.surface import (
    dilate_heights,
    mesh_heights_at,
    raise_cells_at_centres,
    raise_cells_to_maximum,
    reach_in_cells,
)
from plain_python import plain_python

X, Y, CELL = -3.0, 2.0, 1.5


def triangles_of(seed: int, count: int) -> np.ndarray:
    """Return random triangles, some of them partly beside a grid of 8 rows and 10 columns."""
    rng = np.random.default_rng(seed)
    return np.stack(
        [rng.uniform(-6.0, 15.0, (count, 3)), rng.uniform(-1.0, 17.0, (count, 3)), rng.uniform(-5, 5, (count, 3))],
        axis=2,
    )


def plane_height(triangle: np.ndarray, x: float, y: float) -> float:
    """Return the height of the plane of a triangle, by solving for its three coefficients."""
    a, b, c = np.linalg.solve(np.column_stack([triangle[:, :2], np.ones(3)]), triangle[:, 2])
    return float(a * x + b * y + c)


def test_a_cell_is_as_high_as_the_highest_corner_of_the_triangles_clipped_to_it() -> None:
    triangles = triangles_of(1, 5)
    heights = np.full((8, 10), -math.inf)
    heights[:, 4] = 2.0
    wanted = heights.copy()
    for r, c in np.ndindex(*heights.shape):
        cell = box(X + c * CELL, Y + r * CELL, X + (c + 1) * CELL, Y + (r + 1) * CELL)
        for triangle in triangles:
            part = Polygon(triangle[:, :2]).intersection(cell)
            corners = [] if part.is_empty else part.exterior.coords
            wanted[r, c] = max([wanted[r, c], *(plane_height(triangle, x, y) for x, y in corners)])
    with plain_python():
        raise_cells_to_maximum(triangles, X, Y, CELL, heights)
    assert np.isneginf(wanted).any()
    assert heights == pytest.approx(wanted)


def test_an_upright_triangle_raises_the_cells_that_its_edges_cross() -> None:
    """A wall from 0.5, 0.5 to 3.5, 0.5 in cells of 1: its top edge rises from 1 to 4, its lower corner is at 1."""
    wall = np.array([[(0.5, 0.5, 1.0), (3.5, 0.5, 1.0), (3.5, 0.5, 4.0)]])
    for triangles in (wall, wall[:, ::-1], wall[:, :, [1, 0, 2]]):
        heights = np.full((5, 5), -math.inf)
        with plain_python():
            raise_cells_to_maximum(triangles, 0.0, 0.0, 1.0, heights)
        row = heights[0] if triangles[0, 0, 1] == triangles[0, 1, 1] else heights[:, 0]
        assert row.tolist() == [pytest.approx(1.5), pytest.approx(2.5), pytest.approx(3.5), 4.0, -math.inf]
        assert np.isfinite(heights).sum() == 4


@pytest.mark.parametrize("radius", [0.0, 0.4, 1.0, 1.7, 2.0, 3.3])
def test_a_cell_reaches_all_cells_with_a_point_within_the_radius_of_one_of_its_own(radius: float) -> None:
    heights = np.random.default_rng(2).uniform(-5, 5, (9, 11))
    reach, widest = reach_in_cells(radius, 1.0), np.zeros_like(heights)
    with plain_python():
        dilate_heights(heights, reach, widest)
    rows, columns = np.indices(heights.shape)
    for r, c in np.ndindex(*heights.shape):
        gap = np.hypot(np.maximum(abs(rows - r) - 1, 0), np.maximum(abs(columns - c) - 1, 0))
        assert widest[r, c] == heights[gap <= radius].max()


def test_the_highest_and_the_lowest_triangle_at_every_point_are_found() -> None:
    triangles = triangles_of(3, 9)
    triangles[0, 2] = triangles[0, :2].mean(axis=0)  # without area from above
    points = np.random.default_rng(3).uniform(-6, 17, (60, 2))
    points = points[np.argsort(points[:, 0])]
    top, under = np.full(60, -math.inf), np.full(60, math.inf)
    first = np.searchsorted(points[:, 0], triangles[:, :, 0].min(axis=1))
    with plain_python():
        mesh_heights_at(triangles, first, points[:, 0].copy(), points[:, 1].copy(), top, under)
    covered = 0
    for k, (x, y) in enumerate(points.tolist()):
        here = [plane_height(t, x, y) for t in triangles[1:] if Polygon(t[:, :2]).covers(Point(x, y))]
        covered += len(here) > 1
        assert top[k] == pytest.approx(max(here, default=-math.inf))
        assert under[k] == pytest.approx(min(here, default=math.inf))
    assert covered > 4


def test_the_middle_of_a_cell_is_as_high_as_the_highest_triangle_over_it() -> None:
    triangles = triangles_of(4, 12)
    triangles[5, 2] = triangles[5, :2].mean(axis=0)
    heights = np.full((8, 10), -1.0, dtype=np.float32)
    wanted = heights.copy()
    for r, c in np.ndindex(*heights.shape):
        x, y = X + c * CELL, Y + r * CELL
        for triangle in np.delete(triangles, 5, axis=0):
            if Polygon(triangle[:, :2]).covers(Point(x, y)):
                wanted[r, c] = max(wanted[r, c], plane_height(triangle, x, y))
    with plain_python():
        assert raise_cells_at_centres(heights, X, Y, CELL, triangles) == 11
    assert heights == pytest.approx(wanted, abs=1e-5)


def test_middles_on_the_edge_of_a_triangle_belong_to_it() -> None:
    """Corners at 0, 0; 4, 0 and 0, 4: of the middles at whole numbers 15 are inside or on the edge."""
    triangle = np.array([[(0.0, 0.0, 1.0), (4.0, 0.0, 5.0), (0.0, 4.0, 1.0)]])
    for corners in ([0, 1, 2], [2, 1, 0], [1, 2, 0]):
        heights = np.full((7, 7), -9.0, dtype=np.float32)
        with plain_python():
            assert raise_cells_at_centres(heights, -1.0, -1.0, 1.0, triangle[:, corners]) == 1
        for r, c in np.ndindex(7, 7):
            x, y = c - 1, r - 1
            assert heights[r, c] == pytest.approx(1.0 + x if x >= 0 and y >= 0 and x + y <= 4 else -9.0)
