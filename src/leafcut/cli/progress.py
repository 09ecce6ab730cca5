"""Progress on standard error: a bar on a terminal, otherwise a single line."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Self

from leafcut.model.heartbeat import Progress

#: Time before a bar is shown, s.
QUIET_SECONDS = 0.5


class Reporter:
    """A progress callback that shows a bar when standard error is a terminal and the run takes a while."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.bar: Any = None
        self.task: Any = None
        self.quiet = quiet
        self.began = time.perf_counter()
        #: Time and share of the first report: compiling does not count.
        self.origin: tuple[float, float] | None = None
        self.terminal = sys.stderr.isatty()

    def __call__(self, now: Progress) -> None:
        """Show the current step, the cost, the gap to the lower bound, the share done and the time left."""
        if self.quiet:
            return
        if now.step.startswith("compiling"):
            self._print_above_bar(f"leafcut: {now.step} …")
        if not self.terminal or time.perf_counter() - self.began < QUIET_SECONDS:
            return
        if self.bar is None:
            self._open_bar()
        words = now.step if now.cost is None else f"{now.step}: {now.cost:,.2f}"
        if now.gap is not None:
            words += f", gap at most {100.0 * now.gap:.2f} %"
        self.bar.update(self.task, completed=100.0 * now.share, description=words, left=self._time_left(now.share))

    def _time_left(self, share: float) -> str:
        now = time.perf_counter()
        if self.origin is None or not 0.0 < self.origin[1] <= share:
            self.origin = (now, share)
        start_time, start_share = self.origin
        if share <= start_share:
            return ""
        seconds = (now - start_time) * (1.0 - share) / (share - start_share)
        return f"{seconds:.0f} s left" if seconds < 90 else f"{seconds / 60:.0f} min left"

    def _print_above_bar(self, line: str) -> None:
        if self.bar is not None:
            self.bar.console.print(line)
        else:
            print(line, file=sys.stderr, flush=True)

    def _open_bar(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
        )
        self.bar = Bar(*columns, console=Console(stderr=True), transient=True)
        self.bar.start()
        self.task = self.bar.add_task("", total=100.0, left="")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.stop()
