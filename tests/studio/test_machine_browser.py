"""The machine page in Chromium with the real GRBL firmware: each step waits for the page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import LONG, opened, serious, wait_for
from studio_server import PATIENT_PAGES, Server, running

from grbl_board import PROFILE, ZERO, Board, plate
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.port import SerialPort

#: Waits longer for an answer of the board and for a report of the page.
PATIENT = (
    f"{PATIENT_PAGES}; from leafcut.sender.grbl import GrblConversation; from leafcut.studio.control import link; "
    "GrblConversation.patience, link.GRACE = 10.0, 30.0"
)
#: The views of the page by their keys.
VIEWS = (("1", "work"), ("2", "jobs"), ("3", "machines"), ("4", "tools"), ("5", "lab"), ("6", "control"))


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Return a studio in which the board is a machine of the person's own.

    It is patient: the browser and the simulated board may be slow.
    """
    home = tmp_path_factory.mktemp("home")
    with running(home, first=PATIENT) as server:
        (server.folder / "machines" / "board.toml").write_text(PROFILE, encoding="utf-8")
        yield server


@pytest.fixture
def own(browser: Browser, started: Server, board: Board, tmp_path: Path) -> Iterator[Page]:
    """Return the machine's page with a plate of five holes, connected to the board."""
    port = SerialPort(board.port)
    talk = GrblConversation(port)
    talk.ask("G10 L2 P1 X{} Y{} Z{}".format(*ZERO))
    port.close()
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", bypass_csp=True)
    started.let_in(context)
    page = context.new_page()
    page.goto(started.origin)
    file = tmp_path / "plate.nc"
    file.write_text(plate(5).replace("F3000", "F600"), encoding="utf-8")
    opened(page, file)
    page.keyboard.press("6")
    page.get_by_label("Port", exact=True).fill(board.port)
    button(page, "Connect").click()
    expect(state(page)).to_have_text("Idle", timeout=LONG)
    page.locator("#machine-machine").select_option("mine:board")
    expect(page.locator("#view-control")).to_contain_text("5 holes")
    yield page
    given_back(page, started)
    context.close()


def given_back(page: Page, server: Server) -> None:
    """Have the studio let go of the board, whatever a test has left it at."""
    httpx2.post(f"{server.origin}/api/machine/stop", headers={"authorization": f"Bearer {server.token}"})
    page.goto(f"{server.origin}/?view=control&lang=en")

    def is_free() -> object:
        # In one step: between two questions to the page, a button may disappear.
        return page.evaluate(
            """() => {
                const all = [...document.querySelectorAll("#view-control button")];
                const shown = all.filter((at) => at.checkVisibility());
                const names = shown.map((at) => at.textContent.trim());
                shown.find((_, k) => ["Take over", "Disconnect"].includes(names[k]))?.click();
                return names.includes("Connect");
            }"""
        )

    wait_for(page, is_free)


def button(page: Page, name: str) -> Any:
    within = page if name == "Stop" else page.locator("#view-control")
    return within.get_by_role("button", name=re.compile("^Stop") if name == "Stop" else name, exact=True)


def state(page: Page) -> Any:
    return page.locator("#view-control .tag").first


def place(page: Page, axis: str) -> float:
    return float(page.locator(f"#machine-place-{axis}").inner_text())


def at(page: Page, axis: str, value: float) -> None:
    expect(page.locator(f"#machine-place-{axis}")).to_have_text(f"{value:.3f}")


def work_is(page: Page, axis: str, words: str) -> None:
    expect(page.locator(f"#machine-work-{axis}")).to_have_text(words)


def begin(page: Page) -> None:
    button(page, "Start").click()
    button(page, "Start the machine").click()
    expect(button(page, "Start")).to_be_hidden(timeout=LONG)


