"""New speeds and heights in the text of a program: which lines change, and what the following lines restate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import PostError
from leafcut.gcode.program import Program
from leafcut.model.pace import CycleReturn, Lowered, Pace, PaceStretch
from leafcut.model.toolpath import Kind
from leafcut.processes.program.post.pace_writer import with_heights, with_pace, with_returns
from rewriting import program_of

HEAD = "G21 G90 G17 G94 / S6000 M3 / G0 X0 Y0 Z5"
FOOT = "G0 Z20 / M5 / M2"
RAPID = math.inf


def row_of(program: Program, line: int) -> int:
    """Return the row of the path that a line of the program makes."""
    (block,) = np.flatnonzero(program.line == line).tolist()
    return int(program.first[block])


def paced(text: str, stretches: dict[int, list[tuple[float, float]]], longest: int = 255) -> list[str]:
    """Return the lines of a program with new speeds; `stretches` are (share, mm/s) by the number of the line."""
    program = program_of(text)
    rows = {
        row_of(program, line): tuple(PaceStretch(until, speed) for until, speed in parts)
        for line, parts in stretches.items()
    }
    return with_pace(program, Pace(rows), longest).splitlines()


def test_a_program_without_new_speeds_keeps_its_text() -> None:
    text = f"{HEAD} / G1 X10 F600 / {FOOT}"
    assert paced(text, {}) == text.split(" / ")


def test_a_cut_is_divided_at_the_shares_and_its_own_line_ends_it() -> None:
    """10 mm: 2.5 mm at 5 mm/s, a rapid to 7.5 mm, the rest at its own 600 mm/min; the next line takes that feed."""
    text = f"{HEAD} / G1 Z-1 F300 / X10 F600 / Y10 / {FOOT}"
    assert paced(text, {5: [(0.25, 5.0), (0.75, RAPID), (1.0, 10.0)]}) == [
        *HEAD.split(" / "),
        "G1 Z-1 F300",
        "G1 X2.5",
        "G0 X7.5",
        "G1 X10 F600",
        "Y10",
        *FOOT.split(" / "),
    ]


def test_each_part_of_a_slanted_cut_has_all_axes_that_move() -> None:
    """From (0, 0, 5) to (8, 4, -3), half-way: (4, 2, 1). A feed of 7 mm/s is 420 mm/min."""
    text = f"{HEAD} / G1 X8 Y4 Z-3 F600 / X0 / {FOOT}"
    assert paced(text, {4: [(0.5, 7.0), (1.0, 10.0)]})[3:6] == ["G1 X4.0 Y2.0 Z1.0 F420.0", "G1 X8 Y4 Z-3 F600", "X0"]


def test_lines_after_a_new_rapid_restate_motion_and_feed_once() -> None:
    """The rapid keeps its F word, so only the motion changes; a line without F later takes that feed."""
    text = f"{HEAD} / G1 Z-1 F300 / X10 / Y10 / X0 F500 / {FOOT}"
    assert paced(text, {4: [(1.0, RAPID)]})[3:7] == ["G0 Z-1 F300", "G1 X10", "Y10", "X0 F500"]
    # A raised feed is put back in the next line; from then on nothing differs.
    assert paced(text, {5: [(1.0, 6.0)]})[3:8] == ["G1 Z-1 F300", "X10 F360.0", "Y10 F300.0", "X0 F500", "G0 Z20"]


def test_a_line_with_its_own_feed_gets_the_new_number_in_its_place() -> None:
    text = f"{HEAD} / G1 Z-1 F300 (down) / X10 / {FOOT}"
    assert paced(text, {4: [(1.0, 4.0)]})[3:5] == ["G1 Z-1 F240.0 (down)", "X10 F300.0"]


@pytest.mark.parametrize(
    ("speed", "word"),
    [
        (12.3456, "F740.0"),
        (0.123456, "F7.4"),
        (1.9999, "F119.0"),
        (0.0123456, "F0.74"),
        (205.76, "F12345.0"),
        (17.4, "F1044.0"),
    ],
)
def test_a_feed_is_rounded_down_to_three_figures(speed: float, word: str) -> None:
    """Never up: 12.3456 mm/s are 740.736 mm/min."""
    text = f"{HEAD} / G1 Z-1 F300 / X10 / {FOOT}"
    assert paced(text, {5: [(1.0, speed)]})[4] == f"X10 {word}"


def test_in_inches_lengths_have_five_decimals_and_feeds_are_inches_per_minute() -> None:
    """A third of 1 in; 12.7 mm/s are 30 in/min. The program's own 20 in/min are 8.466… mm/s."""
    text = f"{HEAD.replace('G21', 'G20')} / G1 X1 F20 / Y1 / {FOOT}"
    own = 20 * 25.4 / 60
    assert paced(text, {4: [(1 / 3, 12.7), (1.0, own)]})[3:6] == ["G1 X0.33333 F30.0", "G1 X1 F20", "Y1"]
    millimetres = f"{HEAD} / G1 X1 F600 / {FOOT}"
    assert paced(millimetres, {4: [(1 / 3, 5.0), (1.0, 10.0)]})[3:5] == ["G1 X0.3333 F300.0", "G1 X1 F600"]


