"""The whole profile of each file of settings, each line with its origin, and of changed files: reviewed by eye."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import ReadError
from leafcut.read.controllers.importing import (
    ImportedMachine,
    detect_settings_kind,
    load_settings_text,
    machine_from_settings,
)
from leafcut.read.controllers.questions import machine_from_answers
from leafcut.read.controllers.values import ValueOrigin

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
        return machine_from_answers(given, None, base)
    return machine_from_settings(load_settings_text(SETTINGS[name]), str(SETTINGS[name]))


def test_each_file_of_settings_has_its_profile() -> None:
    assert {file.stem for file in PROFILES} == {*SETTINGS, *ANSWERS} - {"README", "changes"}


@pytest.mark.parametrize("file", PROFILES, ids=lambda file: file.stem)
def test_a_profile_has_each_value_with_its_origin(file: Path) -> None:
    found = profile(file.stem)
    assert lines_of(found) == file.read_text(encoding="utf-8").splitlines()
    sources = tomllib.loads(found.text)["sources"]
    assert sources == {
        value.key: "estimate: " * (value.how is ValueOrigin.ASSUMED) + value.source
        for value in found.values
        if value.key not in ("name", "description")
    }


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: f"{change['file']}: {change['new'].strip()[:30]}")
def test_a_changed_line_of_settings_changes_these_lines_of_the_profile(change: dict[str, str]) -> None:
    text, name = load_settings_text(HERE / change["file"]), change["file"]
    assert change["old"] in text
    before, after = (
        without_numbers(lines_of(machine_from_settings(each, name)))
        for each in (text, text.replace(change["old"], change["new"], 1))
    )
    lines = [line for line in difflib.unified_diff(before, after, lineterm="", n=0) if len(line) > 1]
    assert [line for line in lines if line[:2] not in ("--", "++", "@@")] == change["profile"].splitlines()


UNCLEAR = ", so M203 may be in mm/s or in mm/min; choose with --kind marlin or --kind rrf"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("<a><Preferences/></a>", "mach3"),
        ("\ufeff\n <profile><b/></profile>", "mach3"),
        ("[Motor0]\nCountsPerUnit=1\n", "mach4"),
        ("x\n  [Motor0]  \na=CountsPerUnit\n", "mach4"),
        ("[TRAJ]\n", "linuxcnc"),
        (" [KINS]\n", "linuxcnc"),
        ("[EMC]\n", "linuxcnc"),
        ("[RS274NGC]\n", "linuxcnc"),
        ("[JOINT_0]\n", "linuxcnc"),
        ("[AXIS_X]\n", "linuxcnc"),
        ("[AXIS_0]\n", "linuxcnc"),
        ("#INCLUDE a.inc\n", "linuxcnc"),
        ("$0=1\n$1=2\n$2=3\n", "grbl"),
        ("> $0 = 1\nRecv: $1 = 2 (x)\n$2=3", "grbl"),
        ('{"key": "$0", "value": "1"}, {"key":"$1","value":"2"}, {"key" : "$2", "value" : ""}', "grbl"),
        ('\ufeff {"$0": "1", "$1": 2, "$2": "3"}', "grbl"),
        ("board: x\nAxes :\n  x: 1\n", "fluidnc"),
        ("echo: M203 X1 Y1 Z1\n", "marlin"),
        ("M201 X1\nM205 J1\n", "marlin"),
        ("M201 X1\nM206 X0\n", "marlin"),
        ("M203 X1\nM301 P1\n", "marlin"),
        ("m203 X1\nm453\n", "rrf"),
        ("M203 X1\nM550 P1\n", "rrf"),
        ("M203 X1\nM566 X1\n", "rrf"),
        ("M203 X1\nM584 X1\n", "rrf"),
        ("M203 X1\nM669 K0\n", "rrf"),
        ("M203 X1\nM950 R0\n", "rrf"),
        ("M203 X1\nM208 X1\n", "rrf"),
        ('M98 P"a.g"\nM584 X1\n', "rrf"),
        ("<svg/>", "is XML, but not a Mach3 profile: <profile> with <Preferences> was expected"),
        ("[Motor0]\n", "is an INI file of no controller that leafcut knows"),
        ("[ a]\n", "is of no kind that leafcut knows"),
        ("$0=1\n$1=2\n", "is of no kind that leafcut knows"),
        ('{"$0": "1", "$1": 2}', "is of no kind that leafcut knows"),
        ("G0 X1\nG1 X2\n", "is a program, not the settings of a controller"),
        ("G0 X1\n", "is of no kind that leafcut knows"),
        ("M98 P1\n", "is of no kind that leafcut knows"),
        ("M203 X1\n", "has M201 and M203 only" + UNCLEAR),
        ("M203 X1\nM205 J1\nM566 X1\n", "has words of both Marlin and RepRapFirmware" + UNCLEAR),
    ],
)  # fmt: skip
def test_settings_are_recognised_by_their_contents(text: str, kind: str) -> None:
    try:
        found = detect_settings_kind(text, "f")
    except ReadError as problem:
        found = problem.reason.partition("; leafcut imports")[0]
    assert found == kind


def test_the_file_of_a_sender_has_the_settings_of_the_board() -> None:
    """Each setting with its line; the last one counts, and an empty one is no number."""
    text = (HERE / "grbl_3018.txt").read_text(encoding="utf-8")
    numbers = re.findall(r"^\$(\d+) ?= ?(\S+)", text, re.MULTILINE)
    before = lines_of(machine_from_settings(text, "f"))
    for entry in ('{{"key": "${}", "value": "{}"}}', '"${}": "{}"', '"${}": {}'):
        written = "{" + ",\n".join(entry.format(*pair) for pair in numbers) + "}"
        after = lines_of(machine_from_settings(written, "f"))
        assert [line for line in without_numbers(after) if "GRBL" not in line] == [
            line for line in without_numbers(before) if "GRBL" not in line
        ]
        rapid = next(number for number, pair in enumerate(numbers, 1) if pair[0] == "110")
        assert any(f"lines {rapid} to {rapid + 2}" in line for line in after)
        changed = written.replace(entry.format("110", dict(numbers)["110"]), entry.format("110", ""))
        with pytest.raises(ReadError, match=rf"^f:{rapid}: \$110 is '', but must be a number$"):
            machine_from_settings(changed, "f")
