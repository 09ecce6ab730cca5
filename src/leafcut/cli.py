"""The command line: options become flags, one command calls one function of `api`."""

from __future__ import annotations

import gc
import io
import json
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

from leafcut import __version__
from leafcut.errors import LeafcutError, OptionError
from leafcut.flags import command_of
from leafcut.options import used_by
from leafcut.progress import Reporter

DONE, REFUSED, USAGE, INCOMPLETE = 0, 1, 2, 3
_WORST_FIRST = ("danger", "missing", "warning")

#: New objects between two looks for garbage: what is imported and compiled stays, and looking takes a tenth of a start.
LITTER = 100_000

#: So many warnings are said where they are not asked for.
MOST_WARNINGS = 10

#: The switch that every command which answers has.
Json = Annotated[bool, Parameter(name="--json", negative="", help="answer in JSON")]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status: 0 done, 1 refused, 2 wrong usage."""
    gc.set_threshold(LITTER)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without "→" shows "?", it does not stop the work
    sys.exit(run(sys.argv[1:] if arguments is None else list(arguments)))


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit status; errors are one line on standard error."""
    try:
        status = app()(arguments, exit_on_error=False, print_error=False)
        return int(status or DONE)
    except CycloptsError as problem:
        return _refuse(" ".join(str(problem).split()) + " (see leafcut --help)", USAGE)
    except LeafcutError as problem:
        line = "; ".join([str(problem), *getattr(problem, "__notes__", ())])
        return _refuse(line, USAGE if isinstance(problem, OptionError) else REFUSED)
    except KeyboardInterrupt:
        return _refuse("interrupted; nothing was written", REFUSED)
    except BrokenPipeError:
        # The reader of our output went away, which is its right; keep Python from complaining at exit.
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except MemoryError:
        return _refuse("not enough memory for this input", REFUSED)
    except Exception as problem:  # the last net: no traceback reaches a user
        if os.environ.get("LEAFCUT_TRACEBACK"):
            raise
        text = " ".join(f"{type(problem).__name__}: {problem}".split())
        return _refuse(f"a fault in leafcut itself ({text}); set LEAFCUT_TRACEBACK=1 to see where", REFUSED)


def _warn(issues: Iterable[Any]) -> None:
    """Say on standard error what matters even to somebody who wants no summary: holes lost, depths assumed."""
    told = sorted((i for i in issues if i.severity != "note"), key=lambda i: _WORST_FIRST.index(i.severity))
    lines = list(dict.fromkeys(f"{issue.severity}: {issue}" for issue in told))
    for line in lines[:MOST_WARNINGS]:
        _refuse(line, DONE)
    if len(lines) > MOST_WARNINGS:
        _refuse(f"warning: and {len(lines) - MOST_WARNINGS} more", DONE)


def _refuse(line: str, status: int) -> int:
    shown = "".join(c if c.isprintable() else "?" for c in line)  # names of files may hold anything
    print(f"leafcut: {shown}", file=sys.stderr)
    return status


@contextmanager
def _nothing_new_in(output: str | None) -> Iterator[None]:
    """Let a refusal tell that what an earlier run wrote is still there: it would run on the machine as well."""
    try:
        yield
    except LeafcutError as problem:
        from leafcut.files import OutputError

        if output and Path(output).is_file() and not isinstance(problem, OutputError):
            problem.add_note(f"{output} is as it was before this run")
        raise


