"""The command `leafcut list`: lists machines, materials and other profiles, and prints their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

from cyclopts import Parameter

from leafcut.cli.flags import Json
from leafcut.cli.shared import print_json
from leafcut.errors import OptionError, name_suggestion

KINDS = ("machines", "materials", "dialects", "formats", "algorithms", "plugins")


def list_known(
    kind: Annotated[str, Parameter(name="KIND", help=f"one of {', '.join(KINDS)}")],
    name: Annotated[
        str | None,
        Parameter(
            name="NAME",
            help="print the file of this machine, material or dialect; write it to a file with > my.toml to edit it",
        ),
    ] = None,
    /,
    *more: Annotated[str, Parameter(show=False)],
    as_json: Json = False,
) -> int:
    """List machines, materials, dialects, formats, algorithms or plug-ins, or print the file of one."""
    if kind not in KINDS:
        raise OptionError(f"list: unknown kind '{kind}'{name_suggestion(kind, KINDS)}")
    if more:
        raise OptionError(f"list takes one name, not {1 + len(more)}; run it once for each")
    if name is not None:
        if kind not in _FILES:
            raise OptionError(f"list {kind}: these have no files to print; leave {name} out")
        noun, file_of = _FILES[kind]
        known_as, text = file_of(name)
        if as_json:
            print_json({"name": known_as, noun: text})
        else:
            print(text, end="")
        return 0
    rows = _ROWS[kind]()
    if as_json:
        print_json({kind: [{"name": entry, "description": text} for entry, text in rows]})
    elif rows:
        width = max(len(entry) for entry, _ in rows)
        for entry, text in rows:
            print(f"{entry:{width}}  {text}")
    else:
        print("no plug-ins installed")
    return 0


def _machines() -> Sequence[tuple[str, str]]:
    from leafcut.read.machine import machine_descriptions

    return machine_descriptions()


def _machine_file(name: str) -> tuple[str, str]:
    from leafcut.read.machine import load_machine, machine_template

    return load_machine(name).name, machine_template(name)


def _materials() -> Sequence[tuple[str, str]]:
    from leafcut.read.work_materials import material_descriptions

    return material_descriptions()


def _material_file(name: str) -> tuple[str, str]:
    from leafcut.read.work_materials import load_material, material_file_text

    return load_material(name).name, material_file_text(name)


def _dialects() -> Sequence[tuple[str, str]]:
    from leafcut.gcode.dialects import dialect_names_and_descriptions

    return dialect_names_and_descriptions()


def _dialect_file(name: str) -> tuple[str, str]:
    from leafcut.gcode.dialects import dialect_template

    return name, dialect_template(name)


def _formats() -> Sequence[tuple[str, str]]:
    from leafcut.read import formats

    return [
        (file_format.name, f"{' '.join(file_format.extensions)}  {file_format.help}".strip())
        for file_format in formats()
    ]


def _algorithms() -> Sequence[tuple[str, str]]:
    from leafcut import api

    return list(api.algorithms().items())


def _plugins() -> Sequence[tuple[str, str]]:
    from leafcut import api

    return api.plugins()


_ROWS: dict[str, Callable[[], Sequence[tuple[str, str]]]] = {
    "machines": _machines, "materials": _materials, "dialects": _dialects, "formats": _formats,
    "algorithms": _algorithms, "plugins": _plugins,
}  # fmt: skip
#: Kind with files → key of the file in the JSON answer, and function that returns the name and text of a file.
_FILES: dict[str, tuple[str, Callable[[str], tuple[str, str]]]] = {
    "machines": ("profile", _machine_file), "materials": ("material", _material_file),
    "dialects": ("dialect", _dialect_file),
}  # fmt: skip
