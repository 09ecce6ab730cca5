"""Closed paths: no lift between levels, by LinuxCNC and shapely; lengths by hand, refusals, a failing proof."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import pytest
import shapely

from leafcut import api
from leafcut.errors import OptionError, PlanError
from leafcut.gcode.dialects import dialect
from leafcut.gcode.interpreter import interpret
from leafcut.geometry.polyline import Polyline
from leafcut.model.outcome import Outcome
from leafcut.model.pocket import Pocket, PocketPath, PocketPiece, PocketRules
from leafcut.model.toolpath import Kind, Toolpath, ToolpathBuilder
from leafcut.processes.pocket.plan.closed import closed
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.proof.pocket import closed_differences
from rs274_moves import moves_of_rs274, run_rs274

#: 44 × 36 mm with an island.
ISLAND = shapely.box(7, 7, 37, 29).buffer(7, quad_segs=64) - shapely.Point(22, 18).buffer(4, quad_segs=64)
#: 60 × 46 mm with an island.
LARGE = shapely.box(7, 7, 53, 39).buffer(7, quad_segs=64) - shapely.Point(30, 23).buffer(5, quad_segs=64)
PLAIN = shapely.box(0, 0, 40, 28)
LEVELS = (-2.0, -4.0, -6.0)
COMMON: dict[str, Any] = {
    "process": "pocket", "tool_diameter": 10, "depth": 6, "step_down": 2, "preset": "fast", "threads": 1, "date": False,
    "closed_path": True, "units": "mm",
}  # fmt: skip


def milled(folder: Path, *shapes: Any, **options: Any) -> Outcome:
    """Return the program of pockets."""
    file = folder / "pocket.wkt"
    file.write_text("\n".join(shape.wkt for shape in shapes))
    return api.optimize(file, **{**COMMON, **options})


def flat_moves(path: Toolpath) -> list[tuple[int, float, tuple[float, float], tuple[float, float]]]:
    """Return the level feed moves below the surface: row, height, start, end."""
    return [
        (row, float(end[2]), (float(begin[0]), float(begin[1])), (float(end[0]), float(end[1])))
        for row, (kind, begin, end) in enumerate(zip(path.kind.tolist(), path.before, path.end, strict=True))
        if kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW) and end[2] < -1e-6 and abs(begin[2] - end[2]) < 1e-6
    ]


def check_closed(path: Toolpath, regions: int) -> None:
    """Check a program that was read back: one descent and retract per region, each level returns to its start."""
    moves = flat_moves(path)
    stays = itertools.groupby(moves, lambda move: int((path.kind[: move[0]] == Kind.RAPID).sum()))
    count = 0
    for _, stay in stays:
        count += 1
        levels = [list(level) for _, level in itertools.groupby(stay, lambda move: move[1])]
        assert [level[0][1] for level in levels] == list(LEVELS)
        places = {place for level in levels for place in (level[0][2], level[-1][3])}
        assert max(math.dist(a, b) for a, b in itertools.product(places, places)) < 1e-3
    assert count == regions


@pytest.mark.parametrize(
    "strategy, entry", [("connected", "ramp"), ("connected", "plunge"), ("firefly", "helix"), ("ants", "predrilled")]
)
def test_no_rapid_lies_between_the_levels(tmp_path: Path, strategy: str, entry: str) -> None:
    found = milled(tmp_path, ISLAND, strategy=strategy, entry=entry, iterations=3)
    check_closed(interpret(found.text, dialect("linuxcnc")), 1)
    assert found.verified


@pytest.mark.parametrize("shape", [PLAIN, pytest.param(LARGE, marks=pytest.mark.slow)], ids=["plain", "island"])
@pytest.mark.parametrize(
    "strategy, entry", [("connected", "ramp"), ("connected", "plunge"), ("firefly", "helix"), ("ants", "predrilled")]
)
def test_a_closed_path_needs_fewer_rapids_than_a_path_that_is_lifted(
    tmp_path: Path, strategy: str, entry: str, shape: Any
) -> None:
    rapids = {}
    for closes in (True, False):
        found = milled(tmp_path, shape, strategy=strategy, entry=entry, iterations=3, closed_path=closes)
        rapids[closes] = int((interpret(found.text, dialect("linuxcnc")).kind == Kind.RAPID).sum())
    assert rapids[True] < rapids[False]


def test_linuxcnc_sees_no_lift_between_the_levels(rs274: str, tmp_path: Path) -> None:
    """From the first feed below the surface to the last there is no rapid, and each height ends where it began."""
    status, said = run_rs274(rs274, milled(tmp_path, ISLAND, strategy="firefly").text, tmp_path)
    assert status == 0, said[-500:]
    moves = [move for move in moves_of_rs274(said) if move[0] in ("rapid", "feed", "arc")]
    ends = [move[1:4] if move[0] != "arc" else move[2:5] for move in moves]
    below = [k for k, (move, end) in enumerate(zip(moves, ends, strict=True)) if move[0] != "rapid" and end[2] < -1e-6]
    assert {moves[k][0] for k in range(below[0], below[-1] + 1)} <= {"feed", "arc"}
    for z in LEVELS:
        at = [k for k in range(1, len(ends)) if abs(ends[k][2] - z) < 1e-4 and abs(ends[k - 1][2] - z) < 1e-4]
        assert at == list(range(at[0], at[-1] + 1))
        assert math.dist(ends[at[0] - 1][:2], ends[at[-1]][:2]) < 2e-3


def test_a_closed_grid_of_six_by_four_points_is_as_long_as_its_points_are_many(tmp_path: Path) -> None:
    """Tool centres have 30 × 18 mm: 6 × 4 points 6 mm apart, a closed tour of 24 steps."""
    found = milled(tmp_path, PLAIN, strategy="firefly", finishing_pass=False, uncovered_tolerance=50)
    assert found.detail.plans[0].result.path.feed_mm == pytest.approx(24 * 6.0, abs=0.05)
    check_closed(interpret(found.text, dialect("linuxcnc")), 1)


def test_a_return_path_leads_around_an_island_from_another_distant_island() -> None:
    """By hand: 50 mm to a corner of the island, 20 mm along it, 50 mm to the start."""
    room = shapely.box(0, 0, 150, 120) - shapely.box(40, 30, 60, 90) - shapely.box(100, 55, 110, 65)
    path = PocketPath("hand", (PocketPiece(Polyline.of_points([(0.0, 60.0), (0.0, 0.0), (100.0, 60.0)])),))
    *_, back = closed(path, CentreRegion(room, PocketRules(tool_diameter=10.0, step_over=6.0))).pieces
    assert (back.path.start, back.path.end) == ((100.0, 60.0), (0.0, 60.0))
    assert room.buffer(1e-3).covers(shapely.LineString(back.path.flattened()))
    assert 120.0 - 1e-3 < back.path.length < 1.1 * 120.0


@pytest.mark.slow
def test_a_return_path_leads_from_an_island_to_a_distant_wall(tmp_path: Path) -> None:
    """Islands and walls are too far apart for a straight move of a few step-overs."""
    islands = [shapely.Point(x, 75).buffer(8) for x in (60, 140, 220)]
    found = milled(tmp_path, shapely.box(0, 0, 280, 150) - shapely.union_all(islands), strategy="firefly", iterations=3)
    check_closed(interpret(found.text, dialect("linuxcnc")), 1)


def test_every_level_clears_the_pocket_as_shapely_sees_it(tmp_path: Path) -> None:
    found = milled(tmp_path, PLAIN, strategy="connected")
    path, swept = interpret(found.text, dialect("linuxcnc")), []
    for z in LEVELS:
        lines = [shapely.LineString([a, b]).buffer(5.0) for _, height, a, b in flat_moves(path) if height == z]
        swept.append(shapely.union_all(lines))
    assert all(one.difference(PLAIN.buffer(0.011)).area < 1e-6 for one in swept)
    assert all(PLAIN.buffer(-5).buffer(5).difference(one).area < 0.02 * PLAIN.area for one in swept)


def test_a_closed_path_returns_along_a_narrow_slot_and_two_pockets_need_one_lift(
    tmp_path: Path,
) -> None:
    found = milled(tmp_path, shapely.box(0, 0, 50, 10), shapely.box(0, 20, 40, 48), strategy="connected")
    check_closed(interpret(found.text, dialect("linuxcnc")), 2)
    slot = found.detail.plans[0].result.path
    assert slot.feed_mm == pytest.approx(2 * 40.0, abs=0.05)


def test_paths_that_cannot_be_closed_are_refused_and_best_chooses_a_closed_path(tmp_path: Path) -> None:
    with pytest.raises(
        PlanError, match="its path is lifted 1 times on each level; --closed-path needs one that is not"
    ):
        milled(tmp_path, ISLAND, strategy="zigzag")
    with pytest.raises(OptionError, match="--closed-path: not used with --stock"):
        milled(tmp_path, ISLAND, stock=0.3)
    found = milled(tmp_path, ISLAND, strategy="best", iterations=1)
    plan = found.detail.plans[0]
    assert plan.result.strategy in ("connected", "firefly", "ants")
    assert "lifted" in next(r.refused for r in plan.results if r.strategy == "zigzag")
    check_closed(interpret(found.text, dialect("linuxcnc")), 1)


def two_levels(second: list[tuple[float, float]], lifts: bool = False) -> Toolpath:
    """Return a program of a square at Z-1, then at Z-2 along some places."""
    builder = ToolpathBuilder()
    builder.rapid(z=5.0)
    builder.rapid(0.0, 0.0)
    for z, places in ((-1.0, [(9, 0), (9, 9), (0, 9), (0, 0)]), (-2.0, second)):
        if lifts and z < -1.0:
            builder.rapid(z=5.0)
        builder.feed(z=z, feed=10.0)
        for x, y in places:
            builder.feed(float(x), float(y), feed=10.0)
    builder.rapid(z=5.0)
    return builder.build()


@pytest.mark.parametrize(
    "second, lifts, levels, what",
    [
        ([(9, 0), (9, 9), (0, 9), (0, 0)], False, (-1.0, -2.0), []),
        ([(9, 0), (9, 9), (0, 9)], False, (-1.0, -2.0), ["not closed"]),
        ([(9, 0), (9, 9), (0, 9), (0, 0)], True, (-1.0, -2.0), ["lifted", "lifted"]),
        ([(9, 0), (9, 9), (0, 9), (0, 0)], False, (-1.0, -2.0, -3.0), ["lifted"]),
    ],
)
def test_the_proof_finds_a_lift_and_a_level_that_ends_elsewhere(
    second: list, lifts: bool, levels: tuple[float, ...], what: list[str]
) -> None:
    rules = PocketRules(tool_diameter=5.0, step_over=3.0)
    wall = [Pocket(Polyline.of_points([(-5, -5), (15, -5), (15, 15), (-5, 15)], closed=True))]
    assert [d.what for d in closed_differences(two_levels(second, lifts), wall, rules, [levels])] == what
