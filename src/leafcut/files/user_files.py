"""Files of the person's own: shop defaults, and which machine was told what already.

Nothing here is needed: without a home, or where nothing may be written, leafcut runs as if the files were not there.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

from leafcut.errors import LeafcutError, OptionError
from leafcut.files.whole_files import write_whole

#: Names the file of defaults in place of the usual one; empty for none.
DEFAULTS_VARIABLE = "LEAFCUT_DEFAULTS"
#: So many are remembered, the last ones; their file is no larger than this.
_MOST_REMEMBERED, _LARGEST = 500, 1_000_000


def defaults_file() -> Path | None:
    """Return the file of the person's defaults, or None where there is none.

    Raises
    ------
    OptionError
        `DEFAULTS_VARIABLE` names a file that is not there.
    """
    named = os.environ.get(DEFAULTS_VARIABLE)
    if named is not None:
        if named and not Path(named).is_file():
            raise OptionError(f"{named}: file not found; {DEFAULTS_VARIABLE} names it as your defaults file")
        return Path(named) if named else None
    usual = usual_defaults_file()
    with suppress(OSError):
        if usual is not None and usual.is_file():
            return usual
    return None


def usual_defaults_file() -> Path | None:
    """Return where the file of the person's defaults is looked for, whether it is there or not; None without a home."""
    folder = _folder("XDG_CONFIG_HOME", ".config", "APPDATA", "Roaming")
    return None if folder is None else folder / "defaults.toml"


def has_defaults() -> bool:
    """Return whether the command line runs with defaults of the person's own, unless it is told not to."""
    try:
        return defaults_file() is not None
    except OptionError:
        return True


def first_time(what: str) -> bool:
    """Return whether something is told for the first time, and remember it as far as that is possible."""
    folder = _folder("XDG_STATE_HOME", ".local/state", "LOCALAPPDATA", "Local")
    if folder is None:
        return True
    file = folder / "told.json"
    told = _told(file)
    if what in told:
        return False
    with suppress(OSError, LeafcutError):
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(file, json.dumps([*told, what][-_MOST_REMEMBERED:], indent=0))
    return True


def _told(file: Path) -> list[str]:
    """Return what was told; a file that cannot be read, or that is none of ours, says nothing."""
    try:
        with file.open("rb") as stream:
            found = json.loads(stream.read(_LARGEST))
    except (OSError, ValueError, RecursionError):
        return []
    return [one for one in found if isinstance(one, str)] if isinstance(found, list) else []


def _folder(variable: str, usual: str, windows: str, windows_usual: str) -> Path | None:
    """Return leafcut's folder of one kind as the XDG base directory specification has it; None without a home."""
    name, under = (windows, f"AppData/{windows_usual}") if os.name == "nt" else (variable, usual)
    base = os.environ.get(name)
    if base and Path(base).is_absolute():  # the specification: others are left out of account
        return Path(base) / "leafcut"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / under / "leafcut" if home.is_absolute() else None
