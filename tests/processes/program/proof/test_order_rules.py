"""Pieces whose order matters: pairs of passes placed by hand, just inside and just outside each limit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from leafcut.model.toolpath import Arc, DrillCycle, Kind, ToolpathBuilder
from leafcut.processes.program.proof.certificate import _moved_mask
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.order_rules import (
    Visits,
    build_visits,
    detaching_visits_of_outlines,
    line_index,
    lowest_level,
    nearby_passes,
    passes_at_levels,
    passes_side_by_side,
    rows_in_order,
)
from leafcut.processes.program.proof.order_thresholds import FREE, KEEP, OrderThresholds
from leafcut.processes.program.proof.outlines import Line, Outline
from leafcut.processes.program.proof.traces import traces_of
from rewriting import features_in

BOTH = pytest.mark.parametrize("doubt", [KEEP, FREE], ids=["keep", "free"])
Cut = tuple[tuple[float, float], tuple[float, float], float]


def visits_at(
    cuts: Sequence[Cut], level: Sequence[bool] = (), closed: Sequence[bool] = (), cutting: Sequence[bool] = ()
) -> Visits:
    """One straight cut per visit: start, end, depth."""
    n = len(cuts)
    ends = np.array([(a, b) for a, b, _ in cuts], dtype=np.float64).reshape(-1, 2, 2)
    depth = np.array([z for *_, z in cuts], dtype=np.float64)
    number = np.arange(n)
    flags = ((cutting, True), (level, True), (closed, False))
    return Visits(
        number,
        number,
        ends[:, 0],
        depth,
        depth,
        *(np.array(given or [default] * n, dtype=bool) for given, default in flags),
        ends,
        np.hypot(*(ends[:, 1] - ends[:, 0]).T),
        np.ones(n, dtype=bool),
    )


def index_of(cuts: Sequence[Cut]) -> tuple[object, np.ndarray]:
    return line_index([Line(k, np.array([a, b])) for k, (a, b, _) in enumerate(cuts)])


def pairs_of(
    rule: object, visits: Visits, cuts: Sequence[Cut], doubt: OrderThresholds, width: float
) -> list[list[int]]:
    near, owner = index_of(cuts)
    found = [
        pair
        for pairs in rule(visits, near, owner, doubt, width, lambda a, b: a < b)  # type: ignore[operator]
        for pair in pairs.tolist()
    ]
    return sorted(found)


def beside(gap: float, depths: tuple[float, float] = (-1.0, -1.0), length: float = 50.0) -> list[Cut]:
    return [((0.0, 0.0), (50.0, 0.0), depths[0]), ((0.0, gap), (length, gap), depths[1])]


@pytest.mark.parametrize(
    ("doubt", "width", "gap", "found"),
    [
        (FREE, math.inf, 5.9, True),
        (FREE, math.inf, 6.1, False),
        (KEEP, math.inf, 12.6, True),
        (KEEP, math.inf, 12.8, False),
        (FREE, 3.0, 2.9, True),
        (FREE, 3.0, 3.1, False),
        (KEEP, 3.0, 2.9, True),
        (KEEP, 3.0, 3.1, False),
    ],
)
def test_passes_at_two_levels_keep_their_order_within_the_tool(
    doubt: OrderThresholds, width: float, gap: float, found: bool
) -> None:
    cuts = beside(gap, (-1.0, -2.0))
    assert pairs_of(passes_at_levels, visits_at(cuts), cuts, doubt, width) == [[0, 1]] * found


@BOTH
@pytest.mark.parametrize(("second", "apart"), [(-1.009, False), (-1.011, True), (-0.989, True), (math.inf, False)])
def test_passes_are_at_two_levels_beyond_a_hundredth_of_a_millimetre(
    doubt: OrderThresholds, second: float, apart: bool
) -> None:
    """Then they are not side by side; at one level they are, and an unknown depth counts as the same level."""
    cuts = beside(0.5, (-1.0, second))
    assert pairs_of(passes_at_levels, visits_at(cuts), cuts, doubt, 6.0) == [[0, 1]] * apart
    assert pairs_of(passes_side_by_side, visits_at(cuts), cuts, doubt, 6.0) == [[0, 1]] * (not apart)
    said = [
        (said, pairs.tolist())
        for said, pairs in nearby_passes(visits_at(cuts), *index_of(cuts), doubt, 6.0, lambda a, b: a < b)
    ]
    word = "is at another level beside" if apart else "runs beside"
    assert said == [(word, [[0, 1]])]


@BOTH
@pytest.mark.parametrize("attribute", ["level", "cutting"])
def test_passes_that_follow_a_surface_and_holes_are_exempt(doubt: OrderThresholds, attribute: str) -> None:
    """In doubt only if both do; for certain if one does."""
    cuts = beside(0.5, (-1.0, -2.0))
    for values in ((False, True), (True, False), (False, False)):
        visits = visits_at(cuts, **{attribute: values})  # type: ignore[arg-type]
        kept = doubt.keep and any(values)
        assert pairs_of(passes_at_levels, visits, cuts, doubt, 6.0) == [[0, 1]] * kept
    flat = beside(0.5)
    for values in ((False, True), (True, False), (False, False)):
        visits = visits_at(flat, **{attribute: values})  # type: ignore[arg-type]
        kept = doubt.keep and any(values) and attribute == "level"
        assert pairs_of(passes_side_by_side, visits, flat, doubt, 6.0) == [[0, 1]] * kept


@BOTH
def test_two_closed_passes_may_lie_side_by_side_in_any_order(doubt: OrderThresholds) -> None:
    cuts = beside(0.5)
    for closed, found in (((True, True), False), ((True, False), True), ((False, True), True)):
        visits = visits_at(cuts, closed=closed)
        assert pairs_of(passes_side_by_side, visits, cuts, doubt, 6.0) == [[0, 1]] * found


@pytest.mark.parametrize(
    ("doubt", "width", "gap", "found"),
    [
        (FREE, 6.0, 0.98, True),
        (FREE, 6.0, 1.0, False),
        (KEEP, 6.0, 0.99, True),
        (KEEP, 6.0, 1.01, False),
        (FREE, 0.5, 0.49, True),
        (KEEP, 0.5, 0.51, False),
    ],
)
def test_passes_run_side_by_side_within_a_finishing_allowance(
    doubt: OrderThresholds, width: float, gap: float, found: bool
) -> None:
    cuts = beside(gap)
    assert pairs_of(passes_side_by_side, visits_at(cuts), cuts, doubt, width) == [[0, 1]] * found


@pytest.mark.parametrize(("doubt", "share"), [(KEEP, 0.45), (FREE, 0.55)])
@pytest.mark.parametrize("swap", [False, True])
def test_passes_run_side_by_side_if_half_of_the_shorter_one_does(
    doubt: OrderThresholds, share: float, swap: bool
) -> None:
    """The shorter cut has 40 mm; one part of it runs along the longer one or 0.98 mm past its end, at 0.1 mm."""
    for part, found in ((share - 0.03, False), (share + 0.03, True)):
        x = 50.98 - 40.0 * part
        cuts = [((0.0, 0.0), (50.0, 0.0), -1.0), ((x, 0.1), (x + 40.0, 0.1), -1.0)]
        cuts = cuts[::-1] if swap else cuts
        assert pairs_of(passes_side_by_side, visits_at(cuts), cuts, doubt, 6.0) == [[0, 1]] * found


def test_all_pairs_of_many_passes_are_found() -> None:
    """70 passes in a row of 0.9 mm spacing have 69 pairs of neighbours; far more than are compared at once is 0.01."""
    cuts = [((0.0, 0.9 * k), (50.0, 0.9 * k), -1.0) for k in range(70)]
    found = pairs_of(passes_side_by_side, visits_at(cuts), cuts, FREE, 6.0)
    assert found == [[k, k + 1] for k in range(69)]
    cuts = [((0.0, 0.01 * k), (50.0, 0.01 * k), -1.0) for k in range(70)]
    found = pairs_of(passes_side_by_side, visits_at(cuts), cuts, FREE, 6.0)
    assert found == [[a, b] for a in range(70) for b in range(a + 1, 70)]


def test_a_long_line_is_indexed_in_parts_of_one_piece() -> None:
    """65 segments are three parts; a point is a point."""
    points = np.column_stack([np.arange(66.0), np.zeros(66)])
    near, owner = line_index([Line(4, points), Line(2, np.zeros((2, 2)))])
    assert owner.tolist() == [4, 4, 4, 2]
    parts = [shapely.get_coordinates(part).tolist() for part in near.lines]
    assert parts == [points[:33].tolist(), points[32:65].tolist(), points[64:].tolist(), [[0.0, 0.0]]]


def rows(*offsets: float, length: float = 50.0, depth: Sequence[float] = (), turn: float = 0.0) -> list[Cut]:
    """Rows at these offsets to the left, alternately forwards and backwards, turned by an angle."""
    c, s = math.cos(turn), math.sin(turn)
    cuts: list[Cut] = []
    for k, y in enumerate(offsets):
        a, b = (c * 0.0 - s * y, s * 0.0 + c * y), (c * length - s * y, s * length + c * y)
        cuts.append((a, b, depth[k] if depth else -1.0) if k % 2 == 0 else (b, a, depth[k] if depth else -1.0))
    return cuts


def in_order(
    cuts: Sequence[Cut], doubt: OrderThresholds = FREE, width: float = math.inf, **given: Sequence[bool]
) -> list[list[int]]:
    return rows_in_order(visits_at(cuts, **given), doubt, width).tolist()


@BOTH
@pytest.mark.parametrize("turn", [0.0, 0.7, math.pi / 2, 2.5, math.pi, -math.pi / 2])
def test_at_least_three_parallel_rows_to_one_side_are_in_order(doubt: OrderThresholds, turn: float) -> None:
    assert in_order(rows(0.0, 1.0, turn=turn), doubt) == []
    assert in_order(rows(0.0, 1.0, 2.0, turn=turn), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, -1.0, -2.0, -3.0, turn=turn), doubt) == [[0, 1], [1, 2], [2, 3]]
    assert in_order(rows(0.0, 1.0, 2.0, 1.0, turn=turn), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 1.0, 0.0, 1.0, turn=turn), doubt) == []


@pytest.mark.parametrize(("doubt", "wide", "too_wide"), [(FREE, 1.009, 1.012), (KEEP, 1.04, 1.06)])
def test_the_spacing_of_rows_grows_hardly(doubt: OrderThresholds, wide: float, too_wide: float) -> None:
    assert in_order(rows(0.0, 1.0, 1.0 + wide), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 1.0, 1.0 + too_wide), doubt) == []
    assert in_order(rows(0.0, 1.0, 1.5), doubt) == [[0, 1], [1, 2]]
    # A wider step starts a new surface with its own spacing.
    assert in_order(rows(0.0, 1.0, 2.0, 4.0, 6.0), doubt) == [[0, 1], [1, 2], [2, 3], [3, 4]]


@BOTH
def test_rows_at_two_depths_or_wider_than_the_tool_are_none(doubt: OrderThresholds) -> None:
    assert in_order(rows(0.0, 1.0, 2.0, depth=(-1.0, -1.009, -1.0)), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 1.0, 2.0, depth=(-1.0, -1.011, -1.0)), doubt) == []
    assert in_order(rows(0.0, 3.0, 6.0), doubt, 3.0) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 3.1, 6.2), doubt, 3.0) == []
    assert in_order(rows(0.0, 100.0, 200.0, length=300.0), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 100.5, 201.0, length=300.0), doubt) == []
    # A row is longer than its distance to the next one.
    assert in_order(rows(0.0, 49.0, 98.0), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 51.0, 102.0), doubt) == []
    assert in_order(rows(0.0, 0.011, 0.022), doubt) == [[0, 1], [1, 2]]
    assert in_order(rows(0.0, 0.009, 0.018), doubt) == []


@pytest.mark.parametrize(("doubt", "lean"), [(FREE, 0.015), (KEEP, 0.02)])
def test_rows_lean_hardly_and_share_half_of_their_length(doubt: OrderThresholds, lean: float) -> None:
    for factor, found in ((0.98, True), (1.02, False)):
        rise = 50.0 * math.tan(math.asin(lean * factor))
        leaning = [((0.0, 0.0), (50.0, 0.0), -1.0), ((0.0, 1.0), (50.0, 1.0 + rise), -1.0)]
        third = ((0.0, 2.0 + rise), (50.0, 2.0 + rise), -1.0)
        assert (in_order([*leaning, third], doubt)[:1] == [[0, 1]]) is found or not found
        assert (in_order([leaning[1], leaning[0], ((0.0, -1.0), (50.0, -1.0), -1.0)], doubt) != []) is found
    for shift, found in ((24.9, True), (25.1, False)):
        shifted = [((0.0, 0.0), (50.0, 0.0), -1.0), ((shift, 1.0), (50.0 + shift, 1.0), -1.0),
                   ((2 * shift, 2.0), (50.0 + 2 * shift, 2.0), -1.0)]  # fmt: skip
        assert bool(in_order(shifted, doubt)) is found
        # The shorter row decides: 20 mm beside 50 mm.
        short = [((40.0 if found else 40.2, y), (60.0 if found else 60.2, y), -1.0) for y in (1.0,)]
        assert bool(in_order([rows(0.0)[0], short[0], ((0.0, 2.0), (50.0, 2.0), -1.0)], doubt)) is found


def test_a_row_is_straight_cuts_and_lies_at_a_level() -> None:
    cuts = rows(0.0, 1.0, 2.0)
    assert in_order(cuts, cutting=(True, False, True)) == []
    assert in_order(cuts, FREE, level=(True, False, True)) == []
    assert in_order(cuts, KEEP, level=(True, False, True)) == [[0, 1], [1, 2]]
    visits = visits_at(cuts)
    for longer, found in ((1.009, 2), (1.011, 0)):
        visits.length[1] = 50.0 * longer
        assert len(rows_in_order(visits, FREE)) == found
    assert in_order([]) == []


def made(builder: ToolpathBuilder) -> Features:
    path = builder.build()
    kinds = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL, Kind.DWELL)
    return features_in(path, np.isin(path.kind, kinds))


def summary(features: Features, visit: Sequence[int], doubt: OrderThresholds = FREE) -> Visits:
    number = np.array(visit)
    return build_visits(features, traces_of(features), number, int(number[-1]) + 1, doubt)


def test_a_visit_has_the_ends_depths_and_length_of_its_sideways_cuts() -> None:
    """Plunge, 30 mm and 40 mm at Z-2, up and a dwell; then a hole; then a full circle of 5 mm radius."""
    builder = ToolpathBuilder()
    builder.rapid(1.0, 2.0, 5.0)
    builder.feed(z=-2.5, feed=1.0)
    builder.feed(x=31.0, z=-2.0, feed=1.0)
    builder.feed(y=42.0, feed=1.0)
    builder.feed(z=1.0, feed=1.0)
    builder.dwell(1.0)
    builder.rapid(z=5.0)
    builder.drill(7.0, 8.0, DrillCycle("G81", 2.0, -6.0), feed=1.0)
    builder.end_cycles()
    builder.rapid(20.0, 0.0)
    builder.feed(z=-1.0, feed=1.0)
    builder.arc(True, (20.0, 0.0, -1.0), Arc((15.0, 0.0, 0.0)), feed=1.0)
    features = made(builder)
    found = summary(features, [0, 0, 0, 0, 0, 1, 2, 2])
    assert found.first.tolist() == [0, 5, 6] and found.last.tolist() == [4, 5, 7]
    assert found.start.tolist() == [[1.0, 2.0], [7.0, 8.0], [20.0, 0.0]]
    assert found.bottom.tolist() == [-2.5, -6.0, -1.0] and found.floor.tolist() == [-2.0, math.inf, -1.0]
    assert found.cuts.tolist() == [True, False, True]
    assert found.closed.tolist() == [False, False, True]
    assert found.length.tolist() == pytest.approx([70.0, 0.0, 10.0 * math.pi])
    assert found.ends[0].tolist() == [[1.0, 2.0], [31.0, 42.0]] and np.isnan(found.ends[1]).all()
    assert found.ends[2].tolist() == pytest.approx(np.array([[20.0, 0.0], [20.0, 0.0]]))
    assert found.sideways.tolist() == [False, True, True, False, False, False, False, True]


@pytest.mark.parametrize(("high", "level"), [(29.0, True), (31.0, False)])
def test_a_visit_lies_at_a_level_if_a_quarter_of_its_length_does(high: float, level: bool) -> None:
    """10 mm at Z-1, and more at Z0."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=high, feed=1.0)
    builder.feed(z=-1.0, feed=1.0)
    builder.feed(y=10.0, feed=1.0)
    assert summary(made(builder), [0, 0, 0]).level.tolist() == [level]


