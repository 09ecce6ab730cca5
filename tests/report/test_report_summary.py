"""The summary on the terminal."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from leafcut.cli import shared
from leafcut.model.issue import CODES, LIMITS, Issue, Severity
from leafcut.model.outcome import Outcome
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json
from leafcut.report.page import report_page_html
from leafcut.report.summary import MAX_ISSUES, print_summary
from leafcut.report.wording import cost_words, gap_words, percent_words, replace_unprintable, time_words
from page_parser import Page


def shown(outcome: Outcome, **terminal: object) -> str:
    """Return the output on a terminal of 80 columns."""
    console = Console(file=io.StringIO(), width=80, **terminal)  # type: ignore[arg-type]
    print_summary(report_of(outcome), console)
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_every_summary_fits_80_columns(every_outcome):
    long = replace(every_outcome["ten holes"], output="/a/very/long/path" * 12, report="x" * 200)
    long = replace(long, part=replace(long.part, name="name " * 40), issues=(Issue("L201", "word " * 60, "p" * 90),))
    for outcome in [*every_outcome.values(), long]:
        assert max(len(line) for line in shown(outcome).splitlines()) <= 80


def test_paths_are_folded_never_cut(outcome_of):
    path = "/parts/" + "folder/" * 30 + "plate.nc"
    assert path in "".join(line.strip() for line in shown(outcome_of(output=path)).splitlines())


def test_the_three_orders_have_their_figures(outcome_of):
    searched = outcome_of([(1.0, 1.0)], options={"--seed": "7"})
    rows = {line.split("  ")[0]: line.split() for line in shown(searched).splitlines() if line}
    assert rows["drawing"][1:] == ["9.00", "m", "560.0", "mm", "1", "min", "40", "s", "–"]
    assert rows["nearest neighbour"][2:] == ["4.00", "m", "560.0", "mm", "1", "min", "10", "s", "30.0", "%"]
    assert rows["leafcut"][1:] == ["3.00", "m", "560.0", "mm", "58.0", "s", "42.0", "%"]
    assert " ".join(rows["gap"][1:]) == "travel time at most 5.00 % above the least possible"


@pytest.mark.parametrize(
    ("options", "shows"),
    [({"--thickness": "6mm"}, False), ({"--algorithm": "mmas"}, True), ({"--no-local-search": ""}, True)],
)
def test_facts_of_the_search_are_for_users_of_its_options(outcome_of, options, shows):
    """The page and the answer have them for everybody."""
    outcome = outcome_of([(1.0, 1.0)], options=options)
    headings = {line.split("  ")[0] for line in shown(outcome).splitlines()}
    assert ({"gap", "method"} <= headings) is shows is bool({"gap", "method"} & headings)
    assert "at most 5.00 % above" in Page(report_page_html(report_of(outcome))).words
    assert program_as_json(report_of(outcome))["gap_percent"] == pytest.approx(5.0)


def test_facts_for_the_operator_precede_the_comparison_of_orders(outcome_of):
    """Two holes of Ø2 at X1 and X30: the fixture drills to Z-6 from Z10, at 3 mm/s and 1500 rpm."""
    detail = DrillingDetail(clearance=10.0, retract=(2.0, 2.0))
    outcome = outcome_of([(1.0, 2.0), (30.0, 4.0)], detail=detail, work_offset="G54")
    lines = [" ".join(line.split()) for line in shown(outcome).splitlines()]
    expected = [
        "tool T1 drill Ø2, 1,500 rpm, 180 mm/min, G81",
        "heights clearance Z10, retract Z2",
        "time 58.0 s",
        "range X 0 to 30, Y 0 to 4, Z -6 to 10 mm",
        "work offset G54",
        "order travel cutting time saved",
    ]
    assert [line for line in lines if line in expected] == expected
    inches = shown(replace(outcome, options={"--output-units": "inch"}))
    assert "Z -0.236 to 0.394 in" in inches


def test_a_gap_is_never_said_smaller_than_it_is(outcome_of):
    """40.01 s above 40 s is 0.025 %: shown as 0.03 %; a gap of 0 is shown as optimal."""
    assert (
        report_of(outcome_of([(1.0, 1.0)], solution={"cost": 40.01}))
        .gap_sentence()
        .endswith("at most 0.03 % above the least possible")
    )
    assert (
        report_of(outcome_of([(1.0, 1.0)], solution={"cost": 40.0})).gap_sentence() == "travel time the least possible"
    )
    assert gap_words(0.05, "mm") == "at most 5.00 % above the shortest possible"
    assert report_of(outcome_of([(1.0, 1.0)], solution={"lower_bound": None})).gap_sentence() == ""


def test_of_several_tools_the_gap_says_what_it_is_a_bound_of(outcome_of):
    """Two tools, 84 s above 80 s: each tool's path starts at the end of the previous one."""
    words = report_of(outcome_of([(1.0, 1.0)], [(2.0, 2.0)])).gap_sentence()
    assert words.startswith("travel time at most 5.00 % above the least possible")
    assert words.endswith("each tool from the end of the last")


