"""Read-back: every change between plan and text is seen, and rounding is not a change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.proof.difference import MOST_LISTED
from leafcut.proof.read_back import compare_motion

TOLERANCE = 0.0006

G81 = DrillCycle("G81", 2.0, -5.0)
G83 = DrillCycle("G83", 2.0, -12.0, peck=4.0)
G82 = DrillCycle("G82", 2.0, -1.0, dwell=0.5)


def program(offsets: bool = False) -> Toolpath:
    """Two tools, three cycles, a slot and an arc; row by row as a plan has it, or as read with length offsets."""
    builder = ToolpathBuilder()
    for tool, rpm in ((1, 3000.0), (2, -1200.0)):
        builder.machine(z=0.0)
        builder.tool(tool)
        if offsets:
            builder.offset(tool)
        builder.rapid(0.0, 0.0)
        builder.rapid(z=10.0)
        builder.spindle(rpm)
        builder.coolant(2)
        builder.dwell(2.0)
        for number, cycle in enumerate((G81, G82, G83, G81)):
            builder.drill(10.0 * number, 3.0, cycle, feed=2.0)
        builder.rapid(z=10.0)
    builder.rapid(50.0, 0.0)
    builder.rapid(z=1.0)
    builder.feed(z=-1.0, feed=1.0)
    builder.feed(x=60.0, feed=3.0)
    builder.arc(True, (60.0, 10.0, -1.0), Arc((60.0, 5.0, 0.0)), feed=3.0)
    builder.rapid(z=10.0)
    builder.pause()
    builder.end()
    path = builder.build()
    return replace(path, line=np.arange(1, len(path) + 1, dtype=np.int32))


def changed(column: str, kind: Kind, which: int, value: float, axis: int | None = None) -> Toolpath:
    """Return the program with one number of the row number `which` of a kind set to `value`."""
    path = program()
    row = int(np.flatnonzero(path.kind == kind)[which])
    data = getattr(path, column).copy()
    if axis is None:
        data[row] = value
    else:
        data[row, axis] = value
    return replace(path, **{column: data})


def with_cycle(which: int, cycle: DrillCycle) -> Toolpath:
    path = changed("ref", Kind.DRILL, which, 3)
    return replace(path, cycles=(*path.cycles[:3], cycle))


def without(rows: Callable[[Toolpath], int]) -> Toolpath:
    path = program()
    return pick(path, [r for r in range(len(path)) if r != rows(path)])


def pick(path: Toolpath, order: list[int]) -> Toolpath:
    return replace(
        path,
        kind=path.kind[order],
        end=path.end[order],
        value=path.value[order],
        ref=path.ref[order],
        line=path.line[order],
    )


def drill_row(path: Toolpath, which: int) -> int:
    return int(np.flatnonzero(path.kind == Kind.DRILL)[which])


def duplicated(which: int) -> Toolpath:
    path = program()
    row = drill_row(path, which)
    return pick(path, [*range(row + 1), *range(row, len(path))])


def swapped(a: int, b: int) -> Toolpath:
    path = program()
    order = list(range(len(path)))
    a, b = drill_row(path, a), drill_row(path, b)
    order[a], order[b] = b, a
    return pick(path, order)


MUTATIONS = {
    "depth": with_cycle(1, replace(G82, bottom=-1.01)),
    "R plane": with_cycle(1, replace(G82, r_plane=1.9)),
    "peck": with_cycle(2, replace(G83, peck=3.0)),
    "cycle dwell": with_cycle(1, replace(G82, dwell=0.4)),
    "cycle": with_cycle(0, replace(G81, name="G85")),
    "place": changed("end", Kind.DRILL, 1, 10.01, axis=0),
    "height": changed("end", Kind.DRILL, 1, 1.5, axis=2),
    "feed": changed("value", Kind.DRILL, 1, 2.1),
    "speed": changed("value", Kind.SPINDLE, 1, -1300.0),
    "speed ": changed("value", Kind.SPINDLE, 1, 1200.0),
    "dwell": changed("value", Kind.DWELL, 1, 1.9),
    "command": changed("ref", Kind.TOOL, 1, 3),
    "command ": changed("ref", Kind.COOLANT, 0, 1),
    "command  ": changed("ref", Kind.PAUSE, 0, 1),
    "arc": replace(program(), arcs=(Arc((60.0, 5.1, 0.0)),)),
    "arc ": replace(program(), arcs=(Arc((60.0, 5.0, 0.0), turns=2),)),
    "place ": changed("end", Kind.FEED, 1, 60.1, axis=0),
    "height ": changed("end", Kind.MACHINE, 1, -1.0, axis=2),
    "order of moves    ": changed("end", Kind.RAPID, 1, np.nan, axis=2),
    "order of moves": without(lambda p: drill_row(p, 1)),
    "order of moves ": duplicated(1),
    "order of moves  ": without(lambda p: len(p) - 1),
    "order of moves   ": replace(program(), kind=np.where(program().kind == Kind.ARC_CW, 3, program().kind)),
    "place    ": swapped(1, 3),
}


@pytest.mark.parametrize("what", MUTATIONS)
def test_every_single_change_is_seen_and_named(what: str) -> None:
    found = compare_motion(program(), MUTATIONS[what], TOLERANCE)
    assert what.strip() in {d.what for d in found}
    assert all("\n" not in str(d) for d in found)
    assert compare_motion(MUTATIONS[what], program(), TOLERANCE)


@pytest.mark.parametrize("what", MUTATIONS)
def test_every_single_change_is_seen_move_by_move_too(what: str) -> None:
    """Except for the name of a cycle that makes the same moves, which does not occur here."""
    assert compare_motion(expand_cycles(program()), expand_cycles(MUTATIONS[what]), TOLERANCE)


@pytest.mark.hazard
def test_the_same_program_has_no_difference_as_cycles_and_as_moves() -> None:
    assert compare_motion(program(), program(), 0.0) == []
    assert compare_motion(expand_cycles(program()), expand_cycles(program()), 0.0) == []
    assert compare_motion(program(), program(offsets=True), 0.0) == []


def test_an_empty_toolpath_is_equal_to_itself_only() -> None:
    empty = ToolpathBuilder().build()
    assert compare_motion(empty, empty, TOLERANCE, offsets=True) == []
    assert compare_motion(program(), empty, TOLERANCE)
    assert compare_motion(empty, program(), TOLERANCE)


def rounded(path: Toolpath) -> Toolpath:
    """Return the path as text would carry it: 3 decimals, feeds in whole mm/min, speeds in whole rpm."""
    value = np.where(path.kind == Kind.SPINDLE, np.round(path.value), np.round(path.value * 60) / 60)
    return replace(path, end=np.round(path.end, 3), value=np.where(path.kind == Kind.DWELL, path.value, value))


def test_rounding_to_the_written_decimals_is_no_difference() -> None:
    noise = np.random.default_rng(3).uniform(-3e-4, 3e-4, program().end.shape)
    path = program()
    planned = replace(path, end=path.end + noise, value=path.value * 1.0003)
    assert compare_motion(planned, rounded(planned), TOLERANCE) == []
    assert compare_motion(planned, rounded(planned), TOLERANCE / 10)


def test_a_move_of_no_length_need_not_be_written() -> None:
    builder, plain = ToolpathBuilder(), ToolpathBuilder()
    for b, again in ((builder, True), (plain, False)):
        b.rapid(0.0, 0.0, 5.0)
        if again:
            b.rapid(0.0, 0.0, 5.0)
            b.rapid(0.0004, 0.0, 5.0)
        b.rapid(10.0, 0.0, 5.0)
    assert compare_motion(builder.build(), plain.build(), TOLERANCE) == []


def test_many_tiny_moves_that_lead_away_cannot_vanish() -> None:
    """A curve of steps below the tolerance, out and back, is not the same as standing still."""
    curve, straight = ToolpathBuilder(), ToolpathBuilder()
    for b in (curve, straight):
        b.rapid(0.0, 0.0, 5.0)
    for step in [*range(1, 100), *range(100, -1, -1)]:
        curve.feed(0.0005 * step, 0.0, 5.0, feed=1.0)
    for b in (curve, straight):
        b.rapid(10.0, 0.0, 5.0)
    assert compare_motion(curve.build(), straight.build(), TOLERANCE)


@pytest.mark.hazard
def test_a_tool_must_take_its_own_length_offset_before_it_moves_down() -> None:
    right = program(offsets=True)
    assert compare_motion(program(), right, TOLERANCE, offsets=True) == []
    missing = compare_motion(program(), program(), TOLERANCE, offsets=True)
    assert {d.what for d in missing} == {"length offset"}
    wrong = replace(right, ref=np.where((right.kind == Kind.OFFSET) & (right.ref == 2), 1, right.ref))
    found = compare_motion(program(), wrong, TOLERANCE, offsets=True)
    assert [d.what for d in found] == ["length offset"]
    assert "tool 2 moves with length offset 1" in str(found[0])


@pytest.mark.hazard
def test_a_length_offset_taken_too_late_is_seen() -> None:
    path = program(offsets=True)
    row = int(np.flatnonzero(path.kind == Kind.OFFSET)[0])
    late = pick(path, [*range(row), row + 1, row + 2, row, *range(row + 3, len(path))])
    found = compare_motion(program(), late, TOLERANCE, offsets=True)
    assert [d.what for d in found] == ["length offset"]


def test_a_difference_names_line_and_place_for_a_person() -> None:
    found = compare_motion(program(), MUTATIONS["feed"], TOLERANCE)
    place = "drilling cycle to X10.000 Y3.000 Z2.000"
    assert str(found[0]) == f"feed: planned 120 mm/min, written 126 mm/min, {place} (original line 9, line 9)"


def test_a_program_wrong_everywhere_makes_a_short_list() -> None:
    builder, other = ToolpathBuilder(), ToolpathBuilder()
    for number in range(5000):
        builder.drill(float(number), 0.0, G81, feed=2.0)
        other.drill(float(number), 1.0, G81, feed=2.0)
    found = compare_motion(builder.build(), other.build(), TOLERANCE)
    assert len(found) == MOST_LISTED + 1
    assert "4950 more" in str(found[-1])


Rows = Callable[[ToolpathBuilder], object]


def rows_of(*rows: Rows) -> Toolpath:
    """At (0, 0, 10) with a turning spindle, then the rows."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0, line=1)
    builder.spindle(1000.0, 2)
    for row in rows:
        row(builder)
    return builder.build()


