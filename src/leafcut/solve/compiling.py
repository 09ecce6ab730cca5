"""Saying that kernels are being compiled, on the first run of a machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from leafcut.kernels.keeping import not_kept

FIRST_RUN = "compiling (first run on this machine)"
EVERY_RUN = "compiling (again in every run: no writable folder for compiled code; set NUMBA_CACHE_DIR)"


class _Listener(event.Listener):  # type: ignore[misc]  # numba has no types
    """Calls back when the first compilation begins, and with what each one took."""

    def __init__(self, tell: Callable[[str], None], spent: Callable[[float], None]) -> None:
        self.tell, self.told, self.depth = tell, False, 0
        self.spent, self.began = spent, 0.0

    def on_start(self, event: Any) -> None:
        if not self.told:
            self.told = True
            self.tell(EVERY_RUN if not_kept() else FIRST_RUN)
        if self.depth == 0:
            self.began = time.perf_counter()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        self.depth -= 1
        if not self.depth:
            self.spent(time.perf_counter() - self.began)


@contextmanager
def announced(tell: Callable[[str], None], spent: Callable[[float], None] = lambda _: None) -> Iterator[None]:
    """Call `tell` once, with what to say, if any kernel has to be compiled inside.

    `spent` is called with the seconds that each time took.

    Kernels found on disk are not compiled.
    """
    listener = _Listener(tell, spent)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
