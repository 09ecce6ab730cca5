"""What a person sees while waiting: a bar on a terminal, one line elsewhere; always on standard error."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Self

#: A run that is over before this shows no bar.
QUIET_SECONDS = 0.5


class Reporter:
    """Receives `api.Progress` calls; shows a bar when standard error is a terminal and the run takes long."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.bar: Any = None
        self.task: Any = None
        self.quiet = quiet
        self.began = time.perf_counter()
        self.terminal = sys.stderr.isatty()

    def __call__(self, what: str, cost: float | None, share: float) -> None:
        """Show what is being done, the cost so far and the share done."""
        if self.quiet:
            return
        if what.startswith("compiling"):
            self._say(f"leafcut: {what} …")
        if not self.terminal or time.perf_counter() - self.began < QUIET_SECONDS:
            return
        if self.bar is None:
            self._open()
        words = what if cost is None else f"{what}: {cost:,.2f}"
        self.bar.update(self.task, completed=100.0 * share, description=words)

    def _say(self, line: str) -> None:
        if self.bar is not None:
            self.bar.console.print(line)
        else:
            print(line, file=sys.stderr, flush=True)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self.bar = Progress(*columns, console=Console(stderr=True), transient=True)
        self.bar.start()
        self.task = self.bar.add_task("", total=100.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.stop()
