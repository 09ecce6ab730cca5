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
    "Each option is a flag of the command line, a key of a TOML file given with `--options`, and a keyword of",
    "`leafcut.optimize`. It means the same in all three. Numbers without a unit are millimetres, seconds, mm/min or",
    "rpm; any number can have a unit: `0.25in`, `90ipm`, `500ms`, and can be a fraction: `1/4in`, `1 1/2in`. A comma",
    "counts as a decimal point if it can mean nothing else: `6,5` is 6.5 (in a list, two numbers); `1,250` is refused",
    "as ambiguous.",
    "",
    "The column *used for* names kinds of work:",
    f"{', '.join(f'`{work.name}` is {work.title}' for work in registry.works())}.",
    "An option that a run does not use is an error on the command line and in a call.",
    "A file of options may serve many kinds of work: a run ignores what it does not use.",
    "So does a file of your own defaults ([inputs.md](inputs.md)).",
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
            choices += f" (or {', '.join(f'`{word}`' for word in spec.words)})" if spec.words else ""
            works = ", ".join(work.name for work in registry.works() if name in work.used())
            lines.append(f"| `{flag_name(name)}` | `{name}` | {words} | {works} | {spec.help}{choices} |")
        lines.append("")
    return lines


def profile_table() -> list[str]:
    """Return the keys of a machine profile."""
    lines = ["### A profile of your own", ""]
    lines += [
        "`leafcut machines --show haas-vf2 > my.toml` writes a profile that explains its keys. Change it and use it",
        "with `--machine my.toml`. Lengths, speeds and times are texts with a unit; lists are x, y and z. A run",
        "that uses a default on which time or safety depends says so (L408). `[sources]` may say where each value",
        "comes from.",
        "",
        "| key | meaning | default |",
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
