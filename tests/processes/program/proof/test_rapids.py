"""Rapids between cuts: heights by gap and by feature, worked out by hand, and what a lower rapid is called."""

from __future__ import annotations

import math
from typing import Any

import pytest

from leafcut.gcode.program import Program
from leafcut.model.difference import Difference
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.program.proof.certificate import certify
from leafcut.processes.program.proof.features import ProgramPath
from leafcut.processes.program.proof.program_work import ProgramWork, merged_rows, read_work
from leafcut.processes.program.proof.rapids import allowed_heights, group_rapids
from rewriting import program_of

INF = math.inf


def work_of(*lines: str) -> ProgramWork:
    return read_work(program_of("\n".join(lines)), written_out=False, beam=False)


def columns(found: object, *names: str) -> dict[str, list[Any]]:
    return {name: getattr(found, name).tolist() for name in names}


#: Two strokes, a stop, a stroke and two holes. By line: 4 to 6, 9 to 15, 19, 21 to 23, 25 and 29 are rapids.
STROKES = (
    "G21 G90 G17 G40 G94", "T1 M6", "S1000 M3", "G0 G43 H1 Z30", "G0 X0 Y0", "Z2", "G1 Z-1 F100", "X10",
    "G0 Z4", "Z1", "Z6", "X20 Y5 Z7", "X30 Z8", "Z3", "Z5", "G1 Z-2", "Y20", "X40",
    "G0 Z9", "M0", "G0 Z3", "X50", "Z2.5", "G1 Z-1",
    "G0 Z12", "G81 X60 Y0 Z-3 R1 F100", "X70", "G80", "G0 Z20", "G53 G0 Z0", "G53 G0 X0 Y0", "M2",
)  # fmt: skip


def test_rapids_have_their_heights_by_gap() -> None:
    """Gap 3 leads from X10 to X30: down to 1 at its start, away at 6, there at 8, down to 3 at its end."""
    found = group_rapids(work_of(*STROKES))
    assert columns(
        found,
        "feature",
        "gap_of",
        "rows",
        "across",
        "line",
        "leave",
        "arrive",
        "cross",
        "down_here",
        "down_there",
        "top",
    ) == {
        "feature": [-1, 0, 1, 2, 3, 4, -1, 5, 6, 7, -1, -1, -1],
        "gap_of": [1, 2, 3, 4, 5, 7, 8, 9],
        "rows": [False, True, False, True, False, False, True, True, True, True, True, False, False, False],
        "across": [False, True, False, True, False, False, False, True, True, True, False, False, False, False],
        "line": [0, 4, 0, 9, 0, 0, 19, 21, 25, 27, 29, 0, 0, 0],
        "leave": [INF, 30, INF, 6, INF, INF, INF, 3, 12, 1, INF, INF, INF, INF],
        "arrive": [INF, 30, INF, 8, INF, INF, INF, 3, 12, 1, INF, INF, INF, INF],
        "cross": [INF, 30, INF, 6, INF, INF, INF, 3, 12, 1, INF, INF, INF, INF],
        "down_here": [INF, 30, INF, 1, INF, INF, INF, 3, INF, INF, INF, INF, INF, INF],
        "down_there": [INF, 2, INF, 3, INF, INF, INF, 2.5, 1, INF, INF, INF, INF, INF],
        "top": [-INF, INF, -INF, 8, -INF, -INF, 9, 9, 12, 1, 20, -INF, -INF, -INF],
    }
    assert found.closed_by_feature.tolist() == [k >= 0 for k in (-1, 0, 1, 2, 3, 4, -1, 5, 6, 7, -1, -1, -1, -1)]
    assert found.opened_by_feature.tolist() == [k >= 0 for k in (-1, -1, 0, 1, 2, 3, 4, -1, 5, 6, 7, -1, -1, -1)]


def test_each_feature_is_left_and_reached_at_the_height_of_its_rapids_or_of_its_stage() -> None:
    """The first cut is reached as low as it is left, at 6. The last one before the stop is left as it is reached."""
    work = work_of(*STROKES)
    found = allowed_heights(work, group_rapids(work))
    assert columns(found, "leave", "arrive", "follows", "down_here", "down_there", "first") == {
        "leave": [INF, 6, INF, INF, 8, 12, 1, 1],
        "arrive": [6, INF, 8, INF, INF, 3, 12, 1],
        "follows": [False, True, False, True, True, False, False, False],
        "down_here": [-1, -1, -2, -2, -2, -1, 1, 1],
        "down_there": [2, -1, 3, -2, -2, 2.5, 1, 1],
        "first": [True, False, False, False, False, True, False, False],
    }


