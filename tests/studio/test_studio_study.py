"""The student's bench: files and answers of a study."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable

import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.model.heartbeat import Progress
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.jobs.task import Task
from leafcut.studio.studio import Studio

OPTIONS = {"iterations": "5", "threads": "1", "local_search": False, "n_ants": "4"}
STUDY = Task("study", ("random:30:1",), options=OPTIONS, algorithms=("mmas", "acs", "firefly"), runs=2)


def test_a_study_is_a_job_whose_runs_are_those_of_the_command_line(studio: Studio) -> None:
    job = studio.jobs.start(STUDY)
    assert studio.jobs.wait(job, 120) is JobState.DONE
    answer = studio.history.answer(job)
    assert answer is not None
    assert [(run["algorithm"], run["seed"]) for run in answer["runs"]] == [
        (name, seed) for name in ("mmas", "acs", "firefly") for seed in (1, 2)
    ]
    for run in answer["runs"]:
        used = {**OPTIONS, **({} if run["algorithm"] != "firefly" else {"n_ants": None})}
        alone = api.solve("random:30:1", algorithm=run["algorithm"], seed=run["seed"], **used)
        assert run["length"] == alone.solution.cost
    rows = csv.DictReader(io.StringIO(studio.history.artefact(job, "runs").text))
    assert [float(row["length"]) for row in rows] == [run["length"] for run in answer["runs"]]
    curves = json.loads(studio.history.artefact(job, "curves").data)
    assert [curve["points"][-1][2] for curve in curves] == [run["length"] for run in answer["runs"]]
    record = studio.jobs.record(job)
    assert record is not None
    assert record.figures == {"length": min(run["length"] for run in answer["runs"])}
    assert Task.from_json(STUDY.as_json()) == STUDY == record.task


def test_a_study_can_be_cancelled_and_a_stopped_study_keeps_its_finished_runs(
    own_studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The studio stops the study when the third run starts, and cancels it when the first run starts.

    All thousand runs would take minutes.
    """
    studio = own_studio
    options = {**OPTIONS, "iterations": "1000"}
    long = Task("study", ("random:30:1",), options=options, algorithms=("mmas",), runs=1000)
    tell = LiveJob.record_progress

    def end_at(words: str, end: Callable[[str], None]) -> None:
        def observed(live: LiveJob, progress: Progress) -> None:
            tell(live, progress)
            if words in progress.step:
                end(live.id)

        monkeypatch.setattr(LiveJob, "record_progress", observed)

    end_at("seed 3", studio.jobs.stop)
    job = studio.jobs.start(long)
    assert studio.jobs.wait(job, 120) is JobState.STOPPED
    answer = studio.history.answer(job)
    assert answer is not None
    assert answer["stopped_early"]
    assert 2 <= len(answer["runs"]) < 1000
    end_at("seed 1", studio.jobs.cancel)
    job = studio.jobs.start(long)
    assert studio.jobs.wait(job, 120) is JobState.CANCELLED
    assert studio.history.answer(job) is None


@pytest.mark.parametrize(("algorithms", "runs"), [((), 3), (("mmas",), 0), (("mmas",), 1001), (("auto",), 2)])
def test_what_is_no_study_is_refused_before_it_is_a_job(studio: Studio, algorithms: tuple[str, ...], runs: int) -> None:
    with pytest.raises(OptionError):
        studio.jobs.start(Task("study", ("random:30:1",), algorithms=algorithms, runs=runs))
    assert studio.jobs.newest() == []


def test_the_iterations_of_an_algorithm_of_the_literature_are_kept_and_of_no_other(studio: Studio) -> None:
    job = studio.jobs.start(Task("solve", ("random:30:1",), options={**OPTIONS, "algorithm": "mmas"}))
    assert studio.jobs.wait(job, 120) is JobState.DONE
    (search,) = json.loads(studio.history.artefact(job, "search").data)
    rows = search["iterations"]
    assert [row[0] for row in rows] == [1, 2, 3, 4, 5]
    assert all(row[2] <= row[3] <= row[4] <= row[5] for row in rows)
    assert rows[-1][2] == studio.history.answer(job)["length"]
    table = list(csv.DictReader(io.StringIO(studio.history.artefact(job, "iterations").text)))
    assert [int(row["number"]) for row in table] == [1, 2, 3, 4, 5]
    assert [float(row["mean"]) for row in table] == [row[4] for row in rows]
    job = studio.jobs.start(Task("solve", ("random:30:1",), options={"preset": "fast"}))
    assert studio.jobs.wait(job, 120) is JobState.DONE
    assert "iterations" not in studio.history.artefacts(job)
