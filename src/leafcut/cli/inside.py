"""The commands `leafcut defaults`, `completion`, `addon` and `warm-up`: what makes leafcut at home in a shop."""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from cyclopts import App, Parameter

from leafcut.cli.flags import Json, switch
from leafcut.cli.json_output import print_json
from leafcut.cli.usage import refuse_dash
from leafcut.errors import LeafcutError, OptionError, count_of, nearest
from leafcut.files.user_files import DEFAULTS_VARIABLE, defaults_file, usual_defaults_file

SHELLS = ("bash", "zsh", "fish")

#: The script of zsh defines a function. A file of $fpath is called by its own name, so it has to call the function;
#: where it is read by a start file, it has to say what the function is for.
_ZSH_END = """
if [[ $zsh_eval_context[-1] == loadautofunc || $funcstack[1] == _leafcut ]]; then
  _cyclopts_leafcut "$@"
else
  compdef _cyclopts_leafcut leafcut
fi
"""


def add_commands(app: App, whole: Callable[[], App]) -> None:
    """Add the commands to the application; `whole` makes the one with all its flags."""

    def completion(
        shell: Annotated[str, Parameter(name="SHELL", help=f"one of {', '.join(SHELLS)}")],
        /,
    ) -> int:
        """Print the script by which a shell completes commands, options and their choices."""
        return _completion(shell, whole)

    app.command(_defaults, name="defaults")
    app.command(_addon, name="addon")
    app.command(completion, name="completion")
    app.command(_warm_up, name="warm-up")


def _defaults(
    command: Annotated[
        str | None, Parameter(name="COMMAND", help="show all options of this command, such as drill")
    ] = None,
    /,
    *,
    options_file: Annotated[
        str | None, Parameter(name="--options", help="a TOML file of options that goes before your defaults")
    ] = None,
    template: Annotated[
        bool,
        switch("--template", help="print a file of defaults to begin with"),
    ] = False,
    as_json: Json = False,
) -> int:
    """Show your own defaults, and where the value of each option comes from."""
    from leafcut.cli.shop_defaults import TEMPLATE, as_answer, shop_defaults
    from leafcut.files.whole_files import check_is_there

    if template:
        if command or options_file or as_json:
            raise OptionError("--template prints a file to begin with; leave the others out")
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


def _addon(
    name: Annotated[
        str | None, Parameter(name="NAME", help="inkscape or freecad; without one, they are listed")
    ] = None,
    /,
    *,
    to: Annotated[
        str | None, Parameter(name="--to", help="folder to write the files into, in which the other program looks")
    ] = None,
    as_json: Json = False,
) -> int:
    """Write the files of an add-on, with which another program uses leafcut: Inkscape, FreeCAD."""
    from leafcut.addons import ADDONS, write_addon

    refuse_dash("--to", to)
    if name is None:
        if to is not None:
            raise OptionError("--to: name the add-on, too: leafcut addon inkscape --to FOLDER")
        if as_json:
            print_json({"addons": [{"name": one.name, "description": one.help} for one in ADDONS.values()]})
        else:
            for one in ADDONS.values():
                print(f"{one.name:10}{one.help}")
        return 0
    if to is None:
        raise OptionError(f"addon needs a folder: leafcut addon {name} --to FOLDER")
    files = write_addon(name, to)
    if as_json:
        print_json({"name": name, "files": [str(file) for file in files]})
    else:
        print(f"wrote {', '.join(map(str, files))}; {ADDONS[name].then}")
    return 0


def _warm_up(*, as_json: Json = False) -> int:
    """Compile all kernels now, so that the first job starts at once."""
    from leafcut.cli.progress import Reporter
    from leafcut.cli.warming import warm_all

    with Reporter() as reporter:
        warmed = warm_all(lambda words: reporter(words, None, 0.0, None))
    if as_json:
        print_json({"compiled": warmed.count, "seconds": round(warmed.seconds, 1), "kept": warmed.kept})
    elif warmed.count:
        print(f"{count_of(warmed.count, 'kernel')} compiled in {warmed.seconds:.0f} s")
    if not warmed.kept:
        problem = LeafcutError("no folder for compiled code can be written; set NUMBA_CACHE_DIR to one that can")
        problem.answered = as_json
        raise problem
    return 0


