"""`Link` connects a task in another process to the studio."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from leafcut.model.heartbeat import Progress, Trial
from leafcut.studio.jobs.search_watch import PageObserver

#: Minimum interval between two reports about the same step, s.
_REPORT_SECONDS = 0.02


class Link:
    """The connection of a task to the studio. If `stop` is set, the task ends with the best result so far."""

    def __init__(self, send: Callable[[Any], None]) -> None:
        self.stop = threading.Event()
        self.observer = PageObserver(send)
        self._send = send
        self._reported: tuple[str, Trial | None] = ("", None)
        self._next = 0.0

    def report(self, progress: Progress) -> None:
        """Report the progress, at most once per step every `_REPORT_SECONDS`."""
        now = time.monotonic()
        reported = progress.step, progress.trial
        if reported != self._reported or now >= self._next:
            self._reported, self._next = reported, now + _REPORT_SECONDS
            self._send(progress)

    def obey(self, name: str, *arguments: Any) -> None:
        """Execute a command from the studio, which stops the task or calls a method of the observer."""
        if name == "stop":
            self.stop.set()
            self.observer.release()
        else:
            getattr(self.observer, name)(*arguments)
