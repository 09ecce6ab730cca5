"""Take the screenshots of the studio for the documentation, in headless Chromium.

    python tools/make_studio_pictures.py [solid | machine]

``solid`` selects the solid view. ``machine`` selects the Control page, with GRBL firmware on the simulated board from
the tests.
"""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from curved_part import FIXTURES, holes_csv, part_stl
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
EXAMPLES = ROOT / "examples"
#: Parts to be nested: name → width, height and SVG content, mm.
PARTS = {
    "bracket.svg": (
        200,
        150,
        '<path d="M0 0H180A20 20 0 0 1 200 20V40H60V130A20 20 0 0 1 40 150H20A20 20 0 0 1 0 130Z"/>'
        '<circle cx="30" cy="30" r="9"/><circle cx="170" cy="20" r="7"/><circle cx="30" cy="125" r="7"/>',
    ),
    "ring.svg": (240, 240, '<circle cx="120" cy="120" r="118"/><circle cx="120" cy="120" r="75"/>'),
    "gusset.svg": (90, 90, '<path d="M0 0H90L0 90Z"/><circle cx="25" cy="25" r="8"/>'),
}
#: A tool library with holders.
HELD = """
[[tool]]
number = 1
kind = "drill"
diameter = "4 mm"
point_angle = "118 deg"
flute_length = "36 mm"
stickout = "44 mm"
feed = "240 mm/min"
spindle_speed = "4000 rpm"
holder = "14-20 x 6, 20 x 14"

[[tool]]
number = 2
kind = "drill"
diameter = "6 mm"
point_angle = "118 deg"
flute_length = "40 mm"
stickout = "50 mm"
feed = "260 mm/min"
spindle_speed = "3000 rpm"
holder = "16-22 x 6, 22 x 14"
"""
#: The machine on the page about machines.
ROUTER = """
name = "router"
controller = "grbl"
rapid.velocity = ["6 m/min", "6 m/min", "3 m/min"]
rapid.acceleration = "1000 mm/s2"
travel.min = ["-400 mm", "-400 mm", "-90 mm"]
travel.max = ["0 mm", "0 mm", "0 mm"]
"""
#: Settings of the machine's board: number → value.
STORED = {110: 6000, 111: 6000, 112: 3000, 120: 1000, 121: 1000, 122: 1000, 130: 400, 131: 400, 132: 90}
#: Maximum duration of a run, ms.
LONG = 120_000


def main() -> None:
    """Write docs/pictures/studio_*.png."""
    with tempfile.TemporaryDirectory() as home:
        machines = Path(home) / "leafcut" / "studio" / "machines"
        machines.mkdir(parents=True)
        (machines / "router.toml").write_text(ROUTER, encoding="utf-8")
        command = [sys.executable, "-m", "leafcut", "studio", "--no-open", "--port", "8399"]
        environment = {**os.environ, "XDG_DATA_HOME": home}
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        try:
            assert server.stdout is not None
            found = re.search(r"http\S+", server.stdout.readline())
            assert found is not None, "the studio did not start"
            take(found.group(0))
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(30)


