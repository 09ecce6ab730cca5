"""The benchmark of surfaces: its distances against closed forms, and a small run of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from benchmarked import benchmark
from leafcut.model.toolpath import ToolpathBuilder

surfaces = benchmark("surfaces")


def test_the_distance_of_a_point_from_a_box_is_that_of_its_closed_form() -> None:
    """Outside of a box it is the length of what each coordinate lies beyond its sides."""
    low, high = np.array([1.0, 2.0, -3.0]), np.array([4.0, 3.0, 5.0])
    triangles = surfaces.box(*low.tolist(), *high.tolist())
    for point in np.random.default_rng(4).uniform(-10.0, 12.0, (200, 3)):
        beyond = np.maximum(np.maximum(low - point, point - high), 0.0)
        if beyond.any():
            assert surfaces.distance(point[None], triangles) == pytest.approx(np.linalg.norm(beyond))
    assert surfaces.distance(np.zeros((1, 3)), np.zeros((0, 3, 3))) == math.inf


def test_the_rim_of_the_tip_is_what_comes_nearest() -> None:
    builder = ToolpathBuilder()
    builder.rapid(-20.0, 0.0, 5.0)
    builder.rapid(-7.0, 0.0, 5.0)
    builder.rapid(z=40.0)
    builder.rapid(0.0, 0.0, 40.0)
    path = builder.build()
    assert surfaces.least_distance(path, surfaces.box(-2, -2, 0, 2, 2, 20), 2.0) == pytest.approx(3.0)


def test_the_plates_have_holes_where_no_boss_stands(tmp_path: Path) -> None:
    plate = surfaces.plate_of(60, tmp_path)
    holes = np.loadtxt(plate.holes, delimiter=",", skiprows=1)
    assert len(holes) == 60
    triangles = surfaces.load_mesh(plate.mesh).triangles
    tall = triangles[triangles[:, :, 2].max(axis=1) > 7.0]
    shadow = shapely.union_all(shapely.convex_hull(shapely.multipoints(tall[:, :, :2])))
    assert not shapely.dwithin(shapely.points(holes[:, :2]), shadow, 2.5).any()


def test_low_ways_are_shorter_and_clear(tmp_path: Path) -> None:
    row: list[Any] = surfaces.row_of(surfaces.plate_of(24, tmp_path), "linuxcnc-mill", "fast")
    high, low, clear = (float(row[k]) for k in (2, 3, 6))
    assert low < high
    assert clear >= 1.9
