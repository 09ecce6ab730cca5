"""Experiments in the studio: one at a time, finished runs are kept, and the report is a separate page."""

from __future__ import annotations

import csv
import io
import threading
from typing import Any

import pytest
from fastapi.testclient import TestClient
from waiting import until

from leafcut.errors import OptionError
from leafcut.lab.loading import load_experiment, reduced_experiment
from leafcut.lab.own_experiment import comparison_experiment
from leafcut.lab.running import RunSummary
from leafcut.model.heartbeat import Progress
from leafcut.read import read
from leafcut.studio.lab import runs as lab_runs
from leafcut.studio.studio import Studio

SHORT = "machining_time"


@pytest.mark.slow
def test_an_experiment_runs_once_and_its_report_and_runs_can_be_had(studio: Studio, client: TestClient) -> None:
    lab, of = studio.rooms["lab"].runs, reduced_experiment(load_experiment(SHORT))
    lab.start(of)
    lab.wait()
    assert lab.state is not None
    assert (lab.state.running, lab.state.line, lab.state.failed) == (False, "", ())
    rows = lab.rows(of)
    assert len(rows) == of.n_runs == lab.run_counts()[of.storage_key]
    began = [row.began for row in rows]
    lab.start(of)
    lab.wait()
    assert [row.began for row in lab.rows(of)] == began
    page = client.get(f"/api/lab/{SHORT}/report.html?reduced=true")
    assert page.status_code == 200
    assert "sandbox" in page.headers["content-security-policy"]
    assert f"{of.n_runs} of {of.n_runs} runs done" in page.text
    table = client.get(f"/api/lab/{SHORT}/runs.csv?reduced=true")
    assert len(list(csv.DictReader(io.StringIO(table.text)))) == of.n_runs


@pytest.mark.parametrize("name", ["no_such", "open_part", "thesis.toml", "..%2Fthesis"])
def test_what_is_no_experiment_is_refused_in_one_line(client: TestClient, name: str) -> None:
    answer = client.get(f"/api/lab/{name}/report.html")
    assert answer.status_code in (400, 404, 422)
    assert "\n" not in answer.json()["error"]
    assert client.get("/api/lab/thesis/lab.sqlite").status_code == 404


def test_one_runs_at_a_time_and_stops_when_it_is_told_or_the_studio_ends(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = threading.Event()

    def waits(of: Any, store: Any, *, progress: Any, cancelled: threading.Event, mixed: bool) -> RunSummary:
        progress(Progress("first (1 of 2 runs)", 0.5))
        begun.set()
        assert cancelled.wait(60)
        return RunSummary(2, 1, 1, stopped=True)

    monkeypatch.setattr(lab_runs, "execute_experiment", waits)
    lab, of = studio.rooms["lab"].runs, load_experiment(SHORT)
    lab.start(of)
    assert begun.wait(60)
    assert lab.running
    assert lab.state is not None and lab.state.seconds_left is not None
    with pytest.raises(OptionError, match="an experiment is already running"):
        lab.start(of)
    lab.stop()
    until(lambda: not lab.running)
    begun.clear()
    lab.start(of)
    assert begun.wait(60)
    studio.close()
    assert not lab.running


def test_a_failure_names_no_folder_of_the_studio(studio: Studio) -> None:
    gone = studio.folder.root / "inputs" / "gone.dxf"
    lab = studio.rooms["lab"].runs
    lab.start(comparison_experiment("gone", str(gone), "solve", {}, ["nn", "2opt"], 1))
    lab.wait()
    assert lab.state is not None
    assert "gone.dxf" in lab.state.line
    assert str(studio.folder.root) not in lab.state.line
    assert "\n" not in lab.state.line


def test_points_of_a_map_can_be_had_as_a_table_and_no_file_beyond_the_studio(client: TestClient) -> None:
    answer = client.get("/api/points.csv?source=random:30:4")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [(float(row["x"]), float(row["y"])) for row in rows] == [(h.x, h.y) for h in read("random:30:4").holes]
    assert "random-30-4.csv" in answer.headers["content-disposition"]
    for name in ("/etc/passwd", "../x.csv", "random:", "random:99999999999:1"):
        assert client.get("/api/points.csv", params={"source": name}).status_code in (400, 404, 422)