def test_no_colour_when_it_is_not_wanted(outcome_of, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[3" not in shown(outcome_of([(1.0, 1.0)]), force_terminal=True)
    assert "\x1b" not in shown(outcome_of([(1.0, 1.0)]))


def test_names_from_files_are_neither_markup_nor_escape_sequences(outcome_of):
    outcome = outcome_of(part={"name": "[bold]a\x1b[31m\x07b\nc[/bold]"}, issues=(Issue("L201", "[red]\x1b]0;x"),))
    text = shown(outcome)
    assert "[bold]a�[31m��"[:8] in text
    assert "[red]" in text
    assert "\x1b" not in text


def test_issues_that_say_the_same_are_grouped_and_at_most_twelve_are_named(outcome_of):
    codes = sorted(CODES.keys() - LIMITS.keys())[:14]
    issues = tuple(Issue(code, "something") for code in codes for _ in range(3))
    lines = shown(outcome_of(issues=issues)).splitlines()
    named = [line for line in lines if line.startswith("L")]
    assert [line.split()[0] for line in named] == codes[:MAX_ISSUES]
    assert all("3 ×" in line for line in named)
    assert f"+ {3 * (14 - MAX_ISSUES)} more" in [line.strip() for line in lines]


def test_issues_of_the_motion_and_the_machine_come_first_of_their_kind_and_are_never_folded(outcome_of):
    others = sorted(code for code in CODES.keys() - LIMITS.keys() if code < "L8")
    issues = tuple(Issue(code, "something", severity=Severity.NOTE) for code in (*others, "L805", "L808"))
    warnings = tuple(Issue(code, "a warning") for code in (others[0], "L806"))
    lines = [line.split()[0] for line in shown(outcome_of(issues=(*issues, *warnings))).splitlines() if line[:1] == "L"]
    assert lines[:5] == ["L806", others[0], "L805", "L808", others[0]] and len(lines) == MAX_ISSUES
    many = tuple(Issue(code, "a warning") for code in others[: MAX_ISSUES + 1])
    lines = [line.split()[0] for line in shown(outcome_of(issues=(*issues, *many))).splitlines() if line[:1] == "L"]
    assert lines[MAX_ISSUES:] == ["L805", "L808"]


def test_what_is_not_verified_is_said_to_be_so(outcome_of):
    assert "verified  no" in shown(outcome_of(verified=False))
    assert "verified  yes" in shown(outcome_of())


@pytest.mark.parametrize(
    "words, expected",
    [
        (percent_words(-3.14159), "−3.1 %"),
        (percent_words(-0.01), "0.0 %"),
        (percent_words(None), "–"),
        (time_words(-75.0), "−1 min 15 s"),
        (time_words(float("nan")), "–"),
        (cost_words(102.56, "s"), "102.6 s"),
        (cost_words(1234.0, "s"), "1234 s"),
        (cost_words(12345.0, "mm"), "12.35 m"),
        (cost_words(float("inf"), "mm"), "–"),
        (replace_unprintable("a\u202eb\udcffc\x00"), "a�b�c�"),
    ],
)
def test_numbers_and_texts_are_worded_as_a_person_reads_them(words, expected):
    assert words == expected


def test_different_tools_that_were_assumed_are_all_named(outcome_of):
    issues = tuple(Issue("L401", f"T{n} drill assumed", "") for n in (1, 2, 3))
    assert all(f"T{n} drill assumed" in shown(outcome_of(issues=issues)) for n in (1, 2, 3))


@pytest.mark.hazard
def test_assumptions_and_corners_that_are_not_cut_stand_beside_verified(outcome_of):
    issues = (
        Issue("L401", "T1 drill Ø5 assumed: 60 mm/min at 900 rpm", severity=Severity.NOTE),
        Issue("L402", "no depth given: 1 mm deep", severity=Severity.NOTE),
        Issue("L102", "the file does not state its units: mm assumed"),
        Issue("L701", "pocket 1: 4 corners are not reached", severity=Severity.NOTE),
        Issue("L201", "ignored 1 LINE, which cannot be a hole"),
    )
    lines = shown(outcome_of(issues=issues)).splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("verified"))
    beside = [line.split(None, 1) for line in lines[first + 1 : first + 5]]
    assert {words[0] for words in beside} == {"assumed", "not"}
    assert all(any(issue.message in line for line in lines[first:]) for issue in issues)
    assert [line.split()[0] for line in lines if line.startswith("L")] == ["L201"]
    page = Page(report_page_html(report_of(outcome_of(issues=issues)))).words
    assert page.index("assumed: no depth given: 1 mm deep") < page.index("machine time")


@pytest.mark.hazard
def test_assumptions_are_never_folded_into_and_so_many_more(outcome_of, capsys):
    issues = tuple(Issue("L401", f"T{n} drill assumed") for n in range(42))
    others = tuple(Issue("L208", f"line {n}") for n in range(15))
    text = shown(outcome_of(issues=issues))
    assert text.count("drill assumed") == 42 and "more" not in text
    assert report_page_html(report_of(outcome_of(issues=issues))).count("drill assumed") >= 42
    shared.print_issues((*others, *issues))
    told = capsys.readouterr().err
    assert told.count("drill assumed") == 42 and told.count("L208") == 10 and "warning: 5 more" in told


@pytest.mark.parametrize(("saved", "stated", "answer"), [(-0.37, False, 0.0), (0.0, False, 0.0), (2.5, True, 2.5)])
def test_low_ways_that_take_longer_save_nothing(outcome_of, saved, stated, answer):
    """A short hop below the highest place may take as long as one over it."""
    outcome = outcome_of(detail=DrillingDetail(saved))
    assert ("low moves" in shown(outcome)) is stated and "−0" not in shown(outcome)
    assert program_as_json(report_of(outcome))["low_ways_saved_s"] == answer


@pytest.mark.parametrize(("unit", "shows"), [("in", "254 × 304.8 mm, read in inches"), ("mm", "")])
def test_the_unit_of_a_drawing_is_stated_with_its_size_unless_it_is_mm(outcome_of, unit: str, shows: str) -> None:
    """A plate of 10 × 12 in."""
    outcome = outcome_of([(0.0, 0.0), (254.0, 304.8)])
    text = " ".join(shown(replace(outcome, part=replace(outcome.part, units=unit))).split())
    assert (shows in text) if shows else ("drawing 254" not in text)
