"""A running search in Chromium, and programs of all kinds of work downloaded from the page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from parts_to_nest import svg
from playwright.sync_api import Page, expect
from studio_page import (
    LONG,
    ROOT,
    choose_work,
    downloaded,
    opened,
    press_run,
    run,
    said_by,
    steady,
    sure,
    typed,
    wait_for,
)

from leafcut.cli import app as cli

PICTURE = "[...document.querySelectorAll('.lc-canvas')].pop().toDataURL()"
#: Pixels of the pheromone: clearly green.
GREEN = """() => {
  const shown = [...document.querySelectorAll(".lc-canvas")].pop(), canvas = document.createElement("canvas");
  Object.assign(canvas, { width: shown.width, height: shown.height });
  const ctx = canvas.getContext("2d", { willReadFrequently: true });
  ctx.drawImage(shown, 0, 0);
  const { data } = ctx.getImageData(0, 0, canvas.width, canvas.height);
  let green = 0;
  for (let k = 0; k < data.length; k += 4) if (data[k + 1] > data[k] + 8 && data[k + 1] > data[k + 2] + 8) green++;
  return green;
}"""


#: Where stops are on the page.
STOPS = """async (stops) => {
  const { whenThere } = await import("leafcut-canvas/registry.js");
  const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
  const drawing = await new Promise((done) => whenThere(id, done));
  // The path is there, may be changed, and has been drawn where it stays.
  const still = () => drawing.editable && drawing.scenes.live && !drawing._request;
  while (!still()) await new Promise(requestAnimationFrame);
  const { main, canvas } = drawing.panes[1], box = canvas.getBoundingClientRect();
  return stops.map((stop) => {
    const [x, y] = main.scene.stopPlace(stop), [ox, oy] = main.scene.origin;
    return [box.left + drawing.view.toX(x + ox), box.top + drawing.view.toY(y + oy)];
  });
}"""

#: The numbers that are written beside the stops now, each with its place on the drawing.
NUMBERS = """async () => {
  const { whenThere } = await import("leafcut-canvas/registry.js");
  const id = Number(document.querySelector(".frame .lc-drawing").parentElement.id.replace(/\\D+/g, ""));
  const drawing = await new Promise((done) => whenThere(id, done)), pen = CanvasRenderingContext2D.prototype;
  while (drawing._request) await new Promise(requestAnimationFrame);
  const { fillText } = pen, written = {};
  pen.fillText = function (words, x, y) {
    if (this.textAlign === "left" && /^\\d+\\D?$/.test(words)) written[`${Math.round(x)},${Math.round(y)}`] = words;
    return fillText.call(this, words, x, y);
  };
  drawing.panes[1].invalidate("marks");
  drawing._wake();
  while (drawing._request) await new Promise(requestAnimationFrame);
  pen.fillText = fillText;
  return written;
}"""


def make_map(page: Page, points: int, algorithm: str) -> None:
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", str(points))
    page.get_by_role("button", name="Create map").click()
    expect(page.locator(".about-part .name")).to_have_text(f"random:{points}:1")
    choose_work(page, "solve")
    page.get_by_label("Algorithm", exact=True).select_option(algorithm)
    typed(page, "Time limit", "10min")


def ten_holes_to_change(page: Page) -> list[list[float]]:
    """Enable manual editing of a plate's hole order; return the positions on the page, in order."""
    opened(page, ROOT / "examples" / "plate_10.dxf")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    page.get_by_role("button", name="Edit the order").click()
    expect(page.locator(".edit")).to_be_visible()
    places: list[list[float]] = steady(page, STOPS, list(range(10)))
    return places


def gap(page: Page) -> float:
    told = said_by(page.locator(".progress .gap"))
    found = re.search(r"at most ([\d.]+) %", told)
    assert found, told
    return float(found.group(1))


def test_a_search_is_stepped_through_its_gap_falls_its_path_moves_and_pheromone_is_laid(page: Page) -> None:
    make_map(page, 120, "mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    study, canvas = page.locator(".study"), page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last
    expect(study).to_contain_text("step 1", timeout=LONG)
    first = gap(page)
    study.get_by_role("button", name="Single step").click()
    expect(study).to_contain_text("step 2")
    canvas.hover()
    page.mouse.move(2, 2)
    wait_for(page, lambda: page.evaluate(GREEN) > 200)
    laid = steady(page, GREEN)
    page.locator(".lc-menu summary").click()
    page.locator("[data-layer=pheromone]").click()
    wait_for(page, lambda: page.evaluate(GREEN) < laid / 2)
    page.locator("[data-layer=pheromone]").click()
    page.keyboard.press("Escape")
    before = page.evaluate(PICTURE)
    study.get_by_label("Speed", exact=True).select_option("full")
    wait_for(page, lambda: gap(page) < first)
    wait_for(page, lambda: page.evaluate(PICTURE) != before)
    study.get_by_role("button", name="Pause").click()
    expect(study.get_by_role("button", name="Resume")).to_be_visible()
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)
    expect(page.locator(".result")).to_contain_text("above the least possible")


