"""The commands `leafcut install …`: add-ons for other programs, shell completion, compiled kernels."""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from cyclopts import App, Parameter

from leafcut.cli.flags import Json, switch_parameter
from leafcut.cli.shared import print_json
from leafcut.cli.usage import DASH, HELD
from leafcut.errors import LeafcutError, OptionError, count_of, name_suggestion
from leafcut.files.whole_files import OutputError

SHELLS = ("bash", "zsh", "fish")

#: End of the zsh script, which defines a function. As a file in $fpath, the script must call the function; as part of a
#: start file, it must register the function for the command.
_ZSH_END = """
if [[ $zsh_eval_context[-1] == loadautofunc || $funcstack[1] == _leafcut ]]; then
  _cyclopts_leafcut "$@"
else
  compdef _cyclopts_leafcut leafcut
fi
"""


def install_addon(
    name: Annotated[
        str | None, Parameter(name="NAME", help="inkscape or freecad; without a name, all add-ons are listed")
    ] = None,
    folder: Annotated[
        str | None, Parameter(name="FOLDER", help="folder in which the other program looks for add-ons")
    ] = None,
    /,
    *,
    as_json: Json = False,
) -> int:
    """Write the files of an add-on that lets another program use leafcut: Inkscape, FreeCAD."""
    from leafcut.addons import ADDONS, write_addon

    if name is None:
        if as_json:
            print_json({"addons": [{"name": addon.name, "description": addon.help} for addon in ADDONS.values()]})
        else:
            for addon in ADDONS.values():
                print(f"{addon.name:10}{addon.help}")
        return 0
    if name not in ADDONS:
        raise OptionError(f"unknown add-on '{name}'{name_suggestion(name, ADDONS)}")
    if folder is None or folder in (DASH, HELD):
        raise OptionError(f"install addon {name} needs a folder: leafcut install addon {name} FOLDER")
    files = write_addon(name, folder)
    if as_json:
        print_json({"name": name, "files": [str(file) for file in files]})
    else:
        print(f"wrote {', '.join(map(str, files))}; {ADDONS[name].then}")
    return 0


def install_completion(
    shell: Annotated[str, Parameter(name="SHELL", help=f"one of {', '.join(SHELLS)}")],
    /,
    *,
    print_only: Annotated[bool, switch_parameter("--print", help="print the script, change nothing")] = False,
) -> int:
    """Let a shell complete commands, options and their choices with the Tab key."""
    from leafcut.cli.app import build_app

    if shell not in SHELLS:
        raise OptionError(f"unknown shell '{shell}'{name_suggestion(shell, SHELLS)}")
    whole = build_app()
    annotate_completion_choices(whole)
    script = whole.generate_completion(prog_name="leafcut", shell=shell)  # type: ignore[arg-type]
    # If bash has no better completion, it completes file names: --machine my.toml.
    script = script.replace("\ncomplete -F ", "\ncomplete -o default -F ")
    script += _ZSH_END if shell == "zsh" else ""
    if print_only:
        print(script, end="")
        return 0
    try:
        file = whole.install_completion(shell=shell)  # type: ignore[arg-type]
        file.write_text(script, encoding="utf-8")
    except OSError as problem:
        raise OutputError(f"{problem.filename}: cannot be written ({problem.strerror}); use --print") from None
    print(f"wrote {file}; open a new shell")
    return 0


def install_kernels(*, as_json: Json = False) -> int:
    """Compile all kernels now, so that the first job starts at once."""
    from leafcut.cli.progress import Reporter
    from leafcut.cli.warming import compile_all_kernels
    from leafcut.model.heartbeat import Progress

    with Reporter() as reporter:
        warmed = compile_all_kernels(lambda words: reporter(Progress(words)))
    if as_json:
        print_json({"compiled": warmed.count, "seconds": round(warmed.seconds, 1), "kept": warmed.is_cached})
    elif warmed.count:
        print(f"{count_of(warmed.count, 'kernel')} compiled in {warmed.seconds:.0f} s")
    if not warmed.is_cached:
        problem = LeafcutError("no folder for compiled code is writable; set NUMBA_CACHE_DIR to a writable folder")
        problem.answered = as_json
        raise problem
    return 0


def _completion_choices() -> dict[str, Sequence[str]]:
    from leafcut.gcode.dialects import dialect_names_and_descriptions
    from leafcut.processes import registry
    from leafcut.processes.settings import all_options
    from leafcut.read.machine import machine_names

    choices: dict[str, Sequence[str]] = {name: (*spec.all_choices, *spec.words) for _, name, spec in all_options()}
    choices |= {
        "machine": machine_names(),
        "dialect": [name for name, _ in dialect_names_and_descriptions()],
        "shell": SHELLS,
    }
    commands = [work.command for work in registry.works()]
    return {**choices, "process": registry.all_process_values(), "command": commands}


def annotate_completion_choices(app: App, choices: Mapping[str, Sequence[str]] | None = None) -> None:
    """Annotate arguments for completion with the choices of an option, or with files for any other text."""
    choices = _completion_choices() if choices is None else choices
    for name in app:
        if name.startswith("-"):
            continue
        command = app[name]
        annotate_completion_choices(command, choices)
        function = command.default_command
        if function is None:
            continue
        signature = inspect.signature(function, eval_str=True)
        typed = [
            p.replace(annotation=_completion_type(p, choices.get(p.name, ()))) for p in signature.parameters.values()
        ]
        command.default_command = _placeholder_command(signature.replace(parameters=typed))


def _placeholder_command(signature: inspect.Signature) -> Callable[..., int]:
    def command(*_: Any, **__: Any) -> int:
        raise NotImplementedError

    command.__signature__ = signature  # type: ignore[attr-defined]
    command.__annotations__ = {name: p.annotation for name, p in signature.parameters.items()}
    return command


def _completion_type(parameter: inspect.Parameter, choices: Sequence[str]) -> Any:
    kind, *notes = get_args(parameter.annotation) if get_origin(parameter.annotation) is Annotated else (str,)
    instead: Any = Literal[tuple(choices)] if choices else Path
    typed = _replace_text_type(kind, instead)
    return Annotated[(typed, *notes)] if notes else typed


def _replace_text_type(kind: Any, replacement: Any) -> Any:
    if isinstance(kind, type) and issubclass(kind, str):
        return replacement
    if get_origin(kind) in (Union, types.UnionType):
        return Union[tuple(_replace_text_type(member, replacement) for member in get_args(kind))]  # noqa: UP007
    if get_origin(kind) is list:
        return list[_replace_text_type(get_args(kind)[0], replacement)]  # type: ignore[misc]
    return kind