@pytest.mark.parametrize(("doubt", "drift", "cuts"), [(FREE, 0.009, False), (FREE, 0.011, True), (KEEP, 0.001, True)])
def test_a_plunge_may_drift_by_rounding(doubt: OrderThresholds, drift: float, cuts: bool) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=drift, z=-1.0, feed=1.0)
    assert summary(made(builder), [0], doubt).cuts.tolist() == [cuts]


@pytest.mark.parametrize(("gap", "closed"), [(0.99, True), (1.01, False)])
def test_a_visit_is_closed_if_its_ends_are_within_a_millimetre(gap: float, closed: bool) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.feed(x=9.0, feed=1.0)
    builder.feed(y=9.0, feed=1.0)
    builder.feed(0.0, gap, feed=1.0)
    assert summary(made(builder), [0, 0, 0]).closed.tolist() == [closed]


@pytest.mark.parametrize(("doubt", "rise"), [(KEEP, 0.2), (FREE, 0.15)])
def test_a_tab_rises_above_the_lowest_level_and_a_ramp_down_has_none(doubt: OrderThresholds, rise: float) -> None:
    for height, level in ((rise - 0.01, True), (rise + 0.01, False)):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, -3.0)
        builder.feed(x=10.0, feed=1.0)
        builder.feed(z=-3.0 + height, feed=1.0)
        builder.feed(x=20.0, feed=1.0)
        builder.feed(z=-3.0, feed=1.0)
        builder.feed(x=30.0, feed=1.0)
        features = made(builder)
        visit = np.zeros(5, dtype=np.int64)
        found = lowest_level(features, summary(features, visit, doubt), visit, doubt)
        assert found.tolist() == [True, False, level, False, True]
    ramp = ToolpathBuilder()
    ramp.rapid(0.0, 0.0, 0.0)
    for k in (1, 2, 3):
        ramp.feed(x=10.0 * k, z=-1.0 * k, feed=1.0)
    features = made(ramp)
    visit = np.zeros(3, dtype=np.int64)
    assert lowest_level(features, summary(features, visit, doubt), visit, doubt).all()


