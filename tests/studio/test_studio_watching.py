"""A job's search is looked at only while somebody looks, and held only while somebody studies it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from waiting import until

from leafcut import api
from leafcut.model.snapshot import Snapshot
from leafcut.studio.jobs import search_watch as watching
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.search_watch import Watch
from leafcut.studio.jobs.task import Task
from leafcut.studio.studio import Studio

MMAS = {"algorithm": "mmas", "iterations": "12", "threads": "1"}


class Search(threading.Thread):
    """Steps without end, each telling a watch, until it is to stop."""

    def __init__(self, watch: Watch) -> None:
        super().__init__(daemon=True)
        self.watch, self.steps, self.taken, self.over = watch, 0, 0, False

    def take(self) -> Snapshot:
        self.taken += 1
        return Snapshot(np.zeros((2, 2)), float(self.steps), None, self.steps, 0.0)

    def run(self) -> None:
        while not self.over:
            self.watch(self.take, True)
            self.steps += 1
            time.sleep(0.001)

    def rests(self) -> bool:
        """Return whether it makes no step in a while."""
        before = self.steps
        time.sleep(0.25)
        return self.steps == before


@pytest.fixture
def search() -> Iterator[Search]:
    made = Search(Watch(paused=True))
    made.start()
    yield made
    made.over = True
    made.watch.release()
    made.join(10)


def test_a_held_search_makes_a_step_when_told_and_no_other(search: Search) -> None:
    until(lambda: search.watch.can_hold)
    for wanted in (1, 2):
        assert search.rests()
        search.watch.look()
        search.watch.step()
        until(lambda wanted=wanted: search.steps == wanted)
    assert search.rests()
    assert search.watch.look()[1] is not None
    search.watch.pause(False)
    until(lambda: search.steps > 20)


def test_a_search_at_a_pace_makes_so_many_steps_a_second(search: Search) -> None:
    search.watch.go(20.0)
    search.watch.pause(False)
    began, before = time.perf_counter(), search.steps
    while time.perf_counter() < began + 1.0 or search.steps == before:
        search.watch.look()
        time.sleep(0.02)
    # A slow machine makes fewer.
    assert search.steps - before <= 20.0 * (time.perf_counter() - began) + 2
    search.watch.go(None)
    until(lambda: search.steps > 100)


def test_a_search_that_nobody_looks_at_is_neither_held_nor_seen(
    search: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watching, "LEFT_ALONE", 0.3)
    monkeypatch.setattr(watching, "LOOKS_AWAY", 0.2)
    until(lambda: search.steps > 20)  # it was held, and everybody went away
    taken = search.taken
    time.sleep(0.3)
    assert search.taken == taken
    search.watch.look()
    until(lambda: search.taken > taken)


def test_who_holds_a_search_does_not_wait_for_its_picture() -> None:
    """While a picture is taken of a search that is held, its buttons are answered: they are pressed by the server."""
    watch, taking, release, pressed = Watch(paused=True), threading.Event(), threading.Event(), threading.Event()

    def take() -> Snapshot:
        taking.set()
        release.wait(30)
        return Snapshot(np.zeros((2, 2)), 1.0, None, 0, 0.0)

    def press() -> None:
        watch.step()
        watch.pause(False)
        watch.go(None)
        pressed.set()

    held = threading.Thread(target=lambda: watch._hold(take), daemon=True)
    watch.look()
    held.start()
    assert taking.wait(30)
    threading.Thread(target=press, daemon=True).start()
    assert pressed.wait(20)
    release.set()
    held.join(30)
    assert not held.is_alive()


def test_a_search_that_is_to_end_is_held_no_more(search: Search) -> None:
    until(lambda: search.watch.can_hold)
    assert search.rests()
    search.watch.release()
    until(lambda: search.steps > 20)


def test_snapshots_are_not_taken_more_often_than_ten_times_a_second() -> None:
    watch, taken = Watch(), 0

    def take() -> Snapshot:
        nonlocal taken
        taken += 1
        return Snapshot(np.zeros((2, 2)), 1.0, None, 0, 0.0)

    began = time.perf_counter()
    while time.perf_counter() < began + 0.5:
        watch.look()
        watch(take, False)
    assert 1 <= taken <= 1 + (time.perf_counter() - began) / watching.EVERY


def test_a_job_studied_step_by_step_gives_what_the_command_line_gives(studio: Studio) -> None:
    job = studio.jobs.start(Task("solve", ("random:40:1",), options=MMAS), Watch(paused=True))
    live = studio.jobs.live(job)
    assert live is not None
    until(lambda: live.watch.look()[1] is not None)
    live.watch.step()
    until(lambda: (found := live.watch.look()[1]) is not None and found.iteration > 1)
    _, seen = live.watch.look()
    assert seen is not None
    assert seen.iteration == 2
    assert seen.pheromone is not None
    assert not live.state.over
    live.watch.pause(False)
    assert studio.jobs.wait(job, 60) is JobState.DONE
    answer = studio.history.answer(job)
    assert answer is not None
    assert answer["length"] == api.solve_file("random:40:1", **MMAS).solution.cost
    assert answer["iterations"] == 12


@pytest.mark.parametrize("end", ["stop", "cancel"])
def test_a_held_job_can_be_stopped_and_cancelled(studio: Studio, end: str) -> None:
    job = studio.jobs.start(Task("solve", ("random:40:1",), options=MMAS), Watch(paused=True))
    live = studio.jobs.live(job)
    assert live is not None
    until(lambda: live.watch.look()[1] is not None)
    getattr(studio.jobs, end)(job)
    assert studio.jobs.wait(job, 60) is (JobState.STOPPED if end == "stop" else JobState.CANCELLED)
