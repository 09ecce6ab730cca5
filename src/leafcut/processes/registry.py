"""The processes that there are: those built in, and those of the entry-point group ``leafcut.processes``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from leafcut.errors import OptionError
from leafcut.files.plugins import PluginKind
from leafcut.options import SHARED, CutDataOptions, Settings
from leafcut.options.option_spec import OptionGroup, flag_name
from leafcut.processes.base import Process, Work
from leafcut.processes.inquiries import ChoosingSpeeds, CuttingStock, Simulating, Solving, Verifying

if TYPE_CHECKING:
    from leafcut.model.kinds import Head
    from leafcut.model.outcome import Outcome
    from leafcut.model.part import Part
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Format, Source
    from leafcut.report.path_report import PathReport

#: In the order in which they are offered: name → module and class.
BUILT_IN = {
    "drill": "leafcut.processes.drilling.process:Drilling",
    "cut": "leafcut.processes.sheet.process:SheetCutting",
    "nest": "leafcut.processes.nesting.process:Nesting",
    "pocket": "leafcut.processes.pocket.process:Pocketing",
    "program": "leafcut.processes.program.process:ForeignProgram",
}
#: Commands that are not named as their process is: process → command.
_COMMAND_OF = {"program": "reorder"}
#: The process of an input that is good for several, by the kind of input.
_USUAL = {"drawing": "drill", "program": "program"}
#: Commands and words behind ``--process`` that are no processes: no plug-in can take their names.
OTHER_COMMANDS = (
    "auto", "optimize", "filter", "solve", "simulate", "stock", "verify", "machine", "tools", "list", "install",
    "defaults", "send", "studio", "lab",
)  # fmt: skip
#: What other commands than `optimize` do, each in the package of the process that it belongs to.
COMMANDS = {
    "cutting_data": "leafcut.processes.cutting_data.run:cutting_data",
    "cutting_data_library": "leafcut.processes.cutting_data.saving:library_text",
    "nest_answer": "leafcut.processes.nesting.report:nest_as_json",
    "nest_summary": "leafcut.processes.nesting.report:print_nests",
    "nest": "leafcut.processes.nesting.command:nest",
    "simulate": "leafcut.processes.program.simulate:simulate",
    "shown_stock": "leafcut.processes.program.shown:stock_of_file",
    "stock": "leafcut.processes.program.stock:cut_stock",
    "verify": "leafcut.processes.program.verify:verify",
}


def _process_of(name: str, found: Any) -> Process:
    """Return the process that an entry point names, after a look at what all commands ask of it."""
    if not isinstance(found, type) or Process not in found.__mro__:
        raise TypeError("a class that inherits from leafcut.processes.base.Process was expected")
    made: Process = found()
    if not made.title.isprintable():
        raise ValueError("its title must be one line of text")
    if not made.name == made.command == name:
        raise ValueError(f"its name '{made.name}', command '{made.command}' and entry point '{name}' must be equal")
    if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise ValueError("its name must be lower-case letters, digits and -")
    if words := sorted(_taken_words() & set(made.asked_as)):
        raise ValueError(f"leafcut already has a process '{words[0]}'")
    shared = [*SHARED, *(group for one in BUILT_IN for group in process(one).options)]
    for group in made.options:
        taken = [f"[{group.section}]" for other in shared if other.section == group.section]
        taken += [flag_name(option) for other in shared for option in group.specs() if option in other.specs()]
        if taken:
            raise ValueError(f"leafcut already has {taken[0]}")
    known = {option for group in (*shared, *made.options) for option in group.specs()}
    for option in (*made.used(), *(option for _, names in made.form for option in names)):
        if option not in known:
            raise ValueError(f"unknown option '{option}'")
    return made


@cache
def _taken_words() -> frozenset[str]:
    """Return what asks for a process of leafcut's own, and the names of its commands."""
    own = [process(name) for name in BUILT_IN]
    return frozenset({*OTHER_COMMANDS, *BUILT_IN, *(word for one in own for word in (one.command, *one.asked_as))})


def _claims(one: Process) -> tuple[str, ...]:
    """Return what a process has that no other one may have: its words, and its options with their tables."""
    tables = (f"[{group.section}]" for group in one.options)
    flags = (flag_name(option) for group in one.options for option in group.specs())
    return (*(f"--process {word}" for word in one.asked_as), *tables, *flags)


