"""Without its extras leafcut runs, and a command that needs an extra names it in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

#: Runs command lines (a JSON list) in a process that cannot import some packages, until one fails.
WITHOUT = """
import json
import sys
from importlib.machinery import PathFinder
hidden = sys.argv[1].split(",")
found = PathFinder.find_spec
PathFinder.find_spec = classmethod(
    lambda _, name, *more, **words: None if name.partition(".")[0] in hidden else found(name, *more, **words)
)
from leafcut.cli import run
sys.exit(next((status for words in json.loads(sys.argv[2]) if (status := run(words))), 0))
"""


def without(hidden: str, *commands: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run command lines without the packages `hidden`."""
    command = [sys.executable, "-c", WITHOUT, hidden, json.dumps(commands)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)


@pytest.mark.parametrize(
    "arguments, extra, packages",
    [
        (("studio", "--no-open"), "studio", "nicegui,uvicorn,fastapi"),
        (("nest", "{examples}/bracket.dxf:3"), "nest", "spyrrow,rectpack"),
        pytest.param(
            ("nest", "{examples}/bracket.dxf:3", "--nester", "rectangles"),
            "nest",
            "spyrrow,rectpack",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_command_names_its_missing_extra_in_one_line(
    arguments: tuple[str, ...], extra: str, packages: str, examples: Path
) -> None:
    """The line names the package and the command that installs it."""
    done = without(packages, [word.format(examples=examples) for word in arguments])
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert f"pip install 'leafcut[{extra}]'" in line
    assert any(f"needs the package {package}" in line for package in packages.split(","))


def test_commands_without_extras_run_without_their_packages() -> None:
    packages = "nicegui,uvicorn,fastapi,spyrrow,rectpack"
    commands = ["formats"], ["machines"], ["optimize", "example:plate-27", "--algorithm", "none", "--json"]
    done = without(packages, *commands)
    assert done.returncode == 0, done.stderr
    assert '"verified": true' in done.stdout


@pytest.mark.slow
def test_an_experiment_runs_without_the_extra_of_its_report(tmp_path: Path) -> None:
    """The runs are kept; the report names the extra and writes nothing."""
    results, packages = str(tmp_path / "r.sqlite"), "scipy,pandas,statsmodels,scikit_posthocs,matplotlib"
    words = ("machining_time", "--reduced", "--results", results)
    done = without(packages, ["lab", "run", *words])
    assert (done.returncode, done.stderr) == (0, "")
    done = without(packages, ["lab", "report", *words, "-o", str(tmp_path)])
    assert done.returncode == 1
    assert "needs the package scipy: pip install 'leafcut[lab]'" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["r.sqlite"]


def test_tuning_names_its_extra_before_any_run(tmp_path: Path) -> None:
    words = ("random:9:1", "random:9:2", "random:9:3", "--algorithm", "as", "--process", "solve")
    done = without("optuna", ["lab", "tune", *words, "--results", str(tmp_path / "r.sqlite"), "-o", str(tmp_path)])
    assert done.returncode == 1
    assert "needs the package optuna: pip install 'leafcut[lab]'" in done.stderr
    assert not list(tmp_path.glob("tune_as.*"))
