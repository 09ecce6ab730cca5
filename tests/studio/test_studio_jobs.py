"""Jobs run beside the server, can be stopped and cancelled, and survive a restart."""

from __future__ import annotations

import os
import sqlite3
import threading
import time
import zlib
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import works
from waiting import until

from leafcut.errors import OptionError
from leafcut.files.schemas import HISTORY
from leafcut.files.whole_files import OutputError
from leafcut.message import Message
from leafcut.model.heartbeat import Progress, Trial
from leafcut.studio.jobs import jobs as room
from leafcut.studio.jobs.history import Artefact, History, JobState, SearchTerm
from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.jobs.run_job import JobResult
from leafcut.studio.jobs.task import ReadyTask, Task, resolve_task, task_title
from leafcut.studio.jobs.workers import StudioWork, StudioWorkers
from leafcut.studio.page.job_words import change_words, machine_and_changed_options
from leafcut.studio.studio import Studio, open_studio
from leafcut.studio.wording import Words
from leafcut.studio.wording import words as words_of

LONG = Task("solve", ("random:300:1",), options={"time_limit": "120s", "bound": False})
SHORT = Task("optimize", ("example:plate-10",), options={"depth": "3", "preset": "fast"})
#: Of a job that never starts.
WORK = StudioWork(StudioWorkers(Path("unused")))


def test_a_job_keeps_program_report_pictures_and_scenes(studio: Studio) -> None:
    job = studio.jobs.start(SHORT)
    assert studio.jobs.wait(job) is JobState.DONE
    made = studio.history.artefact(job, "program")
    assert made is not None
    assert made.file_name == "plate-10.ngc"
    answer = studio.history.answer(job)
    assert answer is not None
    assert answer["verified"] is True
    offered = {name for name, file in studio.history.artefacts(job).items() if file}
    assert offered == {"program", "report", "order", "picture-before", "picture-after"}
    for layer in ("part", "before", "after"):
        scene = studio.history.artefact(job, f"scene-{layer}")
        assert scene is not None
        assert scene.data.startswith(b"LCSCENE1")


def test_stopping_keeps_the_best_and_cancelling_keeps_nothing(own_studio: Studio) -> None:
    studio = own_studio
    kept, dropped = studio.jobs.start(LONG), studio.jobs.start(LONG)
    for job in (kept, dropped):
        live = studio.jobs.find_live_job(job)
        assert live is not None
        until(lambda live=live: live.latest.cost is not None)
    studio.jobs.stop(kept)
    studio.jobs.cancel(dropped)
    assert studio.jobs.wait(kept, 120) is JobState.STOPPED
    assert studio.jobs.wait(dropped, 120) is JobState.CANCELLED
    answer = studio.history.answer(kept)
    assert answer is not None
    assert answer["stopped_early"] is True
    assert studio.history.answer(dropped) is None
    assert studio.history.artefacts(dropped) == {}


