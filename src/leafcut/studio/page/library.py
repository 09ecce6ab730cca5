"""Machines and tool libraries of the person's own: TOML files in the studio's folder, checked by leafcut's readers."""

from __future__ import annotations

import os
import tempfile
from importlib.resources import files
from pathlib import Path

from leafcut.errors import LeafcutError, OptionError
from leafcut.studio.drafts import MOST_CHARACTERS
from leafcut.studio.folder import Folder

KINDS = ("machines", "tools")


def shipped(kind: str) -> list[str]:
    """Return the names of what leafcut brings, which can be looked at and copied but not changed."""
    if kind == "machines":
        from leafcut.read.machine import shipped_machines

        return shipped_machines()
    return ["example"]


def shipped_text(kind: str, name: str) -> str:
    """Return the TOML of what leafcut brings.

    Raises
    ------
    OptionError
        There is none of that name.
    """
    if name not in shipped(kind):
        raise OptionError(f"unknown name '{name}' in {kind}")
    file = files("leafcut.machines") / f"{name}.toml" if kind == "machines" else files("leafcut.studio") / "tools.toml"
    return file.read_text(encoding="utf-8")


def own_text(folder: Folder, kind: str, name: str) -> str:
    """Return the TOML of one of the person's own.

    Raises
    ------
    OptionError
        There is none of that name, or it cannot be read.
    """
    try:
        return folder.own_path(kind, name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise OptionError(f"'{name}' is no longer in your {kind}") from None


def check(kind: str, name: str, text: str) -> None:
    """Read a text as leafcut reads the file.

    Raises
    ------
    OptionError
        It is no such file; the line says what is wrong.
    """
    if len(text) > MOST_CHARACTERS:
        raise OptionError(f"{name}.toml: longer than {MOST_CHARACTERS:,} characters; no profile is")
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
        except LeafcutError as problem:
            raise OptionError(str(problem).replace(f"{Path(place)}{os.sep}", "")) from None


def save(folder: Folder, kind: str, name: str, text: str) -> None:
    """Keep a text as one of the person's own, after it was read.

    Raises
    ------
    OptionError
        The name is none, is a shipped one's, or the text is no such file.
    """
    folder.own_path(kind, name)
    if kind == "machines" and name in shipped(kind):
        raise OptionError(f"'{name}' is a built-in machine; give yours another name")
    check(kind, name, text)
    folder.save_own(kind, name, text)


def delete(folder: Folder, kind: str, name: str) -> None:
    """Remove one of the person's own."""
    folder.own_path(kind, name).unlink(missing_ok=True)