def with_arc(x: float = 5.0, z: float = 10.0, plane: int = 17, turns: int = 1) -> Rows:
    return lambda b: b.arc(True, (10.0, 0.0, 10.0), Arc((x, 0.0, z), plane, turns), feed=10.0, line=3)


def two_arcs(planned: Arc, written: Arc) -> str:
    return f"planned {planned}, written {written}, arc clockwise to X10.000 Y0.000 Z10.000"


def drilled(**values: float | str) -> Rows:
    cycle = replace(DrillCycle("G83", 2.0, -12.0, peck=4.0), **values)  # type: ignore[arg-type]
    return lambda b: b.drill(5.0, 6.0, cycle, feed=2.0, line=3)


@pytest.mark.parametrize(
    ("planned", "near", "far", "kind", "text"),
    [
        (
            lambda b: b.rapid(x=5.0, line=3), lambda b: b.rapid(x=5.0006, line=3), lambda b: b.rapid(x=5.0007, line=3),
            "place", "planned rapid to X5.000 Y0.000 Z10.000, written rapid to X5.001 Y0.000 Z10.000",
        ),
        (
            lambda b: b.rapid(y=5.0, line=3), lambda b: b.rapid(y=4.9994, line=3), lambda b: b.rapid(y=4.9, line=3),
            "place", "planned rapid to X0.000 Y5.000 Z10.000, written rapid to X0.000 Y4.900 Z10.000",
        ),
        (
            lambda b: b.feed(z=5.0, feed=9.0, line=3), lambda b: b.feed(z=5.0006, feed=9.0, line=3),
            lambda b: b.feed(z=5.1, feed=9.0, line=3),
            "height", "planned feed to X0.000 Y0.000 Z5.000, written feed to X0.000 Y0.000 Z5.100",
        ),
        (
            lambda b: b.feed(x=5.0, feed=10.0, line=3), lambda b: b.feed(x=5.0, feed=10.0499, line=3),
            lambda b: b.feed(x=5.0, feed=10.0501, line=3),
            "feed", "planned 600 mm/min, written 603.006 mm/min, feed to X5.000 Y0.000 Z10.000",
        ),
        (
            lambda b: b.feed(x=5.0, feed=1.0, line=3), lambda b: b.feed(x=5.0, feed=1.0083, line=3),
            lambda b: b.feed(x=5.0, feed=1.0084, line=3),
            "feed", "planned 60 mm/min, written 60.504 mm/min, feed to X5.000 Y0.000 Z10.000",
        ),
        (
            lambda b: b.probe(-5.0, feed=1.0, line=3), lambda b: b.probe(-5.0, feed=1.008, line=3),
            lambda b: b.probe(-5.0, feed=2.0, line=3),
            "feed", "planned 60 mm/min, written 120 mm/min",
        ),
        (
            lambda b: b.dwell(1.0, 3), lambda b: b.dwell(1.001, 3), lambda b: b.dwell(1.0011, 3),
            "dwell", "planned dwell of 1 s, written dwell of 1.0011 s",
        ),
        (
            lambda b: b.spindle(300.0, 3), lambda b: b.spindle(300.5, 3), lambda b: b.spindle(300.6, 3),
            "speed", "planned spindle speed 300 rpm, written spindle speed 300.6 rpm",
        ),
        (
            lambda b: b.spindle(9000.0, 3), lambda b: b.spindle(9008.9, 3), lambda b: b.spindle(9009.1, 3),
            "speed", "planned spindle speed 9000 rpm, written spindle speed 9009.1 rpm",
        ),
        (
            lambda b: b.spindle(0.2, 3), lambda b: b.spindle(0.1, 3), lambda b: b.spindle(-0.2, 3),
            "speed", "planned spindle speed 0.2 rpm, written spindle speed -0.2 rpm",
        ),
        (
            lambda b: b.radius(41, 1.5, 3), lambda b: b.radius(41, 1.5006, 3), lambda b: b.radius(41, 1.6, 3),
            "kerf", "planned radius compensation G41 D1.5, written radius compensation G41 D1.6",
        ),
        (
            lambda b: b.radius(41, 1.5, 3), lambda b: b.radius(41, 1.5, 3), lambda b: b.radius(42, 1.5, 3),
            "command", "planned radius compensation G41 D1.5, written radius compensation G42 D1.5",
        ),
        (
            lambda b: b.blending(640, 0.1, line=3), lambda b: b.blending(640, 0.1006, line=3),
            lambda b: b.blending(640, 0.2, line=3),
            "switch", "planned blending G64 P0.1, written blending G64 P0.2",
        ),
        (
            lambda b: b.blending(640, 0.1, line=3), lambda b: b.blending(640, 0.1, line=3),
            lambda b: b.blending(610, 0.1, line=3),
            "command", "planned blending G64 P0.1, written blending G61 P0.1",
        ),
        (
            lambda b: b.torch(True, 3), lambda b: b.torch(True, 3), lambda b: b.torch(False, 3),
            "switch", "planned torch on, written torch off",
        ),
        (
            lambda b: b.coolant(1, 3), lambda b: b.coolant(1, 3), lambda b: b.coolant(2, 3),
            "command", "planned coolant 1, written coolant 2",
        ),
        (
            lambda b: b.pause(False, 3), lambda b: b.pause(False, 3), lambda b: b.pause(True, 3),
            "command", "planned pause M0, written pause M1",
        ),
        (
            with_arc(), with_arc(x=5.0006), with_arc(x=5.001),
            "arc", two_arcs(Arc((5.0, 0.0, 10.0)), Arc((5.001, 0.0, 10.0))),
        ),
        (
            with_arc(), with_arc(z=99.0), with_arc(turns=2),
            "arc", two_arcs(Arc((5.0, 0.0, 10.0)), Arc((5.0, 0.0, 10.0), turns=2)),
        ),
        (
            with_arc(plane=18), with_arc(plane=18, z=10.0006), with_arc(plane=17),
            "arc", two_arcs(Arc((5.0, 0.0, 10.0), 18), Arc((5.0, 0.0, 10.0), 17)),
        ),
        (
            drilled(), drilled(bottom=-12.0006), drilled(bottom=-12.1),
            "depth", "planned -12.0 mm, written -12.1 mm, drilling cycle to X5.000 Y6.000 Z2.000",
        ),
        (
            drilled(), drilled(peck=4.0006), drilled(peck=4.1),
            "peck", "planned 4.0 mm, written 4.1 mm, drilling cycle to X5.000 Y6.000 Z2.000",
        ),
        (
            drilled(peck=14.0), drilled(peck=99.0), drilled(peck=13.9),
            "peck", "planned 14.0 mm, written 13.9 mm, drilling cycle to X5.000 Y6.000 Z2.000",
        ),
        (
            drilled(name="G82", dwell=0.5), drilled(name="G82", dwell=0.501, peck=1.0), drilled(name="G82", dwell=0.6),
            "cycle dwell", "planned 0.5 s, written 0.6 s, drilling cycle to X5.000 Y6.000 Z2.000",
        ),
        (
            drilled(name="G81"), drilled(name="G81", dwell=9.0, peck=1.0), drilled(name="G85"),
            "cycle", "planned G81, written G85, drilling cycle to X5.000 Y6.000 Z2.000",
        ),
        (
            drilled(to_initial=True), drilled(to_initial=True, r_plane=2.0006), drilled(to_initial=True, r_plane=2.1),
            "R plane", "planned 2.0 mm, written 2.1 mm, drilling cycle to X5.000 Y6.000 Z10.000",
        ),
    ],
)  # fmt: skip
def test_each_value_has_its_tolerance_and_its_text(planned: Rows, near: Rows, far: Rows, kind: str, text: str) -> None:
    assert compare_motion(rows_of(planned), rows_of(near), TOLERANCE) == []
    assert compare_motion(rows_of(planned), rows_of(far), TOLERANCE) == [Difference(kind, 3, 3, text)]


