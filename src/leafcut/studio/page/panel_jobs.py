"""The Jobs view, in which users search, open, repeat, compare and delete jobs, and change the order of the queue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from nicegui.elements.mixins.text_element import TextElement

from leafcut.processes.settings import all_options
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import JobRecord, JobState
from leafcut.studio.jobs.jobs import Jobs, error_line
from leafcut.studio.page.badge import add_notification_switch
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.forms import changed_values, value_words
from leafcut.studio.page.job_words import machine_and_changed_options, result_words, search_terms
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_input import task_work
from leafcut.studio.wording import Words, day_and_time
from leafcut.units import format_length, format_time

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Maximum number of jobs that are sent to the page at once.
MAX_ROWS = 50
#: Minimum interval between two searches while the user is typing, s.
_PACE = 0.25
_COLUMNS = (("when", ""), ("what", ""), ("work", ""), ("state", ""), ("result", "n"), ("do", ""))

_NONE = "–"


class _ShownJob(NamedTuple):
    tag: TextElement
    figures: TextElement


class JobsPanel:
    """The table of jobs, newest first."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self._drawn: list[tuple[str, JobState]] = []
        self._wanted, self._skip = "", 0
        self._rows: dict[str, _ShownJob] = {}
        self._count = 0
        #: The jobs to compare. There are at most two.
        self._picked: list[str] = []
        w = view.words
        with box("div", "page"):
            with box("div", "title"):
                text("h1", w("top.jobs"))
                with box("div", "find", role="search"), box("span", "box"):
                    find = box("input", "", id="jobs-find", type="search", autocomplete="off", spellcheck="false")
                    find.props.update({"placeholder": w("jobs.find"), "aria-label": w("jobs.find")})
            add_notification_switch(view)
            self.queue = QueueCard(w, view.studio.jobs, page.open_job, self.draw)
            self.compared = box("section", "card compare", aria_label=w("compare.title"))
            self.place = box("div", "found")
        find.on("input", self._search, throttle=_PACE, leading_events=False, js_handler="(e) => emit(e.target.value)")

    def tick(self) -> None:
        """Update the table if the state of any job has changed."""
        if self._unfinished_states() != self._drawn:
            self.draw()
        else:
            self.queue.tick()

    def _unfinished_states(self) -> list[tuple[str, JobState]]:
        jobs = self.view.studio.jobs
        order = [*jobs.unfinished_ids(), *jobs.waiting_ids()]
        return [(job, live.state) for job in order if (live := jobs.find_live_job(job)) is not None]

    def _search(self, event: Any) -> None:
        self._wanted, self._skip = str(event.args), 0
        self._draw_list()

    def draw(self) -> None:
        """Show the current jobs."""
        self._drawn = self._unfinished_states()
        self.queue.draw()
        self._compare()
        self._draw_list()

    def _draw_list(self) -> None:
        """Show one page of matching jobs.

        Rows are reused, because a button might otherwise disappear while it is pressed.
        """
        w = self.view.words
        records, count = self.view.studio.jobs.find(search_terms(self._wanted, w), MAX_ROWS, self._skip)
        if not records and self._skip:  # the last job of a page was deleted
            self._skip = max(self._skip - MAX_ROWS, 0)
            return self._draw_list()
        if self._rows and (list(self._rows), self._count) == ([record.id for record in records], count):
            for record in records:
                self._update_row(record)
            return None
        self._rows, self._count = {}, count
        self.place.clear()
        with self.place:
            if not records:
                text("p", w("jobs.none_found" if self._wanted.strip() else "jobs.none"), "quiet", role="status")
                return None
            self._draw_pager(len(records), count)
            with box("div", "scroll card"), box("table", "jobs", aria_label=w("top.jobs")):
                with box("thead"), box("tr"):
                    text("td", "")
                    for key, classes in _COLUMNS:
                        text("th", w(f"jobs.{key}"), classes, scope="col")
                with box("tbody"):
                    for record in records:
                        self._draw_row(record)
        return None

    def _draw_pager(self, shown: int, count: int) -> None:
        w = self.view.words
        with box("div", "pager"):
            span = w("jobs.shown", first=f"{self._skip + 1:,}", last=f"{self._skip + shown:,}", count=f"{count:,}")
            text("span", span, "quiet small", role="status")
            if count > MAX_ROWS:
                for name, target in (("newer", self._skip - MAX_ROWS), ("older", self._skip + MAX_ROWS)):
                    attributes = {} if 0 <= target < count else {"aria_disabled": "true"}
                    button(
                        f"{w(f'jobs.{name}')}",
                        lambda target=target: self._turn_page(target, count),
                        "small",
                        **attributes,
                    )

    def _turn_page(self, target: int, count: int) -> None:
        if 0 <= target < count:
            self._skip = target
            self._draw_list()

    def _draw_row(self, record: JobRecord) -> None:
        w = self.view.words
        with box("tr", "", data_focus=f"job-{record.id}"):
            with box("td"):
                pick = box("input", "", type="checkbox", aria_label=w("jobs.compare", name=record.title))
                pick.props["checked"] = record.id in self._picked
                pick.on(
                    "change",
                    lambda e: self._select_for_comparison(record.id, bool(e.args)),
                    js_handler="(e) => emit(e.target.checked)",
                )
            text("td", day_and_time(record.created), "keep quiet")
            with box("th", "", scope="row"):
                text("span", record.title, "", dir="auto")
                chosen = machine_and_changed_options(record.task, self.view.studio.folder, w)
                text("small", " · ".join(chosen), "chosen quiet", title=" · ".join(chosen), dir="auto")
            text("td", w.item_name("work", task_work(record.task, record.title)), "quiet")
            with box("td"):
                tag = text("span", "", "tag")
            self._rows[record.id] = _ShownJob(tag, text("td", "", "n"))
            self._update_row(record)
            with box("td", "keep"):
                button(w("jobs.open"), lambda: self.page.open_job(record.id), "small")
                button(w("jobs.again"), lambda: self._run_again(record), "small")
                button(w("jobs.delete"), lambda: self._delete(record), "small plain", data_sure=w("jobs.sure"))

    def _update_row(self, record: JobRecord) -> None:
        w, row = self.view.words, self._rows[record.id]
        row.tag.set_text(w(f"state.{record.state.value}"))
        row.tag.classes(replace=f"tag {record.state.value}")
        if row.tag.props.get("title") != (line := w.translate_for_page(record.line)):
            row.tag.props["title"] = line
            row.tag.update()
        row.figures.set_text(result_words(record, w))

    def _select_for_comparison(self, job: str, picked: bool) -> None:
        """Select a job for comparison. If two jobs are already selected, the new job replaces the first."""
        remaining = [picked_job for picked_job in self._picked if picked_job != job]
        dropped = len(remaining) > 1 and picked
        self._picked = [*remaining[-1:], job] if picked else remaining
        self._compare()
        if dropped:
            self._rows = {}
            self._draw_list()

    def _compare(self) -> None:
        w, jobs = self.view.words, self.view.studio.jobs
        records = [record for job in self._picked if (record := jobs.record(job)) is not None]
        self._picked = [record.id for record in records]
        records.sort(key=lambda record: record.created)  # the earlier job first
        self.compared.clear()
        self.compared.set_visibility(bool(records))
        with self.compared:
            if len(records) != 2:
                text("p", w("compare.second"), "quiet", role="status")
                return
            earlier, later = records
            with box("div", "title"):
                text("h2", w("compare.title"), role="status")
                button(w("edit.close"), self._clear_selection, "small plain")
            answers = tuple(self.view.studio.history.answer(record.id) or {} for record in records)
            states = (w(f"state.{record.state.value}") for record in records)
            rows = [ComparedRow(w("jobs.state"), *states), *compared_figures((answers[0], answers[1]), w)]
            chosen = compared_options((earlier, later), self.view.studio.folder, w)
            with box("div", "scroll"), box("table", "", aria_label=w("compare.title")):
                with box("thead"), box("tr"):
                    text("td", "")
                    for record in records:
                        created = day_and_time(record.created)
                        with box("th", "", scope="col"):
                            text("span", record.title, "", dir="auto")
                            text("small", f" {created}", "quiet")
                    text("td", "")
                for title, part in (("compare.figures", rows), ("compare.options", chosen)):
                    self._draw_compared_rows(w(title), part)

    def _draw_compared_rows(self, title: str, rows: list[ComparedRow]) -> None:
        if not rows:
            return
        with box("tbody"):
            with box("tr", "part"):
                text("th", title, "", scope="rowgroup", colspan="4")
            for row in rows:
                with box("tr", "differs" if row.differs else ""):
                    text("th", row.label, "", scope="row")
                    text("td", row.one, "", dir="auto")
                    text("td", row.other, "", dir="auto")
                    with box("td"):
                        if row.differs:
                            text("span", self.view.words("compare.differs"), "tag interrupted")

    def _clear_selection(self) -> None:
        self._picked, self._rows = [], {}
        self.draw()

    async def _run_again(self, record: JobRecord) -> None:
        try:
            job = self.view.studio.jobs.start(record.task)
        except Exception as problem:
            self.page.show_message(error_line(problem), True)
            return
        await self.page.open_job(job)

    def _delete(self, record: JobRecord) -> None:
        self.view.studio.jobs.delete(record.id)
        if self.view.job == record.id:
            self.page.run.leave_job()
            self.page.update_address()
            self.page.run.draw()
            self.page.input.show_ready(bool(self.view.source))
            self.page.result.draw()
        self.draw()


