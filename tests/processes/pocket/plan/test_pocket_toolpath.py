"""From the path over one level to motions: levels, entries, links, walls; by hand on a square pocket."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from leafcut.errors import OptionError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket, PocketLevels, PocketPath, PocketPiece, PocketRules
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import JobOptions, MillingOptions
from leafcut.processes.milling.entries import ABOVE
from leafcut.processes.milling.mill import MillingData, milling_data
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.arcs import fit_arcs_to_path
from leafcut.processes.pocket.plan.region import CentreRegion, centre_regions
from leafcut.processes.pocket.plan.rings import contour_parallel_path
from leafcut.processes.pocket.plan.rules import (
    clearing_rules,
    divide_into_levels,
    finishing_levels,
    select_pockets,
)
from leafcut.processes.pocket.plan.toolpath import Clearing, PocketHeights, pocket_motion
from leafcut.processes.pocket.plan.walls import wall_passes
from leafcut.processes.pocket.proof.pocket import check_pockets
from leafcut.read.machine import load_machine

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
MILL = load_machine("linuxcnc-mill")
ANGLE = math.radians(3.0)


def box(x0: float, y0: float, x1: float, y1: float, closed: bool = True) -> Polyline:
    """A rectangle, counter-clockwise."""
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return Polyline.of_points(corners if closed else [*corners, corners[0]], closed=closed)


def square(side: float = 60.0, stock: float = 0.0) -> tuple[CentreRegion, CentreRegion]:
    """The region of tool centres of a square pocket, to the wall and less the stock."""
    pocket = Pocket(box(0, 0, side, side))
    return centre_regions(pocket, RULES)[0][0], centre_regions(pocket, replace(RULES, stock=stock))[0][0]


def rings(*sizes: float, joined: bool = True) -> PocketPath:
    """Squares round (30, 30) from the inside out, half their sides given, with links where they are joined."""
    pieces: list[PocketPiece] = []
    for half in sizes:
        ring = box(30 - half, 30 - half, 30 + half, 30 + half, closed=False)
        if joined and pieces:
            pieces.append(PocketPiece(Polyline.of_points([pieces[-1].path.end, ring.start]), "link"))
        pieces.append(PocketPiece(ring))
    return PocketPath("rings", tuple(pieces))


def data_of(entry: str = "ramp", feed: float = 10.0) -> MillingData:
    return milling_data(MillingOptions(), JobOptions(spindle_speed=3000.0, feed=feed), 10.0, MILL, entry=entry)[0]


def lay(path: PocketPath, levels: tuple[float, ...] = (-2.0,), entry: str = "ramp", **changes: object) -> Toolpath:
    region = square()[0]
    heights = PocketHeights(clearance=10.0, retract=2.0, **changes)  # type: ignore[arg-type]
    clearing = Clearing(region, region.polygon, path, PocketLevels(0.0, levels))
    return pocket_motion([clearing], heights, data_of(entry), MILL)[0]


def test_levels_are_equal_and_none_is_deeper_than_the_step_down() -> None:
    assert divide_into_levels(5.0, 2.0, 10.0).levels == pytest.approx([-5 / 3, -10 / 3, -5.0])
    assert divide_into_levels(4.0, 2.0, 10.0).levels == pytest.approx([-2.0, -4.0])
    assert divide_into_levels(4.0, None, 10.0) == PocketLevels(0.0, (-4.0,))
    assert divide_into_levels(9.0, 2.0, 10.0, begin=-4.0).levels == pytest.approx([-4 - 5 / 3, -4 - 10 / 3, -9.0])


def test_finishing_passes_are_two_diameters_deep_at_most() -> None:
    assert finishing_levels(PocketLevels(0.0, (-20.0,)), 10.0) == (-20.0,)
    assert finishing_levels(PocketLevels(0.0, (-50.0,)), 10.0) == pytest.approx([-50 / 3, -100 / 3, -50.0])


@pytest.mark.parametrize(
    "diameter, strategy, words", [(None, "best", "--tool-diameter"), (10.0, "adaptive", "--max-engagement")]
)
def test_rules_say_in_one_line_what_is_missing_or_wrong(diameter: float | None, strategy: str, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        clearing_rules(PocketOptions(strategy=strategy), "climb", None, diameter)


def test_depth_is_needed_and_levels_are_counted() -> None:
    with pytest.raises(OptionError, match="--depth"):
        select_pockets(Part("part", pockets=(Pocket(box(0, 0, 60, 60)),)), None, 10.0)
    with pytest.raises(OptionError, match="levels"):
        divide_into_levels(100.0, 0.01, 10.0)


def test_a_spindle_or_a_feed_that_the_machine_does_not_have_is_refused() -> None:
    with pytest.raises(PlanError, match="rpm"):
        milling_data(MillingOptions(), JobOptions(spindle_speed=50_000.0), 10.0, MILL)
    with pytest.raises(PlanError, match="feeds at"):
        milling_data(MillingOptions(), JobOptions(feed=1000.0), 10.0, MILL)
    with pytest.raises(PlanError, match="cannot mill"):
        milling_data(MillingOptions(), JobOptions(), 10.0, load_machine("plasma-table"))


# -- entries -----------------------------------------------------------------------------------------------------------


def slopes(path: Toolpath) -> list[tuple[float, float, float]]:
    """Every feed that goes down below the surface's approach: (way in the plane, drop, z at its end)."""
    before = path.before
    found = []
    for row in np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)).tolist():
        a, b = before[row], path.end[row]
        if b[2] < a[2] - 1e-9:
            way = math.dist(a[:2], b[:2])
            if path.kind[row] != Kind.FEED:
                centre = path.arcs[int(path.ref[row])].center
                way = math.pi * math.dist(a[:2], centre[:2])  # half circles
            found.append((way, float(a[2] - b[2]), float(b[2])))
    return found


