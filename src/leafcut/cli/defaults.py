"""The command `leafcut defaults`: the user's own defaults, and the source of each option's value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, switch_parameter
from leafcut.cli.shared import print_json
from leafcut.cli.usage import refuse_standard_input
from leafcut.errors import OptionError, name_suggestion
from leafcut.files.schemas import OPTIONS
from leafcut.files.user_files import DEFAULTS_VARIABLE, defaults_file, usual_defaults_file
from leafcut.files.whole_files import check_file_exists
from leafcut.options.option_spec import OptionGroup, OptionSpec, flag_name, typed_text
from leafcut.processes import registry
from leafcut.processes.base import Work
from leafcut.processes.settings import PlacedOption, collect_settings, options_used_by, read_options_with_lines

#: Template of a defaults file with the settings of a shop. Each line is a commented example.
TEMPLATE = f"""\
# Defaults of this shop. Remove the # in front of a line, and write your own value.
# The command line goes before --options, and that before this file. Paths are relative to its folder.
# leafcut defaults drill lists all options of drilling with their sources.
{OPTIONS.toml_line}

# machine = "haas-vf2"          # a name of `leafcut list machines`, or a profile: "my.toml"
# work_offset = "-400,-200,-300"
# dialect = "haas"              # where it is not the machine's
# tools = "tools.toml"          # tool library
# output_units = "inch"         # of programs: mm or inch
# units = "mm"                  # of drawings that do not state theirs
# thickness = "6mm"
# clearance_height = "10mm"
# preset = "thorough"

# seller = "Example Metalwork; 1 Main Street; Springfield"  # and the costs of a quote (--quote)
# terms = "Prices do not include taxes."
# currency = "EUR"
# shop_rate = 80                # machine and operator per hour
# setup_cost = 25               # once for each batch
# markup = "20%"                # on the cost
# valid_days = 30

# [cut]                         # of one process alone
# material = "mild-steel"

# [drill]
# break_through = "0.5mm"
"""

#: Commands whose kind of work depends on the input.
_OF_ALL_KINDS = ("optimize", "filter")


@dataclass(frozen=True)
class DefaultRow:
    """The value of an option that is not on the command line.

    `option` is the flag and `value` its value as typed. `source` is a file and line, ``leafcut``, or ``leafcut`` for
    this kind of work. `used_by` are the commands that use the option; it is empty if all rows belong to a single
    command.
    """

    option: str
    value: str
    source: str
    used_by: str = ""


def default_rows(command: str | None, options_file: Path | None, defaults_file: Path | None) -> list[DefaultRow]:
    """Return the options of a command with their sources, options from files first. Without a command, return only
    options from files.

    Raises OptionError if the command does not exist or has no options, or if a file cannot be read, has an unknown
    option or an invalid value; the message names the line.
    """
    from_files: dict[str, tuple[PlacedOption, Path]] = {}
    for file in filter(None, (defaults_file, options_file)):
        from_files.update({option.name: (option, file) for option in read_options_with_lines(file)})
    if command is None:
        return [_row_from_file(option, file) for option, file in from_files.values()]
    work = _find_work(command)
    settings = collect_settings({}, options_file, defaults_file)
    usual = work.with_defaults(settings)
    rows = []
    for group, name, spec in options_used_by(work):
        value = getattr(usual.of(group), name)
        is_default = value == group.defaults()[name]
        source = "leafcut" if is_default else f"leafcut, for {work.title}"
        if name in from_files:
            source = _file_and_line(*from_files[name])
        rows.append(DefaultRow(flag_name(name), _value_text(group, name, spec, value), source))
    return sorted(rows, key=lambda row: row.source.startswith("leafcut"))  # options from files first


def defaults_as_json(rows: list[DefaultRow], file: Path | None) -> Mapping[str, Any]:
    """Return the rows as JSON data."""
    return {"file": str(file or ""), "options": [asdict(row) for row in rows]}


def _row_from_file(option: PlacedOption, file: Path) -> DefaultRow:
    spec = option.group.specs()[option.name]
    value = getattr(option.group(**option.group.as_typed({option.name: option.value})), option.name)
    uses = ", ".join(command for command, work in _works_by_command() if option.name in work.used())
    return DefaultRow(
        flag_name(option.name), _value_text(option.group, option.name, spec, value), _file_and_line(option, file), uses
    )


def _file_and_line(option: PlacedOption, file: Path) -> str:
    return f"{file}:{option.line}" if option.line else str(file)


def _value_text(group: type[OptionGroup], name: str, spec: OptionSpec, value: Any) -> str:
    """Return a value as typed, or in words if it cannot be typed."""
    if spec.kind == "flag":
        return "on" if value else "off"
    if value == group.defaults()[name] and (spec.default_words or value in (None, ())):
        return spec.default_words or "none"
    return str(value) if spec.names_file(value) else typed_text(spec, value)


def _works_by_command() -> Iterator[tuple[str, Work]]:
    for work in registry.works():
        yield work.command, work


def _find_work(command: str) -> Work:
    kinds = dict(_works_by_command())
    if command in _OF_ALL_KINDS:
        words = ", ".join(process.command for process in registry.processes())
        raise OptionError(f"{command} does several kinds of work; name one of {words}")
    if command not in kinds and command in registry.OTHER_COMMANDS and command != "auto":
        raise OptionError(f"{command} takes nothing from your defaults; leafcut {command} --help lists its options")
    if command not in kinds:
        raise OptionError("unknown command '{}'{}", command, name_suggestion(command, kinds))
    return kinds[command]


def show_defaults(
    command: Annotated[
        str | None, Parameter(name="COMMAND", help="show all options of this command, such as drill")
    ] = None,
    /,
    *,
    options_file: Annotated[
        File | None, Parameter(name="--options", help="a TOML file of options that overrides your defaults")
    ] = None,
    template: Annotated[
        bool,
        switch_parameter("--template", help="print a new file of defaults"),
    ] = False,
    as_json: Json = False,
) -> int:
    """Show your own defaults, and where the value of each option comes from."""
    if template:
        if command or options_file or as_json:
            raise OptionError("--template prints a new file; leave out the other options")
        print(TEMPLATE, end="")
        return 0
    refuse_standard_input("--options", options_file)
    given = Path(options_file) if options_file else None
    check_file_exists("--options", given)
    file = defaults_file()
    rows = default_rows(command, given, file)
    if as_json:
        print_json(defaults_as_json(rows, file))
        return 0
    print(_defaults_file_line(str(file) if file else "", str(usual_defaults_file() or "")))
    widths = [max((len(cell) for cell in column), default=0) for column in zip(*map(_table_cells, rows), strict=True)]
    for row in rows:
        print("  ".join(f"{cell:{width}}" for cell, width in zip(_table_cells(row), widths, strict=True)).rstrip())
    return 0


def _table_cells(row: Any) -> tuple[str, ...]:
    cells = (row.option, row.value, row.source, f"used by {row.used_by}" if row.used_by else "")
    return tuple("".join(c if c.isprintable() else "?" for c in cell) for cell in cells)


def _defaults_file_line(file: str, usual: str) -> str:
    if file:
        return f"your defaults file: {file}"
    place = f"; leafcut defaults --template prints one to save as {usual}" if usual else ""
    return f"no defaults file{place} (or name one in ${DEFAULTS_VARIABLE})"
