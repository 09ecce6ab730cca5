"""The user's files: shop defaults, shown hints, and completion; always optional, never read by tests."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.files import user_files
from leafcut.processes.settings import collect_settings

PLATE = "example:plate-10"
FAST = ["--preset", "fast", "--threads", "1"]


@pytest.fixture
def defaults(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of defaults of a person with a home of their own."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv(user_files.DEFAULTS_VARIABLE, raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config" / "leafcut").mkdir(parents=True)
    return tmp_path / "config" / "leafcut" / "defaults.toml"


def said(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> tuple[str, str]:
    assert run(words) == status
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_the_tests_read_nobodys_own_defaults() -> None:
    assert user_files.defaults_file() is None


def test_what_is_typed_goes_before_an_options_file_and_that_before_the_defaults(
    defaults: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Options that the run does not use are neither errors nor mentioned; the header suffices to regenerate the
    program.
    """
    defaults.write_text(
        'machine = "haas-vf2"\nthickness = 8\nmaterial = "steel"\n[drill]\npeck = 1.5\nretract_height = 3\n'
    )
    (tmp_path / "job.toml").write_text("peck = 2.5\n")
    words = ["optimize", PLATE, "--options", "job.toml", "--thickness", "5", *FAST]
    found = json.loads(said(capsys, *words, "-o", "out.nc", "--json")[0])
    assert found["defaults"] == ["--machine haas-vf2", "--retract-height 3mm"]
    same = leafcut.optimize(
        PLATE, machine="haas-vf2", retract_height=3, peck=2.5, thickness=5, preset="fast", threads=1
    )
    assert (tmp_path / "out.nc").read_text() == same.text
    for flag in ("--retract-height 3mm", "--peck 2.5mm", "--thickness 5mm", "machine: haas-vf2"):
        assert flag in same.text
    text, _ = said(capsys, *words)
    (line,) = [line for line in text.splitlines() if line.startswith("defaults")]
    assert line.split(maxsplit=1)[1].strip() == "--machine haas-vf2, --retract-height 3mm"


