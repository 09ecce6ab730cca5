"""The drawing as an element of a NiceGUI page, in Chromium."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from canvas_server import until

HERE = Path(__file__).parent
INK = """() => {
  const canvas = [...document.querySelectorAll(".lc-canvas")].pop();
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let orange = 0;
  for (let k = 0; k < data.length; k += 4) if (data[k] > 180 && data[k + 1] < 120 && data[k + 2] < 80) orange++;
  return orange;
}"""


@pytest.fixture(scope="module")
def served() -> Iterator[str]:
    """Return the address of a NiceGUI page in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    # NiceGUI would take the page for one of its own tests.
    around = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    run = subprocess.Popen(
        [sys.executable, str(HERE / "canvas_app.py"), str(port)], stdout=subprocess.DEVNULL, env=around
    )
    try:
        for _ in range(2400):
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                break
            except OSError:
                assert run.poll() is None, "the page's process ended"
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}/"
    finally:
        run.terminate()
        run.wait(120)


def test_scenes_are_fetched_shown_chosen_in_and_taken_off(served: str, browser: Any) -> None:
    with browser.new_page() as page:
        wrong: list[str] = []
        page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda r: r.url.startswith((served, served.replace("http", "ws"))) or wrong.append(r.url))
        page.goto(served)
        until(page, "document.querySelectorAll('.lc-canvas').length === 2")
        until(page, f"({INK})() > 100")
        page.click("#choose")
        until(page, "/^1: .*'line': 5/.test(document.querySelector('#said').innerText)")
        until(page, "document.querySelector('.lc-selected')?.dataset.line === '5'")
        # Clearing by the studio sends no event: it would arrive late and clear a newer selection.
        page.click("#deselect")
        until(page, "!document.querySelector('.lc-selected')")
        page.click("#choose")
        until(page, "/^2: .*'line': 5/.test(document.querySelector('#said').innerText)")
        page.click("#clear")
        until(page, f"({INK})() === 0")
        assert wrong == []
