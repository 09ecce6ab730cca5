"""Probable mistakes in programs, reported by `simulate` and `reorder` alike."""

from __future__ import annotations

from pathlib import Path

import pytest

import leafcut
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.issue import Issue, Severity
from leafcut.proof.doubts import find_probable_mistakes

HEAD = "G21 G90 G17\nT1 M6\nG0 Z5.\nG0 X0. Y0.\nM{} S1000\n"
CUT = "G1 Z-1. F100.\nX10.\nG0 Z5.\nM2\n"


def doubts(text: str, process: str = "mill", words: str = "linuxcnc") -> list[Issue]:
    return find_probable_mistakes(interpret_program(text, load_dialect(words)), load_dialect(words), process)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("code", "text", "process", "found"),
    [
        (4, CUT, "mill", ["L806"]),
        (4, "G81 X5 Y5 Z-3 R1 F100\nG80\nM2\n", "drill", ["L806"]),
        (3, CUT, "mill", []),
        (4, CUT, "laser", []),
        (3, "G1 Z-9 F100\nM4\nG1 Z5\nM3\nG1 X9\nM2\n", "mill", []),
        (4, "G84 X5 Y5 Z-3 R1 F100\nG80\nM2\n", "drill", []),
    ],
    ids=["cut", "hole", "forwards", "laser", "out of a tapped hole", "tapping cycle"],
)
def test_a_tool_that_cuts_with_a_spindle_turning_backwards_is_reported(
    code: int, text: str, process: str, found: list[str]
) -> None:
    assert [issue.code for issue in doubts(HEAD.format(code) + text, process)] == found


@pytest.mark.parametrize(
    ("text", "words", "found"),
    [
        ("G84 X5 Y5 Z-3 R1 F100 P1000\nX9\nG80\n", "linuxcnc", "2 dwells longer than 60 s, the longest 1,000 s"),
        ("G4 P1000\n", "linuxcnc", "linuxcnc reads P in seconds"),
        ("G4 P60\n", "linuxcnc", ""),
        ("G4 P1000\n", "fanuc", ""),
        ("G4 P90000\n", "fanuc", "1 dwell longer than 60 s, the longest 90 s: fanuc reads P in milliseconds"),
    ],
)
def test_a_dwell_of_more_than_a_minute_is_reported_with_the_unit_it_is_read_in(
    text: str, words: str, found: str
) -> None:
    issues = doubts(HEAD.format(3) + text + CUT, words=words)
    assert [issue.code for issue in issues] == ["L102"] * bool(found)
    assert not found or found in issues[0].message


#: Stops, moves to another position, starts again: the blocks in between, and before the next cut.
_AGAIN = "G1 Z-1 F100\nX10\nG0 Z5\nM5\n{0}G0 X20\nM3 S1000\n{1}G1 Z-1 F100\nX30\nG0 Z5\n"


@pytest.mark.parametrize(
    ("between", "before", "process", "found"),
    [
        ("", "", "mill", ["line 11"]),
        ("", "G4 P2\n", "mill", []),
        ("", "G0 X21\nG4 P0.5\n", "mill", []),
        ("", "G4 P0\n", "mill", ["line 11"]),
        # A dwell while the spindle stands gives it no speed; after a tool change every program starts it.
        ("G4 P2\n", "", "mill", ["line 12"]),
        ("M0\n", "", "mill", ["line 12"]),
        ("T2 M6\n", "", "mill", []),
        ("", "", "laser", []),
    ],
)
def test_a_spindle_that_restarts_between_cuts_without_a_dwell_is_noted(
    between: str, before: str, process: str, found: list[str]
) -> None:
    issues = doubts(f"{HEAD.format(3)}{_AGAIN.format(between, before)}M2\n", process)
    assert [issue.place for issue in issues if issue.code == "L817"] == found
    assert all(issue.severity is Severity.NOTE for issue in issues if issue.code == "L817")


def test_all_starts_without_a_dwell_are_counted_and_the_first_and_the_last_are_none() -> None:
    """The first start has its own look of the operator, and after the last cut nothing follows."""
    text = HEAD.format(3) + _AGAIN.format("", "") + _AGAIN.format("", "").removeprefix("G1 Z-1 F100\n") + "M5\nM3\nM2\n"
    (issue,) = [issue for issue in doubts(text) if issue.code == "L817"]
    assert issue.message.startswith("2 starts of the spindle between cuts without a dwell")


@pytest.mark.parametrize(("words", "found"), [("grbl", ["line 2"]), ("linuxcnc", [])])
def test_m6_is_reported_where_the_controller_does_not_know_it(words: str, found: list[str]) -> None:
    """GRBL stops with error 20. A change by M0 is no M6, and a remark is none either."""
    assert [issue.place for issue in doubts(HEAD.format(3) + CUT, words=words)] == found
    assert doubts(HEAD.format(3).replace("T1 M6", "T1\nM0 (M6)") + CUT, words="grbl") == []


@pytest.mark.parametrize(("words", "found"), [("grbl", []), ("grbl-laser", []), ("linuxcnc", ["L806"])])
def test_a_command_of_grbl_is_reported_on_other_controllers(words: str, found: list[str]) -> None:
    text = HEAD.format(3).replace("T1 M6\n", "$H\n") + CUT
    assert [issue.code for issue in doubts(text, words=words)] == found


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("comment", "units", "told"),
    [
        ("(FACE MILL 0.6 INCH)", None, "gives the size 0.6 INCH"),
        ('(T1 1/4" END MILL)', None, 'gives the size 1/4"'),
        ("(6 mm flat)", "in", "gives the size 6 mm"),
        ("(0.25 INCH, 6.35 mm)", None, ""),
        ("(STEP 2 IN PROGRESS)", None, ""),
        ("(FACE MILL 0.6 INCH)", "in", ""),
    ],
)
def test_an_assumed_unit_that_the_comments_contradict_is_a_warning(
    comment: str, units: str | None, told: str, tmp_path: Path
) -> None:
    source = tmp_path / "a.nc"
    source.write_text(f"{comment}\nG90 G17\nT1 M6\nG0 Z5\nG0 X0 Y0\nM3 S1000\n{CUT}")
    for issues in (leafcut.simulate(source, units=units).issues, leafcut.optimize(source, units=units).issues):
        (issue,) = [issue for issue in issues if issue.code == "L102"]
        assert issue.severity == ("warning" if told else "note") and told in issue.message
