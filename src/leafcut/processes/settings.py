"""All options that there are, how the settings of a run are collected, and which of them a kind of work uses.

An option that is given and not used is refused, never ignored.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from leafcut.errors import DataError, OptionError, nearest
from leafcut.files.schemas import OPTIONS
from leafcut.files.whole_files import check_is_there, line_of, parse_toml, toml_bytes
from leafcut.options.option_spec import OptionGroup, OptionSpec, flag_name
from leafcut.options.removed import why_removed
from leafcut.options.settings import Settings, without
from leafcut.processes import registry
from leafcut.processes.base import Work


def collect(
    values: Mapping[str, Any],
    file: Path | None = None,
    defaults: Path | None = None,
    own: Iterable[type[OptionGroup]] | None = None,
) -> Settings:
    """Return the settings of a file of defaults, if any, overridden by a `file`, if any, and these by `values`.

    `values` maps option names to values; None stands for "not given". A number without a unit means the same here, in
    the files and on the command line (`units.BARE_UNIT`). Files that the defaults name are sought from where their own
    file lies. `own` are the groups of the process that is asked for, where one is: if only its options and shared ones
    are given, no other process is loaded.

    Raises
    ------
    OptionError
        An unknown name (the nearest known one is named), or a value out of its bounds; of a file with its line.
    """
    asked = frozenset(name for name, value in values.items() if value is not None)
    groups = registry.groups(own)
    if file or defaults or not asked <= _by_name(groups).keys():
        groups = registry.groups()
    given: dict[type[OptionGroup], dict[str, Any]] = {group: {} for group in groups}
    usual: set[str] = set()
    if defaults:
        for group, table in _file_tables(defaults):
            given[group].update(placed_in(defaults.parent, table))
            usual.update(table)
    for group, table in _file_tables(file) if file else ():
        given[group].update(table)
        usual.difference_update(table)
    for name in asked:
        given[group_of(name, groups)][name] = values[name]
    made = {group: group(**group.as_typed(table)) for group, table in given.items()}
    names = frozenset(name for table in given.values() for name in table)
    return Settings(MappingProxyType(made), given=names, asked=asked, defaults=frozenset(usual) - asked)


def all_options() -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option as (group, name, specification), in the order in which they are told."""
    for group in registry.groups():
        for name, spec in group.specs().items():
            yield group, name, spec


def group_of(name: str, groups: Iterable[type[OptionGroup]] = ()) -> type[OptionGroup]:
    """Return the group that holds the option `name`; refuse a removed option, or name the nearest option.

    `groups` are searched first, so that no process is loaded if one of them holds it.
    """
    if found := _by_name(tuple(groups)).get(name):
        return found
    names = _by_name(registry.groups())
    if name not in names:
        raise OptionError(why_removed(name) or f"unknown option '{name}'{nearest(name, names)}")
    return names[name]


@cache
def _by_name(groups: tuple[type[OptionGroup], ...]) -> dict[str, type[OptionGroup]]:
    """Return the group of every option; a page of the studio asks for hundreds."""
    return {name: group for group in groups for name in group.specs()}


def options_of_file(file: Path) -> dict[str, Any]:
    """Return the options of a TOML file: name → value as it stands there.

    Raises
    ------
    OptionError
        The file cannot be read, or names what is none.
    """
    return {name: value for _, table in _file_tables(file) for name, value in table.items()}


