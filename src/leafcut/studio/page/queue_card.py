"""The running and the waiting jobs in their order, which the user can change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.jobs.jobs import Jobs
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.wording import Words


class QueueCard:
    """The card with the unfinished jobs. `on_change` is called when their order changes."""

    def __init__(self, words: Words, jobs: Jobs, open_job: Callable[[str], Any], on_change: Callable[[], Any]) -> None:
        self._words, self._jobs, self._open, self._on_change = words, jobs, open_job, on_change
        self._shares: dict[str, TextElement] = {}
        self.place = box("section", "card queue", aria_label=words("jobs.queue"))

    def draw(self) -> None:
        """Show the current jobs."""
        waiting = self._jobs.waiting()
        running = [job for job in self._jobs.running() if job not in waiting]
        self._shares = {}
        self.place.clear()
        self.place.set_visibility(bool(running or waiting))
        with self.place:
            text("h2", self._words("jobs.queue"), "minor")
            with box("ol"):
                for job in running:
                    self._row(job, 0, 0)
                for place, job in enumerate(waiting, 1):
                    self._row(job, place, len(waiting))
        self.tick()

    def tick(self) -> None:
        """Update the progress of the running jobs."""
        for job, shown in self._shares.items():
            live = self._jobs.live(job)
            if live is not None:
                share = f"{100 * live.latest.share:.0f} %"
                if shown.text != share:
                    shown.set_text(share)

    def _row(self, job: str, place: int, last: int) -> None:
        w, record = self._words, self._jobs.record(job)
        if record is None:
            return
        with box("li", "", data_focus=f"queue-{job}"):
            if place:
                text("span", w("jobs.place", number=place), "tag")
            else:
                self._shares[job] = text("span", "", "tag running")
            text("b", record.title, "", dir="auto")
            with box("span", "do"):
                if place:
                    for name, target in (("next", 0), ("up", place - 2), ("down", place)):
                        if (name == "down" and place == last) or (name != "down" and place == 1):
                            continue
                        label = f"{w(f'jobs.{name}')}: {record.title}"
                        button(
                            w(f"jobs.{name}"), lambda target=target: self._move(job, target), "small", aria_label=label
                        )
                button(w("jobs.open"), lambda: self._open(job), "small")
                button(w("run.cancel"), lambda: self._jobs.cancel(job), "small plain", data_sure=w("run.sure"))

    def _move(self, job: str, place: int) -> None:
        self._jobs.move(job, place)
        self._on_change()
