"""The command line: options become flags, one command calls one function of `api`."""

from __future__ import annotations

import io
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, CycloptsError, Parameter

from leafcut._version import __version__
from leafcut.cli.flags import Directory, File, Json, command_of, switch
from leafcut.cli.json_output import print_json
from leafcut.cli.progress import Reporter
from leafcut.cli.several import all_drill_files, expanded, targets_of
from leafcut.cli.usage import DASH, GROUPS, HELD, command_in, refuse_dash, told
from leafcut.errors import DataError, LeafcutError, OptionError, count_of
from leafcut.files.user_files import DEFAULTS_VARIABLE, defaults_file, first_time
from leafcut.files.whole_files import StandardInput
from leafcut.options import Settings
from leafcut.options.option_spec import PLACES, flag_name
from leafcut.processes import registry
from leafcut.processes.base import Process, Work
from leafcut.processes.settings import all_options, used_by, why_unused

if TYPE_CHECKING:
    from leafcut.cli.batch import BatchRow
    from leafcut.model.outcome import Outcome
    from leafcut.model.simulation import Simulation

DONE, REFUSED, USAGE, INCOMPLETE = 0, 1, 2, 3
STATUSES = "Exit status: 0 done; 1 refused; 2 wrong usage; 3 done, but work is missing, which is reported first."
_WORST_FIRST = ("danger", "missing", "warning")
#: Of several inputs the status is that of the worst.
_STATUS_ORDER = (DONE, INCOMPLETE, REFUSED, USAGE)

#: The options of `cutting-data` that matter most.
_FIRST_OF_SPEEDS = ("material", "tools", "holes", "depth", "thickness", "machine", "shop_rate", "tool_cost")

#: What it does without some options, where that is not what drilling does.
_ASKED_OF_SPEEDS = {
    "material": "must be given",
    "tools": "one drill per diameter of the drawing, or --drill-diameter",
}

#: What `optimize` takes.
_EVERY_INPUT = (
    "a drawing, a drill file, a point map, a G-code program, or example:plate-70; several drill files make one program"
)

#: What `batch` takes.
_MANY_INPUTS = "a folder of drawings or programs, a list of inputs (.list, one on each line), or files"

#: So many warnings are said where they are not asked for.
MOST_WARNINGS = 10

#: A file of options.
OptionsFile = Annotated[File | None, Parameter(name="--options", help="a TOML file of options")]

#: Where `batch` and `watch` write, and who does the inputs.
ProgramsFolder = Annotated[
    Directory, Parameter(name=["--output", "-o"], help="folder to write programs, table and report into")
]
ExecutorOption = Annotated[
    str, Parameter(name="--executor", help="where inputs are done: threads, processes, or dask://host:port")
]
WorkersOption = Annotated[
    int | None, Parameter(name="--workers", help="so many inputs at once (default: one per core, all of a cluster)")
]

#: Whether the person's own defaults are left out of account.
NoDefaults = Annotated[
    bool,
    switch(
        "--no-defaults",
        help=f"ignore your defaults file (leafcut/defaults.toml in your settings folder, or ${DEFAULTS_VARIABLE})",
    ),
]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status (`STATUSES`)."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without "→" shows "?", it does not stop the work
    warnings.formatwarning = _warning_line  # type: ignore[assignment]
    status = run(sys.argv[1:] if arguments is None else list(arguments))
    sys.exit(status)


def _warning_line(message: Warning | str, *_: object) -> str:
    """Return a warning as one line, without the place in the source that Python adds."""
    return f"leafcut: {message}\n"


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit status; errors are one line on standard error."""
    try:
        return _answered(arguments)
    except KeyboardInterrupt:
        return _refused(arguments, "interrupted; nothing was written", REFUSED)
    except BrokenPipeError:
        # The reader of our output went away, which is its right; keep Python from complaining at exit.
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as problem:  # the last net: no traceback reaches a user
        return _refused(() if getattr(problem, "answered", False) else arguments, *_failure(problem))


def _answered(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit status; the parser says what is wrong in it."""
    words = [HELD if word == DASH else word for word in arguments]
    try:
        return int(app(arguments)(words, exit_on_error=False, print_error=False) or DONE)
    except CycloptsError as problem:
        return _refused(arguments, _told(problem, command_in(arguments)), USAGE)


def _told(problem: CycloptsError, command: str) -> str:
    """Return what a person is told of a command line that the parser refuses."""
    works = {name: works for name, _, works, _ in _working_commands()}.get(command, [])

    def why(flag: str, name: str) -> str:
        if not works or any(name == used for _, used, _ in used_by(*works)):
            return ""
        title, instead = (works[0].title, works[0].otherwise.get(name, "")) if len(works) == 1 else (command, "")
        return f"{flag}: {why_unused(name, title, instead)}"

    every = [name for name in app() if not name.startswith("-")]
    return told(problem, command, every, {name: spec for _, name, spec in all_options()}, why)


