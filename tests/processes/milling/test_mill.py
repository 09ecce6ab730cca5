"""Which end mill clears a pocket, and with which data, by hand."""

from __future__ import annotations

import math

import pytest

from leafcut.errors import LeafcutError, PlanError
from leafcut.model.issue import Severity
from leafcut.model.tool import Tool, ToolKind, ToolLibrary
from leafcut.options import JobOptions, MillingOptions
from leafcut.processes.milling.mill import milling_data, select_library_mill
from leafcut.read.machine import load_machine

DRILL = Tool(3, 6.0, feed=5.0, spindle_rpm=2000)
SMALL = Tool(
    7, 6.0, ToolKind.END_MILL, point_angle=math.pi, feed=10.0, spindle_rpm=5000, plunge_feed=2.5, flute_length=13.0
)
LARGE = Tool(8, 10.0, ToolKind.END_MILL, point_angle=math.pi, teeth=3)
SHOP = ToolLibrary((DRILL, SMALL, LARGE), source="shop.toml")
MACHINE = load_machine("linuxcnc-mill")


def mill(
    library: ToolLibrary = SHOP, depth: float = 4.0, tool_number: int | None = None, tool_diameter: float | None = None
) -> Tool:
    return select_library_mill(library, tool_number, tool_diameter, 0.05, depth)


def test_the_mill_is_that_of_the_number_or_of_the_diameter_or_the_only_one() -> None:
    assert mill(tool_number=7) == SMALL
    assert mill(tool_diameter=10.02) == LARGE
    assert mill(tool_number=8, tool_diameter=10.0) == LARGE
    assert mill(ToolLibrary((DRILL, LARGE))) == LARGE


@pytest.mark.parametrize(
    "library, options, depth, words",
    [
        (SHOP, {"tool_number": 3}, 4.0, "T3 drill Ø6 is a drill, not an end mill"),
        (SHOP, {"tool_number": 9}, 4.0, "shop.toml has no such tool"),
        (SHOP, {"tool_number": 7, "tool_diameter": 10.0}, 4.0, "T7 end-mill Ø6 differs from"),
        (SHOP, {"tool_diameter": 8.0}, 4.0, "shop.toml has these end mills: T7 end-mill Ø6, T8 end-mill Ø10"),
        (SHOP, {}, 4.0, "choose one with --tool-number or --tool-diameter"),
        (SHOP, {"tool_number": 7}, 14.0, "T7 end-mill Ø6 cuts 13 mm deep at most"),
        (ToolLibrary((DRILL,), source="shop.toml"), {}, 4.0, "no end mill; add a"),
        (ToolLibrary((DRILL,), source="shop.toml"), {"tool_number": 3}, 4.0, "shop.toml has no end mill"),
    ],
)
def test_a_tool_that_cannot_clear_the_pocket_is_refused_by_name_in_one_line(
    library: ToolLibrary, options: dict[str, object], depth: float, words: str
) -> None:
    with pytest.raises(LeafcutError, match=words) as refused:
        mill(library, depth, **options)  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)


def test_an_option_counts_before_the_library_and_the_library_before_what_is_assumed() -> None:
    data, issues = milling_data(MillingOptions(), JobOptions(), 6.0, MACHINE, SMALL)
    assert (data.tool.number, data.tool.feed, data.plunge_feed, data.tool.spindle_rpm) == (7, 10.0, 2.5, 5000)
    assert issues == [] and not data.tool.assumed
    data, issues = milling_data(MillingOptions(), JobOptions(feed=12.0), 6.0, MACHINE, SMALL)
    assert (data.tool.feed, data.tool.spindle_rpm, issues) == (12.0, 5000, [])


@pytest.mark.parametrize(
    "diameter, teeth, material, rpm, feed",
    [
        # v / (π D): 20 m/min at 10 mm are 637 rpm; 0.05 mm a tooth, two teeth.
        (10.0, None, "mild steel", 637, 0.1),
        (10.0, 3, "steel", 637, 0.15),
        (10.0, None, "aluminum", 1910, 0.1),
        (4.0, None, "stainless", 637, 0.08),
    ],
)
def test_what_nobody_says_is_assumed_for_the_material_and_told(
    diameter: float, teeth: int | None, material: str, rpm: float, feed: float
) -> None:
    tool = None if teeth is None else Tool(2, diameter, ToolKind.END_MILL, teeth=teeth)
    data, [told] = milling_data(MillingOptions(), JobOptions(material=material), diameter, MACHINE, tool)
    assert data.tool.spindle_rpm == rpm
    assert data.tool.feed == pytest.approx(feed * rpm / 60.0)
    assert data.plunge_feed == pytest.approx(data.tool.feed / 3.0)
    assert told.code == "L401" and "assumes" in told.message and f"at {rpm} rpm" in told.message


def test_a_spindle_that_turns_no_slower_than_too_fast_for_the_mill_is_a_warning() -> None:
    """60 m/min at 5 mm are 3820 rpm; a router's spindle turns 6000 at least, and 3 mm in aluminium may turn 6366."""
    router = load_machine("mach3-router")
    data, [told] = milling_data(MillingOptions(), JobOptions(material="aluminium"), 5.0, router)
    assert data.tool.spindle_rpm == router.spindle_min_rpm == 6000
    assert (
        told.severity is Severity.WARNING
        and "The recommended spindle speed is 3820 rpm, but the minimum speed of the spindle of" in told.message
    )
    _, [told] = milling_data(MillingOptions(), JobOptions(material="aluminium"), 3.0, router)
    assert told.severity is Severity.NOTE


@pytest.mark.hazard
def test_a_mill_that_needs_less_than_half_of_the_lowest_speed_or_more_than_twice_the_highest_is_refused() -> None:
    """20 m/min at 10 mm are 637 rpm, 60 m/min at 6.4 mm 2984; 8 m/min at 0.2 mm are 12,732 rpm."""
    router = load_machine("mach3-router")
    slow = (
        r"end-mill Ø{} needs {} rpm in {}, but the spindle of {} turns {} rpm; use a {} mill, or give --material or the"
    )
    for machine, diameter, material, words in (
        (router, 10.0, "mild steel", ("10", 637, "mild steel", "mach3-router", "6000 to 24000", "smaller")),
        (router, 6.4, "aluminium", (r"6\.4", 2984, "aluminium", "mach3-router", "6000 to 24000", "smaller")),
        (MACHINE, 0.2, "stainless", (r"0\.2", 12732, "stainless 304", "linuxcnc-mill", "60 to 6000", "larger")),
    ):
        with pytest.raises(PlanError, match=slow.format(*words)) as refused:
            milling_data(MillingOptions(), JobOptions(material=material), diameter, machine)
        assert "\n" not in str(refused.value)
        given = JobOptions(material=material, spindle_speed=6000.0)
        assert milling_data(MillingOptions(), given, diameter, machine)[0].tool.spindle_rpm == 6000.0


@pytest.mark.hazard
def test_a_feed_that_is_assumed_for_a_speed_far_above_the_right_one_is_a_warning() -> None:
    """20 m/min at 20 mm are 318 rpm in mild steel; with a given feed, nothing is reported."""
    router = load_machine("mach3-router")
    _, [told] = milling_data(MillingOptions(), JobOptions(spindle_speed=6000.0), 20.0, router)
    assert told.severity is Severity.WARNING and told.message.endswith(". The recommended spindle speed is 318 rpm")
    assert not milling_data(MillingOptions(), JobOptions(spindle_speed=6000.0, feed=2.0), 20.0, router)[1]
