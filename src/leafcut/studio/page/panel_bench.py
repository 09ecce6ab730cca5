"""Experiments for students: several algorithms, each with several seeds, on the open map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from leafcut.errors import OptionError
from leafcut.lab.experiment import COMPARED
from leafcut.studio.jobs.jobs import line_of
from leafcut.studio.jobs.task import Task
from leafcut.studio.page import forms
from leafcut.studio.page.elements import Form, box, button, text
from leafcut.studio.page.forms import plain_field, plain_group
from leafcut.studio.page.page_state import View

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Default algorithms, and default number of runs per algorithm.
_USUAL, _RUNS = ("as", "mmas", "acs"), "10"

#: Names in the literature of algorithms that leafcut abbreviates.
_TITLES = {
    "as": "Ant System", "eas": "Elitist AS", "asrank": "Rank-based AS", "mmas": "MAX–MIN AS",
    "acs": "Ant Colony System", "nn": "Nearest Neighbour",
}  # fmt: skip


class BenchPanel:
    """The card that starts a study, and a note if local search is off."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self.runs, self.chosen, self.local_search = _RUNS, set(_USUAL), False
        w = view.words
        self.note = text("p", w("bench.plain"), "hint", role="note")
        with box("details", "built-in bench") as self.place:
            text("summary", w("bench.title"))
            text("p", w("bench.text"), "quiet small")
            words = {"help": w("form.help")}
            self.form = Form([], words, self._put, lambda line: page.show_message(line, True))
            self.begin = button("", self._begin, "wide")

    def draw(self) -> None:
        """Show the card if the kind of work is solving a map."""
        view = self.view
        self.place.set_visibility(view.work == "solve")
        self.note.set_visibility(view.work == "solve" and view.studied and view.values.get("local_search") is False)
        flags = {f"algorithm-{name}": name in self.chosen for name in COMPARED}
        groups = self._groups() if view.work == "solve" else []  # most pages never show it
        self.form.show({"runs": self.runs, "local": self.local_search, **flags}, groups=groups)
        runs = int(self.runs) * len(self.chosen) if self.runs.isdecimal() else 0
        self.begin.set_text(view.words("bench.begin", runs=f"{runs:,}"))

    def restore(self, task: Task, options: dict[str, Any]) -> None:
        """Show the choices of a study. Its option for local search does not affect the form above."""
        if task.command == "study":
            self.runs, self.chosen = str(task.runs), set(task.algorithms)
            self.local_search = options.pop("local_search", True)

    def _groups(self) -> list[dict[str, Any]]:
        w = self.view.words
        fields = [
            plain_field("runs", w("bench.runs"), help=w("bench.runs_help")),
            *(plain_field(f"algorithm-{n}", label(n), "flag", help=w(f"algorithm.{n}")) for n in COMPARED),
            plain_field("local", w.option("local_search"), "flag", help=w("bench.local_help")),
        ]
        return [plain_group(*fields)]

    def _put(self, name: str, value: Any, _: str) -> None:
        if name == "runs":
            self.runs = str(value).strip() or _RUNS
        elif name == "local":
            self.local_search = bool(value)
        elif value:
            self.chosen.add(name.removeprefix("algorithm-"))
        else:
            self.chosen.discard(name.removeprefix("algorithm-"))
        self.draw()

    def task(self) -> Task:
        """Return the chosen study with the settings of the form; raise `OptionError` if a setting is invalid."""
        if not self.runs.isdecimal():
            raise OptionError("{}: '{}' is not a whole number", self.view.words("bench.runs"), self.runs)
        algorithms = tuple(name for name in COMPARED if name in self.chosen)
        options = settings_of(self.view, algorithms)
        if not self.local_search:
            options["local_search"] = False
        return Task("study", (self.view.source,), "auto", options, algorithms=algorithms, runs=int(self.runs))

    def _begin(self) -> None:
        view, page = self.view, self.page
        if not view.source or page.run.running:
            page.show_message(view.words("command.none" if not view.source else "bench.running"), True)
            return
        if page.input.reading:  # the input that is being read may replace the current input, or be invalid
            page.show_message(view.words("open.reading", name=view.name), True)
            return
        try:
            view.job = view.studio.jobs.start(self.task())
        except Exception as problem:
            page.show_message(line_of(problem), True)
            return
        page.show_message("")
        page.remember()
        page.run.watch()
        page.result.draw()


def settings_of(view: View, algorithms: tuple[str, ...]) -> dict[str, Any]:
    """Return the settings that at least one of the algorithms uses; raise `OptionError` if a setting is invalid."""
    known = {
        n for algorithm in algorithms or ("auto",) for _, names in forms.names_of("solve", algorithm) for n in names
    }
    known -= {"algorithm", "local_search"}
    for name, line in view.errors.items():
        if name in known:
            raise OptionError(line)
    return {name: value for name, value in forms.changed_values(view.values).items() if name in known}


def label(name: str) -> str:
    """Return an algorithm's name, followed by its name in the literature."""
    title = _TITLES.get(name)
    return f"{name} – {title}" if title else name
