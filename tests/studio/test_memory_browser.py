"""File, options and edits survive reload, a change of language, Back, a restart, and two tabs."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, PLATE, choose_machine, opened, run, said_by, sure, typed
from studio_server import Server, running
from test_stale_browser import select_hole

OTHER = PLATE.with_name("plate_27.dxf")


def kept(page: Page) -> None:
    """Wait until the browser has the choices of the page."""
    page.wait_for_function("() => JSON.parse(history.state?.choices ?? '{}').source")


def test_file_and_options_live_through_reload_language_and_back(page: Page, server: Server) -> None:
    opened(page, PLATE)
    typed(page, "Thickness", "7mm")
    page.get_by_label("Machine", exact=True).select_option("haas-vf2")
    kept(page)
    page.get_by_label("Time limit", exact=True).fill("11s")  # the field keeps its focus: text being typed counts, too
    page.reload()
    for label, value in (("Thickness", "7mm"), ("Machine", "haas-vf2"), ("Time limit", "11s")):
        expect(page.get_by_label(label, exact=True)).to_have_value(value)
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    expect(page.locator("#command")).to_contain_text("--thickness 7mm --machine haas-vf2")
    page.get_by_role("link", name="Español").click()
    expect(page.get_by_label("Espesor", exact=True)).to_have_value("7mm")
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    page.get_by_role("link", name="English").click()
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("7mm")
    page.goto("about:blank")
    page.go_back()
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("7mm")
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    assert "token" not in page.url
    assert page.evaluate("() => JSON.stringify({ ...sessionStorage })").count(PLATE.name) == 0


def test_an_outcome_of_earlier_choices_is_still_marked_after_a_reload(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "5")
    run(page)
    page.get_by_role("tab", name="Search").click()
    typed(page, "Thickness", "9")
    expect(page.locator(".stale li")).to_have_count(1)
    page.reload()
    expect(page.locator(".stale li")).to_have_text(["Thickness 5\u00a0mm; now 9\u00a0mm"])
    expect(page.get_by_role("tab", name="Search")).to_have_attribute("aria-selected", "true")


def test_an_order_edited_by_hand_lives_through_a_reload_and_another_file(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "5")
    run(page)
    page.get_by_role("button", name="Edit the order").click()
    select_hole(page, 3)
    length = page.locator(".edit .figure").first
    found = said_by(length)
    page.locator(".edit").get_by_role("button", name="First", exact=True).click()
    expect(length).not_to_have_text(found)
    edited = said_by(length)
    page.reload()
    expect(page.locator(".edit")).to_be_visible()
    expect(length).to_have_text(edited)
    opened(page, OTHER)
    expect(page.locator(".edit")).to_be_hidden()
    page.go_back()
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    expect(page.locator(".edit")).to_be_visible()
    expect(length).to_have_text(edited)
    page.locator(".edit").get_by_role("button", name="Undo", exact=True).click()
    expect(length).to_have_text(found)


def test_back_and_forward_go_through_views_files_and_jobs(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "5")
    run(page)
    for key, view in (("2", "jobs"), ("3", "machines"), ("4", "tools")):
        page.keyboard.press(key)
        expect(page.locator(f"#view-{view}")).to_be_visible()
        expect(page).to_have_url(re.compile(f"view={view}"))
    for view in ("machines", "jobs", "work"):
        page.go_back()
        expect(page.locator(f"#view-{view}")).to_be_visible()
    page.go_forward()
    expect(page.locator("#view-jobs")).to_be_visible()
    page.reload()
    expect(page.locator("#view-jobs")).to_be_visible()
    page.keyboard.press("1")
    typed(page, "Thickness", "6")
    opened(page, OTHER)
    typed(page, "Thickness", "8")
    page.go_back()
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("6")
    expect(page.locator(".stale li")).to_have_count(1)
    page.go_forward()
    expect(page.locator(".about-part .name")).to_have_text(OTHER.name)
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("8")
    # Opening a job is a step of the history, too: earlier choices are not lost.
    page.get_by_role("button", name="Jobs", exact=True).click()
    page.locator("table.jobs tbody tr").first.get_by_role("button", name="Open").click()
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("5")
    page.go_back()
    expect(page.locator("#view-jobs")).to_be_visible()
    page.go_back()
    expect(page.locator("#view-work")).to_be_visible()
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("8")
    expect(page.locator(".about-part .name")).to_have_text(OTHER.name)


WHERE_IT_IS_SEEN = """([place, attribute]) => {
  const seen = document.querySelector(place);
  window.stood = "";
  new MutationObserver(() => { window.stood ||= location.search + history.state.choices; })
    .observe(seen, attribute ? { attributes: true } : { childList: true, characterData: true, subtree: true });
}"""


def test_what_is_seen_can_be_gone_back_from_at_once(page: Page) -> None:
    """The address stands before what it leads to is drawn; looked at in the very moment in which that is drawn."""
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "5")
    run(page)
    page.evaluate(WHERE_IT_IS_SEEN, [".about-part", False])
    opened(page, OTHER)
    assert OTHER.name in page.evaluate("stood")
    page.evaluate(WHERE_IT_IS_SEEN, ["#view-jobs", True])
    page.get_by_role("button", name="Jobs", exact=True).click()
    page.wait_for_function("stood", timeout=LONG)
    assert "view=jobs" in page.evaluate("stood")
    page.evaluate(WHERE_IT_IS_SEEN, ["#view-work", True])
    page.locator("table.jobs tbody tr").first.get_by_role("button", name="Open").click()
    page.wait_for_function("stood", timeout=LONG)
    assert "job=" in page.evaluate("stood")


def test_a_tab_that_is_doubled_goes_its_own_way(page: Page) -> None:
    opened(page, PLATE)
    typed(page, "Thickness", "5")
    expect(page.locator("#command")).to_contain_text("--thickness 5")
    kept(page)
    with page.context.expect_page() as doubled:
        page.evaluate("open(location.href)")
    other = doubled.value
    other.wait_for_load_state()
    other.evaluate("state => history.replaceState(state, '')", page.evaluate("history.state"))  # as a browser does
    other.reload()
    expect(other.get_by_label("Thickness", exact=True)).to_have_value("5")
    typed(other, "Thickness", "6")
    typed(page, "Thickness", "7")
    for tab, value in ((page, "7"), (other, "6")):
        tab.reload()
        expect(tab.get_by_label("Thickness", exact=True)).to_have_value(value)
    other.close()


def test_everything_is_there_when_the_studio_is_started_again(browser: Browser, tmp_path: Path) -> None:
    with running(tmp_path) as first:
        page = browser.new_page(locale="en-US", viewport={"width": 1280, "height": 720})
        page.goto(f"{first.origin}/?token={first.key}")
        opened(page, PLATE)
        typed(page, "Thickness", "5")
        page.keyboard.press("3")
        choose_machine(page, "grbl-3018")
        page.locator("#view-machines").get_by_role("button", name="Copy").click()
        expect(page.locator("#editor-name-machines")).to_have_value("my-grbl-3018")
        page.locator("#view-machines").get_by_role("tab", name="TOML").click()
        text = page.locator("#view-machines .editor .cm-content")
        text.press("Control+Home")
        page.keyboard.insert_text("# mine\n")
        text.blur()
        page.locator("#view-machines").get_by_role("button", name="haas-vf2", exact=True).click()
        expect(text).to_contain_text('name = "haas-vf2"')
    page.evaluate("window.before = true")
    with running(tmp_path, port=first.port):
        page.wait_for_function("!window.before", timeout=LONG)
        expect(page.locator("#view-machines")).to_be_visible()
        choose_machine(page, "my-grbl-3018")
        expect(page.locator("#view-machines .tag")).to_have_text("not saved yet")
        page.locator("#view-machines").get_by_role("tab", name="TOML").click()
        expect(text).to_contain_text("# mine")
        sure(page.get_by_role("button", name="Discard changes"))
        expect(page.locator("#view-machines .tag")).to_be_hidden()
        page.keyboard.press("1")
        expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
        expect(page.get_by_label("Thickness", exact=True)).to_have_value("5")
        page.close()


def test_a_restart_shows_the_tab_that_was_shown_with_the_result(browser: Browser, tmp_path: Path) -> None:
    summary = re.compile("^Summary")
    with running(tmp_path) as first:
        page = browser.new_page(locale="en-US", viewport={"width": 1280, "height": 720})
        page.goto(f"{first.origin}/?token={first.key}")
        opened(page, PLATE.with_name("cam_121.nc"))
        expect(page.get_by_role("tab", name="Program", selected=True)).to_be_visible()
        run(page)
        expect(page.get_by_role("tab", name=summary, selected=True)).to_be_visible()
        page.wait_for_function("() => JSON.parse(history.state.choices).job")
    page.evaluate("window.before = true")
    with running(tmp_path, port=first.port):
        page.wait_for_function("!window.before", timeout=LONG)
        expect(page.get_by_role("tab", name=summary, selected=True)).to_be_visible()
        page.close()


def test_recent_files_are_opened_with_a_click_and_a_page_that_was_closed_is_gone_on_with(
    browser: Browser, tmp_path: Path
) -> None:
    with running(tmp_path) as server:
        context = browser.new_context(locale="en-US", viewport={"width": 1280, "height": 720})
        server.let_in(context)
        page = context.new_page()
        page.goto(server.origin)
        for file in (PLATE, OTHER, PLATE):
            opened(page, file)
        typed(page, "Thickness", "5")
        page.wait_for_function("() => JSON.parse(history.state.choices).table.thickness?.[0] === '5'")
        page.close()
        page = context.new_page()
        page.goto(server.origin)
        row = page.get_by_role("group", name="Recent files")
        expect(row.get_by_role("button")).to_have_text([PLATE.name, OTHER.name])
        row.get_by_role("button", name=OTHER.name).click()
        expect(page.locator(".about-part .name")).to_have_text(OTHER.name)
        page.get_by_text("Recent files", exact=True).first.click()
        expect(page.locator(".recent li .button")).to_have_text([OTHER.name, PLATE.name])
        again = context.new_page()
        again.goto(server.origin)
        again.get_by_role("button", name=f"Continue with {PLATE.name}").click()
        expect(again.locator(".about-part .name")).to_have_text(PLATE.name)
        expect(again.get_by_label("Thickness", exact=True)).to_have_value("5")
        again.get_by_text("Recent files", exact=True).first.click()
        sure(again.get_by_role("button", name="Clear the list"))
        expect(again.locator(".recent li")).to_have_count(0)
        expect(again.locator(".about-part .name")).to_have_text(PLATE.name)
        context.close()
