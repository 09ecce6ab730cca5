"""Lets pages observe the search of a job: `Watch` is used by the pages, `PageObserver` by the process of the search."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from leafcut.model.snapshot import Observer, Snapshot
from leafcut.model.study import Iteration, Study

#: Minimum interval between snapshots in seconds, and as a multiple of the time that a snapshot takes.
EVERY, TIMES_AS_LONG = 0.1, 10.0
#: Minimum interval between snapshots per point of the path, s. It allows for transfer and drawing.
PER_PLACE = 3e-6
#: Times without a request after which a page counts as closed, and after which a paused search continues, s.
LOOKS_AWAY, LEFT_ALONE = 1.0, 30.0
#: Maximum number of iterations in a snapshot.
_MAX_ITERATIONS = 300


#: The search's answer to `PageObserver.look`.
LOOKED = "looked"


@dataclass(frozen=True, eq=False)
class Picture:
    """A snapshot of a running search, which pages can display.

    Attributes
    ----------
    can_hold
        Whether the search can be paused.
    iterations
        A selection of the recorded iterations, which includes the last iteration. It is empty if the search does not
        record iterations.
    """

    snapshot: Snapshot
    can_hold: bool
    iterations: list[Iteration]


class Watch:
    """Controls how the pages of the studio show the running search of a job.

    Attributes
    ----------
    speed
        Maximum number of steps per second, or None for no limit.
    paused
        Whether the search is paused.
    number, picture
        Number and content of the latest picture. They are 0 and None before the first picture.
    """

    def __init__(self, speed: float | None = None, paused: bool = False) -> None:
        self.speed, self.paused = speed, paused
        self.number, self.picture = 0, None  # type: int, Picture | None
        self._send: Callable[..., None] = lambda *_: None
        self._looked, self._answered = 0.0, True

    def connect(self, send: Callable[..., None]) -> None:
        """Set the function that calls a method of the `PageObserver`, and use it to send the current settings."""
        self._send = send
        send("go", self.speed)
        send("pause", self.paused)

    def store_message(self, message: Picture | str) -> None:
        """Store a picture from the search, or note its answer `LOOKED`."""
        if isinstance(message, Picture):
            self.picture = message
            self.number += 1
        else:
            self._answered = True

    def poll(self) -> tuple[int, Snapshot | None]:
        """Return the number and the content of the latest snapshot, and let the search know that a page is open."""
        now = time.perf_counter()
        # During a long computation, the search does not answer. Further messages would fill the pipe.
        if self._answered and now - self._looked > 0.5 * LOOKS_AWAY:
            self._looked, self._answered = now, False
            self._send("look")
        picture = self.picture
        return self.number, None if picture is None else picture.snapshot

    @property
    def can_pause(self) -> bool:
        """Whether the search can be paused."""
        return self.picture is not None and self.picture.can_hold

    def pause(self, paused: bool) -> None:
        """Pause the search before its next step, or let it continue."""
        self.paused = paused
        self._send("pause", paused)

    def step(self) -> None:
        """Let the search make one step, then pause it."""
        self.paused = True
        self._send("step")

    def go(self, speed: float | None) -> None:
        """Set the speed in steps per second, or None for no limit."""
        self.speed = speed
        self._send("go", speed)


class PageObserver(Observer):
    """Observes a search and is controlled by a `Watch` in another process.

    The observer takes snapshots only while a page is open. It can pause the search between two steps, or limit the
    number of steps per second. `study` records the iterations of the search. It is None if iterations are not recorded.
    """

    def __init__(self, send: Callable[[Any], None]) -> None:
        self._send = send
        self._changed = threading.Condition()
        self._speed: float | None = None
        self._paused = self._released = False
        self._steps = self._number = 0
        self._looked, self._next, self._stepped = time.perf_counter(), 0.0, 0.0
        self.study: Study | None = None

    def show(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Take a snapshot if a page is open, and pause the search if the user has requested this.

        `take` returns a snapshot. If `alone` is set, this call blocks the entire search and can therefore pause it.
        """
        now = time.perf_counter()
        on_hold = alone and (self._paused or self._speed is not None) and not self._released
        if now - self._looked < LOOKS_AWAY and (now >= self._next or (on_hold and self._paused)):
            self._send_snapshot(take, alone, now)
        if on_hold:
            self._hold(take)

    def look(self) -> None:
        """Record that a page is open."""
        self._looked = time.perf_counter()
        self._send(LOOKED)

    def pause(self, paused: bool) -> None:
        """Pause the search before its next step, or let it continue."""
        with self._changed:
            self._paused, self._steps = paused, 0
            self._changed.notify_all()

    def step(self) -> None:
        """Let the search make one step, then pause it."""
        with self._changed:
            self._steps = self._steps + 1 if self._paused else 0
            self._paused = True
            self._changed.notify_all()

    def go(self, speed: float | None) -> None:
        """Set the speed in steps per second, or None for no limit."""
        with self._changed:
            self._speed = speed
            self._changed.notify_all()

    def release(self) -> None:
        """Never pause the search again, so that it can finish."""
        with self._changed:
            self._released = True
            self._changed.notify_all()

    def _send_snapshot(self, take: Callable[[], Snapshot], can_hold: bool, now: float) -> None:
        snapshot = take()
        iterations = evenly_spaced_rows(self.study.iterations(), _MAX_ITERATIONS) if self.study is not None else []
        self._send(Picture(snapshot, can_hold, iterations))
        self._number += 1
        duration = time.perf_counter() - now
        self._next = now + max(EVERY, TIMES_AS_LONG * duration, PER_PLACE * len(snapshot.path))

    def _hold(self, take: Callable[[], Snapshot]) -> None:
        seen = self._number
        while self._wait_if_early():
            if self._number == seen and time.perf_counter() - self._looked < LOOKS_AWAY:
                # A page was opened during the pause. Taking a snapshot of a large map lasts a second.
                self._send_snapshot(take, True, time.perf_counter())
        self._stepped = time.perf_counter()

    def _wait_if_early(self) -> bool:
        """If it is too early for the next step, wait briefly. Return whether it was necessary to wait."""
        with self._changed:
            if self._released or time.perf_counter() - self._looked >= LEFT_ALONE:
                return False
            if self._paused and self._steps:
                self._steps -= 1
                return False
            rest = 0.0 if self._speed is None else self._stepped + 1.0 / self._speed - time.perf_counter()
            if not self._paused and rest <= 0.0:
                return False
            self._changed.wait(min(rest, EVERY) if not self._paused else EVERY)
            return True


def evenly_spaced_rows(rows: list[Any], limit: int) -> list[Any]:
    """Select about `limit` evenly spaced rows, including the last row."""
    kept = rows[:: len(rows) // limit + 1]
    return kept if not rows or kept[-1] is rows[-1] else [*kept, rows[-1]]