def test_a_drawing_whose_search_is_stopped_gives_the_program_that_the_command_line_writes(
    page: Page, tmp_path: Path
) -> None:
    """The ants find their best order after five steps, so the longer run of the command line gives the same."""
    source = ROOT / "examples" / "plate_70.dxf"
    opened(page, source)
    typed(page, "Thickness", "6")
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    study = page.locator(".study")
    expect(study).to_contain_text("step 1", timeout=LONG)
    first = gap(page)
    for step in range(2, 9):
        study.get_by_role("button", name="Single step").click()
        expect(study).to_contain_text(f"step {step}")
    wait_for(page, lambda: gap(page) < first)
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    given, program = downloaded(page, "Program")
    target = tmp_path / given
    assert cli.run(["optimize", str(source), "-o", str(target), "--thickness", "6", "--algorithm", "mmas", "-q"]) == 0
    assert program == target.read_bytes()


def test_fireflies_are_shown_by_their_brightness(page: Page) -> None:
    make_map(page, 60, "firefly")
    page.locator(".choose").get_by_label("Speed", exact=True).select_option("step")
    press_run(page)
    expect(page.locator(".swarm [role=img]")).to_have_attribute("aria-label", re.compile(r"best \d"), timeout=LONG)
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator(".progress")).to_be_visible()  # asked twice: it cannot be taken back
    sure(page.locator(".progress [data-sure]"))
    expect(page.locator("#said")).to_contain_text("cancelled", timeout=LONG)
    expect(page.locator(".progress")).to_be_hidden()


@pytest.mark.parametrize(
    ("name", "work", "fields", "words"),
    [
        ("sheet.svg", "cut", {"Thickness": "6mm"}, ["--process", "cut", "--thickness", "6mm"]),
        (
            "pocket.dxf",
            "pocket",
            {"Tool diameter": "16", "Depth": "2"},
            ["--process", "pocket", "--tool-diameter", "16", "--depth", "2", "--strategy", "zigzag"],
        ),
        ("points.xml", "drill", {"Depth": "3"}, ["--depth", "3"]),
    ],
)
def test_what_is_downloaded_is_what_the_command_line_writes(
    page: Page, tmp_path: Path, name: str, work: str, fields: dict[str, str], words: list[str]
) -> None:
    source = ROOT / "examples" / name
    if name == "sheet.svg":
        source = tmp_path / name
        body = '<path d="M5 5H85V45H5Z"/><circle cx="45" cy="25" r="9"/><path d="M95 5H135V45Z"/>'
        source.write_bytes(svg(140, 50, body))
    if name == "points.xml":
        source = tmp_path / name
        points = "".join(f'<point x="{7 * k % 31}" y="{5 * k % 23}"/>' for k in range(31))
        source.write_text(f'<?xml version="1.0"?><map units="mm">{points}</map>', encoding="utf-8")
    opened(page, source)
    choose_work(page, work)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    for label, value in fields.items():
        typed(page, label, value)
    if work == "pocket":
        page.get_by_label("Strategy", exact=True).select_option("zigzag")
    run(page)
    given, program = downloaded(page, "Program")
    target = tmp_path / given
    assert cli.run(["optimize", str(source), "-o", str(target), *words, "--preset", "fast", "-q"]) == 0
    assert program == target.read_bytes()


def test_what_is_being_typed_stays_when_the_form_is_drawn_anew(page: Page) -> None:
    opened(page, ROOT / "examples" / "plate_10.dxf")
    page.get_by_label("Thickness", exact=True).fill("12")
    # Another field changes meanwhile, as when a large file has been read.
    page.evaluate(
        """() => {
            const effort = [...document.querySelectorAll("select")].find((e) => e.id.endsWith("preset"));
            effort.value = "fast";
            effort.dispatchEvent(new Event("change"));
        }"""
    )
    expect(page.locator("#command")).to_contain_text("--preset fast")
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("12")
    page.keyboard.press("Tab")
    expect(page.locator("#command")).to_contain_text("--thickness 12")


