"""A LinuxCNC filter: called by the code of AXIS and QtVCP, its output runs in LinuxCNC's interpreter."""

from __future__ import annotations

import ast
import os
import re
import select
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ezdxf
import pytest

from leafcut.cli.app import run
from leafcut.cli.linuxcnc_filter import FilterProgress
from leafcut.model.heartbeat import Progress
from rs274_moves import moves_of_rs274, run_rs274

# LinuxCNC leaves it to the end of its program to close files.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
SETTINGS = Path(__file__).parent / "read" / "settings"
FAST = "--preset fast --threads 1"
DRILL_FILE = "M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y5.0\nX30.0Y5.0\nM30\n"
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    '<rect x="10" y="10" width="30" height="20"/></svg>'
)


class ProgressBar:
    """The progress bar of a LinuxCNC window: records its values."""

    def __init__(self, *_: Any) -> None:
        self.told: list[int] = []
        ProgressBar.last = self

    last: ProgressBar

    def update(self, percent: int, *_: Any) -> None:
        self.told.append(percent)

    def set_text(self, _: str) -> None: ...

    def done(self) -> None: ...


def of_linuxcnc(file: Path, *names: str) -> dict[str, Any]:
    """Return some functions or classes of a program of LinuxCNC, which cannot be imported without its screen."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    tree.body = [
        node
        for node in tree.body
        if getattr(node, "name", "") in names
        or (isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "progress_re")
    ]
    found: dict[str, Any] = {
        "_": str, "os": os, "sys": sys, "re": re, "select": select, "Progress": ProgressBar,
        "t": SimpleNamespace(update=lambda: None),
    }  # fmt: skip
    exec(compile(tree, str(file), "exec"), found)
    return found


@pytest.fixture
def axis(rs274: str) -> dict[str, Any]:
    """Return AXIS's own way of finding and calling a filter."""
    found = of_linuxcnc(Path(rs274).with_name("axis"), "filter_program", "get_filter")
    command = f"{shlex.quote(sys.executable)} -m leafcut filter {FAST}"
    lines = {
        "dxf": f"{command} --thickness 6 --spindle-speed 6000",
        "svg": f"{command} --depth 2 --tool-diameter 6 --spindle-speed 6000",
    }
    found["inifile"] = SimpleNamespace(find=lambda section, key: lines.get(key) if section == "FILTER" else None)
    return found


