"""Shortest paths around obstacles, against brute force and by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.obstacles import CLEARANCE, MARGIN, ObstacleMap, shortest_path

SQUARES = {0: shapely.box(0, 0, 10, 10), 1: shapely.box(15, 0, 25, 10)}


@pytest.mark.parametrize("seed", range(8))
def test_no_other_path_of_a_small_graph_is_shorter(seed: int) -> None:
    chance = np.random.default_rng(seed)
    lengths = chance.uniform(1.0, 10.0, (6, 6))
    lengths[chance.random((6, 6)) < 0.4] = math.inf
    orders = (order for n in range(5) for order in itertools.permutations(range(2, 6), n))
    paths = [[0, *order, 1] for order in orders]
    best = min(paths, key=lambda path: sum(lengths[a, b] for a, b in itertools.pairwise(path)))
    length = sum(lengths[a, b] for a, b in itertools.pairwise(best))
    everywhere = np.arange(6)
    found = shortest_path(6, lambda node: (everywhere, lengths[node]), 0, (1,))
    assert found == (best if math.isfinite(length) else None)


def test_the_nearest_of_several_ends_is_reached_by_the_shorter_of_two_edges() -> None:
    edges = {0: ([1, 1, 2], [5.0, 3.0, 1.0]), 2: ([3], [2.5])}
    arrays = {node: (np.array(ends), np.array(lengths)) for node, (ends, lengths) in edges.items()}
    assert shortest_path(4, lambda node: arrays[node], 0, (1, 3)) == [0, 1]


def test_a_path_keeps_the_radius_from_standing_polygons_and_ignores_others() -> None:
    """From the left of the first square to its right: straight over it, or around two of its corners."""
    obstacles = ObstacleMap(SQUARES, {})
    a, b = (-5.0, 4.0), (12.5, 4.0)
    assert obstacles.polygons_crossed(a, b) == {0}
    assert obstacles.path_around(a, b, set(), 2.0) == []
    corners = obstacles.path_around(a, b, {0}, 2.0)
    assert corners is not None
    beside = max(MARGIN, 2.0 + CLEARANCE)
    assert {y for _, y in corners} <= {-beside, 10.0 + beside}
    assert shapely.LineString([a, *corners, b]).distance(SQUARES[0]) >= 2.0 - 0.02
    assert obstacles.path_around(a, b, {0}, 2.0) == corners


@pytest.mark.parametrize("radius", [0.0, 2.0])
def test_no_path_crosses_a_wall_whatever_stands(radius: float) -> None:
    """A wall beside the first square closes the shorter side, also to a line between two of its corners."""
    wall = shapely.box(-2, -30, 12, -0.5)
    a, b = (-5.0, 4.0), (12.5, 4.0)
    corners = ObstacleMap(SQUARES, {-1: wall}).path_around(a, b, {0}, radius)
    assert corners is not None
    assert {y for _, y in corners} == {10.0 + max(MARGIN, radius + CLEARANCE)}


def test_a_head_enclosed_by_standing_polygons_has_no_path() -> None:
    """Four plates leave 1 mm around the start; the head has a radius of 2 mm."""
    sides = {0: (-20, -20, -1, 20), 1: (1, -20, 20, 20), 2: (-1, -20, 1, -1), 3: (-1, 1, 1, 20)}
    obstacles = ObstacleMap({n: shapely.box(*side) for n, side in sides.items()}, {})
    a, b = (0.0, 0.0), (0.0, 50.0)
    assert obstacles.path_around(a, b, {0, 1, 2, 3}, 2.0) is None
    assert obstacles.path_around(b, a, {0, 1, 2, 3}, 2.0) is None
    assert obstacles.path_around(a, b, {1}, 2.0) is not None
