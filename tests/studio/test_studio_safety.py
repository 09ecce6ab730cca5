"""The studio is for the person at this machine: who else comes, by whatever way, is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from leafcut.errors import OptionError
from leafcut.studio.folder import Folder, safe_name
from leafcut.studio.jobs.task import Task, resolve_task
from leafcut.studio.keys import COOKIE_SECONDS, StudioKeys
from leafcut.studio.server.app import build_api
from leafcut.studio.server.safety import Guard
from leafcut.studio.studio import PORT, STILL_POLICY, Studio, open_studio

OWN = f"http://127.0.0.1:{PORT}"


def test_no_route_answers_without_the_token(studio: Studio, stranger: TestClient) -> None:
    paths = build_api(studio).openapi()["paths"]
    assert len(paths) > 10
    for path, methods in paths.items():
        for method in methods:
            address = path.replace("{job}", "a" * 12).replace("{name}", "program")
            answer = stranger.request(method, address, headers={"origin": OWN})
            assert answer.status_code == 401, (method, path)
    for address in ("/", "/static/studio.css", "/static/colours.css", "/api/openapi.json", "/nothing"):
        assert stranger.get(address).status_code == 401


def test_a_wrong_token_is_no_token(studio: Studio, stranger: TestClient) -> None:
    token, key = studio.keys.token, studio.keys.new_entry()
    for wrong in ("", "x", key[:-1], key + "x", "Ä", token):
        assert stranger.get("/", params={"token": wrong}).status_code == 401
    for header in (f"Bearer {token}x", f"Basic {token}", "Bearer", f"Bearer {key}", studio.keys.new_cookie()):
        assert stranger.get("/api/machines", headers={"authorization": header}).status_code == 401
    assert stranger.get("/api/machines", headers={"cookie": f"leafcut-{PORT}={token}"}).status_code == 401
    assert stranger.get("/api/machines", headers={"cookie": 'a="; =;;\x7f'}).status_code == 401


def test_the_token_in_the_address_becomes_a_cookie_that_scripts_and_other_sites_do_not_have(
    studio: Studio, stranger: TestClient
) -> None:
    key = studio.keys.new_entry()
    answer = stranger.get("/", params={"token": key})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= {word.strip() for word in cookie.split(";")}
    assert key not in cookie
    assert stranger.get("/api/machines").status_code == 200  # the client has kept the cookie
    assert stranger.get("/api/machines", params={"token": "wrong"}).status_code == 200
    assert stranger.get("/", params={"token": key}).headers["location"] == "/"  # the same browser may come back by it
    stranger.cookies.clear()
    assert stranger.get("/", params={"token": key}).status_code == 401


def test_a_cookie_ends_and_a_page_that_is_loaded_has_it_anew() -> None:
    now = [1000.0]
    keys = StudioKeys(b"k" * 32, lambda: now[0])

    async def page(scope, receive, send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    client = TestClient(Guard(page, keys=keys, port=PORT), base_url=OWN, follow_redirects=False)
    client.get("/", params={"token": keys.new_entry()})
    first = client.cookies[f"leafcut-{PORT}"]
    now[0] += COOKIE_SECONDS - 1
    assert client.get("/api/x").status_code == 200
    assert client.get("/").status_code == 200
    now[0] += 2
    assert client.get("/").status_code == 200
    now[0] += COOKIE_SECONDS
    assert client.get("/").status_code == 401
    later = str(int(first.partition(".")[0]) + 10 * COOKIE_SECONDS)
    for wrong in (first, f"{later}.{first.partition('.')[2]}", "", ".", "x.y"):
        assert client.get("/", headers={"cookie": f"leafcut-{PORT}={wrong}"}).status_code == 401


def test_only_so_many_addresses_that_were_not_used_are_good() -> None:
    keys = StudioKeys(b"k" * 32)
    made = [keys.new_entry() for _ in range(20)]
    assert not keys.redeem_entry(made[0])
    assert keys.redeem_entry(made[-1])
    assert len({*made, keys.token}) == 21


@pytest.mark.parametrize("host", ["evil.example", f"evil.example:{PORT}", f"127.0.0.1:{PORT + 1}", "127.0.0.1", ""])
def test_a_name_that_was_rebound_to_this_machine_is_refused(client: TestClient, host: str) -> None:
    assert client.get("/api/machines", headers={"host": host}).status_code == 403
    assert client.get("/api/machines", headers={"host": f"localhost:{PORT}"}).status_code == 200


def test_two_host_headers_are_none(studio: Studio) -> None:
    client = TestClient(Guard(build_api(studio), keys=studio.keys, port=PORT), base_url=OWN)
    hosts = [("host", f"127.0.0.1:{PORT}"), ("host", "evil.example"), ("authorization", f"Bearer {studio.keys.token}")]
    assert client.get("/api/machines", headers=hosts).status_code == 403


@pytest.mark.parametrize(
    "origin", ["http://evil.example", f"http://127.0.0.1:{PORT + 1}", "null", f"https://127.0.0.1:{PORT}"]
)
def test_a_page_of_another_origin_can_neither_send_nor_load(studio: Studio, stranger: TestClient, origin: str) -> None:
    stranger.get("/", params={"token": studio.keys.new_entry()})
    assert stranger.post("/api/files?name=a.csv", content=b"x", headers={"origin": origin}).status_code == 403
    assert stranger.get("/api/machines", headers={"origin": origin}).status_code == 403
    assert not list(studio.folder.inputs.iterdir())


def test_what_sends_no_key_or_a_wrong_one_is_told_that_it_is_the_key(stranger: TestClient) -> None:
    for headers in ({}, {"authorization": "Bearer wrong"}, {"origin": OWN}):
        assert stranger.post("/api/files?name=a.csv", content=b"x", headers=headers).status_code == 401


def test_a_cookie_alone_changes_nothing_without_an_origin(studio: Studio, stranger: TestClient) -> None:
    stranger.get("/", params={"token": studio.keys.new_entry()})
    assert stranger.post("/api/files?name=a.csv", content=b"x").status_code == 403
    assert stranger.post("/api/files?name=a.csv", content=b"x", headers={"origin": OWN}).status_code == 200


def test_what_another_site_begins_is_refused_but_a_link_may_be_followed(studio: Studio, stranger: TestClient) -> None:
    stranger.get("/", params={"token": studio.keys.new_entry()})
    for site in ("cross-site", "same-site"):
        headers = {"sec-fetch-site": site, "sec-fetch-mode": "no-cors"}
        assert stranger.get("/api/machines", headers=headers).status_code == 403
    link = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    assert stranger.get("/", params={"token": studio.keys.new_entry()}, headers=link).status_code == 303


def test_a_websocket_needs_cookie_and_origin(studio: Studio) -> None:
    async def welcome(scope, receive, send) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        await send({"type": "websocket.close"})

    client = TestClient(Guard(welcome, keys=studio.keys, port=PORT), base_url=OWN)
    good = {"host": f"127.0.0.1:{PORT}", "origin": OWN, "cookie": f"leafcut-{PORT}={studio.keys.new_cookie()}"}
    with client.websocket_connect("/", headers=good):
        pass
    for name, value in (("cookie", ""), ("origin", "http://evil.example"), ("host", "evil.example")):
        with pytest.raises(WebSocketDisconnect), client.websocket_connect("/", headers={**good, name: value}):
            pass
    without = {name: value for name, value in good.items() if name != "origin"}
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/", headers=without):
        pass


def test_every_answer_forbids_frames_guessing_and_other_hosts(client: TestClient) -> None:
    for address in ("/api/machines", "/api/nothing", "/static/studio.css", "/static/nothing"):
        headers = client.get(address).headers
        policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
        assert policy["default-src"] == "'none'"
        assert policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == "'none'"
        assert "unsafe-inline" not in policy["script-src"] + policy["style-src"]
        assert not [
            word for rule in policy.values() for word in rule.split() if "//" in word and "127.0.0.1" not in word
        ]
        assert headers["x-frame-options"] == "DENY"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"


def test_scripts_and_styles_of_a_page_get_a_nonce_that_is_never_the_same() -> None:
    async def page(scope, receive, send) -> None:
        await send(
            {
                "type": "http.response.start",
                "status": 200,
                "headers": [(b"content-type", b"text/html"), (b"content-length", b"9")],
            }
        )
        await send({"type": "http.response.body", "body": b"<script>a</scr", "more_body": True})
        await send({"type": "http.response.body", "body": b"ipt><style>b</style><scripted>"})

    keys = StudioKeys(b"k" * 32)
    client = TestClient(
        Guard(page, keys=keys, port=PORT), base_url=OWN, headers={"authorization": f"Bearer {keys.token}"}
    )
    nonces = set()
    for _ in range(2):
        answer = client.get("/page")
        nonce = answer.headers["content-security-policy"].partition("'nonce-")[2].partition("'")[0]
        assert answer.text == f'<script nonce="{nonce}">a</script><style nonce="{nonce}">b</style><scripted>'
        assert int(answer.headers["content-length"]) == len(answer.content)
        nonces.add(nonce)
    assert len(nonces) == 2
    assert min(map(len, nonces)) >= 20


def test_an_upload_that_is_too_large_is_refused_with_a_line_and_leaves_nothing(
    studio: Studio, client: TestClient
) -> None:
    def pieces():
        for _ in range(30):
            yield b"x" * 10_000

    for body in (b"x" * 200_001, pieces()):  # the second does not say how long it is
        answer = client.post("/api/files?name=a.csv", content=body)
        assert answer.status_code == 413
        assert "larger than" in answer.text
        assert len(answer.text.splitlines()) == 1
    assert client.post("/api/optimize", files={"file": ("a.csv", b"x" * 300_000)}).status_code == 413
    assert not list(studio.folder.inputs.iterdir())
    assert client.post("/api/files?name=a.csv", content=b"x" * 200_000).json()["size"] == 200_000


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("plate.dxf", "plate.dxf"),
        ("../../etc/passwd", "passwd"),
        ("C:\\temp\\a b.nc", "a b.nc"),
        ("/", "file"),
        ("..", "file"),
        (".bashrc", "bashrc"),
        ("--report.html", "_report.html"),
        ("example:plate-70", "exampleplate-70"),
        ("a\nb\0c\u202e.nc", "abc.nc"),
        ("CON.txt", "_CON.txt"),
        ("Ñandú.dxf", "Ñandú.dxf"),
        ("x" * 500 + ".dxf", "x" * 156 + ".dxf"),
        ("名" * 500 + ".dxf", "名" * 52 + ".dxf"),
        ("x." + "y" * 500, "x." + "y" * 158),
    ],
)
def test_names_of_uploads_are_names_and_nothing_else(name: str, safe: str) -> None:
    assert safe_name(name) == safe


def test_nothing_that_a_page_sends_names_a_file_outside_the_studio(studio: Studio, tmp_path: Path) -> None:
    secret = tmp_path / "secret.toml"
    secret.write_text("x = 1")
    inside = studio.folder.add_input("map.csv", b"x,y\n1,2\n")
    for word in (str(secret), "../../secret.toml", "..", ".", "", "a" * 16, f"../inputs/{inside}", f"{inside}/map.csv"):
        with pytest.raises(OptionError):
            resolve_task(Task("optimize", (word,)), studio.folder)
        for option in ("tools", "chart", "plan"):
            if word:
                with pytest.raises(OptionError, match=f"--{option}"):
                    resolve_task(Task("optimize", (inside,), options={option: word}), studio.folder)
    for machine in (str(secret), "../secret.toml", "secret.toml", "mine:../../secret", "mine:absent", "/etc/passwd"):
        with pytest.raises(OptionError):
            resolve_task(Task("optimize", (inside,), options={"machine": machine}), studio.folder)
    with pytest.raises(OptionError, match="--save-plan"):
        resolve_task(Task("optimize", (inside,), "cut", {"save_plan": str(tmp_path / "out.toml")}), studio.folder)


@pytest.mark.parametrize("option", ["workpiece", "part"])
@pytest.mark.parametrize("word", ["/etc/passwd", "/etc/passwd.stl", "../part.step", "..\\part", "0,0,0,1,1,1/../x"])
def test_a_block_or_a_file_of_the_studio_and_no_path_passes(option: str, word: str, studio: Studio) -> None:
    """Options that take numbers or a file: numbers pass, a path of any ending does not."""
    inside = studio.folder.add_input("a.nc", b"G21 G90\nG0 X1\nM2\n")
    with pytest.raises(OptionError, match=f"--{option}: choose a file opened in the studio, not a path"):
        resolve_task(Task("optimize", (inside,), "mill", {option: word}), studio.folder)
    ready = resolve_task(Task("optimize", (inside,), "mill", {"workpiece": "0,0,-5,10,10,0"}), studio.folder)
    assert ready.options["workpiece"] == "0,0,-5,10,10,0"


def test_a_message_names_the_file_and_not_the_studios_folder(studio: Studio, client: TestClient) -> None:
    answer = client.post("/api/optimize", files={"file": ("../broken.dxf", b"\0\1\2")})
    assert answer.status_code == 422
    assert answer.json()["error"].startswith("broken.dxf: ")
    assert str(studio.folder.root) not in answer.text


def test_a_report_is_a_document_in_which_nothing_runs(studio: Studio, client: TestClient) -> None:
    data = {"source": "example:ten-points", "options": '{"depth": 3, "preset": "fast"}'}
    made = client.post("/api/optimize", data=data).json()
    report = client.get(f"/api/jobs/{made['job']}/files/report", params={"show": True})
    assert report.headers["content-security-policy"] == STILL_POLICY
    assert report.headers["content-disposition"].startswith("inline")
    program = client.get(f"/api/jobs/{made['job']}/files/program", params={"show": True})
    assert program.headers["content-disposition"].startswith("attachment")


def test_the_cookie_outlives_a_restart_and_the_token_does_not(tmp_path: Path) -> None:
    first = open_studio(tmp_path)
    first.history.close()
    second = open_studio(tmp_path)
    second.history.close()
    assert second.keys.is_cookie(first.keys.new_cookie())
    assert not second.keys.redeem_entry(first.keys.new_entry())
    assert first.keys.token != second.keys.token
    assert min(len(first.keys.token), len(first.keys.new_entry())) >= 32
    assert (tmp_path / "key").stat().st_mode & 0o077 == 0
    assert Folder(tmp_path).inputs.stat().st_mode & 0o077 == 0
