"""Makes the pictures of the page on the studio from the running program, in a headless Chromium."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

HERE = Path(__file__).parent
PICTURES = HERE / "pictures"
EXAMPLES = HERE.parent / "examples"
#: Parts to be nested: name → width, height and what is drawn, mm.
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
#: A run, ms.
LONG = 120_000


def main() -> None:
    """Write docs/pictures/studio_empty.png, and so on: result, nest, program and dark."""
    with tempfile.TemporaryDirectory() as home:
        command = [sys.executable, "-m", "leafcut.cli", "studio", "--no-open", "--port", "8399"]
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
    """Go through the states and take their pictures."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light", locale="en-US")
        page.goto(address)
        page.wait_for_selector("#view-work")
        shot(page, "empty")
        run(page, EXAMPLES / "plate_70.dxf")
        shot(page, "result")
        nest(page)
        run(page, EXAMPLES / "cam_121.nc")
        page.get_by_role("tab", name="Program").click()
        shot(page, "program")
        page.keyboard.press("t")
        page.get_by_role("tab", name="Search").click()
        shot(page, "dark")
        browser.close()


def run(page: Page, file: Path) -> None:
    """Open a file and run it."""
    page.set_input_files("#open-file", file)
    page.locator(".about-part .name", has_text=file.name).wait_for()
    page.wait_for_timeout(500)
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("#result-panel", timeout=LONG)


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
    """Type into a field, and leave it."""
    page.get_by_label(label, exact=True).fill(text)
    page.keyboard.press("Tab")


def svg(width: int, height: int, body: str) -> str:
    """Return a drawing of a part, mm."""
    size = f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}><g fill="none" stroke="black">{body}</g></svg>'


def shot(page: Page, name: str) -> None:
    """Take a picture when all is drawn."""
    page.mouse.move(640, 8)
    page.wait_for_timeout(1500)
    page.screenshot(path=PICTURES / f"studio_{name}.png")


if __name__ == "__main__":
    main()
