"""Nesting in Chromium: parts with quantities, nests to choose from, their cuts compared, and the programs."""

from __future__ import annotations

from pathlib import Path

import pytest
from parts_to_nest import ANGLE, PLATE
from playwright.sync_api import Page, expect
from studio_page import LONG, choose_work, downloaded, press_run, typed, work_is

from leafcut.cli import app as cli


def test_parts_are_nested_compared_cut_and_downloaded_as_the_command_line_writes_them(
    page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    drawings = {"plate.svg": PLATE, "angle.svg": ANGLE}
    for name, data in drawings.items():
        Path(name).write_bytes(data)
    choose_work(page, "nest")
    expect(page.locator("#open-file[multiple]")).to_be_attached()
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    page.set_input_files("#open-file", list(drawings))
    expect(page.locator(".piece")).to_have_text(list(drawings))
    pieces = page.get_by_label("Quantity: plate.svg")
    typed(page, "Quantity: plate.svg", "none")
    expect(page.locator("#said")).to_contain_text("quantity: 'none' is not a whole number")
    expect(pieces).to_have_value("1")
    typed(page, "Quantity: plate.svg", "4")
    typed(page, "Quantity: angle.svg", "2")
    for label, value in {"Sheet": "260x130", "Part gap": "2", "Edge margin": "2", "Variants": "2"}.items():
        typed(page, label, value)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    words = (
        "leafcut nest plate.svg:4 angle.svg:2 -o nest.dxf --sheet 260x130 --gap 2 --margin 2 --variants 2 --preset fast"
    )
    expect(page.locator("#command")).to_have_text(words)
    press_run(page)
    variants = page.locator("table.nests tbody tr")
    expect(variants).to_have_count(2, timeout=LONG)
    assert cli.run([*words.split()[1:], "--quiet"]) == 0
    sheet = page.locator(".sheets li").first
    with page.expect_download() as waiting:
        sheet.get_by_role("link", name="DXF").click()
    drawn = waiting.value
    assert Path(drawn.path()).read_bytes() == Path(drawn.suggested_filename).read_bytes()

    page.locator(".cuts").get_by_label("Thickness", exact=True).fill("6")
    page.keyboard.press("Tab")
    page.get_by_role("button", name="Plan all and compare").click()
    for row in variants.all():
        expect(row.locator("td").last).to_contain_text(" s", timeout=LONG)
    chosen = variants.last
    chosen.get_by_role("button").click()
    expect(chosen.get_by_role("button")).to_have_attribute("aria-pressed", "true")
    sheet.get_by_role("button", name="Cutting plan").click()
    expect(page.locator(".back")).to_be_visible()
    work_is(page, "cut")
    given, program = downloaded(page, "Program")
    shown = (page.locator("#command").text_content() or "").split()
    assert cli.run([*shown[1:], "--quiet"]) == 0
    assert program == Path(given).read_bytes()
    page.locator(".back").click()
    expect(variants.last.get_by_role("button")).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".piece")).to_have_text(list(drawings))


def test_a_list_fills_in_the_figures_of_the_drawings_that_are_there(page: Page) -> None:
    choose_work(page, "nest")
    expect(page.locator("#open-file[multiple]")).to_be_attached()

    def opened(name: str, data: bytes) -> None:
        page.set_input_files("#open-file", {"name": name, "mimeType": "", "buffer": data})

    opened("plate.svg", PLATE)
    expect(page.locator(".piece")).to_have_count(1)
    opened("parts.csv", b"file;quantity;rotations\nplate.svg;7;0 180\nangle.svg;3;free\n")
    expect(page.locator("#said")).to_contain_text("The list also names angle.svg")
    opened("angle.svg", ANGLE)
    expect(page.get_by_label("Quantity: angle.svg")).to_have_value("3")
    expect(page.get_by_label("Quantity: plate.svg")).to_have_value("7")
    expect(page.get_by_label("Rotations: angle.svg")).to_have_value("free")
    expect(page.locator("#command")).to_contain_text("leafcut nest parts.csv -o nest.dxf")
    page.get_by_role("button", name="Remove: plate.svg").click()
    expect(page.locator(".piece")).to_have_text(["angle.svg"])
