"""Packages of other authors, installed for one test: a folder on the search path, with the files that pip writes."""

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
        """Install a package and return its folder.

        `groups`: entry points, group → name → object reference. `files`: path → text.
        """
        ...


def write_package(folder: Path, name: str, groups: Mapping[str, Mapping[str, str]], files: Mapping[str, str]) -> None:
    """Write the files of a package and its metadata, as pip does."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    metadata = folder / f"{name}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    lines = [
        line for group, points in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in points.items()))
    ]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


#: Page with an example package that has every kind of plug-in.
PAGE = Path(__file__).parents[1] / "docs" / "plugins.md"


def shop() -> tuple[str, dict[str, dict[str, str]], dict[str, str]]:
    """Return the example package of `PAGE`: name, entry points by group, files."""
    page = PAGE.read_text(encoding="utf-8")
    found = re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', page, flags=re.MULTILINE | re.DOTALL)
    files: dict[str, str] = dict(found)
    assert len(files) == len(found) == page.count("\n```") / 2
    project = tomllib.loads(files.pop("pyproject.toml"))["project"]
    return project["name"], project["entry-points"], files
