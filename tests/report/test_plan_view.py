"""Toolpaths seen from above."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Arc, DrillCycle, ToolpathBuilder
from leafcut.report.plan_view import plan_view

CYCLES = [
    DrillCycle("G81", 2.0, -6.0),
    DrillCycle("G83", 2.0, -6.0, peck=1.5),
    DrillCycle("G73", 2.0, -6.0, peck=1.5),
    DrillCycle("G82", 2.0, -6.0, to_initial=True, dwell=0.5),
    DrillCycle("G85", 2.0, -6.0),
]


def lengths(segments):
    return np.hypot(*(segments[:, 1] - segments[:, 0]).T)


@pytest.mark.parametrize("cycle", CYCLES, ids=lambda c: c.name)
def test_a_cycle_and_its_written_out_moves_look_the_same_from_above(cycle):
    path = ToolpathBuilder()
    path.rapid(z=10.0)
    for x, y in [(0.0, 0.0), (30.0, 40.0), (30.0, 0.0)]:
        path.drill(x, y, cycle, feed=3.0)
    for seen in (plan_view(path.build()), plan_view(expand_cycles(path.build()))):
        assert seen.stops.tolist() == [[0.0, 0.0], [30.0, 40.0], [30.0, 0.0]]
        assert lengths(seen.rapids).tolist() == [50.0, 40.0]
        assert len(seen.cuts) == 0


def test_a_slot_in_two_passes_is_one_stop_and_two_cuts():
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 10.0)
    path.rapid(3.0, 4.0)
    for depth, x in ((-1.0, 13.0), (-2.0, 3.0)):
        path.feed(z=depth, feed=2.0)
        path.feed(x, 4.0, feed=5.0)
    path.rapid(z=10.0)
    seen = plan_view(path.build())
    assert seen.stops.tolist() == [[3.0, 4.0]]
    assert lengths(seen.cuts).tolist() == [10.0, 10.0]
    assert lengths(seen.rapids).tolist() == [5.0]


def test_two_tools_at_one_hole_are_two_stops():
    path = ToolpathBuilder()
    path.rapid(5.0, 5.0, 10.0)
    for number in (1, 2):
        path.tool(number)
        path.feed(z=-1.0, feed=2.0)
        path.rapid(z=10.0)
    assert plan_view(path.build()).stops.tolist() == [[5.0, 5.0], [5.0, 5.0]]


def test_nothing_is_drawn_from_or_to_a_place_that_is_not_known():
    path = ToolpathBuilder()
    path.rapid(10.0, 10.0)
    path.rapid(20.0, 10.0)
    path.machine(z=0.0)
    path.rapid(30.0, 10.0)
    path.machine(x=0.0, y=0.0)
    path.rapid(x=99.0)
    path.rapid(50.0, 50.0)
    path.rapid(50.0, 60.0)
    assert plan_view(path.build()).rapids.tolist() == [
        [[10.0, 10.0], [20.0, 10.0]],
        [[20.0, 10.0], [30.0, 10.0]],
        [[50.0, 50.0], [50.0, 60.0]],
    ]


def test_an_arc_is_as_long_as_its_formula_and_keeps_to_its_circle():
    """A quarter circle of radius 10 clockwise from (0, 10) about (0, 0) ends at (10, 0): π/2 · 10 mm long."""
    path = ToolpathBuilder()
    path.rapid(0.0, 10.0, 0.0)
    path.arc(True, (10.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=5.0)
    cuts = plan_view(path.build()).cuts
    assert math.isclose(lengths(cuts).sum(), math.pi / 2 * 10, rel_tol=1e-2)
    assert np.allclose(np.hypot(*cuts.reshape(-1, 2).T), 10.0)
    assert (cuts > -1e-9).all()
    assert cuts[-1, 1].tolist() == pytest.approx([10.0, 0.0])


def test_a_helix_of_a_million_turns_stays_small():
    path = ToolpathBuilder()
    path.rapid(10.0, 0.0, 0.0)
    path.arc(False, (0.0, 10.0, -5.0), Arc((0.0, 0.0, 0.0), turns=1_000_000), feed=5.0)
    cuts = plan_view(path.build()).cuts
    assert len(cuts) < 200
    assert cuts[-1, 1].tolist() == pytest.approx([0.0, 10.0], abs=1e-3)
    assert cuts.min() == pytest.approx(-10.0, abs=0.05)


def test_what_a_beam_does_while_it_is_off_is_a_way() -> None:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0)
    path.feed(30.0, 40.0, feed=9.0)
    path.spindle(100.0)
    path.feed(30.0, 50.0, feed=9.0)
    path.spindle(0.0)
    path.feed(30.0, 70.0, feed=9.0)
    path.spindle(100.0)
    path.feed(31.0, 70.0, feed=9.0)
    seen = plan_view(path.build(), beam=True)
    assert lengths(seen.cuts).tolist() == [10.0, 1.0]
    assert lengths(seen.rapids).tolist() == [50.0, 20.0]
    assert seen.stops.tolist() == [[30.0, 40.0], [30.0, 70.0]]
    mill = plan_view(path.build())
    assert len(mill.rapids) == 0


def test_every_cut_has_its_tool() -> None:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 0.0)
    path.tool(7)
    path.feed(10.0, 0.0, feed=9.0)
    path.tool(8)
    path.arc(False, (-10.0, 0.0, 0.0), Arc((0.0, 0.0, 0.0)), feed=5.0)
    path.feed(0.0, 0.0, feed=9.0)
    seen = plan_view(path.build())
    assert len(seen.cut_tool) == len(seen.cuts)
    assert set(seen.cut_tool[lengths(seen.cuts) > 9.0].tolist()) == {7, 8}
    assert Counter(seen.cut_tool.tolist())[7] == 1


def test_an_empty_toolpath_has_an_empty_trace():
    seen = plan_view(ToolpathBuilder().build())
    assert len(seen.all_points) == 0
