"""Measure the time spent on loading and compiling kernels, count compilations, and announce the first compilation.

Numba is slow to load, so this module does not load it. Invalid files and options can therefore be rejected without
delay.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from leafcut.kernels import COMPILE, PREPARE, cache_folder, listeners
from leafcut.message import Message

FIRST_RUN = Message("compiling (once for each kind of job)")
EVERY_RUN = Message("compiling (again in every run: no writable folder for compiled code; set NUMBA_CACHE_DIR)")


class Compilations:
    """Counts compilations of kernels and measures the total time spent on loading and compiling them.

    Kernels that only other kernels call are included. If several compilations overlap, the time counts once.
    """

    def __init__(self, on_start: Callable[[Message], None] = lambda _: None) -> None:
        """Start counting. When the first compilation starts, `on_start` receives a message for the user."""
        self.count = 0
        self._on_start = on_start
        self._spent, self._began, self._depth = 0.0, 0.0, 0
        self._lock = threading.Lock()

    @property
    def is_cached(self) -> bool:
        """Whether the next run can load the compiled code from disk."""
        return cache_folder() is not None

    def record_event(self, kind: str, starts: bool) -> None:
        """Record the start or the end of an event. If an event started before this counter, its end is ignored."""
        with self._lock:
            if kind == PREPARE:
                self._start_or_stop_clock(starts)
            elif starts:
                self.count += 1
            first = kind == COMPILE and starts and self.count == 1
        if first:
            self._on_start(FIRST_RUN if self.is_cached else EVERY_RUN)

    def _start_or_stop_clock(self, starts: bool) -> None:
        if starts:
            self._depth += 1
            if self._depth == 1:
                self._began = time.perf_counter()
        elif self._depth:
            self._depth -= 1
            if not self._depth:
                self._spent += time.perf_counter() - self._began

    @property
    def seconds(self) -> float:
        """Total time spent on loading and compiling kernels, in seconds."""
        with self._lock:
            return self._spent + (time.perf_counter() - self._began if self._depth else 0.0)


#: Counts all compilations in this process. Search times do not include the time spent on loading and compiling kernels.
_of_process = Compilations()
listeners.append(_of_process.record_event)


def compile_seconds() -> float:
    """Return the total time that this process has spent on loading and compiling kernels, in seconds."""
    return _of_process.seconds


@contextmanager
def announced_compilations(on_start: Callable[[Message], None]) -> Iterator[Compilations]:
    """Count the compilations in a ``with`` block.

    When the first compilation starts, `on_start` receives a message for the user.
    """
    compilations = Compilations(on_start)
    listeners.append(compilations.record_event)
    try:
        yield compilations
    finally:
        listeners.remove(compilations.record_event)
