"""Height fields against volumes from formulas, and against a tool at many places along its path."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError
from leafcut.material.cutting import Removed, simulate_cutting
from leafcut.material.height_field import HeightField, StockBlock, default_cell_size
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.cutter import Cutter, ball_mill, bull_mill, flat_mill, pointed_cutter
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder

#: 40 × 30 × 10 mm, its top at 0.
BLOCK = StockBlock((0.0, 0.0, -10.0), (40.0, 30.0, 0.0))
V_BIT = pointed_cutter(6.0, math.radians(90))
#: A tapered ball end, a chamfer mill, and all usual shapes.
CUTTERS = {
    "flat": flat_mill(6.0),
    "ball": ball_mill(6.0),
    "bull": bull_mill(6.0, 1.0),
    "drill": pointed_cutter(6.0, math.radians(118)),
    "v-bit": V_BIT,
    "chamfer": pointed_cutter(8.0, math.radians(90), 2.0),
    "tapered ball": Cutter(3.0, 0.0, 1.0, 4.0),
}


def run(
    path: Toolpath, cutter: Cutter, cell: float = 0.05, threads: int = 2, longest: float = math.inf
) -> tuple[HeightField, Removed]:
    """Cut the block by a path, with chords a thousandth of a millimetre off at most."""
    field = HeightField.of_block(BLOCK, cell)
    moves = convert_to_straight_moves(path, 0.001, longest)
    return field, simulate_cutting(field, moves, {0: cutter, 1: cutter}, threads)


def lines(*places: tuple[float, float, float]) -> Toolpath:
    """Return feed along places, from high above the first."""
    builder = ToolpathBuilder()
    builder.rapid(places[0][0], places[0][1], 20.0)
    for x, y, z in places:
        builder.feed(x, y, z, feed=10.0)
    return builder.build()


def taken(field: HeightField) -> float:
    """Return the volume that is gone, mm³."""
    return 40.0 * 30.0 * 10.0 - field.volume


def test_a_plunge_takes_a_cylinder_a_cone_and_half_a_ball() -> None:
    """π r² h; a cone of 45 degrees, 3 mm deep: π 3³/3; a drill 118 degrees; a ball 3 mm deep: 2π 3³/3."""
    point = 3.0 / math.tan(math.radians(59))
    for cutter, z, volume in (
        (CUTTERS["flat"], -4.0, math.pi * 9 * 4),
        (V_BIT, -3.0, math.pi * 9),
        (CUTTERS["drill"], -5.0, math.pi * 9 * (5 - point) + math.pi * 9 * point / 3),
        (CUTTERS["ball"], -3.0, 2 * math.pi * 9),
    ):
        field, removed = run(lines((20.0, 15.0, z)), cutter)
        assert taken(field) == pytest.approx(volume, rel=0.005)
        assert removed.volume.sum() == pytest.approx(taken(field), rel=1e-4)
        assert removed.depth.max() == pytest.approx(-z, abs=0.05)


def test_a_slot_takes_its_length_and_a_round_end_on_both_sides() -> None:
    """Length × section + a body of revolution; the section of a V of 90 degrees is z²."""
    for cutter, z, section, round_end in (
        (CUTTERS["flat"], -2.0, 12.0, math.pi * 9 * 2),
        (V_BIT, -2.0, 4.0, math.pi * 8 / 3),
        (CUTTERS["ball"], -3.0, 4.5 * math.pi, 2 * math.pi * 9),
    ):
        for end in ((30.0, 15.0), (26.0, 23.0)):
            field, removed = run(lines((10.0, 15.0, z), (*end, z)), cutter)
            volume = section * math.dist((10.0, 15.0), end) + round_end
            assert taken(field) == pytest.approx(volume, rel=0.005)
            assert removed.volume.sum() == pytest.approx(taken(field), rel=1e-4)


def test_a_flat_tool_going_down_a_ramp_leaves_the_ramp_its_rear_edge_cut() -> None:
    """From z = 0 to −4 over 20 mm: at a distance d from the way the rear edge is √(9 − d²) behind the middle.

    Up to where the rear edge ends it leaves a ramp, ½ · 20 · 4 a mm of width; from there on, over the disc at the end,
    4 mm deep: 6 · 40 + 4 · 9π.
    """
    field, _ = run(lines((10.0, 15.0, 0.0), (30.0, 15.0, -4.0)), CUTTERS["flat"])
    volume = 6.0 * 40.0 + 4.0 * 9.0 * math.pi
    assert taken(field) == pytest.approx(volume, rel=0.005)
    assert field.height_at(20.0, 15.0) == pytest.approx(-(20.0 + 3.0 - 10.0) / 5.0, abs=0.02)


def test_a_full_turn_of_a_helix_and_a_ring_take_what_the_formulas_say() -> None:
    """A ring between radii 2 and 8, 2 deep: π (64 − 4) 2; its arc in two halves or one, in either direction."""
    for clockwise in (True, False):
        builder = ToolpathBuilder()
        builder.rapid(25.0, 15.0, 5.0)
        builder.feed(25.0, 15.0, 0.0, feed=10.0)
        builder.arc(clockwise, (25.0, 15.0, -2.0), Arc((20.0, 15.0, 0.0)), feed=10.0)
        builder.arc(clockwise, (25.0, 15.0, -2.0), Arc((20.0, 15.0, 0.0)), feed=10.0)
        field, _ = run(builder.build(), CUTTERS["flat"])
        assert taken(field) == pytest.approx(math.pi * 60 * 2, rel=0.005)
        assert field.height_at(20.0, 15.0) == 0.0
        assert field.height_at(14.0, 15.0) == pytest.approx(-2.0)


def test_an_arc_in_an_upright_plane_lies_where_its_plane_says() -> None:
    """A half circle of 4 mm in ZX, from x = 24 to 16: G3 turns from Z to X, so it goes round below."""
    for clockwise, low in ((False, -4.0), (True, 4.0)):
        builder = ToolpathBuilder()
        builder.feed(24.0, 15.0, 0.0, feed=10.0)
        builder.arc(clockwise, (16.0, 15.0, 0.0), Arc((20.0, 15.0, 0.0), plane=18), feed=10.0)
        moves = convert_to_straight_moves(builder.build(), 0.001, math.inf)
        middle = moves.ends[np.abs(moves.ends[:, 0] - 20.0).argmin(), :3]
        assert middle == pytest.approx((20.0, 15.0, low), abs=0.2)


def test_a_cycle_drills_and_its_rapids_meet_nothing() -> None:
    builder = ToolpathBuilder()
    builder.rapid(10.0, 10.0, 5.0)
    for x in (10.0, 30.0):
        builder.drill(x, 10.0, DrillCycle("G83", 1.0, -6.0, peck=2.0), feed=2.0)
    moves = convert_to_straight_moves(builder.build(), 0.001, math.inf)
    field = HeightField.of_block(BLOCK, 0.05)
    removed = simulate_cutting(field, moves, {0: CUTTERS["flat"]})
    assert taken(field) == pytest.approx(2 * math.pi * 9 * 6, rel=0.005)
    assert not removed.cuts[moves.rapid].any()


def test_a_rapid_in_the_material_is_seen_and_one_along_a_wall_that_was_cut_is_not() -> None:
    builder = ToolpathBuilder()
    builder.rapid(5.0, 15.0, 5.0)
    builder.feed(5.0, 15.0, -2.0, feed=5.0)
    builder.feed(20.0, 15.0, -2.0, feed=5.0)
    builder.rapid(6.03, 15.0, -2.0)
    builder.rapid(25.0, 15.0, -2.0)
    moves = convert_to_straight_moves(builder.build(), 0.001, math.inf)
    removed = simulate_cutting(HeightField.of_block(BLOCK, 0.05), moves, {0: CUTTERS["flat"]})
    assert removed.cuts.tolist() == [False, True, True, False, True]
    assert moves.rapid.tolist() == [True, False, False, True, True]


def test_width_and_side_of_a_cut_are_what_the_step_over_leaves() -> None:
    """A slot along x, then a cut 2 mm to its left: 6 wide, then 2 wide, on the left side only."""
    field, removed = run(
        lines((5.0, 10.0, -3.0), (35.0, 10.0, -3.0), (35.0, 10.0, 3.0), (5.0, 12.0, 3.0), (5.0, 12.0, -3.0),
              (30.0, 12.0, -3.0)),
        CUTTERS["flat"],
    )  # fmt: skip
    slot, second = 2, 6
    assert (removed.left[slot], removed.right[slot]) == pytest.approx((3.0, 3.0), abs=0.06)
    assert (removed.left[second], removed.right[second]) == pytest.approx((3.0, -1.0), abs=0.06)
    assert removed.area[second] / 25.0 == pytest.approx(2.0, rel=0.02)
    assert removed.depth[second] == pytest.approx(3.0)
    assert field.height_at(20.0, 14.5) == pytest.approx(-3.0)


@given(
    name=st.sampled_from(sorted(CUTTERS)),
    begin=st.tuples(st.floats(8, 32), st.floats(8, 22), st.floats(-5, 1)),
    end=st.tuples(st.floats(8, 32), st.floats(8, 22), st.floats(-5, 1)),
)
def test_every_moving_shape_cuts_as_deep_as_the_shape_at_many_places(
    name: str, begin: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    cutter = CUTTERS[name]
    field = HeightField.of_block(BLOCK, 0.5)
    simulate_cutting(field, convert_to_straight_moves(lines(begin, end), 0.001, math.inf), {0: cutter})
    rows, columns = field.heights.shape
    x, y = field.x + field.cell * np.arange(columns), field.y + field.cell * np.arange(rows)[:, None]
    expected = np.zeros((rows, columns))
    height = np.vectorize(cutter.height)
    for share in np.linspace(0.0, 1.0, 400):
        px, py, pz = (a + share * (b - a) for a, b in zip(begin, end, strict=True))
        away = np.hypot(x - px, y - py)
        near = away <= cutter.radius  # no cutter beyond its radius
        expected[near] = np.minimum(expected[near], pz + height(away[near]))
    steepest = 0.5 * math.dist(begin, end) / 400 * (1.0 + (5.0 if cutter.corner else 1.0))
    assert (field.heights <= expected + 1e-5).all()
    # … and not deeper than the step between two samples lets them miss, but for cells that only the edge sweeps.
    edge = np.minimum.reduce([np.roll(expected, shift, axis) for shift in (-1, 0, 1) for axis in (0, 1)])
    assert (field.heights >= edge - steepest - 1e-5).all()


def lowest_of(cutter: Cutter, move: tuple[float, ...], x: NDArray, y: NDArray) -> NDArray:
    """Return the lowest that a cutter is over places along a move, 0 where it never is, by golden sections.

    Along a move the height over a place is convex, and the tool is over it between two ends.
    """
    dx, dy, dz = (move[k + 3] - move[k] for k in range(3))
    length = math.hypot(dx, dy)
    along = ((x - move[0]) * dx + (y - move[1]) * dy) / length
    aside = np.abs((x - move[0]) * dy - (y - move[1]) * dx) / length
    half = np.sqrt(np.maximum(cutter.radius**2 - aside**2, 0.0))
    low, high = np.clip(along - half, 0.0, length), np.clip(along + half, 0.0, length)
    under = (aside <= cutter.radius) & (high > low)
    surface = np.vectorize(cutter.height)

    def height(at: NDArray) -> NDArray:
        return move[2] + dz * at / length + surface(np.minimum(np.hypot(at - along, aside), cutter.radius))

    share = 0.5 * (math.sqrt(5.0) - 1.0)
    ends = np.minimum(height(low), height(high))
    for _ in range(40):
        first, second = high - share * (high - low), low + share * (high - low)
        left = height(first) < height(second)
        low, high = np.where(left, low, first), np.where(left, second, high)
    return np.where(under, np.minimum(0.0, np.minimum(ends, height(low))), 0.0)


@pytest.mark.parametrize(
    ("length", "rise"), [(20.0, 0.02), (20.0, -1.0), (0.5, 0.1), (0.5, -0.01), (1.0, -3.0), (4.0, 3.0), (20.0, 1e-9)]
)
def test_a_round_corner_cuts_as_deep_on_a_slope_as_a_search_along_the_way_finds(length: float, rise: float) -> None:
    """Bull noses with a small, a large and a nearly full corner, and one with a cone above its corner."""
    turn = 0.3
    move = (
        12.0, 13.0, -2.0 - max(rise, 0.0), 12.0 + length * math.cos(turn), 13.0 + length * math.sin(turn),
        -2.0 - max(rise, 0.0) + rise,
    )  # fmt: skip
    for cutter in (bull_mill(6.0, 0.3), bull_mill(6.0, 2.0), bull_mill(6.0, 2.999), Cutter(3.0, 1.0, 1.0, 1.5)):
        field = HeightField.of_block(BLOCK, 1.0)
        rows, columns = field.heights.shape
        builder = ToolpathBuilder()
        builder.rapid(*move[:2], 20.0)
        builder.feed(*move[:3], feed=10.0)
        builder.feed(*move[3:], feed=10.0)
        simulate_cutting(field, convert_to_straight_moves(builder.build(), 0.001, math.inf), {0: cutter})
        x, y = field.x + field.cell * np.arange(columns), field.y + field.cell * np.arange(rows)[:, None]
        expected = lowest_of(cutter, move, *np.broadcast_arrays(x, y))
        assert np.abs(field.heights - expected).max() < 2e-6


def test_the_answer_is_the_same_with_any_number_of_threads() -> None:
    rng = np.random.default_rng(4)
    places = [(float(x), float(y), float(z)) for x, y, z in rng.uniform((3, 3, -4), (37, 27, 0), (40, 3))]
    one, first = run(lines(*places), CUTTERS["ball"], 0.1, 1)
    two, second = run(lines(*places), CUTTERS["ball"], 0.1, 3)
    assert (one.heights == two.heights).all()
    assert all((a == b).all() for a, b in zip(first, second, strict=True))


def test_pieces_of_a_cut_come_to_the_cut() -> None:
    builder = ToolpathBuilder()
    builder.feed(5.0, 10.0, -1.0, feed=5.0)
    builder.feed(35.0, 20.0, -3.0, feed=5.0)
    builder.arc(True, (35.0, 20.0, -3.0), Arc((30.0, 20.0, 0.0)), feed=5.0)
    whole = convert_to_straight_moves(builder.build(), 0.001, math.inf)
    parts = convert_to_straight_moves(builder.build(), 0.001, 1.0)
    assert len(parts) > len(whole)
    assert np.hypot(*(parts.ends[:, 3:5] - parts.ends[:, :2]).T).max() <= 1.0
    fields = [HeightField.of_block(BLOCK, 0.1) for _ in range(2)]
    sums = [
        simulate_cutting(field, m, {0: CUTTERS["bull"]}).volume.sum()
        for field, m in zip(fields, (whole, parts), strict=True)
    ]
    assert np.abs(fields[0].heights - fields[1].heights).max() < 0.01
    assert sums[0] == pytest.approx(sums[1], rel=1e-3)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(OptionError, match="diameter 0 mm"):
        flat_mill(0.0)
    with pytest.raises(OptionError, match="corner radius of 4 mm"):
        bull_mill(6.0, 4.0)
    with pytest.raises(OptionError, match="between 0 and 180"):
        pointed_cutter(6.0, math.radians(200))
    with pytest.raises(PlanError, match="no volume"):
        StockBlock((0.0, 0.0, 0.0), (1.0, 0.0, 1.0))
    with pytest.raises(PlanError, match=r"12,000,169,548 are needed.*use cells of 0\.005 mm"):
        HeightField.of_block(BLOCK, 0.0003162278)
    assert default_cell_size(BLOCK, 6.0) == pytest.approx(0.15)
    assert default_cell_size(StockBlock((0, 0, 0), (1000, 1000, 1)), 1.0) == pytest.approx(0.2)
    assert default_cell_size(StockBlock((0, 0, 0), (1000, 1000, 1)), 6.0) == pytest.approx(0.5)
