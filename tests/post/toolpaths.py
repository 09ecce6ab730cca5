"""Toolpaths for the tests of posts: one made by hand, and any that a planner may lay."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Motion, Toolpath, ToolpathBuilder

#: Dialects that tap (G84).
TAPPING = ("fanuc", "haas", "linuxcnc", "mach4")


#: Dialects that write any work of a mill; those for drilling only are apart.
MILLING = [name for name in dialect_names(torch=False) if load_dialect(name).language != "klartext"]


def units_of(name: str) -> tuple[str, ...]:
    """The units that programs of a dialect can be in."""
    return ("mm", "inch") if load_dialect(name).units_inch else ("mm",)


def two_tools(name: str) -> Toolpath:
    """A drill runs every cycle on a row of holes, then a mill cuts a slot with round ends; all as a planner does it."""
    tap = name in TAPPING
    b = ToolpathBuilder()
    b.rapid(z=25.0)
    b.tool(1)
    b.spindle(1000.0)
    b.dwell(2.5)
    b.rapid(z=25.0)
    b.coolant(2)
    b.rapid(0.0, 0.0)
    cycles = [
        DrillCycle("G81", 2.0, -5.0),
        DrillCycle("G82", 2.0, -5.5, True, 0.0, 0.25),
        DrillCycle("G83", 2.0, -10.0, False, 10 / 3),
        DrillCycle("G73", 2.0, -10.125, True, 3.0),
        DrillCycle("G85", 2.0, -5.0),
        *([DrillCycle("G84", 2.0, -6.0)] if tap else []),
    ]
    for row, cycle in enumerate(cycles):
        b.rapid(z=10.0)
        for column in range(2):
            b.drill(12.7 * column + 1 / 3, 5.0 * row + 1 / 7, cycle, feed=2.0 + row / 8)
    b.rapid(z=25.0)
    b.spindle(0.0)
    b.coolant(0)
    b.tool(2)
    b.spindle(-2000.0)
    b.rapid(z=25.0)
    b.rapid(50.0, 0.0)
    b.rapid(z=2.0)
    b.feed(z=-1.0, feed=1.0)
    b.feed(60.0, 0.0, feed=4.0)
    b.arc(False, (60.0, 6.0, -1.0), Arc((60.0, 3.0, -1.0)), feed=4.0)
    b.feed(50.0, 6.0, feed=4.0)
    b.arc(False, (50.0, 0.0, -1.0), Arc((50.0, 3.0, -1.0)), feed=4.0)
    b.arc(True, (50.0, 0.0, -2.0), Arc((48.0, 0.0, -1.0)), feed=3.0)
    b.rapid(z=25.0)
    if load_dialect(name).has_machine_moves:
        b.machine(z=0.0)
    b.spindle(0.0)
    b.end()
    return b.build()


_LENGTH = st.floats(-800.0, 800.0)
# Hundredths: heights closer than the program's decimals fall together, and the move between them away.
_HEIGHT = st.integers(300, 6000).map(lambda n: n / 100)
_FEED = st.floats(0.1, 90.0)


@st.composite
def cycles(draw: st.DrawFn, names: tuple[str, ...]) -> DrillCycle:
    """Any cycle of these names, with at most twelve pecks."""
    name = draw(st.sampled_from(names))
    r_plane, depth = draw(st.integers(50, 500)) / 100, draw(st.floats(2.0, 60.0))
    peck = depth / draw(st.floats(0.8, 11.0)) if name in ("G83", "G73") else 0.0
    dwell = draw(st.floats(0.02, 9.0)) if name == "G82" else 0.0
    # LinuxCNC feeds a tap or a reamer all the way up to the initial plane; others only to R.
    to_initial = name not in ("G84", "G85") and draw(st.booleans())
    return DrillCycle(name, r_plane, r_plane - depth, to_initial, peck, dwell)


def _arc(draw: st.DrawFn, b: ToolpathBuilder) -> None:
    x, y, z = b.position
    radius, begin = draw(st.floats(0.5, 80.0)), draw(st.floats(0.0, math.tau))
    clockwise, whole = draw(st.booleans()), draw(st.booleans())
    sweep = math.tau if whole else draw(st.floats(0.1, math.tau - 0.1))
    u, v = x - radius * math.cos(begin), y - radius * math.sin(begin)
    stop = begin - sweep if clockwise else begin + sweep
    end = (x, y) if whole else (u + radius * math.cos(stop), v + radius * math.sin(stop))
    rise = draw(st.sampled_from([0.0, -0.5]))
    b.arc(clockwise, (*end, z + rise), Arc((u, v, z)), feed=draw(_FEED))


def _change_tool(draw: st.DrawFn, b: ToolpathBuilder, backwards: bool, to_zero: bool) -> None:
    b.spindle(0.0)
    if at_machine := to_zero and draw(st.booleans()):
        b.machine(z=0.0)
    b.tool(draw(st.integers(1, 9)))
    b.spindle(draw(st.sampled_from([1.0, -1.0] if backwards else [1.0])) * draw(st.integers(50, 24_000)))
    if at_machine:
        b.rapid(draw(_LENGTH), draw(_LENGTH))
    b.rapid(z=draw(_HEIGHT))


@st.composite
def planned(draw: st.DrawFn, names: tuple[str, ...], to_zero: bool = True, may_stop: bool = True) -> Toolpath:
    """Any toolpath as the planner creates it: Z first, a Z move after every tool, arcs on their circle.

    With `may_stop_program`, stops may be optional.
    """
    b = ToolpathBuilder()
    # LinuxCNC taps with the spindle turning forwards only.
    backwards = "G84" not in names
    b.rapid(z=draw(_HEIGHT))
    _change_tool(draw, b, backwards, to_zero)
    b.rapid(draw(_LENGTH), draw(_LENGTH))
    for _ in range(draw(st.integers(0, 8))):
        match draw(st.integers(0, 9)):
            case 0:
                b.rapid(draw(_LENGTH), draw(_LENGTH), draw(st.none() | _HEIGHT))
            case 1:
                b.rapid(z=draw(_HEIGHT))
            case 2:
                b.feed(draw(_LENGTH), draw(st.none() | _LENGTH), draw(st.none() | st.floats(-9, 9)), feed=draw(_FEED))
            case 3:
                _arc(draw, b)
            case 4:
                b.dwell(draw(st.floats(0.0, 100.0)))
            case 5:
                b.coolant(draw(st.sampled_from([2, 0])))
            case 6:
                b.pause(draw(st.booleans()) and may_stop)
            case 7:
                _change_tool(draw, b, backwards, to_zero)
                b.rapid(draw(_LENGTH), draw(_LENGTH))
            case _:
                cycle = draw(cycles(names))
                for _ in range(draw(st.integers(1, 3))):
                    b.drill(draw(_LENGTH), draw(_LENGTH), cycle, feed=draw(_FEED))
    b.rapid(z=60.0)
    b.spindle(0.0)
    b.end()
    return b.build()


def assert_same_rows(read: Toolpath, meant: Toolpath, step: float, pecks: int = 1, dwell_step: float = 0.001) -> None:
    """Compare row by row, but for tool length offsets and rapids that go nowhere: each number within half of the last
    decimal, `step` mm.

    The centre of an arc may be off by twice that (start and offset are both rounded), a peck by a whole step, and a
    height in a pecked hole by `pecks` half steps.
    """
    read_rows, meant_rows = _rows(read, step), _rows(meant, step)
    assert [m.kind for m in read_rows] == [m.kind for m in meant_rows]
    half = step / 2 + 1e-9
    for one, other in zip(read_rows, meant_rows, strict=True):
        np.testing.assert_allclose(one.end, other.end, rtol=0, atol=half * pecks, equal_nan=True)
        tolerance = {Kind.DWELL: dwell_step / 2, Kind.SPINDLE: 0.5}.get(one.kind, step / 120)
        assert abs(one.value - other.value) <= tolerance + 1e-9, (one, other)
        if one.kind is Kind.DRILL:
            _same_cycle(read.cycles[one.ref], meant.cycles[other.ref], half)
        elif one.kind in (Kind.ARC_CW, Kind.ARC_CCW):
            a, c = read.arcs[one.ref], meant.arcs[other.ref]
            assert (a.plane, a.turns) == (c.plane, c.turns)
            np.testing.assert_allclose(a.center[:2], c.center[:2], rtol=0, atol=2 * half)
        else:
            assert one.ref == other.ref


def _same_cycle(one: DrillCycle, other: DrillCycle, half: float) -> None:
    assert (one.name, one.to_initial) == (other.name, other.to_initial)
    assert abs(one.r_plane - other.r_plane) <= half and abs(one.bottom - other.bottom) <= half
    assert abs(one.peck - other.peck) <= 3 * half and abs(one.dwell - other.dwell) <= 0.005


def _rows(path: Toolpath, step: float) -> list[Motion]:
    """Return the rows that count: a cycle that is written out need not go to where the tool stands."""
    rows, here = [], np.full(3, np.inf)
    for row in path:
        end = np.array(row.end)
        stays = (
            np.array_equal(np.isnan(end), np.isnan(here)) and np.nanmax(np.abs(end - here), initial=0.0) < 1.2 * step
        )
        if row.kind is not Kind.OFFSET and not (row.kind is Kind.RAPID and stays):
            rows.append(row)
        if np.isfinite(end).any():
            here = end
    return rows