#: Outsiders' processes: an entry point is a class that inherits from `base.Process`.
PACKAGED = PluginKind("process", "leafcut.processes", _taken_words, _process_of, lambda one: one.title, _claims)


def process(name: str) -> Process:
    """Return a process by its name.

    Raises
    ------
    OptionError
        There is none of that name, or a plug-in cannot be used.
    """
    return _built_in(name) if name in BUILT_IN else PACKAGED.load(name)


@cache
def _built_in(name: str) -> Process:
    made: Process = _load(BUILT_IN[name])()
    return made


def report_of(outcome: Outcome[Any]) -> PathReport[Any]:
    """Return the facts and pictures of an outcome, by the process that made it.

    Raises
    ------
    OptionError
        The outcome is of a process from outside that is not installed here.
    """
    # An outcome that was not made by the course, such as a stored one of an earlier version, names none.
    usual = "program" if outcome.part.format == "gcode" else outcome.process
    return process(outcome.made_by or usual).report(outcome)


def names() -> tuple[str, ...]:
    """Return the names of all processes, those built in first."""
    return (*BUILT_IN, *PACKAGED.names())


def commands() -> tuple[str, ...]:
    """Return the commands of all processes, without loading one."""
    return tuple(_COMMAND_OF.get(name, name) for name in names())


def of_command(word: str) -> Process | None:
    """Return the process of a command, without loading another one; None for any other word.

    Raises
    ------
    OptionError
        It is a plug-in that cannot be used.
    """
    built_in = next((name for name in BUILT_IN if _COMMAND_OF.get(name, name) == word), None)
    name = built_in or next((name for name in PACKAGED.names() if name == word), None)
    return process(name) if name else None


def of_drawings(word: str) -> Process | None:
    """Return the process of drawings that ``--process`` asks for by a word; None for "auto" and words of programs."""
    named = None if word == "auto" else of_command(word)
    some = [named] if named or word == "auto" else processes()
    return next((one for one in some if one and one.reads == "drawing" and word in one.asked_as), None)


def processes() -> Iterator[Process]:
    """Yield all processes; a plug-in that cannot be loaded is left out, and told where it is asked for by name."""
    for name in names():
        try:
            yield process(name)
        except OptionError:
            if name in BUILT_IN:
                raise


def groups(own: Iterable[type[OptionGroup]] | None = None) -> tuple[type[OptionGroup], ...]:
    """Return all groups of options in the order in which they are told: those of processes behind the job's.

    Where groups of processes are given as `own`, these and the shared ones: no process is loaded.
    """
    if own is None:
        own = [group for one in processes() for group in one.options]
    place = SHARED.index(CutDataOptions) + 1
    return (*SHARED[:place], *own, *SHARED[place:])


def works() -> tuple[Work, ...]:
    """Return all kinds of work: the processes, and what leafcut does besides."""
    return (*processes(), *map(work, ("solve", "simulate", "stock", "verify", "cutting-data")))


def work(name: str) -> Work:
    """Return a kind of work by its name, without loading another one."""
    if name == ChoosingSpeeds.name:
        return ChoosingSpeeds(_built_in("drill"))
    kinds: tuple[type[Work], ...] = (Solving, Simulating, CuttingStock, Verifying)
    return next((kind() for kind in kinds if kind.name == name), None) or process(name)


def command(name: str) -> Any:
    """Return what a command does."""
    return _load(COMMANDS[name])


def asked_words() -> tuple[str, ...]:
    """Return all that ``--process`` may say: of drawings first, then of programs."""
    found = [
        word for kind in ("drawing", "program") for one in processes() if one.reads == kind for word in one.asked_as
    ]
    return ("auto", *dict.fromkeys(found))


def offered(works: Sequence[str], format_name: str) -> tuple[str, ...]:
    """Return what is offered for an input: kinds of work that its format is for, those behind them, and outsiders'."""
    behind = {one.offered_with: one.name for one in processes() if one.offered_with}
    besides = (one.name for one in processes() if format_name in one.formats)
    return (*(name for work in works for name in (work, behind.get(work, "")) if name), *besides)