def test_a_ramp_is_as_steep_as_asked_stays_on_the_path_and_ends_where_it_began() -> None:
    path = lay(rings(1, 7, 13, 19, 25))
    down = [s for s in slopes(path) if s[2] < ABOVE - 1e-9]
    assert sum(drop for _, drop, _ in down) == pytest.approx(2.0 + ABOVE)
    assert all(drop / way <= math.tan(ANGLE) + 1e-9 for way, drop, _ in down)
    ground = shapely.LineString(np.concatenate([p.path.flattened() for p in rings(1, 7, 13, 19, 25).pieces]))
    on_the_way = path.end[(path.kind == Kind.FEED) & (path.end[:, 2] < ABOVE) & (path.end[:, 2] > -2.0)]
    assert all(ground.distance(shapely.Point(p[:2])) < 1e-6 for p in on_the_way)
    first = int(np.flatnonzero((path.kind == Kind.FEED) & (path.end[:, 2] == -2.0))[0])
    assert path.end[first, :2].tolist() == pytest.approx(list(rings(1).pieces[0].path.start))


def test_along_a_ring_shorter_than_the_ramp_the_tool_goes_round_and_round_and_never_back() -> None:
    """0.5 + 2 mm at 3° are 47.7 mm: six times round a ring of 8 mm; one of 48 mm is long enough to go and come back."""
    for half, times in ((1.0, 6), (6.0, 0)):
        path = lay(rings(half, 13))
        before = path.before
        rows = [r for r in np.flatnonzero(path.kind == Kind.FEED) if path.end[r, 2] < before[r, 2] <= ABOVE + 1e-9]
        ways = path.end[rows, :2] - before[rows, :2]
        backwards = [a @ b < -1e-9 for a, b in itertools.pairwise(ways)]
        assert any(backwards) is (times == 0)
        if times:
            assert len(rows) == 4 * times and path.end[rows[-1], :2].tolist() == list(rings(half).pieces[0].path.start)


def test_a_helix_turns_inside_the_region_as_steep_as_asked_and_counter_clockwise_for_climb() -> None:
    path = lay(rings(1, 7, 13, 19, 25), entry="helix")
    arcs = np.flatnonzero(path.kind == Kind.ARC_CCW)
    assert len(arcs) and not (path.kind == Kind.ARC_CW).any()
    region = square()[0].polygon.buffer(1e-6)
    assert all(region.covers(shapely.Point(path.end[row, :2])) for row in arcs)
    assert all(drop / way <= math.tan(ANGLE) + 1e-9 for way, drop, z in slopes(path) if z < ABOVE - 1e-9)


