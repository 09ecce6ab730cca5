"""Which cuts can be reversed; every program is worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.model.problem import Metric
from leafcut.processes.program.plan.resequencing import build_problem, find_sequence, tasks_from_nodes
from rewriting import program_of

MILL = "G21 G90 / T1 M6 / S1000 M3 / G0 Z5 / {} / G0 Z5 / X90 Y90 / G1 Z-1 F50 / X99 F200 / G0 Z5 / M5 / M2"
LASER = "G21 G90 / G0 X90 Y0 / M3 S500 / G1 X99 F600 / M5 / {} / M5 / G0 X0 Y0 / M2"


def turns(text: str) -> list[bool]:
    """Return for every task whether it may be reversed; the first or last task is a plain cut of the frame."""
    sections = find_sequence(program_of(text), allow_reverse=True).sections
    return [piece.reversible for section in sections for piece in section.pieces]


OPEN = {
    "one line": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200",
    "an arc": "G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 F200",
    "an arc by its radius": "G0 X0 Y0 / G1 Z-1 F50 / G3 X4 Y2 R9 F200",
    "lines and arcs": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / G2 X9 I2 / G1 X20",
    "down at rapid first": "G0 X0 Y0 / Z1 / G1 Z-1 F50 / X5 F200 / Y5",
    "another feed in the middle only": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / Y5 F90 / X9 F200 / Y9",
    "up at feed first": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / G1 Z1",
    "the place said again": "G0 X0 Y0 / X0 Y0 Z1 / G1 Z-1 F50 / X5 F200",
    "the level said in every block": "G0 X0 Y0 / G1 Z-1 F50 / X5 Z-1 F200 / Y5 Z-1",
}
STAYS = {
    "a hole": "G0 X0 Y0 / G1 Z-1 F50",
    "closed": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / Y5 / X0 / Y0",
    "as good as closed": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / Y5 / X0 / Y0.5",
    "a full circle": "G0 X0 Y0 / G1 Z-1 F50 / G2 I5 F200",
    "a way in to a closed one": "G0 X-9 Y-9 / G1 Z-1 F50 / X0 Y0 F200 / X5 / Y5 / X0 / Y0",
    "it crosses itself": "G0 X0 Y0 / G1 Z-1 F50 / X9 F200 / Y9 / X5 / Y-9",
    "there and back": "G0 X0 Y0 / G1 Z-1 F50 / X9 F200 / X3",
    "it sinks": "G0 X0 Y0 / G1 Z-1 F50 / X9 Z-2 F200",
    "it goes down on its way": "G0 X0 Y0 / G1 X3 Z-1 F50 / X9 F200",
    "two levels": "G0 X0 Y0 / G1 Z-1 F50 / X9 F200 / Z-2 / Y9",
    "a slow way in": "G0 X0 Y0 / G1 Z-1 F50 / X1 F90 / X9 F200 / Y9",
    "a slow way out": "G0 X0 Y0 / G1 Z-1 F50 / X9 F200 / Y8 / Y9 F90",
    "an arc to lead in": "G0 X0 Y0 / G1 Z-1 F50 / G2 X2 I1 F200 / G1 X9 / Y9",
    "an arc to lead out": "G0 X0 Y0 / G1 Z-1 F50 / X9 F200 / Y8 / G2 X12 I1.5",
    "a dwell": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / G4 P1 / X9",
    "another speed": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / S1100 X9 / S1000",
    "a remark that says where": "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 (to X5)",
    "time for a feed": "G0 X0 Y0 / G1 Z-1 F50 / G93 X5 F4 / G94",
    "a parameter": "#1=5 / G0 X0 Y0 / G1 Z-1 F50 / X#1 F200",
    "a turn in space": "G0 X0 Y0 / G1 Z-1 F50 / G18 G2 X4 I2 F200 / G17",
    "an arc back along itself": "G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 F200 / G1 Y5 / G3 X9 R9",
    "many turns": "G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 P3 F200",
    "steps": "G0 X0 Y0 / G1 Z-1 F50 / G91 X4 F200 / G90",
}


@pytest.mark.parametrize("body", OPEN.values(), ids=OPEN.keys())
def test_an_open_cut_at_one_depth_may_be_turned(body: str) -> None:
    assert turns(MILL.format(body)) == [True, True]


@pytest.mark.parametrize("body", STAYS.values(), ids=STAYS.keys())
def test_a_cut_that_shows_a_direction_stays(body: str) -> None:
    assert [*turns(MILL.format(body)), False][0] is False


def test_without_the_option_nothing_is_turned() -> None:
    program = program_of(MILL.format(OPEN["one line"]))
    assert not any(c.reversible for s in find_sequence(program).sections for c in s.pieces)


@pytest.mark.parametrize(
    "body, expected",
    [
        ("G0 X0 Y0 / M3 S500 / G1 X9 F600", True),
        ("G0 X0 Y0 / M4 / G1 X9 S300 F600 / Y9", True),
        ("G0 X0 Y0 / M3 S500 / G1 X9 F600 / Y9 S400", False),
        ("G0 X0 Y0 / M3 S500 / G4 P0.3 / G1 X9 F600", False),
        ("G0 X0 Y0 / M3 S500 / G1 X9 F600 / M5 / M3 / Y9", False),
        ("G0 X0 Y0 / M3 S500 / G1 X9 F600 / Y9 / X0 / Y0", False),
    ],
)
def test_open_lines_of_a_laser_may_be_turned_where_its_power_is_the_same(body: str, expected: bool) -> None:
    assert turns(LASER.format(body)) == [True, expected]


def test_the_tool_must_come_as_high_as_it_leaves() -> None:
    """It comes to the first cut at Z20 and leaves it at Z5."""
    text = MILL.replace("G0 Z5 / {}", "G0 Z20 / {}")
    assert turns(text.format(OPEN["one line"])) == [False, True]


def test_how_many_may_be_turned_is_said() -> None:
    issues = find_sequence(program_of(MILL.format(OPEN["one line"])), allow_reverse=True).issues
    assert [i.message for i in issues if i.code == "L504"] == ["2 cuts can be reversed"]
    issues = find_sequence(program_of("G21 G90 / G99 G81 X0 Y0 Z-1 R1 F9 / X9 / M2"), allow_reverse=True).issues
    assert [i.message for i in issues if i.code == "L504"] == ["no cut can be reversed"]


def test_a_cut_that_may_be_turned_is_a_cluster_of_two_nodes() -> None:
    text = MILL.format("{0} / G0 Z5 / X30 Y0 / G1 Z-1 / {1}")
    text = text.format(OPEN["one line"], "X35 F200 / Y5 / X30 / Y0")
    (section,) = find_sequence(program_of(text), allow_reverse=True).sections
    problem = build_problem(section, Metric(), (0.0, 0.0), None)
    assert problem.cluster.tolist() == [0, 1, 2, 0, 2]
    assert problem.entry.tolist() == [[0, 0], [30, 0], [90, 90], [5, 0], [99, 90]]
    assert problem.exit.tolist() == [[5, 0], [30, 0], [99, 90], [0, 0], [90, 90]]
    assert tasks_from_nodes(section, np.array([4, 1, 3])).tolist() == [~2, 1, ~0]


def test_an_arc_with_the_beam_off_stays_behind_what_brings_the_tool_to_its_begin() -> None:
    """It is defined from the current position; a line with the beam off leads to its end from anywhere."""
    for way in ("G3 X12 Y5 I1.5 J2.5", "G1 X12 Y5"):
        text = LASER.format(f"G0 X0 Y0 / M3 / G1 X9 F600 / M5 / {way} / M5 / G0 X20 Y0 / M3 / G1 X29")
        program = program_of(text)
        (section,) = find_sequence(program).sections
        piece = section.pieces[1]
        said = [program.lines[int(program.line[b]) - 1].strip() for b in range(piece.begin, piece.end)]
        assert (way in said) == (way[:2] == "G3"), said
