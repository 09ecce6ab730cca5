"""Machines and tools by form in Chromium: both tabs change one text, and what is wrong is shown where it stands."""

from __future__ import annotations

import re

from playwright.sync_api import Page, expect
from studio_page import choose_machine, typed


def copied(page: Page, view: str, name: str) -> None:
    """Copy something that is shipped, to change it."""
    place = page.locator(f"#view-{view}")
    if view == "machines":
        choose_machine(page, name)
    place.get_by_role("button", name="Copy", exact=True).click()
    expect(place.locator(".editor-bar input")).to_have_value(re.compile(f"^my-{name}"))


def tab(page: Page, name: str) -> None:
    page.locator("[role=tab]:visible").filter(has_text=name).click()
    expect(page.locator("[role=tab]:visible").filter(has_text=name)).to_have_attribute("aria-selected", "true")


def test_a_machine_is_changed_by_form_and_by_text_and_both_say_the_same(page: Page) -> None:
    page.keyboard.press("3")
    copied(page, "machines", "grbl-3018")
    speed = page.get_by_label("Speed X", exact=True)
    expect(speed).to_have_value("800 mm/min")
    speed.fill("1 1/2 m/min")
    speed.press("Tab")
    expect(page.locator("#view-machines .tag")).to_have_text("not saved yet")
    expect(page.get_by_label("Speed Y", exact=True)).to_be_focused()
    tab(page, "TOML")
    text, rows = page.locator(".editor .cm-content"), page.locator(".editor .cm-line")
    for row in ('velocity = "1 1/2 m/min"', '"rapid.velocity" = "set by hand"'):
        expect(rows.filter(has_text=re.compile(f"^{re.escape(row)}$"))).to_have_count(1)
    text.press("Control+Home")
    page.keyboard.insert_text("# our own\n")
    rows.filter(has_text='deviation = "0.01 mm"').click()
    page.keyboard.press("End")
    page.keyboard.press("Shift+Home")
    page.keyboard.insert_text('deviation = "0 mm"')
    problem = page.locator(".problem:visible")
    expect(problem).to_contain_text("'corners.deviation' is 0 mm, but must be above 0")
    line = next(k for k, row in enumerate(rows.all_inner_texts(), 1) if row.startswith("deviation"))
    expect(page.locator(".editor .wrong")).to_have_text('deviation = "0 mm"')
    expect(text).to_have_attribute("aria-invalid", "true")
    tab(page, "Form")
    expect(page.get_by_role("alert")).to_contain_text("is 0 mm, but must be above 0")
    page.get_by_role("button", name=f"Go to line {line}").click()
    expect(text).to_be_focused()
    assert page.evaluate("getSelection().toString()") == 'deviation = "0 mm"'
    tab(page, "Form")
    typed(page, "Deviation", "0.02")
    expect(problem).to_be_hidden()
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#said")).to_contain_text("checked and saved")
    expect(page.locator("#view-machines .tag")).to_be_hidden()
    tab(page, "TOML")
    expect(rows.first).to_have_text("# our own")
    expect(rows.filter(has_text='deviation = "0.02 mm"')).to_have_count(1)


def test_what_is_shipped_can_be_looked_at_and_not_changed(page: Page) -> None:
    page.keyboard.press("3")
    choose_machine(page, "haas-vf2")
    fields = page.locator("#view-machines .profile :is(input, select)")
    assert fields.count() > 15
    assert fields.evaluate_all("all => all.every((one) => one.readOnly || one.disabled)")
    expect(page.locator("#view-machines").get_by_role("button", name="Save")).to_have_count(0)


def test_a_tool_is_added_changed_and_used_in_a_recipe(page: Page) -> None:
    page.keyboard.press("4")
    copied(page, "tools", "example")
    page.get_by_role("button", name="Add a tool").click()
    expect(page.get_by_label("Number", exact=True)).to_have_value("17")
    typed(page, "Diameter", '3/8"')
    expect(page.get_by_role("button", name="T17", exact=False)).to_contain_text('3/8"')
    page.get_by_label("Kind", exact=True).select_option("tap")
    expect(page.locator(".problem:visible")).to_contain_text("a tap needs 'pitch'")
    expect(page.get_by_role("alert")).to_be_visible()
    typed(page, "Pitch", "1.5")
    expect(page.locator(".problem:visible")).to_have_count(0)
    page.get_by_role("button", name="Add a recipe").click()
    expect(page.get_by_label("Tools in order", exact=True)).to_have_value("1")
    typed(page, "Diameter", "3/8in")
    typed(page, "Tools in order", "1, 99")
    expect(page.get_by_role("alert")).to_contain_text("names tool 99, which is not in this library")
    typed(page, "Tools in order", "1, 17")
    expect(page.get_by_role("alert")).to_have_count(0)
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#said")).to_contain_text("checked and saved")
