"""A studio in its own folder, and functions to call it."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from starlette.testclient import TestClient

from grbl_board import board, patient, running
from leafcut.studio.jobs.workers import StudioWorkers
from leafcut.studio.server.app import build_api, guard_app, open_with_rooms
from leafcut.studio.studio import PORT, Studio
from outside_programs import program_path

__all__ = ["board", "patient", "running"]

PLATE = Path(__file__).parents[2] / "examples" / "plate_10.dxf"


class SharedWorkers(StudioWorkers):
    """Processes for many studios: the end of a studio does not end them."""

    def close(self) -> None:
        """Do nothing."""


@pytest.fixture(scope="session")
def search_path() -> Iterator[None]:
    """Let other processes find the modules in this folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)
        yield


@pytest.fixture(scope="session")
def workers(tmp_path_factory: pytest.TempPathFactory, search_path: None) -> Iterator[StudioWorkers]:
    """Return processes for the jobs of all tests that cancel none.

    The processor time of a process counts for the case in which it ends, so these end after all cases.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("leafcut.studio.jobs.workers._LONG_SECONDS", math.inf)
        opened = SharedWorkers(tmp_path_factory.mktemp("work"), spare=False)
        yield opened
        StudioWorkers.close(opened)


@pytest.fixture
def studio(tmp_path: Path, workers: StudioWorkers) -> Iterator[Studio]:
    """Return a studio that nobody has used; its runs are ended with the test."""
    opened = open_with_rooms(tmp_path / "studio", workers=workers)
    yield opened
    opened.rooms["control"].close()
    opened.jobs.close()
    opened.history.close()


@pytest.fixture
def own_studio(tmp_path: Path, search_path: None) -> Iterator[Studio]:
    """Return a studio with processes of its own, which a test may kill, and which find the packages it installs."""
    opened = open_with_rooms(tmp_path / "own", workers=StudioWorkers(tmp_path / "work", spare=False))
    yield opened
    opened.close()
    opened.history.close()


@pytest.fixture
def stranger(studio: Studio) -> TestClient:
    """Return a client that has no token."""
    app = guard_app(studio, build_api(studio), largest=200_000)
    return TestClient(app, base_url=f"http://127.0.0.1:{PORT}", follow_redirects=False, raise_server_exceptions=False)


@pytest.fixture
def client(studio: Studio, stranger: TestClient) -> TestClient:
    """Return a program that sends the token in its header."""
    stranger.headers["authorization"] = f"Bearer {studio.keys.token}"
    return stranger


@pytest.fixture(scope="session")
def chromium() -> str:
    """Return the path of Chromium: the shell without windows if it is installed, since it loads pages faster."""
    return shutil.which("chromium-headless-shell") or program_path("chromium", "chromium")


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
    """Return a studio in its own process, shared by all tests that do not change it for others."""
    from studio_server import running

    with running(tmp_path_factory.mktemp("home")) as started:
        yield started


@pytest.fixture
def page(browser: Any, server: Any) -> Iterator[Any]:
    """Return a page of the studio; in the end nobody may have complained, nor asked another host."""
    from canvas_server import READS_BACK
    from playwright.sync_api import Error
    from studio_page import LONG, loaded

    complaints: list[str] = []
    asked: list[str] = []
    server.speak_as_the_browser()
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US", accept_downloads=True)
    try:
        context.set_default_timeout(LONG)
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        server.let_in(context)
        made = context.new_page()
        made.on("console", lambda m: m.type in ("error", "warning") and complaints.append(m.text))
        made.on("pageerror", lambda e: complaints.append(str(e)))
        made.on("request", lambda r: asked.append(r.url))
        try:
            made.goto(server.origin)
        except Error as problem:
            pytest.fail(f"the studio does not answer ({problem})\n{server.standing()}")
        loaded(made)
        yield made
    finally:
        context.close()
    assert [text for text in complaints if not any(map(text.__contains__, READS_BACK))] == []
    assert server.complained() == ""
    assert {urlsplit(url).netloc for url in asked if not url.startswith(("data:", "blob:"))} == {
        f"127.0.0.1:{server.port}"
    }
