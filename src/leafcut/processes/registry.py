"""The processes that there are: those built in, and those of the entry-point group ``leafcut.processes``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from leafcut.errors import OptionError
from leafcut.option_spec import OptionGroup
from leafcut.options import SHARED, CutDataOptions, Settings
from leafcut.processes.base import Process, Work
from leafcut.processes.inquiries import Simulating, Solving, Verifying

if TYPE_CHECKING:
    from leafcut.model.part import Part
    from leafcut.read.format import Format, Source

#: Outsiders' processes: an entry point is a class that inherits from `base.Process`.
PLUGIN_GROUP = "leafcut.processes"

#: In the order in which they are offered: name → module and class.
BUILT_IN = {
    "drill": "leafcut.processes.drilling.process:Drilling",
    "cut": "leafcut.processes.sheet.process:SheetCutting",
    "nest": "leafcut.processes.nesting.process:Nesting",
    "pocket": "leafcut.processes.pocket.process:Pocketing",
    "program": "leafcut.processes.program.process:ForeignProgram",
}
#: What other commands than `optimize` do, each in the package of the process that it belongs to.
COMMANDS = {
    "nest_answer": "leafcut.processes.nesting.report:nest_as_json",
    "nest_summary": "leafcut.processes.nesting.report:print_nests",
    "nest": "leafcut.processes.nesting.command:nest",
    "simulate": "leafcut.processes.program.simulate:simulate",
    "verify": "leafcut.processes.program.verify:verify",
}


@cache
def process(name: str) -> Process:
    """Return a process by its name.

    Raises
    ------
    OptionError
        There is none of that name, or a plug-in cannot be loaded.
    """
    if name in BUILT_IN:
        made: Process = _load(BUILT_IN[name])()
        return made
    for entry in _entry_points():
        if entry.name == name:
            try:
                plugin: Process = entry.load()()
            except Exception as problem:  # whatever it is: a stranger's module
                raise OptionError(f"the plug-in {entry.value} cannot be loaded: {problem}") from None
            return plugin
    raise OptionError(f"there is no process '{name}'")


def names() -> tuple[str, ...]:
    """Return the names of all processes, those built in first."""
    return (*BUILT_IN, *(entry.name for entry in _entry_points() if entry.name not in BUILT_IN))


def processes() -> Iterator[Process]:
    """Yield all processes; a plug-in that cannot be loaded is left out, and told where it is asked for by name."""
    for name in names():
        try:
            yield process(name)
        except OptionError:
            if name in BUILT_IN:
                raise


def groups() -> tuple[type[OptionGroup], ...]:
    """Return all groups of options in the order in which they are told: those of processes behind the job's."""
    own = [group for one in processes() for group in one.options]
    place = SHARED.index(CutDataOptions) + 1
    return (*SHARED[:place], *own, *SHARED[place:])


def works() -> tuple[Work, ...]:
    """Return all kinds of work: the processes, and what leafcut does besides."""
    return (*processes(), Solving(), Simulating(), Verifying())


def work(name: str) -> Work:
    """Return a kind of work by its name; one of the processes, where nothing else has it."""
    return next((one for one in works() if one.name == name), None) or process(name)


def command(name: str) -> Any:
    """Return what a command does."""
    return _load(COMMANDS[name])


def asked_words() -> tuple[str, ...]:
    """Return all that ``--process`` may say: of drawings first, then of programs."""
    found = [
        word for kind in ("drawing", "program") for one in processes() if one.reads == kind for word in one.asked_as
    ]
    return ("auto", *dict.fromkeys(found))


def offered(works: Sequence[str]) -> tuple[str, ...]:
    """Return kinds of work with those that are offered wherever one of them is, each behind that one."""
    behind = {one.offered_with: one.name for one in processes() if one.offered_with}
    return tuple(name for work in works for name in (work, behind.get(work, "")) if name)


def look_at(work: str, source: Source | str, settings: Settings) -> Part:
    """Return what is read of an input for a kind of work; where that is no process, its holes."""
    from leafcut.read import read

    return process(work).look_at(source, settings) if work in names() else read(source, settings.read)


def check_asked(word: str) -> None:
    """Refuse what no process is asked for by.

    Raises
    ------
    OptionError
        Names what there is.
    """
    if word not in asked_words():
        raise OptionError(f"--process: '{word}' is not there; use one of {', '.join(asked_words())}")


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
    format_, _ = inputs[0]
    kind = "program" if "program" in format_.processes else "drawing"
    fitting = [one for one in processes() if one.reads == kind]
    for one in fitting:
        if asked in one.instead:
            raise OptionError(f"{asked}: {one.instead[asked]}")
    if asked == "auto":
        alone = (one for one in fitting if one.by_itself and format_.processes == (one.name,))
        return next(alone, fitting[0])
    for one in fitting:
        if asked in one.asked_as:
            return one
    words = " or ".join(", ".join(word for one in fitting for word in one.asked_as).rsplit(", ", 1))
    raise OptionError(f"{asked}: this is a drawing, and not a program; use {words}")


def _joining(inputs: Sequence[tuple[Format, Source]], asked: str) -> Process:
    """Return the process that makes one program of several files."""
    for one in processes():
        others = [source for format_, source in inputs if format_.name != one.joins]
        if one.joins and not others and asked in ("auto", *one.asked_as):
            return one
        if one.joins:
            what = f"{others[0].path} is none" if others else f"--process {asked} is none for them"
            raise OptionError(f"one program is made of several drill files only; {what}")
    raise OptionError("one program is made of one input")


@cache
def _entry_points() -> list[Any]:
    from importlib.metadata import entry_points

    return list(entry_points(group=PLUGIN_GROUP))


def _load(place: str) -> Any:
    module, _, attribute = place.partition(":")
    return getattr(import_module(module), attribute)
