"""Faults of a pocketing program in full: kind, line, height and place, worked out on a square with an island."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.processes.pocket.proof.pocket import (
    EarlierCuts,
    check_pockets,
    cutting_moves,
    depth_differences,
    fast_cut_differences,
    gouge_differences,
    max_ignored_film,
    simulate_levels,
    step_over_differences,
    stock_top_differences,
)

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
WALL = Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True)
FIELD = Polyline.of_points([(-90, -90), (90, -90), (90, 90), (-90, 90)], closed=True)
WIDE = (Pocket(FIELD, name="1"),)
Step = tuple[float | None, float | None, float | None, float]


def path_of(*steps: Step, z: float = 2.0) -> Toolpath:
    """Return moves in lines 1, 2, …: x, y, z and feed; a rapid has feed 0. The tool starts at the R plane."""
    builder = ToolpathBuilder()
    builder.rapid(z=z, line=90)
    for line, (x, y, height, feed) in enumerate(steps, 1):
        if feed:
            builder.feed(x, y, height, feed=feed, line=line)
        else:
            builder.rapid(x, y, height, line=line)
    return builder.build()


def faults(path: Toolpath, pockets: tuple[Pocket, ...] = WIDE, **more: object) -> list[str]:
    given = {"depths": [2.0] * len(pockets), "retract": 2.0} | more
    return [str(one) for one in check_pockets(path, pockets, RULES, **given)]  # type: ignore[arg-type]


def test_each_rapid_in_material_has_its_place() -> None:
    path = path_of(
        (5, 5, None, 0), (None, None, 1.999, 0), (None, None, 1.99, 0), (9, None, None, 0), (None, 9, 9, 0),
        (9, 9, -2, 5), (9, 20, 3, 0), (30, 20, 3, 0), (30, 20, 2.1, 0), (30, 20, 1.5, 0),
    )  # fmt: skip
    sideways = "a rapid may move sideways only at Z2.000 or above; this move goes from"
    down = "a rapid may go below Z2.000 only over cleared area; this move goes from"
    assert faults(path) == [
        f"rapid in material: {down} X5.000 Y5.000 Z1.999 to X5.000 Y5.000 Z1.990 (line 3)",
        f"rapid in material: {sideways} X5.000 Y5.000 Z1.990 to X9.000 Y5.000 Z1.990 (line 4)",
        f"rapid in material: {sideways} X9.000 Y5.000 Z1.990 to X9.000 Y9.000 Z9.000 (line 5)",
        f"rapid in material: {sideways} X9.000 Y9.000 Z-2.000 to X9.000 Y20.000 Z3.000 (line 7)",
        f"rapid in material: {down} X30.000 Y20.000 Z2.100 to X30.000 Y20.000 Z1.500 (line 10)",
    ]


def test_a_rapid_over_a_lower_pocket_goes_down_to_a_gap_above_its_material() -> None:
    """The material of the second pocket starts at -3; 0.4 mm stay above it."""
    low = Pocket(Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True), name="2")
    for at, height, found in (
        ((20, 15), -2.6, 0),
        ((20, 15), -2.61, 1),
        ((5, 15), -2.6, 0),
        ((4.9, 15), -2.6, 1),
        ((60, 15), -2.6, 1),
    ):
        path = path_of((*at, None, 0), (None, None, height, 0))
        assert len(faults(path, (*WIDE, low), tops=[0.0, -3.0])) == found, (at, height)
        assert len(faults(path, (*WIDE, low))) == len(faults(path, (*WIDE, low), tops=[-0.0, 0.0])) == 1


def test_cuts_beyond_a_wall_and_below_a_floor_have_their_place() -> None:
    pockets = (Pocket(WALL, name="1"), Pocket(Polyline.of_points([(60, 0), (90, 0), (90, 30), (60, 30)], closed=True)))
    path = path_of(
        (5, 5, None, 0), (5, 5, -2.002, 5), (5, 5, -2.003, 5), (5, 20, -4, 5), (4.98, 20, -1, 5), (5, 20, -1, 5),
        (65, 20, -0.002, 5), (65, 20, -1, 5), (70, 20, -4, 5), (70, 20, -4.01, 5),
    )  # fmt: skip
    assert faults(path, pockets, depths=[2.0, 4.0]) == [
        "too deep: the tool goes to Z-4.010; the pocket is 4.000 mm deep (line 10)",
        "too deep: the tool goes to Z-2.003; the pocket is 2.000 mm deep (line 3)",
        "too deep: the tool goes to Z-4.000; the pocket is 2.000 mm deep (line 4)",
        "gouge: the tool of 10 mm cuts into a wall near X5.000 Y20.000 (line 5)",
        "gouge: the tool of 10 mm cuts into a wall near X4.980 Y20.000 (line 6)",
        "gouge: the tool of 10 mm cuts into a wall near X64.990 Y20.000 (line 7)",
    ]
    unknown = "gouge: a cut starts or ends at a position that the program does not state (line 1)"
    assert faults(path_of((None, 5, -1, 5)))[0] == unknown
    assert faults(path_of((None, 5, 9, 5))) == [unknown]


def test_of_many_faults_fifty_are_listed() -> None:
    steps = [(5, 5, None, 0), *((4 - k % 2, 20, -1, 5) for k in range(60))]
    found = faults(path_of(*steps), (Pocket(WALL, name="1"),))
    assert len(found) == 51 and found[-1].endswith("10 more differences")


def test_moves_below_the_surface_are_cuts() -> None:
    """A half turn is an arc; a full turn has no bulge, and its chords follow it."""
    builder = ToolpathBuilder()
    builder.rapid(0, 0, 1, line=1)
    builder.feed(0, 0, -0.0019, feed=1, line=2)
    builder.feed(0, 0, -1, feed=1, line=3)
    builder.arc(False, (10, 0, -1), Arc((5, 0, -1)), feed=1, line=4)
    builder.arc(True, (10, 0, -2), Arc((5, 0, -1)), feed=1, line=5)
    builder.rapid(10, 0, -2, line=6)
    builder.feed(10, 5, 1, feed=1, line=7)
    builder.feed(12, 5, 1, feed=1, line=8)
    builder.feed(12, 6, -0.003, feed=1, line=9)
    plunge, half, full, rise, down = cutting_moves(builder.build(), 0.01)
    assert [(cut.row, cut.line) for cut in (plunge, half, full, rise, down)] == [(2, 3), (3, 4), (4, 5), (6, 7), (8, 9)]
    assert plunge.path.tolist() == [[0, 0, -0.0019], [0, 0, -1]]
    assert [cut.bulge for cut in (plunge, half, full, rise)] == [0, pytest.approx(1), 0, 0]
    np.testing.assert_allclose(half.vertices, [(0, 0, 1), (10, 0, 0)], atol=1e-9)
    np.testing.assert_allclose(rise.vertices, [(10, 0, 0), (10, 5, 0)])
    np.testing.assert_allclose(full.vertices, np.column_stack([full.path[:, :2], np.zeros(len(full.path))]))
    radii = np.hypot(*(full.path[:, :2] - (5, 0)).T)
    assert radii == pytest.approx(5, abs=0.003) and len(full.path) > 50
    assert not list(cutting_moves(ToolpathBuilder().build(), 0.01))
    coarse = next(cut for cut in cutting_moves(builder.build(), 1.0) if cut.row == 4)
    assert len(coarse.path) < len(full.path) / 4


def test_a_fast_move_that_cuts_or_goes_down_has_its_place() -> None:
    path = path_of(
        (5, 5, None, 0), (None, None, -2, 5), (35, 5, -2, 10), (20, 5, -2, 40), (20, 7, -2, 40), (20, 7, -3, 40),
        (20, 9, -3, 10),
    )  # fmt: skip
    most = "the mill cuts at 600 mm/min at most"
    assert [str(one) for one in fast_cut_differences(path, RULES, 10.0)] == [
        f"feed: a move at 2400 mm/min cuts near X20.000 Y7.000 Z-2.000; {most} (line 5)",
        f"feed: a move at 2400 mm/min goes down near X20.000 Y7.000 Z-3.000; {most} (line 6)",
    ]
    assert len(fast_cut_differences(path, RULES, 9.0)) == 4 and not fast_cut_differences(path, RULES, 40.0)


@pytest.mark.parametrize(("aside", "found"), [(0.09, 0), (0.12, 1)])
def test_a_film_of_a_hundredth_of_the_tool_is_no_material(aside: float, found: int) -> None:
    path = path_of(
        (5, 5, None, 0), (None, None, -2, 5), (35, 5, -2, 10), (35, 5 + aside, -2, 5), (10, 5 + aside, -2, 40)
    )
    assert len(fast_cut_differences(path, RULES, 10.0)) == found
    assert max_ignored_film(RULES) == 0.1 and max_ignored_film(replace(RULES, tolerance=0.02)) == 0.12


def test_a_level_that_is_too_deep_has_its_place() -> None:
    path = path_of((5, 5, None, 0), (None, None, -4, 5), (35, 5, -4, 10), (5, 5, -4, 10))
    (found,) = depth_differences(path, RULES, 2.0)
    text = "more than the step-down of 2.000 mm would be cut at once near X20.000 Y5.087 Z-4.000"
    assert str(found) == f"too deep: {text} (line 3)"
    low = (Pocket(WALL, name="1"),)
    # A pocket whose material starts at -2 is cut by 2 mm.
    tops = (-2.0, -1.99, -2.1, 0.0)
    assert [len(depth_differences(path, RULES, 2.0, low, (top,))) for top in tops] == [0, 1, 0, 1]
    assert [len(depth_differences(path, RULES, step)) for step in (3.99, 3.998, 4.0)] == [1, 0, 0]


def around(x: float, y: float, wide: float, high: float, z: float) -> list[Step]:
    """Return a closed rectangle from its lower left corner."""
    corners = [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high), (x, y)]
    return [(*corners[0], 2, 0), (*corners[0], z, 5), *((*corner, z, 10) for corner in corners[1:])]


def test_a_gouge_and_a_wide_step_over_have_their_level() -> None:
    pocket = Pocket(WALL, name="1")
    (level,) = simulate_levels(path_of(*around(4, 5, 31, 20, -2)), (pocket,), RULES, [(-2.0,)])
    # The tool goes 1 mm into the left wall, at both ends with the corners of a circle.
    assert 20 <= level.removal.gouges.area <= 30
    (found,) = gouge_differences([level], (pocket,))
    assert found.what == "gouge" and found.text.startswith("pocket 1 at Z-2.000: ")
    assert found.text.split(": ", 1)[1].startswith(
        f"{level.removal.gouges.area:.3g} mm² are cut beyond the wall near X-0."
    )
    rows = [(x, 7.0 * k, -2, 10) for k, ends in enumerate(((0, 50), (50, 0), (0, 50))) for x in ends]
    (level,) = simulate_levels(path_of((0, 0, None, 0), (None, None, -2, 5), *rows), WIDE, RULES, [(-2.0,)])
    (found,) = step_over_differences([level], WIDE, RULES)
    assert str(found) == "step-over: pocket 1 at Z-2.000: passes are 7.000 mm apart, 6 mm are allowed"


def test_each_pocket_is_simulated_with_its_own_moves() -> None:
    """Two pockets at the same levels: each has the strip of its own two moves."""
    pockets = tuple(
        Pocket(Polyline.of_points([(x, 0), (x + 40, 0), (x + 40, 30), (x, 30)], closed=True)) for x in (0, 60)
    )
    steps = [(5, 5, None, 0), (5, 5, -1, 5), (35, 5, -1, 10), (35, 5, 2, 0), (65, 5, 2, 0), (65, 5, -1, 5),
             (95, 5, -1, 10), (95, 5, -2, 5), (80, 5, -2, 10)]  # fmt: skip
    found = simulate_levels(path_of(*steps), pockets, RULES, [(-1.0,), (-2.0, -1.0)])
    assert [(level.number, level.z) for level in found] == [(0, -1.0), (1, -2.0), (1, -1.0)]
    strip = 30 * 10 + math.pi * 25
    assert [level.removal.swept.area for level in found] == pytest.approx([strip, strip - 150, strip], rel=1e-3)


@pytest.mark.parametrize(
    ("turns", "radius", "step_over"),
    [((360,), 4.5, 0), ((180, 180), 4.5, 0), ((350,), 4.5, None), ((360,), 5.1, None), ((360,), 5.0, 0)],
)
def test_only_a_whole_circle_within_the_tool_clears_its_inside(
    turns: tuple[int, ...], radius: float, step_over: float | None
) -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(radius, 0.0)
    builder.feed(z=-2.0, feed=5.0)
    turned = 0
    for degrees in turns:
        turned += degrees
        end = (radius * math.cos(math.radians(turned)), radius * math.sin(math.radians(turned)), -2.0)
        builder.arc(False, end, Arc((0.0, 0.0, -2.0)), feed=5.0)
    rules = replace(RULES, step_over=2.0)
    (level,) = simulate_levels(builder.build(), WIDE, rules, [(-2.0,)])
    assert (level.step_over == 0) is (step_over == 0)


def test_earlier_cuts_are_those_before_a_row_and_as_low() -> None:
    cuts = list(cutting_moves(path_of((5, 5, None, 0), (5, 5, -2, 5), (35, 5, -2, 10), (35, 5, -3, 5)), 0.01))
    earlier = EarlierCuts(cuts, RULES)
    place, up = np.array([20.0, 5.0]), np.array([0.0, 1.0])
    assert (
        earlier.has_passed(place, 4, -2.0)
        and not earlier.has_passed(place, 3, -2.0)
        and not earlier.has_passed(place, 4, -2.1)
    )
    assert earlier.has_passed(place + 0.0009 * up, 4, -2.0) and not earlier.has_passed(place + 0.0011 * up, 4, -2.0)
    assert earlier.cleared_area(place, 4, 0.0).bounds == pytest.approx((0, 0, 40, 10), abs=0.01)
    assert earlier.cleared_area(place, 3, 0.0).is_empty and earlier.cleared_area(place + 10.1 * up, 4, 0.0).is_empty
    assert not earlier.cleared_area(place + 9.9 * up, 4, 0.0).is_empty


TRIANGLE = np.array([[(50, 0, 3), (60, 0, 3), (50, 10, 3)]], dtype=float)


@pytest.mark.parametrize(
    ("surface", "top", "found"),
    [
        (TRIANGLE, -2.0, 0), (TRIANGLE - (5.05, 0, 0), -2.0, 0), (TRIANGLE - (5.07, 0, 0), -2.0, 1),
        (TRIANGLE - (20.0, 0, 0), 2.0, 0), (TRIANGLE - (20.0, 0, 0), 1.95, 0),
        (TRIANGLE - (20.0, 0, 0), 1.93, 1), (TRIANGLE - (-5.0, 0, 0), -2.0, 0),
    ],
)  # fmt: skip
def test_a_solid_above_the_assumed_top_is_found(surface: np.ndarray, top: float, found: int) -> None:
    """The rim of the pocket is at 1, and the triangle at 3, 10 mm beside it; its tool has a radius of 5 mm."""
    pocket = Pocket(WALL, name="1", top=1.0)
    words = f"rapid in material: pocket 1: the solid is higher than Z{1 + top:.3f}, the assumed top of its material"
    assert [str(one) for one in stock_top_differences((pocket,), (top,), (pocket,), surface, 5.0)] == [words] * found


def test_a_pocket_around_another_belongs_to_its_area() -> None:
    """A wider pocket touches the first and reaches to X50; a third at X60 does not touch it."""
    pocket = Pocket(WALL, name="1", top=1.0)
    beside = Pocket(Polyline.of_points([(40, 0), (50, 0), (50, 30), (40, 30)], closed=True))
    apart = Pocket(Polyline.of_points([(60, 0), (70, 0), (70, 30), (60, 30)], closed=True))
    for others, shift, found in (((pocket, beside), 0.0, 1), ((pocket, apart), 10.0, 0), ((beside,), 4.0, 1)):
        surface = TRIANGLE + np.array([shift, 0, 0])
        assert len(stock_top_differences((pocket,), (-2.0,), others, surface, 5.0)) == found


def test_a_finishing_pass_below_all_levels_is_measured_alone() -> None:
    """Three passes 7 mm apart at -2, and nothing at -1."""
    rows = [(x, 7.0 * k, -2, 10) for k, ends in enumerate(((0, 50), (50, 0), (0, 50))) for x in ends]
    path = path_of((0, 0, None, 0), (0, 0, -2, 5), *rows)
    levels = simulate_levels(path, WIDE, RULES, [(-1.0,)], [(-2.0,)])
    assert [(level.z, level.step_over) for level in levels] == [(-2.0, pytest.approx(7.0)), (-1.0, 0.0)]
