"""The commands `leafcut machine` and `leafcut tools import`, which create profiles and libraries from existing
files.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from leafcut.cli.flags import Acceleration, File, Json, Lengths, Name, Rpm, Speed, Time
from leafcut.cli.shared import print_json
from leafcut.cli.usage import DASH, HELD, refuse_standard_input
from leafcut.errors import OptionError, count_of
from leafcut.files.whole_files import StandardInput, check_output, write_whole
from leafcut.message import Message

if TYPE_CHECKING:
    from leafcut.read.controllers.importing import ImportedMachine
    from leafcut.timing.fitting import MachineFit

_Output = Annotated[
    File | None, Parameter(name=["--output", "-o"], help="profile to write (.toml); by default, the profile is printed")
]
_Units = Annotated[
    Name | None, Parameter(name="--units", help="unit of lengths, mm or in, if the file does not state it")
]


def import_machine(
    file: Annotated[
        str | None,
        Parameter(
            name="FILE",
            help="settings of a controller: GRBL ($$) and Marlin (M503) as saved text, LinuxCNC .ini, Mach3 .xml, "
            "Mach4 Machine.ini, FluidNC .yaml, RepRapFirmware config.g; - for standard input",
        ),
    ] = None,
    /,
    *,
    port: Annotated[
        Name | None,
        Parameter(
            name="--port", help="serial port of a GRBL, grblHAL, FluidNC or Marlin board to query, instead of a file"
        ),
    ] = None,
    baud: Annotated[int | None, Parameter(name="--baud", help="baud rate of the port (default: 115200)")] = None,
    output: _Output = None,
    kind: Annotated[
        Name | None, Parameter(name="--kind", help="kind of settings (default: recognised from the content)")
    ] = None,
    units: _Units = None,
    as_json: Json = False,
) -> int:
    """Make a machine profile from the settings of its controller; each value is shown with its source."""
    from leafcut.read.controllers.importing import decode_settings, load_settings_text, machine_from_settings

    if file is not None and port is not None:
        raise OptionError("machine import takes FILE or --port, not both")
    if file is not None and baud is not None:
        raise OptionError("--baud goes with --port; leave it out for a file")
    name: str | None = DASH if file == HELD else file
    settings_kind: str | None = kind
    _check_output(output, [name])
    if port is not None:
        settings_kind, text = _query_board(port, baud, kind)
        name = f"{settings_kind}-board"  # a port such as ttyUSB0 does not name a machine
    elif name is None:
        raise OptionError("machine import needs FILE, or --port")
    elif name == DASH:
        text, name = decode_settings(StandardInput.read().data, "standard input"), "standard input"
    else:
        text = load_settings_text(name)
    _write_or_print(machine_from_settings(text, name, settings_kind, units), output, as_json=as_json)
    return 0


def _query_board(port: str, baud: int | None, kind: str | None) -> tuple[str, str]:
    from leafcut.sender.firmware import query_settings
    from leafcut.sender.port import BAUD, SerialPort

    with closing(SerialPort(port, BAUD if baud is None else baud)) as line:
        return query_settings(line, kind)


def new_machine(
    *,
    output: _Output = None,
    answers: Annotated[
        File | None, Parameter(name="--answers", help="a TOML file of answers, with the names of the flags as keys")
    ] = None,
    base: Annotated[
        Name | None,
        Parameter(
            name="--base",
            help="a profile to complete, such as an imported profile; leafcut asks only for its estimated values",
        ),
    ] = None,
    name: Annotated[Name | None, Parameter(name="--name", help="name of the machine")] = None,
    controller: Annotated[
        Name | None, Parameter(name="--controller", help="haas, centroid, or another name from `leafcut list dialects`")
    ] = None,
    process: Annotated[
        Name | None, Parameter(name="--process", help="head: spindle, torch, laser, flame or water")
    ] = None,
    units: Annotated[
        Name | None, Parameter(name="--units", help="units of a program that does not state them: mm or in")
    ] = None,
    rapid: Annotated[
        Speed | None, Parameter(name="--rapid", help="speed of rapids: one value, or x,y,z, such as 1000ipm")
    ] = None,
    acceleration: Annotated[
        Acceleration | None,
        Parameter(
            name="--acceleration",
            help="acceleration: one value, or x,y,z, such as 0.25g (default: that of a similar machine)",
        ),
    ] = None,
    travel: Annotated[
        Lengths | None,
        Parameter(name="--travel", help="travel of x,y,z, such as 30in,16in,20in (default: unknown, not checked)"),
    ] = None,
    max_feed: Annotated[
        Speed | None, Parameter(name="--max-feed", help="highest feed rate (default: the speed of rapids)")
    ] = None,
    spindle_speed: Annotated[
        Rpm | None, Parameter(name="--spindle-speed", help="highest spindle speed (default: that of a similar machine)")
    ] = None,
    tool_changer: Annotated[
        Name | None, Parameter(name="--tool-changer", help="whether the machine changes tools: yes or no")
    ] = None,
    tool_change_time: Annotated[
        Time | None, Parameter(name="--tool-change-time", help="duration of a tool change")
    ] = None,
    as_json: Json = False,
) -> int:
    """Make a machine profile by a few questions, for controllers that have no file of settings (Haas, Centroid …).

    On a terminal, values that are not given by a flag or by --answers are asked, with a suggestion. Otherwise the
    suggestion is used, and shown.
    """
    from leafcut.read.controllers.questions import load_answers, machine_from_answers

    refuse_standard_input("--answers", answers)
    refuse_standard_input("--base", base)
    files = [answers, base if base and base.lower().endswith(".toml") else None]
    _check_output(output, files)
    given: dict[str, Any] = {}
    places: dict[str, str] = {}
    if answers is not None:
        given, places = load_answers(Path(answers))
    flags = {
        "name": name,
        "controller": controller,
        "process": process,
        "units": units,
        "rapid": rapid,
        "acceleration": acceleration,
        "travel": travel,
        "max-feed": max_feed,
        "spindle-speed": spindle_speed,
        "tool-changer": tool_changer,
        "tool-change-time": tool_change_time,
    }
    typed = {key: value for key, value in flags.items() if value is not None}
    given |= typed
    places = {key: place for key, place in places.items() if key not in typed}
    terminal = sys.stdin is not None and sys.stdin.isatty() and not as_json
    _write_or_print(machine_from_answers(given, _ask if terminal else None, base, places), output, as_json=as_json)
    return 0


def _ask(question: str, likely: str) -> str:
    print(f"{question}{f' [{likely}]' if likely else ''}: ", end="", file=sys.stderr, flush=True)
    line = sys.stdin.readline()
    if not line:
        print(file=sys.stderr)
        raise OptionError("the answers ended before the questions; no profile was written")
    return line


def check_machine(
    *programs: Annotated[str, Parameter(name="PROGRAM", help="programs that ran on the machine")],
    measured: Annotated[
        list[Time] | None,
        Parameter(
            name="--measured",
            negative="",
            help="measured time of a program, 12:34 or 754s; once for each program, in order",
        ),
    ] = None,
    times: Annotated[
        File | None,
        Parameter(
            name="--times", help="a CSV table with program,seconds in each row, instead of programs and --measured"
        ),
    ] = None,
    machine: Annotated[Name, Parameter(name="--machine", help="the machine, by name or profile file")],
    output: Annotated[File | None, Parameter(name=["--output", "-o"], help="fitted profile to write (.toml)")] = None,
    dialect: Annotated[
        Name | None, Parameter(name="--dialect", help="dialect of the programs (default: the machine's)")
    ] = None,
    units: Annotated[
        Literal["mm", "in"] | None, Parameter(name="--units", help="units of programs that do not state them")
    ] = None,
    as_json: Json = False,
) -> int:
    """Compare leafcut's times with a stop-watch; with several programs, fit accelerations and the corner value."""
    from leafcut import api
    from leafcut.report.fit_report import fit_as_json, print_fit

    refuse_standard_input("machine check", *programs)
    refuse_standard_input("--times", times)
    pairs = _measured_programs(programs, measured or [], times)
    files = [machine if machine.lower().endswith(".toml") else None, times, *(program for program, _ in pairs)]
    _check_output(output, files)
    if output and len(pairs) < 2:
        raise OptionError("-o: one program is not enough to fit a machine profile; time at least two")
    fitted, results = api.check_times(pairs, machine, dialect=dialect, units=units)
    written = ""
    if output and (fitted.acceleration is not None or fitted.corner is not None):
        _write_signed(output, _fitted_profile(machine, fitted, len(pairs), output))
        written = output
    if as_json:
        print_json(fit_as_json(fitted, results, [seconds for _, seconds in pairs], written))
    else:
        from rich.console import Console

        print_fit(fitted, results, [seconds for _, seconds in pairs], Console())
        if written:
            print(f"wrote {written}")
        elif output:
            print(f"{output} was not written: nothing could be fitted")
    return 0 if written or not output else 1


