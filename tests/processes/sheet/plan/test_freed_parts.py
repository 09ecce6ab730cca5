"""Heads that stay down: travel moves avoid detached parts; moves that cannot are reported."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise, permutations
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely

from leafcut import api
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.obstacles import CLEARANCE, MARGIN
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut
from leafcut.model.outcome import Outcome
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.plan.detached_parts import HIT, DetachableParts, cut_outlines_later
from leafcut.processes.sheet.proof.cut_motion import read_cut_program
from leafcut.processes.sheet.proof.matched_runs import CutRequest, MatchedRuns
from leafcut.processes.sheet.proof.sheet import check_detached_parts, detached_part_crossings
from leafcut.processes.sheet.proof.torch_runs import torch_runs


def square(x: float, y: float, size: float = 10.0) -> Polyline:
    return Polyline.of_points([(x, y), (x + size, y), (x + size, y + size), (x, y + size)], closed=True)


def sheet_of(*paths: Polyline) -> Sheet:
    contours = [Contour(path, part=k + 1) for k, path in enumerate(paths)]
    return Sheet("three", tuple(contours))


def cut_of(k: int, start: tuple[float, float], end: tuple[float, float], joints: tuple = ()) -> Cut:
    """A cut of which only the ends count here."""
    path = Polyline.of_points([start, end])
    return Cut((k,), path, 0.0, path.length, path.length, joints, ((0.0, 10.0),))


#: Three squares in a row, 5 mm apart; each starts and ends next to its lower edge, or above its upper edge.
ROW = sheet_of(square(0, 0), square(15, 0), square(30, 0))
LEFT = cut_of(0, (-0.2, 5.0), (-0.2, 5.1))
MIDDLE = cut_of(1, (20.0, -0.2), (14.8, 0.0))
RIGHT = cut_of(2, (40.2, 5.0), (40.2, 5.1))


def test_a_way_over_a_free_part_goes_round_its_corners() -> None:
    """From the left of the row to its right, over the detached middle: by hand two corners, 1 mm from it."""
    found = DetachableParts(ROW).routes([MIDDLE, LEFT, RIGHT], None, None)
    assert (found.crossing, found.moves) == ((), 2)
    assert found.corners.keys() == {2}
    assert {y for _, y in found.corners[2]} <= {-MARGIN, 10.0 + MARGIN}
    assert all(min(abs(x - corner) for corner in (0, 10, 15, 25, 30, 40)) <= MARGIN for x, _ in found.corners[2])


def test_what_is_not_free_yet_or_hangs_on_joints_is_crossed() -> None:
    # From the right over the right one, then from the left over the left one; the middle is not free yet.
    assert DetachableParts(ROW).routes([RIGHT, LEFT, MIDDLE], None, None).corners.keys() == {1, 2}
    two = sheet_of(square(0, 0), square(15, 0))
    beyond = cut_of(1, (25.2, 5.0), (25.2, 6.0))
    assert DetachableParts(two).routes([beyond, LEFT], None, None).corners.keys() == {1}
    assert DetachableParts(two).routes([replace(beyond, joints=((0.1, 0.2),)), LEFT], None, None).corners == {}
    assert DetachableParts(two).routes([cut_of(1, (25.2, 5.0), (12.0, 5.0)), LEFT], None, None).corners == {}


def test_a_way_that_ends_inside_a_free_part_crosses_and_is_counted() -> None:
    inside = cut_of(2, (20.0, 5.0), (20.0, 5.1))
    found = DetachableParts(ROW).routes([MIDDLE, inside], None, None)
    assert (found.crossing, found.corners, found.moves) == ((1,), {}, 1)


def nearest(ways: list[list[tuple[float, float]]], free: list[object], radius: float) -> float:
    """Return the minimum distance of the head's centre from detached parts, except near the ends of moves."""
    least = math.inf
    for way in ways:
        ends = shapely.union_all([shapely.Point(way[0]).buffer(radius, 64), shapely.Point(way[-1]).buffer(radius, 64)])
        outside = shapely.difference(shapely.LineString(way), ends)
        least = min([least, *(shapely.distance(outside, part) for part in free if not outside.is_empty)])
    return least


