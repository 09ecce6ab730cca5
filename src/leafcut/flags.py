"""Flags of the command line, made from the option groups."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Annotated, Any

from cyclopts import Group, Parameter

from leafcut.option_spec import OptionGroup, OptionSpec, flag_name, written


def command_of(
    function: Callable[..., int], options: Iterable[tuple[type[OptionGroup], str, OptionSpec]]
) -> Callable[..., int]:
    """Return `function` with a flag for every one of `options`, which it receives as a dict `options`."""
    own = [p for p in inspect.signature(function, eval_str=True).parameters.values() if p.name != "options"]
    names = list(options)
    places = {group: k for k, group in enumerate(dict.fromkeys(group for group, _, _ in names))}
    flags = [_flag(group, name, spec, places[group]) for group, name, spec in names]

    def command(*places: Any, **given: Any) -> int:
        # A list may be given by several flags.
        taken = {name: given.pop(name, None) for _, name, _ in names}
        options = {name: ",".join(value) if isinstance(value, list) else value for name, value in taken.items()}
        return function(*places, **given, options=options)

    command.__signature__ = inspect.Signature([*own, *flags])  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in [*own, *flags]}
    command.__doc__ = function.__doc__
    return command


def _flag(group: type[OptionGroup], name: str, spec: OptionSpec, place: int) -> inspect.Parameter:
    default = group.defaults()[name]
    words = spec.default_words or ("" if default in (None, (), False) else written(spec, default))
    help_text = spec.help
    if spec.choices:
        help_text += f" [{', '.join(spec.choices)}]"
    if words:
        help_text += f" (default: {words})"
    parameter = Parameter(
        name=flag_name(name),
        help=help_text,
        group=Group(group.title, sort_key=10 + place),
        show_default=False,
        allow_leading_hyphen=True,
        negative_iterable=(),
    )
    kinds: dict[str, Any] = {"flag": bool | None, "names": list[str] | None}
    annotation: Any = Annotated[kinds.get(spec.kind, str | None), parameter]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
