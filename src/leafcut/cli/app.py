"""Build the command line: commands, flags, and errors in one line each."""

from __future__ import annotations

import io
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Group, Parameter

from leafcut._version import __version__
from leafcut.cli.flags import File, Name, add_option_flags, print_help_panel, usage_line
from leafcut.cli.shared import (
    DONE,
    REFUSED,
    STATUSES,
    USAGE,
    error_line_and_status,
    print_error_line,
    print_json,
    printable,
)
from leafcut.cli.usage import DASH, GROUPS, HELD, command_name, usage_message
from leafcut.errors import OptionError
from leafcut.options.settings import Settings
from leafcut.processes import registry
from leafcut.processes.base import Process, Work
from leafcut.processes.settings import all_options, options_used_by, unused_option_message

#: Flag that shows all options of a command.
HELP_ALL = "--help-all"
#: Command of an earlier version → its replacement.
REPLACED = {
    "batch": "leafcut optimize FOLDER -o OUT",
    "watch": "leafcut optimize FOLDER --watch -o OUT",
    "machines": "leafcut list machines [NAME]",
    "materials": "leafcut list materials [NAME]",
    "dialects": "leafcut list dialects [NAME]",
    "formats": "leafcut list formats",
    "algorithms": "leafcut list algorithms",
    "plugins": "leafcut list plugins",
    "addon": "leafcut install addon NAME FOLDER",
    "completion": "leafcut install completion SHELL",
    "warm-up": "leafcut install kernels",
    "cutting-data": "leafcut tools speeds",
}
#: Word that users mistake for a command → command to type.
_MEANT = {
    "help": "leafcut --help, or leafcut COMMAND --help",
    "mill": "leafcut pocket DRAWING, or leafcut reorder PROGRAM",
}
EXAMPLES = """Examples:

leafcut plate.dxf --thickness 6 --machine haas-vf2

leafcut reorder program.nc -o shorter.nc"""

_EVERY_INPUT = (
    "a drawing, a drill file, a point map, a G-code program, or example:plate-70; several drill files make one program"
)
#: Command → example at the end of its help.
_EXAMPLE_OF = {
    "drill": "leafcut drill plate.dxf --thickness 6 --machine haas-vf2 -o plate.nc",
    "cut": "leafcut cut sheet.dxf --material mild-steel --thickness 6 -o sheet.ngc",
    "pocket": "leafcut pocket pocket.dxf --depth 5 --tool-diameter 6 -o pocket.ngc",
    "part": "leafcut part bracket.dxf --thickness 3 --tool-diameter 3 -o bracket.ngc",
    "reorder": "leafcut reorder program.nc -o shorter.nc",
    "nest": "leafcut nest bracket.dxf:10 gusset.svg:4 --sheet 800x500 -o nested.dxf",
    "simulate": "leafcut simulate program.nc --machine haas-vf2",
    "stock": "leafcut stock program.nc --tool-diameter 6 -o stock.png",
    "verify": "leafcut verify program.nc shorter.nc",
}
#: Main options of commands whose help does not follow a form of the studio.
_MAIN = {
    "solve": ("algorithm", "preset", "time_limit", "seed", "threads"),
    "tools speeds": ("material", "tools", "depth", "thickness", "machine", "shop_rate"),
}

#: The flag --report of processes that have no table of parts.
_PAGE = Annotated[
    File | None,
    Parameter(name="--report", help="report page to write (HTML); for several inputs, a folder"),
]

