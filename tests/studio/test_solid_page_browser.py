"""The solid view on the studio's page: of a run, of a program that is opened, and for everybody."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, PLATE, ROOT, opened, run, serious
from studio_server import Server

#: A slot whose tool the program describes.
SLOT = "(T1 D=8. CR=0. - flat end mill)\nG21 G90 G94\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-3 F200\nX60 F600\nG0 Z5\nM30\n"


def solid(page: Page, name: str = "Solid") -> None:
    """See the stock, and wait until it is cut."""
    page.get_by_role("radio", name=name, exact=True).click()
    expect(page.locator(".lc-solid-frame")).to_have_attribute("aria-busy", "false")


def test_the_stock_of_a_drilled_plate_is_seen_and_nobody_is_kept_out(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True, locale="en-US")
    server.let_in(context)
    page = context.new_page()
    page.goto(server.origin)
    opened(page, PLATE)
    run(page)
    solid(page)
    expect(page.locator(".lc-picture")).to_be_visible()
    page.get_by_label("Colour", exact=True).select_option("depth")
    page.get_by_label("Section", exact=True).select_option("x")
    expect(page.get_by_label("Place of the section", exact=True)).to_be_visible()
    page.reload()
    expect(page.get_by_role("radio", name="Solid", exact=True)).to_have_attribute("aria-checked", "true", timeout=LONG)
    expect(page.locator(".lc-picture")).to_be_visible()
    expect(page.get_by_label("Colour", exact=True)).to_have_value("depth")
    expect(page.get_by_label("Section", exact=True)).to_have_value("x")
    found = serious(page, "solid")
    context.close()
    assert found == []


def test_a_program_that_is_opened_is_cut_where_its_tools_are_known(page: Page, tmp_path: Path) -> None:
    (tmp_path / "slot.nc").write_text(SLOT)
    opened(page, tmp_path / "slot.nc")
    solid(page)
    expect(page.locator(".lc-picture")).to_be_visible()
    expect(page.locator(".lc-refused")).to_be_hidden()
    for key, name in (("ArrowLeft", "Plan"), ("End", "Both"), ("ArrowLeft", "Solid")):
        page.keyboard.press(key)
        expect(page.get_by_role("radio", name=name, exact=True)).to_be_checked()
        expect(page.get_by_role("radio", name=name, exact=True)).to_be_focused()
    opened(page, ROOT / "examples" / "cam_121.nc")
    expect(page.locator(".lc-refused")).to_contain_text("the shape of tool T1 is unknown", timeout=LONG)


def test_the_reason_for_no_picture_is_in_the_language_of_the_page(page: Page) -> None:
    page.locator(".languages").get_by_role("link", name="Español").click()
    expect(page.locator("html")).to_have_attribute("lang", "es")
    opened(page, ROOT / "examples" / "cam_121.nc")
    solid(page, "Sólido")
    expect(page.locator(".lc-refused")).to_contain_text("no se conoce la forma de la herramienta T1", timeout=LONG)


def test_a_sheet_has_no_solid_view(page: Page) -> None:
    opened(page, ROOT / "examples" / "sheet.dxf")
    page.get_by_label("Thickness", exact=True).fill("6")
    page.get_by_label("Thickness", exact=True).blur()
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    expect(page.locator("[data-mode=after]")).to_be_visible()
    expect(page.locator("[data-space=solid]")).to_be_hidden()
