"""The state of an open page. Each browser tab has its own state, but all tabs share the jobs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from leafcut import api
from leafcut.errors import LeafcutError, OptionError
from leafcut.message import Message
from leafcut.options import LITERATURE
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry
from leafcut.processes.settings import all_options, group_of, read_options_file
from leafcut.studio.folder import OWN
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.preview import Preview, preview_without_part, stock_scene
from leafcut.studio.jobs.task import Task, command_line, program_name, resolve_task
from leafcut.studio.jobs.whole import Zero
from leafcut.studio.jobs.workers import StudioWork
from leafcut.studio.page import fitting_machines, forms
from leafcut.studio.page.chart_menus import Menus, chart_error, chart_menus
from leafcut.studio.page.form_values import FormValues, Setter
from leafcut.studio.page.own_defaults import read_own_defaults, without_unused_defaults
from leafcut.studio.wording import Words

if TYPE_CHECKING:
    from leafcut.studio.studio import Studio


@dataclass
class View:
    """The choices of a page.

    Attributes
    ----------
    source, name
        Id of the uploaded input or name of the built-in part, and its displayed name. Both are empty if there is no
        input.
    second, second_name
        The second program for `verify`.
    parts, part_names
        The parts to nest, and the displayed name of each drawing by id.
    origin
        Origin of a nested sheet (`sheets.SheetOfNest.origin`). It is empty for other inputs.
    sheet
        Variant and number of the visible sheet of a nest.
    table
        The values of the form. Each value has a setter.
    job
        The job whose result is visible.
    pace
        Speed of a search that the user can watch step by step (`panel_live.PACES`).
    edited
        Whether the user has edited the order of the result and not run it yet.
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
    seen: Preview | None = None
    work: str = "drill"
    process: str = "auto"
    table: FormValues = field(default_factory=FormValues)
    job: str | None = None
    pace: str = "full"
    edited: bool = False

    @property
    def values(self) -> dict[str, Any]:
        """The values of the form that are set."""
        return self.table.values_only

    @property
    def errors(self) -> dict[str, str]:
        """Errors of single values. Each message starts with the flag of its option."""
        values = self.values
        lines = {name: forms.value_error_message(name, value) for name, value in values.items()}
        if line := chart_error(values, self.studio.folder) if "chart" in values else "":
            lines["chart"] = Message("{}: {}", flag_name("chart"), line)
        return {name: line for name, line in lines.items() if line}

    def read_preview(self, work: str, reading: StudioWork, on_message: Callable[[Any], Any] | None = None) -> Preview:
        """Preview the input in another process. This is slow for a large file.

        Without `work`, the most likely kind of work applies. Raises `LeafcutError` if the input cannot be read.
        """
        try:
            values = self.values
            known = forms.values_of_work(work, values) if work else forms.changed_values(values)
            errors = self.errors
            options = {n: v for n, v in known.items() if n in OF_READING and n not in errors}
            call = resolve_task(Task("simulate", (self.source,), "auto", options), self.studio.folder)
            seen: Preview = reading.run(
                preview_without_part, call.sources[0], work, call.options, on_message=on_message
            )
        except LeafcutError as problem:
            raise LeafcutError(self.studio.folder.hide_paths(str(problem))) from None
        has_stock = seen.format == "gcode" and not seen.error
        stock = partial(self._stock_scene, call.sources[0], call.options) if has_stock else None
        return replace(seen, error=self.studio.folder.hide_paths(seen.error), stock=stock)

    def _stock_scene(self, source: str, options: dict[str, Any]) -> bytes:
        try:
            scene: bytes = StudioWork(self.studio.workers).run(stock_scene, source, options)
        except LeafcutError as problem:
            raise LeafcutError(self.studio.folder.hide_paths(str(problem))) from None
        return scene

    def works(self) -> tuple[str, ...]:
        """Return the kinds of work that suit the input. Without an input, return all kinds."""
        known = self.seen.works if self.seen is not None else forms.works_with_form()
        return (*known, "nest") if self.parts and "nest" not in known else known

    @property
    def is_study(self) -> bool:
        """Whether the search is an algorithm from the literature, which users can watch step by step."""
        values = self.values
        chosen = str(values.get("algorithm") or "auto")
        return "algorithm" in forms.values_of_work(self.work, values) and chosen in LITERATURE

    def turn_off_local_search_for_study(self) -> None:
        """Turn off local search while an algorithm from the literature solves a map, unless the user has set this
        option.

        Local search would hide how ants and fireflies learn.
        """
        entry = self.table.get("local_search")
        if self.work == "solve" and self.is_study:
            if entry is None:
                self.table.set_value("local_search", False, setter=Setter.STUDY)
        elif entry is not None and entry.setter is Setter.STUDY:
            del self.table["local_search"]

    def reset_unsuitable_options(self) -> str:
        """Reset options of an earlier input that do not suit the current input.

        Return a message for the user, or "" if nothing was reset.
        """
        if self.values.get("pixel_size") and self.seen is not None and self.seen.format != "picture":
            self.table.set_value("pixel_size", "")
        machine = str(self.values.get("machine") or "")
        if not fitting_machines.unsuitable_reason(machine, self.work, self.studio.folder, self.words):
            return ""
        self.table.set_value("machine", "")
        return self.words("choose.left", machine=machine.removeprefix(OWN), usual=api.default_machine(self.work))

    def switch_input(self, source: str, name: str, origin: str = "") -> None:
        """Switch to another input, and reset the values of the previous input."""
        self.table.remove_input_values()
        if self.source not in ("", source):
            self.table.reset_for_new_input()
            self.apply_defaults()
        self.source, self.name, self.origin = source, name, origin
        self.second = self.second_name = ""

    @property
    def invalid_values(self) -> dict[str, str]:
        """Errors of all options that apply to the selected kind of work."""
        known = forms.values_of_work(self.work, self.values)
        return {name: line for name, line in self.problems.items() if name in known}

    @property
    def problems(self) -> dict[str, str]:
        """Error messages by option. They cover invalid values and a machine that does not suit the kind of work."""
        machine = str(self.values.get("machine") or "")
        line = fitting_machines.unsuitable_reason(machine, self.work, self.studio.folder, self.words)
        return {**self.errors, "machine": Message("{}: {}", flag_name("machine"), line)} if line else self.errors

    def field_errors(self) -> dict[str, str]:
        """Return the errors in the language of the page.

        They have no flags, because each error appears next to its field.
        """
        lines = {name: self.words.translate(line) for name, line in self.problems.items()}
        return {
            name: self.words.translate_for_page(line.removeprefix(f"{flag_name(name)}: "))
            for name, line in lines.items()
        }

    def apply_defaults(self) -> str:
        """Apply the user's own defaults to options that the user has not changed. Return an error message, or ""."""
        defaults = read_own_defaults(self.studio.folder)
        if not defaults.problem:
            self.table.apply_defaults(defaults)
        return defaults.problem

    def load_options_file(self, input_id: str) -> None:
        """Load an options file that was opened. Raises `OptionError` if its content is invalid or names other files."""
        try:
            options = read_options_file(self.studio.folder.input_path(input_id))
        except OptionError as problem:
            raise OptionError(self.studio.folder.hide_paths(str(problem))) from None
        for name, value in options.items():
            spec = group_of(name).specs()[name]
            if spec.names_file(value):
                raise OptionError("{}: choose a file opened in the studio, not a path", flag_name(name))
        if "algorithm" in options:
            self.table.set_value("local_search", "")  # the options file may set it
        for name, value in options.items():
            words = ",".join(map(str, value)) if isinstance(value, list) else value
            self.table.set_value(name, words if isinstance(words, bool) else str(words))

    def options_form(self) -> list[dict[str, Any]]:
        """Return the options form for the selected kind of work."""
        tools = self.studio.folder.own_names("tools")
        chosen = str(self.values.get("machine") or "")
        machines = fitting_machines.offered_machines(self._machine_labels(), self.work, chosen, self.studio.folder)
        return forms.work_form(
            self.work,
            self.values,
            self.words,
            machines=machines,
            tools=tools,
            menus=self._chart_menus(self.work),
            usual=self.table.default_places,
            kept=self.table.names_set_by(Setter.EARLIER),
        )

    def cut_form(self) -> list[dict[str, Any]]:
        """Return the form with the options for cutting nested sheets."""
        machines = fitting_machines.offered_machines(self._machine_labels(), "cut", "", self.studio.folder)
        return forms.single_group_form("cuts", forms.CUT_OF_NEST, self.words, "cut", machines, self._chart_menus("cut"))

    def _chart_menus(self, work: str) -> Menus:
        if "cut_process" not in forms.applicable_options(work, {}):
            return {}
        return chart_menus(self.values, self.studio.folder, self.words, str(forms.option_default("machine", work)))

    def cut_options(self) -> dict[str, Any]:
        """Return the options for cutting nested sheets. Raises `OptionError` if a value is invalid."""
        for name, line in self.errors.items():
            if name in forms.CUT_OF_NEST:
                raise OptionError(line)
        return {name: value for name, value in forms.values_of_work("cut", self.values).items() if name != "quantity"}

    def _machine_labels(self) -> dict[str, str]:
        own_names = self.studio.folder.own_names("machines")
        return {name: name for name in _known_machines()} | {
            OWN + n: self.words("machines.own", name=n) for n in own_names
        }

    @property
    def program_zero(self) -> Zero:
        """Position of program zero in the drawing, mm, or None if the kind of work has no such option."""
        return self.seen.zero if self.seen is not None and "origin" in forms.applicable_options(self.work, {}) else None

    @property
    def has_all_inputs(self) -> bool:
        """Whether all inputs that the selected kind of work needs are available."""
        if self.work == "nest":
            return bool(self.parts)
        return bool(self.source) and bool(self.work != "verify" or self.second)

    def build_task(self) -> Task:
        """Return the task that the choices describe."""
        inputs: tuple[str, ...] = (self.source, self.second) if self.work == "verify" else (self.source,)
        if self.work == "nest":
            inputs = tuple(part.encoded for part in self.parts)
        process = self.process if self.work == "program" else registry.work(self.work).asks
        if self.work == "drill" and next(iter(self.seen.whole.suits if self.seen else ()), "drill") != "drill":
            process = self.work  # with ``auto``, leafcut would choose another process
        origin = self.origin if self.work == "cut" else ""
        kind = self.seen.format if self.seen is not None else ""
        options = without_unused_defaults(
            forms.values_of_work(self.work, self.values), self.table.default_places, self.work, kind
        )
        return Task(forms.work_command(self.work), inputs, process, options, origin)

    def command_line(self) -> str:
        """Return the shell command for this task. It is empty while an input is missing."""
        if not self.has_all_inputs:
            return ""
        try:
            task = self.build_task()
            return command_line(task, self.studio.folder, self._output_name(task))
        except LeafcutError:
            return ""

    def _output_name(self, task: Task) -> str:
        if task.command != "optimize":
            return ""
        call = resolve_task(task, self.studio.folder)
        return program_name(self.name, api.program_extension(api.dialect_of(call.options, task.process)))


#: Options outside the groups `read` and `sheet` that affect how a file is read or placed on the machine.
_ALSO_READ = {
    "machine",
    "work_offset",
    "copies",
    "copy_spacing",
    "pitch",
    "operations",
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
#: All options that affect how a file is read.
OF_READING = frozenset(
    name for group, name, _ in all_options() if group.section in ("read", "sheet") or name in _ALSO_READ
)


def _known_machines() -> list[str]:
    from leafcut.read.machine import machine_names

    return machine_names()
