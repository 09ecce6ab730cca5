"""Invalid files of tools, materials, machines and dialects are refused as inputs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import DataError
from leafcut.read.machine import machine_template
from leafcut.read.work_materials import material_file_text

TOOL = '[[tool]]\nnumber = 1\nkind = "drill"\ndiameter = "6.35mm"\nfeed = "100 mm/min"\nspindle_speed = "900 rpm"\n'
MACHINE = machine_template("haas-vf2")
MATERIAL = material_file_text("steel-c45")
DRILL = ("drill", "example:plate-10", "--depth", "3")


def said(text: str, key: str, value: str) -> str:
    """Return TOML with another value of a key."""
    changed = re.sub(rf"(?m)^{key} = .*", f"{key} = {value}", text)
    assert changed != text
    return changed


#: Content of a file, the flag or command that takes it, and a word of the refusal.
WRONG = [
    ("--tools a.toml", "[[tool]\n", "not a TOML file"),
    ("--tools a.toml", "", "no [[tool]]"),
    ("--tools a.toml", "tool = 3\n", "must be written as [[tool]]"),
    ("--tools a.toml", "tool = [3]\n", "is not a table"),
    ("--tools a.toml", TOOL + "colour = 3\n", "unknown key 'colour'"),
    ("--tools a.toml", said(TOOL, "kind", '"hammer"'), "'kind' is 'hammer'"),
    ("--tools a.toml", said(TOOL, "diameter", '"0mm"'), "must be above 0"),
    ("--tools a.toml", said(TOOL, "diameter", '"6 lightyears"'), "'diameter' is wrong"),
    ("--tools a.toml", said(TOOL, "number", "0"), "whole number"),
    ("--tools a.toml", said(TOOL, "kind", '"v-bit"'), "needs 'point_angle'"),
    ("--tools a.toml", said(TOOL, "kind", '"tap"'), "needs 'pitch'"),
    ("--tools a.toml", TOOL + TOOL, "used twice"),
    ("--tools a.toml", TOOL + '[[hole]]\ndiameter = "6.35mm"\ntools = [7]\n', "[[hole]] 1"),
    ("--tools a.toml", "#" * 2_000_000, "larger than"),
    ("--tools a.tbl", "rubbish\n", "not a line of a LinuxCNC tool table"),
    ("--tools a.json", "{", "not valid JSON"),
    ("--tools a.json", "{}", "no list 'data'"),
    ("--tools a.tools", "PK", "zip file"),
    ("--tools a.fctl", "{}", "no list 'tools'"),
    ("--tools a.csv", "a,b\n1,2\n", "no column"),
    ("--tools a.csv", "number,diameter\n", "no tool of this library"),
    ("--machine a.toml", "[rapid", "not a TOML file"),
    ("--machine a.toml", "", "is missing"),
    ("--machine a.toml", MACHINE + "\n[colour]\n", "unknown key 'colour'"),
    ("--machine a.toml", said(MACHINE, "process", '"hammer"'), "'process' is 'hammer'"),
    ("--machine a.toml", said(MACHINE, "home", '["9 km", "0 mm", "0 mm"]'), "'home'"),
    ("--machine a.toml", said(MACHINE, "controller", '"hass"'), "did you mean 'haas'"),
    ("--machine a.toml", said(MACHINE, "controller", '"../a.toml"'), "folder of the profile"),
    ("--machine a.toml", said(MACHINE, "controller", '"none.toml"'), "which does not exist"),
    ("--machine a.toml", said(MACHINE, "controller", '"dialect.toml"'), "dialect.toml:1: unknown key 'x'"),
    ("--dialect a.toml", "x = 1\n", "a.toml:1: unknown key 'x'"),
    ("list materials a.toml", "[x", "not a TOML file"),
    ("list materials a.toml", MATERIAL + "\ncolour = 1\n", "unknown key 'sources.colour'"),
    ("list materials a.toml", said(MATERIAL, "mc", "1.5"), "'cutting_force.mc' is 1.5"),
    ("list materials a.toml", said(MATERIAL, "kc11", '"0 N/mm²"'), "'cutting_force.kc11' is 0 N/mm²"),
    ("list materials a.toml", "life = 3\n" + MATERIAL.partition("[[life]]")[0], "must be written as [[life]]"),
]


@pytest.mark.parametrize(("words", "text", "told"), WRONG, ids=lambda value: value[:30])
def test_wrong_data_in_a_file_is_a_refused_input_and_no_wrong_usage(
    words: str,
    text: str,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    *before, name = words.split()
    Path(name).write_text(text, encoding="utf-8")
    Path("dialect.toml").write_text("x = 1\n")
    assert run([*(DRILL if before[0].startswith("--") else ()), *before, name]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and told in lines[0]


@pytest.mark.parametrize(
    "words",
    ["--tools none.toml", "--machine none.toml", "--machine hass", "--dialect hass", "list materials none.toml"],
)
def test_a_name_that_there_is_not_is_wrong_usage(words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([*(DRILL if words.startswith("--") else ()), *words.split()]) == 2


def test_who_catches_wrong_options_catches_wrong_files_too(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[[tool]\n")
    with pytest.raises(leafcut.OptionError) as caught:
        leafcut.optimize("example:plate-10", depth=3, tools=str(tmp_path / "a.toml"))
    assert isinstance(caught.value, DataError)
