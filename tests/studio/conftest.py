"""A studio in a folder of its own, and ways to speak to it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from starlette.testclient import TestClient

from grbl_board import board, patient, running
from leafcut.studio.server.app import guarded, make_api
from leafcut.studio.studio import PORT, Studio, open_studio

__all__ = ["board", "patient", "running"]

PLATE = Path(__file__).parents[2] / "examples" / "plate_10.dxf"


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[Studio]:
    """Return a studio that nobody has used; its runs are ended with the test."""
    opened = open_studio(tmp_path / "studio")
    yield opened
    opened.machine.close()
    opened.jobs.close()
    opened.history.close()


@pytest.fixture
def stranger(studio: Studio) -> TestClient:
    """Return a client that has no token."""
    app = guarded(studio, make_api(studio), largest=200_000)
    return TestClient(app, base_url=f"http://127.0.0.1:{PORT}", follow_redirects=False, raise_server_exceptions=False)


@pytest.fixture
def client(studio: Studio, stranger: TestClient) -> TestClient:
    """Return a program that sends the token in its header."""
    stranger.headers["authorization"] = f"Bearer {studio.keys.token}"
    return stranger


@pytest.fixture(scope="session")
def chromium() -> str:
    """Return the path of Debian's Chromium; skip without it, or fail where it is required."""
    program = shutil.which("chromium")
    if program is None:
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail("chromium is required here: apt-get install chromium")
        pytest.skip("chromium is not installed")
    return program


@pytest.fixture(scope="session")
def browser(chromium: str) -> Iterator[Any]:
    """Return Playwright's browser, one for all tests: every test has pages of its own."""
    from canvas_server import browser as launched
    from playwright.sync_api import expect
    from studio_page import LONG

    # A studio that has just begun loads what it reads its first file with, and its first run may have to compile: on a
    # busy machine much longer than the usual 5 s. What is waited for here is seen to come, however long it takes.
    expect.set_options(timeout=LONG)
    with launched(chromium) as opened:
        yield opened


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Return a studio in a process of its own, one for all tests that change nothing of it for others."""
    from studio_server import running

    with running(tmp_path_factory.mktemp("home")) as started:
        yield started


@pytest.fixture(scope="session")
def context(browser: Any, server: Any) -> Iterator[Any]:
    """Return what all pages share that `page` returns: the scripts of the page are fetched and compiled once."""
    from studio_page import LONG

    made = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", accept_downloads=True)
    made.set_default_timeout(LONG)
    yield made
    made.close()


@pytest.fixture
def page(context: Any, server: Any) -> Iterator[Any]:
    """Return a page of the studio; in the end nothing may have been complained of, nor asked of another host."""
    from playwright.sync_api import Error, expect

    complaints: list[str] = []
    asked: list[str] = []
    server.speak_as_the_browser()
    made = context.new_page()
    try:
        _as_never_used(made, server)
        made.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
        made.on("pageerror", lambda e: complaints.append(str(e)))
        made.on("request", lambda r: asked.append(r.url))
        try:
            made.goto(server.origin)
        except Error as problem:
            pytest.fail(f"the studio does not answer ({problem})\n{server.standing()}")
        expect(made.locator("#view-work")).to_be_visible()
        # What is done before that reaches the studio afterwards, and not always in its order.
        made.wait_for_function("window.did_handshake")
        yield made
    finally:
        for one in context.pages:  # a test may have opened more
            one.close()
    assert complaints == []
    assert server.complained() == ""
    assert {urlsplit(url).netloc for url in asked if not url.startswith(("data:", "blob:"))} == {
        f"127.0.0.1:{server.port}"
    }


def _as_never_used(page: Any, server: Any) -> None:
    """Forget all that earlier tests left in the browser but the files that the page is made of."""
    context = page.context
    context.clear_cookies()
    context.clear_permissions()
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    server.let_in(context)
    session = context.new_cdp_session(page)
    kinds = "local_storage,indexeddb,cache_storage,service_workers,websql,file_systems"
    session.send("Storage.clearDataForOrigin", {"origin": server.origin, "storageTypes": kinds})
    session.detach()
