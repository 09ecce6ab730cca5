"""Works of the studio run in other processes, which end at any moment and leave nothing behind."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import uvicorn
import works
from own_loop import awaited
from waiting import has_ended, until
from websockets.exceptions import InvalidState

from leafcut.model.heartbeat import Progress
from leafcut.studio.jobs import jobs as room
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.run_job import JobResult, run_task
from leafcut.studio.jobs.task import Task
from leafcut.studio.jobs.work_process import READY_TASK
from leafcut.studio.jobs.workers import StudioWork, StudioWorkers, WorkError
from leafcut.studio.server.app import _create_server
from leafcut.studio.studio import Studio

TASK = Task("optimize", ("example:plate-10",))
#: A studio that does a work until it is killed.
STUDIO = """
import sys
from pathlib import Path
import works
from leafcut.studio.jobs.workers import StudioWork, StudioWorkers
StudioWork(StudioWorkers(Path(sys.argv[1]))).run(works.start_another, on_message=lambda p: print(p.step, flush=True))
"""


@pytest.fixture
def studio(own_studio: Studio) -> Studio:
    """Return a studio whose processes may be killed."""
    return own_studio


@pytest.fixture
def workers(own_studio: Studio, monkeypatch: pytest.MonkeyPatch) -> StudioWorkers:
    """Return processes that may be killed; however long their start takes, a work counts as short."""
    monkeypatch.setattr("leafcut.studio.jobs.workers._LONG_SECONDS", math.inf)
    return own_studio.workers


class Doing:
    """A work in a thread: its messages, and its result or error."""

    def __init__(self, workers: StudioWorkers, function: Callable[..., Any]) -> None:
        self.work, self.messages = StudioWork(workers), list[Progress]()
        self.answer = ThreadPoolExecutor(1).submit(self.work.run, function, on_message=self.messages.append)
        until(lambda: self.messages or self.answer.done())

    @property
    def process(self) -> int:
        """Number of the process that the work has reported."""
        return int(self.messages[0].step.split()[1])


@pytest.mark.parametrize("how", ["cancel", "delete", "close"])
@pytest.mark.parametrize("work", [works.read_for_ever, works.hold_the_interpreter])
def test_a_job_that_never_looks_up_is_ended(
    how: str, work: Callable[..., Any], studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By Cancel, by its deletion, and by the end of the studio."""
    monkeypatch.setattr(room, "run_task", work)
    job = studio.jobs.start(TASK)
    live = studio.jobs.find_live_job(job)
    assert live is not None
    until(lambda: live.latest.step)
    studio.jobs.close() if how == "close" else getattr(studio.jobs, how)(job)
    live.ended.result(60)
    assert has_ended(int(live.latest.step.split()[1]))
    expected = {"cancel": JobState.CANCELLED, "close": JobState.INTERRUPTED}
    assert live.state is expected.get(how, live.state)


@pytest.mark.skipif(os.name != "posix", reason="needs groups of processes")
def test_a_cancelled_work_leaves_neither_files_nor_processes(tmp_path: Path, workers: StudioWorkers) -> None:
    own = StudioWorkers(tmp_path / "work", spare=False)
    doing = Doing(own, works.start_another)
    assert list(tmp_path.rglob("file"))
    doing.work.cancel()
    with pytest.raises(WorkError):
        doing.answer.result(60)
    until(lambda: has_ended(doing.process))
    assert list((tmp_path / "work").iterdir()) == []
    own.close()


