"""The page by keyboard alone: the focus is never lost, arrows go through tabs, stops are moved without a pointer."""

from __future__ import annotations

import re
from typing import Any

from playwright.sync_api import Page, expect
from studio_page import LONG, PLATE, opened, said_by, typed, wait_for


def focused(page: Page) -> Any:
    """Return the focused element by its id, its name or its text; empty if there is none."""
    return page.evaluate(
        """() => {
            const at = document.activeElement;
            if (!at || at === document.body) return "";
            return /^c\\d+$/.test(at.id) || !at.id ? at.getAttribute("aria-label") ?? at.textContent : at.id;
        }"""
    )


def drilled(page: Page) -> None:
    """Drill a plate, by keys alone."""
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "6mm")
    page.get_by_role("button", name="Run", exact=True).focus()
    page.keyboard.press("Enter")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)


def test_the_focus_stays_on_run_and_in_the_tabs_whatever_is_drawn_anew(page: Page) -> None:
    drilled(page)
    wait_for(page, lambda: focused(page) == "Run")
    page.locator("#tab-summary").focus()
    for key, tab in (("ArrowRight", "issues"), ("End", "search"), ("ArrowRight", "summary"), ("ArrowLeft", "search")):
        page.keyboard.press(key)
        expect(page.locator(f"#tab-{tab}")).to_have_attribute("aria-selected", "true")
        wait_for(page, lambda tab=tab: focused(page) == f"tab-{tab}")
    page.keyboard.press("Home")
    expect(page.locator("#tab-summary")).to_have_attribute("aria-selected", "true")
    # The tabs are a single Tab stop: the next stop is the panel.
    page.keyboard.press("Tab")
    wait_for(page, lambda: focused(page) == "result-panel")


def test_a_search_that_is_stopped_by_key_leaves_the_focus_on_the_page(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    typed(page, "Depth", "3mm")
    page.get_by_role("button", name="Run", exact=True).press("Enter")
    stop = page.get_by_role("button", name="Stop, keep the best")
    expect(page.locator(".study")).to_contain_text("step 1", timeout=LONG)
    stop.press("Enter")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    wait_for(page, lambda: focused(page) == "Run")


def test_the_views_are_one_stop_of_tab_and_arrows_go_through_them(page: Page) -> None:
    views = page.get_by_role("navigation", name="Views")
    views.get_by_role("button", name="Work").focus()
    page.keyboard.press("ArrowRight")
    assert focused(page) == "Jobs"
    page.keyboard.press("End")
    assert focused(page) == "Control"
    page.keyboard.press("Enter")
    expect(page.locator("#view-control")).to_be_visible()
    assert views.locator("[tabindex='0']").count() == 1
    page.keyboard.press("Home")
    assert focused(page) == "Work"


def test_stops_are_chosen_and_moved_by_keys_and_it_is_announced(page: Page) -> None:
    drilled(page)
    page.locator("#edit-begin").press("Enter")
    told, way = page.locator(".edit [role=status]"), page.locator(".edit .ways .figure").first
    length = said_by(way)
    page.get_by_role("button", name="Next stop").focus()
    for number in (1, 2, 3):
        page.keyboard.press("Enter")
        expect(told).to_contain_text(f"stop {number} of 10")
    third = said_by(told).partition("X")[2]
    page.keyboard.press("ArrowRight")
    wait_for(page, lambda: focused(page) == "Move earlier")
    page.keyboard.press("Enter")
    expect(told).to_have_text(re.compile(f"stop 2 of 10, X{re.escape(third)}$"))
    expect(way).not_to_have_text(length)
    page.get_by_label("Place in the order").fill("9")
    page.keyboard.press("Enter")
    expect(told).to_have_text(re.compile(f"stop 9 of 10, X{re.escape(third)}$"))
    page.get_by_label("Place in the order").fill("11")
    page.keyboard.press("Enter")
    expect(page.locator("#said")).to_contain_text("The places in the order are 1 to 10")
    expect(told).to_contain_text("stop 9 of 10")
    page.get_by_role("button", name="Undo").press("Enter")
    expect(told).to_contain_text("stop 2 of 10")
    page.get_by_role("button", name="Undo").press("Enter")
    expect(way).to_have_text(length)
    page.get_by_role("button", name="Previous stop").press("Enter")
    expect(told).to_contain_text("stop 2 of 10")
    page.get_by_role("button", name="Close", exact=True).press("Enter")
    wait_for(page, lambda: focused(page) == "edit-begin")


def test_question_marks_are_no_stops_of_tab_and_help_is_one_key_away(page: Page) -> None:
    opened(page, PLATE)
    marks = page.locator(".what")
    assert marks.count() > 5
    assert marks.evaluate_all("all => all.every((one) => one.tabIndex === -1)")
    field = page.get_by_label("Thickness", exact=True)
    about = field.get_attribute("aria-describedby")
    assert "thickness" in (page.locator(f"#{about}").text_content() or "")  # a screen reader announces it anyway
    field.focus()
    expect(page.locator(f"#{about}")).to_be_hidden()
    page.keyboard.press("F1")
    expect(page.locator(f"#{about}")).to_be_visible()
    assert field.evaluate("at => at === document.activeElement")
    page.keyboard.press("F1")
    expect(page.locator(f"#{about}")).to_be_hidden()


def test_a_field_that_gave_up_the_focus_does_not_get_it_back_when_the_page_is_drawn_anew(page: Page) -> None:
    """Else the key of a view were typed into it."""
    opened(page, PLATE)
    page.get_by_label("Thickness", exact=True).focus()
    page.get_by_label("Thickness", exact=True).blur()
    page.evaluate("document.body.append(document.createElement('i'))")
    assert (
        page.evaluate("new Promise((done) => requestAnimationFrame(() => done(document.activeElement.tagName)))")
        == "BODY"
    )
    page.keyboard.press("3")
    expect(page.locator("#view-machines")).to_be_visible()