@pytest.mark.parametrize("name, depth, holes", [("it's a plate.dxf", 6, 10), ("panel.svg", 2, 0)])
def test_axis_opens_a_drawing_as_a_program_of_its_own_machine(
    name: str,
    depth: float,
    holes: int,
    axis: dict[str, Any],
    rs274: str,
    tmp_path: Path,
    examples: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """LinuxCNC's interpreter drills as many holes as are drawn, or mills the depth; the percentages rise."""
    monkeypatch.setenv("INI_FILE_NAME", str(SETTINGS / "linuxcnc_mm.ini"))
    drawing, opened = tmp_path / name, tmp_path / "opened" / name
    opened.parent.mkdir(exist_ok=True)
    drawing.write_bytes(SVG.encode() if name.endswith("svg") else (examples / "plate_10.dxf").read_bytes())
    status, said = axis["filter_program"](axis["get_filter"](str(drawing)), str(drawing), str(opened))
    assert (status, "FILTER_PROGRESS" in said) == (0, False), said
    text = opened.read_text()
    assert "(machine: shop-router)" in text
    percents = ProgressBar.last.told
    assert percents == sorted(set(percents)) and all(0 <= percent <= 100 for percent in percents)
    done, printed = run_rs274(rs274, text, tmp_path)
    assert done == 0, printed
    moves = moves_of_rs274(printed)
    deep = {move[1:3] for move in moves if move[0] == "feed" and move[3] <= -depth}
    assert len(deep) == holes if holes else len(deep) > 4


def test_what_is_refused_is_told_in_the_window_of_axis_and_nothing_is_opened(
    axis: dict[str, Any], tmp_path: Path
) -> None:
    drawing, opened = tmp_path / "empty.dxf", tmp_path / "opened.ngc"
    drawing.write_text("0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n")
    status, said = axis["filter_program"](axis["get_filter"](str(drawing)), str(drawing), str(opened))
    assert status == 1 and said.count("\n") == 1 and "empty.dxf" in said and said.startswith("leafcut: ")
    assert opened.read_text() == ""


def test_qtvcp_opens_a_drill_file_as_a_program(rs274: str, tmp_path: Path) -> None:
    """QtDragon and others; the names of the window's own parts are stood in for."""
    file = Path("/usr/lib/python3/dist-packages/qtvcp/qt_action.py")
    if not file.is_file():
        pytest.skip("this LinuxCNC has no QtVCP")
    found = of_linuxcnc(file, "FilterProgram")
    shown: list[Any] = []
    status = SimpleNamespace(connect=lambda *_: 0, disconnect=lambda _: None, emit=lambda *words: shown.append(words))
    found |= {"STATUS": status, "LOG": SimpleNamespace(error=shown.append)}
    drawing, opened, ended = tmp_path / "board.drl", tmp_path / "opened.ngc", []
    drawing.write_text(DRILL_FILE)
    command = f"{shlex.quote(sys.executable)} -m leafcut filter {FAST} --depth 2"
    running = found["FilterProgram"](command, str(drawing), str(opened), ended.append)
    running.p.wait()
    while running.update(None):
        pass
    assert ended == [0] and not shown
    assert run_rs274(rs274, opened.read_text(), tmp_path)[0] == 0


def test_the_machine_is_that_of_the_line_then_of_linuxcnc_then_of_the_defaults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    (tmp_path / "board.drl").write_text(DRILL_FILE)
    (tmp_path / "mine.toml").write_text('machine = "haas-vf2"\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LEAFCUT_DEFAULTS", str(tmp_path / "mine.toml"))

    def machine(*words: str) -> bytes:
        assert run(["filter", "board.drl", "--depth", "2", *FAST.split(), *words]) == 0
        return next(line for line in capsysbinary.readouterr().out.splitlines() if b"machine: " in line.lower())

    assert b"haas-vf2" in machine().lower()
    monkeypatch.setenv("INI_FILE_NAME", str(SETTINGS / "linuxcnc_mm.ini"))
    assert machine() == b"(machine: shop-router)"
    assert machine("--machine", "pcb-drill") == b"(machine: pcb-drill)"
    assert machine("--options", "mine.toml").lower() == b"(machine: haas-vf2)"


def test_a_plasma_table_cuts_a_drawing_where_nobody_says_what_is_done(
    examples: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    monkeypatch.setenv("INI_FILE_NAME", str(SETTINGS / "linuxcnc_plasma.ini"))
    words = ["filter", str(examples / "bracket.dxf"), "--thickness", "6", *FAST.split()]
    assert run(words) == 0, capsysbinary.readouterr().err
    assert b"M3 $0" in capsysbinary.readouterr().out


@pytest.mark.parametrize(
    "words, status, told",
    [
        ("", 2, "filter takes one file, as LinuxCNC calls it; 0 were given"),
        ("a.drl b.drl", 2, "filter takes one file, as LinuxCNC calls it; 2 were given"),
        ("-", 2, "filter -: cannot be read from standard input; name a file"),
        ("nosuch.drl", 1, "nosuch.drl: file not found"),
        ("a.drl -o b.ngc", 2, "unknown option '-o'"),
        ("a.drl --kerf 2", 2, "--kerf: this option does not apply to drilling"),
        ("a.drl --depht 2", 2, "did you mean '--depth'?"),
    ],
)
def test_a_wrong_line_is_told_in_one_line(
    words: str,
    status: int,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "a.drl").write_text(DRILL_FILE)
    monkeypatch.chdir(tmp_path)
    assert run(["filter", *words.split()]) == status
    said = capsys.readouterr()
    lines = [line for line in said.err.splitlines() if not line.startswith("FILTER_PROGRESS=")]
    assert said.out == "" and len(lines) == 1 and told in lines[0]


def test_a_file_of_linuxcnc_that_is_no_machine_is_refused_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another machine is never taken for it."""
    (tmp_path / "a.drl").write_text(DRILL_FILE)
    (tmp_path / "m.ini").write_text("[EMC]\nMACHINE = x\n")
    monkeypatch.setenv("INI_FILE_NAME", str(tmp_path / "m.ini"))
    assert run(["filter", str(tmp_path / "a.drl")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "m.ini" in said.err and "--machine my.toml" in said.err


def test_a_drawing_of_which_something_would_not_be_done_is_not_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """A letter without strokes is not engraved; where its layer is left out, the rest is cut."""
    drawing = ezdxf.new("R2010", units=4)
    drawing.modelspace().add_lwpolyline([(0, 0), (90, 0), (90, 60), (0, 60)], close=True)
    drawing.modelspace().add_text("Ж", height=5.0, dxfattribs={"layer": "MARK"}).set_placement((20, 20))
    drawing.saveas(tmp_path / "part.dxf")
    monkeypatch.setenv("INI_FILE_NAME", str(SETTINGS / "linuxcnc_plasma.ini"))
    words = ["filter", str(tmp_path / "part.dxf"), "--thickness", "6", *FAST.split()]
    assert run(words) == 3
    said = capsysbinary.readouterr()
    assert said.out == b"" and b"L216" in said.err and b"it is not opened; leave its layer out" in said.err
    assert run([*words, "--ignore-layers", "MARK"]) == 0


def test_no_percentage_is_told_twice_or_falls(capsys: pytest.CaptureFixture[str]) -> None:
    """Between two searches the share starts again; 100 % is reported when the program is written."""
    progress = FilterProgress()
    for share in (0.0, 0.001, 0.5, 0.2, 0.505, 1.0):
        progress(Progress("searching", share))
    progress.report(100)
    assert capsys.readouterr().err.split() == [f"FILTER_PROGRESS={n}" for n in (0, 50, 99, 100)]
