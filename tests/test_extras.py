"""Without its extras leafcut runs, and what needs one says so in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

#: The command line where some packages are not installed, whether they are or not.
WITHOUT = """
import sys
from importlib.machinery import PathFinder
hidden = sys.argv.pop(1).split(",")
found = PathFinder.find_spec
PathFinder.find_spec = classmethod(
    lambda _, name, *more, **words: None if name.partition(".")[0] in hidden else found(name, *more, **words)
)
from leafcut.cli import run
sys.exit(run(sys.argv[1:]))
"""


def without(hidden: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Return what the command line says where the packages `hidden` are not there."""
    command = [sys.executable, "-c", WITHOUT, hidden, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)


@pytest.mark.parametrize(
    "arguments, extra, packages",
    [
        (("studio", "--no-open"), "studio", "nicegui,uvicorn,fastapi"),
        (("nest", "{examples}/bracket.dxf:3"), "nest", "spyrrow,rectpack"),
        (("nest", "{examples}/bracket.dxf:3", "--nester", "rectangles"), "nest", "spyrrow,rectpack"),
    ],
)
def test_what_needs_an_extra_that_is_not_there_says_so_in_one_line(
    arguments: tuple[str, ...], extra: str, packages: str, examples: Path
) -> None:
    """It names the package and the command that installs it."""
    done = without(packages, *(word.format(examples=examples) for word in arguments))
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert f"pip install 'leafcut[{extra}]'" in line
    assert any(f"needs the package {package}" in line for package in packages.split(","))


def test_what_needs_no_extra_runs_without_them() -> None:
    packages = "nicegui,uvicorn,fastapi,spyrrow,rectpack"
    for arguments in (("formats",), ("machines",), ("optimize", "example:plate-27", "--algorithm", "none", "--json")):
        done = without(packages, *arguments)
        assert done.returncode == 0, done.stderr


def test_an_experiment_runs_without_the_extra_that_its_report_needs(tmp_path: Path) -> None:
    """What was run is kept, whatever is installed; the report names the extra, and writes nothing."""
    results, packages = str(tmp_path / "r.sqlite"), "scipy,pandas,statsmodels,scikit_posthocs,matplotlib"
    words = ("machining_time", "--reduced", "--results", results)
    done = without(packages, "lab", "run", *words)
    assert (done.returncode, done.stderr) == (0, "")
    done = without(packages, "lab", "report", *words, "-o", str(tmp_path))
    assert done.returncode == 1
    assert "needs the package scipy: pip install 'leafcut[lab]'" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["r.sqlite"]


def test_tuning_names_the_extra_that_it_needs_before_any_run(tmp_path: Path) -> None:
    words = ("random:9:1", "random:9:2", "random:9:3", "--algorithm", "as", "--process", "solve")
    done = without("optuna", "lab", "tune", *words, "--results", str(tmp_path / "r.sqlite"), "-o", str(tmp_path))
    assert done.returncode == 1
    assert "needs the package optuna: pip install 'leafcut[lab]'" in done.stderr
    assert not list(tmp_path.glob("tune_as.*"))
