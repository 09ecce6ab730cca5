"""Consistency of the page while a user changes choices."""

from __future__ import annotations

import math
import re
from pathlib import Path

import ezdxf
import httpx2
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from studio_page import (
    LONG,
    PLATE,
    choose_machine,
    choose_work,
    opened,
    press_run,
    run,
    said_by,
    steady,
    sure,
    typed,
    wait_for,
)
from studio_server import Server, running

from packages import write_package


def endless(page: Page) -> None:
    """Start a run that ends only when it is stopped."""
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", "1500")
    page.get_by_role("button", name="Create map").click()
    expect(page.locator(".about-part .name")).to_have_text("random:1500:1")
    choose_work(page, "solve")
    page.get_by_label("Algorithm", exact=True).select_option("mmas")  # it searches as long as it may
    typed(page, "Time limit", "60min")
    press_run(page)
    expect(page.locator(".progress")).to_be_visible()
    expect(page).to_have_url(re.compile("job="))


def test_another_file_takes_the_place_of_a_run_which_goes_on_and_can_be_ended(page: Page) -> None:
    endless(page)
    opened(page, PLATE.with_name("plate_27.dxf"))
    expect(page.locator(".progress")).to_be_hidden()
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_enabled()
    page.get_by_role("button", name="Jobs", exact=True).click()
    row = page.locator("table.jobs tbody tr").first
    expect(row).to_contain_text("random:1500:1")
    expect(row).to_contain_text("running")
    row.get_by_role("button", name="Delete").click()
    expect(row).to_contain_text("running")  # asked twice: it cannot be taken back
    sure(row.locator("[data-sure]"))
    expect(page.locator("table.jobs tbody tr", has_text="running")).to_have_count(0)


def test_a_new_file_is_seen_whole_however_the_last_one_was_looked_at(page: Page, tmp_path: Path) -> None:
    opened(page, PLATE)
    expect(page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last).to_be_visible()
    for _ in range(8):
        page.get_by_role("button", name="Zoom in").click()
    page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last.hover()
    expect(page.locator(".lc-readout")).to_contain_text("X ")
    page.mouse.move(5, 5)
    opened(page, PLATE.with_name("plate_27.dxf"))
    box = page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last.bounding_box()
    assert box is not None

    def seen() -> float:
        """Return the width of the visible area, mm; the pointer leaves in between, so that each position is shown
        again.
        """
        told = []
        for x in (60, box["width"] - 4):
            page.mouse.move(5, 5)
            expect(page.locator(".lc-readout")).to_be_hidden()
            page.mouse.move(box["x"] + x, box["y"] + 10)
            page.evaluate("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
            place = re.search(r"X (-?[\d.]+)", page.locator(".lc-readout").inner_text())
            told.append(float(place[1]) if place else math.nan)  # being redrawn, so it shows no position
        return told[1] - told[0]

    wait_for(page, lambda: seen() > 200)  # mm: the plate is 241 mm high, and wider than half of that


def test_what_must_be_known_before_a_program_runs_stands_before_its_figures(page: Page) -> None:
    opened(page, PLATE)
    typed(page, "Time limit", "1s")
    typed(page, "Depth", "40mm")
    run(page)
    expect(page.locator(".warnings")).to_contain_text("in one stroke")
    typed(page, "Depth", "3mm")
    press_run(page)
    expect(page.locator(".warnings")).to_have_count(0, timeout=LONG)
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)