def _fitted_profile(machine: str, fitted: MachineFit, programs: int, output: str) -> str:
    from leafcut.read.controllers.importing import change_profile_values
    from leafcut.read.controllers.values import format_axes

    changes: dict[str, tuple[Any, str]] = {}
    if fitted.acceleration is not None:
        words = f"fitted to {programs} measured programs: {fitted.acceleration:.3g} times that of {machine}"
        numbers = [round(acceleration, 3) for acceleration in fitted.machine.acceleration]
        changes["rapid.acceleration"] = (format_axes(numbers, "mm/s2"), words)
    if fitted.corner is not None:
        value = f"{fitted.machine.corner_deviation:.4g} mm"
        changes["corners.deviation"] = (value, f"fitted to {programs} measured programs")
    return change_profile_values(machine, changes, output)


def _measured_programs(programs: Sequence[str], measured: Sequence[str], times: str | None) -> list[tuple[str, float]]:
    """Return each program with its measured time, s.

    Raises OptionError if the numbers of programs and times differ, a time is invalid, or both a table and programs are
    given.
    """
    from leafcut.read.time_table import parse_stopwatch_time, read_times

    if times is not None:
        if programs or measured:
            raise OptionError(
                "--times: the table already has the programs and their times; leave out other programs and --measured"
            )
        return read_times(times)
    if not programs:
        raise OptionError("machine check needs programs with --measured, or --times")
    if len(programs) != len(measured):
        raise OptionError(
            f"--measured: {count_of(len(measured), 'time')} for {count_of(len(programs), 'program')}; "
            "give one for each, in their order"
        )
    return [
        (program, _parse_measured_time(parse_stopwatch_time, time))
        for program, time in zip(programs, measured, strict=True)
    ]