def test_an_order_is_dragged_taken_back_and_written(page: Page) -> None:
    opened(page, ROOT / "examples" / "plate_10.dxf")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    before = downloaded(page, "Program")[1]
    page.get_by_role("button", name="Edit the order").click()
    edit = page.locator(".edit")
    expect(edit).to_be_visible()
    length = said_by(edit.locator(".figure").first)
    places = steady(page, STOPS, [0, 4])
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(places[0][0] + 20, places[0][1] + 20)
    page.mouse.move(*places[1], steps=4)
    page.mouse.up()
    expect(edit.locator(".figure").first).not_to_have_text(length)
    edit.get_by_role("button", name="Undo").click()
    expect(edit.locator(".figure").first).to_have_text(length)
    edit.get_by_role("button", name="Redo").click()
    expect(edit.locator(".figure").first).not_to_have_text(length)
    address = page.url
    edit.get_by_role("button", name="Run with this order").click()
    wait_for(page, lambda: page.url != address)  # another job
    expect(page.locator("#command")).to_contain_text("--plan plate_10_edited.json")
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    expect(page.locator(".edit")).to_be_hidden()
    assert downloaded(page, "Program")[1] != before
    assert downloaded(page, "Input")[0] == "plate_10_edited.json"


def test_the_drawing_shows_the_order_as_it_is_changed_and_what_is_chosen_has_its_new_number(page: Page) -> None:
    places = ten_holes_to_change(page)
    edit, readout = page.locator(".edit"), page.locator(".lc-readout")
    page.mouse.click(*places[3])
    expect(edit).to_contain_text("Selected: stop 4 ")
    before = steady(page, NUMBERS)
    assert len(before) > 2
    edit.get_by_role("button", name="Reverse").click()
    expect(edit).to_contain_text("Selected: stop 7 ")
    wait_for(page, lambda: page.evaluate(NUMBERS) != before)
    after = steady(page, NUMBERS)
    both = before.keys() & after.keys()
    assert len(both) > 1
    assert all(int(before[place]) + int(after[place]) == 11 for place in both)
    page.mouse.move(*places[9])
    expect(readout).to_contain_text("no. 1")
    edit.get_by_role("button", name="First").click()
    expect(edit).to_contain_text("Selected: stop 1 ")
    page.mouse.move(*places[9])
    expect(readout).to_contain_text("no. 2")
    edit.get_by_role("button", name="Free the rest").click()
    expect(edit).to_contain_text("1 of 10 fixed")
    expect(edit.locator(".shorter, .longer")).to_have_count(0)
    wait_for(page, lambda: set(page.evaluate(NUMBERS).values()) == {"1"})
    page.mouse.click(*page.evaluate(STOPS, [0])[0])
    expect(edit).to_contain_text("Selected: a stop that the search orders")


def test_after_an_edit_that_is_refused_it_can_be_taken_back_and_the_next_run_is_without_it(
    page: Page, tmp_path: Path
) -> None:
    """An outline before its hole is refused: the hole would be cut in a plate that lies loose."""
    sheet = tmp_path / "one.svg"
    body = '<path d="M5 5h40v30h-40z"/><circle cx="25" cy="20" r="6"/><path d="M65 5h20v30h-20z"/>'
    sheet.write_bytes(svg(90, 40, body))
    opened(page, sheet)
    choose_work(page, "cut")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "6")
    run(page)
    address = page.url
    page.get_by_role("button", name="Edit the order").click()
    edit = page.locator(".edit")
    expect(edit).to_contain_text("unchanged")
    places = steady(page, STOPS, [0, 1])
    page.mouse.click(*places[1])
    expect(edit).to_contain_text("Selected: stop 2 ")
    edit.get_by_role("button", name="First").click()
    expect(edit).to_contain_text("Selected: stop 1 ")
    edit.get_by_role("button", name="Run with this order").click()
    expect(page.locator("#said")).to_contain_text("must be cut first", timeout=LONG)
    expect(edit).to_be_visible()
    expect(page.locator("#command")).not_to_contain_text("--plan")
    expect(page).to_have_url(address)
    expect(edit).not_to_contain_text("unchanged")
    edit.get_by_role("button", name="Undo").click()
    expect(edit).to_contain_text("unchanged")
    run(page)
    expect(page.locator("#said")).to_have_text("")


