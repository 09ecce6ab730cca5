"""The whole profile of each file of settings, each line with its origin, and of changed files: reviewed by eye."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from leafcut.read.controllers.importing import ImportedMachine, imported, read_settings
from leafcut.read.controllers.questions import questioned
from leafcut.read.controllers.values import How

HERE = Path(__file__).parent / "settings"
PROFILES = sorted((HERE / "profiles").iterdir())
CHANGES: list[dict[str, str]] = tomllib.loads((HERE / "changes.toml").read_text(encoding="utf-8"))["change"]
SETTINGS = {file.stem: file for file in HERE.iterdir() if file.is_file()}

#: Profile → answers, and the profile that they complete.
ANSWERS: dict[str, tuple[dict[str, Any], str | None]] = {
    "answers_haas": ({"name": "Mill", "controller": "haas", "rapid": "1000 ipm", "travel": "30in,16in,20in"}, None),
    "answers_centroid": ({"name": "Knee", "controller": "Centroid", "rapid": "300 ipm,300 ipm,90"}, None),
    "answers_all": (
        {"name": "All", "controller": "linuxcnc", "process": "Laser", "units": "in", "rapid": "10 m/min",
         "acceleration": "0.1 g,0.2 g,50", "travel": "1 m, 2 m, 300", "max-feed": "5 m/min", "spindle-speed": "8000",
         "tool-changer": True, "tool-change-time": "0 s"}, None),
    "answers_router": ({"name": "My router", "travel": "unknown", "tool-changer": "n"}, "mach3-router"),
}  # fmt: skip


def lines_of(found: ImportedMachine) -> list[str]:
    """Return the lines of a profile without its [sources], and the notes."""
    return [*found.text.partition("[sources]")[0].splitlines(), *(f"# note: {note}" for note in found.notes)]


def without_numbers(lines: list[str]) -> list[str]:
    """Return lines without the numbers of the lines that they name."""
    return [re.sub(r"\blines? [0-9]+((,| to| and) [0-9]+)*", "line …", line) for line in lines]


def profile(name: str) -> ImportedMachine:
    """Return the machine of a file of settings, or of answers."""
    if name in ANSWERS:
        given, base = ANSWERS[name]
        return questioned(given, None, base)
    return imported(read_settings(SETTINGS[name]), str(SETTINGS[name]))


def test_each_file_of_settings_has_its_profile() -> None:
    assert {file.stem for file in PROFILES} == {*SETTINGS, *ANSWERS} - {"README", "changes"}


@pytest.mark.parametrize("file", PROFILES, ids=lambda file: file.stem)
def test_a_profile_has_each_value_with_its_origin(file: Path) -> None:
    found = profile(file.stem)
    assert lines_of(found) == file.read_text(encoding="utf-8").splitlines()
    sources = tomllib.loads(found.text)["sources"]
    assert sources == {
        value.key: "estimate: " * (value.how is How.ASSUMED) + value.source
        for value in found.values
        if value.key not in ("name", "description")
    }


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: f"{change['file']}: {change['new'].strip()[:30]}")
def test_a_changed_line_of_settings_changes_these_lines_of_the_profile(change: dict[str, str]) -> None:
    text, name = read_settings(HERE / change["file"]), change["file"]
    assert change["old"] in text
    before, after = (
        without_numbers(lines_of(imported(each, name)))
        for each in (text, text.replace(change["old"], change["new"], 1))
    )
    lines = [line for line in difflib.unified_diff(before, after, lineterm="", n=0) if len(line) > 1]
    assert [line for line in lines if line[:2] not in ("--", "++", "@@")] == change["profile"].splitlines()
