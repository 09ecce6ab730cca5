"""Counterbores and countersinks of a solid: made by matching tools of the library, reported without one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps

from leafcut import api
from leafcut.model.part import Hole, HoleStep, Part
from leafcut.model.toolpath import Kind
from leafcut.options import JobOptions
from leafcut.processes.drilling.options import DrillOptions
from leafcut.processes.drilling.plan.drilling import plan_drilling
from leafcut.read.machine import load_machine
from leafcut.read.step_solid import RoundWall, column_to_hole
from leafcut.read.tools import load_tools
from made_solids import DOWN, UP, box, cone, cut, cylinder, fused, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

FAST: dict[str, Any] = {"preset": "fast", "threads": 1, "machine": "linuxcnc-mill", "process": "drill"}
DRILLS = """
[[tool]]
number = 1
diameter = "6 mm"
spindle_speed = "2000 rpm"
feed = "200 mm/min"
[[tool]]
number = 2
diameter = "4 mm"
spindle_speed = "2000 rpm"
feed = "200 mm/min"
"""
BORE = """
[[tool]]
number = 3
kind = "end-mill"
diameter = "10 mm"
spindle_speed = "1500 rpm"
feed = "300 mm/min"
plunge_feed = "60 mm/min"
"""
SINK = """
[[tool]]
number = 4
kind = "chamfer-mill"
diameter = "12 mm"
point_angle = "90 deg"
tip_diameter = "1 mm"
spindle_speed = "1500 rpm"
feed = "300 mm/min"
"""


def drilled_plate() -> Any:
    """Return the plate with two narrow holes."""
    plate = box(0, 0, 0, 120, 40, 20)
    return cut(plate, cylinder((15, 20, 20), DOWN, 3, 20), cylinder((40, 20, 20), DOWN, 2, 20))


def volume(solid: Any) -> float:
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, found)
    return float(found.Mass())


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a plate from Z0 to Z20: counterbored, countersunk, under-cut, and countersunk beside a tall boss."""
    solid = cut(
        drilled_plate(),
        cylinder((15, 20, 20), DOWN, 5, 6),
        cone((40, 20, 17), 2, 5, 3),
        cylinder((65, 20, 20), DOWN, 2, 20),
        cylinder((65, 20, 0), (0, 0, 1), 5, 6),
        cylinder((95, 20, 20), DOWN, 2, 20),
        cone((95, 20, 17), 2, 5, 3),
    )
    solid = fused(solid, box(100.5, 0, 20, 110, 40, 40))
    return saved(tmp_path_factory.mktemp("wide") / "block.step", solid)


@pytest.fixture(scope="module")
def outcome(block: Path) -> Any:
    tools = block.with_name("tools.toml")
    tools.write_text(DRILLS + BORE + SINK)
    return api.optimize(block, tools=str(tools), z_zero="drawn", **FAST)


def bottoms(outcome: Any) -> list[tuple[int, float, float]]:
    """Return tool, x and the height of the tip of every cycle, in the order of the program."""
    path = outcome.path_after
    rows = np.flatnonzero(path.kind == Kind.DRILL)
    return [(int(path.tool[r]), float(path.end[r, 0]), path.cycles[path.ref[r]].bottom) for r in rows]


@pytest.mark.slow
def test_fitting_tools_make_the_wide_parts_after_the_drill(outcome: Any) -> None:
    """The end mill ends at the floor, 6 mm deep; the flat tip of the countersink, 1 mm wide, half a mm over 15."""
    found = bottoms(outcome)
    assert [row for row in found if row[0] == 3] == [(3, 15.0, 14.0)]
    assert [row for row in found if row[0] == 4] == [(4, 40.0, pytest.approx(15.5))]
    order = [tool for tool, *_ in found]
    assert order.index(3) > order.index(1)
    assert order.index(4) > order.index(2)
    path = outcome.path_after
    feeds = {int(path.tool[r]): float(path.value[r]) for r in np.flatnonzero(path.kind == Kind.DRILL)}
    assert (feeds[3], feeds[4]) == pytest.approx((1.0, 300.0 / 60.0 / 3.0))
    # The undercut cannot be made from above, and the wide countersink would meet the boss.
    told = [str(issue) for issue in outcome.issues if issue.code == "L217"]
    assert [
        "the program drills only the narrow part of 2 holes with a counterbore, countersink or undercut, such as "
        "the one at (65, 20), Ø" in line
        for line in told
    ] == [True]


@pytest.mark.slow
def test_what_the_tools_cut_is_what_is_missing_of_the_block(outcome: Any) -> None:
    """By OpenCASCADE: the end mill and the cone of the countersink, at the heights of the program, leave the same."""
    ends = {tool: bottom for tool, _, bottom in bottoms(outcome)}
    tools = cylinder((15, 20, ends[3]), UP, 5, 40), cone((40, 20, ends[4]), 0.5, 6, 5.5)
    wanted = cut(drilled_plate(), cylinder((15, 20, 20), DOWN, 5, 6), cone((40, 20, 17), 2, 5, 3))
    assert volume(cut(drilled_plate(), *tools)) == pytest.approx(volume(wanted), rel=1e-9)


@pytest.mark.parametrize(
    ("tools", "left"),
    [
        ("", 4),
        (BORE, 3),
        (SINK, 2),
        (BORE + SINK, 1),
        (BORE.replace("10 mm", "9.5 mm"), 4),
        (BORE + 'corner_radius = "1 mm"', 4),
        (BORE + 'flute_length = "5 mm"', 4),
        (SINK.replace("90 deg", "82 deg"), 4),
        (SINK.replace("12 mm", "9 mm"), 4),
        (SINK.replace('"1 mm"', '"5 mm"'), 4),
        (SINK.replace("12 mm", "10 mm"), 2),
    ],
)
def test_only_fitting_tools_make_wide_parts(tmp_path: Path, tools: str, left: int) -> None:
    """The holes: one with a counterbore, one with an undercut, two with countersinks."""
    bore = HoleStep(10, 6, math.pi, 6, 10, True)
    sink = HoleStep(10, 3, math.pi / 2, 5, 4, True)
    under = HoleStep(10, 20, math.pi, 20, 10, False)
    steps = [(6.0, bore), (4.0, under), (4.0, sink), (4.0, sink)]
    holes = tuple(
        Hole(20.0 * k, 0.0, wide, depth=20.0, through=True, steps=(one,)) for k, (wide, one) in enumerate(steps)
    )
    (tmp_path / "tools.toml").write_text(DRILLS + tools)
    machine = load_machine("linuxcnc-mill")
    library = load_tools(tmp_path / "tools.toml", machine.units)
    plan = plan_drilling(Part("part", holes), machine, library, JobOptions(thickness=20.0), DrillOptions())
    (told,) = [issue for issue in plan.issues if issue.code == "L217"]
    assert f"narrow part of {left} hole" in told.message
    assert told.severity == "missing"


ALL = frozenset(range(-180, 180))


def test_a_cone_whose_tip_finds_no_room_below_is_not_made_by_a_countersink() -> None:
    """A tip of 90 degrees goes 2 mm below a hole 4 mm wide; in one of 3 mm it would cut its wall."""
    for low, narrow, free in ((-20.0, 2.0, True), (-3.5, 2.0, False), (-20.0, 1.5, False)):
        column = [RoundWall(0, 0, -3, 0, 2, 5, ALL), RoundWall(0, 0, low, -3, narrow, narrow, ALL)]
        hole = column_to_hole(column)
        assert hole is not None
        assert [step.open for step in hole.steps] == [free]