@pytest.mark.parametrize("radius", [1.5, 2.4, 4.0])
def test_a_nozzle_keeps_its_radius_from_free_parts_where_there_is_room(radius: float) -> None:
    """From a cut just above the middle square, which is free, along its upper edge to beyond its corner, and down on
    the right of it. By hand: the gap is 5 mm, so a radius of 1.5 and 2.4 fits between two free squares, 4 does not."""
    above, beside = cut_of(1, (20.0, 10.2), (18.0, 10.2)), cut_of(2, (27.5, 2.0), (29.8, 3.0))
    free = [shapely.box(15, 0, 25, 10)]
    found = DetachableParts(ROW, radius).routes([above, beside], None, None)
    assert (found.crossing, found.close) == ((), ())
    way = [above.path.end, *found.corners[1], beside.path.start]
    assert nearest([way], free, radius) >= radius - 0.02
    assert DetachableParts(ROW).routes([above, beside], None, None).corners.keys() == {1}, (
        "its middle alone goes by the corner"
    )

    right = cut_of(2, (31.0, 10.2), (30.5, 10.2))
    found = DetachableParts(ROW, radius).routes([right, above, cut_of(0, (27.5, 2.0), (27.5, 2.1))], None, None)
    assert found.crossing == ()
    assert found.close == (() if radius < 2.5 else (2,)), "two free squares, 5 mm apart"


def test_a_nozzle_that_comes_from_beside_a_free_part_leaves_it_at_once() -> None:
    """Along an edge from 0.2 mm beside it: the centre alone moves straight, a nozzle of 3 mm first moves away."""
    beside, on = cut_of(1, (14.8, 1.0), (14.8, 1.0)), cut_of(0, (14.0, 9.9), (14.0, 9.9))
    assert DetachableParts(ROW).routes([beside, on], None, None).corners == {}
    corners = DetachableParts(ROW, 1.5).routes([beside, on], None, None).corners[1]
    assert corners[0] == pytest.approx((15.0 - 1.5 - CLEARANCE, 1.0), abs=0.02)


def test_the_way_to_the_end_counts_too() -> None:
    found = DetachableParts(ROW).routes([RIGHT, MIDDLE, LEFT], (0.0, -50.0), (80.0, 5.0))
    assert found.moves == 4
    assert 3 in found.corners


def test_what_is_known_of_a_way_is_used_only_where_the_same_parts_are_free() -> None:
    """Shapes with cached moves give the same paths as new shapes, whatever is detached."""
    sheet = sheet_of(*(square(15.0 * x, 15.0 * y) for x in range(3) for y in range(3)))
    chance = np.random.default_rng(1)
    places = [(float(x), float(y)) for x, y in chance.uniform(-5.0, 45.0, (8, 2))]
    shapes = DetachableParts(sheet, 2.0)
    for _ in range(6):
        free = set(np.flatnonzero(chance.random(9) < 0.5).tolist())
        for a, b in pairwise(places):
            assert shapes.route(a, b, free) == DetachableParts(sheet, 2.0).route(a, b, free)


def test_a_part_is_freed_behind_the_ways_that_cross_it_where_that_costs_less() -> None:
    """A move from the left to the right over the middle, and back to its start; brute force over all orders gives the
    optimum.
    """
    left, right = cut_of(0, (-0.2, 5.0), (-0.2, 5.1)), cut_of(2, (29.8, 5.0), (29.8, 5.1))
    cuts = [cut_of(1, (20.0, -0.2), (14.9, 4.0)), left, right]

    def length(order: list[int]) -> float:
        chosen = [cuts[k] for k in order]
        found = DetachableParts(ROW).routes(chosen, None, None)
        stops = [[a.path.end, *found.corners.get(k + 1, ()), b.path.start] for k, (a, b) in enumerate(pairwise(chosen))]
        return sum(math.dist(p, q) for way in stops for p, q in pairwise(way)) + HIT * len(found.crossing)

    order = cut_outlines_later(DetachableParts(ROW), cuts, [], math.dist)
    assert order != [0, 1, 2]
    assert length(order) < length([0, 1, 2])
    assert length(order) >= min(length(list(one)) for one in permutations(range(3)))
    assert cut_outlines_later(DetachableParts(ROW), cuts, [(0, 1), (0, 2)], math.dist) == [0, 1, 2]
    assert cut_outlines_later(DetachableParts(ROW), cuts, [], math.dist, lambda: True) == [0, 1, 2]


