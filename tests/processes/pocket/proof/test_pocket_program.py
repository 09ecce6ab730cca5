"""The proof of a pocketing program finds gouges, excessive depth and rapids in material; by hand on a square."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.processes.pocket.proof.pocket import (
    check_pockets,
    depth_differences,
    fast_cut_differences,
    gouge_differences,
    simulate_levels,
    step_over_differences,
)

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
WALL = Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True)
ISLAND = Polyline.circle(20, 15, 2, clockwise=True)
POCKETS = (Pocket(WALL, (ISLAND,), name="1"),)


def laid(*moves: tuple[float, float, float], start: tuple[float, float] = (5.0, 5.0)) -> Toolpath:
    """Down at `start` to 2 mm, along feeds to places, up again."""
    builder = ToolpathBuilder()
    builder.rapid(z=10.0)
    builder.rapid(*start)
    builder.rapid(z=2.0)
    builder.feed(z=-2.0, feed=5.0)
    for place in moves:
        builder.feed(*place, feed=10.0)
    builder.rapid(z=10.0)
    builder.end()
    return builder.build()


def found(path: Toolpath) -> list[str]:
    return [d.what for d in check_pockets(path, POCKETS, RULES, depths=[2.0], retract=2.0)]


RING = ((35.0, 5.0, -2.0), (35.0, 25.0, -2.0), (5.0, 25.0, -2.0), (5.0, 5.0, -2.0))


@pytest.mark.hazard
def test_a_path_that_keeps_its_distance_is_free_of_faults() -> None:
    assert found(laid(*RING)) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "move, what",
    [
        ((4.98, 25.0, -2.0), "gouge"),  # 0.02 mm into the left wall
        ((35.0, 25.0, -2.0), "gouge"),  # straight over the island
        ((5.0, 25.0, -2.01), "too deep"),
        ((5.0, 31.0, 5.0), "gouge"),  # slanting out of the pocket through its wall
    ],
)
def test_a_move_into_a_wall_an_island_or_the_floor_is_found(move: tuple[float, float, float], what: str) -> None:
    assert what in found(laid(move))


@pytest.mark.hazard
def test_a_cut_from_or_to_a_place_that_is_not_stated_is_found() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.feed(z=-2.0, feed=5.0)  # X and Y are unknown
    builder.feed(5.0, 5.0, feed=10.0)
    builder.feed(5.0, 25.0, feed=10.0)
    assert found(builder.build()) == ["gouge", "gouge"]


def test_less_than_the_tolerance_is_no_gouge() -> None:
    assert found(laid((4.995, 25.0, -2.0))) == []


def test_outside_every_pocket_everything_is_a_gouge() -> None:
    assert found(laid((60.0, 5.0, -2.0), start=(50.0, 5.0))) == ["gouge", "gouge"]


def test_an_arc_is_followed_and_not_its_chord() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(5.0, 10.0)
    builder.feed(z=-2.0, feed=5.0)
    # From (5, 10) to (5, 20) through x = 0 on the left: a gouge that the chord does not show.
    builder.arc(True, (5.0, 20.0, -2.0), Arc((5.0, 15.0, -2.0)), feed=10.0)
    builder.end()
    assert found(builder.build()) == ["gouge"]


def test_a_rapid_below_the_r_plane_is_found_but_the_rise_is_not() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(5.0, 5.0)
    builder.rapid(z=1.0)
    builder.feed(z=-2.0, feed=5.0)
    builder.rapid(35.0, 5.0)
    builder.rapid(z=2.0)
    builder.end()
    assert found(builder.build()) == ["rapid in material"] * 2


@pytest.mark.hazard
@pytest.mark.parametrize(
    "at, z, free",
    [
        ((20.0, 5.0), -1.5, True),  # the tool's centre has been here
        ((20.0, 5.0), -1.7, False),  # 0.3 mm over the floor
        ((7.5, 7.5), -1.5, True),  # inside the corner: near both paths, and the area behind is cleared
        ((12.5, 12.5), -1.5, False),  # its front stands over what is uncut
        ((20.0, 6.0), -1.5, False),  # a millimetre of the tool over what is uncut
        ((20.0, 5.009), -1.5, True),  # a film thinner than the tolerance is no material
    ],
)
def test_a_rapid_goes_down_below_the_r_plane_only_where_all_of_the_tool_is_over_cleared_ground(
    at: tuple[float, float], z: float, free: bool
) -> None:
    moves = [(5.0, 5.0, -2.0), *RING]
    if at == (7.5, 7.5):
        moves += [(10.0, 5.0, -2.0), (10.0, 10.0, -2.0), (5.0, 10.0, -2.0), (5.0, 5.0, -2.0)]
    for order in (1, -1):
        builder = ToolpathBuilder()
        builder.rapid(z=2.0)
        steps = [(moves, None), ([], (at, z))][::order]
        for way, down in steps:
            if down is not None:
                builder.rapid(z=2.0)
                builder.rapid(*at)
                builder.rapid(z=z)
                builder.rapid(z=2.0)
                continue
            builder.rapid(*way[0][:2])
            builder.feed(z=-2.0, feed=5.0)
            for step in way:
                builder.feed(*step, feed=10.0)
        builder.rapid(z=2.0)
        builder.end()
        # Before anything is cut, no place is cleared.
        assert found(builder.build()) == ([] if free and order == 1 else ["rapid in material"])


@pytest.mark.hazard
def test_what_a_level_leaves_is_found_by_simulation_of_the_program() -> None:
    levels = simulate_levels(laid(*RING), POCKETS, RULES, [(-2.0,)])
    [level] = levels
    assert (level.z, level.number) == (-2.0, 0)
    # The tool's centre can go round the island on all of 30 × 20 mm but a disc of 7 mm; the ring's inner edge leaves
    # 20 × 10 mm, of which the island takes π·2².
    assert level.removal.uncovered.area == pytest.approx(20 * 10 - math.pi * 4, rel=1e-3)
    assert gouge_differences(levels, POCKETS) == []


def test_where_the_tool_only_comes_down_to_a_level_its_disc_is_cleared() -> None:
    [level] = simulate_levels(laid(), POCKETS, RULES, [(-2.0,)])
    assert level.removal.swept.area == pytest.approx(math.pi * 25.0, rel=1e-3)


def test_the_moves_of_another_level_do_not_count_for_a_level() -> None:
    [level] = simulate_levels(laid(*RING), POCKETS, RULES, [(-1.0,)])
    assert level.removal.swept.is_empty


def test_a_gouge_is_found_by_simulation_too() -> None:
    levels = simulate_levels(laid((4.0, 25.0, -2.0)), POCKETS, RULES, [(-2.0,)])
    assert [d.what for d in gouge_differences(levels, POCKETS)] == ["gouge"]
    assert levels[0].removal.gouges.area > 1.0


def test_levels_that_are_alike_are_simulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(5.0, 5.0)
    for z in (-1.0, -2.0):
        builder.feed(z=z, feed=5.0)
        for x, y, _ in RING:
            builder.feed(x, y, feed=10.0)
    builder.end()
    from leafcut.processes.pocket.proof import pocket as room

    calls = []
    real = room.measure_removal
    monkeypatch.setattr(room, "measure_removal", lambda *a: calls.append(1) or real(*a))
    rows = simulate_levels(builder.build(), POCKETS, RULES, [(-1.0, -2.0)])
    assert len(rows) == 2 and len(calls) == 1
    assert np.isclose(rows[0].removal.swept.area, rows[1].removal.swept.area)


@pytest.mark.hazard
@pytest.mark.parametrize("apart, said", [(5.9, []), (6.0, []), (6.1, ["step-over"])])
def test_lines_further_apart_than_the_stated_step_over_are_found_in_the_text(apart: float, said: list[str]) -> None:
    """Three lines over a field without walls nearby, to and fro."""
    field = (Pocket(Polyline.of_points([(-90, -90), (90, -90), (90, 90), (-90, 90)], closed=True), name="1"),)
    rows = [(x, k * apart, -2.0) for k, ends in enumerate(((0, 50), (50, 0), (0, 50))) for x in ends]
    levels = simulate_levels(laid(*rows, start=(0.0, 0.0)), field, RULES, [(-2.0,)])
    assert levels[0].step_over == pytest.approx(apart, abs=1e-6)
    assert [d.what for d in step_over_differences(levels, field, RULES)] == said


def test_what_a_helix_clears_within_its_circle_is_no_gap_between_passes() -> None:
    """A circle of 4.5 mm radius gone down on leaves no core; twice a step-over of 2 mm would be missing inside it."""
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(24.5, 15.0)
    builder.feed(z=0.0, feed=5.0)
    for z in (-1.0, -2.0, -2.0):
        builder.arc(False, (24.5, 15.0, z), Arc((20.0, 15.0, builder.position[2])), feed=5.0)
    builder.end()
    rules, pocket = replace(RULES, step_over=2.0), (Pocket(WALL, name="1"),)
    assert simulate_levels(builder.build(), pocket, rules, [(-2.0,)])[0].step_over == 0.0


def test_a_finishing_pass_half_way_down_lies_beside_the_passes_of_the_level_below_it() -> None:
    """The ring is finished at 1 mm, in its own steps; roughing is 5 mm inside it, at 2 mm: 5 apart."""
    rough = ((10.0, 10.0), (30.0, 10.0), (30.0, 20.0), (10.0, 20.0), (10.0, 10.0))
    path = levels_at(-2.0, -1.0, ways={-2.0: rough})
    levels = simulate_levels(path, (Pocket(WALL, name="1"),), RULES, [(-2.0,)], [(-1.0,)])
    assert [(level.z, level.step_over) for level in levels] == [(-2.0, pytest.approx(0.0)), (-1.0, pytest.approx(5.0))]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "back, said",
    [
        ((5.0, 5.0, -2.0), []),  # along the ring that is cleared
        ((20.0, 7.0, -2.0), ["feed"]),  # 2 mm off it: a strip is left there
        ((35.0, 5.0, -3.0), ["feed"]),  # down
    ],
)
def test_a_move_faster_than_the_mill_cuts_is_found_where_it_cuts_anything(
    back: tuple[float, float, float], said: list[str]
) -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    builder.rapid(5.0, 5.0)
    builder.feed(z=-2.0, feed=5.0)
    builder.feed(35.0, 5.0, feed=10.0)
    builder.feed(*back, feed=40.0)
    builder.end()
    assert [d.what for d in fast_cut_differences(builder.build(), RULES, 10.0)] == said


def levels_at(*heights: float, ways: dict[float, tuple[tuple[float, float], ...]] | None = None) -> Toolpath:
    """The ring at every height, or another way at some."""
    builder = ToolpathBuilder()
    builder.rapid(z=2.0)
    for z in heights:
        first, *rest = (ways or {}).get(z, ((5.0, 5.0), *((x, y) for x, y, _ in RING)))
        builder.rapid(*first)
        builder.feed(z=z, feed=5.0)
        for x, y in rest:
            builder.feed(x, y, feed=10.0)
        builder.rapid(z=2.0)
    builder.end()
    return builder.build()


ELSEWHERE = ((10.0, 7.5), (30.0, 7.5))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "heights, ways, lines",
    [
        ((-2.0, -4.0, -6.0), {}, 0),
        ((-2.0, -6.0), {}, 1),  # two levels at once
        ((-4.0, -2.0), {}, 1),  # the lower one first
        ((-2.0, -4.0), {-4.0: ELSEWHERE}, 1),  # 2.5 mm beside the open area
        ((-2.0, -4.0), {-4.0: ((10.0, 6.5), (30.0, 6.5))}, 0),  # a strip of 1.5 mm: less than a fifth of the tool
        ((-2.0, -4.0), {-2.0: ((5.0, 5.0), (35.0, 5.0)), -4.0: ((30.0, 5.0), (10.0, 5.0))}, 0),  # inside what is open
    ],
)
def test_no_more_than_a_level_is_cut_at_once_but_for_a_strip_of_a_fifth_of_the_tool(
    heights: tuple[float, ...], ways: dict[float, tuple[tuple[float, float], ...]], lines: int
) -> None:
    assert [d.what for d in depth_differences(levels_at(*heights, ways=ways), RULES, 2.0)] == ["too deep"] * lines
