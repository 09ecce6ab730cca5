"""An outcome of earlier choices is marked; a new outcome is announced."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Page, expect
from studio_page import LONG, PLATE, choose_machine, choose_work, downloaded, opened, press_run, run, serious, typed
from studio_server import Server


def quick(page: Page) -> None:
    """Open a plate and run it."""
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "5")
    run(page)


def test_an_outcome_of_earlier_choices_says_which_and_is_not_offered_as_the_present_one(page: Page) -> None:
    quick(page)
    stale, badge = page.locator(".stale"), page.locator(".badge")
    program = page.locator(".files a").first
    expect(stale).to_be_empty()
    fresh = program.get_attribute("title")
    typed(page, "Thickness", "25mm")
    expect(stale).to_contain_text("Result of earlier settings")
    expect(stale.locator("li")).to_have_text(["Thickness 5\u00a0mm; now 25\u00a0mm"])
    expect(badge).to_have_text("Verified: read back, same work (earlier settings)")
    expect(program).to_have_text("Program (earlier settings)")
    expect(page.locator(".frame")).to_have_attribute("data-earlier", "Result of earlier settings")
    expect(program).to_have_attribute("title", re.compile("Thickness 5.mm; now 25.mm"))
    assert "primary" not in (program.get_attribute("class") or "")
    assert downloaded(page, "Program (earlier settings)")[0] == "plate_10.ngc"
    # An equal value in another notation is no change, and undoing a change removes the mark.
    typed(page, "Thickness", "0.5cm")
    expect(stale).to_be_empty()
    expect(program).to_have_text("Program")
    expect(page.locator(".frame")).to_have_attribute("data-earlier", "")
    expect(program).to_have_class(re.compile("primary"))
    expect(program).to_have_attribute("title", fresh or "")
    expect(badge).not_to_contain_text("earlier")


def test_three_differences_are_named_and_the_others_counted_and_all_can_be_taken_back(page: Page) -> None:
    quick(page)
    lines = page.locator(".stale li")
    typed(page, "Thickness", "6")
    page.get_by_label("Machine", exact=True).select_option("haas-vf2")
    page.get_by_label("Search effort", exact=True).select_option("default")
    page.get_by_label("Minimise", exact=True).select_option("distance")
    typed(page, "Time limit", "1s")
    expect(lines).to_have_count(4)
    expect(lines.last).to_have_text("and 2 more")
    page.get_by_role("button", name="Back to these settings").click()
    expect(lines).to_have_count(0)
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("5")
    expect(page.get_by_label("Machine", exact=True)).not_to_have_value("haas-vf2")
    expect(page.locator(".headline")).to_be_visible()
    page.locator("input[value=cut]").click()
    expect(lines).to_have_text(["Work Drill the holes; now Cut from sheet"])
    page.locator("input[value=drill]").click()
    expect(lines).to_have_count(0)
    typed(page, "Thickness", "7")
    page.get_by_role("button", name="Run again", exact=True).click()
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)
    expect(lines).to_have_count(0)


def test_a_machine_saved_since_marks_what_was_made_with_it(page: Page) -> None:
    page.keyboard.press("3")
    choose_machine(page, "linuxcnc-mill")
    page.locator("#view-machines").get_by_role("button", name="Copy").click()
    expect(page.locator("#said")).to_contain_text("checked and saved")
    page.keyboard.press("1")
    opened(page, PLATE)
    page.get_by_role("combobox", name="Machine", exact=True).select_option("mine:my-linuxcnc-mill")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    expect(page.locator(".stale")).to_be_empty()
    page.keyboard.press("3")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#said")).to_contain_text("checked and saved")
    page.keyboard.press("1")
    expect(page.locator(".stale li")).to_have_text(["Machine my-linuxcnc-mill; now saved again since"])


def test_an_order_edited_by_hand_marks_the_outcome_closing_asks_and_run_runs_what_is_shown(page: Page) -> None:
    quick(page)
    edit, lines = page.locator(".edit"), page.locator(".stale li")
    page.get_by_role("button", name="Edit the order").click()
    select_hole(page, 3)
    edit.get_by_role("button", name="First", exact=True).click()
    expect(lines).to_have_text(["Order as found; now edited by hand"])
    close = edit.locator("[data-sure]")
    expect(close).to_have_text("Close")
    close.click()
    expect(close).to_have_text("Discard the changes?")
    expect(edit).to_be_visible()
    edit.get_by_role("button", name="Undo", exact=True).click()
    expect(lines).to_have_count(0)
    edit.get_by_role("button", name="Redo", exact=True).click()
    expect(lines).to_have_count(1)
    press_run(page)
    expect(page.locator("#command")).to_contain_text("--plan plate_10_edited.json")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    expect(lines).to_have_count(0)
    page.get_by_role("button", name="Edit the order").click()
    edit.get_by_role("button", name="Close", exact=True).click()  # without a change, no question
    expect(edit).to_be_hidden()


def select_hole(page: Page, hole: int) -> None:
    """Choose a stop of an order that was just opened, as a click on it does."""
    page.locator(".edit").get_by_role("button", name="Reverse", exact=True).click()
    expect(page.locator("#said")).to_contain_text("Select a stop first")  # no hole is selected now
    page.evaluate(
        """async (hole) => {
            const { whenThere } = await import("leafcut-canvas/registry.js");
            const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
            const drawing = await new Promise((done) => whenThere(id, done)), [, pane] = drawing.panes;
            const [x, y] = pane.part.holePlace(hole);
            drawing.choose(pane, drawing.view.toX(x), drawing.view.toY(y));
        }""",
        hole,
    )
    expect(page.locator(".edit")).to_contain_text("Selected")


def test_a_new_outcome_opens_its_summary_is_announced_and_leaves_the_focus_alone(page: Page) -> None:
    quick(page)
    page.get_by_role("tab", name="Search").click()
    expect(page.get_by_role("tab", name="Search")).to_have_attribute("aria-selected", "true")
    typed(page, "Thickness", "8")
    button = page.get_by_role("button", name="Run", exact=True)
    button.click()
    expect(page.get_by_role("tab", name="Summary")).to_have_attribute("aria-selected", "true", timeout=LONG)
    expect(page.locator("#announced")).to_have_text(re.compile(r"^plate_10\.dxf: .* less machine time\. Verified"))
    expect(page.locator("#announced")).to_have_attribute("aria-live", "polite")
    expect(button).to_be_focused()


def test_the_verdict_of_a_comparison_stands_before_all_else(page: Page, tmp_path: Path) -> None:
    one, other = tmp_path / "one.nc", tmp_path / "other.nc"
    one.write_text("G21 G90\nG0 X0 Y0 Z5\nG81 X10 Y10 Z-3 R1 F100\nX20 Y10\nG80\nM30\n")
    other.write_text("G21 G90\nG0 X0 Y0 Z5\nG81 X10 Y10 Z-3 R1 F100\nX25 Y10\nG80\nM30\n")
    opened(page, one)
    choose_work(page, "verify")
    page.locator(".second input[type=file]").set_input_files(other)
    run(page)
    expect(page.locator("#result-panel > *").first).to_have_text("Not the same work")
    page.locator(".second input[type=file]").set_input_files(one)
    expect(page.locator(".stale li")).to_have_text(["New program other.nc; now one.nc"])
    run(page)
    expect(page.locator("#result-panel > *").first).to_have_text("The same work")


def test_a_program_that_could_not_be_improved_says_why(page: Page, tmp_path: Path) -> None:
    done = tmp_path / "done.nc"
    done.write_text("G21 G90\nG0 X0 Y0 Z5\nG81 X10 Y10 Z-3 R1 F100\nX20 Y10\nX30 Y10\nG80\nG0 Z5\nM30\n")
    opened(page, done)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    large = page.locator(".headline.same")
    expect(large).to_have_text(re.compile(r"^(Already in the best order found|\d+ of \d+ sections stay: .+)$"))
    expect(page.locator(".under").first).to_contain_text("Machine time stays")
    expect(page.locator(".result")).not_to_contain_text("0.00 s")


def test_the_mark_keeps_nobody_out(page: Page, server: Server) -> None:
    context = page.context.browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)  # type: ignore[union-attr]
    server.let_in(context)
    made = context.new_page()
    made.goto(server.origin)
    quick(made)
    typed(made, "Thickness", "25mm")
    expect(made.locator(".stale li")).to_have_count(1)
    assert serious(made, "marked") == []
    context.close()
