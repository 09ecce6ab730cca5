"""What reads in a thread can be ended wherever it is, also where it never looks up."""

from __future__ import annotations

import gc
import json
import threading
import weakref
from typing import Any

import pytest
import uvicorn
from own_loop import awaited
from websockets.exceptions import InvalidState

from leafcut.model.heartbeat import Progress
from leafcut.studio.jobs import jobs as room
from leafcut.studio.jobs.ending import Endable, Ended
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.task import Task
from leafcut.studio.server.app import _server
from leafcut.studio.studio import Studio

LONG_ENOUGH = 60.0


class Endless:
    """Reads for ever in plain Python and lets no error go, as a reader of another package may."""

    def __init__(self) -> None:
        self.begun, self.let_go = threading.Event(), threading.Event()

    def __call__(self, *_: Any) -> None:
        while not self.let_go.is_set():
            try:
                json.loads("[" * 50 + "]" * 50)
                self.begun.set()
            except Exception:
                continue


@pytest.fixture
def endless() -> Any:
    reader = Endless()
    yield reader
    reader.let_go.set()


@pytest.mark.parametrize("how", ["cancel", "delete", "close"])
def test_a_job_that_reads_for_ever_is_ended(
    how: str, studio: Studio, endless: Endless, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By Cancel, by being forgotten, and by the end of the studio; the next job has its turn."""

    def run(call: Any, names: Any, tell: Any, *_: Any) -> Any:
        tell(Progress("reading"))
        endless()
        pytest.fail("it was not ended")

    with monkeypatch.context() as patched:
        patched.setattr(room, "run", run)
        job = studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3"}))
        assert endless.begun.wait(LONG_ENOUGH)
        live = studio.jobs.live(job)
        assert live is not None
        studio.jobs.close() if how == "close" else getattr(studio.jobs, how)(job)
        live.ended.result(LONG_ENOUGH)
    expected = {"cancel": JobState.CANCELLED, "close": JobState.INTERRUPTED}
    assert live.state is expected.get(how, live.state)


def test_a_job_is_ended_where_its_reading_is_in_a_callback_of_the_garbage_collector(
    studio: Studio, endless: Endless, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Others have such callbacks, as Hypothesis does; Python lets go of what is raised in one."""
    inside, reader = threading.Event(), list[int]()

    def callback(*_: Any) -> None:
        if threading.get_ident() not in reader or inside.is_set():
            return
        inside.set()
        while not endless.let_go.is_set():
            pass

    def run(call: Any, names: Any, tell: Any, *_: Any) -> Any:
        tell(Progress("reading"))
        reader.append(threading.get_ident())
        gc.collect()
        endless()
        pytest.fail("it was not ended")

    monkeypatch.setattr(room, "run", run)
    gc.callbacks.append(callback)
    try:
        job = studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3"}))
        assert inside.wait(LONG_ENOUGH)
        studio.jobs.cancel(job)
        assert studio.jobs.wait(job, LONG_ENOUGH) is JobState.CANCELLED
    finally:
        gc.callbacks.remove(callback)
    assert capsys.readouterr().err == ""


def test_what_does_not_read_is_not_ended_anywhere(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    """A search or a compiler looks up by itself; it holds what others use."""
    begun, cancelled = threading.Event(), threading.Event()
    through: list[bool] = []

    def run(call: Any, names: Any, tell: Any, *_: Any) -> Any:
        tell(Progress("reading"))
        tell(Progress("searching"))
        begun.set()
        cancelled.wait(LONG_ENOUGH)
        through.append(True)
        tell(Progress("searching", 0.5))

    monkeypatch.setattr(room, "run", run)
    job = studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3"}))
    assert begun.wait(LONG_ENOUGH)
    studio.jobs.cancel(job)
    cancelled.set()
    assert studio.jobs.wait(job, LONG_ENOUGH) is JobState.CANCELLED
    assert through == [True]


@pytest.mark.parametrize(
    "task", [Task("solve", ("random:60:1",)), Task("study", ("random:60:1",), algorithms=("mmas",), runs=1)]
)
def test_a_search_that_has_told_nothing_yet_is_not_ended_anywhere(
    task: Task, studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was read; the search starts threads and holds what others use before it tells of its first step."""
    begun, cancelled = threading.Event(), threading.Event()
    through: list[bool] = []

    def solve(*arguments: Any, **named: Any) -> Any:
        begun.set()
        cancelled.wait(LONG_ENOUGH)
        for _ in range(1000):
            json.loads("[]")
        through.append(True)
        raise AssertionError("it has seen enough")

    monkeypatch.setattr("leafcut.order.solve.solve", solve)
    job = studio.jobs.start(task)
    assert begun.wait(LONG_ENOUGH)
    studio.jobs.cancel(job)
    cancelled.set()
    assert studio.jobs.wait(job, LONG_ENOUGH) is JobState.CANCELLED
    assert through == [True]


def test_what_python_lets_go_of_is_raised_again(endless: Endless, capsys: pytest.CaptureFixture[str]) -> None:
    """In the callback of a weak reference, or in `__del__`, Python tells of an exception and goes on."""
    endable, inside, ended = Endable(), threading.Event(), list[bool]()

    def callback(_: Any) -> None:
        inside.set()
        while not endless.let_go.is_set():
            pass

    def work() -> None:
        try:
            with endable:
                seen = Endless()
                kept = weakref.ref(seen, callback)
                del seen
                endless(kept)
        except Ended:
            ended.append(True)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    assert inside.wait(LONG_ENOUGH)
    endable.end()
    assert endless.begun.wait(LONG_ENOUGH)  # out of the callback, where the first one was lost
    thread.join(LONG_ENOUGH)
    assert ended == [True]
    assert capsys.readouterr().err == ""


def test_a_thread_that_is_being_started_is_started_before_who_starts_it_is_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else `Thread.start` would wait for it for ever, with the lock that all pools of threads share."""
    starting, go_on, reading = threading.Event(), threading.Event(), [True]
    came: list[str] = []
    start = threading._start_new_thread  # type: ignore[attr-defined]

    def start_late(*arguments: Any) -> int:
        starting.set()
        go_on.wait(LONG_ENOUGH)
        for _ in range(1000):
            json.loads("[]")
        number: int = start(*arguments)
        return number

    endable = Endable()

    def work() -> None:
        try:
            with endable:
                monkeypatch.setattr(threading, "_start_new_thread", start_late)
                threading.Thread(target=lambda: came.append("started")).start()
                while reading:
                    pass
        except Ended:
            came.append("ended")

    thread = threading.Thread(target=work)
    thread.start()
    assert starting.wait(LONG_ENOUGH)
    monkeypatch.undo()
    endable.end()
    go_on.set()
    thread.join(LONG_ENOUGH)
    reading.clear()
    assert came == ["started", "ended"]


def test_a_preview_is_ended_where_another_is_wanted_and_before_it_began(endless: Endless) -> None:
    first, second = Endable(), Endable()
    ended: list[str] = []

    def work(endable: Endable) -> None:
        try:
            with endable:
                endless()
        except Ended:
            ended.append("ended")

    thread = threading.Thread(target=work, args=(first,))
    thread.start()
    assert endless.begun.wait(LONG_ENOUGH)
    first.end()
    thread.join(LONG_ENOUGH)
    second.end()
    work(second)
    assert ended == ["ended", "ended"]
    first.end()  # it is left: nothing is raised here or later
    assert not endless.let_go.is_set()


@pytest.mark.parametrize("file", ["/any/numba/core/dispatcher.py", "/any/llvmlite/binding/executionengine.py"])
def test_compiled_code_is_loaded_whole_before_its_thread_is_ended(file: str) -> None:
    """Where the library that loads it calls Python back, an error is printed by Python itself, and ends nothing."""
    begun, go_on = threading.Event(), threading.Event()
    code = compile("def load():\n    begun.set()\n    go_on.wait(60)\n    loaded.append(True)\n", file, "exec")
    names: dict[str, Any] = {"begun": begun, "go_on": go_on, "loaded": []}
    exec(code, names)
    endable, ended = Endable(), []
    reading = [True]

    def work() -> None:
        try:
            with endable:
                names["load"]()
                while reading:  # and holds no lock, which would stay locked
                    pass
        except Ended:
            ended.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    assert begun.wait(LONG_ENOUGH)
    endable.end()
    go_on.set()
    thread.join(LONG_ENOUGH)
    reading.clear()
    assert names["loaded"] == [True]
    assert ended == [True]


def test_the_end_waits_for_a_connection_that_is_just_closing(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    """The server under it fails then, as it cannot close what is closing; it did so once in some thousand ends."""
    asked: list[object] = []

    async def ends(self: uvicorn.Server, sockets: object = None) -> None:
        asked.append(sockets)
        if len(asked) < 3:
            raise InvalidState("connection is closing")

    monkeypatch.setattr(uvicorn.Server, "shutdown", ends)
    server = _server(uvicorn.Config(lambda: None), studio)
    awaited(server.shutdown())
    assert len(asked) == 3
    assert studio.jobs.closed
