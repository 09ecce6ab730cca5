"""Generate docs/reference.md (options, issue codes, formats, machines, algorithms) from the program."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.model.issue import CODES
from leafcut.options import ALGORITHM_TITLES
from leafcut.options.option_spec import flag_name, typed_text
from leafcut.options.removed import REMOVED, removal_message
from leafcut.processes import registry
from leafcut.read import formats
from leafcut.read.machine import load_machine, machine_names
from leafcut.read.machine_keys import PROFILE_KEYS

PAGE = Path(__file__).parents[1] / "docs" / "reference.md"
OPTIONS_INTRODUCTION = (
    "Each option is a flag of the command line. The key of a TOML file given with `--options` and the keyword of",
    "`leafcut.optimize` are the flag without `--` and with `_` for `-`: `--min-diameter` is `min_diameter`. Numbers",
    "without a unit are millimetres, seconds, mm/min or rpm. Any number can have a unit (`0.25in`, `90ipm`, `500ms`)",
    "and can be a fraction (`1/4in`, `1 1/2in`). A comma counts as a decimal point if it can mean nothing else: `6,5`",
    "is 6.5 (in a list, two numbers); `1,250` is refused as ambiguous.",
    "",
    "The line above a table states the kinds of work that use its options (*all* in its rows). The kinds are:",
    f"{', '.join(f'`{work.name}` is {work.title}' for work in registry.works())}.",
    "An option that a run does not use is an error on the command line and in a call.",
    "A run ignores unused options in a file of options and in a file of your own defaults ([inputs.md](inputs.md)).",
)


def options_table() -> list[str]:
    """Return one table per group of options."""
    lines = ["## Options", "", *OPTIONS_INTRODUCTION, ""]
    for group in registry.option_groups():
        lines += [f"### [{group.section}] {(group.__doc__ or '').splitlines()[0]}", ""]
        uses = {name: [work.name for work in registry.works() if name in work.used()] for name in group.specs()}
        users = [work.name for work in registry.works() if any(work.name in names for names in uses.values())]
        differ = any(names != users for names in uses.values())
        lines += [f"Used for {', '.join(users)}.", ""]
        lines += [
            f"| flag | default |{' used for |' if differ else ''} meaning |",
            f"| --- | --- |{' --- |' if differ else ''} --- |",
        ]
        for name, spec in group.specs().items():
            default = group.defaults()[name]
            words = spec.default_words or ("" if default in (None, ()) else typed_text(spec, default))
            words = words or ("off", "on")[default is True] if spec.kind == "flag" else words
            choices = f" ({', '.join(f'`{c}`' for c in spec.choices)})" if spec.choices else ""
            choices += f" (or {', '.join(f'`{word}`' for word in spec.words)})" if spec.words else ""
            works = f" {shortest_list(uses[name], users)} |" if differ else ""
            lines.append(f"| `{flag_name(name)}` | {words} |{works} {spec.help}{choices} |")
        lines.append("")
    return lines


def shortest_list(names: list[str], of: list[str]) -> str:
    """Return the names in a list, or the names that are missing from it, whichever are fewer."""
    missing = [name for name in of if name not in names]
    if len(missing) + 1 < len(names):
        return f"all but {', '.join(missing)}" if missing else "all"
    return ", ".join(names)


def removed_options() -> list[str]:
    """Return the options of earlier versions; options with the same message share a line."""
    flags: dict[str, list[str]] = {}
    for name in REMOVED:
        words = (
            removal_message(name)
            .partition(" ")[2]
            .removeprefix("was removed")
            .lstrip(":; ")
            .removesuffix("; leave it out")
        )
        flags.setdefault(words, []).append(f"`{flag_name(name)}`")
    lines = ["### Removed options", "", "leafcut refuses them by name and states the replacement.", ""]
    return [*lines, *(f"* {', '.join(names)}: {words}" for words, names in flags.items()), ""]


def profile_table() -> list[str]:
    """Return the keys of a machine profile."""
    lines = ["### A profile of your own", ""]
    lines += [
        "`leafcut list machines haas-vf2 > my.toml` writes a profile that explains its keys. Change it and use it",
        "with `--machine my.toml`. Lengths, speeds and times are texts with a unit; lists are x, y and z. A run",
        "that uses a default on which time or safety depends reports it (L408). `[sources]` may hold the source of",
        "each value.",
        "",
        "| key | meaning | default |",
        "| --- | --- | --- |",
    ]
    rows = ((key.name, key.help, "required" if key.required else key.default_text) for key in PROFILE_KEYS)
    return [*lines, *(f"| `{name}` | {text} | {otherwise} |" for name, text, otherwise in rows), ""]


def named_list(title: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    """Return a section with a list of names and their meanings."""
    return [f"## {title}", "", *(f"* `{name}`: {text}" for name, text in rows), ""]


def reference() -> str:
    """Return the text of the whole page."""
    lines = ["# Reference", "", "Generated by `tools/make_reference.py`; do not edit.", ""]
    lines += options_table()
    lines += removed_options()
    lines += named_list("Algorithms", ALGORITHM_TITLES.items())
    lines += named_list("Formats", ((f.name, " ".join((*f.extensions, f.help))) for f in formats()))
    lines += named_list("Machines", ((name, load_machine(name).description) for name in machine_names()))
    lines += profile_table()
    lines += named_list("Dialects", ((name, load_dialect(name).description) for name in dialect_names()))
    lines += named_list("Issues", CODES.items())
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