class QueueCard:
    """The card with all unfinished jobs. `on_change` is called when their order changes."""

    def __init__(self, words: Words, jobs: Jobs, open_job: Callable[[str], Any], on_change: Callable[[], Any]) -> None:
        self._words, self._jobs, self._open, self._on_change = words, jobs, open_job, on_change
        self._shares: dict[str, TextElement] = {}
        self.place = box("section", "card queue", aria_label=words("jobs.queue"))

    def draw(self) -> None:
        """Show the current jobs."""
        waiting = self._jobs.waiting_ids()
        running = [job for job in self._jobs.unfinished_ids() if job not in waiting]
        self._shares = {}
        self.place.clear()
        self.place.set_visibility(bool(running or waiting))
        with self.place:
            text("h2", self._words("jobs.queue"), "minor")
            with box("ol"):
                for job in running:
                    self._draw_row(job, 0, 0)
                for place, job in enumerate(waiting, 1):
                    self._draw_row(job, place, len(waiting))
        self.tick()

    def tick(self) -> None:
        """Update the progress of the running jobs."""
        for job, shown in self._shares.items():
            live = self._jobs.find_live_job(job)
            if live is not None:
                share = f"{100 * live.latest.share:.0f} %"
                if shown.text != share:
                    shown.set_text(share)

    def _draw_row(self, job: str, place: int, last: int) -> None:
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
                            w(f"jobs.{name}"),
                            lambda target=target: self._move_job(job, target),
                            "small",
                            aria_label=label,
                        )
                button(w("jobs.open"), lambda: self._open(job), "small")
                button(w("run.cancel"), lambda: self._jobs.cancel(job), "small plain", data_sure=w("run.sure"))

    def _move_job(self, job: str, place: int) -> None:
        self._jobs.move_in_queue(job, place)
        self._on_change()


