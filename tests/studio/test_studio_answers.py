"""Plans and tours of a studio job equal the files of the command line."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

import pytest

from leafcut.cli import app as cli
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.run_job import JobResult, run_task
from leafcut.studio.jobs.task import ReadyTask

EXAMPLES = Path(__file__).parents[2] / "examples"
LITTLE = {"iterations": 1, "threads": 1}


def made(
    command: str, *names: str, process: str = "auto", parts: tuple[WantedPart, ...] = (), **options: Any
) -> JobResult:
    """Do what a job does with examples."""
    sources = tuple(name if ":" in name else str(EXAMPLES / name) for name in names)
    call = ReadyTask(command, sources, process, options, parts)
    return run_task(Link(lambda _: None), call, names)


@pytest.mark.parametrize(
    "command, names, more",
    [
        ("optimize", ["plate_10.dxf"], {"thickness": "6", **LITTLE}),
        ("optimize", ["bracket.dxf"], {"process": "cut", "thickness": "6", **LITTLE}),
        ("optimize", ["cam_121.nc"], LITTLE),
        ("solve", ["random:30:1"], LITTLE),
        ("simulate", ["cam_121.nc"], {}),
        ("verify", ["cam_121.nc", "cam_121.nc"], {}),
        (
            "nest",
            ["bracket.dxf", "gusset.svg"],
            {
                "parts": (WantedPart("a" * 16, 2, "0 90"), WantedPart("b" * 16, 1)),
                "sheet": "600x400",
                "nester": "rectangles",
            },
        ),
    ],
)
def test_a_run_needs_no_place_for_temporary_files(
    command: str, names: list[str], more: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/there/is/no/such/folder")
    assert made(command, *names, **more).answer


def test_the_plan_of_a_sheet_is_the_file_that_the_command_line_saves(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "bracket.dxf", tmp_path / "bracket.dxf")
    file, words = tmp_path / "plan.json", ["--thickness", "6", "--iterations", "1", "--threads", "1", "-q"]
    assert cli.run(["cut", str(tmp_path / "bracket.dxf"), "--save-plan", str(file), *words]) == 0
    ours = made("optimize", "bracket.dxf", process="cut", thickness="6", **LITTLE).artefacts["plan"]
    assert ours.data == file.read_bytes()
    assert ours.file_name == "bracket_plan.json"


def test_common_lines_and_other_work_have_no_plan() -> None:
    assert "plan" not in made("optimize", "plate_10.dxf", thickness="6", **LITTLE).artefacts
    common = made("optimize", "bracket.dxf", process="cut", thickness="6", common_lines=True, **LITTLE)
    assert "plan" not in common.artefacts


def test_the_tour_of_a_map_is_the_file_that_the_command_line_writes(tmp_path: Path) -> None:
    file = tmp_path / "a.tour"
    assert cli.run(["solve", "random:30:1", "--tour", str(file), "--iterations", "1", "--threads", "1"]) == 0
    assert made("solve", "random:30:1", **LITTLE).artefacts["tour"].data == file.read_bytes()
