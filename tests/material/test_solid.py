"""The stock as displayed: a block around the cuts, its cells, and collisions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.errors import PlanError
from leafcut.material.solid import CELLS, Solid, cut_display_solid
from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import BodySegment, Tool, ToolKind
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from meshes import box_triangles

MILL = Tool(1, 10.0, ToolKind.END_MILL, point_angle=math.pi)
DRILL = Tool(2, 8.0, ToolKind.DRILL, point_angle=math.radians(118))


def slot(depth: float = -4.0) -> Toolpath:
    """Return a slot of 60 mm along x at y = 30, and a rapid through the remaining material, along y at x = 50."""
    path = ToolpathBuilder()
    path.tool(1)
    path.rapid(20.0, 30.0, 5.0, line=1)
    path.feed(z=depth, feed=5.0, line=2)
    path.feed(x=80.0, feed=10.0, line=3)
    path.rapid(z=5.0, line=4)
    path.rapid(x=50.0, y=30.0, line=5)
    path.rapid(z=depth, line=6)
    path.rapid(y=50.0, line=7)
    return path.build()


def test_a_slot_takes_its_length_and_two_half_circles() -> None:
    found = cut_display_solid(slot(), ShownStock({1: MILL}, block=((0.0, 0.0, -10.0), (100.0, 60.0, 0.0))))
    rapid = (
        10.0 * 20.0 * 4.0 - 10.0 * 5.0 * 4.0
    )  # where the rapid goes beside the slot, its round end as long as the wall
    taken = found.before.volume - found.after.volume
    assert taken == pytest.approx((60.0 * 10.0 + 25.0 * math.pi) * 4.0 + rapid, rel=0.05)
    assert max(found.before.heights.shape) == CELLS


def test_a_rapid_in_the_stock_is_a_collision_with_its_place_and_its_depth() -> None:
    found = cut_display_solid(slot(), ShownStock({1: MILL}, block=((0.0, 0.0, -10.0), (100.0, 60.0, 0.0))))
    (one,) = found.collisions
    x, y, z = one.place
    assert (one.kind, found.moves.path.line[one.row]) == ("rapid", 7)
    assert x + found.origin[0] == pytest.approx(50.0)
    assert 30.0 < y + found.origin[1] < 50.0
    assert (z, one.depth) == (-4.0, pytest.approx(4.0))


def test_a_slot_engages_the_whole_width_of_its_tool() -> None:
    found = cut_display_solid(slot(), ShownStock({1: MILL}))
    along = np.flatnonzero(found.moves.path.line[found.moves.row] == 3)
    assert found.width[along] == pytest.approx(1.0, abs=0.02)
    assert found.chip[along] == pytest.approx(1.0, abs=0.02)


def test_a_block_around_the_cuts_reaches_beyond_them_and_as_far_as_the_plate_is_drawn() -> None:
    path = ToolpathBuilder()
    path.tool(2)
    path.rapid(0.0, 0.0, 20.0)
    path.drill(10.0, 10.0, DrillCycle("G81", r_plane=2.0, bottom=-9.0), feed=5.0)
    drawn = cut_display_solid(path.build(), ShownStock({2: DRILL}, around=(0.0, -5.0, 200.0, 90.0), floor=-6.0)).block
    assert drawn.low == (0.0, -5.0, -6.0)
    assert drawn.high == (200.0, 90.0, 0.0)
    alone = cut_display_solid(path.build(), ShownStock({2: DRILL})).block
    assert all(low < 6.0 for low in alone.low[:2])
    assert all(high > 14.0 for high in alone.high[:2])
    assert alone.low[2] < -9.0


@pytest.mark.parametrize(
    ("stock", "words"),
    [
        (ShownStock(refused="a reason"), "a reason"),
        (ShownStock(), "no known tool"),
        (ShownStock({1: MILL}, block=((500.0, 0.0, -10.0), (600.0, 60.0, 0.0))), "never touches the stock"),
    ],
)
def test_what_is_not_known_is_refused_in_one_line(stock: ShownStock, words: str) -> None:
    with pytest.raises(PlanError, match=words) as refused:
        cut_display_solid(slot(), stock)
    assert "\n" not in str(refused.value)


def test_cuts_above_zero_alone_do_not_tell_where_the_stock_ends() -> None:
    with pytest.raises(PlanError, match="cuts nothing below Z0"):
        cut_display_solid(slot(depth=1.0), ShownStock({1: MILL}))


#: Two steps, the lower one with a square hole of 5 mm that is open already.
STEPS = [
    (0, 0, -10, 40, 30, 0),
    (40, 0, -10, 57.5, 30, -4),
    (62.5, 0, -10, 80, 30, -4),
    (57.5, 0, -10, 62.5, 12.5, -4),
    (57.5, 17.5, -10, 62.5, 30, -4),
]
CLAMP = (-8.0, 10.0, -10.0, 5.0, 20.0, 6.0)


def drilled(**stock: object) -> Solid:
    """Return the steps drilled through by 8 mm at (20, 15), and where they are open at (60, 15)."""
    path = ToolpathBuilder()
    path.tool(2)
    path.rapid(20.0, 15.0, 12.0)
    path.drill(20.0, 15.0, DrillCycle("G81", r_plane=2.0, bottom=-14.0), feed=5.0)
    path.drill(60.0, 15.0, DrillCycle("G81", r_plane=-2.0, bottom=-14.0), feed=5.0)
    path.rapid(z=12.0)
    mesh = Mesh(np.concatenate([box_triangles(*box) for box in STEPS]), "steps.stl")
    return cut_display_solid(path.build(), ShownStock({2: DRILL}, surface=mesh, **stock))


def at(solid: Solid, field: str, x: float, y: float) -> float:
    """Return the height of a field over a place of the program."""
    found = getattr(solid, field)
    row, column = (y - solid.origin[1] - found.y) / found.cell, (x - solid.origin[0] - found.x) / found.cell
    return float(found.heights[round(row), round(column)])


def test_a_part_that_is_not_flat_is_shown_as_high_as_it_stands_and_drilled_there() -> None:
    found = drilled()
    assert [at(found, "before", x, 5.0) for x in (10.0, 60.0)] == [0.0, -4.0]
    assert at(found, "before", 60.0, 15.0) == -10.0
    assert at(found, "after", 20.0, 15.0) < -10.0
    assert found.collisions == ()
    taken = found.before.volume - found.after.volume
    assert taken == pytest.approx(16.0 * math.pi * 10.0 + (16.0 * math.pi - 25.0) * 6.0, rel=0.02)


def test_holes_of_a_finished_part_are_filled_up_to_their_rim_so_that_drilling_them_is_seen() -> None:
    found = drilled(finished=True)
    assert at(found, "before", 60.0, 15.0) == -4.0
    taken = found.before.volume - found.after.volume
    assert taken == pytest.approx(16.0 * math.pi * (10.0 + 6.0), rel=0.02)


def test_what_holds_a_part_stands_on_it_and_beside_it_and_is_told_from_it() -> None:
    found = drilled(fixtures=(CLAMP,))
    assert found.block.low == (-8.0, 0.0, -10.0)
    assert found.block.high == (80.0, 30.0, 6.0)
    assert at(found, "before", 2.0, 15.0) == at(found, "before", -5.0, 12.0) == 6.0
    assert at(found, "before", -5.0, 5.0) == -10.0
    assert found.held.sum() * found.before.cell**2 == pytest.approx(130.0, rel=0.05)


def test_a_skin_ends_below_where_it_is_not_known_further_down_than_it_reaches() -> None:
    corners = np.array([[0, 0, 0], [60, 0, 0], [60, 30, -2], [0, 30, -2]], dtype=np.float64)
    skin = Mesh(corners[[[0, 1, 2], [0, 2, 3]]], "skin.stl", closed=False)
    path = ToolpathBuilder()
    path.tool(2)
    path.rapid(20.0, 15.0, 12.0)
    path.drill(20.0, 15.0, DrillCycle("G81", r_plane=2.0, bottom=-9.0), feed=5.0)
    found = cut_display_solid(path.build(), ShownStock({2: DRILL}, surface=skin, finished=True))
    assert found.block.low[2] < -2.0
    assert at(found, "before", 20.0, 15.0) == pytest.approx(-1.0, abs=0.05)


def test_a_holder_in_the_stock_is_a_collision_over_the_tip() -> None:
    """The flutes of 6 mm and the shank go 10 mm deep: the holder, 20 mm wide and 8 mm up, 2 mm into the material."""
    tool = Tool(
        1,
        10.0,
        ToolKind.END_MILL,
        point_angle=math.pi,
        flute_length=6.0,
        stickout=8.0,
        holder=(BodySegment(20.0, 20.0, 20.0),),
    )
    found = cut_display_solid(slot(-10.0), ShownStock({1: tool}, block=((0.0, 0.0, -15.0), (100.0, 60.0, 0.0))))
    holders = [one for one in found.collisions if one.kind == "holder"]
    assert [found.moves.path.line[one.row] for one in holders][:2] == [2, 3]
    assert holders[0].depth == pytest.approx(2.0)
    assert holders[0].place[2] == pytest.approx(-2.0)
