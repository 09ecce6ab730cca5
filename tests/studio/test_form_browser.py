"""The options form in Chromium: menus from the cut chart, and options found by a word."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, PLATE, choose_work, opened
from studio_server import Server

CHART = "process,material,thickness_mm,cut_speed_mm_min,amps\nplasma,hardox,7,2000,85\nplasma,hardox,11,1200,105\n"


def cutting(page: Page) -> None:
    opened(page, PLATE)
    choose_work(page, "cut")
    expect(page.get_by_label("Current", exact=True)).to_be_visible()  # drilling has none


def offered(page: Page, label: str) -> list[str]:
    """Return the choices in the menu of a field."""
    field = page.get_by_label(label, exact=True)
    field.press("ArrowDown")
    expect(field).to_have_attribute("aria-expanded", "true")
    found = page.locator(".menu:visible [role=option]").all_inner_texts()
    field.press("Escape")
    expect(field).to_have_attribute("aria-expanded", "false")
    return found


def test_material_thickness_and_current_are_offered_from_the_chart_and_can_be_typed(page: Page) -> None:
    cutting(page)
    assert offered(page, "Material") == ["aluminium", "mild steel", "stainless steel 304"]
    assert "6 mm" in offered(page, "Thickness")
    field = page.get_by_label("Material", exact=True)
    field.fill("alu")
    expect(page.locator(".menu:visible [role=option]")).to_have_text(["aluminium"])
    field.press("ArrowDown")
    field.press("Enter")
    expect(page.locator("#command")).to_contain_text("--material aluminium")
    assert field.evaluate("at => at === document.activeElement")
    thickness = page.get_by_label("Thickness", exact=True)
    thickness.fill('3/8"')
    thickness.press("Tab")
    expect(page.locator("#command")).to_contain_text("--thickness '3/8\"'")
    expect(page.get_by_label("Material", exact=True)).to_be_focused()
    page.get_by_role("button", name="Choices: Current").click()
    page.get_by_role("option", name="45 A").click()
    expect(page.locator("#command")).to_contain_text("--amps 45")


def test_a_chart_of_ones_own_fills_the_menus_and_a_broken_one_says_its_line(page: Page, tmp_path: Path) -> None:
    cutting(page)
    chart = tmp_path / "shop.csv"
    chart.write_text(CHART)
    page.get_by_label("Find an option").fill("cut chart")
    page.get_by_label("Cut chart: File …").set_input_files(chart)
    expect(page.locator("#command")).to_contain_text("--chart shop.csv")
    page.get_by_label("Find an option").press("Escape")
    assert offered(page, "Material") == ["hardox"]
    page.get_by_label("Material", exact=True).fill("hardox")
    page.get_by_label("Material", exact=True).press("Tab")
    expect(page.locator("#command")).to_contain_text("--material hardox")
    assert offered(page, "Thickness") == ["7 mm", "11 mm"]
    page.get_by_label("Thickness", exact=True).fill("11")
    page.get_by_label("Thickness", exact=True).press("Tab")
    expect(page.locator("#command")).to_contain_text("--thickness 11")
    assert offered(page, "Current") == ["105 A"]
    chart.write_text(CHART.replace("2000", "fast"))
    page.get_by_label("Find an option").fill("--chart")
    page.get_by_label("Cut chart: File …").set_input_files(chart)
    expect(page.get_by_role("alert")).to_contain_text("shop.csv:2: 'cut_speed_mm_min' is 'fast', not a number")


def test_an_option_is_found_by_its_label_its_flag_and_its_help(page: Page) -> None:
    cutting(page)
    find, height = page.get_by_label("Find an option"), page.get_by_label("Cut height", exact=True)
    expect(height).to_be_hidden()
    for word in ("CUT hei", "--cut-height", "height cut"):
        find.fill(word)
        expect(height).to_be_visible()
    find.fill("rest of the sheet flat")  # words of its help alone
    expect(page.get_by_label("Sweep direction", exact=True)).to_be_visible()
    expect(height).to_be_hidden()
    find.fill("xyzzy")
    expect(page.get_by_text("No option of this name.")).to_be_visible()
    find.press("Escape")
    expect(find).to_have_value("")
    expect(height).to_be_hidden()
    expect(page.get_by_label("Material", exact=True)).to_be_visible()


def test_the_main_fields_stand_first_and_the_others_in_folded_groups(page: Page) -> None:
    cutting(page)
    expect(page.locator(".choose .find ~ section .field:visible")).to_have_count(14)
    assert page.locator(".choose .find ~ details").count() > 3
    expect(page.locator(".choose .find ~ details .field:visible")).to_have_count(0)


def test_on_a_spanish_page_refusals_and_issues_are_said_in_spanish(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="es-ES")
    server.let_in(context)
    page = context.new_page()
    page.goto(f"{server.origin}/?lang=es")
    opened(page, PLATE)
    page.get_by_label("Espesor", exact=True).fill("1/0in")
    page.get_by_label("Espesor", exact=True).press("Tab")
    expect(page.get_by_role("alert")).to_have_text("división entre cero en '1/0in'")
    page.get_by_label("Espesor", exact=True).fill("")
    page.get_by_label("Espesor", exact=True).press("Tab")
    page.get_by_label("Esfuerzo", exact=False).first.select_option("fast")
    page.get_by_role("button", name="Ejecutar", exact=True).click()
    expect(page.locator(".result .error")).to_contain_text("para taladrar hace falta una profundidad", timeout=LONG)
    page.get_by_label("Espesor", exact=True).fill("6mm")
    page.get_by_label("Espesor", exact=True).press("Tab")
    page.get_by_role("button", name="Ejecutar", exact=True).click()
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    page.locator("#tab-issues").click()
    expect(page.locator(".issue-list [lang=es]").filter(has_text="se supone").first).to_be_visible()
    page.goto(f"{server.origin}/?lang=en")
    context.close()


def test_a_key_leads_to_the_field_that_finds_options(page: Page) -> None:
    opened(page, PLATE)
    page.keyboard.press("/")
    expect(page.get_by_label("Find an option")).to_be_focused()
    page.keyboard.type("peck")
    expect(page.get_by_label("Peck depth", exact=True)).to_be_visible()
    expect(page.get_by_label("Machine", exact=True)).to_have_count(0)


def test_a_form_begins_with_the_persons_own_defaults_and_tells_where_they_come_from(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are in the fields; a typed value has no note."""
    shop = tmp_path / "shop.toml"
    shop.write_text('machine = "haas-vf2"\n')
    monkeypatch.setenv("LEAFCUT_DEFAULTS", str(shop))
    server = Server(tmp_path / "home")
    try:
        context = browser.new_context()
        server.let_in(context)
        page = context.new_page()
        page.goto(server.origin)
        opened(page, PLATE)
        expect(page.locator("#command")).to_contain_text("--machine haas-vf2 --no-defaults")
        note = page.get_by_text("from your defaults (shop.toml:1)", exact=True)
        expect(note).to_be_visible()
        page.get_by_label("Machine", exact=True).select_option("fagor-8055")
        expect(note).to_have_count(0)
        context.close()
    finally:
        server.end()
