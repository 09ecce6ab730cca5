"""The studio's page in headless Chromium beside that of an earlier state: first paint, opening a file, and a run.

    git worktree add ../leafcut-0.1.0 COMMIT
    python benchmarks/studio_opening.py --against ../leafcut-0.1.0 [--rounds 7] [--write docs/benchmarks.md]

Both states are started anew for each round, in turn, and each file is opened on a page of its own. Seconds are medians
by the clock, from the browser's or this program's; processor seconds are those of the studio's process alone, which
hardly depend on what else the machine does. It is checked that both show as many holes and that each run is verified.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from page import facts, table, write_section
from playwright.sync_api import Browser, Page, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studio"))
from studio_server import Server, running

ROOT = Path(__file__).parents[1]
#: Files that are opened, and whether they are run, too: the others open as other work in other states.
OPENED = {
    "plate_70.dxf": True,
    "cam_121.nc": True,
    "board of 1,720 holes": False,
    "sheet.dxf": False,
    "pocket.dxf": False,
}
PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
THERE = "() => performance.getEntriesByType('navigation')[0].domContentLoadedEventEnd"
NAMED = "(name) => document.querySelector('.about-part .name')?.textContent === name"
OVER = "() => document.querySelector('#result-panel') && document.querySelector('.headline')"
VERIFIED = "() => /^Verified/.test(document.querySelector('.badge')?.textContent ?? '')"

#: What was measured → seconds, round by round.
Figures = dict[str, list[float]]


def main(arguments: Sequence[str]) -> None:
    """Measure both states in turn, and show what each takes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--against", type=Path, required=True, metavar="CHECKOUT", help="a checkout of the earlier state"
    )
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="the page whose section on this is written")
    given = parser.parse_args(arguments)
    found: dict[Path, Figures] = {given.against.resolve(): {}, ROOT: {}}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        files = [ROOT / "examples" / name for name in OPENED if "." in name]
        files.insert(2, board(Path(folder) / "board.csv", 1720))
        browser = playwright.chromium.launch(executable_path=given.chromium, args=["--no-sandbox", "--disable-gpu"])
        for number in range(given.rounds):
            for checkout in list(found)[:: 1 if number % 2 else -1]:
                os.environ["PYTHONPATH"] = str(checkout / "src")
                with running(Path(folder) / f"home {number} {checkout.name}") as server:
                    one_round(browser, server, files, found[checkout])
    earlier, now = ({what: statistics.median(one) for what, one in figures.items()} for figures in found.values())
    rows = [(what, f"{earlier[what]:.3f}", f"{now[what]:.3f}", f"{now[what] / earlier[what]:.2f}") for what in now]
    told = table(("note", "earlier, s", "now, s", "ratio"), rows)
    print(told)
    if given.write:
        about = f"""## The page of the studio

The studio beside that of version 0.1.0 in headless Chromium, both in turn; medians of {given.rounds} rounds. "First
paint" is the browser's first contentful paint, which is the page's bar now, and was the whole page; the page is there
when its elements are. A file is open when its name stands over what is known of it,
and a run is over when its summary stands there. Processor seconds are those of the studio's
process.

{told}

{facts("studio_opening", arguments, ("nicegui", "playwright"))}
"""
        write_section(given.write, "studio_opening", about)


def board(file: Path, holes: int) -> Path:
    """Write a board of so many holes of four diameters, and return its file."""
    rng = np.random.default_rng(11)
    places, widths = rng.uniform((0, 0), (300, 200), (holes, 2)).round(3), rng.choice((0.6, 0.8, 1.0, 3.0), holes)
    rows = [f"{x},{y},{width}" for (x, y), width in zip(places.tolist(), widths.tolist(), strict=True)]
    file.write_text("\n".join(["x,y,diameter", *rows, ""]))
    return file


def one_round(browser: Browser, server: Server, files: Sequence[Path], figures: Figures) -> None:
    """Open every file on a page of its own, the first page unmeasured, as it loads what all have in common."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US")
    server.let_in(context)
    for number, file in enumerate((files[0], *files)):
        page = context.new_page()
        page.goto(server.origin)
        page.wait_for_selector("#view-work")
        page.wait_for_function(PAINT)
        into = figures if number else {}
        into.setdefault("page there", []).append(page.evaluate(THERE) / 1000.0)
        into.setdefault("first paint", []).append(page.evaluate(PAINT) / 1000.0)
        opening(page, server, file, into)
        page.close()
    context.close()


def opening(page: Page, server: Server, file: Path, figures: Figures) -> None:
    """Open a file, and run it where both states take it for the same work."""
    known = {"board.csv": "board of 1,720 holes"}.get(file.name, file.name)
    with Measured(server, f"{known}: opened", figures):
        page.set_input_files("#open-file", file)
        page.wait_for_function(NAMED, arg=file.name)
    if not OPENED[known]:
        return
    page.wait_for_timeout(500)  # a press that comes sooner is lost by 0.1.0
    with Measured(server, f"{known}: run", figures):
        page.get_by_role("button", name="Run", exact=True).click()
        page.wait_for_function(OVER)
    page.wait_for_function(VERIFIED)


class Measured:
    """Adds the seconds of a block, by the clock and of the studio's process."""

    def __init__(self, server: Server, what: str, figures: Figures) -> None:
        self._server, self._what, self._figures = server, what, figures

    def __enter__(self) -> None:
        self._began, self._used = time.perf_counter(), self._processor()

    def __exit__(self, *_: object) -> None:
        taken, used = time.perf_counter() - self._began, self._processor() - self._used
        self._figures.setdefault(self._what, []).append(taken)
        self._figures.setdefault(f"{self._what}, processor", []).append(used)

    def _processor(self) -> float:
        words = Path(f"/proc/{self._server.process.pid}/stat").read_text().rpartition(")")[2].split()
        return sum(int(word) for word in words[11:15]) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main(sys.argv[1:])
