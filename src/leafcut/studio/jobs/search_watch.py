"""`Watch`: observes the search of a job for pages, and pauses or slows it for study."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from leafcut.model.snapshot import Snapshot

#: Minimum interval between snapshots: s, and as a multiple of the time for taking a snapshot.
EVERY, TIMES_AS_LONG = 0.1, 10.0
#: Extra interval per point of the path, s, for transfer and drawing.
PER_PLACE = 3e-6
#: Time without a request after which a page counts as closed, and after which a held search continues, s.
LOOKS_AWAY, LEFT_ALONE = 1.0, 30.0


class Watch:
    """Observer of a job, called by its search and polled by pages.

    It takes no snapshots while no page is open. A search waits between two steps while `paused`, and is slowed down to
    `speed` steps per second unless that is None.
    """

    def __init__(self, speed: float | None = None, paused: bool = False) -> None:
        self._changed = threading.Condition()
        self._speed, self._paused = speed, paused
        self._steps = 0
        self._released = False
        self._looked, self._next, self._stepped = time.perf_counter(), 0.0, 0.0
        self.latest: Snapshot | None = None
        #: Number of the latest snapshot, from 1.
        self.number = 0
        #: Whether the search can be held, as it waits during a snapshot.
        self.can_hold = False

    def __call__(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Take a snapshot if a page is open, and hold the search if requested."""
        self.can_hold = alone
        now = time.perf_counter()
        on_hold = alone and (self._paused or self._speed is not None) and not self._released
        if now - self._looked < LOOKS_AWAY and (now >= self._next or (on_hold and self._paused)):
            self._see(take, now)
        if on_hold:
            self._hold(take)

    def poll(self) -> tuple[int, Snapshot | None]:
        """Return number and content of the latest snapshot, and note that a page is open."""
        self._looked = time.perf_counter()
        return self.number, self.latest

    @property
    def paused(self) -> bool:
        """Whether the search shall wait."""
        return self._paused

    @property
    def speed(self) -> float | None:
        """Steps per second; None for no limit."""
        return self._speed

    def pause(self, paused: bool) -> None:
        """Hold the search before its next step, or continue."""
        with self._changed:
            self._paused, self._steps = paused, 0
            self._changed.notify_all()

    def step(self) -> None:
        """Make one step and hold the search after it."""
        with self._changed:
            self._steps = self._steps + 1 if self._paused else 0
            self._paused = True
            self._changed.notify_all()

    def go(self, speed: float | None) -> None:
        """Set the speed in steps per second; None for no limit."""
        with self._changed:
            self._speed = speed
            self._changed.notify_all()

    def release(self) -> None:
        """Never hold the search again, so that it can end."""
        with self._changed:
            self._released = True
            self._changed.notify_all()

    def _see(self, take: Callable[[], Snapshot], now: float) -> None:
        self.latest = take()
        self.number += 1
        duration = time.perf_counter() - now
        self._next = now + max(EVERY, TIMES_AS_LONG * duration, PER_PLACE * len(self.latest.path))

    def _hold(self, take: Callable[[], Snapshot]) -> None:
        """Return when the next step may start."""
        seen = self.number
        while self._waits():
            if self.number == seen and time.perf_counter() - self._looked < LOOKS_AWAY:
                # A page was opened during the pause. A snapshot of a large map takes a second, so take it here.
                self._see(take, time.perf_counter())
        self._stepped = time.perf_counter()

    def _waits(self) -> bool:
        """Wait briefly if the next step may not start yet; return whether it had to wait."""
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