def freed(
    boxes: Sequence[tuple[float, ...]],
    doubt: OrderThresholds,
    above: Sequence[float] = (),
    alone: bool = True,
    starts: Sequence[tuple[float, float]] = (),
) -> tuple[list[bool], list[bool]]:
    """Outlines of one visit each; further visits only start somewhere."""
    n = len(boxes) + len(starts)
    visits = visits_at(
        [(((-9.0, -9.0) if k < len(boxes) else starts[k - len(boxes)]), (0.0, 0.0), -1.0) for k in range(n)]
    )
    outlines = [Outline(shapely.box(*box), [k], alone) for k, box in enumerate(boxes)]
    heights = np.array([*(above or [0.0] * len(boxes)), *([0.0] * len(starts))])
    may, surely = detaching_visits_of_outlines(visits, outlines, heights, doubt)
    return may.tolist(), surely.tolist()


PLATE, HOLE = (0.0, 0.0, 20.0, 20.0), (5.0, 5.0, 10.0, 10.0)


@BOTH
def test_an_outline_through_the_material_detaches_its_part(doubt: OrderThresholds) -> None:
    assert freed([PLATE], doubt) == ([True], [True])
    assert freed([PLATE], doubt, alone=False) == ([True], [False])
    assert freed([], doubt) == ([], [])
    for above, may, surely in (
        (doubt.through - 0.01, True, doubt.keep),
        (doubt.through + 0.01, False, False),
        (doubt.surely_through - 0.01, True, True),
        (doubt.surely_through + 0.01, not doubt.keep, False),
    ):
        assert freed([PLATE], doubt, above=[above]) == ([may], [surely])


