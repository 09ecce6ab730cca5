"""The JSON API: the same answers as the command line's ``--json``, documented, in one form also when refused."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path
from typing import Any

import httpx2
import pytest
import works
from own_loop import awaited
from starlette.testclient import TestClient

from leafcut.cli import app as cli
from leafcut.studio.jobs import jobs
from leafcut.studio.jobs.run_job import JobResult
from leafcut.studio.jobs.workers import StudioWork
from leafcut.studio.server.app import build_api
from leafcut.studio.studio import Studio

ROOT = Path(__file__).parents[2]
PLATE = ROOT / "examples" / "plate_10.dxf"
CAM = ROOT / "examples" / "cam_121.nc"
#: What differs from run to run.
CLOCK = {"seconds", "search_seconds", "compile_seconds", "history", "workers"}


def told(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """Return the answer of a command line."""
    capsys.readouterr()
    cli.run([*words, "--json"])
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def same(answer: dict[str, Any], other: dict[str, Any], *more: str) -> None:
    for key in other.keys() - CLOCK - set(more):
        assert answer[key] == other[key], key


def test_optimize_answers_as_the_command_line_and_gives_the_program(
    client: TestClient, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = {"thickness": "3mm", "machine": "haas-vf2", "preset": "fast"}
    answer = client.post(
        "/api/optimize", files={"file": ("plate_10.dxf", PLATE.read_bytes())}, data={"options": json.dumps(options)}
    ).json()
    flags = ["--thickness", "3mm", "--machine", "haas-vf2", "--preset", "fast"]
    program = tmp_path / "plate_10.nc"
    same(answer, told(capsys, "optimize", str(PLATE), "-o", str(program), *flags), "output")
    assert answer["output"] == "plate_10.nc"
    assert answer["text"] == program.read_text()
    job = client.get(f"/api/jobs/{answer['job']}").json()
    assert (job["state"], job["title"], job["files"]["program"]) == ("done", "plate_10.dxf", "plate_10.nc")
    file = client.get(f"/api/jobs/{answer['job']}/files/program")
    assert file.content == program.read_bytes()
    assert "plate_10.nc" in file.headers["content-disposition"]


def test_solve_simulate_and_verify_answer_as_the_command_line(
    client: TestClient, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = client.post("/api/solve", data={"source": "random:30:4", "options": '{"preset": "fast"}'}).json()
    same(answer, told(capsys, "solve", "random:30:4", "--preset", "fast"))
    assert answer["text"].startswith("NAME")
    program = ("cam_121.nc", CAM.read_bytes())
    answer = client.post("/api/simulate", files={"file": program}, data={"options": '{"machine": "haas-vf2"}'}).json()
    same(answer, told(capsys, "simulate", str(CAM), "--machine", "haas-vf2"), "program")
    assert answer["program"] == "cam_121.nc"
    answer = client.post("/api/verify", files={"original": program, "new": program}).json()
    same(answer, told(capsys, "verify", str(CAM), str(CAM)))
    assert answer["same"] is True


def test_the_text_of_a_program_is_its_own_letters_and_no_answer_says_where_the_studio_keeps_it(
    studio: Studio, client: TestClient
) -> None:
    """A comment in Latin-1 is unchanged, in the file and in the text."""
    program = CAM.read_bytes().replace(b"(", "(PIEZA Ñ 5° ".encode("latin-1"), 1)
    file = {"file": ("cam_121.nc", program)}
    answer = client.post("/api/optimize", files=file, data={"options": '{"preset": "fast"}'}).json()
    assert "(PIEZA Ñ 5° " in answer["text"]
    assert answer["input"] == "cam_121.nc"
    made = client.get(f"/api/jobs/{answer['job']}/files/program").content
    assert made == answer["text"].encode("latin-1")
    for name in studio.history.artefacts(answer["job"]):
        found = studio.history.artefact(answer["job"], name)
        assert found is not None
        assert str(studio.folder.root).encode() not in found.data, name


def test_what_comes_with_a_request_that_is_refused_is_not_kept(studio: Studio, client: TestClient) -> None:
    """A file that was opened before stays: a better request may follow."""
    opened = client.post("/api/files?name=plate.dxf", content=PLATE.read_bytes()).json()["id"]
    file = ("plate.dxf", PLATE.read_bytes())
    for options in ("[]", '{"thicknes": 1}'):
        data = {"options": options}
        for command in ("optimize", "solve", "simulate"):
            assert client.post(f"/api/{command}", files={"file": file}, data=data).status_code == 400
        assert client.post("/api/optimize", data={"source": opened, **data}).status_code == 400
        assert client.post("/api/verify", files={"original": file, "new": file}, data=data).status_code == 400
        assert client.post("/api/nest", files=[("files", file)], data={**data, "parts": "[{}]"}).status_code == 400
    assert client.post("/api/nest", files=[("files", file)], data={"parts": "x"}).status_code == 400
    assert [place.name for place in studio.folder.inputs.iterdir()] == [opened]


@pytest.mark.parametrize(
    ("data", "status", "line"),
    [
        ({}, 400, "no file given"),
        ({"source": "example:plat-70"}, 422, "did you mean 'plate-70'"),
        ({"source": "example:plate-10", "options": "[]"}, 400, "must be a JSON object"),
        ({"source": "example:plate-10", "options": "[" * 50_000}, 400, "must be a JSON object"),
        ({"source": "example:plate-10", "options": '{"thicknes": 1}'}, 400, "did you mean 'thickness'"),
        ({"source": "example:plate-10", "options": '{"thickness": -1}'}, 400, "--thickness: -1 mm is below"),
        ({"source": "example:plate-10", "options": '{"machine": "haas"}'}, 422, "unknown machine 'haas'"),
        ({"source": "/etc/passwd"}, 400, "no longer in the studio"),
    ],
)
def test_what_is_refused_says_so_in_one_line(client: TestClient, data: dict[str, str], status: int, line: str) -> None:
    answer = client.post("/api/optimize", data=data)
    assert answer.status_code == status
    assert list(answer.json()) == ["error", "message"]
    assert answer.json()["message"]["text"] == answer.json()["error"]
    assert line in answer.json()["error"]
    assert len(answer.json()["error"].splitlines()) == 1


def test_a_field_too_large_for_a_form_is_told_in_words_of_ours(studio: Studio) -> None:
    data = {"source": "example:plate-10", "options": "x" * ((1 << 20) + 1)}
    answer = TestClient(build_api(studio)).post("/api/optimize", files={"file": ("a.dxf", b"0")}, data=data)
    assert answer.status_code == 400
    assert answer.json() == {"error": "a field of this request is larger than 1 MiB; only files may be"}


def test_an_internal_error_is_answered_with_status_500(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "run_task", works.raise_division)
    answer = client.post("/api/optimize", data={"source": "example:plate-10"})
    assert answer.status_code == 500
    assert answer.json()["error"].startswith("internal error in leafcut (ZeroDivisionError")


def test_a_request_that_lacks_something_is_refused_in_the_same_form(client: TestClient) -> None:
    for method, address, status in (
        ("POST", "/api/verify", 422),
        ("POST", "/api/files", 422),
        ("GET", "/api/jobs?most=x", 422),
        ("GET", "/api/nothing", 404),
        ("GET", "/api/jobs/absentabsent", 404),
        ("GET", "/api/jobs/..", 404),
        ("GET", "/api/jobs/absentabsent/files/program", 404),
        ("DELETE", "/api/jobs/absentabsent", 404),
        ("DELETE", "/api/machines", 405),
    ):
        answer = client.request(method, address)
        assert answer.status_code == status, address
        assert list(answer.json()) == ["error"]


def test_however_many_wait_for_their_answers_the_others_are_answered(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sixty requests wait, more than the server has threads; the next request is answered anyway."""
    release = threading.Event()
    monkeypatch.setattr(StudioWork, "run", lambda *_, **__: release.wait(600) and JobResult({}, {}, {}))

    async def ask() -> None:
        transport = httpx2.ASGITransport(build_api(studio))
        async with (
            asyncio.timeout(500),
            httpx2.AsyncClient(transport=transport, base_url="http://studio", timeout=600) as client,
        ):
            waiting = [asyncio.create_task(client.post("/api/solve", data={"source": "random:9:1"})) for _ in range(60)]
            while len(studio.jobs.unfinished_ids()) < 60:
                await asyncio.sleep(0.01)
            assert (await client.get("/api/machines")).status_code == 200
            assert not any(task.done() for task in waiting)
            release.set()
            assert {answer.status_code for answer in await asyncio.gather(*waiting)} == {200}

    try:
        awaited(ask())
    finally:
        release.set()


