"""A toolpath played row by row."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leafcut
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.machine import Machine
from leafcut.model.outcome import Outcome
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.report.plan_view import plan_view
from leafcut.report.playback import Activity, outcome_playback, playback_of_path
from leafcut.timing.toolpath import measure_toolpath

MILL = Machine(
    name="test-mill",
    description="a mill of no particular make",
    controller="fanuc",
    rapid_velocity=(100.0, 100.0, 100.0),
    acceleration=(1000.0, 1000.0, 1000.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -300.0),
    travel_max=(700.0, 400.0, 0.0),
)


def started() -> ToolpathBuilder:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 5.0, line=1)
    return path


def test_the_rows_are_where_the_tool_is_after_them_and_last_as_long_as_the_toolpath() -> None:
    path = started()
    path.dwell(2.0, line=2)
    path.feed(x=30.0, feed=10.0, line=3)
    path.rapid(y=40.0, line=4)
    built = path.build()
    rows = playback_of_path(built, MILL)
    assert rows.place.tolist() == [[0, 0, 5], [0, 0, 5], [30, 0, 5], [30, 40, 5]]
    assert rows.activity.tolist() == [Activity.RAPID, Activity.STAND, Activity.CUT, Activity.RAPID]
    assert rows.line.tolist() == [1, 2, 3, 4]
    assert rows.seconds.sum() == pytest.approx(measure_toolpath(built, MILL).time_s, rel=1e-12)


def test_a_flat_arc_is_its_circle_and_begins_where_the_tool_is() -> None:
    """A quarter clockwise from (0, 0) round (10, 0) ends above the centre, at (10, 10)."""
    path = started()
    path.arc(True, (10.0, 10.0, 5.0), Arc((10.0, 0.0, 0.0)), feed=5.0)
    rows = playback_of_path(path.build(), MILL)
    x, y, radius, start, sweep = rows.arc[0]
    assert rows.arc_row.tolist() == [1]
    assert (x, y, radius, sweep) == pytest.approx((10.0, 0.0, 10.0, -math.pi / 2))
    assert (x + radius * math.cos(start), y + radius * math.sin(start)) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_an_upright_arc_is_seen_as_chords_that_share_its_time() -> None:
    """A half circle in the plane XZ from x 0 to x 20 rises by 10 mm on its way."""
    path = started()
    path.arc(False, (20.0, 0.0, 5.0), Arc((10.0, 0.0, 5.0), plane=18), feed=5.0, line=2)
    built = path.build()
    rows = playback_of_path(built, MILL)
    on_arc = rows.line == 2
    assert (rows.activity[on_arc] == Activity.CUT).all() and on_arc.sum() > 10
    away = np.hypot(rows.place[on_arc, 0] - 10.0, rows.place[on_arc, 2] - 5.0)
    assert away == pytest.approx(10.0)
    assert abs(rows.place[on_arc, 2] - 5.0).max() == pytest.approx(10.0)
    assert rows.place[-1].tolist() == [20.0, 0.0, 5.0]
    assert rows.seconds.sum() == pytest.approx(measure_toolpath(built, MILL).time_s, rel=1e-12)


def test_stops_are_the_places_that_the_drawing_of_the_report_numbers() -> None:
    path = started()
    cycle = DrillCycle("G83", r_plane=2.0, bottom=-6.0, peck=2.0)
    for x in (10.0, 20.0, 30.0):
        path.drill(x, 7.0, cycle, feed=5.0)
    path.rapid(x=50.0, y=0.0)
    path.feed(z=-1.0, feed=5.0)
    path.feed(x=60.0, feed=5.0)
    path.feed(x=70.0, feed=5.0)
    built = path.build()
    rows = playback_of_path(built, MILL)
    assert rows.place[rows.stops - 1, :2].tolist() == plan_view(built).stops.tolist()


def test_a_beam_that_is_off_is_dark_at_feed() -> None:
    path = started()
    path.spindle(1000.0)
    path.feed(x=10.0, feed=50.0)
    path.spindle(0.0)
    path.feed(x=20.0, feed=50.0)
    doing = playback_of_path(path.build(), MILL, beam=True).activity.tolist()
    assert doing == [Activity.RAPID, Activity.STAND, Activity.CUT, Activity.STAND, Activity.DARK]


def test_an_arc_of_a_beam_that_is_off_is_no_cut_and_lies_where_it_is_gone_along() -> None:
    path = started()
    path.spindle(1000.0)
    path.spindle(0.0)
    path.feed(x=10.0, feed=50.0)
    path.arc(True, (20.0, 0.0, 5.0), Arc((15.0, 0.0, 5.0)), feed=50.0)
    built = path.build()
    rows = playback_of_path(built, MILL, beam=True)
    gone = rows.activity != Activity.STAND
    assert set(rows.activity[gone].tolist()) == {Activity.RAPID, Activity.DARK}
    assert len(rows.arc_row) == len(rows.stops) == 0
    assert np.hypot(*(rows.place[4:, :2] - (15.0, 0.0)).T) == pytest.approx(5.0)
    assert rows.place[:, 1].max() > 4.9
    assert rows.seconds.sum() == pytest.approx(measure_toolpath(built, MILL).time_s, rel=1e-12)


def test_an_empty_toolpath_has_no_rows() -> None:
    assert len(playback_of_path(Toolpath.of_motions([]), MILL).activity) == 0


def test_a_place_in_machine_coordinates_is_not_known_on_the_part() -> None:
    path = started()
    path.machine(z=0.0)
    rows = playback_of_path(path.build(), MILL)
    assert rows.place[1, :2].tolist() == [0.0, 0.0] and math.isnan(rows.place[1, 2])


def test_a_planned_path_takes_its_lines_from_the_program_that_was_written() -> None:
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 5.0)
    path.feed(x=10.0, feed=10.0)
    planned = path.build()
    text = "(a comment)\nG21 G90 G0 X0 Y0 Z5\nG1 X10 F600\nM2\n"
    outcome = replace(_outcome(planned, text), written=interpret_own_program(text, load_dialect("linuxcnc")))
    rows = outcome_playback(outcome, "after")
    assert rows.line[rows.activity == Activity.CUT].tolist() == [3]
    assert outcome_playback(outcome, "before").line.tolist() == [0, 0]
    read = replace(planned, line=np.array([7, 8], dtype=np.int32))
    assert outcome_playback(replace(outcome, path_after=read, written=None), "after").line.tolist() == [7, 8]


def _outcome(path: Toolpath, text: str) -> Outcome:
    from leafcut.model.part import Part

    cost = measure_toolpath(path, MILL)
    return Outcome(
        Part("p"), MILL, "drill", (), cost, None, cost, path, path, text, "linuxcnc", 1, True, DrillingDetail()
    )


STYLES = Path(__file__).parents[1] / "styles"


@pytest.mark.parametrize("machine", ["linuxcnc-mill", "grbl-3018", "haas-vf2"])
def test_the_player_lasts_as_long_as_the_program_whatever_made_it(machine: str, examples: Path) -> None:
    """The times in all tables agree with the player: the same start, and the same lines of the board."""
    common: dict[str, Any] = {"machine": machine, "preset": "fast", "threads": 1}
    outcomes = [
        leafcut.optimize(examples / "plate_8x8_10.dxf", process="drill", thickness=5, spindle_speed=3000, **common),
        leafcut.optimize(STYLES / "vcarve_grbl_peck.nc", **common),
    ]
    for outcome in outcomes:
        times = {"before": outcome.before, "after": outcome.after}
        for which in ("before", "after"):
            rows = outcome_playback(outcome, which)
            assert rows.seconds.sum() == pytest.approx(times[which].time_s, rel=1e-9)


def test_the_player_of_a_program_lasts_as_long_as_its_simulation() -> None:
    """On a GRBL board the time depends on the length of the lines and on the move to the first place."""
    for machine in ("grbl-3018", "linuxcnc-mill"):
        found = leafcut.simulate(STYLES / "vcarve_grbl_peck.nc", machine=machine)
        rows = playback_of_path(found.run, found.machine, measured=found.measure)
        assert rows.seconds.sum() == pytest.approx(found.measure.time_s, rel=1e-9)
