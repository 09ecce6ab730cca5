"""`Settings`: the options of a job."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeVar

from leafcut.options.cutting import CutDataOptions, StockOptions
from leafcut.options.drawings import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.options.job import JobOptions, MachineOptions, PostOptions
from leafcut.options.option_spec import OptionGroup, flag_name, typed_text
from leafcut.options.search import AcoOptions, FireflyOptions, SolveOptions

Group = TypeVar("Group", bound=OptionGroup)


@dataclass(frozen=True)
class Settings:
    """Options of a job by group: shared groups by name, and the groups of a process with `of`.

    Attributes
    ----------
    groups
        Groups in display order; a missing group has its defaults.
    given
        Names of all given options, even if their value is the default.
    asked
        Names of the options given on the command line or in a call. Options from a file are not included, because they
        may be meant for other processes.
    defaults
        Names of the options given in the user's own defaults.
    process
        Value of ``--process`` that selects the same work again; "" if the input determines it.
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
        """Return the settings with some groups replaced."""
        return replace(self, groups=MappingProxyType({**self.groups, **{type(group): group for group in groups}}))

    @property
    def read(self) -> ReadOptions:
        """Options of the input file."""
        return self.of(ReadOptions)

    @property
    def sheet(self) -> SheetOptions:
        """Options of sheet drawings."""
        return self.of(SheetOptions)

    @property
    def pocket_drawing(self) -> PocketDrawingOptions:
        """Options of pocket drawings and pictures."""
        return self.of(PocketDrawingOptions)

    @property
    def machine(self) -> MachineOptions:
        """Options of the machine."""
        return self.of(MachineOptions)

    @property
    def job(self) -> JobOptions:
        """Material, heights, positions and obstacles of the job."""
        return self.of(JobOptions)

    @property
    def stock(self) -> StockOptions:
        """Options of the stock."""
        return self.of(StockOptions)

    @property
    def cut_data(self) -> CutDataOptions:
        """Cutting process and cutting data of a sheet."""
        return self.of(CutDataOptions)

    @property
    def solve(self) -> SolveOptions:
        """Options of the search."""
        return self.of(SolveOptions)

    @property
    def aco(self) -> AcoOptions:
        """Parameters of the ant algorithms."""
        return self.of(AcoOptions)

    @property
    def firefly(self) -> FireflyOptions:
        """Parameters of the firefly algorithm."""
        return self.of(FireflyOptions)

    @property
    def post(self) -> PostOptions:
        """Format of the written program."""
        return self.of(PostOptions)

    def changed(self) -> dict[str, str]:
        """Return every option that can change the program and differs from its default: flag → value as typed."""
        process = {"--process": self.process} if self.process else {}
        return process | dict(
            _as_typed(group, name)
            for group in self.groups.values()
            for name in group.changed()
            if group.specs()[name].changes_program
        )

    def options_from_defaults(self) -> tuple[str, ...]:
        """Return the used options that come from the user's own defaults, as typed."""
        names = self.defaults & self.given
        return tuple(
            " ".join(filter(None, _as_typed(group, name)))
            for group in self.groups.values()
            for name in group.specs()
            if name in names
        )


def _as_typed(group: OptionGroup, name: str) -> tuple[str, str]:
    value = getattr(group, name)
    return flag_name(name if value is not False else f"no_{name}"), typed_text(group.specs()[name], value)


def without_options(settings: Settings, names: Iterable[str]) -> Settings:
    """Return the settings with some options reset to their defaults and marked as not given."""
    removed = frozenset(names)
    groups = [
        replace(group, **{name: type(group).defaults()[name] for name in present})  # type: ignore[type-var]
        for group in settings.groups.values()
        if (present := removed & group.specs().keys())
    ]
    return replace(settings.but(*groups), given=settings.given - removed)
