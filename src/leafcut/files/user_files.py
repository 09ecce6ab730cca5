"""Access the user's own files: the shop defaults, and a record of hints that were already shown.

Both files are optional. leafcut ignores a file that cannot be read.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

from leafcut.errors import LeafcutError, OptionError
from leafcut.files.whole_files import write_whole

#: Environment variable with the path of the defaults file. If the variable is empty, no defaults file is used.
DEFAULTS_VARIABLE = "LEAFCUT_DEFAULTS"
#: Maximum number of hints to remember, starting with the latest, and maximum size of their file, bytes.
_MAX_REMEMBERED, _LARGEST = 500, 1_000_000


def defaults_file() -> Path | None:
    """Return the path of the user's defaults file, or None if the user has no such file.

    Raises
    ------
    OptionError
        The environment variable `DEFAULTS_VARIABLE` refers to a missing file.
    """
    named = os.environ.get(DEFAULTS_VARIABLE)
    if named is not None:
        if named and not Path(named).is_file():
            raise OptionError("{}: file not found; {} names it as your defaults file", named, DEFAULTS_VARIABLE)
        return Path(named) if named else None
    usual = usual_defaults_file()
    with suppress(OSError):
        if usual is not None and usual.is_file():
            return usual
    return None


def usual_defaults_file() -> Path | None:
    """Return the standard path of the defaults file, even if the file does not exist.

    Return None without a home folder.
    """
    folder = _user_folder("XDG_CONFIG_HOME", ".config", "APPDATA", "Roaming")
    return None if folder is None else folder / "defaults.toml"


def has_defaults() -> bool:
    """Return whether the user has a defaults file.

    A missing file counts if the environment variable refers to it.
    """
    try:
        return defaults_file() is not None
    except OptionError:
        return True


def record_first_showing(hint: str) -> bool:
    """Record a hint, and return whether it is shown for the first time.

    If leafcut cannot write the record, it treats every call as the first.
    """
    folder = _user_folder("XDG_STATE_HOME", ".local/state", "LOCALAPPDATA", "Local")
    if folder is None:
        return True
    file = folder / "hints.json"
    shown = _recorded_hints(file)
    if hint in shown:
        return False
    with suppress(OSError, LeafcutError):
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(file, json.dumps([*shown, hint][-_MAX_REMEMBERED:], indent=0))
    return True


def _recorded_hints(file: Path) -> list[str]:
    try:
        with file.open("rb") as stream:
            hints = json.loads(stream.read(_LARGEST))
    except (OSError, ValueError, RecursionError):
        return []
    return [hint for hint in hints if isinstance(hint, str)] if isinstance(hints, list) else []


def _user_folder(variable: str, usual: str, windows: str, windows_usual: str) -> Path | None:
    """Return leafcut's configuration or state folder (XDG base directories), or None without a home folder."""
    name, under = (windows, f"AppData/{windows_usual}") if os.name == "nt" else (variable, usual)
    base = os.environ.get(name)
    if base and Path(base).is_absolute():  # the specification: ignore relative paths
        return Path(base) / "leafcut"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / under / "leafcut" if home.is_absolute() else None