def test_the_first_row_in_another_order_is_reported_with_the_numbers_of_rows() -> None:
    one = rows_of(lambda b: b.rapid(x=5.0, line=3), lambda b: b.dwell(1.0, 4), lambda b: b.rapid(x=9.0, line=5))
    other = rows_of(lambda b: b.rapid(x=5.0, line=3), lambda b: b.rapid(x=9.0, line=4))
    planned, written = "dwell of 1 s", "rapid to X9.000 Y0.000 Z10.000"
    assert compare_motion(one, other, TOLERANCE) == [
        Difference("order of moves", 4, 4, f"planned {planned}, written {written}; 5 rows planned, 4 written")
    ]
    shorter = rows_of(lambda b: b.rapid(x=5.0, line=3), lambda b: b.dwell(1.0, 4))
    assert compare_motion(one, shorter, TOLERANCE) == [
        Difference("order of moves", 5, 0, f"planned {written}, written nothing more; 5 rows planned, 4 written")
    ]
    moved = rows_of(lambda b: b.rapid(x=6.0, line=3), lambda b: b.rapid(x=9.0, line=4))
    (found,) = compare_motion(one, moved, TOLERANCE)
    assert (found.original, found.new) == (3, 3) and "X5.000" in found.text and "X6.000" in found.text