def app() -> App:
    """Return the application with its commands; flags are made from the option groups."""
    made = App(
        name="leafcut",
        help="The shortest-time, verified CNC program for a drawing.",
        version=__version__,
        version_flags=["--version"],
        help_format="plaintext",
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    made.command(command_of(_optimize, used_by("drill", "cut", "pocket", "program")), name="optimize")
    made.command(command_of(_solve, used_by("solve")), name="solve")
    made.command(command_of(_nest, used_by("nest")), name="nest")
    made.command(command_of(_simulate, used_by("simulate")), name="simulate")
    made.command(command_of(_verify, used_by("verify")), name="verify")
    made.command(_machines, name="machines")
    made.command(_algorithms, name="algorithms")
    made.command(_formats, name="formats")
    made.command(_studio, name="studio")
    made.register_install_completion_command(help="write a completion script for your shell, and have it read there")
    return made


def _optimize(
    source: Annotated[
        str, Parameter(name="INPUT", help="a drawing, a drill file, a map, a G-code program, or example:plate-70")
    ],
    /,
    *,
    output: Annotated[str | None, Parameter(name=["--output", "-o"], help="the program to write")] = None,
    report: Annotated[str | None, Parameter(name="--report", help="a page with pictures to write")] = None,
    process: Annotated[
        str, Parameter(name="--process", help="what is done [auto, drill, cut, pocket, mill, laser, plasma]")
    ] = "auto",
    options_file: Annotated[str | None, Parameter(name="--options", help="a TOML file of options")] = None,
    as_json: Json = False,
    quiet: Annotated[
        bool, Parameter(name=["--quiet", "-q"], negative="", help="no progress, no summary; warnings only")
    ] = False,
    options: dict[str, Any],
) -> int:
    """Make a verified program with the shortest machine time from a drawing, or from another CAM's program.

    The search ends by itself when its colonies agree; --time-limit and --preset say what it may use at most.
    """
    from leafcut import api

    with _nothing_new_in(output), Reporter(quiet=quiet) as reporter:
        outcome = api.optimize(
            source,
            output,
            report=report,
            process=process,
            options_file=options_file,
            progress=reporter,
            **_given(options),
        )
    if as_json:
        from leafcut.report.json_answer import as_json as answer

        _print_json(answer(outcome))
    elif quiet:
        _warn(outcome.issues)
    else:
        from rich.console import Console

        from leafcut.report.summary import print_summary

        print_summary(outcome, Console())
    return INCOMPLETE if any(issue.severity == "missing" for issue in outcome.issues) else DONE


def _solve(
    instance: Annotated[str, Parameter(name="INSTANCE", help="a TSPLIB file, a map, or random:200")],
    /,
    *,
    tour: Annotated[str | None, Parameter(name="--tour", help="the tour to write, as TSPLIB has it")] = None,
    as_json: Annotated[
        bool,
        Parameter(
            name="--json",
            negative="",
            help="answer in JSON; gap_percent is against the best known length where the map has one (optimum), else "
            "against lower_bound",
        ),
    ] = False,
    options: dict[str, Any],
) -> int:
    """Find a short closed tour through the points of a map, or through sets of them, to study the algorithms."""
    from leafcut import api
    from leafcut.read.tsplib import write_tour
    from leafcut.report.wording import count, gap_lines

    if tour:
        from leafcut.files import check_output

        check_output(tour, [instance])
    with Reporter() as reporter:
        answer, nodes = api.solve_file(instance, progress=reporter, **_given(options))
    if tour:
        write_tour(tour, answer["instance"], nodes, every="clusters" not in answer)
    if as_json:
        _print_json(answer)
        return DONE
    sets = f" in {count(answer['clusters'], 'set')}" if "clusters" in answer else ""
    print(f"{answer['instance']}: {count(answer['n'], 'point')}{sets}, {answer['algorithm']}, seed {answer['seed']}")
    steps = count(answer["iterations"], "iteration")
    print(f"length {answer['length']:,.10g}, {steps} in {answer['seconds']:.2f} s")
    if answer["stopped_early"] and options["time_limit"] is None:
        print("stopped before its end; this is the best so far")
    for line in gap_lines(answer["length"], answer["optimum"], answer["lower_bound"]):
        print(line)
    for issue in answer["issues"][:MOST_WARNINGS]:
        print(f"{issue['code']}  {issue['message']}{' (' + issue['place'] + ')' if issue['place'] else ''}")
    return DONE


def _nest(
    *parts: Annotated[str, Parameter(name="PARTS", help="drawings with quantities, bracket.dxf:10, or a list.csv")],
    output: Annotated[str | None, Parameter(name=["--output", "-o"], help="the nested sheet to write, DXF")] = None,
    options_file: Annotated[str | None, Parameter(name="--options", help="a TOML file of options")] = None,
    as_json: Json = False,
    quiet: Annotated[
        bool, Parameter(name=["--quiet", "-q"], negative="", help="no progress, no summary; warnings only")
    ] = False,
    options: dict[str, Any],
) -> int:
    """Lay parts on sheets, in several variants, and write the best as DXF to be cut."""
    from leafcut import api

    with _nothing_new_in(output), Reporter(quiet=quiet) as reporter:
        outcome = api.nest(parts, output, options_file=options_file, progress=reporter, **_given(options))
    if as_json:
        from leafcut.report.nest_answer import nest_as_json

        _print_json(nest_as_json(outcome))
    elif quiet:
        _warn(outcome.issues)
    else:
        from rich.console import Console

        from leafcut.report.nest_answer import print_nests

        print_nests(outcome, Console())
    return INCOMPLETE if any(issue.severity == "missing" for issue in outcome.issues) else DONE


def _simulate(
    program: Annotated[str, Parameter(name="PROGRAM", help="a G-code program")],
    /,
    *,
    dialect: Annotated[str | None, Parameter(name="--dialect", help="its dialect (default: the machine's)")] = None,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Tell how long a program runs on a machine, how far it moves, and what is dangerous in it."""
    from leafcut import api

    answer = api.simulate(program, dialect=dialect, **_given(options))
    dangers = [issue for issue in answer["issues"] if issue["severity"] == "danger"]
    status = REFUSED if dangers and options.get("strict") else DONE
    if as_json:
        _print_json(answer)
        return status
    from leafcut.units import format_length, format_time

    for issue in dangers:
        print(f"danger: {_said(issue)}")
    print(f"{program}: {format_time(answer['time_s'])} on {answer['machine']}")
    print(f"rapid {format_length(answer['rapid_mm'])}, feed {format_length(answer['feed_mm'])}")
    print("  ".join(f"{kind} {format_time(s)}" for kind, s in answer["by_kind"].items()))
    for axis, (low, high) in answer["extents"].items():
        print(f"{axis.upper()} {low:.3f} to {high:.3f} mm")
    for issue in answer["issues"]:
        if issue not in dangers:
            print(f"{issue['severity']}: {_said(issue)}")
    return status


def _said(issue: dict[str, str]) -> str:
    """Return an issue of a JSON answer in a line."""
    return f"{issue['code']} {issue['message']}" + (f" ({issue['place']})" if issue["place"] else "")


def _verify(
    original: Annotated[str, Parameter(name="ORIGINAL", help="the program that is right")],
    new: Annotated[str, Parameter(name="NEW", help="the program that must do the same work")],
    /,
    *,
    dialect: Annotated[str | None, Parameter(name="--dialect", help="their dialect (default: the machine's)")] = None,
    allow_reverse: Annotated[
        bool,
        Parameter(name="--allow-reverse", negative="", help="open cuts of one depth are the same from either end"),
    ] = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Tell whether two programs do the same work, or where they differ."""
    from leafcut import api

    answer = api.verify_programs(original, new, dialect=dialect, allow_reverse=allow_reverse, **_given(options))
    if as_json:
        _print_json(answer)
    elif answer["same"]:
        turned = answer["reversed_cuts"]
        print("the same work" + (f", {turned} of the cuts from their other end" if turned else ""))
    else:
        for difference in answer["differences"]:
            print(difference["words"])
    return DONE if answer["same"] else REFUSED


def _machines(
    *,
    show: Annotated[
        str | None,
        Parameter(name="--show", help="print the profile of this machine, to be saved and changed: > my.toml"),
    ] = None,
    as_json: Json = False,
) -> int:
    """List the machines that leafcut knows, or print the profile of one with what its keys mean."""
    from leafcut.read.machine import load_machine, machine_names, machine_template

    if show is not None:
        text = machine_template(show)
        if as_json:
            _print_json({"name": load_machine(show).name, "profile": text})
        else:
            print(text, end="")
        return DONE
    machines = [load_machine(name) for name in machine_names()]
    return _list([(m.name, f"{m.description} ({m.controller})") for m in machines], as_json)


def _algorithms(*, as_json: Json = False) -> int:
    """List the algorithms that order the work."""
    from leafcut.options import ALGORITHM_TITLES

    return _list(list(ALGORITHM_TITLES.items()), as_json)


def _formats(*, as_json: Json = False) -> int:
    """List the kinds of file that leafcut reads."""
    from leafcut.read import formats

    return _list([(f.name, f"{' '.join(f.extensions)}  {f.help}".strip()) for f in formats()], as_json)


def _studio(
    *,
    port: Annotated[str | None, Parameter(name="--port", help="where it listens (default: 8173 or the next)")] = None,
    no_open: Annotated[bool, Parameter(name="--no-open", negative="", help="print the address only")] = False,
) -> int:
    """Open the studio, a page in your browser: open, see, run, compare, download. For this machine alone."""
    from leafcut.studio import app as studio

    studio.serve(None if port is None else studio.parse_port(port), open_page=not no_open)
    return DONE


def _list(rows: list[tuple[str, str]], as_json: bool) -> int:
    if as_json:
        _print_json([{"name": name, "description": text} for name, text in rows])
        return DONE
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        print(f"{name:{width}}  {text}")
    return DONE


def _given(options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _print_json(answer: Any) -> None:
    print(json.dumps(answer, allow_nan=False, indent=2, ensure_ascii=False))


if __name__ == "__main__":
    main()
