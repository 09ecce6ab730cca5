"""The report page."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace

import pytest

from leafcut.model.certificate import Certificate, Counts
from leafcut.model.issue import Issue, Severity
from leafcut.model.solution import WorkerFigures
from leafcut.processes.program.model import ProgramDetail
from leafcut.processes.registry import report_of
from leafcut.report import views
from leafcut.report.page import report_page_html
from leafcut.report.styles import drawing_css, ramp_css
from leafcut.report.views import HEAD_LINES, MAX_ISSUE_ROWS, WHOLE_PROGRAM_LINES
from page_parser import Page


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw small pictures of the stock, since large ones take half a second each."""
    monkeypatch.setattr("leafcut.report.stock_picture.LONGER", 100)
    monkeypatch.setattr("leafcut.report.stock_picture._MAX_CELLS", 200)


def test_every_page_is_well_formed_and_complete_loads_nothing_and_runs_nothing(every_outcome):
    for name, outcome in every_outcome.items():
        page = Page(report_page_html(report_of(outcome)))
        assert outcome.part.name in page.words, name
        assert len(page.values("id")) == len(set(page.values("id"))), name
        names = {n for _, n, _ in page.attributes}
        assert not {"script", "link", "iframe", "object", "embed", "form"} & set(page.tags)
        assert all(address.startswith("data:image/png;base64,") for address in page.values("src"))
        assert not {"style", "srcset", "action", "background", "xlink:href"} & names
        assert not [n for n in names if n.startswith("on")]
        ids = {f"#{i}" for i in page.values("id")}
        assert set(page.values("href")) <= ids
        assert "url(" not in "".join(page.cells["style"])
        assert "@import" not in "".join(page.cells["style"])


def test_the_security_policy_allows_the_one_style_sheet_and_no_more(outcome_of):
    page = Page(report_page_html(report_of(outcome_of([(0.0, 0.0)]))))
    (policy,) = [v for v in page.values("content") if "default-src" in v]
    css = "".join(page.cells["style"])
    digest = base64.b64encode(hashlib.sha256(css.encode()).digest()).decode()
    pictures = " img-src data:;" if "img" in page.tags else ""
    assert policy == f"default-src 'none'; style-src 'sha256-{digest}';{pictures} base-uri 'none'; form-action 'none'"
    assert page.tags.count("style") == 1


def test_text_from_files_stays_text(outcome_of):
    evil = "<script>alert('x')</script>"
    quoted = '" onload="alert(1)'
    holes = outcome_of([(1.0, 1.0)]).part.holes
    outcome = outcome_of(
        [(1.0, 1.0)],
        part={"name": evil, "source": evil, "holes": tuple(replace(h, layer=evil, handle=quoted) for h in holes)},
        issues=(Issue("L201", evil + quoted, evil),),
        text=f"({evil})\n</pre></details>\n",
        options={quoted: evil},
        output=evil,
        version=quoted,
    )
    operation = outcome.operations[0]
    named = replace(operation, tool=replace(operation.tool, name=evil), cycle=evil)
    page = Page(report_page_html(report_of(replace(outcome, operations=(named,)))))
    assert "script" not in page.tags
    assert not [n for _, n, _ in page.attributes if n.startswith("on")]
    assert page.cells["title"][0] == f"{evil} – leafcut report"
    assert page.cells["pre"] == [f"({evil})\n</pre></details>"]
    assert page.cells["bdi"].count(evil) == 5  # heading, tool, input, program; place of the issue
    assert evil + quoted in page.cells["bdi"]


def test_what_does_not_print_is_replaced(outcome_of):
    html = report_page_html(report_of(outcome_of(part={"name": "a\x00b\u202ec\udcff"}, text="G0\x1b[2J\nM30\n")))
    assert "a�b�c�" in html
    assert "G0�[2J" in html
    html.encode("utf-8")


def test_the_figures_are_those_of_the_outcome(outcome_of):
    """100 s before and 58 s after save 42 s, which is 42 %; 60 s of 100 s are rapids."""
    words = Page(report_page_html(report_of(outcome_of([(0.0, 0.0), (10.0, 10.0)])))).words
    for figure in ("42.0 s", "42.0 % less machine time", "1 h 10 min on 100 parts", "1 min 40 s", "58.0 s"):
        assert figure in words
    assert "9.00 m" in words
    assert "Travel time at most 5.00 % above the least possible." in words
    assert "T1 drill Ø2, 2 holes" in words
    assert "seed 7" in words
    assert "--thickness 6.35mm" in words
    assert "180" in words


def test_a_loss_is_not_sold_as_a_gain(every_outcome):
    words = Page(report_page_html(report_of(every_outcome["slower than drawn"]))).words
    assert "20.0 s longer than the drawing’s order 20.0 % more machine time." in words


def test_only_a_verified_program_has_the_badge(outcome_of):
    assert "Verified: read back" in Page(report_page_html(report_of(outcome_of()))).words
    words = Page(report_page_html(report_of(outcome_of(verified=False)))).words
    assert "Verified: read back" not in words
    assert "Not verified" in words


def test_an_order_alone_is_marked_as_ours_even_when_all_three_are_one_object(empty_outcome):
    classes = Page(report_page_html(report_of(empty_outcome))).values("class")
    assert [c for c in classes if c.split()[:1] == ["order"]] == ["order", "order", "order ours"]


