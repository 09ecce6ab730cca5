"""Collect the settings of a job, and refuse options that the requested work does not use."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from leafcut.errors import DataError, OptionError, name_suggestion
from leafcut.files.schemas import OPTIONS
from leafcut.files.whole_files import check_file_exists, key_line_number, key_place, parse_toml, read_toml_text
from leafcut.message import Message
from leafcut.options.option_spec import OptionGroup, OptionSpec, flag_name
from leafcut.options.removed import removal_message
from leafcut.options.settings import Settings, without_options
from leafcut.processes import registry
from leafcut.processes.base import Work


def collect_settings(
    values: Mapping[str, Any],
    file: Path | None = None,
    defaults: Path | None = None,
    own: Iterable[type[OptionGroup]] | None = None,
) -> Settings:
    """Merge the settings from `values`, an options file, and a file of defaults.

    Earlier sources override later sources.

    Numbers without a unit mean the same in all three (`units.BARE_UNIT`). Paths in the file of defaults are relative to
    this file.

    Parameters
    ----------
    values
        Values by option name; None means "not given".
    own
        Option groups of the requested process. If all values belong to these groups or to shared groups, no other
        process is loaded.

    Raises
    ------
    OptionError
        If a name is unknown, or a value is out of bounds. For a file, the message names the line.
    """
    asked = frozenset(name for name, value in values.items() if value is not None)
    groups = registry.option_groups(own)
    if file or defaults or not asked <= _groups_by_option(groups).keys():
        groups = registry.option_groups()
    given: dict[type[OptionGroup], dict[str, Any]] = {group: {} for group in groups}
    from_defaults: set[str] = set()
    if defaults:
        for group, table in _read_option_tables(defaults):
            given[group].update(resolve_files(defaults.parent, table))
            from_defaults.update(table)
    for group, table in _read_option_tables(file) if file else ():
        given[group].update(table)
        from_defaults.difference_update(table)
    for name in asked:
        given[group_of(name, groups)][name] = values[name]
    instances = {group: group(**group.as_typed(table)) for group, table in given.items()}
    names = frozenset(name for table in given.values() for name in table)
    return Settings(MappingProxyType(instances), given=names, asked=asked, defaults=frozenset(from_defaults) - asked)


def all_options() -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option as (group, name, specification), in the order of the documentation."""
    for group in registry.option_groups():
        for name, spec in group.specs().items():
            yield group, name, spec


def group_of(name: str, groups: Iterable[type[OptionGroup]] = ()) -> type[OptionGroup]:
    """Return the group that contains an option. The given `groups` are searched first.

    Raises OptionError if the option was removed or is unknown. For a removed option, the message states the reason. For
    an unknown option, it suggests the most similar name.
    """
    if group := _groups_by_option(tuple(groups)).get(name):
        return group
    names = _groups_by_option(registry.option_groups())
    if name not in names:
        raise OptionError(removal_message(name) or Message("unknown option '{}'{}", name, name_suggestion(name, names)))
    return names[name]


@cache
def _groups_by_option(groups: tuple[type[OptionGroup], ...]) -> dict[str, type[OptionGroup]]:
    """Map the name of each option to its group.

    The result is cached, because a page of the studio needs hundreds of options.
    """
    return {name: group for group in groups for name in group.specs()}


def read_options_file(file: Path) -> dict[str, Any]:
    """Return the options of a TOML file as they are written.

    Raises OptionError if the file cannot be read, or if a name is unknown.
    """
    return {name: value for _, table in _read_option_tables(file) for name, value in table.items()}