@pytest.fixture(scope="module")
def laser(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """Twelve L-shaped parts with holes on a laser whose head keeps its height."""
    file = tmp_path_factory.mktemp("laser") / "parts.dxf"
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for i in range(4):
        for j in range(3):
            x, y = 20 + i * 105, 20 + j * 105
            corners = [(0, 0), (100, 0), (100, 60), (60, 60), (60, 100), (0, 100)]
            space.add_lwpolyline([(x + u, y + v) for u, v in corners], close=True)
            space.add_circle((x + 30, y + 30), 8)
    document.saveas(file)
    return api.optimize(file, process="cut", thickness="3", cut_process="laser_fiber_3kW", iterations=10, threads=1)


def laid_of(outcome: Outcome, text: str) -> tuple[MatchedRuns, Toolpath]:
    words, plan = load_dialect(outcome.dialect), outcome.detail.plan
    path = read_cut_program(text, plan, words)
    half = 0.5 * plan.data.kerf
    return MatchedRuns(torch_runs(path, None), plan, plan.sheet, words, CutRequest(half)), path


def test_no_way_of_a_laser_crosses_a_free_part_and_the_proof_counts_for_itself(laser: Outcome) -> None:
    """The proof tests points of every rapid against the drawn edges: none is in a detached part. For straight moves it
    finds some, and refuses them.
    """
    laid, path = laid_of(laser, laser.text)
    assert laser.detail.plan.crossings == 0 == len(detached_part_crossings(laid, path))
    assert laser.machine.nozzle_diameter == 8.0
    assert laser.detail.plan.close >= len(detached_part_crossings(laid, path, 4.0))
    words = load_dialect(laser.dialect)
    assert check_detached_parts(laid, path, words, 8.0) == []
    (told,) = [i for i in laser.issues if i.code == "L623"]
    assert (
        f"a nozzle of 8 mm passes over detached parts on {laser.detail.plan.close} of 24 travel moves" in told.message
    )
    rapid = path.kind == Kind.RAPID
    last = ~(rapid & np.append(rapid[1:], False))
    columns = {name: getattr(path, name)[last] for name in ("kind", "end", "value", "ref", "line")}
    straight = replace(path, **columns)
    found = check_detached_parts(laid, straight, words)
    assert found
    assert "0 reported" in str(found[0])
    laid, path = laid_of(replace(laser, detail=SheetDetail((replace(laser.detail.plan, close=0),))), laser.text)
    (wide,) = check_detached_parts(laid, path, words, 8.0)
    assert "a nozzle of 8 mm passes over detached parts" in str(wide)


def test_no_order_of_the_summary_is_faster_and_as_safe(laser: Outcome) -> None:
    """The nearest-neighbour order avoids detached parts as well, so that the comparison is fair."""
    measures = (laser.before, laser.nearest, laser.after)
    (drawn, nearest, written) = (
        ([plan.crossings, plan.close], measure.time_s)
        for plan, measure in zip(laser.detail.plans, measures, strict=True)
    )
    for risks, seconds in (drawn, nearest):
        assert risks > written[0] or seconds >= written[1]
    assert nearest[0][0] == 0


def test_a_table_that_rises_between_cuts_goes_straight(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    for x in (0, 60, 120):
        document.modelspace().add_lwpolyline([(x, 0), (x + 50, 0), (x + 50, 50), (x, 50)], close=True)
    document.saveas(tmp_path / "row.dxf")
    outcome = api.optimize(tmp_path / "row.dxf", process="cut", thickness="6", iterations=3, threads=1)
    assert outcome.detail.plan.crossings is None
    assert "L623" not in {i.code for i in outcome.issues}