def test_a_feed_in_inches_is_replaced_in_its_place_and_restored_after_it() -> None:
    """6.35 mm/s are 15 in/min."""
    text = f"{HEAD.replace('G21', 'G20')} / G1 X1 F20 / Y1 / {FOOT}"
    assert paced(text, {4: [(1.0, 6.35)]})[3:5] == ["G1 X1 F15.0", "Y1 F20.0"]
    assert paced(text, {5: [(1.0, 6.35)]})[3:6] == ["G1 X1 F20", "Y1 F15.0", "G0 Z20"]


def test_an_arc_that_becomes_a_rapid_loses_its_centre_and_the_next_cut_states_its_motion() -> None:
    text = f"{HEAD} / G1 Z-1 F300 / G2 X10 Y0 I5 J0 (round) / G1 X20 / {FOOT}"
    assert paced(text, {5: [(1.0, RAPID)]})[3:6] == ["G1 Z-1 F300", "G0 X10 Y0 (round)", "G1 X20"]


def test_an_arc_without_its_own_motion_word_gets_it_back_after_a_rapid() -> None:
    text = f"{HEAD} / G1 Z-1 F300 / G2 X10 Y0 I5 J0 / X20 Y0 I5 J0 / G0 Z5 / {FOOT}"
    assert paced(text, {5: [(1.0, RAPID)]})[4:7] == ["G0 X10 Y0", "G2 X20 Y0 I5 J0", "G0 Z5"]


def test_a_rapid_without_a_motion_word_gets_one() -> None:
    text = f"{HEAD} / G1 Z-1 F300 / X10 / Y10 / X0 / {FOOT}"
    assert paced(text, {5: [(1.0, RAPID)], 6: [(1.0, RAPID)]})[3:7] == ["G1 Z-1 F300", "G0 X10", "Y10", "G1 X0"]


def test_a_line_that_must_stay_gets_its_feed_and_motion_in_a_block_before_it() -> None:
    """The controller may skip a line with a slash; its own words cannot change."""
    text = f"{HEAD} / G1 Z-1 F300 / X10 / /Y10 / X0 / {FOOT}"
    lines = paced(text, {5: [(1.0, 6.0)]})
    assert lines[4:8] == ["X10 F360.0", "F300.0", "/Y10", "X0"]


def test_lines_end_as_in_the_program() -> None:
    program = program_of(f"{HEAD} / G1 X10 F600 / Y10 / {FOOT}".replace(" / ", "\r\n"))
    text = with_pace(program, Pace({row_of(program, 4): (PaceStretch(0.5, 5.0), PaceStretch(1.0, 5.0))}), 255)
    assert text.split("\r\n")[3:6] == ["G1 X5.0 F300.0", "G1 X10 F300.0", "Y10 F600.0"]
    assert "\n" not in text.replace("\r\n", "")


