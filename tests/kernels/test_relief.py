"""Travel heights over tiles: compared with the tiles that a line or a box touches, one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import LineString, box

from leafcut.kernels.cost import (
    CODES,
    CostModel,
    box_touches_zone,
    max_tile_height_in_box,
    max_tile_height_on_line,
    node_travel_cost,
    relief_table,
    segment_touches_zone,
    travel_heights_along_path,
)
from leafcut.model.problem import Metric
from leafcut.order.instance import build_cost_model, matrix_of_nodes
from plain_python import plain_python
from travel_reference import travel_cost

X, Y, SIDE = -4.0, 3.0, 2.0
TILES = np.random.default_rng(1).uniform(1.0, 9.0, (6, 9))
TILES[1:3, 2:5] = -math.inf


def touched(shape: LineString) -> float:
    """Return the height of the highest tile that a shape touches, −∞ for none."""
    found = -math.inf
    for r, c in np.ndindex(*TILES.shape):
        x, y = X + c * SIDE, Y + r * SIDE
        if shape.intersects(box(x, y, x + SIDE, y + SIDE)):
            found = max(found, float(TILES[r, c]))
    return found


def table_of(heights: np.ndarray) -> np.ndarray:
    """Return the table of the tiles, with velocity 5 mm/s and acceleration 40 mm/s² of z."""
    return relief_table((X, Y, SIDE, 5.0, 40.0), TILES, heights)


def ends(seed: int, count: int) -> np.ndarray:
    """Return ends of moves, some of them beside the tiles."""
    return np.random.default_rng(seed).uniform((X - 6, Y - 6), (X + 24, Y + 18), (count, 2, 2))


def test_a_line_and_a_box_are_as_high_as_the_highest_tile_that_they_touch() -> None:
    table, none = table_of(np.zeros(3)), 0
    moves = ends(2, 120)
    moves[100:110, 1, 0] = moves[100:110, 0, 0]  # along y
    moves[110:, 1, 1] = moves[110:, 0, 1]  # along x
    moves[50:60, 1] = moves[50:60, 0] + (0.1, 0.05)  # within a tile
    with plain_python():
        for (x0, y0), (x1, y1) in moves.tolist():
            line = touched(LineString([(x0, y0), (x1, y1)]))
            assert (
                max_tile_height_on_line(table, x0, y0, x1, y1) == max_tile_height_on_line(table, x1, y1, x0, y0) == line
            )
            area = box(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))
            assert (
                max_tile_height_in_box(table, x0, y0, x1, y1)
                == max_tile_height_in_box(table, x1, y1, x0, y0)
                == touched(area)
            )
            none += line == -math.inf
    assert 10 < none < 80


@pytest.mark.parametrize("name", ["euclidean", "manhattan", "linear", "dogleg"])
def test_a_move_rises_from_its_start_to_the_travel_height_and_descends_to_its_end(name: str) -> None:
    """More nodes than a row of the table has columns; lengths add the heights, times add two moves of z."""
    n = 23
    xy, heights = ends(3, n)[:, 0], np.random.default_rng(3).uniform(0.0, 6.0, n)
    metric = Metric(name, (10.0, 20.0), (50.0, 40.0), 0.01)
    bare = build_cost_model(metric, xy)
    model = bare._replace(matrix=table_of(heights), plain=False)
    assert model.matrix.shape == (1 + 3 + 6, 9)

    def rise(height: float) -> float:
        if name not in ("linear", "dogleg"):
            return height
        return height / 5.0 + 5.0 / 40.0 if height >= 25.0 / 40.0 else 2.0 * math.sqrt(height / 40.0)

    found = np.zeros(n - 1)
    with plain_python():
        travel_heights_along_path(CODES[name], xy, model.matrix, found)
        for i in range(n - 1):
            line = LineString(xy[i : i + 2])
            top = max(touched(line if name != "dogleg" else line.envelope), heights[i], heights[i + 1])
            assert found[i] == top
            cost = (
                travel_cost(metric, tuple(xy[i]), tuple(xy[i + 1]))
                + rise(top - heights[i])
                + rise(top - heights[i + 1])
            )
            assert node_travel_cost(model, i, i + 1) == pytest.approx(cost)
            assert node_travel_cost(model, i + 1, i) == pytest.approx(cost)
            assert node_travel_cost(model._replace(free=i), i, i + 1) == 0.0


def test_a_part_of_the_nodes_has_the_same_costs_with_its_own_table() -> None:
    n = 23
    xy, heights = ends(4, n)[:, 0], np.random.default_rng(4).uniform(0.0, 6.0, n)
    model = build_cost_model(Metric(), xy)._replace(matrix=table_of(heights), plain=False)
    nodes = np.array([20, 3, 17, 4, 5, 11, 0, 9, 10, 22, 1], dtype=np.int32)
    part: CostModel = model._replace(xy=xy[nodes], matrix=matrix_of_nodes(model, nodes))
    with plain_python():
        for i in range(len(nodes) - 1):
            assert node_travel_cost(part, i, i + 1) == node_travel_cost(model, nodes[i], nodes[i + 1])


def test_a_narrow_field_of_tiles_has_a_table_of_seven_columns() -> None:
    tiles, heights = np.arange(6.0).reshape(3, 2), np.arange(10.0, 19.0)
    table = relief_table((1.0, 2.0, 3.0, 4.0, 5.0), tiles, heights)
    assert table.tolist() == [
        [1.0, 2.0, 3.0, 4.0, 5.0, 2.0, 2.0],
        [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0],
        [17.0, 18.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [4.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ]


def test_a_zone_is_crossed_or_overlapped_as_the_geometry_library_says() -> None:
    zones = np.array([[0.0, 0.0, 1.0, 1.0], [2.0, 5.0, 9.0, 11.0]])
    area = box(*zones[1])
    moves = ends(5, 100)
    moves[80:90, 1, 0] = moves[80:90, 0, 0]
    moves[90:, 1, 1] = moves[90:, 0, 1]
    crossed = 0
    with plain_python():
        for move in moves:
            line = LineString(move)
            crossed += line.intersects(area)
            given = (*move[0].tolist(), *move[1].tolist())
            assert segment_touches_zone(zones, 1, *given) == line.intersects(area)
            assert box_touches_zone(zones, 1, *given) == line.envelope.intersects(area)
    assert 20 < crossed < 80