def test_jobs_are_listed_and_forgotten(studio: Studio, client: TestClient) -> None:
    made = client.post("/api/solve", data={"source": "random:9:1"}).json()["job"]
    listed = client.get("/api/jobs").json()["jobs"]
    assert [(job["id"], job["title"], job["state"]) for job in listed] == [(made, "random:9:1", "done")]
    assert client.post(f"/api/jobs/{made}/stop").json()["state"] == "done"
    assert client.delete(f"/api/jobs/{made}").json() == {"schema": 1, "deleted": made}
    assert client.get("/api/jobs").json() == {"schema": 1, "jobs": []}


@pytest.mark.parametrize("address", ["jobs", "machines", "algorithms", "formats", "options"])
def test_an_answer_is_an_object_that_begins_with_its_schema(address: str, client: TestClient) -> None:
    answer = client.get(f"/api/{address}").json()
    assert next(iter(answer.items())) == ("schema", 1)


def test_the_description_names_every_way_in_and_loads_nothing_from_elsewhere(client: TestClient) -> None:
    described = client.get("/api/openapi.json").json()
    for command in ("optimize", "nest", "solve", "simulate", "verify"):
        operation = described["paths"][f"/api/{command}"]["post"]
        assert operation["summary"]
        assert operation["description"]
    for path in described["paths"]:
        assert all(operation["summary"] for operation in described["paths"][path].values())
        for operation in described["paths"][path].values():
            for status, answer in operation["responses"].items():
                schema = answer["content"]["application/json"]["schema"] if status != "200" else {}
                assert schema in ({}, {"$ref": "#/components/schemas/Refusal"}), (path, status)
            assert operation["security"] == [{"HTTPBearer": []}]
    assert described["components"]["schemas"]["Refusal"]["required"] == ["error"]
    assert described["paths"]["/api/files"]["post"]["requestBody"]["content"].keys() == {"application/octet-stream"}
    assert client.get("/docs").status_code == client.get("/redoc").status_code == 404


def test_what_there_is_is_listed_as_the_command_line_does(
    client: TestClient, capsys: pytest.CaptureFixture[str]
) -> None:
    for what in ("machines", "algorithms", "formats"):
        capsys.readouterr()
        cli.run(["list", what, "--json"])
        assert client.get(f"/api/{what}").json() == json.loads(capsys.readouterr().out)
    options = {option["name"]: option for option in client.get("/api/options").json()["options"]}
    assert options["thickness"]["flag"] == "--thickness"
    assert options["preset"]["choices"] == ["fast", "default", "thorough"]
