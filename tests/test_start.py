"""A start loads only the packages that its command needs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from leafcut.cli.app import run
from leafcut.processes import registry

EXAMPLES = Path(__file__).parents[1] / "examples"
HEAVY = {"ezdxf", "gerbonara", "jinja2", "numba", "numpy", "optuna", "rich", "shapely"}
#: Steps of one process, lightest first.
STEPS = f"""
import runpy
sys.argv = ["leafcut", "--version"]
try:
    runpy.run_module("leafcut", run_name="__main__")
except SystemExit:
    pass
step("version")

import leafcut
step("import")

from leafcut.cli.app import run
from leafcut.processes import registry
run(["--version"])
step("command line")

run(["--help"])
step("help")

run(["simulate", {str(EXAMPLES / "cam_121.nc")!r}])
step("simulate")

from leafcut.processes.drilling.plan.drilling import plan_drilling
leafcut.read_part("example:plate-70")
step("plan")

leafcut.read_part({str(EXAMPLES / "plate_70.dxf")!r})
step("read")
"""
RECORD = """
import json, sys
loaded = {}
def step(name):
    loaded[name] = sorted({module for name in sys.modules for module in (name, name.partition(".")[0])})
"""


@pytest.fixture(scope="module")
def process() -> tuple[str, dict[str, set[str]]]:
    """Return the output of a process, and the modules that are loaded after each of its steps."""
    code = f"{RECORD}{STEPS}print()\nprint(json.dumps(loaded))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    *output, last = done.stdout.splitlines()
    return output[0], {step: set(modules) for step, modules in json.loads(last).items()}


@pytest.mark.parametrize(
    "step, unneeded",
    [
        ("version", {"leafcut.cli.app", "cyclopts", "dataclasses"}),
        ("import", HEAVY),
        ("command line", HEAVY - {"rich"}),
        ("help", HEAVY - {"rich"}),
        ("simulate", HEAVY - {"rich", "numpy"}),
        ("plan", {"numba"}),
        ("read", {"gerbonara", "numba", *(f"leafcut.read.{name}" for name in ("excellon", "picture", "step", "svg"))}),
    ],
)
def test_a_start_loads_no_package_that_it_does_not_need(
    step: str, unneeded: set[str], process: tuple[str, dict[str, set[str]]]
) -> None:
    assert process[1][step] & unneeded == set()


def test_the_version_is_the_same_without_the_command_line(
    process: tuple[str, dict[str, set[str]]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"{process[0]}\n"


#: The module of each command's work.
PROCESS_OF = {
    "drill": "leafcut.processes.drilling.process", "cut": "leafcut.processes.sheet.process",
    "pocket": "leafcut.processes.pocket.process", "reorder": "leafcut.processes.program.process",
    "nest": "leafcut.nesting.work",
}  # fmt: skip


@pytest.mark.parametrize("command", ["drill", "nest", "reorder"])
def test_a_command_loads_its_own_process_and_result_only(command: str) -> None:
    words = [command, "missing.dxf", *(["--dry-run"] if command != "nest" else [])]
    code = f"{RECORD}from leafcut.cli.app import run\nprint(run({words!r}))\nstep('run')\nprint(json.dumps(loaded))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    status, last = done.stdout.splitlines()
    modules = set(json.loads(last)["run"])
    works = modules & set(PROCESS_OF.values())
    results = {name.rpartition(".")[2] for name in modules if name.startswith("leafcut.results.")} - {"base"}
    own = "nest" if command == "nest" else "program"
    assert (status, works, results) == ("1", {PROCESS_OF[command]}, {own})


#: Commands whose file, or an option of it, is refused.
REFUSED = (
    "drill missing.dxf", "drill notes.xyz", "drill broken.dxf --depth 3", "drill {plate}", "drill {plate} --depth x",
    "drill {plate} --depth 3 --keep-out 1,2", "cut missing.dxf", "cut broken.dxf --thickness 6", "cut {plate}",
    "pocket broken.dxf --depth 3 --tool-diameter 6", "pocket {pocket}", "pocket {pocket} --depth 3",
    "reorder missing.nc", "reorder {plate}", "reorder broken.nc", "simulate broken.nc", "stock broken.nc",
    "verify broken.nc broken.nc", "nest broken.dxf", "solve broken.tsp", "missing.dxf",
)  # fmt: skip


def test_a_refused_file_or_option_loads_no_compiled_kernels(tmp_path: Path) -> None:
    for name in ("notes.xyz", "broken.dxf", "broken.nc", "broken.tsp"):
        (tmp_path / name).write_text("G1 X(", encoding="utf-8")
    files = {"plate": EXAMPLES / "plate_8x8_10.dxf", "pocket": EXAMPLES / "pocket.dxf"}
    commands = [[word.format(**files) for word in command.split()] for command in REFUSED]
    code = (
        "import sys\nfrom leafcut.cli.app import run\n"
        f"print([(words, status) for words in {commands!r} if (status := run(words)) not in (1, 2)])\n"
        "print('numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "False"], done.stderr


def test_every_command_of_a_process_is_known_without_loading_it() -> None:
    assert [one.command for one in registry.processes()] == list(registry.process_commands())
    assert [registry.process_of_command(word) for word in registry.process_commands()] == list(registry.processes())
