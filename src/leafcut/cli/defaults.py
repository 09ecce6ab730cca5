"""The command `leafcut defaults`: the user's own defaults, and the source of each option's value."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, switch
from leafcut.cli.shared import print_json
from leafcut.cli.shop_defaults import TEMPLATE, as_answer, shop_defaults
from leafcut.cli.usage import refuse_dash
from leafcut.errors import OptionError
from leafcut.files.user_files import DEFAULTS_VARIABLE, defaults_file, usual_defaults_file
from leafcut.files.whole_files import check_is_there


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
        switch("--template", help="print a new file of defaults"),
    ] = False,
    as_json: Json = False,
) -> int:
    """Show your own defaults, and where the value of each option comes from."""
    if template:
        if command or options_file or as_json:
            raise OptionError("--template prints a new file; leave out the other options")
        print(TEMPLATE, end="")
        return 0
    refuse_dash("--options", options_file)
    given = Path(options_file) if options_file else None
    check_is_there("--options", given)
    file = defaults_file()
    rows = shop_defaults(command, given, file)
    if as_json:
        print_json(as_answer(rows, file))
        return 0
    print(_file_words(str(file) if file else "", str(usual_defaults_file() or "")))
    widths = [max((len(cell) for cell in column), default=0) for column in zip(*map(_cells, rows), strict=True)]
    for row in rows:
        print("  ".join(f"{cell:{width}}" for cell, width in zip(_cells(row), widths, strict=True)).rstrip())
    return 0


def _cells(row: Any) -> tuple[str, ...]:
    cells = (row.option, row.value, row.source, f"used by {row.used_by}" if row.used_by else "")
    return tuple("".join(c if c.isprintable() else "?" for c in cell) for cell in cells)


def _file_words(file: str, usual: str) -> str:
    if file:
        return f"your defaults file: {file}"
    place = f"; leafcut defaults --template prints one to save as {usual}" if usual else ""
    return f"no defaults file{place} (or name one in ${DEFAULTS_VARIABLE})"
