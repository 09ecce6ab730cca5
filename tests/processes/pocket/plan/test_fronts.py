"""Engagement in ground cleared as discs, compared with shapely, which does not use the formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.processes.pocket.plan.adaptive import ClearedDiscs

TOOL = 5.0


def fronts(*discs: tuple[float, float, float], turn: int = 1) -> ClearedDiscs:
    made = ClearedDiscs(TOOL, turn, 1e-6, 1e-6)
    for disc in discs:
        made.add(*disc)
    return made


def cleared(discs: np.ndarray) -> shapely.Geometry:
    """Return the area visited by the tool's centre."""
    return shapely.union_all([shapely.Point(x, y).buffer(r, quad_segs=256) for x, y, r in discs])


def some(seed: int, n: int = 12) -> list[tuple[float, float, float]]:
    dice = np.random.default_rng(seed)
    return [(x, y, r) for x, y, r in np.column_stack([dice.uniform(-20, 20, (n, 2)), dice.uniform(2, 9, n)]).tolist()]


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("seed", range(10))
def test_the_arcs_of_a_circle_outside_of_all_discs_are_as_long_as_shapely_says(turn: int, seed: int) -> None:
    ground = fronts(*some(seed), turn=turn)
    arcs = ground.uncut_arcs(1.0, 2.0, 8.0)
    ring = shapely.Point(1.0, 2.0).buffer(8.0, quad_segs=512).exterior
    outside = ring.difference(cleared(ground.discs))
    assert 8.0 * sum(sweep for _, sweep in arcs) == pytest.approx(outside.length, abs=0.05)
    for start, sweep in arcs:
        for share in (0.02, 0.5, 0.98):
            angle = start + turn * share * sweep
            place = np.array([[1.0 + 8.0 * math.cos(angle), 2.0 + 8.0 * math.sin(angle)]])
            assert ground.distances_to_union(place)[0] > -1e-9


@pytest.mark.parametrize("seed", range(10))
def test_how_far_places_lie_outside_is_their_distance_to_what_is_cleared(seed: int) -> None:
    ground, dice = fronts(*some(seed, 300)[:290]), np.random.default_rng(seed)
    places = dice.uniform(-60, 60, (50, 2))
    whole = cleared(ground.discs)
    for place, gap in zip(places, ground.distances_to_union(places), strict=True):
        assert max(gap, 0.0) == pytest.approx(shapely.distance(whole, shapely.Point(place)), abs=0.01)


@pytest.mark.parametrize("seed", range(40))
def test_a_straight_way_is_clear_where_the_discs_together_cover_it(seed: int) -> None:
    ground, dice = fronts(*some(seed, 25)), np.random.default_rng(seed)
    whole = cleared(ground.discs)
    a, b = dice.uniform(-12, 12, (2, 2))
    line = shapely.LineString([a, b])
    met = [k for k, (x, y, r) in enumerate(ground.discs) if line.distance(shapely.Point(x, y)) < r]
    said = ground.contains_move(tuple(a), tuple(b), met)
    # Chords lie a hair inside of their circles.
    assert said <= whole.buffer(0.01).covers(line)
    assert said >= whole.buffer(-0.01).covers(line)


def test_discs_beyond_the_ends_of_a_way_do_not_matter() -> None:
    """From 0 to 10 one disc covers it; others are 20 mm after its end and before its start."""
    ground = fronts((5, 0, 6), (30, 0, 2), (-30, 0, 2))
    assert ground.contains_move((0.0, 0.0), (10.0, 0.0), [0, 1, 2])
    assert not ground.contains_move((0.0, 0.0), (12.0, 0.0), [0, 1, 2])
    assert not ground.contains_move((-2.0, 0.0), (10.0, 0.0), [0, 1, 2])


def test_a_way_of_no_length_is_clear() -> None:
    assert fronts((0, 0, 1)).contains_move((9.0, 9.0), (9.0, 9.0), [0])


def test_round_a_disc_larger_by_a_step_the_engagement_is_that_of_the_step_in_a_hollow() -> None:
    """Ground cleared to R + r, the centre on R + s: by the law of cosines the edge meets it at acos(c).

    c = ((R + s)² + r² − (R + r)²) / (2 (R + s) r), an angle from straight inwards; the rest of the edge, from there to
    straight outwards, is engaged.
    """
    radius, step = 20.0, 1.0
    out = radius + step
    c = (out * out + TOOL * TOOL - (radius + TOOL) ** 2) / (2 * out * TOOL)
    found = fronts((0, 0, radius)).engagement(0.0, 0.0, out, sure=True)
    assert found == pytest.approx(math.pi - math.acos(c), abs=0.01)


def test_where_all_is_cleared_nothing_is_engaged_and_in_solid_ground_half_of_the_tool_is() -> None:
    assert fronts((0, 0, 30)).engagement(3.0, 0.0, 10.0) == 0.0
    assert fronts((500, 0, 1)).engagement(0.0, 0.0, 10.0) == pytest.approx(math.pi)


@pytest.mark.parametrize("seed", range(15))
def test_the_engagement_is_the_share_of_the_leading_edge_in_uncleared_ground(seed: int) -> None:
    """Counted: of 3,600 places of the edge ahead those that lie in no cleared ground."""
    turn = 1 if seed % 2 else -1
    ground = fronts(*some(seed, 8), turn=turn)
    x, y, radius = 2.0, -1.0, 9.0
    worst = 0.0
    for start, sweep in ground.uncut_arcs(x, y, radius):
        for share in np.linspace(0.0, 1.0, 60):
            angle = start + turn * share * sweep
            px, py = x + radius * math.cos(angle), y + radius * math.sin(angle)
            edge = angle + turn * 0.5 * math.pi + np.linspace(-0.5, 0.5, 3600) * math.pi
            gaps = np.hypot(
                px + TOOL * np.cos(edge)[:, None] - ground.discs[:, 0],
                py + TOOL * np.sin(edge)[:, None] - ground.discs[:, 1],
            ) - (ground.discs[:, 2] + TOOL)
            worst = max(worst, math.pi * float((gaps.min(axis=1) > 0).mean()))
    assert ground.engagement(x, y, radius, sure=True) == pytest.approx(worst, abs=0.12)
    assert ground.engagement(x, y, radius, sure=True) >= worst - 0.02


def test_one_disc_holds_another_but_for_a_film_and_the_nearest_is_that_which_a_place_lies_deepest_in() -> None:
    ground = fronts((0, 0, 10), (30, 0, 5))
    assert (
        ground.contains_disc(3, 0, 7.0, 0.0)
        and not ground.contains_disc(3, 0, 7.1, 0.0)
        and ground.contains_disc(3, 0, 7.1, 0.2)
    )
    assert [ground.nearest(x, 0) for x in (0, 17, 18, 29)] == [0, 0, 1, 1]


def test_more_discs_than_were_foreseen_are_all_kept() -> None:
    ground = fronts(*[(float(k), 0.0, 1.0) for k in range(1000)])
    assert ground.discs[:, 0].tolist() == list(range(1000))
