"""The table of operations by layer in Chromium: the file that it writes, its errors, and its rows in the drawing."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect
from studio_page import ROOT, choose_work, downloaded, loaded, opened, run, serious, typed

from leafcut.cli import app as cli

EXAMPLES = ROOT / "examples"
#: The position on the page of a point of the drawing, when it is drawn.
PLACE = """async ([x, y]) => {
  const { whenThere } = await import("leafcut-canvas/registry.js");
  const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
  const drawing = await new Promise((done) => whenThere(id, done));
  while (!drawing.wholePaths || drawing._request) await new Promise(requestAnimationFrame);
  const box = drawing.panes[1].canvas.getBoundingClientRect();
  return [box.left + drawing.view.toX(x), box.top + drawing.view.toY(y)];
}"""


def row(page: Page, layer: str) -> Locator:
    return page.locator(f".operations section[aria-label^='{layer}']")


def choose(page: Page, field: str, layer: str, value: str) -> None:
    page.get_by_label(f"{field}: {layer}", exact=True).select_option(value)


def test_the_table_writes_the_file_that_the_command_line_reads(
    page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    opened(page, EXAMPLES / "nameplate.dxf")
    choose_work(page, "part")
    expect(page.locator(".operations section")).to_have_count(5)
    expect(row(page, "OUTLINE").locator("h3")).to_have_text("OUTLINE: closed: 2")
    form = page.locator("#view-work")
    form.get_by_label("Machine", exact=True).select_option("shapeoko-router")
    typed(page, "Thickness", "6")
    form.get_by_label("Tool library: File …").set_input_files(EXAMPLES / "mills.toml")
    choose(page, "Operation", "POCKET_3", "pocket")
    expect(row(page, "POCKET_3").get_by_role("alert")).to_contain_text("needs a depth")
    expect(row(page, "OUTLINE").get_by_role("alert")).to_contain_text("no operation yet")
    typed(page, "Depth: POCKET_3", "7")
    expect(row(page, "POCKET_3").get_by_role("alert")).to_contain_text("goes through the plate of 6 mm")
    typed(page, "Depth: POCKET_3", "3mm")
    expect(row(page, "POCKET_3").get_by_role("alert")).to_have_count(0)
    choose(page, "Tool", "POCKET_3", "3")
    expect(row(page, "POCKET_3").get_by_role("alert")).to_contain_text("is a v-bit, not an end mill")
    choose(page, "Tool", "POCKET_3", "2")
    choose(page, "Rest with", "POCKET_3", "4")
    choose(page, "Operation", "OUTLINE", "profile")
    typed(page, "Chamfer: OUTLINE", "0.3mm")
    choose(page, "Tool", "OUTLINE", "3")
    choose(page, "Operation", "HOLES", "bore")
    choose(page, "Operation", "NOTES", "ignore")
    choose(page, "Operation", "TEXT", "engrave")
    typed(page, "Depth: TEXT", "0.3mm")
    expect(page.locator(".operations [role=alert]")).to_have_count(0)
    expect(page.locator("#command")).to_contain_text("--operations operations.toml")
    page.locator(".operations summary").click()
    name, content = downloaded(page, "Download")
    assert name == "operations.toml"
    assert tomllib.loads(content.decode())["layer"] == {
        "POCKET_3": "pocket 3mm T2 rest T4",
        "OUTLINE": "profile + chamfer 0.3mm T3",
        "HOLES": "bore",
        "NOTES": "ignore",
        "TEXT": "engrave 0.3mm",
    }

    assert name == "operations.toml"
    Path(name).write_bytes(content)
    for file in ("nameplate.dxf", "mills.toml"):
        Path(file).write_bytes((EXAMPLES / file).read_bytes())
    typed(page, "Tool diameter", "3")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    cells = page.get_by_role("table", name="Operations by layer").locator("tr", has_text="POCKET_3").locator("th, td")
    expect(cells).to_have_text(["POCKET_3", "Pocket", "3", "T2 / T4", "10,000 / 12,000", "900 / 400"])
    given, program = downloaded(page, "Program")
    shown = (page.locator("#command").text_content() or "").split()
    assert cli.run([*shown[1:], "--quiet"]) == 0
    assert program == Path(given).read_bytes()

    page.reload()
    expect(page.get_by_label("Depth: POCKET_3", exact=True)).to_have_value("3mm")


def test_a_click_on_a_shape_selects_the_row_of_its_layer(page: Page) -> None:
    opened(page, EXAMPLES / "nameplate.dxf")
    choose_work(page, "part")
    expect(page.locator(".operations section")).to_have_count(5)
    page.mouse.click(*page.evaluate(PLACE, [12, 20]))  # the left wall of the pocket
    expect(page.get_by_label("Operation: POCKET_3", exact=True)).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_label("Operation: TEXT", exact=True)).to_be_focused()
    expect(page.locator(".lc-readout")).to_have_text("TEXT")


def test_the_table_is_accessible(browser: Any, server: Any) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", bypass_csp=True)
    try:
        server.let_in(context)
        page = context.new_page()
        page.goto(server.origin)
        loaded(page)
        opened(page, EXAMPLES / "nameplate.dxf")
        choose_work(page, "part")
        choose(page, "Operation", "POCKET_3", "pocket")
        expect(row(page, "POCKET_3").get_by_role("alert")).to_be_visible()
        page.locator(".operations summary").click()
        assert serious(page, "operations") == []
    finally:
        context.close()
