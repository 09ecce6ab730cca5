"""Pockets and outlines of solids: millable ones with their depths and shapes; others are reported."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

pytest.importorskip("OCP")

from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf

from leafcut import api
from leafcut.errors import LeafcutError, OptionError, PlanError, ReadError
from leafcut.geometry.polyline import Polyline
from leafcut.model.issue import LIMITS, Severity
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.model.toolpath import Kind, ToolpathBuilder
from leafcut.options import ReadOptions
from leafcut.processes.contours import check_thickness
from leafcut.processes.pocket.plan.rules import select_pockets
from leafcut.processes.pocket.proof.pocket import check_pockets
from leafcut.read import read_contours, read_pockets
from made_solids import DOWN, UP, box, cone, cut, cylinder, fused, rounded, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

FAST: dict[str, Any] = {
    "preset": "fast", "threads": 1, "machine": "linuxcnc-mill", "strategy": "contour", "z_zero": "drawn",
}  # fmt: skip
CORNER = 4.0 - math.pi


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a plate from Z0 to Z20: a pocket with an island, one in two steps, holes, a window."""
    solid = cut(
        box(0, 0, 0, 120, 80, 20),
        cut(rounded(10, 10, 14, 60, 50, 20, 5), rounded(25, 22, 14, 40, 34, 20, 4)),
        rounded(70, 10, 12, 110, 40, 20, 5),
        rounded(80, 15, 8, 100, 35, 12, 5),
        cylinder((15, 15, 14), DOWN, 2, 14),
        cylinder((20, 65, 20), DOWN, 2.5, 8),
        rounded(40, 60, 0, 70, 75, 20, 3),
    )
    return saved(tmp_path_factory.mktemp("block") / "block.step", solid)


@pytest.fixture(scope="module")
def pockets(block: Path) -> Part:
    return read_pockets(block, ReadOptions(z_zero="drawn"))


def test_pockets_have_the_depths_and_areas_that_they_were_made_with(pockets: Part) -> None:
    """A hole in a floor is not an island; the step below another pocket also starts at the top."""
    found = [(one.depth, one.top, one.area, [island.area for island in one.islands]) for one in pockets.pockets]
    island = 15 * 12 - CORNER * 16
    assert found == [
        (6.0, 20.0, pytest.approx(50 * 40 - CORNER * 25 - island), [pytest.approx(-island)]),
        (8.0, 20.0, pytest.approx(40 * 30 - CORNER * 25), []),
        (8.0, 20.0, pytest.approx(math.pi * 2.5**2), []),
        (12.0, 20.0, pytest.approx(20 * 20 - CORNER * 25), []),
    ]
    assert all(one.outline.bulges.any() and one.outline.n_segments <= 8 for one in pockets.pockets)


def test_an_opening_without_a_floor_is_told(pockets: Part) -> None:
    assert [str(issue) for issue in pockets.issues] == [
        "L219 the program does not mill 1 opening through the part, because a pocket has a floor (at (55, 67.5))"
    ]
    assert pockets.issues[0].severity == "missing"


@pytest.mark.hazard
def test_round_openings_wider_than_the_tool_are_missing_work_and_narrower_ones_are_drilled(tmp_path: Path) -> None:
    """One opening ends above the lowest point of the solid, because a foot is next to it."""
    solid = cut(
        box(0, 0, 0, 120, 80, 20),
        rounded(10, 10, 14, 60, 50, 20, 5),
        box(70, -1, -1, 121, 81, 5),
        cylinder((90, 40, 0), UP, 15, 20),
        cylinder((20, 65, 0), UP, 2.5, 20),
    )
    part = read_pockets(saved(tmp_path / "windows.step", solid))
    milled, issues = select_pockets(part, None, 8.0)
    assert [one.depth for one in milled.pockets] == [6.0]
    wide, narrow = issues
    assert wide.missing is not None
    assert (wide.missing.what, wide.missing.count, wide.missing.where) == (
        "opening",
        1,
        (pytest.approx((90.0, 40.0), abs=0.05),),
    )
    assert (
        str(narrow) == "L219 the program does not mill 1 round opening no wider than the tool; drill such holes instead"
    )
    assert narrow.severity == "note"


