"""``leafcut pocket --feeds``: feeds follow what the tool meets, within what was given; the path stays."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut import api
from leafcut.errors import OptionError, PlanError, VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.material.cutting_force import DRIVE_EFFICIENCY
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.loads import StockBefore, compute_loads
from leafcut.model.cutter import flat_mill
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pocket import PocketRules
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.processes.pocket.proof.chips import measure_chips
from leafcut.processes.registry import report_of
from leafcut.read.work_materials import load_material
from leafcut.report.json_answer import program_as_json
from own_machines import machine_of_power

#: A pocket of 28 × 20 mm with round corners.
POCKET = shapely.box(5, 5, 23, 15).buffer(5, quad_segs=32)
GIVEN: dict[str, Any] = {
    "process": "pocket",
    "strategy": "contour",
    "tool_diameter": 6,
    "depth": 3,
    "step_down": 1.5,
    "step_over": 0.15,
    "feed": "600mm/min",
    "plunge_feed": "200mm/min",
    "spindle_speed": 6000,
    "iterations": 3,
    "threads": 1,
}
TOOL = """
[[tool]]
number = 1
diameter = "6 mm"
kind = "end-mill"
teeth = 3
feed = "600 mm/min"
spindle_speed = "6000 rpm"
"""


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fed") / "plate.wkt"
    file.write_text(POCKET.wkt)
    return file


@pytest.fixture(scope="module")
def even(drawing: Path):
    return api.optimize(drawing, **GIVEN)


@pytest.fixture(scope="module")
def fed(drawing: Path):
    return api.optimize(drawing, feeds=True, **GIVEN)


def test_the_program_is_faster_by_what_is_told_and_goes_the_same_way(even, fed) -> None:
    assert fed.after.time_s < 0.95 * even.after.time_s
    assert fed.detail.pace.feeds_s == pytest.approx(even.after.time_s - fed.after.time_s)
    assert even.detail.pace is None
    assert fed.after.cut_mm == pytest.approx(even.after.cut_mm, abs=1e-6)
    # Every position of the old program occurs in the new program, in the same order, except for rounding.
    old, new = (np.nan_to_num(o.written.end[o.written.kind <= Kind.ARC_CCW]) for o in (even, fed))
    rest = iter(new)
    assert all(any(np.abs(one - place).max() < 0.0015 for one in rest) for place in old)
    assert len(new) > len(old)


def test_no_feed_is_above_what_was_given_and_ways_down_keep_theirs(even, fed) -> None:
    path = fed.written
    cuts = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    down = cuts & (path.end[:, 2] < path.before[:, 2])
    before = even.written.value[(even.written.kind == Kind.FEED) & (even.written.end[:, 2] < even.written.before[:, 2])]
    assert set(path.value[down].round(4)) <= set(before.round(4))
    milled = path.value[cuts & ~down & (path.value < 40)]
    assert 12.0 - 1e-6 <= milled.max() <= 15.0 + 1e-6


def test_chips_are_no_thicker_by_another_model_of_the_stock(even, fed) -> None:
    """The height field uses neither circles nor angles: cells of 0.05 mm, each assumed one cell nearer."""
    block = StockBlock((-3.0, -3.0, -5.0), (31.0, 23.0, 0.0))
    for outcome in (even, fed):
        stock = StockBefore(HeightField.of_block(block, 0.05), -5.0, True)
        loads = compute_loads(outcome.written, {1: flat_mill(6.0)}, stock, 0.5)
        # Where the tool goes through air at its own feed a corner of a cell is no chip.
        cuts = loads.is_milling & (loads.width > 0.3) & (loads.feed < 40.0)
        assert loads.chip[cuts].max() <= 0.1 * 1.04


def test_the_answer_tells_the_feeds_and_the_thickest_chip_before_and_after(fed) -> None:
    """600 mm/min at 6,000 rpm are 0.1 mm a revolution: in the first cut before and after."""
    pace = program_as_json(report_of(fed))["pace"]
    assert pace["feeds_s"] > 0
    (tool,) = pace["tools"]
    assert (tool["chip_before"], tool["chip_after"], tool["chip_limit"]) == pytest.approx((0.1, 0.1, 0.1), rel=1e-4)
    assert tool["feed_before"] == pytest.approx([10.0, 10.0])
    assert tool["feed_after"][0] == pytest.approx(10.0)
    assert 12.0 < tool["feed_after"][1] <= 15.0


def test_few_lines_are_added_and_no_move_is_tiny(even, fed) -> None:
    assert fed.text.count("F") < fed.text.count("\n") / 3
    path = fed.written
    cuts = (path.kind == Kind.FEED) & (path.value > 10.01) & (path.value < 40)
    shortest = np.linalg.norm(np.diff(even.written.end[even.written.kind == Kind.FEED], axis=0), axis=1)
    length = np.linalg.norm(path.end[cuts] - path.before[cuts], axis=1)
    assert length.min() >= min(0.3, shortest[shortest > 0].min()) - 1e-3


def test_a_program_whose_chips_are_too_thick_is_refused(drawing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof reads the written program: it finds a feed that is 50 % higher in the first cut."""
    monkeypatch.setattr(
        "leafcut.processes.pocket.feeds.allowed_feed", lambda e, limits: np.full(len(e.chip), limits.most)
    )
    with pytest.raises(VerifyError, match=r"a move at 900 mm/min makes a chip of 0.15 mm per revolution near"):
        api.optimize(drawing, feeds=True, **GIVEN)


