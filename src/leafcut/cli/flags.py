"""Flags of the command line, generated from the option groups."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from leafcut.options.option_spec import OptionGroup, OptionSpec, flag_name, typed_text

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions


class File(str):
    """A path, shown as FILE in the help."""


class Name(str):
    """A name, shown as NAME in the help."""


class Time(str):
    """A time with its unit, shown as TIME in the help."""


class Lengths(str):
    """Lengths in x, y and z, shown as LENGTHS in the help."""


class Speed(str):
    """A speed: the help shows SPEED instead of STR."""


class Acceleration(str):
    """An acceleration: the help shows ACCELERATION instead of STR."""


class Rpm(str):
    """A spindle speed: the help shows RPM instead of STR."""


class Percent(str):
    """A percentage: the help shows PERCENT instead of STR."""


class NUMBER(str):
    """A number: the help shows NUMBER instead of STR. The name is in capitals because `timing.profile` has a
    `Number`.
    """


#: Unit or kind of an option → type whose name the help shows. All types are texts, which `option_spec` parses.
_SHOWN = {
    "s": Time,
    "path": File,
    "text": Name,
    "names": Name,
    "mm/s": Speed,
    "rpm": Rpm,
    "percent": Percent,
    "number": NUMBER,
    "whole": NUMBER,
    "share": NUMBER,
} | {
    key: type(name, (str,), {})
    for key, name in {
        "mm": "LENGTH",
        "rad": "ANGLE",
        "W": "POWER",
        "N·mm": "TORQUE",
        "N": "FORCE",
        "point": "POINT",
        "place": "POINT",
    }.items()
}


#: Parameters that the help shows only with --help-all.
_SELDOM = ("options_file", "no_defaults", "watch", "every", "executor", "workers")


def switch_parameter(*names: str, help: str) -> Parameter:
    """Return the parameter for a flag that takes no value."""
    return Parameter(name=names, negative="", show_default=False, help=help)


Json = Annotated[bool, switch_parameter("--json", help="print the result as JSON")]


def add_option_flags(
    function: Callable[..., int],
    options: Iterable[tuple[type[OptionGroup], str, OptionSpec]],
    *,
    first: Sequence[str] = (),
    fixed: Mapping[str, Any] | None = None,
    annotations: Mapping[str, Any] | None = None,
    help: str = "",
    all_shown: bool = True,
    helps: Callable[[], Mapping[str, tuple[str, str]]] = dict,
) -> Callable[..., int]:
    """Return `function` with a flag for each of `options`, which it receives as a dict `options`.

    Parameters
    ----------
    first
        Main options, which come first in the help.
    fixed
        Values of arguments that have no flag.
    annotations
        Replacements for annotations of the function.
    help
        Replacement for the docstring of the function.
    all_shown
        Whether the help shows all options, or only the main options if the command has any.
    helps
        Function that returns, for each option, a new help text and a new displayed default; "" keeps the original.
    """
    fixed = fixed or {}
    own_parameters = [
        parameter.replace(annotation=(annotations or {}).get(parameter.name, parameter.annotation))
        for parameter in inspect.signature(function, eval_str=True).parameters.values()
        if parameter.name != "options" and parameter.name not in fixed
    ]
    if first and not all_shown:
        own_parameters = [
            _hide_parameter(parameter) if parameter.name in _SELDOM else parameter for parameter in own_parameters
        ]
    all_options = list(options)
    replaced = helps() if all_options else {}
    names = sorted(all_options, key=lambda option: first.index(option[1]) if option[1] in first else len(first))
    places = {group: k for k, group in enumerate(dict.fromkeys(group for group, _, _ in all_options))}
    flags = [
        _flag_parameter(
            group,
            name,
            spec,
            _help_group(group, places[group], name, first),
            *replaced.get(name, ("", "")),
            all_shown or not first or name in first,
        )
        for group, name, spec in names
    ]

    def command(*places: Any, **given: Any) -> int:
        options = {name: _plain_value(given.pop(name, None)) for _, name, _ in names}
        return function(*places, **fixed, **given, options=options)

    parameters = [*own_parameters, *flags]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__ = help or function.__doc__
    return command


def _plain_value(value: Any) -> Any:
    """Convert a value from its displayed type, which worker processes cannot unpickle, and join repeated flags."""
    if isinstance(value, list):
        return ",".join(value)
    return str(value) if isinstance(value, str) else value


def _hide_parameter(parameter: inspect.Parameter) -> inspect.Parameter:
    return parameter.replace(annotation=Annotated[parameter.annotation, Parameter(show=False)])


def usage_line(name: str, command: Callable[..., int]) -> str:
    """Return the usage line of a command, with the names of its arguments."""
    words = ["leafcut", name]
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        notes = [note for note in getattr(parameter.annotation, "__metadata__", ()) if isinstance(note, Parameter)]
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY or any(note.show is False for note in notes):
            continue
        word = next((label for note in notes for label in note.name or ()), parameter.name.upper())
        if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
            words.append(f"{word}...")
        else:
            words.append(word if parameter.default is inspect.Parameter.empty else f"[{word}]")
    return " ".join([*words, "[OPTIONS]"])


def print_help_panel(console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
    """Print one part of a help page; defaults have the style of the generated flags: (default: auto)."""
    from cyclopts.help import DefaultFormatter

    DefaultFormatter()(console, options, panel.copy(entries=[_add_default_note(entry) for entry in panel.entries]))


def _add_default_note(entry: HelpEntry) -> HelpEntry:
    from rich.text import Text

    note = "(required)" if entry.required else f"(default: {entry.default})" if entry.default else ""
    if note and entry.description is not None:
        entry.description.append(Text(note))
    return entry.copy(required=False, default=None)


def _help_group(group: type[OptionGroup], place: int, name: str, first: Sequence[str]) -> Group:
    if name in first:
        return Group("Main options", sort_key=9)
    return Group(f"More: {group.title}" if first else group.title, sort_key=10 + place)


def _flag_parameter(
    group: type[OptionGroup], name: str, spec: OptionSpec, help_group: Group, text: str, default_words: str, show: bool
) -> inspect.Parameter:
    default = group.defaults()[name]
    words = default_words or spec.default_words or ("" if default in (None, (), False) else typed_text(spec, default))
    help_text = text or spec.help
    if spec.all_choices:
        help_text += f" [{', '.join(spec.all_choices)}]"
    if spec.words:
        help_text += f" [or {', '.join(spec.words)}]"
    if words:
        help_text += f" (default: {words})"
    parameter = Parameter(
        name=flag_name(name),
        help=help_text,
        group=help_group,
        show_default=False,
        show=show,
        allow_leading_hyphen=True,
        negative_iterable=(),
    )
    annotation: Any = Annotated[_flag_type(spec), parameter]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)


def _flag_type(spec: OptionSpec) -> Any:
    if spec.kind == "flag":
        return bool | None
    shown: Any = _SHOWN[spec.unit if spec.kind == "quantity" else spec.kind]
    return (list[shown] if spec.kind == "names" else shown) | None
