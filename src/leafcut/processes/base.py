"""What a process is: a kind of work that leafcut does, from the options that it uses to what it writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from leafcut.model.kinds import Head
from leafcut.options import (
    AcoOptions,
    CutDataOptions,
    FireflyOptions,
    JobOptions,
    PostOptions,
    Settings,
    SolveOptions,
)
from leafcut.options.condition import Conditions, absent
from leafcut.options.option_spec import OptionGroup

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
    from leafcut.model.part import Part
    from leafcut.processes.course import Run
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

#: Groups of a form: the key of a title, and names of options.
FormGroups = tuple[tuple[str, tuple[str, ...]], ...]

#: Options that forms of several processes show, by the group that they stand in.
SEARCH = ("preset", "time_limit", "algorithm", "objective")
SEARCH_MORE = (
    "iterations",
    "target_gap",
    "bound",
    "seed",
    "threads",
    "candidates",
    "local_search",
)
PLACE = ("mirror", "rotate", "origin")
POST = ("dialect", "output_units", "line_numbers", "program_number", "header")


def all_of(group: type[OptionGroup], but: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the options of a group, without some that stand elsewhere."""
    left_out = set(but)
    return tuple(name for name in group.specs() if name not in left_out)


def use(group: type[OptionGroup], *names: str, but: Iterable[str] = (), **needs: Conditions) -> dict[str, Conditions]:
    """Return options of a group, each with the conditions for its use.

    Parameters
    ----------
    names
        Those that are used, beside those of `needs`; all of the group where none is named.
    but
        Those that are not.
    needs
        Conditions that replace those of the option itself (`OptionSpec.needs`).
    """
    specs, left_out = group.specs(), set(but)
    chosen = (*names, *needs) if names or needs else tuple(specs)
    return {name: needs.get(name, specs[name].needs) for name in chosen if name not in left_out}


#: Options that several processes use: of what orders the work, of a program that is made from a drawing, and of the
#: cutting data that a program without speeds of its own is cut with.
ORDERED = use(SolveOptions) | use(AcoOptions) | use(FireflyOptions)
WRITTEN = use(PostOptions, *POST, "coolant")
#: Options of programs that may change tools.
CHANGES = ("preselect_tool", "optional_stop")
_LOOKED_UP = (absent("cut_speed"),)
LOOKED_UP = use(CutDataOptions, "cut_speed")
LOOKED_UP |= use(CutDataOptions, cut_process=_LOOKED_UP, amps=_LOOKED_UP, nozzle=_LOOKED_UP, chart=_LOOKED_UP)
LOOKED_UP |= use(JobOptions, thickness=_LOOKED_UP, material=_LOOKED_UP)


class Work(Protocol):
    """A kind of work, as far as its options go.

    Attributes
    ----------
    name, title
        By which it is asked for, and as a message calls it: "drilling".
    uses
        The options of shared groups that it uses, each with the conditions for its use (`use`).
    otherwise
        What to do instead of giving an option that it does not use, where that is more than to leave it out.
    helps
        Help of options that mean something more special here: text, and default in words ("" for that of the option).
    """

    name: ClassVar[str]
    title: ClassVar[str]
    uses: ClassVar[Mapping[str, Conditions]] = {}
    otherwise: ClassVar[Mapping[str, str]] = {}
    helps: ClassVar[Mapping[str, tuple[str, str]]] = {}

    def used(self) -> Mapping[str, Conditions]:
        """Return all options that it uses, each with the conditions for its use."""
        return self.uses


class Process(Work, Protocol):
    """One kind of work. A class that inherits from it says what is its own; the rest is as most have it.

    Attributes
    ----------
    name
        By which formats say what they are for, too.
    options
        The groups of options that are its own; the first one's table in a file may hold all that it uses.
    asked_as
        What ``--process`` may say of its input to have it.
    reads
        ``drawing`` or ``program``: what its input is. "" for what is not asked for through `api.optimize`.
    formats
        The formats that it is offered for, of a process that they do not know: one from outside.
    by_itself
        Whether a file that is good for this alone is given to it without being asked.
    joins
        The format of which it makes one program of several files; "" where it does so of none.
    instead
        What ``--process`` may be mistaken for, and what to say then.
    command, help
        The command that does it alone, and what that does, in a line. It is what ``--process`` says to have it.
    takes
        What its input is, in words.
    asks
        What ``--process`` has to say where a file is good for several kinds of work.
    offered_with
        The kind of work with which a page offers this one, too.
    form
        The options that a form shows, the important ones first: (key of the title, names). The first two groups are
        open, the others folded.
    heads
        What a machine must work with to do it; empty where any will do.
    pictured
        How a small picture shows what it works: ``holes`` as dots, ``lines``, or ``areas`` filled.
    """

    options: ClassVar[tuple[type[OptionGroup], ...]] = ()
    asked_as: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[str] = ""
    formats: ClassVar[tuple[str, ...]] = ()
    by_itself: ClassVar[bool] = False
    joins: ClassVar[str] = ""
    instead: ClassVar[Mapping[str, str]] = {}
    command: ClassVar[str]
    help: ClassVar[str] = ""
    takes: ClassVar[str] = "a drawing"
    asks: ClassVar[str] = "auto"
    offered_with: ClassVar[str] = ""
    form: ClassVar[FormGroups] = ()
    heads: ClassVar[tuple[Head, ...]] = ()
    pictured: ClassVar[str] = "lines"

    def used(self) -> Mapping[str, Conditions]:
        """Return the options that it uses, its own and of shared groups, each with the conditions for its use."""
        own = {name: spec.needs for group in self.options for name, spec in group.specs().items()}
        return own | dict(self.uses)

    def usual(self, settings: Settings) -> Settings:
        """Return the settings with what this process takes where nobody said anything: its usual machine."""
        return settings

    def machine_for(self, format_name: str) -> str:
        """Return the machine that is at hand for files of a format; "" where they need none of their own."""
        return ""

    def suits(self, drawing: WholeDrawing) -> Suitability | None:
        """Return how well a drawing suits it, from all that the drawing shows; None for no opinion."""
        return None

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[Any]:
        """Do the work; `asked` is what ``--process`` said.

        Raises
        ------
        ReadError, OptionError, PlanError, PostError, VerifyError
            One line that says what was found and what to do.
        """
        ...

    def reads_besides(self, settings: Settings) -> list[Path]:
        """Return the files that it reads beside its input."""
        return []

    def writes_besides(self, settings: Settings) -> list[Path]:
        """Return the files that it writes beside the program."""
        return []

    def files(self, outcome: Outcome[Any], settings: Settings) -> dict[str, str]:
        """Return the files that it writes beside the program: name → text."""
        return {}

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return what is read of an input, as it lies before the work is planned: what a preview shows."""
        ...
