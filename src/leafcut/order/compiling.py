"""Compile time of kernels: seconds, number, and the line that a user sees on the first run of a machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event

from leafcut.kernels import cache_folder

FIRST_RUN = "compiling (first run on this machine)"
EVERY_RUN = "compiling (again in every run: no writable folder for compiled code; set NUMBA_CACHE_DIR)"

_EVENT = "numba:compile"


class Compilations(event.Listener):  # type: ignore[misc]  # numba has no types
    """Counts compilations and their seconds; nested and parallel compilations count their seconds once.

    Attributes
    ----------
    count
        Compiled kernels, those included that only kernels call. Kernels found on disk are not compiled.
    """

    def __init__(self, tell: Callable[[str], None] = lambda _: None) -> None:
        """Prepare to count; `tell` is called with a line for the user when the first compilation begins."""
        self.count = 0
        self._tell = tell
        self._spent, self._began, self._depth = 0.0, 0.0, 0
        self._lock = threading.Lock()

    @property
    def kept(self) -> bool:
        """Whether the next run finds compiled code on disk."""
        return cache_folder() is not None

    def on_start(self, event: event.Event) -> None:
        """Begin a compilation."""
        with self._lock:
            self.count += 1
            self._depth += 1
            if self._depth == 1:
                self._began = time.perf_counter()
            first = self.count == 1
        if first:
            self._tell(FIRST_RUN if self.kept else EVERY_RUN)

    def on_end(self, event: event.Event) -> None:
        """End a compilation; one that had begun before this listener was registered is not counted."""
        with self._lock:
            if self._depth:
                self._depth -= 1
                if not self._depth:
                    self._spent += time.perf_counter() - self._began

    @property
    def seconds(self) -> float:
        """Seconds until now."""
        with self._lock:
            return self._spent + (time.perf_counter() - self._began if self._depth else 0.0)


#: All compilations of this process: the clock of searches stands still during them.
_of_process = Compilations()
event.register(_EVENT, _of_process)


def compile_seconds() -> float:
    """Return the seconds that this process has spent compiling kernels until now."""
    return _of_process.seconds


@contextmanager
def announced(tell: Callable[[str], None]) -> Iterator[Compilations]:
    """Count the compilations inside; `tell` is called once, with a line for the user, when the first one begins."""
    with event.install_listener(_EVENT, Compilations(tell)) as compilations:
        yield compilations
