"""The grid of a pocket and the moves on it: by hand, by brute force, and by invariants of every order."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketRules
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job, machine_of
from leafcut.processes.pocket.plan import grid as pocket_grid
from leafcut.processes.pocket.plan.grid import (
    RegionPaths,
    Retract,
    best_grid,
    grid_path,
    grid_points,
    grid_problem,
    path_length,
)
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.strategies import STRATEGIES, Grids
from leafcut.processes.settings import collect_settings

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
#: A square with a square island in its middle, as a region of tool centres.
RING = shapely.box(0, 0, 40, 40).difference(shapely.box(13, 13, 27, 27))
SMALL_RING = shapely.box(0, 0, 26, 26).difference(shapely.box(9, 9, 17, 17))
DEAR, CHEAP = Retract(1e6, 1.0), Retract(0.0, 0.1)


def region(shape: object, rules: PocketRules = RULES) -> CentreRegion:
    """A region of tool centres of this shape."""
    return CentreRegion(shape, rules)


def test_a_step_over_of_half_a_diameter_is_too_small_for_a_grid() -> None:
    with pytest.raises(PlanError, match=r"more than 0\.5 diameters apart, which exceeds the step-over of 5 mm"):
        grid_points(region(RING, replace(RULES, step_over=5.0)))


def test_a_grid_has_the_points_counted_by_hand() -> None:
    """0, 6, … 30 along x, 0, 6, 12 along y; with an offset of 3 mm 3, 9, … 27 and 3, 9."""
    shape = region(shapely.box(0, 0, 31, 13))
    assert len(grid_points(shape).points) == 6 * 3
    assert len(grid_points(shape, (3.0, 3.0)).points) == 5 * 2
    assert len(best_grid(shape).points) == 5 * 2


def test_points_outside_by_less_than_the_tolerance_are_moved_onto_the_boundary() -> None:
    shape = region(shapely.box(0, 0, 29.995, 12))
    points = grid_points(shape).points
    assert len(points) == 6 * 3
    assert sorted(set(points[:, 0].round(6))) == [0, 6, 12, 18, 24, 29.995]


def test_a_turned_grid_is_the_grid_of_the_region_turned_back() -> None:
    shape, angle = shapely.box(0, 0, 31, 13), 0.4
    turned = grid_points(region(shapely.affinity.rotate(shape, angle, origin=(0, 0), use_radians=True)), angle=angle)
    back = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    assert turned.points @ back == pytest.approx(grid_points(region(shape)).points, abs=1e-9)


def test_a_region_too_small_for_any_point_has_one_in_its_middle() -> None:
    grid = best_grid(region(shapely.Polygon([(0, 0), (1, 0.4), (0, 0.5)]), replace(RULES, tolerance=1e-4)))
    assert len(grid.points) == 1


def test_too_many_points_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    for most in (50, 20):
        monkeypatch.setattr(pocket_grid, "MOST_POINTS", most)
        with pytest.raises(PlanError, match=f"the limit is {most}"):
            grid_points(region(shapely.box(0, 0, 60, 60)))


@given(st.sets(st.integers(0, 15), min_size=2, max_size=6))
def test_no_path_is_shorter_than_the_bound_of_colours_and_spurs(cells: set[int]) -> None:
    """All orders of some points of a 4 × 4 grid, tried; the points are taken by a region of spots."""
    places = np.array([(k % 4, k // 4) for k in cells | {0}]) * 6.0
    spurs = pocket_grid._count_spurs(*(places / 6.0).round().astype(int).T)
    colour = (places.sum(axis=1) / 6.0).round().astype(int) % 2
    longer = max(abs(len(places) - 2 * int(colour.sum())) - 1, spurs)
    grid = pocket_grid.Grid(places, 6.0, longer)
    shortest = min(path_length(places[list(order)]) for order in itertools.permutations(range(len(places))))
    assert shortest >= grid.path_length_bound - 1e-9


def test_the_colours_of_a_grid_are_counted_by_hand() -> None:
    """3 × 3 points: five of one colour, four of the other; a plus of five: four and one, so two steps are longer."""
    assert grid_points(region(shapely.box(0, 0, 12.5, 12.5))).longer == 0
    plus = shapely.box(0, 5.5, 12.5, 6.5).union(shapely.box(5.5, 0, 6.5, 12.5))
    grid = grid_points(region(plus))
    assert (len(grid.points), grid.longer) == (5, 2)
    assert grid.path_length_bound == pytest.approx(6.0 * (4 + 2 * (math.sqrt(2) - 1)))


def test_the_way_round_an_island_is_the_string_pulled_tight() -> None:
    """From (20, 10) to (20, 30): round the corners (13, 13) and (13, 27), or the other two."""
    points = np.array([[20.0, 10.0], [20.0, 30.0], [5.0, 5.0]])
    ways = RegionPaths(RING, CentreRegion(RING, RULES).boundary_rings, points, 6.0)
    by_hand = 2 * math.hypot(7, 3) + 14
    node, way = ways.path_to_nearest(0, [1]) or (-1, points)
    assert node == 1 and path_length(way) == pytest.approx(by_hand)
    lengths = ways.shortest_lengths()
    assert by_hand - 1e-6 <= lengths[0, 1] < 1.02 * by_hand
    assert lengths[0, 2] == pytest.approx(math.hypot(15, 5))
    assert ways.straight_move_mask(points[[0, 0]], points[[1, 2]]).tolist() == [False, True]


def test_lengths_between_points_are_a_metric_no_shorter_than_the_straight_line() -> None:
    grid = best_grid(region(RING))
    d = RegionPaths(RING, region(RING).boundary_rings, grid.points, 6.0).shortest_lengths()
    x, y = grid.points.T
    assert np.isfinite(d).all() and np.array_equal(d, d.T)
    assert (d >= np.hypot(x[:, None] - x, y[:, None] - y) - 1e-9).all()
    assert (d[:, None, :] <= d[:, :, None] + d[None, :, :] + 1e-5).all()


def check(path: PocketPath, shape: CentreRegion) -> None:
    """Feed moves stay inside, and everything that can be reached is cut."""
    lines = shapely.union_all([shapely.LineString(piece.path.vertices[:, :2]) for piece in path.pieces])
    assert lines.difference(shape.polygon.buffer(1e-5)).length == 0.0
    cut = lines.buffer(5.0, quad_segs=16)
    assert shape.polygon.buffer(4.99, quad_segs=16).difference(cut).area < 1e-6


@settings(max_examples=settings().max_examples // 5)
@given(st.randoms(use_true_random=False), st.sampled_from([DEAR, CHEAP, Retract()]))
def test_in_any_order_no_feed_crosses_an_island_and_nothing_stays_uncut(order: object, retract: Retract) -> None:
    shape = region(SMALL_RING)
    problem, context = grid_problem(shape, retract)
    nodes = list(range(problem.n_nodes))
    order.shuffle(nodes)  # type: ignore[attr-defined]
    path = grid_path(context, np.array(nodes, dtype=np.int32))
    check(path, shape)
    if retract is DEAR:
        assert path.retracts == 0
    assert sum(piece.kind == "finish" for piece in path.pieces) == 2
    visited = np.concatenate([p.path.vertices[:, :2] for p in path.pieces])
    for point in context.grid.points:
        assert np.hypot(*(visited - point).T).min() < 1e-9


def test_the_path_along_the_rows_costs_what_the_problem_says_and_has_no_retract() -> None:
    shape = region(shapely.box(0, 0, 31, 13))
    problem, context = grid_problem(shape, grid=grid_points(shape))
    x, y = context.grid.points.T
    row = (y / 6).round().astype(int)
    order = np.lexsort((np.where(row % 2, -x, x), row)).astype(np.int32)
    path = grid_path(context, order)
    assert problem.metric.matrix is not None
    (rows,) = [piece for piece in path.pieces if piece.kind == "rough"]
    assert rows.path.length == pytest.approx(problem.metric.matrix[order[:-1], order[1:]].sum()) == 17 * 6.0
    assert path.retracts == 0


@pytest.mark.parametrize("climb", [True, False])
def test_walls_are_on_the_right_in_climb_milling_and_on_the_left_in_conventional(climb: bool) -> None:
    shape = region(RING, replace(RULES, climb=climb))
    problem, context = grid_problem(shape)
    path = grid_path(context, np.arange(problem.n_nodes, dtype=np.int32))
    loops = [piece.path for piece in path.pieces if piece.kind == "finish"]
    for loop in loops:
        assert math.dist(loop.start, loop.end) <= SAME_PLACE
        a, b = loop.vertices[0, :2], loop.vertices[1, :2]
        right = 0.5 * (a + b) + 0.01 * np.array([b[1] - a[1], a[0] - b[0]]) / math.dist(a, b)
        assert shapely.contains_xy(RING, *right) != climb


def test_the_pass_along_the_walls_leaves_the_stock_there_and_is_roughing() -> None:
    shape = region(RING, replace(RULES, stock=0.5))
    problem, context = grid_problem(shape)
    path = grid_path(context, np.arange(problem.n_nodes, dtype=np.int32))
    check(path, shape)
    assert {piece.kind for piece in path.pieces} <= {"rough", "link"}
    loops = sorted(p.path.length for p in path.pieces if math.dist(p.path.start, p.path.end) <= SAME_PLACE)
    assert loops[-2:] == pytest.approx([ring.length for ring in (RING.interiors[0], RING.exterior)])


def test_a_region_with_one_point_is_cut_by_its_finishing_pass() -> None:
    shape = region(shapely.box(0, 0, 2, 2))
    problem, context = grid_problem(shape)
    check(grid_path(context, np.zeros(problem.n_nodes, dtype=np.int32)), shape)


def test_two_strategies_on_one_region_make_its_grid_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second strategy uses the grid of the first, with the same path; a third one builds a new grid."""
    made: list[RegionPaths] = []

    class Counted(RegionPaths):
        def __init__(self, *given: object) -> None:
            super().__init__(*given)  # type: ignore[arg-type]
            made.append(self)

    monkeypatch.setattr(pocket_grid, "RegionPaths", Counted)
    settings = collect_settings({"preset": "fast", "threads": 1})
    run, shape = Job(settings, machine_of(settings), Deadline()), region(RING)
    strategies = {way.name: way.path for way in STRATEGIES}
    counts, paths = [], []
    grids: Grids = {}
    for name, where in [("firefly", shape), ("ants", shape), ("firefly", shape), ("ants", region(RING))]:
        paths.append(strategies[name](where, run, grids))
        counts.append(len(made))
    assert counts == [1, 1, 2, 3]
    points = [[piece.path.vertices.tolist() for piece in path.pieces] for path in paths]
    assert points[0] == points[2]
    assert points[1] == points[3]
