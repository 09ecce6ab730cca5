"""Number and duration of kernel compilations, and the message shown on the first run on a machine."""

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
    """Counts compilations and measures their total time; overlapping compilations are counted once in the time.

    Attributes
    ----------
    count
        Number of compiled kernels, including those called only by other kernels. Kernels loaded from disk do not count.
    """

    def __init__(self, tell: Callable[[str], None] = lambda _: None) -> None:
        """Start at zero; `tell` receives a message for the user when the first compilation starts."""
        self.count = 0
        self._tell = tell
        self._spent, self._began, self._depth = 0.0, 0.0, 0
        self._lock = threading.Lock()

    @property
    def kept(self) -> bool:
        """Whether the next run finds compiled code on disk."""
        return cache_folder() is not None

    def on_start(self, event: event.Event) -> None:
        """Count a compilation that starts."""
        with self._lock:
            self.count += 1
            self._depth += 1
            if self._depth == 1:
                self._began = time.perf_counter()
            first = self.count == 1
        if first:
            self._tell(FIRST_RUN if self.kept else EVERY_RUN)

    def on_end(self, event: event.Event) -> None:
        """Add the time of a compilation that ends; it is ignored if it started before this listener was registered."""
        with self._lock:
            if self._depth:
                self._depth -= 1
                if not self._depth:
                    self._spent += time.perf_counter() - self._began

    @property
    def seconds(self) -> float:
        """Total compile time so far, s."""
        with self._lock:
            return self._spent + (time.perf_counter() - self._began if self._depth else 0.0)


#: All compilations of this process; search clocks exclude them.
_of_process = Compilations()
event.register(_EVENT, _of_process)


def compile_seconds() -> float:
    """Return the total time that this process has spent compiling kernels, s."""
    return _of_process.seconds


@contextmanager
def announced(tell: Callable[[str], None]) -> Iterator[Compilations]:
    """Count the compilations in the block; `tell` receives a message for the user when the first one starts."""
    with event.install_listener(_EVENT, Compilations(tell)) as compilations:
        yield compilations
