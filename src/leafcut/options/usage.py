"""Which options a kind of work uses: one that is given and not used is refused, never ignored.

Every option says it of itself (`OptionSpec.works`, `OptionSpec.needs`); this file reads what they say.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import replace
from typing import Any

from leafcut.errors import OptionError
from leafcut.option_spec import WORKS, OptionGroup, OptionSpec, flag_name
from leafcut.options.settings import Settings, all_options, group_of

#: What to do instead of an option, by the kind of work and the option.
_INSTEAD = {
    ("program", "output_units"): "a program keeps its own units",
    ("program", "line_numbers"): "--renumber gives new numbers to the blocks that have one",
    ("program", "coolant"): "a program keeps its own coolant",
    ("program", "depth"): "a program keeps its own depths",
    ("program", "program_number"): "a program keeps its own number",
    ("program", "origin"): "a program stays where it is; set the work offset on the machine",
    ("program", "mirror"): "mirror the drawing, or in the CAM, which knows leads and climb milling",
    ("program", "rotate"): "turn the drawing, or in the CAM, or by the machine's work offset",
    ("drill", "keep_order"): "--algorithm none keeps the order of the drawing",
    ("pocket", "thickness"): "--depth says how deep the pocket is",
}


def settings_for(settings: Settings, work: str, input_kind: str = "", also: Container[str] = ()) -> Settings:
    """Return the settings as a kind of work uses them: what only a file gave, and it does not use, is left out.

    Parameters
    ----------
    work
        A name of `WORKS`, or of a process from outside.
    input_kind
        The name of the input's format.
    also
        Options that the work uses though they do not say so themselves: those of a process from outside.

    Raises
    ------
    OptionError
        An option that was given by itself, not in a file for many kinds of work, is not used.
    """
    unused: dict[str, set[str]] = {}
    for name, why in _unused(settings, work, input_kind, also):
        if name in settings.asked:
            raise OptionError(f"{flag_name(name)}: {why}")
        unused.setdefault(group_of(name).section, set()).add(name)
    kept: dict[str, Any] = {section: _without(getattr(settings, section), names) for section, names in unused.items()}
    given = settings.given - {name for names in unused.values() for name in names}
    return replace(settings, **kept, given=given)


def used_by(*works: str) -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option that one of some kinds of work uses, as `all_options` does."""
    for group, name, spec in all_options():
        if not set(works).isdisjoint(group.works_of(name)):
            yield group, name, spec


def _unused(settings: Settings, work: str, input_kind: str, also: Container[str]) -> Iterator[tuple[str, str]]:
    """Yield the options that were given and are not used, and why they are not and what to do."""
    for name in sorted(settings.given):
        group = group_of(name)
        works = group.works_of(name)
        if name in also:
            continue
        if work not in works:
            others = " and ".join(", ".join(WORKS[w] for w in works).rsplit(", ", 1))
            instead = _INSTEAD.get((work, name), "leave it out")
            yield name, f"{WORKS.get(work, work)} does not use it, it is for {others}; {instead}"
            continue
        for need in group.specs()[name].needs.split():
            where, _, condition = need.rpartition(":")
            if where in ("", work) and not _holds(condition, settings, input_kind):
                yield name, f"is not used here: it is {_said(condition)}; change that, or leave it out"
                break


def _holds(condition: str, settings: Settings, input_kind: str) -> bool:
    wanted, (name, _, values) = not condition.startswith("!"), condition.removeprefix("!").partition("=")
    value = input_kind if name == "input" else getattr(getattr(settings, group_of(name).section), name)
    return wanted == (value in values.split("|") if values else bool(value))


def _said(condition: str) -> str:
    """Return a condition in words, as the end of "it is …"."""
    wanted, (name, _, values) = not condition.startswith("!"), condition.removeprefix("!").partition("=")
    words = " or ".join(", ".join(values.split("|")).rsplit(", ", 1))
    if name == "input":
        return f"for a {words}" if wanted else f"not for a {words}"
    return f"used {'with' if wanted else 'without'} {flag_name(name)}{f' {words}' if words else ''} only"


def _without(group: OptionGroup, names: set[str]) -> OptionGroup:
    """Return a group of options with some of them at their defaults."""
    defaults = type(group).defaults()
    return replace(group, **{name: defaults[name] for name in names})  # type: ignore[type-var]
