"""No motion hits an obstacle on the table: compared with shapes of GEOS, arcs as arcs, dogleg rapids as boxes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.geometry.zones import path_around_zones, touches_any_zone
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.proof.obstacles import check_obstacles

G81 = DrillCycle("G81", 2.0, -5.0)


def begun() -> ToolpathBuilder:
    """At (0, 0, 10) with a turning spindle."""
    builder = ToolpathBuilder()
    builder.tool(1)
    builder.spindle(3000)
    builder.rapid(z=10.0)
    builder.rapid(0.0, 0.0)
    return builder


def whats(
    path: Toolpath | ToolpathBuilder, zones: object = None, height: float = math.inf, **rules: object
) -> set[str]:
    path = path.build() if isinstance(path, ToolpathBuilder) else path
    return {d.what.split()[0] for d in check_obstacles(path, ZONE if zones is None else zones, height, **rules)}  # type: ignore[arg-type]


ZONE = [[4.0, -1.0, 6.0, 1.0]]


def test_a_rapid_over_a_zone_must_be_at_its_height() -> None:
    """From x 0 to x 10 at y 0 the zone in the middle is crossed; at y 2 it is not."""
    for y, height, fault in ((0.0, 2.0, True), (0.0, 10.0, False), (2.0, 2.0, False)):
        builder = begun()
        builder.rapid(0.0, y)
        builder.rapid(z=height)
        builder.rapid(x=10.0)
        assert whats(builder, height=10.0) == ({"crosses"} if fault else set())


@pytest.mark.hazard
def test_each_zone_is_crossed_at_its_own_height_or_above() -> None:
    """At Z5 over a zone that needs 4 and one that needs 8: the second is met, and named with its height."""
    zones, heights = [[4.0, -1.0, 6.0, 1.0], [14.0, -1.0, 16.0, 1.0]], np.array([4.0, 8.0])
    for z, needed in ((3.0, ["8", "8"]), (5.0, ["8"]), (8.0, [])):
        builder = begun()
        builder.rapid(z=z)
        builder.rapid(x=10.0)
        builder.rapid(x=20.0)
        found = check_obstacles(builder.build(), zones, heights)
        assert len(found) == len(needed)
        assert ("only at Z8.000 or above" in found[-1].text) if found else not needed
    builder = begun()
    builder.rapid(z=5.0)
    builder.feed(x=10.0, feed=1.0)
    assert check_obstacles(builder.build(), zones, heights) == []


def test_cycles_traverse_zones_at_the_plane_they_retract_to() -> None:
    for to_initial, fault in ((False, True), (True, False)):
        builder = begun()
        for x in (0.0, 10.0):
            builder.drill(x, 0.0, DrillCycle("G81", 2.0, -5.0, to_initial=to_initial), feed=1.0)
        assert whats(builder, height=10.0) == ({"crosses"} if fault else set())


def test_on_a_dogleg_machine_the_rectangle_between_start_and_end_counts() -> None:
    builder = begun()
    builder.rapid(z=2.0)
    builder.rapid(10.0, 40.0)
    assert whats(builder, height=10.0) == set()
    assert whats(builder, height=10.0, dogleg=True) == {"crosses"}


@pytest.mark.hazard
def test_zones_without_a_height_are_never_crossed() -> None:
    builder = begun()
    builder.rapid(x=10.0)
    assert whats(builder) == {"crosses"}


@pytest.mark.hazard
def test_nothing_is_cut_inside_a_zone_by_a_cycle_or_a_feed() -> None:
    zones, rules = [[20.0, -5.0, 30.0, 5.0]], {"height": 10.0}
    drilled = begun()
    drilled.rapid(25.0, 0.0)
    drilled.drill(25.0, 0.0, G81, feed=2.0)
    assert whats(drilled, zones=zones, **rules) == {"crosses", "cuts"}
    cut = begun()
    cut.feed(z=-1.0, feed=1.0)
    cut.feed(40.0, 0.0, feed=1.0)
    assert whats(cut, zones=zones, **rules) == {"cuts"}
    beside = begun()
    beside.drill(31.0, 0.0, G81, feed=2.0)
    assert whats(beside, zones=zones, **rules) == set()


@pytest.mark.hazard
def test_the_radius_of_the_tool_in_the_spindle_is_kept_away_from_a_zone() -> None:
    """At y 8, 3 mm beside the zone: a tool of 2.9 mm radius passes at the R plane, one of 3.1 mm does not."""
    builder = begun()
    builder.drill(0.0, 8.0, G81, feed=2.0)
    builder.drill(50.0, 8.0, G81, feed=2.0)
    rules = {"zones": [[20.0, -5.0, 30.0, 5.0]], "height": 10.0}
    assert whats(builder, **rules, tool_radii={1: 2.9}) == set()
    assert whats(builder, **rules, tool_radii={1: 3.1}) == {"crosses"}
    assert whats(builder, **rules, tool_radii={2: 3.1}) == set()


@pytest.mark.hazard
def test_a_holder_below_the_height_of_a_zone_is_kept_away_from_it() -> None:
    """At y 12, 7 mm beside the zone of 10 mm; the holder has 8 mm and is 14 mm above the tip: at Z9 in the hole."""
    rules = {"zones": [[20.0, -5.0, 30.0, 5.0]], "height": 10.0, "tool_radii": {1: 2.0}}
    hole = begun()
    hole.rapid(25.0, 12.0)
    hole.drill(25.0, 12.0, G81, feed=2.0)
    assert whats(hole, **rules) == set()
    assert whats(hole, **rules, bodies={1: [(14.0, 8.0)]}) == {"cuts", "crosses"}
    assert whats(hole, **rules, bodies={1: [(15.1, 8.0)]}) == set()
    assert whats(hole, **rules, bodies={1: [(14.0, 6.9)]}) == set()
    assert whats(hole, **rules, bodies={2: [(14.0, 8.0)]}) == set()
    way = begun()
    way.rapid(z=2.0)
    way.rapid(0.0, 12.0)
    way.rapid(50.0, 12.0)
    assert whats(way, **rules, bodies={1: [(7.0, 8.0)]}) == {"crosses"}
    assert whats(way, **rules, bodies={1: [(8.1, 8.0)]}) == set()
    found = check_obstacles(hole.build(), rules["zones"], 10.0, bodies={1: [(14.0, 8.0)]})
    assert "the shank or holder of the tool hits a --keep-out zone" in found[0].text


def test_an_arc_is_looked_at_along_its_way_and_not_its_chord() -> None:
    """From (0, 0) round (10, 0) to (20, 0): the chord misses an obstacle at (10, 10), the half circle does not."""
    for zone, met in (([8.0, 9.0, 12.0, 12.0], {"cuts"}), ([8.0, -12.0, 12.0, -9.0], set())):
        builder = begun()
        builder.feed(z=-1.0, feed=1.0)
        builder.arc(True, (20.0, 0.0, -1.0), Arc((10.0, 0.0, 0.0)), feed=5.0)
        assert whats(builder, zones=[zone], height=10.0) == met


def test_an_empty_toolpath_meets_nothing() -> None:
    assert whats(ToolpathBuilder(), height=1.0) == set()


@pytest.mark.parametrize("dogleg", [False, True])
def test_a_way_round_touches_nothing_and_is_as_short_as_any_over_the_corners(dogleg: bool) -> None:
    """Two bars between the ends, with a gap of 10 mm: the way leads through the gap or round an end."""
    zones = [[40.0, -50.0, 50.0, 20.0], [40.0, 30.0, 50.0, 90.0]]
    a, b = (0.0, 0.0), (100.0, 0.0)
    turns = path_around_zones(a, b, zones, dogleg=dogleg)
    assert turns
    way = np.array([a, *turns, b])
    assert not touches_any_zone(way[:-1], way[1:], zones, dogleg=dogleg).any()
    length = float(np.hypot(*np.diff(way, axis=0).T).sum())
    assert length == pytest.approx(math.hypot(39, 21) + 12.0 + math.hypot(49, 21), abs=1e-6)


def test_where_there_is_no_way_round_none_is_made() -> None:
    assert path_around_zones((0.0, 0.0), (100.0, 0.0), [[90.0, -10.0, 110.0, 10.0]]) is None


@pytest.mark.parametrize(
    "block, seen",
    [
        ("G0 X30 Y10 A10", False),
        ("G53 G0 X30 Y10", False),
        ("G38.2 X30 F100", False),
        ("G1 X#500 F100", False),
        ("G65 P9000", False),
        ("G0 Z30", True),
        ("G0 Z30\nG0 X30 Y10 A10", True),
        ("G53 G0 Z0\nG53 G0 X30 Y10", True),
        ("M64 P0", True),
    ],
)
def test_a_way_that_nobody_knows_is_taken_to_meet_an_obstacle_unless_the_tool_is_up(block: str, seen: bool) -> None:
    words = "haas" if "G65" in block else "linuxcnc"
    text = f"G21 G90 G17\nT1 M6\nS1000 M3\nG0 X0. Y0.\nG43 H1 Z5.\nG1 Z1. F100.\n{block}\nM30\n"
    found = check_obstacles(interpret_program(text, load_dialect(words)).path, [[15, 5, 25, 15]], 20.0)
    assert [d.what for d in found] == ([] if seen else ["may cross an obstacle"])


def test_a_cut_is_the_first_difference_although_many_rapids_cross_the_obstacle_before_it() -> None:
    rapids = "".join(f"G0 X{x}. Y10.\n" for x in (30, 0) * 40)
    text = f"G21 G90 G17\nT1 M6\nS1000 M3\nG0 X0. Y10.\nG43 H1 Z5.\n{rapids}G1 X30. F100.\nM30\n"
    found = check_obstacles(interpret_program(text, load_dialect("linuxcnc")).path, [[15, 5, 25, 15]], 20.0)
    assert [(d.what, d.new) for d in (found[0], found[1])] == [("cuts in an obstacle", 86), ("crosses an obstacle", 6)]
    assert found[-1].text == "31 more differences"


def crossing(z: float, feed: bool = False) -> ToolpathBuilder:
    builder = begun()
    builder.rapid(z=z)
    if feed:
        builder.feed(x=10.0, feed=1.0, line=7)
    else:
        builder.rapid(x=10.0, line=7)
    return builder


ENDS = "this move goes from X0.000 Y0.000 Z1.000 to X10.000 Y0.000 Z1.000"


@pytest.mark.parametrize(
    ("feed", "height", "bodies", "kind", "rule"),
    [
        (False, 2.0, {}, "crosses an obstacle", "a rapid may cross a --keep-out zone only at Z2.000 or above"),
        (False, math.inf, {}, "crosses an obstacle", "no rapid may cross a --keep-out zone"),
        (True, 2.0, {}, "cuts in an obstacle", "cutting is forbidden in a --keep-out zone"),
    ],
)
def test_each_meeting_has_its_kind_rule_line_and_ends(
    feed: bool, height: float, bodies: dict[int, list[tuple[float, float]]], kind: str, rule: str
) -> None:
    assert check_obstacles(crossing(1.0, feed).build(), ZONE, height, bodies=bodies) == [
        Difference(kind, 0, 7, f"{rule}; {ENDS}")
    ]


def test_a_holder_is_named_only_if_the_tool_itself_stays_clear() -> None:
    """Beside the zone at y 3 with a radius of 1 mm: 2 mm from its edge; the holder has 2.5 mm."""
    builder = begun()
    builder.rapid(0.0, 3.0, 1.0)
    builder.rapid(x=10.0, line=7)
    bodies = {1: [(0.5, 2.5)]}
    text = "the shank or holder of the tool hits a --keep-out zone"
    (found,) = check_obstacles(builder.build(), ZONE, 2.0, tool_radii={1: 1.0}, bodies=bodies)
    assert found.text.startswith(text) and found.what == "crosses an obstacle"
    (found,) = check_obstacles(builder.build(), ZONE, 2.0, tool_radii={1: 2.1}, bodies=bodies)
    assert "only at Z2.000 or above" in found.text


@pytest.mark.parametrize(("z", "met"), [(1.9975, False), (1.9965, True)])
def test_the_height_of_a_zone_is_rounded_by_three_thousandths(z: float, met: bool) -> None:
    assert whats(crossing(z), height=2.0) == ({"crosses"} if met else set())
    with_body = {"height": 2.0, "zones": [[4.0, 5.0, 6.0, 7.0]], "bodies": {1: [(0.5, 6.0)]}}
    assert whats(crossing(z - 0.5), **with_body) == ({"crosses"} if met else set())


@pytest.mark.parametrize(("beyond", "met"), [(0.0025, False), (0.0035, True)])
def test_the_radius_of_a_tool_is_rounded_by_three_thousandths(beyond: float, met: bool) -> None:
    zones = [[4.0, 3.0, 6.0, 5.0]]
    assert whats(crossing(1.0), zones, 2.0, tool_radii={1: 3.0 + beyond}) == ({"crosses"} if met else set())
    assert whats(crossing(1.0), zones, 2.0, bodies={1: [(0.0, 3.0 + beyond)]}) == ({"crosses"} if met else set())


def test_the_zone_that_needs_most_height_is_named_and_all_moves_are_reported() -> None:
    """Both zones lie under each move; a move at Z5 meets only the second."""
    zones, heights = [[4.0, -1.0, 6.0, 1.0], [7.0, -1.0, 8.0, 1.0]], [8.0, 4.0]
    builder = begun()
    builder.rapid(z=3.0)
    builder.rapid(x=10.0, line=7)
    builder.rapid(z=5.0)
    builder.rapid(x=0.0, line=8)
    builder.rapid(z=8.0)
    builder.rapid(x=10.0, line=9)
    found = check_obstacles(builder.build(), zones, heights)
    assert [(d.new, "only at Z8.000 or above" in d.text) for d in found] == [(7, True), (8, True)]


def test_no_zone_is_met_without_zones() -> None:
    assert check_obstacles(crossing(-5.0).build(), np.zeros((0, 4)), 2.0) == []


@pytest.mark.parametrize(
    ("event", "unknown"),
    [
        (lambda b, z: b.set_place(Kind.FOREIGN, (50.0, 0.0, z), 1, line=9), True),
        (lambda b, z: b.set_place(Kind.FOREIGN, (0.0, 0.0, z), 1, line=9), False),
        (lambda b, z: b.set_place(Kind.FOREIGN, (math.nan, 0.0, z), 1, line=9), True),
        (lambda b, z: b.machine(z=0.0, line=9), False),
        (lambda b, z: b.set_place(Kind.SHIFT, (50.0, 0.0, z), 0, line=9), False),
        (lambda b, z: (b.set_place(Kind.SHIFT, (math.nan, 0.0, z), 0), b.rapid(y=50.0, line=9)), True),
    ],
    ids=["unknown block", "still", "to nowhere", "machine z", "shift", "from nowhere"],
)
def test_an_unknown_path_must_be_above_all_zones(
    event: Callable[[ToolpathBuilder, float], object], unknown: bool
) -> None:
    for z in (1.99, 2.0):
        builder = begun()
        builder.rapid(z=z)
        event(builder, z)
        lines = [d.new for d in check_obstacles(builder.build(), [[90.0, 90.0, 91.0, 91.0]], 2.0)]
        assert lines == ([9] if unknown and z < 2.0 else [])


def test_a_move_to_machine_x_or_y_is_reported_unless_it_goes_to_the_top_of_the_machine() -> None:
    for axes, reported in (({"x": 0.0}, True), ({"y": 0.0}, True), ({"x": 0.0, "z": 0.0}, False)):
        for z in (1.0, 2.0):
            builder = begun()
            builder.rapid(z=z)
            builder.machine(**axes, line=9)
            found = check_obstacles(builder.build(), [[90.0, 90.0, 91.0, 91.0]], 2.0)
            assert [d.new for d in found] == [9] * reported


def test_an_unknown_path_is_reported_with_its_start() -> None:
    builder = begun()
    builder.rapid(z=1.0)
    builder.set_place(Kind.FOREIGN, (50.0, 0.0, 1.0), 1, line=9)
    assert check_obstacles(builder.build(), ZONE, 2.0) == [
        Difference(
            "may cross an obstacle",
            0,
            9,
            "the tool leaves X0.000 Y0.000 Z1.000 on an unknown path, too low to cross a --keep-out zone",
        )
    ]


def test_the_first_rapid_from_an_unknown_position_is_above_the_highest_zone() -> None:
    """It may come from anywhere, so it may cross every zone; a zone without a height is then not counted."""
    zones, heights = [[90.0, 0.0, 95.0, 5.0], [80.0, 0.0, 85.0, 5.0]], [2.0, 4.0]
    for z, fault in ((3.9, True), (4.0, False)):
        builder = ToolpathBuilder()
        builder.rapid(z=z)
        builder.rapid(0.0, 0.0)
        found = check_obstacles(builder.build(), zones, heights)
        assert ["only at Z4.000 or above" in d.text for d in found] == [True] * fault
    builder = ToolpathBuilder()
    builder.rapid(z=1.0)
    builder.rapid(0.0, 0.0)
    assert check_obstacles(builder.build(), zones, math.inf) == []


@pytest.mark.parametrize(("z", "fault"), [(-5.0015, False), (-5.0025, True)])
def test_a_rapid_at_a_safe_machine_height_may_cross(z: float, fault: bool) -> None:
    builder = ToolpathBuilder()
    builder.machine(z=z)
    builder.rapid(0.0, 0.0)
    builder.rapid(x=10.0)
    assert len(check_obstacles(builder.build(), ZONE, 2.0, safe_z=-5.0)) == int(fault)
    assert len(check_obstacles(builder.build(), ZONE, math.inf, safe_z=-5.0)) == 1


@pytest.mark.parametrize(("y", "met"), [(39.0, True), (0.5, True)])
def test_a_dogleg_covers_the_rectangle_in_every_quadrant_and_a_feed_only_its_line(y: float, met: bool) -> None:
    for sign_x in (1, -1):
        for sign_y in (1, -1):
            x = 9.5 if y == 0.5 else 0.5
            zone = [sorted((sign_x * x, sign_x * (x + 0.1))), sorted((sign_y * y, sign_y * (y + 0.1)))]
            box = [[zone[0][0], zone[1][0], zone[0][1], zone[1][1]]]
            for feed in (False, True):
                builder = begun()
                builder.rapid(z=1.0)
                if feed:
                    builder.feed(10.0 * sign_x, 40.0 * sign_y, feed=1.0)
                else:
                    builder.rapid(10.0 * sign_x, 40.0 * sign_y)
                assert bool(whats(builder, box, 2.0, dogleg=True)) is (met and not feed)
                assert whats(builder, box, 2.0) == set()


def test_of_many_meetings_fifty_are_listed_and_the_others_are_counted() -> None:
    builder = begun()
    builder.rapid(z=1.0)
    for k in range(60):
        builder.rapid(x=10.0 * ((k + 1) % 2), line=k)
    builder.set_place(Kind.FOREIGN, (50.0, 0.0, 1.0), 1)
    found = check_obstacles(builder.build(), ZONE, 2.0)
    assert [d.what for d in found[:50]] == ["may cross an obstacle", *["crosses an obstacle"] * 49]
    assert [d.new for d in found[1:50]] == list(range(49))
    assert found[50:] == [Difference("and more", 0, 0, "11 more differences")]


@pytest.mark.parametrize("plane", [18, 19])
def test_an_arc_in_an_upright_plane_is_a_line_seen_from_above(plane: int) -> None:
    """A half circle of 10 mm radius, down to Z-9 in its middle; seen from above, 20 mm along an axis."""
    zones = [[19.0, -1.0, 21.0, 1.0]] if plane == 18 else [[-1.0, 19.0, 1.0, 21.0]]
    away = [[21.1, -1.0, 22.0, 1.0]] if plane == 18 else [[-1.0, 21.1, 1.0, 22.0]]
    center, end = ((10.0, 0.0, 1.0), (20.0, 0.0, 1.0)) if plane == 18 else ((0.0, 10.0, 1.0), (0.0, 20.0, 1.0))
    builder = begun()
    builder.rapid(z=1.0)
    builder.arc(True, end, Arc(center, plane=plane), feed=1.0)
    assert whats(builder, zones, 2.0) == {"cuts"}
    assert whats(builder, away, 2.0) == set()