def look_at(work: str, source: Source | str, settings: Settings) -> Part:
    """Return what is read of an input for a kind of work; where that is no process, its holes."""
    from leafcut.read import read

    return process(work).look_at(source, settings) if work in names() else read(source, settings.read)


def suited(works: Sequence[str], drawing: WholeDrawing) -> dict[str, Suitability]:
    """Return what each of some kinds of work says of a drawing, the likeliest first; without those that say nothing."""
    said = {name: process(name).suits(drawing) for name in works if name in names()}
    known = {name: one for name, one in said.items() if one is not None}
    return dict(sorted(known.items(), key=lambda pair: -pair[1].score))


def does_with(work: str, head: Head) -> bool:
    """Return whether a machine that works with a head can do a kind of work; what is no process asks for none."""
    return work not in names() or not process(work).heads or head in process(work).heads


def machine_for(work: str, format_name: str) -> str:
    """Return the machine that is at hand for files of a format, where a kind of work has one; else ""."""
    return process(work).machine_for(format_name) if work in names() else ""


def usual(work: str, settings: Settings) -> Settings:
    """Return the settings with what a kind of work takes where nobody said anything."""
    return process(work).usual(settings) if work in names() else settings


def check_asked(word: str) -> None:
    """Refuse what no process is asked for by.

    Raises
    ------
    OptionError
        Names what there is.
    """
    named = None if word == "auto" else of_command(word)
    if word != "auto" and not (named and word in named.asked_as) and word not in asked_words():
        raise OptionError(f"--process: unknown process '{word}'; choose one of {', '.join(asked_words())}")


def process_for(inputs: Sequence[tuple[Format, Source]], asked: str) -> Process:
    """Return the process that makes a program of some inputs.

    Raises
    ------
    OptionError
        Nothing does what is asked with such an input.
    """
    check_asked(asked)
    if len(inputs) > 1:
        return _joining(inputs, asked)
    if asked == "auto":
        return process(_usual_name(inputs))
    kind = _kind(inputs)
    named = of_command(asked)
    if named and named.reads == kind and asked in named.asked_as:
        return named
    fitting = [one for one in processes() if one.reads == kind]
    for one in fitting:
        if asked in one.instead:
            raise OptionError(f"{asked}: {one.instead[asked]}")
    for one in fitting:
        if asked in one.asked_as:
            return one
    words = " or ".join(", ".join(word for one in fitting for word in one.asked_as).rsplit(", ", 1))
    raise OptionError(f"{asked}: the input is a drawing, not a program; use {words}")


def _kind(inputs: Sequence[tuple[Format, Source]]) -> str:
    """Return what the first of some inputs is, a program or a drawing."""
    return "program" if "program" in inputs[0][0].processes else "drawing"


def _usual_name(inputs: Sequence[tuple[Format, Source]]) -> str:
    """Return the process that makes a program of some inputs where none is asked for."""
    if len(inputs) > 1:
        return _joining(inputs, "auto").name
    format_, kind = inputs[0][0], _kind(inputs)
    only = format_.processes[0] if len(format_.processes) == 1 else ""
    if only in names():
        with suppress(OptionError):  # a plug-in that cannot be used
            one = process(only)
            if one.by_itself and one.reads == kind:
                return only
    return _USUAL[kind]


def needed_word(inputs: Sequence[tuple[Format, Source]], asked: str) -> str:
    """Return what ``--process`` has to say to have the same work again, "" where the inputs alone say it.

    Which kind of program one is, is looked up in it: where that was said, it has to be said again.
    """
    chosen = process_for(inputs, asked)
    said_by_input = asked in ("auto", chosen.command) and _usual_name(inputs) == chosen.name
    return "" if said_by_input else asked


def _joining(inputs: Sequence[tuple[Format, Source]], asked: str) -> Process:
    """Return the process that makes one program of several files."""
    for one in processes():
        others = [source for format_, source in inputs if format_.name != one.joins]
        if one.joins and not others and asked in ("auto", *one.asked_as):
            return one
        if one.joins:
            what = f"{others[0].path} is not one" if others else f"--process {asked} cannot combine them"
            raise OptionError(f"only drill files can be combined into one program; {what}")
    raise OptionError("several inputs cannot be combined into one program")


def _load(place: str) -> Any:
    module, _, attribute = place.partition(":")
    return getattr(import_module(module), attribute)
