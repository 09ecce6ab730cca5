"""The Lab view, which runs published experiments or experiments on the open part and shows the reports."""

from __future__ import annotations

import time
from collections.abc import Iterable
from statistics import fmean
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError, OptionError
from leafcut.lab.description import Description
from leafcut.lab.loading import included_names, titles_of_included_experiments
from leafcut.lab.own_experiment import OWN_PART, compared_option_values, comparison_experiment
from leafcut.lab.results import Results, five_digits
from leafcut.lab.store import Row
from leafcut.report.wording import time_words
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.jobs.task import resolve_task
from leafcut.studio.lab.runs import LabRuns
from leafcut.studio.page.elements import Form, box, button, link, table, text
from leafcut.studio.page.forms import plain_field, plain_group
from leafcut.studio.page.page_state import View

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Default number of runs on a part, and the values that are compared by default for each option.
_RUNS, _USUAL = "5", {"algorithm": ("nn", "acs", "auto"), "strategy": ("zigzag", "contour", "connected")}
#: Minimum interval between two updates of the results, s.
_PACE = 1.0
_MAX_FAILED = 5
#: Kinds of work that have several algorithms or strategies, which users can compare on a part.
_COMPARABLE = ("solve", "drill", "program", "cut", "pocket")
#: Full names of the algorithms that leafcut abbreviates, as used in the literature.
_TITLES = {
    "as": "Ant System", "eas": "Elitist AS", "asrank": "Rank-based AS", "mmas": "MAX–MIN AS",
    "acs": "Ant Colony System", "nn": "Nearest Neighbour",
}  # fmt: skip


