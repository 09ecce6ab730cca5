"""Packages of other people, installed for a test as pip installs them: a folder on the search path."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol


class Installer(Protocol):
    """Installs a package for one test (the fixture `install`)."""

    def __call__(
        self, name: str, groups: Mapping[str, Mapping[str, str]], files: Mapping[str, str] | None = None
    ) -> Path:
        """Install a package; return the folder that it lies in.

        `groups` are its entry points, group → name → what it names; `files` its files, path → text.
        """
        ...


def lay(folder: Path, name: str, groups: Mapping[str, Mapping[str, str]], files: Mapping[str, str]) -> None:
    """Write a package as pip lays it down: its files, and beside them what it says of itself."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    told = folder / f"{name}-1.0.dist-info"
    told.mkdir(parents=True)
    (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    lines = [
        line for group, points in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in points.items()))
    ]
    (told / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


#: The page whose examples are a package of every kind of plug-in.
PAGE = Path(__file__).parents[1] / "docs" / "plugins.md"


def shop() -> tuple[str, dict[str, dict[str, str]], dict[str, str]]:
    """Return the package of the page on plug-ins: its name, its entry points by group, and its files."""
    page = PAGE.read_text(encoding="utf-8")
    found = re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', page, flags=re.MULTILINE | re.DOTALL)
    files: dict[str, str] = dict(found)
    assert len(files) == len(found) == page.count("\n```") / 2
    project = tomllib.loads(files.pop("pyproject.toml"))["project"]
    return project["name"], project["entry-points"], files
