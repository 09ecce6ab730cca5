"""When a toolpath is where: the time of every row."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.model.machine import Machine
from leafcut.model.toolpath import DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.timing.toolpath import measure_toolpath, time_rows

MILL = Machine(
    name="test-mill",
    description="a mill of no particular make",
    controller="fanuc",
    rapid_velocity=(100.0, 100.0, 100.0),
    acceleration=(1000.0, 1000.0, 1000.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -300.0),
    travel_max=(700.0, 400.0, 0.0),
    tool_change_s=7.0,
    spindle_start_s=2.0,
)


def drilled() -> Toolpath:
    """Return a change of tool, a start with a dwell, two holes by a cycle, and a dwell for its own sake."""
    path = ToolpathBuilder()
    path.tool(1)
    path.spindle(1000.0)
    path.dwell(3.0)
    path.rapid(0.0, 0.0, 10.0)
    cycle = DrillCycle("G81", r_plane=2.0, bottom=-6.0)
    path.drill(10.0, 0.0, cycle, feed=4.0)
    path.drill(20.0, 0.0, cycle, feed=4.0)
    path.dwell(1.5)
    path.end()
    return path.build()


def test_the_rows_of_a_toolpath_together_take_the_time_that_is_measured() -> None:
    path = drilled()
    assert time_rows(path, MILL).seconds.sum() == pytest.approx(measure_toolpath(path, MILL).time_s, rel=1e-12)


def test_what_makes_the_machine_stand_takes_its_time_once() -> None:
    """7 s for the tool; 3 s for the start, of which the dwell is the wait; 1.5 s for the other dwell."""
    timed = time_rows(drilled(), MILL)
    by_source = np.bincount(timed.source, weights=timed.seconds)
    assert by_source[[0, 1, 2, 6]].tolist() == [7.0, 3.0, 0.0, 1.5]


def test_the_moves_of_a_cycle_come_from_its_row() -> None:
    """A hole: over it, down to R, feed to the bottom, up to R; the feed of 8 mm at 4 mm/s takes at least 2 s."""
    timed = time_rows(drilled(), MILL)
    feeds = np.flatnonzero(timed.path.kind == Kind.FEED)
    assert timed.source[feeds].tolist() == [4, 5]
    assert (timed.seconds[feeds] > 2.0).all() and (timed.seconds[feeds] < 2.1).all()
    assert timed.path.end[feeds, 2].tolist() == [-6.0, -6.0]