def test_what_is_told_can_be_clicked_away_and_a_change_by_hand_be_taken_back_by_ctrl_z(page: Page) -> None:
    opened(page, PLATE)
    typed(page, "Time limit", "1s")
    run(page)
    page.get_by_role("button", name="Edit the order").click()
    length = page.locator(".edit .figure").first
    before = said_by(length)
    page.get_by_role("button", name="Reverse", exact=True).click()
    expect(page.locator("#said")).to_contain_text("Select a stop first")
    page.locator("#said").click()
    expect(page.locator("#said")).to_be_hidden()
    page.evaluate(
        """async () => {
            const { whenThere } = await import("leafcut-canvas/registry.js");
            const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
            const drawing = await new Promise((done) => whenThere(id, done)), [, pane] = drawing.panes;
            const [x, y] = pane.part.holePlace(3);
            drawing.choose(pane, drawing.view.toX(x), drawing.view.toY(y));
        }"""
    )
    expect(page.locator(".edit")).to_contain_text("Selected")
    page.get_by_role("button", name="First", exact=True).click()
    expect(length).not_to_have_text(before)
    change = page.locator(".edit .ways .figure").last
    expect(change).to_have_text(re.compile(r"([+−])[\d.]+ m{1,2} \(\1[\d.]+ %\)"))
    page.keyboard.press("Control+z")
    expect(length).to_have_text(before)
    expect(change).to_have_text("unchanged")
    page.keyboard.press("Control+Shift+z")
    expect(length).not_to_have_text(before)


def test_what_was_typed_of_a_machine_and_not_saved_is_there_when_a_person_comes_back(page: Page) -> None:
    page.keyboard.press("3")
    choose_machine(page, "duet-router")
    page.locator("#view-machines").get_by_role("button", name="Copy").click()
    text = page.locator("#view-machines .editor .cm-content")
    expect(page.locator("#editor-name-machines")).to_have_value("my-duet-router")
    page.get_by_role("tab", name="TOML").click()
    expect(text).to_contain_text("rrf")
    text.press("Control+Home")
    page.keyboard.insert_text("# mine\n")
    page.locator("#view-machines").get_by_role("button", name="haas-vf2", exact=True).click()
    expect(text).to_contain_text('name = "haas-vf2"')
    page.locator("#view-machines").get_by_role("button", name="my-duet-router", exact=True).click()
    expect(page.locator("#view-machines .tag")).to_have_text("not saved yet")
    expect(text).to_contain_text("# mine")
    # A copy contains the saved text, under its own name; typed changes stay with the original.
    page.locator("#view-machines").get_by_role("button", name="Copy").click()
    expect(page.locator("#editor-name-machines")).to_have_value("my-duet-router-2")
    expect(text).to_contain_text('name = "my-duet-router-2"')
    page.locator("#view-machines").get_by_role("button", name="my-duet-router", exact=True).click()
    expect(text).to_contain_text("# mine")
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#said")).to_contain_text("saved")
    expect(page.locator("#view-machines .tag")).to_be_hidden()


def test_a_program_that_is_looked_at_again_and_again_leaves_nothing_behind(page: Page) -> None:
    """What listens to the drawing is what is on the page: a list of the program that was taken off is let go."""
    opened(page, PLATE)
    typed(page, "Time limit", "1s")
    run(page)
    listening = """async () => {
        const { whenThere } = await import("leafcut-canvas/registry.js");
        const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
        const drawing = await new Promise((done) => whenThere(id, done));
        return [...drawing._listeners.values()].reduce((sum, acts) => sum + acts.size, 0);
    }"""
    before = steady(page, listening)
    for _ in range(3):
        page.get_by_role("tab", name="Program").click()
        expect(page.locator(".lc-line").first).to_be_visible()
        wait_for(page, lambda: page.evaluate(listening) > before)  # another program, another choice, playing …
        page.get_by_role("tab", name="Summary").click()
        expect(page.locator(".cm-content")).to_have_count(0)
    wait_for(page, lambda: page.evaluate(listening) == before)


def test_a_wrong_value_is_not_told_as_a_missing_file(page: Page) -> None:
    opened(page, PLATE)
    typed(page, "Thickness", "thick")
    expect(page.locator("#command")).to_have_text("Complete or correct the fields above.")


def test_the_list_of_jobs_says_when_one_is_over(page: Page, server: Server) -> None:
    endless(page)
    page.get_by_role("button", name="Jobs", exact=True).click()
    row = page.locator("table.jobs tbody tr").first
    expect(row).to_contain_text("running")
    headers = {"Authorization": f"Bearer {server.token}"}
    job = page.url.partition("job=")[2]
    assert httpx2.post(f"{server.origin}/api/jobs/{job}/stop", headers=headers, timeout=60).status_code == 200
    expect(row).to_contain_text("stopped, best result kept", timeout=LONG)


