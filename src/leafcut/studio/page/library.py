"""The user's own machines and tool libraries: TOML files in the studio's folder, which leafcut's readers check."""

from __future__ import annotations

import os
import tempfile
from importlib.resources import files
from pathlib import Path

from leafcut.errors import DataError, OptionError
from leafcut.files.whole_files import key_line_number
from leafcut.message import map_text
from leafcut.studio.folder import Folder

#: Maximum length of a profile, characters. Typical profiles have a few thousand.
MAX_CHARACTERS = 200_000


def shipped_names(kind: str) -> list[str]:
    """Return the names of the included files. Users can view and copy these files, but not change them."""
    if kind == "machines":
        from leafcut.read.machine import shipped_machines

        return shipped_machines()
    return ["example"]


def shipped_text(kind: str, name: str) -> str:
    """Return the TOML text of an included file. Raises `OptionError` if the name is unknown."""
    if name not in shipped_names(kind):
        raise OptionError("unknown name '{}' in {}", name, kind)
    file = files("leafcut.machines") / f"{name}.toml" if kind == "machines" else files("leafcut.studio") / "tools.toml"
    return file.read_text(encoding="utf-8")


def own_text(folder: Folder, kind: str, name: str) -> str:
    """Return the TOML text of one of the user's own files.

    Raises `OptionError` if the file is missing or unreadable.
    """
    try:
        return folder.own_path(kind, name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise OptionError("'{}' is no longer in your {}", name, kind) from None


def check_profile(kind: str, name: str, text: str) -> None:
    """Check the text of a machine or tool library. Raises `OptionError` if the text is invalid.

    A `DataError` also contains the line of the error. If a key is missing, this is the line of its table.
    """
    if len(text) > MAX_CHARACTERS:
        raise OptionError("{}.toml: longer than {:,} characters, too long for a profile", name, MAX_CHARACTERS)
    from leafcut.read.machine import load_machine
    from leafcut.read.tools import load_tools

    with tempfile.TemporaryDirectory(prefix="leafcut-") as place:
        file = Path(place) / f"{name}.toml"
        file.write_text(text, encoding="utf-8")
        try:
            if kind == "machines":
                load_machine(str(file))
            else:
                load_tools(file)
        except DataError as problem:
            problem.args = (map_text(str(problem), lambda text: text.replace(f"{Path(place)}{os.sep}", "")),)
            problem.line = problem.line or _line_of_error(text, problem)
            raise


def _line_of_error(text: str, problem: DataError) -> int | None:
    table, number, key = problem.table, problem.number, problem.key
    line = key_line_number(text, table, key, number) if key else None
    return line or (key_line_number(text, table, "", number) if table else 1)


def save_profile(folder: Folder, kind: str, name: str, text: str) -> None:
    """Check a text, and save it as one of the user's own files.

    Raises `OptionError` if the text or the name is invalid, or if an included machine has the same name.
    """
    folder.own_path(kind, name)
    if kind == "machines" and name in shipped_names(kind):
        raise OptionError("'{}' is a built-in machine; give yours another name", name)
    check_profile(kind, name, text)
    folder.save_own(kind, name, text)


def delete_profile(folder: Folder, kind: str, name: str) -> None:
    """Delete one of the user's own files."""
    folder.own_path(kind, name).unlink(missing_ok=True)
