"""Moves against a surface that is not flat: one block of 10 × 10 mm, 5 mm high, from X10 Y10, and hand calculations."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.proof.clearance import LEAST_CLEARANCE
from leafcut.proof.surface import check_surface, surface_reaches_into_area
from meshes import box_triangles

BLOCK = box_triangles(10, 10, 0, 20, 20, 5)
#: A roof that rises along X from Z0 at X0 to Z10 at X10.
SLOPE = np.array([[(0, 0, 0), (10, 0, 10), (10, 10, 10)], [(0, 0, 0), (10, 10, 10), (0, 10, 0)]], dtype=np.float64)
RADIUS = 3.0


def rapids(*places: tuple[float, float, float]) -> Toolpath:
    """Return a path of tool 1 through places, at rapid."""
    builder = ToolpathBuilder()
    builder.tool(1)
    builder.rapid(z=50.0)
    builder.rapid(*places[0][:2])
    for x, y, z in places:
        builder.rapid(x, y, z)
    return builder.build()


def found(path: Toolpath, triangles: np.ndarray = BLOCK, **options: object) -> list[Difference]:
    return check_surface(path, triangles, {1: RADIUS}, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("z", "meets"),
    [(4.0, True), (5.0 + LEAST_CLEARANCE - 0.01, True), (5.0 + LEAST_CLEARANCE, False), (9.0, False)],
)
def test_a_rapid_over_the_block_keeps_the_least_clearance(z: float, meets: bool) -> None:
    assert bool(found(rapids((0, 15, z), (30, 15, z)))) == meets


@pytest.mark.parametrize(("y", "meets"), [(6.9, False), (7.1, True), (15.0, True), (22.9, True), (23.1, False)])
def test_a_rapid_beside_the_block_is_a_radius_away(y: float, meets: bool) -> None:
    """The sides are at Y10 and Y20, the radius is 3."""
    assert bool(found(rapids((0, y, 2), (30, y, 2)))) == meets


def test_a_difference_names_the_kind_and_both_ends_of_the_move() -> None:
    (one,) = found(rapids((0, 15, 2), (30, 15, 2)))
    assert (one.what, one.original) == ("rapid into the part", 0)
    assert one.text == (
        "the tool touches the surface, or comes closer than 0.05 mm to it; this move goes from "
        "X0.000 Y15.000 Z2.000 to X30.000 Y15.000 Z2.000"
    )


def test_a_slanted_move_counts_with_its_lower_end() -> None:
    """From Z20 to Z2: it passes the block at its upper end, but the controller may go down first."""
    assert found(rapids((15, 15, 20), (40, 15, 2)))
    assert found(rapids((40, 15, 20), (15, 15, 6))) == []


@pytest.mark.parametrize(("x", "meets"), [(1.0, False), (1.9, False), (2.1, True), (9.0, True)])
def test_on_a_slope_only_the_part_above_the_tool_counts(x: float, meets: bool) -> None:
    """At Z5 the slope is above the tool from X5 on, less 0.05 mm of clearance; the radius of 3 reaches it at X1.95."""
    assert bool(found(rapids((x, 5, 5.0), (x, 6, 5.0)), SLOPE)) == meets


def test_where_rapids_are_not_straight_the_whole_rectangle_counts() -> None:
    """The straight line from (0, 9) to (9, 30) stays 6 mm away from the corner (10, 20); the rectangle touches it."""
    path = rapids((0, 9, 2), (9, 30, 2))
    assert found(path) == []
    assert [one.what for one in found(path, dogleg=True)] == ["rapid into the part"]


def test_only_feeds_go_into_the_material_and_rapids_come_out_of_it() -> None:
    """Down at feed and up at rapid is drilling; a rapid may return only as deep as a feed of a tool as wide."""

    def hole(back: float, again: int = 1) -> Toolpath:
        builder = ToolpathBuilder()
        builder.tool(1)
        builder.rapid(z=50.0)
        builder.rapid(15.0, 15.0)
        builder.rapid(z=6.0)
        builder.feed(z=1.0, feed=5.0)
        builder.rapid(z=6.0)
        if again != 1:
            builder.rapid(z=50.0)
            builder.tool(again)
        builder.rapid(z=back)
        return builder.build()

    assert found(hole(1.0)) == []
    assert found(hole(2.0)) == []
    assert [one.what for one in found(hole(0.9))] == ["rapid into the part"]
    radii = {1: RADIUS, 2: RADIUS - 1, 3: RADIUS + 1}
    assert check_surface(hole(1.0, 2), BLOCK, radii) == []
    assert len(check_surface(hole(1.0, 3), BLOCK, radii)) == 1


def test_a_holder_meets_the_surface_at_feed_too() -> None:
    """The holder has a radius of 8 mm from 4 mm above the tip on: above Z1 it passes over the block, 5 mm high."""

    def slot(y: float, z: float) -> Toolpath:
        builder = ToolpathBuilder()
        builder.tool(1)
        builder.rapid(z=50.0)
        builder.rapid(0.0, y)
        builder.feed(z=z, feed=5.0)
        builder.feed(30.0, y, feed=5.0)
        builder.rapid(z=50.0)
        return builder.build()

    bodies = {1: [(4.0, 8.0)]}
    (one,) = found(slot(3.0, 0.5), bodies=bodies)
    assert one.what == "shank or holder in the part"
    assert one.text.startswith("the tool hits the surface above its flutes; this move goes from X0.000 Y3.000")
    assert found(slot(3.0, 1.1), bodies=bodies) == []
    assert found(slot(1.9, 0.5), bodies=bodies) == []
    assert found(slot(3.0, 0.5), bodies={2: [(4.0, 8.0)]}) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dogleg", [False, True])
def test_random_moves_meet_random_blocks_as_by_dense_points(seed: int, dogleg: bool) -> None:
    """The distance of each move, or of its rectangle, to upright boxes. Moves within 0.1 mm of a limit do not count."""
    chance = np.random.default_rng(seed)
    low = np.round(chance.uniform(0, 40, (6, 2)), 3)
    high = low + np.round(chance.uniform(1, 12, (6, 2)), 3)
    tops = np.round(chance.uniform(1, 9, 6), 3)
    triangles = np.concatenate(
        [box_triangles(*a, 0, *b, top) for a, b, top in zip(low.tolist(), high.tolist(), tops.tolist(), strict=True)]
    )
    path = rapids(*np.round(chance.uniform((-5, -5, 0), (55, 55, 9), (60, 3)), 3).tolist())
    begin, end = path.before, path.end
    told = {one.text.partition("from ")[2] for one in check_surface(path, triangles, {1: RADIUS}, dogleg=dogleg)}
    share = np.linspace(0, 1, 200)
    wrong = 0
    for row in range(3, len(path)):
        (x0, y0, z0), (x1, y1, z1) = begin[row].tolist(), end[row].tolist()
        points = np.column_stack([x0 + share * (x1 - x0), y0 + share * (y1 - y0)])
        ends = np.sort([(x0, y0), (x1, y1)], axis=0)
        high_enough = tops + LEAST_CLEARANCE > min(z0, z1)
        gap = 99.0
        for corners in zip(low[high_enough], high[high_enough], strict=True):
            aside = (
                np.maximum(corners[0] - ends[1], ends[0] - corners[1]) if dogleg else points - np.clip(points, *corners)
            )
            gap = min(gap, float(np.linalg.norm(np.maximum(aside, 0.0) if dogleg else aside, axis=-1).min()))
        if abs(gap - RADIUS) < 0.1:
            continue
        words = f"X{x0:.3f} Y{y0:.3f} Z{z0:.3f} to X{x1:.3f} Y{y1:.3f} Z{z1:.3f}"
        assert (words in told) == (gap < RADIUS), words
        wrong += gap < RADIUS
    assert wrong > 5


@pytest.mark.parametrize(
    ("height", "radius", "meets"), [(4.9, 2.1, True), (4.9, 1.9, False), (5.1, 9.0, False), (-1.0, 2.1, True)]
)
def test_a_surface_meets_an_area_within_a_radius_and_above_a_height(height: float, radius: float, meets: bool) -> None:
    """The area ends at X8, 2 mm before the block."""
    assert surface_reaches_into_area(BLOCK, shapely.box(0, 0, 8, 30), radius, height) == meets


def test_of_a_slope_only_the_part_above_the_height_meets_an_area() -> None:
    """Above Z6 the slope starts at X6; the area ends at X2."""
    area = shapely.box(0, 0, 2, 10)
    assert [surface_reaches_into_area(SLOPE, area, radius, 6.0) for radius in (3.9, 4.1)] == [False, True]
    # The peak of a gable at X5 Y5 is 3 mm before the area; 0.5 mm below, the gable is 0.42 mm farther away.
    gable = np.array([[(0, 0, 0), (10, 0, 0), (5, 5, 6)]], dtype=np.float64)
    assert [surface_reaches_into_area(gable, shapely.box(0, 8, 10, 9), radius, 5.5) for radius in (2.9, 3.1)] == [
        False,
        True,
    ]
