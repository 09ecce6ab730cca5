"""The studio as a process: its address, its refusals, and its end."""

from __future__ import annotations

import re
import socket
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx2
import pytest
from studio_server import PATIENCE, Server, running
from waiting import until
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.files.whole_files import OutputError
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.task import Task
from leafcut.studio.server.app import StudioError, _open_socket, lock_folder, parse_port, serve
from leafcut.studio.studio import open_studio


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Return a running studio."""
    with running(tmp_path_factory.mktemp("home"), first="") as started:
        yield started


def test_the_page_is_served_to_the_browser_that_opens_the_address(server: Server) -> None:
    with httpx2.Client(base_url=server.origin, follow_redirects=True, timeout=PATIENCE) as client:
        assert client.get("/").status_code == 401
        client.cookies.update(server.cookies())
        page = client.get("/")
        assert page.status_code == 200
        assert page.url.path == "/"
        assert not [key for key in (server.key, server.token) if key in str(page.url) + page.text]
        policy = page.headers["content-security-policy"]
        nonce = policy.partition("'nonce-")[2].partition("'")[0]
        tags = re.findall(r"<(?:script|style)[ >][^>]*>?", page.text)
        assert len(tags) > 5
        assert all(f'nonce="{nonce}"' in tag for tag in tags)
        assert not re.findall(r"(?:src|href)=[\"']?(?:https?:)?//", page.text)
        for address in re.findall(r'(?:src|href)="(/[^"]+)"', page.text):
            assert client.get(address).status_code == 200, address


def test_pages_and_websockets_are_closed_to_strangers(server: Server) -> None:
    address = f"ws://127.0.0.1:{server.port}/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    for origin in (server.origin, "http://evil.example", None):
        with pytest.raises(InvalidStatus):
            connect(address, origin=origin)
    cookie = "; ".join(f"{name}={value}" for name, value in server.cookies().items())
    with pytest.raises(InvalidStatus):
        connect(address, origin="http://evil.example", additional_headers={"cookie": cookie})
    with connect(address, origin=server.origin, additional_headers={"cookie": cookie}) as opened:
        assert str(opened.recv(timeout=PATIENCE)).startswith("0{")
    for path in ("/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/_nicegui/x", "/favicon.ico"):
        assert httpx2.get(server.origin + path, timeout=PATIENCE).status_code == 401


@pytest.mark.slow
def test_no_other_user_of_the_machine_can_read_a_key(tmp_path: Path) -> None:
    """The browser opens a file that only this user can read, and an address works once."""
    seen = tmp_path / "told"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {seen}.part && mv {seen}.part {seen}\n')
    browser.chmod(0o755)
    with running(tmp_path, "BROWSER", str(browser), first="") as started:
        until(seen.is_file)
        told = seen.read_text().strip()
        page = Path(told.removeprefix("file://"))
        assert told.startswith("file://")
        assert page.stat().st_mode & 0o077 == (page.parent / "token").stat().st_mode & 0o077 == 0
        key = re.search(r"token=([\w-]+)", page.read_text())
        assert key and key[1] not in (started.key, started.token)

        def answers(token: str) -> list[int]:
            """Return the status of two requests with a token."""
            address = f"{started.origin}/?token={token}"
            return [httpx2.get(address, timeout=PATIENCE).status_code for _ in range(2)]

        assert answers(key[1]) == [303, 401]
        assert not page.exists()
        assert answers(started.key) == [303, 401]
        status, out, _ = started.end()
    assert status == 0
    assert re.fullmatch(rf"leafcut studio, for another browser: {started.origin}/\?token=[\w-]+\n", out)
    assert started.key not in out
    assert not (page.parent / "token").exists()


def test_the_studio_listens_on_the_loopback_address_alone(server: Server) -> None:
    others = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}
    for address in others | {"127.0.0.2"}:
        with socket.socket() as caller:
            caller.settimeout(2)
            assert caller.connect_ex((address, server.port)) != 0


def test_a_port_in_use_is_refused_in_one_line(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    assert run(["studio", "--no-open", "--port", str(server.port)]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(rf"leafcut: port {server.port} cannot be used \(.+\); choose another with --port\n", err)


def test_without_port_the_studio_uses_a_free_one(server: Server) -> None:
    with _open_socket(None) as first, _open_socket(None) as second:
        assert first.getsockname()[0] == second.getsockname()[0] == "127.0.0.1"
        assert first.getsockname()[1] != second.getsockname()[1]
    with pytest.raises(StudioError, match="cannot be used"):
        _open_socket(server.port)


@pytest.mark.parametrize("word", ["0", "65536", "x", "-1", "80.5", ""])
def test_a_wrong_port_is_refused(word: str) -> None:
    with pytest.raises(OptionError, match="--port"):
        parse_port(word)


def test_ctrl_c_ends_the_studio_and_marks_its_jobs_as_interrupted(tmp_path: Path) -> None:
    """Two jobs run and one waits when Ctrl-C comes."""
    with running(tmp_path, first="") as started:
        headers = {"authorization": f"Bearer {started.token}"}
        client = httpx2.Client(base_url=started.origin, headers=headers, timeout=PATIENCE)
        body = {"source": "random:300:1", "options": '{"time_limit": "300s", "bound": false}'}
        with ThreadPoolExecutor(3) as asking:
            for _ in range(3):
                asking.submit(client.post, "/api/solve", data=body, timeout=PATIENCE)
            states = ["running", "running", "waiting"]
            until(lambda: sorted(job["state"] for job in client.get("/api/jobs").json()["jobs"]) == states)
            status, out, error = started.end()
        client.close()
    assert status == 0
    assert out == ""
    assert error == "leafcut: Ctrl-C ends it\n"
    again = open_studio(started.folder)
    assert {job.state for job in again.history.newest()} == {JobState.INTERRUPTED}
    again.jobs.close()
    again.history.close()


@pytest.mark.slow
def test_the_studio_starts_with_a_damaged_folder_and_restores_a_removed_one(tmp_path: Path) -> None:
    root = tmp_path / "leafcut" / "studio"
    root.mkdir(parents=True)
    (root / "language").write_bytes(b"\xff\xfe")
    started = Server(tmp_path, first="")
    with httpx2.Client(base_url=started.origin, follow_redirects=True, timeout=PATIENCE) as client:
        assert client.get("/", params={"token": started.key}).status_code == 200
        answer = client.get("/api/nothing/here")
        assert (answer.status_code, list(answer.json())) == (404, ["error"])
        (root / "inputs").rmdir()
        headers = {"Authorization": f"Bearer {started.token}"}
        assert (
            client.post("/api/files", params={"name": "a.nc"}, content=b"G0 X1\n", headers=headers).status_code == 200
        )
    assert started.end()[0] == 0


def test_a_key_that_cannot_be_saved_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "key").mkdir()
    with pytest.raises(OutputError, match="cannot save the studio's key"):
        open_studio(tmp_path)


@pytest.mark.parametrize(
    ("missing", "told"),
    [
        ("uvicorn", "the studio needs the package uvicorn: pip install 'leafcut[studio]'"),
        ("leafcut.studio.page.page_state", None),
    ],
)
def test_only_a_package_that_is_not_installed_is_reported_as_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, missing: str, told: str | None
) -> None:
    for name in [n for n in sys.modules if n == missing or n.startswith("leafcut.studio.page")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(StudioError if told else ModuleNotFoundError, match=re.escape(told or missing)):
        serve(root=tmp_path)


def test_a_second_studio_on_the_same_folder_is_refused_in_one_line_and_the_first_keeps_its_jobs(tmp_path: Path) -> None:
    root = tmp_path / "studio"
    with lock_folder(root, "http://127.0.0.1:1234"):
        first = open_studio(root)
        first.history.add("j", "plate", Task("optimize", ("example:plate-10",)), 0.0)
        with pytest.raises(
            OutputError, match=r"a studio is already running at http://127\.0\.0\.1:1234; use that one, or stop it"
        ):
            serve(port=None, open_page=False, root=root)
        waiting = first.history.get("j")
        assert waiting is not None and waiting.state is JobState.WAITING
        first.history.close()
    with lock_folder(root, "http://127.0.0.1:99"):  # released when the first studio ended
        pass


def test_a_folder_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "studio").write_text("a file")
    with (
        pytest.raises(OutputError, match="cannot write to the studio's folder"),
        lock_folder(tmp_path / "studio", "http://127.0.0.1:1234"),
    ):
        pass
