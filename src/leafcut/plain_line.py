"""Command lines that are plain enough to be read without the parser, which takes as long to import as a short search.

A plain line names a command that works on inputs, its inputs, and flags in full, each once and with its value behind
it. Whatever else there is, right or wrong, is left to the parser, which knows all that can be said and how to refuse
the rest; `tests/test_plain_line.py` has both read the same lines.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from leafcut.option_spec import OptionSpec, flag_name


class Parameter:
    """What the parser is told of an argument or a flag, as its own `Parameter`, which it is made of when it is needed.

    Attributes
    ----------
    words
        What was said: ``name`` (one or several), ``help``, ``negative``, ``show``.
    """

    def __init__(self, **words: Any) -> None:
        self.words = words

    @property
    def names(self) -> list[str]:
        """The names that it has on the command line."""
        name = self.words.get("name", [])
        return [name] if isinstance(name, str) else list(name)


class _Flag(NamedTuple):
    """A flag: the name of what it sets, of an option or not, and the value that it is without one behind it, if any."""

    name: str
    of_options: bool
    alone: bool | None = None


class PlainLine(NamedTuple):
    """What a command line says: inputs, arguments of the command's function, and options."""

    places: list[str]
    own: dict[str, Any]
    options: dict[str, Any]


def own_parameters(
    function: Callable[..., Any], fixed: Iterable[str] = (), annotations: Mapping[str, Any] | None = None
) -> list[inspect.Parameter]:
    """Return the parameters of a command's function but `options` and those that are `fixed`.

    `annotations` are those of parameters that do not have their own.
    """
    ours = [p for p in inspect.signature(function, eval_str=True).parameters.values() if p.name != "options"]
    return [p.replace(annotation=(annotations or {}).get(p.name, p.annotation)) for p in ours if p.name not in fixed]


def read_plain_line(
    words: Sequence[str], own: Sequence[inspect.Parameter], options: Iterable[tuple[str, OptionSpec]]
) -> PlainLine | None:
    """Return what the words behind a command say; None where they are not plain."""
    flags = _flags_of_options(options)
    places, most = 0, 0
    needed = set()
    for parameter in own:
        if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
            places, most = max(places, 1), len(words)
        elif parameter.kind is inspect.Parameter.POSITIONAL_ONLY:
            places, most = places + 1, most + 1
        elif flag := _own_flag(parameter):
            flags |= flag
            if parameter.default is inspect.Parameter.empty:
                needed.add(parameter.name)
        else:
            return None
    line = _read(words, flags)
    if line is None or not places <= len(line.places) <= most or needed - set(line.own):
        return None
    return line


def _flags_of_options(options: Iterable[tuple[str, OptionSpec]]) -> dict[str, _Flag]:
    flags = {}
    for name, spec in options:
        flag = flag_name(name)
        flags[flag] = _Flag(name, True, True if spec.kind == "flag" else None)
        if spec.kind == "flag":
            flags[f"--no-{flag.removeprefix('--')}"] = _Flag(name, True, False)
    return flags


def _own_flag(parameter: inspect.Parameter) -> dict[str, _Flag] | None:
    """Return the flags of a parameter of a command's function; None for one that takes neither a text nor nothing."""
    if get_origin(parameter.annotation) is not Annotated:
        return None
    kind, told = get_args(parameter.annotation)
    if kind not in (str, str | None, bool) or (kind is bool and told.words.get("negative") != ""):
        return None
    return {name: _Flag(parameter.name, False, True if kind is bool else None) for name in told.names}


def _read(words: Sequence[str], flags: Mapping[str, _Flag]) -> PlainLine | None:
    line = PlainLine([], {}, {})
    rest = iter(words)
    for word in rest:
        if not word.startswith("-"):
            line.places.append(word)
            continue
        flag = flags.get(word)
        if flag is None:
            return None
        said = line.options if flag.of_options else line.own
        if flag.name in said:
            return None
        value: Any = flag.alone
        if value is None:
            value = next(rest, "")
            if not value or value.startswith("-"):
                return None
        said[flag.name] = value
    return line