def test_what_goes_down_faster_than_the_tool_or_cuts_above_the_highest_feed_is_refused() -> None:
    text = "G21 G90 G17 G94\nT1 M6\nS9000 M3\nG0 X0 Y0 Z2\nG1 X9 Z-2 F1000\nG1 X30 F700\nG1 Y5 F2000\nG0 Z5\nM2\n"
    limits = FeedLimits(6.0, 15.0, 9000.0, most=22.5, depth=2.0, film_depth=2.0, film=1.2)
    rules = PocketRules(tool_diameter=6.0, step_over=3.0)
    found = measure_chips(
        interpret_own_program(text, load_dialect("linuxcnc")), rules, limits, Tool(1, 6.0, ToolKind.END_MILL), [-2.0]
    )
    said = [str(one) for one in found.wrong]
    assert [word in " ".join(said) for word in ("goes down", "makes a chip of 0.2222 mm", "cuts near")] == [True] * 3
    assert found.tool.chip_after == pytest.approx(2000 / 9000, rel=1e-6)
    assert found.tool.chip_before == pytest.approx(0.1)


@pytest.mark.parametrize("machine", ["grbl-3018", pytest.param("mach3-router", marks=pytest.mark.slow)])
def test_no_program_takes_longer_on_any_machine(machine: str, drawing: Path) -> None:
    before = api.optimize(drawing, machine=machine, **GIVEN)
    after = api.optimize(drawing, machine=machine, feeds=True, **GIVEN)
    assert after.after.time_s <= before.after.time_s + 1e-9


@pytest.fixture
def library_tool(tmp_path: Path) -> dict[str, Any]:
    """Return options with feed and speed from a tool library, and steel."""
    (tmp_path / "shop.toml").write_text(TOOL)
    return {**GIVEN, "feed": None, "spindle_speed": None, "tools": tmp_path / "shop.toml", "material": "c45"}


def test_a_weak_spindle_lowers_the_feed_in_slots(drawing: Path, tmp_path: Path, library_tool: dict[str, Any]) -> None:
    slow = api.optimize(drawing, feeds=True, machine=machine_of_power(tmp_path, "0.16 kW"), **library_tool)
    low, high = slow.detail.pace.tools[0].feed_after
    assert low < 9.7
    assert high > 10.0


def test_a_spindle_too_weak_for_any_feed_is_refused(
    drawing: Path, tmp_path: Path, library_tool: dict[str, Any]
) -> None:
    with pytest.raises(PlanError, match=r"the spindle provides only 0\.0398 kW; give a smaller --step-down"):
        api.optimize(drawing, feeds=True, machine=machine_of_power(tmp_path, "0.053 kW"), **library_tool)


def test_a_material_of_unknown_force_gives_a_warning(drawing: Path, library_tool: dict[str, Any]) -> None:
    given = {**library_tool, "material": "plastic", "depth": 1.5}
    unknown = api.optimize(drawing, feeds=True, machine="haas-vf2", **given)
    assert [issue.message for issue in unknown.issues if issue.code == "L705"] == [
        "the power and torque of the spindle do not limit the feeds, because the cutting force of 'plastic' "
        "is unknown; name a material of `leafcut list materials`"
    ]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"feed": None, "spindle_speed": None}, "feed and spindle speed of T1 .* --feed and --spindle"),
        ({"feed": None}, "the feed of T1 end-mill Ø6 is not stated, .*; give --feed, or"),
        ({"spindle_speed": None}, "the spindle speed of T1 end-mill Ø6 is not stated"),
    ],
)
def test_feeds_are_refused_where_their_data_are_missing(options: dict[str, Any], words: str, drawing: Path) -> None:
    with pytest.raises(OptionError, match=words):
        api.optimize(drawing, **{**GIVEN, "feeds": True, **options})


@pytest.mark.parametrize(
    ("entry", "angle"),
    [("helix", 3.0), *(pytest.param(*entry, marks=pytest.mark.slow) for entry in [("ramp", 3.0), ("helix", 8.0)])],
)
def test_a_ramp_or_helix_keeps_the_power_limit_by_a_height_field(
    entry: str, angle: float, drawing: Path, tmp_path: Path, library_tool: dict[str, Any]
) -> None:
    """Cells measure the volume that each descending move removes; without the limit it needs more power."""
    given = {**library_tool, "entry": entry, "entry_angle": f"{angle} deg", "plunge_feed": "400 mm/min"}
    weak = api.optimize(drawing, feeds=True, machine=machine_of_power(tmp_path, f"{200 / DRIVE_EFFICIENCY} W"), **given)
    limit = weak.detail.pace.tools[0].limits[0]
    assert (limit.name, limit.limit) == ("power", pytest.approx(200.0))
    assert limit.after <= 200.0 * 1.0001
    strong = api.optimize(drawing, feeds=True, machine=machine_of_power(tmp_path, "10 kW"), **given)
    needs = [_power_down(found.text) for found in (weak, strong)]
    assert needs[0] < 200.0 * 1.02
    assert needs[1] > needs[0] * 1.1


