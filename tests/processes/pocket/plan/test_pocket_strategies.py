"""Pocket strategies, by hand calculation; shapely judges coverage and gouges."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pocket_shapes import RULES, box, floor_mm, l_shape, leaves, only_region, plate, uncovered_share

from leafcut.geometry.polyline import Polyline
from leafcut.material.step_over import WidePlaceFinder
from leafcut.model.pocket import Pocket, PocketPath
from leafcut.processes.pocket.clearing import measure_path
from leafcut.processes.pocket.plan.connected_rings import connected_path
from leafcut.processes.pocket.plan.region import CentreRegion, centre_regions
from leafcut.processes.pocket.plan.rings import contour_parallel_path, offset_rings
from leafcut.processes.pocket.plan.spurs import add_spurs
from leafcut.processes.pocket.plan.zigzag import zigzag

STRATEGIES = [connected_path, contour_parallel_path, zigzag]
POCKETS = {"plate": plate(), "l_shape": l_shape(), "disc": Pocket(Polyline.circle(0, 0, 24))}


@pytest.mark.parametrize("name", POCKETS)
@pytest.mark.parametrize("strategy", STRATEGIES, ids=lambda strategy: strategy.__name__)
def test_every_strategy_clears_the_whole_floor_and_gouges_no_wall(
    strategy: Callable[[CentreRegion], PocketPath], name: str
) -> None:
    region = only_region(POCKETS[name])
    path = strategy(region)
    assert leaves(region, path) < 1e-6
    assert uncovered_share(region, path) < 1e-4


@pytest.mark.parametrize("name", POCKETS)
def test_the_connected_path_has_no_retract_and_is_at_most_a_percent_longer_than_other_strategies(name: str) -> None:
    region = only_region(POCKETS[name])
    path, others = connected_path(region), [contour_parallel_path(region), zigzag(region)]
    assert path.retracts == 0 and path.rapid_mm == 0.0
    assert path.feed_mm <= 1.01 * min(other.feed_mm + other.rapid_mm for other in others)


def test_rings_of_a_rectangle_are_as_long_as_by_hand() -> None:
    """Centres of 90 × 50: rings at 0, 6, … 24 mm from the wall are 2·(90 − 12k) + 2·(50 − 12k) long."""
    found = offset_rings(only_region(Pocket(box(0, 0, 100, 60))))
    assert [ring.level for ring in found] == [0, 1, 2, 3, 4]
    assert [ring.length for ring in found] == pytest.approx([280 - 48 * k for k in range(5)], abs=0.1)


def test_contour_links_the_rings_of_a_rectangle_by_one_step_over_each() -> None:
    path = contour_parallel_path(only_region(Pocket(box(0, 0, 100, 60))))
    links = [piece.path.length for piece in path.pieces if piece.kind == "link"]
    assert len(links) == 4 and path.retracts == 0
    # Rings are closest at the start of the next ring: at a step-over, or on the diagonal of a corner.
    assert all(6.0 <= round(link, 3) <= 8.49 for link in links)


@pytest.mark.parametrize("climb", [True, False])
def test_walls_are_passed_with_the_material_on_the_right_when_climbing(climb: bool) -> None:
    region = only_region(plate(), dataclasses.replace(RULES, climb=climb))
    for ring in offset_rings(region):
        if ring.level == 0:
            start, end = ring.points[0], ring.points[1]
            ahead = (end - start) / np.hypot(*(end - start))
            right = np.array([ahead[1], -ahead[0]]) * (1.0 if climb else -1.0)
            beside = 0.5 * (start + end) + 5.2 * right
            assert not region.polygon.buffer(5.0).contains(shapely.Point(beside))


@pytest.mark.parametrize("size", [(80, 60), pytest.param((140, 100), marks=pytest.mark.slow)])
def test_no_pass_of_the_connected_path_is_further_than_the_step_over_from_its_neighbour(size: tuple[int, int]) -> None:
    """Wider passes stay rings. The core between two fronts is at most as wide as the tool."""
    pocket = Pocket(box(0, 0, *size))
    region = only_region(pocket)
    found = measure_path(pocket, connected_path(region, WidePlaceFinder(region.polygon, RULES)), RULES)
    assert 0.97 * RULES.step_over < found.max_step_over <= RULES.step_over
    assert found.max_core < RULES.tool_diameter


def test_a_strip_between_two_lines_is_cleared_by_spurs_as_short_as_will_do() -> None:
    """Lines 10.4 mm apart leave a strip 0.4 mm wide: a spur 0.2 mm deep would just touch its middle."""
    ground = shapely.box(0, 0, 50, 10.4)
    ways = [np.array([(0.0, 0.0), (50.0, 0.0)]), np.array([(0.0, 10.4), (50.0, 10.4)])]
    spurred = add_spurs(ways, ground, RULES)
    added = sum(shapely.LineString(way).length for way in spurred) - 100.0
    assert 0.0 < added < 50.0
    steps = np.concatenate([np.stack([way[:-1], way[1:]], axis=1) for way in spurred])
    swept = shapely.union_all(shapely.buffer(shapely.linestrings(steps), 5.0, quad_segs=64))
    assert ground.difference(swept).area < 0.01


def test_a_spur_goes_round_no_corner_but_comes_from_a_pass_that_sees_the_place() -> None:
    """Below a wall 1 mm thick, from x = 10 to 60, is a pass 8 mm from the strip above it that is uncut."""
    wall = shapely.box(10, 7, 60, 8)
    ground = shapely.box(0, 0, 60, 30) - wall
    ways = [np.array([(0.0, 6.0), (60.0, 6.0)]), np.array([(0.0, 30.0), (0.0, 10.0), (8.0, 10.0)])]
    ways.append(np.array([(20.0, 30.0), (60.0, 30.0), (60.0, 19.0), (20.0, 19.0)]))
    spurred = add_spurs(ways, ground, RULES)
    assert sum(len(way) for way in spurred) > sum(len(way) for way in ways)
    assert all(ground.buffer(1e-5).covers(shapely.LineString(way)) for way in spurred)


def test_nothing_is_added_where_nothing_is_uncut() -> None:
    way = np.array([(0.0, 0.0), (50.0, 0.0)])
    (same,) = add_spurs([way], shapely.box(0, -4, 50, 4), RULES)
    assert np.array_equal(same, way)


def test_lines_at_a_given_angle_run_at_that_angle_and_no_further_apart_than_the_step_over() -> None:
    region = only_region(Pocket(box(0, 0, 100, 60)))
    path = zigzag(region, angle=math.pi / 2)
    steps = np.diff(path.pieces[0].path.vertices[:, :2], axis=0)
    long = steps[np.hypot(*steps.T) > 10.0]
    assert np.abs(long[:, 0]).max() < 1e-6
    columns = np.unique(path.pieces[0].path.vertices[:, 0].round(6))
    assert np.diff(columns).max() <= 6.0 + 1e-6


def test_lines_end_on_the_walls_where_they_would_leave_more_than_the_step_over_before_them() -> None:
    """A star with five points: half a step-over before the pass along its walls a line ends too soon for the next."""
    radii = [45.0 if k % 2 else 20.0 for k in range(10)]
    points = [(r * math.cos(math.pi * k / 5), r * math.sin(math.pi * k / 5)) for k, r in enumerate(radii)]
    pocket = Pocket(Polyline.of_points(points, closed=True))
    region = only_region(pocket)
    before = measure_path(pocket, zigzag(region, 0.0), RULES)
    after = measure_path(pocket, zigzag(region, 0.0, too_wide=WidePlaceFinder(region.polygon, RULES)), RULES)
    assert before.max_step_over > 1.1 * RULES.step_over
    assert after.max_step_over <= RULES.step_over


def test_lines_begin_with_a_run_that_has_room_for_a_ramp_and_not_in_a_corner() -> None:
    """The floor is a flat V: the line in its tip is a point, and both ends of the next line are far from it."""
    pocket = Pocket(Polyline.of_points([(0, 10), (50, 0), (100, 10), (100, 50), (0, 50)], closed=True))
    region = only_region(pocket)
    path = zigzag(region, angle=0.0)
    runs = [piece.path.length for piece in path.pieces if piece.kind == "rough"]
    assert min(runs) < 0.1
    assert path.pieces[0].path.length >= RULES.tool_diameter


def test_a_slot_as_wide_as_the_tool_is_cleared_by_one_line_there_and_back() -> None:
    region = only_region(Pocket(box(0, 0, 60, 10.2)))
    path = connected_path(region)
    assert uncovered_share(region, path) < 1e-4 and leaves(region, path) < 1e-6
    assert path.feed_mm < 2.2 * 50.0


@pytest.mark.parametrize("width", [10.0045, 10.008, 10.05])
def test_a_slot_a_few_hundredths_wider_than_the_tool_is_cleared_by_lines(width: float) -> None:
    region = only_region(Pocket(box(0, 0, 60, width)))
    path = zigzag(region)
    assert uncovered_share(region, path) < 0.01  # what is left are films along the walls
    assert leaves(region, path) < 1e-6


def test_the_connected_path_over_a_disc_is_near_the_ideal_of_constant_pitch() -> None:
    """The ideal is floor + half the wall: half of the strip along the wall lies outside the region."""
    region = only_region(Pocket(Polyline.circle(0, 0, 45)))
    assert connected_path(region).feed_mm < 1.03 * (floor_mm(region) + 0.5 * region.polygon.length)


@st.composite
def polygons_with_islands(draw: st.DrawFn) -> Pocket:
    """A star-shaped outline with up to two round islands, not always apart from each other."""
    n = draw(st.integers(5, 9))
    radii = draw(st.lists(st.floats(18.0, 36.0), min_size=n, max_size=n))
    points = [(r * math.cos(2 * math.pi * k / n), r * math.sin(2 * math.pi * k / n)) for k, r in enumerate(radii)]
    shape = shapely.Polygon(points)
    islands: list[Polyline] = []
    for _ in range(draw(st.integers(0, 2))):
        x, y, r = draw(st.floats(-15, 15)), draw(st.floats(-15, 15)), draw(st.floats(2.0, 6.0))
        disc = shapely.Point(x, y).buffer(r + 0.5)
        if shape.contains(disc):
            shape = shape.difference(disc)
            islands.append(Polyline.circle(x, y, r, clockwise=True))
    return Pocket(Polyline.of_points(points, closed=True), tuple(islands))


@settings(max_examples=settings().max_examples // 5)
@given(polygons_with_islands())
def test_any_pocket_is_cleared_without_gouges_by_one_path_per_region(pocket: Pocket) -> None:
    for region in centre_regions(pocket, RULES)[0]:
        path = connected_path(region)
        assert path.retracts == 0
        assert leaves(region, path) < 1e-6
        assert uncovered_share(region, path) < 1e-3


def test_a_zigzag_leaves_at_most_the_step_over_to_its_pass_along_round_walls() -> None:
    """Rays square to the walls measure the width that the lines leave uncut."""
    region = only_region(Pocket(Polyline.circle(0, 0, 40), (Polyline.circle(9, -7, 8, clockwise=True),)))
    path, radius = zigzag(region, too_wide=WidePlaceFinder(region.polygon, RULES)), 0.5 * RULES.tool_diameter
    rough = [shapely.LineString(piece.path.flattened(0.01)) for piece in path.pieces if piece.kind == "rough"]
    cleared = shapely.union_all(rough).buffer(radius, 64)
    widest = 0.0
    for middle, radii in ((np.zeros(2), 40.0), (np.array([9.0, -7.0]), -8.0)):
        for angle in np.linspace(0.0, math.tau, 720, endpoint=False):
            out = np.array([math.cos(angle), math.sin(angle)]) * math.copysign(1.0, radii)
            wall = middle + abs(radii) * np.array([math.cos(angle), math.sin(angle)])
            ray = shapely.LineString([wall, wall - 2.0 * radius * out])
            widest = max(widest, shapely.Point(wall).distance(ray.intersection(cleared)))
    assert 0.5 * RULES.step_over < widest <= RULES.step_over
