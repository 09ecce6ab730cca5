"""The page in a real Chromium, as a person uses it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from parts_to_nest import PLATE as PART
from playwright.sync_api import Browser, Page, expect
from studio_page import (
    LONG,
    PLATE,
    ROOT,
    choose_machine,
    choose_work,
    downloaded,
    opened,
    press_run,
    run,
    said_by,
    serious,
    typed,
    wait_for,
    work_is,
)
from studio_server import Server, running

import leafcut
from leafcut.cli import app as cli


def test_a_drawing_is_opened_run_and_downloaded_as_the_command_line_writes_it(page: Page, tmp_path: Path) -> None:
    opened(page, PLATE)
    expect(page.locator(".about-part")).to_contain_text("10")
    typed(page, "Thickness", "0.25in")
    page.get_by_label("Machine", exact=True).select_option("haas-vf2")
    expect(page.locator("#command")).to_have_text(
        "leafcut optimize plate_10.dxf -o plate_10.nc --thickness 0.25in --machine haas-vf2"
    )
    run(page)
    expect(page.locator(".badge")).to_contain_text("Verified")
    name, program = downloaded(page, "Program")
    target = tmp_path / "plate_10.nc"
    assert (
        cli.run(["optimize", str(PLATE), "-o", str(target), "--thickness", "0.25in", "--machine", "haas-vf2", "-q"])
        == 0
    )
    assert name == "plate_10.nc"
    assert program == target.read_bytes()
    assert b"<title>" in downloaded(page, "Report")[1]


def test_a_program_of_another_cam_is_reordered(page: Page, tmp_path: Path) -> None:
    opened(page, ROOT / "examples" / "cam_121.nc")
    work_is(page, "program")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    run(page)
    _, program = downloaded(page, "Program")
    target = tmp_path / "new.nc"
    assert (
        cli.run(["optimize", str(ROOT / "examples" / "cam_121.nc"), "-o", str(target), "--preset", "fast", "-q"]) == 0
    )
    assert program == target.read_bytes()


def test_the_work_that_is_shown_is_the_work_that_is_run(page: Page) -> None:
    opened(page, ROOT / "examples" / "pocket.dxf")
    for work in ("pocket", "cut", "drill", "pocket"):
        choose_work(page, work)
        expect(page.locator("#command")).to_contain_text("-o" if work == "drill" else f"--process {work}")
        expect(page.locator("#said")).to_be_empty()
        work_is(page, work)
    # A run that fails says why, at the foot and beside what it said before, and the page goes on.
    press_run(page)
    expect(page.locator("#said")).to_contain_text("give “Depth”", timeout=LONG)
    expect(page.locator(".result .error")).to_contain_text("give “Depth”")
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_enabled()
    page.keyboard.press("2")
    expect(page.locator("table.jobs tbody tr").first).to_contain_text("failed")


def test_a_random_map_is_made_and_its_search_stopped(page: Page) -> None:
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", "1500")
    page.get_by_role("button", name="Create map").click()
    expect(page.locator(".about-part .name")).to_have_text("random:1500:1")
    choose_work(page, "solve")
    page.get_by_label("Algorithm", exact=True).select_option("mmas")  # it searches as long as it may
    typed(page, "Time limit", "10min")
    press_run(page)
    expect(page.locator(".progress .figure").first).not_to_be_empty(timeout=LONG)
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)
    page.keyboard.press("2")
    expect(page.locator("table.jobs tbody tr").first.locator(".tag.stopped")).to_be_visible()


def test_what_cannot_be_read_is_a_line_and_the_page_lives_on(page: Page, tmp_path: Path) -> None:
    bad = tmp_path / "broken.dxf"
    bad.write_bytes(b"\0\1\2<script>alert(1)</script>")
    page.set_input_files("#open-file", bad)
    expect(page.locator("#said")).to_contain_text("broken.dxf: ")
    expect(page.locator("#said")).not_to_contain_text("Traceback")
    opened(page, PLATE)
    typed(page, "Thickness", "thick")
    expect(page.get_by_role("alert")).to_contain_text("'thick' is not")
    press_run(page)
    expect(page.locator("#said")).to_contain_text("“Thickness”: 'thick' is not")
    typed(page, "Thickness", "3")
    run(page)
    expect(page.locator(".headline")).to_be_visible()


def test_a_job_goes_on_when_its_tab_is_closed_and_is_found_in_the_history(page: Page, server: Server) -> None:
    opened(page, PLATE)
    page.get_by_label("Search effort", exact=True).select_option("fast")
    press_run(page)
    expect(page).to_have_url(re.compile("job="))
    job = page.url.partition("job=")[2]
    other = page.context.new_page()
    page.goto("about:blank")
    other.goto(server.origin)
    other.get_by_role("button", name="Jobs").click()
    row = other.locator("table.jobs tbody tr").first
    expect(row).to_contain_text("plate_10.dxf")
    row.get_by_role("button", name="Open").click()
    expect(other).to_have_url(re.compile(f"job={job}"))
    expect(other.locator(".headline")).to_be_visible(timeout=LONG)
    expect(other.get_by_label("Search effort", exact=True)).to_have_value("fast")
    other.close()


def test_two_tabs_have_their_own_choices(page: Page, server: Server) -> None:
    other = page.context.new_page()
    other.goto(server.origin)
    opened(page, PLATE)
    typed(page, "Thickness", "5mm")
    opened(other, ROOT / "examples" / "plate_27.dxf")
    expect(other.get_by_label("Thickness", exact=True)).to_have_value("")
    expect(page.locator(".about-part .name")).to_have_text("plate_10.dxf")
    for tab in (page, other):
        tab.get_by_label("Search effort", exact=True).select_option("fast")
        press_run(tab)
    for tab, holes in ((page, "10"), (other, "27")):
        expect(tab.locator(".badge")).to_contain_text("Verified", timeout=LONG)
        tools = tab.get_by_role("table", name="Tools", exact=True).locator("tbody tr")
        expect(tools.first.locator("td").last).to_have_text(holes)
    assert page.url != other.url
    other.close()


def test_a_program_of_50_megabytes_is_opened_and_the_page_lives_on(page: Page, tmp_path: Path) -> None:
    large = tmp_path / "large.nc"
    blocks = (f"G0 X{k % 300} Y{k // 300}\n({'x' * 2400})\n" for k in range(20_800))
    large.write_text("G21 G90\n" + "".join(blocks) + "M30\n")
    assert large.stat().st_size > 50_000_000
    opened(page, large)
    expect(page.locator(".about-part .facts")).to_contain_text("299 × 69 mm")
    expect(page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last).to_be_visible()
    large.unlink()
    opened(page, PLATE)
    expect(page.locator(".about-part .facts")).to_contain_text("10")


def test_a_machine_is_copied_changed_and_used(page: Page) -> None:
    page.keyboard.press("3")
    choose_machine(page, "pcb-drill")
    page.get_by_role("button", name="Copy", exact=True).click()
    expect(page.locator("#said")).to_contain_text("my-pcb-drill checked and saved")
    page.get_by_role("tab", name="TOML").click()
    line = page.locator("#view-machines .editor .cm-line").filter(has_text="controller =").first
    line.click()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+End")
    page.keyboard.insert_text(line.inner_text().replace("controller =", "controler ="))
    expect(page.locator(".problem")).to_contain_text("unknown key 'controler'; did you mean 'controller'?")
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#said")).to_contain_text("unknown key 'controler'; did you mean 'controller'?")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Work").click()
    opened(page, PLATE)
    page.get_by_role("combobox", name="Machine", exact=True).select_option("mine:my-pcb-drill")
    expect(page.locator("#command")).to_contain_text("--machine my-pcb-drill.toml")


def test_it_speaks_spanish_and_remembers(page: Page, server: Server) -> None:
    page.get_by_role("link", name="Español").click()
    expect(page.get_by_role("button", name="Ejecutar")).to_be_visible()
    page.goto(server.origin)
    expect(page.get_by_role("button", name="Ejecutar")).to_be_visible()
    page.get_by_role("link", name="English").click()
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_visible()


def test_light_and_dark_are_kept(page: Page) -> None:
    def ground() -> str:
        return str(page.evaluate("getComputedStyle(document.body).backgroundColor"))

    light = ground()
    page.keyboard.press("t")
    wait_for(page, lambda: ground() != light)
    dark = ground()
    page.reload()
    expect(page.locator("#view-work")).to_be_visible()
    wait_for(page, lambda: ground() == dark)


def test_the_keys_are_explained_and_work(page: Page) -> None:
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("2")
    expect(page.locator("#view-jobs")).not_to_be_visible()  # the dialogue is in front
    page.get_by_role("button", name="Close").click()
    page.keyboard.press("2")
    expect(page.locator("#view-jobs")).to_be_visible()
    page.keyboard.press("1")
    opened(page, PLATE)
    page.get_by_label("Thickness", exact=True).press("r")  # in a field, a key is a letter
    expect(page.get_by_label("Thickness", exact=True)).to_have_value("r")
    typed(page, "Thickness", "")
    page.get_by_role("button", name="Copy", exact=True).click()
    copied = "navigator.clipboard.readText()"
    wait_for(page, lambda: page.evaluate(copied) == page.locator("#command").text_content())


def test_files_are_dropped_on_the_page(page: Page) -> None:
    page.evaluate(
        """(text) => {
            const data = new DataTransfer();
            data.items.add(new File([text], "points.csv"));
            const about = { bubbles: true, cancelable: true, dataTransfer: data };
            for (const type of ["dragenter", "dragover", "drop"])
                document.body.dispatchEvent(new DragEvent(type, about));
        }""",
        "x,y,diameter\n1,2,3\n40,2,3\n",
    )
    expect(page.locator(".about-part .name")).to_have_text("points.csv")


def test_every_control_has_a_name_and_the_focus_is_seen(page: Page) -> None:
    opened(page, PLATE)
    run(page)
    unnamed: list[Any] = page.evaluate(
        """() => [...document.querySelectorAll("button, a[href], input, select, textarea, [role=tab]")]
            .filter((e) => e.getClientRects().length || e.type === "file")
            .filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.labels?.length))
            .map((e) => e.outerHTML)"""
    )
    assert unnamed == []
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    assert re.match(r"(?!none)", page.evaluate("getComputedStyle(document.activeElement).outlineStyle"))
    assert leafcut.__version__ in (page.locator("#help").text_content() or "")


def test_a_page_comes_back_when_the_studio_is_started_again_under_it(browser: Browser, tmp_path: Path) -> None:
    with running(tmp_path) as first:
        page = browser.new_page(locale="en-US", viewport={"width": 1280, "height": 720})
        page.goto(f"{first.origin}/?token={first.key}")
        opened(page, PLATE)
        page.get_by_label("Search effort", exact=True).select_option("fast")
        run(page)
        saved = said_by(page.locator(".headline"))
    page.evaluate("window.before = true")
    with running(tmp_path, port=first.port) as second:
        page.wait_for_function("!window.before", timeout=LONG)
        expect(page.locator(".headline")).to_have_text(saved, timeout=LONG)
        expect(page.locator(".about-part .name")).to_have_text(PLATE.name)
        page.close()
        code, _, error = second.end()
    assert (code, error) == (0, "leafcut: Ctrl-C ends it\n")


def test_axe_finds_nothing_serious(browser: Browser, server: Server) -> None:
    # The policy of the page would not let axe in.
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    server.let_in(context)
    page = context.new_page()
    page.goto(f"{server.origin}/?lang=es")
    page.goto(f"{server.origin}/?lang=en")
    expect(page.locator("#view-work")).to_be_visible()
    found = serious(page, "empty")
    opened(page, PLATE)
    run(page)
    for name in ("Summary", "Issues", "Program", "Search"):
        page.get_by_role("tab", name=name).click()
        expect(page.get_by_role("tab", name=name)).to_have_attribute("aria-selected", "true")
        found += serious(page, name, dark=name == "Program")
    found += nested(page)
    for view in ("jobs", "machines", "tools", "help"):
        page.keyboard.press({"jobs": "2", "machines": "3", "tools": "4", "help": "?"}[view])
        expect(page.locator("#help" if view == "help" else f"#view-{view}")).to_be_visible()
        found += serious(page, view, dark=view == "jobs")
    context.close()
    assert found == []


def nested(page: Page) -> list[tuple[str, ...]]:
    """Return axe's findings in the parts of a nest and in its outcome."""
    choose_work(page, "nest")
    expect(page.locator("#open-file[multiple]")).to_be_attached()
    typed(page, "Variants", "1")
    page.set_input_files("#open-file", {"name": "part.svg", "mimeType": "", "buffer": PART})
    expect(page.locator(".piece")).to_have_count(2)
    page.get_by_role("button", name="Remove: plate_10.dxf").click()
    press_run(page)
    page.get_by_role("tab", name="Summary").click()
    expect(page.locator("table.nests")).to_be_visible(timeout=LONG)
    return serious(page, "nest")
