"""Without its extras leafcut runs, and a command that needs an extra names it in one line."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

#: Runs command lines (a JSON list) in a process that cannot import some packages; the last line is their statuses.
WITHOUT = """
import json
import sys
from importlib.machinery import PathFinder
hidden = sys.argv[1].split(",")
found = PathFinder.find_spec
PathFinder.find_spec = classmethod(
    lambda _, name, *more, **words: None if name.partition(".")[0] in hidden else found(name, *more, **words)
)
from leafcut.cli.app import run
print("\\n", [run(words) for words in json.loads(sys.argv[2])], sep="")
"""


def without(hidden: str, *commands: Sequence[str]) -> tuple[list[int], str, str]:
    """Run command lines without the packages `hidden`; return their exit statuses, output and errors."""
    command = [sys.executable, "-c", WITHOUT, hidden, json.dumps(commands)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    output, _, statuses = done.stdout.rstrip().rpartition("\n")
    return json.loads(statuses), output, done.stderr


def test_commands_name_their_missing_extras_in_one_line_each(examples: Path, tmp_path: Path) -> None:
    """The line names the package and the command that installs it."""
    bracket = f"{examples}/bracket.dxf:3"
    tuned = ("random:9:1", "random:9:2", "random:9:3", "--algorithm", "as", "--process", "solve")
    statuses, _, errors = without(
        "nicegui,uvicorn,fastapi,spyrrow,rectpack,optuna",
        ["studio", "--no-open"],
        ["nest", bracket],
        ["nest", bracket, "--nester", "rectangles"],
        ["lab", "tune", *tuned, "--results", str(tmp_path / "r.sqlite"), "-o", str(tmp_path)],
    )
    assert statuses == [1, 1, 1, 1]
    expected = [("nicegui|uvicorn|fastapi", "studio"), ("spyrrow", "nest"), ("rectpack", "nest"), ("optuna", "lab")]
    for line, (package, extra) in zip(errors.splitlines(), expected, strict=True):
        assert re.search(rf"needs the package ({package}): pip install 'leafcut\[{extra}\]'", line)
    assert not list(tmp_path.glob("tune_as.*")), "tuning stops before its first run"


def test_commands_without_extras_run_without_their_packages() -> None:
    packages = "nicegui,uvicorn,fastapi,spyrrow,rectpack"
    commands = (
        ["list", "formats"],
        ["list", "machines"],
        ["optimize", "example:plate-27", "--depth", "3", "--algorithm", "none", "--json", "--dry-run"],
    )
    statuses, output, errors = without(packages, *commands)
    assert statuses == [0, 0, 0], errors
    assert '"verified": true' in output


@pytest.mark.slow
def test_an_experiment_runs_without_the_extra_of_its_report(tmp_path: Path) -> None:
    """The runs are kept; the report names the extra and writes nothing."""
    results, packages = str(tmp_path / "r.sqlite"), "scipy,pandas,statsmodels,scikit_posthocs,matplotlib"
    words = ("machining_time", "--reduced", "--results", results)
    statuses, _, errors = without(packages, ["lab", "run", *words], ["lab", "report", *words, "-o", str(tmp_path)])
    assert statuses == [0, 1]
    (line,) = errors.splitlines()
    assert "needs the package scipy: pip install 'leafcut[lab]'" in line
    assert [file.name for file in tmp_path.iterdir()] == ["r.sqlite"]
