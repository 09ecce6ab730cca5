"""The registry of all processes: built-in processes, and plug-ins in the entry-point group ``leafcut.processes``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError, OptionError
from leafcut.files.plugins import PluginKind
from leafcut.message import Message
from leafcut.options import SHARED, CutDataOptions, Settings
from leafcut.options.option_spec import OptionGroup, flag_name
from leafcut.processes.base import Process, Work

if TYPE_CHECKING:
    from leafcut.model.kinds import Head
    from leafcut.model.outcome import Outcome
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Format, Source
    from leafcut.report.path_report import PathReport

#: Built-in processes: name → module and class. All lists use this order.
BUILT_IN = {
    "drill": "leafcut.processes.drilling.process:Drilling",
    "cut": "leafcut.processes.sheet.process:SheetCutting",
    "pocket": "leafcut.processes.pocket.process:Pocketing",
    "part": "leafcut.processes.part.process:PartMilling",
    "program": "leafcut.processes.program.process:ForeignProgram",
}
#: Work that does not generate programs: name → module and class. All lists use this order.
OTHER_WORKS = {
    "nest": "leafcut.nesting.work:Nesting",
    "solve": "leafcut.processes.other_works:Solving",
    "simulate": "leafcut.processes.other_works:Simulating",
    "stock": "leafcut.processes.other_works:CuttingStock",
    "verify": "leafcut.processes.other_works:Verifying",
    "cutting-data": "leafcut.processes.other_works:ChoosingSpeeds",
}
#: Commands that are not named like their process: process → command.
_COMMAND_OF = {"program": "reorder"}
#: Default process for each type of input.
_USUAL = {"drawing": "drill", "program": "program"}
#: Process for a drawing that shows a whole part, if the machine is a mill.
_PART = "part"
#: Other commands and other values of ``--process``. Plug-ins cannot use these names.
OTHER_COMMANDS = (
    "auto", "optimize", "filter", "nest", "solve", "simulate", "stock", "verify", "machine", "tools", "list", "install",
    "defaults", "send", "studio", "lab",
)  # fmt: skip
#: Functions that run the other commands: name → module and function.
COMMANDS = {
    "cutting_data": "leafcut.processes.cutting_data.run:cutting_data",
    "cutting_data_library": "leafcut.processes.cutting_data.saving:library_text",
    "nest_answer": "leafcut.nesting.report:nest_as_json",
    "nest_summary": "leafcut.nesting.report:print_nests",
    "nest": "leafcut.nesting.command:run_nest_command",
    "simulate": "leafcut.processes.program.simulate:simulate",
    "shown_stock": "leafcut.processes.program.tools:stock_of_file",
    "stock": "leafcut.processes.program.stock:cut_stock",
    "verify": "leafcut.processes.program.verify:verify",
}


def _create_plugin_process(name: str, entry: Any) -> Process:
    """Load the process of an entry point.

    Check that its names and options are valid and that no other process uses them.
    """
    if not isinstance(entry, type) or Process not in entry.__mro__:
        raise TypeError("a class that inherits from leafcut.processes.base.Process was expected")
    instance: Process = entry()
    if not instance.title.isprintable():
        raise ValueError("its title must be one line of text")
    if not instance.name == instance.command == name:
        raise ValueError(
            f"its name '{instance.name}', command '{instance.command}' and entry point '{name}' must be equal"
        )
    if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise ValueError("its name must be lower-case letters, digits and -")
    if reserved := sorted(_reserved_words() & set(instance.process_values)):
        raise ValueError(f"leafcut already has a process '{reserved[0]}'")
    shared = [*SHARED, *(group for built_in in (*BUILT_IN, *OTHER_WORKS) for group in work(built_in).options)]
    for group in instance.options:
        conflicts = [f"[{group.section}]" for existing in shared if existing.section == group.section]
        conflicts += [
            flag_name(option) for existing in shared for option in group.specs() if option in existing.specs()
        ]
        if conflicts:
            raise ValueError(f"leafcut already has {conflicts[0]}")
    known = {option for group in (*shared, *instance.options) for option in group.specs()}
    for option in (*instance.used(), *(option for _, names in instance.form for option in names)):
        if option not in known:
            raise ValueError(f"unknown option '{option}'")
    return instance


@cache
def _reserved_words() -> frozenset[str]:
    built_in = [process(name) for name in BUILT_IN]
    return frozenset(
        {
            *OTHER_COMMANDS,
            *BUILT_IN,
            *(word for process_ in built_in for word in (process_.command, *process_.process_values)),
        }
    )


def _unique_names(process_: Process) -> tuple[str, ...]:
    """Return the names that no two processes may share: values of ``--process``, tables of options, and flags."""
    tables = (f"[{group.section}]" for group in process_.options)
    flags = (flag_name(option) for group in process_.options for option in group.specs())
    return (*(f"--process {word}" for word in process_.process_values), *tables, *flags)


#: Processes from other packages. Each entry point is a class that inherits from `base.Process`.
PACKAGED = PluginKind(
    "process",
    "leafcut.processes",
    _reserved_words,
    _create_plugin_process,
    lambda process_: process_.title,
    _unique_names,
)


def process(name: str) -> Process:
    """Return the process with a name. Raises OptionError if the name is unknown, or if the plug-in cannot be used."""
    found: Process = _instance_of(BUILT_IN[name]) if name in BUILT_IN else PACKAGED.load(name)
    return found


@cache
def _instance_of(name: str) -> Any:
    return resolve_name(name)()


def report_of(outcome: Outcome[Any]) -> PathReport[Any]:
    """Return the report of an outcome. Raises OptionError if the process is a plug-in that is not installed."""
    # An outcome stored by an earlier version names no process.
    usual = "program" if outcome.part.format == "gcode" else outcome.process
    return process(outcome.made_by or usual).report(outcome)


def process_names() -> tuple[str, ...]:
    """Return the names of all processes. Built-in processes come first."""
    return (*BUILT_IN, *PACKAGED.names())


def process_commands() -> tuple[str, ...]:
    """Return the commands of all processes. This does not load the processes."""
    return tuple(_COMMAND_OF.get(name, name) for name in process_names())


def process_of_command(word: str) -> Process | None:
    """Return the process that a command runs, or None. Other processes are not loaded.

    Raises OptionError if the process is a plug-in that cannot be used.
    """
    built_in = next((name for name in BUILT_IN if _COMMAND_OF.get(name, name) == word), None)
    name = built_in or next((name for name in PACKAGED.names() if name == word), None)
    return process(name) if name else None


def drawing_process(word: str) -> Process | None:
    """Return the process for drawings that a value of ``--process`` selects.

    Return None for "auto" and for processes that read programs.
    """
    named = None if word == "auto" else process_of_command(word)
    candidates = [named] if named or word == "auto" else processes()
    return next(
        (
            process_
            for process_ in candidates
            if process_ and process_.reads == "drawing" and word in process_.process_values
        ),
        None,
    )


def processes() -> Iterator[Process]:
    """Yield all processes, but skip plug-ins that cannot be loaded. Call `process` to get the reason."""
    for name in process_names():
        try:
            yield process(name)
        except OptionError:
            if name in BUILT_IN:
                raise


def option_groups(own: Iterable[type[OptionGroup]] | None = None) -> tuple[type[OptionGroup], ...]:
    """Return the shared groups of options and the groups `own`.

    By default, `own` contains the groups of all types of work.
    """
    if own is None:
        own = dict.fromkeys(group for work_ in works() for group in work_.options)
    position = SHARED.index(CutDataOptions) + 1
    return (*SHARED[:position], *own, *SHARED[position:])


def works() -> tuple[Work, ...]:
    """Return all types of work, with the processes first."""
    return (*processes(), *map(work, OTHER_WORKS))


def work(name: str) -> Work:
    """Return the type of work with a name. Other types of work are not loaded."""
    found: Work = _instance_of(OTHER_WORKS[name]) if name in OTHER_WORKS else process(name)
    return found


def command_function(name: str) -> Any:
    """Return the Python function that runs a command."""
    return resolve_name(COMMANDS[name])


def all_process_values() -> tuple[str, ...]:
    """Return all values of ``--process``. The values for drawings come before the values for programs."""
    words = [
        word
        for kind in ("drawing", "program")
        for process_ in processes()
        if process_.reads == kind
        for word in process_.process_values
    ]
    return ("auto", *dict.fromkeys(words))


def offered_works(works: Sequence[str], format_name: str) -> tuple[str, ...]:
    """Return the types of work to offer for an input.

    These are `works`, nesting after cutting, and plug-ins for the file format.
    """
    plugins = (process_.name for process_ in processes() if format_name in process_.formats)
    return (*(name for work in works for name in ((work, "nest") if work == "cut" else (work,))), *plugins)


def rate_works(works: Sequence[str], drawing: WholeDrawing) -> dict[str, Suitability]:
    """Rate a drawing for each type of work that rates drawings. The highest rating comes first."""
    ratings = {name: work(name).rate_drawing(drawing) for name in works}
    given_ratings = {name: rating for name, rating in ratings.items() if rating is not None}
    return dict(sorted(given_ratings.items(), key=lambda pair: -pair[1].score))


def machine_can_do(name: str, head: Head) -> bool:
    """Return whether a machine with the given head can do a type of work."""
    heads = work(name).heads
    return not heads or head in heads


def guess_command(inputs: Sequence[tuple[Format, Source]], settings: Settings) -> str:
    """Choose the command for an input that suits several types of work. For the usual command, return "auto".

    The head of the machine that the user named comes first, then the given options, and then the drawing. In a drawing,
    the layer names decide. If the user named a machine and a mill, a drawing that contains more than holes is treated
    as a part. Raises OptionError if there is still no decision and the input has no usual command.
    """
    format_, source = inputs[0]
    names, usual_name = [name for name in format_.processes if name in BUILT_IN], _USUAL["drawing"]
    if len(inputs) > 1 or len(names) < 2:
        return "auto"

    @cache
    def drawing() -> WholeDrawing | None:
        return _read_whole_drawing(source, settings)

    names = _names_fitting_options(_names_fitting_machine(names, settings), settings)
    others = [name for name in names if name != _PART]
    if others != names and others:
        if _is_part_for_mill(names, drawing, settings):
            return _PART
        if len(others) == 1 or usual_name in others:
            names = others
    if len(names) > 1 and usual_name not in names:
        commands = [f"leafcut {_COMMAND_OF.get(name, name)} {source.path}" for name in names]
        choices = " or ".join(", ".join(commands).rsplit(", ", 1))
        raise OptionError("{}: several kinds of work are possible; use {}", source.path, choices)
    chosen = names[0] if len(names) == 1 else _process_named_by_layers(names, source, drawing, settings) or usual_name
    return "auto" if chosen == usual_name else _COMMAND_OF.get(chosen, chosen)


def _names_fitting_machine(names: list[str], settings: Settings) -> list[str]:
    if "machine" not in settings.given:
        return names
    from leafcut.read.machine import load_machine

    head = load_machine(settings.machine.machine).head
    return [name for name in names if machine_can_do(name, head)] or names


def _names_fitting_options(names: list[str], settings: Settings) -> list[str]:
    if len(names) < 2 or settings.asked <= process(names[0]).used().keys():
        return names
    return [name for name in names if settings.asked <= process(name).used().keys()] or names


def _process_named_by_layers(
    names: list[str], source: Source, drawing: Callable[[], WholeDrawing | None], settings: Settings
) -> str:
    """Return the process that the layer names of a drawing suggest. If the drawing has many holes, return ""."""
    from leafcut.processes.suitability import COUNTED

    stems = {pattern.rstrip("*").encode() for name in names for pattern in process(name).layer_names}
    if settings.read.layers or not any(stem in source.data.upper() for stem in stems):
        return ""
    ratings = _ratings(names, drawing())
    likeliest = next(iter(ratings), "")
    holes = ratings.get(_USUAL["drawing"])
    clear = likeliest and ratings[likeliest].score > COUNTED and (holes is None or 2.0 * holes.score < COUNTED)
    return likeliest if clear else ""


def _is_part_for_mill(names: list[str], drawing: Callable[[], WholeDrawing | None], settings: Settings) -> bool:
    """Return whether the user named a machine and a mill, and "part" has the highest rating for the drawing."""
    named = {"machine", "tool_diameter"} <= settings.given and settings.asked <= process(_PART).used().keys()
    return named and next(iter(_ratings(names, drawing())), "") == _PART


def _ratings(names: list[str], drawing: WholeDrawing | None) -> dict[str, Suitability]:
    return {} if drawing is None else rate_works(names, drawing)


def _read_whole_drawing(source: Source, settings: Settings) -> WholeDrawing | None:
    from leafcut.processes.suitability import WholeDrawing
    from leafcut.read import read_whole

    try:
        return WholeDrawing(read_whole(source, settings.read))
    except LeafcutError:  # the process reports it
        return None


def check_process_value(word: str) -> None:
    """Raise OptionError if a value of ``--process`` is unknown."""
    named = None if word == "auto" else process_of_command(word)
    if word != "auto" and not (named and word in named.process_values) and word not in all_process_values():
        raise OptionError("--process: unknown process '{}'; choose one of {}", word, ", ".join(all_process_values()))


def process_for(inputs: Sequence[tuple[Format, Source]], asked: str) -> Process:
    """Return the process for the inputs of a job.

    `asked` is a known value of ``--process`` (`check_process_value`). Raises OptionError if the requested process
    cannot read the inputs.
    """
    if len(inputs) > 1:
        return _process_for_several_inputs(inputs, asked)
    if asked == "auto":
        return process(_usual_process_name(inputs))
    kind = _input_kind(inputs)
    named = process_of_command(asked)
    if named and named.reads == kind and asked in named.process_values:
        return named
    fitting = [process_ for process_ in processes() if process_.reads == kind]
    for process_ in fitting:
        if asked in process_.instead:
            raise OptionError("{}: {}: {}", inputs[0][1], asked, process_.instead[asked])
    for process_ in fitting:
        if asked in process_.process_values:
            return process_
    words = " or ".join(", ".join(word for process_ in fitting for word in process_.process_values).rsplit(", ", 1))
    raise OptionError("{}: {}: the input is a drawing, not a program; use {}", inputs[0][1], asked, words)


def _input_kind(inputs: Sequence[tuple[Format, Source]]) -> str:
    return "program" if "program" in inputs[0][0].processes else "drawing"


def _usual_process_name(inputs: Sequence[tuple[Format, Source]]) -> str:
    if len(inputs) > 1:
        return _process_for_several_inputs(inputs, "auto").name
    format_, kind = inputs[0][0], _input_kind(inputs)
    name = format_.processes[0] if len(format_.processes) == 1 else ""
    if name in process_names():
        with suppress(OptionError):  # a plug-in that cannot be used
            process_ = process(name)
            if process_.by_itself and process_.reads == kind:
                return name
    return _USUAL[kind]


def needed_process_value(inputs: Sequence[tuple[Format, Source]], asked: str, chosen: Process) -> str:
    """Return the value of ``--process`` that selects the chosen process again.

    If the inputs alone determine the process, return "".
    """
    implied = asked in ("auto", chosen.command) and _usual_process_name(inputs) == chosen.name
    return "" if implied else asked


def _process_for_several_inputs(inputs: Sequence[tuple[Format, Source]], asked: str) -> Process:
    for process_ in processes():
        other_files = [source for format_, source in inputs if format_.name != process_.joins]
        if process_.joins and not other_files and asked in ("auto", *process_.process_values):
            return process_
        if process_.joins:
            reason = (
                Message("{} is not a drill file", other_files[0].path)
                if other_files
                else Message("--process {} cannot combine them", asked)
            )
            raise OptionError("only drill files can be combined into one program; {}", reason)
    raise OptionError("several inputs cannot be combined into one program")
