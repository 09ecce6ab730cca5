"""The command `leafcut tools speeds`: choose speeds and feeds."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, Name
from leafcut.cli.progress import Reporter
from leafcut.cli.shared import (
    DONE,
    NoDefaults,
    defaults_file_unless,
    given_options,
    note_unchanged_output,
    print_defaults,
    print_json,
    refuse_standard_output,
    restore_dash,
)
from leafcut.cli.usage import DASH
from leafcut.errors import OptionError
from leafcut.files.whole_files import StandardInput


def tool_speeds(
    drawing: Annotated[
        str | None,
        Parameter(
            name="DRAWING", help="a drawing with the holes; without a drawing, a single hole of --depth is assumed"
        ),
    ] = None,
    /,
    *more: Annotated[str, Parameter(show=False)],
    objective: Annotated[Name, Parameter(name="--objective", help="what to optimize [time, cost, life]")] = Name(
        "cost"
    ),
    save: Annotated[
        File | None,
        Parameter(name="--save", help="tool library to write, a copy of --tools with the chosen speeds (.toml)"),
    ] = None,
    plot: Annotated[File | None, Parameter(name="--plot", help="picture of the Pareto fronts to write (.svg)")] = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Choose Pareto-optimal spindle speeds and feeds: time, cost and tool life of a part."""
    from leafcut import api
    from leafcut.report.cutting_data_report import cutting_data_as_json, print_cutting_data

    if more:
        raise OptionError(f"tools speeds takes one drawing, not {1 + len(more)}; run them one by one")
    refuse_standard_output("--save", save)
    refuse_standard_output("--plot", plot)
    source = StandardInput.read() if restore_dash(drawing) == DASH else drawing
    with note_unchanged_output(save), Reporter(quiet=as_json) as reporter:
        result = api.tool_speeds(
            source,
            objective=objective,
            save=save,
            plot=plot,
            progress=reporter,
            defaults_file=defaults_file_unless(no_defaults),
            **given_options(options),
        )
    if as_json:
        print_json(cutting_data_as_json(result, save, plot))
    else:
        from rich.console import Console

        print_cutting_data(result, save, plot, Console())
        print_defaults(result.defaults)
    return DONE
