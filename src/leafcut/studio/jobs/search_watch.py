"""`Watch`: looks at a job's search for the pages that show it, and holds it for those who study it step by step."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from leafcut.model.snapshot import Snapshot

#: Least seconds between two snapshots, and how many times longer than taking one: a large map is looked at less often.
EVERY, TIMES_AS_LONG = 0.1, 10.0
#: Seconds per place of a path that two snapshots are apart besides: for the way to the browser and the drawing of it.
PER_PLACE = 3e-6
#: Seconds after which a page that said nothing is taken to look no longer; a search that is held goes on then.
LOOKS_AWAY, LEFT_ALONE = 1.0, 30.0


class Watch:
    """The observer of a job: called by its search, looked at by pages.

    Nothing is taken while nobody looks. A search is held between two steps while `paused`, and slowed down to `speed`
    steps a second where that is not None.
    """

    def __init__(self, speed: float | None = None, paused: bool = False) -> None:
        self._changed = threading.Condition()
        self._speed, self._paused = speed, paused
        self._steps = 0
        self._released = False
        self._looked, self._next, self._stepped = time.perf_counter(), 0.0, 0.0
        self.latest: Snapshot | None = None
        #: Of the latest snapshot, from 1.
        self.number = 0
        #: Whether the search can be held: it waits while it is looked at.
        self.can_hold = False

    def __call__(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Look, if anybody wants to see it, and hold the search if it is to wait."""
        self.can_hold = alone
        now = time.perf_counter()
        held = alone and (self._paused or self._speed is not None) and not self._released
        if now - self._looked < LOOKS_AWAY and (now >= self._next or (held and self._paused)):
            self._see(take, now)
        if held:
            self._hold(take)

    def look(self) -> tuple[int, Snapshot | None]:
        """Return number and snapshot of the last look; say that somebody is looking."""
        self._looked = time.perf_counter()
        return self.number, self.latest

    @property
    def paused(self) -> bool:
        """Whether the search is to wait."""
        return self._paused

    @property
    def speed(self) -> float | None:
        """Steps a second, None for as many as there can be."""
        return self._speed

    def pause(self, paused: bool) -> None:
        """Hold the search before its next step, or let it go on."""
        with self._changed:
            self._paused, self._steps = paused, 0
            self._changed.notify_all()

    def step(self) -> None:
        """Let a held search make one step; one that is not held is held after its step."""
        with self._changed:
            self._steps = self._steps + 1 if self._paused else 0
            self._paused = True
            self._changed.notify_all()

    def go(self, speed: float | None) -> None:
        """Let the search make so many steps a second, or as many as it can."""
        with self._changed:
            self._speed = speed
            self._changed.notify_all()

    def release(self) -> None:
        """Never hold the search again: it is to end."""
        with self._changed:
            self._released = True
            self._changed.notify_all()

    def _see(self, take: Callable[[], Snapshot], now: float) -> None:
        self.latest = take()
        self.number += 1
        took = time.perf_counter() - now
        self._next = now + max(EVERY, TIMES_AS_LONG * took, PER_PLACE * len(self.latest.path))

    def _hold(self, take: Callable[[], Snapshot]) -> None:
        """Return when the next step may be made."""
        seen = self.number
        while self._waits():
            if self.number == seen and time.perf_counter() - self._looked < LOOKS_AWAY:
                # Somebody came to look while it stood still. A large map takes a second: nobody may wait for it.
                self._see(take, time.perf_counter())
        self._stepped = time.perf_counter()

    def _waits(self) -> bool:
        """Wait a moment, if the next step may not be made yet; return whether that was so."""
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
