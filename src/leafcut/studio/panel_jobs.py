"""The jobs that ran: look at one again, run it again, forget it."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING

from leafcut.api import default_machine
from leafcut.errors import LeafcutError
from leafcut.processes.settings import group_of
from leafcut.studio.elements import box, button, text
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.forms import changed
from leafcut.studio.history import JobRecord, JobState
from leafcut.studio.jobs import line_of
from leafcut.studio.page_state import View
from leafcut.studio.panel_input import work_of
from leafcut.studio.task import Task
from leafcut.studio.wording import Words
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.studio.page_parts import PageParts

_MOST = 200


class JobsPanel:
    """A table of jobs, the newest first."""

    def __init__(self, view: View, page: PageParts) -> None:
        self.view, self.page = view, page
        self.place = box("div", "page")
        self._drawn: list[tuple[str, JobState]] = []

    def tick(self) -> None:
        """Show the jobs anew when one of them stands otherwise than it is shown."""
        if self._states() != self._drawn:
            self.draw()

    def _states(self) -> list[tuple[str, JobState]]:
        """Return every job that is not over, and how it stands."""
        jobs = self.view.studio.jobs
        return [(job, live.state) for job in jobs.running() if (live := jobs.live(job)) is not None]

    def draw(self) -> None:
        """Show the jobs as they stand now."""
        w = self.view.words
        self._drawn = self._states()
        records = self.view.studio.jobs.newest(_MOST)
        self.place.clear()
        with self.place:
            text("h1", w("top.jobs"))
            if not records:
                text("p", w("jobs.none"), "quiet")
                return
            with box("div", "scroll card"), box("table", "jobs", aria_label=w("top.jobs")):
                with box("thead"), box("tr"):
                    for key, classes in (
                        ("when", ""), ("what", ""), ("work", ""), ("state", ""), ("result", "n"), ("do", ""),
                    ):  # fmt: skip
                        text("th", w(f"jobs.{key}"), classes, scope="col")
                with box("tbody"):
                    for record in records:
                        self._row(record)

    def _row(self, record: JobRecord) -> None:
        w = self.view.words
        with box("tr"):
            text("td", time.strftime("%Y-%m-%d %H:%M", time.localtime(record.created)), "keep quiet")
            with box("th", "", scope="row"):
                text("span", record.title, "", dir="auto")
                chosen = choices_of(record.task, self.view.studio.folder, w)
                text("small", " · ".join(chosen), "chosen quiet", title=" · ".join(chosen), dir="auto")
            text("td", w.named("work", work_of(record.task, record.title)), "quiet")
            with box("td"):
                text("span", w(f"state.{record.state.value}"), f"tag {record.state.value}", title=w.plain(record.line))
            text("td", self._figures(record), "n")
            with box("td", "keep"):
                button(w("jobs.open"), lambda: self.page.open_job(record.id), "small")
                button(w("jobs.again"), lambda: self._again(record), "small")
                button(w("jobs.delete"), lambda: self._delete(record), "small plain", data_sure=w("jobs.sure"))

    def _figures(self, record: JobRecord) -> str:
        found, w = record.figures, self.view.words
        if "after_s" in found and found["before_s"] is not None:
            change = change_words(found["saved_percent"] or 0.0)
            return f"{format_time(found['before_s'])} → {format_time(found['after_s'])} ({change})"
        if "length" in found:
            return f"{found['length']:,.8g}"
        if "variants" in found:
            used = f"{found['utilisation_of_used_percent']:.1f}"
            return w("nest.found", sheets=found["sheets"], percent=used)
        if "same" in found:
            return w("result.same" if found["same"] else "result.differs")
        return format_time(found["time_s"]) if "time_s" in found else w.plain(record.line)

    async def _again(self, record: JobRecord) -> None:
        try:
            job = self.view.studio.jobs.start(record.task)
        except Exception as problem:
            self.page.say(line_of(problem), True)
            return
        await self.page.open_job(job)

    def _delete(self, record: JobRecord) -> None:
        self.view.studio.jobs.delete(record.id)
        if self.view.job == record.id:
            self.page.run.leave()
            self.page.remember()
            self.page.run.draw()
            self.page.input.ready(bool(self.view.source))
            self.page.result.draw()
        self.draw()


def choices_of(task: Task, folder: Folder, words: Words) -> list[str]:
    """Return what tells a job from others of its file: its machine, then every option that is not at its default."""
    options = changed(task.options)
    machine = str(options.pop("machine", "") or default_machine(task.process)).removeprefix(OWN)
    told = [machine] if task.command == "optimize" or "machine" in task.options else []
    for name, value in options.items():
        if isinstance(value, bool):
            told.append(words.option(name) if value else f"{words.option(name)} {words('form.off')}")
            continue
        shown = ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        if group_of(name).specs()[name].kind == "path":
            with suppress(LeafcutError):  # else it is the name of a library, or gone
                shown = folder.input_path(shown).name
        told.append(f"{words.option(name)} {shown.removeprefix(OWN)}")
    return told


def change_words(saved: float) -> str:
    """Return by how many percent a time has changed, ``−2.5\u00a0%``; one that has not has no sign."""
    percent = round(saved, 1)
    sign = "−" if percent > 0 else "+" if percent < 0 else ""
    return f"{sign}{abs(percent):.1f}\u00a0%"
