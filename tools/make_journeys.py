"""Take screenshots of six journeys through the studio on laptop, desktop and phone screens.

    python tools/make_journeys.py [JOURNEY …] [--to docs/pictures/journeys] [--dark]

The exit status is 1 if axe reports a serious problem, or if a page is wider than its window.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Page, expect, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studio"))
from journeys import JOURNEYS
from studio_page import LONG, at_rest, serious, steady
from studio_server import Server, running

JOURNEY_PICTURES = Path(__file__).parents[1] / "docs" / "pictures" / "journeys"
#: Name → width, height and scale of the window. At a zoom of 200 %, 1280 pixels become 640.
SIZES = {"1280": (1280, 720, 1), "1920": (1920, 1080, 1), "390": (390, 844, 2), "zoomed": (640, 360, 2)}
#: Sizes with screenshots; axe checks all sizes.
KEPT = ("1280", "1920", "390")
REST = "() => document.querySelector('.studio').innerText.length + ' ' + document.querySelectorAll('.studio *').length"
WIDTH = "() => document.documentElement.scrollWidth - innerWidth"


def main() -> int:
    """Run the journeys; return 1 if a page has an accessibility problem."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("journeys", nargs="*", default=list(JOURNEYS))
    parser.add_argument("--to", type=Path, default=JOURNEY_PICTURES)
    parser.add_argument("--sizes", default=",".join(SIZES))
    parser.add_argument("--dark", action="store_true")
    parser.add_argument("--no-axe", action="store_true", help="pictures alone")
    asked = parser.parse_args()
    asked.to.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=LONG)
    faults: list[object] = []
    with tempfile.TemporaryDirectory() as home, running(Path(home)) as server, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"]
        )
        for name in asked.journeys:
            for size in asked.sizes.split(","):
                faults += go(browser, server, name, size, asked)
    for fault in faults:
        print(fault)
    return 1 if faults else 0


def go(browser: Browser, server: Server, name: str, size: str, asked: argparse.Namespace) -> list[object]:
    """Run one journey at one size, and return the accessibility problems."""
    width, height, scale = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height},
        device_scale_factor=scale,
        locale="en-US",
        bypass_csp=True,
        color_scheme="dark" if asked.dark else "light",
    )
    server.let_in(context)
    page: Page = context.new_page()
    page.goto(server.origin)
    page.wait_for_selector("#view-work")
    faults: list[object] = []
    number = 0

    def at(station: str) -> None:
        nonlocal number
        number += 1
        where = f"{name}_{number}_{station}_{size}"
        steady(page, REST)
        at_rest(page)
        if size in KEPT:
            page.screenshot(path=asked.to / f"{where}.png")
        if not asked.no_axe:
            faults.extend(serious(page, where))  # checked in light and dark mode
            page.emulate_media(color_scheme="dark" if asked.dark else "light")
        if page.evaluate(WIDTH) > 0:
            faults.append((where, "wider than its window", page.evaluate(WIDTH)))

    JOURNEYS[name](page, at)
    context.close()
    return faults


if __name__ == "__main__":
    sys.exit(main())