def _failure(problem: Exception) -> tuple[str, int]:
    """Return what a person is told of an error, in a line, and the exit status."""
    if isinstance(problem, LeafcutError):
        line = "; ".join([str(problem), *getattr(problem, "__notes__", ())])
        wrong_usage = isinstance(problem, OptionError) and not isinstance(problem, DataError)
        return line, USAGE if wrong_usage else REFUSED
    if isinstance(problem, MemoryError):
        return "not enough memory for this input", REFUSED
    if os.environ.get("LEAFCUT_TRACEBACK"):
        raise problem
    text = " ".join(f"{type(problem).__name__}: {problem}".split())
    return f"internal error in leafcut ({text}); set LEAFCUT_TRACEBACK=1 for details", REFUSED


def _warn(issues: Iterable[Any], place: str = "") -> None:
    """Say on standard error what matters even to somebody who wants no summary: holes lost, depths assumed."""
    from leafcut.model.issue import LIMITS

    told = sorted((i for i in issues if i.severity != "note"), key=lambda i: _WORST_FIRST.index(i.severity))
    lines = {f"{place}{issue.severity}: {issue}": issue.code in LIMITS for issue in told}
    most = MOST_WARNINGS
    for line, is_limit in lines.items():
        # Never fold assumptions.
        if is_limit or most > 0:
            _refuse(line, DONE)
        most -= not is_limit
    if most < 0:
        _refuse(f"warning: {-most} more", DONE)


def _refused(arguments: Sequence[str], line: str, status: int) -> int:
    """Print why nothing was done: one line, and with --json also an object, unless the program goes to that output."""
    program = re.search(r"(^| )(-o|--output)[ =]-( |$)", " ".join(arguments))
    if "--json" in arguments and not program:
        print_json({"error": _printable(line)})
    return _refuse(line, status)


def _refuse(line: str, status: int) -> int:
    print(f"leafcut: {_printable(line)}", file=sys.stderr)
    return status


def _printable(line: str) -> str:
    """Return a line as it is shown; names of files may hold any character."""
    line = line.replace(HELD, DASH)  # a word that nobody took for standard input
    return "".join(c if c.isprintable() else "?" for c in line)


@contextmanager
def _nothing_new_in(output: str | None) -> Iterator[None]:
    """Let a refusal tell that what an earlier run wrote is still there: it would run on the machine as well."""
    try:
        yield
    except LeafcutError as problem:
        from leafcut.files.whole_files import OutputError

        if output and Path(output).is_file() and not isinstance(problem, OutputError):
            problem.add_note(f"{output} was not changed")
        raise


