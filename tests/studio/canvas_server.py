"""A page with the studio's drawing, backed only by files and scenes, and a browser for it."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import nicegui.elements.scene

from leafcut.studio.server.routes import colours_css
from leafcut.studio.wording import words

HERE = Path(__file__).parent
STATIC = HERE.parents[1] / "src" / "leafcut" / "studio" / "static"
#: Where NiceGUI has three.js.
THREE = Path(nicegui.elements.scene.__file__).parent / "dist"
_TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html; charset=utf-8"}
#: What no test looks at. Every window makes the list of its address bar ready, a page of its own: 0.9 s of work.
#: The last switch of this kind holds, so what Playwright leaves out that changes how a page behaves is named again.
_WITHOUT = "--disable-features=" + ",".join(
    [
        *("WebUIOmniboxPopup", "WebUIOmniboxAimPopup", "WebUIOmniboxFullPopup"),
        *("AvoidCorsURLLoaderRestartOnRedirect", "AvoidUnnecessaryBeforeUnloadCheckSync", "HttpsUpgrades"),
        *("DestroyProfileOnBrowserClose", "HttpsFirstBalancedModeAutoEnable", "LensOverlay", "MediaRouter"),
        *("NetworkTimeServiceQuerying", "OptimizationHints", "PaintHolding", "PreconnectToSearch"),
        *("ThirdPartyStoragePartitioning", "TcpPortRandomizationWin", "AimEnabled"),
    ]
)


#: Warnings of Chromium without a GPU, which reads every picture of WebGL back from its software driver.
READS_BACK = ("getImageData", "GPU stall due to ReadPixels")


@contextmanager
def serving(scenes: Mapping[str, bytes]) -> Iterator[str]:
    """Serve the page on a free port of 127.0.0.1, scenes by name as ``plate.after``; yield its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body, kind = _answer(self.path.split("?")[0], scenes)
            self.send_response(200 if body is not None else 404)
            self.send_header("Content-Type", kind)
            self.end_headers()
            self.wfile.write(body or b"")

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _answer(path: str, scenes: Mapping[str, bytes]) -> tuple[bytes | None, str]:
    folder, _, name = path.lstrip("/").rpartition("/")
    if folder == "scene":
        return scenes.get(name), "application/octet-stream"
    if name == "colours.css":
        return colours_css().encode(), "text/css"
    if name == "words.json":
        return json.dumps(words("en").section("canvas")).encode(), "application/json"
    page = {"": "canvas_page.html", "page.js": "canvas_page.js"}
    file = {"static": STATIC / name, "three": THREE / name}.get(folder, HERE / page.get(name, "none"))
    return (file.read_bytes() if file.is_file() else None), _TYPES.get(file.suffix, "text/plain")


def until(page: Any, condition: str) -> None:
    """Wait until a condition holds in the page, minutes at most; not by eval, which its policy forbids."""
    for _ in range(12_000):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"never: {condition}")


def loaded(page: Any, address: str) -> list[str]:
    """Open the page of drawings; return the list of errors on it, which grows as they occur."""
    wrong: list[str] = []
    page.on(
        "console",
        lambda m: None if m.type == "log" or any(map(m.text.__contains__, READS_BACK)) else wrong.append(m.text),
    )
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: request.url.startswith((address, "data:")) or wrong.append(request.url))
    page.goto(address)
    until(page, "window.loaded")
    return wrong


@contextmanager
def browser(program: str) -> Iterator[Any]:
    """Start Chromium without a screen and without a GPU; yield Playwright's browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu", _WITHOUT])
        try:
            yield launched
        finally:
            launched.close()