def test_a_job_that_dies_is_reported_with_its_last_step_and_the_next_one_runs(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(room, "run_task", works.die)
        job = studio.jobs.start(TASK)
        assert studio.jobs.wait(job, 60) is JobState.FAILED
    record = studio.jobs.record(job)
    assert record is not None
    assert record.line.startswith("the process of this job ended unexpectedly during 'searching' (")
    assert studio.jobs.wait(studio.jobs.start(Task("solve", ("random:9:1",))), 120) is JobState.DONE


def test_a_result_that_cannot_be_sent_is_an_internal_error(workers: StudioWorkers) -> None:
    with pytest.raises(WorkError, match="internal error in leafcut") as failed:
        StudioWork(workers).run(works.unpicklable)
    assert failed.value.internal


def test_a_process_is_used_again_after_a_short_work_but_not_after_a_cancelled_one(workers: StudioWorkers) -> None:
    first = StudioWork(workers).run(works.number_of_process)
    doing = Doing(workers, works.read_for_ever)
    assert doing.process == first
    doing.work.cancel()
    with pytest.raises(WorkError):
        doing.answer.result(60)
    assert StudioWork(workers).run(works.number_of_process) != first
    with pytest.raises(WorkError, match="cancelled"):
        doing.work.run(works.number_of_process)


def test_the_job_that_prepares_a_process_succeeds() -> None:
    """Its errors are not shown to anyone."""
    assert "program" in run_task(Link(lambda _: None), READY_TASK, ("plate-10",)).artefacts


def test_a_message_to_a_work_reaches_it_even_before_its_start_but_no_later_work(workers: StudioWorkers) -> None:
    early = StudioWork(workers)
    early.call_link_method("stop")
    assert early.run(works.wait_for_stop) == JobResult({}, {}, {})
    later = Doing(workers, works.wait_for_stop)
    early.call_link_method("stop")
    early.cancel()
    assert not later.answer.done()
    later.work.call_link_method("stop")
    assert later.answer.result(60) == JobResult({}, {}, {})


def test_a_late_message_of_a_work_does_not_reach_the_next_one(workers: StudioWorkers) -> None:
    StudioWork(workers).run(works.leave_a_message)
    later, messages = StudioWork(workers), list[Any]()
    later.run(works.wait_for_the_message, on_message=messages.append)
    assert [type(message) for message in messages] == [Progress]


def test_the_end_of_the_studio_ends_working_and_idle_processes(tmp_path: Path, workers: StudioWorkers) -> None:
    old = tmp_path / "work" / "left" / "by-a-killed-studio"
    old.mkdir(parents=True)
    own = StudioWorkers(tmp_path / "work")
    doing = Doing(own, works.read_for_ever)
    folder = Path(StudioWork(own).run(works.temporary_folder))
    assert folder.parent == tmp_path / "work"
    assert not old.exists()
    own.close()
    with pytest.raises(WorkError):
        doing.answer.result(60)
    assert has_ended(doing.process)
    assert list((tmp_path / "work").iterdir()) == []
    with pytest.raises(WorkError, match="the studio is closing"):
        StudioWork(own).run(works.number_of_process)


@pytest.mark.skipif(os.name != "posix", reason="needs groups of processes")
def test_processes_end_when_the_studio_is_killed(tmp_path: Path, workers: StudioWorkers) -> None:
    with subprocess.Popen([sys.executable, "-c", STUDIO, str(tmp_path)], stdout=subprocess.PIPE, text=True) as studio:
        assert studio.stdout is not None
        number = int(studio.stdout.readline().split()[1])
        assert not has_ended(number)
        studio.send_signal(signal.SIGKILL)
    until(lambda: has_ended(number))


def test_jobs_end_one_by_one_whatever_thread_cancels_them(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "run_task", works.wait_for_stop)
    jobs = [studio.jobs.start(TASK) for _ in range(4)]
    threads = [threading.Thread(target=studio.jobs.cancel, args=(job,)) for job in jobs[1:]]
    for thread in threads:
        thread.start()
    studio.jobs.stop(jobs[0])
    assert [studio.jobs.wait(job, 60) for job in jobs] == [JobState.STOPPED, *3 * [JobState.CANCELLED]]


def test_the_end_waits_for_a_connection_that_is_just_closing(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    """The server under it fails then, as it cannot close what is closing; it did so once in some thousand ends."""
    asked: list[object] = []

    async def ends(self: uvicorn.Server, sockets: object = None) -> None:
        asked.append(sockets)
        if len(asked) < 3:
            raise InvalidState("connection is closing")

    monkeypatch.setattr(uvicorn.Server, "shutdown", ends)
    server = _create_server(uvicorn.Config(lambda: None), studio)
    awaited(server.shutdown())
    assert len(asked) == 3
    assert studio.jobs.closed
