"""What one open page shows: each tab of a browser has its own; the jobs are everybody's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from leafcut import api
from leafcut.errors import LeafcutError
from leafcut.options import all_options, group_of
from leafcut.studio import forms
from leafcut.studio.folder import OWN
from leafcut.studio.preview import Seen, look
from leafcut.studio.task import Task, command_line, prepare, program_name
from leafcut.studio.wording import Words

if TYPE_CHECKING:
    from leafcut.studio.app import Studio


@dataclass
class View:
    """The choices of one page.

    Attributes
    ----------
    source, name
        The input: the id of an upload or the name of a built-in part, and what a person calls it; empty for none.
    second, second_name
        Of `verify`: the program that must do the same work.
    values, shown, errors
        Of the form: what was typed, what chosen files are called, and what is wrong.
    job
        The job whose outcome is shown, or None.
    pace
        How fast a search goes that is studied, by `panel_live.PACES`.
    """

    studio: Studio
    words: Words
    source: str = ""
    name: str = ""
    second: str = ""
    second_name: str = ""
    seen: Seen | None = None
    work: str = "drill"
    process: str = "auto"
    values: dict[str, Any] = field(default_factory=dict)
    shown: dict[str, str] = field(default_factory=dict)
    errors: dict[str, str] = field(default_factory=dict)
    job: str | None = None
    pace: str = "full"

    def look(self, work: str = "") -> Seen:
        """Read the input, for a kind of work or the likeliest; slow for a large file."""
        try:
            options = {n: v for n, v in forms.of_work(work or "drill", self.values).items() if n in OF_READING}
            call = prepare(Task("simulate", (self.source,), "auto", options), self.studio.folder)
            seen = look(call.sources[0], work, call.options)
        except LeafcutError as problem:
            raise LeafcutError(self.studio.folder.without_paths(str(problem))) from None
        return replace(seen, error=self.studio.folder.without_paths(seen.error))

    def works(self) -> tuple[str, ...]:
        """Return the kinds of work that the input is good for; all of them before there is one."""
        return self.seen.works if self.seen is not None else tuple(forms.WORKS)

    @property
    def studied(self) -> bool:
        """Whether the search is one of those that people study step by step."""
        chosen = str(self.values.get("algorithm") or "auto")
        return "algorithm" in forms.of_work(self.work, self.values) and chosen in forms.STUDIED

    def put(self, name: str, value: Any, shown: str = "") -> None:
        """Take a value as typed, and note what is wrong with it."""
        if value in (None, "", group_of(name).defaults()[name]):
            self.values.pop(name, None)
            self.shown.pop(name, None)
        else:
            self.values[name] = value
            if shown:
                self.shown[name] = shown
        self.errors.pop(name, None)
        problem = forms.problem_with(name, value)
        if problem:
            self.errors[name] = problem

    def form(self) -> list[dict[str, Any]]:
        """Return the options form of the work chosen."""
        folder = self.studio.folder
        machines = {name: name for name in _shipped()}
        machines |= {OWN + name: self.words("machines.own", name=name) for name in folder.own("machines")}
        return forms.form(self.work, self.values, self.words, machines=machines, tools=folder.own("tools"))

    def task(self) -> Task:
        """Return what is asked for."""
        work = forms.WORKS[self.work]
        inputs = (self.source, self.second) if self.work == "verify" else (self.source,)
        process = self.process if self.work == "program" else work.process
        return Task(work.command, inputs, process, forms.of_work(self.work, self.values))

    def command_line(self) -> str:
        """Return what one types to have the same run; empty as long as that cannot be said."""
        if not self.source or (self.work == "verify" and not self.second):
            return ""
        try:
            task = self.task()
            return command_line(task, self.studio.folder, self._output(task))
        except LeafcutError:
            return ""

    def _output(self, task: Task) -> str:
        if task.command != "optimize":
            return ""
        call = prepare(task, self.studio.folder)
        return program_name(self.name, api.program_extension(api.dialect_of(call.options, task.process)))


#: What of the options changes how a file is read.
OF_READING = frozenset(
    name
    for group, name, _ in all_options()
    if group.section in ("read", "sheet") or name in ("machine", "pixel_size", "threshold", "speckle", "invert")
) | {"pocket_layers", "island_layers"}


def _shipped() -> list[str]:
    from leafcut.read.machine import machine_names

    return machine_names()