def _parse_measured_time(parse: Any, time: str) -> float:
    try:
        return float(parse(time))
    except OptionError as problem:
        raise OptionError(f"--measured: {problem}; write it as 12:34 or 754s") from None


def import_tools(
    file: Annotated[
        str,
        Parameter(
            name="FILE",
            help="a tool library: LinuxCNC .tbl, Fusion .json, .tools or .csv, FreeCAD .fctl or .fctb, or a .csv table",
        ),
    ],
    /,
    *,
    output: Annotated[
        File | None,
        Parameter(name=["--output", "-o"], help="library to write (.toml); by default, the library is printed"),
    ] = None,
    units: Annotated[
        Name | None, Parameter(name="--units", help="unit of lengths whose unit the file does not state: mm or in")
    ] = None,
    material: Annotated[
        Name | None, Parameter(name="--material", help="material to cut: selects the preset of each Fusion tool")
    ] = None,
    as_json: Json = False,
) -> int:
    """Convert a tool library of another program; list the tools that leafcut cannot use, with the reason."""
    from leafcut.read.tool_text import convert_library_to_toml

    refuse_standard_input("tools import", file)
    _check_output(output, [file])
    if units not in ("mm", "in", "", None):
        raise OptionError(f"--units: '{units}' is not mm or in")
    text, library = convert_library_to_toml(file, units or "", material or "")
    if output:
        _write_signed(output, text)
    if as_json:
        answer = {"tools": len(library.tools), "left_out": list(library.left_out), "output": output or ""}
        print_json(answer if output else {**answer, "library": text})
        return 0
    if not output:
        print(text, end="")
    stream = sys.stdout if output else sys.stderr
    for line in library.left_out:
        print(Message("left out: {}", line), file=stream)
    if output:
        print(f"wrote {output}: {count_of(len(library.tools), 'tool')}")
    return 0


def _check_output(output: str | None, inputs: Sequence[str | None]) -> None:
    from leafcut.cli.several import refuse_foreign_file

    if output in (DASH, HELD):
        raise OptionError("-o -: the result is printed if you leave out -o; name a file, or leave it out")
    if output is not None and not output.lower().endswith(".toml"):
        raise OptionError(f"-o {output}: a profile or library is TOML; name a file that ends in .toml")
    check_output(output, [source for source in inputs if source not in (None, DASH)])
    refuse_foreign_file(output, ())


def _write_signed(output: str, text: str) -> None:
    """Write a profile or library with a digest, so that hand edits are never replaced."""
    from leafcut.files.digests import DIGEST_LINE, fill_in_digest

    write_whole(output, fill_in_digest(f"# {DIGEST_LINE}\n{text}"))


def _write_or_print(imported: ImportedMachine, output: str | None, *, as_json: bool) -> None:
    if output:
        _write_signed(output, imported.text)
    if as_json:
        print_json(_imported_as_json(imported, output))
        return
    if not output:
        print(imported.text, end="")
        for note in imported.notes:
            print(f"note: {note}", file=sys.stderr)
        return
    _print_imported_values(imported)
    print(f"wrote {output}; use it with --machine {output}")


def _imported_as_json(imported: ImportedMachine, output: str | None) -> Mapping[str, Any]:
    values = [{"key": v.key, "value": v.value, "how": v.how.value, "source": v.source} for v in imported.values]
    answer = {
        "kind": imported.kind,
        "title": imported.title,
        "name": imported.machine.name,
        "values": values,
        "notes": [*imported.notes],
    }
    return {**answer, "output": output} if output else {**answer, "output": "", "profile": imported.text}


def _print_imported_values(imported: ImportedMachine) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table("Key", "Value", "", "From", title=imported.title, box=None, pad_edge=False, title_justify="left")
    for v in sorted(imported.values, key=lambda v: v.how.value == "assumed"):
        words = ", ".join(map(str, v.value)) if isinstance(v.value, list) else str(v.value)
        table.add_row(v.key, words.replace("True", "true").replace("False", "false"), v.how.value, v.source)
    console.print(table, markup=False)
    for note in imported.notes:
        console.print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