def _cells(row: Any) -> tuple[str, ...]:
    cells = (row.option, row.value, row.source, f"used by {row.used_by}" if row.used_by else "")
    return tuple("".join(c if c.isprintable() else "?" for c in cell) for cell in cells)


def _file_words(file: str, usual: str) -> str:
    if file:
        return f"your defaults file: {file}"
    place = f"; leafcut defaults --template prints one to save as {usual}" if usual else ""
    return f"no defaults file{place} (or name one in ${DEFAULTS_VARIABLE})"


def _completion(shell: str, whole: Callable[[], App]) -> int:
    if shell not in SHELLS:
        raise OptionError(f"unknown shell '{shell}'{nearest(shell, SHELLS)}")
    app = whole()
    type_for_shell(app)
    script = app.generate_completion(prog_name="leafcut", shell=shell)  # type: ignore[arg-type]
    # Where bash knows nothing better it completes files, as it does elsewhere: --machine my.toml.
    script = script.replace("\ncomplete -F ", "\ncomplete -o default -F ")
    print(script + (_ZSH_END if shell == "zsh" else ""), end="")
    return 0


def _choices() -> dict[str, Sequence[str]]:
    """Return what arguments may be, by their names, where that is known."""
    from leafcut.gcode.dialects import dialect_list
    from leafcut.processes import registry
    from leafcut.processes.settings import all_options
    from leafcut.read.machine import machine_names

    found: dict[str, Sequence[str]] = {name: (*spec.all_choices, *spec.words) for _, name, spec in all_options()}
    found |= {"machine": machine_names(), "dialect": [name for name, _ in dialect_list()], "shell": SHELLS}
    commands = [one.command for one in registry.processes()]
    return {**found, "process": registry.asked_words(), "command": commands}


def type_for_shell(app: App, choices: Mapping[str, Sequence[str]] | None = None) -> None:
    """Say by types what a shell may complete: the choices of an option, and files wherever a text may stand.

    The command line itself takes texts, and says what is wrong with them in its own words.
    """
    choices = _choices() if choices is None else choices
    for name in app:
        if name.startswith("-"):
            continue
        one = app[name]
        type_for_shell(one, choices)
        function = one.default_command
        if function is None:
            continue
        signature = inspect.signature(function, eval_str=True)
        typed = [p.replace(annotation=_shell_type(p, choices.get(p.name, ()))) for p in signature.parameters.values()]
        one.default_command = _stand_in(signature.replace(parameters=typed))


def _stand_in(signature: inspect.Signature) -> Callable[..., int]:
    """Return what looks like a command, and is never called."""

    def command(*_: Any, **__: Any) -> int:
        raise NotImplementedError

    command.__signature__ = signature  # type: ignore[attr-defined]
    command.__annotations__ = {name: p.annotation for name, p in signature.parameters.items()}
    return command


def _shell_type(parameter: inspect.Parameter, choices: Sequence[str]) -> Any:
    """Return the annotation of an argument with choices or files in place of texts."""
    kind, *notes = get_args(parameter.annotation) if get_origin(parameter.annotation) is Annotated else (str,)
    instead: Any = Literal[tuple(choices)] if choices else Path
    typed = _with_texts_as(kind, instead)
    return Annotated[(typed, *notes)] if notes else typed


def _with_texts_as(kind: Any, instead: Any) -> Any:
    if isinstance(kind, type) and issubclass(kind, str):
        return instead
    if get_origin(kind) in (Union, types.UnionType):
        return Union[tuple(_with_texts_as(one, instead) for one in get_args(kind))]  # noqa: UP007
    if get_origin(kind) is list:
        return list[_with_texts_as(get_args(kind)[0], instead)]  # type: ignore[misc]
    return kind
