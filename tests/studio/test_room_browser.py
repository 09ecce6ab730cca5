"""Layout: columns can be folded, the running job is above the results, and nothing is wider than its window."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect
from studio_page import LONG, PLATE, choose_work, opened, press_run, run, steady, typed
from studio_server import Server

#: Elements wider than their window that cannot be scrolled: the first ones.
STICKS_OUT = """() => {
  const wide = document.documentElement.scrollWidth > innerWidth + 1;
  const out = (e) => { const box = e.getBoundingClientRect(); return box.width > 0 && box.right > innerWidth + 1; };
  const held = (e) => {
    for (let at = e; at; at = at.parentElement) if (getComputedStyle(at).overflowX !== "visible") return true;
    return false;
  };
  const found = [...document.querySelectorAll(".studio *")].filter((e) => out(e) && !held(e));
  return [wide, ...found.slice(0, 5).map((e) => e.outerHTML.slice(0, 90))];
}"""


def width(page: Page, place: str) -> float:
    """Return the width of an element when the layout is at rest."""
    script = "(place) => document.querySelector(place).getBoundingClientRect().width"
    return float(steady(page, script, place))


def fold(page: Page, side: str) -> Locator:
    return page.locator(f"[data-fold={side}]")


def test_a_column_that_is_folded_gives_its_room_to_the_drawing_and_stays_so(page: Page) -> None:
    opened(page, PLATE)
    before = width(page, ".middle")
    fold(page, "left").click()
    expect(page.locator("#column-left")).to_be_hidden()
    expect(fold(page, "left")).to_have_attribute("aria-expanded", "false")
    assert width(page, ".middle") == before + 324
    page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last.click()
    page.keyboard.press("]")
    expect(page.locator("#column-right")).to_be_hidden()
    assert width(page, ".middle") == 1280
    page.reload()
    expect(page.locator("#view-work")).to_be_visible()
    expect(page.locator("#column-left")).to_be_hidden()
    expect(fold(page, "left")).to_have_attribute("aria-expanded", "false")
    for side in ("left", "right"):
        fold(page, side).click()
        expect(page.locator(f"#column-{side}")).to_be_visible()
        expect(fold(page, side)).to_have_attribute("aria-expanded", "true")


def test_what_runs_can_be_stopped_also_where_the_results_are_folded_away(page: Page) -> None:
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", "1200")
    page.get_by_role("button", name="Create map").click()
    choose_work(page, "solve")
    page.get_by_label("Algorithm", exact=True).select_option("mmas")  # it searches as long as it may
    typed(page, "Time limit", "60min")
    drawn = steady(page, "() => document.querySelector('.frame').getBoundingClientRect().height")
    fold(page, "right").click()
    press_run(page)
    stop = page.locator("#column-right").get_by_role("button", name="Stop, keep the best")
    expect(stop).to_be_visible(timeout=LONG)
    # The drawing keeps its height: the running job is next to it.
    assert page.evaluate("() => document.querySelector('.frame').getBoundingClientRect().height") == drawn
    stop.click()
    expect(page.locator("#column-right")).to_be_hidden(timeout=LONG)
    fold(page, "right").click()
    expect(page.locator("#result-panel")).to_be_visible()


@pytest.fixture(scope="module")
def spanish(browser: Browser, server: Server) -> Iterator[BrowserContext]:
    """Return a browser that asks for Spanish, which has the longest words."""
    context = browser.new_context(locale="es-ES")
    server.let_in(context)
    yield context
    context.close()


@pytest.mark.parametrize("width_px", [390, 640, 780, 900, 1080])
def test_the_bar_of_the_page_fits_a_small_window_in_the_longest_words(
    spanish: BrowserContext, server: Server, width_px: int
) -> None:
    server.speak_as_the_browser()
    page = spanish.new_page()
    page.set_viewport_size({"width": width_px, "height": 700})
    page.goto(server.origin)
    expect(page.locator("html")).to_have_attribute("lang", "es")
    expect(page.get_by_role("button", name="Control", exact=True)).to_be_visible()
    assert steady(page, STICKS_OUT) == [False]
    page.close()


@pytest.mark.parametrize(("width_px", "height_px"), [(390, 844), (640, 360), (900, 700)])
def test_nothing_sticks_out_of_a_small_window(browser: Browser, server: Server, width_px: int, height_px: int) -> None:
    """A phone; a laptop at a zoom of 200 %, which is 640 × 360; a tablet."""
    context = browser.new_context(viewport={"width": width_px, "height": height_px}, locale="en-US")
    server.let_in(context)
    page = context.new_page()
    page.goto(server.origin)
    expect(page.locator("#view-work")).to_be_visible()
    assert steady(page, STICKS_OUT) == [False]
    opened(page, PLATE)
    typed(page, "Time limit", "1s")
    run(page)
    for name in ("Issues", "Program", "Search", "Summary"):
        page.locator(".result").get_by_role("tab", name=re.compile(name)).click()
        expect(page.locator(".result").get_by_role("tab", name=re.compile(name))).to_have_attribute(
            "aria-selected", "true"
        )
        assert steady(page, STICKS_OUT) == [False], name
    for view in ("Jobs", "Machines", "Tools"):
        page.get_by_role("navigation", name="Views").get_by_text(view, exact=True).click()
        expect(page.locator(f"#view-{view.lower()}")).to_be_visible()
        assert steady(page, STICKS_OUT) == [False], view
    context.close()