def test_a_file_of_no_kind_takes_nothing_away(page: Page, tmp_path: Path) -> None:
    opened(page, PLATE)
    typed(page, "Time limit", "1s")
    run(page)
    saved = said_by(page.locator(".headline"))
    wrong = tmp_path / "letter.docx"
    wrong.write_bytes(b"PK")
    page.set_input_files("#open-file", wrong)
    expect(page.locator("#said")).to_contain_text("unknown file format")
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    expect(page.locator(".headline")).to_have_text(saved)
    expect(page).to_have_url(re.compile("job="))


def test_the_keys_of_the_page_mean_the_same_once_the_drawing_was_clicked(page: Page) -> None:
    """With Shift a letter is a layer's, in the drawing alone; M goes through what can be compared."""
    opened(page, PLATE)
    typed(page, "Depth", "3")
    drawing = page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last
    layer = page.locator("[data-layer=rapids] input")
    page.keyboard.press("Shift+R")
    drawing.click(position={"x": 5, "y": 300})
    page.keyboard.press("Shift+R")
    expect(layer).not_to_be_checked()
    expect(page.locator("#result-panel")).not_to_be_visible()
    page.keyboard.press("r")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    expect(layer).not_to_be_checked()
    expect(page.get_by_role("radiogroup", name="View", exact=True)).to_be_visible()
    drawing.click(position={"x": 5, "y": 300})
    page.keyboard.press("m")
    expect(page.locator(".lc-mode[data-mode=side]")).to_have_attribute("aria-checked", "true")
    page.keyboard.press("2")
    expect(page.locator("#view-jobs")).to_be_visible()