def take(address: str) -> None:
    """Open each state and take its screenshot."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light", locale="en-US")
        page.set_default_timeout(LONG)
        page.goto(address)
        page.wait_for_selector("#view-work")
        chosen = sys.argv[1:]
        if "machine" not in chosen:
            solids(page)
        if "solid" not in chosen:
            machine(page)
        if chosen:
            browser.close()
            return
        page.goto(page.url.partition("?")[0])
        run(page, EXAMPLES / "plate_70.dxf")
        shot(page, "result")
        nest(page)
        browser.close()


@contextmanager
def router() -> Iterator[str]:
    """Yield the port of the simulated board, which is set up as a router."""
    sys.path += [str(ROOT), str(ROOT / "tests")]
    from grbl_board import SETTINGS, set_up

    # Soft limits come last, because they require homing, which is set before.
    settings = {**{k: v for k, v in SETTINGS.items() if k != 20}, **STORED, 20: 1}
    with tempfile.TemporaryDirectory() as folder, set_up(Path(folder), settings, (-380, -390, -60)) as board:
        yield board.port


def machine(page: Page) -> None:
    """Drill a plate on a GRBL board, hole by hole."""
    with router() as port:
        page.goto(page.url.partition("?")[0])
        page.set_input_files("#open-file", EXAMPLES / "plate_27.dxf")
        page.locator(".about-part .name", has_text="plate_27.dxf").wait_for()
        page.get_by_label("Machine", exact=True).first.select_option("mine:router")
        fill(page, "Thickness", "6")
        page.get_by_role("button", name="Run", exact=True).click()
        page.locator(".headline").wait_for(timeout=LONG)
        page.keyboard.press("6")
        page.locator("#machine-port").fill(port)
        press(page, "Connect")
        page.locator("#machine-jog-feed").fill("6000")
        for step, key in (("100 mm", "X−"), ("100 mm", "X−"), ("100 mm", "Y−"), ("10 mm", "Z−")):
            page.get_by_role("button", name=step, exact=True).click()
            page.get_by_role("button", name=key, exact=True).click()
            page.wait_for_timeout(1000)
            page.locator("#view-control .tag", has_text="Idle").wait_for()
        drill(page)
        page.keyboard.press("Escape")
        press(page, "Disconnect")
        page.locator("#machine-port").wait_for()
        page.keyboard.press("1")


def drill(page: Page) -> None:
    """Drill eight holes one by one, continue to the end, then hold."""
    page.locator("#view-control").get_by_text("Hole by hole").click()
    press(page, "Start")
    press(page, "Start the machine")
    press(page, "Go on")  # the tool is in the spindle
    for hole in range(1, 9):
        press(page, f"Drill hole {hole}")
    page.get_by_role("button", name="Drill hole 9", exact=True).wait_for()
    shot(page, "machine_step")
    press(page, "Go on to the end")
    page.wait_for_timeout(4000)
    press(page, "Hold")
    page.get_by_role("button", name="Resume", exact=True).wait_for()


def press(page: Page, name: str) -> None:
    """Press a button on the Control page."""
    page.locator("#view-control").get_by_role("button", name=name, exact=True).click()


def run(page: Page, file: Path) -> None:
    """Open the drawing of a plate and run it."""
    page.set_input_files("#open-file", file)
    page.locator(".about-part .name", has_text=file.name).wait_for()
    page.wait_for_timeout(500)
    fill(page, "Thickness", "0.25in")
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("#result-panel", timeout=LONG)


def solids(page: Page) -> None:
    """Show stock in three dimensions, for an opened program and for a part that is not flat."""
    page.wait_for_timeout(2500)
    page.wait_for_function("window.did_handshake")
    relief = {"name": "relief.nc", "mimeType": "text/plain", "buffer": carved().encode()}
    page.set_input_files("#open-file", relief)
    page.locator(".about-part .name", has_text="relief.nc").wait_for()
    page.get_by_role("radio", name="Solid", exact=True).click()
    at(page, 0.74)
    shot(page, "solid")
    surface(page)
    page.get_by_role("radio", name="Plan", exact=True).click()


def surface(page: Page) -> None:
    """Drill a part that is not flat, held by two clamps, with tools whose holders are known."""
    page.goto(page.url.partition("?")[0])
    table = {"name": "holes.csv", "mimeType": "text/csv", "buffer": holes_csv().encode()}
    page.set_input_files("#open-file", table)
    page.locator(".about-part .name", has_text="holes.csv").wait_for()
    page.locator(".works input[value=drill]").check()
    folded = page.locator("form details:not([open]) > summary, .form details:not([open]) > summary")
    while folded.count():
        folded.first.click()
    put(page, "Surface", "cover.stl", part_stl())
    put(page, "Tool library", "shop.toml", HELD.encode())
    fill(page, "Depth", "through")
    fill(page, "Fixtures", ", ".join(FIXTURES))
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("#result-panel", timeout=LONG)
    page.get_by_role("tab", name="Program").click()
    at(page, 0.42)
    shot(page, "solid_surface")


def put(page: Page, label: str, name: str, data: bytes) -> None:
    """Choose a file for a field."""
    place = page.get_by_label(re.compile(f"^{label}: "), exact=False).and_(page.locator("input[type=file]"))
    place.set_input_files({"name": name, "mimeType": "application/octet-stream", "buffer": data})
    page.get_by_text(name).first.wait_for(state="attached")


def at(page: Page, share: float) -> None:
    """Move to a share of the program's time, and wait until the stock has been cut up to it."""
    slider = page.locator(".lc-player .lc-slider")
    slider.evaluate("(e, share) => { e.value = 10000 * share; e.dispatchEvent(new Event('input')); }", share)
    page.wait_for_timeout(500)
    page.locator(".lc-busy").wait_for(state="hidden")
    slider.evaluate("e => e.blur()")