def test_a_job_that_waits_can_be_cancelled(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()
    monkeypatch.setattr(StudioWork, "run", lambda *_, **__: release.wait(600) and JobResult({}, {}, {}))
    jobs = [studio.jobs.start(SHORT) for _ in range(room.AT_ONCE + 1)]
    last = studio.jobs.find_live_job(jobs[-1])
    assert last is not None
    assert last.state is JobState.WAITING
    studio.jobs.cancel(jobs[-1])
    release.set()
    assert [studio.jobs.wait(job, 120) for job in jobs] == [JobState.DONE] * room.AT_ONCE + [JobState.CANCELLED]


def test_who_waits_for_a_job_that_has_no_turn_is_told_at_once_that_it_is_over(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    release = threading.Event()
    monkeypatch.setattr(StudioWork, "run", lambda *_, **__: release.wait(600) and JobResult({}, {}, {}))
    jobs = [studio.jobs.start(SHORT) for _ in range(room.AT_ONCE + 2)]
    studio.jobs.cancel(jobs[-1])
    assert studio.jobs.wait(jobs[-1], 120) is JobState.CANCELLED
    assert not release.is_set()
    ending = threading.Thread(target=studio.jobs.close)
    ending.start()
    until(lambda: studio.jobs.closed)
    release.set()
    assert studio.jobs.wait(jobs[-2], 120) is JobState.INTERRUPTED
    ending.join(120)


def test_a_job_whose_outcome_cannot_be_kept_is_over_and_says_so(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a history that takes nothing more, the server still knows; of a fault in storing, the history, too."""
    monkeypatch.setattr(StudioWork, "run", lambda *_, **__: JobResult({"odd": object()}, {}, {}))
    job = studio.jobs.start(SHORT)
    assert studio.jobs.wait(job, 120) is JobState.FAILED
    kept = studio.history.get(job)
    assert kept is not None
    assert (kept.state, "internal error in leafcut (TypeError" in kept.line) == (JobState.FAILED, True)

    def full(*_: object, **__: object) -> None:
        raise OutputError("cannot write the history (disk full)")

    monkeypatch.setattr(studio.history, "finish", full)
    job = studio.jobs.start(SHORT)
    assert studio.jobs.wait(job, 120) is JobState.FAILED
    for record in (studio.jobs.record(job), studio.jobs.newest()[0]):
        assert record is not None
        assert (record.id, record.state, record.line) == (
            job,
            JobState.FAILED,
            "cannot write the history (disk full)",
        )


def test_a_job_that_is_over_keeps_nothing_large(studio: Studio) -> None:
    job = studio.jobs.start(LONG)
    live = studio.jobs.find_live_job(job)
    assert live is not None
    until(lambda: live.watch.poll()[1] is not None)
    studio.jobs.stop(job)
    assert studio.jobs.wait(job, 60) is JobState.STOPPED
    assert live.watch.poll() == (0, None)
    assert live.points == []


def test_of_a_days_jobs_only_the_last_are_still_known_as_they_went(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their messages and states are read from the history; jobs missing there stay in memory."""

    def said(*_: Any, on_message: Any) -> JobResult:
        on_message(Progress("search"))
        return JobResult({}, {}, {})

    def full(*_: object, **__: object) -> None:
        raise OutputError("cannot write the history (disk full)")

    monkeypatch.setattr(StudioWork, "run", said)
    with monkeypatch.context() as patched:
        patched.setattr(studio.history, "finish", full)
        unknown = studio.jobs.start(SHORT)
        assert studio.jobs.wait(unknown, 120) is JobState.FAILED
    jobs = [studio.jobs.start(SHORT) for _ in range(room._MAX_ENDED + 4)]
    assert [studio.jobs.wait(job, 120) for job in jobs] == [JobState.DONE] * len(jobs)
    live = [one for one in map(studio.jobs.find_live_job, jobs) if one is not None]
    assert (len(live), [one.messages for one in live if one.messages]) == (room._MAX_ENDED, [])
    assert all([words for _, words in studio.jobs.messages(job)] == ["search"] for job in (*jobs, unknown))
    assert studio.jobs.wait(unknown, 120) is JobState.FAILED


def test_a_run_that_fails_says_its_line_and_nothing_else_ends(studio: Studio) -> None:
    empty = studio.folder.add_input("empty.csv", b"\n")
    job = studio.jobs.start(Task("optimize", (empty,)))
    assert studio.jobs.wait(job) is JobState.FAILED
    record = studio.jobs.record(job)
    assert record is not None
    assert record.line == "empty.csv: the file is empty"
    assert studio.jobs.wait(studio.jobs.start(Task("solve", ("random:9:1",)))) is JobState.DONE


@pytest.mark.parametrize("problem", ["ValueError", "MemoryError", "SystemExit", "KeyboardInterrupt"])
def test_a_fault_of_leafcut_is_one_line_too(studio: Studio, monkeypatch: pytest.MonkeyPatch, problem: str) -> None:
    monkeypatch.setattr(room, "run_task", getattr(works, f"raise_{problem}"))
    job = studio.jobs.start(SHORT)
    assert studio.jobs.wait(job) is JobState.FAILED
    record = studio.jobs.record(job)
    assert record is not None
    assert len(record.line.splitlines()) == 1
    assert ("not enough memory" if problem == "MemoryError" else f"internal error in leafcut ({problem}") in record.line


def test_a_task_that_cannot_be_meant_is_refused_before_it_is_a_job(studio: Studio) -> None:
    for task in (
        Task("lift", ("example:plate-10",)),
        Task("verify", ("example:plate-10",)),
        Task("optimize", ("example:plate-10",), "saw"),
        Task("optimize", ("example:plate-10",), options={"thicknes": "3mm"}),
        Task("optimize", ("example:plate-10",), options={"thickness": "3 bananas"}),
        # Half of a letter: the list of jobs could not be shown any more.
        Task("optimize", ("example:plate-10",), options={"machine": "\ud800"}),
        Task("optimize", ("example:\udfff",)),
    ):
        with pytest.raises(OptionError):
            studio.jobs.start(task)
    assert studio.history.newest() == []


def test_the_curve_of_a_long_run_stays_short() -> None:
    live = LiveJob("a", ReadyTask("optimize", ("a.dxf",), "auto", {}), ("a.dxf",), WORK)
    for k in range(9_000):
        live.began = time.perf_counter() - k
        live.record_progress(Progress("search", 0.5, 1e6 - k))
    assert len(live.points) <= 4001
    costs = [cost for _, cost, what in live.points if what == "search"]
    assert costs == sorted(costs, reverse=True)


def test_a_restart_loses_nothing(tmp_path: Path, own_studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    first = open_studio(tmp_path, workers=own_studio.workers)
    points = first.folder.add_input("map.csv", b"x,y,diameter\n1,2,3\n4,5,3\n")
    done = first.jobs.start(Task("solve", (points,), options={"units": "mm"}))
    assert first.jobs.wait(done) is JobState.DONE
    tour = first.history.artefact(done, "tour")
    with monkeypatch.context() as patched:
        patched.setattr(room, "run_task", works.read_for_ever)
        running = first.jobs.start(SHORT)
        live = first.jobs.find_live_job(running)
        assert live is not None
        until(lambda: live.latest.step)
        first.jobs.close()
    first.history.close()

    second = open_studio(tmp_path, workers=own_studio.workers)
    records = {r.id: r for r in second.history.newest()}
    assert records[running].state is JobState.INTERRUPTED
    assert records[done].state is JobState.DONE
    assert second.history.artefact(done, "tour") == tour is not None
    again = second.jobs.start(records[done].task)
    assert second.jobs.wait(again) is JobState.DONE
    assert second.history.artefact(again, "tour") == tour
    second.jobs.close()
    second.history.close()


def test_a_job_that_was_cut_short_by_a_crash_is_told_so(tmp_path: Path) -> None:
    history = History(tmp_path / "h.sqlite")
    history.add("a", "x", SHORT, 1.0)
    history.set_state("a", JobState.RUNNING)
    history.close()
    history = History(tmp_path / "h.sqlite")
    history.mark_unfinished_interrupted()
    found = history.get("a")
    assert found is not None
    assert found.state is JobState.INTERRUPTED
    assert found.task == SHORT
    history.close()


def test_forgetting_a_job_removes_the_file_that_only_it_used(studio: Studio) -> None:
    shared, own = (studio.folder.add_input("map.csv", b"x,y\n1,2\n") for _ in range(2))
    first, second, third = (
        studio.jobs.start(Task("solve", (source,), options={"units": "mm"})) for source in (shared, shared, own)
    )
    for job in (first, second, third):
        studio.jobs.wait(job)
    studio.jobs.delete(first)
    studio.jobs.delete(third)
    assert {p.name for p in studio.folder.inputs.iterdir()} == {shared}
    assert [r.id for r in studio.history.newest()] == [second]
    assert studio.history.artefacts(first) == {}


def test_a_history_of_leafcut_0_2_which_has_no_numbers_is_read_and_numbered(tmp_path: Path) -> None:
    file = tmp_path / "h.sqlite"
    history = History(file)
    history.add("a", "x", SHORT, 1.0)
    history.finish("a", JobState.DONE, answer={"n": 1})
    history.close()
    with closing(sqlite3.connect(file, isolation_level=None)) as data:
        data.execute("UPDATE job SET answer = ?", (zlib.compress(b'{"n": 1}'),))
        data.execute("PRAGMA user_version = 0")
        data.execute("ALTER TABLE job DROP COLUMN line_parts")
        data.execute("ALTER TABLE message DROP COLUMN parts")
    history = History(file)
    (job,) = history.newest()
    assert (job.task, job.state, history.answer("a")) == (SHORT, JobState.DONE, {"schema": 1, "n": 1})
    history.close()
    with closing(sqlite3.connect(file)) as data:
        assert data.execute("PRAGMA user_version").fetchone() == (HISTORY.current,)


def test_stored_messages_are_translated_and_their_english_text_is_searched(tmp_path: Path) -> None:
    refusal, step = Message("tool {} is unknown", 3), Message("pocket {} of {}: {}", 1, 2, Message("searching"))
    history = History(tmp_path / "h.sqlite")
    history.add("a", "x", SHORT, 1.0)
    history.finish("a", JobState.FAILED, line=refusal, answer={"error": [refusal]}, messages=[(0.5, step), (1.0, "x")])
    (job,) = history.find([SearchTerm("tool 3 is")], 1)
    (_, stored_step), (_, plain) = history.messages("a")
    table = {"tool {} is unknown": "herramienta {}", "pocket {} of {}: {}": "{1}: {0}, {2}", "searching": "s"}
    spanish = Words("es", {}, messages=table)
    assert (job.line, stored_step, plain) == ("tool 3 is unknown", "pocket 1 of 2: searching", "x")
    assert spanish.translate(job.line) == spanish.translate((history.answer("a") or {})["error"][0]) == "herramienta 3"
    assert spanish.translate(stored_step) == "2: 1, s"
    history.close()


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such modes")
@pytest.mark.parametrize("kept", [False, True])
def test_the_history_and_all_that_sqlite_keeps_beside_it_are_private(kept: bool, tmp_path: Path) -> None:
    """Whatever the umask of the shell, and also for files that an older version left open to all."""
    file = tmp_path / "h.sqlite"
    if kept:
        History(file).close()
        file.chmod(0o644)
    mask = os.umask(0)
    try:
        history = History(file)
        history.add("a", "x", SHORT, 1.0)
    finally:
        os.umask(mask)
    modes = {one.name: one.stat().st_mode & 0o777 for one in tmp_path.iterdir()}
    history.close()
    assert modes == {"h.sqlite": 0o600, "h.sqlite-wal": 0o600, "h.sqlite-shm": 0o600}


def test_a_damaged_history_is_set_aside(tmp_path: Path) -> None:
    file = tmp_path / "h.sqlite"
    file.write_bytes(b"no database at all" * 100)
    history = History(file)
    history.add("a", "x", SHORT, 1.0)
    history.finish("a", JobState.DONE, answer={"n": 1}, artefacts={"p": Artefact("p.nc", "text/plain", b"M2\n")})
    assert history.answer("a") == {"schema": 1, "n": 1}
    assert history.artefact("a", "p") == Artefact("p.nc", "text/plain", b"M2\n")
    history.close()
    assert len(list(tmp_path.glob("h.sqlite.damaged-*"))) == 1


def test_a_history_with_damaged_pages_is_set_aside_with_what_lies_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    history = History(path)
    for number in range(200):
        history.add(f"job{number}", "plate " * 50, Task("optimize", ("example:plate-10",)), float(number))
    history.close()
    data = bytearray(path.read_bytes())
    for page in range(8192, len(data), 4096):
        data[page : page + 300] = bytes(range(1, 256)) + bytes(45)
    path.write_bytes(data)
    path.with_name("h.sqlite-wal").write_bytes(b"left by a fall of the machine")
    history = History(path)
    assert history.newest() == []
    history.add("job", "plate", Task("optimize", ("example:plate-10",)), 1.0)
    history.close()
    assert list(tmp_path.glob("h.sqlite.damaged-*"))


def test_two_who_write_at_once_lose_nothing(tmp_path: Path) -> None:
    history = History(tmp_path / "h.sqlite")

    def write(name: str) -> None:
        for k in range(25):
            history.add(f"{name}{k}", "x", SHORT, float(k))
            history.finish(f"{name}{k}", JobState.DONE)

    threads = [threading.Thread(target=write, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(history.newest(1000)) == 75
    history.close()


def test_what_is_built_in_is_called_by_its_name(studio: Studio) -> None:
    assert task_title(SHORT, studio.folder) == "plate-10"
    assert task_title(Task("solve", ("random:9:1",)), studio.folder) == "random:9:1"


def test_a_time_that_has_not_changed_has_no_sign() -> None:
    assert [change_words(saved) for saved in (2.46, 0.04, -0.04, -1.0)] == [
        "−2.5\u00a0%",
        "0.0\u00a0%",
        "0.0\u00a0%",
        "+1.0\u00a0%",
    ]


def test_jobs_of_one_file_are_told_apart_by_machine_and_options(studio: Studio) -> None:
    words = words_of("en")
    chosen = {"machine": "haas-vf2", "thickness": "6mm", "bound": False, "preset": "default", "tools": "mine:shop"}
    task = Task("optimize", ("example:plate-10",), options=chosen)
    assert machine_and_changed_options(task, studio.folder, words) == [
        "haas-vf2",
        "Thickness 6\u00a0mm",
        "Lower bound off",
        "Tool library shop",
    ]
    assert machine_and_changed_options(Task("optimize", ("example:plate-10",)), studio.folder, words) == [
        "linuxcnc-mill"
    ]
    # A job of an older leafcut is still shown.
    older = Task("optimize", ("example:plate-10",), options={"an_option_of_old": "3", "thickness": "6mm"})
    assert machine_and_changed_options(older, studio.folder, words) == ["linuxcnc-mill", "Thickness 6\u00a0mm"]
    assert machine_and_changed_options(Task("optimize", ("a",), "cut"), studio.folder, words) == ["plasma-table"]
    assert machine_and_changed_options(Task("solve", ("random:9:1",), options={"seed": "2"}), studio.folder, words) == [
        "Random seed 2"
    ]


def test_messages_are_counted_also_when_only_the_last_are_kept() -> None:
    live = LiveJob("a", ReadyTask("optimize", ("a.dxf",), "auto", {}), ("a.dxf",), WORK)
    for number in range(1500):
        live.record_progress(Progress(f"pocket {number}"))
    assert (len(live.messages), live.said) == (1000, 1500)
    assert live.messages[-1][1] == "pocket 1499"


def test_what_a_run_tries_is_kept_by_its_name_with_what_came_of_it(studio: Studio) -> None:
    """Also for equal messages: they are a single message."""
    call = resolve_task(Task("optimize", ("example:plate-27",)), studio.folder)
    live = LiveJob("a", call, ("plate-27",), WORK)
    live.record_progress(Progress("trying both", trial=Trial("zigzag")))
    live.record_progress(Progress("trying both", trial=Trial("contour")))
    live.record_progress(Progress("trying both", 0.5, trial=Trial("zigzag", "41.2 s", 41.2)))
    assert live.tried == {"zigzag": ("41.2 s", 41.2), "contour": ("", None)}
    assert [words for _, words in live.messages] == ["trying both"]
