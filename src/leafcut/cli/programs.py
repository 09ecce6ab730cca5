"""The commands that make programs: optimize, drill, cut, pocket, reorder, nest, and the filter of LinuxCNC."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from leafcut.cli.flags import File, Json, Name, Time, switch_parameter
from leafcut.cli.progress import Reporter
from leafcut.cli.several import (
    TABLE,
    all_drill_files,
    expand_folders_and_lists,
    expand_inputs,
    output_files,
    program_files_beside_inputs,
    refuse_foreign_file,
)
from leafcut.cli.shared import (
    DONE,
    INCOMPLETE,
    REFUSED,
    NoDefaults,
    OptionsFile,
    Quiet,
    defaults_file_unless,
    given_options,
    note_unchanged_output,
    print_error_line,
    print_issues,
    print_json,
    refuse_standard_output,
    restore_dash,
    write_program_to_stdout,
)
from leafcut.cli.usage import DASH, refuse_standard_input
from leafcut.errors import OptionError
from leafcut.files.user_files import record_first_showing
from leafcut.files.whole_files import StandardInput
from leafcut.options.option_spec import PLACES, flag_name
from leafcut.processes import registry
from leafcut.processes.settings import all_options
from leafcut.units import parse_quantity

if TYPE_CHECKING:
    from leafcut.cli.batch import BatchResult, BatchRow
    from leafcut.model.outcome import Outcome
    from leafcut.read import Input

_MANY = Group("Many inputs", sort_key=50)


def optimize(
    *sources: str,
    command: str,
    output: Annotated[
        File | None,
        Parameter(
            name=["--output", "-o"],
            help="program to write, - for standard output; for several inputs, a folder; replaces only unchanged files "
            "of leafcut (default: beside the input)",
        ),
    ] = None,
    dry_run: Annotated[bool, switch_parameter("--dry-run", help="write no program")] = False,
    report: Annotated[
        File | None,
        Parameter(
            name="--report",
            help="report to write: an HTML page, or a .csv file with the times of the parts of a sheet; a folder for "
            "several inputs",
        ),
    ] = None,
    process: Name = Name("auto"),
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    quiet: Quiet = False,
    watch: Annotated[
        bool,
        Parameter(
            name="--watch",
            negative="",
            show_default=False,
            group=_MANY,
            help="watch a folder, and make a program of each file that is added or changed; needs -o",
        ),
    ] = False,
    every: Annotated[
        Time | None, Parameter(name="--every", group=_MANY, help="with --watch: time between two checks (default: 2s)")
    ] = None,
    executor: Annotated[
        Name | None,
        Parameter(
            name="--executor", group=_MANY, help="where to process the inputs: threads, processes, or dask://host:port"
        ),
    ] = None,
    workers: Annotated[
        int | None, Parameter(name="--workers", group=_MANY, help="number of inputs to process at once (default: 1)")
    ] = None,
    options: dict[str, Any],
) -> int:
    """Make a verified program with the least machine time from a drawing, or from another CAM's program.

    The search ends when its colonies agree; --time-limit and --preset limit it.
    """
    output, report = restore_dash(output), restore_dash(report)
    asked = process if command == "optimize" or process != "auto" else command
    refuse_standard_output("--report", report)
    refuse_standard_input("--options", options_file)
    _check_workers(executor, workers)
    if dry_run and output is not None:
        raise OptionError("--dry-run writes no program; leave -o out")
    if output == DASH and as_json:
        raise OptionError("--json and -o - both write to standard output; leave one out")
    general = {"process": asked, "options_file": options_file, "defaults_file": defaults_file_unless(no_defaults)}
    given: dict[str, Any] = general | given_options(options)
    words = [*map(restore_dash, sources)]
    if watch:
        _refuse_single_file_options(given, "a folder has many programs")
        if dry_run or report or as_json:
            raise OptionError("--watch writes programs, a table and a report with -o; leave the other outputs out")
        return _watch_folder(words, output, given, every or "2s", executor, workers, quiet=quiet)
    if every is not None:
        raise OptionError("--every is used with --watch only; leave it out")
    inputs_found = expand_folders_and_lists(words)
    inputs, each = expand_inputs(inputs_found, command, folder=output, joins=asked in ("auto", "drill"))
    if each or inputs_found != words:
        return _optimize_each(
            inputs, output, report, given, executor, workers, dry_run=dry_run, as_json=as_json, quiet=quiet
        )
    if executor is not None or workers is not None:
        raise OptionError(f"--{'workers' if executor is None else 'executor'}: only for several inputs; leave it out")
    from leafcut import api
    from leafcut.read.registry import read_once

    loaded: list[Input] = [StandardInput.read()] if inputs == [DASH] else [*inputs]
    if asked == "auto":
        loaded = [read_once(source) for source in loaded]
    file = None if dry_run or output == DASH else _output_file(inputs, loaded, output, given)
    replaced = Path(file).read_bytes() if file and output is None and Path(file).is_file() else None
    with note_unchanged_output(file), Reporter(quiet=quiet) as reporter:
        outcome = api.optimize(loaded, file, report=report, progress=reporter, **given)
    _report_replaced(file, replaced)
    if output == DASH:
        write_program_to_stdout(outcome.text.encode(outcome.encoding))
        outcome = replace(outcome, output="standard output")

    if as_json:
        from leafcut.report.json_answer import program_as_json as answer

        print_json(answer(registry.report_of(outcome)))
    elif quiet:
        print_issues(outcome.issues)
    else:
        from rich.console import Console

        from leafcut.report.summary import print_summary

        print_summary(registry.report_of(_drop_shown_machine_note(outcome)), Console(stderr=output == DASH))
    return _exit_status(outcome)


def _output_file(
    inputs: Sequence[str], loaded: Sequence[Input], output: str | None, given: Mapping[str, Any]
) -> str | None:
    """Return the program file, by default beside the input; None for standard input without an output.

    Raises OutputError if the file exists and is not leafcut's own, and OptionError if the command does not read the
    input.
    """
    from leafcut import api
    from leafcut.read.registry import read_source_with_format

    command = ""
    if output is None and inputs != [DASH]:
        name, command = api.program_for(loaded[0], **given)
        output = program_files_beside_inputs(inputs[:1], [name], inputs)[0]
        if Path(output).is_file():
            registry.check_process_value(str(given["process"]))
            registry.process_for([read_source_with_format(source) for source in loaded], str(given["process"]))
    refuse_foreign_file(output, inputs, command)
    return output


def _report_replaced(file: str | None, before: bytes | None) -> None:
    """Report that a program replaced an earlier program with different contents, `before`."""
    if file is not None and before is not None and Path(file).read_bytes() != before:
        print_error_line(f"{file}: replaced leafcut's earlier program; name another file with -o to keep both", DONE)


def _exit_status(outcome: Outcome) -> int:
    return INCOMPLETE if outcome.missing else DONE


def _drop_shown_machine_note(outcome: Outcome) -> Outcome:
    """Return an outcome without the note on this machine (L403) if it was shown before; notes on the part stay."""
    from leafcut.model.issue import Severity

    known = [
        issue
        for issue in outcome.issues
        if issue.code == "L403"
        and issue.severity is Severity.NOTE
        and not issue.message.startswith("the part reaches ")
    ]
    if known and not record_first_showing(f"L403 {outcome.machine.name}"):
        return replace(outcome, issues=tuple(issue for issue in outcome.issues if issue not in known))
    return outcome


def _refuse_single_file_options(given: Mapping[str, Any], several: str) -> None:
    for _, name, spec in all_options():
        if spec.is_output and given.get(name):
            raise OptionError(f"{flag_name(name)}: names one file but {several}; run them one by one")


def _check_workers(executor: str | None, workers: int | None) -> None:
    if executor is None and workers is None:
        return
    from leafcut.order.executors import MOST_WORKERS, check_executor

    if executor is not None:
        check_executor(executor)
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise OptionError(f"--workers: choose 1 to {MOST_WORKERS}")


def _optimize_each(
    inputs: list[str],
    output: str | None,
    report: str | None,
    given: dict[str, Any],
    executor: str | None,
    workers: int | None,
    *,
    dry_run: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    from leafcut import api
    from leafcut.cli.batch import read_table, run_batch
    from leafcut.order.executors import open_executor

    _refuse_single_file_options(given, "there are several inputs")
    if DASH in inputs:
        raise OptionError("-: standard input cannot be combined with other inputs")
    if given.get("origin") in PLACES and len(inputs) > 1 and all_drill_files(inputs):
        raise OptionError(
            f"--origin {given['origin']}: each drill file would get its own zero, so the holes of the board would not "
            "match; name one program for all with -o, or a point, --origin x,y"
        )
    names, works = zip(*(api.program_for(source, **given) for source in inputs), strict=True)
    if output is None and not dry_run:
        programs: Sequence[str | None] = program_files_beside_inputs(inputs, names, inputs)
        for program, work in zip(programs, works, strict=True):
            refuse_foreign_file(program, inputs, work)
    else:
        programs = output_files(inputs, names, output, "-o")
        earlier = {row.program_sha256 for row in read_table(Path(output) / TABLE).values()} if output else set()
        for program in programs:
            refuse_foreign_file(program, inputs, earlier=earlier)
    pages = output_files(inputs, [f"{Path(name).stem}.html" for name in names], report, "--report")
    with Reporter(quiet=quiet) as reporter:
        make = partial(
            run_batch,
            inputs,
            programs,
            given,
            folder=output,
            reports=pages,
            progress=reporter,
            refused=_print_refusal,
        )
        try:
            if executor is None and (workers or 1) == 1:
                results = make()
            else:
                with open_executor(executor or "processes", workers or 0) as opened:
                    results = make(executor=opened)
        except KeyboardInterrupt:
            raise OptionError("interrupted; finished programs are kept") from None
    return _print_results(results, output, as_json=as_json, quiet=quiet)


def _print_results(results: Sequence[BatchResult], folder: str | None, *, as_json: bool, quiet: bool) -> int:
    from leafcut.report.several import batch_as_json, print_batch

    rows = [result.as_json() for result in results]
    status = next(
        (worst_status for worst_status in (REFUSED, INCOMPLETE) if any(row["status"] == worst_status for row in rows)),
        DONE,
    )
    if as_json:
        print_json(batch_as_json(rows, status))
    elif quiet:
        for result in results:
            print_issues(result.issues, f"{result.row.input}: ")
    else:
        from rich.console import Console

        figures = [asdict(result.row) for result in results]
        print_batch([*zip(figures, rows, strict=True)], folder, Console())
    return status


def _print_refusal(line: str) -> None:
    print_error_line(line, REFUSED)


def _watch_folder(
    words: Sequence[str],
    output: str | None,
    given: Mapping[str, Any],
    every: str,
    executor: str | None,
    workers: int | None,
    *,
    quiet: bool,
) -> int:
    from leafcut.cli.watch_folder import FolderWatch
    from leafcut.order.executors import open_executor
    from leafcut.report.wording import count_text, time_words

    if len(words) != 1 or words == [DASH]:
        raise OptionError(f"--watch takes one folder; {len(words)} inputs were given")
    if output is None or output == DASH:
        raise OptionError("--watch needs -o FOLDER for the programs")
    seconds = parse_quantity(every, "s")
    if not 0.1 <= seconds <= 3600.0:
        raise OptionError("--every: choose 0.1s to 1h")
    numbers = {"written": 0, "refused": 0}

    def written(row: BatchRow) -> None:
        numbers["written"] += 1
        worst = f"; {count_text(row.issues, 'issue')}, the worst: {row.worst}" if row.issues else ""
        if not quiet:
            name = "".join(c if c.isprintable() else "?" for c in f"{row.input}: {row.program}")
            print(f"{name}, {time_words(float(row.after_s or 'nan'))}{worst}", flush=True)

    def refused(line: str) -> None:
        numbers["refused"] += 1
        _print_refusal(line)

    # An input that is being processed at Ctrl-C is repeated when the folder is watched again.
    with suppress(KeyboardInterrupt), open_executor(executor or "threads", workers or 1) as opened:
        watch = FolderWatch(Path(words[0]), Path(output), given, opened, written, refused)
        watch.check_settings()
        if not quiet:
            print(f"watching {words[0]}; Ctrl-C ends it", flush=True)
        watch.run_until_interrupted(seconds)
    if not quiet:
        print(
            f"ended; {count_text(numbers['written'], 'program')} written, {count_text(numbers['refused'], 'refusal')}"
        )
    return DONE


def filter_program(
    *sources: str,
    process: Name = Name("auto"),
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    options: dict[str, Any],
) -> int:
    """Write the program of a file to standard output, as a filter of LinuxCNC: a drawing opens in its own window.

    The machine is LinuxCNC's, from its .ini, unless --machine or --options names one. A line in [FILTER] of the .ini
    calls it: dxf = leafcut filter --thickness 6
    """
    from leafcut.cli.linuxcnc_filter import only_file, run_filter

    refuse_standard_input("filter", *sources)
    refuse_standard_input("--options", options_file)
    outcome = run_filter(
        only_file(sources),
        given_options(options),
        process=process,
        options_file=options_file,
        defaults_file=defaults_file_unless(no_defaults),
    )
    print_issues(outcome.issues)
    if _exit_status(outcome) == INCOMPLETE:
        line = "something in the drawing would not be done, so it is not opened; leave its layer out, or correct it"
        return print_error_line(line, INCOMPLETE)
    write_program_to_stdout(outcome.text.encode(outcome.encoding))
    return DONE


def _default_sheet_file(parts: Sequence[str]) -> str | None:
    """Return the default file of nested sheets, in the folder of the first part and with its name; None if there is no
    part.

    Raises OutputError if it cannot be written.
    """
    inputs = _files_without_quantities(parts)
    if not inputs or (":" not in inputs[0] and not Path(inputs[0]).exists()):
        return None  # the missing part is refused when it is read
    return program_files_beside_inputs(inputs[:1], [f"{Path(inputs[0]).stem}.dxf"], inputs)[0]


def _files_without_quantities(parts: Sequence[str]) -> list[str]:
    from leafcut.read.nest_list import split_file_and_quantity

    return [split_file_and_quantity(word)[0] for word in parts]


def _refuse_foreign_sheets(output: str, parts: Sequence[str], remnants: str | None) -> None:
    """Raise OutputError if a sheet of this name, or a remnant in the folder `remnants`, was not written by leafcut."""
    file, inputs = Path(output), _files_without_quantities(parts)
    names = [(file.parent, r"(_v\d+)?(_\d+)?")]
    if remnants is not None:
        names.append((Path(remnants), r"(_\d+)?_rest(_\d+)?"))
    for folder, ending in names:
        pattern = re.compile(rf"{re.escape(file.stem)}{ending}\.dxf", re.IGNORECASE)
        for drawing in sorted(folder.iterdir() if folder.is_dir() else ()):
            if pattern.fullmatch(drawing.name):
                refuse_foreign_file(str(drawing), inputs, "nest")


def nest(
    *parts: Annotated[
        str, Parameter(name="PARTS", help="drawings with quantities, such as bracket.dxf:10, or a parts list (CSV)")
    ],
    output: Annotated[
        File | None,
        Parameter(
            name=["--output", "-o"],
            help="nested sheet to write (DXF), - for standard output if there is one; replaces only unchanged files of "
            "leafcut (default: beside the first part)",
        ),
    ] = None,
    dry_run: Annotated[bool, switch_parameter("--dry-run", help="do not write a drawing")] = False,
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    quiet: Quiet = False,
    options: dict[str, Any],
) -> int:
    """Nest parts on sheets, in several variants, and write the best nest as DXF for cutting."""
    from leafcut import api

    refuse_standard_input("nest", *parts)
    refuse_standard_input("--options", options_file)
    to_standard_output = restore_dash(output) == DASH
    if dry_run and output is not None:
        raise OptionError("--dry-run writes no drawing; leave -o out")
    if to_standard_output and as_json:
        raise OptionError("--json and -o - both write to standard output; leave one out")
    file = None if to_standard_output or dry_run else _default_sheet_file(parts) if output is None else output
    if file is not None:
        _refuse_foreign_sheets(file, parts, given_options(options).get("remnants_out"))
    with note_unchanged_output(file), Reporter(quiet=quiet) as reporter:
        outcome = api.nest(
            [*parts],
            file,
            options_file=options_file,
            defaults_file=defaults_file_unless(no_defaults),
            progress=reporter,
            **given_options(options),
        )
    if to_standard_output:
        drawings = [drawing for variant in outcome.drawings for drawing in variant]
        if len(drawings) != 1:
            raise OptionError(
                f"-o -: the nest has {len(drawings)} drawings, but standard output takes only one; name a file"
            )
        write_program_to_stdout(drawings[0].encode())
        outcome = replace(outcome, files=(("standard output",),))
    if as_json:
        print_json(registry.command_function("nest_answer")(outcome))
    elif quiet:
        print_issues(outcome.issues)
    else:
        from rich.console import Console

        registry.command_function("nest_summary")(outcome, Console(stderr=to_standard_output))
    return INCOMPLETE if outcome.missing else DONE
