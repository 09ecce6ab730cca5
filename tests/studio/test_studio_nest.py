"""Parts are nested, their sheets cut and compared: the files are those of the command line, byte for byte."""

from __future__ import annotations

import io
import json
import shlex
from pathlib import Path
from typing import Any

import ezdxf
import pytest
from parts_to_nest import ANGLE, PLATE
from starlette.testclient import TestClient

import leafcut
from leafcut import cli
from leafcut.errors import OptionError
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.nest_request import WantedPart, list_text, listed_parts, wanted_parts
from leafcut.studio.jobs.sheets import comparison, nest_of, plan_cuts
from leafcut.studio.jobs.task import Task, command_line, prepare, title_of
from leafcut.studio.studio import Studio, open_studio

#: Two plates beside each other fill a sheet, so that six parts take several.
OPTIONS = {"sheet": "200x90", "margin": "2", "gap": "2", "preset": "fast", "nester": "rectangles"}


def nested(studio: Studio, rotations: str = "", **options: Any) -> tuple[str, Task]:
    """Nest four plates and two angles; return the job and its task."""
    plate, angle = studio.folder.add_input("plate.svg", PLATE), studio.folder.add_input("angle.svg", ANGLE)
    task = Task("nest", (f"{plate}:4", WantedPart(angle, 2, rotations).word), options={**OPTIONS, **options})
    job = studio.jobs.start(task)
    state, record = studio.jobs.wait(job, 60), studio.jobs.record(job)
    assert record is not None
    assert state is JobState.DONE, record.line
    return job, task


@pytest.mark.parametrize("rotations", ["", "0 180"])
def test_the_sheets_of_a_nest_are_those_of_the_command_line_shown(
    studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rotations: str
) -> None:
    job, task = nested(studio, rotations)
    (tmp_path / "plate.svg").write_bytes(PLATE)
    (tmp_path / "angle.svg").write_bytes(ANGLE)
    made = studio.history.artefact(job, "list")
    assert (made is not None) is bool(rotations)
    if made is not None:
        (tmp_path / made.file_name).write_bytes(made.data)
    monkeypatch.chdir(tmp_path)
    words = shlex.split(command_line(task, studio.folder))
    assert ("parts.csv" in words) is bool(rotations)
    assert cli.run([*words[1:], "--quiet"]) == 0
    sheets = nest_of(studio.history, job)
    assert {sheet.file for sheet in sheets} == {file.name for file in tmp_path.glob("*.dxf")}
    assert len(sheets) > 1
    for sheet in sheets:
        drawing = studio.history.artefact(job, sheet.drawing)
        assert drawing is not None
        assert drawing.data == (tmp_path / sheet.file).read_bytes()
        scene = studio.history.artefact(job, f"scene-{sheet.variant}-{sheet.number}")
        assert scene is not None
        assert scene.data.startswith(b"LCSCENE1")


def test_the_cuts_of_all_nests_are_planned_compared_and_written_as_the_command_line_does(
    studio: Studio, tmp_path: Path
) -> None:
    job, _ = nested(studio)
    assert [row["state"] for row in comparison(studio.jobs, job)] == ["none"] * len(comparison(studio.jobs, job))
    for begun in plan_cuts(studio.jobs, job, {"thickness": "6", "preset": "fast"}):
        assert studio.jobs.wait(begun, 90) is JobState.DONE, studio.jobs.record(begun)
    rows = comparison(studio.jobs, job)
    answer = studio.history.answer(job)
    assert answer is not None
    for row, variant in zip(rows, answer["variants"], strict=True):
        assert row["state"] == "done"
        expected = 0.0
        for sheet, layout in zip(row["jobs"], variant["layouts"], strict=True):
            drawing = tmp_path / layout["file"]
            source = studio.history.artefact(job, f"sheet-{row['variant']}-{row['jobs'].index(sheet) + 1}")
            assert source is not None
            drawing.write_bytes(source.data)
            quantity = {"quantity": layout["sheets"]} if layout["sheets"] > 1 else {}
            outcome = leafcut.optimize(drawing, process="cut", thickness="6", preset="fast", **quantity)
            program = studio.history.artefact(sheet, "program")
            assert program is not None
            assert program.data.decode() == outcome.text
            expected += layout["sheets"] * outcome.after.time_s
        assert row["time_s"] == pytest.approx(expected)
        assert row["pierces"] == 10  # four plates with a hole each, and two angles
    best = [row for row in rows if row["quickest"]]
    assert len(rows) == 1 or min(row["time_s"] for row in rows) == best[0]["time_s"]
    used = {record.task.inputs for record in studio.history.of_sheets(job)}
    again = plan_cuts(studio.jobs, job, {"thickness": "8", "preset": "fast"})
    assert {studio.history.get(begun).task.inputs for begun in again} == used  # type: ignore[union-attr]
    for begun in again:
        studio.jobs.cancel(begun)


