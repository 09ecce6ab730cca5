"""What of a program is sent, what of it is refused, where it is by its place, and how it goes on from a line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.read.machine import load_machine
from leafcut.sender.answers import Alarm, Greeting, InvalidAnswer, Refused, Report, Status
from leafcut.sender.character_counting import SentLine
from leafcut.sender.grbl import parse_grbl_line
from leafcut.sender.job import SendJob, job_from_text
from leafcut.sender.line_tracking import LineTracker
from leafcut.sender.lines import Pause, steps_from_lines
from leafcut.sender.resuming import first_line_of_hole, resuming_steps

GRBL = load_dialect("grbl")
MACHINE = load_machine("grbl-3018")
HEAD = "G21 G90 G94 G17\nG0 Z5\nM3 S900\n"


def job(text: str, machine: str = "grbl-3018") -> SendJob:
    known = load_machine(machine)
    return job_from_text(HEAD + text + "\nM30\n", "part.nc", known, load_dialect(known.controller), None)


def run(text: str) -> Toolpath:
    return interpret_program(text, GRBL, units="mm").path


def texts(steps: object) -> list[str]:
    return [step.text for step in steps if isinstance(step, SentLine)]  # type: ignore[attr-defined]


def test_comments_blanks_numbers_and_what_stands_behind_the_end_are_not_sent() -> None:
    lines = ["%", "(a part)", "N10 g1 x+1.5 Y2 (here) F100 ; there", "/G0 Z5", "", "T2", "M30", "G0 X9"]
    steps = steps_from_lines(lines, GRBL, "part.nc")
    assert [(step.text, step.number) for step in steps if isinstance(step, SentLine)] == [
        ("G1X1.5Y2F100", 3),
        ("G0Z5", 4),
        ("T2", 6),
        ("M30", 7),
    ]


def test_only_a_tool_chosen_right_above_makes_of_a_pause_a_change() -> None:
    lines = ["T1 (3 mm drill)", "M0", "G0 Z5", "M0", "T2 M6", "G0 Z5", "T3", "G0 Z5", "G0 Z6", "G0 Z7", "M0"]
    pauses = [step for step in steps_from_lines(lines, GRBL, "part.nc") if isinstance(step, Pause)]
    assert [(p.number, p.change, p.tool) for p in pauses] == [
        (2, True, 1),
        (4, False, None),
        (5, True, 2),
        (11, False, None),
    ]
    assert str(pauses[0]) == "line 2: mount tool T1 (3 mm drill)"


@pytest.mark.parametrize(
    "line, told",
    [
        ("G81 X1 Y1 Z-1 R1 F100", r"part\.nc:4: G81 is not a word of grbl; post the program for this controller"),
        ("G38.2 Z-5 F50", "G38.2 is not a word of grbl"),
        ("$130=999", r"part\.nc:4: '=': parameters"),
        ("$H", r"part\.nc:4: unexpected character '\$'"),
        ("$J=G91 X1 F100", r"part\.nc:4: unexpected character '\$'"),
        ("?", r"part\.nc:4: unexpected character '\?'"),
        ("G0 X1 \x18", r"part\.nc:4: unexpected character"),
        ("G0 X1é", r"part\.nc:4"),
        ("G92 X0", r"part\.nc:4: .*not a word|moves the origin"),
        ("G0 A3", r"part\.nc:4: A3 is not a word|A"),
        ("G1 F100 X" + "1" * 5 + "." + "1" * 90, r"part\.nc:4: the line has \d+ characters .* takes 79"),
        ("G1 X5 F100", "part.nc is not sent: L801|L802|part"),
        ("G91\nG0 X1", r"part\.nc:5: X1 is incremental \(G91\), but the position of X before it is unknown"),
    ],
)
def test_what_a_board_must_not_get_is_refused_with_its_line(line: str, told: str) -> None:
    with pytest.raises(LeafcutError, match=told):
        job(f"{line}\nG0 Z-2\nG0 X3 Y3")


@pytest.mark.hazard
def test_a_program_of_another_machine_is_refused() -> None:
    from leafcut.sender.job import read_job

    with pytest.raises(OptionError, match="its controller is linuxcnc; leafcut sends only to GRBL and Marlin boards"):
        read_job("part.nc", "linuxcnc-mill")
    with pytest.raises(ReadError, match="has no moves"):
        job_from_text("G21\nM30\n", "part.nc", MACHINE, GRBL, None)
    with pytest.raises(OptionError, match="L806 spindle speed"):
        job("S20000 M3\nG0 X1 Y1")


def test_holes_are_counted_with_their_pecks_and_milled_plunges_are_none() -> None:
    text = (
        "G0 X1 Y1\nG0 Z1\nG1 Z-1 F100\nG0 Z1\nG0 Z-0.9\nG1 Z-2\nG0 Z5\n"
        "G0 X5 Y5\nG1 Z-1 F100\nG1 X9\nG0 Z5\nG0 X2 Y2\nG1 Z-1\nG0 Z5"
    )
    found = [(h.number, h.x, h.y, h.first, h.last) for h in job(text).holes]
    assert found == [(1, 1.0, 1.0, 4, 9), (2, 2.0, 2.0, 15, 16)]


def test_the_line_is_found_by_the_place_on_straight_moves_and_arcs() -> None:
    text = "G0 X0 Y0\nG1 Z-1 F100\nG1 X10\nG2 X20 Y10 I0 J10\nG3 X10 Y0 I-10 J0\nG0 Z5"
    path = run(HEAD + text + "\nM30")
    tracker = LineTracker(path)
    assert tracker.line_at((5.0, 0.0, -1.0), 4, 9) == 6
    for angle in np.linspace(0.1, 1.4, 9):
        # G2 from (10, 0) about (10, 10) is the long arc: clockwise, over x below 10.
        there = (10 - 10 * math.sin(angle), 10 - 10 * math.cos(angle), -1.0)
        assert tracker.line_at(there, 4, 9) == 7
    assert tracker.line_at((0.0, 0.0, 2.0), 4, 9) == 5
    # Far from every move: assigned to the first possible move.
    assert tracker.line_at((80.0, 80.0, 5.0), 4, 9) == 4


@pytest.mark.hazard
def test_going_on_in_a_cut_comes_down_at_feed_over_its_place_with_the_spindle_on() -> None:
    steps, tool = resuming_steps(job("T3\nG0 X0 Y0\nM8\nG1 Z-1 F100\nG1 X10 F300\nY10\nX0\nG0 Z5"), 9)
    assert tool is None or tool == 3
    assert texts(steps) == [
        "M5",
        "M9",
        "G21G90G94G17G40G49",
        "G54",
        "G0Z5",
        "G0X10Y0",
        "M8",
        "M3S900",
        "G4P2",
        "G1Z-1F300",
        "G21",
        "F300",
        "G17G90",
        "G1Y10",
        "X0",
        "G0Z5",
        "M30",
    ]


def test_going_on_never_comes_down_before_it_is_over_its_place() -> None:
    steps, _ = resuming_steps(job("G0 X0 Y0\nG1 Z-1 F100\nG0 Z5\nG0 X5\nG1 Z-1\nG0 Z5"), 7, height=30.0)
    assert texts(steps)[4:6] == ["G0Z30", "G0X0Y0"]


def test_going_on_in_inches_and_incrementally_keeps_both() -> None:
    text = "G20\nG0 X1 Y1\nG91\nG1 Z-0.3 F10\nG1 X0.5\nX0.5\nG90\nG0 Z0.2"
    steps, _ = resuming_steps(job(text), 9)
    sent = texts(steps)
    assert sent[sent.index("G20") :][:4] == ["G20", "F10", "G17G91", "G1X0.5"]
    assert run("\n".join(sent)).end[-2] == pytest.approx(job(text).program.path.end[-2])


@pytest.mark.parametrize(
    "text, line, told",
    [
        ("G0 X0 Y0\nG1 Z-1 F100", 2, "the tool position before this line is not known"),
        ("G0 X0 Y0\nG1 Z-1 F100", 99, "--from-line 99: the program ends in line 6"),
        ("G0 X0 Y0\nG93\nG1 Z-1 F2\nG1 X5 F3\nG0 Z5", 7, "G93 gives each move a time"),
    ],
)
def test_where_the_state_cannot_be_known_going_on_is_refused(text: str, line: int, told: str) -> None:
    with pytest.raises(OptionError, match=told):
        resuming_steps(job(text), line)


def test_a_hole_that_is_not_there_is_refused() -> None:
    with pytest.raises(OptionError, match="--from-hole 3: the program has 1 hole"):
        first_line_of_hole(job("G0 X0 Y0\nG1 Z-1 F100\nG0 Z5"), 3)


_PLACES = st.tuples(st.integers(0, 40), st.integers(0, 40), st.integers(-8, 4))


@pytest.mark.hazard
@given(
    moves=st.lists(st.tuples(st.sampled_from(["G0", "G1", "", "G91", "G90", "M8", "M9", "F200"]), _PLACES), min_size=3),
    at=st.integers(0, 200),
)
def test_whatever_is_gone_on_with_makes_the_same_moves_from_there(moves, at) -> None:
    """Rapids stay above; read by the interpreter of our own posts' judge, compared by ends, kinds and feeds."""
    lines, z = ["G0 X0 Y0", "G1 Z0 F100", "G0 Z5"], 5
    absolute = True
    for word, (x, y, depth) in moves:
        if word in ("G90", "G91"):
            absolute = word == "G90"
            lines.append(word)
        elif word in ("M8", "M9", "F200"):
            lines.append(word)
        elif word == "G0" and absolute:
            lines += ["G0 Z5", f"X{x} Y{y}"]
            z = 5
        elif absolute:
            lines += [f"G1 Z{min(depth, z)}", f"X{x}", f"Y{y}"]
            z = min(depth, z)
        else:
            lines += ["G1 X0.5", "Y-0.25"]
    whole = job("\n".join([*lines, "G90", "G0 Z5"]))
    line = 5 + at % max(len(lines) - 2, 1)
    try:
        steps, _ = resuming_steps(whole, line)
    except OptionError:
        return
    was, now = whole.program.path, run("\n".join(texts(steps)))
    block = int(np.searchsorted(whole.program.line, line))
    rest = was.end[whole.program.first[block] :]
    same = now.end[len(now) - len(rest) :]
    np.testing.assert_allclose(same, rest, atol=1e-3)
    lead = len(now) - len(rest)
    # The whole approach: up, over, down; never sideways below the top.
    sideways = (now.kind[:lead] <= Kind.ARC_CCW) & np.isfinite(now.end[:lead, :2]).any(axis=1)
    high = now.end[:lead, 2][sideways & (np.abs(now.end[:lead, :2] - now.before[:lead, :2]) > 1e-9).any(axis=1)]
    assert (high >= np.nanmax(was.end[:, 2]) - 1e-9).all()


