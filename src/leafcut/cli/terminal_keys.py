"""Read single keys of a terminal in the background, without waiting for Enter."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_LOOK_SECONDS = 0.05


class Keys:
    """Calls `pressed` with each key while it is open, from its own thread; without a terminal, it does nothing."""

    def __init__(self, pressed: Callable[[str], None]) -> None:
        self.pressed = pressed
        self.terminal = sys.stdin is not None and sys.stdin.isatty()
        self._reading = threading.Event()
        self._closed = threading.Event()
        self._idle = threading.Event()
        self._before: Any = None

    def __enter__(self) -> Keys:
        if self.terminal:
            self._raw()
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._cooked()

    @contextmanager
    def lines(self) -> Iterator[None]:
        """Release the terminal, so that whole lines can be read."""
        if self.terminal:
            self._cooked()
            self._idle.wait(1.0)
        try:
            yield
        finally:
            if self.terminal:
                self._raw()

    def _watch(self) -> None:
        while not self._closed.is_set():
            if not self._reading.is_set():
                self._idle.set()
                self._reading.wait(_LOOK_SECONDS)
                continue
            self._idle.clear()
            key = _key()
            if key and self._reading.is_set():
                self.pressed(key)

    def _raw(self) -> None:
        if os.name == "posix":
            import termios
            import tty

            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        self._reading.set()

    def _cooked(self) -> None:
        self._reading.clear()
        if self._before is not None:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
            self._before = None


def _key() -> str:
    """Return a pressed key, or "" after a short wait."""
    if os.name == "posix":
        import select

        ready, _, _ = select.select([sys.stdin], [], [], _LOOK_SECONDS)
        return os.read(sys.stdin.fileno(), 1).decode("ascii", "replace") if ready else ""
    import msvcrt
    import time

    if not msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]
        time.sleep(_LOOK_SECONDS)
        return ""
    return str(msvcrt.getwch())  # type: ignore[attr-defined,unused-ignore]