#: The groups of commands in the help, in their order.
_MAKE, _CHECK, _USE, _SET_UP, _STUDY = (
    Group(name, sort_key=k)
    for k, name in enumerate(
        ("Make a program", "Check a program", "See and run", "Set up and look up", "Study algorithms"), 1
    )
)
_GROUP_OF = {
    "simulate": _CHECK, "verify": _CHECK, "stock": _CHECK, "studio": _USE, "send": _USE, "machine": _SET_UP,
    "tools": _SET_UP, "list": _SET_UP, "install": _SET_UP, "defaults": _SET_UP, "solve": _STUDY, "lab": _STUDY,
}  # fmt: skip
#: Commands that use no option groups, and their functions.
_SIMPLE = {
    "studio": "leafcut.cli.studio:open_studio",
    "send": "leafcut.cli.send:send",
    "list": "leafcut.cli.listing:list_known",
    "defaults": "leafcut.cli.defaults:show_defaults",
}
_OPTIMIZE = "leafcut.cli.programs:optimize"
#: Other commands with options of the option groups: function, kind of work, and further arguments of
#: `add_option_flags`.
_WORKING: dict[str, tuple[str, str, dict[str, Any]]] = {
    "filter": ("leafcut.cli.programs:filter_program", "", {}),
    "nest": ("leafcut.cli.programs:nest", "nest", {}),
    "simulate": ("leafcut.cli.checks:simulate", "simulate", {}),
    "stock": ("leafcut.cli.checks:stock", "stock", {}),
    "verify": ("leafcut.cli.checks:verify", "verify", {}),
    "solve": ("leafcut.cli.study:solve", "solve", {"first": _MAIN["solve"]}),
    "tools speeds": (
        GROUPS["tools"][1]["speeds"], "cutting-data", {"first": _MAIN["tools speeds"]},
    ),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its status (`STATUSES`)."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without "→" shows "?" instead of raising an error
    warnings.formatwarning = _warning_line  # type: ignore[assignment]
    status = run(sys.argv[1:] if arguments is None else list(arguments))
    sys.exit(status)


def _warning_line(message: Warning | str, *_: object) -> str:
    """Return a warning as one line, without the source location that Python adds."""
    return f"leafcut: {message}\n"


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit status; errors are one line on standard error."""
    try:
        return _run_command(arguments)
    except KeyboardInterrupt:
        return _print_error(arguments, "interrupted; nothing was written", REFUSED)
    except BrokenPipeError:
        # The reader of our output has closed it; prevent Python's message at exit.
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as problem:  # no traceback reaches a user
        return _print_error(() if getattr(problem, "answered", False) else arguments, *error_line_and_status(problem))


def _run_command(arguments: Sequence[str]) -> int:
    words = _insert_optimize(arguments)
    masked = [HELD if word == DASH else word for word in words]
    masked = ["--help" if word == HELP_ALL else word for word in masked]
    try:
        return int(build_app(words)(masked, exit_on_error=False, print_error=False) or DONE)
    except CycloptsError as problem:
        return _print_error(words, _usage_message(problem, command_name(words)), USAGE)


def _insert_optimize(arguments: Sequence[str]) -> list[str]:
    """Return the words of a command line, with `optimize` inserted before a file.

    Raises OptionError for a command that was replaced or never existed.
    """
    words = [*arguments]
    first = words[0] if words else ""
    if first in REPLACED:
        raise OptionError(f"'leafcut {first}' was replaced; enter: {REPLACED[first]}")
    if first in _MEANT and not Path(first).exists():
        raise OptionError(f"there is no command '{first}'; type: {_MEANT[first]}")
    is_command = first in _command_names() or first.startswith("-") or not first
    if not is_command and (Path(first).exists() or re.search(r"[.:*?/\\]", first)):
        words.insert(0, "optimize")
    return words


def _command_names() -> list[str]:
    working = [name for name in _option_command_names() if " " not in name]
    return [*working, *_SIMPLE, *GROUPS]


def _usage_message(problem: CycloptsError, command: str) -> str:
    kinds = _option_command_parts(command)[1] if command in _option_command_names() else []

    def reason_unused(flag: str, name: str) -> str:
        if not kinds or any(name == used for _, used, _ in options_used_by(*kinds)):
            return ""
        title, alternative = (kinds[0].title, kinds[0].otherwise.get(name, "")) if len(kinds) == 1 else (command, "")
        return f"{flag}: {unused_option_message(name, title, alternative)}"

    names = [name for name in _command_names() if name != "filter"]
    return usage_message(problem, command, names, {name: spec for _, name, spec in all_options()}, reason_unused)


def _print_error(arguments: Sequence[str], line: str, status: int) -> int:
    """Print an error line and return the status; with --json, also print an object, unless standard output has the
    program.
    """
    program = re.search(r"(^| )(-o|--output)[ =]-( |$)", " ".join(arguments))
    if "--json" in arguments and not program:
        print_json({"error": printable(line)})
    return print_error_line(line, status)


def build_app(arguments: Sequence[str] = ()) -> App:
    """Return the application. A command line limits the generated flags to its command, which saves time."""
    application = App(
        name="leafcut",
        help="Make the verified CNC program that needs the least machine time, from a drawing or another program.\n\n"
        f"leafcut FILE does the same as leafcut optimize FILE. {STATUSES}",
        help_epilogue=EXAMPLES,
        usage="leafcut COMMAND [--help] | leafcut FILE",
        group_commands=Group("Options", sort_key=9),
        # No option has parts such as --tool.diameter. To look for them takes a third of the time.
        default_parameter=Parameter(accepts_keys=False),
        version=__version__,
        version_flags=["--version"],
        help_format="plaintext",
        help_formatter=print_help_panel,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    asked = command_name(arguments)
    show_all = HELP_ALL in arguments
    for name, (help_text, commands) in GROUPS.items():
        application.command(
            App(name=name, help=help_text, help_format="plaintext", help_epilogue="", group=_GROUP_OF[name])
        )
        for subcommand, place in commands.items() if not arguments or asked.partition(" ")[0] == name else ():
            if f"{name} {subcommand}" not in _WORKING:
                _add_command(application, f"{name} {subcommand}", resolve_name(place))
    for name, place in _SIMPLE.items():
        if not arguments or asked in ("", name):
            _add_command(application, name, resolve_name(place))
    for name in _option_command_names():
        if not arguments or f"{name} ".startswith(f"{asked} ".lstrip()):
            try:
                function, kinds, special = _option_command_parts(name)
            except OptionError:  # a plug-in that cannot be used
                if asked == name:
                    raise
                continue
            options = options_used_by(*kinds) if not arguments or asked == name else ()
            command = add_option_flags(function, options, all_shown=show_all or not arguments, **special)
            hidden = bool(special.get("first")) and not show_all
            _add_command(
                application,
                name,
                command,
                special.get("help"),
                f"leafcut {name} --help-all shows all options." * hidden,
            )
    return application


def _add_command(
    application: App, name: str, command: Callable[..., int], help: str | None = None, epilogue: str = ""
) -> None:
    *parent, last = name.split()
    parent_app = application[parent[0]] if parent else application
    shown: dict[str, Any] = {} if parent else {"group": _GROUP_OF.get(name, _MAKE), "show": name != "filter"}
    example = f"Example: {_EXAMPLE_OF[name]}" if name in _EXAMPLE_OF else ""
    epilogue = "\n\n".join(filter(None, (example, epilogue)))
    parent_app.command(command, last, help=help, help_epilogue=epilogue, usage=usage_line(name, command), **shown)


def _option_command_names() -> tuple[str, ...]:
    return ("optimize", *registry.process_commands(), *_WORKING)


def _option_command_parts(name: str) -> tuple[Callable[..., int], Sequence[Work], dict[str, Any]]:
    if name in ("optimize", "filter"):
        kinds = list(registry.processes())
        annotations = {
            "process": _process_parameter("process", registry.all_process_values()),
            "sources": _input_parameter(_EVERY_INPUT),
        }
        if name == "optimize":
            first = registry.process("drill").form[0][1]
            return resolve_name(_OPTIMIZE), kinds, {
                "annotations": annotations, "fixed": {"command": "optimize"}, "first": first,
            }  # fmt: skip
        file = Annotated[str, Parameter(name="FILE", help="a drawing, a drill file or a program")]
        return resolve_name(_WORKING[name][0]), kinds, {"annotations": {**annotations, "sources": file}}
    if name in _WORKING:
        place, name_of_work, special = _WORKING[name]
        work = registry.work(name_of_work)
        main = {"first": work.form[0][1]} if name == "nest" else {}
        special = {**main, **special, "help": work.help or None, "helps": partial(_replaced_help_texts, work)}
        return resolve_name(place), [work], special
    process = registry.process_of_command(name)
    assert process is not None
    return _process_command_parts(process)


def _process_command_parts(process: Process) -> tuple[Callable[..., int], Sequence[Work], dict[str, Any]]:
    special: dict[str, Any] = {
        "first": process.form[0][1], "help": process.help, "helps": partial(_replaced_help_texts, process),
    }  # fmt: skip
    words = [word for word in process.process_values if word != process.command]
    flag = {"process": _process_parameter("kind of program", ["auto", *words])} if words else {}
    report = {} if process.tabulates else {"report": _PAGE}
    special["annotations"] = {"sources": _input_parameter(process.takes), **report, **flag}
    special["fixed"] = {"command": process.command} | ({} if words else {"process": "auto"})
    return resolve_name(_OPTIMIZE), [process], special


def _replaced_help_texts(work: Work) -> dict[str, tuple[str, str]]:
    """Return the help texts and defaults that a kind of work replaces, such as its default machine."""
    return {**work.helps, "machine": ("", work.with_defaults(Settings()).machine.machine)}


def _process_parameter(summary: str, words: Iterable[str]) -> Any:
    return Annotated[Name, Parameter(name="--process", help=f"{summary} [{', '.join(words)}]")]


def _input_parameter(summary: str) -> Any:
    words = (
        f"{summary}; a folder, a list of inputs (.list), or several inputs are done one by one; - for standard input"
    )
    return Annotated[str, Parameter(name="INPUT", help=words)]