def options_used_by(*works: Work) -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield each option that at least one of the given types of work uses, as (group, name, specification)."""
    used = {name for work in works for name in work.used()}
    own_groups = [group for work in works for group in work.options]
    for group in registry.option_groups(own_groups):
        for name, spec in group.specs().items():
            if name in used:
                yield group, name, spec


def settings_for(settings: Settings, work: Work, input_kind: str = "") -> Settings:
    """Return the settings for a type of work. Options from files are dropped if the work does not use them.

    `input_kind` is the format of the input. Raises OptionError if an option on the command line is not used, or if a
    file that an option names is missing.
    """
    unused = unused_options(settings, work, input_kind)
    for name, reason in unused.items():
        if name in settings.asked:
            raise OptionError("{}: {}", flag_name(name), reason)
    used = without_options(settings, unused) if unused else settings
    _check_input_files_exist(used)
    return used


def _check_input_files_exist(settings: Settings) -> None:
    """Raise OptionError if an option names a missing file. The readers report all other errors."""
    for name in sorted(settings.given):
        group = group_of(name, settings.groups)
        if group.specs()[name].names_input:
            check_file_exists(flag_name(name), getattr(settings.of(group), name))


def input_file_names(settings: Settings) -> list[str]:
    """Return the names of the input files in the given options."""
    groups = [(name, group_of(name, settings.groups)) for name in sorted(settings.given)]
    values = [(group.specs()[name], getattr(settings.of(group), name)) for name, group in groups]
    return [str(value) for spec, value in values if not spec.is_output and spec.names_file(value)]


def unused_option_message(name: str, title: str, instead: str = "") -> Message:
    """Return the message for an option that the work `title` does not use.

    It names the works that use it, and a remedy.
    """
    titles = [work.title for work in registry.works() if name in work.used()]
    title_list = " and ".join(", ".join(titles).rsplit(", ", 1))
    remedy = instead or Message("leave it out")
    return Message("this option does not apply to {}, only to {}; {}", title, title_list, remedy)


def unused_options(settings: Settings, work: Work, input_kind: str = "") -> dict[str, str]:
    """Return the reason and the remedy for each given option that the work does not use, keyed by the option."""
    return dict(_find_unused(settings, work, input_kind))


def _find_unused(settings: Settings, work: Work, input_kind: str) -> Iterator[tuple[str, str]]:
    used = work.used()

    def value_of(name: str) -> Any:
        return getattr(settings.of(group_of(name, settings.groups)), name)

    for name in sorted(settings.given):
        if name not in used:
            yield name, unused_option_message(name, work.title, work.otherwise.get(name, ""))
            continue
        # A flag set to off has no effect, so it needs no refusal.
        is_off = group_of(name, settings.groups).specs()[name].kind == "flag" and value_of(name) is False
        for condition in () if is_off else used[name]:
            if not condition.holds(value_of, input_kind):
                yield name, condition.refusal(name, flag_name)
                break


def resolve_files(folder: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Resolve the file names in `options` against a folder. The options are values by name.

    Raises OptionError if an option is unknown.
    """
    placed = dict(options)
    for name, value in options.items():
        spec = group_of(name).specs()[name]
        is_file = spec.names_file(str(value))
        if is_file and isinstance(value, str):
            placed[name] = str(folder / os.path.expanduser(value))  # noqa: PTH111  # without a home directory, unchanged
    return placed


def _groups_by_table() -> dict[str, dict[str, type[OptionGroup]]]:
    """Map each table and option name to the group of the option.

    The table of a process also accepts the shared options that the process uses.
    """
    sections = {group.section: dict.fromkeys(group.specs(), group) for group in registry.option_groups()}
    group_of_option = {name: group for group, name, _ in all_options()}
    for process in registry.processes():
        for own_group in process.options:
            sections[own_group.section] = {name: group_of_option[name] for name in process.used()} | sections[
                own_group.section
            ]
    return sections


def _read_option_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    tables: dict[type[OptionGroup], dict[str, Any]] = {}
    for option in read_options_with_lines(file):
        tables.setdefault(option.group, {})[option.name] = option.value
    yield from tables.items()


@dataclass(frozen=True)
class PlacedOption:
    """An option in a TOML file, with its line number if the line is known."""

    group: type[OptionGroup]
    name: str
    value: Any
    line: int | None


def read_options_with_lines(file: Path) -> list[PlacedOption]:
    """Return the options of a TOML file with their lines. Each option is checked separately.

    Raises OptionError if the file cannot be read, or if an option is unknown, invalid or given twice. The message names
    the line.
    """
    try:
        text = read_toml_text(file)
        data = parse_toml(text, str(file), OPTIONS)
    except DataError as problem:  # an error in a file of options is reported like one on the command line
        raise OptionError(str(problem)) from None

    def refused(message: str, section: str, name: str = "") -> OptionError:
        return OptionError("{}: {}", key_place(file, text, section, name), message)

    sections = _groups_by_table()
    # Options may also be outside of tables: `machine = "haas-vf2"`.
    names = {name: group for group, name, _ in all_options()}
    sections_seen: dict[str, str] = {}
    options: list[PlacedOption] = []

    def take(group: type[OptionGroup], name: str, value: Any, section: str) -> None:
        if name in sections_seen:
            location = Message("at the top") if not sections_seen[name] else Message("in [{}]", sections_seen[name])
            second_location = Message("in [{}]", section) if section else Message("at the top")
            raise refused(Message("'{}' is given twice, {} and {}", name, location, second_location), section, name)
        sections_seen[name] = section
        try:
            group.check(name, value)
        except OptionError as problem:
            raise refused(str(problem), section, name) from None
        options.append(PlacedOption(group, name, value, key_line_number(text, section, name)))

    for name in [key for key, value in data.items() if key in names and not isinstance(value, dict)]:
        take(names[name], name, data.pop(name), "")
    for section, table in data.items():
        if section not in sections:
            is_table = isinstance(table, dict)
            noun = Message("table [{}]", section) if is_table else Message("option '{}'", section)
            location = (section, "") if is_table else ("", section)
            if not is_table and (removal := removal_message(section)):
                raise refused(removal, *location)
            raise refused(Message("unknown {}{}", noun, name_suggestion(section, [*sections, *names])), *location)
        if not isinstance(table, dict):
            raise refused(Message("'{}' is not a table; write [{}]", section, section), "", section)
        for name, value in table.items():
            if name not in sections[section]:
                hint = name_suggestion(name, sections[section])
                raise refused(
                    removal_message(name) or Message("unknown option '{}' in [{}]{}", name, section, hint),
                    section,
                    name,
                )
            take(sections[section][name], name, value, section)
    return options