def test_escape_ends_a_run_and_keeps_the_best_of_it(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.get_by_label("Speed", exact=True).first.select_option("step")
    press_run(page)
    expect(page.locator(".progress .figure").first).not_to_have_text("", timeout=LONG)
    page.keyboard.press("Escape")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    page.keyboard.press("2")
    expect(page.locator("table.jobs tbody tr").first).to_contain_text("stopped, best result kept")


#: A reader that never ends.
ENDLESS = """
import time

from leafcut.read import Format


def read(source, options):
    while True:
        time.sleep(1)


FORMAT = Format("endless", (".endless",), "files that are never read", read)
"""


def test_escape_and_cancel_end_a_reading_however_long_it_takes(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The open file stays, and the next file opens as usual."""
    packages = tmp_path / "packages"
    write_package(packages, "slow", {"leafcut.readers": {"endless": "slow_reader:FORMAT"}}, {"slow_reader.py": ENDLESS})
    monkeypatch.setenv("PYTHONPATH", str(packages))
    with running(tmp_path / "home") as server:
        page = browser.new_page(locale="en-US", viewport={"width": 1280, "height": 720})
        page.goto(f"{server.origin}/?token={server.key}")
        opened(page, PLATE)
        for end in ("key", "button"):
            page.set_input_files("#open-file", {"name": "part.endless", "mimeType": "", "buffer": b"1"})
            expect(page.locator(".reading")).to_contain_text("part.endless")
            page.keyboard.press("Escape") if end == "key" else page.locator(".reading").get_by_text("Cancel").click()
            expect(page.locator("#said")).to_contain_text("Reading cancelled.")
            expect(page.locator(".reading")).to_be_hidden()
            expect(page.locator(".about-part .name")).to_have_text("plate_10.dxf")
        run(page)
        expect(page.locator(".headline")).to_be_visible()
        page.close()


def test_an_empty_page_offers_an_example_in_its_middle(page: Page) -> None:
    page.locator(".empty").get_by_role("button", name="plate-27").click()
    expect(page.locator(".about-part .name")).to_have_text("plate-27")
    expect(page.locator(".empty")).to_be_hidden()


def test_another_language_shows_the_same_job(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    page.locator(".languages").get_by_role("link", name="Español").click()
    expect(page.locator("#result-panel")).to_contain_text("Verificado")
    expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
    page.locator(".languages").get_by_role("link", name="English").click()
    expect(page.locator("#result-panel")).to_contain_text("Verified")


def test_the_figures_of_a_random_map_stay_when_the_page_is_drawn_anew(page: Page) -> None:
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", "31")
    page.get_by_role("button", name="Create map").click()
    expect(page.locator(".about-part .name")).to_have_text("random:31:1")
    typed(page, "Thickness", "6")
    expect(page.locator("#command")).to_contain_text("--thickness 6")
    expect(page.get_by_label("Points", exact=True)).to_have_value("31")


#: The buttons covered by the message, once the page is laid out.
COVERED = """async () => {
    await new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(then)));
    const said = document.querySelector("#said").getBoundingClientRect();
    const buttons = [...document.querySelectorAll("button")].filter((one) => one.checkVisibility());
    return buttons.filter((one) => {
        const box = one.getBoundingClientRect();
        return box.x < said.right && box.right > said.x && box.y < said.bottom && box.bottom > said.y;
    }).map((one) => one.textContent || one.ariaLabel);
}"""


def test_what_is_told_covers_no_button_a_hand_made_order_is_of_one_drawing_and_jobs_show_all_buttons(
    page: Page,
) -> None:
    page.set_viewport_size({"width": 1280, "height": 720})
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "6")
    run(page)
    page.get_by_role("button", name="Edit the order").click()
    page.locator(".edit").get_by_role("button", name="Undo").click()
    said_by(page.locator("#said"))
    assert page.evaluate(COVERED) == []
    page.locator(".edit").get_by_role("button", name="Run with this order").click()
    expect(page.locator("#command")).to_contain_text("--plan")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    opened(page, PLATE.with_name("plate_27.dxf"))  # the order belongs to other holes
    expect(page.locator("#command")).to_have_text("leafcut optimize plate_27.dxf -o plate_27.ngc --preset fast")
    run(page)
    expect(page.get_by_role("radio", name="Overlaid")).to_be_visible()  # the buttons stand in two rows
    page.set_input_files("#open-file", {"name": "none.dxf", "mimeType": "", "buffer": b"none"})
    said_by(page.locator("#said"))
    assert page.evaluate(COVERED) == []
    page.keyboard.press("2")
    # Its question disappears by itself: it is searched as soon as it is asked.
    inside = """at => {
        at.click();
        const box = at.getBoundingClientRect(), list = document.querySelector("#view-jobs .scroll");
        return [at.textContent, box.left >= 0 && box.right <= innerWidth && list.scrollWidth <= list.clientWidth];
    }"""
    assert page.get_by_role("button", name="Delete").first.evaluate(inside) == ["Delete for good?", True]


def test_an_option_of_the_command_line_is_not_broken_at_its_hyphens(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "6")
    expect(page.locator("#command")).to_have_text(
        "leafcut optimize plate_10.dxf -o plate_10.ngc --preset fast --thickness 6"
    )
    lines = page.locator("#command span").evaluate_all("words => words.map((word) => word.getClientRects().length)")
    assert lines == [1] * 9
    assert page.locator("#command span").evaluate_all(
        "words => words.every((word) => word.getBoundingClientRect().height < 24)"
    )


def test_a_run_that_was_cancelled_is_not_told_as_none(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    expect(page.locator(".study")).to_contain_text("step 1", timeout=LONG)
    sure(page.locator(".progress [data-sure]"))
    expect(page.locator(".result")).to_contain_text("cancelled", timeout=LONG)
    expect(page.locator(".result")).not_to_contain_text("No runs yet")


def test_a_machine_saved_under_another_name_has_it_and_another_is_replaced_only_when_asked_twice(page: Page) -> None:
    page.get_by_role("button", name="Machines", exact=True).click()
    choose_machine(page, "laser-table")
    page.get_by_role("button", name="Copy", exact=True).last.click()
    name, said = page.locator("#editor-name-machines"), page.locator("#said")
    save = page.get_by_role("button", name="Save", exact=True)
    expect(name).to_have_value("my-laser-table")
    page.get_by_role("tab", name="TOML").click()
    expect(page.locator(".editor .cm-content")).to_be_visible()
    name.fill("other-laser")
    save.click()
    expect(said).to_contain_text("other-laser checked and saved")
    expect(page.locator(".editor .cm-content")).to_contain_text('name = "other-laser"')
    page.get_by_role("button", name="my-laser-table", exact=True).click()
    expect(name).to_have_value("my-laser-table")
    name.fill("other-laser")
    save.click()
    expect(said).to_contain_text("Save again")
    save.click()
    expect(said).to_contain_text("other-laser checked and saved")


def test_what_knowing_the_stock_saves_is_told_beside_the_figures(page: Page) -> None:
    """The same figures as on the command line: 29 retracts are lower, 16 descents are rapids."""
    opened(page, PLATE.parents[1] / "tests" / "styles" / "inkscape_gcodetools_engrave.ngc")
    page.get_by_text("Stock and speeds").click()
    for label in ("Rapids in the air", "Low retracts"):
        page.get_by_label(label, exact=True).click()
    typed(page, "Workpiece", "-5,-5,-10,240,160,0")
    typed(page, "Tool diameter", "3")
    run(page)
    expect(page.locator("#result-panel")).to_contain_text("heights lowered: 29")
    expect(page.locator("#result-panel")).to_contain_text("now rapids: 16")


def test_missing_work_comes_first_in_red_and_is_hatched_in_the_drawing(page: Page, tmp_path: Path) -> None:
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
    for x in (10, 50, 90):
        space.add_circle((x, 10), 3)
    space.add_lwpolyline([(20, 30, 0), (60, 30, 1), (60, 45, 0), (20, 45, 1)], format="xyb", close=True)
    document.saveas(tmp_path / "slot.dxf")
    opened(page, tmp_path / "slot.dxf")
    choose_work(page, "drill")
    typed(page, "Thickness", "6mm")
    run(page)
    expect(page.locator("#result-panel .warnings").first).to_contain_text("1 slot will not be milled")
    expect(page.locator("#result-panel .badge").first).to_have_text("Missing: 1 feature of the input")
    colours = [
        page.locator(place).first.evaluate("at => getComputedStyle(at).color")
        for place in ("#result-panel .warnings.worst", "#result-panel .badge.no")
    ]
    red, green, blue = map(int, re.findall(r"\d+", colours[0])[:3])
    assert colours[0] == colours[1]
    assert red > 2 * max(green, blue)


def test_a_picture_is_asked_for_its_width_on_the_drawing(page: Page, tmp_path: Path) -> None:
    """A picture of 520 pixels that is 104 mm wide has pixels of 0.2 mm."""
    opened(page, PLATE.with_name("pocket.png"))
    expect(page.locator(".inviting")).to_contain_text("520 × 360 pixels")
    expect(page.locator("#said")).to_be_empty()
    width = page.get_by_label("Width of the picture", exact=True)
    width.fill("wide")
    width.press("Enter")
    expect(page.locator("#said")).to_contain_text("'wide' is not a number")
    width.fill("104")
    width.press("Enter")
    expect(page.get_by_label("Pixel size", exact=True)).to_have_value("0.2mm")
    expect(page.locator(".about-part")).to_contain_text("Pockets")
    expect(page.locator("#said")).to_be_empty()
    other = tmp_path / "other.png"
    Image.new("L", (300, 100), 255).save(other)
    opened(page, other)  # the scale of one picture says nothing about the next
    expect(page.locator(".inviting")).to_contain_text("300 × 100 pixels")


def test_the_keys_of_the_page_work_after_a_file_was_chosen_in_the_dialog(page: Page) -> None:
    """The focus is then on the field of the file."""
    page.locator("#open-file").focus()
    page.keyboard.press("2")
    expect(page.locator("#view-jobs")).to_be_visible()


def test_rarely_used_files_are_in_a_menu_that_a_click_beside_it_closes(page: Page) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    files = page.locator(".files")
    expect(files.get_by_role("link")).to_have_text(["Program", "Report"])
    files.get_by_text("More files").click()
    expect(files.get_by_role("link", name="Picture after")).to_be_visible()
    expect(files.get_by_role("link", name="JSON")).to_be_visible()
    page.locator(".headline").click()
    expect(files.get_by_role("link", name="JSON")).to_be_hidden()
