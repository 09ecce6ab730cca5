"""Add-ons, run by the programs that they are for: what these write is what leafcut writes, or nothing."""

from __future__ import annotations

import ast
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest

import leafcut
from leafcut.addons import ADDONS, write_addon
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.files.whole_files import OutputError
from outside_programs import missing

HERE = Path(__file__).parent
PROGRAM = "G21 G90 G17\nT1 M6\nS1200 M3\nG0 Z10\nG98 G81 X5 Y5 Z-5 R2 F120\nX90 Y5\nX9 Y7\nX80\nG80\nG0 Z50\nM5\nM30\n"


@pytest.mark.parametrize("name", ["freecad/leafcut_post.py", "inkscape/leafcut_inkscape.py"])
def test_an_addon_needs_nothing_of_leafcut_in_the_python_of_its_program(name: str) -> None:
    tree = ast.parse((Path(leafcut.__file__).parent / "addons" / name).read_text(encoding="utf-8"))
    modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    modules += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    assert modules and not any(module.partition(".")[0] == "leafcut" for module in modules)


def motions(text: str) -> list[str]:
    """Return a program without its comments, one of which contains the name of the input."""
    return [line for line in text.splitlines() if not line.startswith("(")]


def called(command: list[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a program with a home of its own, without a window."""
    home = {**os.environ, "HOME": str(folder), "QT_QPA_PLATFORM": "offscreen", "LEAFCUT_DEFAULTS": "", **environment}
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, cwd=folder, env=home)


# -- writing them ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ADDONS)
def test_an_add_on_calls_the_leafcut_that_wrote_it(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And is written again over its own files."""
    for _ in range(2):
        assert run(["install", "addon", name, str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert all(str(tmp_path / file) in said for file in ADDONS[name].files)
    (script,) = [file for file in ADDONS[name].files if file.endswith(".py")]
    assert runpy.run_path(str(tmp_path / script))["LEAFCUT"] == [sys.executable, "-m", "leafcut"]


@pytest.mark.parametrize(
    "words, status, told",
    [
        ("inkscpe .", 2, "unknown add-on 'inkscpe'; did you mean 'inkscape'?"),
        ("inkscape", 2, "install addon inkscape needs a folder: leafcut install addon inkscape FOLDER"),
        ("inkscape nosuch", 1, "nosuch: not a folder"),
        ("inkscape -", 2, "needs a folder"),
        ("freecad theirs", 1, "leafcut_post.py: exists already and is not from leafcut"),
    ],
)
def test_what_cannot_be_written_is_refused_in_a_line(
    words: str,
    status: int,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("theirs").mkdir(exist_ok=True)
    Path("theirs/leafcut_post.py").write_text("print('mine')\n")
    assert run(["install", "addon", *words.split()]) == status
    said = capsys.readouterr()
    assert told in said.err and said.err.count("\n") == 1
    assert Path("theirs/leafcut_post.py").read_text() == "print('mine')\n"


def test_the_list_of_add_ons_tells_what_each_does(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["install", "addon"]) == 0
    said = capsys.readouterr().out
    assert all(f"{one.name} " in said and one.help in said for one in ADDONS.values())
    with pytest.raises(OptionError):
        write_addon("gimp", tmp_path)
    with pytest.raises(OutputError):
        write_addon("freecad", tmp_path / "nosuch")


# -- Inkscape --------------------------------------------------------------------------------------------------------


@pytest.fixture
def extension(tmp_path: Path) -> Path:
    """Return the script of Inkscape's extension, where Inkscape looks for it."""
    folder = tmp_path / "profile" / "extensions"
    folder.mkdir(parents=True)
    write_addon("inkscape", folder)
    return folder / "leafcut_inkscape.py"


def test_inkscape_saves_a_drawing_as_the_program_that_leafcut_makes_of_it(
    inkscape: str, extension: Path, tmp_path: Path, examples: Path
) -> None:
    command = [inkscape, "--export-extension=org.leafcut.output", "--export-filename=gusset.ngc"]
    profile = str(extension.parents[1])
    done = called([*command, str(examples / "gusset.svg")], tmp_path, INKSCAPE_PROFILE_DIR=profile)
    assert (tmp_path / "gusset.ngc").is_file(), done.stderr
    ours = leafcut.optimize(examples / "gusset.svg", process="cut", thickness="3mm")
    assert motions((tmp_path / "gusset.ngc").read_text()) == motions(ours.text)


def test_the_extension_passes_on_what_stands_in_its_window(extension: Path, tmp_path: Path, examples: Path) -> None:
    """Its parameters are those in the window's description, and all of them are used."""
    described = ElementTree.parse(extension.with_name("leafcut.inx"))
    names = [one.get("name", "") for one in described.iter() if one.tag.endswith("}param")]
    command: Callable[[list[str]], list[str]] = runpy.run_path(str(extension))["leafcut_command"]
    assert set(names) == {"tab", "work", "machine", "thickness", "depth", "tool", "more"}
    given = {"work": "pocket", "machine": " haas-vf2 ", "thickness": "3mm", "depth": "2mm", "tool": "6mm"}
    words = [f"--{name}={value}" for name, value in given.items()]
    made = command([*words, "--more=--strategy contour --origin '0,0'", "--tab=work", "part.svg"])
    assert made[3:] == [
        *("pocket", "part.svg", "-o", "-", "--quiet", "--machine", "haas-vf2", "--depth", "2mm"),
        *("--tool-diameter", "6mm", "--strategy", "contour", "--origin", "0,0"),
    ]
    assert command(["--work=cut", "--thickness=3mm", "--tool=6mm", "a.svg"])[3:] == [
        *("cut", "a.svg", "-o", "-", "--quiet", "--thickness", "3mm")
    ]


def test_the_extension_reports_a_refusal_of_leafcut_with_its_exit_status_and_saves_nothing(
    extension: Path, tmp_path: Path, examples: Path
) -> None:
    words = ["--work=cut", "--thickness=3mm", str(examples / "gusset.svg"), "--machine=haas-vf3"]
    done = called([sys.executable, str(extension), *words], tmp_path)
    assert (done.returncode, done.stdout) == (2, "") and "did you mean 'haas-vf2'" in done.stderr


def test_the_extension_reports_wrong_options_and_a_missing_leafcut_in_one_line(
    extension: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    extension.write_text(re.sub("^LEAFCUT = .*$", 'LEAFCUT = ["no/such/leafcut"]', extension.read_text(), flags=re.M))
    main: Callable[[], int] = runpy.run_path(str(extension))["main"]
    for words, status, message in (
        (["--more=--origin 'x"], 2, "More options: "),
        ([], 1, "leafcut cannot be started"),
    ):
        monkeypatch.setattr(sys, "argv", [str(extension), "--work=cut", *words, "part.svg"])
        assert main() == status
        output = capsys.readouterr()
        assert (output.out, output.err.count("\n")) == ("", 1) and output.err.startswith(message)


# -- FreeCAD ---------------------------------------------------------------------------------------------------------


def freecad_job(freecadcmd: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    (folder / "macros").mkdir(exist_ok=True)
    write_addon("freecad", folder / "macros")
    settings = {"MACROS": str(folder / "macros"), "POST": "leafcut", "ARGUMENTS": "", "OUT": "job.ngc", **environment}
    return called([freecadcmd, str(HERE / "freecad_job.py")], folder, **settings)


def test_a_job_of_freecad_is_reordered_and_does_the_same_work(
    freecadcmd: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six holes, in less time than by FreeCAD's own post-processor."""
    settings = {"POST": "linuxcnc", "ARGUMENTS": "--no-show-editor", "OUT": "before.ngc"}
    assert freecad_job(freecadcmd, tmp_path, **settings).returncode == 0
    done = freecad_job(freecadcmd, tmp_path, ARGUMENTS="--base linuxcnc --machine linuxcnc-mill --preset fast")
    assert done.returncode == 0, done.stderr
    monkeypatch.chdir(tmp_path)
    assert leafcut.verify("before.ngc", "job.ngc").same
    assert Path("job.ngc").read_text().count("G81") == 6
    before, after = (leafcut.simulate(name).measure.time_s for name in ("before.ngc", "job.ngc"))
    assert after < before


def test_what_leafcut_refuses_is_told_by_freecad_and_nothing_is_written(freecadcmd: str, tmp_path: Path) -> None:
    """A tool without a feed: the message is leafcut's."""
    done = freecad_job(freecadcmd, tmp_path, FEED="0 mm/min")
    assert done.returncode == 1 and "the cut has no feed" in done.stderr
    assert not (tmp_path / "job.ngc").exists()


def posted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> Mapping[str, Any]:
    """Return the post-processor, where another one of the person's own writes a text."""
    write_addon("freecad", tmp_path)
    monkeypatch.setitem(sys.modules, "shop_post", SimpleNamespace(export=lambda *_: text))  # type: ignore[arg-type]
    return runpy.run_path(str(tmp_path / "leafcut_post.py"))


def test_the_post_processor_takes_any_other_one_and_the_options_of_leafcut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A warning of leafcut does not stop it. The text is returned and written to the file."""
    export = posted(tmp_path, monkeypatch, PROGRAM)["export"]
    file = tmp_path / "job.ngc"
    text = export([], str(file), "--base shop --machine linuxcnc-mill --preset fast")
    assert file.read_bytes().decode() == text and not list(tmp_path.glob("*.leafcut-part"))
    (tmp_path / "before.ngc").write_text(PROGRAM)
    assert leafcut.verify(tmp_path / "before.ngc", file).same


@pytest.mark.parametrize(
    "text, arguments, told",
    [
        (PROGRAM, "--base", "--base needs the name of a post-processor"),
        (PROGRAM, "--base nosuch", "--base nosuch: FreeCAD has no post-processor of that name"),
        (PROGRAM, "--base shop --machine haas-vf3", "did you mean 'haas-vf2'"),
        ("", "--base shop", "the post-processor shop wrote nothing"),
        (PROGRAM.replace("X80", "X"), "--base shop", "is a letter without a number"),
    ],
)
def test_the_post_processor_refuses_in_a_line_and_writes_nothing(
    text: str, arguments: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export = posted(tmp_path, monkeypatch, text)["export"]
    with pytest.raises(RuntimeError, match=re.escape(told)):
        export([], str(tmp_path / "job.ngc"), arguments)
    assert not (tmp_path / "job.ngc").exists()


# -- KiCad and pcb2gcode: the commands in docs/inside.md ---------------------------------------------------------------


def recipe(program: str) -> str:
    """Return leafcut's command in a recipe: the command that contains the word `program`."""
    page = (HERE.parent / "docs" / "inside.md").read_text(encoding="utf-8")
    (command,) = re.findall(rf"^    leafcut (.*\b{program}\b.*)$", page, re.MULTILINE)
    return str(command)


@pytest.fixture
def kicad_python(tmp_path: Path) -> str:
    """Return the path of the Python that has KiCad's module."""
    python = "/usr/bin/python3"  # Debian installs the module for this Python
    if called([python, "-c", "import pcbnew"], tmp_path).returncode:
        missing("KiCad's Python module", "kicad")
    return python


def test_the_drill_files_of_kicad_become_one_program(
    kicad_python: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = called([kicad_python, str(HERE / "kicad_board.py"), "."], tmp_path)
    assert done.returncode == 0, done.stderr
    monkeypatch.chdir(tmp_path)
    for kind in ("PTH", "NPTH"):
        Path(f"-{kind}.drl").rename(f"board-{kind}.drl")
    assert run([*recipe("board-NPTH.drl").split(), "--preset", "fast", "-q"]) == 0
    assert leafcut.simulate("board.ngc", machine="pcb-drill").path.extents[1][:2] == (60.0, -20.0)
    assert Path("board.ngc").read_text().count("M6") == 2


def test_a_drilling_program_of_pcb2gcode_is_reordered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drill.ngc").write_bytes((HERE / "styles" / "pcb2gcode_drill_three_bits.ngc").read_bytes())
    assert run([*recipe("drill.ngc").split(), "--preset", "fast", "-q"]) == 0
    assert leafcut.verify("drill.ngc", "faster.ngc").same
