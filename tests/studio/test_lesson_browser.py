"""Algorithms of the literature in Chromium: their steps are drawn and explained."""

from __future__ import annotations

import csv
import re
import struct
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from studio_page import LONG, press_run, serious, typed
from studio_server import Server
from test_live_browser import make_map

from leafcut import api

COMMAND = "#command"


def unfolded(page: Page, title: str) -> Locator:
    """Open the fold with a title and return it, as fields of the same name may be in two folds."""
    details = page.locator(".choose details").filter(has=page.locator("summary", has_text=title))
    details.locator("summary").click()
    expect(details).to_have_attribute("open", "")
    return details


def stepped(page: Page, algorithm: str, steps: int) -> None:
    """Run a search on forty points for this number of single steps."""
    make_map(page, 40, algorithm)
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    study = page.locator(".study")
    expect(study).to_contain_text("step 1", timeout=LONG)
    for step in range(2, steps + 1):
        study.get_by_role("button", name="Single step").click()
        expect(study).to_contain_text(f"step {step}")


def test_local_search_is_off_where_ants_are_studied_which_is_told_and_stands_in_the_command_line(page: Page) -> None:
    make_map(page, 40, "mmas")
    hint = page.get_by_role("note").filter(has_text="Local search is off")
    expect(hint).to_be_visible()
    expect(page.locator(COMMAND)).to_contain_text("--no-local-search")
    algorithm = page.locator(".choose").get_by_label("Algorithm", exact=True)
    algorithm.select_option("auto")
    expect(hint).to_be_hidden()
    expect(page.locator(COMMAND)).not_to_contain_text("--no-local-search")
    algorithm.select_option("firefly")
    expect(hint).to_be_visible()
    unfolded(page, "Search details").get_by_label("Local search", exact=True).check()
    expect(hint).to_be_hidden()
    expect(page.locator(COMMAND)).not_to_contain_text("--no-local-search")


def test_parameters_stand_by_their_letters(page: Page) -> None:
    make_map(page, 40, "acs")
    unfolded(page, "Ant algorithms")
    for label in ("Pheromone weight α", "Heuristic weight β", "Evaporation rate ρ", "Initial pheromone τ₀", "Ants m"):
        expect(page.get_by_label(label, exact=True)).to_be_visible()
    typed(page, "Greedy probability q₀", "0.5")
    expect(page.locator(COMMAND)).to_contain_text("--greedy-probability 0.5")
    page.locator(".choose").get_by_label("Algorithm", exact=True).select_option("firefly")
    unfolded(page, "Firefly algorithm")
    for label in ("Attractiveness β₀", "Absorption γ"):
        expect(page.get_by_label(label, exact=True)).to_be_visible()


def test_a_step_is_drawn_with_best_mean_worst_and_branching_and_explained_in_its_own_numbers(page: Page) -> None:
    stepped(page, "mmas", 4)
    chart = page.locator(".progress .learned [role=img]")
    expect(chart).to_have_attribute(
        "aria-label", re.compile(r"best so far [\d.,]+ .*best of the iteration .*mean .*worst .*branching [\d.]+")
    )
    for name in ("best so far", "best of the iteration", "mean", "worst", "λ-branching"):
        expect(chart.locator("svg")).to_contain_text(name)
    lesson = page.locator(".lesson")
    expect(lesson).to_contain_text("What happened in step 4")
    # ρ of MAX–MIN Ant System without local search is 0.02, β is 2, and the next places add up to no more than all.
    told = lesson.locator("math").all_text_contents()
    assert any("0.98" in "".join(one.split()) for one in told)
    shares = [float(cell.split()[0]) for cell in lesson.locator("tbody td:last-child").all_text_contents()]
    assert len(shares) == 5
    assert shares == sorted(shares, reverse=True)
    assert 0.0 < sum(shares) <= 100.1
    axis = page.locator(".progress .lc-switch")
    expect(axis.get_by_role("button", name="Iterations")).to_have_attribute("aria-pressed", "true")
    expect(chart.get_by_text("it.", exact=True)).to_be_visible()
    axis.get_by_role("button", name="Time").press("Enter")
    expect(chart.get_by_text("s", exact=True)).to_be_visible()
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)
    page.get_by_role("tab", name="Search").click()
    expect(page.locator(".result .learned svg")).to_contain_text("λ-branching")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="PNG", exact=True).click()
    picture = Path(waiting.value.path()).read_bytes()
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", picture[16:24])[0] > 1500
    with page.expect_download() as waiting:
        page.get_by_role("link", name="CSV", exact=True).click()
    with Path(waiting.value.path()).open() as file:
        rows = list(csv.DictReader(file))
    # The command line makes the same search, and its best tour after as many iterations is as long.
    same = api.solve("random:40:1", algorithm="mmas", local_search=False, iterations=len(rows), bound=False)
    assert float(rows[-1]["shortest"]) == pytest.approx(same.solution.cost, rel=1e-12)
    assert [int(row["number"]) for row in rows] == list(range(1, len(rows) + 1))
    assert len(rows) >= 4


def test_a_flight_of_fireflies_is_explained(page: Page) -> None:
    stepped(page, "firefly", 2)
    expect(page.locator(".lesson")).to_contain_text(re.compile(r"Firefly \d+ of 11 has the longest tour"))
    expect(page.locator(".lesson")).to_contain_text("It tries")
    expect(page.locator(".progress .learned svg")).not_to_contain_text("λ-branching")
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)


def test_axe_finds_nothing_serious_in_a_lesson(browser: Browser, server: Server) -> None:
    # The policy of the page would not let axe in.
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True, locale="en-US")
    server.let_in(context)
    page = context.new_page()
    page.goto(f"{server.origin}/?lang=en")
    expect(page.locator("#view-work")).to_be_visible()
    stepped(page, "mmas", 2)
    expect(page.locator(".lesson table")).to_be_visible()
    found = serious(page, "lesson")
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)
    context.close()
    assert found == []
