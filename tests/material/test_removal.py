"""Removal of a path against hand calculations: covered corners, gouges, engagement, step-over, time."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline
from leafcut.material.engagement import engagement_along_path
from leafcut.material.removal import measure_removal
from leafcut.material.tool_steps import steps_along_path
from leafcut.model.pocket import Pocket, PocketMeasures, PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.clearing import measure_path

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
#: Plate-like pockets without nearby walls.
WIDE = Pocket(Polyline.of_points([(-200, -200), (200, -200), (200, 200), (-200, 200)], closed=True))


def path_of(*pieces: Polyline | list[tuple[float, float]]) -> PocketPath:
    """A path of pieces given as points or polylines."""
    lines = [p if isinstance(p, Polyline) else Polyline.of_points(p) for p in pieces]
    return PocketPath("test", tuple(PocketPiece(line) for line in lines))


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    """A rectangle, counter-clockwise."""
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def gap_of(*pieces: Polyline | list[tuple[float, float]]) -> float:
    """The step-over of a path in a wide pocket."""
    return gaps_of(*pieces)[0]


def gaps_of(*pieces: Polyline | list[tuple[float, float]]) -> tuple[float, float]:
    """The step-over and the widest core of a path in a wide pocket, mm."""
    m = measure_path(WIDE, path_of(*pieces), RULES)
    return m.max_step_over, m.max_core


def engaged(*pieces: Polyline | list[tuple[float, float]]) -> tuple[PocketMeasures, np.ndarray]:
    """The measures of a path in a wide pocket, and the engagement along its last piece, degrees."""
    path = path_of(*pieces)
    way = steps_along_path(path, RULES)
    return measure_path(WIDE, path, RULES), np.degrees(
        engagement_along_path(way, RULES).angle[way.piece == way.piece[-1]]
    )


def test_a_frame_round_a_rectangle_leaves_the_middle_that_it_does_not_reach_and_no_corner_that_can_be_reached() -> None:
    pocket = Pocket(box(0, 0, 60, 40))
    m = measure_path(pocket, path_of(box(5, 5, 55, 35)), RULES)
    assert m.gouge_mm2 == 0.0
    assert m.reachable_mm2 == pytest.approx(60 * 40 - (4 - math.pi) * 25, abs=0.5)
    assert m.uncovered_mm2 == pytest.approx(40 * 20, abs=0.2)
    assert m.feed_mm == pytest.approx(160.0) and m.retracts == 0
    assert m.floor_mm == pytest.approx(50 * 30 / 6, rel=1e-3)


def test_lines_without_a_wall_pass_leave_the_cusps_between_their_ends() -> None:
    pocket = Pocket(box(0, 0, 60, 22))
    m = measure_path(pocket, path_of([(5, 5), (55, 5)], [(55, 11), (5, 11)], [(5, 17), (55, 17)]), RULES)
    # Between two ends 6 apart: 6 wide, 5 deep, less two circular sectors' share under half the gap.
    under = 2.0 * (0.5 * 3.0 * 4.0 + 0.5 * 25.0 * math.asin(0.6))
    assert m.uncovered_mm2 == pytest.approx(4 * (30.0 - under), abs=0.1)
    assert (m.retracts, m.rapid_mm) == (2, pytest.approx(12.0))
    assert m.max_step_over == pytest.approx(6.0, abs=1e-6)


def test_a_film_thinner_than_the_tolerance_counts_neither_as_uncut_nor_as_gouged() -> None:
    pocket = Pocket(box(0, 0, 60, 10.0))
    for y, rules in ((5.0, RULES), (5.004, RULES)):
        m = measure_path(pocket, path_of([(5, y), (55, y)]), rules)
        assert (m.gouge_mm2, m.uncovered_mm2) == (0.0, 0.0)


def test_a_path_a_tenth_of_a_millimetre_beyond_its_distance_gouges_a_strip_of_that_depth() -> None:
    pocket = Pocket(box(0, 0, 60, 40))
    path = path_of([(10, 4.9), (50, 4.9)])
    m = measure_path(pocket, path, RULES)
    # At both ends the strip runs out in half a segment of a circle 0.1 high.
    half = math.acos(1.0 - 0.1 / 5.0)
    ends = 25.0 * (half - math.sin(half) * math.cos(half))
    assert m.gouge_mm2 == pytest.approx(40 * 0.1 + ends, rel=2e-3)


def test_an_island_and_a_path_outside_the_pocket_are_gouged_too() -> None:
    pocket = Pocket(box(0, 0, 60, 40), (Polyline.circle(30, 20, 3, clockwise=True),))
    m = measure_path(pocket, path_of([(10, 20), (50, 20)]), RULES)
    assert m.gouge_mm2 == pytest.approx(math.pi * 9, rel=1e-3)
    outside = measure_path(pocket, path_of([(100, 100), (110, 100)]), RULES)
    assert outside.gouge_mm2 == pytest.approx(100 + math.pi * 25, rel=1e-3)


def test_ground_that_no_disc_sweeps_is_uncut_and_a_slot_is_clean_after_one_line() -> None:
    """A ring 5 mm inside a box of 60 × 40 leaves 40 × 20 in its middle."""
    ring = measure_removal(Pocket(box(0, 0, 60, 40)), path_of(box(5, 5, 55, 35)), RULES)
    assert ring.gouges.is_empty and ring.uncovered.area == pytest.approx(800.0, rel=1e-3)
    slot = measure_removal(Pocket(box(0, 0, 60, 10)), path_of([(5, 5), (55, 5)]), RULES)
    assert slot.gouges.is_empty and slot.uncovered.is_empty


def test_a_slot_engages_half_of_the_edge_and_going_back_through_it_is_air() -> None:
    m, _ = engaged([(0, 0), (50, 0)])
    assert m.max_engagement == pytest.approx(math.pi) and m.mean_engagement == pytest.approx(math.pi)
    assert m.air_mm == 0.0
    m, back = engaged([(0, 0), (50, 0)], [(50, 0), (0, 0)])
    assert m.air_mm == pytest.approx(50.0) and back.max() == pytest.approx(0.0, abs=1e-3)
    assert m.mean_engagement == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("width", [0.5, 2.0, 6.0, 9.0])
def test_the_width_of_a_cut_is_what_the_tool_takes_off_sideways_and_its_diameter_in_a_slot(width: float) -> None:
    path = path_of([(0, 0), (60, 0)], [(10, width), (50, width)])
    way = steps_along_path(path, RULES)
    widths = engagement_along_path(way, RULES).width
    assert widths[way.piece == 0][1:] == pytest.approx(10.0, abs=1e-6)
    assert widths[way.piece == 1][2:] == pytest.approx(width, abs=0.03)
    m = measure_path(WIDE, path, RULES)
    # From 8 mm on, half way from the step-over to the full width, it is reported; the first line is a slot.
    assert m.max_width == pytest.approx(10.0, abs=1e-6)
    assert m.wide_mm == pytest.approx(100.0 if width > 8.0 else 60.0, abs=1.1)


@pytest.mark.parametrize("width", [0.5, 1.5, 2.0, 5.0, 6.0, 9.0])
def test_side_milling_engages_the_angle_whose_cosine_is_one_less_the_width_over_the_radius(width: float) -> None:
    _, angles = engaged([(0, 0), (60, 0)], [(10, width), (50, width)])
    expected = math.degrees(math.acos(1.0 - width / 5.0))
    assert angles[2:] == pytest.approx(np.full(len(angles) - 2, expected), abs=0.3)


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("outwards", [False, True])
def test_along_a_circle_the_engagement_is_that_of_two_circles(outwards: bool, clockwise: bool) -> None:
    first, second = (20.0, 22.0) if outwards else (22.0, 20.0)
    _, angles = engaged(Polyline.circle(0, 0, first), Polyline.circle(0, 0, second, clockwise=clockwise))
    # The cut reaches first ± 5; the engaged arc about (second, 0) lies beyond the edge of the cut, ahead of the tool.
    cut = first + 5.0 if outwards else first - 5.0
    cosine = (cut * cut - second * second - 25.0) / (2.0 * 5.0 * second)
    across = math.degrees(math.acos(cosine))
    expected = across if outwards else 180.0 - across
    assert np.median(angles) == pytest.approx(expected, abs=0.3)


def test_at_a_corner_of_a_slot_the_quarter_ahead_that_is_not_cut_yet_is_engaged() -> None:
    _, angles = engaged([(0, 0), (30, 0), (30, 30)])
    at_corner = int(np.argmin(angles))
    assert angles[at_corner] == pytest.approx(90.0, abs=0.1)


def test_films_that_one_pass_after_the_other_takes_off_do_not_add_up_to_a_cut() -> None:
    """Each pass takes off 0.006 mm, less than the tolerance: none cuts, however many there were. Judged by shapely."""
    lines = [[(0.0, 0.006 * k), (600.0, 0.006 * k)] for k in range(8)]
    path = path_of(*lines)
    way = steps_along_path(path, RULES)
    found = engagement_along_path(way, RULES)
    swept = [shapely.LineString(line).buffer(RULES.radius, quad_segs=64) for line in lines]
    for k in range(1, len(lines)):
        film = swept[k].difference(shapely.union_all(swept[:k])).area / 610.0  # the discs at both ends included
        assert film == pytest.approx(0.006, rel=1e-3)
        assert film < RULES.tolerance
        assert not found.angle[way.piece == k].any(), k
        assert not found.width[way.piece == k].any(), k


def test_parallel_lines_are_as_far_apart_as_they_are() -> None:
    assert gap_of(*([(0, y), (50, y)] for y in (0, 6, 12, 16))) == pytest.approx(6.0, abs=1e-6)
    assert gap_of([(0, 0), (50, 0)], [(0, 12), (50, 12)]) == pytest.approx(12.0, abs=1e-6)
    assert gap_of([(0, 0), (50, 0)]) == 0.0


def test_a_zigzag_that_is_linked_at_its_ends_has_the_pitch_of_its_lines() -> None:
    points = [(50.0 * ((k + 1) // 2 % 2), 6.0 * (k // 2)) for k in range(12)]
    assert gap_of(points) == pytest.approx(6.0, abs=1e-6)


def test_rings_are_as_far_apart_as_their_offset_also_at_corners_round_or_sharp() -> None:
    rings = [box(-k, -k, k, k) for k in (3.0, 9.0, 15.0, 21.0)]
    assert gap_of(*rings) == pytest.approx(6.0, abs=1e-6)
    star = shapely.Polygon([(0, 60), (-18, 18), (-60, 0), (-18, -18), (0, -60), (18, -18), (60, 0), (18, 18)])
    rings = [as_polyline(star.buffer(-k, join_style="mitre", mitre_limit=99).exterior.coords, True) for k in (0.0, 6.0)]
    assert gap_of(*rings) == pytest.approx(6.0, abs=0.01)
    # The arc of 4 mm about the corner (30, 30), and a sharp corner 2 inside of it: 6 apart everywhere.
    rounded = [as_polyline(shapely.box(-30, -30, 30, 30).buffer(k, 64).exterior.coords, True) for k in (4.0, -2.0)]
    assert gap_of(*rounded) == pytest.approx(6.0, abs=0.01)


def test_a_corner_that_is_rounded_without_coming_nearer_is_further_away() -> None:
    inner = as_polyline(shapely.box(-21, -21, 21, 21).buffer(3.0, 64).exterior.coords, True)
    # Both corners about one centre would be 6 apart at radii 3 and 9; the sharp outer one leaves more.
    assert 6.2 < gaps_of(box(-30, -30, 30, 30), inner)[1] < 6.0 * math.sqrt(2.0)


def test_the_sides_of_a_sharp_corner_are_no_neighbours_and_those_of_a_narrow_ring_are() -> None:
    # But for the length of a step: near the tip, where it is as long as the gap.
    assert gaps_of([(0, 0), (30, 15), (0, 30)])[1] < 1.5
    assert gaps_of(box(0, 0, 40, 9)) == pytest.approx((0.0, 9.0), abs=1e-6)


def test_circles_are_as_far_apart_as_their_radii_differ_and_the_innermost_as_wide_as_it_is() -> None:
    assert gap_of(*(Polyline.circle(0, 0, r) for r in (2.0, 8.0, 14.0))) == pytest.approx(6.0, abs=0.01)
    assert gaps_of(*(Polyline.circle(0, 0, r) for r in (4.5, 9.0))) == pytest.approx((4.5, 9.0), abs=0.02)


def test_a_spiral_has_its_pitch() -> None:
    turn = np.linspace(0.0, 10 * math.pi, 4000)
    spiral = np.column_stack([np.cos(turn), np.sin(turn)]) * (5.5 * turn / math.tau)[:, None]
    assert measure_path(WIDE, path_of(as_polyline(spiral)), RULES).max_step_over == pytest.approx(5.5, rel=0.01)


def test_one_pass_left_out_among_many_is_a_core_and_counts_where_it_would_have_been_a_full_step_over_from_both() -> (
    None
):
    lines = {pitch: [[(0.0, pitch * k), (50.0, pitch * k)] for k in range(10) if k != 6] for pitch in (5.0, 6.0)}
    assert gaps_of(*lines[5.0]) == pytest.approx((5.0, 10.0), abs=1e-6)
    assert gaps_of(*lines[6.0]) == pytest.approx((12.0, 12.0), abs=1e-6)


def test_lines_that_are_all_too_far_apart_have_the_step_over_that_they_have() -> None:
    assert gap_of(*([(0.0, 8.0 * k), (50.0, 8.0 * k)] for k in range(5))) == pytest.approx(8.0, abs=1e-6)


def test_passes_on_both_sides_of_an_island_are_no_neighbours() -> None:
    pocket = Pocket(box(-50, -30, 50, 30), (box(-20, -0.5, 20, 0.5).reversed(),))
    m = measure_path(pocket, path_of([(-10, 5.6), (10, 5.6)], [(-10, -5.6), (10, -5.6)]), RULES)
    assert m.max_step_over == 0.0 and m.gouge_mm2 == 0.0


def test_an_empty_path_leaves_everything_and_a_plunge_clears_a_disc() -> None:
    pocket = Pocket(box(0, 0, 60, 40))
    none = measure_path(pocket, PocketPath("test", ()), RULES)
    assert none.uncovered_mm2 == pytest.approx(none.reachable_mm2, rel=1e-4)
    assert (none.max_engagement, none.feed_mm, none.gouge_mm2) == (0.0, 0.0, 0.0)
    plunge = measure_removal(pocket, path_of([(30, 20)]), RULES)
    assert plunge.swept.area == pytest.approx(math.pi * 25, rel=1e-3)