def test_an_unlit_torch_may_be_reset_and_the_last_reset_counts_if_it_darkens() -> None:
    """Before the first lighting only the last state matters, and that it is on is the state after a reset."""

    def lit(*states: bool) -> Toolpath:
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 10.0)
        for is_on in states:
            builder.torch(is_on)
        builder.spindle(1000.0)
        builder.rapid(x=5.0)
        return builder.build()

    assert compare_motion(lit(), lit(True), TOLERANCE) == [] == compare_motion(lit(), lit(False, True), TOLERANCE)
    assert [d.what for d in compare_motion(lit(), lit(False), TOLERANCE)] == ["order of moves"]
    assert compare_motion(lit(False), lit(True, False), TOLERANCE) == []


def test_tools_that_move_with_another_length_offset_are_reported_once_each() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    for number, offset in ((1, 1), (2, 1), (3, 0)):
        builder.tool(number)
        builder.offset(offset)
        builder.rapid(x=float(number), line=10 * number)
        builder.rapid(z=10.0 + number, line=10 * number + 1)
        builder.feed(x=20.0 + number, feed=1.0, line=10 * number + 2)
    path = builder.build()
    assert compare_motion(path, path, TOLERANCE) == []
    assert compare_motion(path, path, TOLERANCE, offsets=True) == [
        Difference(
            "length offset",
            0,
            21,
            "tool 2 moves with length offset 1 instead of its own; rapid to X2.000 Y0.000 Z12.000",
        ),
        Difference(
            "length offset",
            0,
            31,
            "tool 3 moves with length offset 0 instead of its own; rapid to X3.000 Y0.000 Z13.000",
        ),
    ]