def test_it_is_jogged_zeroed_and_its_part_is_framed(own: Page, board: Board) -> None:
    """By buttons and by keys of the pad alone; a key that is held goes on, and lets go when it is let go."""
    page = own
    x, z = place(page, "x"), place(page, "z")
    page.get_by_role("button", name="X−", exact=True).click()
    at(page, "x", x - 1)
    page.get_by_role("button", name="10 mm", exact=True).click()
    page.locator(".jog-pad").focus()
    page.keyboard.press("PageDown")
    at(page, "z", z - 10)
    page.locator("#machine-jog-feed").fill("20")  # a step takes 30 s
    page.locator(".jog-pad").focus()
    page.keyboard.down("ArrowDown")
    expect(state(page)).to_have_text("Jogging")
    # The page counts a press as held after 350 ms of its own clock.
    page.wait_for_function("() => new Promise((done) => setTimeout(() => done(true), 700))")
    page.keyboard.up("ArrowDown")
    wait_for(page, lambda: b"\x85" in board.sent)
    expect(state(page)).to_have_text("Idle")
    button(page, "Z = 0").click()
    work_is(page, "z", "0.000")
    button(page, "Zero all").click()
    for axis in "xyz":
        work_is(page, axis, "0.000")
    page.locator("#machine-jog-feed").fill("0")
    page.get_by_role("button", name="X−", exact=True).click()
    expect(page.locator("#machine-line")).to_contain_text("a jog needs a feed above 0")
    page.locator("#machine-jog-feed").fill("6000")
    # The zero is where the plate cannot lie: its box leaves the travel in X.
    button(page, "Frame").click()
    expect(page.locator("#machine-line")).to_contain_text("outside the travel of -200 to 0 mm")
    frame_says = page.locator("#machine-line").inner_text()
    button(page, "Check").click()
    expect(page.locator("#machine-line")).to_have_text(frame_says)
    board.forget()
    for to in ("-10.000", "-20.000"):
        page.get_by_role("button", name="X−", exact=True).click()
        work_is(page, "x", to)
    button(page, "Zero all").click()
    work_is(page, "x", "0.000")
    expect(page.locator("#machine-jog-feed")).to_have_value("6000")  # also after the page is redrawn
    page.get_by_role("button", name="Z−", exact=True).click()
    work_is(page, "z", "-10.000")
    button(page, "Frame").click()
    wait_for(page, lambda: len([line for line in board.lines() if line.startswith("$J=G53")]) == 6)
    expect(button(page, "Frame")).to_be_enabled(timeout=LONG)
    expect(state(page)).to_have_text("Idle")
    assert serious(page, "machine") == []


def test_holes_are_gone_through_one_by_one_with_their_lines_in_words(own: Page, board: Board) -> None:
    page = own
    page.get_by_text("Hole by hole").click()
    begin(page)
    for hole in range(1, 6):
        drill = button(page, f"Drill hole {hole}")
        expect(drill).to_be_visible(timeout=LONG)
        lines = page.locator(".explained li")
        expect(lines.nth(2)).to_have_text(re.compile(r"\d+G1 Z-0.5 F600drills down to Z -0.5 at 600 mm/min"))
        assert board.lines().count("G1Z-0.5F600") == hole - 1
        if hole == 3:
            assert serious(page, "step") == []
        drill.click()
    expect(page.locator("#machine-line")).to_contain_text("plate.nc: all 27 lines done", timeout=LONG)
    assert board.lines().count("G1Z-0.5F600") == 5


@pytest.mark.hazard
def test_a_double_click_on_start_starts_nothing_and_the_dialog_states_what_will_move(own: Page, board: Board) -> None:
    """Only a press on the other button of the dialog starts the machine, and not one that ends a double click."""
    page = own
    board.forget()
    confirm = page.locator("#machine-confirm")
    button(page, "Start").dblclick()
    expect(confirm).to_be_visible()
    expect(page.locator("#machine-confirm-box")).to_have_text("X 0 to 6 mm, Y 0 to 0 mm")
    expect(page.locator("#machine-confirm-z")).to_have_text("-0.5 to 0.5 mm")
    expect(page.locator("#machine-confirm-tool")).to_have_text("not named in the program")
    expect(button(page, "Cancel")).to_be_focused()
    assert serious(page, "confirm") == []
    button(page, "Start the machine").dispatch_event("click", {"detail": 2})
    expect(confirm).to_be_visible()
    button(page, "Cancel").click()
    expect(confirm).to_be_hidden()
    # A check is answered after all that was asked for before.
    button(page, "Check").click()
    expect(page.locator("#machine-line")).to_have_text("Checked: the program can be run.")
    expect(state(page)).to_have_text("Idle")
    assert [line for line in board.lines() if not line.startswith("$")] == []