def test_a_line_longer_than_the_controller_takes_gets_its_feed_before_it() -> None:
    """`Y10 F300.0` has 10 characters; G1 cannot stand alone, so a rapid in a line of full length is refused."""
    text = f"{HEAD} / G1 Z-1 F300 / X10 / Y10 / {FOOT}"
    assert paced(text, {5: [(1.0, 6.0)]}, longest=10)[4:6] == ["X10 F360.0", "Y10 F300.0"]
    assert paced(text, {5: [(1.0, 6.0)]}, longest=9)[4:8] == ["F360.0", "X10", "F300.0", "Y10"]
    with pytest.raises(PostError, match="'X10' would be longer than the 5 characters that the controller accepts"):
        paced(text, {5: [(1.0, RAPID)]}, longest=5)


SPEEDS = st.sampled_from([2.0, 5.0, 10.0, 20.0, RAPID])


@settings(max_examples=settings().max_examples * 2)
@given(st.lists(st.lists(SPEEDS, min_size=1, max_size=3), min_size=1, max_size=5), st.sampled_from(["", " F300"]))
def test_the_new_text_is_run_with_the_wanted_speed_everywhere(wanted: list[list[float]], feed: str) -> None:
    """Each cut is 12 mm along X and in equal parts. The interpreter runs the new text; speeds are compared by place."""
    cuts = [f"{'G1 ' if not k else ''}X{12 * (k + 1)}{feed if k % 2 else ' F600' * (not k)}" for k in range(6)]
    program = program_of(f"{HEAD} / {' / '.join(cuts)} / {FOOT}")
    stretches = {
        row_of(program, 4 + k): tuple(PaceStretch((n + 1) / len(speeds), speed) for n, speed in enumerate(speeds))
        for k, speeds in enumerate(wanted)
    }
    path = program_of(with_pace(program, Pace(stretches), 255)).path
    for k in range(6):
        row = row_of(program, 4 + k)
        parts = stretches.get(row, (PaceStretch(1.0, float(program.path.value[row])),))
        begin = 12.0 * k
        for part in parts:
            end = 12.0 * (k + part.until)
            middle = (begin + end) / 2
            (new,) = np.flatnonzero((path.before[:, 0] < middle) & (path.end[:, 0] > middle)).tolist()
            speed = RAPID if path.kind[new] == Kind.RAPID else float(path.value[new])
            assert speed == pytest.approx(part.speed)
            begin = end


def test_heights_are_rounded_up_in_the_unit_of_the_program() -> None:
    program = program_of(f"{HEAD} / G1 Z-1 F300 / G0 Z15 (up) / X10 / {FOOT}")
    assert with_heights(program, [Lowered(4, "Z", 1.23401)]).splitlines()[4] == "G0 Z1.235 (up)"
    assert with_heights(program, [Lowered(4, "Z", 1.234)]).splitlines()[4] == "G0 Z1.234 (up)"
    inches = program_of(f"{HEAD.replace('G21', 'G20')} / G1 Z-1 F30 / G0 Z15 / X10 / {FOOT}")
    assert with_heights(inches, [Lowered(4, "Z", 2.0)]).splitlines()[4] == "G0 Z0.0788"  # 2 / 25.4 = 0.07874


def test_a_cycle_returns_to_the_plane_that_is_asked_for() -> None:
    """A stated G98 becomes G99; without one, the word comes first."""
    program = program_of(f"{HEAD} / G98 G81 X1 Y1 Z-1 R1 F100 / X5 / X9 / G80 / {FOOT}")
    text = with_returns(program, [CycleReturn(3, 99), CycleReturn(5, 98)], 255)
    assert text.splitlines()[3:7] == ["G99 G81 X1 Y1 Z-1 R1 F100", "X5", "G98 X9", "G80"]
    assert with_returns(program, [CycleReturn(4, 99)], longest=5).splitlines()[4:6] == ["G99", "X5"]
