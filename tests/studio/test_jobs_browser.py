"""The list of jobs, and the title of the browser tab during and after a run, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, PLATE, opened, press_run, run, serious, sure, typed, wait_for
from studio_server import running


@pytest.fixture
def own(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    """Return a page of a studio of its own, in which nobody else has jobs."""
    with running(tmp_path) as server:
        context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", bypass_csp=True)
        server.let_in(context)
        context.grant_permissions(["notifications"], origin=server.origin)
        page = context.new_page()
        page.goto(server.origin)
        expect(page.locator("#view-work")).to_be_visible()
        yield page
        context.close()


def endless(page: Page, file: Path = PLATE) -> None:
    """Start a run that ends only when it is stopped."""
    opened(page, file)
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    expect(page).to_have_url(re.compile("job="))
    expect(page.locator(".study")).to_contain_text("step 1", timeout=LONG)


def finished(page: Page, **options: str) -> None:
    """Run a plate with options by their labels."""
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    for label, value in options.items():
        typed(page, label, value)
    run(page)


def test_two_jobs_are_compared_and_one_is_found_by_what_was_chosen(own: Page) -> None:
    finished(own, Thickness="6mm")
    job = own.url
    typed(own, "Thickness", "1/4in")
    press_run(own)
    wait_for(own, lambda: own.url != job)
    expect(own.locator("#result-panel")).to_be_visible(timeout=LONG)
    own.keyboard.press("2")
    rows = own.locator("table.jobs tbody tr")
    expect(rows).to_have_count(2)
    for box in rows.locator("input[type=checkbox]").all():
        box.check()
    table = own.get_by_role("table", name="Comparison")
    expect(table.locator("tr", has_text="Thickness")).to_have_text(re.compile("Thickness.*6.mm.*1/4in.*differs"))
    expect(table.locator("tr", has_text="Search effort")).not_to_contain_text("differs")
    assert serious(own, "compared") == []
    own.get_by_role("button", name="Close", exact=True).last.click()
    expect(table).to_have_count(0)
    find = own.get_by_label("Find a job")
    find.fill("1/4")
    expect(rows).to_have_count(1)
    expect(rows).to_contain_text("1/4in")
    expect(find).to_be_focused()
    find.fill("thickness plate_10")
    expect(rows).to_have_count(2)
    find.fill("nothing like this")
    expect(own.get_by_text("No job matches these words.")).to_be_visible()


def test_jobs_that_wait_are_put_in_another_order_by_keys(own: Page) -> None:
    names = ["a.dxf", "b.dxf", "c.dxf", "d.dxf", "e.dxf"]
    for name in names:
        own.set_input_files("#open-file", {"name": name, "mimeType": "", "buffer": PLATE.read_bytes()})
        expect(own.locator(".about-part .name")).to_have_text(name)
        own.get_by_label("Algorithm", exact=True).select_option("mmas")
        own.locator(".choose").get_by_label("Speed", exact=True).select_option("step")  # those that run wait, too
        before = own.url
        press_run(own)
        wait_for(own, lambda before=before: "job=" in own.url and own.url != before)
    own.keyboard.press("2")
    rows = own.locator(".queue li")
    expect(rows).to_have_text([re.compile(name) for name in names])
    later = rows.nth(2).get_by_role("button", name="Later")
    later.focus()
    own.keyboard.press("Enter")
    expect(rows).to_have_text([re.compile(name) for name in ("a.dxf", "b.dxf", "d.dxf", "c.dxf", "e.dxf")])
    wait_for(own, lambda: own.evaluate("document.activeElement.getAttribute('aria-label')") == "Later: c.dxf")
    rows.nth(4).get_by_role("button", name="Run next").press("Enter")
    expect(rows).to_have_text([re.compile(name) for name in ("a.dxf", "b.dxf", "e.dxf", "d.dxf", "c.dxf")])
    sure(rows.nth(3).locator("[data-sure]"))
    expect(rows).to_have_count(4)
    sure(rows.nth(0).locator("[data-sure]"))
    expect(own.locator(".queue li .tag.running")).to_have_count(2)
    expect(rows.filter(has=own.locator(".running")).nth(1)).to_contain_text("e.dxf")


def test_a_button_of_a_job_stays_when_the_job_ends(own: Page) -> None:
    """A click at that moment is not lost."""
    endless(own)
    own.keyboard.press("2")
    row = own.locator("table.jobs tbody tr")
    expect(row.locator(".tag")).to_have_text("running")
    button = row.get_by_role("button", name="Open").element_handle()
    sure(own.locator(".queue li [data-sure]"))
    expect(row.locator(".tag")).not_to_have_text("running", timeout=LONG)
    button.click()
    expect(own).to_have_url(re.compile("job="))
    expect(own.locator("#view-work")).to_be_visible()


def test_the_tab_says_how_a_run_goes_and_a_notice_comes_only_where_it_was_asked_for(own: Page) -> None:
    own.evaluate(
        """() => {
            window.told = [];
            class Told { constructor(title, about) { told.push([title, about.body]); } close() {} }
            Told.permission = "default";
            Told.requestPermission = async () => { told.push("asked"); Told.permission = "granted"; };
            window.Notification = Told;
            Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
        }"""
    )
    # The end of a run stays in the title for some seconds only.
    own.evaluate(
        """() => {
            window.titles = [];
            new MutationObserver(() => titles.push(document.title))
                .observe(document.head, { childList: true, characterData: true, subtree: true });
        }"""
    )
    plain = own.locator("link[rel~=icon]").get_attribute("href")
    endless(own)
    expect(own).to_have_title(re.compile(r"^▶ .*plate_10 – leafcut$"))
    assert own.locator("link[rel~=icon]").get_attribute("href") != plain
    own.get_by_role("button", name="Stop, keep the best").click()
    wait_for(own, lambda: "✓ plate_10 – leafcut" in own.evaluate("titles"))
    assert own.evaluate("told") == []  # no permission for notifications was requested
    own.keyboard.press("2")
    own.get_by_label("Notify me when a run is over").check()
    wait_for(own, lambda: own.evaluate("told") == ["asked"])
    own.keyboard.press("1")
    press_run(own)
    expect(own.locator(".study")).to_contain_text("step 1", timeout=LONG)
    expect(own).to_have_title(
        re.compile("^▶ ")
    )  # the tab does not announce the end of a run that it has not seen running
    own.get_by_role("button", name="Stop, keep the best").click()
    wait_for(own, lambda: own.evaluate("told") == ["asked", ["plate_10 – leafcut", "The run is over."]])
    own.evaluate("delete document.hidden")
    own.locator("body").click(position={"x": 640, "y": 5})
    expect(own).to_have_title("leafcut studio", timeout=LONG)
    expect(own.locator("link[rel~=icon]")).to_have_attribute("href", plain or "")