@pytest.mark.hazard
def test_stop_covers_nothing_in_any_view(own: Page) -> None:
    """At 1280 x 720: the bar of Stop lies beside each view, and Stop itself is on top at its place."""
    page = own
    for key, name in VIEWS:
        page.keyboard.press(key)
        expect(page.locator(f"#view-{name}")).to_be_visible()
        view = page.locator(f"#view-{name}").bounding_box()
        stop = page.locator(".machine-stop").bounding_box()
        assert view is not None and stop is not None
        assert view["y"] + view["height"] <= stop["y"] + 0.5, name
        assert stop["y"] + stop["height"] <= 720.5 and stop["height"] > 40.0
    page.keyboard.press("6")
    for name in ("Check", "Frame", "Start"):
        button(page, name).click(trial=True)
    button(page, "Stop").click(trial=True)


def test_it_runs_is_held_goes_on_and_is_stopped_by_key_from_another_view_and_goes_on_at_a_hole(
    own: Page, board: Board, tmp_path: Path
) -> None:
    page = own
    page.keyboard.press("1")
    slow = tmp_path / "slow.nc"
    slow.write_text(plate(10, {1: 12, 4: 6}), encoding="utf-8")  # 5 s for the first hole, 10 s for the fourth
    opened(page, slow)
    page.keyboard.press("6")
    expect(page.locator("#view-control .name")).to_have_text("slow.nc")
    begin(page)
    button(page, "Hold").click()
    expect(state(page)).to_have_text("On hold", timeout=LONG)
    button(page, "+10 %").click()
    expect(page.locator("#machine-now-feed")).to_contain_text("110 %")
    expect(page.locator("#machine-now-hole")).to_contain_text("/ 10")
    button(page, "Resume").click()
    expect(page.locator("#machine-now-hole")).to_have_text(re.compile(r"([3-9]|10) / 10"), timeout=LONG)
    button(page, "Hold").click()
    expect(state(page)).to_have_text("On hold", timeout=LONG)
    page.keyboard.press("2")
    expect(button(page, "Stop")).to_be_visible()
    page.keyboard.press("Escape")
    page.keyboard.press("6")
    line = page.locator("#machine-line")
    expect(line).to_contain_text("stopped by you", timeout=LONG)
    expect(line).to_contain_text("resume with “From hole”")
    expect(page.locator("#machine-from-hole")).to_have_value(re.compile(r"^([3-9]|10)$"))
    hole = int(page.locator("#machine-from-hole").input_value())
    board.forget()
    begin(page)
    expect(line).to_contain_text("all 47 lines done", timeout=LONG)
    assert sum(line.startswith("G1Z-0.5") for line in board.lines()) == 11 - hole


def test_a_second_page_sees_the_same_says_so_and_may_take_over(own: Page, started: Server) -> None:
    other = own.context.new_page()
    other.goto(f"{started.origin}/?view=control")
    expect(state(other)).to_have_text("Idle")
    expect(other.locator(".other-page")).to_contain_text("Another page commands this machine")
    expect(button(other, "Home")).to_be_disabled()
    expect(button(other, "Stop")).to_be_visible()
    work = own.locator("#machine-work-x").inner_text()
    expect(other.locator("#machine-work-x")).to_have_text(work)
    button(other, "Take over").click()
    expect(own.locator(".other-page")).to_be_visible()
    expect(button(other, "Home")).to_be_enabled()
    other.close()
    # Nobody commands it any more: the page that still shows it does.
    expect(button(own, "Home")).to_be_enabled(timeout=LONG)


def test_what_is_refused_is_one_line_in_the_language_of_the_page(own: Page, started: Server) -> None:
    page = own
    page.locator("#machine-from-hole").fill("99")
    button(page, "Check").click()
    expect(page.locator("#machine-line")).to_have_text("“From hole” 99: the program has 5 holes")
    page.goto(f"{started.origin}/?view=control&lang=es")
    expect(button(page, "Desconectar")).to_be_enabled(timeout=LONG)
    button(page, "Desconectar").click()
    page.locator("#machine-port").fill("/dev/nothing")
    button(page, "Conectar").click()
    expect(page.locator("#machine-line")).to_contain_text("“Puerto” /dev/nothing: no existe ese puerto")
    started.speak_as_the_browser()
    page.goto(f"{started.origin}/?view=control&lang=en")
    page.get_by_label("Port", exact=True).fill("/dev/nothing")
    button(page, "Connect").click()
    expect(page.locator("#machine-line")).to_contain_text("does not exist")
