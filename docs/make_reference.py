"""Writes docs/reference.md (options, issue codes, formats, machines, algorithms, errors) from the program itself."""

from __future__ import annotations

from pathlib import Path

from leafcut.gcode.dialects import dialect, dialects
from leafcut.model.issue import CODES
from leafcut.option_spec import flag_name, written
from leafcut.options import ALGORITHM_TITLES
from leafcut.processes import registry
from leafcut.read import formats
from leafcut.read.machine import machine_descriptions
from leafcut.read.machine_keys import PROFILE_KEYS

HERE = Path(__file__).parent
OPTIONS_INTRODUCTION = (
    "Each is a flag of the command line, a key of a TOML file given with `--options`, and a keyword of",
    "`leafcut.optimize`, and means the same in all three. Bare numbers are millimetres, seconds, mm/min or rpm;",
    "any can carry its own unit: `0.25in`, `90ipm`, `500ms`. A decimal comma is a point where it",
    "cannot be anything else: `6,5` is 6.5, but not in lists, and `1,250` is asked back.",
    "",
    "An option that the work at hand does not use is an error where it is given on the command line or in a call:",
    f"{', '.join(f'`{work.name}` is {work.title}' for work in registry.works())}.",
    "A file of options may serve many kinds of work: of it, what a run does not use is not applied.",
    "So may a file of your own defaults ([inputs.md](inputs.md)).",
)


def options_table() -> list[str]:
    """Return one table per group of options."""
    lines = ["## Options", "", *OPTIONS_INTRODUCTION, ""]
    for group in registry.groups():
        lines += [f"### [{group.section}] {(group.__doc__ or '').splitlines()[0]}", ""]
        lines += ["| flag | TOML key | default | used for | what |", "| --- | --- | --- | --- | --- |"]
        for name, spec in group.specs().items():
            default = group.defaults()[name]
            words = spec.default_words or ("" if default in (None, ()) else written(spec, default))
            words = words or ("off", "on")[default is True] if spec.kind == "flag" else words
            choices = f" ({', '.join(f'`{c}`' for c in spec.choices)})" if spec.choices else ""
            works = ", ".join(work.name for work in registry.works() if name in work.used())
            lines.append(f"| `{flag_name(name)}` | `{name}` | {words} | {works} | {spec.help}{choices} |")
        lines.append("")
    return lines


def profile_table() -> list[str]:
    """Return the keys of a machine profile."""
    lines = ["### A profile of your own", ""]
    lines += [
        "`leafcut machines --show haas-vf2 > my.toml` prints a profile with what its keys mean; change it, and give it",
        "with `--machine my.toml`. Lengths, speeds and times are texts with a unit; lists are x, y and z. What is",
        "taken for keys that time or safety hangs on is told (L408). `[sources]` may say where each value comes from.",
        "",
        "| key | what | otherwise |",
        "| --- | --- | --- |",
    ]
    rows = ((key.name, key.help, "required" if key.required else key.shown_default) for key in PROFILE_KEYS)
    return [*lines, *(f"| `{name}` | {text} | {otherwise} |" for name, text, otherwise in rows), ""]


def table(title: str, head: tuple[str, str], rows: list[tuple[str, str]]) -> list[str]:
    """Return a section with a table of two columns."""
    lines = [f"## {title}", "", f"| {head[0]} | {head[1]} |", "| --- | --- |"]
    return [*lines, *(f"| `{name}` | {text} |" for name, text in rows), ""]


def reference() -> str:
    """Return the whole page."""
    lines = ["# Reference", "", "Made by `docs/make_reference.py` from the program; do not edit by hand.", ""]
    lines += options_table()
    lines += table("Algorithms", ("name", "what"), list(ALGORITHM_TITLES.items()))
    lines += table("Formats", ("name", "what"), [(f.name, f"{' '.join(f.extensions)} {f.help}") for f in formats()])
    lines += table("Machines", ("name", "what"), list(machine_descriptions().items()))
    lines += profile_table()
    lines += table("Dialects", ("name", "what"), [(name, dialect(name).description) for name in dialects()])
    lines += table("Issues", ("code", "meaning"), list(CODES.items()))
    return "\n".join(lines)


if __name__ == "__main__":
    (HERE / "reference.md").write_text(reference(), encoding="utf-8")
