"""The distance of a path to the material, and the largest stock that a program allows."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from leafcut.material.cutting import simulate_cutting
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.loads import infer_largest_safe_stock
from leafcut.material.straight_moves import StraightMoves, convert_to_straight_moves
from leafcut.model.cutter import Cutter, ball_mill, flat_mill, pointed_cutter
from leafcut.model.toolpath import ToolpathBuilder

BLOCK = StockBlock((0.0, 0.0, -10.0), (20.0, 15.0, 0.0))
CUTTERS = [flat_mill(4.0), ball_mill(4.0), pointed_cutter(6.0, math.radians(90))]


def ways(chance: random.Random, cutter: int, count: int = 6) -> StraightMoves:
    """Return `count` rapids and cuts to random places."""
    builder = ToolpathBuilder()
    builder.tool(cutter)
    builder.rapid(0.0, 0.0, 5.0)
    for _ in range(count):
        place = (chance.uniform(-5, 25), chance.uniform(-5, 20), chance.uniform(-6, 4))
        if chance.random() < 0.3:
            builder.rapid(*place)
        else:
            builder.feed(*(place[:2] if chance.random() < 0.5 else place), feed=10.0)
    return convert_to_straight_moves(builder.build(), 0.01, math.inf)


def highest_by_places(field: HeightField, way: np.ndarray, cutter: Cutter, margin: float) -> float:
    """Return the height of material over a tool at many places along a move, at the lowest height of the move."""
    rows, columns = field.heights.shape
    x = field.x + np.arange(columns) * field.cell
    y = field.y + np.arange(rows) * field.cell
    low = min(way[2], way[5])
    worst = -math.inf
    for share in np.linspace(0, 1, 200):
        place = way[:2] + share * (way[3:5] - way[:2])
        away = np.hypot(x[None, :] - place[0], y[:, None] - place[1])
        near = away <= cutter.radius + margin
        if near.any():
            surface = np.array([cutter.height(min(max(d - margin, 0.0), cutter.radius)) for d in away[near].tolist()])
            worst = max(worst, float((field.heights[near] - low - surface).max()))
    return worst


@pytest.mark.parametrize("number", range(3))
def test_the_height_of_material_over_a_wider_tool_equals_that_at_many_places(number: int) -> None:
    cutter, margin = CUTTERS[number], 0.7
    moves = ways(random.Random(number), number)
    field = HeightField.of_block(BLOCK, 0.25)
    other = field.copy()
    found = simulate_cutting(field, moves, {number: cutter}, margin=margin).over
    for k in range(len(moves)):
        worst = highest_by_places(other, moves.ends[k], cutter, margin)
        inside = bool(other.contains(moves.ends[k : k + 1], np.array([cutter.radius + margin]))[0])
        beside = -math.inf if inside else other.floor - min(moves.ends[k, 2], moves.ends[k, 5])
        # Between two of the places it may be a little nearer; the exact one is never lower.
        assert found[k] >= max(worst, beside) - 1e-3
        assert found[k] <= max(worst, beside) + 0.15
        only = slice(k, k + 1)
        single = replace(
            moves, ends=moves.ends[only], row=moves.row[only], rapid=moves.rapid[only], tool=moves.tool[only]
        )
        simulate_cutting(other, single, {number: cutter})
    assert np.array_equal(field.heights, other.heights)


def test_the_same_is_found_with_any_number_of_threads() -> None:
    moves = ways(random.Random(9), 0, 40)
    fields = [HeightField.of_block(BLOCK, 0.25) for _ in range(2)]
    one, two = (
        simulate_cutting(field, moves, {0: CUTTERS[0]}, threads, margin=0.5)
        for field, threads in zip(fields, (1, 3), strict=True)
    )
    assert np.array_equal(one.over, two.over)


@pytest.mark.parametrize("seed", range(4))
def test_in_the_largest_stock_no_rapid_of_the_program_meets_material_and_in_any_larger_one_does(seed: int) -> None:
    moves = ways(random.Random(seed), 1, 30)
    cutters = {1: CUTTERS[1]}
    room = infer_largest_safe_stock(moves, cutters, 0.25, dogleg=False)
    assert not simulate_cutting(room.copy(), moves, cutters).cuts[moves.rapid].any()
    # Where it is lower than at first, a rapid came as low: with 0.1 mm more there one of them would cut.
    lowered = np.argwhere(room.heights < room.heights.max())
    assert len(lowered) > 20
    for row, column in lowered[:: max(len(lowered) // 15, 1)].tolist():
        larger = room.copy()
        larger.heights[row, column] += 0.1
        assert simulate_cutting(larger, moves, cutters).cuts[moves.rapid].any()


def test_where_rapids_are_not_straight_their_ends_alone_are_believed() -> None:
    builder = ToolpathBuilder()
    builder.tool(1)
    builder.rapid(0.0, 0.0, 5.0)
    builder.feed(10.0, 10.0, 5.0, feed=10.0)
    builder.rapid(0.0, 0.0, 5.0)
    builder.rapid(0.0, 0.0, 2.0)
    moves = convert_to_straight_moves(builder.build(), 0.01, math.inf)
    straight, bent = (
        infer_largest_safe_stock(moves, {1: flat_mill(2.0)}, 0.25, dogleg=dogleg) for dogleg in (False, True)
    )
    assert straight.height_at(0.0, 0.0) == bent.height_at(0.0, 0.0) == 2.0
    assert straight.height_at(5.0, 5.0) == bent.height_at(5.0, 5.0) == 6.0  # a cut was there first, as deep
    assert straight.heights.max() == 6.0