def carved() -> str:
    """Return a program that carves waves with a ball mill and cuts a ring around them; comments describe its tools."""
    rows = ["(T1 D=6. CR=3. - ball end mill)", "(T2 D=5. CR=0. - flat end mill)", "G21 G90 G94 G17", "G0 Z10"]
    rows += ["T1 M6", "S12000 M3", "G0 X0 Y0"]
    for k in range(201):
        xs = [0.8 * i for i in range(151)]
        for x in xs if k % 2 == 0 else reversed(xs):
            y = 0.45 * k
            away = math.hypot(x - 60.0, y - 45.0)
            z = -5.0 + 2.6 * math.cos(0.22 * away) * math.exp(-away / 60.0) - 0.9 * math.sin(0.05 * x)
            rows.append(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F{2400 if z > -5.0 else 1500}")
    rows += ["G0 Z10", "T2 M6", "S14000 M3", "G0 X8 Y45", "G0 Z2"]
    for z in (-5.0, -9.0):
        rows += [f"G1 Z{z} F300", "G2 X8 Y45 I52 J0 F900"]
    return "\n".join([*rows, "G0 Z10", "M30", ""])


def nest(page: Page) -> None:
    """Nest three parts, and compare the cuts of the nests."""
    page.goto(page.url.partition("?")[0])
    page.locator(".works input[value=nest]").check()
    page.wait_for_selector("#open-file[multiple]", state="attached")
    parts = [{"name": name, "mimeType": "image/svg+xml", "buffer": svg(*part).encode()} for name, part in PARTS.items()]
    page.set_input_files("#open-file", parts)
    for name, pieces in (("bracket.svg", "14"), ("ring.svg", "5"), ("gusset.svg", "24")):
        fill(page, f"Quantity: {name}", pieces)
    fill(page, "Sheet", "1000x1000")
    page.get_by_label("Search effort", exact=True).select_option("fast")
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("table.nests", timeout=LONG)
    page.locator(".cuts").get_by_label("Thickness", exact=True).fill("6")
    page.keyboard.press("Tab")
    page.get_by_role("button", name="Plan all and compare").click()
    page.wait_for_selector(".nests .best", timeout=2 * LONG)
    page.locator(".result .scrolls").evaluate("e => e.scrollTo(0, 0)")
    shot(page, "nest")
    page.locator(".works input[value=cut]").check()


def fill(page: Page, label: str, text: str) -> None:
    """Type into a field, and leave the field."""
    page.get_by_label(label, exact=True).fill(text)
    page.keyboard.press("Tab")


def svg(width: int, height: int, body: str) -> str:
    """Return a drawing of a part, in mm."""
    size = f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}><g fill="none" stroke="black">{body}</g></svg>'


def shot(page: Page, name: str) -> None:
    """Take a screenshot once everything is drawn."""
    page.mouse.move(640, 8)
    page.wait_for_timeout(1500)
    page.screenshot(path=PICTURES / f"studio_{name}.png")


if __name__ == "__main__":
    main()
