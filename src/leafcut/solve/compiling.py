"""Saying that kernels are being compiled, on the first run of a machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event


class _Listener(event.Listener):  # type: ignore[misc]  # numba has no types
    """Calls back when the first compilation begins."""

    def __init__(self, tell: Callable[[], None]) -> None:
        self.tell, self.told = tell, False

    def on_start(self, event: Any) -> None:
        if not self.told:
            self.told = True
            self.tell()

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


@contextmanager
def announced(tell: Callable[[], None]) -> Iterator[None]:
    """Call `tell` once if any kernel has to be compiled inside; kernels found on disk are not compiled."""
    with event.install_listener("numba:compile", _Listener(tell)):
        yield
