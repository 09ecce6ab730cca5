"""Defaults of a shop with their origin, and completion by the shells themselves."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from leafcut.cli.app import run
from leafcut.cli.defaults import TEMPLATE
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings
from outside_programs import program_path


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a file of defaults in the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LEAFCUT_DEFAULTS", "mine.toml")
    text = '# my shop\nmachine = "haas-vf2"\n\n[drill]\nthickness = 6\npeck = "0.1in"\nheader = false\n'
    Path("mine.toml").write_text(text.replace("header", "strict"))
    return Path("mine.toml")


def said(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> str:
    assert run(words) == status
    captured = capsys.readouterr()
    return captured.err if status else captured.out


def rows(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, tuple[str, str]]:
    found = json.loads(said(capsys, "defaults", *words, "--json"))
    return {row["option"]: (row["value"], row["source"]) for row in found["options"]}


def test_each_option_that_the_defaults_say_is_told_with_its_line(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert rows(capsys) == {
        "--machine": ("haas-vf2", "mine.toml:2"),
        "--thickness": ("6mm", "mine.toml:5"),
        "--peck": ("2.54mm", "mine.toml:6"),
        "--strict": ("off", "mine.toml:7"),
    }
    lines = said(capsys, "defaults").splitlines()
    assert lines[0] == "your defaults file: mine.toml"
    peck = next(line for line in lines if line.startswith("--peck"))
    assert peck.split(maxsplit=3)[3] == "used by drill, cutting-data"


def test_all_options_of_a_command_are_told_with_where_each_comes_from(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of options goes before the defaults, and both before leafcut."""
    Path("job.toml").write_text("peck = 3\nseed = 4\n")
    found = rows(capsys, "drill", "--options", "job.toml")
    assert found.keys() == {f"--{name.replace('_', '-')}" for name in registry.process("drill").used()}
    assert found["--peck"] == ("3mm", "job.toml:1") and found["--seed"] == ("4", "job.toml:2")
    assert found["--machine"] == ("haas-vf2", "mine.toml:2")
    assert found["--clearance-height"] == ("10mm", "leafcut")
    assert found["--tools"] == ("one assumed drill per diameter", "leafcut")
    assert list(found)[:4] != list(found)[-4:] and "mine.toml" in found[next(iter(found))][1]
    mine.write_text("")
    assert rows(capsys, "cut")["--machine"] == ("plasma-table", "leafcut, for cutting a sheet")


