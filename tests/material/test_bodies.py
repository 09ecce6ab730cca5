"""Shank and holder in the material: against cases by hand, and against a tool at many places."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.material.cutting import Removed, simulate_cutting
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.cutter import Body, BodyPart, ball_mill, flat_mill, shank_and_holder_sections
from leafcut.model.tool import BodySegment, Tool, ToolKind
from leafcut.model.toolpath import Arc, ToolpathBuilder

BLOCK = StockBlock((0.0, 0.0, -20.0), (60.0, 40.0, 0.0))
CELL = 0.1
#: A mill of 6 mm with flutes of 5 mm and a shank as wide, which its holder holds 12 mm above the tip.
MILL = Tool(1, 6.0, ToolKind.END_MILL, flute_length=5.0, shank_diameter=6.0, stickout=12.0)


def run(
    tool: Tool, *places: tuple[float, float, float], field: HeightField | None = None, longest: float = math.inf
) -> Removed:
    """Return the removal of a feed move along places, which starts high above the first place."""
    builder = ToolpathBuilder()
    builder.rapid(places[0][0], places[0][1], 30.0)
    for place in places:
        builder.feed(*place, feed=10.0)
    moves = convert_to_straight_moves(builder.build(), 0.001, longest)
    field = field or HeightField.of_block(BLOCK, CELL)
    cutter = flat_mill(tool.diameter)
    return simulate_cutting(
        field,
        moves,
        {0: cutter, 1: cutter},
        2,
        bodies={0: shank_and_holder_sections(tool), 1: shank_and_holder_sections(tool)},
    )


@pytest.mark.hazard
@pytest.mark.parametrize("longest", [math.inf, 3.0, 0.02])
def test_a_slot_deeper_than_the_flutes_meets_the_shank_on_its_way_across_and_not_on_the_way_down(
    longest: float,
) -> None:
    """8 − 5 mm deep: in one piece, and in pieces of a fifth of a cell. Straight down the flutes clear the way."""
    found = run(MILL, (20.0, 20.0, -8.0), (30.0, 20.0, -8.0), longest=longest)
    assert found.shank.max() == pytest.approx(3.0)
    assert found.shank[:2].tolist() == [0.0, 0.0]
    assert found.holder.max() == 0.0


def test_a_slot_in_passes_no_deeper_than_the_flutes_meets_no_shank() -> None:
    """Also if the second pass ends a hundredth beyond the first, at the walls and in the corners."""
    for off in (0.0, 0.001, 0.01, -0.01):
        ways = [
            (20.0, 20.0, -4.0), (30.0, 20.0, -4.0), (30.0, 28.0, -4.0), (20.0, 20.0, -4.0),
            (20.0, 20.0, -8.0), (30.0 + off, 20.0 + off, -8.0), (30.0 + off, 28.0 + off, -8.0),
            (20.0 - off, 20.0, -8.0),
        ]  # fmt: skip
        assert run(MILL, *ways).shank.max() == 0.0


def test_a_helix_into_a_hole_deeper_than_the_flutes_meets_no_shank() -> None:
    """Down 10 mm in turns of 1 mm, with a mill of 6 on a circle of 2: each turn finds 1 mm more."""
    builder = ToolpathBuilder()
    builder.rapid(22.0, 20.0, 5.0)
    builder.feed(22.0, 20.0, 0.0, feed=10.0)
    for turn in range(10):
        builder.arc(False, (22.0, 20.0, -1.0 - turn), Arc((20.0, 20.0, 0.0)), feed=10.0)
    moves = convert_to_straight_moves(builder.build(), 0.005, 1.0)
    found = simulate_cutting(
        HeightField.of_block(BLOCK, CELL), moves, {0: flat_mill(6.0)}, bodies={0: shank_and_holder_sections(MILL)}
    )
    assert found.shank.max() == 0.0


def test_a_ramp_meets_the_shank_from_where_its_front_is_deeper_than_the_flutes() -> None:
    """Down 8 mm over 20: at the end the front runs into 8 mm, 3 more than the flutes; 9 mm of flutes do. Back: air."""
    found = run(MILL, (15.0, 20.0, 0.0), (35.0, 20.0, -8.0), (15.0, 20.0, 0.0))
    assert found.shank[2] == pytest.approx(3.0, abs=0.05)
    assert found.shank[3] == 0.0
    long = Tool(1, 6.0, ToolKind.END_MILL, flute_length=9.0, shank_diameter=6.0)
    assert run(long, (15.0, 20.0, 0.0), (35.0, 20.0, -8.0)).shank.max() == 0.0


def test_a_wide_shank_meets_the_wall_beside_a_slot_and_the_rim_of_a_hole() -> None:
    """A mill of 2 mm, flutes 3, in a shank of 6: 4 mm down a hole and along a slot, 1 mm of shank stands in the rim."""
    tool = Tool(1, 2.0, ToolKind.END_MILL, flute_length=3.0, shank_diameter=6.0)
    found = run(tool, (20.0, 20.0, -4.0), (30.0, 20.0, -4.0))
    assert found.shank[1:] == pytest.approx([1.0, 1.0])
    assert run(tool, (20.0, 20.0, -2.9), (30.0, 20.0, -2.9)).shank.max() == 0.0


@pytest.mark.parametrize(("away", "depth"), [(4.0, 2.0), (7.0, 0.4), (8.0, 0.0), (11.0, 0.0)])
def test_a_tapered_holder_at_a_wall(away: float, depth: float) -> None:
    """The lower end, of radius 5, is 2 mm below the top of the wall; from there it rises 4 mm over 5, a slope of 0.8.

    Distances of the axis from the wall: 4 mm: 2 deep; 7 mm: 2 − 0.8 · 2; 8 mm: 0.4 above it.
    """
    tool = Tool(1, 6.0, ToolKind.END_MILL, stickout=8.0, holder=(BodySegment(4.0, 10.0, 20.0),))
    field = HeightField.of_block(BLOCK, CELL)
    field.heights[: round(20.0 / CELL)] = -10.0
    found = run(tool, (15.0, 20.0 - away, -10.0), (40.0, 20.0 - away, -10.0), field=field)
    # Half a cell to the middle of the first one of the wall, and the cell by which it is taken smaller.
    assert found.holder.max() == pytest.approx(depth, abs=0.8 * 1.6 * CELL)
    assert bool(found.holder.max() > 0) is (depth > 0)


def test_what_is_narrower_than_the_tool_or_unknown_meets_nothing() -> None:
    for tool in (
        Tool(1, 6.0, ToolKind.END_MILL, flute_length=5.0, shank_diameter=5.0),
        Tool(1, 6.0, ToolKind.END_MILL, flute_length=5.0),
        Tool(1, 6.0, ToolKind.END_MILL, holder=(BodySegment(9.0, 40.0, 40.0),)),
    ):
        assert shank_and_holder_sections(tool) == ()
        assert run(tool, (20.0, 20.0, -19.0), (30.0, 20.0, -19.0)).shank.max() == 0.0


def test_a_body_is_its_shaft_then_its_shank_up_to_the_holder() -> None:
    tool = Tool(
        1,
        3.0,
        ToolKind.BALL_MILL,
        flute_length=6.0,
        shank_diameter=6.0,
        stickout=25.0,
        shaft=(BodySegment(2.0, 2.8, 2.8), BodySegment(3.0, 3.0, 6.0)),
        holder=(BodySegment(5.0, 20.0, 28.0), BodySegment(30.0, 28.0, 20.0)),
    )
    assert shank_and_holder_sections(tool) == (
        BodyPart(Body.SHANK, 8.0, 1.5, 3.0, 2.0),
        BodyPart(Body.SHANK, 11.0, 3.0, 3.0),
        BodyPart(Body.HOLDER, 25.0, 10.0, 14.0, 1.25),
        BodyPart(Body.HOLDER, 30.0, 14.0, 14.0),
    )


@settings(max_examples=settings().max_examples // 3)  # an example takes 0.1 s
@given(
    places=st.lists(st.tuples(st.floats(12, 48), st.floats(12, 28), st.floats(-9, 1)), min_size=2, max_size=4),
    stickout=st.floats(3, 8),
    upper=st.floats(10, 20),
)
def test_a_moving_holder_is_as_deep_as_a_holder_at_many_places(
    places: list[tuple[float, float, float]], stickout: float, upper: float
) -> None:
    """A ball mill with a conical holder every 0.05 mm: the holder is checked before the tool cuts."""
    cell, cutter = 0.5, ball_mill(6.0)
    tool = Tool(1, 6.0, ToolKind.BALL_MILL, stickout=stickout, holder=(BodySegment(4.0, 9.0, upper),))
    field = HeightField.of_block(BLOCK, cell)
    builder = ToolpathBuilder()
    builder.rapid(places[0][0], places[0][1], 30.0)
    for place in places:
        builder.feed(*place, feed=10.0)
    moves = convert_to_straight_moves(builder.build(), 0.001, math.inf)
    found = simulate_cutting(field, moves, {0: cutter}, 1, bodies={0: shank_and_holder_sections(tool)}).holder.max()
    rows, columns = np.indices(field.heights.shape)
    wide = math.ceil(0.5 * upper / cell) + 1
    slope = 4.0 / (0.5 * (upper - 9.0))

    def deepest(radius: float) -> float:
        """Return the depth of a holder that is smaller by a radius on all sides."""
        heights, worst = np.zeros(field.heights.shape), 0.0
        for begin, end in zip([(*places[0][:2], 30.0), *places], places, strict=False):
            steps = max(math.ceil(math.dist(begin, end) / 0.05), 1)
            for share in np.linspace(0.0, 1.0, steps + 1):
                px, py, pz = (a + share * (b - a) for a, b in zip(begin, end, strict=True))
                column, row = round((px - field.x) / cell), round((py - field.y) / cell)
                near = np.s_[max(row - wide, 0) : row + wide + 1, max(column - wide, 0) : column + wide + 1]
                r = np.hypot(field.x + cell * columns[near] - px, field.y + cell * rows[near] - py)
                under = np.where(r + radius <= 4.5, 0.0, slope * (r + radius - 4.5))
                meets = (r > 3.0) & (r + radius <= 0.5 * upper)
                worst = max(worst, float((heights[near] - pz - stickout - under)[meets].max(initial=0.0)))
                ball = pz + 3.0 - np.sqrt(np.maximum(9.0 - r**2, 0.0))
                heights[near] = np.where(r <= 3.0, np.minimum(heights[near], ball), heights[near])
        return worst

    step = 0.05 * (1.0 + slope + 6.0)
    assert deepest(cell + 0.05) - step <= found <= deepest(cell - 0.05) + step
