"""Run is never lost, and uses the latest input and file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import httpx2
from playwright.sync_api import Page, Route, expect
from studio_page import LONG, PLATE, ROOT, choose_work, opened, run, said_by, typed, wait_for, work_is
from studio_server import Server


def many_holes(folder: Path) -> Path:
    """Return a drawing that takes longer to read than a finger stays on a button."""
    plate = folder / "many.dxf"
    drawing = ezdxf.new(units=4)
    for k in range(4000):
        drawing.modelspace().add_circle((k % 80, k // 80), 2.0 if k % 800 == 0 else 0.2)
    drawing.saveas(plate)
    return plate


def press_run(page: Page) -> None:
    """Press Run for as long as a finger does, straight after what was typed."""
    page.get_by_role("button", name="Run", exact=True).hover()
    page.mouse.down()
    page.wait_for_timeout(90)  # duration of the delay, not a wait for an event
    page.mouse.up()


def job_of(page: Page, server: Server, before: str) -> dict[str, Any]:
    """Return the job started since job `before`, as other programs see it; it is stopped."""
    wait_for(page, lambda: page.url.partition("job=")[2] not in ("", before.partition("job=")[2]))
    headers = {"Authorization": f"Bearer {server.token}"}
    job = f"{server.origin}/api/jobs/{page.url.partition('job=')[2]}"
    found: dict[str, Any] = httpx2.post(f"{job}/cancel", headers=headers, timeout=60).json()
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_enabled(timeout=LONG)
    return found


def test_a_press_straight_after_a_field_that_makes_the_file_be_read_again_begins_the_run(
    page: Page, server: Server, tmp_path: Path
) -> None:
    opened(page, many_holes(tmp_path))
    page.get_by_label("Search effort", exact=True).select_option("fast")
    typed(page, "Depth", "3mm")
    page.get_by_text("Reading the file").click()
    for label, value, name in (
        ("Min diameter", "1mm", "min_diameter"),
        ("Min diameter", "2mm", "min_diameter"),
        ("Layers", "0", "layers"),
    ):
        before = page.url
        page.locator(".left").get_by_label(label, exact=True).fill(value)
        press_run(page)
        assert job_of(page, server, before)["options"][name] == value
    for label, value, name in (("Units", "in", "units"), ("Machine", "haas-vf2", "machine")):
        before = page.url
        field = page.locator(".left").get_by_label(label, exact=True)
        field.focus()
        field.select_option(value)
        press_run(page)
        assert job_of(page, server, before)["options"][name] == value
    before = page.url
    page.get_by_label("Min diameter", exact=True).fill("3mm")
    page.keyboard.press("Control+Enter")  # a key alone is a letter of the field
    assert job_of(page, server, before)["options"]["min_diameter"] == "3mm"
    before = page.url
    page.get_by_label("Min diameter", exact=True).fill("1.5mm")
    page.locator(".about-part").click()
    page.keyboard.press("r")
    assert job_of(page, server, before)["options"]["min_diameter"] == "1.5mm"


def test_a_press_straight_after_the_pixel_size_begins_the_run(page: Page, server: Server) -> None:
    opened(page, ROOT / "examples" / "pocket.png")
    page.get_by_label("Pixel size", exact=True).wait_for()
    typed(page, "Tool diameter", "6mm")
    typed(page, "Depth", "3mm")
    for size in ("0.2", "0.25"):
        before = page.url
        page.get_by_label("Pixel size", exact=True).fill(size)
        press_run(page)
        assert job_of(page, server, before)["options"]["pixel_size"] == size


def test_a_press_straight_after_another_work_was_chosen_runs_that(page: Page, server: Server) -> None:
    opened(page, ROOT / "examples" / "pocket.dxf")
    before = page.url
    choose_work(page, "cut")
    press_run(page)
    assert job_of(page, server, before)["process"] == "cut"


def test_a_press_while_a_file_is_on_its_way_runs_that_file(page: Page, server: Server) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    page.route("**/api/files*", hold)
    page.set_input_files("#open-file", PLATE.with_name("plate_27.dxf"))
    expect(page.get_by_text("Opening …")).to_be_visible()
    before = page.url
    press_run(page)
    wait_for(page, lambda: held)
    held[0].continue_()
    assert job_of(page, server, before)["title"] == "plate_27.dxf"


def test_a_file_chosen_while_another_is_on_its_way_is_opened_after_it(page: Page) -> None:
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    page.route("**/api/files*", hold)
    page.set_input_files("#open-file", PLATE)
    wait_for(page, lambda: held)
    page.set_input_files("#open-file", PLATE.with_name("plate_27.dxf"))
    held[0].continue_()
    wait_for(page, lambda: len(held) == 2)
    held[1].continue_()
    expect(page.locator(".about-part .name")).to_have_text("plate_27.dxf")


def test_run_keeps_the_focus_and_says_what_is_missing(page: Page) -> None:
    button = page.get_by_role("button", name="Run", exact=True)
    button.click(force=True)
    expect(page.locator("#said")).to_have_text("Open a file, an example or a random map.")
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    button.focus()
    run(page)
    expect(button).to_be_focused()


def test_a_broken_file_never_takes_the_place_of_the_one_that_is_open(page: Page, tmp_path: Path) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    saved = said_by(page.locator(".headline"))
    for name, data, line in (
        ("broken.dxf", b"\0\1\2", "this is not a DXF drawing"),
        ("half.svg", b"<svg", "not well-formed"),
        ("letter.nc", b"Dear Sir", "is a letter without a number"),
        ("none.png", b"PNG", "this is not a picture"),
        ("empty.dxf", b"", "the file is empty"),
    ):
        file = tmp_path / name
        file.write_bytes(data)
        page.set_input_files("#open-file", file)
        expect(page.locator("#said")).to_contain_text(f"{name}:")
        expect(page.locator("#said")).to_contain_text(line)
        expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
        work_is(page, "drill")
        expect(page.locator(".headline")).to_have_text(saved)
    # What only lacks an option is no broken file.
    opened(page, ROOT / "examples" / "pocket.png")
