"""All options of one run, and where each of them belongs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, nearest
from leafcut.files import line_of, read_toml
from leafcut.option_spec import OptionGroup, OptionSpec, flag_name, written
from leafcut.options.cutting import CutOptions
from leafcut.options.drawings import ReadOptions, SheetOptions
from leafcut.options.machining import DrillOptions, MachineOptions
from leafcut.options.nests import NestOptions
from leafcut.options.pockets import PocketOptions
from leafcut.options.programs import PostOptions, ResequenceOptions
from leafcut.options.search import AcoOptions, FireflyOptions, SolveOptions

GROUPS: tuple[type[OptionGroup], ...] = (
    ReadOptions,
    SheetOptions,
    MachineOptions,
    DrillOptions,
    CutOptions,
    PocketOptions,
    NestOptions,
    ResequenceOptions,
    SolveOptions,
    AcoOptions,
    FireflyOptions,
    PostOptions,
)


@dataclass(frozen=True)
class Settings:
    """All options of one run, one group per stage."""

    read: ReadOptions = field(default_factory=ReadOptions)
    sheet: SheetOptions = field(default_factory=SheetOptions)
    machine: MachineOptions = field(default_factory=MachineOptions)
    drill: DrillOptions = field(default_factory=DrillOptions)
    cut: CutOptions = field(default_factory=CutOptions)
    pocket: PocketOptions = field(default_factory=PocketOptions)
    nest: NestOptions = field(default_factory=NestOptions)
    resequence: ResequenceOptions = field(default_factory=ResequenceOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)
    aco: AcoOptions = field(default_factory=AcoOptions)
    firefly: FireflyOptions = field(default_factory=FireflyOptions)
    post: PostOptions = field(default_factory=PostOptions)
    #: Names of what was given, also where that is what holds anyway; of these what was given by itself, on the command
    #: line or in a call, and not in a file, which may be meant for many kinds of work; and what is of the person's own
    #: defaults.
    given: frozenset[str] = frozenset()
    asked: frozenset[str] = frozenset()
    defaults: frozenset[str] = frozenset()

    @classmethod
    def collect(cls, values: Mapping[str, Any], file: Path | None = None, defaults: Path | None = None) -> Settings:
        """Return the settings of a file of defaults, if any, overridden by a `file`, if any, and these by `values`.

        `values` maps option names to values; None stands for "not given". A number without a unit means the same
        here, in the files and on the command line (`units.BARE_UNIT`). Files that the defaults name are sought from
        where their own file lies.

        Raises
        ------
        OptionError
            An unknown name (the nearest known one is named), or a value out of its bounds; of a file with its line.
        """
        given: dict[str, dict[str, Any]] = {}
        usual: set[str] = set()
        if defaults:
            for group, table in _file_tables(defaults):
                given[group.section] = _from_folder(group, table, defaults.parent)
                usual.update(table)
        for group, table in _file_tables(file) if file else ():
            given.setdefault(group.section, {}).update(table)
            usual.difference_update(table)
        for name, value in values.items():
            if value is not None:
                given.setdefault(group_of(name).section, {})[name] = value
        made: dict[str, Any] = {
            group.section: group(**group.as_typed(given.get(group.section, {}))) for group in GROUPS
        }
        asked = frozenset(name for name, value in values.items() if value is not None)
        names = frozenset(name for table in given.values() for name in table)
        return cls(**made, given=names, asked=asked, defaults=frozenset(usual) - asked)

    def changed(self) -> dict[str, str]:
        """Return every option that is not at its default and can change the program: flag → value as one types it."""
        return {
            flag_name(name if value is not False else f"no_{name}"): written(group.specs()[name], value)
            for group in (getattr(self, made.section) for made in GROUPS)
            for name, value in group.changed().items()
            if group.specs()[name].changes_program
        }

    def from_defaults(self) -> tuple[str, ...]:
        """Return what the person's own defaults say of the options that are used, as one types it."""
        told = []
        for group, name, spec in all_options():
            if name in self.defaults and name in self.given:
                value = getattr(getattr(self, group.section), name)
                flag = flag_name(name if value is not False else f"no_{name}")
                told.append(f"{flag} {written(spec, value)}".rstrip())
        return tuple(told)


def all_options() -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option as (group, name, specification), in the order of the stages."""
    for group in GROUPS:
        for name, spec in group.specs().items():
            yield group, name, spec


def group_of(name: str) -> type[OptionGroup]:
    """Return the group that holds the option `name`, or raise `OptionError` with the nearest name."""
    names = {option: group for group, option, _ in all_options()}
    if name not in names:
        raise OptionError(f"unknown option '{name}'{nearest(name, names)}")
    return names[name]


def options_of_file(file: Path) -> dict[str, Any]:
    """Return the options of a TOML file: name → value as it stands there.

    Raises
    ------
    OptionError
        The file cannot be read, or names what is none.
    """
    return {name: value for _, table in _file_tables(file) for name, value in table.items()}


def _from_folder(group: type[OptionGroup], table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a table of options with the files that it names sought from a folder."""
    specs, found = group.specs(), dict(table)
    for name, value in table.items():
        is_file = specs[name].kind == "path" or (specs[name].may_be_path and str(value).lower().endswith(".toml"))
        if is_file and isinstance(value, str):
            found[name] = str(folder / os.path.expanduser(value))  # noqa: PTH111  # without a home it stays as it is
    return found


def _file_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    """Yield the groups of options of a TOML file and what it says of each, checked."""
    data = read_toml(file)

    def refused(words: str, section: str, name: str = "") -> OptionError:
        line = line_of(file.read_text(encoding="utf-8", errors="replace"), section, name)
        return OptionError(f"{file}{f':{line}' if line else ''}: {words}")

    sections = {group.section: group for group in GROUPS}
    # Without a table an option stands for itself: `machine = "haas-vf2"`.
    bare: dict[str, dict[str, Any]] = {}
    names = {name: group.section for group, name, _ in all_options()}
    for name in [key for key, value in data.items() if key in names and not isinstance(value, dict)]:
        bare.setdefault(names[name], {})[name] = data.pop(name)
    for section, table in bare.items():
        inside = data.setdefault(section, {})
        if isinstance(inside, dict):
            if twice := next((name for name in table if name in inside), None):
                raise refused(f"'{twice}' stands there twice, at the top and in [{section}]", section, twice)
            inside.update(table)
    for section, table in data.items():
        if section not in sections:
            is_table = isinstance(table, dict)
            what = f"table [{section}]" if is_table else f"option '{section}'"
            place = (section, "") if is_table else ("", section)
            raise refused(f"unknown {what}{nearest(section, [*sections, *names])}", *place)
        if not isinstance(table, dict):
            raise refused(f"'{section}' is not a table; write [{section}]", "", section)
        group = sections[section]
        for name, value in table.items():
            at = "" if name in bare.get(section, {}) else section
            if name not in group.specs():
                raise refused(f"unknown option '{name}' in [{section}]{nearest(name, group.specs())}", at, name)
            try:
                group.check(name, value)
            except OptionError as problem:
                raise refused(str(problem), at, name) from None
        yield group, table