def app(arguments: Sequence[str] = ()) -> App:
    """Return the application with its commands; flags are made from the option groups.

    Of a command line only the flags of its command are made: there are hundreds. Without one, those of all commands.
    """
    from leafcut.cli.inside import add_commands
    from leafcut.cli.send import send

    made = App(
        name="leafcut",
        help=f"The shortest-time, verified CNC program for a drawing.\n\n{STATUSES}",
        version=__version__,
        version_flags=["--version"],
        help_format="plaintext",
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    asked = command_in(arguments)
    all_of_them = not arguments or "--install-completion" in arguments
    for name, (help_text, commands) in GROUPS.items():
        group = App(name=name, help=help_text, help_format="plaintext")
        for one, place in commands.items() if all_of_them or asked.partition(" ")[0] == name else ():
            group.command(resolve_name(place), name=one)
        made.command(group)
    made.command(send, name="send")
    add_commands(made, app)
    for name, alone in _WITHOUT_OPTIONS.items():
        made.command(alone, name=name)
    for name, function, works, special in _working_commands():
        options = used_by(*works) if all_of_them or asked == name else ()
        made.command(command_of(function, options, **special), name=name, help=special.get("help"))
    if "--install-completion" in arguments:
        from leafcut.cli.inside import type_for_shell

        type_for_shell(made)
    made.register_install_completion_command(help="install command completion for your shell")
    return made


def _working_commands() -> Iterator[tuple[str, Callable[..., int], Sequence[Work], dict[str, Any]]]:
    """Yield what does work: its name, its function, the kinds of work whose options it has, and what is its own."""
    by_optimize = [one for one in registry.processes() if one.reads]
    every = {"process": _process_flag("process", registry.asked_words()), "sources": _inputs(_EVERY_INPUT)}
    yield "optimize", _optimize, by_optimize, {"annotations": every, "fixed": {"command": "optimize"}}
    for one in registry.processes():
        first = [name for _, names in one.form[:2] for name in names]
        special: dict[str, Any] = {"first": first, "help": one.help}
        if not one.reads:
            yield one.command, _nest, [one], special
            continue
        words = [word for word in one.asked_as if word != one.command]
        process = {"process": _process_flag("kind of program", ["auto", *words])} if words else {}
        special["annotations"] = {"sources": _inputs(one.takes), **process}
        special["fixed"] = {"command": one.command} | ({} if words else {"process": "auto"})
        special["defaults"] = partial(_usual, one)
        yield one.command, _optimize, [one], special
    filtered = {**every, "sources": Annotated[str, Parameter(name="FILE", help="a drawing, a drill file or a program")]}
    yield "filter", _filter, by_optimize, {"annotations": filtered}
    many_of = {"process": every["process"], "sources": Annotated[str, Parameter(name="INPUT", help=_MANY_INPUTS)]}
    yield "batch", _batch, by_optimize, {"annotations": many_of}
    watched = {**many_of, "sources": Annotated[str, Parameter(name="FOLDER", help="the folder that is watched")]}
    yield "watch", _watch, by_optimize, {"annotations": watched}
    for name, function in (("solve", _solve), ("simulate", _simulate), ("stock", _stock), ("verify", _verify)):
        yield name, function, [registry.work(name)], {}
    yield (
        "cutting-data",
        _cutting_data,
        [registry.work("cutting-data")],
        {"first": _FIRST_OF_SPEEDS, "defaults": lambda: _ASKED_OF_SPEEDS},
    )


def _usual(process: Process) -> dict[str, str]:
    """Return the defaults that a process has instead of those of the options: its machine."""
    return {"machine": process.usual(Settings()).machine.machine}


def _process_flag(what: str, words: Iterable[str]) -> Any:
    return Annotated[str, Parameter(name="--process", help=f"{what} [{', '.join(words)}]")]


def _inputs(what: str) -> Any:
    words = f"{what}; - for standard input; several inputs, or a pattern with * and ?, are done one by one"
    return Annotated[str, Parameter(name="INPUT", help=words)]


def _optimize(
    *sources: str,
    command: str,
    output: Annotated[
        File | None,
        Parameter(
            name=["--output", "-o"], help="program to write, - for standard output; for several inputs, a folder"
        ),
    ] = None,
    report: Annotated[
        File | None, Parameter(name="--report", help="report page to write (HTML); for several inputs, a folder")
    ] = None,
    process: str = "auto",
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    quiet: Annotated[
        bool,
        switch("--quiet", "-q", help="no progress, no summary; warnings only"),
    ] = False,
    options: dict[str, Any],
) -> int:
    """Make a verified program with the least machine time from a drawing, or from another CAM's program.

    The search ends when its colonies agree; --time-limit and --preset limit it.
    """
    output, report = _dashed(output), _dashed(report)
    asked = process if command == "optimize" or process != "auto" else command
    inputs, each = expanded([*map(_dashed, sources)], command, folder=output, joins=asked in ("auto", "drill"))
    if output == DASH and as_json:
        raise OptionError("--json and -o - both write to standard output; leave one out")
    _check_file("--report", report)
    refuse_dash("--options", options_file)
    given: dict[str, Any] = {"process": asked, "options_file": options_file, "defaults_file": _defaults(no_defaults)}
    if each:
        return _optimize_each(inputs, output, report, {**given, **_given(options)}, as_json=as_json, quiet=quiet)
    source = StandardInput.read() if inputs == [DASH] else inputs[0] if len(inputs) == 1 else inputs
    file = None if output == DASH else output
    from leafcut import api

    with _nothing_new_in(file), Reporter(quiet=quiet) as reporter:
        outcome = api.optimize(source, file, report=report, progress=reporter, **given, **_given(options))
    if output == DASH:
        _write_out(outcome.text.encode(outcome.encoding))
        outcome = replace(outcome, output="standard output")
    if as_json:
        from leafcut.report.json_answer import as_json as answer

        print_json(answer(outcome))
    elif quiet:
        _warn(outcome.issues)
    else:
        from rich.console import Console

        from leafcut.report.summary import print_summary

        print_summary(_without_what_is_known(outcome), Console(stderr=output == DASH))
    return _status_of(outcome)


def _status_of(outcome: Outcome) -> int:
    return INCOMPLETE if outcome.missing else DONE


def _without_what_is_known(outcome: Outcome) -> Outcome:
    """Return an outcome without the known note on this machine (L403); notes on the part itself always stay."""
    from leafcut.model.issue import Severity

    known = [
        issue
        for issue in outcome.issues
        if issue.code == "L403"
        and issue.severity is Severity.NOTE
        and not issue.message.startswith("the part reaches ")
    ]
    if known and not first_time(f"L403 {outcome.machine.name}"):
        return replace(outcome, issues=tuple(issue for issue in outcome.issues if issue not in known))
    return outcome


def _check_one_file(given: Mapping[str, Any], several: str) -> None:
    """Refuse options that name one file to be written where there are several programs."""
    for _, name, spec in all_options():
        if spec.is_output and given.get(name):
            raise OptionError(f"{flag_name(name)}: names one file but {several}; run them one by one")


def _optimize_each(
    inputs: list[str], output: str | None, report: str | None, given: dict[str, Any], *, as_json: bool, quiet: bool
) -> int:
    """Make a program of each of several inputs; one that is refused does not stop the others."""
    from leafcut import api
    from leafcut.report.json_answer import as_json as answer

    _check_one_file(given, "there are several inputs")
    if given.get("origin") in PLACES and len(inputs) > 1 and all_drill_files(inputs):
        raise OptionError(
            f"--origin {given['origin']}: each drill file would get its own zero, so the holes of the board would not "
            "match; name one program for all with -o, or a point, --origin x,y"
        )
    names = [api.output_name(source, **given) for source in inputs]
    programs = targets_of(inputs, names, output, "-o")
    pages = targets_of(inputs, [f"{Path(name).stem}.html" for name in names], report, "--report")

    def do(number: int, source: str) -> tuple[dict[str, Any], int]:
        with _nothing_new_in(programs[number]), Reporter(quiet=quiet) as reporter:
            outcome = api.optimize(source, programs[number], report=pages[number], progress=reporter, **given)
        if quiet:
            _warn(outcome.issues, f"{source}: ")
        return {**answer(outcome), "input": source}, _status_of(outcome)

    rows, status = _each("input", inputs, do)
    if as_json:
        from leafcut.report.several import several_as_json

        print_json(several_as_json(rows, status))
    elif not quiet:
        from rich.console import Console

        from leafcut.report.several import print_programs

        print_programs(rows, output, Console())
    return status


def _filter(
    *sources: str,
    process: str = "auto",
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    options: dict[str, Any],
) -> int:
    """Write the program of a file to standard output, as a filter of LinuxCNC: a drawing opens in its own window.

    The machine is that of LinuxCNC, by its .ini, unless --machine or --options names one. A line in [FILTER] of the
    .ini calls it: dxf = leafcut filter --thickness 6
    """
    from leafcut.cli.linuxcnc_filter import check_file, run_filter

    refuse_dash("filter", *sources)
    refuse_dash("--options", options_file)
    outcome = run_filter(
        check_file(sources),
        _given(options),
        process=process,
        options_file=options_file,
        defaults_file=_defaults(no_defaults),
    )
    _warn(outcome.issues)
    if _status_of(outcome) == INCOMPLETE:
        line = "something in the drawing would not be done, so it is not opened; leave its layer out, or correct it"
        return _refuse(line, INCOMPLETE)
    _write_out(outcome.text.encode(outcome.encoding))
    return DONE


def _batch(
    *sources: str,
    output: ProgramsFolder,
    process: str = "auto",
    executor: ExecutorOption = "processes",
    workers: WorkersOption = None,
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    quiet: Annotated[
        bool,
        switch(
            "--quiet",
            "-q",
            help="no progress, no summary; what is refused only",
        ),
    ] = False,
    options: dict[str, Any],
) -> int:
    """Make a program of each of many inputs with the same options, and one report; done ones are not done again.

    One that is refused does not stop the others.
    """
    from leafcut.cli.batch import PAGE, inputs_of, run_batch
    from leafcut.cli.batch import REFUSED as NOT_WRITTEN
    from leafcut.order.executors import open_executor
    from leafcut.report.several import print_batch

    _check_workers(workers)
    asked = _given(options)
    refuse_dash("--options", options_file)
    _check_one_file(asked, "a batch has many")
    given = {"process": process, "options_file": options_file, "defaults_file": _defaults(no_defaults), **asked}
    inputs, _ = expanded(inputs_of(sources), "batch", folder=output)
    if DASH in map(_dashed, inputs):
        raise OptionError("batch: standard input is one program; name files")
    with open_executor(executor, workers or 0) as opened, Reporter(quiet=quiet) as reporter:
        try:
            rows = run_batch(inputs, output, given, opened, progress=reporter, refused=_tell)
        except KeyboardInterrupt:
            raise OptionError("interrupted; what was finished is kept, and the same command goes on") from None
    status = REFUSED if any(row.state == NOT_WRITTEN for row in rows) else DONE
    if status == DONE and any(row.worst == "missing" for row in rows):
        status = INCOMPLETE
    if as_json:
        from dataclasses import asdict

        print_json({"runs": [asdict(row) for row in rows], "status": status})
    elif not quiet:
        print_batch([row.state for row in rows], str(Path(output) / PAGE))
    return status


def _watch(
    *sources: str,
    output: ProgramsFolder,
    process: str = "auto",
    every: Annotated[str, Parameter(name="--every", help="time between two looks at the folder (default: 2s)")] = "2s",
    executor: ExecutorOption = "processes",
    workers: WorkersOption = None,
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    quiet: Annotated[bool, switch("--quiet", "-q", help="only what is refused")] = False,
    options: dict[str, Any],
) -> int:
    """Make a program of each drawing or program that is put into a folder, or changed there; Ctrl-C ends it.

    One that is refused does not stop it. Files that are still being written are waited for.
    """
    from leafcut.cli.watch_folder import FolderWatch
    from leafcut.order.executors import open_executor
    from leafcut.report.wording import count, time_words
    from leafcut.units import parse_quantity

    refuse_dash("watch", *sources)
    refuse_dash("-o", output)
    refuse_dash("--options", options_file)
    if len(sources) != 1:
        raise OptionError(f"watch takes one folder; {len(sources)} were given")
    seconds = parse_quantity(every, "s")
    if not 0.1 <= seconds <= 3600.0:
        raise OptionError("--every: choose 0.1s to 1h")
    _check_workers(workers)
    asked = _given(options)
    _check_one_file(asked, "a folder has many programs")
    given = {"process": process, "options_file": options_file, "defaults_file": _defaults(no_defaults), **asked}
    numbers = {"written": 0, "refused": 0}

    def written(row: BatchRow) -> None:
        numbers["written"] += 1
        worst = f"; the worst of {count(row.issues, 'remark')}: {row.worst}" if row.issues else ""
        if not quiet:
            name = "".join(c if c.isprintable() else "?" for c in f"{row.input}: {row.program}")
            print(f"{name}, {time_words(float(row.after_s or 'nan'))}{worst}", flush=True)

    def refused(line: str) -> None:
        numbers["refused"] += 1
        _tell(line)

    # What is being worked on when it is ended is given up; it is done when the folder is watched again.
    with suppress(KeyboardInterrupt), open_executor(executor, workers or 0) as opened:
        watch = FolderWatch(Path(sources[0]), Path(output), given, opened, written, refused)
        watch.check()
        if not quiet:
            print(f"watching {sources[0]}; Ctrl-C ends it", flush=True)
        watch.run(seconds)
    if not quiet:
        print(f"ended; {count(numbers['written'], 'program')} written, {count(numbers['refused'], 'refusal')}")
    return DONE


def _check_workers(workers: int | None) -> None:
    from leafcut.order.executors import MOST_WORKERS

    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise OptionError(f"--workers: choose 1 to {MOST_WORKERS}")


def _tell(line: str) -> None:
    _refuse(line, REFUSED)


def _each(
    noun: str, inputs: Sequence[str], do: Callable[[int, str], tuple[dict[str, Any], int]]
) -> tuple[list[dict[str, Any]], int]:
    """Return the answer of each input with its ``status``, and the worst status; an error is told where it happens."""
    rows: list[dict[str, Any]] = []
    for number, source in enumerate(inputs):
        try:
            answer, status = do(number, source)
        except KeyboardInterrupt:
            _refuse(f"interrupted; {number} of {len(inputs)} inputs were done", REFUSED)
            rows += [{noun: one, "error": "interrupted", "status": REFUSED} for one in inputs[number:]]
            break
        except BrokenPipeError:
            raise
        except Exception as problem:
            line, status = _failure(problem)
            _refuse(line if str(Path(source)) in line else f"{source}: {line}", status)
            answer = {noun: source, "error": line}
        rows.append({**answer, "status": status})
    return rows, max((row["status"] for row in rows), key=_STATUS_ORDER.index)


def _solve(
    instance: Annotated[str, Parameter(name="INSTANCE", help="a TSPLIB file, a point map, or random:200")],
    /,
    *,
    tour: Annotated[File | None, Parameter(name="--tour", help="tour file to write, in TSPLIB format")] = None,
    save_map: Annotated[
        File | None, Parameter(name="--save-map", help="table to write with the points of the map (.csv), mm")
    ] = None,
    as_json: Annotated[
        bool,
        switch(
            "--json",
            help="print the result as JSON; gap_percent is to the best known length (optimum) if the map has one, else "
            "to lower_bound",
        ),
    ] = False,
    no_defaults: NoDefaults = False,
    options: dict[str, Any],
) -> int:
    """Find a short closed tour through the points of a map, or one point of each set, to study the algorithms."""
    from leafcut import api
    from leafcut.files.whole_files import check_output, write_whole
    from leafcut.read.csvmap import points_text
    from leafcut.read.tsplib import tour_text
    from leafcut.report.wording import count, gap_lines

    _check_file("--tour", tour)
    _check_file("--save-map", save_map)
    if save_map and not save_map.lower().endswith(".csv"):
        raise OptionError(f"--save-map {save_map}: a table of points is written; name a file that ends in .csv")
    for file in (tour, save_map):
        check_output(file, [instance, *([tour] if file is save_map else [])])
    with Reporter() as reporter:
        solved = api.solve_file(
            StandardInput.read() if _dashed(instance) == DASH else instance,
            progress=reporter,
            defaults_file=_defaults(no_defaults),
            **_given(options),
        )
    part, found = solved.part, solved.solution
    if tour:
        write_whole(tour, tour_text(part.name, found.nodes, every=part.grouping is None))
    if save_map:
        write_whole(save_map, points_text(part))
    if as_json:
        from leafcut.report.json_answer import solved_as_json

        print_json(solved_as_json(solved))
        return DONE
    sets = "" if part.grouping is None else f" in {count(part.grouping.n_clusters, 'set')}"
    print(f"{part.name}: {count(len(part.holes), 'point')}{sets}, {found.algorithm}, seed {found.seed}")
    print(f"length {found.cost:,.10g}, {count(found.iterations, 'iteration')} in {found.seconds:.2f} s")
    if found.stopped_early and options.get("time_limit") is None:
        print("stopped early; this is the best tour so far")
    for line in gap_lines(found.cost, part.optimum, found.lower_bound):
        print(line)
    _print_defaults(solved.defaults)
    for issue in part.issues[:MOST_WARNINGS]:
        print(f"{issue.code}  {issue.message}{f' ({issue.place})' if issue.place else ''}")
    return DONE


def _nest(
    *parts: Annotated[
        str, Parameter(name="PARTS", help="drawings with quantities, such as bracket.dxf:10, or a parts list (CSV)")
    ],
    output: Annotated[
        File | None,
        Parameter(name=["--output", "-o"], help="nested sheet to write (DXF), - for standard output if it is one"),
    ] = None,
    options_file: OptionsFile = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    quiet: Annotated[
        bool,
        switch("--quiet", "-q", help="no progress, no summary; warnings only"),
    ] = False,
    options: dict[str, Any],
) -> int:
    """Nest parts on sheets, in several variants, and write the best nest as DXF for cutting."""
    from leafcut import api

    refuse_dash("nest", *parts)
    refuse_dash("--options", options_file)
    to_standard_output = _dashed(output) == DASH
    if to_standard_output and as_json:
        raise OptionError("--json and -o - both write to standard output; leave one out")
    file = None if to_standard_output else output
    with _nothing_new_in(file), Reporter(quiet=quiet) as reporter:
        outcome = api.nest(
            [*parts],
            file,
            options_file=options_file,
            defaults_file=_defaults(no_defaults),
            progress=reporter,
            **_given(options),
        )
    if to_standard_output:
        drawings = [drawing for variant in outcome.drawings for drawing in variant]
        if len(drawings) != 1:
            raise OptionError(f"-o -: the nest is {len(drawings)} drawings, and one alone can go there; name a file")
        _write_out(drawings[0].encode())
        outcome = replace(outcome, files=(("standard output",),))
    if as_json:
        print_json(registry.command("nest_answer")(outcome))
    elif quiet:
        _warn(outcome.issues)
    else:
        from rich.console import Console

        registry.command("nest_summary")(outcome, Console(stderr=to_standard_output))
    return INCOMPLETE if outcome.missing else DONE


def _simulate(
    *programs: Annotated[
        str,
        Parameter(name="PROGRAM", help="a G-code program; - for standard input; several, or a pattern with * and ?"),
    ],
    dialect: Annotated[
        str | None,
        Parameter(name="--dialect", help="dialect of the program, by name or TOML file (default: the machine's)"),
    ] = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Show the machine time and travel of a program, and any dangerous moves."""
    from leafcut import api
    from leafcut.report.json_answer import simulation_as_json

    inputs, each = expanded([*map(_dashed, programs)], "simulate")
    given = {"dialect": dialect, "defaults_file": _defaults(no_defaults), **_given(options)}

    def simulated(program: str) -> tuple[Simulation, int]:
        found = api.simulate(StandardInput.read() if program == DASH else program, **given)
        dangerous = any(issue.severity == "danger" for issue in found.issues)
        return found, REFUSED if dangerous and options.get("strict") else DONE

    def do(_: int, program: str) -> tuple[dict[str, Any], int]:
        found, status = simulated(program)
        return simulation_as_json(found), status

    if each:
        rows, status = _each("program", inputs, do)
        if as_json:
            from leafcut.report.several import several_as_json

            print_json(several_as_json(rows, status))
        else:
            from rich.console import Console

            from leafcut.report.several import print_simulated

            print_simulated(rows, Console())
        return status
    found, status = simulated(inputs[0])
    if as_json:
        print_json(simulation_as_json(found))
    else:
        _print_simulated(found)
    return status


def _print_simulated(found: Simulation) -> None:
    from leafcut.units import fixed, format_length, format_time

    dangers = [issue for issue in found.issues if issue.severity == "danger"]
    for issue in dangers:
        print(f"danger: {issue}")
    cost = found.measure
    print(f"{found.program}: {format_time(cost.time_s)} on {found.machine.name}")
    print(f"rapid {format_length(cost.travel_mm)}, feed {format_length(cost.cut_mm)}")
    print("  ".join(f"{kind} {format_time(s)}" for kind, s in cost.by_kind.items()))
    for axis, low, high in zip("XYZ", *found.path.extents, strict=True):
        print(f"{axis} {fixed(low, 3)} to {fixed(high, 3)} mm")
    for issue in found.issues:
        if issue not in dangers:
            print(f"{issue.severity}: {issue}")
    _print_defaults(found.defaults)


def _stock(
    program: Annotated[str, Parameter(name="PROGRAM", help="a G-code program; - for standard input")],
    /,
    *more: Annotated[str, Parameter(show=False)],
    output: Annotated[
        File | None,
        Parameter(
            name=["--output", "-o"], help="what is left, as a picture (.png) or a solid for other programs (.stl)"
        ),
    ] = None,
    same_as: Annotated[
        str | None,
        Parameter(
            name="--same-as", help="another program, which must leave the same of the stock (else exit status 1)"
        ),
    ] = None,
    dialect: Annotated[
        str | None,
        Parameter(name="--dialect", help="dialect of the program, by name or TOML file (default: the machine's)"),
    ] = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Show what a program cuts from its stock: volume, depth, time in the air, rapids and holders that meet it."""
    from leafcut import api
    from leafcut.files.whole_files import check_output, write_bytes
    from leafcut.report.stock_report import as_file, check_name, print_stock, stock_as_json

    if more:
        raise OptionError(f"stock takes one program, not {1 + len(more)}; run them one by one")
    program = _dashed(program)
    refuse_dash("--same-as", same_as)
    _check_file("-o", output)
    check_name(output)
    check_output(
        output, [program if program != DASH else None, same_as, options.get("tools"), options.get("workpiece")]
    )
    source = StandardInput.read() if program == DASH else program
    with _nothing_new_in(output):
        found = api.cut_stock(
            source, same_as=same_as, dialect=dialect, defaults_file=_defaults(no_defaults), **_given(options)
        )
    if output:
        write_bytes(output, as_file(found, output))
    if as_json:
        print_json(stock_as_json(found, output))
    else:
        from rich.console import Console

        print_stock(found, output, Console())
        _print_defaults(found.defaults)
    dangers = bool(found.rapids or found.collisions)
    return REFUSED if found.differences or (dangers and options.get("strict")) else DONE


def _cutting_data(
    drawing: Annotated[
        str | None,
        Parameter(name="DRAWING", help="a drawing with the holes; without one --holes and --depth say what is drilled"),
    ] = None,
    /,
    *more: Annotated[str, Parameter(show=False)],
    objective: Annotated[
        str, Parameter(name="--objective", help="what the speeds are chosen for [time, cost, life]")
    ] = "cost",
    save: Annotated[
        str | None,
        Parameter(name="--save", help="tool library to write, a copy of --tools with the chosen speeds (.toml)"),
    ] = None,
    plot: Annotated[File | None, Parameter(name="--plot", help="picture of the fronts to write (.svg)")] = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Choose spindle speeds and feeds: all that no others are better than in time, cost and tool life of a part."""
    from leafcut import api
    from leafcut.report.cutting_data_report import cutting_data_as_json, print_cutting_data

    if more:
        raise OptionError(f"cutting-data takes one drawing, not {1 + len(more)}; run them one by one")
    _check_file("--save", save)
    _check_file("--plot", plot)
    source = StandardInput.read() if _dashed(drawing) == DASH else drawing
    with _nothing_new_in(save), Reporter(quiet=as_json) as reporter:
        found = api.cutting_data(
            source,
            objective=objective,
            save=save,
            plot=plot,
            progress=reporter,
            defaults_file=_defaults(no_defaults),
            **_given(options),
        )
    if as_json:
        print_json(cutting_data_as_json(found, save, plot))
    else:
        from rich.console import Console

        print_cutting_data(found, save, plot, Console())
        _print_defaults(found.defaults)
    return DONE


def _print_defaults(told: Sequence[str]) -> None:
    if told:
        print(f"from your defaults file: {', '.join(told)}")


def _verify(
    original: Annotated[str, Parameter(name="ORIGINAL", help="the reference program")],
    new: Annotated[str, Parameter(name="NEW", help="the program to check against it")],
    /,
    *more: Annotated[str, Parameter(show=False)],
    dialect: Annotated[
        str | None,
        Parameter(name="--dialect", help="dialect of both programs, by name or TOML file (default: the machine's)"),
    ] = None,
    allow_reverse: Annotated[
        bool,
        switch(
            "--allow-reverse",
            help="accept open cuts of constant depth that run from the other end",
        ),
    ] = False,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Check that two programs do the same work, to 0.002 mm, or show where they differ."""
    from leafcut import api

    if more:
        raise OptionError(
            f"verify compares two programs, but {len(more) + 2} were given; give the original and the new one"
        )
    if _dashed(original) == _dashed(new) == DASH:
        raise OptionError("verify: only one of the two programs can come from standard input")
    first, other = (StandardInput.read() if _dashed(word) == DASH else word for word in (original, new))
    proof = api.verify_programs(
        first,
        other,
        dialect=dialect,
        allow_reverse=allow_reverse,
        defaults_file=_defaults(no_defaults),
        **_given(options),
    )
    if as_json:
        from leafcut.report.json_answer import verification_as_json

        print_json(verification_as_json(proof))
    else:
        turned = proof.reversed_cuts
        if proof.same:
            print("the same work" + (f", {count_of(turned, 'cut')} reversed" if turned else ""))
        for difference in proof.differences:
            print(difference)
        for note in proof.notes:
            print(f"note: {note}")
    return DONE if proof.same else REFUSED


def _machines(
    *,
    show: Annotated[
        str | None,
        Parameter(name="--show", help="print the profile of this machine, to save and edit: > my.toml"),
    ] = None,
    as_json: Json = False,
) -> int:
    """List the known machines, or print the profile of one with its keys explained."""
    from leafcut.read.machine import load_machine, machine_list, machine_template

    if show is not None:
        text = machine_template(show)
        if as_json:
            print_json({"name": load_machine(show).name, "profile": text})
        else:
            print(text, end="")
        return DONE
    return _list("machines", machine_list(), as_json)


def _materials(
    *,
    show: Annotated[
        str | None,
        Parameter(name="--show", help="print the file of this material, with its sources, to save and edit: > my.toml"),
    ] = None,
    as_json: Json = False,
) -> int:
    """List the materials that cutting data is known for, or print the file of one with its sources."""
    from leafcut.read.work_materials import load_material, material_list, material_text

    if show is None:
        return _list("materials", material_list(), as_json)
    text = material_text(show)
    if as_json:
        print_json({"name": load_material(show).name, "material": text})
    else:
        print(text, end="")
    return DONE


def _dialects(
    *,
    show: Annotated[
        str | None,
        Parameter(name="--show", help="print the file of this shipped dialect, to be saved and changed: > my.toml"),
    ] = None,
    as_json: Json = False,
) -> int:
    """List the dialects that programs are written in, or print the file of one."""
    from leafcut.gcode.dialects import dialect_list, dialect_template

    if show is None:
        return _list("dialects", dialect_list(), as_json)
    text = dialect_template(show)
    if as_json:
        print_json({"name": show, "dialect": text})
    else:
        print(text, end="")
    return DONE


def _algorithms(*, as_json: Json = False) -> int:
    """List the search algorithms."""
    from leafcut import api

    return _list("algorithms", list(api.algorithms().items()), as_json)


def _formats(*, as_json: Json = False) -> int:
    """List the file formats that leafcut reads."""
    from leafcut.read import formats

    return _list("formats", [(f.name, f"{' '.join(f.extensions)}  {f.help}".strip()) for f in formats()], as_json)


def _plugins(*, as_json: Json = False) -> int:
    """List the plug-ins of installed packages, and why any of them cannot be used."""
    from leafcut import api

    rows = api.plugins()
    if not rows and not as_json:
        print("no plug-ins installed")
        return DONE
    return _list("plugins", rows, as_json)


def _studio(
    *,
    port: Annotated[
        str | None, Parameter(name="--port", help="port to listen on (default: 8173, or the next free one)")
    ] = None,
    no_open: Annotated[
        bool,
        switch("--no-open", help="print the address, do not open a browser"),
    ] = False,
) -> int:
    """Open the studio in your browser: open, see, run, compare, download. For use on this computer only."""
    from leafcut.studio.server import app as studio

    studio.serve(None if port is None else studio.parse_port(port), open_page=not no_open)
    return DONE


def _list(noun: str, rows: list[tuple[str, str]], as_json: bool) -> int:
    """Print the names and descriptions of some things; `noun` is their key in the JSON answer."""
    if as_json:
        print_json({noun: [{"name": name, "description": text} for name, text in rows]})
        return DONE
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        print(f"{name:{width}}  {text}")
    return DONE


def _given(options: dict[str, Any]) -> dict[str, Any]:
    return {name: _dashed(value) for name, value in options.items() if value is not None}


def _check_file(flag: str, name: str | None) -> None:
    """Refuse standard output where no program is written."""
    if _dashed(name) == DASH:
        raise OptionError(f"{flag} -: only a program can go to standard output; name a file")


def _dashed(word: Any) -> Any:
    """Return a word of the command line as it was typed."""
    return DASH if word == HELD else word


def _defaults(left_out: bool) -> Path | None:
    """Return the file of the person's own defaults, unless they are left out or there is none."""
    return None if left_out else defaults_file()


def _write_out(data: bytes) -> None:
    """Write a program to standard output as it is, whatever the terminal's letters are."""
    sys.stdout.flush()
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


#: Commands without options of the option groups.
_WITHOUT_OPTIONS: dict[str, Callable[..., int]] = {
    "machines": _machines, "materials": _materials, "dialects": _dialects, "algorithms": _algorithms,
    "formats": _formats, "plugins": _plugins, "studio": _studio,
}  # fmt: skip
