"""Shows the progress while an input is read (step, share and time). A button cancels the reading."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from leafcut.model.heartbeat import Progress
from leafcut.studio.jobs.workers import StudioWork, StudioWorkers
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.wording import Words
from leafcut.units import format_time

#: Progress is only shown if a reading takes longer than this time, s.
QUIET_SECONDS = 0.5


class PreviewReading:
    """Reads an input in another process.

    `what` is the current step. `share` is the completed share of this step, or 0 if it is unknown.
    """

    def __init__(self, workers: StudioWorkers, name: str = "") -> None:
        self.name = name
        self.work = StudioWork(workers)
        self.what, self.share = "", 0.0
        self.cancelled = asyncio.Event()
        self._began = time.monotonic()

    @property
    def seconds(self) -> float:
        """Time since the reading started, s."""
        return time.monotonic() - self._began

    def record_progress(self, progress: Progress) -> None:
        """Record the progress of the reading."""
        self.what, self.share = progress.step, progress.share

    def cancel(self, grace: float = 0.0) -> None:
        """Cancel the reading.

        Because it takes long to start a new process, its process is only killed after `grace` seconds.
        """
        self.cancelled.set()
        if grace:
            asyncio.get_running_loop().call_later(grace, self.work.cancel)
        else:
            self.work.cancel()


class ReadingPanel:
    """The card with the progress of a reading and a button that cancels it."""

    def __init__(self, words: Words, cancel: Callable[[], Any]) -> None:
        self._words = words
        self._shown: tuple[object, ...] = ()
        with box("div", "reading", aria_label=words("open.progress")) as self.place:
            with box("div", "line"):
                self.name = text("b", "", "what", dir="auto")
                self.what = text("span", "", "quiet")
                self.time = text("span", "", "quiet figure")
            self.track = box("progress", "", max="1", value="0", aria_label=words("open.progress"))
            with box("div", "ends", data_focus_after=".left [data-key~=r]"):
                button(words("run.cancel"), cancel, "", data_key="esc")
        self.place.set_visibility(False)

    def show(self, reading: PreviewReading | None) -> None:
        """Show the progress of the reading. Hide the card if there is no reading or if it has only just started."""
        if reading is None or reading.seconds < QUIET_SECONDS:
            if self._shown:
                self._shown = ()
                self.place.set_visibility(False)
            return
        step = self._words.translate(reading.what) or self._words("run.reading")
        known = reading.share > 0.0
        display = (reading.name, step, int(reading.seconds), f"{reading.share:.2f}")
        if display == self._shown:
            return
        self._shown = display
        self.name.set_text(reading.name)
        self.what.set_text(f"{step}, {100.0 * reading.share:.0f} %" if known else step)
        self.time.set_text(format_time(reading.seconds) if reading.seconds >= 1 else "")
        self.track.set_visibility(known)
        self.track.props(f"value={reading.share:.2f}")
        self.place.set_visibility(True)
