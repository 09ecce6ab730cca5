"""Nests of the studio: their sheets, and the comparison of their cuts."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import ezdxf
import pytest
from parts_to_nest import ANGLE, PLATE
from starlette.testclient import TestClient

from leafcut.errors import OptionError
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.nest_request import WantedPart, parts_list_text, read_parts_list, wanted_parts
from leafcut.studio.jobs.sheets import compare_variants, sheets_of_nest, start_cut_planning
from leafcut.studio.jobs.task import Task, resolve_task, task_title
from leafcut.studio.jobs.workers import StudioWorkers
from leafcut.studio.studio import Studio, open_studio

#: Two plates fill a sheet.
OPTIONS = {"sheet": "200x90", "margin": "2", "gap": "2", "preset": "fast", "nester": "rectangles"}
#: Options of a cut with little search.
CUT = {"thickness": "6", "iterations": 1, "bound": False}


def nested(studio: Studio, plates: int = 4, **options: Any) -> str:
    """Nest plates and two angles and return the job."""
    plate, angle = studio.folder.add_input("plate.svg", PLATE), studio.folder.add_input("angle.svg", ANGLE)
    task = Task("nest", (f"{plate}:{plates}", f"{angle}:2"), options={**OPTIONS, **options})
    job = studio.jobs.start(task)
    state, record = studio.jobs.wait(job, 60), studio.jobs.record(job)
    assert record is not None
    assert state is JobState.DONE, record.line
    return job


def test_the_cuts_of_all_nests_are_planned_and_compared(studio: Studio) -> None:
    """The time of a variant is the sum over its sheets, times the number of equal sheets."""
    job = nested(studio, plates=2, variants=2)
    sheets = sheets_of_nest(studio.history, job)
    assert len(sheets) > 1
    for sheet in sheets:
        scene = studio.history.artefact(job, f"scene-{sheet.variant}-{sheet.number}")
        assert scene is not None
        assert scene.data.startswith(b"LCSCENE1")
    assert [row["state"] for row in compare_variants(studio.jobs, job)] == ["none"] * len(
        compare_variants(studio.jobs, job)
    )
    for begun in start_cut_planning(studio.jobs, job, CUT):
        assert studio.jobs.wait(begun, 90) is JobState.DONE, studio.jobs.record(begun)
    rows = compare_variants(studio.jobs, job)
    answer = studio.history.answer(job)
    assert answer is not None
    for row, variant in zip(rows, answer["variants"], strict=True):
        assert row["state"] == "done"
        expected = 0.0
        for number, (cut, layout) in enumerate(zip(row["jobs"], variant["layouts"], strict=True), 1):
            drawing, record = studio.history.artefact(job, f"sheet-{row['variant']}-{number}"), studio.history.get(cut)
            outcome = studio.history.answer(cut)
            assert drawing is not None and record is not None and outcome is not None
            assert studio.folder.input_path(record.task.inputs[0]).read_bytes() == drawing.data
            assert record.task.options.get("quantity", 1) == layout["sheets"]
            assert outcome["verified"] is True
            expected += layout["sheets"] * outcome["after"]["time_s"]
        assert row["time_s"] == pytest.approx(expected)
        assert row["pierces"] == 6  # two plates with a hole each, and two angles
    best = [row for row in rows if row["quickest"]]
    assert len(rows) == 1 or min(row["time_s"] for row in rows) == best[0]["time_s"]
    used = {record.task.inputs for record in studio.history.sheet_jobs(job)}
    again = start_cut_planning(studio.jobs, job, {**CUT, "thickness": "8"})
    assert {studio.history.get(begun).task.inputs for begun in again} == used  # type: ignore[union-attr]
    for begun in again:
        studio.jobs.cancel(begun)


def test_cuts_that_are_being_planned_are_not_begun_again_and_of_a_wrong_option_none_are(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = nested(studio)
    monkeypatch.setattr(studio.jobs._threads, "submit", lambda _: None)  # all wait
    last = sheets_of_nest(studio.history, job)[-1]

    def refused(task: Task, *rest: Any) -> Any:
        if task.origin == last.origin:
            raise OptionError("out of range")
        return resolve_task(task, *rest)

    with monkeypatch.context() as patch:
        for module in ("sheets", "jobs"):
            patch.setattr(f"leafcut.studio.jobs.{module}.resolve_task", refused, raising=False)
        with pytest.raises(OptionError, match="out of range"):
            start_cut_planning(studio.jobs, job, {"thickness": "6"})
    assert studio.jobs.sheet_jobs(job) == []
    begun = start_cut_planning(studio.jobs, job, {"thickness": "6"})
    assert start_cut_planning(studio.jobs, job, {"thickness": "6"}) == begun
    assert len(studio.jobs.sheet_jobs(job)) == len(begun) == len(sheets_of_nest(studio.history, job))
    studio.jobs.cancel(begun[0])
    assert start_cut_planning(studio.jobs, job, {"thickness": "6"})[1:] == begun[1:]
    assert not {*start_cut_planning(studio.jobs, job, {"thickness": "8"})} & {*begun}


def test_programs_nest_and_compare_through_the_api(client: TestClient) -> None:
    files = [("files", ("plate.svg", PLATE)), ("files", ("angle.svg", ANGLE))]
    parts = json.dumps([{"quantity": 2}, {"quantity": "2", "rotations": "0/90"}])
    options = json.dumps({**OPTIONS, "variants": 1})
    answer = client.post("/api/nest", files=files, data={"parts": parts, "options": options}).json()
    layouts = [layout for variant in answer["variants"] for layout in variant["layouts"]]
    assert layouts and all("LWPOLYLINE" in answer["texts"][layout["file"]] for layout in layouts)
    assert client.get(f"/api/jobs/{answer['job']}/answer").json()["variants"] == answer["variants"]
    planned = client.post(f"/api/jobs/{answer['job']}/cuts", data={"options": json.dumps(CUT)}).json()
    rows = planned["variants"]
    assert [row["variant"] for row in rows] == list(range(1, len(answer["variants"]) + 1))
    assert all(row["time_s"] > 0 for row in rows)
    assert client.get(f"/api/jobs/{answer['job']}/cuts").json() == planned


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
        (["plate.svg"], {"options": '{"remnants_out": "out"}'}, "the studio sets this file itself"),
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
        resolve_task(Task("nest", ()), studio.folder)


def test_a_list_names_drawings_that_are_open_and_no_others(studio: Studio, tmp_path: Path) -> None:
    """Of ``/etc/passwd`` and ``../other/plate.svg`` the last name alone counts, and only where it was opened."""
    wanted = tmp_path / "parts.csv"
    wanted.write_text("file;quantity;rotations\n../other/plate.svg;7;0 90\n/etc/passwd;2\nC:\\parts\\angle.svg;3\n")
    opened = {"plate.svg": "P" * 16, "angle.svg": "A" * 16}
    found, missing = read_parts_list(wanted, opened)
    assert found == [WantedPart("P" * 16, 7, "0 90"), WantedPart("A" * 16, 3)]
    assert missing == ["passwd"]


def test_a_part_is_one_word_and_a_list_is_read_as_it_was_written(tmp_path: Path) -> None:
    for part in (WantedPart("x" * 16), WantedPart("x" * 16, 12, "0 22.5"), WantedPart("x" * 16, 1, "free")):
        assert WantedPart.decode(part.encoded) == part
    parts = wanted_parts(["a" * 16, "b" * 16], '[{"quantity": 3, "rotations": "0,90"}]')
    assert parts == [WantedPart("a" * 16, 3, "0 90"), WantedPart("b" * 16)]
    file = tmp_path / "parts.csv"
    file.write_text(parts_list_text(parts, ['odd "name"; one.dxf', "b,2.dxf"]))
    opened = {'odd "name"; one.dxf': "a" * 16, "b,2.dxf": "b" * 16}
    assert read_parts_list(file, opened) == (parts, [])


def test_nests_and_their_cuts_outlive_a_restart_with_what_they_said(tmp_path: Path, workers: StudioWorkers) -> None:
    first = open_studio(tmp_path, workers=workers)
    job = nested(first, plates=1, variants=1)
    begun = start_cut_planning(first.jobs, job, CUT)
    for each in begun:
        first.jobs.wait(each, 90)
    rows, said = compare_variants(first.jobs, job), first.jobs.messages(job)
    assert any("nesting" in words for _, words in said)
    first.folder.delete_unused_inputs(first.history.inputs_in_use())
    first.jobs.close()
    first.history.close()
    second = open_studio(tmp_path)
    assert compare_variants(second.jobs, job) == rows
    assert second.jobs.messages(job) == said
    record = second.history.get(job)
    assert record is not None
    assert task_title(record.task, second.folder) == "plate.svg × 1 · angle.svg × 2"
    second.jobs.delete(job)
    assert second.jobs.messages(job) == []
    second.jobs.close()
    second.history.close()
