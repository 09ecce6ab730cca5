"""Time to load and compile kernels, number of compilations, and the message on the first run.

This module does not load Numba, which is slow. Invalid files and options are therefore refused at once.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from leafcut.kernels import COMPILE, PREPARE, cache_folder, listeners
from leafcut.message import Message

FIRST_RUN = Message("compiling (first run on this machine)")
EVERY_RUN = Message("compiling (again in every run: no writable folder for compiled code; set NUMBA_CACHE_DIR)")


class Compilations:
    """Counts compilations of kernels, and measures the total time to load and compile them.

    Kernels that only other kernels call count as well. Overlapping times count once.
    """

    def __init__(self, on_start: Callable[[Message], None] = lambda _: None) -> None:
        """Start counting; `on_start` receives a message for the user when the first compilation starts."""
        self.count = 0
        self._on_start = on_start
        self._spent, self._began, self._depth = 0.0, 0.0, 0
        self._lock = threading.Lock()

    @property
    def kept(self) -> bool:
        """Whether the next run will find compiled code on disk."""
        return cache_folder() is not None

    def note(self, kind: str, starts: bool) -> None:
        """Record the start or the end of an event. The end of an event that started before this counter is ignored."""
        with self._lock:
            if kind == PREPARE:
                self._measure(starts)
            elif starts:
                self.count += 1
            first = kind == COMPILE and starts and self.count == 1
        if first:
            self._on_start(FIRST_RUN if self.kept else EVERY_RUN)

    def _measure(self, starts: bool) -> None:
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
        """Total time to load and compile kernels until now, s."""
        with self._lock:
            return self._spent + (time.perf_counter() - self._began if self._depth else 0.0)


#: All compilations in this process; search times exclude the time to load and compile kernels.
_of_process = Compilations()
listeners.append(_of_process.note)


def compile_seconds() -> float:
    """Return the total time that this process has spent on loading and compiling kernels, s."""
    return _of_process.seconds


@contextmanager
def announced_compilations(on_start: Callable[[Message], None]) -> Iterator[Compilations]:
    """Count the compilations in a ``with`` block.

    When the first compilation starts, `on_start` receives a message for the user.
    """
    compilations = Compilations(on_start)
    listeners.append(compilations.note)
    try:
        yield compilations
    finally:
        listeners.remove(compilations.note)