def test_a_tool_that_has_no_room_for_a_ramp_or_a_helix_goes_straight_down_and_that_is_told() -> None:
    pocket = Pocket(Polyline.circle(30, 30, 5.05))
    region = centre_regions(pocket, RULES)[0][0]
    dot = PocketPath("dot", (PocketPiece(Polyline.of_points([(30, 30), (30.02, 30), (30, 30)])),))
    heights = PocketHeights(clearance=10.0, retract=2.0)
    clearing = Clearing(region, region.polygon, dot, PocketLevels(0.0, (-3.0,)))
    path, descents = pocket_motion([clearing], heights, data_of(), MILL)
    assert [(d.kind, d.asked) for d in descents] == [("plunge", "ramp")]
    row = int(np.flatnonzero(path.end[:, 2] == -3.0)[0])
    assert path.value[row] == pytest.approx(data_of().plunge_feed)


def test_into_what_is_cut_already_the_tool_comes_down_straight_into_what_is_not_by_its_entry() -> None:
    heights = PocketHeights(clearance=10.0, retract=2.0)
    region = square()[0]
    near = rings(13, 15, joined=False)  # 2 mm beside the cut area: half of the disc at its start is uncut
    far = rings(1, 25, joined=False)
    inside = rings(25, 23, 24, joined=False)
    for path, entries in ((near, 2), (far, 2), (inside, 2)):
        descents = pocket_motion(
            [Clearing(region, region.polygon, path, PocketLevels(0.0, (-2.0,)))], heights, data_of(), MILL
        )[1]
        assert len(descents) == entries


# -- links -------------------------------------------------------------------------------------------------------------


def rapids(path: Toolpath) -> list[tuple[list[float], list[float]]]:
    before = path.before
    return [(before[r].tolist(), path.end[r].tolist()) for r in np.flatnonzero(path.kind == Kind.RAPID)]


def test_the_tool_stays_down_between_levels_where_the_next_begins_near_the_end_of_the_last() -> None:
    there_and_back = PocketPath("ring", (PocketPiece(box(10, 10, 50, 50, closed=False)),))
    path = lay(there_and_back, levels=(-1.0, -2.0, -3.0))
    assert sum(a[2] < 0.0 < b[2] for a, b in rapids(path)) == 1  # the rise at the end
    assert [z for z in (-1.0, -2.0, -3.0) if not (path.end[:, 2] == z).any()] == []


def test_pieces_apart_are_reached_over_the_r_plane_or_over_the_clearance_height_when_asked() -> None:
    path = lay(rings(1, 13, joined=False))
    sideways = [(a, b) for a, b in rapids(path) if a[:2] != b[:2] and not math.isnan(a[0])]
    assert {a[2] for a, _ in sideways} == {2.0}
    path = lay(rings(1, 13, joined=False), always_clearance=True)
    assert {a[2] for a, b in rapids(path) if a[:2] != b[:2] and not math.isnan(a[0])} == {10.0}


def test_a_rapid_goes_down_to_just_over_the_floor_that_is_cut_and_the_tool_feeds_into_what_is_not() -> None:
    """The second line starts where the first has cut; above the start of the third, only the previous level is cut."""
    ways = ([(10, 30), (50, 30)], [(30, 30), (30, 50)], [(50, 10), (20, 10)])
    pieces = tuple(PocketPiece(Polyline.of_points(points)) for points in ways)
    path = lay(PocketPath("lines", pieces), levels=(-2.0, -4.0))
    down = [(*a[:2], b[2]) for a, b in rapids(path) if b[2] < 0.0]
    assert down == [(30, 30, -2 + ABOVE), (10, 30, -2 + ABOVE), (30, 30, -4 + ABOVE), (50, 10, -2 + ABOVE)]
    pocket = (Pocket(box(0, 0, 60, 60)),)
    assert check_pockets(path, pocket, RULES, depths=[4.0], retract=2.0) == []
    low = replace(path, end=np.where(path.end == -2.0 + ABOVE, -2.0, path.end))
    assert {d.what for d in check_pockets(low, pocket, RULES, depths=[4.0], retract=2.0)} == {"rapid in material"}


def test_a_rapid_over_a_clamp_is_made_at_the_clearance_height() -> None:
    apart = PocketPath("two", tuple(PocketPiece(Polyline.of_points([(x, 10), (x, 50)])) for x in (10.0, 50.0)))
    zones = np.array([[25.0, -20.0, 35.0, 80.0]])
    path = lay(apart, zones=zones)
    assert {a[2] for a, b in rapids(path) if a[:2] != b[:2] and not math.isnan(a[0])} == {10.0}


# -- walls -----------------------------------------------------------------------------------------------------------