#: After G53 Z-5 the height is unknown, after G53 Z0 the tool is at the top; then a dwell, and a spindle that is off.
UNKNOWN = (
    "G21 G90 G17 G40 G94", "S1000 M3", "G53 G0 Z-5", "G0 X0 Y0", "G0 X5", "G0 Z3", "G0 X9", "G1 Z-1 F100",
    "G53 G0 Z-5", "G0 X20", "Z2", "G1 Z-1", "G53 G0 Z0", "G0 X30", "G0 Z2", "G1 Z-1",
    "M5", "G0 Z5", "G4 P1", "G0 X40", "M3", "X50", "M5", "X60", "G0 Z1", "M3 S900", "G1 Z-2", "M2",
)  # fmt: skip


def test_unknown_heights_and_a_turning_spindle_are_known_for_the_first_and_the_last_rapid() -> None:
    work = work_of(*UNKNOWN)
    gaps = group_rapids(work)
    assert columns(
        gaps, "cross", "down_there", "unknown", "unknown_first", "unknown_last", "lit", "lit_first", "lit_last"
    ) == {
        "cross": [INF, 3, INF, INF, INF, INF, INF, 5, INF, INF],
        "down_there": [INF, INF, INF, 2, INF, 2, INF, 1, INF, INF],
        "unknown": [0, 3, 0, 3, 0, 0, 0, 0, 0, 0],
        "unknown_first": [0, 3, 0, 3, 0, 0, 0, 0, 0, 0],
        "unknown_last": [0, 0, 0, 3, 0, 0, 0, 0, 0, 0],
        "lit": [False, True, False, True, False, True, False, True, False, False],
        "lit_first": [False, True, False, True, False, True, False, False, False, False],
        "lit_last": [False, True, False, True, False, True, False, False, False, False],
    }
    found = allowed_heights(work, gaps)
    assert columns(found, "leave", "arrive", "follows", "down_here", "down_there", "first") == {
        "leave": [3, INF, 5, 5, 5],
        "arrive": [3, INF, 5, 5, 5],
        "follows": [False] * 5,
        "down_here": [-1, -1, -1, 5, -2],
        "down_there": [3, 2, 2, 5, 1],
        "first": [True, True, True, False, False],
    }