def test_cuts_that_are_being_planned_are_not_begun_again_and_of_a_wrong_option_none_are(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, _ = nested(studio)
    monkeypatch.setattr(studio.jobs._threads, "submit", lambda _: None)  # all wait
    last = nest_of(studio.history, job)[-1]

    def refused(task: Task, *rest: Any) -> Any:
        if task.origin == last.origin:
            raise OptionError("out of range")
        return prepare(task, *rest)

    with monkeypatch.context() as patch:
        for module in ("sheets", "jobs"):
            patch.setattr(f"leafcut.studio.jobs.{module}.prepare", refused, raising=False)
        with pytest.raises(OptionError, match="out of range"):
            plan_cuts(studio.jobs, job, {"thickness": "6"})
    assert studio.jobs.of_sheets(job) == []
    begun = plan_cuts(studio.jobs, job, {"thickness": "6"})
    assert plan_cuts(studio.jobs, job, {"thickness": "6"}) == begun
    assert len(studio.jobs.of_sheets(job)) == len(begun) == len(nest_of(studio.history, job))
    studio.jobs.cancel(begun[0])
    assert plan_cuts(studio.jobs, job, {"thickness": "6"})[1:] == begun[1:]
    assert not {*plan_cuts(studio.jobs, job, {"thickness": "8"})} & {*begun}


def test_programs_nest_and_compare_through_the_api(
    client: TestClient, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [("files", ("plate.svg", PLATE)), ("files", ("angle.svg", ANGLE))]
    parts = json.dumps([{"quantity": 4}, {"quantity": "2", "rotations": "0/90"}])
    answer = client.post("/api/nest", files=files, data={"parts": parts, "options": json.dumps(OPTIONS)}).json()
    for name, data in (("plate.svg", PLATE), ("angle.svg", ANGLE)):
        (tmp_path / name).write_bytes(data)
    wanted = tmp_path / "parts.csv"
    wanted.write_text("plate.svg,4\nangle.svg,2,0 90\n")
    flags = [word for name, value in OPTIONS.items() for word in (f"--{name}", value)]
    capsys.readouterr()
    sheet = str(tmp_path / "nest.dxf")
    assert cli.run(["nest", str(wanted), "-o", sheet, "--all-variants", *flags, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    for variant in told["variants"]:
        for layout in variant["layouts"]:
            layout["file"] = Path(layout["file"]).name
            assert answer["texts"][layout["file"]] == (tmp_path / layout["file"]).read_text()
    for key in told.keys() - {"seconds"}:
        assert answer[key] == told[key], key
    assert client.get(f"/api/jobs/{answer['job']}/answer").json()["variants"] == answer["variants"]
    rows = client.post(
        f"/api/jobs/{answer['job']}/cuts", data={"options": '{"thickness": 6, "preset": "fast", "iterations": 1}'}
    ).json()
    assert [row["variant"] for row in rows] == list(range(1, len(answer["variants"]) + 1))
    assert all(row["time_s"] > 0 for row in rows)
    assert client.get(f"/api/jobs/{answer['job']}/cuts").json() == rows


def test_a_drawing_that_is_named_as_a_sheet_is_one_and_no_part(client: TestClient) -> None:
    """What remains of a sheet, 300 by 200 mm, is opened beside the part and named in the sheets."""
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(0, 0), (300, 0), (300, 200), (0, 200)], close=True)
    text = io.StringIO()
    document.write(text)
    rest = text.getvalue().encode()
    answer = client.post(
        "/api/nest",
        files=[("files", ("plate.svg", PLATE)), ("files", ("rest.dxf", rest))],
        data={"parts": '[{"quantity": 2}, {}]', "options": '{"sheet": "rest.dxf:3@5", "nester": "rectangles"}'},
    )
    assert answer.status_code == 200, answer.json()
    told = answer.json()
    assert [(one["length_mm"], one["width_mm"], one["price"]) for one in told["sheets"]] == [(300, 200, 5)]
    assert {name for v in told["variants"] for layout in v["layouts"] for name in layout["parts"]} == {"plate"}


@pytest.mark.parametrize(
    ("files", "data", "line"),
    [
        (["plate.svg"], {"parts": "x"}, "'parts' must be a JSON list"),
        (["plate.svg"], {"parts": "[{}, {}]"}, "'parts' must be a JSON list"),
        (["plate.svg"], {"parts": '[{"quantity": 0}]'}, "quantity: '0' is not a whole number"),
        (["plate.svg"], {"parts": '[{"quantity": 1e9}]'}, "quantity: '1000000000.0' is not"),
        (["plate.svg"], {"parts": '[{"rotations": "up"}]'}, "rotations: "),
        (["plate.svg"], {"options": '{"sheet": "5x5"}'}, "--margin: 10 mm on each side leaves no room"),
        (["plate.svg"], {"options": '{"sheet": "300x200,/etc/secret.dxf"}'}, "is not open; open it"),
        (["plate.svg"], {"options": '{"all_variants": true}'}, "the studio sets this file itself"),
        (["parts.csv"], {}, "open the drawings themselves"),
    ],
)
def test_what_cannot_be_nested_is_one_line(
    client: TestClient, files: list[str], data: dict[str, str], line: str
) -> None:
    answer = client.post("/api/nest", files=[("files", (name, PLATE)) for name in files], data=data)
    assert answer.status_code == 400
    assert line in answer.json()["error"]
    assert len(answer.json()["error"].splitlines()) == 1


def test_only_a_nest_has_sheets_to_be_cut(studio: Studio, client: TestClient) -> None:
    job = studio.jobs.start(Task("solve", ("random:5:1",)))
    studio.jobs.wait(job)
    assert "has no nests" in client.post(f"/api/jobs/{job}/cuts").json()["error"]
    assert client.get("/api/jobs/absentabsent/cuts").status_code == 404
    with pytest.raises(OptionError, match="no parts"):
        prepare(Task("nest", ()), studio.folder)


def test_a_list_names_drawings_that_are_open_and_no_others(studio: Studio, tmp_path: Path) -> None:
    """Of ``/etc/passwd`` and ``../other/plate.svg`` the last name alone counts, and only where it was opened."""
    wanted = tmp_path / "parts.csv"
    wanted.write_text("file;quantity;rotations\n../other/plate.svg;7;0 90\n/etc/passwd;2\nC:\\parts\\angle.svg;3\n")
    opened = {"plate.svg": "P" * 16, "angle.svg": "A" * 16}
    found, missing = listed_parts(wanted, opened)
    assert found == [WantedPart("P" * 16, 7, "0 90"), WantedPart("A" * 16, 3)]
    assert missing == ["passwd"]


def test_a_part_is_one_word_and_a_list_is_read_as_it_was_written(tmp_path: Path) -> None:
    for part in (WantedPart("x" * 16), WantedPart("x" * 16, 12, "0 22.5"), WantedPart("x" * 16, 1, "free")):
        assert WantedPart.of(part.word) == part
    parts = wanted_parts(["a" * 16, "b" * 16], '[{"quantity": 3, "rotations": "0,90"}]')
    assert parts == [WantedPart("a" * 16, 3, "0 90"), WantedPart("b" * 16)]
    file = tmp_path / "parts.csv"
    file.write_text(list_text(parts, ['odd "name"; one.dxf', "b,2.dxf"]))
    opened = {'odd "name"; one.dxf': "a" * 16, "b,2.dxf": "b" * 16}
    assert listed_parts(file, opened) == (parts, [])


def test_nests_and_their_cuts_outlive_a_restart_with_what_they_said(tmp_path: Path) -> None:
    first = open_studio(tmp_path)
    job, _ = nested(first)
    begun = plan_cuts(first.jobs, job, {"thickness": "6", "preset": "fast"})
    for each in begun:
        first.jobs.wait(each, 90)
    rows, said = comparison(first.jobs, job), first.jobs.messages(job)
    assert any("nesting" in words for _, words in said)
    first.folder.drop_unused(first.history.inputs_in_use())
    first.jobs.close()
    first.history.close()
    second = open_studio(tmp_path)
    assert comparison(second.jobs, job) == rows
    assert second.jobs.messages(job) == said
    record = second.history.get(job)
    assert record is not None
    assert title_of(record.task, second.folder) == "plate.svg × 4 · angle.svg × 2"
    second.jobs.delete(job)
    assert second.jobs.messages(job) == []
    second.jobs.close()
    second.history.close()
