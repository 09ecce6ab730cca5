"""Moves that crash are found; moves that do not are let through."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
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
    assert whats(expand_cycles(builder.build())) == []


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


def low_across(builder: ToolpathBuilder) -> None:
    builder.feed(z=0.0, feed=1.0)
    builder.rapid(x=10.0, line=8)


def down(builder: ToolpathBuilder) -> None:
    builder.rapid(z=-1.0, line=8)


def unknown_height(builder: ToolpathBuilder) -> None:
    builder.set_place(Kind.SHIFT, (0.0, 0.0, float("nan")), 0)
    builder.rapid(x=10.0, line=8)


def stopped(builder: ToolpathBuilder) -> None:
    builder.spindle(0)
    builder.feed(x=10.0, feed=1.0, line=8)


def burning(builder: ToolpathBuilder) -> None:
    builder.rapid(x=10.0, line=8)


@pytest.mark.parametrize(
    ("wrong", "torch", "kind", "rule", "ends"),
    [
        (
            low_across,
            False,
            "rapid below clearance",
            "a rapid in x or y must be at Z0.050 or above",
            ("X0.000 Y0.000 Z0.000", "X10.000 Y0.000 Z0.000"),
        ),
        (
            down,
            False,
            "rapid into the part",
            "a rapid descends below the surface, Z0.000, at a position where nothing has been cut",
            ("X0.000 Y0.000 Z10.000", "X0.000 Y0.000 Z-1.000"),
        ),
        (
            unknown_height,
            False,
            "height not known",
            "X or Y moves before Z is known",
            ("X0.000 Y0.000 and an unknown Z", "X10.000 Y0.000 and an unknown Z"),
        ),
        (
            stopped,
            False,
            "spindle off",
            "the spindle must turn before a cut",
            ("X0.000 Y0.000 Z10.000", "X10.000 Y0.000 Z10.000"),
        ),
        (
            burning,
            True,
            "torch on in a rapid",
            "the torch must be off in a rapid",
            ("X0.000 Y0.000 Z10.000", "X10.000 Y0.000 Z10.000"),
        ),
    ],
)
def test_each_danger_has_its_kind_rule_line_and_ends(
    wrong: Callable[[ToolpathBuilder], None], torch: bool, kind: str, rule: str, ends: tuple[str, str]
) -> None:
    builder = begun()
    builder.spindle(0 if torch else 3000)
    builder.rapid(1.0, 0.0)
    builder.rapid(0.0, 0.0)
    builder.spindle(3000)
    wrong(builder)
    found = [d for d in check_clearance(builder.build(), torch=torch) if d.new]
    assert found == [Difference(kind, 0, 8, f"{rule}; this move goes from {ends[0]} to {ends[1]}")]


@pytest.mark.parametrize(("height", "fault"), [(-0.0015, False), (-0.0025, True)])
def test_a_descent_is_rounded_by_two_thousandths(height: float, fault: bool) -> None:
    """The rule holds for the surface and for the bottom of a hole."""
    builder = begun()
    builder.rapid(z=height)
    assert whats(builder) == ["rapid into the part"] * fault
    hole = begun()
    hole.feed(z=-3.0, feed=1.0)
    hole.rapid(z=1.0)
    hole.rapid(z=-3.0 + height)
    assert whats(hole) == ["rapid into the part"] * fault


@pytest.mark.parametrize(("height", "fault"), [(-5.0015, False), (-5.0025, True)])
def test_a_safe_machine_height_is_rounded_by_two_thousandths(height: float, fault: bool) -> None:
    builder = ToolpathBuilder()
    builder.machine(z=height)
    builder.rapid(0.0, 0.0)
    builder.rapid(1.0, 1.0)
    assert whats(builder, safe_z=-5.0) == ["height not known"] * (2 * fault)


@pytest.mark.parametrize(("height", "fault"), [(0.0485, False), (0.0475, True)])
def test_a_move_to_machine_x_starts_clear_of_the_surface(height: float, fault: bool) -> None:
    for axes in ({"x": 0.0}, {"y": 0.0}, {"x": 0.0, "z": 0.0}):
        builder = begun()
        builder.feed(z=height, feed=1.0)
        builder.machine(**axes)
        assert whats(builder) == ["rapid below clearance"] * fault
    builder = begun()
    builder.feed(z=height, feed=1.0)
    builder.machine(z=0.0)
    assert whats(builder) == []


@pytest.mark.parametrize(
    ("event", "fault"),
    [
        (lambda b: b.dwell(1.0), False),
        (lambda b: b.spindle(2000), False),
        (lambda b: b.offset(0), False),
        (lambda b: b.offset(2), True),
        (lambda b: b.pause(), True),
        (lambda b: b.tool(2), True),
        (lambda b: b.machine(z=0.0), True),
        (lambda b: b.set_place(Kind.FOREIGN, (0.0, 0.0, 2.0), 1), True),
        (lambda b: b.rapid(x=1e-4), True),
        (lambda b: b.feed(y=1.0, feed=1.0), True),
    ],
    ids=["dwell", "speed", "same offset", "offset", "stop", "tool", "machine", "unknown block", "rapid", "feed"],
)
def test_what_ends_the_stay_over_a_hole_forbids_the_rapid_back(
    event: Callable[[ToolpathBuilder], None], fault: bool
) -> None:
    """After a stop the part may be another one, and another length offset is another height."""
    builder = begun()
    builder.feed(z=-9.0, feed=1.0)
    builder.rapid(z=2.0)
    event(builder)
    builder.rapid(z=-1.0)
    assert ("rapid into the part" in whats(builder)) is fault


def test_a_later_shallower_feed_keeps_the_depth_of_the_stay() -> None:
    builder = begun()
    for depth in (-9.0, -3.0, 1.0):
        builder.feed(z=depth, feed=1.0)
        builder.rapid(z=2.0)
    builder.rapid(z=-9.0)
    builder.rapid(z=2.0)
    assert whats(builder) == []
    builder.rapid(z=-9.01)
    assert whats(builder) == ["rapid into the part"]


@pytest.mark.parametrize(
    ("x", "z", "faults"),
    [
        (0.009, -2.0, []),
        (0.011, -2.0, ["rapid into the part"]),
        (0.0, -2.01, ["rapid into the part"]),
        (10.0, 3.0, []),
        (10.0, 2.99, ["rapid into the part"]),
        (20.0, 3.0, []),
        (20.0, 2.99, ["rapid into the part"]),
    ],
)
def test_above_a_hole_its_own_top_is_the_surface_and_elsewhere_the_highest(
    x: float, z: float, faults: list[str]
) -> None:
    """Two holes: one starts at Z-2, the other at Z3. A hole is met within 0.01 mm."""
    tops = np.array([[0.0, 0.0, -2.0], [10.0, 0.0, 3.0]])
    builder = begun()
    builder.rapid(x=x)
    builder.rapid(z=z)
    assert whats(builder, tops=tops) == faults
    text = [d.text.partition(";")[0] for d in check_clearance(builder.build(), tops=tops)]
    assert text == ["a rapid descends below the surface at a position where nothing has been cut"] * len(faults)


def test_the_highest_top_is_the_surface_of_rapids_across() -> None:
    tops = np.array([[0.0, 0.0, -2.0], [10.0, 0.0, 3.0]])
    for z, fault in ((3.049, False), (3.04, True)):
        builder = begun()
        builder.feed(z=z, feed=1.0)
        builder.rapid(x=10.0)
        assert whats(builder, tops=tops) == ["rapid below clearance"] * fault
    assert whats(builder, tops=np.zeros((0, 3))) == []


def test_over_an_uneven_surface_only_an_unknown_height_is_reported() -> None:
    builder = begun()
    builder.feed(z=-5.0, feed=1.0)
    builder.rapid(x=10.0)
    assert whats(builder) == ["rapid below clearance"]
    assert whats(builder, level=False) == []
    unknown_height(builder)
    assert whats(builder, level=False) == ["height not known"]


def test_in_a_milled_area_only_the_descent_is_left_to_the_pocket() -> None:
    builder = begun()
    builder.rapid(z=-1.0)
    builder.rapid(x=10.0)
    assert whats(builder) == ["rapid into the part", "rapid below clearance"]
    assert whats(builder, milled=True) == ["rapid below clearance"]


def test_a_torch_may_be_off_in_a_feed_and_rise_while_it_burns() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    builder.feed(x=1.0, feed=1.0)
    builder.spindle(1)
    builder.rapid(z=12.0)
    assert whats(builder, torch=True) == []
    assert whats(builder) == ["spindle off"]


@pytest.mark.parametrize(("count", "last"), [(50, "rapid below clearance"), (51, "and more"), (130, "and more")])
def test_of_many_dangers_fifty_are_listed_and_the_others_are_counted(count: int, last: str) -> None:
    builder = begun()
    builder.feed(z=0.0, feed=1.0)
    for k in range(1, count + 1):
        builder.rapid(x=float(k), line=k)
    found = check_clearance(builder.build())
    assert [d.new for d in found[:50]] == list(range(1, 51))
    assert found[-1].what == last and len(found) == min(count, 51)
    if count > 50:
        assert found[-1] == Difference("and more", 0, 0, f"{count - 50} more differences")
