"""Pockets on a lower step of a solid: their top, and a safe path of the tool down to it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

pytest.importorskip("OCP")

from leafcut import api
from leafcut.errors import OptionError
from leafcut.geometry.polyline import Polyline
from leafcut.material.cutting import simulate_cutting as cut_field
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.solid import cut_display_solid
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.cutter import cutter_of_tool
from leafcut.model.pocket import Pocket
from leafcut.processes.pocket.plan.stock_top import highest_over, stock_tops
from leafcut.processes.pocket.proof.pocket import stock_top_differences
from leafcut.processes.pocket.report.pocket_report import PocketReport
from made_solids import box, cut, fused, rounded, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

FAST: dict[str, Any] = {
    "preset": "fast", "threads": 1, "machine": "linuxcnc-mill", "strategy": "contour", "tool_diameter": 6,
    "pocket_top": "surface", "z_zero": "drawn",
}  # fmt: skip
#: The material before any pocket is milled: boxes of x, y and height, the later ones on top; a step of 20, 12 and 6 mm.
STEPS = ((0, 0, 40, 80, 20), (40, 0, 80, 80, 12), (80, 0, 120, 80, 6))


@pytest.fixture(scope="module")
def stairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return stairs with a pocket on each, one in the floor of another, and one at the foot of the highest step."""
    solid = fused(*(box(x0, y0, 0, x1, y1, z) for x0, y0, x1, y1, z in STEPS))
    solid = cut(
        solid,
        rounded(8, 10, 15, 32, 40, 21, 4),
        rounded(50, 10, 8, 74, 40, 13, 4),
        rounded(56, 16, 5, 68, 34, 9, 4),
        rounded(88, 10, 2, 112, 40, 7, 4),
        rounded(41, 50, 8, 70, 70, 13, 4),
    )
    return saved(tmp_path_factory.mktemp("stairs") / "stairs.step", solid)


def material(cell: float) -> HeightField:
    """Return the stairs with no pocket in them."""
    field = HeightField.of_block(StockBlock((0.0, 0.0, 0.0), (120.0, 80.0, 20.0)), cell)
    x = field.x + cell * np.arange(field.heights.shape[1])
    for x0, _, x1, _, z in STEPS:
        field.heights[:, (x > x0) & (x < x1)] = z
    return field


@pytest.mark.parametrize(
    "more",
    [
        {},
        pytest.param({"stock": 0.3}, marks=pytest.mark.slow),
        pytest.param({"strategy": "connected"}, marks=pytest.mark.slow),
        pytest.param({"entry": "helix"}, marks=pytest.mark.slow),
    ],
)
def test_a_pocket_on_a_step_begins_at_that_step_and_no_rapid_meets_the_stairs(
    stairs: Path, more: dict[str, Any]
) -> None:
    """Simulate the program on the stairs without pockets; the result is the solid.

    The pocket at the foot of the highest step starts at the top of that step, which is within the tool's radius.
    """
    outcome = api.optimize(stairs, process="pocket", **{**FAST, **more})
    begins = sorted((plan.pocket.depth, plan.begin) for plan in outcome.detail.plans)
    assert begins == [(5.0, 0.0), (12.0, -8.0), (12.0, 0.0), (15.0, -12.0), (18.0, -14.0)]
    tool = outcome.operations[0].tool
    field = material(0.25)
    moves = convert_to_straight_moves(outcome.written, 0.01, np.inf).of_tools({tool.number: cutter_of_tool(tool)})
    removed = cut_field(field, moves, {tool.number: cutter_of_tool(tool)}, 2)
    assert not (removed.cuts & moves.rapid).any()
    if "stock" not in more:  # which a finishing pass takes off along its whole depth
        assert removed.depth.max() <= 3.0 + 0.01
    solid = {(20, 25): 15, (62, 12): 8, (62, 25): 5, (100, 25): 2, (55, 60): 8, (60, 45): 12, (100, 60): 6, (4, 4): 20}
    found = {(x, y): float(field.heights[int(y / 0.25), int(x / 0.25)]) for x, y in solid}
    assert found == pytest.approx(solid, abs=2e-3)
    shown = cut_display_solid(outcome.written, PocketReport(outcome).shown_stock())
    assert not shown.collisions
    assert {(x, y): at(shown.before, x, y) for x, y in solid} == pytest.approx(
        {(x, y): 20 if x < 40 else 12 if x < 80 else 6 for x, y in solid if (x, y) != (55, 60)} | {(55, 60): 20.0}
    )
    assert {(x, y): at(shown.after, x, y) for x, y in solid} == pytest.approx(solid, abs=2e-3)
    assert ["at Z12, Z6" in issue.message for issue in outcome.issues if issue.code == "L706"] == [True]