def test_defaults_are_left_out_when_asked_for_and_by_the_library(
    defaults: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    defaults.write_text('machine = "haas-vf2"\n')
    found = json.loads(said(capsys, "optimize", PLATE, "--no-defaults", "--depth", "3", "--json", *FAST)[0])
    assert found["machine"] == "linuxcnc-mill" and "defaults" not in found
    assert leafcut.optimize(PLATE, depth=3, preset="fast").machine.name == "linuxcnc-mill"


def test_simulate_verify_and_nest_take_the_defaults_that_they_use(
    defaults: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, examples: Path
) -> None:
    program = str(examples / "cam_121.nc")
    defaults.write_text('machine = "haas-vf2"\nkerf = 1.5\nsheet = "300x200"\npeck = 2\n')
    assert "from your defaults file: --machine haas-vf2\n" in said(capsys, "simulate", program)[0]
    found = json.loads(said(capsys, "verify", program, program, "--json")[0])
    assert found["defaults"] == ["--machine haas-vf2"]
    words = ["nest", str(examples / "bracket.dxf"), "--nester", "rectangles", "--dry-run", *FAST]
    text, _ = said(capsys, *words, "--machine", "plasma-table")
    assert "of your defaults: --kerf 1.5mm, --sheet 300x200" in " ".join(text.split())
    assert "not written" in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = 4\n\n# mine\nthicknes = 3\n", r"defaults\.toml:4: unknown option 'thicknes'; did you mean 'thickness"),
        ("[solve]\nseed = 4\n[drill]\npeck = 2\ndeth = 3\n", r"defaults\.toml:5: unknown option 'deth' in \[drill\]"),
        ("[solve]\nseed = 4\n\n[dril]\npeck = 2\n", r"defaults\.toml:4: unknown table \[dril\]"),
        ("drill.peck = 1\ndrill.deth = 3\n", r"defaults\.toml:2: unknown option 'deth' in \[drill\]"),
        ("[drill]\nvariants = 1\npeck = -2\n", r"defaults\.toml:2: unknown option 'variants' in \[drill\]"),
        ("seed = 1\npeck = -2 # mm\n", r"defaults\.toml:2: --peck: -2 mm is below the minimum of"),
        ("seed = = 1\n", r"defaults\.toml: not a TOML file .*line 1"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_the_defaults_is_told_with_file_and_line(
    text: str, words: str, defaults: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    defaults.write_text(text)
    _, err = said(capsys, "optimize", PLATE, status=2)
    assert err.count("\n") == 1
    with pytest.raises(OptionError, match=words):
        collect_settings({}, None, defaults)


def test_files_that_the_defaults_name_are_sought_from_where_they_lie(defaults: Path) -> None:
    """A whole path and one from the home stay what they are."""
    defaults.write_text('tools = "shop/tools.toml"\nmachine = "mill.toml"\nchart = "/data/chart.csv"\n')
    settings = collect_settings({}, None, defaults)
    assert settings.job.tools == defaults.parent / "shop" / "tools.toml"
    assert settings.machine.machine == str(defaults.parent / "mill.toml")
    assert settings.cut_data.chart == Path("/data/chart.csv")
    defaults.write_text('machine = "haas-vf2"\n')
    assert collect_settings({}, None, defaults).machine.machine == "haas-vf2"


def test_a_refusal_tells_that_nobody_typed_the_option_that_it_names(
    defaults: Path, capsys: pytest.CaptureFixture[str], examples: Path
) -> None:
    """A mill of the defaults does not cut sheets."""
    defaults.write_text('machine = "haas-vf2"\n')
    words = ["optimize", str(examples / "sheet.dxf"), "--process", "cut", "--thickness", "6"]
    _, err = said(capsys, *words, status=2)
    assert err.endswith("; --machine may come from your defaults file; --no-defaults ignores it\n")
    assert "defaults" not in said(capsys, *words, "--machine", "haas-vf2", status=2)[1]


def test_the_variable_names_another_file_or_none(
    defaults: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    defaults.write_text("seed = 4\n")
    assert user_files.defaults_file() == defaults
    monkeypatch.setenv("LEAFCUT_DEFAULTS", "")
    assert user_files.defaults_file() is None
    monkeypatch.setenv("LEAFCUT_DEFAULTS", str(tmp_path / "mine.toml"))
    with pytest.raises(OptionError, match=r"mine\.toml: file not found; LEAFCUT_DEFAULTS names it"):
        user_files.defaults_file()
    (tmp_path / "mine.toml").write_text("seed = 5\n")
    assert user_files.defaults_file() == tmp_path / "mine.toml"


def test_without_a_home_or_where_nothing_may_be_written_all_runs_as_without_the_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A service has no home; a folder of the wrong kind, or one that is read-only, is as good as none."""
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "LEAFCUT_DEFAULTS", "APPDATA", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)

    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert user_files.defaults_file() is None
    assert user_files.record_first_showing("L403 mill") and user_files.record_first_showing("L403 mill")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert user_files.record_first_showing("L403 mill") and user_files.record_first_showing("L403 mill")


def test_where_the_part_lies_is_asked_once_for_each_machine_and_always_in_json_and_reports(
    defaults: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """A damaged record is started again."""
    words = ["optimize", PLATE, "--thickness", "5", *FAST]
    assert "L403" in said(capsys, *words)[0]
    assert "L403" not in said(capsys, *words, "--report", "page.html")[0]
    assert "L403" in (tmp_path / "page.html").read_text()
    assert "L403" in [issue["code"] for issue in json.loads(said(capsys, *words, "--json")[0])["issues"]]
    assert "L403" in said(capsys, *words, "--machine", "haas-vf2")[0]
    assert "L403" not in said(capsys, *words, "--machine", "haas-vf2")[0]
    memory = tmp_path / "state" / "leafcut" / "hints.json"
    assert json.loads(memory.read_text()) == ["L403 linuxcnc-mill", "L403 haas-vf2"]
    memory.write_text("[" * 100_000)
    assert "L403" in said(capsys, *words)[0]
    assert "L403" not in said(capsys, *words)[0]


def test_a_dry_run_says_that_nothing_was_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And one with it, where the program is."""
    monkeypatch.chdir(tmp_path)
    words = ["optimize", PLATE, "--thickness", "5", *FAST]
    assert "not written" in said(capsys, *words, "--dry-run")[0]
    assert not list(tmp_path.iterdir())
    text, _ = said(capsys, *words, "-o", "plate.nc")
    assert "not written" not in text
    (line,) = [line for line in text.splitlines() if line.startswith("program")]
    assert line.split() == ["program", "plate.nc"]


def test_completion_of_bash_is_installed_and_read(bash: str, tmp_path: Path) -> None:
    """In a home of its own; bash then knows the commands and the flags."""
    environment = {**os.environ, "HOME": str(tmp_path), "SHELL": bash}
    command = [sys.executable, "-m", "leafcut", "install", "completion", "bash"]
    subprocess.run(command, env=environment, capture_output=True, check=True)
    asked = (
        "source ~/.bashrc; complete -p leafcut; COMP_WORDS=(leafcut sim); COMP_CWORD=1; _leafcut; echo ${COMPREPLY[@]}"
    )
    done = subprocess.run([bash, "--norc", "-c", asked], env=environment, capture_output=True, text=True, check=True)
    assert "-F _leafcut leafcut" in done.stdout and done.stdout.split()[-1] == "simulate"