@BOTH
def test_an_outline_inside_another_is_scrap_unless_work_starts_inside_it(doubt: OrderThresholds) -> None:
    assert freed([PLATE, HOLE], doubt) == ([True, False], [True, False])
    assert freed([PLATE, HOLE], doubt, starts=[(7.0, 7.0)]) == ([True, True, False], [True, True, False])
    assert freed([PLATE, HOLE], doubt, starts=[(12.0, 7.0)]) == ([True, False, False], [True, False, False])
    # An outline around it that is not cut through leaves a part, but none for certain.
    high = doubt.around_through + 0.01
    assert freed([PLATE, HOLE], doubt, above=[high, 0.0])[0] == [True, True]
    assert freed([PLATE, HOLE], doubt, above=[high - 0.02, 0.0])[0] == [True, False]
    assert freed([PLATE, HOLE], doubt, above=[high, 0.0])[1][1] is False


@BOTH
def test_passes_of_one_outline_are_no_parts_of_each_other(doubt: OrderThresholds) -> None:
    """An inner area of 94 % (free) or 95 % (keep) of the outer one is a second pass."""
    for share, scrap in ((doubt.smaller - 0.005, True), (doubt.smaller + 0.005, False)):
        side = 20.0 * math.sqrt(share)
        inner = (0.1, 0.1, 0.1 + side, 0.1 + side)
        assert freed([PLATE, inner], doubt) == ([True, not scrap], [True, not scrap])