def test_a_cut_is_chosen_by_its_pierce_begun_elsewhere_and_written_by_the_plan_that_is_given(
    page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drawing stays where it is when a cut is chosen: what follows is under the pointer."""
    monkeypatch.chdir(tmp_path)
    body = "".join(
        f'<path d="M{60 * k + 5} 5h40v30h-40z"/><circle cx="{60 * k + 25}" cy="20" r="6"/>' for k in range(3)
    )
    Path("three.svg").write_bytes(svg(180, 40, body))
    opened(page, Path("three.svg"))
    choose_work(page, "cut")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Thickness", "6")
    run(page)
    page.get_by_role("button", name="Edit the order").click()
    edit = page.locator(".edit")
    expect(edit).to_contain_text("Drag a pierce along its contour")
    places = steady(page, STOPS, list(range(6)))
    for number, place in enumerate(places, 1):
        page.mouse.click(*place)
        expect(edit).to_contain_text(f"Selected: stop {number} ")
    assert page.evaluate(STOPS, list(range(6))) == places
    page.mouse.move(*places[5])
    page.mouse.down()
    page.mouse.move(places[5][0] + 30, places[5][1] + 15, steps=4)
    page.mouse.up()
    expect(edit.locator(".figure").last).not_to_have_text("unchanged")
    address = page.url
    edit.get_by_role("button", name="Run with this order").click()
    wait_for(page, lambda: page.url != address)
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    expect(page.locator("#command")).to_contain_text("--plan three_edited.json")
    words = (page.locator("#command").text_content() or "").split()
    given, plan = downloaded(page, "Input")
    Path(given).write_bytes(plan)
    program, text = downloaded(page, "Program")
    assert cli.run([*words[1:], "--quiet"]) == 0
    assert text == Path(program).read_bytes()
    assert downloaded(page, "Plan")[0] == "three_plan.json"


def test_what_is_told_of_a_stop_covers_none_that_the_pointer_is_at(page: Page) -> None:
    """Also during a drag; away from there it is shown at its usual position."""
    places = ten_holes_to_change(page)
    readout = page.locator(".lc-readout")
    left = min(places, key=lambda place: place[0] - place[1])

    def clear_of(place: list[float]) -> bool:
        box = readout.bounding_box()
        if box is None:
            return False
        (x, y), reach = place, 12
        beside = x < box["x"] - reach or x > box["x"] + box["width"] + reach
        return bool(beside or y < box["y"] - reach or y > box["y"] + box["height"] + reach)

    far = max(places, key=lambda place: place[0] - place[1])
    page.mouse.move(*far)
    expect(readout).to_contain_text("Hole")
    wait_for(page, lambda: not clear_of(left))  # otherwise this proves nothing
    page.mouse.down()
    page.mouse.move(*left, steps=5)
    wait_for(page, lambda: clear_of(left))
    page.mouse.up()
    page.mouse.move(*left)
    expect(readout).to_contain_text("Hole")
    wait_for(page, lambda: clear_of(left))
    page.mouse.move(*far)
    wait_for(page, lambda: not clear_of(left))


def test_beside_the_path_of_before_the_new_program_is_shown_and_told_as_that(page: Page) -> None:
    opened(page, ROOT / "examples" / "plate_10.dxf")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    page.get_by_role("tab", name="Program").click()
    told, lines = page.locator(".lc-told"), page.locator(".lc-line")
    expect(lines.first).to_be_visible()
    expect(told).to_be_hidden()
    first = lines.all_inner_texts()
    page.get_by_role("radio", name="Before").click()
    expect(told).to_contain_text("This is the new program")
    wait_for(page, lambda: len(now := lines.all_inner_texts()) > 5 and now == first[: len(now)])
    lines.nth(5).click()
    expect(lines.nth(5)).to_have_class(re.compile("lc-selected"))
    typed(page, "Thickness", "6")  # another program replaces the previous one
    address = page.url
    press_run(page)
    wait_for(page, lambda: page.url != address)
    expect(page.locator(".badge")).to_be_visible(timeout=LONG)  # a new outcome opens its summary
    page.get_by_role("tab", name="Program").click()
    expect(page.locator(".cm-content")).to_contain_text("--thickness 6", timeout=LONG)
    expect(told).to_contain_text("This is the new program")
    page.get_by_role("radio", name="After").click()
    expect(told).to_be_hidden()
