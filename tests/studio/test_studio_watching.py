"""A watch takes snapshots of a search only for a page, and holds the search only while a page studies it."""

from __future__ import annotations

import csv
import io
import json
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from waiting import until

from leafcut import api
from leafcut.model.snapshot import Snapshot
from leafcut.studio.jobs import search_watch as watching
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.search_watch import PageObserver, Picture, Watch
from leafcut.studio.jobs.task import Task
from leafcut.studio.studio import Studio

MMAS = {"algorithm": "mmas", "iterations": "12", "threads": "1"}


class Clock:
    """The time of a `PageObserver`: it advances when the search waits, and then `on_wait` is called."""

    def __init__(self) -> None:
        self.now, self.waits = 1000.0, 0
        self.on_wait: Callable[[], object] = lambda: None

    def perf_counter(self) -> float:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.waits += 1
        self.on_wait()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Replace the clock of `PageObserver` and its waiting."""
    made = Clock()

    class Condition:
        wait = staticmethod(made.wait)

        def __enter__(self) -> None: ...

        def __exit__(self, *_: object) -> None: ...

        def notify_all(self) -> None: ...

    monkeypatch.setattr(watching, "time", made)
    monkeypatch.setattr(watching, "threading", SimpleNamespace(Condition=Condition))
    return made


class Pictures:
    """Takes snapshots and counts them."""

    def __init__(self) -> None:
        self.taken = 0

    def __call__(self) -> Snapshot:
        self.taken += 1
        return Snapshot(np.zeros((2, 2)), 1.0, None, 0, 0.0)


def observer(speed: float | None = None, paused: bool = False, sent: list[Any] | None = None) -> PageObserver:
    """Return an observer that a page has just opened with these settings."""
    made = PageObserver(([] if sent is None else sent).append)
    made.go(speed)
    made.pause(paused)
    return made


def test_a_paused_search_makes_one_step_per_request(clock: Clock) -> None:
    """A page looks at each wait and requests a step at each fifth."""
    sent: list[Any] = []
    watch = observer(paused=True, sent=sent)

    def page() -> None:
        watch.look()
        if clock.waits % 5 == 0:
            watch.step()

    clock.on_wait = page
    for step in (1, 2, 3):
        watch.show(Pictures(), True)
        assert clock.waits == 5 * step
    assert any(isinstance(message, Picture) and message.can_hold for message in sent)
    watch.pause(False)
    watch.show(Pictures(), True)
    assert clock.waits == 15


def test_a_search_with_a_speed_makes_that_many_steps_per_second(clock: Clock) -> None:
    watch = observer(speed=20.0)
    clock.on_wait = watch.look
    start = clock.now
    for _ in range(41):
        watch.show(Pictures(), True)
    assert clock.now - start == pytest.approx(40 / 20.0)
    watch.go(None)
    waits = clock.waits
    for _ in range(100):
        watch.show(Pictures(), True)
    assert clock.waits == waits


def test_a_search_without_a_page_is_neither_held_nor_seen(clock: Clock) -> None:
    watch, take = observer(paused=True), Pictures()
    start = clock.now
    watch.show(take, True)
    assert watching.LEFT_ALONE <= clock.now - start < watching.LEFT_ALONE + 2 * watching.EVERY
    taken, waits = take.taken, clock.waits
    watch.show(take, True)
    assert (take.taken, clock.waits) == (taken, waits)
    watch.look()
    watch.show(take, False)
    assert take.taken == taken + 1


def test_the_buttons_of_a_held_search_are_answered_while_a_snapshot_is_taken() -> None:
    watch, taking, release, pressed = observer(paused=True), threading.Event(), threading.Event(), threading.Event()

    def take() -> Snapshot:
        taking.set()
        release.wait(600)
        return Snapshot(np.zeros((2, 2)), 1.0, None, 0, 0.0)

    def press() -> None:
        watch.step()
        watch.pause(False)
        watch.go(None)
        pressed.set()

    held = threading.Thread(target=lambda: watch._hold(take), daemon=True)
    watch.look()
    held.start()
    assert taking.wait(120)
    threading.Thread(target=press, daemon=True).start()
    assert pressed.wait(120)
    release.set()
    held.join(120)
    assert not held.is_alive()


def test_a_released_search_is_held_no_more(clock: Clock) -> None:
    watch = observer(paused=True)

    def page() -> None:
        watch.look()
        if clock.waits == 3:
            watch.release()

    clock.on_wait = page
    for _ in range(20):
        watch.show(Pictures(), True)
    assert clock.waits == 3


def test_snapshots_are_at_least_a_tenth_of_a_second_apart(clock: Clock) -> None:
    """A snapshot that takes 0.05 s is taken every 0.5 s only."""
    watch, take = observer(), Pictures()

    def slow() -> Snapshot:
        clock.now += 0.05
        return take()

    for picture, expected in ((take, 10), (slow, 2)):
        take.taken = 0
        end = clock.now + 1.0
        while clock.now < end:
            watch.look()
            watch.show(picture, False)
            clock.now += 0.001
        assert take.taken == pytest.approx(expected, abs=1)


def test_a_job_studied_step_by_step_gives_what_the_command_line_gives(studio: Studio) -> None:
    job = studio.jobs.start(Task("solve", ("random:40:1",), options=MMAS), Watch(paused=True))
    live = studio.jobs.find_live_job(job)
    assert live is not None
    until(lambda: live.watch.poll()[1] is not None)
    live.watch.step()
    until(lambda: (found := live.watch.poll()[1]) is not None and found.iteration > 1)
    _, seen = live.watch.poll()
    assert seen is not None
    assert seen.iteration == 2
    assert seen.pheromone is not None
    assert not live.state.is_over
    live.watch.pause(False)
    assert studio.jobs.wait(job, 60) is JobState.DONE
    answer = studio.history.answer(job)
    assert answer is not None
    assert answer["length"] == api.solve("random:40:1", **MMAS).solution.cost
    assert answer["iterations"] == 12


@pytest.mark.parametrize("end", ["stop", "cancel"])
def test_a_held_job_can_be_stopped_and_cancelled(own_studio: Studio, end: str) -> None:
    studio = own_studio
    job = studio.jobs.start(Task("solve", ("random:40:1",), options=MMAS), Watch(paused=True))
    live = studio.jobs.find_live_job(job)
    assert live is not None
    until(lambda: live.watch.poll()[1] is not None)
    getattr(studio.jobs, end)(job)
    assert studio.jobs.wait(job, 60) is (JobState.STOPPED if end == "stop" else JobState.CANCELLED)


def test_a_search_that_does_not_answer_is_not_flooded_by_the_looks_of_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, sent = Clock(), list[tuple[Any, ...]]()
    monkeypatch.setattr(watching, "time", clock)
    watch = Watch()
    watch.connect(lambda *message: sent.append(message))
    for looks in (1, 2):
        for _ in range(100):
            clock.now += 1.0
            watch.poll()
        assert sent.count(("look",)) == looks
        watch.store_message(watching.LOOKED)


def test_the_iterations_of_an_algorithm_of_the_literature_are_stored_and_of_no_other(studio: Studio) -> None:
    options = {"iterations": "5", "threads": "1", "local_search": False, "n_ants": "4"}
    job = studio.jobs.start(Task("solve", ("random:30:1",), options={**options, "algorithm": "mmas"}))
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