def test_with_stock_all_levels_are_cleared_before_the_walls_are_finished_at_full_depth() -> None:
    region, roughed = square(stock=0.5)
    walls = wall_passes(region, roughed.polygon)
    clearing = Clearing(region, roughed.polygon, rings(1, 7, 13, 19, 24.49), PocketLevels(0.0, (-2.0, -4.0)), walls)
    heights = PocketHeights(clearance=10.0, retract=2.0)
    path = pocket_motion([clearing], heights, data_of(), MILL)[0]
    near_wall = (path.kind == Kind.FEED) & (np.abs(path.end[:, :2] - 30).max(axis=1) > 24.9)
    assert near_wall.any() and set(path.end[near_wall, 2]) == {-4.0}
    last_rough = np.flatnonzero((path.kind == Kind.FEED) & (np.abs(path.end[:, 0] - 5.51) < 1e-3))[-1]
    assert last_rough < np.flatnonzero(near_wall)[0]


def swept_at(path: Toolpath, z: float) -> shapely.Geometry:
    """Return the area that a tool of 10 mm clears by feeds at one height."""
    before, discs = path.before, []
    for row in np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)).tolist():
        a, b = before[row], path.end[row]
        if a[2] == b[2] == z:
            centre = path.arcs[int(path.ref[row])].center if path.kind[row] != Kind.FEED else None
            way = [a[:2], b[:2]] if centre is None else arc_points(a[:2], b[:2], centre, path.kind[row] == Kind.ARC_CW)
            discs.append(shapely.LineString(way).buffer(5.0, quad_segs=32))
    return shapely.union_all(discs)


def arc_points(a: np.ndarray, b: np.ndarray, centre: tuple[float, ...], clockwise: bool) -> np.ndarray:
    """Points of an arc of less than a turn."""
    first, last = (math.atan2(p[1] - centre[1], p[0] - centre[0]) for p in (a, b))
    turn = -((first - last) % math.tau) if clockwise else (last - first) % math.tau
    angles = first + turn * np.linspace(0.0, 1.0, 40)
    radius = math.dist(a, centre[:2])
    return np.column_stack([centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)])


def test_a_way_too_narrow_for_tool_and_stock_is_cut_level_by_level() -> None:
    """Two rooms of 30 mm, a way of 10.6 mm between them: with 0.5 mm of stock roughing leaves all of that way."""
    rooms = shapely.union_all([shapely.box(0, 0, 30, 30), shapely.box(29, 9.7, 71, 20.3), shapely.box(70, 0, 100, 30)])
    pocket = Pocket(Polyline.of_points(rooms.exterior.coords[:-1], closed=True))
    region = centre_regions(pocket, RULES)[0][0]
    roughed = centre_regions(pocket, replace(RULES, stock=0.5))[0]
    rough = PocketPath("contour", tuple(piece for part in roughed for piece in contour_parallel_path(part).pieces))
    allowed = shapely.union_all([part.polygon for part in roughed])
    levels = (-3.0, -6.0, -9.0, -12.0)
    clearing = Clearing(region, allowed, rough, PocketLevels(0.0, levels), wall_passes(region, allowed))
    path = pocket_motion([clearing], PocketHeights(clearance=10.0, retract=2.0), data_of(), MILL)[0]
    ground = region.polygon.buffer(4.99, quad_segs=32)
    assert ground.difference(swept_at(path, levels[-1])).area < 1e-6
    for above, below in itertools.pairwise(levels):
        assert swept_at(path, below).difference(swept_at(path, above)).buffer(-0.5).is_empty


def test_where_roughing_left_more_than_stock_the_tool_does_not_come_down_straight_to_a_wall() -> None:
    """Roughing is a single line; the walls are 14 mm from it."""
    region, roughed = square(stock=0.5)
    line = PocketPath("line", (PocketPiece(Polyline.of_points([(20, 30), (40, 30)])),))
    walls = wall_passes(region, roughed.polygon)
    clearing = Clearing(region, roughed.polygon, line, PocketLevels(0.0, (-2.0, -4.0)), walls)
    heights = PocketHeights(clearance=10.0, retract=2.0)
    path, descents = pocket_motion([clearing], heights, data_of(), MILL)
    assert [d.kind for d in descents] == ["ramp"] * 4
    straight = {z for way, _, z in slopes(path) if way == 0.0}
    assert straight == {ABOVE}  # half a millimetre over what is uncut; over what the level above has cut by a rapid
    assert {b[2] for _, b in rapids(path) if b[2] < 0.0} == {-2.0 + ABOVE}
    assert swept_at(path, -4.0).difference(swept_at(path, -2.0)).buffer(-0.01).is_empty