@pytest.mark.slow
def test_pockets_that_no_straight_mill_makes_are_told_by_reason(tmp_path: Path) -> None:
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 1, 0)), math.radians(8))
    leaning = BRepBuilderAPI_Transform(box(-10, 10, -8, 10, 30, 20), turn, True).Shape()
    solid = cut(
        box(-20, 0, -20, 180, 80, 0),
        fused(cut(leaning, box(-90, 0, -90, 90, 90, -8)), box(-9, 10, -8, 9, 30, -7)),
        cone((40, 20, -6), 8, 12, 6),
        box(60, 30, -5, 80, 80, 0),
        cylinder((120, 10, 0), (0, 1, 0), 8, 30),
        box(140, 10, -10, 170, 40, 0),
    )
    solid = fused(solid, box(135, 8, 0, 175, 42, 4))
    with pytest.raises(ReadError) as refused:
        read_pockets(saved(tmp_path / "odd.step", solid))
    told = str(refused.value)
    assert "\n" not in told
    assert "no closed pocket with a level floor" in told
    # The cone; and the leaning slot, one wall of which hangs over, and what is under the roof.
    assert "1 pocket with sloping walls or rounded floor edges" in told
    assert "2 level faces under an overhang" in told
    # The slot, and the plate around the roof.
    assert "2 level faces open at a side" in told
    assert "slope or are rounded" in told


def test_a_pocket_under_a_roof_is_not_cut(tmp_path: Path) -> None:
    solid = fused(cut(box(0, 0, -20, 100, 60, 0), box(20, 20, -8, 60, 40, 0)), box(30, 0, 0, 40, 60, 5))
    with pytest.raises(ReadError, match="1 level face under an overhang"):
        read_pockets(saved(tmp_path / "roof.step", solid))


def test_a_block_without_a_pocket_is_refused(tmp_path: Path) -> None:
    file = saved(tmp_path / "block.step", box(0, 0, 0, 20, 10, 5))
    with pytest.raises(ReadError) as refused:
        read_pockets(file)
    reason = "the level faces of the solid are all at the top"
    assert str(refused.value) == f"{file}: the solid has no closed pocket with a level floor: {reason}"


