"""Saying that kernels are being compiled, on the first run of a machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from leafcut.kernels.calling import compile_seconds, listening

__all__ = ["EVERY_RUN", "FIRST_RUN", "announced", "compile_seconds"]

FIRST_RUN = "compiling (first run on this machine)"
EVERY_RUN = "compiling (again in every run: no writable folder for compiled code; set NUMBA_CACHE_DIR)"


class _Listener:
    """Calls back when the first compilation begins, and with what each one took."""

    def __init__(self, tell: Callable[[str], None], spent: Callable[[float], None]) -> None:
        self.tell, self.told = tell, False
        self.spent, self.start = spent, 0.0

    def began(self, kept: bool) -> None:
        if not self.told:
            self.told = True
            self.tell(FIRST_RUN if kept else EVERY_RUN)
        self.start = time.perf_counter()

    def ended(self) -> None:
        self.spent(time.perf_counter() - self.start)


@contextmanager
def announced(tell: Callable[[str], None], spent: Callable[[float], None] = lambda _: None) -> Iterator[None]:
    """Call `tell` once, with what to say, if any kernel has to be compiled inside.

    `spent` is called with the seconds that each time took.

    Kernels found on disk are not compiled.
    """
    with listening(_Listener(tell, spent)):
        yield
