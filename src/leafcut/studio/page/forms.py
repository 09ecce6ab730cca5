"""Forms for each kind of work. They are generated from the option dataclasses, and important options come first."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from typing import Any

from leafcut.api import default_machine
from leafcut.errors import LeafcutError, OptionError
from leafcut.options import ANT_ALGORITHMS
from leafcut.options.option_spec import OptionSpec, flag_name, typed_text
from leafcut.processes import registry
from leafcut.processes.settings import all_options, group_of
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.page.chart_menus import Menus
from leafcut.studio.wording import Words
from leafcut.units import BARE_UNIT

#: A number that may have a unit.
_FIGURE = re.compile(r"(-?\d+(?:[.]\d*)?)\s*([a-zµ%/°]*)", re.IGNORECASE)
#: Width of a field, characters.
_MAX_LETTERS = 16

#: Options for cutting nested sheets. The page shows these options next to the nests until the cuts are planned.
CUT_OF_NEST = ("machine", "thickness", "material", "cut_process")


def works_with_form() -> tuple[str, ...]:
    """Return the kinds of work that have a form, in the order in which they are shown. Processes come first."""
    return tuple(work.name for work in registry.works() if work.form)


def work_command(work: str) -> str:
    """Return the command for a kind of work."""
    return work if work in registry.OTHER_WORKS else "optimize"


def program_processes() -> tuple[str, ...]:
    """Return the processes that users can select for a program. With ``auto``, leafcut selects the process."""
    names = (
        word
        for process in registry.processes()
        if process.reads == "program"
        for word in process.process_values
        if word != process.command
    )
    return ("auto", *names)


def option_groups(work: str, algorithm: str = "auto") -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the option groups for a kind of work and an algorithm.

    Each group has the key of its title and its options.
    """
    groups = registry.work(work).form
    parameters = "aco" if algorithm in ANT_ALGORITHMS else algorithm
    if any("algorithm" in names for _, names in groups) and parameters in ("aco", "firefly"):
        group = next(g for g in registry.option_groups() if g.section == parameters)
        return (*groups, (parameters, tuple(group.specs())))
    return groups


def applicable_options(work: str, values: Mapping[str, Any]) -> set[str]:
    """Return the options for a kind of work, including the parameters of the algorithm that `values` selects."""
    return {name for _, names in option_groups(work, str(values.get("algorithm") or "auto")) for name in names}


def work_form(
    work: str,
    values: Mapping[str, Any],
    words: Words,
    *,
    machines: Mapping[str, str],
    tools: Iterable[str],
    menus: Menus | None = None,
    usual: Mapping[str, str] | None = None,
    kept: Collection[str] = (),
) -> list[dict[str, Any]]:
    """Return the form for a kind of work. It consists of groups of fields as plain values.

    Parameters
    ----------
    machines
        Label of each machine by name.
    tools
        Names of the user's own tool libraries.
    menus
        Suggestions for fields that also accept other values.
    usual
        File and line of the user's own default for each option.
    kept
        Options that have been carried over from an earlier input.
    """
    own_choices = _machine_and_tool_choices(machines, work, tools)
    groups = [
        _form_group(key, names, values, words, work, own_choices, menus)
        for key, names in option_groups(work, str(values.get("algorithm") or "auto"))
    ]
    for field in (member for group in groups for member in group["fields"] if member["name"] in (usual or {})):
        field["usual"] = words("form.usual", place=(usual or {})[field["name"]])
    for field in (member for group in groups for member in group["fields"] if member["name"] in kept):
        field["usual"] = words("form.kept")
    return groups


def single_group_form(
    key: str, names: Iterable[str], words: Words, work: str, machines: Mapping[str, str], menus: Menus | None = None
) -> list[dict[str, Any]]:
    """Return a form that has a single group of options."""
    return [_form_group(key, tuple(names), {}, words, work, _machine_and_tool_choices(machines, work), menus)]


def _machine_and_tool_choices(
    machines: Mapping[str, str], work: str, tools: Iterable[str] = ()
) -> dict[str, list[tuple[str, str]]]:
    return {"machine": list(machines.items()), "tools": [(OWN + name, name) for name in tools]}


def _form_group(
    key: str,
    names: tuple[str, ...],
    values: Mapping[str, Any],
    words: Words,
    work: str,
    own_choices: Mapping[str, list[tuple[str, str]]],
    menus: Menus | None,
) -> dict[str, Any]:
    return {
        "key": key,
        "title": words.item_name("group", key),
        "folded": key not in ("main", "search", "cuts"),
        "changed": sum(1 for name in names if values.get(name) not in (None, "")),
        "fields": [
            _form_field(name, words, work, own_choices.get(name)) | {"offers": (menus or {}).get(name, [])}
            for name in names
        ],
    }


def plain_field(name: str, label: str, kind: str = "text", **given: Any) -> dict[str, Any]:
    """Return a field that does not belong to an option of leafcut."""
    empty = {"flag": "", "unit": "", "help": "", "choices": [], "default": "", "on": False, "file": False}
    return {"name": name, "label": label, "kind": kind, **empty, **given}


