"""Adaptive clearing: the measured engagement never exceeds its limit."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline
from leafcut.model.pocket import SAME_PLACE, Pocket, PocketLevels, PocketMeasures, PocketPath, PocketRules
from leafcut.model.toolpath import Kind
from leafcut.options import JobOptions, MillingOptions
from leafcut.processes.milling.mill import milling_data
from leafcut.processes.pocket.clearing import measure_path
from leafcut.processes.pocket.plan.adaptive import adaptive, medial_axis
from leafcut.processes.pocket.plan.region import centre_regions
from leafcut.processes.pocket.plan.toolpath import Clearing, PocketHeights, pocket_motion
from leafcut.read.machine import load_machine


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    """A rectangle, counter-clockwise."""
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def cleared(pocket: Pocket, degrees: float, climb: bool = True) -> tuple[PocketPath, PocketMeasures]:
    """Return the path for a pocket with a single region, and its measures."""
    rules = PocketRules(tool_diameter=10.0, step_over=6.0, climb=climb, max_engagement=math.radians(degrees))
    path = adaptive(centre_regions(pocket, rules)[0][0])
    return path, measure_path(pocket, path, rules)


def keeps_its_limit(pocket: Pocket, degrees: float, climb: bool = True) -> PocketPath:
    """Clear a pocket and check all that a path with a limit promises."""
    path, m = cleared(pocket, degrees, climb)
    assert m.max_engagement <= math.radians(degrees)
    assert m.gouge_mm2 == 0.0
    assert m.uncovered_percent <= 0.1
    assert m.retracts == 0
    return path


@pytest.mark.parametrize("degrees, climb", [(45.0, True), (80.0, False)])
def test_a_rectangle_with_sharp_corners_is_cleared_within_the_limit(degrees: float, climb: bool) -> None:
    keeps_its_limit(Pocket(box(0, 0, 24, 20)), degrees, climb)


def test_a_passage_a_little_wider_than_the_tool_is_cleared_within_the_limit() -> None:
    outline = [(0, 0), (16, 0), (16, 2), (26, 2), (26, 0), (42, 0), (42, 16), (26, 16), (26, 15), (16, 15), (16, 16)]
    keeps_its_limit(Pocket(Polyline.of_points([*outline, (0, 16)], closed=True)), 70.0)


def test_a_circle_is_a_helix_a_spiral_and_once_round_the_wall() -> None:
    path = keeps_its_limit(Pocket(Polyline.circle(5, 5, 20)), 50.0)
    assert [piece.kind for piece in path.pieces if piece.kind != "link"] == ["entry", "rough", "finish"]
    # Turning an angle φ of the edge in: a straight cut r (1 − cos φ) wide at most, so no path is shorter than this.
    bite = 5.0 * (1.0 - math.cos(math.radians(50.0)))
    assert path.feed_mm > (math.pi * 15.0**2) / bite


@pytest.mark.parametrize("climb", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_around_an_island_climb_milling_turns_left_and_conventional_milling_right(climb: bool) -> None:
    path = keeps_its_limit(Pocket(box(0, 0, 28, 26), (box(13, 12, 15, 14).reversed(),)), 80.0, climb)
    walls = [shapely.Polygon(p.path.flattened()).exterior.is_ccw for p in path.pieces if p.kind == "finish"]
    assert sorted(walls) == [False, True]
    outer = max((p for p in path.pieces if p.kind == "finish"), key=lambda p: p.path.length)
    assert shapely.Polygon(outer.path.flattened()).exterior.is_ccw == climb
    assert all((p.path.bulges * (1 if climb else -1) >= 0.0).all() for p in path.pieces if p.kind == "rough")


def test_links_lie_in_cleared_area_and_every_piece_starts_at_the_end_of_the_last_one() -> None:
    path, m = cleared(Pocket(box(0, 0, 28, 22)), 60.0)
    links = sum(piece.path.length for piece in path.pieces if piece.kind == "link")
    assert m.air_mm >= 0.98 * links
    assert all(
        math.dist(a.path.end, b.path.start) <= SAME_PLACE for a, b in zip(path.pieces, path.pieces[1:], strict=False)
    )


def test_without_a_limit_and_in_a_slot_as_wide_as_the_tool_it_is_refused_in_one_line() -> None:
    rules = PocketRules(tool_diameter=10.0, step_over=6.0)
    with pytest.raises(PlanError, match="--max-engagement"):
        adaptive(centre_regions(Pocket(box(0, 0, 40, 30)), rules)[0][0])
    tight = PocketRules(tool_diameter=10.0, step_over=6.0, max_engagement=1.0)
    with pytest.raises(PlanError, match="narrow"):
        adaptive(centre_regions(Pocket(box(0, 0, 50, 10.1)), tight)[0][0])


def test_the_axis_of_a_rectangle_is_its_middle_line_and_four_diagonals() -> None:
    axis = medial_axis(shapely.box(0, 0, 40, 20), 0.5, 0.005)
    assert axis.width[0] == pytest.approx(10.0, abs=0.01)
    length = sum(math.dist(axis.xy[i], axis.xy[axis.parent[i]]) for i in range(1, len(axis.xy)))
    assert length == pytest.approx(20.0 + 4 * 10.0 * math.sqrt(2.0), rel=0.01)
    distance = shapely.distance(shapely.points(axis.xy), shapely.box(0, 0, 40, 20).boundary)
    assert axis.width == pytest.approx(distance, abs=1e-6)


def test_a_path_that_begins_with_a_loop_is_entered_round_and_round_it_no_steeper_than_asked() -> None:
    rules = PocketRules(tool_diameter=10.0, step_over=6.0, max_engagement=1.2)
    region = centre_regions(Pocket(Polyline.circle(0, 0, 15)), rules)[0][0]
    angle = math.radians(3.0)
    mill = load_machine("linuxcnc-mill")
    data = milling_data(MillingOptions(entry_angle=angle), JobOptions(spindle_speed=3000.0, feed=10.0), 10.0, mill)[0]
    clearing = Clearing(region, region.polygon, adaptive(region), PocketLevels(0.0, (-2.0, -4.0)))
    toolpath, down = pocket_motion([clearing], PocketHeights(10.0, 2.0), data, mill)
    before, end = toolpath.before, toolpath.end
    dropping = np.flatnonzero((toolpath.kind == Kind.ARC_CCW) & (end[:, 2] < before[:, 2] - 1e-9))
    # Half circles of 4.5 mm about the middle, whose slope is the drop over π · 4.5.
    assert np.hypot(end[dropping, 0], end[dropping, 1]) == pytest.approx(np.full(len(dropping), 4.5))
    assert ((before - end)[dropping, 2] <= math.pi * 4.5 * math.tan(angle) + 1e-9).all()
    assert {d.kind for d in down} == {"helix"} and [d.bottom for d in down] == [-2.0, -4.0]


numbers = st.floats(-10.0, 10.0).map(lambda v: round(v, 2))


@settings(max_examples=settings().max_examples // 5)
@given(
    corners=st.lists(st.tuples(numbers, numbers), min_size=3, max_size=6, unique=True),
    degrees=st.sampled_from([50.0, 75.0, 110.0]),
)
def test_random_pockets_are_cleared_within_the_limit(corners: list[tuple[float, float]], degrees: float) -> None:
    hull = shapely.MultiPoint(corners).convex_hull.buffer(7.5, quad_segs=4)
    keeps_its_limit(Pocket(as_polyline(hull.exterior.coords, True)), degrees)