def test_every_run_that_begins_with_a_loop_is_entered_along_it() -> None:
    """The loops are made for limited engagement: coming down anywhere else, their first round would be a full cut."""
    loops = [Polyline.circle(x, 30, 4.5) for x in (20.0, 40.0)]
    pieces = [PocketPiece(loop.piece(0.0, loop.length), "entry") for loop in loops]
    region = square()[0]
    path, descents = pocket_motion(
        [Clearing(region, region.polygon, PocketPath("two", tuple(pieces)), PocketLevels(0.0, (-2.0,)))],
        PocketHeights(clearance=10.0, retract=2.0),
        data_of(),
        MILL,
    )
    assert [d.kind for d in descents] == ["helix", "helix"]
    for x in (20.0, 40.0):
        down = path.end[(path.kind == Kind.ARC_CCW) & (np.abs(path.end[:, 0] - x) < 5.0)]
        assert np.hypot(down[:, 0] - x, down[:, 1] - 30.0) == pytest.approx(4.5)


@pytest.mark.parametrize("climb", [True, False])
def test_a_wall_pass_goes_once_along_every_wall_on_the_side_that_is_asked_for(climb: bool) -> None:
    pocket = Pocket(box(0, 0, 80, 60), (Polyline.circle(40, 30, 8, clockwise=True),))
    rules = replace(RULES, climb=climb)
    region = centre_regions(pocket, rules)[0][0]
    roughed = centre_regions(pocket, replace(rules, stock=0.4))[0][0].polygon
    walls = wall_passes(region, roughed)
    passes = [p.path for p in walls.pieces if p.kind == "finish"]
    assert len(passes) == 2
    outer, island = (shapely.Polygon(p.flattened()) for p in passes)
    # Climb: the wall is on the right; counter-clockwise in the pocket, clockwise round an island.
    assert outer.exterior.is_ccw is climb
    assert island.exterior.is_ccw is not climb
    for way in passes:
        assert roughed.buffer(1e-6).covers(shapely.Point(way.start))
        assert region.polygon.buffer(2e-3).covers(shapely.LineString(way.flattened()))
    lines = shapely.union_all([shapely.LineString(p.flattened()) for p in passes])
    assert region.polygon.boundary.difference(lines.buffer(1e-3)).length < 1e-6


# -- arcs ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("densify", [0.05, pytest.param(0.01, marks=pytest.mark.slow)])
def test_chords_become_arcs_within_half_the_tolerance_and_keep_their_ends(densify: float) -> None:
    angles = np.linspace(0.0, 1.9 * math.pi, 400)
    curve = np.column_stack([20 * np.cos(angles), 20 * np.sin(angles)])
    points = np.concatenate([[[0.0, 0.0]], curve])
    path = PocketPath("arc", (PocketPiece(Polyline.of_points(points)),))
    new = fit_arcs_to_path(path, 0.01).pieces[0].path
    assert new.n_segments <= 5
    assert (new.start, new.end) == ((0.0, 0.0), pytest.approx(tuple(points[-1])))
    flat = shapely.LineString(new.flattened(1e-5))
    assert shapely.hausdorff_distance(flat, shapely.LineString(points), densify=densify) < 0.0051


def test_an_arc_larger_than_any_controller_takes_becomes_lines() -> None:
    xs = np.linspace(-100.0, 100.0, 200)
    points = np.column_stack([xs, xs**2 / 40_000.0])  # a radius of 20 m
    new = fit_arcs_to_path(PocketPath("flat", (PocketPiece(Polyline.of_points(points)),)), 0.01).pieces[0].path
    assert not new.bulges.any()
    flat, true = shapely.LineString(new.flattened()), shapely.LineString(points)
    assert shapely.hausdorff_distance(flat, true, densify=0.01) < 0.011


def test_no_moves_closer_than_a_program_can_say_are_left() -> None:
    points = [(0.0, 0.0), (10.0, 0.0), (10.0005, 0.0004), (10.001, 0.001), (10.001, 10.0)]
    new = fit_arcs_to_path(PocketPath("dense", (PocketPiece(Polyline.of_points(points)),)), 0.01).pieces[0].path
    assert all(math.dist(a[:2], b[:2]) > 0.004 for a, b in itertools.pairwise(new.vertices))
