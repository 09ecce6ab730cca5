"""The user's own defaults (`leafcut defaults`), as initial values of a form with their positions in the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from leafcut.errors import LeafcutError
from leafcut.files.user_files import defaults_file
from leafcut.files.whole_files import decode_text, read_toml_bytes
from leafcut.processes import registry
from leafcut.processes.settings import (
    collect_settings,
    group_of,
    read_options_with_lines,
    resolve_files,
    unused_options,
)
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.jobs.task import OWN_KINDS


@dataclass(frozen=True)
class OwnDefaults:
    """The content of the file with the user's own defaults, as values of a form.

    Attributes
    ----------
    values
        The value of each option, as a user would type it. If the option names a file, this is the id of a copy.
    shown
        The displayed name of each copied file, by option.
    places
        The file name and the line of each option.
    problem
        Why the file cannot be used, in one line. It is empty if the file is valid.
    """

    values: dict[str, Any] = field(default_factory=dict)
    shown: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    problem: str = ""


def read_own_defaults(folder: Folder) -> OwnDefaults:
    """Read the user's own defaults. Files that they name are copied to the studio's folder."""
    defaults = OwnDefaults()
    try:
        file = defaults_file()
        if file is None:
            return defaults
        for entry in read_options_with_lines(file):
            name, value = entry.name, entry.value
            if group_of(name).specs()[name].names_file(str(value)):
                path = Path(resolve_files(file.parent, {name: value})[name])
                value, defaults.shown[name] = _copy_into_studio(path, name, folder), path.name
            defaults.values[name] = value if isinstance(value, bool) else _typed_text(value)
            defaults.places[name] = f"{file.name}:{entry.line}" if entry.line else file.name
    except LeafcutError as problem:
        return OwnDefaults(problem=str(problem))
    return defaults


def _copy_into_studio(path: Path, name: str, folder: Folder) -> str:
    """Copy a file to the library or to the uploads, and return its new name.

    Raises `LeafcutError` if the file cannot be read.
    """
    data = read_toml_bytes(path)
    kind = OWN_KINDS.get(name)
    if kind is None:
        return folder.add_input(path.name, data)
    text = decode_text(data)[0]
    called = re.sub(r"[^a-z0-9_-]+", "-", path.stem.lower()).strip("-_")[:40] or "shop"
    if called in folder.own_names(kind) and folder.own_path(kind, called).read_text(encoding="utf-8") != text:
        called += "-defaults"  # never overwrite a file of the user's library
    folder.save_own(kind, called, text)
    return OWN + called


def _typed_text(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def without_unused_defaults(
    options: Mapping[str, Any], usual: Mapping[str, str], work: str, input_kind: str = ""
) -> dict[str, Any]:
    """Remove the user's own defaults that a kind of work does not use. Options that the user has typed are kept."""
    known = next((kind for kind in registry.works() if kind.name == work), None)
    if known is None or not usual.keys() & options.keys():
        return dict(options)
    idle = unused_options(collect_settings(options), known, input_kind)
    return {name: value for name, value in options.items() if name not in usual or name not in idle}
