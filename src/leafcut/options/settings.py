"""All options of one run, and where each of them belongs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, nearest
from leafcut.files import read_toml
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
    #: Names of what was given, also where that is what holds anyway; and of these what was given by itself, on the
    #: command line or in a call, and not in a file, which may be meant for many kinds of work.
    given: frozenset[str] = frozenset()
    asked: frozenset[str] = frozenset()

    @classmethod
    def collect(cls, values: Mapping[str, Any], file: Path | None = None) -> Settings:
        """Return the settings of a TOML `file` (if any), overridden by `values`.

        `values` maps option names to values; None stands for "not given". A number without a unit means the same
        here, in the file and on the command line (`units.BARE_UNIT`).

        Raises
        ------
        OptionError
            An unknown name (the nearest known one is named), or a value out of its bounds.
        """
        given = {group.section: dict(table) for group, table in _file_tables(file)} if file else {}
        for name, value in values.items():
            if value is not None:
                given.setdefault(group_of(name).section, {})[name] = value
        made: dict[str, Any] = {
            group.section: group(**group.as_typed(given.get(group.section, {}))) for group in GROUPS
        }
        asked = frozenset(name for name, value in values.items() if value is not None)
        return cls(**made, given=frozenset(name for table in given.values() for name in table), asked=asked)

    def changed(self) -> dict[str, str]:
        """Return every option that is not at its default and can change the program: flag → value as one types it."""
        return {
            flag_name(name if value is not False else f"no_{name}"): written(group.specs()[name], value)
            for group in (getattr(self, f.name) for f in fields(self) if f.name not in ("given", "asked"))
            for name, value in group.changed().items()
            if group.specs()[name].changes_program
        }


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


def _file_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    data = read_toml(file)
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
                raise OptionError(f"{file}: '{twice}' stands there twice, at the top and in [{section}]")
            inside.update(table)
    for section, table in data.items():
        if section not in sections:
            what = f"table [{section}]" if isinstance(table, dict) else f"option '{section}'"
            raise OptionError(f"{file}: unknown {what}{nearest(section, [*sections, *names])}")
        if not isinstance(table, dict):
            raise OptionError(f"{file}: '{section}' is not a table; write [{section}]")
        for name in table:
            if name not in sections[section].specs():
                raise OptionError(
                    f"{file}: unknown option '{name}' in [{section}]{nearest(name, sections[section].specs())}"
                )
        yield sections[section], table