def cuts_of(outcome: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return start and end of every feed move."""
    path = outcome.written
    rows = np.isin(path.kind, [int(kind) for kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)])
    return path.before[rows], path.end[rows]


@pytest.mark.slow
def test_pockets_of_one_depth_are_milled_at_the_heights_of_the_solid(block: Path) -> None:
    """No place at the floor is nearer to a wall than the mill's radius, and but for chords all of it is reached."""
    outcome = api.optimize(block, process="pocket", depth=8, tool_diameter=6, **FAST)
    assert [one.depth for one in outcome.part.pockets] == [8.0]
    assert any(
        "the program does not mill 1 round pocket no wider than the tool; drill such holes instead" in str(i)
        for i in outcome.issues
    )
    assert any("the program leaves out 2 pockets of other depths than --depth" in str(i) for i in outcome.issues)
    begin, end = cuts_of(outcome)
    assert end[:, 2].min() == 12.0
    path = outcome.written
    across = (path.kind == Kind.RAPID) & (path.before[:, :2] != path.end[:, :2]).any(axis=1)
    assert np.nanmin(path.end[across, 2]) >= 22.0
    floor = (begin[:, 2] == 12.0) & (end[:, 2] == 12.0)
    made = shapely.union_all(shapely.linestrings(np.stack([begin[floor, :2], end[floor, :2]], axis=1)).tolist())
    pocket = shapely.box(75, 15, 105, 35).buffer(5.0, quad_segs=64)
    assert pocket.buffer(-2.99).covers(made)
    assert made.buffer(3.0, quad_segs=32).area == pytest.approx(pocket.area, rel=0.01)


def left_at(outcome: Any, x: float, y: float, radius: float, top: float) -> float:
    """Return the height that a flat mill leaves at a place, by the points of its moves alone."""
    begin, end = cuts_of(outcome)
    share = np.linspace(0.0, 1.0, 41)[:, None, None]
    along = (begin + share * (end - begin)).reshape(-1, 3)  # chords of arcs: nearer to the middle of a pocket
    near = np.hypot(along[:, 0] - x, along[:, 1] - y) <= radius
    return float(min(along[near, 2].min(initial=top), top))


@pytest.mark.parametrize(
    "more",
    [
        {},
        *(pytest.param(m, marks=pytest.mark.slow) for m in ({"stock": 0.3}, {"strategy": "connected"})),
    ],
)
def test_each_pocket_is_milled_to_its_floor_and_inner_pockets_after_outer_ones(
    block: Path, more: dict[str, Any]
) -> None:
    """The program leaves the heights of the solid and cuts no air above the inner pocket."""
    outcome = api.optimize(block, process="pocket", tool_diameter=6, **{**FAST, **more})
    plans = outcome.detail.plans
    assert [plan.heights[-1] for plan in plans] == [14.0, 12.0, 8.0]
    assert [plan.begin for plan in plans] == [0.0, 0.0, -8.0]
    solid = {(15, 30): 14, (55, 45): 14, (32, 28): 20, (75, 25): 12, (90, 13): 12, (90, 25): 8, (84, 19): 8, (5, 5): 20}
    assert {place: left_at(outcome, *place, 3.0, 20.0) for place in solid} == pytest.approx(solid, abs=2e-3)
    _, end = cuts_of(outcome)
    outer, inner = np.flatnonzero(end[:, 2] == 12.0), np.flatnonzero(end[:, 2] < 12.0 - 1e-6)
    assert outer.max() < inner.min()
    assert outcome.before.time_s > 0.0


@pytest.mark.slow
def test_a_lower_island_is_uncovered_before_what_is_around_it(tmp_path: Path) -> None:
    """The pocket of the island's top has the same walls as the deeper one around the island."""
    pocket = cut(rounded(10, 10, -10, 70, 50, 0, 5), rounded(30, 22, -10, 50, 38, -4, 3))
    file = saved(tmp_path / "island.step", cut(box(0, 0, -20, 80, 60, 0), pocket))
    outcome = api.optimize(file, process="pocket", tool_diameter=8, **FAST)
    assert [plan.begin for plan in outcome.detail.plans] == [0.0, -4.0]
    solid = {(40, 30): -4, (20, 30): -10, (40, 15): -10, (5, 30): 0}
    assert {place: left_at(outcome, *place, 4.0, 0.0) for place in solid} == pytest.approx(solid, abs=2e-3)


def test_the_proof_knows_how_deep_each_pocket_is() -> None:
    """A move at Z-5 is right in the deep pocket, too deep in the shallow one, and beyond the wall between them."""
    walls = [Polyline.of_points([(x, 0), (x + 40, 0), (x + 40, 40), (x, 40)], closed=True) for x in (0, 60)]
    pockets = [Pocket(wall, name=str(number)) for number, wall in enumerate(walls, 1)]
    rules, told = PocketRules(tool_diameter=10.0, step_over=6.0), []
    for begin, end in ((70, 80), (10, 20), (70, 50)):
        builder = ToolpathBuilder()
        builder.rapid(z=5.0)
        builder.rapid(float(begin), 20.0)
        builder.feed(z=-5.0, feed=10.0)
        builder.feed(float(end), 20.0, feed=10.0)
        builder.rapid(z=5.0)
        told.append([d.what for d in check_pockets(builder.build(), pockets, rules, [3.0, 6.0], 2.0)])
    assert told == [[], ["too deep", "too deep"], ["gouge"]]


@pytest.mark.slow
def test_a_depth_chooses_the_pockets_of_one_depth(block: Path, tmp_path: Path) -> None:
    with pytest.raises(
        PlanError,
        match=r"no pocket is --depth 7 mm deep; the solid has pockets of 6 mm \(1 pocket\), 8 mm \(1 pocket\), "
        r"12 mm \(1 pocket\); leave --depth out to mill each to its own floor",
    ):
        api.optimize(block, process="pocket", depth=7, tool_diameter=6, **FAST)
    solid = cut(box(0, 0, -20, 80, 40, 0), rounded(10, 10, -4.5, 50, 30, 0, 5))
    outcome = api.optimize(saved(tmp_path / "one.step", solid), process="pocket", tool_diameter=8, **FAST)
    assert outcome.detail.plans[0].heights == (-2.25, -4.5)


def test_units_and_layers_are_refused_as_a_solid_has_neither(block: Path) -> None:
    for options, told in (({"units": "in"}, "defines its own unit"), ({"pocket_layers": "a"}, "has no layers")):
        with pytest.raises(OptionError, match=told):
            api.optimize(block, process="pocket", tool_diameter=6, **options, **FAST)
    with pytest.raises(OptionError, match="defines its own unit"):
        read_contours(block, ReadOptions(units="in"))


@pytest.mark.slow
def test_the_outline_of_a_sheet_and_what_goes_through_it_are_cut(block: Path, tmp_path: Path) -> None:
    part = read_contours(block)
    areas = sorted(abs(one.path.area) for one in part.contours)
    window, hole = 30 * 15 - CORNER * 9, math.pi * 4.0
    assert areas == pytest.approx([hole, window, 120 * 80])
    assert ["also has pockets, steps or chamfers" in str(issue) for issue in part.issues] == [True]
    flat = cut(rounded(0, 0, 0, 60, 40, 3, 6), cylinder((20, 20, 0), UP, 5, 3))
    outcome = api.optimize(saved(tmp_path / "flat.step", flat), process="cut", thickness=3, preset="fast", threads=1)
    assert not [issue for issue in outcome.issues if issue.code == "L219"]
    assert outcome.verified
    assert len(outcome.part.contours) == 2


@pytest.mark.hazard
def test_a_sheet_of_another_thickness_than_its_solid_is_refused_with_both(tmp_path: Path) -> None:
    """A solid drawn as 3.175 mm, an eighth of an inch, is cut as 3.2 mm."""
    flat = saved(tmp_path / "flat.step", box(0, 0, 5, 60, 40, 8.175))
    with pytest.raises(
        OptionError,
        match=r"--thickness is 6 mm, but the solid is 3.175 mm high; give --thickness 3.175mm",
    ):
        api.optimize(flat, process="cut", thickness=6, threads=1)
    part = read_contours(flat)
    assert check_thickness(part, 3.2) == []
    with pytest.raises(OptionError, match=r"is 3.175 mm high"):
        check_thickness(part, 2.6)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("height", "thickness", "more"), [(3.175, 3.038, 3.7), (3.175, 3, 2.6), (6.35, 6, 5.7), (20, 18, 17.9)]
)
def test_a_usual_substitute_for_the_thickness_of_a_solid_is_a_warning_with_both(
    height: float, thickness: float, more: float
) -> None:
    part = Part("flat", height=height)
    (issue,) = check_thickness(part, thickness)
    assert issue.code in LIMITS and issue.severity is Severity.WARNING
    assert f"solid is {height:g} mm high, but the sheet is {thickness:g} mm thick" in issue.message
    with pytest.raises(OptionError, match=f"the solid is {height:g} mm high"):
        check_thickness(part, more)


def test_what_no_section_shows_as_it_is_seen_from_above_is_no_sheet(tmp_path: Path) -> None:
    solid = fused(box(0, 0, 0, 40, 20, 4), box(20, 10, 4, 60, 40, 8))
    with pytest.raises(LeafcutError, match="is not a flat sheet"):
        read_contours(saved(tmp_path / "two.step", solid))


def test_a_flat_sheet_has_its_edge_and_its_openings_as_outlines(tmp_path: Path) -> None:
    """Ø6 and a window of 12 × 4; the lower left corner of the sheet may be the zero."""
    sheet = cut(box(5, 7, -3, 65, 47, 0), cylinder((20, 20, 0), DOWN, 3, 3), rounded(40, 20, -3, 52, 24, 0, 1))
    part = read_contours(saved(tmp_path / "sheet.step", sheet))
    assert sorted(abs(contour.path.area) for contour in part.contours) == [
        pytest.approx(math.pi * 9),
        pytest.approx(12 * 4 - CORNER),
        pytest.approx(60 * 40),
    ]
    assert part.issues == ()
    assert part.reference is not None
    assert part.reference.contours[0].path.extents == pytest.approx((5, 7, 65, 47))