@dataclass(frozen=True)
class ComparedRow:
    """A result or an option of two jobs, as shown to the user."""

    label: str
    one: str
    other: str

    @property
    def differs(self) -> bool:
        """Whether the two values differ."""
        return self.one != self.other


def _percent_text(value: float) -> str:
    return f"{value:.2f} %"


def _value_text(value: Any) -> str:
    return f"{value:,.10g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


#: Key of the label, path of the value in the answer, and function that formats the value.
_FIGURES: tuple[tuple[str, tuple[str, ...], Callable[[Any], str]], ...] = (
    ("result.before", ("before", "time_s"), format_time),
    ("result.after", ("after", "time_s"), format_time),
    ("compare.saved", ("saved_percent",), _percent_text),
    ("result.travel", ("after", "travel_mm"), format_length),
    ("result.cutting", ("after", "cut_mm"), format_length),
    ("result.time", ("time_s",), format_time),
    ("result.rapid", ("rapid_mm",), format_length),
    ("result.feed", ("feed_mm",), format_length),
    ("compare.length", ("length",), _value_text),
    ("compare.gap", ("gap_percent",), _percent_text),
    ("result.lower_bound", ("lower_bound",), _value_text),
    ("result.iterations", ("iterations",), _value_text),
    ("result.machine", ("machine",), _value_text),
    ("result.dialect", ("dialect",), _value_text),
    ("result.algorithm", ("algorithm",), _value_text),
    ("result.seed", ("seed",), _value_text),
    ("result.computing", ("seconds",), format_time),
)


def compared_figures(answers: tuple[Mapping[str, Any], Mapping[str, Any]], words: Words) -> list[ComparedRow]:
    """Return a row for each result that any of the answers contains."""
    rows = []
    for label, path, format_value in _FIGURES:
        first, second = (_value_at(answer, path) for answer in answers)
        if first is not None or second is not None:
            rows.append(ComparedRow(words(label), *(_NONE if v is None else format_value(v) for v in (first, second))))
    return rows


def _value_at(answer: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    value: Any = answer
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value


def compared_options(records: tuple[JobRecord, JobRecord], folder: Folder, words: Words) -> list[ComparedRow]:
    """Return a row for each option that any of the jobs sets. For a job without this option, show the default."""
    given = tuple(changed_values(record.task.options) for record in records)
    names = [name for _, name, _ in all_options() if name in given[0] or name in given[1]]

    def value_text(record: JobRecord, options: Mapping[str, Any], name: str) -> str:
        return value_words(name, options.get(name), words, folder, record.task.process)

    return [
        ComparedRow(words.option_label(name), *(value_text(*job, name) for job in zip(records, given, strict=True)))
        for name in names
    ]
