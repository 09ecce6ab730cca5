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
#: A run, ms.
LONG = 120_000


def main() -> None:
    """Write docs/pictures/studio_empty.png, studio_result.png, studio_program.png and studio_dark.png."""
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


def shot(page: Page, name: str) -> None:
    """Take a picture when all is drawn."""
    page.mouse.move(640, 8)
    page.wait_for_timeout(1500)
    page.screenshot(path=PICTURES / f"studio_{name}.png")


if __name__ == "__main__":
    main()
