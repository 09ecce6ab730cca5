"""Which line of a program does which row of its plan."""

from __future__ import annotations

import numpy as np

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import DrillCycle, Kind, ToolpathBuilder
from leafcut.report.playback import line_numbers_by_row


def test_every_move_of_a_cycle_has_the_line_that_calls_it() -> None:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 10.0)
    cycle = DrillCycle("G83", r_plane=2.0, bottom=-6.0, peck=3.0)
    for x in (5.0, 9.0):
        path.drill(x, 0.0, cycle, feed=5.0)
    text = "G21 G90 G17\nG0 X0 Y0 Z10\nG99 G83 X5 Y0 Z-6 R2 Q3 F300\nX9\nG80\nM2\n"
    rows = expand_cycles(path.build())
    line = line_numbers_by_row(rows, interpret_own_program(text, load_dialect("linuxcnc")))
    assert line[0] == 2 and set(line[rows.end[:, 0] == 5.0]) == {3} and set(line[rows.end[:, 0] == 9.0]) == {4}


def test_what_the_controller_does_by_itself_has_the_line_of_what_comes_next() -> None:
    """A plan with the torch's heights and dwell, and a program that leaves them to the controller."""
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0)
    path.rapid(z=4.0)
    path.dwell(0.5)
    path.feed(z=1.5, feed=50.0)
    path.feed(x=30.0, feed=40.0)
    text = "G21 G90\n(a sheet)\nG0 X0 Y0\nM3\nG1 X30 F2400\nM5\nM2\n"
    assert line_numbers_by_row(path.build(), interpret_own_program(text, load_dialect("linuxcnc"))).tolist() == [
        3,
        5,
        5,
        5,
        5,
    ]


def test_rounded_places_are_found_again_and_there_and_back_is_kept_apart() -> None:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 1.0)
    for x in (10.00049, 0.0, 10.00049, 0.0):
        path.feed(x=x, feed=10.0)
    text = "G21 G90\nG0 X0 Y0 Z1\nG1 X10 F600\nX0\nX10\nX0\nM2\n"
    rows = path.build()
    assert line_numbers_by_row(rows, interpret_own_program(text, load_dialect("linuxcnc")))[
        rows.kind == Kind.FEED
    ].tolist() == [
        3,
        4,
        5,
        6,
    ]


def test_a_plan_that_goes_nowhere_has_no_lines() -> None:
    path = ToolpathBuilder()
    path.end()
    assert not np.any(line_numbers_by_row(path.build(), interpret_own_program("M2\n", load_dialect("linuxcnc"))))
