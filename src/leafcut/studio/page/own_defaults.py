"""The person's own defaults (`leafcut defaults`) as values that a form begins with, and where each was said."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from leafcut.errors import LeafcutError
from leafcut.files.user_files import defaults_file
from leafcut.files.whole_files import decoded, toml_bytes
from leafcut.processes import registry
from leafcut.processes.settings import collect, group_of, placed_in, placed_options, unused_options
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.jobs.task import OWN_KINDS


@dataclass(frozen=True)
class OwnDefaults:
    """What the file of defaults says, as a form has it.

    Attributes
    ----------
    values, shown
        Name → what one would type, or the id of a copy of the file that it names; name → what that file is called.
    places
        Name → the file's name and the line.
    problem
        Why nothing was taken, in one line; empty where all is well.
    """

    values: dict[str, Any] = field(default_factory=dict)
    shown: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    problem: str = ""


def own_defaults(folder: Folder) -> OwnDefaults:
    """Return the person's own defaults; files that they name are copied into its folder."""
    found = OwnDefaults()
    try:
        file = defaults_file()
        if file is None:
            return found
        for one in placed_options(file):
            name, value = one.name, one.value
            if group_of(name).specs()[name].names_file(str(value)):
                path = Path(placed_in(file.parent, {name: value})[name])
                value, found.shown[name] = _copied(path, name, folder), path.name
            found.values[name] = value if isinstance(value, bool) else _typed(value)
            found.places[name] = f"{file.name}:{one.line}" if one.line else file.name
    except LeafcutError as problem:
        return OwnDefaults(problem=str(problem))
    return found


def _copied(path: Path, name: str, folder: Folder) -> str:
    """Return how the studio names its copy of a file: machines and tools go into its library, others are inputs.

    Raises
    ------
    LeafcutError
        It cannot be read, is too large, or is no text.
    """
    data = toml_bytes(path)
    kind = OWN_KINDS.get(name)
    if kind is None:
        return folder.add_input(path.name, data)
    text = decoded(data)[0]
    called = re.sub(r"[^a-z0-9_-]+", "-", path.stem.lower()).strip("-_")[:40] or "shop"
    if called in folder.own(kind) and folder.own_path(kind, called).read_text(encoding="utf-8") != text:
        called += "-defaults"  # one of the library that a person made is never overwritten
    folder.save_own(kind, called, text)
    return OWN + called


def _typed(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def without_idle(
    options: Mapping[str, Any], usual: Mapping[str, str], work: str, input_kind: str = ""
) -> dict[str, Any]:
    """Return options without those of the defaults that would do nothing: nobody asked for them here.

    What a person typed stays, and is refused where it does nothing, as on the command line.
    """
    known = next((one for one in registry.works() if one.name == work), None)
    if known is None or not usual.keys() & options.keys():
        return dict(options)
    idle = unused_options(collect(options), known, input_kind)
    return {name: value for name, value in options.items() if name not in usual or name not in idle}