def test_without_a_file_it_is_told_where_one_would_be(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The template saved there has no effect until a line is enabled; with all lines enabled, all apply."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("APPDATA", str(tmp_path))
    monkeypatch.delenv("LEAFCUT_DEFAULTS", raising=False)
    file = tmp_path / "leafcut" / "defaults.toml"
    assert f"save as {file}" in said(capsys, "defaults")
    file.parent.mkdir()
    file.write_text(said(capsys, "defaults", "--template"))
    assert said(capsys, "defaults") == f"your defaults file: {file}\n"
    wanted = [
        line.removeprefix("# ")
        for line in TEMPLATE.splitlines()
        if line.startswith("# ") and ("=" in line or line.startswith("# ["))
    ]
    file.write_text("\n".join(wanted))
    assert len(collect_settings({}, None, file).defaults) == sum("=" in line for line in wanted) > 8


@pytest.mark.parametrize(
    "words, told",
    [
        ("dril", "unknown command 'dril'; did you mean 'drill'?"),
        ("optimize", "optimize does several kinds of work; name one of drill"),
        ("send", "send takes nothing from your defaults; leafcut send --help lists its options"),
        ("auto", "unknown command 'auto'"),
        ("--options nosuch", "--options nosuch: file not found"),
        ("--options wrong.toml", "wrong.toml:2: unknown option 'thicknes'; did you mean 'thickness'"),
        ("drill --template", "--template prints a new file; leave out the other options"),
    ],
)
def test_what_cannot_be_told_is_refused_in_a_line(
    words: str, told: str, mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("wrong.toml").write_text("seed = 1\nthicknes = 3\n")
    err = said(capsys, "defaults", *words.split(), status=2)
    assert told in err and err.count("\n") == 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a drawing, a tool library, and the scripts of the shells."""
    made = tmp_path_factory.mktemp("shell")
    for name in ("plate.dxf", "tools.toml"):
        (made / name).write_text("")
    return made


@pytest.fixture
def script(folder: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Path]:
    """Return the script of each shell."""
    found = {shell: folder / f"_{shell}" for shell in ("bash", "zsh", "fish")}
    for shell, file in found.items():
        if not file.exists():
            file.write_text(said(capsys, "install", "completion", shell, "--print"))
    return found


#: Typed text up to the request for completion, and the completions.
TYPED = [
    ("leafcut dri", "drill"),
    ("leafcut drill --machine ha", "haas-vf2"),
    ("leafcut drill --clearance-h", "--clearance-height"),
    ("leafcut drill pl", "plate.dxf"),
    ("leafcut drill plate.dxf --tools to", "tools.toml"),
    ("leafcut drill plate.dxf --cycle G8", "G81 G82 G83 G84 G85"),
    ("leafcut machine im", "import"),
    ("leafcut install completion fi", "fish"),
]


@pytest.fixture
def fish() -> str:
    """Return the path of the shell fish."""
    return program_path("fish", "fish")


@pytest.fixture
def zsh() -> str:
    """Return the path of the shell zsh."""
    return program_path("zsh", "zsh")


def test_bash_completes_commands_options_choices_and_files(bash: str, folder: Path, script: dict[str, Path]) -> None:
    asked = "\n".join(
        f"COMP_WORDS=({words}); COMP_CWORD={len(words.split()) - 1}; COMPREPLY=(); _leafcut; echo ${{COMPREPLY[@]}}"
        for words, _ in TYPED
    )
    text = f"source {script['bash']}\ncomplete -p leafcut\n{asked}\n"
    command = [bash, "--norc", "-c", text]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
    registered, *lines = done.stdout.splitlines()
    assert registered == "complete -o default -F _leafcut leafcut"
    assert [" ".join(sorted(line.split())) for line in lines] == [found for _, found in TYPED]


def test_fish_completes_commands_options_choices_and_files(fish: str, folder: Path, script: dict[str, Path]) -> None:
    asked = "\n".join(f"echo (complete -C '{words}' | string split -f 1 \\t)" for words, _ in TYPED)
    command = [fish, "--no-config", "-c", f"source {script['fish']}\n{asked}\n"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
    assert [" ".join(sorted(line.split())) for line in done.stdout.splitlines()] == [found for _, found in TYPED]


#: Typed text for a zsh of its own, and the completions after Tab; the test waits for answers, not for time.
_ZSH = """
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell "cd {folder}; {setup}; print REA''DY"
zpty -r shell told '*READY*'
zpty -w -n shell $'leafcut drill --machine ha\\t'
zpty -r shell told '*as-vf2*' && print option
zpty -w -n shell $'pl\\t'
zpty -r shell told '*ate.dxf*' && print file
zpty -d shell
"""


@pytest.mark.parametrize(
    "setup",
    [
        "fpath=({folder} $fpath); autoload -U compinit; compinit -u -D",
        "autoload -U compinit; compinit -u -D; source {folder}/_zsh",
    ],
    ids=["of-fpath", "sourced"],
)
def test_zsh_completes_choices_and_files(setup: str, zsh: str, folder: Path, script: dict[str, Path]) -> None:
    """As a file of its path of functions, and read by a start file."""
    (folder / "_leafcut").write_text(script["zsh"].read_text())
    text = _ZSH.replace("{setup}", setup.replace("$", "\\$")).replace("{folder}", str(folder))
    done = subprocess.run([zsh, "-f", "-c", text], capture_output=True, text=True, check=True, timeout=240)
    assert done.stdout.split() == ["option", "file"], done.stderr


def test_a_shell_that_is_not_known_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, "install", "completion", "bsh", status=2).endswith(
        "unknown shell 'bsh'; did you mean 'bash'?\n"
    )
    assert "completion needs SHELL" in said(capsys, "install", "completion", status=2)
