"""Files of settings with a damaged line, and all refusals, reviewed by eye: `tables/refused settings.txt`.

The last number of a line becomes a word, negative or 0, or the line is left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from leafcut.errors import LeafcutError
from leafcut.read.controllers.importing import load_settings_text, machine_from_settings

HERE = Path(__file__).parent
FILES = sorted(file.name for file in (HERE / "settings").iterdir() if file.suffix not in (".toml", ".md", ""))
EXPECTED = re.split("^== ", (HERE / "tables" / "refused settings.txt").read_text(encoding="utf-8"), flags=re.MULTILINE)

_NUMBER = re.compile(r"(?<![\w$.])-?\d+(?:\.\d+)?(?!.*\d)")


def damaged(lines: list[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield each damage with its name, and the lines with it."""
    for at, line in enumerate(lines):
        for word in ("abc", "-1", "0"):
            changed, count = _NUMBER.subn(word, line, count=1)
            if count:
                yield word, [*lines[:at], changed, *lines[at + 1 :]]
        yield f"without line {at + 1}", [*lines[:at], *lines[at + 1 :]]


def refusals(name: str) -> list[str]:
    """Return the refusals of a file of settings with one damage each; the reasons of the YAML parser are left out."""
    found = []
    for damage, lines in damaged(load_settings_text(HERE / "settings" / name).splitlines()):
        try:
            machine_from_settings("\n".join([*lines, ""]), name)
        except LeafcutError as problem:
            found.append(f"{damage}: {re.sub(r'not YAML .*', 'not YAML', str(problem).removeprefix(name))}")
    return found


@pytest.mark.parametrize("name", FILES)
def test_a_damaged_line_is_refused_or_does_not_matter(name: str) -> None:
    (expected,) = (part for part in EXPECTED if part.startswith(f"{name}\n"))
    assert "\n".join([name, *refusals(name), ""]) == expected


@pytest.mark.parametrize("line", ["SetupUnits=200", "SetupUnits=210"])
def test_units_of_mach4_have_their_source(line: str) -> None:
    """Without SetupUnits the units are given, and the source says so."""
    text = re.sub("SetupUnits=.*", line, load_settings_text(HERE / "settings" / "mach4_mm.ini"))
    assert f'"units" = "[Preferences]SetupUnits is {line[-3:]}"' in machine_from_settings(text, "a.ini").text
    assert (
        '"units" = "[Preferences] has no SetupUnits"'
        in machine_from_settings(text.replace(line, ""), "a.ini", units="mm").text
    )