HEAD = "G21 G90 G17 G40 G94 / S900 M3 / G0 Z9"
BASE = (
    f"{HEAD} / G0 X1 Y2 / Z3 / G1 Z-1 F100 / X5 / G0 Z4 / Z2 / Z6 / X11 Y2 / Z3 / G1 Z-1 / G0 Z7 / M0 / G0 Z8 / X20 / "
    "Z3 / G1 Z-2 / X25 / G0 Z9 / X0 Y0 / M5 / M2"
)
#: Name → the first text that is replaced, its replacement, and the differences: kind, both lines, text.
LOWER: dict[str, tuple[str, str, list[tuple[str, int, int, str]]]] = {
    "left lower": (
        "Z6 / X11", "Z5 / X11",
        [("lower retract", 8, 8, "a rapid leaves X5.000 Y2.000 at Z5.000 instead of Z6.000")],
    ),
    "left lower by more than rounding": (
        "Z6 / X11", "Z5.997 / X11",
        [("lower retract", 8, 8, "a rapid leaves X5.000 Y2.000 at Z5.997 instead of Z6.000")],
    ),
    "left lower by rounding": ("Z6 / X11", "Z5.999 / X11", []),
    "left higher": ("Z6 / X11", "Z8 / X11", []),
    "down where a cut has ended deeper": ("Z4 / Z2 / Z6", "Z4 / Z-0.9 / Z6", []),
    "lower on the way": (
        "Z6 / X11 Y2", "Z6 / X8 Z3 / X11 Z6 Y2",
        [("lower retract", 8, 8, "a rapid goes across to X11.000 Y2.000 at Z3.000 instead of Z6.000")],
    ),
    "an interrupted cut": (
        "F100 / X5", "F100 / G0 Z4 / Z-1 / G1 X5",
        [("interrupted cut", 7, 9,
          "the cut to X5.000 Y2.000 originally followed the previous cut without a rapid; "
          "now a rapid lies between them")],
    ),
    "lower from a stop": (
        "M0 / G0 Z8", "M0 / G0 Z6.5",
        [("lower approach", 16, 16, "a rapid arrives at X20.000 Y2.000 at Z6.500 instead of Z8.000"),
         ("lower retract", 15, 15, "a rapid from 'pause M0' is lower than before")],
    ),
    "down at a stop": (
        "Z7 / M0", "Z7 / Z-0.5 / Z7 / M0",
        [("deeper rapid", 15, 17, "a rapid down to 'pause M0' is lower than before")],
    ),
    "down after a stop": (
        "M0 / G0 Z8", "M0 / G0 Z2 / Z8",
        [("deeper rapid", 15, 15, "a rapid down from 'pause M0' is lower than before")],
    ),
    "lower to the end": (
        "G0 Z9 / X0", "G0 Z5 / X0",
        [("lower retract", 21, 21, "a rapid leaves X25.000 Y2.000 at Z5.000 instead of Z8.000"),
         ("lower approach", 24, 24, "a rapid to 'end of program M2' is lower than before"),
         ("lower retract", 24, 24, "at 'end of program M2' the tool was at Z9.000, now at Z5.000")],
    ),
    "another place at the end": (
        "X0 Y0", "X1 Y0",
        [("parked elsewhere", 24, 24,
          "the tool does not return to its original position for 'end of program M2': X0.000 Y0.000 Z9.000")],
    ),
    "lower at the start": (
        HEAD, HEAD.replace("Z9", "Z2 / Z9"),
        [("deeper rapid", 3, 3, "the program starts with a rapid to a lower height than before")],
    ),
    "an unknown height": (
        "Z8 / X20", "G53 G0 Z-9 / X20",
        [("extra machine move", 0, 16, "'rapid in machine coordinates to Z-9.000  refused by LinuxCNC' is new"),
         ("unknown height", 16, 17, "a rapid next to X20.000 Y2.000 crosses at an unknown height")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LOWER)
def test_a_lower_rapid_is_one_difference_with_its_place_and_heights(name: str) -> None:
    old, new, words = LOWER[name]
    assert old in BASE
    found = certify(program_of(BASE), program_of(BASE.replace(old, new, 1))).differences
    assert list(found) == [Difference(*one) for one in words]


def test_equal_faults_at_several_places_are_one_difference_with_all_lines() -> None:
    strokes = " / ".join(f"G0 X{x} / Z3 / G1 Z-1 F100 / X{x + 5} / G0 Z6" for x in (10, 20, 30))
    original = f"{HEAD} / G0 Y0 / {strokes} / G0 X90 / M5 / M2"
    found = certify(program_of(original), program_of(original.replace("G0 Z6", "G0 Z5"))).differences[0]
    assert found.what == "lower retract" and found.text.startswith(
        "a rapid leaves X15.000 Y0.000 and 2 other places at"
    )
    assert (found.original, found.new, found.also) == (9, 9, ((14, 14), (19, 19)))


@pytest.mark.parametrize(
    ("points", "needed"),
    [
        ([(3.0, 4.0), (6.0, 8.0), (9.0, 12.0)], [3]),
        ([(3.0, 4.0), (6.0, 8.0015), (9.0, 12.0)], [3]),
        ([(3.0, 4.0), (6.0, 8.006), (9.0, 12.0)], [2, 3]),
        ([(6.0, 8.0), (3.0, 4.0), (9.0, 12.0)], [1, 2, 3]),
        ([(3.0, 4.0), (3.0, 4.0), (9.0, 12.0)], [3]),
        ([(30.0, 40.0), (60.0, 80.0), (60.0, 90.0)], [2, 3]),
    ],
)
def test_a_straight_cut_in_parts_is_one_row(points: list[tuple[float, float]], needed: list[int]) -> None:
    """Points within 0.002 mm of the line, and in order."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, -1.0)
    for x, y in points:
        builder.feed(x, y, feed=10.0)
    program = Program.of_toolpath(builder.build(), [""])
    assert merged_rows(ProgramPath.of(program), still=1e-6, tolerance=0.002).tolist() == [0, *needed]