def test_a_long_program_shows_its_head_only(outcome_of):
    whole = "\n".join(f"N{i}" for i in range(WHOLE_PROGRAM_LINES - 1))
    assert Page(report_page_html(report_of(outcome_of(text=whole)))).cells["pre"] == [whole]
    long = whole + "\nM5\nM30\n"
    page = Page(report_page_html(report_of(outcome_of(text=long))))
    assert page.cells["pre"] == ["\n".join(whole.splitlines()[:HEAD_LINES])]
    assert f"2,001 lines, the first {HEAD_LINES} shown" in page.words


def test_warnings_come_before_notes_and_many_issues_are_counted(outcome_of):
    notes = [Issue("L406", f"note {i}", "", Severity.NOTE) for i in range(MAX_ISSUE_ROWS)]
    issues = (*notes, Issue("L201", "a warning", "plate.dxf:7"))
    words = Page(report_page_html(report_of(outcome_of(issues=issues)))).words
    assert words.index("a warning plate.dxf:7") < words.index("note 0")
    assert f"+ 1 more; in all: 1 × L201 (an entity is not a hole), {MAX_ISSUE_ROWS} × L406" in words


def test_an_option_in_a_message_is_kept_on_one_line_and_what_a_file_says_stays_text(outcome_of):
    """A browser may break a line after a dash; the words are those of the message."""
    message = "give --island-layers <b>, or --depth 3-4; not--this"
    html = report_page_html(report_of(outcome_of(issues=(Issue("L421", message),))))
    flags = ('<span class="flag">--island-layers</span>', '<span class="flag">--depth</span>')
    assert f"give {flags[0]} &lt;b&gt;, or {flags[1]} 3-4; not--this" in html
    assert ".flag { white-space: nowrap; }" in html


def test_nearest_neighbour_costs_the_difference_of_travel_more(outcome_of):
    """42 s + (70 s − 58 s) = 54 s; in distance 12 345 mm + (4 000 − 3 000) mm; unknown for several operations."""
    assert report_of(outcome_of([(0, 0)])).nearest_neighbour_cost() == 54.0
    assert report_of(outcome_of([(0, 0)], solution={"unit": "mm", "cost": 12345.0})).nearest_neighbour_cost() == 13345.0
    assert report_of(outcome_of([(0, 0)], [(9, 9)])).nearest_neighbour_cost() is None


def luminance(colour: str) -> float:
    """Relative luminance of sRGB by WCAG 2.2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("mode", [0, 1], ids=["light", "dark"])
def test_words_and_lines_stand_out_enough_from_what_is_behind_them(mode):
    """WCAG 2.2 AA: text 4.5 (1.4.3), lines and shapes that carry meaning 3 (1.4.11)."""
    palette = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", drawing_css().split("@media")[mode]))
    texts = ["ink", "ink-2", "accent", "warn", "bad"]
    pairs = [(w, b) for w in texts for b in ("card", "page")]
    pairs += [("accent", "accent-soft"), ("ink-2", "accent-soft"), ("warn", "warn-soft"), ("bad", "bad-soft")]
    assert {p: c for p in pairs if (c := contrast(palette[p[0]], palette[p[1]])) < 4.5} == {}
    shapes = ["rapid", "cut", "hole-rim", "change", "spindle", *(f"t{i}" for i in range(8))]
    assert {s: c for s in shapes if (c := contrast(palette[s], palette["card"])) < 3} == {}
    ramp = re.findall(r"stroke: (#[0-9a-f]{6})", ramp_css().split("@media")[mode])
    assert min(contrast(c, palette["card"]) for c in ramp) >= 3


def test_columns_that_say_nothing_and_words_of_other_processes_are_left_out(outcome_of):
    """A laser has no diameters and no spindle; what its beam does while it is off is travel."""
    counts = Counts(holes=0, cuts=2, dwells=0, stages=1, tool_changes=0)
    detail = ProgramDetail(Certificate(True, (), counts, counts, (), ""))
    outcome = outcome_of([(0.0, 0.0), (10.0, 10.0)], process="laser", detail=detail, part={"format": "gcode"})
    tools = tuple(replace(o, tool=replace(o.tool, diameter=0.0), cycle="") for o in outcome.operations)
    times = replace(outcome.before, by_kind={"feed": 90.0, "spindle": 10.0})
    words = Page(report_page_html(report_of(replace(outcome, operations=tools, before=times, after=times)))).words
    assert "Ø mm" not in words
    assert "Cycle" not in words
    assert "feed moves" in words
    assert "beam on, off" in words


def test_workers_that_had_nothing_to_search_have_no_row(outcome_of):
    """If the optimum was found at once, or another worker did all the work, there are no ants to show."""
    idle, busy = WorkerFigures(0, 0, 0.0, float("inf")), WorkerFigures(1, 90, 0.1, 42.0)
    points = [(0.0, 0.0), (10.0, 0.0)]
    for algorithm, workers, rows in (("colony", (idle, busy), [1]), ("colony", (idle,), []), ("exact", (busy,), [])):
        outcome = outcome_of(points, solution={"algorithm": algorithm, "workers": workers})
        assert [row["worker"] for row in views.worker_rows(outcome)["rows"]] == rows
        assert ("Workers" in Page(report_page_html(report_of(outcome))).words) is bool(rows)