def _power_down(text: str) -> float:
    """Return the maximum power of sloped moves, W: kc Q of side and end of the tool, by volumes on cells."""
    path = interpret_own_program(text, load_dialect("linuxcnc"))
    block = StockBlock((-2, -2, -5), (30, 22, 0))
    found = compute_loads(path, {1: flat_mill(6)}, StockBefore(HeightField.of_block(block, 0.05), 0.0, True), 1.0)
    sinks = found.is_ramping & (found.length > 0.2)
    steel = load_material("c45")
    teeth = 100.0 * 3  # by second
    end = np.minimum(found.rate, 9.0 * np.pi * found.descent_speed)[sinks]
    across = np.sqrt(found.feed**2 - found.descent_speed**2)[sinks] / teeth * 2.0 / np.pi
    force = steel.kc11 * across**-steel.mc, steel.kc11 * (found.descent_speed[sinks] / teeth) ** -steel.mc
    return float((((found.rate[sinks] - end) * force[0] + end * force[1]) / 1000.0).max())


def test_a_plunge_keeps_the_power_by_hand_and_is_refused_above_it(
    drawing: Path, tmp_path: Path, library_tool: dict[str, Any]
) -> None:
    """9π mm² × feed × kc at the descent per tooth, 300 teeth per second: within 100 W, but not at 400 mm/min.

    The proof reports a plunge into full material that needs more, and accepts it where a slot of that depth exists.
    """
    steel = load_material("c45")

    def power(feed: float) -> float:
        return 9.0 * math.pi * feed / 60.0 * steel.kc11 * (feed / 60.0 / 300.0) ** -steel.mc / 1000.0

    given = {**library_tool, "entry": "plunge", "plunge_feed": "400 mm/min"}
    found = api.optimize(
        drawing, feeds=True, machine=machine_of_power(tmp_path, f"{200 / DRIVE_EFFICIENCY} W"), **given
    )
    path = found.written
    before = path.before
    down = (path.kind == Kind.FEED) & (before[:, 2] > path.end[:, 2]) & (before[:, 2] <= 0.5)
    down &= (before[:, :2] == path.end[:, :2]).all(axis=1)
    feeds = 60.0 * path.value[down]
    assert power(400.0) > 200.0
    assert len(feeds)
    assert 0.97 * 200.0 < power(float(feeds.max())) <= 200.0 * 1.001
    limits = FeedLimits(6.0, 10.0, 6000.0, 15.0, 2.0, 2.0, 1.2, power=200.0, material=steel, teeth=3)
    text = "G21 G90 G17 G94\nT1 M6\nS6000 M3\nG0 X0 Y0 Z0.5\nG1 Z-2 F{}\nG1 X9 F60\nG0 Z0.5\nG0 X5\nG1 Z-2 F590\nM2\n"
    mill, rules = Tool(1, 6.0, ToolKind.END_MILL), PocketRules(tool_diameter=6.0, step_over=3.0)
    for feed, lines in ((400, ["line 5"]), (int(feeds.max()), [])):
        wrong = measure_chips(
            interpret_own_program(text.format(feed), load_dialect("linuxcnc")), rules, limits, mill, [-2.0]
        ).wrong
        assert [str(one) for one in wrong if "line 5" in str(one) or "line 9" in str(one)] == [
            str(one) for one in wrong if any(line in str(one) for line in lines)
        ]
        assert bool([one for one in wrong if "F400" in str(one) or "at 400 mm/min" in str(one)]) is bool(lines)


def test_a_ramp_that_needs_more_power_than_there_is_is_refused() -> None:
    text = "G21 G90 G17 G94\nT1 M6\nS6000 M3\nG0 X0 Y0 Z0.5\nG1 X30 Z-2 F600\nG1 X0\nG0 Z5\nM2\n"
    limits = FeedLimits(6.0, 10.0, 6000.0, 15.0, 2.0, 2.0, 1.2, power=200.0, material=load_material("c45"), teeth=3)
    rules = PocketRules(tool_diameter=6.0, step_over=3.0)
    mill = Tool(1, 6.0, ToolKind.END_MILL)
    found = measure_chips(interpret_own_program(text, load_dialect("linuxcnc")), rules, limits, mill, [-2.0])
    (said,) = [str(one) for one in found.wrong if "X30" in str(one) or "line 5" in str(one)]
    assert "kW near" in said
    assert "the spindle provides at most 0.2 kW" in said