@pytest.mark.parametrize(("doubt", "least", "sure"), [(KEEP, 1.0, 1.0), (FREE, 0.5, 1.5)])
def test_a_tiny_area_is_no_part(doubt: OrderThresholds, least: float, sure: float) -> None:
    for area in (least - 0.01, least + 0.01, sure - 0.01, sure + 0.01):
        assert freed([(0.0, 0.0, 1.0, area)], doubt) == ([area > least], [area > sure])


@BOTH
def test_only_work_that_starts_inside_a_hole_keeps_it_a_part(doubt: OrderThresholds) -> None:
    """An L of 10 mm: the place beside it lies inside its bounding box."""
    corner = shapely.Polygon([(4, 4), (14, 4), (14, 6), (6, 6), (6, 14), (4, 14)])
    outlines = [Outline(shapely.box(*PLATE), [0], True), Outline(corner, [1], True)]
    for start, part in (((5.0, 5.0), True), ((12.0, 12.0), False)):
        visits = visits_at(
            [((-9.0, -9.0), (0.0, 0.0), -1.0), ((-9.0, -9.0), (0.0, 0.0), -1.0), (start, (0.0, 0.0), -1.0)]
        )
        may, surely = detaching_visits_of_outlines(visits, outlines, np.zeros(3), doubt)
        assert may.tolist() == [True, part, False] == surely.tolist()


@pytest.mark.parametrize("seed", range(5))
def test_pieces_that_changed_their_order_are_those_with_a_pair_in_the_other_order(seed: int) -> None:
    """Compared pair by pair; missing pieces have rank -1."""
    rng = np.random.default_rng(seed)
    rank = np.arange(12)
    for _ in range(2):
        a, b = rng.integers(12, size=2)
        rank[[a, b]] = rank[[b, a]]
    rank[rng.integers(12, size=3)] = -1
    moved = [
        bool(rank[k] >= 0 and any(rank[j] >= 0 and (j < k) != (rank[j] < rank[k]) for j in range(12) if j != k))
        for k in range(12)
    ]
    assert _moved_mask(rank).tolist() == moved
    assert not _moved_mask(np.arange(12)).any()
