"""Where a bridge may lead from one contour to another: by distances that shapely measures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

from cut_sheets import (
    PLASMA,
    cutting_of,
    part_in_hole,
    part_in_notch,
    rectangle,
    ring,
    rules_of,
    sheet_of,
    square,
    two_squares,
)
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.chains import (
    LEAVES_WITHIN,
    PLACES,
    Bridges,
    bridge_fits,
    exit_position,
    find_bridges,
    leaves_kerf_at_once,
    scrap_number,
)
from leafcut.processes.sheet.plan.contours import CutContour, prepare_contours
from leafcut.processes.sheet.plan.scrap import Scrap

KERF = PLASMA.kerf
HALF = 0.5 * KERF


def ready(sheet: Sheet, **options: Any) -> tuple[list[CutContour], Scrap]:
    rules = rules_of(**options)
    contours, _ = prepare_contours(sheet, rules)
    return contours, Scrap(sheet, contours, rules)


def bridges(sheet: Sheet, reach: float, members: list[int] | None = None) -> tuple[list[CutContour], Bridges]:
    contours, scrap = ready(sheet)
    which = members if members is not None else [k for k, c in enumerate(contours) if c.has_leads]
    return contours, find_bridges(contours, which, scrap, reach)


def pairs(found: Bridges) -> set[tuple[int, int]]:
    ends = zip(found.contour[found.begin].tolist(), found.contour[found.end].tolist(), strict=True)
    return set(ends)


def test_bridges_between_two_squares_are_as_long_as_said_and_shorter_than_the_reach() -> None:
    """20 mm are between the squares: 18.5 mm between the middles of their kerfs."""
    _, found = bridges(two_squares(20.0), 30.0)
    assert pairs(found) == {(0, 1), (1, 0)}
    step = found.arrive[found.end] - found.leave[found.begin]
    assert found.length == pytest.approx(np.hypot(*step.T))
    assert found.length.max() < 30.0
    assert found.length.min() == pytest.approx(20.0 - KERF, abs=0.5)


@pytest.mark.hazard
@pytest.mark.parametrize("mouth, joined", [(2.9, set()), (6.0, {(0, 1), (1, 0)})])
def test_no_bridge_joins_an_outline_and_a_part_in_its_closed_notch(mouth: float, joined: set[tuple[int, int]]) -> None:
    """Two kerfs of 1.5 mm close the first mouth: a chain from the outline would cut the part on loose scrap."""
    cutting = cutting_of(part_in_notch(mouth))
    assert pairs(find_bridges(cutting.contours, [0, 1], cutting.scrap, 30.0)) == joined


def test_where_the_reach_is_less_than_the_room_between_there_are_none() -> None:
    assert len(bridges(two_squares(20.0), 18.0)[1].length) == 0
    assert len(bridges(two_squares(20.0), 30.0, members=[])[1].length) == 0


def test_a_part_between_two_others_is_in_the_way() -> None:
    """A slat reaches beyond both squares; only from neighbour to neighbour there is a bridge."""
    sheet = sheet_of(
        (square(50, 50, 30), 0, -1, 1), (rectangle(90, 20, 8, 90), 0, -1, 2), (square(108, 50, 30), 0, -1, 3)
    )
    assert pairs(bridges(sheet, 60.0)[1]) == {(0, 1), (1, 0), (1, 2), (2, 1)}


def test_no_bridge_touches_a_part_a_clamp_or_a_kerf_but_those_that_it_joins() -> None:
    boxes = [(square(40 + 40 * i, 40 + 40 * j, 30), 0, -1, 1 + i + 2 * j) for i in range(2) for j in range(2)]
    sheet = sheet_of(*boxes, zones=((70.0, 45.0, 80.0, 65.0),))
    contours, found = bridges(sheet, 40.0)
    lines = shapely.linestrings(np.stack([found.leave[found.begin], found.arrive[found.end]], axis=1)).tolist()
    assert len(lines) > 20
    clamp = shapely.box(70, 45, 80, 65)
    for line, one, other in zip(lines, found.contour[found.begin], found.contour[found.end], strict=True):
        assert line.distance(clamp) >= HALF - 1e-3
        for k, contour in enumerate(contours):
            part = shapely.Polygon(contour.source.path.flattened(0.01))
            assert line.distance(part) >= HALF - 0.02
            if k not in (one, other):
                assert line.distance(contour.line) >= KERF - 1e-3


def test_a_hole_is_come_to_from_what_lies_in_it_and_never_left() -> None:
    contours, found = bridges(part_in_hole(), 60.0)
    holes = {k for k, contour in enumerate(contours) if contour.hole}
    inner = next(k for k, c in enumerate(contours) if c.source.part == 2 and not c.hole)
    around = next(k for k, c in enumerate(contours) if c.source.part == 1 and c.hole)
    assert pairs(found) == {(inner, around)}
    assert not holes & {one for one, _ in pairs(found)}


def test_along_an_outline_lies_what_it_is_in_and_along_a_hole_its_own_room() -> None:
    contours, _ = ready(ring())
    sides = {c.index: scrap_number(c) for c in contours if c.kind == "cut"}
    assert sides == {0: -1, 1: 1}


def test_places_of_a_contour_are_bounded_in_number_and_a_millimetre_apart() -> None:
    boxes = [(square(30 + 12 * i, 30 + 12 * j, 6), 0, -1, 1 + i + 3 * j) for i in range(3) for j in range(2)]
    contours, found = bridges(sheet_of(*boxes), 60.0)
    for k, contour in enumerate(contours):
        at = np.sort(found.at[found.contour == k])
        assert 2 <= len(at) <= PLACES
        around = np.append(at, at[0] + contour.path.length)
        assert np.diff(around).min() >= 1.0 - 1e-9


def test_a_contour_has_bridges_to_its_eight_nearest_neighbours_and_no_others() -> None:
    """Twelve squares around a ring: each sees all others, and of these the four next on either side are taken."""
    places = [(100 + 60 * math.cos(k * math.pi / 6), 100 + 60 * math.sin(k * math.pi / 6)) for k in range(12)]
    sheet = sheet_of(*((square(x - 2, y - 2, 4), 0, -1, k + 1) for k, (x, y) in enumerate(places)))
    contours, scrap = ready(sheet)
    _, found = bridges(sheet, 150.0)
    outlines = [shapely.Polygon(contour.source.path.flattened(0.01)) for contour in contours]
    wanted = set()
    for k, outline in enumerate(outlines):
        nearest = sorted((j for j in range(12) if j != k), key=lambda j: outline.distance(outlines[j]))
        wanted |= {(k, j) for j in nearest[:8]} | {(j, k) for j in nearest[:8]}
    assert (
        pairs(found)
        == wanted
        == {(k, j) for k in range(12) for j in range(12) if (k - j) % 12 in (1, 2, 3, 4, 8, 9, 10, 11)}
    )
    # Across the ring there would be room.
    (x0, y0), (x1, y1) = places[0], places[6]
    assert bridge_fits(contours, (0, 6), ((x0 - 2 - HALF, y0), (x1 + 2 + HALF, y1)), scrap)


def along_a_slat(rows: int) -> Sheet:
    """Return a slat with twenty squares along it, in this number of rows."""
    boxes = [(square(30 + 30 * i, 30 + 30 * j, 20), 0, -1, 2 + i + 20 * j) for j in range(rows) for i in range(20)]
    return sheet_of((rectangle(30, 12, 590, 10), 0, -1, 1), *boxes)


@pytest.mark.parametrize(("rows", "most"), [(1, 16), pytest.param(12, 12, marks=pytest.mark.slow)])
def test_a_contour_has_at_most_sixteen_places_and_fewer_among_many(rows: int, most: int) -> None:
    """The maximum is three thousand places in all: twelve for each of 241 contours."""
    places = bridges(along_a_slat(rows), 12.0)[1].contour
    assert max(np.bincount(places)) == np.bincount(places)[0] == most
    assert len(places) <= 3000


def test_a_bridge_has_left_a_kerf_after_three_kerfs_and_does_not_come_back() -> None:
    kerf_line = shapely.LineString([(0, 0), (100, 0)])
    far = LEAVES_WITHIN * KERF
    slant = math.asin(1.0 / LEAVES_WITHIN)
    lines = [
        [(50, 0), (50, 20)],
        [(50, 0), (50, 0.9 * KERF)],
        [(50, 0), (50 + 20 * math.cos(1.02 * slant), 20 * math.sin(1.02 * slant))],
        [(50, 0), (50 + 20 * math.cos(0.95 * slant), 20 * math.sin(0.95 * slant))],
        [(50, 0), (50, -far)],
    ]
    found = leaves_kerf_at_once(np.array(lines, dtype=float), kerf_line, KERF)
    assert found.tolist() == [True, False, True, False, True]
    hook = shapely.LineString([(0, 0), (100, 0), (100, 10), (0, 10)])
    assert leaves_kerf_at_once(np.array([[(50.0, 0.0), (50.0, 10.0 - 2 * KERF)]]), hook, KERF).tolist() == [True]
    assert leaves_kerf_at_once(np.array([[(50.0, 0.0), (50.0, 10.0)]]), hook, KERF).tolist() == [False]


def test_two_contours_join_where_there_is_room_between_the_ends_given() -> None:
    contours, scrap = ready(two_squares(20.0))
    right, left = 70.0 + HALF, 90.0 - HALF
    assert bridge_fits(contours, (0, 1), ((right, 45.0), (left, 45.0)), scrap)
    assert not bridge_fits(contours, (0, 0), ((right, 45.0), (left, 45.0)), scrap)
    # Through the first square.
    assert not bridge_fits(contours, (0, 1), ((20.0 - HALF, 45.0), (left, 45.0)), scrap)
    # Along its edge the bridge does not leave the kerf.
    assert not bridge_fits(contours, (0, 1), ((right, 22.0), (right + 0.5, 68.0)), scrap)


def test_a_bridge_leads_from_a_part_to_the_hole_around_it_but_not_back_and_not_across_the_part() -> None:
    """The part of 40 mm lies in a hole of radius 60 about (100, 100); around that is another part."""
    contours, scrap = ready(part_in_hole())
    inner = next(k for k, c in enumerate(contours) if c.source.part == 2 and not c.hole)
    around = next(k for k, c in enumerate(contours) if c.source.part == 1 and c.hole)
    outer = next(k for k, c in enumerate(contours) if c.source.part == 1 and not c.hole)
    edge, wall = (120.0 + HALF, 100.0), (160.0 - HALF, 100.0)
    assert bridge_fits(contours, (inner, around), (edge, wall), scrap)
    assert not bridge_fits(contours, (around, inner), (wall, edge), scrap)
    assert not bridge_fits(contours, (inner, outer), (edge, (180.0 + HALF, 100.0)), scrap)


def test_with_a_joint_a_contour_is_left_before_it_closes_whichever_way_it_is_cut() -> None:
    contours, _ = ready(two_squares(), micro_joints=1, joint_width=0.4)
    joint = abs(exit_position(contours[0], 50.0, False) - 50.0)
    assert joint >= 0.4
    assert exit_position(contours[0], 50.0, False) == 50.0 - joint
    assert exit_position(contours[0], 50.0, True) == 50.0 + joint
    plain, _ = ready(two_squares())
    assert exit_position(plain[0], 50.0, True) == 50.0