def plain_group(*fields: dict[str, Any]) -> dict[str, Any]:
    """Return a group of fields that has no title."""
    return {"key": "one", "title": "", "folded": False, "changed": 0, "fields": list(fields)}


def option_default(name: str, work: str = "") -> Any:
    """Return the default of an option for a kind of work."""
    if name == "machine" and work:
        return default_machine(work)
    return group_of(name).defaults()[name]


def _form_field(name: str, words: Words, work: str, own_choices: list[tuple[str, str]] | None) -> dict[str, Any]:
    spec, default = group_of(name).specs()[name], option_default(name, work)
    choices: list[tuple[str, str]] = [(word, word) for word in spec.all_choices]
    if own_choices is not None:
        choices = own_choices
    default_text, unit = default_words(name, default, words, work), _unit_symbol(spec)
    short = _shorten_default(default_text, _MAX_LETTERS - (len(unit) + 2 if unit else 0))
    return {
        "name": name,
        "label": words.option_label(name),
        "flag": flag_name(name),
        "kind": spec.kind,
        "unit": unit,
        "help": words.translate_for_page(words.help_text(name, _texts_for_work(name, work)[0] or spec.help, work)),
        "choices": [list(pair) for pair in choices],
        "default": short,
        "rule": "" if short == default_text else words("form.otherwise", rule=default_text),
        "on": default is True,
        "file": spec.kind == "path",
    }


def _texts_for_work(name: str, work: str) -> tuple[str, str]:
    """Return the help text and the default text that a kind of work uses for an option, or "" if it has no own text."""
    return registry.work(work).helps.get(name, ("", "")) if work else ("", "")


def _unit_symbol(spec: OptionSpec) -> str:
    if spec.kind == "percent":
        return "%"
    return BARE_UNIT.get(spec.unit, "") if spec.kind == "quantity" else "mm" if spec.kind == "point" else ""


def default_words(name: str, default: Any, words: Words, work: str = "") -> str:
    """Describe the default of an option that has no value. Without a description, return `default` itself."""
    spec = group_of(name).specs()[name]
    own = _texts_for_work(name, work)[1]
    if own or spec.default_words:
        return words.translate_for_page(words.default_text(name, own or spec.default_words, work))
    if default in (None, (), ""):
        return words("form.none")
    if spec.kind == "flag":
        return words("form.on" if default else "form.off")
    text = typed_text(spec, default)
    bare = text.removesuffix(_unit_symbol(spec))
    return bare if spec.kind in ("quantity", "percent") else text


def _shorten_default(text: str, limit: int) -> str:
    """Shorten a default to `limit` characters. Keep its first part (``auto`` of ``auto: as …``), or its first words."""
    head = text if len(text) <= limit else text.replace(";", ":").partition(":")[0]
    if len(head) <= limit:
        return head
    return (head[:limit].rpartition(" ")[0] or head[: limit - 1]).rstrip(",") + "…"


def value_error_message(name: str, value: Any) -> str:
    """Check a value that the user has typed. Return an error message that starts with the flag of the option.

    The message is empty if the value is valid. Files and machines are only checked when they are used.
    """
    group = group_of(name)
    spec = group.specs()[name]
    if value in (None, "") or spec.kind == "path" or spec.may_be_path:
        return ""
    try:
        group(**group.as_typed({name: value}))
    except OptionError as problem:
        line = str(problem)
        return line if line.startswith(flag_name(name) + ":") else ""
    return ""


def changed_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values that differ from the defaults. Options that no longer exist are ignored."""
    known, kept = {name for _, name, _ in all_options()}, {}
    for name, value in values.items():
        if name not in known:
            continue
        spec, default = group_of(name).specs()[name], group_of(name).defaults()[name]
        is_default = value in (None, "") or value == default
        if not is_default and isinstance(value, str) and default is not None and spec.kind != "path":
            is_default = value == typed_text(spec, default)
        if not is_default:
            kept[name] = value
    return kept


def values_of_work(work: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the changed values of all options that apply to a kind of work."""
    known = applicable_options(work, values)
    return {name: value for name, value in changed_values(values).items() if name in known}


def value_words(name: str, value: Any, words: Words, folder: Folder, work: str = "") -> str:
    """Format the value of an option, or its default, for display. It has a unit, or is shown as the name of a file."""
    spec = group_of(name).specs()[name]
    default = option_default(name, work)
    if spec.kind == "path" and value:
        with suppress(LeafcutError):  # the value names a library, or the file was deleted
            return folder.input_path(str(value)).name
    if spec.kind == "flag":
        return words("form.on" if (default if value in (None, "") else value) is True else "form.off")
    if value in (None, ""):
        value = _shorten_default(default_words(name, default, words), _MAX_LETTERS)
    text = ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value).removeprefix(OWN)
    figure = _FIGURE.fullmatch(text.strip())
    return f"{figure[1]}\u00a0{figure[2] or _unit_symbol(spec)}".strip() if figure else text
