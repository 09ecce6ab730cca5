"""The Lab page in Chromium: an experiment grows, and the part that is open is compared."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, PLATE, opened, serious, typed
from studio_server import running


@pytest.fixture
def own(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    """Return a page of a new studio in which axe may run, because styles of other origins are allowed."""
    with running(tmp_path) as server:
        context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", bypass_csp=True)
        server.let_in(context)
        page = context.new_page()
        page.goto(server.origin)
        expect(page.locator("#view-work")).to_be_visible()
        yield page
        context.close()


def choose(page: Page, name: str) -> None:
    page.locator(f"#view-lab [data-name={name}]").click()
    expect(page.get_by_role("region", name=name, exact=True)).to_be_visible()


def test_a_published_experiment_and_one_on_the_open_part_run_grow_and_are_reported(own: Page) -> None:
    page = own
    opened(page, PLATE)
    typed(page, "Thickness", "6")
    page.keyboard.press("5")
    lab = page.locator("#view-lab")
    choose(page, "machining_time")
    short = page.get_by_role("button", name=re.compile("Short form"))
    short.click()
    expect(short).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Start", exact=True).click()
    expect(lab).to_contain_text("8 of 8 runs done", timeout=LONG)
    expect(lab.locator("table tbody tr")).to_have_count(8)
    choose(page, "open_part")
    typed(page, "Runs of each", "2")
    page.get_by_role("button", name="Start 6 runs").click()
    expect(lab).to_contain_text("6 of 6 runs done", timeout=LONG)
    cells = [row.inner_text().split("\t") for row in lab.locator("table tbody tr").all()]
    time = {row[1]: float(row[3]) for row in cells}
    assert time["auto"] <= time["acs"] + 0.01 < time["nn"]
    assert serious(page, "lab") == []
    with page.context.expect_page() as report:
        page.get_by_role("link", name="Report").click()
    expect(report.value.locator("h1")).to_have_text("Algorithm compared on plate_10.dxf")
    expect(report.value.locator("body")).to_contain_text("6 of 6 runs done")
