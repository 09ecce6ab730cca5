"""What one open page shows: each tab of a browser has its own; the jobs are everybody's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from leafcut import api
from leafcut.errors import LeafcutError, OptionError
from leafcut.model.heartbeat import OnProgress
from leafcut.options import LITERATURE
from leafcut.options.option_spec import flag_name
from leafcut.processes.settings import all_options, group_of, options_of_file
from leafcut.studio.folder import OWN
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.task import Task, command_line, prepare, program_name
from leafcut.studio.page import fitting_machines, forms
from leafcut.studio.page.chart_menus import Menus, chart_menus, chart_problem
from leafcut.studio.page.own_defaults import OwnDefaults, own_defaults, without_idle
from leafcut.studio.page.preview import Seen, look
from leafcut.studio.page.whole import Zero
from leafcut.studio.wording import Words

if TYPE_CHECKING:
    from leafcut.studio.studio import Studio


@dataclass
class View:
    """The choices of one page.

    Attributes
    ----------
    source, name
        The input: the id of an upload or the name of a built-in part, and what a person calls it; empty for none.
    second, second_name
        Of `verify`: the program that must do the same work.
    parts, part_names
        Of a nest: what is wanted, and id → what a person calls the drawing.
    origin
        The nested sheet that the input is (`sheets.SheetOfNest.origin`); empty for another.
    sheet
        Which sheet of the job's nests is shown: variant and number.
    values, shown, errors
        Of the form: what was typed, what chosen files are called, and what is wrong.
    of_input
        Names of values that were put for this input alone: they go when another one comes.
    kept
        Names of values of the shop that were chosen for an earlier input.
    usual
        Names of values that the person's own defaults gave, and where: name → file and line.
    known_defaults
        What that file gave when it was read last; None where the page takes no more from it.
    job
        The job whose outcome is shown, or None.
    pace
        How fast a search goes that is studied, by `panel_live.PACES`.
    edited
        Whether the order of the outcome was changed by hand, and not run yet.
    for_study
        Whether a search is chosen to see ants or fireflies learn; None as long as nobody has chosen here.
    """

    studio: Studio
    words: Words
    source: str = ""
    name: str = ""
    second: str = ""
    second_name: str = ""
    parts: list[WantedPart] = field(default_factory=list)
    part_names: dict[str, str] = field(default_factory=dict)
    origin: str = ""
    sheet: tuple[int, int] = (1, 1)
    seen: Seen | None = None
    work: str = "drill"
    process: str = "auto"
    values: dict[str, Any] = field(default_factory=dict)
    shown: dict[str, str] = field(default_factory=dict)
    errors: dict[str, str] = field(default_factory=dict)
    of_input: set[str] = field(default_factory=set)
    kept: set[str] = field(default_factory=set)
    usual: dict[str, str] = field(default_factory=dict)
    known_defaults: set[str] | None = None
    job: str | None = None
    pace: str = "full"
    edited: bool = False
    for_study: bool | None = None

    def look(self, work: str = "", progress: OnProgress | None = None) -> Seen:
        """Read the input, for a kind of work or the likeliest; slow for a large file."""
        try:
            values = dict(self.values)  # a person may type meanwhile
            known = forms.of_work(work, values) if work else forms.changed(values)
            options = {n: v for n, v in known.items() if n in OF_READING and n not in self.errors}
            call = prepare(Task("simulate", (self.source,), "auto", options), self.studio.folder)
            seen = look(call.sources[0], work, call.options, progress)
        except LeafcutError as problem:
            raise LeafcutError(self.studio.folder.without_paths(str(problem))) from None
        return replace(seen, error=self.studio.folder.without_paths(seen.error))

    def works(self) -> tuple[str, ...]:
        """Return the kinds of work that the input is good for; all of them before there is one."""
        known = self.seen.works if self.seen is not None else tuple(forms.works())
        return (*known, "nest") if self.parts and "nest" not in known else known

    @property
    def studied(self) -> bool:
        """Whether the search is one of those that people study step by step."""
        chosen = str(self.values.get("algorithm") or "auto")
        return "algorithm" in forms.of_work(self.work, self.values) and chosen in LITERATURE

    def follow_study(self) -> None:
        """Turn local search off where an algorithm of the literature was chosen for a map, and on where it is no more.

        Local search hides what ants and fireflies learn. What a person said of it holds.
        """
        before, self.for_study = self.for_study, self.work == "solve" and self.studied
        if before is None or before == self.for_study:
            return
        if self.for_study and "local_search" not in self.values:
            self.put("local_search", False)
        elif not self.for_study:
            self.put("local_search", "")

    def leave_unfit(self) -> str:
        """Leave what was chosen for an earlier input and does nothing for this one; return what a person is told."""
        if self.values.get("pixel_size") and self.seen is not None and self.seen.format != "picture":
            self.put("pixel_size", "")
        machine = str(self.values.get("machine") or "")
        if not fitting_machines.why_not(machine, self.work, self.studio.folder, self.words):
            return ""
        self.put("machine", "")
        return self.words("choose.left", machine=machine.removeprefix(OWN), usual=api.default_machine(self.work))

    def take(self, source: str, name: str, origin: str = "") -> None:
        """Be at another input; the values that belong to the one before go with it."""
        for put in self.of_input & self.values.keys():
            self.put(put, "")
        if self.source not in ("", source):
            self._start_fresh()
        self.source, self.name, self.origin = source, name, origin
        self.second = self.second_name = ""

    def _start_fresh(self) -> None:
        """Reset the values that belong to a file to the person's own defaults; mark those of the shop as kept."""
        mine = own_defaults(self.studio.folder) if self.known_defaults is not None else OwnDefaults()
        for _, name, spec in all_options():
            if spec.of_file and name not in self.usual and (name in self.values or name in mine.values):
                self.put(name, mine.values.get(name, ""), mine.shown.get(name, ""))
                if name in self.values and name in mine.places:
                    self.usual[name] = mine.places[name]
        self.kept = self.values.keys() - self.usual.keys()

    @property
    def wrong(self) -> dict[str, str]:
        """What is wrong with the options that mean something to the work chosen: name → line."""
        known = forms.of_work(self.work, self.values)
        return {name: line for name, line in self.problems.items() if name in known}

    @property
    def problems(self) -> dict[str, str]:
        """What is wrong with the values, by themselves and for the work chosen: name → line."""
        machine = str(self.values.get("machine") or "")
        line = fitting_machines.why_not(machine, self.work, self.studio.folder, self.words)
        return {**self.errors, "machine": line} if line else self.errors

    def take_defaults(self) -> str:
        """Begin with the person's own defaults; return why that cannot be, in one line, or nothing."""
        found = own_defaults(self.studio.folder)
        for name, value in found.values.items():
            self.put(name, value, found.shown.get(name, ""))
        self.usual = {name: place for name, place in found.places.items() if name in self.values}
        self.known_defaults = set(found.places)
        return found.problem

    def renew_defaults(self) -> str:
        """Follow the file of defaults as it is now, in a page that was left; return why that cannot be, or nothing.

        Values that came from it follow it, and what is new in it is taken. What a person typed, or emptied, stays.
        """
        found = own_defaults(self.studio.folder)
        if found.problem:
            return found.problem
        new = set() if self.known_defaults is None else found.values.keys() - self.known_defaults
        follow = set(self.usual) | {name for name in new if name not in self.values}
        for name in follow:
            self.put(name, found.values.get(name, ""), found.shown.get(name, ""))
        self.usual = {name: found.places[name] for name in follow if name in found.places and name in self.values}
        if self.known_defaults is not None:
            self.known_defaults = set(found.places)
        return ""

    def put_for_input(self, name: str, value: Any, shown: str = "") -> None:
        """Take a value that holds for this input alone."""
        self.put(name, value, shown)
        self.of_input.add(name)

    def put(self, name: str, value: Any, shown: str = "") -> None:
        """Take a value as typed, and note what is wrong with it."""
        self.of_input.discard(name)
        self.kept.discard(name)
        self.usual.pop(name, None)
        if value in (None, "", group_of(name).defaults()[name]):
            self.values.pop(name, None)
            self.shown.pop(name, None)
        else:
            self.values[name] = value
            if shown:
                self.shown[name] = shown
        self.errors.pop(name, None)
        problem = forms.problem_with(name, value)
        if name == "chart":
            problem = chart_problem(self.values, self.studio.folder)
        if problem:
            self.errors[name] = problem

    def take_options(self, made: str) -> None:
        """Take the options of a file that was opened, in place of what was typed.

        Raises
        ------
        OptionError
            It is no file of options, or one that names other files: the studio looks for none.
        """
        try:
            found = options_of_file(self.studio.folder.input_path(made))
        except OptionError as problem:
            raise OptionError(self.studio.folder.without_paths(str(problem))) from None
        for name, value in found.items():
            spec = group_of(name).specs()[name]
            if spec.names_file(value):
                raise OptionError(f"{flag_name(name)}: choose a file opened in the studio, not a path")
        self.for_study = None  # what the file says holds
        for name, value in found.items():
            words = ",".join(map(str, value)) if isinstance(value, list) else value
            self.put(name, words if isinstance(words, bool) else str(words))

    def form(self) -> list[dict[str, Any]]:
        """Return the options form of the work chosen."""
        tools = self.studio.folder.own("tools")
        chosen = str(self.values.get("machine") or "")
        machines = fitting_machines.offered(self._machines(), self.work, chosen, self.studio.folder)
        return forms.form(
            self.work,
            self.values,
            self.words,
            machines=machines,
            tools=tools,
            menus=self._menus(self.work),
            usual=self.usual,
            kept=self.kept,
        )

    def cut_form(self) -> list[dict[str, Any]]:
        """Return the form of what nested sheets are cut with."""
        machines = fitting_machines.offered(self._machines(), "cut", "", self.studio.folder)
        return forms.form_of("cuts", forms.CUT_OF_NEST, self.words, "cut", machines, self._menus("cut"))

    def _menus(self, work: str) -> Menus:
        """Return what the cut chart offers, where the work is done by one."""
        if not any("cut_process" in names for _, names in forms.names_of(work)):
            return {}
        return chart_menus(self.values, self.studio.folder, self.words, str(forms.default_of("machine", work)))

    def cut_options(self) -> dict[str, Any]:
        """Return what nested sheets are cut with; how often each is cut is known from the nest.

        Raises
        ------
        OptionError
            A value is wrong.
        """
        wrong = [name for name in self.errors if name in forms.CUT_OF_NEST]
        if wrong:
            raise OptionError(f"{flag_name(wrong[0])}: {self.errors[wrong[0]]}")
        return {name: value for name, value in forms.of_work("cut", self.values).items() if name != "quantity"}

    def _machines(self) -> dict[str, str]:
        own = self.studio.folder.own("machines")
        return {name: name for name in _known_machines()} | {OWN + n: self.words("machines.own", name=n) for n in own}

    @property
    def zero(self) -> Zero:
        """Where in the drawing program zero is, where the work chosen has an option for that; else None."""
        known = {name for _, names in forms.names_of(self.work) for name in names}
        return self.seen.zero if self.seen is not None and "origin" in known else None

    @property
    def ready(self) -> bool:
        """Whether there is what the work needs."""
        if self.work == "nest":
            return bool(self.parts)
        return bool(self.source) and bool(self.work != "verify" or self.second)

    def task(self) -> Task:
        """Return what is asked for."""
        work = forms.works()[self.work]
        inputs: tuple[str, ...] = (self.source, self.second) if self.work == "verify" else (self.source,)
        if self.work == "nest":
            inputs = tuple(one.word for one in self.parts)
        process = self.process if self.work == "program" else work.process
        origin = self.origin if self.work == "cut" else ""
        kind = self.seen.format if self.seen is not None else ""
        options = without_idle(forms.of_work(self.work, self.values), self.usual, self.work, kind)
        return Task(work.command, inputs, process, options, origin)

    def command_line(self) -> str:
        """Return what one types to have the same run; empty as long as that cannot be said."""
        if not self.ready:
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


#: What beside the options of reading changes how a file is read, or how it lies on the machine.
_ALSO_READ = {
    "machine",
    "work_offset",
    "pixel_size",
    "threshold",
    "speckle",
    "invert",
    "pocket_layers",
    "island_layers",
    "tools",
    "workpiece",
    "tool_diameter",
}
#: What of the options changes how a file is read.
OF_READING = frozenset(
    name for group, name, _ in all_options() if group.section in ("read", "sheet") or name in _ALSO_READ
)


def _known_machines() -> list[str]:
    from leafcut.read.machine import machine_names

    return machine_names()