@pytest.mark.parametrize(
    "line, meant",
    [
        ("error:20", Refused(20)),
        ("ALARM:9", Alarm(9)),
        ("Grbl 1.1h ['$' for help]", Greeting("1.1h", "'$' for help")),
        ("Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]", Greeting("3.7", "FluidNC v3.7.8 (wifi) '$' for help")),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", Greeting("1.1f", "'$' or '$HELP' for help")),
        ("$110=500.000 (x max rate, mm/min)", Report("$110", "500.000")),
        ("[G54:1.000,-2.000,3.000]", Report("G54", "1.000,-2.000,3.000")),
        ("<Idle|WPos:1.000,2.000,3.000|F:0>", Status("Idle", work=(1.0, 2.0, 3.0), feed=0.0)),
        (
            "<Hold:1|MPos:1,2,3,4|Bf:3,9|Pn:XP>",
            Status("Hold", 1, machine=(1.0, 2.0, 3.0), free_blocks=3, free_bytes=9, pins="XP"),
        ),
        ("okk", InvalidAnswer("okk")),
        ("<|>", InvalidAnswer("<|>")),
    ],
)
def test_what_a_controller_says_is_understood(line: str, meant: object) -> None:
    assert parse_grbl_line(line) == meant


@given(st.text(max_size=200))
def test_no_line_of_a_controller_stops_the_reader(line: str) -> None:
    parse_grbl_line(line)
    parse_grbl_line(f"<{line}>")
    parse_grbl_line(f"[G54:{line}]")
    parse_grbl_line(f"[OPT:{line}]")