class LabPanel:
    """The list of experiments, and the selected experiment."""

    def __init__(self, view: View, page: Page, runs: LabRuns) -> None:
        self.view, self.page, self.lab = view, page, runs
        self.chosen, self.reduced = included_names()[0], False
        self.runs = _RUNS
        #: Values of each option that the user has selected for comparison.
        self.ways = {option: set(names) for option, names in _USUAL.items()}
        self._drawn: tuple[object, ...] = ()
        #: Elements that show the progress. They can be updated without redrawing the buttons.
        self._progress_elements: tuple[Any, ...] = ()
        self._growing: Description | None = None
        self._next = 0.0
        self.place = box("div", "page lab")

    def tick(self, *, shown: bool) -> None:
        """Update the experiment if its state has changed."""
        if not shown:
            return
        if self._current_state() != self._drawn:
            self.draw()
        elif self._growing is not None and time.monotonic() >= self._next:
            self._update_progress_and_results(self._growing)

    def _current_state(self) -> tuple[object, ...]:
        state = self.lab.state
        if state is None:
            return (self.view.source,)
        return self.view.source, state.description.storage_key, state.running, state.line

    async def show(self) -> None:
        """Show the list and the selected experiment."""
        self.draw()

    def draw(self) -> None:
        """Show the list and the selected experiment."""
        w, counts = self.view.words, self.lab.run_counts()
        self._drawn, self._growing = self._current_state(), None
        self.place.clear()
        with self.place:
            text("h1", w("top.lab"))
            text("p", w("lab.text"), "quiet")
            with box("div", "halves"):
                with box("nav", "list card", aria_label=w("lab.list")):
                    text("h2", w("lab.own"), "minor")
                    self._draw_list_entry(OWN_PART, self.view.name or w("lab.no_part"), counts)
                    text("h2", w("lab.published"), "minor")
                    for name, title in titles_of_included_experiments().items():
                        self._draw_list_entry(name, title, counts)
                with box("section", "card", aria_label=self.chosen):
                    if self.chosen == OWN_PART:
                        self._draw_own()
                    else:
                        self._draw_published()

    def _draw_list_entry(self, name: str, title: str, counts: dict[str, int]) -> None:
        current = "true" if name == self.chosen else "false"
        done = counts.get(name, 0)
        words = f"{title} · {done:,}" if done else title
        button(words, lambda: self._choose_experiment(name), "entry", aria_current=current, data_name=name)

    def _choose_experiment(self, name: str) -> None:
        self.chosen = name
        self.draw()

    # -- published experiments ----------------------------------------------------------------------------------------

    def _draw_published(self) -> None:
        w = self.view.words
        experiment = self.lab.load_description(self.chosen, self.reduced)
        text("h2", experiment.title, lang="en")
        text("p", " ".join(experiment.about.split()), "", lang="en")
        if experiment.source:
            text("p", w("lab.source", source=experiment.source), "quiet small")
        with box("div", "actions"):
            for reduced in (False, True):
                pressed = "true" if reduced == self.reduced else "false"
                n = self.lab.load_description(self.chosen, reduced).n_runs
                words = w("lab.short" if reduced else "lab.whole", runs=f"{n:,}")
                button(words, lambda reduced=reduced: self._choose_short_form(reduced), "small", aria_pressed=pressed)
        if self.reduced:
            text("p", w("lab.short_help"), "quiet small")
        self._draw_experiment(experiment)

    def _choose_short_form(self, reduced: bool) -> None:
        self.reduced = reduced
        self.draw()

    # -- experiments on the open part ----------------------------------------------------------------------------------

    def _draw_own(self) -> None:
        w, view = self.view.words, self.view
        text("h2", w("lab.own"))
        text("p", w("lab.own_text"))
        if not view.source or view.work not in _COMPARABLE:
            text("p", w("lab.no_source" if not view.source else "lab.no_ways"), "hint", role="note")
        else:
            option, names = compared_option_values(self._compared_command())
            flags = [plain_field(n, _name_with_title(n), "flag", help=w.table.get(f"algorithm.{n}", "")) for n in names]
            groups = [plain_group(plain_field("runs", w("lab.runs_of_each"), help=w("lab.runs_help")), *flags)]
            form = Form(w, self._set_own_value, groups)
            form.show({"runs": self.runs, **{name: name in self.ways[option] for name in names}})
            count = int(self.runs) * len(self.ways[option] & set(names)) if self.runs.isdecimal() else 0
            if not self.lab.running:
                with box("div", "actions"):
                    button(w("lab.begin_runs", runs=f"{count:,}"), self._start_own, "primary")
        if self.lab.own is not None:
            self._draw_experiment(self.lab.own)

    def _compared_command(self) -> str:
        task = self.view.build_task()
        return task.command if task.command == "solve" or task.process == "auto" else task.process

    def _set_own_value(self, name: str, value: Any, _: str) -> None:
        option = compared_option_values(self._compared_command())[0]
        if name == "runs":
            self.runs = str(value).strip() or _RUNS
        elif value:
            self.ways[option].add(name)
        else:
            self.ways[option].discard(name)
        self.draw()

    def _start_own(self) -> None:
        view, words = self.view, self.view.words
        try:
            if not self.runs.isdecimal():
                raise OptionError("{}: '{}' is not a whole number", words("lab.runs_of_each"), self.runs)
            ready, command = resolve_task(view.build_task(), view.studio.folder), self._compared_command()
            option, names = compared_option_values(command)
            values = [name for name in names if name in self.ways[option]]
            options = {k: v for k, v in ready.options.items() if k != option}
            self._start(comparison_experiment(view.name, ready.sources[0], command, options, values, int(self.runs)))
        except Exception as problem:
            self.page.show_message(view.studio.folder.hide_paths(error_line(problem)), True)

    # -- both kinds of experiments -----------------------------------------------------------------------------------

    def _draw_experiment(self, experiment: Description) -> None:
        w, state = self.view.words, self.lab.state
        is_shown = state is not None and state.description.storage_key == experiment.storage_key
        rows = self._stored_rows(experiment)
        kept = [row for row in rows if not row.failed]
        done = text("p", "", "", role="status")
        bar = box("progress", "", max="1", value="0", aria_label=w("lab.done_label"))
        step = text("p", "", "quiet small", dir="auto")
        with box("div", "actions"):
            if self.lab.running:
                words = (
                    w("lab.stop") if is_shown else w("lab.stop_other", title=state.description.title if state else "")
                )
                button(words, self.lab.stop, "small")
            elif experiment.name != OWN_PART:
                begin_label = w(
                    "lab.go_on" if 0 < len(kept) < experiment.n_runs else "lab.again" if kept else "lab.begin"
                )
                button(begin_label, lambda: self._start_or_show_error(experiment), "primary")
            if kept or is_shown:
                query = "?reduced=true" if experiment.reduced else ""
                stem = f"/api/lab/{experiment.name}"
                link(w("lab.report"), f"{stem}/report.html{query}", "button small", target="_blank", rel="noopener")
                link(w("lab.csv"), f"{stem}/runs.csv{query}", "button small", download="")
        if is_shown and state is not None and state.line:
            text("p", w.translate_for_page(state.line), "error", role="alert")
        self._progress_elements = (done, bar, step, box("div"))
        self._update_progress_and_results(experiment, rows)
        self._growing = experiment if is_shown and self.lab.running else None

    def _stored_rows(self, experiment: Description) -> list[Row]:
        try:
            return self.lab.rows(experiment)
        except LeafcutError as problem:
            self.page.show_message(self.view.studio.folder.hide_paths(str(problem)), True)
            return []

    def _update_progress_and_results(self, experiment: Description, rows: list[Row] | None = None) -> None:
        w, state, (done, bar, step, place) = self.view.words, self.lab.state, self._progress_elements
        rows = self._stored_rows(experiment) if rows is None else rows
        kept = [row for row in rows if not row.failed]
        done.set_text(w("lab.done", done=f"{len(kept):,}", runs=f"{experiment.n_runs:,}"))
        runs = state is not None and state.running and state.description.storage_key == experiment.storage_key
        bar.set_visibility(runs)
        if state is not None and runs:
            bar.props["value"] = f"{state.share:.4f}"
            bar.update()
            left = state.seconds_left
            remaining = "" if left is None else w("lab.left", time=time_words(left))
            step.set_text(" · ".join(filter(None, (state.doing, remaining))))
        place.clear()
        with place:
            self._draw_failed_runs([row for row in rows if row.failed])
            if kept:
                self._draw_means_table(experiment, kept)
        self._next = time.monotonic() + _PACE

    def _start_or_show_error(self, experiment: Description) -> None:
        try:
            self._start(experiment)
        except Exception as problem:
            self.page.show_message(error_line(problem), True)

    def _start(self, experiment: Description) -> None:
        self.lab.start(experiment)
        self.page.show_message("")
        self.draw()

    def _draw_failed_runs(self, rows: list[Row]) -> None:
        if not rows:
            return
        w = self.view.words
        text("p", w("lab.failed", number=f"{len(rows):,}"), "hint", role="note")
        with box("ul", "small"):
            for row in rows[:_MAX_FAILED]:
                line = self.view.studio.folder.hide_paths(row.failed)
                text(
                    "li", f"{row.instance}, {', '.join(row.levels.values())}: {w.translate_for_page(line)}", dir="auto"
                )

    def _draw_means_table(self, experiment: Description, rows: Iterable[Row]) -> None:
        w, results = self.view.words, Results.from_rows(experiment, rows)
        figures = [results.values_by_cell(item.name) for item in experiment.responses]
        head = [(w("lab.instance"), ""), *((item.title, "") for item in experiment.factors), (w("lab.runs"), "n")]
        head += [(item.heading, "n") for item in experiment.responses]
        shown = []
        for cell in results.cells():
            known = [values.get(cell, []) for values in figures]
            count = max(map(len, known), default=0)
            if count:
                shown.append([*cell, str(count), *(five_digits(fmean(values)) if values else "–" for values in known)])
        text("h3", w("lab.means"))
        table(head, shown, w("lab.means"))


def _name_with_title(name: str) -> str:
    title = _TITLES.get(name)
    return f"{name} – {title}" if title else name
