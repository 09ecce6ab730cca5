"""Blocks after the last task of a section that hold it in place; and outlines of several cuts."""

from __future__ import annotations

import pytest

from leafcut.processes.program.plan.resequencing import find_sequence
from rewriting import program_of

HEAD = "G21 G90 / S1000 M3 / G0 Z5 / X-9 Y-9 / "
FOOT = " / G0 Z20 / M5 / M2"
HOLE = "G0 X{} Y0 / G1 Z-1 F100 / G0 Z5"


def pieces(text: str, process: str = "auto") -> list[int]:
    """Return the number of tasks in every section."""
    return [len(s.pieces) for s in find_sequence(program_of(text), process=process).sections]


@pytest.mark.parametrize(
    "behind, free",
    [
        ("G0 X90 Y0", 3),
        ("M8", 3),
        ("M8 / G0 X90 Y0 / G1 Z-1 / G0 Z5", 3),
        ("M8 / G1 Z-2 / G0 Z5", 2),
        ("M8 / G0 Z2 / G1 Z-2 / G0 Z5", 2),
    ],
)
def test_a_cut_that_goes_on_from_the_last_piece_holds_it(behind: str, free: int) -> None:
    """Three holes; the following block leaves by rapid, or descends at the position of the third hole."""
    text = HEAD + " / ".join(HOLE.format(x) for x in (0, 10, 20)) + f" / {behind}" + FOOT
    assert pieces(text) == [free]


@pytest.mark.parametrize(
    "behind, free",
    [
        ("G0 Z15 / X90 Y0 / G1 Z-1", 2),
        ("G99 G81 X90 Y0 Z-1 R9", 2),
        ("G99 G81 X90 Y0 Z-1 R4", 3),
        ("G0 Z15 / X0 Y0 / M1", 3),
        ("G0 Z15 / X0 Y0", 3),
    ],
)
def test_a_rise_behind_a_block_that_stays_holds_the_piece_below_if_work_follows(behind: str, free: int) -> None:
    """The reason of the rise is unknown, perhaps an obstacle; before a stop and at the end, tools rise."""
    text = HEAD + " / ".join(HOLE.format(x) for x in (0, 10, 20)) + f" / M8 / {behind}" + FOOT
    assert pieces(text) == [free]


def test_a_dwell_that_follows_the_last_cut_at_once_holds_it() -> None:
    """The cut ends at height 5, and so the tool is up: the dwell behind the M8 is at its place."""
    cut = "G0 X{} Y0 / G1 Z-1 F100 / G1 X{} / G1 Z5"
    text = HEAD + " / ".join(cut.format(x, x + 5) for x in (0, 10, 20)) + " / M8 / {}G0 X90 Y0" + FOOT
    assert pieces(text.format("")) == [3]
    assert pieces(text.format("G4 P1 / ")) == [2]


def test_the_rise_that_ends_radius_compensation_stays_with_its_cut() -> None:
    """Unlike other rises, its end depends on the cut before it; a dwell after it stays in place."""
    cut = "G0 X{} Y0 / G1 Z{} F100 / G41 D1 / G1 X{} Y5 / G40 / G0 Z5"
    cuts = [cut.format(x, z, x + 5) for x, z in ((0, 5), (20, -1), (40, -1))]
    section = find_sequence(program_of(HEAD + " / ".join(cuts) + FOOT)).sections[0]
    assert [c.line for c in section.pieces] == [5, 11, 17]
    assert pieces(HEAD + " / ".join(cuts) + " / G4 P1 / M1 / G0 X9 Y9" + FOOT) == [2]


def test_a_dwell_behind_a_stop_belongs_to_the_stop() -> None:
    """M1 and then a dwell: the tool waits for a person, wherever it is."""
    text = HEAD + " / ".join(HOLE.format(x) for x in (0, 10, 20)) + " / M1 / G4 P1 / G0 X90 Y0 / G1 Z-1 / G0 Z5" + FOOT
    assert pieces(text) == [3]
    assert find_sequence(program_of(text)).sections[0].end == (90, 0)


def test_an_outline_cut_in_two_pieces_encloses_what_lies_inside() -> None:
    """A square of 10 mm as two open halves, which touch and keep their order, and a small cut in it, made first."""
    cuts = [[(4, 4), (6, 4), (6, 6)], [(0, 0), (10, 0), (10, 10)], [(0, 0), (0, 10), (10, 10)], [(30, 0), (40, 0)]]
    text = "G21 G90 / G0 X-5 Y-5 / "
    for (x, y), *places in cuts:
        text += f"G0 X{x} Y{y} / M3 S500 / " + "".join(f"G1 X{a} Y{b} F900 / " for a, b in places) + "M5 / "
    section = find_sequence(program_of(text + "G0 X0 Y0 / M2"), process="laser").sections[0]
    assert len(section.pieces) == 4
    assert section.precedence.tolist() == [[0, 1], [1, 2]]


def test_cuts_behind_a_rapid_in_a_piece_are_not_joined_to_those_before_it() -> None:
    """The piece cuts at X0 and, after a low way across, at X20; between them, at X10, a hole is free of it."""
    text = "G0 X0 Y0 / G1 Z-1 F100 / Y5 / G0 Z1 / X20 Y5 / G1 Z-1 / Y0 / G0 Z5 / G0 X10 Y2.5 / G1 Z-1 / G0 Z5"
    text += " / G0 X60 Y0 / G1 Z-1 / G0 Z5"
    section = find_sequence(program_of(HEAD + text + FOOT)).sections[0]
    assert len(section.pieces) == 3
    assert section.precedence.tolist() == []


def test_a_feed_without_power_keeps_its_order_with_what_it_crosses() -> None:
    """Under M4 S0 the beam is on, with no power: the third cut goes back over the place of the second."""
    cut = "G0 X{} Y0 / G1 X{} S500 F800"
    text = (
        "G21 G90 / M4 S0 / " + " / ".join(cut.format(x, x + 5) for x in (0, 10, 20)) + " / S0 X12 / G0 X0 Y9 / M5 / M2"
    )
    section = find_sequence(program_of(text)).sections[0]
    assert len(section.pieces) == 3
    assert section.precedence.tolist() == [[1, 2]]


def test_a_full_circle_goes_sideways() -> None:
    """It ends at its start; a program that consists of circles is not a drilling program."""
    circle = "G0 X{} Y0 / G1 Z-1 F100 / G2 I3 J0 F300 / G0 Z5"
    text = HEAD + " / ".join(circle.format(x) for x in (0, 10, 20)) + FOOT
    assert find_sequence(program_of(text)).process == "mill"


def test_a_dwell_behind_a_canned_hole_divides_as_it_does_behind_a_rise() -> None:
    """The cycle has risen when the tool waits: the reason is unknown."""
    cycle = "G99 G81 X{} Y0 Z-1 R1 F100"
    holes = [cycle.format(x) for x in (0, 10, 20, 30, 40, 50)]
    assert pieces(HEAD + " / ".join(holes) + " / G80" + FOOT) == [6]
    assert pieces(HEAD + " / ".join([*holes[:3], "G4 P1", *holes[3:]]) + " / G80" + FOOT) == [2, 3]
