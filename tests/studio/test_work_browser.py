"""The recognised kind of a drawing, choosing work by pictures, and suitable machines, in Chromium."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import PLATE, ROOT, choose_work, opened, run, serious, typed, wait_for, work_is
from studio_server import Server

EXAMPLES = ROOT / "examples"
#: Evaluates a script in the drawing of the page.
IN_DRAWING = """async (place) => {
  const { whenThere } = await import("leafcut-canvas/registry.js");
  const host = [...document.querySelectorAll(".lc-host")].find((one) => one.querySelector(".lc-drawing"));
  const drawing = await new Promise((found) => whenThere(Number(host.id.replace(/\\D+/g, "")), found));
  %s
}"""
#: Where a place in mm is on the screen.
PLACE = (
    IN_DRAWING
    % """
  const box = drawing.panes[1].canvas.getBoundingClientRect();
  return [box.left + drawing.view.toX(place[0]), box.top + drawing.view.toY(place[1])];
"""
)
MOVABLE = IN_DRAWING % "return Boolean(drawing.placement.movable && drawing.scenes.whole && drawing.scenes.part);"
BENEATH = IN_DRAWING % "return Boolean(drawing.scenes.whole && drawing.scenes.after);"
BOARD = "M48\nMETRIC,TZ\nT1C0.800\n%\nG90\nT1\nX10.0Y10.0\nX20.0Y10.0\nX20.0Y30.0\nM30\n"


@pytest.mark.parametrize(
    ("name", "work", "reason"),
    [
        ("bracket.dxf", "cut", "Suggested: Cut from sheet. Mostly outlines (outlines: 1, holes: 2)."),
        ("sheet.dxf", "cut", "Layers named as a sheet: SHEET."),
        ("pocket.dxf", "pocket", "Layers named as pockets: ISLAND, POCKET."),
        ("plate_27.dxf", "drill", "Mostly round holes (holes: 27, outlines: 1)."),
    ],
)
def test_a_drawing_opens_as_what_it_suits_and_says_why(page: Page, name: str, work: str, reason: str) -> None:
    opened(page, EXAMPLES / name)
    work_is(page, work)
    expect(page.locator(".works .why")).to_contain_text(reason)
    word = "" if work == "drill" else f"--process {work}"
    expect(page.locator("#command")).to_contain_text(word)


def test_the_work_is_chosen_by_pictures_and_with_the_arrows(page: Page) -> None:
    """Each picture shows the drawing: three strong outlines for cutting, two for drilling."""
    opened(page, EXAMPLES / "bracket.dxf")
    group = page.get_by_role("radiogroup", name="Work", exact=True)
    names = ["Drill the holes", "Cut from sheet", "Nest parts on sheets", "Mill the pockets", "Mill the part"]
    assert [
        radio.evaluate("at => at.parentElement.innerText.trim()") for radio in group.get_by_role("radio").all()
    ] == names
    strong = {
        name: group.locator("label", has_text=name).locator("path.strong").get_attribute("d") or "" for name in names
    }
    assert (strong["Cut from sheet"].count("M"), strong["Drill the holes"].count("M")) == (3, 2)
    group.get_by_role("radio", name="Cut from sheet").focus()
    page.keyboard.press("ArrowLeft")
    work_is(page, "drill")
    expect(page.locator(".facts")).to_contain_text("Holes")
    page.keyboard.press("ArrowRight")
    work_is(page, "cut")
    expect(page.locator(".facts")).to_contain_text("Contours")


def test_a_drawing_opens_as_a_part_while_a_router_is_chosen(page: Page) -> None:
    """A plate of many holes is still drilled."""
    opened(page, PLATE)
    page.get_by_label("Machine", exact=True).select_option("shapeoko-router")
    opened(page, EXAMPLES / "bracket.dxf")
    work_is(page, "part")
    expect(page.locator(".works .why")).to_contain_text("Outlines with holes or openings (outlines: 1, holes: 2).")
    expect(page.locator("#command")).to_contain_text("--process part --machine shapeoko-router")
    choose_work(page, "drill")
    expect(page.locator("#command")).to_contain_text("--process drill")
    opened(page, EXAMPLES / "plate_27.dxf")
    work_is(page, "drill")


def test_a_part_shows_its_edges_tabs_and_missing_work(page: Page) -> None:
    opened(page, EXAMPLES / "gusset.svg")
    choose_work(page, "part")
    for label, value in (("Thickness", "3"), ("Tool diameter", "32"), ("Search effort", "fast")):
        field = page.get_by_label(label, exact=True)
        field.select_option(value) if label == "Search effort" else typed(page, label, value)
    run(page)
    expect(page.locator("#result-panel")).to_contain_text("1 outline · 4 tabs")
    expect(page.locator("#result-panel .badge.no")).to_have_text("Missing: 1 feature of the input")
    page.get_by_role("tab", name="Issues").click()
    expect(page.locator("#result-panel")).to_contain_text(
        "the program does not mill 1 opening narrower than the mill of 32 mm"
    )


def test_a_drill_file_opens_on_a_machine_for_circuit_boards(page: Page, tmp_path: Path) -> None:
    """And the next drawing is on the usual one again."""
    board = tmp_path / "board.drl"
    board.write_text(BOARD)
    opened(page, board)
    machine = page.get_by_label("Machine", exact=True)
    expect(machine).to_have_value("pcb-drill")
    expect(page.locator("#command")).to_contain_text("--machine pcb-drill")
    opened(page, PLATE)
    expect(page.locator("#command")).not_to_contain_text("--machine")


def test_only_machines_that_do_the_work_are_offered_and_another_says_why(page: Page) -> None:
    opened(page, PLATE)
    machine = page.get_by_label("Machine", exact=True)
    expect(machine.locator("option[value=haas-vf2]")).to_have_count(1)
    expect(machine.locator("option[value=laser-table]")).to_have_count(0)
    choose_work(page, "cut")
    expect(machine.locator("option[value=laser-table]")).to_have_count(1)
    expect(machine.locator("option[value=haas-vf2]")).to_have_count(0)
    machine.select_option("laser-table")
    choose_work(page, "drill")
    expect(page.get_by_role("alert")).to_have_text("laser-table works with a laser; choose a machine with a spindle")
    machine.select_option("haas-vf2")
    expect(page.get_by_role("alert")).to_have_count(0)


def test_zero_is_dragged_to_a_hole_and_is_an_option_then(page: Page) -> None:
    """The first hole of the plate is 19.05 mm from either edge; zero is there afterwards."""
    opened(page, PLATE)
    wait_for(page, lambda: page.evaluate(MOVABLE))
    (x0, y0), (x1, y1) = page.evaluate(PLACE, [0, 0]), page.evaluate(PLACE, [19.3, 18.9])
    page.mouse.move(x0, y0)
    page.mouse.down()
    page.mouse.move(0.5 * (x0 + x1), 0.5 * (y0 + y1))
    page.mouse.move(x1, y1)
    page.mouse.up()
    expect(page.locator("#command")).to_contain_text("--origin 19.05,19.05")
    page.get_by_text("Position and heights").click()
    expect(page.get_by_label("Program zero", exact=True).or_(page.locator("input[id$=-origin]"))).to_have_value(
        "19.05,19.05"
    )


def test_the_edge_of_a_plate_stays_in_sight_after_the_run(page: Page) -> None:
    opened(page, PLATE)
    typed(page, "Thickness", "0.25in")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    wait_for(page, lambda: page.evaluate(BENEATH))


def test_axe_finds_nothing_serious_beside_a_drawing(browser: Browser, server: Server) -> None:
    # The policy of the page would not let axe in.
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    server.let_in(context)
    page = context.new_page()
    page.goto(f"{server.origin}/?lang=en")
    opened(page, EXAMPLES / "pocket.dxf")
    expect(page.locator(".works .why")).to_contain_text("POCKET")
    page.locator(".lc-menu > summary").click()
    found = serious(page, "pocket")
    context.close()
    assert found == []
