"""Moves that crash are found; moves that do not are let through."""

from __future__ import annotations

import pytest

from leafcut.model.cycles import expand
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.proof.clearance import check_clearance

G81 = DrillCycle("G81", 2.0, -5.0)
G83 = DrillCycle("G83", 2.0, -12.0, peck=4.0)
G73 = DrillCycle("G73", 2.0, -12.0, peck=4.0)


def begun() -> ToolpathBuilder:
    """At (0, 0, 10) with a turning spindle."""
    builder = ToolpathBuilder()
    builder.tool(1)
    builder.spindle(3000)
    builder.rapid(z=10.0)
    builder.rapid(0.0, 0.0)
    return builder


def whats(path: Toolpath | ToolpathBuilder, **rules: object) -> list[str]:
    path = path.build() if isinstance(path, ToolpathBuilder) else path
    return [d.what for d in check_clearance(path, **rules)]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "cycle", [G81, G83, G73, DrillCycle("G84", 2.0, -9.0), DrillCycle("G82", 2.0, -1.0, dwell=0.3)]
)
def test_drilling_is_safe_as_cycles_and_move_by_move(cycle: DrillCycle) -> None:
    builder = begun()
    for x in (10.0, 20.0):
        builder.drill(x, 0.0, cycle, feed=2.0)
    builder.rapid(z=10.0)
    assert whats(builder) == []
    assert whats(expand(builder.build())) == []


@pytest.mark.parametrize(("back", "faults"), [(2.0, []), (1.0, ["rapid into the part"])])
def test_a_rapid_may_return_to_a_cut_depth_above_z0_and_no_deeper(back: float, faults: list[str]) -> None:
    """The surface lies at 5, as with zero at the bottom of the part."""
    builder = begun()
    builder.feed(z=2.0, feed=1.0)
    builder.rapid(z=6.0)
    builder.rapid(z=back)
    assert whats(builder, surface_z=5.0) == faults


@pytest.mark.hazard
@pytest.mark.parametrize("height, fault", [(0.049, False), (0.04, True), (0.0, True), (-1.0, True)])
def test_a_rapid_across_must_be_clear_of_the_surface(height: float, fault: bool) -> None:
    """0.05 mm is the least; 0.002 mm are left to rounding."""
    builder = begun()
    builder.feed(z=height, feed=1.0)
    builder.rapid(x=10.0)
    assert whats(builder) == (["rapid below clearance"] if fault else [])


def test_the_surface_can_be_given() -> None:
    builder = begun()
    builder.rapid(z=1.0)
    builder.rapid(x=10.0)
    assert whats(builder) == []
    assert whats(builder, surface_z=3.0) == ["rapid into the part", "rapid below clearance"]


def test_a_cycle_whose_r_plane_lies_low_makes_its_traverse_low() -> None:
    builder = begun()
    for x in (10.0, 20.0):
        builder.drill(x, 0.0, DrillCycle("G81", -1.0, -5.0), feed=2.0)
    assert "rapid below clearance" in whats(builder)
    assert "rapid into the part" in whats(builder)


def test_a_slanting_rapid_counts_at_its_lower_end() -> None:
    builder = begun()
    builder.rapid(10.0, 0.0, 0.01)
    assert whats(builder) == ["rapid below clearance"]
    builder = begun()
    builder.feed(z=-1.0, feed=1.0)
    builder.rapid(10.0, 0.0, 5.0)
    assert whats(builder) == ["rapid below clearance"]


@pytest.mark.hazard
def test_a_rapid_down_into_the_part_is_found() -> None:
    builder = begun()
    builder.rapid(z=-0.01)
    assert whats(builder) == ["rapid into the part"]


def test_a_rapid_goes_back_into_a_hole_as_deep_as_it_was_cut_and_no_deeper() -> None:
    for depth, fault in ((-3.9, False), (-4.0, False), (-4.01, True)):
        builder = begun()
        builder.feed(z=-4.0, feed=1.0)
        builder.rapid(z=2.0)
        builder.rapid(z=depth)
        assert whats(builder) == (["rapid into the part"] if fault else [])


def test_a_hole_elsewhere_or_an_earlier_visit_does_not_count() -> None:
    builder = begun()
    builder.feed(z=-9.0, feed=1.0)
    builder.rapid(z=2.0)
    builder.rapid(x=10.0)
    builder.rapid(z=-1.0)
    assert whats(builder) == ["rapid into the part"]
    builder = begun()
    builder.feed(z=-9.0, feed=1.0)
    builder.rapid(z=2.0)
    builder.rapid(x=10.0)
    builder.rapid(x=0.0)
    builder.rapid(z=-1.0)
    assert whats(builder) == ["rapid into the part"]


def test_the_end_of_a_slot_is_cut_as_deep_as_the_slot() -> None:
    builder = begun()
    builder.feed(z=-2.0, feed=1.0)
    builder.feed(x=5.0, feed=1.0)
    builder.rapid(z=2.0)
    builder.rapid(z=-2.0)
    assert whats(builder) == []


@pytest.mark.hazard
def test_the_spindle_must_turn_when_something_is_cut() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=10.0)
    builder.rapid(0.0, 0.0)
    builder.drill(0.0, 0.0, G81, feed=1.0)
    assert whats(builder) == ["spindle off"]
    builder = begun()
    builder.arc(True, (1.0, 0.0, 10.0), Arc((0.5, 0.0, 0.0)), feed=1.0)
    builder.spindle(0)
    builder.feed(x=1.5, feed=1.0)
    assert whats(builder) == ["spindle off"]


@pytest.mark.hazard
def test_a_tool_change_stops_the_spindle() -> None:
    builder = begun()
    builder.tool(2)
    builder.feed(x=1.0, feed=1.0)
    assert whats(builder) == ["spindle off"]


@pytest.mark.hazard
def test_no_move_across_before_z_is_placed() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0)
    builder.rapid(z=5.0)
    assert whats(builder) == ["height not known"]


def test_the_top_of_the_machine_is_a_known_height_and_other_machine_heights_are_not() -> None:
    for z, safe_z, fault in ((0.0, 0.0, False), (-300.0, 0.0, True), (-5.0, -5.0, False)):
        builder = ToolpathBuilder()
        builder.machine(z=z)
        builder.rapid(0.0, 0.0)
        builder.rapid(z=5.0)
        assert whats(builder, safe_z=safe_z) == (["height not known"] if fault else [])


def test_a_move_across_in_machine_x_leaves_the_height_not_known() -> None:
    builder = ToolpathBuilder()
    builder.machine(x=0.0)
    builder.rapid(0.0, 0.0)
    assert whats(builder) == ["height not known"]


def test_a_fault_names_its_line_and_place() -> None:
    builder = begun()
    builder.rapid(z=0.0, line=7)
    builder.rapid(x=10.0, line=8)
    found = check_clearance(builder.build())
    assert str(found[0]) == (
        "rapid below clearance: a rapid in x or y must be at Z0.050 or above; this move goes from X0.000 Y0.000 Z0.000 "
        "to X10.000 Y0.000 Z0.000 (line 8)"
    )


def test_an_empty_toolpath_is_safe() -> None:
    assert whats(ToolpathBuilder()) == []