@pytest.mark.slow
def test_levels_in_the_air_above_a_step_are_left_out(stairs: Path) -> None:
    """The same pockets take less time; without the option all start at the highest point."""
    low = api.optimize(stairs, process="pocket", **FAST)
    high = api.optimize(stairs, process="pocket", **{**FAST, "pocket_top": "highest"})
    assert {plan.begin for plan in high.detail.plans} == {0.0, -12.0}
    assert low.after.time_s < high.after.time_s
    assert not [issue for issue in high.issues if issue.code == "L706"]


@pytest.mark.slow
def test_a_pocket_in_one_that_is_left_out_begins_at_the_rim_of_that_one(stairs: Path) -> None:
    outcome = api.optimize(stairs, process="pocket", depth=15, **FAST)
    assert [plan.begin for plan in outcome.detail.plans] == [-8.0]


def test_a_drawing_has_no_surface(tmp_path: Path) -> None:
    file = tmp_path / "pocket.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="50mm" height="50mm" viewBox="0 0 50 50">'
        '<rect x="5" y="5" width="40" height="40"/></svg>'
    )
    with pytest.raises(
        OptionError, match="--pocket-top surface requires a STEP file; leave the option out, or give a STEP file"
    ):
        api.optimize(file, process="pocket", depth=3, **{**FAST, "z_zero": None})


def at(field: HeightField, x: float, y: float) -> float:
    """Return the height of a field at a place, which is relative to its own corner."""
    return float(field.heights[int(y / field.cell), int(x / field.cell)])


def roof(z: float, x0: float, x1: float, rise: float = 0.0) -> np.ndarray:
    """Return two triangles over x0 to x1 and y −50 to 50 that rise along x, float64[2, 3, 3]."""
    a, b = (x0, -50.0, z), (x1, -50.0, z + rise)
    c, d = (x1, 50.0, z + rise), (x0, 50.0, z)
    return np.array([[a, b, c], [a, c, d]])


@pytest.mark.parametrize(("radius", "reach"), [(3.0, 18.0), (6.0, 21.0)])
def test_the_highest_place_of_a_slope_is_at_the_rim_farthest_up(radius: float, reach: float) -> None:
    """A slope of 1 in 10 from Z0 at x = 0: over x 5 to 15 and the radius beyond, it is 0.1 (15 + radius) high."""
    area = shapely.box(5, 5, 15, 15).buffer(radius)
    assert highest_over(roof(0.0, 0.0, 100.0, 10.0), area) == pytest.approx(0.1 * reach)
    assert highest_over(roof(0.0, 60.0, 100.0), area) == -np.inf


def test_the_proof_finds_what_is_higher_than_was_planned() -> None:
    """A step beside the pocket counts from the tool's radius on, and so does the floor that another pocket has left."""
    walls = Polyline.of_points([(0, 0), (20, 0), (20, 20), (0, 20)], closed=True)
    one = Pocket(walls, name="one", depth=10.0, top=0.0)
    low = roof(-5.0, -50.0, 23.5)
    for step, wrong in ((23.5, False), (22.5, True)):
        surface = np.concatenate([low, roof(0.0, step, 60.0)])
        told = stock_top_differences([one], [-5.0], [one], surface, 3.0)
        assert bool(told) is wrong
        assert stock_tops([one], [one], surface, 3.0) == [0.0 if wrong else -5.0]
    wide = Pocket(Polyline.of_points([(-9, -9), (30, -9), (30, 30), (-9, 30)], closed=True), depth=5.0, top=0.0)
    surface = np.concatenate([roof(-5.0, -10.0, 30.0), roof(0.0, 30.0, 60.0)])
    assert stock_tops([one], [one, wide], surface, 3.0) == [0.0]
    assert not stock_top_differences([one], [-5.0], [one], surface, 3.0)
    assert stock_top_differences([one], [-5.0], [one, wide], surface, 3.0)
