"""Programs in Chromium: read before anything is run, searched, folded, beside their original, and compared."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, expect
from studio_page import LONG, ROOT, choose_work, opened, press_run, serious
from studio_server import Server

CAM = ROOT / "examples" / "cam_121.nc"
TEXT = CAM.read_text().splitlines()


def lines(page: Page, column: str = "") -> Locator:
    return page.locator(f"{column} .lc-line".strip())


def number_of(row: Locator) -> int:
    return int(row.get_attribute("data-line") or 0)


def begin(page: Page) -> None:
    press_run(page)


def reordered(page: Page) -> None:
    """Have a program reordered, and its new text beside the old one."""
    opened(page, CAM)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    begin(page)
    page.get_by_role("tab", name="Issues").wait_for(timeout=LONG)
    page.get_by_role("tab", name="Program").click()
    page.get_by_role("button", name="Compare", exact=True).click()
    expect(lines(page, ".lc-original").first).to_be_visible()


def test_a_program_is_text_from_the_moment_it_is_opened_and_linked_with_its_drawing(page: Page) -> None:
    opened(page, CAM)
    expect(page.get_by_role("tab", name="Program")).to_have_attribute("aria-selected", "true")
    expect(lines(page).nth(9)).to_contain_text("G99 G81 X220.746 Y87.312")
    lines(page).nth(10).click()
    expect(page.locator(".lc-readout")).to_contain_text("line 11")
    page.keyboard.press("2")  # keys of the page work in a text that cannot be changed
    expect(page.locator("#view-jobs")).to_be_visible()


def test_a_program_that_cannot_be_drawn_can_be_read_all_the_same(page: Page, tmp_path: Path) -> None:
    broken = tmp_path / "broken.nc"
    broken.write_text("%\nG21 G90\nWHILE [#1 LT 3] DO1\nG1 X10 F100\n")
    opened(page, broken)
    expect(lines(page).nth(2)).to_contain_text("WHILE [#1 LT 3] DO1")


def test_words_are_found_counted_and_gone_through_both_ways(page: Page) -> None:
    opened(page, CAM)
    having = [number for number, line in enumerate(TEXT, 1) if "y190.5" in line.lower()]
    lines(page).first.click()
    page.keyboard.press("Control+f")
    field = page.get_by_role("searchbox", name="Find in the program")
    expect(field).to_be_focused()
    field.fill("y190.5")
    told = page.locator(".lc-found-count")
    expect(told).to_have_text(f"1 of {len(having)}")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(having[0]))
    field.press("Enter")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(having[1]))
    field.press("Shift+Enter")
    field.press("Shift+Enter")  # before the first comes the last
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(having[-1]))
    expect(told).to_have_text(f"{len(having)} of {len(having)}")
    page.get_by_role("button", name="Next match").click()
    expect(told).to_have_text(f"1 of {len(having)}")
    field.fill("nowhere")
    expect(told).to_have_text("no match")
    field.press("Escape")
    expect(field).to_have_value("")
    expect(page.locator(".cm-content")).to_be_focused()


def test_a_line_is_gone_to_by_its_number(page: Page) -> None:
    opened(page, CAM)
    lines(page).first.click()
    page.keyboard.press("Control+g")
    field = page.get_by_role("textbox", name="Line", exact=True)
    expect(field).to_be_focused()
    field.fill("200")
    field.press("Enter")
    expect(page.locator(".lc-selected")).to_contain_text(TEXT[199])
    field.fill("99999")
    field.press("Enter")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(len(TEXT)))


def test_a_program_is_folded_by_tool_and_unfolded_by_keys(page: Page) -> None:
    opened(page, CAM)
    changes = [number for number, line in enumerate(TEXT, 1) if "M6" in line]
    page.get_by_label("Fold", exact=True).select_option("By tool")
    heads = page.locator(".lc-line:has(.lc-held)")
    expect(heads).to_have_count(len(changes))
    assert [number_of(head) for head in heads.all()] == changes
    expect(heads.first).to_contain_text(f"T1 · {changes[1] - changes[0]} lines")
    heads.first.click(position={"x": 10, "y": 5})
    page.keyboard.press("Control+Shift+BracketRight")
    inside = page.locator(f"[data-line='{changes[0] + 1}']")
    expect(inside).to_be_visible()
    page.keyboard.press("ArrowDown")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(changes[0] + 1))
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Control+Shift+BracketLeft")
    expect(inside).to_have_count(0)
    page.keyboard.press("ArrowDown")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", str(changes[1]))
    heads.first.get_by_role("button").click()
    expect(inside).to_be_visible()


def test_what_is_chosen_elsewhere_is_unfolded_and_pieces_begin_where_the_way_to_them_does(
    page: Page, tmp_path: Path
) -> None:
    slots = tmp_path / "slots.nc"
    slots.write_text(
        "G21 G90\nT1 M6\nS1000 M3\nG0 X0 Y0\nG0 Z1\nG1 Z-1 F100\nG1 X10\nG0 Z5\nG0 X30\nG1 Z-1\nG1 X50\nG0 Z5\nM30\n"
    )
    opened(page, slots)
    page.get_by_label("Fold", exact=True).select_option("By piece")
    heads = page.locator(".lc-line:has(.lc-held)")
    expect(heads).to_have_count(2)
    assert [number_of(head) for head in heads.all()] == [4, 8]
    expect(heads.first).to_contain_text("no. 1 · 4 lines")
    page.get_by_role("textbox", name="Line", exact=True).fill("7")
    page.get_by_role("textbox", name="Line", exact=True).press("Enter")
    expect(page.locator(".lc-selected")).to_contain_text("G1 X10")
    expect(heads.first.get_by_role("button")).to_have_attribute("aria-expanded", "true")
    page.get_by_label("Fold", exact=True).select_option("All lines")
    expect(heads).to_have_count(0)


def test_whoever_reads_a_program_stays_at_his_line_while_it_is_reordered(page: Page) -> None:
    opened(page, CAM)
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    lines(page).nth(12).click()
    page.locator(".cm-content").evaluate("list => { list.dataset.mine = 'yes'; }")
    begin(page)
    expect(page.locator(".study")).to_contain_text("step 1", timeout=LONG)  # it waits here
    expect(page.locator(".cm-content")).to_have_attribute("data-mine", "yes")
    expect(page.locator(".lc-selected")).to_have_attribute("data-line", "13")
    page.get_by_role("button", name="Stop, keep the best").click()
    page.get_by_role("tab", name="Issues").wait_for(timeout=LONG)


def test_each_block_of_the_original_is_shown_where_it_is_now_and_back_by_pointer_and_keys(page: Page) -> None:
    reordered(page)
    old, new = page.locator(".lc-original .cm-content"), page.locator(".lc-rewritten .cm-content")
    moved = lines(page, ".lc-original").filter(has=page.locator(".lc-where")).first
    place = TEXT[number_of(moved) - 1]
    told = moved.locator(".lc-where").inner_text()
    moved.click()
    expect(new.locator(".lc-selected")).to_contain_text(place)
    expect(new.locator(".lc-selected")).to_have_attribute("data-line", told.removeprefix("→ "))
    expect(page.locator(".lc-readout")).to_contain_text(f"line {told.removeprefix('→ ')} ")
    old.focus()
    page.keyboard.press("ArrowDown")
    after = TEXT[number_of(old.locator(".lc-selected")) - 1]
    expect(new.locator(".lc-selected")).to_contain_text(after)
    new.focus()
    page.keyboard.press("ArrowDown")
    here = new.locator(".lc-selected")
    expect(old.locator(".lc-selected")).to_contain_text(re.search(r"X[\d.]+ Y[\d.]+", here.inner_text())[0])  # type: ignore[index]
    page.get_by_role("button", name="Compare", exact=True).click()
    expect(old).to_have_count(0)
    expect(new.locator(".lc-moved")).to_have_count(0)


def compared(page: Page, changed: Path) -> None:
    """Compare the program with a copy under another name."""
    original = changed.with_name("original.nc")
    original.write_bytes(CAM.read_bytes())
    opened(page, original)
    choose_work(page, "verify")
    page.get_by_label("New program: File …").set_input_files(changed)
    expect(page.locator("#command")).to_contain_text(changed.name)
    begin(page)
    page.get_by_role("tab", name="Issues").wait_for(timeout=LONG)


def test_what_is_missing_or_moved_is_marked_in_the_drawing_and_in_both_programs(page: Page, tmp_path: Path) -> None:
    gone, moved, there = 13, 31, "X200.000 Y200.000"
    changed = tmp_path / "changed.nc"
    changed.write_text("\n".join([*TEXT[: gone - 1], *TEXT[gone : moved - 1], there, *TEXT[moved:]]) + "\n")
    compared(page, changed)
    page.get_by_role("tab", name="Program").click()
    expect(page.locator(".lc-original .lc-missing").first).to_have_attribute("data-line", str(gone))
    expect(page.locator(".lc-original .lc-differs")).to_contain_text([TEXT[gone - 1]])
    new = page.locator(".lc-rewritten .cm-content")
    new.focus()
    page.get_by_role("textbox", name="Line", exact=True).fill(str(moved - 1))
    page.get_by_role("textbox", name="Line", exact=True).press("Enter")
    expect(new.locator(".lc-differs")).to_contain_text([there])
    page.get_by_role("tab", name="Summary").click()
    buttons = page.locator(".differences button")
    expect(buttons).to_have_count(2)
    marks = """async () => {
        const { whenThere } = await import("leafcut-canvas/registry.js");
        const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
        const { differences } = (await new Promise((done) => whenThere(id, done))).scenes;
        const marks = Array.from({ length: differences.marks }, (_, k) => differences.at(k));
        return marks.map((mark) => `X${mark.x.toFixed(3)} Y${mark.y.toFixed(3)}`);
    }"""
    assert set(page.evaluate(marks)) == {TEXT[gone - 1], TEXT[moved - 1], there}
    buttons.first.focus()
    page.keyboard.press("Enter")
    expect(page.locator(".lc-readout .lc-name")).to_contain_text("hole")


def test_axe_finds_nothing_serious_in_programs(browser: Browser, server: Server, tmp_path: Path) -> None:
    """Neither in a program alone, nor folded, nor beside its original, nor in one that differs."""
    changed = tmp_path / "changed.nc"
    changed.write_text("\n".join([*TEXT[:12], *TEXT[13:], "X1. Y1."]) + "\n")
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    server.let_in(context)
    page = context.new_page()
    page.goto(server.origin)
    opened(page, CAM)
    lines(page).nth(3).click()
    page.get_by_role("searchbox", name="Find in the program").fill("y190")
    found = serious(page, "opened", dark=False)
    page.get_by_label("Fold", exact=True).select_option("By tool")
    found += serious(page, "folded", dark=False)
    page.get_by_label("Fold", exact=True).select_option("All lines")
    reordered(page)
    lines(page, ".lc-original").nth(12).click()
    found += serious(page, "beside", dark=False)
    compared(page, changed)
    found += serious(page, "compared")
    page.get_by_role("tab", name="Summary").click()
    found += serious(page, "differences")
    context.close()
    assert found == []


def test_a_million_lines_are_shown_folded_and_searched(page: Page) -> None:
    """Every tenth line is a head; the expected matches are counted here, independently of the page."""
    opened(page, CAM)
    shown = page.evaluate(
        """async () => {
          const { Lines } = await import("leafcut-canvas/lines.js"), host = document.createElement("div");
          host.className = "lc-program";
          host.style.cssText = "position: fixed; inset: 0; width: 600px; height: 400px; display: flex";
          document.body.append(host);
          const text = Array.from({ length: 1e6 }, (_, k) => `N${k % 10} G0X1`).join("\\n") + "\\n";
          const list = new Lines(host, { words: { folded: "{name} {number}" }, label: "Program" });
          list.setText(new TextEncoder().encode(text));
          const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
          list.select(987_654);
          await frame();
          const there = host.querySelector(".lc-selected")?.dataset.line;
          const rows = host.querySelectorAll(".lc-line").length;
          const found = list.find("n7 g0");
          list.setFolds(Array.from({ length: 1e5 }, (_, k) => ({ first: 10 * k + 1, last: 10 * k + 10, name: "b" })));
          await frame();
          const numbers = [...host.querySelectorAll(".lc-line")].map((row) => Number(row.dataset.line));
          const skipped = numbers.filter((number, k) => number - numbers[k - 1] === 10).length > 10;
          list.setFolds(null);
          await frame();
          const whole = host.querySelectorAll(".lc-held").length === 0;
          list.destroy();
          host.remove();
          return [list.count, there, rows < 100, found.length, found[0], found.at(-1), skipped, whole];
        }"""
    )
    assert shown == [1_000_000, "987654", True, 100_000, 8, 999_998, True, True]


def test_a_text_in_a_program_is_never_taken_as_html(page: Page, tmp_path: Path) -> None:
    program = tmp_path / "odd.nc"
    program.write_text("G21 G90\n(<img src=x onerror=alert>)\nG0 X1\n")
    opened(page, program)
    expect(page.locator(".lc-comment")).to_have_text("(<img src=x onerror=alert>)")
    expect(page.locator(".cm-content img")).to_have_count(0)


def test_a_program_that_cannot_be_fetched_is_told_of(page: Page) -> None:
    page.route("**/dynamic_resources/leafcut-program-*", lambda route: route.fulfill(status=204))
    opened(page, CAM)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    begin(page)
    page.get_by_role("tab", name="Issues").wait_for(timeout=LONG)
    page.get_by_role("tab", name="Program").click()
    expect(page.get_by_role("alert")).to_have_text("The program could not be loaded. Reload the page to try again.")
