"""A studio in a folder of its own, and ways to speak to it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from leafcut.studio.app import PORT, Studio, guarded, make_api, open_studio

PLATE = Path(__file__).parents[2] / "examples" / "plate_10.dxf"


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[Studio]:
    """Return a studio that nobody has used; its runs are ended with the test."""
    opened = open_studio(tmp_path / "studio")
    yield opened
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
    stranger.headers["authorization"] = f"Bearer {studio.token}"
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
