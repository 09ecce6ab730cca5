"""The summary in Chromium: the figures of the report, the running trial, and every strategy's path on the drawing."""

from __future__ import annotations

import csv
import html
import io
from pathlib import Path

from parts_to_nest import ANGLE, PLATE, svg
from playwright.sync_api import Page, expect
from studio_page import LONG, ROOT, choose_work, downloaded, opened, press_run, typed

DRAWN = """async () => {
    const { whenThere } = await import("leafcut-canvas/registry.js");
    const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
    const drawing = await new Promise((done) => whenThere(id, done));
    return [drawing.main?.scene.header.name, drawing.modes.length];
}"""


def run(page: Page) -> None:
    page.get_by_label("Search effort", exact=True).select_option("fast")
    press_run(page)
    expect(page.get_by_role("tab", name="Issues")).to_be_visible(timeout=LONG)


def test_a_sheet_tells_its_cost_its_batch_its_parts_and_its_time_as_the_report_does(page: Page) -> None:
    opened(page, ROOT / "examples" / "sheet.dxf")
    choose_work(page, "cut")
    typed(page, "Thickness", "6")
    page.evaluate("document.querySelectorAll('.left details').forEach((one) => { one.open = true; })")
    typed(page, "Quantity", "25")
    run(page)
    report = html.unescape(
        downloaded(page, "↓ Report" if page.get_by_text("↓ Report").count() else "Report")[1].decode()
    )
    tiles = page.locator(".tile")
    expect(tiles.filter(has_text="Batch of 25")).to_have_count(1)
    expect(tiles.filter(has_text="Pierces")).to_have_count(1)
    for figure in tiles.locator("b").all_inner_texts():
        assert figure in report
    bars = page.get_by_role("list", name="Where the time goes").get_by_role("listitem")
    expect(bars).to_have_count(3)
    for bar in bars.all():
        assert bar.locator("b").inner_text() in report
        shares = bar.locator("i").evaluate_all("parts => parts.map((part) => parseFloat(part.style.width))")
        assert 0 < sum(shares) <= 100.1
    parts = page.locator(".parts-of-sheet tbody tr")
    assert parts.count() > 2
    for row in parts.all():
        assert row.locator("th").inner_text() in report
    norms = page.locator(".norms-of-sheet")
    for figure in norms.locator("tbody td").all_inner_texts():
        assert figure in report
    name, table = downloaded(page, "Time per part")
    rows = list(csv.DictReader(io.StringIO(table.decode())))
    assert name.endswith("_norms.csv")
    assert [row["of"] for row in rows][-2:] == ["sheet", "batch"]
    assert norms.locator("tbody tr").count() == len(rows)
    page.get_by_role("link", name="Español").click()
    expect(tiles.filter(has_text="Lote de 25")).to_have_count(1)
    expect(tiles.filter(has_text="perforando")).to_have_count(1)
    expect(norms).to_contain_text("Perímetro total")


def test_each_strategy_of_a_pocket_is_shown_on_its_own(page: Page, tmp_path: Path) -> None:
    drawing = tmp_path / "pocket.svg"
    drawing.write_bytes(svg(50, 40, '<path d="M5 5H45V35H5Z"/>'))
    opened(page, drawing)
    choose_work(page, "pocket")
    typed(page, "Tool diameter", "10")
    typed(page, "Depth", "3")
    run(page)
    table = page.get_by_role("table", name="All strategies compared, one level of the pockets")
    contour, zigzag = (table.get_by_role("button", name=name) for name in ("contour", "zigzag"))
    contour.focus()
    page.keyboard.press("Enter")
    expect(contour).to_have_attribute("aria-pressed", "true")
    page.wait_for_function(f"({DRAWN})().then((found) => found[0] === 'contour' && found[1] === 1)")
    zigzag.click()
    expect(contour).to_have_attribute("aria-pressed", "false")
    page.wait_for_function(f"({DRAWN})().then((found) => found[0] === 'zigzag')")
    zigzag.click()  # a second click shows the written program again
    page.wait_for_function(f"({DRAWN})().then((found) => found[0] === 'pocket' && found[1] === 4)")
    contour.click()
    page.get_by_role("tab", name="Issues").click()
    page.wait_for_function(f"({DRAWN})().then((found) => found[0] === 'pocket' && found[1] === 4)")


def test_issues_are_grouped_by_severity_and_code_and_only_warnings_are_counted(page: Page) -> None:
    opened(page, ROOT / "examples" / "cam_121.nc")
    run(page)
    tab = page.get_by_role("tab", name="Issues")
    expect(tab).to_have_text("Issues 1")
    tab.click()
    panel = page.locator("#result-panel")
    expect(panel.locator("h3")).to_have_text(["Warnings", "Notes"])
    staying = panel.locator("li.note").filter(has_text="L501")
    expect(staying).to_have_count(1)
    expect(staying.locator("p:visible")).to_have_count(3)
    staying.locator("summary").click()
    expect(staying.locator("p:visible")).not_to_have_count(3)


def test_a_nest_that_goes_on_tells_what_is_being_tried(page: Page, tmp_path: Path) -> None:
    drawings = {"plate.svg": PLATE, "angle.svg": ANGLE}
    for name, data in drawings.items():
        (tmp_path / name).write_bytes(data)
    choose_work(page, "nest")
    expect(page.locator("#open-file[multiple]")).to_be_attached()
    page.set_input_files("#open-file", [tmp_path / name for name in drawings])
    expect(page.locator(".piece")).to_have_text(list(drawings))
    typed(page, "Quantity: plate.svg", "9")
    typed(page, "Quantity: angle.svg", "7")
    typed(page, "Sheet", "600x400")
    typed(page, "Time limit", "60min")
    press_run(page)
    tried = page.get_by_role("list", name="Tried so far").get_by_role("listitem")
    expect(tried.filter(has_text="by shapes").filter(has_text="trying …").first).to_be_visible(timeout=LONG)
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator("table.nests")).to_be_visible(timeout=LONG)
    expect(tried).to_have_count(0)
