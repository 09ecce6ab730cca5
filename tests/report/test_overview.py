"""The figures of the report in plain values."""

from __future__ import annotations

import html
import io
from functools import reduce
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from leafcut import api
from leafcut.message import Message, has_words
from leafcut.model.outcome import Outcome
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json, studio_overview_as_json
from leafcut.report.page import report_page_html
from leafcut.report.summary import print_summary
from leafcut.report.wording import fact_heading, fact_line, fact_value_text
from leafcut.studio.wording import words

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw small pictures of the stock, since large ones take half a second each."""
    monkeypatch.setattr("leafcut.report.stock_picture.LONGER", 100)
    monkeypatch.setattr("leafcut.report.stock_picture._MAX_CELLS", 200)


@pytest.fixture(scope="module", params=["sheet", "pocket", "holes", "program"])
def outcome(request: pytest.FixtureRequest) -> Outcome[Any]:
    """Return an outcome of each kind of work."""
    examples = ROOT / "examples"
    sheet: dict[str, Any] = {"thickness": "6", "quantity": 25, "shop_rate": 60.0}
    known: dict[str, tuple[Path, str, dict[str, Any]]] = {
        "sheet": (examples / "sheet.dxf", "cut", sheet),
        "pocket": (examples / "pocket.dxf", "pocket", {"tool_diameter": "10", "depth": "3", "strategy": "contour"}),
        "holes": (examples / "plate_10.dxf", "drill", {"depth": 3}),
        "program": (examples / "cam_121.nc", "auto", {}),
    }
    file, process, options = known[request.param]
    return api.optimize(file, process=process, preset="fast", **options)


def test_what_is_told_stands_in_the_report_in_the_same_words(outcome: Outcome[Any]) -> None:
    page, found = html.unescape(report_page_html(report_of(outcome))), studio_overview_as_json(report_of(outcome))
    english = words("en")
    for tile in found["tiles"]:
        assert english.translate(tile["name"]) in page
        assert tile["figure"] in page
        assert english.translate(tile["words"]) in page
    for row in found["parts"]["rows"]:
        assert row["total"] in page


def test_a_fact_has_one_value_on_the_terminal_on_the_page_and_in_the_answer(outcome: Outcome[Any]) -> None:
    """A figure is defined once: its value is in the answer at its key, its words are in the summary and on the page."""
    report = report_of(outcome)
    console = Console(file=io.StringIO(), width=2000)
    print_summary(report, console)
    answer, page = program_as_json(report), html.unescape(report_page_html(report))
    lines = [" ".join(row.split()) for row in console.file.getvalue().splitlines()]  # type: ignore[attr-defined]
    for fact in report.facts:
        if fact.key:
            assert reduce(lambda inner, name: inner[name], fact.key.split("."), answer) == fact.value
        if fact.name:
            assert f"{fact_heading(fact.name)} {fact_line(fact)}" in lines
        if fact.name and fact_value_text(fact):
            assert fact_value_text(fact) in page and fact.sentence in page


def test_the_seconds_of_a_bar_are_the_time_of_its_order(outcome: Outcome[Any]) -> None:
    rows = studio_overview_as_json(report_of(outcome))["times"]["rows"]
    for row, measure in ((rows[0], outcome.before), (rows[-1], outcome.after)):
        stated = measure if outcome.process != "cut" else None
        if stated is not None:
            assert sum(row["seconds"].values()) == pytest.approx(stated.time_s)
    if outcome.process == "cut":
        times = outcome.detail.plan.measures.sheet
        assert sum(rows[-1]["seconds"].values()) == pytest.approx(times.total_s)


def test_all_messages_of_the_figures_have_spanish(outcome: Outcome[Any]) -> None:
    def messages(value: Any) -> list[Message]:
        if isinstance(value, Message):
            return [value, *(one for v in value.values for one in messages(v))]
        inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
        return [one for v in inner for one in messages(v)]

    shown = messages(studio_overview_as_json(report_of(outcome)))
    assert shown
    assert {one.template for one in shown if has_words(one.template)} <= words("es").messages.keys()


def test_every_strategy_of_a_pocket_has_a_way_over_one_level() -> None:
    """Its length equals the reported length, measured on the toolpath row by row."""
    import numpy as np

    from leafcut.model.toolpath import Kind, arc_radius_start_sweep

    options = {"tool_diameter": "10", "depth": "3", "strategy": "contour", "preset": "fast"}
    done = api.optimize(ROOT / "examples" / "pocket.dxf", process="pocket", **options)  # type: ignore[arg-type]
    (name, path), *rest = report_of(done).tried_paths()
    assert (name, rest) == ("contour", [])
    way = 0.0
    for row in np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)).tolist():
        if path.kind[row] == Kind.FEED:
            way += float(np.hypot(*(path.end[row] - path.before[row])[:2]))
        else:
            radius, _, sweep = arc_radius_start_sweep(path, row)
            way += radius * abs(sweep)
    measured = sum(plan.result.measures.feed_mm for plan in done.detail.plans if plan.result.measures is not None)
    assert way == pytest.approx(measured, rel=1e-6)
