"""The options of one run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeVar

from leafcut.options.cut_data import CutDataOptions
from leafcut.options.drawings import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.options.job import JobOptions, MachineOptions
from leafcut.options.option_spec import OptionGroup, flag_name, written
from leafcut.options.post import PostOptions
from leafcut.options.search import AcoOptions, FireflyOptions, SolveOptions
from leafcut.options.stock import StockOptions

Group = TypeVar("Group", bound=OptionGroup)


@dataclass(frozen=True)
class Settings:
    """The options of one run, by group: those that processes share by name, a process's own with `of`.

    Attributes
    ----------
    groups
        In the order in which options are told; a group that is not there is at its defaults.
    given, asked, defaults
        Names of what was given, also where that is what holds anyway; of these what was given by itself, on the
        command line or in a call, and not in a file, which may be meant for many processes; and what is of the
        person's own defaults.
    process
        What ``--process`` has to say to have the same work again, "" where the input alone says it.
    """

    groups: Mapping[type[OptionGroup], OptionGroup] = field(default_factory=lambda: MappingProxyType({}))
    given: frozenset[str] = frozenset()
    asked: frozenset[str] = frozenset()
    defaults: frozenset[str] = frozenset()
    process: str = ""

    def of(self, group: type[Group]) -> Group:
        """Return the options of a group."""
        stored = self.groups.get(group)
        return stored if isinstance(stored, group) else group()

    def but(self, *groups: OptionGroup) -> Settings:
        """Return the settings with other options in some groups."""
        return replace(self, groups=MappingProxyType({**self.groups, **{type(group): group for group in groups}}))

    @property
    def read(self) -> ReadOptions:
        """Return what is taken of a file."""
        return self.of(ReadOptions)

    @property
    def sheet(self) -> SheetOptions:
        """Return how drawings of sheets are read."""
        return self.of(SheetOptions)

    @property
    def pocket_drawing(self) -> PocketDrawingOptions:
        """Return how drawings and pictures of pockets are read."""
        return self.of(PocketDrawingOptions)

    @property
    def machine(self) -> MachineOptions:
        """Return which machine."""
        return self.of(MachineOptions)

    @property
    def job(self) -> JobOptions:
        """Return what is worked, and its heights, places and obstacles."""
        return self.of(JobOptions)

    @property
    def stock(self) -> StockOptions:
        """Return what material a program cuts."""
        return self.of(StockOptions)

    @property
    def cut_data(self) -> CutDataOptions:
        """Return what cuts the sheet, and how fast."""
        return self.of(CutDataOptions)

    @property
    def solve(self) -> SolveOptions:
        """Return how the order is sought."""
        return self.of(SolveOptions)

    @property
    def aco(self) -> AcoOptions:
        """Return the parameters of the ants."""
        return self.of(AcoOptions)

    @property
    def firefly(self) -> FireflyOptions:
        """Return the parameters of the fireflies."""
        return self.of(FireflyOptions)

    @property
    def post(self) -> PostOptions:
        """Return how the program is written."""
        return self.of(PostOptions)

    def changed(self) -> dict[str, str]:
        """Return every option that is not at its default and can change the program: flag → value as one types it."""
        process = {"--process": self.process} if self.process else {}
        return process | dict(
            _as_typed(group, name) for group in self.groups.values() for name in group.changed()
            if group.specs()[name].changes_program
        )  # fmt: skip

    def from_defaults(self) -> tuple[str, ...]:
        """Return what the person's own defaults say of the options that are used, as one types it."""
        names = self.defaults & self.given
        return tuple(
            " ".join(filter(None, _as_typed(group, name)))
            for group in self.groups.values() for name in group.specs() if name in names
        )  # fmt: skip


def _as_typed(group: OptionGroup, name: str) -> tuple[str, str]:
    """Return an option's flag and its value."""
    value = getattr(group, name)
    return flag_name(name if value is not False else f"no_{name}"), written(group.specs()[name], value)


def without(settings: Settings, names: Iterable[str]) -> Settings:
    """Return the settings with some options at their defaults, and as not given."""
    removed = frozenset(names)
    groups = [
        replace(group, **{name: type(group).defaults()[name] for name in present})  # type: ignore[type-var]
        for group in settings.groups.values() if (present := removed & group.specs().keys())
    ]  # fmt: skip
    return replace(settings.but(*groups), given=settings.given - removed)