def used_by(*works: Work) -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option that one of some kinds of work uses, as `all_options` does."""
    used = {name for work in works for name in work.used()}
    own = [group for work in works for group in work.options]
    for group in registry.groups(own):
        for name, spec in group.specs().items():
            if name in used:
                yield group, name, spec


def settings_for(settings: Settings, work: Work, input_kind: str = "") -> Settings:
    """Return the settings as a kind of work uses them: what only a file gave, and it does not use, is left out.

    `input_kind` is the name of the input's format.

    Raises
    ------
    OptionError
        An option that was given by itself, not in a file for many kinds of work, is not used; or it names a file that
        is not there.
    """
    unused = unused_options(settings, work, input_kind)
    for name, why in unused.items():
        if name in settings.asked:
            raise OptionError(f"{flag_name(name)}: {why}")
    used = without(settings, unused) if unused else settings
    _check_files(used)
    return used


def _check_files(settings: Settings) -> None:
    """Refuse files that options name and that are not there; that the others can be read, their readers find out."""
    for name in sorted(settings.given):
        group = group_of(name, settings.groups)
        if group.specs()[name].names_input:
            check_is_there(flag_name(name), getattr(settings.of(group), name))


def files_read(settings: Settings) -> list[str]:
    """Return the files that given options name and that are read."""
    places = [(name, group_of(name, settings.groups)) for name in sorted(settings.given)]
    values = [(group.specs()[name], getattr(settings.of(group), name)) for name, group in places]
    return [str(value) for spec, value in values if not spec.is_output and spec.names_file(value)]


def why_unused(name: str, title: str, instead: str = "") -> str:
    """Return why work with a title does not take an option, which others it is for, and what to do instead."""
    titles = [one.title for one in registry.works() if name in one.used()]
    others = " and ".join(", ".join(titles).rsplit(", ", 1))
    return f"not used for {title}; it applies to {others}; {instead or 'leave it out'}"


def unused_options(settings: Settings, work: Work, input_kind: str = "") -> dict[str, str]:
    """Return the options that were given and that a kind of work does not use: name → why, and what to do."""
    return dict(_unused(settings, work, input_kind))


def _unused(settings: Settings, work: Work, input_kind: str) -> Iterator[tuple[str, str]]:
    """Yield the options that were given and are not used, and why they are not and what to do."""
    used = work.used()

    def value_of(name: str) -> Any:
        return getattr(settings.of(group_of(name, settings.groups)), name)

    for name in sorted(settings.given):
        if name not in used:
            yield name, why_unused(name, work.title, work.otherwise.get(name, ""))
            continue
        # What is off and would not be used does what is asked for.
        off = group_of(name, settings.groups).specs()[name].kind == "flag" and value_of(name) is False
        for condition in () if off else used[name]:
            if not condition.holds(value_of, input_kind):
                yield name, condition.refusal(name, flag_name)
                break


def placed_in(folder: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options, name → value, with the files that they name sought from a folder; an unknown name is refused."""
    found = dict(options)
    for name, value in options.items():
        spec = group_of(name).specs()[name]
        is_file = spec.names_file(str(value))
        if is_file and isinstance(value, str):
            found[name] = str(folder / os.path.expanduser(value))  # noqa: PTH111  # without a home it stays as it is
    return found


def _sections() -> dict[str, dict[str, type[OptionGroup]]]:
    """Return the tables that a file of options may have, with what may stand in each: section → option → its group.

    In the table of a process stands what it uses of the groups that it shares, too: ``[drill]`` has a thickness.
    """
    sections = {group.section: dict.fromkeys(group.specs(), group) for group in registry.groups()}
    places = {name: group for group, name, _ in all_options()}
    for process in registry.processes():
        for own in process.options:
            sections[own.section] = {name: places[name] for name in process.used()} | sections[own.section]
    return sections


def _file_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    """Yield the groups of options of a TOML file and what it says of each, checked."""
    found: dict[type[OptionGroup], dict[str, Any]] = {}
    for one in placed_options(file):
        found.setdefault(one.group, {})[one.name] = one.value
    yield from found.items()


@dataclass(frozen=True)
class PlacedOption:
    """An option as a TOML file has it, and the line in which it stands; None where that is not seen."""

    group: type[OptionGroup]
    name: str
    value: Any
    line: int | None


def placed_options(file: Path) -> list[PlacedOption]:
    """Return the options of a TOML file, each checked by itself.

    Raises
    ------
    OptionError
        The file cannot be read; it names what is none (with the nearest name), gives an option twice, or a value that
        the option does not take: with the line.
    """
    try:
        content = toml_bytes(file)
        data = parse_toml(content, str(file), OPTIONS)
    except DataError as problem:  # what a file of options says is as if it were typed
        raise OptionError(str(problem)) from None
    text = content.decode("utf-8")

    def refused(words: str, section: str, name: str = "") -> OptionError:
        line = line_of(text, section, name)
        return OptionError(f"{file}{f':{line}' if line else ''}: {words}")

    sections = _sections()
    # Without a table an option stands for itself: `machine = "haas-vf2"`.
    names = {name: group for group, name, _ in all_options()}
    where: dict[str, str] = {}
    found: list[PlacedOption] = []

    def take(group: type[OptionGroup], name: str, value: Any, section: str) -> None:
        if name in where:
            place = "at the top" if not where[name] else f"in [{where[name]}]"
            other = f"in [{section}]" if section else "at the top"
            raise refused(f"'{name}' is given twice, {place} and {other}", section, name)
        where[name] = section
        try:
            group.check(name, value)
        except OptionError as problem:
            raise refused(str(problem), section, name) from None
        found.append(PlacedOption(group, name, value, line_of(text, section, name)))

    for name in [key for key, value in data.items() if key in names and not isinstance(value, dict)]:
        take(names[name], name, data.pop(name), "")
    for section, table in data.items():
        if section not in sections:
            is_table = isinstance(table, dict)
            what = f"table [{section}]" if is_table else f"option '{section}'"
            place = (section, "") if is_table else ("", section)
            if not is_table and (gone := why_removed(section)):
                raise refused(gone, *place)
            raise refused(f"unknown {what}{nearest(section, [*sections, *names])}", *place)
        if not isinstance(table, dict):
            raise refused(f"'{section}' is not a table; write [{section}]", "", section)
        for name, value in table.items():
            if name not in sections[section]:
                near = nearest(name, sections[section])
                raise refused(why_removed(name) or f"unknown option '{name}' in [{section}]{near}", section, name)
            take(sections[section][name], name, value, section)
    return found
