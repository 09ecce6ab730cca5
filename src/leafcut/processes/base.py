"""What a process is: a kind of work that leafcut does, from the options that it uses to what it writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.option_spec import OptionGroup
from leafcut.options import Settings, settings_for
from leafcut.processes.course import Run

if TYPE_CHECKING:
    from leafcut.read.format import Source

#: Groups of a form: the key of a title, and names of options.
FormGroups = tuple[tuple[str, tuple[str, ...]], ...]

#: Options that forms of several processes show, by the group that they stand in.
SEARCH = ("preset", "time_limit", "algorithm", "objective")
SEARCH_MORE = ("iterations", "target_gap", "bound", "seed", "threads", "candidates", "local_search")
PLACE = ("mirror", "rotate", "origin")
POST = ("dialect", "output_units", "line_numbers", "program_number", "header", "date", "repeat_words")


def all_of(group: type[OptionGroup], but: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the options of a group, without some that stand elsewhere."""
    left_out = set(but)
    return tuple(name for name in group.specs() if name not in left_out)


class Process(Protocol):
    """One kind of work. A class that inherits from it says what is its own; the rest is as most have it.

    Attributes
    ----------
    name
        By which options say that it uses them (`option_spec.WORKS`), and by which formats say what they are for.
    asked_as
        What ``--process`` may say of its input to have it.
    reads
        ``drawing`` or ``program``: what its input is. "" for what is not asked for through `api.optimize`.
    by_itself
        Whether a file that is good for this alone is given to it without being asked.
    joins
        The format of which it makes one program of several files; "" where it does so of none.
    instead
        What ``--process`` may be mistaken for, and what to say then.
    command, asks
        The command that does it, and what ``--process`` has to say where a file is good for several kinds of work.
    offered_with
        The kind of work with which a page offers this one, too.
    form
        The options that a form shows, the important ones first: (key of the title, names). The first two groups are
        open, the others folded.
    uses
        Options that say of themselves only that other processes use them: a process from outside names all of its own.
    """

    name: ClassVar[str]
    asked_as: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[str] = ""
    by_itself: ClassVar[bool] = False
    joins: ClassVar[str] = ""
    instead: ClassVar[Mapping[str, str]] = {}
    command: ClassVar[str] = "optimize"
    asks: ClassVar[str] = "auto"
    offered_with: ClassVar[str] = ""
    form: ClassVar[FormGroups] = ()
    uses: ClassVar[tuple[str, ...]] = ()

    def settings(self, settings: Settings, input_kind: str) -> Settings:
        """Return the settings with the options that this process uses, for an input of a format.

        Raises
        ------
        OptionError
            An option was given that it does not use.
        """
        return settings_for(settings, self.name, input_kind, self.uses)

    def usual(self, settings: Settings) -> Settings:
        """Return the settings with what this process takes where nobody said anything: its usual machine."""
        return settings

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
